/* sim/device/cia402/parts.h - between the files of the simulated CiA 402 drive;
 * see servo.h for what stands where.  Nobody else includes this. */
#ifndef SIM_DEVICE_CIA402_PARTS_H
#define SIM_DEVICE_CIA402_PARTS_H

#include "sim/device/cia402/rows.h"
#include "sim/device/cia402/servo.h"
#include "sim/util.h"

/* Rows of the dictionary: CIA402_STATUSWORD and so on. */
enum cia402_row {
#define CIA402_ROW_ENUM(name, index, sub, type, access, init, min, max)        \
    CIA402_##name,
    CIA402_ROWS(CIA402_ROW_ENUM)
#undef CIA402_ROW_ENUM
        CIA402_ROW_COUNT
};

enum cia402_abort {
    CIA402_DONE = 0,
    CIA402_ABORT_TOGGLE = 0x05030000,
    CIA402_ABORT_TIMEOUT = 0x05040000,
    CIA402_ABORT_COMMAND = 0x05040001,
    CIA402_ABORT_BLOCK_SIZE = 0x05040002,
    CIA402_ABORT_SEQUENCE = 0x05040003,
    CIA402_ABORT_CRC = 0x05040004,
    CIA402_ABORT_ACCESS = 0x06010000,
    CIA402_ABORT_WRITE_ONLY = 0x06010001,
    CIA402_ABORT_READ_ONLY = 0x06010002,
    CIA402_ABORT_NO_OBJECT = 0x06020000,
    CIA402_ABORT_NOT_MAPPABLE = 0x06040041,
    CIA402_ABORT_PDO_LENGTH = 0x06040042,
    CIA402_ABORT_LENGTH = 0x06070010,
    CIA402_ABORT_TOO_LONG = 0x06070012,
    CIA402_ABORT_NO_SUB = 0x06090011,
    CIA402_ABORT_RANGE = 0x06090030,
    CIA402_ABORT_TOO_HIGH = 0x06090031,
    CIA402_ABORT_TOO_LOW = 0x06090032,
    CIA402_ABORT_STORE = 0x08000020,
    CIA402_ABORT_DEVICE_STATE = 0x08000022,
    CIA402_ABORT_NO_DATA = 0x08000024,
};

enum cia402_nmt {
    CIA402_NMT_BOOTING = 0x00,
    CIA402_NMT_STOPPED = 0x04,
    CIA402_NMT_OPERATIONAL = 0x05,
    CIA402_NMT_PRE_OPERATIONAL = 0x7F,
};

enum cia402_power {
    CIA402_POWER_NOT_READY,
    CIA402_POWER_DISABLED, /* Switch on disabled */
    CIA402_POWER_READY,    /* Ready to switch on */
    CIA402_POWER_ON,       /* Switched on */
    CIA402_POWER_ENABLED,  /* Operation enabled */
    CIA402_POWER_QUICK_STOP,
    CIA402_POWER_REACTION,
    CIA402_POWER_FAULT,
};

enum cia402_motion {
    CIA402_MOTION_OFF,    /* no torque */
    CIA402_MOTION_STAND,  /* hold the demand */
    CIA402_MOTION_FOLLOW, /* as the mode of operation says */
    CIA402_MOTION_RAMP,   /* demand slows down to rest */
};

/* CiA 301 7.2.7.1; error register bits, CiA 301 7.5.2.2. */
enum cia402_emcy {
    CIA402_EMCY_NONE = 0x0000,
    CIA402_EMCY_OVERCURRENT = 0x2310,
    CIA402_EMCY_OVERLOAD = 0x2350, /* I2t; one more: the warning before it */
    CIA402_EMCY_LOAD_WARNING = 0x2351,
    CIA402_EMCY_HEARTBEAT = 0x8130,
    CIA402_EMCY_PDO_SHORT = 0x8210,
    CIA402_EMCY_PDO_LONG = 0x8220,
    CIA402_EMCY_SYNC_LENGTH = 0x8240,
    CIA402_EMCY_RPDO_LATE = 0x8250,
    CIA402_EMCY_FOLLOWING = 0x8611,
};
#define CIA402_NO_NODE 255

#define CIA402_ERROR_GENERIC 0x01
#define CIA402_ERROR_CURRENT 0x02
#define CIA402_ERROR_COM     0x10
#define CIA402_ERROR_PROFILE 0x20

static inline int64_t cia402_now_ns(const struct sim_cia402 *self)
{
    return self->base.world->now_ns;
}

/* ---- axes.c ----------------------------------------------------- */

/* The one that has the node, and after it the others by `next`. */
struct sim_cia402 *cia402_axes_first(const struct sim_cia402 *self);
bool cia402_axes_is_first(const struct sim_cia402 *self);
/* Where this axis has an object of the device: *index in its own rows.  False:
 * it is not this one's affair. */
bool cia402_axes_take(const struct sim_cia402 *self, uint16_t *index);
/* And back: the device's index of it. */
uint16_t cia402_axes_index(const struct sim_cia402 *self, uint16_t index);
/* Of all axes together. */
uint8_t cia402_axes_errors(const struct sim_cia402 *self);
bool cia402_axes_is_legal(const struct sim_cia402_config *config);
void cia402_axes_join(struct sim_cia402 *self);

/* ---- od.c ------------------------------------------------------- */

/* All rows, or those of 0x1000-0x1FFF alone, to their defaults. */
void cia402_od_reset(struct sim_cia402 *self, bool communication_only);
/* 0x1010: what is set now is what it is set to after power-on. */
#define CIA402_SAVE UINT32_C(0x65766173) /* "save" */
void cia402_od_store(struct sim_cia402 *self);
/* Both 0: the whole range of the type. */
void cia402_od_range(int row, int64_t *min, int64_t *max);
/* Row of an object, or -1 with *abort_code. */
int cia402_od_find(uint16_t index, uint8_t sub, uint32_t *abort_code);
unsigned cia402_od_size(int row); /* bytes; 0 for a long object */
uint16_t cia402_od_index(int row);
uint8_t cia402_od_sub(int row);
bool cia402_od_is_dummy(int row);
/* As a data sheet has them: name, CiA 301's data type, "ro" "rw" "wo". */
const char *cia402_od_name(int row);
unsigned cia402_od_type(int row);
const char *cia402_od_access(int row);
uint32_t cia402_od_default(int row);
bool cia402_od_adds_node(int row);
/* Long objects: texts, and 0x2002.  Not a number: cia402_od_bytes has them. */
bool cia402_od_is_long(int row);
const uint8_t *cia402_od_bytes(const struct sim_cia402 *self, int row,
                               uint32_t *length);
/* May so many bytes be written to it?  CIA402_DONE or an abort code. */
uint32_t cia402_od_check_long(int row, uint32_t length);
void cia402_od_write_long(struct sim_cia402 *self, const uint8_t *bytes,
                          uint32_t length);
bool cia402_od_is_mappable(int row, bool transmit);
/* By SDO: access is checked.  CIA402_DONE or an abort code. */
uint32_t cia402_od_read(struct sim_cia402 *self, int row, uint32_t *value);
/* size in bytes, 0: not given. */
uint32_t cia402_od_write(struct sim_cia402 *self, int row, unsigned size,
                         uint32_t value);
/* By RPDO: range and rules only. */
uint32_t cia402_od_put(struct sim_cia402 *self, int row, uint32_t value);
/* Number in a row with its sign. */
int64_t cia402_od_signed(const struct sim_cia402 *self, int row);

/* ---- com.c ------------------------------------------------------ */

void cia402_com_send(struct sim_cia402 *self, uint32_t id, const uint8_t *data,
                     unsigned len);
void cia402_com_boot_up(struct sim_cia402 *self);
/* Boot-up message after this time. */
void cia402_com_boot_in(struct sim_cia402 *self, int64_t delay_ns);
/* Power-on or reset node: everything at its default, booting. */
void cia402_com_restart(struct sim_cia402 *self);
void cia402_com_nmt(struct sim_cia402 *self, const struct hal_can_frame *frame);
/* Power-on of all its axes. */
void cia402_com_restart_node(struct sim_cia402 *self);
void cia402_com_heartbeat(struct sim_cia402 *self);
/* A heartbeat of another node. */
void cia402_com_consume(struct sim_cia402 *self,
                        const struct hal_can_frame *frame);
void cia402_com_master_lost(struct sim_cia402 *self);
/* Report: error register, 0x603F, history, EMCY. */
void cia402_com_error(struct sim_cia402 *self, uint16_t code, uint8_t bits);
/* These bits are gone; EMCY 0 when they were the last. */
void cia402_com_error_gone(struct sim_cia402 *self, uint8_t bits);
/* May 11-bit id be given to an object (CiA 301 7.3.5)? */
bool cia402_com_is_free_id(uint32_t id);
/* What a write of an object of the communication area means. */
uint32_t cia402_com_check(const struct sim_cia402 *self, int row,
                          uint32_t value);
void cia402_com_changed(struct sim_cia402 *self, int row);

/* ---- guard.c ---------------------------------------------------- */

/* A remote frame with our heartbeat's id. */
void cia402_guard_requested(struct sim_cia402 *self);
void cia402_guard_start(struct sim_cia402 *self);
void cia402_guard_time(struct sim_cia402 *self,
                       const struct hal_can_frame *frame);

/* ---- lss.c ------------------------------------------------------ */

void cia402_lss_request(struct sim_cia402 *self,
                        const struct hal_can_frame *frame);

/* ---- sdo.c ------------------------------------------------------ */

void cia402_sdo_request(struct sim_cia402 *self,
                        const struct hal_can_frame *frame);
uint32_t cia402_sdo_get_u32(const uint8_t *data);
void cia402_sdo_send(struct sim_cia402 *self, const uint8_t data[8]);
/* Command, the request's index and sub-index, 4 bytes. */
void cia402_sdo_reply(struct sim_cia402 *self, uint8_t command,
                      const uint8_t request[8], uint32_t value);

/* ---- long.c ----------------------------------------------------- */

/* Requests that begin a long transfer of a row. */
void cia402_long_upload(struct sim_cia402 *self, const uint8_t request[8],
                        int row);
void cia402_long_download(struct sim_cia402 *self, const uint8_t request[8],
                          int row);
void cia402_long_block(struct sim_cia402 *self, const uint8_t request[8],
                       int row);
/* A frame that may belong to the transfer under way; false: it does not. */
bool cia402_long_request(struct sim_cia402 *self, const uint8_t request[8]);
/* Segments of a block that is being read; called by the inner loop. */
void cia402_long_poll(struct sim_cia402 *self);
void cia402_long_end(struct sim_cia402 *self);

/* ---- pdo.c ------------------------------------------------------ */

uint32_t cia402_pdo_check(const struct sim_cia402 *self, int row,
                          uint32_t value);
/* Work out from the dictionary which PDOs are active. */
void cia402_pdo_update(struct sim_cia402 *self);
/* Entering Operational: event-driven TPDOs go out once. */
void cia402_pdo_start(struct sim_cia402 *self);
/* A data frame that may be an RPDO, a remote frame that may ask for a TPDO. */
void cia402_pdo_received(struct sim_cia402 *self,
                         const struct hal_can_frame *frame);
void cia402_pdo_sync_in(struct sim_cia402 *self);
void cia402_pdo_sync_out(struct sim_cia402 *self);
/* Event-driven TPDOs; called by the inner loop. */
void cia402_pdo_poll(struct sim_cia402 *self);

/* ---- power.c ---------------------------------------------------- */

void cia402_power_reset(struct sim_cia402 *self);
/* A controlword has been written. */
void cia402_power_control(struct sim_cia402 *self);
void cia402_power_brake_released(struct sim_cia402 *self);
/* A ramp has come to rest. */
void cia402_power_at_rest(struct sim_cia402 *self);
/* Transition 13. */
void cia402_power_fault(struct sim_cia402 *self, uint16_t code, uint8_t bits);
/* The connection is lost: what 0x6007 says. */
void cia402_power_connection_lost(struct sim_cia402 *self);
/* Torque cannot be had any more. */
void cia402_power_lost(struct sim_cia402 *self);
uint16_t cia402_power_statusword(const struct sim_cia402 *self);

/* ---- motion.c --------------------------------------------------- */

/* One step of the inner loop. */
void cia402_motion_step(struct sim_servo *base, int64_t dt_ns);
void cia402_motion_off(struct sim_cia402 *self);
/* Torque on, standing where the axis is. */
void cia402_motion_stand(struct sim_cia402 *self);
void cia402_motion_follow(struct sim_cia402 *self);
void cia402_motion_ramp(struct sim_cia402 *self, int64_t acc_counts_s2);
int64_t cia402_motion_actual_q24(const struct sim_cia402 *self);
/* Values that follow from the state, into the dictionary. */
void cia402_motion_refresh(struct sim_cia402 *self);
/* Limits and late targets of the mode before. */
void cia402_motion_stop_watching(struct sim_cia402 *self);
/* The demand stands and the axis nearly. */
bool cia402_motion_is_resting(const struct sim_cia402 *self);
int64_t cia402_motion_counts(int64_t q24); /* to nearest */
int64_t cia402_motion_abs(int64_t value);
int64_t cia402_motion_gain_q24(struct sim_cia402 *self, int64_t acc_q8,
                               int64_t dt_ns);
/* A position of the plant as the bus sees it. */
uint32_t cia402_motion_seen(const struct sim_cia402 *self, int64_t q24);

/* ---- mode.c ----------------------------------------------------- */

bool cia402_mode_exists(int8_t code); /* 0 too */
/* Put 0x6060 in force when that may be. */
void cia402_mode_update(struct sim_cia402 *self);
/* Operation has been enabled. */
void cia402_mode_begin(struct sim_cia402 *self);
/* A controlword while enabled. */
void cia402_mode_control(struct sim_cia402 *self);
void cia402_mode_latch(struct sim_cia402 *self); /* SYNC */
void cia402_mode_step(struct sim_cia402 *self, int64_t dt_ns);
void cia402_mode_watch(struct sim_cia402 *self, int64_t dt_ns);
unsigned cia402_mode_status(const struct sim_cia402 *self);
/* Is there a following error? */
bool cia402_mode_watches(const struct sim_cia402 *self);
bool cia402_mode_is_cyclic(const struct sim_cia402 *self);

/* ---- stream.c --------------------------------------------------- */

/* SYNC: measure its period. */
void cia402_stream_sync(struct sim_cia402 *self);
void cia402_stream_targets_late(struct sim_cia402 *self);
int32_t cia402_stream_inside(struct sim_cia402 *self, int32_t wanted);
int64_t cia402_stream_vel_max_q24(const struct sim_cia402 *self);
void cia402_stream_latch_csp(struct sim_cia402 *self);
void cia402_stream_latch_ip(struct sim_cia402 *self);
void cia402_stream_latch_csv(struct sim_cia402 *self);
void cia402_stream_step(struct sim_cia402 *self, int64_t dt_ns);
void cia402_stream_step_velocity(struct sim_cia402 *self, int64_t dt_ns);
unsigned cia402_stream_status(const struct sim_cia402 *self);
unsigned cia402_stream_status_ip(const struct sim_cia402 *self);

/* ---- profile.c -------------------------------------------------- */

/* The demand's speed towards vel by the profile's ramps, and the demand with
 * it: by the mean speed of the step. */
void cia402_profile_run(struct sim_cia402 *self, int64_t vel_q24,
                        int64_t dt_ns);
void cia402_profile_begin(struct sim_cia402 *self);
void cia402_profile_control_pp(struct sim_cia402 *self);
void cia402_profile_step_pp(struct sim_cia402 *self, int64_t dt_ns);
void cia402_profile_watch_pp(struct sim_cia402 *self, int64_t dt_ns);
unsigned cia402_profile_status_pp(const struct sim_cia402 *self);
void cia402_profile_step_pv(struct sim_cia402 *self, int64_t dt_ns);
void cia402_profile_watch_pv(struct sim_cia402 *self, int64_t dt_ns);
unsigned cia402_profile_status_pv(const struct sim_cia402 *self);

/* ---- home.c ----------------------------------------------------- */

uint32_t cia402_home_check(const struct sim_cia402 *self, int8_t method);
void cia402_home_begin(struct sim_cia402 *self);
void cia402_home_control(struct sim_cia402 *self);
void cia402_home_step(struct sim_cia402 *self, int64_t dt_ns);
unsigned cia402_home_status(const struct sim_cia402 *self);

/* ---- inputs.c --------------------------------------------------- */

enum cia402_input {
    CIA402_INPUT_NEGATIVE = 1 << 0,
    CIA402_INPUT_POSITIVE = 1 << 1,
    CIA402_INPUT_HOME = 1 << 2,
    CIA402_INPUT_NO_POWER = 1 << 3,
    CIA402_INPUT_PROBE = 1 << 16,
};

uint32_t cia402_inputs(const struct sim_cia402 *self); /* 0x60FD */
/* Number of index pulses at or below a position of the plant. */
int64_t cia402_inputs_index(const struct sim_cia402 *self, int64_t pos_q24);
/* Look for edges; at each inner step. */
void cia402_inputs_watch(struct sim_cia402 *self);
/* 0x60B8 has been written. */
void cia402_inputs_probe(struct sim_cia402 *self);

/* ---- timers: servo.c runs them ------------------------------------ */

static inline void cia402_timer_set(struct sim_cia402 *self,
                                    enum sim_cia402_timer timer, int64_t at_ns)
{
    self->timer_ns[timer] = at_ns;
}

static inline void cia402_timer_stop(struct sim_cia402 *self,
                                     enum sim_cia402_timer timer)
{
    self->timer_ns[timer] = SIM_WORLD_NEVER;
}

/* ---- quirk.c ---- */

/* May it be read, or written?  CIA402_DONE, or the abort code. */
uint32_t cia402_quirk_check(const struct sim_cia402 *self, int row,
                            bool is_write);
/* Values as shipped. */
void cia402_quirk_reset(struct sim_cia402 *self);

#endif
