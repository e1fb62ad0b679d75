/* firmware/host/job/job_camera.c - see job_camera.h. */
#include "firmware/host/job/job_camera.h"

#include <cjson/cJSON.h>
#include <math.h>

#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/camera/plan_camera.h"
#include "motion/plan/camera/plan_follow.h"
#include "motion/plan/rig/plan_arm.h"

#define CAMERA_SAMPLES 9

/* ---- the rig ------------------------------------------------------------- */

/* Of a rig without kinematics: the path's coordinates are linear axes of the head. */
static void camera_path_rig(const struct plan_move *move, struct plan_rig *rig)
{
    const struct plan_camera *camera = move->camera;
    const struct plan_path *path = move->path;
    struct motion_linear *linear = &rig->rig.carrier.as.linear;

    *rig = (struct plan_rig){ .rig.carrier.kind = &motion_carrier_linear,
                              .forward = camera->forward,
                              .up = camera->up };
    linear->origin = motion_vec_zero();
    linear->count = path->points.axes;
    for (uint32_t i = 0; i < linear->count; i++) {
        linear->direction[i].q62[i] = (int64_t)1 << 62;
        rig->carrier[i] = (struct plan_rig_axis){ true, path->axis[i] };
    }
    (void)motion_mount_level(motion_vec_from_dir(camera->forward),
                             motion_vec_from_dir(camera->up),
                             &rig->rig.carrier.level);
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        rig->head[i] =
            (struct plan_rig_axis){ i != MOTION_HEAD_ROLL || camera->has_roll,
                                    camera->axis[i] };
}

/* From the index of an axis in the rig to its index in the move; not given when the
 * move does not drive it. */
static void camera_map_axis(const struct job *job, struct plan_rig_axis *axis)
{
    const uint32_t rig_axis = axis->axis;
    const bool is_given = axis->is_given;

    axis->is_given = false;
    for (uint32_t i = 0; is_given && i < job->move.axis_count; i++)
        if (job->rig_axis[i] == rig_axis)
            *axis = (struct plan_rig_axis){ true, i };
}

bool job_camera_rig(const struct job *job, struct plan_rig *rig)
{
    const struct plan_move *move = &job->move;

    if (job->rig.kinematics == NULL &&
        (move->camera == NULL || move->path == NULL))
        return false;
    if (job->rig.kinematics == NULL) {
        camera_path_rig(move, rig);
        return true;
    }
    *rig = *job->rig.kinematics;
    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        camera_map_axis(job, &rig->carrier[i]);
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        camera_map_axis(job, &rig->head[i]);
    for (int i = 0; i < PLAN_LENSES; i++)
        camera_map_axis(job, &rig->lens[i]);
    for (uint32_t i = 0; i < rig->arm.arm.count; i++)
        camera_map_axis(job, &rig->arm.axis[i]);
    camera_map_axis(job, &rig->table);
    return true;
}

const struct plan_camera *job_camera_look(const struct job *job)
{
    const struct plan_path *path = job->move.path;

    return path != NULL && path->tool.look != NULL ? path->tool.look
                                                   : job->move.camera;
}

bool job_camera_subject(const struct job *job, int64_t t_ns_q12,
                        struct plan_jet_vec *subject)
{
    const struct plan_camera *camera = job_camera_look(job);

    return camera != NULL &&
           plan_follow_subject(camera, job->track, t_ns_q12, subject);
}

static int64_t camera_axis_pos(const struct job *job,
                               const struct plan_rig_axis *axis,
                               int64_t t_ns_q12)
{
    struct motion_state at = { .pos_q32 = 0 };

    if (axis->is_given)
        motion_track_state(&job->track[axis->axis], t_ns_q12, &at);
    return at.pos_q32;
}

/* Joints that the move does not drive are at zero. */
static bool camera_arm_pose(const struct job *job, int64_t t_ns_q12,
                            struct motion_camera *camera)
{
    int64_t joint_q32[MOTION_ARM_JOINTS_MAX];
    struct plan_rig rig;

    if (!job_camera_rig(job, &rig) || rig.arm.arm.count == 0)
        return false;
    for (uint32_t i = 0; i < rig.arm.arm.count; i++) {
        const struct plan_jet axis = plan_jet_of(number_double(
            camera_axis_pos(job, &rig.arm.axis[i], t_ns_q12), 32));
        joint_q32[i] = plan_arm_joint_q32(
            &rig.arm, i,
            rig.arm.axis[i].is_given ? plan_arm_joint(&rig.arm, i, axis).p : 0);
    }
    if (motion_arm_camera(&rig.arm.arm, &rig.arm.tool, joint_q32, camera) < 0)
        return false;
    camera->q = motion_quat_mul(rig.arm.base.q, camera->q);
    camera->pupil = motion_vec_add(
        rig.arm.base.origin, motion_mount_turn(rig.arm.base.q, camera->pupil));
    return true;
}

bool job_camera_rotation(const struct job *job, int64_t t_ns_q12,
                         struct motion_quat *q)
{
    const struct plan_camera *move_camera = job->move.camera;
    int64_t axis_q32[MOTION_RIG_AXES_MAX];
    struct motion_camera camera;

    if (camera_arm_pose(job, t_ns_q12, &camera)) {
        *q = camera.q;
        return true;
    }
    if (move_camera == NULL || move_camera->following.rig == NULL)
        return false;
    const struct plan_rig *rig = move_camera->following.rig;
    const uint32_t carried = motion_rig_axes(&rig->rig) - MOTION_HEAD_AXES;
    for (uint32_t i = 0; i < carried; i++)
        axis_q32[i] = camera_axis_pos(job, &rig->carrier[i], t_ns_q12);
    for (uint32_t i = 0; i < MOTION_HEAD_AXES; i++)
        axis_q32[carried + i] = camera_axis_pos(job, &rig->head[i], t_ns_q12);
    if (motion_rig_camera(&rig->rig, axis_q32, &camera) < 0)
        return false;
    *q = camera.q;
    return true;
}

/* ---- samples of the shot ------------------------------------------------- */

/* In m, m/s; the lens in mm. */
struct camera_sample {
    double t_s, at[3], speed, distance, lens[PLAN_LENSES];
    bool has_distance, has_lens[PLAN_LENSES];
};

static double camera_length(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static void camera_sample(const struct job *job, const struct plan_rig *rig,
                          int i, struct camera_sample *sample)
{
    struct plan_rig_camera camera;
    struct plan_jet_vec subject;
    double rate[3], to[3];
    int64_t t = 0;

    (void)motion_fixed_muldiv(job->end_ns_q12, i, CAMERA_SAMPLES - 1, &t);
    plan_rig_camera_at(rig, job->track, t, &camera);
    sample->t_s = number_double(t, 12) / 1e9;
    sample->has_distance = job_camera_subject(job, t, &subject);
    for (int k = 0; k < 3; k++) {
        sample->at[k] = camera.pupil.x[k].p / 1000;
        rate[k] = camera.pupil.x[k].v / 1000;
        to[k] =
            sample->has_distance ? subject.x[k].p / 1000 - sample->at[k] : 0;
    }
    sample->speed = camera_length(rate);
    sample->distance = camera_length(to);
    for (int k = 0; k < PLAN_LENSES; k++) {
        sample->has_lens[k] = rig->lens[k].is_given;
        if (sample->has_lens[k])
            sample->lens[k] =
                plan_rig_track(&job->track[rig->lens[k].axis], t, -1).p;
    }
}

static void camera_cell(struct table *table, bool is_given, int decimals,
                        double value)
{
    if (is_given)
        table_cell(table, "%.*f", decimals, value);
    else
        table_cell(table, "-");
}

void job_camera_text(const struct job *job, FILE *file)
{
    static const char *const head[] = {
        ">time",       ">camera x, m", ">y, m",     ">z, m",
        ">speed, m/s", ">subject, m",  ">focus, m", ">focal, mm",
    };
    struct plan_rig rig;
    struct table table;

    if (!job_camera_rig(job, &rig))
        return;
    fputc('\n', file);
    table_init(&table, 8, head);
    for (int i = 0; i < CAMERA_SAMPLES; i++) {
        struct camera_sample sample = { .t_s = 0 };
        camera_sample(job, &rig, i, &sample);
        table_cell(&table, "%.3f s", sample.t_s);
        for (int k = 0; k < 3; k++)
            table_cell(&table, "%.3f", sample.at[k]);
        table_cell(&table, "%.3f", sample.speed);
        camera_cell(&table, sample.has_distance, 3, sample.distance);
        camera_cell(&table, sample.has_lens[PLAN_LENS_FOCUS], 3,
                    sample.lens[PLAN_LENS_FOCUS] / 1000);
        camera_cell(&table, sample.has_lens[PLAN_LENS_ZOOM], 1,
                    sample.lens[PLAN_LENS_ZOOM]);
    }
    table_print(&table, file);
    table_free(&table);
}

void job_camera_json(const struct job *job, struct cJSON *object)
{
    struct plan_rig rig;

    if (!job_camera_rig(job, &rig))
        return;
    struct cJSON *list = cJSON_AddArrayToObject(object, "shot");
    for (int i = 0; i < CAMERA_SAMPLES; i++) {
        struct cJSON *item = cJSON_CreateObject();
        struct camera_sample sample = { .t_s = 0 };
        camera_sample(job, &rig, i, &sample);
        cJSON_AddItemToArray(list, item);
        cJSON_AddNumberToObject(item, "time_s", sample.t_s);
        cJSON_AddItemToObject(item, "camera_m",
                              cJSON_CreateDoubleArray(sample.at, 3));
        cJSON_AddNumberToObject(item, "speed_m_s", sample.speed);
        if (sample.has_distance)
            cJSON_AddNumberToObject(item, "subject_m", sample.distance);
        if (sample.has_lens[PLAN_LENS_FOCUS])
            cJSON_AddNumberToObject(item, "focus_m",
                                    sample.lens[PLAN_LENS_FOCUS] / 1000);
        if (sample.has_lens[PLAN_LENS_ZOOM])
            cJSON_AddNumberToObject(item, "focal_mm",
                                    sample.lens[PLAN_LENS_ZOOM]);
    }
}
