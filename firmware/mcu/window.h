/* firmware/mcu/window.h - one axis of an uploaded move: a ring of segments, of
 * which the track (track.h) is a window.
 *
 * Two sides:
 *     open, put   what receives: checks a segment and appends it
 *     advance     on the tick: lets go of what has been played and shows what
 *                 has come; never waits
 * The side that puts may be interrupted by the tick; open and show are called
 * when the tick cannot come between.
 *
 * Nothing is taken on trust: a segment begins when and where the one before
 * ends, leaves no format (motion_segment_restore), stays within the extremes
 * that the head states, and the last one ends as the head says. */
#ifndef FIRMWARE_MCU_WINDOW_H
#define FIRMWARE_MCU_WINDOW_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/mcu/piece.h"
#include "motion/core/track.h"

struct mcu_window {
    struct mcu_head head;
    struct motion_track track;
    struct motion_segment *ring; /* every segment twice, `capacity` apart, so
                                    that any run of them is in one piece */
    uint32_t capacity;           /* a power of two */
    _Atomic uint32_t first;      /* number of the first one kept; the tick's */
    _Atomic uint32_t filled;     /* one past the last; the receiver's */
    int64_t end_ns_q12;          /* of the last one put */
    struct motion_state end;
};

/* Empty.  `ring` has 2 * capacity segments, capacity a power of two >= 8. */
void mcu_window_init(struct mcu_window *window, struct motion_segment *ring,
                     uint32_t capacity);
/* Could a track have this head? */
bool mcu_head_is_sound(const struct mcu_head *head);
/* Empty, for the axis with this head, which is sound. */
void mcu_window_open(struct mcu_window *window, const struct mcu_head *head);

/* Append segments whose duration, pos, coef, remainder and frac are given.
 *   MOTION_E_FULL           no room for so many yet
 *   MOTION_E_ORDER          more than the axis has
 *   MOTION_E_DISCONTINUITY  not where the one before ends, or the last one not
 *                           as the head says
 *   MOTION_E_LIMIT          beyond the extremes of the head
 *   MOTION_E_ARG, _RANGE    motion_segment_restore
 * Then none of them has been appended.  Plan-time work. */
int mcu_window_put(struct mcu_window *window,
                   const struct motion_segment given[], unsigned count);

/* Are these the segments there are from `number` on, all of which have been put?
 * Those that have been played and let go are not looked at. */
bool mcu_window_has(const struct mcu_window *window, uint32_t number,
                    const struct motion_segment given[], unsigned count);

/* Segments that can be put now. */
uint32_t mcu_window_free(const struct mcu_window *window);
/* All of them are there, or as many as have room. */
bool mcu_window_is_ready(const struct mcu_window *window);

/* The track shows what there is, at most `most` segments. */
void mcu_window_show(struct mcu_window *window, uint32_t most);
/* On the tick. */
void mcu_window_advance(struct mcu_window *window, int64_t t_ns_q12);

#endif
