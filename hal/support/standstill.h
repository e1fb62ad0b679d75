/* hal/support/standstill.h - does an axis stand, by its positions as they come?
 *
 * For HAL_STANDSTILL_NS they have been no further apart than `near`, which is the
 * caller's: two counts, and what the slowest motion that counts as one makes in
 * that time.  A speed made of two readings would be as coarse as a count in the
 * time between them, and 0 where a motor that swings turns back. */
#ifndef HAL_SUPPORT_STANDSTILL_H
#define HAL_SUPPORT_STANDSTILL_H

#include <stdbool.h>
#include <stdint.h>

#define HAL_STANDSTILL_NS INT64_C(40000000)

struct hal_standstill {
    int64_t low, high, since_ns; /* all of them since then */
};

/* Begin where nothing is known of what was before. */
static inline void hal_standstill_begin(struct hal_standstill *self,
                                        int64_t place, int64_t t_ns)
{
    *self = (struct hal_standstill){ place, place, t_ns };
}

/* Begin at a place where it is taken to have stood. */
static inline void hal_standstill_rest(struct hal_standstill *self,
                                       int64_t place, int64_t t_ns)
{
    hal_standstill_begin(self, place, t_ns - HAL_STANDSTILL_NS);
}

/* Take in a position, measured at t_ns.  |place| below 2^62. */
static inline void hal_standstill_note(struct hal_standstill *self,
                                       int64_t place, int64_t near,
                                       int64_t t_ns)
{
    if (place < self->low)
        self->low = place;
    if (place > self->high)
        self->high = place;
    if (self->high - self->low > near)
        hal_standstill_begin(self, place, t_ns);
}

/* Every place is called otherwise from now on. */
static inline void hal_standstill_shift(struct hal_standstill *self, int64_t by)
{
    self->low += by;
    self->high += by;
}

/* Say whether it stood at t_ns, the time of the last position. */
static inline bool hal_standstill_is(const struct hal_standstill *self,
                                     int64_t t_ns)
{
    return t_ns - self->since_ns >= HAL_STANDSTILL_NS;
}

#endif
