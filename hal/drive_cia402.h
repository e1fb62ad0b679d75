/* hal/drive_cia402.h - a CiA 402 servo in cyclic synchronous position mode.
 *
 * Start-up (see drive_cia402.c for the picture): probe 0x1000, check 0x6502 for
 * CSP, pre-operational, heartbeat both ways and what the drive does when ours
 * stops (0x1016, 0x6007 = 3), limits, PDO map with reading back, mode 8,
 * preload 0x607A = 0x6064, NMT start, first TPDO -> HAL_DRIVE_OFF.
 * Enable: 0x06, 0x07, preload again, 0x0F, one state at a time.
 *
 * RPDO1 = 0x6040 u16, 0x607A i32;  TPDO1 = 0x6041 u16, 0x6064 i32; both on
 * every SYNC.  Source: CiA 402-2 (IEC 61800-7-201) 6.5, 8; CiA 301 7.2-7.5. */
#ifndef HAL_DRIVE_CIA402_H
#define HAL_DRIVE_CIA402_H

#include "hal/canopen.h"
#include "hal/drive.h"

/* Power state, decoded from the statusword. */
enum cia402_state {
    CIA402_NOT_READY,
    CIA402_SWITCH_ON_DISABLED,
    CIA402_READY,
    CIA402_SWITCHED_ON,
    CIA402_OPERATION_ENABLED,
    CIA402_QUICK_STOP_ACTIVE,
    CIA402_FAULT_REACTION,
    CIA402_FAULT,
    CIA402_UNKNOWN,
};
enum cia402_state cia402_state_of(uint16_t statusword);
const char *cia402_state_text(enum cia402_state state);

struct drive_cia402_config {
    uint8_t node_id;
    /* one unit = counts_num / counts_den counts; num != 0 (negative: reversed),
     * den > 0 */
    int64_t counts_num, counts_den;
    int64_t sync_period_ns;
    int64_t heartbeat_period_ns; /* the drive's; lost after three */
    int64_t watchdog_ns; /* drive stops when ours is not heard, <= 100 ms */
    int64_t state_timeout_ns;        /* per step of the state machine; 0: 1 s */
    uint32_t following_error_counts; /* 0x6065; 0: leave the drive's own */
    uint32_t quick_stop_counts_s2;   /* 0x6085; 0: leave */
    int64_t first_step_max_q32;      /* refuse to enable when target and actual
                                      are further apart; 0: 1 unit */
};

/* Visible so that it can be static; use the functions. */
struct drive_cia402 {
    struct hal_drive drive;
    struct canopen_node node;
    struct drive_cia402_config config;
    enum hal_drive_request request;
    enum hal_drive_state state;
    int phase; /* step of the start-up or of the enable walk */
    int64_t phase_since_ns;
    int64_t to_counts;   /* counts = pos_q32 * to_counts >> to_shift */
    int64_t from_counts; /* pos_q32 = counts * from_counts >> from_shift */
    uint8_t to_shift, from_shift;
    uint16_t controlword, statusword;
    int32_t target_counts, actual_counts;
    int64_t actual_ns; /* SYNC that latched actual */
    int64_t actual_vel_q32;
    int64_t given_ns[3]; /* when the last targets were given, newest first */
    bool target_valid;
    uint16_t fault_code;
    char fault_text[64];
};

/* Adds the node to the master.  Errors as canopen_add, and MOTION_E_ARG for a
 * scale of zero or one that does not fit.  Returns the drive through
 * &self->drive. */
int drive_cia402_init(struct drive_cia402 *self, struct canopen *master,
                      const struct drive_cia402_config *config);

#endif
