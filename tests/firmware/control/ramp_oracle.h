/* tests/firmware/control/ramp_oracle.h - the shortest slow-down by brute force,
 * in double.
 *
 * r'' is -J0 until r' is 0, where it was above, then -J, 0 and J with |r'| <=
 * A.  Every such ramp of a fine grid is judged by itself, from the tracks
 * alone, by dense sampling, and at both sides of every border of segments, of
 *     p' = f' r     p'' = f'' r^2 + f' r'     p''' = f''' r^3 + 3 f'' r r' + f' r''
 * In reverse f' and f''' are the negative.  Only the piece that brings r' to 0 counts
 * in ticks (oracle_level). */
#ifndef TESTS_FIRMWARE_CONTROL_RAMP_ORACLE_H
#define TESTS_FIRMWARE_CONTROL_RAMP_ORACLE_H

#include <stdlib.h>

#include "tests/firmware/control/ramp_bench.h"

#define ORACLE_SAMPLES 400   /* evenly, and both sides of where r'' jumps */
#define ORACLE_STEP    0.125 /* of an octave, of A and of J */
#define ORACLE_GRID    128

struct oracle_piece {
    double t, jerk;
};

struct oracle_ramp {
    double s, r, a; /* path time in s, rate, r' where it begins */
    struct oracle_piece piece[4];
};

static inline double oracle_duration(const struct oracle_ramp *ramp)
{
    double t = 0;
    for (int i = 0; i < 4; i++)
        t += ramp->piece[i].t;
    return t;
}

/* The clock t into a piece. */
struct oracle_clock {
    double s, r, a, jerk;
};

static inline struct oracle_clock oracle_at(const struct oracle_clock *from,
                                            double t)
{
    const double j = from->jerk;
    return (struct oracle_clock){
        from->s + t * (from->r + t * (from->a / 2 + t * j / 6)),
        from->r + t * (from->a + t * j / 2), from->a + t * j, j
    };
}

/* One axis at one state of its track and of the clock. */
static inline bool oracle_keeps(const struct motion_clock_limit *limit,
                                const struct motion_state *f,
                                const struct oracle_clock *at)
{
    const double most = 1 + 1e-8, r = at->r;
    const double f1 = (double)f->vel_q32 * 0x1p-32;
    const double f2 = (double)f->acc_q32 * 0x1p-32;
    const double f3 = (double)f->jerk_q32 * 0x1p-32;
    const double vel = (double)limit->vel_q32 * 0x1p-32;
    const double acc = (double)limit->acc_q32 * 0x1p-32;
    const double third = (double)limit->jerk_q32 * 0x1p-32;
    return fabs(f1 * r) <= vel * most &&
           fabs(f2 * r * r + f1 * at->a) <= acc * most + 1e-6 &&
           (limit->jerk_q32 == 0 || fabs(f3 * r * r * r + 3 * f2 * r * at->a +
                                         f1 * at->jerk) <= third * most + 1e-6);
}

static inline void oracle_turn(const struct controller *c,
                               struct motion_state *f)
{
    if (!c->is_reversed)
        return;
    f->vel_q32 = -f->vel_q32;
    f->jerk_q32 = -f->jerk_q32;
}

/* On the path, where the clock that reads it is at s. */
static inline int64_t oracle_place(const struct controller *c, double s)
{
    const double end = (double)c->move_end_ns_q12;
    const double at = fmin(s * (double)MOTION_FIXED_S_Q12, end);
    return (int64_t)(c->is_reversed ? end - at : at);
}

/* Both sides of the borders of segments that the clock comes to in a piece:
 * p''' jumps there, and the next sample would see it late. */
static inline bool oracle_borders(const struct controller *c,
                                  const struct motion_track *track,
                                  const struct motion_clock_limit *limit,
                                  const struct oracle_clock *piece, double t1)
{
    const double unit = (double)MOTION_FIXED_S_Q12;
    const double s0 = piece->s * unit, s1 = oracle_at(piece, t1).s * unit;
    for (uint32_t i = 0; i < track->count; i++) {
        const struct motion_segment *segment = &track->segment[i];
        const int64_t path = segment->start_ns_q12 + segment->dur_ns_q12;
        const int64_t end = c->is_reversed ? c->move_end_ns_q12 - path : path;
        struct motion_state left, right;
        double low = 0, high = t1;
        if ((double)end <= s0 || (double)end > s1)
            continue;
        for (int n = 0; n < 50; n++) {
            const double t = (low + high) / 2;
            *(oracle_at(piece, t).s * unit < (double)end ? &low : &high) = t;
        }
        const struct oracle_clock at = oracle_at(piece, high);
        motion_segment_state(segment, segment->dur_ns_q12, &left);
        motion_track_state(track, path, &right);
        oracle_turn(c, &left);
        oracle_turn(c, &right);
        if (!oracle_keeps(limit, &left, &at) ||
            !oracle_keeps(limit, &right, &at))
            return false;
    }
    return true;
}

/* One axis at n + 1 times of a piece, and at the borders in it. */
static inline bool oracle_axis_fits(const struct controller *c, unsigned i,
                                    bool stop, const struct oracle_clock *piece,
                                    double t1, int n)
{
    const struct motion_track *track = c->axis[i].track;
    const struct motion_clock_limit *limit =
        stop ? &c->config.axis[i].stop : &c->config.axis[i].limit;
    for (int m = 0; m <= n && n > 0; m++) {
        const struct oracle_clock at = oracle_at(piece, t1 * m / n);
        struct motion_state f;
        motion_track_state(track, oracle_place(c, at.s), &f);
        oracle_turn(c, &f);
        if (!oracle_keeps(limit, &f, &at))
            return false;
    }
    return n == 0 || oracle_borders(c, track, limit, piece, t1);
}

static inline bool oracle_fits_by(const struct controller *c,
                                  const struct oracle_ramp *ramp, bool stop,
                                  double step)
{
    struct oracle_clock at = { ramp->s, ramp->r, ramp->a, 0 };
    for (int k = 0; k < 4; k++) {
        const double t1 = ramp->piece[k].t;
        at.jerk = ramp->piece[k].jerk;
        for (unsigned i = 0; i < c->config.axis_count; i++)
            if (c->axis[i].track &&
                !oracle_axis_fits(c, i, stop, &at, t1,
                                  t1 > 0 ? (int)(t1 / step) + 1 : 0))
                return false;
        at = oracle_at(&at, t1);
    }
    return true;
}

/* Few samples rule most ramps out; what they leave is judged at every tick: just
 * after its begin an axis may be over its limit for a few of them alone. */
static inline bool oracle_fits(const struct controller *c,
                               const struct oracle_ramp *ramp, bool stop)
{
    const double step = oracle_duration(ramp) / ORACLE_SAMPLES;
    const double tick = (double)c->config.period_ns * 1e-9;
    return oracle_fits_by(c, ramp, stop, step) &&
           (step <= tick || oracle_fits_by(c, ramp, stop, tick));
}

/* The largest J that brings r' > 0 to 0 in a whole number of ticks, from here or
 * after `first`; 0: none.  Ticks, because r'' of a ramp of the clock changes at
 * ticks alone (motion/core/clock_warp.h): where p''' falls behind a border of
 * segments, a level of 9.6 ticks may end just before it, and one of 10 just
 * after.  That is no ramp of the clock, and the next that fits may be far
 * longer.  Beyond 32 ticks they are tried a thirty-second apart. */
static inline double oracle_level(const struct controller *c, double s,
                                  double r, double a, struct oracle_piece first,
                                  bool stop)
{
    const double tick = (double)c->config.period_ns * 1e-9;
    const double from = a + first.t * first.jerk;
    for (int n = 1; n < 1 << 16; n += 1 + n / 32) {
        const double jerk = from / (n * tick);
        const struct oracle_ramp ramp = {
            s, r, a, { first, { n * tick, -jerk } }
        };
        if (oracle_fits(c, &ramp, stop))
            return jerk;
    }
    return 0;
}

/* From (r, r' <= 0) to rest within A and J; false: J is too small for r'. */
static inline bool oracle_rest(struct oracle_piece piece[3], double r, double a,
                               double most, double jerk)
{
    const double square = jerk * r + a * a / 2;
    const double peak = fmin(most, sqrt(square));
    if (sqrt(square) < -a)
        return false;
    const double first = fabs(peak + a) / jerk, last = peak / jerk;
    const double displacement = r - first * (peak - a) / 2 - last * peak / 2;
    piece[0] = (struct oracle_piece){ first, peak > -a ? -jerk : jerk };
    piece[1] = (struct oracle_piece){ fmax(displacement, 0) / peak, 0 };
    piece[2] = (struct oracle_piece){ last, jerk };
    return displacement > -1e-12;
}

static inline int oracle_compare(const void *a, const void *b)
{
    const double x = oracle_duration((const struct oracle_ramp *)a);
    const double y = oracle_duration((const struct oracle_ramp *)b);
    return (x > y) - (x < y);
}

/* The shortest of the grid that is shorter than `most` seconds; else `most`. */
static inline double oracle_shortest(const struct controller *c,
                                     const struct motion_clock_rate *from,
                                     bool stop, double most)
{
    static struct oracle_ramp ramp[ORACLE_GRID * ORACLE_GRID];
    const double tick = (double)c->config.period_ns * 1e-9;
    struct oracle_ramp start = { (double)from->s_ns_q12 /
                                     (double)MOTION_FIXED_S_Q12,
                                 (double)from->rate_q30 * 0x1p-30,
                                 (double)from->accel_q30 * 0x1p-30,
                                 { { 0, 0 } } };
    double r = start.r, a = start.a;
    if (a > 0) {
        const double jerk =
            oracle_level(c, start.s, r, a, (struct oracle_piece){ 0, 0 }, stop);
        if (jerk == 0)
            return most;
        start.piece[0] = (struct oracle_piece){ a / jerk, -jerk };
        r += a * a / (2 * jerk);
        a = 0;
    }
    const double least_a = r / most, least_j = r / (most * most);
    size_t count = 0;
    for (int n = 0; n < ORACLE_GRID; n++)
        for (int m = 0; m < ORACLE_GRID; m++) {
            const double accel = least_a * exp2(n * ORACLE_STEP);
            const double jerk = least_j * exp2(m * ORACLE_STEP);
            struct oracle_ramp *const at = &ramp[count];
            *at = start;
            if (accel <= 1 / (2 * tick) && jerk <= accel / (2 * tick) &&
                oracle_rest(&at->piece[1], r, a, accel, jerk) &&
                oracle_duration(at) < most)
                count++;
        }
    qsort(ramp, count, sizeof ramp[0], oracle_compare);
    for (size_t k = 0; k < count; k++)
        if (oracle_fits(c, &ramp[k], stop))
            return oracle_duration(&ramp[k]);
    return most;
}

#endif
