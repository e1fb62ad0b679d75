/* motion/plan/plan_bound.c - see plan_bound.h.
 *
 * In double, of which every number here is a sum of some 20 terms, off by less
 * than 2^-47 of their sizes; a sample rounds to 2 of its segment's steps. */
#include "motion/plan/plan_bound.h"

#include "motion/core/fixed.h"

#define BOUND_ROUNDING 0x1p-47
#define BOUND_UNITS    4
#define BOUND_MOST     0x1p62

/* The powers of u of a segment, or of a derivative, in units of its format. */
struct bound_polynomial {
    double power[MOTION_TRACK_DEGREE + 1];
    double rate; /* du / dt, of 1 s */
};

static struct bound_polynomial
bound_polynomial(const struct motion_segment *segment)
{
    struct bound_polynomial p = { .rate = (double)MOTION_FIXED_S_Q12 /
                                          (double)segment->dur_ns_q12 };
    double scale = segment->frac >= 0
                       ? 1 / (double)(INT64_C(1) << segment->frac)
                       : (double)(INT64_C(1) << -segment->frac);

    for (int k = 0; k <= MOTION_TRACK_DEGREE; k++, scale /= 2)
        p.power[k] = (double)segment->coef[k] * scale;
    if (segment->frac <= 0)
        p.power[1] += segment->remainder;
    return p;
}

static void bound_derive(struct bound_polynomial *p)
{
    for (int k = 1; k <= MOTION_TRACK_DEGREE; k++)
        p->power[k - 1] = p->power[k] * (k * p->rate);
    p->power[MOTION_TRACK_DEGREE] = 0;
}

static int64_t bound_whole(double value, int64_t beyond)
{
    const double most = BOUND_MOST;

    return value >= most    ? (beyond > 0 ? beyond : (int64_t)most)
           : value <= -most ? (beyond < 0 ? beyond : -(int64_t)most)
                            : (int64_t)value;
}

/* Ordinates b_j = sum C(j, k) / C(n, k) power_k; the first and the last are the
 * values at the ends. */
static struct plan_bound bound_range(const struct motion_segment *segment,
                                     const struct bound_polynomial *p,
                                     enum motion_quantity quantity)
{
    static const double
        over_choose[MOTION_JERK + 1][MOTION_TRACK_DEGREE + 1] = {
            { 1, 1.0 / 5, 1.0 / 10, 1.0 / 10, 1.0 / 5, 1 },
            { 1, 1.0 / 4, 1.0 / 6, 1.0 / 4, 1 },
            { 1, 1.0 / 3, 1.0 / 3, 1 },
            { 1, 1.0 / 2, 1 },
        };
    const int n = MOTION_TRACK_DEGREE - (int)quantity;
    const double from = quantity == MOTION_POS ? (double)segment->pos_q32 : 0;
    const double coarse = segment->frac < 0 ? 1 << -segment->frac : 1;
    double point[MOTION_TRACK_DEGREE + 1] = { 0 };
    double size = from < 0 ? -from : from;

    for (int k = 0; k <= n; k++) {
        size += p->power[k] < 0 ? -p->power[k] : p->power[k];
        point[k] = p->power[k] * over_choose[quantity][k];
    }
    for (int i = 1; i <= n; i++)
        for (int k = n; k >= i; k--)
            point[k] += point[k - 1];

    double low = point[0], high = point[0];
    for (int k = 1; k <= n; k++) {
        low = point[k] < low ? point[k] : low;
        high = point[k] > high ? point[k] : high;
    }
    const double margin = size * BOUND_ROUNDING + BOUND_UNITS * coarse;
    return (struct plan_bound){ bound_whole(from + low - margin, INT64_MIN),
                                bound_whole(from + high + margin, INT64_MAX),
                                from + point[0], from + point[n], margin };
}

struct plan_bound plan_segment_bound(const struct motion_segment *segment,
                                     enum motion_quantity quantity)
{
    struct bound_polynomial p = bound_polynomial(segment);

    for (int q = MOTION_POS; q < (int)quantity; q++)
        bound_derive(&p);
    return bound_range(segment, &p, quantity);
}

void plan_segment_bounds(const struct motion_segment *segment,
                         struct plan_bound bound[MOTION_JERK + 1])
{
    struct bound_polynomial p = bound_polynomial(segment);

    for (int q = MOTION_POS; q <= MOTION_JERK; q++) {
        if (q > MOTION_POS)
            bound_derive(&p);
        bound[q] = bound_range(segment, &p, (enum motion_quantity)q);
    }
}

void plan_track_extreme(const struct motion_track *track,
                        enum motion_quantity quantity,
                        struct motion_extreme *extreme)
{
    if (track->outline != NULL || track->count == 0) {
        motion_track_extreme(track, quantity, extreme);
        return;
    }
    motion_segment_extreme(&track->segment[0], quantity, extreme);
    for (uint32_t i = 1; i < track->count; i++) {
        const struct motion_segment *segment = &track->segment[i];
        const struct plan_bound bound = plan_segment_bound(segment, quantity);
        struct motion_extreme own;

        if (bound.low >= extreme->min && bound.high <= extreme->max)
            continue;
        motion_segment_extreme(segment, quantity, &own);
        if (own.min < extreme->min) {
            extreme->min = own.min;
            extreme->min_ns_q12 = own.min_ns_q12;
        }
        if (own.max > extreme->max) {
            extreme->max = own.max;
            extreme->max_ns_q12 = own.max_ns_q12;
        }
    }
}
