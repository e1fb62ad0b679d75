/* tests/firmware/host/exchange/test_otg_motion.c - several rows as one motion,
 * judged by integrating its phases. */
#include "tests/support/check.h"

#include <math.h>
#include <string.h>

#include "firmware/host/exchange/otg_motion.h"

#define LEGS  6
#define CASES 150

static double between(double low, double high)
{
    return low + (double)draw_unit() * (high - low);
}

static void draw_limits(double value[OTG_VALUES], double unit)
{
    value[OTG_VMAX] = unit * between(1, 20);
    value[OTG_VMIN] = -unit * between(1, 20);
    value[OTG_AMAX] = unit * between(1, 50);
    value[OTG_AMIN] = -unit * between(1, 50);
    value[OTG_JMAX] = unit * between(1, 500);
    value[OTG_JDOWN] = 0;
}

static struct otg_header header_of(enum otg_table table, int axes)
{
    return (struct otg_header){ .table = table, .axes = axes };
}

/* Rows as they are after otg_row_follow. */
static void draw_rows(struct otg_motion *motion, double unit)
{
    const bool through = motion->header->table == OTG_TABLE_THROUGH;
    for (int leg = 0; leg < motion->legs; leg++)
        for (int axis = 0; axis < motion->header->axes; axis++) {
            struct otg_row *row = &motion->leg[leg].row;
            double *value = row->value[axis];
            row->t = 0;
            if (leg == 0)
                draw_limits(value, unit);
            else
                memcpy(value, motion->leg[0].row.value[axis],
                       sizeof row->value[axis]);
            if (leg > 0 && !through) /* less jerk would run over vmax */
                value[OTG_VMAX] = unit * between(1, 20);
            value[OTG_P0] = value[OTG_V0] = value[OTG_A0] =
                leg > 0 ? (double)NAN : 0;
            if (leg == 0)
                value[OTG_P0] = unit * between(-100, 100);
            value[OTG_PF] = unit * between(-100, 100);
            value[OTG_VF] = through && leg + 1 < motion->legs ? (double)NAN : 0;
            value[OTG_AF] = 0;
        }
    for (int leg = 1; leg < motion->legs && !through; leg++)
        motion->leg[leg].row.t = motion->leg[leg - 1].row.t + between(0.01, 12);
}

/* What was left when the phase before began, and how far it may be off. */
struct judge {
    const struct otg_motion *motion;
    int axis, points;
    struct otg_point last;
    double unit;
};

/* The limits of any row: a tighter one comes into force on the way. */
static double widest(const struct judge *judge, int value)
{
    double most = 0;
    for (int leg = 0; leg < judge->motion->legs; leg++)
        most = fmax(
            most, fabs(judge->motion->leg[leg].row.value[judge->axis][value]));
    return most;
}

static void judge_point(void *context, int leg, const struct otg_point *at)
{
    struct judge *judge = context;
    const struct otg_point *was = &judge->last;
    const double dt = at->t - was->t;
    if (judge->points++ > 0) {
        double p = was->p + dt * (was->v + dt * (was->a / 2 + dt * was->j / 6));
        double v = was->v + dt * (was->a + dt * was->j / 2);
        double a = was->a + dt * was->j;
        if (fabs(p - at->p) > 1e-9 * judge->unit * 1000 ||
            fabs(v - at->v) > 1e-9 * judge->unit * 1000 ||
            fabs(a - at->a) > 1e-7 * judge->unit * 1000)
            fail_msg("leg %d: a gap of %g, %g, %g at %.17g s", leg, p - at->p,
                     v - at->v, a - at->a, at->t);
    }
    if (fabs(at->v) >
            widest(judge, at->v > 0 ? OTG_VMAX : OTG_VMIN) * (1 + 1e-9) ||
        fabs(at->a) > fmax(widest(judge, OTG_AMAX), widest(judge, OTG_AMIN)) *
                          (1 + 1e-9) ||
        fabs(at->j) > widest(judge, OTG_JMAX) * (1 + 1e-9))
        fail_msg("leg %d: beyond a limit at %.17g s", leg, at->t);
    judge->last = *at;
}

static void judge_motion(const struct otg_motion *motion, double unit)
{
    const int last = motion->legs - 1;
    assert_int_equal(motion->err, 0);
    for (int axis = 0; axis < motion->header->axes; axis++) {
        struct judge judge = { .motion = motion, .axis = axis, .unit = unit };
        const double *first = motion->leg[0].row.value[axis];
        otg_motion_walk(motion, axis, judge_point, &judge);
        assert_true(judge.last.p == motion->leg[last].row.value[axis][OTG_PF]);
        assert_true(judge.last.v == 0 && judge.last.a == 0);
        const struct otg_point start =
            otg_piece_at(&motion->leg[0].piece[axis], 0, 0);
        assert_true(start.p == first[OTG_P0] && start.v == 0);
    }
}

static void points_are_passed_without_a_gap(void **state)
{
    static const double units[] = { 1, 1e-9, 1e12 };
    double with = 0, without = 0;
    (void)state;
    seed_from("points_are_passed_without_a_gap");
    for (int i = 0; i < CASES; i++) {
        const int axes = 1 + (int)(draw() % 3);
        const struct otg_header header = header_of(OTG_TABLE_THROUGH, axes);
        const struct otg_header one = header_of(OTG_TABLE_SEPARATE, axes);
        struct otg_motion motion, stops;
        otg_motion_init(&motion, &header, MOTION_SYNC_TIME, LEGS);
        draw_rows(&motion, units[i % 3]);
        otg_motion_make(&motion);
        judge_motion(&motion, units[i % 3]);
        with += otg_motion_seconds(&motion);
        otg_motion_init(&stops, &one, MOTION_SYNC_TIME, 1);
        for (int leg = 0; leg < LEGS; leg++) {
            stops.leg[0].row = motion.leg[leg].row;
            for (int axis = 0; axis < axes; axis++) {
                double *value = stops.leg[0].row.value[axis];
                assert_true(otg_piece_end(&motion.leg[leg].piece[axis]).p ==
                            value[OTG_PF]);
                value[OTG_V0] = value[OTG_VF] = 0;
            }
            otg_motion_make(&stops);
            assert_int_equal(stops.err, 0);
            without += otg_motion_seconds(&stops);
        }
        otg_motion_free(&stops);
        otg_motion_free(&motion);
    }
    assert_true(with < 0.99 * without);
}

static void goals_replace_each_other_without_a_gap(void **state)
{
    static const double units[] = { 1, 1e-9, 1e12 };
    unsigned taken = 0;
    (void)state;
    seed_from("goals_replace_each_other_without_a_gap");
    for (int i = 0; i < CASES; i++) {
        const struct otg_header header =
            header_of(OTG_TABLE_REPLAN, 1 + (int)(draw() % 3));
        struct otg_motion motion;
        otg_motion_init(&motion, &header, MOTION_SYNC_NONE, LEGS);
        draw_rows(&motion, units[i % 3]);
        otg_motion_make(&motion);
        judge_motion(&motion, units[i % 3]);
        for (int leg = 1; leg < LEGS; leg++)
            taken += motion.leg[leg].piece[0].outcome == MOTION_OTG_NEW &&
                     motion.leg[leg - 1].piece[0].end_s >
                         motion.leg[leg - 1].piece[0].until_s;
        otg_motion_free(&motion);
    }
    assert_true(taken > CASES); /* on the way, not at rest */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_are_passed_without_a_gap),
        cmocka_unit_test(goals_replace_each_other_without_a_gap),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
