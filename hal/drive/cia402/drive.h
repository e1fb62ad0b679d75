/* hal/drive/cia402/drive.h - a CiA 402 servo: cyclic synchronous position by
 * default, and what else it has: interpolated position, cyclic velocity,
 * profile position and velocity, homing, touch probe.
 *
 * Start-up (see start.c for the list): probe 0x1000, check 0x6502 for CSP,
 * pre-operational, heartbeat both ways and what the drive does when ours stops
 * (0x1016, 0x6007 = 3), that a quick stop brakes and ends without torque
 * (0x605A), SYNC period, limits, PDO map, all with reading back, mode 8,
 * preload 0x607A = 0x6064, NMT start, first TPDO
 * -> HAL_DRIVE_OFF.
 * Enable: 0x06, 0x07, preload again, 0x0F, one state at a time.
 * Off (request OFF): one that moves is quick-stopped (0x605A), and its torque
 * goes when it stands by 0x6064, HAL_DRIVE_STOP_NS later at the latest.  So is one
 * that the search finds with its stage on, before anything else is written;
 * TORQUE_OFF disables the voltage at once.
 *
 * RPDO1 = 0x6040 u16, 0x607A i32;  TPDO1 = 0x6041 u16, 0x6064 i32; both on
 * every SYNC.  TPDO2 = 0x60FD u32, sent by the drive when a switch changes, if
 * it can (it must where its switches are relied on).  With torque RPDO1 also
 * has 0x60B2 i16 and TPDO1 0x6077 i16, where the drive has them.  RPDO2 =
 * 0x60FF i32, while a velocity is streamed.  All else (another mode, a profile,
 * homing, the probe) goes by SDO.  Source: CiA 402-2 (IEC 61800-7-201) 6.5, 8;
 * CiA 301 7.2-7.5.
 *
 * A device of several axes (CiA 402-2 annex, CiA 301 7.5.2.1) is a drive for
 * each: axis n, from 0, has its objects at 0x6000 + n * 0x800 and its PDOs from
 * number 1 + n * 64 on.  What belongs to the node is set by the first of them;
 * none starts the node before all are configured, and one that starts anew
 * takes the others with it.  Emergencies name no axis: 0x603F does.
 *
 * Which set point is in force when (ticks k, one SYNC each):
 *
 *   tick   k            k+1          k+2          k+3
 *          set_target   SYNC         SYNC         begin reads the TPDO of
 *          RPDO in end  latches it   has it       SYNC k+2: actual and t_ns
 *                       |--ramp to it-|
 *
 * The drive goes from the previous target to the one latched within one
 * period, so at the instant of SYNC k+2 the set point given at tick k is just
 * reached: it is the one in force at t_ns = time of SYNC k+2, and
 * demand_age_ns = t_ns - (time of tick k), two periods on a steady clock.
 * Both are counted from SYNCs and RPDOs really sent, so a tick that was lost
 * or a target that was not renewed gives its true, larger age.  The following
 * error is that set point minus the actual position. */
#ifndef HAL_DRIVE_CIA402_DRIVE_H
#define HAL_DRIVE_CIA402_DRIVE_H

#include "hal/canopen/canopen.h"
#include "hal/drive.h"
#include "hal/readings.h"
#include "hal/support/ratio.h"
#include "hal/support/standstill.h"

MOTION_C_BEGIN

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

/* An object that is written when the drive starts, and read back. */
struct drive_cia402_parameter {
    uint16_t index;
    uint8_t sub, size; /* 1..4 bytes */
    uint32_t value;
};

/* How STREAM_POSITION goes out. */
enum drive_cia402_stream {
    DRIVE_CIA402_CSP, /* mode 8 */
    DRIVE_CIA402_IP,  /* mode 7: 0x60C1:1 in the place of 0x607A */
    DRIVE_CIA402_CSV, /* mode 9: the loop around the position is closed here */
};

/* Option codes: 0x605A plus this. */
enum drive_cia402_option {
    DRIVE_CIA402_QUICK_STOP,
    DRIVE_CIA402_SHUTDOWN,
    DRIVE_CIA402_DISABLE,
    DRIVE_CIA402_HALT,
    DRIVE_CIA402_FAULT,
    DRIVE_CIA402_OPTIONS, /* how many */
};

struct drive_cia402_option_code {
    bool given; /* else: leave */
    int8_t value;
};

#define DRIVE_CIA402_QUIRK_PRODUCTS   8
#define DRIVE_CIA402_QUIRK_PARAMETERS 16
#define DRIVE_CIA402_QUIRK_FIXED      2

/* What a maker does otherwise than the profile, in the place of what the config
 * leaves open (docs/QUIRKS.md). */
struct drive_cia402_quirk {
    uint32_t vendor;        /* 0x1018:1; 0: it is never found by itself */
    uint32_t vendor_ignore; /* bits that differ from drive to drive */
    uint32_t product[DRIVE_CIA402_QUIRK_PRODUCTS]; /* 0x1018:2 */
    unsigned product_count; /* 0: all that the vendor has */
    int64_t sdo_timeout_ns, state_timeout_ns, brake_timeout_ns,
        precharge_timeout_ns; /* 0: leave */
    bool interpolates;        /* IP, not CSP */
    bool guarding; /* no heartbeats: asked twice in the watchdog's time */
    bool homing_without_bit_10; /* standstill is seen in 0x6064 instead */
    struct drive_cia402_option_code option[DRIVE_CIA402_OPTIONS];
    /* written at start-up, before those of the config, and read back */
    struct drive_cia402_parameter parameter[DRIVE_CIA402_QUIRK_PARAMETERS];
    unsigned parameter_count;
    /* never written: they must be as said here */
    struct drive_cia402_parameter fixed[DRIVE_CIA402_QUIRK_FIXED];
    unsigned fixed_count;
};

#define DRIVE_CIA402_AXES 8

/* Which of the device's PDOs are this axis's; 0: as they are by its number. */
struct drive_cia402_pdos {
    /* COB-IDs of the first two each way; 0: the predefined ones, or, of another
     * axis than the first, those that the drive has, valid and free */
    uint16_t rpdo_id[CANOPEN_OWN_PDOS], tpdo_id[CANOPEN_OWN_PDOS];
    uint16_t number; /* of its first, 1 .. 509; 0: 1 + 64 per axis before it */
};

struct drive_cia402_config {
    uint8_t node_id;
    uint8_t axis; /* of the node, 0 .. 7: its objects are 0x800 further each */
    struct drive_cia402_pdos pdo;
    /* one unit = counts_num / counts_den counts; num != 0 (negative: reversed),
     * den > 0; one count is 2^-32 .. 2^30 units and one count per SYNC period
     * at most 2^26 unit/s, else MOTION_E_RANGE */
    int64_t counts_num, counts_den;
    int64_t sync_period_ns;      /* the master's; 0x60C2 must be able to say it:
                               1..255 times 1, 10, 100 us, 1, 10 or 100 ms */
    int64_t heartbeat_period_ns; /* the drive's, whole ms up to 20 s; lost
                                    after three; 0: 20 ms */
    int64_t watchdog_ns;    /* drive stops when ours is not heard; whole ms, at
                            least twice our heartbeat period, at most 100 ms;
                            0: 50 ms */
    int64_t sdo_timeout_ns; /* per answer, three tries; 0: the master's */
    int64_t state_timeout_ns;     /* per step of the state machine, and of NMT;
                                     0: 1 s */
    int64_t brake_timeout_ns;     /* of the step that opens a brake; 0: 3 s */
    int64_t precharge_timeout_ns; /* until there is power; 0: 3 s */
    uint32_t following_error_counts; /* 0x6065; 0: leave the drive's own */
    uint16_t following_error_ms;     /* 0x6066; 0: leave */
    uint32_t quick_stop_counts_s2;   /* 0x6085; 0: leave */
    int64_t first_step_max_q32;      /* refuse to enable when target and actual
                                      are further apart; 0: 1 unit */
    int64_t
        vel_max_q32; /* unit/s of the axis: a thousandth of it is standing; 0:
                            by its counts alone */
    enum drive_cia402_stream stream;
    bool stream_given; /* CSP, also where quirks say IP */
    int64_t gain_q16;  /* CSV: speed per following error, 1/s, > 0 */
    bool velocity;     /* STREAM_VELOCITY too */
    bool torque;       /* feed-forward and actual torque, where it has them */
    /* its units of velocity per count/s, of acceleration per count/s2; num and
     * den > 0; 0: 1 */
    int64_t vel_num, vel_den, acc_num, acc_den;
    /* of the axis in one revolution of the drive's shaft, signless: its factor
     * group (0x608F, 0x6091, 0x6092) must say the same; 0: not checked */
    int64_t travel_q32;
    /* Runs without 0x1016, 0x6007 or 0x6066 where the drive has none, or not as
     * it should be: something else takes its torque off when we are silent */
    bool unsupervised;
    uint32_t modes_also; /* bits of 0x6502 that it has and does not tell */
    /* software limits, 0x607D, where the drive has them; as wide as it takes
     * while the axis stands outside them; both 0: leave */
    int64_t pos_min_q32, pos_max_q32;
    bool limits_when_homed; /* not before its own homing is done */
    bool inputs; /* its switches are relied on: 0x60FD in TPDO2, or refused */
    struct drive_cia402_option_code option[DRIVE_CIA402_OPTIONS];
    /* 1 << enum hal_reading: those that are read, see readings.c.  A temperature
     * is in this object, as it is in the device, and signed: so many thousandths
     * of a degC each, != 0 */
    unsigned readings;
    struct {
        uint16_t index;
        uint8_t sub;
        int32_t milli;
    } temperature;
    /* What a node that does not answer is told once in a search, after it was to
     * enter pre-operational: CANOPEN_NMT_RESET_NODE, _RESET_COMMUNICATION; 0:
     * nothing */
    enum canopen_nmt_command nmt_reset;
    /* Node guarding instead of heartbeats, for a drive that has none: asked so
     * often, whole ms, at most half of watchdog_ns; 0: heartbeats */
    int64_t guard_period_ns;
    /* objects as they are in the device, whatever the axis; outlive the
     * drive */
    const struct drive_cia402_parameter *parameter;
    unsigned parameter_count;
    /* of which those of its 0x1018 are taken, one of its product before one of
     * its vendor; outlive the drive */
    const struct drive_cia402_quirk *quirk;
    unsigned quirk_count;
    bool quirk_is_given; /* the first, whatever its 0x1018; one with a vendor
                            refuses a drive that is not of it */
};

enum drive_cia402_phase {
    DRIVE_CIA402_START_UP, /* running the start-up list, from the probe on */
    DRIVE_CIA402_RUN,      /* PDOs flow; walks to what is requested */
    DRIVE_CIA402_RESET,    /* clearing a latched fault */
    DRIVE_CIA402_LATCHED,  /* fault; the configuration still stands */
    DRIVE_CIA402_LOST,     /* silent, restarted or refused: start anew */
};

/* A list of SDO steps that is run while the drive is off or enabled. */
enum drive_cia402_job {
    DRIVE_CIA402_NO_JOB,
    DRIVE_CIA402_JOB_MODE,   /* to another mode */
    DRIVE_CIA402_JOB_GO,     /* what a profile needs */
    DRIVE_CIA402_JOB_HOME,   /* what homing needs */
    DRIVE_CIA402_JOB_HOMED,  /* where it stands after it; limits */
    DRIVE_CIA402_JOB_LIMITS, /* beside set points: the axis is inside again */
};

/* A motion by the drive's own profile; see go.c. */
struct drive_cia402_go {
    uint8_t step;
    bool halted;
    int32_t target_counts, speed; /* the drive's units */
    uint32_t vel, acc, dec;       /* the same; 0: leave */
    int64_t since_ns, begun_ns, timeout_ns;
    unsigned syncs;
};

/* See home.c. */
struct drive_cia402_home {
    uint8_t step;
    int8_t method;
    uint32_t fast, slow, acc; /* the drive's units; 0: leave */
    int32_t zero_counts;      /* of the home point */
    int64_t off_max_counts;   /* 0x6064 afterwards, at most */
    int64_t since_ns, timeout_ns, step_ns;
    unsigned syncs;
};

/* See probe.c. */
struct drive_cia402_probe {
    uint8_t step;
    bool there, latched;
    enum hal_drive_probe edge;
    int32_t counts;
    int64_t due_ns;
};

struct drive_cia402_step;

/* Visible so that it can be static; use the functions. */
struct drive_cia402 {
    struct hal_drive drive;
    struct canopen_node node;
    /* as told; what is in force of it, by the quirks */
    struct drive_cia402_config given, config;
    uint32_t vendor;                        /* 0x1018:1 */
    const struct drive_cia402_quirk *quirk; /* of this drive; NULL: none */

    /* made from config once */
    struct hal_ratio to_counts;   /* pos_q32 to counts */
    struct hal_ratio to_pos;      /* counts to pos_q32 */
    struct hal_ratio to_rate;     /* counts per period to counts/s, Q16 */
    struct hal_ratio to_vel;      /* that to vel_q32 */
    struct hal_ratio to_speed;    /* vel_q32 to counts/s, Q16 */
    struct hal_ratio to_vel_unit; /* that to the drive's unit */
    struct hal_ratio to_ramp, to_acc_unit; /* acc_q32 likewise */
    int64_t turn_q32; /* counts per revolution of the shaft; 0: not told */
    int32_t limit_counts[2];
    uint16_t guard_ms, guard_given_ms;
    uint8_t life_factor;
    int64_t first_step_counts;
    int64_t near_counts; /* it stands: at most so far from one place */
    uint32_t sync_us;    /* 0: not a whole number */
    uint16_t heartbeat_ms, watchdog_ms;
    uint8_t interpolation_count;
    int8_t interpolation_exponent;

    enum hal_drive_request request;
    enum drive_cia402_phase phase;
    enum hal_drive_state state; /* as reported */
    int64_t now_ns;             /* of the last begin() */

    /* the list of SDO steps being run: start-up or preload */
    const struct drive_cia402_step *list;
    unsigned list_at, list_tries; /* list NULL: none */
    unsigned parameter_at;        /* twice: written, then read back */
    int64_t list_since_ns;        /* of the present step */
    int64_t list_due_ns;          /* no transfer begins before */

    /* the node is told by NMT, see search.c */
    unsigned wakes; /* in this search */
    bool was_reset;
    int64_t wake_due_ns;

    /* modes; see modes.c */
    uint32_t modes; /* bits of 0x6502 */
    enum hal_drive_mode mode, mode_wanted;
    bool is_configured; /* but for the NMT start */
    bool was_latched;   /* when a sibling began to start the node anew */
    bool mode_known;    /* 0x6060 has not been left in between */
    enum drive_cia402_job job;
    struct drive_cia402_go go;
    struct drive_cia402_home home;
    enum hal_drive_homing homing;
    struct drive_cia402_probe probe;
    struct hal_readings readings;
    enum hal_reading reading; /* whose turn it is; HAL_READINGS: none's */
    bool reading_asked;
    int32_t rated_ma;        /* 0x6075; 0: not read yet */
    uint32_t factor[4][2];   /* 0x608F, 0x6091, 0x6092, 0x6096; 0: not there */
    bool speeds_fit;         /* 0x6096 is what the config says */
    int32_t reach_counts[2]; /* of its counter: 0x607B, or 32 bits */
    bool limit_there[2];     /* it has 0x607D:1, :2, and they hold: */
    int32_t limit_held[2];
    bool has_offset;            /* its own 0x607C is not 0 */
    uint32_t cob;               /* of the PDO that is being set up */
    bool cob_turned;            /* its bit 30 has been tried the other way */
    bool pdo_other, map_other;  /* it is not as it is to be, nor its map */
    int32_t option;             /* code read last */
    int32_t zero_counts;        /* of the drive's zero, since its own homing */
    bool torque_out, torque_in; /* 0x60B2 and 0x6077 are in the PDOs */

    /* the walk through the power states */
    enum cia402_state walk_state; /* waited in since walk_since_ns */
    int64_t walk_since_ns;
    bool preloaded;        /* target = actual written and read back */
    bool first_target;     /* no set point since enabled */
    unsigned reset_cycles; /* SYNCs since the reset began */
    bool reset_by_nmt;     /* it needed a reset of the communication first */
    uint16_t lost_word;    /* controlword it has acknowledged since it was lost;
                              all bits: none */
    int64_t lost_ns, lost_due_ns;
    int64_t status_ns; /* when it has said its statusword by SDO since; 0 */

    /* on the wire */
    bool pdo_ok;  /* the PDO map is ours */
    bool is_live; /* a TPDO1 has come since start-up */
    unsigned syncs_unanswered;
    uint16_t controlword, statusword;
    uint32_t inputs; /* 0x60FD */
    int32_t target_counts;
    int32_t preload_counts;
    int64_t actual_counts; /* followed across the wrap of i32 */
    int64_t actual_ns;     /* SYNC that latched actual; 0: never */
    int64_t actual_vel_q32;
    int32_t actual_delta_counts;      /* in the last period */
    struct hal_standstill standstill; /* by these, or by SDO in the search */
    struct hal_drive_found found;
    bool was_found; /* by this search, with its stage on */
    /* When the target was given that is in the RPDO image, that went out last,
     * and those that were latched at the last three SYNCs, newest first; 0: not
     * by set_target. */
    int64_t target_ns, sent_ns, latched_ns[3];
    int64_t demand_ns; /* of the target in force at actual_ns */
    int32_t sent_counts, latched_counts[3], demand_counts; /* likewise */
    int64_t target_speed_q16; /* counts/s: feed-forward, or the target */
    int16_t target_torque, actual_torque; /* permille, in the drive's sense */

    struct hal_drive_events events;
    uint32_t steps;     /* of start-up and enabling, so far */
    bool has_followed;  /* bit 12 has been up since it is enabled */
    unsigned lag_syncs; /* it has been low since */

    uint16_t emcy_code;  /* last heard, 0 after "all clear" */
    int64_t emcy_ns;     /* when */
    uint16_t fault_code; /* latched */
    bool code_is_reason; /* it is latched for a fault of the drive's own */
    unsigned code_tries; /* that are left to ask for it by SDO */
    int64_t code_due_ns;
    char fault_text[64];
};

/* Adds the node to the master.  Errors as canopen_add; MOTION_E_ARG for a value
 * outside what the config says, also when sync_period_ns is not the master's or
 * the master sends no heartbeat; MOTION_E_RANGE for a scale that does not fit.
 * The drive is &self->drive. */
int drive_cia402_init(struct drive_cia402 *self, struct canopen *master,
                      const struct drive_cia402_config *config);

/* Where an axis, from 0, has the object that the first has there; `number` as
 * in drive_cia402_pdos. */
uint16_t drive_cia402_object_of(uint8_t axis, uint16_t number, uint16_t index);
/* The one of these that a drive with this 0x1018:1 and :2 has, or NULL. */
const struct drive_cia402_quirk *
drive_cia402_quirk_find(const struct drive_cia402_quirk *quirk, unsigned count,
                        uint32_t vendor, uint32_t product);
bool drive_cia402_quirk_is_of(const struct drive_cia402_quirk *quirk,
                              uint32_t vendor, uint32_t product);

MOTION_C_END

#endif
