/* tests/firmware/linux/commands/otg/test_cmd_otg_motion.c - slew otg: which motion
 * is planned, by options and for numbers far apart. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include <math.h>

#include "tests/support/run_slew.h"

#define HEADER "p0,v0,a0,pf,vf,af,vmax,vmin,amax,amin,jmax\n"

/* --- the bench ------------------------------------------------------------ */

/* `words` apart by blanks, TABLE standing for the file. */
static int slew(const char *words)
{
    const struct run_name names[] = { { "TABLE", run_path("moves.csv") } };

    return run_line("otg", words, names, ARRAY_LEN(names));
}

static void write_table(const char *text)
{
    run_put("moves.csv", text);
}

static void expect(const char *want)
{
    if (strstr(run_slew()->out, want) == NULL)
        fail_msg("expected \"%s\" in \"%s\"", want, run_slew()->out);
}

/* What follows `before` in the answer. */
static double number_after(const char *before)
{
    const char *text = strstr(run_slew()->out, before);
    char *end;
    if (text == NULL)
        fail_msg("%s%s", run_slew()->out, run_slew()->err);
    return strtod(text + strlen(before), &end);
}

static double duration_of(const char *words)
{
    assert_int_equal(slew(words), 0);
    return number_after("duration ");
}

/* --- numbers far apart ---------------------------------------------------- */

/* An acceleration that has to be let go first runs on to a speed, and a place,
 * far beyond what the row speaks of.  By hand: a change of speed by a^2/2 at an
 * acceleration of 1; a displacement of 1.1e8 in about five ramps, back at a speed of 1. */
static void ends_that_run_far_away_are_planned(void **state)
{
    static const struct {
        const char *table;
        double duration;
    } rows[] = {
        { "v0,a0,vf,af,amax,amin,jmax\n0,-1000,0,0,1,-2000,1\n", 501001 },
        { "v0,a0,vf,af,amax,amin,jmax\n0,0,0,1000,2000,-1,1\n", 501001 },
        { HEADER "0,0,-300,0,0,0,1,-1,10,-300,1\n", 110479806 },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        write_table(rows[i].table);
        assert_int_equal(slew("TABLE"), 0);
        double duration = number_after("\n0,ok,");
        assert_true(fabs(duration / rows[i].duration - 1) < 1e-6);
    }
}

/* A limit that the move cannot come near costs neither time nor digits. */
static void limits_out_of_reach_are_as_good_as_none(void **state)
{
    static const struct {
        const char *row;
        double duration;
    } rows[] = {
        { "0,0,0,1,0,0,1e30,-1e30,1,-1,1", 3.1748021039363992 }, /* 32^1/3 */
        { "0,0,0,1,0,0,1,-1,1e30,-1e30,1", 3.1748021039363992 },
        { "0,0,0,1,0,0,1e30,-1e30,1e30,-1e30,1", 3.1748021039363992 },
        { "0,0,0,1,0,0,1,-1,1,-1,1e30", 2 },
        { "0,0,0,1,0,0,1e-30,-1e-30,1,-1,1", 1e30 },
        { "0,0,0,0,0,0,1e30,-1e-30,1e9,-1,1e50", 0 },
    };
    char text[256];
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        snprintf(text, sizeof text, HEADER "%s\n", rows[i].row);
        write_table(text);
        slew("TABLE");
        double duration = number_after("\n0,ok,");
        if (!(fabs(duration - rows[i].duration) <= 1e-6 * rows[i].duration))
            fail_msg("row %zu: %.17g", i, duration);
    }
}

/* Without a limit of the jerk the acceleration steps.  By hand: ramps of
 * constant acceleration, and a cruise. */
static void without_a_limit_of_jerk_the_acceleration_steps(void **state)
{
    static const struct {
        const char *row;
        double duration;
    } rows[] = {
        { "0,0,0,1,0,0,10,-10,1,-1,0", 2 },
        { "0,0,0,-1,0,0,10,-10,1,-1,0", 2 },
        { "0,0,0,1,0,0,0.5,-10,1,-1,0", 2.5 },
        { "0,0.5,0,-1,0,0,10,-10,1,-1,0", 2.6213203435596424 },
        { "5,0,0,1005,0,0,7,-1,3,-2,0", 145.77380952380952 },
        { "0,2,0,10,0,0,1,-1,1,-1,0", 10 }, /* at first too fast */
        { "0,0,0,0,0,0,1,-1,1,-1,0", 0 },
    };
    char text[256];
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        snprintf(text, sizeof text, HEADER "%s\n", rows[i].row);
        write_table(text);
        assert_int_equal(slew("TABLE"), 0);
        double duration = number_after("\n0,ok,");
        if (!(fabs(duration - rows[i].duration) <= 1e-14 * rows[i].duration))
            fail_msg("row %zu: %.17g", i, duration);
    }
    write_table("v0,a0,vf,af,amax,amin,jmax\n3,0,-1,0,1,-2,0\n");
    assert_int_equal(slew("TABLE"), 0);
    assert_true(number_after("\n0,ok,") == 2);
    assert_true(duration_of("--to 1 --vmax 10 --amax 1 --jmax 0") == 2);
    expect("jmax 0: the acceleration steps; in the table steep ramps stand for "
           "its steps, by\nwhich it ends 2.7e-07 s later\n");
}

/* What steps is what very steep ramps come to. */
static void steps_are_the_limit_of_steep_ramps(void **state)
{
    char text[512];
    (void)state;
    seed_from("steps_are_the_limit_of_steep_ramps");
    for (int i = 0; i < 300; i++) {
        const double vmax = 0.5 + (double)draw_unit() * 9;
        const double vmin = -0.5 - (double)draw_unit() * 9;
        const double amax = 0.5 + (double)draw_unit() * 9;
        const double amin = -0.5 - (double)draw_unit() * 9;
        const double v0 = vmin + (double)draw_unit() * (vmax - vmin);
        const double vf = vmin + (double)draw_unit() * (vmax - vmin);
        const double pf = -10 + (double)draw_unit() * 20;
        double duration[2];
        for (int k = 0; k < 2; k++) {
            snprintf(text, sizeof text,
                     HEADER "0,%.12g,0,%.12g,%.12g,0,%.12g,%.12g,%.12g,%.12g,%s"
                            "\n",
                     v0, pf, vf, vmax, vmin, amax, amin, k ? "1e8" : "0");
            write_table(text);
            assert_int_equal(slew("TABLE"), 0);
            duration[k] = number_after("\n0,ok,");
        }
        if (!(duration[0] <= duration[1] + 1e-9 &&
              duration[0] >= duration[1] - 1e-5))
            fail_msg("%.12g, with steep ramps %.12g: %s", duration[0],
                     duration[1], text);
    }
}

/* Planned as by who moves along, told as from where the row stands.  By hand:
 * a to h and down to -h sqrt(2) at a jerk of 1, the speed as before. */
static void a_small_change_of_a_high_speed_keeps_its_digits(void **state)
{
    static const double h = 1e-6;
    (void)state;
    write_table("v0,a0,vf,af,amax,amin,jmax\n"
                "1000,0,1000,-1.4142135623730951e-6,1,-1,1\n");
    assert_int_equal(slew("TABLE"), 0);
    double want = h * (2 + sqrt(2));
    assert_true(fabs(number_after("\n0,ok,") / want - 1) < 1e-6);
    assert_int_equal(slew("--v0 5 --vf -2 --amax 20 --jmax 200 --segments"), 0);
    expect("\n0,0,0,0,5,0,-");
    const char *end = strstr(run_slew()->out, "\n0,0,0.45");
    assert_non_null(end);
    double place = strtod(strchr(end + strlen("\n0,0,"), ',') + 1, NULL);
    assert_true(fabs(place - 0.45 * (5 - 2) / 2) < 1e-7);
}

/* --- by options ------------------------------------------------------------ */

static void a_jerk_of_its_own_slows_down(void **state)
{
    static const char text[] =
        "p0,v0,a0,pf,vf,af,vmax,vmin,amax,amin,jmax,jdown\n"
        "0,0,0,100,0,0,10,-10,20,-20,200,20\n";
    (void)state;
    /* 0.6 s, 3 to the speed of 10; 2 sqrt(10 / 20) s, half of 10 each from it */
    double want = 0.6 + 2 * sqrt(0.5) + (100 - 3 - 10 * sqrt(0.5)) / 10;
    double got = duration_of("--to 100 --vmax 10 --amax 20 --jmax 200 "
                             "--jdown 20");
    assert_true(fabs(got / want - 1) < 1e-6);
    write_table(text);
    assert_int_equal(slew("TABLE"), 0);
    expect("\n0,ok,11.00710");
}

static void a_motion_takes_as_long_as_is_wanted(void **state)
{
    (void)state;
    static const char base[] = "--to 100 --vmax 10 --amax 20 --jmax 200 ";
    char words[160];
    snprintf(words, sizeof words, "%s--duration 20", base);
    assert_true(fabs(duration_of(words) - 20) < 1e-8);
    snprintf(words, sizeof words, "%s--duration 5", base);
    assert_true(fabs(duration_of(words) - 10.6) < 1e-5);
    assert_int_equal(slew("--vf 3 --amax 1 --jmax 1 --duration 9"), 1);
    expect("duration: a velocity goal takes the least");
}

/* 17 us at the limit of velocity, a part of a tick too long, which the jerk
 * cannot stretch.  The row's own unit of time makes a tick 2^-34 s, 5.8e-8 of
 * way. */
static void what_the_nearest_tick_leaves_is_said(void **state)
{
    (void)state;
    assert_true(fabs(duration_of("--v0 1000 --vf 1000 --to "
                                 "0.0170000000000001 --vmax 1000 --amax 10 "
                                 "--jmax 1") -
                     17e-6) < 0x1p-33);
    assert_non_null(strstr(run_slew()->err, "residual position -"));
    assert_int_equal(slew("--v0 1000 --vf 1000 --to 0.0170000000000001 --vmax "
                          "1000 --amax 10 --jmax 1 --json"),
                     0);
    double left = number_after("\"p\":");
    assert_true(left < 0 && left > -1000 * 0x1p-33);
    assert_int_equal(slew("--to 1 --vmax 1 --amax 10 --jmax 10 --json"), 0);
    assert_true(number_after("\"p\":") == 0);
    assert_null(strstr(run_slew()->err, "residual"));
}

#define TWO_AXES                                                               \
    "p0_1,v0_1,a0_1,pf_1,vf_1,af_1,vmax_1,vmin_1,amax_1,amin_1,jmax_1,"        \
    "p0_2,v0_2,a0_2,pf_2,vf_2,af_2,vmax_2,vmin_2,amax_2,amin_2,jmax_2\n"

/* The second axis is the slow one: 0.1 sqrt(2) s twice, 3 at a speed of 1. */
static void axes_come_together_as_they_are_told(void **state)
{
    static const char text[] =
        TWO_AXES "0,0,0,10,0,0,10,-10,20,-20,200,0,0,0,3,0,0,1,-1,20,-20,200\n";
    static const char bent[] =
        TWO_AXES "0,0,1,10,0,0,10,-10,20,-20,200,0,0,0,3,0,0,1,-1,20,-20,200\n";
    (void)state;
    write_table(text);
    assert_int_equal(slew("TABLE"), 0);
    expect("\n0,ok,3.14142");
    assert_int_equal(slew("--together none --segments TABLE"), 0);
    expect("\n0,0,1.6000000"); /* the first is there before */
    assert_int_equal(slew("--together straight --segments TABLE"), 0);
    expect("\n0,0,3.26666"); /* the ramps of the first take longer */
    write_table(bent);
    assert_int_equal(slew("--together phase TABLE"), 0);
    expect("\n0,ok,3.14142");
    assert_int_equal(slew("--together straight TABLE"), 1);
    expect("\n0,a0_1: no straight line leads there");
}

/* --- several rows, one motion ---------------------------------------------- */

/* By hand: 0.6 s and 3 to the speed of 10, at which 50 is passed. */
static void points_are_passed_at_a_given_speed(void **state)
{
    (void)state;
    write_table(HEADER "0,0,0,50,10,0,10,-10,20,-20,200\n,,,100,,,,,,,\n");
    assert_int_equal(slew("--through TABLE"), 0);
    assert_true(fabs(number_after("row,status,t\n0,ok,") - 5.3) < 1e-5);
    assert_true(fabs(number_after("\n1,ok,") - 10.6) < 1e-5);
    assert_int_equal(slew("--through --segments TABLE"), 0);
    assert_true(number_after("\n1,0,5.30") >= 0);
    expect(",50,10,0,"); /* the row's own numbers */
    expect(",100,0,0,0\n");
}

/* The first point is passed sooner than one could stop there; the last is a
 * stop; what JSON says of both. */
static void a_speed_is_chosen_where_none_is_given(void **state)
{
    (void)state;
    write_table(TWO_AXES
                "0,0,0,10,,0,10,-10,20,-20,200,5,0,0,5,,0,1,-1,20,-20,200\n"
                ",,,20,,,,,,,,,,,7,,,,,,,\n");
    assert_int_equal(slew("--through TABLE --json --segments"), 0);
    assert_true(number_after("\"t\":") < 1.5);
    expect("\"legs\":");
    expect("\"v\":\t[0, 0]"); /* of the last point */
    assert_null(strstr(run_slew()->out, "kept"));
}

/* By hand: 1 s into the motion of 10.6 s another goal, then the same goal, then
 * one out of reach. */
static void a_goal_takes_the_place_of_another(void **state)
{
    static const char text[] = "t," HEADER "0,0,0,0,100,0,0,10,-10,20,-20,200\n"
                               "1,,,,50,,,,,,,\n"
                               "2,,,,,,,,,,,\n";
    (void)state;
    write_table(text);
    assert_int_equal(slew("--replan TABLE"), 0);
    assert_true(fabs(number_after("row,status,t\n0,ok,") - 10.6) < 1e-5);
    assert_true(fabs(number_after("\n1,ok,") - 5.6) < 1e-4);
    assert_true(fabs(number_after("\n2,kept,") - 5.6) < 1e-4);
    write_table("t," HEADER "0,0,0,0,100,0,0,10,-10,20,-20,200\n"
                "3,,,,50,11,,,,,,\n");
    assert_int_equal(slew("--replan TABLE"), 1);
    assert_true(fabs(number_after("\n1,vf: no motion leads there: the row "
                                  "before goes on,") -
                     10.6) < 1e-5);
    write_table("t," HEADER "0,0,0,0,100,0,0,10,-10,20,-20,200\n"
                "20,,,,50,11,,,,,,\n");
    assert_int_equal(slew("--replan --segments TABLE"), 1);
    expect("\n1,0,20,100,0,0,0\n"); /* where it stands */
    assert_non_null(strstr(run_slew()->err,
                           "row 1: vf: no motion leads there: it stops\n"));
    write_table("t," HEADER "0,0,0,0,10,5,0,10,-10,20,-20,200\n"
                "9,,,,50,0,,,,,,\n");
    assert_int_equal(slew("--replan TABLE"), 1);
    expect("\n1,t: the motion before it has ended and not at rest,\n");
}

/* A target that moves at 4 and is seen every 50 ms is reached and kept up with;
 * by hand, it is ahead at 10 while the axis gains 6 of every 10. */
static void a_moving_target_is_reached(void **state)
{
    static char text[1 << 14];
    size_t used = (size_t)snprintf(text, sizeof text, "t," HEADER);
    (void)state;
    for (int i = 0; i < 120; i++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 i == 0 ? "0,0,0,0,10,4,0,10,-10,20,-20,200\n"
                                        : "%g,,,,%g,4,,,,,,\n",
                                 0.05 * i, 10 + 0.2 * i);
    write_table(text);
    assert_int_equal(slew("--replan TABLE"), 0);
    /* 6 s on, at 33.8: on its way to what it sees for less than a tenth */
    const double last = number_after("\n119,ok,");
    assert_true(last > 5.95 && last < 6.05);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ends_that_run_far_away_are_planned),
        cmocka_unit_test(limits_out_of_reach_are_as_good_as_none),
        cmocka_unit_test(without_a_limit_of_jerk_the_acceleration_steps),
        cmocka_unit_test(steps_are_the_limit_of_steep_ramps),
        cmocka_unit_test(a_small_change_of_a_high_speed_keeps_its_digits),
        cmocka_unit_test(a_jerk_of_its_own_slows_down),
        cmocka_unit_test(a_motion_takes_as_long_as_is_wanted),
        cmocka_unit_test(what_the_nearest_tick_leaves_is_said),
        cmocka_unit_test(axes_come_together_as_they_are_told),
        cmocka_unit_test(points_are_passed_at_a_given_speed),
        cmocka_unit_test(a_speed_is_chosen_where_none_is_given),
        cmocka_unit_test(a_goal_takes_the_place_of_another),
        cmocka_unit_test(a_moving_target_is_reached),
    };
    return cmocka_run_group_tests(tests, run_open, run_close);
}
