/* tests/motion/vectors_demand.c - see vectors_demand.h. */
#include "tests/motion/vectors_demand.h"

#include "motion/double/double_math.h"
#include "tests/motion/kinematics/rig_inverse.h"

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

static struct plan_jet_vec jets_of(struct motion_vec v)
{
    const double x[3] = { plan_rig_real(v.x[0]), plan_rig_real(v.x[1]),
                          plan_rig_real(v.x[2]) };

    return plan_jet_vec_of(x);
}

static struct motion_vec vec_of(struct plan_jet_vec v)
{
    return vectors_vec((const double[]){ v.x[0].p, v.x[1].p, v.x[2].p });
}

static double from_q32(int64_t a)
{
    return ldexp((double)a, -32);
}

/* Seen from the table: what it takes back by turning the other way. */
static struct motion_vec from_table(const struct vectors_rig *rig,
                                    int64_t table_q32, struct motion_vec v)
{
    struct plan_rig origin = rig->table;

    memset(origin.centre_q32, 0, sizeof origin.centre_q32);
    return vec_of(plan_rig_on_table(&origin, plan_jet_of(-from_q32(table_q32)),
                                    jets_of(v)));
}

/* The table's frame from what its rotation makes of view and up. */
static int table_camera(const struct vectors_rig *rig, const int64_t *axis_q32,
                        struct motion_camera *camera)
{
    const int64_t one_q62 = (int64_t)1 << 62;
    const struct motion_vec centre = vec_of(plan_rig_on_table(
        &rig->table, plan_jet_of(0), plan_jet_vec_of((const double[3]){ 0 })));
    struct motion_vec view, up;
    int err = motion_rig_camera(&rig->camera, axis_q32 + 1, camera);

    if (err < 0)
        return err;
    view = motion_vec_from_dir(
        motion_quat_turn(camera->q, (struct motion_dir){ { 0, 0, -one_q62 } }));
    up = motion_vec_from_dir(
        motion_quat_turn(camera->q, (struct motion_dir){ { 0, one_q62, 0 } }));
    camera->pupil =
        from_table(rig, axis_q32[0], motion_vec_sub(camera->pupil, centre));
    return motion_mount_level(from_table(rig, axis_q32[0], view),
                              from_table(rig, axis_q32[0], up), &camera->q);
}

int vectors_rig_camera(const struct vectors_rig *rig, const int64_t *axis_q32,
                       struct motion_camera *camera)
{
    struct motion_pose flange;
    int err;

    if (rig->sort == RIG_CAMERA)
        return motion_rig_camera(&rig->camera, axis_q32, camera);
    if (rig->sort == RIG_TABLE)
        return table_camera(rig, axis_q32, camera);
    err = motion_arm_flange(&rig->arm, axis_q32, &flange);
    *camera = (struct motion_camera){ flange.origin, flange.q };
    return err;
}

/* The focal length per distance that the lens has where it was set. */
static int zoom_ratio(const struct vectors_rig *rig, double *ratio)
{
    const struct vectors_zoom *const zoom = &rig->zoom;
    int64_t axis_q32[RIG_AXES_MAX] = { zoom->slide_at_q32 };
    double distance = 0;
    int err = rig_inverse_track(&rig->camera, zoom->subject_at, NULL, axis_q32,
                                &distance);

    *ratio = from_q32(zoom->focal_at_q32) / distance;
    return err;
}

static int zoomed(const struct vectors_rig *rig, struct motion_vec subject,
                  const int64_t *before_q32, struct answer *got)
{
    double ratio = 0;
    int err = zoom_ratio(rig, &ratio);

    if (err == MOTION_OK)
        err = rig_inverse_track(&rig->camera, subject, before_q32,
                                got->axis_q32, &got->distance);
    got->focal_q32 = vectors_q32(ratio * got->distance);
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
        return zoomed(rig, subject, before_q32, got);
    err = vectors_rig_camera(rig, got->axis_q32, &got->camera);
    if (has_subject && err == MOTION_OK) {
        const struct motion_vec to = motion_vec_sub(subject, got->camera.pupil);
        const struct motion_dir view = motion_quat_turn(
            got->camera.q,
            (struct motion_dir){ { 0, 0, -((int64_t)1 << 62) } });
        got->distance = vectors_double(motion_vec_length(to));
        got->depth =
            vectors_double(motion_vec_dot(to, motion_vec_from_dir(view)));
    }
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

#define SEARCH_STEPS 200
#define SEARCH_STEP  1e-4 /* mm, of a difference */
#define SEARCH_OFF   1e-9 /* mm and deg */

static int track(const struct vectors_rig *rig, const struct sheet *in,
                 const int64_t *before_q32, struct answer *got)
{
    struct motion_vec subject;

    if (rig->sort != RIG_CAMERA || !vectors_sheet_subject(in, &subject))
        return MALFORMED;
    vectors_sheet_axes(in, rig, "", got->axis_q32);
    return rig_inverse_track(&rig->camera, subject, before_q32, got->axis_q32,
                             &got->distance);
}

static int pose(const struct vectors_rig *rig, const struct sheet *in,
                const int64_t *before_q32, struct answer *got)
{
    struct motion_camera camera;

    if (rig->sort != RIG_CAMERA || !vectors_sheet_pupil(in, &camera.pupil) ||
        !vectors_sheet_quat(in, &camera.q))
        return MALFORMED;
    return rig_inverse_pose(&rig->camera, &camera, before_q32, got->axis_q32);
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
    err = rig_inverse_level_view(pupil, subject, &camera);
    return err < 0 ? err
                   : rig_inverse_pose(&rig->camera, &camera, before_q32,
                                      got->axis_q32);
}

/* Track the table's subject; where the pupil is then, from the table. */
static int table_track(const struct vectors_rig *rig, const int64_t *before_q32,
                       struct answer *got, struct motion_vec *pupil)
{
    const struct plan_jet_vec subject =
        plan_rig_on_table(&rig->table, plan_jet_of(from_q32(got->axis_q32[0])),
                          jets_of(rig->on_table));
    int err = rig_inverse_track(&rig->camera, vec_of(subject),
                                before_q32 != NULL ? before_q32 + 1 : NULL,
                                got->axis_q32 + 1, &got->distance);

    if (err == MOTION_OK)
        err = table_camera(rig, got->axis_q32, &got->camera);
    *pupil = got->camera.pupil;
    return err;
}

static double radius_of(struct motion_vec pupil)
{
    return hypot(vectors_double(pupil.x[0]), vectors_double(pupil.x[1]));
}

/* By steps from the axes before: the table by how far the azimuth is off, the
 * slide by Newton's. */
static int relative(const struct vectors_rig *rig, const struct sheet *in,
                    const int64_t *before_q32, struct answer *got)
{
    double azimuth, radius = 0;
    const bool has_radius = vectors_sheet_get(in, "radius", &radius);
    struct motion_vec pupil, aside;

    if (rig->sort != RIG_TABLE || !vectors_sheet_get(in, "azimuth", &azimuth))
        return MALFORMED;
    for (int i = 0; i < rig->axes && before_q32 != NULL; i++)
        got->axis_q32[i] = i + 1 < rig->axes ? before_q32[i] : 0;
    for (int i = 0; i < SEARCH_STEPS; i++) {
        struct answer beside = *got;
        double off = 0, slope = 0;
        int err = table_track(rig, before_q32, got, &pupil);
        if (err < 0)
            return err;
        const double turn = remainder(
            atan2(vectors_double(pupil.x[1]), vectors_double(pupil.x[0])) /
                    DOUBLE_RADIAN -
                azimuth,
            360);
        if (has_radius) {
            off = radius_of(pupil) - radius;
            beside.axis_q32[1] += vectors_q32(SEARCH_STEP);
            err = table_track(rig, before_q32, &beside, &aside);
            slope = (radius_of(aside) - radius_of(pupil)) / SEARCH_STEP;
        }
        if (err < 0)
            return err;
        if (fabs(turn) <= SEARCH_OFF && fabs(off) <= SEARCH_OFF)
            return MOTION_OK;
        got->axis_q32[0] += vectors_q32(turn);
        if (has_radius)
            got->axis_q32[1] -= vectors_q32(off / slope);
    }
    return MOTION_E_UNREACHABLE;
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

/* The slide, by Newton's method on the focal length from where it was. */
static int focal(const struct vectors_rig *rig, const struct sheet *in,
                 const int64_t *before_q32, struct answer *got)
{
    struct motion_vec subject;
    double wanted;

    if (!rig->has_zoom || !vectors_sheet_subject(in, &subject) ||
        !vectors_sheet_get(in, "focal", &wanted))
        return MALFORMED;
    memset(got->axis_q32, 0, sizeof got->axis_q32);
    if (before_q32 != NULL)
        got->axis_q32[0] = before_q32[0];
    for (int i = 0; i < SEARCH_STEPS; i++) {
        struct answer beside = *got;
        int err = zoomed(rig, subject, before_q32, got);
        beside.axis_q32[0] += vectors_q32(SEARCH_STEP);
        if (err == MOTION_OK)
            err = zoomed(rig, subject, before_q32, &beside);
        if (err < 0)
            return err;
        const double off = from_q32(got->focal_q32) - wanted;
        const double slope =
            from_q32(beside.focal_q32 - got->focal_q32) / SEARCH_STEP;
        if (fabs(off) <= SEARCH_OFF * fabs(slope) || fabs(off) < 2e-10)
            return MOTION_OK;
        got->axis_q32[0] -= vectors_q32(off / slope);
    }
    return MOTION_E_UNREACHABLE;
}

/* Within what the lens has. */
static int dolly_zoom(const struct vectors_rig *rig, const struct sheet *in,
                      const int64_t *before_q32, struct answer *got)
{
    int err = rig->has_zoom ? vectors_rig_forward(rig, in, before_q32, got)
                            : MALFORMED;

    if (err == MOTION_OK && (got->focal_q32 < rig->zoom.focal_min_q32 ||
                             got->focal_q32 > rig->zoom.focal_max_q32))
        err = MOTION_E_UNREACHABLE;
    return err;
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
