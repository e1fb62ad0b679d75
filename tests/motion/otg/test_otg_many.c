/* tests/motion/otg/test_otg_many.c - some thousands of the problems of
 * tests/motion/otg/otg_many.h; `make otg-many N=10000000` runs as many as one
 * likes.  Takes long. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "tests/motion/otg/otg_many.h"
#include "tests/support/check.h"

#define SEED  UINT64_C(1)
#define COUNT 200 /* of each kind */

/* Whatever is answered was not too far. */
static void judge_far(const struct many_problem *problem)
{
    for (int i = 0; i < problem->axes; i++)
        if (many_is_far(&problem->move[i]))
            fail_msg("%s: answered, but proven too far",
                     many_kind_text(problem->kind));
}

static bool is_one_move(enum many_kind kind)
{
    return kind < MANY_THROUGH && kind != MANY_DURATION;
}

/* Every problem of the kind has its answer, and the judge agrees. */
static void run_kind(enum many_kind kind)
{
    unsigned seen[MANY_VERDICTS] = { 0 };
    char last[MANY_TEXT + 64] = "";
    for (uint64_t i = 0; i < COUNT; i++) {
        struct many_problem problem;
        char text[MANY_TEXT];
        uint64_t number = i * MANY_KINDS + kind;
        many_draw(SEED, number, &problem);
        enum many_verdict verdict = many_run(&problem, text);
        seen[verdict]++;
        if (verdict == MANY_GOOD && is_one_move(kind) && i % 8 == 0)
            judge_far(&problem);
        if (verdict >= MANY_DOUBT)
            snprintf(last, sizeof last, "problem %" PRIu64 ": %s", number,
                     text);
    }
    printf("%s: %u answered, %u have no motion, %u too far, %u missed, %u "
           "bad\n",
           many_kind_text(kind), seen[MANY_GOOD], seen[MANY_REFUSED],
           seen[MANY_RANGE], seen[MANY_MISSED], seen[MANY_BAD]);
    if (seen[MANY_DOUBT] + seen[MANY_MISSED] + seen[MANY_BAD] > 0)
        fail_msg("seed %" PRIu64 ": %s", SEED, last);
    assert_true(seen[MANY_GOOD] > COUNT / 2);
}

#define KIND_TEST(name, text)                                                  \
    static void name##_is_solved(void **state)                                 \
    {                                                                          \
        (void)state;                                                           \
        run_kind(name);                                                        \
    }
MANY_KIND_LIST(KIND_TEST)
#undef KIND_TEST

static void a_problem_follows_from_its_number(void **state)
{
    struct many_problem one, again;
    (void)state;
    many_draw(SEED, 12345, &one);
    many_draw(SEED, 12345, &again);
    assert_int_equal(one.kind, again.kind);
    assert_int_equal(one.move[0].goal.pos_q32, again.move[0].goal.pos_q32);
    many_draw(SEED, 12345 + MANY_KINDS, &again);
    assert_int_equal(one.kind, again.kind);
    assert_int_not_equal(one.move[0].limit.jerk_q32,
                         again.move[0].limit.jerk_q32);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_problem_follows_from_its_number),
#define KIND_ROW(name, text) cmocka_unit_test(name##_is_solved),
        MANY_KIND_LIST(KIND_ROW)
#undef KIND_ROW
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
