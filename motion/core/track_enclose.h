/* motion/core/track_enclose.h - between what f', f'' and f''' of a track lie over
 * a stretch of its time.
 *
 * Of each segment of the stretch its Taylor series at the middle of what lies in
 * it: with b[k] the coefficients there and d half of the width,
 *
 *     f'    b[1] +- (2 |b[2]| d + 3 |b[3]| d^2 + 4 |b[4]| d^3 + 5 |b[5]| d^4)
 *     f''   2 (b[2] +- (3 |b[3]| d + 6 |b[4]| d^2 + 10 |b[5]| d^3))
 *     f'''  6 (b[3] +- (4 |b[4]| d + 10 |b[5]| d^2))
 *
 * which holds at every time of it (the centred form; Moore, Interval Analysis
 * (1966), 6.4), and is off by the square of d, where f' or f'' has an extreme in
 * it.  In 32 bits: some 220 instructions of a Cortex-M4 per segment. */
#ifndef MOTION_CORE_TRACK_ENCLOSE_H
#define MOTION_CORE_TRACK_ENCLOSE_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/track.h"

/* What 1 of f', f'' and f''' is, as factors per power of a segment's duration. */
struct motion_track_unit {
    uint32_t factor[3];
    int16_t exponent[3];
};
/* From values in unit/s, unit/s2, unit/s3; of one that is 0 nothing is told.
 * Divides. */
void motion_track_unit_init(struct motion_track_unit *unit,
                            const int64_t one_q32[3]);

/* Q30; beyond +-1 it is cut to that. */
struct motion_range {
    int32_t low, high;
};
#define MOTION_RANGE_ONE ((int32_t)1 << 30)

/* Widens the ranges of f', f'' and f''' by what they are from *from_ns_q12 on, as
 * far as one segment and to_ns_q12 (after it) reach, to where *from_ns_q12 is
 * moved.  Before its start and after its end a track stands.  False: the window
 * does not hold that.  Beyond 1 by rounding, 2^-24 of it at most, is within 1.
 * On the tick. */
bool motion_track_enclose(const struct motion_track *track,
                          struct motion_cursor *cursor,
                          const struct motion_track_unit *unit,
                          int64_t *from_ns_q12, int64_t to_ns_q12,
                          struct motion_range range[3]);

#endif
