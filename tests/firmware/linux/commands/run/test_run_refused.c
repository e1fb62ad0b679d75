/* tests/firmware/linux/commands/run/test_run_refused.c - a move that cannot start: which
 * axis, from where and to where. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "tests/support/run_slew.h"

static void put(const char *start_a, const char *start_b)
{
    char text[1024];

    snprintf(text, sizeof text,
             "axes:\n"
             "  a:\n    unit: mm\n"
             "    limits: {position: [-1000 m, 1000 m], velocity: 1,\n"
             "             acceleration: 20}\n"
             "    following_error: {floor: 5, time: 100 ms}\n"
             "    drive: {kind: virtual}\n"
             "    sim: {start: %s}\n"
             "  b:\n    unit: deg\n"
             "    limits: {position: [-360000000, 360000000], velocity: 5,\n"
             "             acceleration: 20}\n"
             "    following_error: {floor: 5, time: 100 ms}\n"
             "    drive: {kind: virtual}\n"
             "    sim: {start: %s}\n",
             start_a, start_b);
    run_put("rig.yaml", text);
    run_put("move.yaml",
            "axes:\n"
            "  a: {curve: quintic, keys: [[0 s, 2], [30 s, 3]]}\n"
            "  b: {curve: quintic, keys: [[0 s, 0], [30 s, 3]]}\n");
}

static void an_axis_too_far_away_is_named(void **state)
{
    static const struct {
        const char *start_a, *start_b, *says;
    } rows[] = {
        { "900 m", "0",
          "cannot start: a: from 900000 to 2 mm at a quarter of its limits "
          "takes longer than 3.26 days" },
        { "-900 m", "0", "cannot start: a: from -900000 to 2 mm" },
        { "0", "3600000",
          "cannot start: b: from 3600000 to 0 deg at a quarter" },
        { "70400", "0", "cannot start: a: from 70400 to 2 mm" }, /* 2^48 ns */
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        put(rows[i].start_a, rows[i].start_b);
        run("run", run_path("rig.yaml"), run_path("move.yaml"));
        assert_int_not_equal(run_slew()->status, 0);
        if (strstr(run_slew()->out, rows[i].says) == NULL)
            fail_msg("%s: %s", rows[i].says, run_slew()->out);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(an_axis_too_far_away_is_named, run_open,
                                        run_close),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
