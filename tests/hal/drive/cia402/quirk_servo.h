/* tests/hal/drive/cia402/quirk_servo.h - a strict CiA 402 servo on the
 * simulated CAN bus, for the ways in which real ones differ.
 *
 * Written from CiA 301 (7.2, 7.5), CiA 402-2 and makers' manuals, without a
 * look at sim/cia402*: what it does with a PDO that is written in the wrong
 * order, a controlword out of turn or a halted axis is the least friendly thing
 * that the standard lets it do.  Its motor is ideal: it stands where it is told
 * to, and rolls on with a little friction when the stage is off. */
#ifndef TESTS_HAL_DRIVE_CIA402_QUIRK_SERVO_H
#define TESTS_HAL_DRIVE_CIA402_QUIRK_SERVO_H

#include "sim/bus/can.h"

#define QUIRK_OBJECTS 128
#define QUIRK_ANSWERS 8
#define QUIRK_LINGER  8

/* An object: index << 8 | sub. */
#define QUIRK_KEY(index, sub) ((uint32_t)(index) << 8 | (sub))

/* 6064 at the home place, with 0x607C given. */
enum quirk_offset { QUIRK_OFFSET_PLUS, QUIRK_OFFSET_MINUS, QUIRK_OFFSET_MOVES };

/* What happens by itself, so long after Operation enabled. */
enum quirk_event {
    QUIRK_NOTHING,
    QUIRK_LEAVES,   /* to Switch on disabled, without a word */
    QUIRK_EMCY,     /* 0x8130, without a fault */
    QUIRK_WARNS,    /* bit 7 for 20 ms */
    QUIRK_LIMITS,   /* bit 11 for 20 ms */
    QUIRK_LAGS,     /* bit 12 down for 20 ms */
    QUIRK_REBOOTS,  /* loses its power for 50 ms */
    QUIRK_NMT_DROP, /* to pre-operational, stage on */
    QUIRK_MUTE,     /* no TPDO any more */
    QUIRK_DEAF,     /* nor does it take SDOs */
};

/* All zero: a servo by the book. */
struct quirk_kind {
    uint32_t missing[12], read_only[4]; /* keys; 0 ends */
    struct {
        uint32_t key, value;
    } initial[8];
    struct {
        uint32_t key; /* written with another value: */
        uint32_t value, abort;
    } only[4];
    struct {
        uint32_t key, abort; /* neither read nor written */
    } refuses[4];
    struct {
        uint32_t key, abort;
        unsigned times; /* so often, then no more */
    } passing;
    /* NMT: so many starts are ignored; in Stopped it hears this command alone,
     * 0: any; it stops itself when its master is lost (0x1029:1 = 2) */
    unsigned starts_ignored;
    uint8_t wakes_by;
    bool stops_alone;
    /* A device of so many axes (CiA 301 7.5.2.1), of which this is one, from 0:
     * objects 0x800 further each, PDOs from number 64 n + 1 on, without a
     * COB-ID of their own.  The first has what is the node's.  0: a device of
     * one. */
    uint8_t axes, axis;
    uint32_t cob_bit_30; /* 1: must stay as it is, 06090030 else */
    /* must be set in what is written to 0x18xx:1, whatever stands there; must
     * be clear in 0x14xx:1 (CANopenNode PR 589 and 643) */
    bool tpdo_bit_30, rpdo_no_bit_30;
    bool cob_mute;     /* a COB-ID written is never answered (eRob) */
    bool guarding;     /* neither 0x1016 nor 0x1017; answers RTR */
    bool watches_late; /* its consumer waits for the first heartbeat */
    int64_t boot_ns, sdo_ns, mode_ns, precharge_ns, brake_ns, word_gap_ns;
    /* One thing at a time, and every so many answers one comes so much later */
    unsigned late_one_in;
    int64_t late_ns;
    /* Reads are answered by segments, even of one byte; with their size or not */
    enum { QUIRK_EXPEDITED, QUIRK_SEGMENTS, QUIRK_SEGMENTS_NO_SIZE } reads;
    unsigned linger; /* bits 10, 12, 13 are so many SYNCs old */
    bool beats_first, emcy_at_boot;
    bool re_enters;    /* after a quick stop, when the enable bits stay set */
    unsigned resets;   /* so many rising edges of bit 7 clear a fault */
    bool reset_by_nmt; /* after 0x8130 only after reset communication */
    bool mode_not_halted; /* 0x6060 is refused while bit 8 is up */
    bool no_bit_10;       /* in homing */
    bool ip_needs_3006;   /* mode 7 is refused unless 0x3006:3D is 1 */
    uint16_t status;      /* bits that are always up */
    enum quirk_event event;
    int64_t event_ns;
    /* homing */
    enum quirk_offset offset;
    bool limits_minus_offset; /* 0x607D is counted from 0x607C */
    bool old_bits; /* bits 10 and 12 of the last homing stay until its end */
    int64_t old_bits_ns;    /* or so long */
    int64_t old_reached_ns; /* bit 10 of the last profile stays so long */
    bool ignores_start;     /* bit 4 does nothing */
    int32_t home_wrong;     /* 6064 is so far off afterwards */
};

enum quirk_state {
    QUIRK_NOT_READY,
    QUIRK_DISABLED,
    QUIRK_READY,
    QUIRK_ON,
    QUIRK_OPERATION,
    QUIRK_QUICK_STOP,
    QUIRK_REACTION,
    QUIRK_FAULT,
};

struct quirk_object {
    uint32_t key;
    uint8_t size;
    bool read_only;
    uint32_t value;
};

struct quirk_servo {
    struct sim_member member;
    struct sim_can_port port;
    const struct quirk_kind *kind;
    uint8_t id;
    int64_t now_ns, due_ns, boot_ns;
    struct quirk_object object[QUIRK_OBJECTS];
    unsigned objects;

    /* CiA 301 */
    uint8_t nmt, toggle; /* nmt 0: boots */
    unsigned starts, passed;
    int64_t beat_ns, heard_ns, guarded_ns, sent_ns;
    struct {
        struct hal_can_frame frame;
        int64_t due_ns;
    } answer[QUIRK_ANSWERS];
    unsigned answers, answered;
    struct quirk_object segment;  /* to be read */
    struct hal_can_frame rpdo[4]; /* waits for SYNC */
    bool rpdo_waits[4];
    bool muted, deaf;

    /* CiA 402 */
    enum quirk_state state;
    int64_t state_ns, word_ns, operation_ns, mode_ns;
    uint16_t word; /* as last taken */
    int8_t mode;
    uint16_t old_status[QUIRK_LINGER];
    uint16_t bits; /* 10, 12, 13 as they are */
    unsigned edges;
    bool needs_nmt, event_done, voltage;
    bool connection_lost;

    /* motor: counts */
    double pos, vel, zero, from, to;
    int64_t to_ns;
    int32_t target; /* of the profile */
    bool jumps;     /* the set point, further than it can follow */
    bool moving;    /* by its profile */
    bool homing, homed;
    int64_t homing_ns, moving_ns;
    double home_place;

    /* what it saw */
    bool energised;
    bool requested;     /* by SDO, and has not answered */
    unsigned crowded;   /* requests before the answer to the one before */
    bool started_unset; /* NMT start before its PDOs and its mode were */
    bool coasted;       /* the stage went off at speed, without a fault */
    unsigned moves;
};

int quirk_servo_init(struct quirk_servo *servo, struct sim_can_bus *bus,
                     uint8_t id, const struct quirk_kind *kind);
/* NULL: it has none. */
struct quirk_object *quirk_servo_object(struct quirk_servo *servo,
                                        uint32_t key);
/* A fault of its own, with its emergency message: reaction by 0x605E. */
void quirk_servo_fault(struct quirk_servo *servo, uint16_t code);

/* ---- between its parts ---- */

uint32_t quirk_get(struct quirk_servo *servo, uint32_t key);
void quirk_put(struct quirk_servo *servo, uint32_t key, uint32_t value);
void quirk_send(struct quirk_servo *servo, uint32_t id, const void *data,
                unsigned len);
void quirk_emergency(struct quirk_servo *servo, uint16_t code);
void quirk_enter(struct quirk_servo *servo, enum quirk_state state);
void quirk_take_word(struct quirk_servo *servo, uint16_t word);
uint16_t quirk_status(const struct quirk_servo *servo);
void quirk_latch_bits(struct quirk_servo *servo);
void quirk_power_step(struct quirk_servo *servo);
void quirk_lose_connection(struct quirk_servo *servo);
/* 0, or the abort code. */
uint32_t quirk_write_mode(struct quirk_servo *servo, int8_t mode);
/* By this object, if it is the mode's. */
void quirk_set_target(struct quirk_servo *servo, uint32_t key);

#endif
