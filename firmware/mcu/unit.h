/* firmware/mcu/unit.h - a board that moves axes: the controller, a window of
 * the uploaded move and a drive per axis, and a log of its set points.
 *
 * Independent of the processor: the image of a board calls mcu_unit_tick from its timer
 * and everything else from its main loop, between hold and release, which keep
 * the tick away.  On a PC nothing interrupts and both may be NULL. */
#ifndef FIRMWARE_MCU_UNIT_H
#define FIRMWARE_MCU_UNIT_H

#include "firmware/control/controller.h"
#include "firmware/mcu/servos.h"
#include "firmware/mcu/window.h"
#include "hal/drive/virtual/drive.h"

/* What a board is made with; stays the caller's. */
struct mcu_unit_config {
    int64_t period_ns;
    uint16_t board;              /* docs/MCU.md */
    struct motion_segment *ring; /* MCU_AXES_MAX * 2 * window */
    uint32_t window;             /* segments; a power of two, 8 .. 32768 */
    int64_t *log;                /* log_words */
    uint32_t log_words;
    struct mcu_servos *servos; /* NULL: no port to servo drives */
    /* sets that port up; MOTION_E_ARG: it has no such line */
    int (*open_line)(const struct modbus_rtu_line *line);
    void (*hold)(void), (*release)(void);
    uint32_t (*stack_free)(void); /* words never used; NULL: not known */
    int64_t (*now_ns)(void);      /* NULL: that of the last tick */
};

/* One tick's set points, in the order of ticks: the path's time, then one per
 * axis.  The log is as long as its memory and forgets the oldest; its checksum
 * is that of all entries ever, so that whoever knows what they should be can
 * tell whether they were. */
struct mcu_log {
    int64_t *word;
    uint32_t stride, capacity; /* words of an entry; entries */
    uint32_t slot;             /* of the next entry */
    uint32_t next;             /* entries since it was cleared; wraps */
    uint32_t held;             /* of them, there are */
    uint32_t crc;              /* CRC-32 of them, little-endian */
};

struct mcu_unit {
    const struct mcu_unit_config *config;
    struct controller controller;
    unsigned axis_count; /* 0: not set up */
    uint32_t tick;       /* since power came; wraps */
    int64_t tick_ns;     /* its time */
    int32_t clock_ppb;   /* its ticks come faster by so much, 1e-9; the board's
                            timer looks at it after every tick */
    uint32_t began;      /* the tick of the last move's first set point */
    struct controller_axis axis[MCU_AXES_MAX];
    struct controller_axis_config axis_config[MCU_AXES_MAX];
    struct drive_virtual_bus bus;
    struct drive_virtual drive[MCU_AXES_MAX]; /* where `driven` has no bit */
    uint16_t driven; /* bit per axis: a servo on the line */
    struct mcu_window window[MCU_AXES_MAX];
    struct mcu_log log;
};

void mcu_unit_init(struct mcu_unit *unit, const struct mcu_unit_config *config);

/* The following return MOTION_OK or an error, and have changed nothing then. */

/* No axes.  MOTION_E_STATE unless off and without torque. */
int mcu_unit_clear(struct mcu_unit *unit);
/* New axes, off, without a move; driven: bit per axis, its servo is on the
 * line, as config->servos describes it.  MOTION_E_STATE unless off and without
 * torque; MOTION_E_ARG: controller_init says so, or count not 1 ..
 * MCU_AXES_MAX.  When the line or a drive on it cannot be so, mcu_servos_start's
 * errors, and there are no axes then. */
int mcu_unit_set_up(struct mcu_unit *unit, unsigned count,
                    const struct mcu_setup setup[], uint16_t driven);
/* Is a move being played, or stopped? */
bool mcu_unit_is_moving(const struct mcu_unit *unit);
/* Play what the windows hold.  MOTION_E_AGAIN: not all of it, or less than
 * fits, is there, or its beginning is not there any more; else
 * controller_start. */
int mcu_unit_start(struct mcu_unit *unit);

/* The tick, at nominal time now_ns (controller.h). */
void mcu_unit_tick(struct mcu_unit *unit, int64_t now_ns);

/* Entry `index` of the log, counted since it was cleared; NULL: not there. */
const int64_t *mcu_log_entry(const struct mcu_log *log, uint32_t index);
uint32_t mcu_log_first(const struct mcu_log *log);

/* Keep the tick away, and let it come. */
void mcu_unit_hold(const struct mcu_unit *unit);
void mcu_unit_release(const struct mcu_unit *unit);

#endif
