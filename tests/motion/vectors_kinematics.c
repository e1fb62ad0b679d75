/* tests/motion/vectors_kinematics.c - kinematics.json: camera rigs and arms
 * forward, inverse, and what they must refuse; see vectors.h.  A row per case
 * tells its rows, its refused demands and the worst deviations. */
#include "tests/motion/vectors_demand.h"

#define TOL_MM   1e-6
#define TOL_DEG  1e-7
#define TOL_QUAT 2e-9
#define TOL_JAC  1e-6 /* of the largest entry */

struct worst {
    unsigned rows, refused;
    double mm, deg, quat, jacobian;
};

/* --- deviations ------------------------------------------------------------- */

static double from_q32(int64_t a)
{
    return ldexp((double)a, -32);
}

static double quat_deviation(struct motion_quat a, struct motion_quat b)
{
    const int64_t p[4] = { a.w, a.x, a.y, a.z }, q[4] = { b.w, b.x, b.y, b.z };
    double same = 0, other = 0;

    for (int i = 0; i < 4; i++) {
        same = fmax(same, fabs(ldexp((double)(p[i] - q[i]), -62)));
        other = fmax(other, fabs(ldexp((double)p[i] + (double)q[i], -62)));
    }
    return fmin(same, other);
}

static double vec_deviation(struct motion_vec a, struct motion_vec b)
{
    return vectors_double(motion_vec_length(motion_vec_sub(a, b)));
}

/* One column of the answer; false when there is no such thing. */
static bool judge_column(const struct vectors_rig *rig, const char *name,
                         double want, const struct answer *got,
                         struct worst *worst)
{
    static const char *const pose[] = {
        "px", "py", "pz", "qw", "qx", "qy", "qz"
    };

    for (int i = 0; i < rig->axes; i++) {
        if (strcmp(name, rig->name[i]) == 0) {
            vectors_worst(rig->is_length[i] ? &worst->mm : &worst->deg,
                          fabs(from_q32(got->axis_q32[i]) - want));
            return true;
        }
    }
    for (size_t i = 0; i < sizeof pose / sizeof pose[0]; i++) {
        if (strcmp(name, pose[i]) == 0)
            return true; /* judged together */
    }
    if (strcmp(name, "distance") == 0)
        vectors_worst(&worst->mm, fabs(got->distance - want));
    else if (strcmp(name, "depth") == 0)
        vectors_worst(&worst->mm, fabs(got->depth - want));
    else if (strcmp(name, "focal") == 0)
        vectors_worst(&worst->mm, fabs(from_q32(got->focal_q32) - want));
    else
        return false;
    return true;
}

static bool judge(const struct vectors_rig *rig, const struct sheet *out,
                  const struct answer *got, struct worst *worst)
{
    const int n = cJSON_GetArraySize(out->names);
    struct motion_vec pupil;
    struct motion_quat q;
    double want;

    if (n == 0 || n != cJSON_GetArraySize(out->values))
        return false;
    for (int i = 0; i < n; i++) {
        const char *const name =
            vectors_string(cJSON_GetArrayItem(out->names, i));
        if (!vectors_sheet_get(out, name, &want) ||
            !judge_column(rig, name, want, got, worst))
            return false;
    }
    if (vectors_sheet_pupil(out, &pupil))
        vectors_worst(&worst->mm, vec_deviation(pupil, got->camera.pupil));
    if (vectors_sheet_quat(out, &q))
        vectors_worst(&worst->quat, quat_deviation(q, got->camera.q));
    worst->rows++;
    return true;
}

/* --- sequences -------------------------------------------------------------- */

/* The axes before the first row: `start` has the columns of `out` without the
 * distance and the focal length, or for track and zoom those of the head. */
static bool read_start(const struct vectors_rig *rig, const cJSON *start,
                       const cJSON *out, int64_t *before_q32)
{
    const struct sheet sheet = { out, start };

    vectors_sheet_axes(&sheet, rig, "", before_q32);
    return cJSON_GetArraySize(start) <= cJSON_GetArraySize(out);
}

static bool run_rows(const struct vectors_rig *rig, const cJSON *group,
                     const cJSON *start, const char *branch,
                     vectors_demand *answer, struct worst *worst)
{
    const cJSON *const in_names = vectors_get(group, "in"),
                       *const out_names = vectors_get(group, "out"), *row;
    const bool is_near = strcmp(branch, "near") == 0;
    struct answer got = { .focal_q32 = 0 };
    int64_t before_q32[RIG_AXES_MAX] = { 0 };

    if (!cJSON_IsArray(vectors_get(group, "rows")) ||
        (start != NULL && !read_start(rig, start, out_names, before_q32)))
        return false;
    cJSON_ArrayForEach(row, vectors_get(group, "rows"))
    {
        const struct sheet in = { in_names, cJSON_GetArrayItem(row, 0) },
                           out = { out_names, cJSON_GetArrayItem(row, 1) };
        const bool has_before = is_near || strcmp(branch, "continuity") == 0;
        int err;

        if (is_near)
            vectors_sheet_axes(&in, rig, "start_", before_q32);
        err = answer(rig, &in, has_before ? before_q32 : NULL, &got);
        if (err < 0)
            fprintf(stderr, "row %u: %s\n", worst->rows + 1,
                    motion_err_text(err));
        if (err < 0 || !judge(rig, &out, &got, worst))
            return false;
        memcpy(before_q32, got.axis_q32, sizeof before_q32);
    }
    return true;
}

static bool run_inverse(const struct vectors_rig *rig, const cJSON *item,
                        struct worst *worst)
{
    const cJSON *group;

    cJSON_ArrayForEach(group, vectors_get(item, "inverse"))
    {
        vectors_demand *const answer =
            vectors_demand_named(vectors_text(group, "demand"));
        const char *const branch = vectors_text(group, "branch");

        if (answer == NULL ||
            (strcmp(branch, "continuity") != 0 &&
             strcmp(branch, "upright") != 0 && strcmp(branch, "near") != 0) ||
            !run_rows(rig, group, vectors_get(group, "start"), branch, answer,
                      worst))
            return false;
    }
    return true;
}

/* --- Jacobians -------------------------------------------------------------- */

static bool judge_jacobian(const struct vectors_rig *rig,
                           const struct motion_arm_jacobian *got,
                           const cJSON *lines, struct worst *worst)
{
    double largest = 0, error = 0, want[MOTION_ARM_JOINTS_MAX];

    for (int k = 0; k < 6; k++) {
        if (!vectors_numbers(cJSON_GetArrayItem(lines, k), rig->axes, want))
            return false;
        for (int i = 0; i < rig->axes; i++) {
            largest = fmax(largest, fabs(want[i]));
            vectors_worst(&error,
                          fabs(vectors_double(got->column[i][k]) - want[i]));
        }
    }
    vectors_worst(&worst->jacobian, error / largest);
    worst->rows++;
    return cJSON_GetArraySize(lines) == 6;
}

static bool run_jacobians(const struct vectors_rig *rig, const cJSON *group,
                          struct worst *worst)
{
    const cJSON *row;

    cJSON_ArrayForEach(row, vectors_get(group, "rows"))
    {
        const struct sheet in = { vectors_get(group, "in"),
                                  cJSON_GetArrayItem(row, 0) };
        int64_t axis_q32[RIG_AXES_MAX] = { 0 };
        struct motion_arm_jacobian jacobian;
        struct motion_pose at;

        vectors_sheet_axes(&in, rig, "", axis_q32);
        if (rig->sort != RIG_ARM ||
            motion_arm_jacobian(&rig->arm, axis_q32, &at, &jacobian) < 0 ||
            !judge_jacobian(rig, &jacobian, cJSON_GetArrayItem(row, 1), worst))
            return false;
    }
    return true;
}

/* --- refused ---------------------------------------------------------------- */

/* Is the point on the ray along the view? */
static bool is_in_the_middle(const struct motion_camera *camera,
                             struct motion_vec point)
{
    const struct motion_vec to = motion_vec_sub(point, camera->pupil);
    const struct motion_vec view = motion_vec_from_dir(motion_quat_turn(
        camera->q, (struct motion_dir){ { 0, 0, -((int64_t)1 << 62) } }));

    return vectors_double(motion_vec_dot(to, view)) > 0 &&
           vectors_double(motion_vec_length(motion_vec_cross(to, view))) <=
               TOL_MM;
}

/* Do these axes meet the demand after all? */
static bool is_met(const struct vectors_rig *rig, const struct sheet *in,
                   const struct answer *got)
{
    struct motion_camera camera;
    struct motion_vec point;
    struct motion_quat q;

    if (vectors_rig_camera(rig, got->axis_q32, &camera) < 0)
        return false;
    if (vectors_sheet_pupil(in, &point) &&
        vec_deviation(point, camera.pupil) > TOL_MM)
        return false;
    if (vectors_sheet_quat(in, &q) && quat_deviation(q, camera.q) > TOL_QUAT)
        return false;
    return rig->sort != RIG_CAMERA || !vectors_sheet_subject(in, &point) ||
           is_in_the_middle(&camera, point);
}

/* Out of reach must be refused as such, or by a limit; what is singular may be
 * answered after all. */
static bool is_refused(const struct vectors_rig *rig, bool is_singular, int err,
                       const struct sheet *in, const struct answer *got)
{
    if (err == MALFORMED)
        return false;
    if (is_singular)
        return err < 0 || is_met(rig, in, got);
    return err == MOTION_E_UNREACHABLE || err == MOTION_E_LIMIT;
}

static bool run_refused(const struct vectors_rig *rig, const cJSON *item,
                        struct worst *worst)
{
    const cJSON *line;

    cJSON_ArrayForEach(line, vectors_get(item, "refused"))
    {
        const struct sheet in = { vectors_get(line, "in"),
                                  vectors_get(line, "row") };
        const bool is_singular =
            strcmp(vectors_text(line, "reason"), "singular") == 0;
        vectors_demand *const answer =
            vectors_demand_named(vectors_text(line, "demand"));
        struct answer got = { .focal_q32 = 0 };
        const int err =
            answer != NULL ? answer(rig, &in, NULL, &got) : MALFORMED;

        if (!is_refused(rig, is_singular, err, &in, &got)) {
            fprintf(stderr, "%s: answered with \"%s\"\n",
                    vectors_text(line, "note"), motion_err_text(err));
            return false;
        }
        worst->refused++;
    }
    return true;
}

/* --- cases ------------------------------------------------------------------ */

static bool run_rig(const struct vectors_rig *rig, const cJSON *item,
                    struct worst *worst)
{
    const cJSON *const ahead = vectors_get(item, "forward"),
                       *const camera = vectors_get(item, "camera"),
                       *const start = vectors_get(item, "start");

    return (ahead == NULL ||
            run_rows(rig, ahead, start, start != NULL ? "continuity" : "",
                     vectors_rig_forward, worst)) &&
           (camera == NULL ||
            (rig->has_tool &&
             run_rows(rig, camera, NULL, "", vectors_rig_tool, worst))) &&
           run_jacobians(rig, vectors_get(item, "jacobian"), worst) &&
           run_inverse(rig, item, worst) && run_refused(rig, item, worst) &&
           worst->rows + worst->refused > 0;
}

static bool run_case(const cJSON *item, struct worst *worst)
{
    static struct vectors_rig rig;
    const bool is_known = vectors_rig_read(vectors_get(item, "rig"), &rig);
    const bool is_whole = is_known && run_rig(&rig, item, worst);

    if (!is_known)
        fprintf(stderr, "the rig is not one that is known\n");
    vectors_rig_free(&rig);
    return is_whole;
}

int vectors_kinematics(const cJSON *file, struct vectors_row *rows,
                       int capacity)
{
    const cJSON *item;
    int count = 0;

    cJSON_ArrayForEach(item, vectors_get(file, "cases"))
    {
        struct worst worst = { 0 };
        double tol_deg = TOL_DEG;

        if (count == capacity) {
            fprintf(stderr, "more than %d cases\n", capacity);
            return -1;
        }
        struct vectors_row *const row = &rows[count++];
        const bool is_whole = run_case(item, &worst);
        if (!is_whole)
            fprintf(stderr, "%s: not computed to its end\n",
                    vectors_text(item, "name"));
        (void)vectors_number(item, "tol_deg", &tol_deg);
        snprintf(row->method, sizeof row->method, "%s",
                 vectors_text(item, "name"));
        snprintf(row->text, sizeof row->text,
                 "%u rows, %u refused, worst %.2g mm %.2g deg %.2g quaternion "
                 "%.2g Jacobian",
                 worst.rows, worst.refused, worst.mm, worst.deg, worst.quat,
                 worst.jacobian);
        row->cases = worst.rows + worst.refused;
        row->pass = is_whole && worst.mm <= TOL_MM && worst.deg <= tol_deg &&
                    worst.quat <= TOL_QUAT && worst.jacobian <= TOL_JAC;
    }
    return count;
}
