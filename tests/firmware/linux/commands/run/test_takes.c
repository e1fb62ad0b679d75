/* tests/firmware/linux/commands/run/test_takes.c - takes of one move: the same
 * set points wherever the rig stood before; and what a shaper costs. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "tests/support/run_slew.h"

static const char move_text[] =
    "axes: {slide: {keys: [[0 s, 10 mm], [1 s, 40 mm]]}}\n"
    "events: [{line: camera, at: 500 ms}]\n";

/* With one more field of the axis. */
static void put_rig(const char *more)
{
    char text[1024];

    snprintf(text, sizeof text,
             "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
             "gpio: {camera: {kind: trigger, line: GPIO5}}\n"
             "axes:\n"
             "  slide:\n"
             "    unit: mm\n"
             "    limits: {position: [0 mm, 1000 mm], velocity: 100 mm/s,\n"
             "             acceleration: 400 mm/s2, jerk: 4000 mm/s3}\n"
             "    following_error: {floor: 2 mm, time: 20 ms}\n"
             "    drive: {kind: cia402, bus: can0, node: 1, counts: 4096 per "
             "mm}\n"
             "%s",
             more);
    run_put("rig.yaml", text);
}

static void take(const char *more, const char *move, const char *override,
                 char crc[64])
{
    const char *found;

    put_rig(more);
    run_put("move.yaml", move);
    run("run", run_path("rig.yaml"), run_path("move.yaml"), "--override",
        override);
    run_expect(0);
    found = strstr(run_slew()->out, "set points: CRC-32 ");
    assert_non_null(found);
    snprintf(crc, 64, "%.8s", found + strlen("set points: CRC-32 "));
}

static void takes_are_the_same_to_the_bit(void **state)
{
    char first[64], second[64], other[64];

    (void)state;
    take("    sim: {start: 0 mm}\n", move_text, "100", first);
    take("    sim: {start: 300 mm}\n", move_text, "100", second);
    assert_string_equal(first, second);
    take("    sim: {start: 0 mm}\n", move_text, "99", other);
    assert_string_not_equal(first, other);
    /* 2^-32 mm more at the end */
    take("    sim: {start: 0 mm}\n",
         "axes: {slide: {keys: [[0 s, 10 mm], [1 s, 40.0000000003 mm]]}}\n",
         "100", other);
    assert_string_not_equal(first, other);
}

/* What the move says of how often it is played, unless an option does. */
static void a_move_says_how_often_it_is_played(void **state)
{
    static const struct {
        const char *move, *option, *says;
    } rows[] = {
        { "loop: 3", NULL, "played 3 times to the end" },
        { "ping_pong: true", NULL, "played 2 times to the end" },
        { "ping_pong: true\nloop: 3", NULL, "played 3 times to the end" },
        { "loop: forever", "2", "played 2 times to the end" },
    };
    char text[256];

    (void)state;
    put_rig("");
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        snprintf(text, sizeof text,
                 "axes: {slide: {keys: [[0 s, 10 mm], [1 s, 40 mm]]}}\n%s\n",
                 rows[i].move);
        run_put("move.yaml", text);
        if (rows[i].option == NULL)
            run("run", run_path("rig.yaml"), run_path("move.yaml"));
        else
            run("run", run_path("rig.yaml"), run_path("move.yaml"), "--loop",
                rows[i].option);
        run_expect(0);
        run_says(rows[i].says);
        assert_null(strstr(run_slew()->err, ", 4 of 3"));
        assert_null(strstr(run_slew()->err, ", 3 of 2"));
    }
}

static void a_plan_says_where_the_axes_go_between_two_times(void **state)
{
    static const char back[] = "the axes go back before each next time";

    (void)state;
    put_rig("");
    run_put("move.yaml", "axes: {slide: {keys: [[0 s, 10 mm], [1 s, 40 mm]]}}\n"
                         "loop: 3\n");
    run("plan", run_path("rig.yaml"), run_path("move.yaml"));
    run_says(back);
    run_put("move.yaml", "axes: {slide: {keys: [[0 s, 10 mm], [1 s, 40 mm], "
                         "[2 s, 10 mm]]}}\nloop: 3\n");
    run("plan", run_path("rig.yaml"), run_path("move.yaml"));
    run_says("played 3 times");
    assert_null(strstr(run_slew()->out, back));
    run_put("move.yaml", "axes: {slide: {keys: [[0 s, 10 mm], [1 s, 40 mm]]}}\n"
                         "ping_pong: true\n");
    run("plan", run_path("rig.yaml"), run_path("move.yaml"));
    run_says("played 2 times, every second time in reverse");
}

static void what_would_not_end_or_is_played_once_is_refused(void **state)
{
    (void)state;
    put_rig("");
    run_put("move.yaml", "axes: {slide: {keys: [[0 s, 10 mm], [1 s, 40 mm]]}}\n"
                         "loop: forever\n");
    run("run", run_path("rig.yaml"), run_path("move.yaml"));
    run_expect(2);
    run_complains("loop: forever: in virtual time it would not end");
    run("compile", run_path("rig.yaml"), run_path("move.yaml"), "--out",
        run_path("move.slt"));
    run_expect(2);
    run_complains("a compiled move is played once");
    run_put("move.yaml", "axes: {slide: {keys: [[0 s, 10 mm], [1 s, 40 mm]]}}\n"
                         "events: [{line: camera, at: 500 ms}]\nloop: 2\n");
    run("check", run_path("rig.yaml"), run_path("move.yaml"));
    run_expect(2);
    run_complains(
        "move.yaml:2:9: events cannot stand beside loop or ping_pong");
    run_put("move.yaml", "axes: {slide: {keys: [[0 s, 10 mm], [1 s, 40 mm]]}}\n"
                         "shoot: {mode: stop, line: camera, frames: 3, "
                         "exposure: 1 s, move: 2 s}\nping_pong: true\n");
    run("check", run_path("rig.yaml"), run_path("move.yaml"));
    run_expect(2);
    run_complains("move.yaml:2:8: shoot cannot stand beside loop or ping_pong");
    run_put("move.yaml", move_text);
    run("run", "--loop", "2", run_path("rig.yaml"), run_path("move.yaml"));
    run_expect(2);
    run_complains("--loop: the move has events");
}

static void what_a_shaper_costs_is_printed(void **state)
{
    (void)state;
    put_rig("    shaper: {kind: zvd, frequency: 2 Hz}\n");
    run_put("move.yaml", move_text);
    run("plan", run_path("rig.yaml"), run_path("move.yaml"));
    run_expect(0);
    run_says("shapers: the move is 0.500 s longer, and every axis is 0.250 s "
             "later");
    /* and the camera is as much later as the axes */
    run("check", "--json", run_path("rig.yaml"), run_path("move.yaml"));
    run_expect(0);
    const char *at = strstr(run_slew()->out, "\"path_s\"");
    double shot_s = 0;
    /* half a period, of a frequency in whole mrad/s */
    const double want_s = 0.5 + 3.14159265358979 / 12.566;
    if (at == NULL || sscanf(at, "\"path_s\":\t[%lf", &shot_s) != 1 ||
        shot_s < want_s - 1e-9 || shot_s > want_s + 1e-9)
        fail_msg("shot at %.9g s: %s", shot_s, run_slew()->out);
}

/* In periods of 0.5 s without damping: half of one, one, one, and one and a half;
 * impulses that are symmetric lag half of that. */
static void every_kind_of_shaper_costs_what_its_impulses_last(void **state)
{
    static const struct {
        const char *kind, *says;
    } rows[] = {
        { "zv", "0.250 s longer, and every axis is 0.125 s later" },
        { "zvd", "0.500 s longer, and every axis is 0.250 s later" },
        { "ei", "0.500 s longer, and every axis is 0.250 s later" },
        { "ei2", "0.750 s longer, and every axis is 0.375 s later" },
    };

    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char text[128];
        snprintf(text, sizeof text,
                 "    shaper: {kind: %s, frequency: 2 Hz, damping: 0 %%}\n",
                 rows[i].kind);
        put_rig(text);
        run_put("move.yaml", move_text);
        run("plan", run_path("rig.yaml"), run_path("move.yaml"));
        run_expect(0);
        snprintf(text, sizeof text, "slide: shaper %s, 2 Hz, damping 0\n",
                 rows[i].kind);
        run_says(text);
        run_says(rows[i].says);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(takes_are_the_same_to_the_bit),
        cmocka_unit_test(a_move_says_how_often_it_is_played),
        cmocka_unit_test(a_plan_says_where_the_axes_go_between_two_times),
        cmocka_unit_test(what_would_not_end_or_is_played_once_is_refused),
        cmocka_unit_test(what_a_shaper_costs_is_printed),
        cmocka_unit_test(every_kind_of_shaper_costs_what_its_impulses_last),
    };
    return cmocka_run_group_tests(tests, run_open, run_close);
}
