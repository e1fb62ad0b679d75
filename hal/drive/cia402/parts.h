/* hal/drive/cia402/parts.h - private to drive_cia402*.c: what the parts share of
 * each other. */
#ifndef HAL_DRIVE_CIA402_PARTS_H
#define HAL_DRIVE_CIA402_PARTS_H

#include "hal/drive/cia402/drive.h"
#include "hal/support/container_of.h"
#include "hal/support/text.h"

/* ---- list.c: walking a list of SDO steps ---- */

enum step_kind {
    STEP_END,
    STEP_READ,       /* give the value to check() */
    STEP_WRITE,      /* value */
    STEP_COMPARE,    /* read, must be value */
    STEP_MATCH,      /* read; is the PDO asked about as it is to be? */
    STEP_NMT,        /* send the command `value` */
    STEP_UNTIL,      /* check() says so */
    STEP_PARAMETERS, /* those of the config, written and compared */
};

/* Bits. */
enum step_need {
    STEP_NEEDED = 0,
    STEP_IF_THERE = 1, /* a drive that refuses, however it puts that, will do:
                          where it matters what it has, that is read */
    STEP_IF_SET = 2,   /* left out when the value is 0 */
    STEP_SWITCHES = 4, /* any refusal leaves out all rows of this kind */
    STEP_FOREVER = 8,  /* ask until there is an answer */
    /* Left out unless; in the order of step_gates[]: */
    STEP_IF_COUNTED = 1 << 4,  /* SYNC has a counter */
    STEP_IF_GUARDED = 1 << 5,  /* node guarding */
    STEP_IF_OPTION = 1 << 6,   /* this option code is given */
    STEP_IF_TRAVEL = 1 << 7,   /* the factor group is to be checked */
    STEP_IF_LIMITS = 1 << 8,   /* software limits are given */
    STEP_IF_VELOCITY = 1 << 9, /* 0x60FF is in RPDO2 */
    STEP_IF_TORQUE = 1 << 10,
    STEP_IF_IP = 1 << 11,
    STEP_UNLESS_IP = 1 << 12,
    STEP_IF_SPEED = 1 << 13,  /* the mode to come runs at 0x60FF */
    STEP_IF_VALID = 1 << 14,  /* the PDO read before is not off */
    STEP_IF_UNSAFE = 1 << 15, /* the option code read before does not brake */

    STEP_IF_OTHER = 1 << 16, /* 0x607D does not hold this limit */
    STEP_IF_PDO = 1 << 17,   /* the PDO asked about is not as it is to be */
    STEP_IF_MAP = 1 << 18,   /* nor is its map */

    STEP_IF_QUIRKS = 1 << 19, /* there are quirks to be found by identity */

    STEP_IF_OTHER_AXIS = 1 << 20, /* it is not the device's first */
    STEP_IF_FIRST = 1 << 21,      /* of the node: not for each of its axes */
    STEP_IF_FOUND = 1 << 22,      /* its stage is on already */

    STEP_OR_LEAVE = 1 << 24, /* refused: what it has is judged later */
    STEP_WATCH = 1 << 25, /* needed for its watch; not if it is unsupervised */
};

/* What to write or compare with: index of drive_cia402_values[]. */
enum drive_cia402_value {
    VALUE_FIXED,   /* the row's value */
    VALUE_ENTRY,   /* the same as an entry of a map: with the axis's object */
    VALUE_COB,     /* of this PDO; the row's value plus the node id */
    VALUE_COB_OFF, /* what was read, with bit 31 */
    VALUE_HEARTBEAT,
    VALUE_CONSUMER,
    VALUE_SYNC_US,
    VALUE_INTERPOLATION_COUNT,
    VALUE_INTERPOLATION_EXPONENT,
    VALUE_FOLLOWING,
    VALUE_QUICK_STOP,
    VALUE_PRELOAD,
    VALUE_PARAMETER,
    VALUE_MODE,
    VALUE_SYNC_OVERFLOW,
    VALUE_GUARD_TIME,
    VALUE_LIFE_FACTOR,
    VALUE_OPTION,
    VALUE_FOLLOWING_TIME,
    VALUE_LIMIT,
    VALUE_TARGET_ENTRY,
    VALUE_TORQUE_OUT_ENTRY,
    VALUE_TORQUE_IN_ENTRY,
    VALUE_RPDO1_COUNT,
    VALUE_TPDO1_COUNT,
    VALUE_GO_TARGET,
    VALUE_GO_SPEED,
    VALUE_GO_VELOCITY,
    VALUE_GO_ACCELERATION,
    VALUE_GO_DECELERATION,
    VALUE_HOME_METHOD,
    VALUE_HOME_FAST,
    VALUE_HOME_SLOW,
    VALUE_HOME_ACCELERATION,
};

/* What to do with a value read, or what to wait for: index of
 * drive_cia402_checks[]. */
enum drive_cia402_check {
    CHECK_NOTHING,
    CHECK_DEVICE,
    CHECK_VENDOR,
    CHECK_PRODUCT,
    CHECK_MODES,
    CHECK_PRE_OPERATIONAL,
    CHECK_MODE,
    CHECK_ERROR_CODE,
    CHECK_INPUTS,
    CHECK_ACTUAL,
    CHECK_PRELOAD,
    CHECK_PDO_OURS,
    CHECK_SIBLINGS,
    CHECK_LIVE,
    CHECK_FACTOR,
    CHECK_FACTORS,
    CHECK_PROBE,
    CHECK_LIMIT,
    CHECK_TORQUE_OUT,
    CHECK_TORQUE_IN,
    CHECK_COB,
    CHECK_PDO,
    CHECK_INHIBIT,
    CHECK_OPTION,
    CHECK_BRAKES,
    CHECK_OFFSET,
    CHECK_HOME,
    CHECK_STAGE,
    CHECK_PLACE,
    CHECK_SPEED,
    CHECK_STANDS,
    CHECK_REACH,
    CHECK_SYNC,
};

struct drive_cia402_step {
    enum step_kind kind;
    unsigned need; /* enum step_need */
    uint16_t index;
    uint8_t sub, size;
    uint32_t value;
    enum drive_cia402_value value_of;
    enum drive_cia402_check check;
};

/* step: MOTION_OK when the list is done, MOTION_E_AGAIN while it runs, anything
 * else when it failed; then fault_text says why. */
void drive_cia402_list_begin(struct drive_cia402 *self,
                             const struct drive_cia402_step *list,
                             int64_t now_ns);
int drive_cia402_list_step(struct drive_cia402 *self, int64_t now_ns);

/* ---- search.c: ways to an answer ---- */

#define DRIVE_CIA402_TRIES 3 /* of a transfer */

void drive_cia402_search_begin(struct drive_cia402 *self);
/* Every cycle of a search. */
void drive_cia402_search_step(struct drive_cia402 *self);
/* It has not answered: in the search, when it is lost. */
void drive_cia402_search_silent(struct drive_cia402 *self);
void drive_cia402_search_lost(struct drive_cia402 *self);
/* It has aborted, and may do otherwise in a moment: the row is to be tried
 * again. */
bool drive_cia402_search_again(struct drive_cia402 *self);
/* The row waits for an NMT state. */
void drive_cia402_search_repeat(struct drive_cia402 *self);

/* ---- values.c: what stands in the lists ---- */

extern uint32_t (*const drive_cia402_values[])(const struct drive_cia402 *self);
/* MOTION_OK; MOTION_E_AGAIN: ask again; else refused with fault_text. */
extern int (*const drive_cia402_checks[])(struct drive_cia402 *self,
                                          uint32_t value);

/* What a row's check leaves when there is no such object. */
int drive_cia402_missing(struct drive_cia402 *self,
                         enum drive_cia402_check check);
#define DRIVE_CIA402_COB_OFF    UINT32_C(0x80000000)
#define DRIVE_CIA402_COB_NO_RTR UINT32_C(0x40000000)
/* The option code that was read and is not the rig's is to be another. */
bool drive_cia402_option_is_unsafe(const struct drive_cia402 *self);

/* Rows for the switches come next: they are left out. */
void drive_cia402_skip_switches(struct drive_cia402 *self);

/* ---- axis.c: one of several axes of a node ---- */

/* Where this axis has what the first axis has there. */
uint16_t drive_cia402_object(const struct drive_cia402 *self, uint16_t index);
/* The identifiers of its PDOs are those of the config. */
void drive_cia402_forget_pdo_ids(struct drive_cia402 *self);
/* Of the PDO of the present row; 0: the predefined one, or none. */
uint16_t drive_cia402_own_pdo_id(const struct drive_cia402 *self);
/* Checks of the lists; see drive_cia402_checks[]. */
int drive_cia402_check_pdo_id(struct drive_cia402 *self, uint32_t value);
int drive_cia402_check_siblings(struct drive_cia402 *self, uint32_t value);
/* The node starts anew, and each axis with it; one whose fault was being
 * cleared has that before it. */
void drive_cia402_start_node_anew(struct drive_cia402 *self, int64_t now_ns);
/* Has another axis of the node torque? */
bool drive_cia402_holds_sibling(const struct drive_cia402 *self);

/* ---- start.c: the lists for finding and for enabling it ---- */

extern const struct drive_cia402_step drive_cia402_start_up[];
extern const struct drive_cia402_step drive_cia402_preload[];

/* ---- limits.c: software limits ---- */

/* What 0x607D:1 (end 0) or :2 is to be, by 0x6064 as read last. */
int32_t drive_cia402_limit(const struct drive_cia402 *self, unsigned end);
/* It holds that; false: it is to hold something else. */
bool drive_cia402_note_limit(struct drive_cia402 *self, unsigned end,
                             int32_t counts);
/* 0x607B:1, :2: its counter goes on at the other end there. */
int drive_cia402_note_reach(struct drive_cia402 *self, uint32_t value);
void drive_cia402_forget_reach(struct drive_cia402 *self);
/* It is being written. */
void drive_cia402_forget_limit(struct drive_cia402 *self, unsigned end);
/* Would the drive go elsewhere when it is told to stay where it was read
 * last? */
bool drive_cia402_is_clamped(const struct drive_cia402 *self);
/* Every cycle while enabled, nothing else being asked of the drive. */
void drive_cia402_limits_step(struct drive_cia402 *self, int64_t now_ns);

/* ---- factor.c: the factor group ---- */

int drive_cia402_note_factor(struct drive_cia402 *self, uint32_t value);
int drive_cia402_check_factors(struct drive_cia402 *self);

/* ---- modes.c: modes of operation, and jobs ---- */

struct drive_cia402_mode_ops {
    /* Bits of the controlword beside 0x0F. */
    uint16_t (*mode_word)(const struct drive_cia402 *self);
    /* Every cycle while enabled. */
    void (*mode_step)(struct drive_cia402 *self, int64_t now_ns);
    /* Its own motion is over, whatever it was. */
    void (*mode_cancel)(struct drive_cia402 *self);
    bool (*mode_is_busy)(const struct drive_cia402 *self);
};
struct drive_cia402_mode {
    int8_t code;      /* 0x6060 */
    bool streams;     /* takes set points, and says in bit 12 that it follows */
    bool uses_target; /* the target of RPDO1 moves it */
    bool uses_speed;  /* 0x60FF does */
    const struct drive_cia402_mode_ops *ops;
};
/* The one in force. */
const struct drive_cia402_mode *
drive_cia402_mode(const struct drive_cia402 *self);
const struct drive_cia402_mode *
drive_cia402_mode_wanted(const struct drive_cia402 *self);
unsigned drive_cia402_modes(struct hal_drive *drive);
int drive_cia402_set_mode(struct hal_drive *drive, enum hal_drive_mode mode);
int drive_cia402_halt(struct hal_drive *drive);
/* Whatever moves by itself is over: off, a fault, another mode. */
void drive_cia402_modes_reset(struct drive_cia402 *self);
/* Put `mode_wanted` in force. */
void drive_cia402_modes_change(struct drive_cia402 *self, int64_t now_ns);
void drive_cia402_job_begin(struct drive_cia402 *self,
                            enum drive_cia402_job job,
                            const struct drive_cia402_step *list,
                            int64_t now_ns);
void drive_cia402_job_step(struct drive_cia402 *self, int64_t now_ns);

/* ---- go.c: profile position and velocity ---- */

int drive_cia402_go(struct hal_drive *drive, const struct hal_drive_go *go);
void drive_cia402_go_written(struct drive_cia402 *self, int64_t now_ns);
extern const struct drive_cia402_mode_ops drive_cia402_go_ops;
bool drive_cia402_go_has_arrived(const struct drive_cia402 *self);
int drive_cia402_go_halt(struct drive_cia402 *self);

/* ---- home.c: its own homing ---- */

int drive_cia402_home(struct hal_drive *drive,
                      const struct hal_drive_home *home);
void drive_cia402_home_written(struct drive_cia402 *self, int64_t now_ns);
void drive_cia402_home_done(struct drive_cia402 *self, int64_t now_ns);
extern const struct drive_cia402_mode_ops drive_cia402_home_ops;
int drive_cia402_home_halt(struct drive_cia402 *self);

/* ---- probe.c: touch probe 1 ---- */

int drive_cia402_set_probe(struct hal_drive *drive, enum hal_drive_probe probe);
/* A cycle in which nothing else is asked of the drive. */
void drive_cia402_probe_step(struct drive_cia402 *self, int64_t now_ns);

/* ---- readings.c: temperature, voltage, current ---- */

/* As drive_cia402_probe_step, before it; true: the channel is in use. */
bool drive_cia402_readings_step(struct drive_cia402 *self, int64_t now_ns);
/* A cycle in which it cannot be asked. */
void drive_cia402_readings_pause(struct drive_cia402 *self, int64_t now_ns);

/* ---- units.c: into the drive's units ---- */

int drive_cia402_reach(struct hal_drive *drive, int64_t pos_q32,
                       struct hal_drive_reach *reach);
/* MOTION_E_RANGE. */
int drive_cia402_counts(const struct drive_cia402 *self, int64_t pos_q32,
                        int32_t *counts);
/* The same, from the axis's own zero. */
int drive_cia402_counts_of(const struct drive_cia402 *self, int64_t pos_q32,
                           int32_t *counts);
int drive_cia402_speed(const struct drive_cia402 *self, int64_t speed_q16,
                       int32_t *speed);
/* Signless, at least 1; 0 stays 0: leave what the drive has. */
int drive_cia402_speed_of(const struct drive_cia402 *self, int64_t vel_q32,
                          uint32_t *speed);
int drive_cia402_ramp_of(const struct drive_cia402 *self, int64_t acc_q32,
                         uint32_t *ramp);

/* ---- quirk.c: what its maker does otherwise ---- */

/* What is in force of the config. */
void drive_cia402_settle(struct drive_cia402 *self);
/* By self->vendor and this product.  MOTION_OK, or refused with fault_text. */
int drive_cia402_identify(struct drive_cia402 *self, uint32_t product);
/* The parameter to be written as number `at`, where this axis has it; false: no
 * more. */
bool drive_cia402_parameter(const struct drive_cia402 *self, unsigned at,
                            struct drive_cia402_parameter *parameter);
/* What this object must be, since it is not written; NULL: it is. */
const struct drive_cia402_parameter *
drive_cia402_fixed(const struct drive_cia402 *self, uint16_t index,
                   uint8_t sub);
bool drive_cia402_homes_without_bit_10(const struct drive_cia402 *self);

/* ---- walk.c: phases and power states ---- */

/* One cycle of the phase the drive is in. */
void drive_cia402_walk(struct drive_cia402 *self, int64_t now_ns);
uint16_t drive_cia402_controlword(const struct drive_cia402 *self);
/* What is reported: in RUN from request and power state, else as set. */
enum hal_drive_state drive_cia402_reported(const struct drive_cia402 *self);
bool drive_cia402_is_enabled(const struct drive_cia402 *self);
/* Configured, so that silence is a fault. */
bool drive_cia402_is_watched(const struct drive_cia402 *self);
void drive_cia402_reset_begin(struct drive_cia402 *self);
void drive_cia402_start_anew(struct drive_cia402 *self, int64_t now_ns);
void drive_cia402_drop_list(struct drive_cia402 *self);

/* ---- fault.c: what went wrong, in words, latched ---- */

/* fault_text begins anew; more may be put to what is returned. */
struct hal_text drive_cia402_say(struct drive_cia402 *self, const char *words);
/* " for 3000 ms" */
void drive_cia402_put_wait(struct hal_text *text, int64_t wait_ns);
/* The configuration stands; fault_text has been said. */
void drive_cia402_latch(struct drive_cia402 *self);
/* Start-up is needed; `state` is reported until then. */
void drive_cia402_lose(struct drive_cia402 *self, enum hal_drive_state state);
void drive_cia402_latch_fault(struct drive_cia402 *self);
/* After so long. */
void drive_cia402_latch_stuck(struct drive_cia402 *self, int64_t wait_ns);
void drive_cia402_latch_left(struct drive_cia402 *self);
void drive_cia402_say_fault(struct drive_cia402 *self, uint16_t code);
/* It is in fault, and has not told its code yet: it is to be asked. */
bool drive_cia402_awaits_code(const struct drive_cia402 *self);
void drive_cia402_code_step(struct drive_cia402 *self);

/* ", 0x6041=0637" */
void drive_cia402_put_status(const struct drive_cia402 *self,
                             struct hal_text *text);

/* ---- wire.c: what the node hears and sends ---- */

extern const struct canopen_node_ops drive_cia402_node_ops;

/* ---- drive.c: what the controller asks ---- */

extern const struct hal_drive_ops drive_cia402_ops;

static inline struct drive_cia402 *drive_cia402_of(struct hal_drive *drive)
{
    return CONTAINER_OF(drive, struct drive_cia402, drive);
}

/* The axis's counts of a reading of the drive: it counts from its home point,
 * with no offset of its own, whose sign is not the same with all makers. */
static inline int64_t drive_cia402_axis_counts(const struct drive_cia402 *self,
                                               int64_t counts)
{
    return counts + self->zero_counts;
}

/* A list is run that no set point may come between. */
static inline bool drive_cia402_is_busy(const struct drive_cia402 *self)
{
    return self->job != DRIVE_CIA402_NO_JOB &&
           self->job != DRIVE_CIA402_JOB_LIMITS;
}

#define DRIVE_CIA402_STANDING_COUNTS 2 /* per period */

static inline bool drive_cia402_stands(const struct drive_cia402 *self)
{
    return self->actual_delta_counts <= DRIVE_CIA402_STANDING_COUNTS &&
           self->actual_delta_counts >= -DRIVE_CIA402_STANDING_COUNTS;
}

/* It has stood for long enough to lose its torque. */
static inline bool drive_cia402_rests(const struct drive_cia402 *self)
{
    return hal_standstill_is(&self->standstill, self->actual_ns);
}

static inline enum cia402_state
drive_cia402_power(const struct drive_cia402 *self)
{
    return cia402_state_of(self->statusword);
}

#endif
