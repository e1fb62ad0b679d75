/* tests/motion/vectors_demand.c - see vectors_demand.h. */
#include "tests/motion/vectors_demand.h"

/* --- a row ----------------------------------------------------------------- */

bool vectors_sheet_get(const struct sheet *sheet, const char *name, double *to)
{
    const int n = cJSON_GetArraySize(sheet->names);

    for (int i = 0; i < n; i++) {
        const cJSON *const value = cJSON_GetArrayItem(sheet->values, i);
        if (strcmp(vectors_string(cJSON_GetArrayItem(sheet->names, i)), name) ==
            0) {
            *to = vectors_value(value);
            return cJSON_IsNumber(value);
        }
    }
    return false;
}

static bool vectors_sheet_q32(const struct sheet *sheet, const char *name,
                              int64_t *to)
{
    double a;

    if (!vectors_sheet_get(sheet, name, &a))
        return false;
    *to = vectors_q32(a);
    return true;
}

static bool sheet_point(const struct sheet *sheet, const char *x, const char *y,
                        const char *z, struct motion_vec *point)
{
    double a[3];

    if (!vectors_sheet_get(sheet, x, &a[0]) ||
        !vectors_sheet_get(sheet, y, &a[1]) ||
        !vectors_sheet_get(sheet, z, &a[2]))
        return false;
    *point = vectors_vec(a);
    return true;
}

bool vectors_sheet_pupil(const struct sheet *sheet, struct motion_vec *point)
{
    return sheet_point(sheet, "px", "py", "pz", point);
}

bool vectors_sheet_subject(const struct sheet *sheet, struct motion_vec *point)
{
    return sheet_point(sheet, "sx", "sy", "sz", point);
}

bool vectors_sheet_quat(const struct sheet *sheet, struct motion_quat *q)
{
    static const char *const name[4] = { "qw", "qx", "qy", "qz" };
    int64_t q62[4];
    double a;

    for (int i = 0; i < 4; i++) {
        if (!vectors_sheet_get(sheet, name[i], &a) || fabs(a) > 1)
            return false;
        q62[i] = (int64_t)llrint(ldexp(a, 62));
    }
    return motion_quat_unit(q62, q) == MOTION_OK;
}

void vectors_sheet_axes(const struct sheet *sheet,
                        const struct vectors_rig *rig, const char *prefix,
                        int64_t *axis_q32)
{
    char name[32];

    for (int i = 0; i < rig->axes; i++) {
        snprintf(name, sizeof name, "%s%s", prefix, rig->name[i]);
        (void)vectors_sheet_q32(sheet, name, &axis_q32[i]);
    }
}

/* --- forward ---------------------------------------------------------------- */

int vectors_rig_camera(const struct vectors_rig *rig, const int64_t *axis_q32,
                       struct motion_camera *camera)
{
    struct motion_pose flange;
    int err;

    if (rig->sort == RIG_CAMERA)
        return motion_rig_camera(&rig->camera, axis_q32, camera);
    if (rig->sort == RIG_TABLE)
        return motion_turntable_camera(&rig->table, axis_q32, camera);
    err = motion_arm_flange(&rig->arm, axis_q32, &flange);
    *camera = (struct motion_camera){ flange.origin, flange.q };
    return err;
}

int vectors_rig_forward(const struct vectors_rig *rig, const struct sheet *in,
                        const int64_t *before_q32, struct answer *got)
{
    struct motion_vec subject;
    const bool has_subject = vectors_sheet_subject(in, &subject);
    int err;

    vectors_sheet_axes(in, rig, "", got->axis_q32);
    if (rig->has_zoom && has_subject)
        return motion_dolly_zoom_focal(&rig->zoom, subject, before_q32,
                                       got->axis_q32, &got->focal_q32,
                                       &got->distance);
    err = vectors_rig_camera(rig, got->axis_q32, &got->camera);
    if (has_subject && err == MOTION_OK)
        motion_camera_distance(&got->camera, subject, &got->distance,
                               &got->depth);
    return err;
}

int vectors_rig_tool(const struct vectors_rig *rig, const struct sheet *in,
                     const int64_t *before_q32, struct answer *got)
{
    (void)before_q32;
    vectors_sheet_axes(in, rig, "", got->axis_q32);
    return motion_arm_camera(&rig->arm, &rig->tool, got->axis_q32,
                             &got->camera);
}

/* --- demands ---------------------------------------------------------------- */

static int track(const struct vectors_rig *rig, const struct sheet *in,
                 const int64_t *before_q32, struct answer *got)
{
    struct motion_vec subject;

    if (rig->sort != RIG_CAMERA || !vectors_sheet_subject(in, &subject))
        return MALFORMED;
    vectors_sheet_axes(in, rig, "", got->axis_q32);
    return motion_rig_track(&rig->camera, subject, before_q32, got->axis_q32,
                            &got->distance);
}

static int pose(const struct vectors_rig *rig, const struct sheet *in,
                const int64_t *before_q32, struct answer *got)
{
    struct motion_camera camera;

    if (rig->sort != RIG_CAMERA || !vectors_sheet_pupil(in, &camera.pupil) ||
        !vectors_sheet_quat(in, &camera.q))
        return MALFORMED;
    return motion_rig_pose(&rig->camera, &camera, before_q32, got->axis_q32);
}

static int view(const struct vectors_rig *rig, const struct sheet *in,
                const int64_t *before_q32, struct answer *got)
{
    struct motion_camera camera;
    struct motion_vec pupil, subject;
    int err;

    if (rig->sort != RIG_CAMERA || !vectors_sheet_pupil(in, &pupil) ||
        !vectors_sheet_subject(in, &subject))
        return MALFORMED;
    err = motion_rig_level_view(pupil, subject, &camera);
    return err < 0 ? err
                   : motion_rig_pose(&rig->camera, &camera, before_q32,
                                     got->axis_q32);
}

static int relative(const struct vectors_rig *rig, const struct sheet *in,
                    const int64_t *before_q32, struct answer *got)
{
    int64_t azimuth_q32, radius_q32;
    const bool has_radius = vectors_sheet_q32(in, "radius", &radius_q32);

    if (rig->sort != RIG_TABLE ||
        !vectors_sheet_q32(in, "azimuth", &azimuth_q32))
        return MALFORMED;
    return motion_turntable_relative(&rig->table, azimuth_q32,
                                     has_radius ? &radius_q32 : NULL,
                                     before_q32, got->axis_q32, &got->distance);
}

static int flange(const struct vectors_rig *rig, const struct sheet *in,
                  const int64_t *before_q32, struct answer *got)
{
    const int64_t zero_q32[RIG_AXES_MAX] = { 0 };
    struct motion_pose at;

    if (rig->sort != RIG_ARM || !vectors_sheet_pupil(in, &at.origin) ||
        !vectors_sheet_quat(in, &at.q))
        return MALFORMED;
    return motion_arm_inverse(&rig->arm, &at,
                              before_q32 != NULL ? before_q32 : zero_q32,
                              got->axis_q32);
}

static int focal(const struct vectors_rig *rig, const struct sheet *in,
                 const int64_t *before_q32, struct answer *got)
{
    struct motion_vec subject;
    int64_t focal_q32;

    if (!rig->has_zoom || !vectors_sheet_subject(in, &subject) ||
        !vectors_sheet_q32(in, "focal", &focal_q32))
        return MALFORMED;
    return motion_dolly_zoom_slide(&rig->zoom, focal_q32, subject, before_q32,
                                   got->axis_q32, &got->distance);
}

static int dolly_zoom(const struct vectors_rig *rig, const struct sheet *in,
                      const int64_t *before_q32, struct answer *got)
{
    int err = rig->has_zoom ? vectors_rig_forward(rig, in, before_q32, got)
                            : MALFORMED;

    return err < 0 ? err : motion_dolly_zoom_check(&rig->zoom, got->focal_q32);
}

static const struct {
    const char *name;
    vectors_demand *answer;
} demands[] = {
    { "track", track },           { "pose", pose },     { "view", view },
    { "relative", relative },     { "flange", flange }, { "focal", focal },
    { "dolly zoom", dolly_zoom },
};

vectors_demand *vectors_demand_named(const char *name)
{
    for (size_t i = 0; i < sizeof demands / sizeof demands[0]; i++) {
        if (strcmp(name, demands[i].name) == 0)
            return demands[i].answer;
    }
    return NULL;
}
