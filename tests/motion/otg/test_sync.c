/* tests/motion/otg/test_sync.c - axes that have the same move to another scale take
 * the time of one. */
#include "motion/core/err.h"
#include "motion/otg/sync.h"
#include "tests/support/check.h"

#define Q32(a) ((int64_t)(a) << 32)

static struct motion_otg_move move_of(int64_t pos, int64_t vel, int64_t acc,
                                      int64_t jerk)
{
    return (struct motion_otg_move){
        .mode = MOTION_OTG_POSITION,
        .goal = { .pos_q32 = Q32(pos) },
        .limit = { .vel_min_q32 = -Q32(vel),
                   .vel_max_q32 = Q32(vel),
                   .acc_min_q32 = -Q32(acc),
                   .acc_max_q32 = Q32(acc),
                   .jerk_q32 = Q32(jerk) },
    };
}

/* Their fastest plans differ by a rounding, which lengthens the shorter one and
 * not both. */
static void axes_in_proportion_take_the_time_of_the_slower_one(void **state)
{
    static const struct {
        int times;
        int64_t pos, vel, acc, jerk;
    } row[] = {
        { 36, 79, 98, 56, 1673 }, { 26, 19, 54, 13, 2270 },
        { 20, 7, 76, 2, 1512 },   { 9, 177, 100, 28, 705 },
        { 6, 96, 85, 67, 1481 },  { 3, 54, 56, 10, 289 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        const int64_t k = row[i].times;
        const struct motion_otg_move move[2] = {
            move_of(row[i].pos, row[i].vel, row[i].acc, row[i].jerk),
            move_of(k * row[i].pos, k * row[i].vel, k * row[i].acc,
                    k * row[i].jerk),
        };
        struct motion_otg_plan plan[2], alone;
        int64_t slower = 0;

        for (int a = 0; a < 2; a++) {
            assert_int_equal(motion_otg_make(&move[a], &alone, NULL),
                             MOTION_OK);
            slower = alone.dur_ns_q12 > slower ? alone.dur_ns_q12 : slower;
        }
        assert_int_equal(
            motion_sync_make(move, 2, MOTION_SYNC_TIME, plan, NULL), MOTION_OK);
        assert_int_equal(plan[0].dur_ns_q12, slower);
        assert_int_equal(plan[1].dur_ns_q12, slower);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(axes_in_proportion_take_the_time_of_the_slower_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
