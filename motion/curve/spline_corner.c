/* motion/curve/spline_corner.c - straight lines with rounded corners; see
 * spline.h.
 *
 *            ____   corner at (time, pos), rounded from time - half to time +
 *           /       half: velocity goes from m0 to m1 and the position by
 *      ____/        (m0 + m1) half
 *
 * An end that rests is a corner too, with velocity zero outside; its middle is
 * half a rounding inside the move, so that it begins or ends at the key. */
#include "motion/core/err.h"
#include "motion/curve/spline_internal.h"

struct corner_law {
    const struct motion_key *key;
    uint32_t count;
    int64_t half; /* wanted */
    bool smooth, rest_first, rest_last;
};

struct corner {
    int64_t time, half;
};

static int64_t corner_dur(const struct corner_law *law, uint32_t span)
{
    return law->key[span + 1].t_ns_q12 - law->key[span].t_ns_q12;
}

/* Within half of each span; at a resting end within a quarter, since it is
 * there twice. */
static struct corner corner_at(const struct corner_law *law, uint32_t i)
{
    struct corner corner = { law->key[i].t_ns_q12, 0 };

    if (i == 0 || i == law->count - 1) {
        if (i == 0 ? !law->rest_first : !law->rest_last)
            return corner;
        corner.half = motion_fixed_least(
            law->half, corner_dur(law, i == 0 ? 0 : i - 1) / 4);
        corner.time += i == 0 ? corner.half : -corner.half;
        return corner;
    }
    corner.half = motion_fixed_least(
        law->half,
        motion_fixed_least(corner_dur(law, i - 1), corner_dur(law, i)) / 2);
    return corner;
}

/* Velocity of the line after corner i. */
static struct motion_real corner_slope(const struct corner_law *law, uint32_t i)
{
    const struct motion_key ends[2] = {
        { .t_ns_q12 = corner_at(law, i).time, .pos_q32 = law->key[i].pos_q32 },
        { .t_ns_q12 = corner_at(law, i + 1).time,
          .pos_q32 = law->key[i + 1].pos_q32 },
    };

    return spline_chord(ends).vel;
}

static struct motion_real corner_seconds(int64_t dur)
{
    return motion_real_div(motion_real_int(dur),
                           motion_real_int(MOTION_FIXED_S_Q12));
}

static int corner_round(struct motion_track *track,
                        const struct corner_law *law, uint32_t i)
{
    const struct motion_real none = motion_real_zero();
    const struct motion_real vel[2] = {
        i == 0 ? none : corner_slope(law, i - 1),
        i == law->count - 1 ? none : corner_slope(law, i),
    };
    const struct motion_real acc[2] = { none, none };
    const struct corner corner = corner_at(law, i);
    const struct motion_real half = corner_seconds(corner.half);
    const struct motion_real dur = motion_real_twice(half);
    struct motion_u128 end =
        spline_fixed(law->key[i].pos_q32, motion_real_mul(vel[1], half));
    struct spline_poly poly = { .degree = 2 };
    struct motion_real displacement;

    if (i == law->count - 1)
        end = (struct motion_u128){ (uint64_t)law->key[i].pos_q32, 0 };
    displacement = spline_fixed_displacement(track, end);
    if (law->smooth) {
        poly = spline_quintic(displacement, dur, vel, acc);
    } else {
        poly.c[1] = motion_real_mul(dur, vel[0]);
        poly.c[2] = motion_real_sub(displacement, poly.c[1]);
    }
    return spline_emit(track, 2 * corner.half, &poly, (int64_t)end.hi, end.lo);
}

/* The straight part after corner i. */
static int corner_line(struct motion_track *track, const struct corner_law *law,
                       uint32_t i)
{
    const struct corner a = corner_at(law, i), b = corner_at(law, i + 1);
    const int64_t dur = b.time - b.half - (a.time + a.half);
    const struct motion_u128 end =
        spline_fixed(law->key[i + 1].pos_q32,
                     motion_real_neg(motion_real_mul(corner_slope(law, i),
                                                     corner_seconds(b.half))));
    struct spline_poly poly = { .degree = 1 };

    if (dur == 0)
        return MOTION_OK;
    poly.c[1] = spline_fixed_displacement(track, end);
    return spline_emit(track, dur, &poly, (int64_t)end.hi, end.lo);
}

static int corner_append(struct motion_track *track,
                         const struct corner_law *law, uint32_t *failed)
{
    int rc = MOTION_OK;

    for (uint32_t i = 0; rc == MOTION_OK && i < law->count; i++) {
        if (failed)
            *failed = i + 1 < law->count ? i : i - 1;
        if (corner_at(law, i).half > 0)
            rc = corner_round(track, law, i);
        if (rc == MOTION_OK && i + 1 < law->count)
            rc = corner_line(track, law, i);
    }
    return rc;
}

static bool corner_is_rule(enum motion_spline_end rule)
{
    return rule == MOTION_SPLINE_REST || rule == MOTION_SPLINE_ONE_SIDED;
}

int motion_spline_append_blended(struct motion_track *track,
                                 const struct motion_key *key, uint32_t count,
                                 int64_t blend_ns_q12, bool smooth,
                                 enum motion_spline_end first,
                                 enum motion_spline_end last, uint32_t *failed)
{
    const struct motion_track before = *track;
    const struct corner_law law = { key,
                                    count,
                                    blend_ns_q12 / 2,
                                    smooth,
                                    first == MOTION_SPLINE_REST,
                                    last == MOTION_SPLINE_REST };
    int rc = spline_order(key, count);

    if (failed)
        *failed = 0;
    if (rc != MOTION_OK)
        return rc;
    if (blend_ns_q12 < 0 || !corner_is_rule(first) || !corner_is_rule(last) ||
        track->end.pos_q32 != key[0].pos_q32 || track->end_frac != 0)
        return MOTION_E_ARG;
    if (count == 1)
        return MOTION_OK;
    rc = corner_append(track, &law, failed);
    if (rc != MOTION_OK)
        *track = before;
    return rc;
}
