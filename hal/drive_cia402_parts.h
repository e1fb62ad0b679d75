/* hal/drive_cia402_parts.h - private to drive_cia402*.c: what the parts know of
 * each other. */
#ifndef HAL_DRIVE_CIA402_PARTS_H
#define HAL_DRIVE_CIA402_PARTS_H

#include "hal/drive_cia402.h"
#include "hal/text.h"

/* ---- drive_cia402_list.c: walking a list of SDO steps ---- */

enum step_kind {
    STEP_END,
    STEP_READ,       /* give the value to check() */
    STEP_WRITE,      /* value */
    STEP_COMPARE,    /* read, must be value */
    STEP_NMT,        /* send the command `value` */
    STEP_UNTIL,      /* check() says so */
    STEP_PARAMETERS, /* those of the config, written and compared */
};

/* Bits. */
enum step_need {
    STEP_NEEDED = 0,
    STEP_IF_THERE = 1, /* a drive without it, or with a fixed one, will do */
    STEP_IF_SET = 2,   /* left out when the value is 0 */
    STEP_SWITCHES = 4, /* any refusal leaves out all rows of this kind */
    STEP_FOREVER = 8,  /* ask until there is an answer */
};

/* What to write or compare with: index of drive_cia402_values[]. */
enum drive_cia402_value {
    VALUE_FIXED, /* the row's value */
    VALUE_COB,   /* the row's value plus the node id */
    VALUE_HEARTBEAT,
    VALUE_CONSUMER,
    VALUE_SYNC_US,
    VALUE_INTERPOLATION_COUNT,
    VALUE_INTERPOLATION_EXPONENT,
    VALUE_FOLLOWING,
    VALUE_QUICK_STOP,
    VALUE_PRELOAD,
    VALUE_PARAMETER,
};

/* What to do with a value read, or what to wait for: index of
 * drive_cia402_checks[]. */
enum drive_cia402_check {
    CHECK_NOTHING,
    CHECK_DEVICE,
    CHECK_MODES,
    CHECK_PRE_OPERATIONAL,
    CHECK_MODE,
    CHECK_ERROR_CODE,
    CHECK_INPUTS,
    CHECK_ACTUAL,
    CHECK_PRELOAD,
    CHECK_PDO_OURS,
    CHECK_LIVE,
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

/* ---- drive_cia402_start.c: the lists and what stands in them ---- */

extern uint32_t (*const drive_cia402_values[])(const struct drive_cia402 *self);
/* MOTION_OK; MOTION_E_AGAIN: ask again; else refused with fault_text. */
extern int (*const drive_cia402_checks[])(struct drive_cia402 *self,
                                          uint32_t value);
extern const struct drive_cia402_step drive_cia402_start_up[];
extern const struct drive_cia402_step drive_cia402_preload[];

/* ---- drive_cia402_walk.c: phases and power states ---- */

/* One cycle of the phase the drive is in. */
void drive_cia402_walk(struct drive_cia402 *self, int64_t now_ns);
uint16_t drive_cia402_controlword(const struct drive_cia402 *self);
/* What is reported: in RUN from request and power state, else as set. */
enum hal_drive_state drive_cia402_reported(const struct drive_cia402 *self);
bool drive_cia402_is_enabled(const struct drive_cia402 *self);
/* Configured, so that silence is a fault. */
bool drive_cia402_is_watched(const struct drive_cia402 *self);
void drive_cia402_start_anew(struct drive_cia402 *self, int64_t now_ns);
void drive_cia402_drop_list(struct drive_cia402 *self);

/* ---- drive_cia402_fault.c: what went wrong, in words, latched ---- */

/* fault_text begins anew; more may be put to what is returned. */
struct hal_text drive_cia402_say(struct drive_cia402 *self, const char *words);
/* The configuration stands; fault_text has been said. */
void drive_cia402_latch(struct drive_cia402 *self);
/* Start-up is needed; `state` is reported until then. */
void drive_cia402_lose(struct drive_cia402 *self, enum hal_drive_state state);
void drive_cia402_latch_fault(struct drive_cia402 *self);
void drive_cia402_latch_stuck(struct drive_cia402 *self);
void drive_cia402_latch_left(struct drive_cia402 *self);
void drive_cia402_say_fault(struct drive_cia402 *self, uint16_t code);

/* ---- drive_cia402_wire.c: what the node hears and sends ---- */

extern const struct canopen_node_ops drive_cia402_node_ops;

/* ---- drive_cia402.c: what the controller asks ---- */

extern const struct hal_drive_ops drive_cia402_ops;

static inline enum cia402_state
drive_cia402_power(const struct drive_cia402 *self)
{
    return cia402_state_of(self->statusword);
}

#endif
