/* tests/test_plot.c - ticks, lines and whole pictures. */
#define _XOPEN_SOURCE 700 /* mkdtemp */
#include <cairo.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/linux/machine/trace.h"
#include "firmware/linux/plot/chart.h"
#include "firmware/linux/plot/plot.h"
#include "tests/check.h"
#include "tests/fake_job.h"

#define SEED UINT64_C(0xD1B54A32D192ED03)

static char directory[64];
static struct job job;
static struct trace trace;

static int make_directory(void **state)
{
    (void)state;
    snprintf(directory, sizeof directory, "/tmp/slew-test-XXXXXX");
    return mkdtemp(directory) == NULL ? -1 : 0;
}

static int remove_directory(void **state)
{
    (void)state;
    return rmdir(directory); /* every test has removed what it wrote */
}

static void steps_are_1_2_5_and_never_more_than_asked(void **state)
{
    (void)state;
    uint64_t seed = SEED;
    for (int i = 0; i < 5000; i++) {
        double range = ldexp((double)check_random_in(&seed, 1, 1000000),
                             (int)check_random_in(&seed, -40, 40));
        unsigned most = (unsigned)check_random_in(&seed, 1, 12);
        double step = chart_step(range, most);
        double lead = step / pow(10, floor(log10(step) + 1e-9));
        bool nice = fabs(lead - 1) < 1e-6 || fabs(lead - 2) < 1e-6 ||
                    fabs(lead - 5) < 1e-6;
        if (!nice || range / step > most * (1 + 1e-6) ||
            range / step < most / 2.5 * (1 - 1e-6))
            fail_msg("seed %#llx, step %d: %g in %u gave %g",
                     (unsigned long long)SEED, i, range, most, step);
    }
}

static void labels_have_the_decimals_of_their_step(void **state)
{
    static const struct {
        double value, step;
        const char *want;
    } rows[] = {
        { 0, 5, "0" },
        { -1e-17, 0.1, "0.0" },
        { 0.30000000000000004, 0.1, "0.3" },
        { -2, 0.5, "\u22122.0" },
        { 2500, 500, "2500" },
        { 12000, 2000, "12\u2009000" },
        { -1234567, 1, "\u22121\u2009234\u2009567" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char label[CHART_LABEL_MAX];
        chart_label(label, rows[i].value, rows[i].step);
        assert_string_equal(label, rows[i].want);
    }
}

/* --- lines --- */

#define POINTS 4000

static double distance(double x, double y, const double a[2], const double b[2])
{
    double dx = b[0] - a[0], dy = b[1] - a[1];
    double length = dx * dx + dy * dy;
    double at = length > 0 ? ((x - a[0]) * dx + (y - a[1]) * dy) / length : 0;
    at = fmin(fmax(at, 0), 1);
    return hypot(x - a[0] - at * dx, y - a[1] - at * dy);
}

/* Draws, takes the path cairo was given, and returns the number of its points
 * after checking that no point given is further than `most` from it. */
static int simplified(const double *t, const double *value, int count,
                      double most)
{
    static double point[POINTS][2];
    cairo_surface_t *surface =
        cairo_image_surface_create(CAIRO_FORMAT_RGB24, 400, 200);
    struct chart chart = { .cairo = cairo_create(surface),
                           .box = { 0, 0, 400, 200 },
                           .t1 = 1,
                           .low = -1,
                           .high = 1 };
    const struct chart_color black = { 0, 0, 0, 1 };
    int points = 0;
    chart_line_begin(&chart);
    for (int i = 0; i < count; i++)
        chart_line_to(&chart, t[i], value[i]);
    /* the one held back goes out with the end; a copy of it must count */
    cairo_line_to(chart.cairo, chart.held_x, chart.held_y);
    cairo_path_t *path = cairo_copy_path(chart.cairo);
    for (int i = 0; i < path->num_data; i += path->data[i].header.length) {
        point[points][0] = path->data[i + 1].point.x;
        point[points++][1] = path->data[i + 1].point.y;
    }
    for (int i = 0; i < count; i++) {
        double near = INFINITY;
        for (int k = 0; k + 1 < points; k++)
            near = fmin(near, distance(chart_x(&chart, t[i]),
                                       chart_y(&chart, value[i]), point[k],
                                       point[k + 1]));
        if (near > most)
            fail_msg("point %d is %g pixels off", i, near);
    }
    chart_line_end(&chart, &black, 1);
    cairo_path_destroy(path);
    cairo_destroy(chart.cairo);
    cairo_surface_destroy(surface);
    return points;
}

static void a_smooth_line_needs_few_points(void **state)
{
    (void)state;
    static double t[2000], value[2000];
    for (int i = 0; i < 2000; i++) {
        t[i] = i / 1999.0;
        value[i] = sin(6 * t[i]);
    }
    /* tolerance, cairo's 1/256 and the last point drawn twice */
    assert_in_range(simplified(t, value, 2000, 0.13), 5, 60);
}

static void spikes_and_steps_are_kept(void **state)
{
    (void)state;
    static double t[2000], value[2000];
    uint64_t seed = SEED;
    for (int i = 0; i < 2000; i++) {
        const int pair = i / 2; /* two at each time: vertical strokes */
        t[i] = pair / 999.0;
        value[i] = i % 2 ? 0.9 : -0.9;
        if (i % 7 == 0)
            value[i] = (double)check_random_in(&seed, -900, 900) / 1000;
    }
    simplified(t, value, 2000, 0.13);
}

/* --- pictures --- */

static void fill_trace(void)
{
    static struct telemetry_row row;
    trace_init(&trace, job.rig.axis_count);
    for (int i = 0; i <= 2400; i++) {
        row.phase = TELEMETRY_MOVE;
        row.t_ns = i * INT64_C(10000000);
        row.rate.s_ns_q12 = row.t_ns * MOTION_FIXED_NS_Q12;
        for (unsigned a = 0; a < job.move.axis_count; a++) {
            struct motion_state now;
            motion_track_state(&job.track[a], row.rate.s_ns_q12, &now);
            row.axis[a].demand = now;
            row.axis[a].actual_q32 = now.pos_q32;
            row.axis[a].actual_vel_q32 = now.vel_q32;
            row.axis[a].following_q32 = now.acc_q16;
        }
        trace_take(&trace, &row);
    }
}

static int count_near(cairo_surface_t *surface, unsigned want)
{
    int count = 0;
    const unsigned char *data = cairo_image_surface_get_data(surface);
    int stride = cairo_image_surface_get_stride(surface);
    for (int y = 0; y < cairo_image_surface_get_height(surface); y++)
        for (int x = 0; x < cairo_image_surface_get_width(surface); x++) {
            uint32_t pixel;
            memcpy(&pixel, data + y * stride + 4 * x, 4);
            count += (pixel & 0xFFFFFF) == want;
        }
    return count;
}

#define BLUE   0x0072B2u /* the plan */
#define ORANGE 0xE69F00u /* the servo */

static void png_path(char path[96])
{
    snprintf(path, 96, "%s/plot.png", directory);
}

static void a_picture_shows_the_plan_and_the_servo(void **state)
{
    (void)state;
    char path[96];
    png_path(path);
    fake_dolly(&job);
    assert_int_equal(plot_save(&job, NULL, path), 0);
    cairo_surface_t *plan = cairo_image_surface_create_from_png(path);
    assert_int_equal(cairo_surface_status(plan), CAIRO_STATUS_SUCCESS);
    assert_true(count_near(plan, BLUE) > 4000);
    assert_int_equal(count_near(plan, ORANGE), 0);
    fill_trace();
    assert_int_equal(plot_save(&job, &trace, path), 0);
    cairo_surface_t *run = cairo_image_surface_create_from_png(path);
    assert_true(count_near(run, ORANGE) > 1000);
    assert_int_equal(cairo_image_surface_get_width(run),
                     cairo_image_surface_get_width(plan));
    assert_true(cairo_image_surface_get_height(run) >
                cairo_image_surface_get_height(plan));
    cairo_surface_destroy(plan);
    cairo_surface_destroy(run);
    trace_free(&trace);
    fake_free(&job);
    unlink(path);
}

static void a_vector_picture_is_whole_and_small(void **state)
{
    (void)state;
    static char text[1 << 20];
    char path[96];
    snprintf(path, sizeof path, "%s/plot.svg", directory);
    fake_dolly(&job);
    assert_int_equal(plot_save(&job, NULL, path), 0);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t length = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    assert_in_range(length, 10000, 300000);
    assert_non_null(strstr(text, "<svg"));
    assert_non_null(strstr(text + length - 20, "</svg>"));
    fake_free(&job);
    unlink(path);
}

static void odd_moves_can_be_drawn(void **state)
{
    (void)state;
    static const struct fake_key still[] = { { 0, 5 }, { 10, 5 } };
    static const struct fake_key one[] = { { 0, -3 } };
    static const struct fake_key tiny[] = { { 0, 0 }, { 1e-6, 1e-9 } };
    const double open[] = { 0, 0, 0, 0, 0 };
    const double wide[] = { -2e9, 2e9, 2e9, 1e12, 1e13 };
    char path[96];
    png_path(path);
    memset(&job, 0, sizeof job);
    assert_int_equal(plot_save(&job, NULL, path), 0); /* no axis at all */
    fake_axis(&job, "still", still, 2, true, wide);
    fake_axis(&job, "one key", one, 1, true, open);
    fake_axis(&job, "tiny", tiny, 2, false, open);
    for (int i = 0; i < 3; i++)
        fake_axis(&job, "more", still, 2, true, open); /* two bands */
    assert_int_equal(plot_save(&job, NULL, path), 0);
    fill_trace();
    assert_int_equal(plot_save(&job, &trace, path), 0);
    trace_free(&trace);
    fake_free(&job);
    unlink(path);
}

static void the_format_is_in_the_name(void **state)
{
    (void)state;
    assert_int_equal(plot_format_of("a.png"), PLOT_PNG);
    assert_int_equal(plot_format_of("a.b/c.SVG"), PLOT_SVG);
    assert_int_equal(plot_format_of("a.pdf"), -1);
    assert_int_equal(plot_format_of("png"), -1);
    assert_int_equal(plot_format_of(""), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(steps_are_1_2_5_and_never_more_than_asked),
        cmocka_unit_test(labels_have_the_decimals_of_their_step),
        cmocka_unit_test(a_smooth_line_needs_few_points),
        cmocka_unit_test(spikes_and_steps_are_kept),
        cmocka_unit_test(a_picture_shows_the_plan_and_the_servo),
        cmocka_unit_test(a_vector_picture_is_whole_and_small),
        cmocka_unit_test(odd_moves_can_be_drawn),
        cmocka_unit_test(the_format_is_in_the_name),
    };
    return cmocka_run_group_tests(tests, make_directory, remove_directory);
}
