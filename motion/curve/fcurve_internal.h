/* motion/curve/fcurve_internal.h - what the files of fcurve.h share.
 *
 * Inside, times are counted in 2^-12 ns and positions in units. */
#ifndef MOTION_CURVE_FCURVE_INTERNAL_H
#define MOTION_CURVE_FCURVE_INTERNAL_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/curve/fcurve.h"
#include "motion/curve/times.h"
#include "motion/number/real.h"

/* Latest key and latest time; any difference of two is below 2^62. */
#define FCURVE_KEY_MAX_NS_Q12  ((int64_t)1 << 60)
#define FCURVE_TIME_MAX_NS_Q12 ((int64_t)1 << 61)

/* A value and its first two derivatives, by whatever is the variable. */
struct fcurve_jet {
    struct motion_real f, d, dd;
    bool steep; /* a derivative is infinite */
};

static inline struct motion_real fcurve_whole(int64_t a)
{
    return motion_real_int(a);
}

static inline struct motion_real fcurve_over(struct motion_real a, int64_t k)
{
    return motion_real_div(a, motion_real_int(k));
}

/* (to - from) / 2^bits, also where the difference leaves int64. */
struct motion_real fcurve_difference(int64_t to, int64_t from, int bits);

/* A time in a span of `dur`, 0 <= at <= dur.  Where a formula changes inside a
 * span, `inside` says which one is meant: that of the piece it lies in. */
struct fcurve_when {
    int64_t at, inside, dur;
};

/* Easing of kinds SINE .. ELASTIC from 0 to `change`; derivatives by at / dur.
 * ELASTIC does not quite reach its ends: Blender jumps to the key. */
struct fcurve_jet fcurve_ease(const struct motion_fcurve_key *key,
                              struct motion_real change,
                              const struct fcurve_when *when);

/* The times inside a span where the formula changes, rounded down, in order;
 * their number.  Derivatives may step there. */
#define FCURVE_BREAKS_MAX 7
int fcurve_ease_breaks(const struct motion_fcurve_key *key,
                       struct motion_real change, int64_t dur,
                       int64_t at[FCURVE_BREAKS_MAX]);

/* c1 u + c2 u^2 + c3 u^3 */
struct fcurve_cubic {
    struct motion_real c1, c2, c3;
};

/* A bezier span, u = 0 .. 1: the part of its duration and the change of the
 * value.  From its start on; or, `back`, from its end, how far before it and
 * how much is missing there. */
struct fcurve_bezier {
    struct fcurve_cubic x, y;
};
struct fcurve_bezier fcurve_bezier(const struct motion_fcurve_key *a,
                                   const struct motion_fcurve_key *b,
                                   bool back);

/* u where x(u) = x, from a u nearby, and such a one: to 28 bits as a rule, by
 * Newton's method in 64 bits. */
struct motion_real fcurve_bezier_invert(const struct fcurve_cubic *x_of,
                                        struct motion_real x,
                                        struct motion_real u);
struct motion_real fcurve_bezier_near(const struct fcurve_cubic *x_of,
                                      struct motion_real x);

struct motion_real fcurve_cubic_at(const struct fcurve_cubic *c,
                                   struct motion_real u);

/* y at u, with its derivatives by x. */
struct fcurve_jet fcurve_bezier_jet(const struct fcurve_bezier *z,
                                    struct motion_real u);
/* The same at a time, from the start; derivatives by at / dur. */
struct fcurve_jet fcurve_bezier_at(const struct motion_fcurve_key *a,
                                   const struct motion_fcurve_key *b,
                                   const struct fcurve_when *when);

/* Which lap of a cycle t is in (0 between the keys), and the time between the
 * keys that it shows; false where the curve is extrapolated. */
struct fcurve_lap {
    int64_t t, number;
    bool back, offset;
};
bool fcurve_place(const struct motion_fcurve *curve, int64_t t,
                  enum motion_fcurve_side side, struct fcurve_lap *lap);

/* The last key at or before t, where the limit from the left is meant the last
 * before it; never the very last. */
uint32_t fcurve_find(const struct motion_fcurve *curve, int64_t t, bool left);

/* Between two cuts; of the span that starts at `key`, or NULL beyond the keys,
 * and lies between two keys in the order of time, which errors name.  The value
 * is off by `residual` at the ends. */
struct fcurve_piece {
    const struct motion_fcurve *curve;
    const struct motion_fcurve_key *key;
    uint32_t first, last;
    bool is_back; /* the span is run through from its end, */
    int64_t span; /* from this time on */
    int64_t from, to;
    struct motion_fcurve_value start, end;
    struct motion_real shown; /* at the end */
    struct motion_real residual[2];
};

/* What the piece misses at its ends, spread evenly. */
void fcurve_add_residual(const struct fcurve_piece *piece, int64_t t,
                         struct motion_bake_point *point);

/* Append a piece of a bezier span, and how close it is.  MOTION_E_SINGULAR,
 * MOTION_E_TOLERANCE where it is too steep for this, and what motion_bake_append
 * says; the track may have grown then. */
int fcurve_bezier_bake(struct motion_track *track,
                       const struct fcurve_piece *piece,
                       const struct motion_bake_bound *within,
                       struct motion_bake_bound *bound);

/* Of the quintic from u = middle - half to middle + half: what it misses, per_s
 * being 1 s by the span's duration, and half of its part of that.  False where x
 * is bent too much to tell, or stands still: `half` alone is valid then. */
struct fcurve_bezier_bound {
    struct motion_real half;
    struct motion_bake_bound miss;
};
bool fcurve_bezier_bound(const struct fcurve_bezier *of,
                         struct motion_real middle, struct motion_real half,
                         struct motion_real per_s,
                         struct fcurve_bezier_bound *bound);

/* Second pass over handles that motion_fcurve_handles has computed. */
int fcurve_smooth(struct motion_fcurve *curve, bool cyclic,
                  struct motion_fcurve_work *work, uint32_t *failed);

/* key + (t, pos), rounded; MOTION_E_RANGE. */
struct fcurve_offset {
    struct motion_real t, pos;
};
int fcurve_put(struct motion_fcurve_point *handle,
               const struct motion_fcurve_point *key,
               struct fcurve_offset offset);
/* handle - key */
struct fcurve_offset fcurve_get(const struct motion_fcurve_point *handle,
                                const struct motion_fcurve_point *key);
/* The other handle, in line with this one, as long as it is. */
struct fcurve_offset fcurve_align(const struct motion_fcurve *curve,
                                  struct fcurve_offset along,
                                  struct fcurve_offset old);

#endif
