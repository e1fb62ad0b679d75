/* tests/firmware/host/job/test_job_camera.c - the camera of the examples: its
 * place by hand, its samples, and its picture. */
#include "firmware/host/job/job_camera.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/plot/plot_space.h"
#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

#define DEG (acos(-1) / 180)

static struct job *open_job(const char *folder)
{
    struct job *job = calloc(1, sizeof *job);
    char rig[100], move[100];

    snprintf(rig, sizeof rig, "%s/rig.yaml", folder);
    snprintf(move, sizeof move, "%s/move.yaml", folder);
    assert_int_equal(job_open(job, &disk_files, rig, move, false, NULL),
                     STATUS_OK);
    return job;
}

static void close_job(struct job *job)
{
    job_free(job);
    free(job);
}

static double axis_at(const struct job *job, const char *name, int64_t t)
{
    return plan_rig_track(&job->track[job_axis_index(job, name)], t, -1).p;
}

/* The pivot at (slide, 0, 1100), the pupil 65 mm before and 40 mm above it, pan
 * 0 along y. */
static void a_slider_is_where_a_hand_computes_it(void **state)
{
    struct job *job = open_job("examples/slider");
    struct plan_rig rig;

    (void)state;
    assert_true(job_camera_rig(job, &rig));
    for (int i = 0; i <= 8; i++) {
        const int64_t t = job->end_ns_q12 / 8 * i;
        const double pan = axis_at(job, "pan", t) * DEG,
                     tilt = axis_at(job, "tilt", t) * DEG;
        const double flat = 65 * cos(tilt) - 40 * sin(tilt);
        const double want[3] = { axis_at(job, "slide", t) - flat * sin(pan),
                                 flat * cos(pan),
                                 1100 + 65 * sin(tilt) + 40 * cos(tilt) };
        struct plan_rig_camera camera;
        plan_rig_camera_at(&rig, job->track, t, &camera);
        for (int k = 0; k < 3; k++)
            assert_true(fabs(camera.pupil.x[k].p - want[k]) < 1e-9);
    }
    close_job(job);
}

static void a_path_carries_a_camera_without_kinematics(void **state)
{
    struct job *job = open_job("examples/flyby");
    struct plan_rig rig;
    struct plan_rig_camera camera;

    (void)state;
    assert_true(job_camera_rig(job, &rig));
    plan_rig_camera_at(&rig, job->track, job->end_ns_q12, &camera);
    assert_true(fabs(camera.pupil.x[0].p - 3500) < 1e-6);
    assert_true(fabs(camera.pupil.x[1].p - 1000) < 1e-6);
    assert_true(fabs(camera.pupil.x[2].p - 1500) < 1e-6);
    close_job(job);
    job = open_job("examples/dolly");
    assert_false(job_camera_rig(job, &rig));
    close_job(job);
}

static double number_in(const cJSON *item, const char *name)
{
    const cJSON *value = cJSON_GetObjectItem(item, name);

    assert_non_null(value);
    return value->valuedouble;
}

/* Focus is the distance, and focal length in proportion. */
static void a_list_of_moments_agrees_with_itself(void **state)
{
    struct job *job = open_job("examples/dollyzoom");
    cJSON *object = cJSON_CreateObject(), *item;
    int moments = 0;

    (void)state;
    job_camera_json(job, object);
    cJSON_ArrayForEach(item, cJSON_GetObjectItem(object, "shot"))
    {
        const double far = number_in(item, "subject_m");
        assert_true(fabs(number_in(item, "focus_m") - far) < 1e-6);
        assert_true(fabs(number_in(item, "focal_mm") - 100 * far / 4.919634) <
                    1e-3);
        moments++;
    }
    assert_int_equal(moments, 9);
    cJSON_Delete(object);
    close_job(job);
}

static void every_camera_has_a_picture(void **state)
{
    static const char *const folder[] = {
        "examples/slider", "examples/orbit",   "examples/dollyzoom",
        "examples/jib",    "examples/product", "examples/timelapse",
        "examples/flyby",
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(folder); i++) {
        struct job *job = open_job(folder[i]);
        struct messages messages = { .text = NULL };
        char start[9] = "";
        for (int format = PLOT_SVG; format <= PLOT_PNG; format++) {
            FILE *file = tmpfile();
            assert_int_equal(plot_space_write(job, NULL,
                                              (enum plot_format)format, file,
                                              &messages),
                             0);
            assert_true(ftell(file) > 20000);
            rewind(file);
            assert_int_equal(fread(start, 1, 8, file), 8);
            assert_memory_equal(start, format == PLOT_SVG ? "<?xml" : "\x89PNG",
                                4);
            fclose(file);
        }
        messages_free(&messages);
        close_job(job);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_slider_is_where_a_hand_computes_it),
        cmocka_unit_test(a_path_carries_a_camera_without_kinematics),
        cmocka_unit_test(a_list_of_moments_agrees_with_itself),
        cmocka_unit_test(every_camera_has_a_picture),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
