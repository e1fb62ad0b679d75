/* tests/firmware/control/test_follow.c - marks of another clock, and what is
 * steered by them. */
#include <inttypes.h>
#include <stdlib.h>

#include "firmware/control/follow.h"
#include "tests/support/check.h"

#define MS INT64_C(1000000)
#define S  INT64_C(1000000000)

static struct follow follow;

static void begin(void)
{
    follow_init(&follow, 250 * MS, 100 * MS, FOLLOW_ONE_Q30 / 50);
}

/* Their clock runs fast by so many ppm, and began 7 s ahead of ours. */
static int64_t theirs_ns(int64_t t_ns, int64_t ppm)
{
    return 7 * S + t_ns + t_ns / 1000000 * ppm;
}

/* From t_ns on a mark every `every_ns`, each late by up to `late_ns`. */
static int64_t marks(int64_t t_ns, int64_t for_ns, int64_t every_ns,
                     int64_t late_ns, int64_t ppm)
{
    for (int64_t end_ns = t_ns + for_ns; t_ns < end_ns; t_ns += every_ns) {
        const int64_t late =
            late_ns > 0 ? (int64_t)(draw() % (uint64_t)late_ns) : 0;
        follow_mark(&follow, theirs_ns(t_ns, ppm), t_ns + late);
    }
    return t_ns;
}

static void exact_marks_are_known_exactly(void **state)
{
    (void)state;
    begin();
    const int64_t t_ns = marks(0, 3 * S, 40 * MS, 0, 250);
    assert_int_equal(follow.state, FOLLOW_LOCKED);
    assert_in_range(llabs(follow_s_ns(&follow, t_ns) - theirs_ns(t_ns, 250)), 0,
                    100);
    const int64_t s_ns = theirs_ns(3600 * S, 250);
    assert_in_range(llabs(follow_t_ns(&follow, s_ns) - 3600 * S), 0, 50000);
}

/* Of marks up to 2 ms late half of that is left, which nothing can tell from a
 * clock that is behind by it; what comes and goes is filtered out. */
static void late_marks_are_filtered(void **state)
{
    (void)state;
    seed_from("marks");
    for (int round = 0; round < 20; round++) {
        const int64_t ppm = (int64_t)(draw() % 2001) - 1000;
        begin();
        int64_t t_ns = marks(0, 4 * S, 10 * MS, 2 * MS, ppm);
        for (int i = 0; i < 100; i++) {
            t_ns = marks(t_ns, 100 * MS, 10 * MS, 2 * MS, ppm);
            const int64_t off_ns =
                follow_s_ns(&follow, t_ns) - theirs_ns(t_ns, ppm) + 1 * MS;
            if (llabs(off_ns) > 700000)
                fail_msg("round %d: off by %" PRId64 " ns", round, off_ns);
        }
    }
}

/* A move that begins up to a tick late, by the rate that is found. */
static void a_move_is_brought_to_it_and_stays(void **state)
{
    (void)state;
    begin();
    int64_t t_ns = marks(0, 2 * S, 40 * MS, 0, -400);
    int64_t s_ns = follow_s_ns(&follow, t_ns) - 5 * MS, worst_ns = 0;
    for (int i = 0; i < 300; i++) {
        const int64_t rate_q30 = follow_rate_q30(&follow, s_ns, t_ns);
        const int64_t before_ns = t_ns;
        assert_in_range(rate_q30, FOLLOW_ONE_Q30 - FOLLOW_ONE_Q30 / 50,
                        FOLLOW_ONE_Q30 + FOLLOW_ONE_Q30 / 50);
        t_ns = marks(t_ns, 100 * MS, 40 * MS, 0, -400);
        s_ns += (t_ns - before_ns) * (rate_q30 >> 10) >> 20;
        const int64_t off_ns = llabs(s_ns - theirs_ns(t_ns, -400));
        worst_ns = i > 100 && off_ns > worst_ns ? off_ns : worst_ns;
    }
    assert_in_range(worst_ns, 0, 20000);
}

static void silence_is_lost_and_marks_again_are_not(void **state)
{
    (void)state;
    begin();
    int64_t t_ns = marks(0, 2 * S, 40 * MS, 0, 0);
    follow_look(&follow, t_ns + 200 * MS);
    assert_int_equal(follow.state, FOLLOW_LOCKED);
    follow_look(&follow, t_ns + 300 * MS);
    assert_int_equal(follow.state, FOLLOW_LOST);
    (void)marks(t_ns + 400 * MS, 40 * MS, 40 * MS, 0, 0);
    assert_int_equal(follow.state, FOLLOW_LOCKED);
}

static void one_wild_mark_is_none_and_three_are_a_jump(void **state)
{
    (void)state;
    begin();
    int64_t t_ns = marks(0, 2 * S, 40 * MS, 0, 0);
    follow_mark(&follow, 900 * S, t_ns);
    assert_int_equal(follow.state, FOLLOW_LOCKED);
    t_ns = marks(t_ns + 40 * MS, 80 * MS, 40 * MS, 0, 0);
    assert_in_range(llabs(follow_s_ns(&follow, t_ns) - theirs_ns(t_ns, 0)), 0,
                    100);
    for (int i = 0; i < 3; i++)
        follow_mark(&follow, 900 * S + i * 40 * MS, t_ns + i * 40 * MS);
    assert_int_equal(follow.state, FOLLOW_JUMPED);
    for (int i = 3; i < 40; i++)
        follow_mark(&follow, 900 * S + i * 40 * MS, t_ns + i * 40 * MS);
    assert_int_equal(follow.state, FOLLOW_LOCKED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact_marks_are_known_exactly),
        cmocka_unit_test(late_marks_are_filtered),
        cmocka_unit_test(a_move_is_brought_to_it_and_stays),
        cmocka_unit_test(silence_is_lost_and_marks_again_are_not),
        cmocka_unit_test(one_wild_mark_is_none_and_three_are_a_jump),
    };
    return cmocka_run_group_tests_name("follow", tests, NULL, NULL);
}
