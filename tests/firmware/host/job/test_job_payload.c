/* tests/firmware/host/job/test_job_payload.c - where in the camera's space what
 * axes carry is, by hand. */
#include "firmware/host/job/job_payload.h"

#include <math.h>

#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

static struct job *job;
static struct plan_rig rig;

static int open_slider(void **state)
{
    (void)state;
    job = calloc(1, sizeof *job);
    assert_int_equal(job_open(job, &disk_files, "examples/slider/rig.yaml",
                              "examples/slider/move.yaml", false, NULL),
                     STATUS_OK);
    assert_true(job_camera_rig(job, &rig));
    return 0;
}

static int close_slider(void **state)
{
    (void)state;
    job_free(job);
    free(job);
    return 0;
}

static void expect_point(const struct rig_payload *payload, int64_t t,
                         double at, const double point[3], double x, double y,
                         double z)
{
    struct job_payload_place place;
    double space[3];

    job_payload_place(job, &rig, payload, t, at, &place);
    job_payload_in_space(&place, point, space);
    if (!(fabs(space[0] - x) < 1e-12 && fabs(space[1] - y) < 1e-12 &&
          fabs(space[2] - z) < 1e-12))
        fail_msg("at %.9f %.9f %.9f, wanted %.9f %.9f %.9f", space[0], space[1],
                 space[2], x, y, z);
}

static uint32_t axis_of(const char *name)
{
    return job->rig_axis[job_axis_index(job, name)];
}

/* The slider is 1.1 m above x, so a weight 0.6 m under it and 0.1 m behind it is
 * at its place less 0.1 m, 0.5 m. */
static void a_payload_of_the_carrier_hangs_from_the_head(void **state)
{
    const struct rig_payload lamp = { .kind = RIG_PAYLOAD_PENDULUM,
                                      .axis = axis_of("slide") };
    (void)state;

    for (int i = 0; i <= 4; i++) {
        const int64_t t = job->end_ns_q12 / 4 * i;
        const double at =
            plan_rig_track(&job->track[job_axis_index(job, "slide")], t, -1).p /
            1000;
        const double point[3] = { at - 0.1, 0.02, -0.6 };
        expect_point(&lamp, t, at, point, at - 0.1, 0.02, 0.5);
    }
}

/* Where the rig says, its own way: 30 degrees to the left of x. */
static void a_payload_is_where_the_rig_places_it(void **state)
{
    const double c = sqrt(0.75), s = 0.5;
    const struct rig_payload lamp = { .kind = RIG_PAYLOAD_CABLE,
                                      .axis = axis_of("slide"),
                                      .is_placed = true,
                                      .origin_m = { 1, 2, 3 },
                                      .along = { c, s } };
    const double point[3] = { 0.4, 0.1, -0.5 };
    struct rig_payload free_lamp = lamp;
    (void)state;

    expect_point(&lamp, 0, 0.4, point, 1 + 0.4 * c - 0.1 * s,
                 2 + 0.4 * s + 0.1 * c, 2.5);
    /* no carrier: from the origin along x */
    free_lamp.is_placed = false;
    free_lamp.axis = axis_of("focus");
    expect_point(&free_lamp, 0, 0.4, point, 0.4, 0.1, -0.5);
    /* a plate has its own x, which its axis does not shift */
    free_lamp.kind = RIG_PAYLOAD_BALL;
    expect_point(&free_lamp, 0, 0.3, point, 0.4, 0.1, -0.5);
}

/* A quarter of a turn anticlockwise of an arm of 2 m that begins along x: its end
 * is 2 m further along and 2 m to the left, and goes along y. */
static void a_payload_of_an_arm_goes_round(void **state)
{
    const double quarter = 2 * asin(1);
    const struct rig_payload lamp = { .kind = RIG_PAYLOAD_PENDULUM,
                                      .axis = axis_of("pan"),
                                      .arm_m = 2,
                                      .is_placed = true,
                                      .origin_m = { 5, 0, 1 },
                                      .along = { 1, 0 } };
    const double under[3] = { quarter + 0.1, 0, -0.7 };
    (void)state;

    expect_point(&lamp, 0, quarter, under, 7, 2.1, 0.3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_payload_of_the_carrier_hangs_from_the_head),
        cmocka_unit_test(a_payload_is_where_the_rig_places_it),
        cmocka_unit_test(a_payload_of_an_arm_goes_round),
    };
    return cmocka_run_group_tests(tests, open_slider, close_slider);
}
