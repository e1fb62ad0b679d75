/* tests/firmware/linux/commands/files/test_plot_space.c - slew plot --space: what
 * the picture shows, read from the SVG.
 *
 * Every view is a linear projection, so that in each of them the middle of a
 * frustum's far side lies on the line from the pupil to the subject, which is in
 * the middle of the picture. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include <math.h>
#include <stdlib.h>

#include "tests/support/run_slew.h"

#define VIEWS      3 /* at a slant, from above, from the side */
#define FRAMES     13
#define CORNERS    4
#define POINTS_MAX 16

#define SIGHT   "stroke:rgb(90.2%,62.4%,0%)"
#define FRUSTUM "stroke-width:0.9;"
#define CARRIED "stroke-width:1.6;"

static char svg[1 << 20];

struct point {
    double x, y;
};

/* The points of the next path behind *at that has `style`; 0: there is none. */
static unsigned next_path(const char **at, const char *style,
                          struct point point[POINTS_MAX])
{
    while ((*at = strstr(*at, "<path ")) != NULL) {
        const char *const end = strstr(*at, "/>"), *found = strstr(*at, style);
        const char *d = strstr(*at, " d=\"");
        unsigned count = 0;
        *at += strlen("<path ");
        if (end == NULL || found == NULL || found > end || d == NULL || d > end)
            continue;
        d += strlen(" d=\"");
        while (count < POINTS_MAX && (*d == 'M' || *d == 'L')) {
            char *rest;
            point[count].x = strtod(d + 1, &rest);
            point[count++].y = strtod(rest, &rest);
            d = rest + strspn(rest, " ");
        }
        return count;
    }
    return 0;
}

/* Of the angle between a frustum's axis and its line of sight, in a view. */
static double sine_between(const struct point sight[2],
                           const struct point frustum[3 * CORNERS])
{
    struct point axis = { 0, 0 };

    for (int k = 0; k < CORNERS; k++) { /* pupil, corner, the next corner */
        axis.x += frustum[3 * k + 1].x / CORNERS;
        axis.y += frustum[3 * k + 1].y / CORNERS;
    }
    axis.x -= frustum[0].x;
    axis.y -= frustum[0].y;
    const struct point to = { sight[1].x - sight[0].x,
                              sight[1].y - sight[0].y };
    const double size = hypot(axis.x, axis.y) * hypot(to.x, to.y);
    assert_true(axis.x * to.x + axis.y * to.y > 0);
    return (axis.x * to.y - axis.y * to.x) / size;
}

static void every_view_has_frusta_that_look_at_the_subject(void **state)
{
    struct point sight[POINTS_MAX], frustum[POINTS_MAX];
    const char *lines = svg, *frusta = svg;

    (void)state;
    run("plot", "--space", "--out", run_path("space.svg"), "examples/slider");
    run_expect(0);
    run_read(run_path("space.svg"), svg, sizeof svg);
    for (int i = 0; i < VIEWS * FRAMES; i++) {
        assert_int_equal(next_path(&lines, SIGHT, sight), 2);
        assert_int_equal(next_path(&frusta, FRUSTUM, frustum), 3 * CORNERS);
        assert_true(
            hypot(sight[0].x - frustum[0].x, sight[0].y - frustum[0].y) < 0.02);
        const double off = sine_between(sight, frustum);
        if (!(fabs(off) < 2e-3)) /* pixels have two decimals */
            fail_msg("view %d, frustum %d: off by %g", i / FRAMES, i % FRAMES,
                     off);
    }
    assert_int_equal(next_path(&lines, SIGHT, sight), 0);
    assert_int_equal(next_path(&frusta, FRUSTUM, frustum), 0);
}

/* The rig of examples/slider with a weight on a rod under its head. */
static void run_put_carried(const char *name)
{
    static char text[1 << 14];
    size_t length;

    run_read("examples/slider/rig.yaml", text, sizeof text);
    length = strlen(text);
    snprintf(text + length, sizeof text - length,
             "payload:\n  bag: {kind: pendulum, axis: slide, length: 600 mm, "
             "mass: 2}\n");
    run_put(name, text);
}

/* In every view thirteen rods, of one length in the beginning and from the side
 * straight down. */
static void what_axes_carry_is_in_the_camera_s_scene(void **state)
{
    struct point rod[POINTS_MAX], above = { 0, 0 };
    const char *rods = svg;

    (void)state;
    run_put_carried("rig.yaml");
    run("plot", "--space", "--out", run_path("space.svg"), run_path("rig.yaml"),
        "examples/slider/move.yaml");
    run_expect(0);
    run_read(run_path("space.svg"), svg, sizeof svg);
    for (int i = 0; i < VIEWS * FRAMES; i++) {
        assert_int_equal(next_path(&rods, CARRIED, rod), 2);
        const double x = rod[1].x - rod[0].x, y = rod[1].y - rod[0].y;
        if (i % FRAMES == 0 && i / FRAMES == 1) /* from above it is a point */
            assert_true(hypot(x, y) < 0.02);
        else if (i % FRAMES == 0)
            assert_true(fabs(x) < 0.02 && y > 20);
        if (i % FRAMES == 1)
            above = rod[0];
        if (i % FRAMES == FRAMES - 1) /* the slide has gone on */
            assert_true(hypot(rod[0].x - above.x, rod[0].y - above.y) > 20);
    }
    assert_int_equal(next_path(&rods, CARRIED, rod), 0);
}

static void what_has_no_camera_is_refused(void **state)
{
    (void)state;
    run("plot", "--space", "--out", run_path("none.svg"), "examples/dolly");
    run_expect(2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_view_has_frusta_that_look_at_the_subject),
        cmocka_unit_test(what_axes_carry_is_in_the_camera_s_scene),
        cmocka_unit_test(what_has_no_camera_is_refused),
    };
    return cmocka_run_group_tests(tests, run_open, run_close);
}
