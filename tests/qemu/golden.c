/* tests/qemu/golden.c - the same bits on every machine: tracks, splines, otg.
 *
 * Plans tracks on the target itself, samples them, and prints a hash per
 * producer of everything that came out.  `make golden` runs it on a PC (gcc
 * -O0 and -O2, clang) and in QEMU (Cortex-M0, Cortex-M4, RV32, RV64) and
 * compares the output.  To add a producer: a function and a row in `producers`
 * at the end. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/core/track.h"
#include "motion/curve/bake_poly.h"
#include "motion/curve/ease.h"
#include "motion/curve/spline.h"
#include "motion/otg/otg.h"
#include "motion/otg/sync.h"
#include "tests/bench/otg_random.h"
#include "tests/qemu/golden_tools.h"

#define CAPACITY 72
#define SAMPLES  14000 /* of each producer */
#define STATES   200
#define TRIES    1000 /* to append */

#define OTG_MOVES   2200
#define OTG_SAMPLES 50 /* of each */
#define OTG_AXES    3
#define OTG_GROUPS  150

#define OTG_WISHES   400
#define OTG_THROUGHS 10
#define OTG_POINTS   3
#define OTG_WAYS     2 /* axes through points */
#define OTG_LINES    60

#define UNIT   MOTION_FIXED_ONE_Q32
#define SECOND MOTION_FIXED_S_Q12

static struct motion_segment storage[CAPACITY];

static struct motion_state golden_state(unsigned pos_bits, unsigned vel_bits,
                                        unsigned acc_bits)
{
    struct motion_state state = { 0 };

    state.pos_q32 = golden_signed(pos_bits);
    state.vel_q32 = golden_signed(vel_bits);
    state.acc_q32 = golden_signed(acc_bits);
    return state;
}

/* --- what is hashed of a track -------------------------------------------- */

/* Forwards in even steps, with every eighth sample anywhere. */
static void golden_add_samples(const struct motion_track *track)
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;
    uint64_t step;
    struct motion_u128 end = { 0, (uint64_t)track->end_ns_q12 };

    motion_fixed_div_u128(end, SAMPLES - 2, &step, NULL);
    for (int i = 0; i < SAMPLES; i++) {
        int64_t t = (int64_t)step * (i - 1);
        if (i % 8 == 7)
            t = golden_below(track->end_ns_q12);
        motion_track_sample(track, &cursor, t, &sample);
        golden_add(sample.pos_q32);
        golden_add(sample.vel_q32);
        golden_add(sample.acc_q32);
    }
}

static void golden_add_states(const struct motion_track *track)
{
    struct motion_state state;

    for (int i = 0; i < STATES; i++) {
        motion_track_state(track, golden_below(track->end_ns_q12), &state);
        golden_add_state(&state);
    }
}

static void golden_add_extremes(const struct motion_track *track)
{
    static const enum motion_quantity quantity[] = { MOTION_POS, MOTION_VEL,
                                                     MOTION_ACC, MOTION_JERK };
    struct motion_extreme extreme;
    struct motion_continuity worst;

    for (size_t i = 0; i < sizeof(quantity) / sizeof(quantity[0]); i++) {
        motion_track_extreme(track, quantity[i], &extreme);
        golden_add(extreme.min);
        golden_add(extreme.max);
        golden_add(extreme.min_ns_q12);
        golden_add(extreme.max_ns_q12);
    }
    motion_track_continuity(track, &worst);
    golden_add((int64_t)worst.vel_step_q32);
    golden_add((int64_t)worst.acc_step_q32);
}

/* --- producers: each appends to a track until it says no ------------------ */

static int golden_lines(struct motion_track *track)
{
    if (track->count >= 40)
        return MOTION_E_FULL;
    int64_t dur = 1 + golden_below(4 * SECOND);
    if (track->count % 4 == 3)
        return motion_track_append_dwell(track, dur);
    return motion_track_append_line(track, dur, golden_signed(40));
}

static int golden_cubics(struct motion_track *track)
{
    struct motion_state end = golden_state(44, 36, 1);
    int64_t dur = SECOND / 100 + golden_below(SECOND);

    if (track->count >= 30)
        return MOTION_E_FULL;
    return motion_track_append_cubic(track, dur, track->end.vel_q32, &end);
}

static int golden_quintics(struct motion_track *track)
{
    struct motion_state end = golden_state(42, 38, 22);

    if (track->count >= 30)
        return MOTION_E_FULL;
    return motion_track_append_quintic(track, SECOND + golden_below(9 * SECOND),
                                       &track->end, &end);
}

/* Raw coefficients, with fractions below 2^-32 at the borders. */
static int golden_polys(struct motion_track *track)
{
    int64_t coef[MOTION_TRACK_DEGREE];
    int64_t dur = 1 + golden_below(60 * SECOND);
    int64_t end = track->end.pos_q32 + golden_signed(36);

    if (track->count >= 30)
        return MOTION_E_FULL;
    for (int k = 0; k < MOTION_TRACK_DEGREE; k++)
        coef[k] = golden_signed(50);
    return motion_track_append_poly(track, dur, 1 + (int)(track->count % 5),
                                    coef, 15, end, golden_random());
}

/* Every size of span and travel; what does not fit is a result too. */
static int golden_extremes(struct motion_track *track)
{
    int start_order = 1 + (int)golden_below(3);
    int end_order = 1 + (int)golden_below(3);
    unsigned far = 1 + (unsigned)golden_below(60);
    unsigned shift = 4 + (unsigned)golden_below(58);
    int64_t dur = (int64_t)(golden_random() >> shift);
    struct motion_state start = golden_state(1, 40, 30);
    struct motion_state end = golden_state(far, 40, 30);

    if (track->count >= 60)
        return MOTION_E_FULL;
    int err = motion_track_append_constraints(track, dur, start_order, &start,
                                              end_order, &end);
    golden_add(err);
    return MOTION_OK;
}

/* A six-hour move. */
static int golden_long(struct motion_track *track)
{
    const struct motion_state end = { .pos_q32 = 2400 * UNIT };

    if (track->count >= 1)
        return MOTION_E_FULL;
    return motion_track_append_quintic(track, 6 * 3600 * SECOND, &track->end,
                                       &end);
}

/* The three laws in turn, with ramps of every share. */
static int golden_eases(struct motion_track *track)
{
    int64_t k1 = golden_below(UNIT + 1);
    int64_t k2 = k1 + golden_below(UNIT + 1 - k1);
    int64_t dur = SECOND / 10 + golden_below(20 * SECOND);
    int64_t to = golden_signed(42);

    return motion_ease_append(track, (enum motion_ease_law)(track->count % 3),
                              to, dur, k1, k2);
}

static int golden_limited(struct motion_track *track)
{
    struct motion_ease_limit limit;

    limit.vel_q32 = 1 + golden_below(500 * UNIT);
    limit.acc_q32 = MOTION_FIXED_ONE_Q32 + golden_below(INT64_C(1) << 44);
    limit.jerk_q32 = golden_below(INT64_C(1) << 48);
    if (track->count % 2 == 0)
        limit.jerk_q32 = 0;
    return motion_ease_append_limited(track, golden_signed(42), &limit);
}

#define KEYS 16

/* Shared: the smallest target has 16 KB. */
static struct motion_key key[KEYS];
static struct motion_spline_work work[KEYS];

static void golden_keys(const struct motion_track *track)
{
    key[0] = (struct motion_key){ .t_ns_q12 = track->end_ns_q12,
                                  .pos_q32 = track->end.pos_q32 };
    for (int i = 1; i < KEYS; i++) {
        key[i] = (struct motion_key){ .pos_q32 = golden_signed(42) };
        key[i].t_ns_q12 =
            key[i - 1].t_ns_q12 + SECOND / 50 + golden_below(5 * SECOND);
    }
}

static int golden_cardinals(struct motion_track *track)
{
    int err;

    golden_keys(track);
    err = motion_spline_tangents_cardinal(key, KEYS, golden_below(2 * UNIT),
                                          MOTION_SPLINE_REST,
                                          MOTION_SPLINE_NATURAL);
    return err < 0 ? err : motion_spline_append_cubic(track, key, KEYS, NULL);
}

static int golden_parabolas(struct motion_track *track)
{
    const enum motion_spline_end end = MOTION_SPLINE_ONE_SIDED;
    int err;

    golden_keys(track);
    err = motion_spline_tangents_parabola(key, KEYS, end, end);
    if (err == MOTION_OK)
        err = motion_spline_accelerations(key, KEYS, end, end);
    return err < 0 ? err : motion_spline_append_quintic(track, key, KEYS, NULL);
}

static int golden_c2(struct motion_track *track)
{
    int err;

    golden_keys(track);
    err = motion_spline_c2(key, KEYS, MOTION_SPLINE_NOT_A_KNOT,
                           MOTION_SPLINE_NATURAL, work);
    return err < 0 ? err : motion_spline_append_cubic(track, key, KEYS, NULL);
}

static int golden_c4(struct motion_track *track)
{
    int err;

    golden_keys(track);
    err = motion_spline_c4(key, KEYS, MOTION_SPLINE_REST,
                           MOTION_SPLINE_NOT_A_KNOT, work);
    return err < 0 ? err : motion_spline_append_quintic(track, key, KEYS, NULL);
}

static int golden_local(struct motion_track *track)
{
    const enum motion_spline_end end = MOTION_SPLINE_ONE_SIDED;
    int err;

    golden_keys(track);
    err = track->count % 2 ? motion_spline_akima(key, KEYS, end, end)
                           : motion_spline_monotone(key, KEYS, end, end);
    return err < 0 ? err : motion_spline_append_cubic(track, key, KEYS, NULL);
}

static int golden_bsplines(struct motion_track *track)
{
    golden_keys(track);
    return motion_spline_append_bspline(track, key, KEYS, MOTION_SPLINE_REST,
                                        MOTION_SPLINE_NATURAL, NULL);
}

/* Degree 12, a few quintics each. */
static int golden_baked(struct motion_track *track)
{
    const struct motion_bake_poly_tolerance allowed = { motion_real_make(1, -4),
                                                        motion_real_int(1),
                                                        motion_real_int(100) };
    static struct motion_bake_poly poly;
    struct motion_real bound = motion_real_zero();
    int err;

    poly = (struct motion_bake_poly){ .base_q32 = track->end.pos_q32,
                                      .degree = 12,
                                      .c = { motion_real_zero() } };
    for (int k = 1; k <= poly.degree; k++)
        poly.c[k] = motion_real_from_q(golden_signed(38), 32);
    err = motion_bake_poly_append(track, SECOND + golden_below(4 * SECOND),
                                  &poly, NULL, &allowed, &bound);
    golden_add(bound.m);
    return err;
}

static const struct {
    const char *name;
    int (*append)(struct motion_track *track); /* negative: no more */
} producers[] = {
    { "lines", golden_lines },
    { "cubics", golden_cubics },
    { "quintics", golden_quintics },
    { "polys", golden_polys },
    { "extremes", golden_extremes },
    { "six hours", golden_long },
    { "eases", golden_eases },
    { "limited eases", golden_limited },
    { "cardinal splines", golden_cardinals },
    { "quintic splines", golden_parabolas },
    { "c2 splines", golden_c2 },
    { "c4 splines", golden_c4 },
    { "local splines", golden_local },
    { "b-splines", golden_bsplines },
    { "baked", golden_baked },
};

/* --- arithmetic that tracks do not reach ---------------------------------- */

static void golden_fixed(void)
{
    int64_t sine, cosine, result = 0;

    for (int i = 0; i < 2000; i++) {
        int64_t a = golden_signed(63);
        int64_t b = golden_signed(63);
        int64_t c = golden_signed(63);
        struct motion_u128 square = { (uint64_t)a, (uint64_t)b };

        motion_fixed_sincos_q62(golden_random() >> 2, &sine, &cosine);
        golden_add(sine);
        golden_add(cosine);
        golden_add(motion_fixed_muldiv(a, b, c, &result));
        golden_add(result);
        golden_add((int64_t)motion_fixed_isqrt_u128(square));
    }
}

/* --- the planner ---------------------------------------------------------- */

/* Few: there are 32 KB for them and the stack. */
static struct motion_otg_move golden_move[OTG_AXES];
static struct motion_otg_plan golden_plan[OTG_POINTS * OTG_WAYS];

static void golden_add_plan(const struct motion_otg_plan *plan)
{
    golden_add(plan->dur_ns_q12);
    golden_add(plan->goal_pos_q32);
    golden_add(plan->acc_bits);
    for (int i = 0; i < plan->count; i++) {
        golden_add(plan->phase[i].dur_ns_q12);
        golden_add(plan->phase[i].acc);
    }
}

static void golden_add_move(const struct motion_otg_plan *plan)
{
    struct motion_track track;

    golden_add_plan(plan);
    motion_track_init(&track, storage, CAPACITY, plan->start_pos_q32);
    golden_add(motion_otg_append(plan, &track));
    golden_add_random_samples(&track, OTG_SAMPLES);
}

/* Velocity goals, durations longer than need be, a jerk of slowing down. */
static void golden_otg_wishes(uint64_t *seed)
{
    for (uint32_t row = 0; row < OTG_WISHES; row++) {
        otg_random_move(seed, otg_random_kind(row), &golden_move[0]);
        golden_move[0].limit.jerk_down_q32 =
            row % 3 ? 0 : golden_move[0].limit.jerk_q32 / 2 + 1;
        golden_move[0].mode =
            row % 2 ? MOTION_OTG_VELOCITY : MOTION_OTG_POSITION;
        golden_add(motion_otg_make(&golden_move[0], &golden_plan[0], NULL));
        golden_add_plan(&golden_plan[0]);
        if (row % 2)
            continue;
        golden_move[0].dur_ns_q12 =
            golden_plan[0].dur_ns_q12 + (golden_plan[0].dur_ns_q12 >> row % 5);
        golden_add(motion_otg_make(&golden_move[0], &golden_plan[0], NULL));
        golden_add(golden_plan[0].dur_ns_q12);
    }
}

/* A staircase of points, passed without stopping. */
static void golden_otg_through(uint64_t *seed)
{
    struct motion_otg_point point[OTG_POINTS * OTG_WAYS];
    struct motion_otg_limit limit[OTG_WAYS];
    struct motion_state start[OTG_WAYS];

    for (uint32_t group = 0; group < OTG_THROUGHS; group++) {
        otg_random_moves(seed, 0, OTG_WAYS, golden_move);
        for (int i = 0; i < OTG_WAYS; i++) {
            limit[i] = golden_move[i].limit;
            start[i] = golden_move[i].start;
            int64_t step =
                (golden_move[i].goal.pos_q32 - golden_move[i].start.pos_q32) >>
                2;
            for (int k = 0; k < OTG_POINTS; k++)
                point[k * OTG_WAYS + i] = (struct motion_otg_point){
                    start[i].pos_q32 + step * (k + 1), 0, false
                };
        }
        golden_add(motion_otg_through(start, limit, OTG_WAYS, point, OTG_POINTS,
                                      golden_plan, NULL, NULL));
        for (int k = 0; k < OTG_POINTS * OTG_WAYS; k++) {
            golden_add(point[k].vel_q32);
            golden_add_plan(&golden_plan[k]);
        }
    }
}

/* A straight line, where there is one. */
static void golden_otg_line(uint64_t *seed)
{
    for (uint32_t row = 0; row < OTG_LINES; row++) {
        otg_random_moves(seed, 0, OTG_AXES, golden_move); /* rest to rest */
        golden_add(motion_sync_make(golden_move, OTG_AXES, MOTION_SYNC_STRAIGHT,
                                    golden_plan, NULL));
        for (int i = 0; i < OTG_AXES; i++)
            golden_add_plan(&golden_plan[i]);
    }
}

static void golden_otg(void)
{
    uint64_t seed = 1;

    for (uint32_t row = 0; row < OTG_MOVES; row++) {
        otg_random_move(&seed, otg_random_kind(row), &golden_move[0]);
        golden_add(motion_otg_make(&golden_move[0], &golden_plan[0], NULL));
        golden_add_move(&golden_plan[0]);
    }
    for (uint32_t row = 0; row < OTG_GROUPS; row++) {
        otg_random_moves(&seed, row, OTG_AXES, golden_move);
        golden_add(motion_sync_make(golden_move, OTG_AXES, MOTION_SYNC_TIME,
                                    golden_plan, NULL));
        for (int i = 0; i < OTG_AXES; i++)
            golden_add_plan(&golden_plan[i]);
    }
    golden_otg_wishes(&seed);
    golden_otg_through(&seed);
    golden_otg_line(&seed);
}

int main(void)
{
    struct motion_track track;

    golden_start(99);
    golden_fixed();
    golden_report("fixed", 0);
    golden_start(100);
    golden_otg();
    golden_report("otg", 0);
    for (size_t i = 0; i < sizeof(producers) / sizeof(producers[0]); i++) {
        golden_start(i + 1);
        motion_track_init(&track, storage, CAPACITY, golden_signed(40));
        for (int n = 0; n < TRIES && producers[i].append(&track) >= 0; n++) {
        }
        golden_add_segments(&track);
        golden_add_samples(&track);
        golden_add_states(&track);
        golden_add_extremes(&track);
        golden_report(producers[i].name, track.count);
    }
    return 0;
}
