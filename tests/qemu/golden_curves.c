/* tests/qemu/golden_curves.c - curves in space, speed laws along them, poses,
 * warped time and baking: the same bits on every machine.  See golden.c. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/curve/pose.h"
#include "motion/curve/time_warp.h"
#include "motion/number/elementary.h"
#include "motion/path/arclen.h"
#include "motion/path/path.h"
#include "motion/path/speed_law.h"
#include "tests/qemu/golden_tools.h"

#define UNIT     MOTION_FIXED_ONE_Q32
#define SECOND   MOTION_FIXED_S_Q12
#define AXES     2
#define PIECES   2
#define DEGREE   3
#define ROWS     48
#define LAW      16 /* segments */
#define CAPACITY 32
#define SAMPLES  300 /* of each track */

/* Shared: the smallest target has 32 KB. */
static struct motion_segment law_storage[LAW], storage[AXES][CAPACITY];
static struct motion_arclen_row row[ROWS];
static struct motion_real coef[PIECES * AXES * (DEGREE + 1)];
static struct motion_real border[PIECES + 1];
static int64_t knots[PIECES + 1], borders[PIECES + 1 + LAW];

static const struct motion_arclen_poly poly = { coef, DEGREE, AXES };
static const struct motion_arclen_curve curve = { AXES, PIECES, border,
                                                  motion_arclen_poly_at,
                                                  &poly };

/* --- elementary functions ------------------------------------------------- */

static uint32_t golden_elementary(void)
{
    struct motion_real sine, cosine;

    for (int i = 0; i < 400; i++) {
        struct motion_real a = golden_real(20 + (unsigned)(i % 24));
        golden_add_real(motion_elementary_exp2(a));
        motion_elementary_sincos(a, &sine, &cosine);
        golden_add_real(sine);
        golden_add_real(cosine);
        golden_add_real(motion_elementary_asin(motion_real_scale(a, -10)));
        golden_add_real(motion_real_sqrt(motion_real_abs(a)));
        golden_add_real(motion_real_cbrt(motion_real_abs(a)));
        golden_add_real(motion_real_div(sine, motion_real_abs(cosine)));
    }
    return 0;
}

/* --- curves in space ------------------------------------------------------ */

/* Two cubics; the second goes on where the first ends. */
static void golden_curve(void)
{
    struct motion_arclen_point end;

    for (int i = 0; i <= PIECES; i++)
        border[i] = motion_real_int(i);
    for (size_t i = 0; i < sizeof coef / sizeof coef[0]; i++)
        coef[i] = golden_real(39);
    motion_arclen_poly_at(&poly, 0, motion_real_int(1), 0, &end);
    for (int axis = 0; axis < AXES; axis++)
        coef[(AXES + axis) * (DEGREE + 1)] = end.pos[axis];
}

static void golden_add_point(const struct motion_arclen_point *point)
{
    for (int axis = 0; axis < AXES; axis++) {
        golden_add_real(point->pos[axis]);
        golden_add_real(point->d1[axis]);
        golden_add_real(point->d2[axis]);
    }
}

static int golden_table(struct motion_arclen_table *table)
{
    const int err =
        motion_arclen_build(table, &curve, motion_real_make(1, -24), row, ROWS);

    golden_add(err);
    return err;
}

static uint32_t golden_arclen(void)
{
    struct motion_arclen_table table;
    struct motion_arclen_measure measure;
    struct motion_arclen_place place;
    struct motion_arclen_point point;

    golden_curve();
    for (int rule = 0; rule < MOTION_ARCLEN_ADAPTIVE; rule++) {
        golden_add(motion_arclen_measure(&curve, (enum motion_arclen_rule)rule,
                                         8, &measure));
        golden_add_real(measure.length);
        golden_add_real(measure.error);
    }
    if (golden_table(&table) < 0)
        return 0;
    for (uint32_t i = 0; i < table.count; i++) {
        golden_add_real(row[i].x);
        golden_add_real(row[i].s);
    }
    for (int i = -1; i <= 9; i++) {
        motion_arclen_find(
            &table,
            motion_real_scale(motion_real_mul(table.length, motion_real_int(i)),
                              -3),
            &place);
        golden_add_real(place.x);
        golden_add_real(place.error);
        motion_arclen_by_length(&curve, place.piece, place.x, &point);
        golden_add_point(&point);
    }
    return table.count;
}

/* --- speed laws ----------------------------------------------------------- */

static void golden_add_track(const struct motion_track *track)
{
    golden_add_segments(track);
    golden_add_random_samples(track, SAMPLES);
}

/* Every kind over one length, then ramps of every kind up and down. */
static uint32_t golden_speed(void)
{
    static const struct motion_speed_point point[] = {
        { 0, { INT64_C(1) << 61, -61 } },
        { SECOND, { INT64_C(1) << 61, -60 } },
        { 3 * SECOND, { 0, MOTION_REAL_ZERO_E } },
    };
    struct motion_track law;
    uint32_t segments = 0;

    for (int kind = 0; kind < MOTION_SPEED_DRAWN; kind++) {
        const struct motion_real slow = motion_real_abs(golden_real(36));
        const struct motion_real fast = motion_real_abs(golden_real(38));
        struct motion_speed_part part = {
            .kind = (enum motion_speed_kind)kind,
            .dur_ns_q12 = SECOND + golden_below(SECOND),
            .length_q32 = UNIT + golden_below(100 * UNIT),
            .k1_q32 = UNIT / 4,
            .k2_q32 = UNIT / 2,
            .from = slow,
            .to = fast,
            .point = point,
            .points = sizeof point / sizeof point[0],
        };
        struct motion_speed_report report = { .error = motion_real_zero() };
        if (kind == MOTION_SPEED_ACC_POINTS)
            part.from = motion_real_zero();
        motion_track_init(&law, law_storage, LAW, 0);
        golden_add(motion_speed_append(&law, &part, 1, &report));
        golden_add_real(report.error);
        golden_add(motion_speed_check(&law));
        golden_add_track(&law);
        segments += law.count;
    }
    return segments;
}

static int golden_law(struct motion_track *law, struct motion_real length)
{
    struct motion_speed_part part = { .kind = MOTION_SPEED_QUINTIC,
                                      .dur_ns_q12 = 4 * SECOND };

    motion_track_init(law, law_storage, LAW, 0);
    golden_add(motion_real_round(length, 32, &part.length_q32));
    return motion_speed_append(law, &part, 1, NULL);
}

static uint32_t golden_path(void)
{
    const struct motion_path_tolerance tolerance = { motion_real_make(1, -4),
                                                     motion_real_zero(),
                                                     motion_real_zero() };
    struct motion_arclen_table table;
    struct motion_bake_report report = { .segments = 0 };
    struct motion_track law, track[AXES];
    struct motion_track *list[AXES] = { &track[0], &track[1] };
    struct motion_path path;

    golden_curve();
    for (int axis = 0; axis < AXES; axis++) {
        int64_t start;
        golden_add(motion_real_round(coef[axis * (DEGREE + 1)], 32, &start));
        motion_track_init(list[axis], storage[axis], CAPACITY, start);
    }
    if (golden_table(&table) < 0)
        return 0;
    golden_add(golden_law(&law, table.length));
    golden_add(motion_path_init(&path, &table, &law, knots, borders));
    golden_add(motion_path_bake(&path, &tolerance, list, &report));
    for (int axis = 0; axis < AXES; axis++) {
        golden_add_track(list[axis]);
        golden_add_bound(&report.bound[axis]);
    }
    return report.segments;
}

/* --- poses and warped time ------------------------------------------------ */

static void golden_move(struct motion_track *track, struct motion_segment *at,
                        uint32_t segments, int degree)
{
    motion_track_init(track, at, segments, golden_signed(38));
    for (uint32_t i = 0; i < segments; i++) {
        const int64_t dur = SECOND / 2 + golden_below(SECOND);
        const int64_t to = golden_signed(38);
        const struct motion_state end = { .pos_q32 = to };
        golden_add(degree > 1 ? motion_track_append_cubic(track, dur, 0, &end)
                              : motion_track_append_line(track, dur, to));
    }
}

static uint32_t golden_pose(void)
{
    struct motion_track a, b, weight, out;
    const struct motion_pose_term term[] = { { &a, UNIT / 3 },
                                             { &b, -UNIT / 7 } };
    struct motion_real bound = motion_real_zero();
    uint32_t segments;

    golden_move(&a, law_storage, 3, 3);
    golden_move(&b, law_storage + 3, 4, 3);
    motion_track_init(&out, storage[0], CAPACITY, 0);
    golden_add(motion_pose_sum(&out, golden_signed(36), term, 2));
    golden_add_track(&out);
    segments = out.count;
    golden_add(motion_pose_add(&out, &a, &b));
    golden_add_track(&out);

    for (int degree = 1; degree <= 3; degree += 2) {
        const struct motion_state whole = { .pos_q32 = UNIT };
        motion_track_init(&weight, law_storage + 7, 1, 0);
        golden_add(
            degree == 1
                ? motion_track_append_line(&weight, 2 * SECOND, UNIT)
                : motion_track_append_cubic(&weight, 2 * SECOND, 0, &whole));
        motion_track_init(&out, storage[0], CAPACITY, 0);
        golden_add(
            motion_pose_fade(&out, &a, &b, &weight, UNIT / 1000, &bound));
        golden_add_real(bound);
        golden_add_track(&out);
        segments += out.count;
    }
    return segments;
}

/* Half of f, slowly. */
static uint32_t golden_warp(void)
{
    struct motion_track f, w, out;
    struct motion_state state, end = { 0 };
    struct motion_real bound = motion_real_zero();

    golden_move(&f, law_storage, 1, 3);
    end.pos_q32 = motion_time_warp_ms(f.end_ns_q12 / 2);
    motion_track_init(&w, law_storage + 1, 1, 0);
    golden_add(motion_track_append_cubic(&w, 3 * SECOND, 0, &end));
    motion_time_warp_state(&f, &w, 0, &state);
    motion_track_init(&out, storage[0], AXES * CAPACITY, state.pos_q32);
    golden_add(motion_time_warp_append(&out, &f, &w, &bound));
    golden_add_real(bound);
    golden_add_track(&out);
    for (int i = 0; i < 20; i++) {
        motion_time_warp_state(&f, &w, golden_below(3 * SECOND), &state);
        golden_add_state(&state);
    }
    return out.count;
}

/* --- baking --------------------------------------------------------------- */

/* sin(x), x = t in quarter turns per second; and its derivatives. */
static int golden_wave(void *context, int64_t t_ns_q12,
                       enum motion_bake_side side,
                       struct motion_bake_point *point)
{
    const struct motion_real rate = motion_real_half(motion_elementary_pi());
    struct motion_real sine, cosine;

    (void)context;
    (void)side;
    motion_elementary_sincos(motion_bake_seconds(t_ns_q12), &sine, &cosine);
    point[0] = (struct motion_bake_point){ sine, motion_real_mul(rate, cosine),
                                           motion_real_neg(motion_real_mul(
                                               motion_real_sqr(rate), sine)) };
    return MOTION_OK;
}

static uint32_t golden_bake(void)
{
    static const int64_t ends[] = { 0, 3 * SECOND };
    const struct motion_bake job = {
        .source = { golden_wave, NULL },
        .axes = 1,
        .border_ns_q12 = ends,
        .borders = 2,
        .pos = motion_real_make(1, -18),
        .vel = motion_real_make(1, -10),
        .acc = motion_real_zero(),
    };
    struct motion_bake_report report = { .segments = 0 };
    struct motion_track track, *list[] = { &track };

    motion_track_init(&track, storage[0], CAPACITY, 0);
    golden_add(motion_bake(&job, list, &report));
    golden_add_bound(&report.bound[0]);
    golden_add(report.evaluations);
    golden_add_track(&track);
    return report.segments;
}

static const struct {
    const char *name;
    uint32_t (*run)(void); /* gives a count of segments */
} producers[] = {
    { "elementary", golden_elementary },
    { "arclen", golden_arclen },
    { "speed", golden_speed },
    { "path", golden_path },
    { "pose", golden_pose },
    { "time warp", golden_warp },
    { "bake", golden_bake },
};

int main(void)
{
    for (size_t i = 0; i < sizeof producers / sizeof producers[0]; i++) {
        golden_start(i + 1);
        const uint32_t segments = producers[i].run();
        golden_report(producers[i].name, segments);
    }
    return 0;
}
