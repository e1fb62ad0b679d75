/* tests/firmware/host/plot/test_plot.c - ticks, lines and whole pictures. */
#define _XOPEN_SOURCE 700 /* mkdtemp */
#include <cairo.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/plot/chart.h"
#include "firmware/host/plot/plot.h"
#include "firmware/host/recording/trace.h"
#include "tests/support/check.h"
#include "tests/support/fake_job.h"

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
    chart_line_flush(&chart);
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

/* --- lines of a long run: far more points than pixels --- */

#define DENSE 20000 /* points */
#define WIDE  120   /* pixels */
#define TALL  100

static double dense_noise(uint64_t *seed, double t)
{
    (void)t;
    return (double)check_random_in(seed, -900, 900) / 1000;
}

static double dense_wave(uint64_t *seed, double t)
{
    (void)seed;
    return 0.9 * sin(6283 * t);
}

static double dense_steps(uint64_t *seed, double t)
{
    (void)seed;
    return fmod(t * 1700, 2) < 1 ? -0.5 : 0.8;
}

static double dense_spikes(uint64_t *seed, double t)
{
    return check_random_in(seed, 0, 99) == 0 ? 0.9 : 0.3 * sin(6 * t);
}

typedef double dense_value(uint64_t *seed, double t);

static struct chart dense_chart(void)
{
    cairo_surface_t *surface =
        cairo_image_surface_create(CAIRO_FORMAT_RGB24, WIDE, TALL);
    struct chart chart = { .cairo = cairo_create(surface),
                           .box = { 0, 0, WIDE, TALL },
                           .t1 = 1,
                           .low = -1,
                           .high = 1 };
    cairo_surface_destroy(surface);
    return chart;
}

/* By chart.h; returns the number of points that cairo was given. */
static int dense_by_chart(struct chart *chart, const double *value)
{
    static const struct chart_color red = { 1, 0, 0, 1 };
    int points = 0;
    chart_line_begin(chart);
    for (int i = 0; i < DENSE; i++)
        chart_line_to(chart, i / (DENSE - 1.0), value[i]);
    chart_line_flush(chart);
    cairo_path_t *path = cairo_copy_path(chart->cairo);
    for (int i = 0; i < path->num_data; i += path->data[i].header.length)
        points++;
    cairo_path_destroy(path);
    chart_line_end(chart, &red, 0.9);
    return points;
}

/* Every point, in pieces that cairo is quick with. */
static void dense_by_cairo(const struct chart *chart, const double *value)
{
    cairo_t *cairo = chart->cairo;
    cairo_set_line_width(cairo, 0.9);
    cairo_set_line_join(cairo, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_cap(cairo, CAIRO_LINE_CAP_ROUND);
    cairo_set_source_rgb(cairo, 1, 0, 0);
    for (int i = 0; i + 1 < DENSE; i++) {
        cairo_line_to(cairo, chart_x(chart, i / (DENSE - 1.0)),
                      chart_y(chart, value[i]));
        if (i % 32 == 31) {
            cairo_stroke(cairo);
            cairo_move_to(cairo, chart_x(chart, i / (DENSE - 1.0)),
                          chart_y(chart, value[i]));
        }
    }
    cairo_stroke(cairo);
}

/* Pixels whose red differs by more than half. */
static int dense_differ(const struct chart *a, const struct chart *b)
{
    cairo_surface_t *of_a = cairo_get_target(a->cairo);
    cairo_surface_t *of_b = cairo_get_target(b->cairo);
    const int stride = cairo_image_surface_get_stride(of_a);
    int count = 0;
    cairo_surface_flush(of_a);
    cairo_surface_flush(of_b);
    for (int y = 0; y < TALL; y++)
        for (int x = 0; x < WIDE; x++) {
            const int at = y * stride + 4 * x + 2;
            count += abs(cairo_image_surface_get_data(of_a)[at] -
                         cairo_image_surface_get_data(of_b)[at]) > 127;
        }
    return count;
}

static void
a_dense_line_has_points_by_its_width_and_looks_the_same(void **state)
{
    static dense_value *const shapes[] = { dense_noise, dense_wave, dense_steps,
                                           dense_spikes };
    static double value[DENSE];
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(shapes); k++) {
        uint64_t seed = SEED;
        struct chart chart = dense_chart(), other = dense_chart();
        for (int i = 0; i < DENSE; i++)
            value[i] = shapes[k](&seed, i / (DENSE - 1.0));
        const int points = dense_by_chart(&chart, value);
        dense_by_cairo(&other, value);
        const int differ = dense_differ(&chart, &other);
        if (points > 16 * WIDE + 2 || differ > WIDE * TALL / 500)
            fail_msg("shape %zu: %d points, %d pixels differ", k, points,
                     differ);
        cairo_destroy(chart.cairo);
        cairo_destroy(other.cairo);
    }
}

/* --- pictures --- */

static void fill_trace(void)
{
    static struct telemetry_axis axis[16];
    struct telemetry_row row = { .axis = axis };
    trace_init(&trace, &job.rig);
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
            row.axis[a].following_q32 = now.acc_q32;
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

static int save(const struct job *of, const struct trace *traced,
                const char *path)
{
    struct messages messages = { .text = NULL };
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    const int err = plot_write(
        of, traced, (enum plot_format)plot_format_of(path), file, &messages);
    assert_int_equal(fclose(file), 0);
    assert_null(messages.text);
    return err;
}

static void a_picture_shows_the_plan_and_the_servo(void **state)
{
    (void)state;
    char path[96];
    png_path(path);
    fake_dolly(&job);
    assert_int_equal(save(&job, NULL, path), 0);
    cairo_surface_t *plan = cairo_image_surface_create_from_png(path);
    assert_int_equal(cairo_surface_status(plan), CAIRO_STATUS_SUCCESS);
    assert_true(count_near(plan, BLUE) > 4000);
    assert_int_equal(count_near(plan, ORANGE), 0);
    fill_trace();
    assert_int_equal(save(&job, &trace, path), 0);
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
    assert_int_equal(save(&job, NULL, path), 0);
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
    assert_int_equal(save(&job, NULL, path), 0); /* no axis at all */
    fake_axis(&job, "still", still, 2, true, wide);
    fake_axis(&job, "one key", one, 1, true, open);
    fake_axis(&job, "tiny", tiny, 2, false, open);
    for (int i = 0; i < 3; i++)
        fake_axis(&job, "more", still, 2, true, open); /* two bands */
    assert_int_equal(save(&job, NULL, path), 0);
    fill_trace();
    assert_int_equal(save(&job, &trace, path), 0);
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
        cmocka_unit_test(
            a_dense_line_has_points_by_its_width_and_looks_the_same),
        cmocka_unit_test(a_picture_shows_the_plan_and_the_servo),
        cmocka_unit_test(a_vector_picture_is_whole_and_small),
        cmocka_unit_test(odd_moves_can_be_drawn),
        cmocka_unit_test(the_format_is_in_the_name),
    };
    return cmocka_run_group_tests(tests, make_directory, remove_directory);
}
