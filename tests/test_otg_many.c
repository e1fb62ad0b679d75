/* tests/test_otg_many.c - some thousands of the problems of tests/otg_many.h;
 * `make otg-many N=10000000` runs as many as one likes. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "tests/check.h"
#include "tests/otg_many.h"

#define SEED  UINT64_C(1)
#define COUNT 200 /* of each kind */

/* What is still open, docs/OTG.md section 6: at most this many of COUNT have no
 * answer, or a track that is not quite its plan.  No other kind may. */
static const struct {
    enum many_kind kind;
    unsigned missed, bad;
} open_kinds[] = {
    { MANY_STRAIGHT, 1, 0 },
};

static void judge_counts(enum many_kind kind, const unsigned seen[],
                         const char *last)
{
    unsigned missed = 0, bad = 0;
    for (size_t i = 0; i < ARRAY_LEN(open_kinds); i++)
        if (open_kinds[i].kind == kind) {
            missed = open_kinds[i].missed;
            bad = open_kinds[i].bad;
        }
    if (seen[MANY_MISSED] > missed || seen[MANY_BAD] > bad)
        fail_msg("seed %" PRIu64 ": %u missed, %u bad; %s", SEED,
                 seen[MANY_MISSED], seen[MANY_BAD], last);
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
        if (verdict >= MANY_MISSED)
            snprintf(last, sizeof last, "problem %" PRIu64 ": %s", number,
                     text);
    }
    printf("%s: %u answered, %u have no motion, %u too far, %u missed, %u "
           "bad\n",
           many_kind_text(kind), seen[MANY_GOOD], seen[MANY_REFUSED],
           seen[MANY_RANGE], seen[MANY_MISSED], seen[MANY_BAD]);
    judge_counts(kind, seen, last);
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
    assert_int_not_equal(one.move[0].limit.jerk_q16,
                         again.move[0].limit.jerk_q16);
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
