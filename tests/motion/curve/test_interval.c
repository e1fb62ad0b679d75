/* tests/motion/curve/test_interval.c - an interval found by halving is that of a
 * search from the first on, in integers and in double. */
#include <float.h>

#include "motion/curve/interval.h"
#include "motion/double/double_interval.h"
#include "tests/support/check.h"

struct row {
    double other;
    int64_t begin;
    double begin_double;
};

static uint32_t one_by_one(const struct row row[], uint32_t count,
                           int64_t value)
{
    uint32_t found = 0;

    for (uint32_t i = 1; i < count; i++)
        if (row[i].begin <= value)
            found = i;
    return found;
}

/* Of every number of rows up to 40; some begin at the same place. */
static void the_last_that_begins_at_or_before_is_found(void **state)
{
    struct row row[40];

    (void)state;
    for (uint32_t i = 0; i < ARRAY_LEN(row); i++)
        row[i] = (struct row){ .begin = 3 * (int64_t)(i - i % 4 / 3) - 20,
                               .begin_double = 3.0 * (i - i % 4 / 3) - 20 };
    for (uint32_t count = 1; count <= ARRAY_LEN(row); count++)
        for (int64_t value = -30; value < 120; value++) {
            const uint32_t want = one_by_one(row, count, value);
            assert_int_equal(
                motion_interval_find(&row->begin, sizeof *row, count, value),
                want);
            assert_int_equal(double_interval_find(&row->begin_double,
                                                  sizeof *row, count,
                                                  (double)value),
                             want);
        }
}

static void the_ends_of_the_range_are_values_too(void **state)
{
    static const int64_t begin[] = { INT64_MIN, 0, INT64_MAX };
    static const double begin_double[] = { -DBL_MAX, 0, DBL_MAX };

    (void)state;
    assert_int_equal(motion_interval_find(begin, sizeof *begin, 3, INT64_MIN),
                     0);
    assert_int_equal(motion_interval_find(begin, sizeof *begin, 3, INT64_MAX),
                     2);
    assert_int_equal(motion_interval_find(begin, sizeof *begin, 0, 7), 0);
    assert_int_equal(
        double_interval_find(begin_double, sizeof *begin_double, 3, DBL_MAX),
        2);
    assert_int_equal(
        double_interval_find(begin_double, sizeof *begin_double, 0, 7), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_last_that_begins_at_or_before_is_found),
        cmocka_unit_test(the_ends_of_the_range_are_values_too),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
