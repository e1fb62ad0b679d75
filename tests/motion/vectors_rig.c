/* tests/motion/vectors_rig.c - rigs of kinematics.json; see vectors_rig.h. */
#include "tests/motion/vectors_rig.h"

#include "motion/core/err.h"

#define RAIL_POINTS_MAX 1000

/* --- pieces --------------------------------------------------------------- */

static bool read_vec(const cJSON *item, const char *name, struct motion_vec *v)
{
    double a[3];

    if (!vectors_numbers(vectors_get(item, name), 3, a))
        return false;
    *v = vectors_vec(a);
    return true;
}

static bool read_unit(const cJSON *item, const char *name,
                      struct motion_dir *dir)
{
    struct motion_vec v;

    return read_vec(item, name, &v) && motion_vec_unit(v, dir) == MOTION_OK;
}

static bool read_q32(const cJSON *item, const char *name, int64_t *to)
{
    double a;

    if (!vectors_number(item, name, &a))
        return false;
    *to = vectors_q32(a);
    return true;
}

static bool read_map(const cJSON *item, struct motion_axis_map *map)
{
    double dir;

    if (!vectors_number(item, "dir", &dir) || (dir != 1 && dir != -1))
        return false;
    map->is_reversed = dir < 0;
    return read_q32(item, "offset", &map->offset_q32);
}

static bool read_level(const cJSON *item, const char *forward,
                       struct motion_quat *level)
{
    struct motion_vec view, up;

    return read_vec(item, forward, &view) && read_vec(item, "up", &up) &&
           motion_mount_level(view, up, level) == MOTION_OK;
}

static void add_axis(struct vectors_rig *rig, const char *name, bool is_length)
{
    if (rig->axes == RIG_AXES_MAX)
        return;
    snprintf(rig->name[rig->axes], sizeof rig->name[0], "%s", name);
    rig->is_length[rig->axes++] = is_length;
}

/* --- carriers ------------------------------------------------------------- */

static bool read_fixed(const cJSON *item, struct vectors_rig *rig)
{
    struct motion_linear *const linear = &rig->camera.carrier.as.linear;

    rig->camera.carrier.kind = &motion_carrier_linear;
    return read_vec(item, "position", &linear->origin);
}

static bool read_slider(const cJSON *item, struct vectors_rig *rig)
{
    struct motion_linear *const linear = &rig->camera.carrier.as.linear;

    rig->camera.carrier.kind = &motion_carrier_linear;
    linear->count = 1;
    add_axis(rig, "slide", true);
    return read_vec(item, "origin", &linear->origin) &&
           read_unit(item, "direction", &linear->direction[0]);
}

static bool read_linear(const cJSON *item, struct vectors_rig *rig)
{
    struct motion_linear *const linear = &rig->camera.carrier.as.linear;
    const cJSON *axis;

    rig->camera.carrier.kind = &motion_carrier_linear;
    cJSON_ArrayForEach(axis, vectors_get(item, "axes"))
    {
        const uint32_t n = linear->count++;
        if (n == MOTION_LINEAR_AXES_MAX ||
            !read_unit(axis, "direction", &linear->direction[n]) ||
            !read_map(axis, &linear->axis[n]))
            return false;
        add_axis(rig, vectors_text(axis, "name"), true);
    }
    return read_vec(item, "origin", &linear->origin);
}

static bool read_arc(const cJSON *item, struct vectors_rig *rig)
{
    struct motion_arc *const arc = &rig->camera.carrier.as.arc;
    const char *const carriage = vectors_text(item, "carriage");
    struct motion_vec normal, start;

    rig->camera.carrier.kind = &motion_carrier_arc;
    arc->is_turning = strcmp(carriage, "turning") == 0;
    add_axis(rig, "slide", true);
    return (arc->is_turning || strcmp(carriage, "fixed") == 0) &&
           read_vec(item, "centre", &arc->centre) &&
           read_vec(item, "normal", &normal) &&
           read_vec(item, "start", &start) &&
           read_q32(item, "radius", &arc->radius_q32) &&
           motion_arc_plane(arc, normal, start) == MOTION_OK;
}

/* `rail`, beside the rigs of the file: `points`, through which a C4 spline goes
 * (carrier.h), and `carriage` as of an arc; slide is the length along it. */
static bool read_rail(const cJSON *item, struct vectors_rig *rig)
{
    static struct plan_point point[RAIL_POINTS_MAX];
    struct motion_rail *const rail = &rig->camera.carrier.as.rail;
    const char *const carriage = vectors_text(item, "carriage");
    const cJSON *const list = vectors_get(item, "points"), *entry;
    struct plan_points points = { .axes = PLAN_SPACE_AXES,
                                  .curve = PLAN_CURVE_C4,
                                  .spacing = MOTION_SPLINE_CHORDAL,
                                  .point = point };
    struct plan_error error;
    double at[PLAN_SPACE_AXES];

    cJSON_ArrayForEach(entry, list)
    {
        if (points.count == RAIL_POINTS_MAX ||
            !vectors_numbers(entry, PLAN_SPACE_AXES, at))
            return false;
        for (int i = 0; i < PLAN_SPACE_AXES; i++)
            point[points.count].q32[i] = vectors_q32(at[i]);
        points.count++;
    }
    rig->camera.carrier.kind = &motion_carrier_rail;
    rail->table = &rig->rail.table;
    rail->is_turning = strcmp(carriage, "turning") == 0;
    add_axis(rig, "slide", true);
    return (rail->is_turning || strcmp(carriage, "fixed") == 0) &&
           plan_space_init(&rig->rail, &points, &error) == MOTION_OK;
}

static bool read_gantry(const cJSON *item, struct vectors_rig *rig)
{
    static const char *const name[4] = { "x1", "x2", "y", "z" };
    struct motion_gantry *const gantry = &rig->camera.carrier.as.gantry;

    rig->camera.carrier.kind = &motion_carrier_gantry;
    for (int i = 0; i < 4; i++) {
        const cJSON *const axis = vectors_get(item, name[i]);
        if (!read_map(axis, &gantry->axis[i]) ||
            (i < 2 && !read_q32(axis, "at_y", &gantry->at_y_q32[i])))
            return false;
        add_axis(rig, name[i], true);
    }
    return true;
}

static bool read_jib(const cJSON *item, struct vectors_rig *rig)
{
    static const char *const mounts[3] = { "boom", "level", "space" };
    struct motion_jib *const jib = &rig->camera.carrier.as.jib;
    const char *const mount = vectors_text(item, "mount");
    double limit[2];

    rig->camera.carrier.kind = &motion_carrier_jib;
    for (int i = 0; i < 3; i++) {
        if (strcmp(mount, mounts[i]) == 0)
            jib->mount = (enum motion_jib_mount)i;
    }
    if (strcmp(mount, mounts[jib->mount]) != 0 ||
        !vectors_numbers(vectors_get(item, "extend_limits"), 2, limit))
        return false;
    jib->extend_min_q32 = vectors_q32(limit[0]);
    jib->extend_max_q32 = vectors_q32(limit[1]);
    add_axis(rig, "boom_pan", false);
    add_axis(rig, "boom_tilt", false);
    add_axis(rig, "extend", true);
    return read_vec(item, "pivot", &jib->foot) &&
           read_q32(item, "length", &jib->length_q32) &&
           read_vec(item, "drop", &jib->drop);
}

static const struct {
    const char *type;
    bool (*read)(const cJSON *item, struct vectors_rig *rig);
} carriers[] = {
    { "fixed", read_fixed }, { "slider", read_slider },
    { "arc", read_arc },     { "linear", read_linear },
    { "jib", read_jib },     { "gantry", read_gantry },
    { "rail", read_rail },
};

/* --- cameras, tables, arms -------------------------------------------------- */

static bool read_head(const cJSON *item, struct vectors_rig *rig)
{
    static const char *const name[3] = { "pan", "tilt", "roll" };
    struct motion_pan_tilt *const head = &rig->camera.head;
    const cJSON *const nodal = vectors_get(item, "nodal");

    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        if (!read_map(vectors_get(item, name[i]), &head->axis[i]))
            return false;
        add_axis(rig, name[i], false);
    }
    return read_level(item, "forward", &rig->camera.carrier.level) &&
           read_q32(nodal, "forward", &head->nodal.forward_q32) &&
           read_q32(nodal, "right", &head->nodal.right_q32) &&
           read_q32(nodal, "up", &head->nodal.up_q32);
}

static bool read_zoom(const cJSON *item, struct vectors_rig *rig)
{
    double limit[2];

    rig->has_zoom = true;
    if (!vectors_numbers(vectors_get(item, "focal_limits"), 2, limit))
        return false;
    rig->zoom.focal_min_q32 = vectors_q32(limit[0]);
    rig->zoom.focal_max_q32 = vectors_q32(limit[1]);
    return read_q32(item, "focal_at", &rig->zoom.focal_at_q32) &&
           read_q32(item, "slide_at", &rig->zoom.slide_at_q32) &&
           read_vec(item, "subject_at", &rig->zoom.subject_at);
}

static bool read_camera(const cJSON *item, struct vectors_rig *rig)
{
    const char *const type = vectors_text(item, "type");
    const cJSON *const lens = vectors_get(item, "lens");

    for (size_t i = 0; i < sizeof carriers / sizeof carriers[0]; i++) {
        if (strcmp(type, carriers[i].type) == 0)
            return carriers[i].read(item, rig) &&
                   read_head(vectors_get(item, "head"), rig) &&
                   (lens == NULL || read_zoom(lens, rig));
    }
    return false;
}

static bool read_table(const cJSON *item, struct vectors_rig *rig)
{
    double centre[3];

    rig->sort = RIG_TABLE;
    add_axis(rig, "table", false);
    if (!vectors_numbers(vectors_get(item, "centre"), 3, centre))
        return false;
    for (int i = 0; i < 3; i++)
        rig->table.centre_q32[i] = vectors_q32(centre[i]);
    return read_vec(item, "subject", &rig->on_table) &&
           read_camera(vectors_get(item, "camera"), rig);
}

static bool read_joint(const cJSON *item, struct vectors_rig *rig)
{
    const char *const type = vectors_text(item, "type");
    double limit[2];
    char name[16];

    if (rig->arm.count == MOTION_ARM_JOINTS_MAX ||
        !vectors_numbers(vectors_get(item, "limits"), 2, limit))
        return false;
    struct motion_arm_joint *const joint = &rig->arm.joint[rig->arm.count++];
    joint->is_prismatic = strcmp(type, "prismatic") == 0;
    /* listed sequences may pass the limits of the others */
    joint->is_limited = joint->is_prismatic;
    joint->low_q32 = vectors_q32(limit[0]);
    joint->high_q32 = vectors_q32(limit[1]);
    snprintf(name, sizeof name, "j%u", rig->arm.count);
    add_axis(rig, name, joint->is_prismatic);
    return (joint->is_prismatic || strcmp(type, "revolute") == 0) &&
           read_q32(item, "a", &joint->a_q32) &&
           read_q32(item, "d", &joint->d_q32) &&
           read_q32(item, "alpha", &joint->alpha_deg_q32) &&
           read_q32(item, "theta", &joint->theta_deg_q32);
}

static bool read_arm(const cJSON *item, struct vectors_rig *rig)
{
    const cJSON *const tool = vectors_get(item, "tool");
    const cJSON *joint;

    rig->sort = RIG_ARM;
    cJSON_ArrayForEach(joint, vectors_get(item, "dh"))
    {
        if (!read_joint(joint, rig))
            return false;
    }
    rig->has_tool = tool != NULL;
    return rig->arm.count > 0 &&
           (tool == NULL || (read_vec(tool, "position", &rig->tool.pupil) &&
                             read_level(tool, "view", &rig->tool.q)));
}

bool vectors_rig_read(const cJSON *item, struct vectors_rig *rig)
{
    const char *const type = vectors_text(item, "type");

    memset(rig, 0, sizeof *rig);
    if (strcmp(type, "turntable") == 0)
        return read_table(item, rig);
    if (strcmp(type, "arm") == 0)
        return read_arm(item, rig);
    rig->sort = RIG_CAMERA;
    return read_camera(item, rig);
}

void vectors_rig_free(struct vectors_rig *rig)
{
    plan_space_free(&rig->rail);
}
