/* firmware/host/move/move_load_camera.c - `camera` of move.yaml: which way a
 * head on the path looks.  See move_load.h. */
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/move/move_load.h"
#include "motion/core/fixed.h"
#include "motion/plan/camera/plan_camera.h"

/* In the order of enum plan_look from PLAN_LOOK_LEVEL on. */
const char *const move_alongs[MOVE_ALONGS] = { "level", "rotation-minimising",
                                               "frenet" };
const char *const move_ahead_ends[MOVE_AHEAD_ENDS] = {
    [MOTION_AHEAD_STRAIGHT] = "straight",
    [MOTION_AHEAD_HOLD] = "hold",
    [MOTION_AHEAD_CLOSED] = "closed",
};
const char *const move_dwell_eases[MOVE_DWELL_EASES] = {
    [MOTION_DWELL_CUBIC] = "cubic",
    [MOTION_DWELL_QUINTIC] = "quintic",
};

/* ---- the head ---- */

static int move_read_head_axis(struct move_reader *self,
                               const struct yaml_value *value,
                               enum motion_head_axis which)
{
    struct plan_camera *camera = self->move->camera;
    const int found =
        move_drive_axis(self, value, PLAN_BY_CAMERA, &camera->axis[which]);

    if (found < 0)
        return -1;
    if (self->rig->axis[found].unit != UNITS_AXIS_DEG)
        return yaml_value_refuse(value, "has the axis '%s' in %s",
                                 self->rig->axis[found].name,
                                 units_axis_text(self->rig->axis[found].unit));
    camera->limit[which] = self->rig->axis[found].limit;
    return 0;
}

static int move_read_pan(void *reader, const struct yaml_value *value,
                         void *out)
{
    (void)out;
    return move_read_head_axis(reader, value, MOTION_HEAD_PAN);
}

static int move_read_tilt(void *reader, const struct yaml_value *value,
                          void *out)
{
    (void)out;
    return move_read_head_axis(reader, value, MOTION_HEAD_TILT);
}

static int move_read_roll(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct plan_camera *camera = out;

    camera->has_roll = true;
    return move_read_head_axis(reader, value, MOTION_HEAD_ROLL);
}

static const struct yaml_field move_head_fields[] = {
    { "pan", YAML_REQUIRED, "an axis in deg", move_read_pan, 0 },
    { "tilt", YAML_REQUIRED, "an axis in deg", move_read_tilt, 0 },
    { "roll", YAML_OPTIONAL, "an axis in deg", move_read_roll, 0 },
};
const struct yaml_shape move_head_shape = { "head", move_head_fields,
                                            ARRAY_LEN(move_head_fields) };

static int move_read_head(void *reader, const struct yaml_value *value,
                          void *out)
{
    return yaml_fields_read(value, &move_head_shape, reader, out);
}

/* ---- what it looks at ---- */

static int move_read_look_at(void *reader, const struct yaml_value *value,
                             void *out)
{
    struct plan_camera *camera = out;

    camera->look = PLAN_LOOK_AT;
    return move_read_vector(reader, value, PLAN_SPACE_AXES, camera->point_q32);
}

static int move_read_ahead(void *reader, const struct yaml_value *value,
                           void *out)
{
    const struct move_reader *self = reader;
    struct plan_camera *camera = out;

    camera->look = PLAN_LOOK_AHEAD;
    camera->end = self->move->path->points.closed ? MOTION_AHEAD_CLOSED
                                                  : MOTION_AHEAD_STRAIGHT;
    return move_read_positive(self, value, UNITS_POSITION, &camera->ahead_q32);
}

static int move_read_ahead_end(void *reader, const struct yaml_value *value,
                               void *out)
{
    const struct move_reader *self = reader;
    struct plan_camera *camera = out;
    unsigned index;

    if (camera->look != PLAN_LOOK_AHEAD)
        return yaml_value_refuse(value, "is not used without ahead");
    if (yaml_value_choice(value, move_ahead_ends, MOVE_AHEAD_ENDS, &index) < 0)
        return -1;
    camera->end = (enum motion_ahead_end)index;
    if (camera->end == MOTION_AHEAD_CLOSED && !self->move->path->points.closed)
        return yaml_value_refuse(value,
                                 "'closed' goes with a closed path only");
    return 0;
}

static int move_read_along(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct plan_camera *camera = out;
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, move_alongs, MOVE_ALONGS, &index) < 0)
        return -1;
    camera->look = (enum plan_look)(PLAN_LOOK_LEVEL + index);
    return 0;
}

static const struct yaml_field move_target_fields[] = {
    { "curve", YAML_OPTIONAL, "a curve through space", move_read_path_curve,
      offsetof(struct plan_points, curve) },
    { "spacing", YAML_OPTIONAL, "uniform, centripetal or chordal",
      move_read_spacing, offsetof(struct plan_points, spacing) },
    { "closed", YAML_OPTIONAL,
      "true or false, true with c2, quintic, catmull-rom or akima",
      move_read_closed, 0 },
    { "corner", YAML_OPTIONAL,
      "a length above zero, with curve rounded or smoothed", move_read_corner,
      0 },
    { "points", YAML_REQUIRED,
      "a list of 2 .. 10000 points (closed: 3 or more) such as [0 mm, 0 mm, 40 "
      "mm]",
      move_read_path_points, 0 },
};
const struct yaml_shape move_target_shape = { "target", move_target_fields,
                                              ARRAY_LEN(move_target_fields) };

static int move_read_look_path(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct plan_camera *camera = out;

    camera->look = PLAN_LOOK_PATH;
    camera->points = (struct plan_points){
        .axes = PLAN_SPACE_AXES,
        .curve = PLAN_CURVE_C2,
        .spacing = MOTION_SPLINE_CENTRIPETAL,
        .place = yaml_tree_place(value->tree, value->node),
    };
    return yaml_fields_read(value, &move_target_shape, reader, &camera->points);
}

static int move_read_dwell_at(void *reader, const struct yaml_value *value,
                              void *out)
{
    return move_read_vector(reader, value, PLAN_SPACE_AXES, out);
}

static int move_read_dwell_distance(void *reader,
                                    const struct yaml_value *value, void *out)
{
    return move_read_distance(reader, value, out);
}

static const struct yaml_field move_dwell_fields[] = {
    { "at", YAML_REQUIRED, "a point such as [1 m, 0 mm, 1.2 m]",
      move_read_dwell_at, offsetof(struct plan_dwell, point_q32) },
    { "from", YAML_REQUIRED, "a length of the path, or a part of it in %",
      move_read_dwell_distance, offsetof(struct plan_dwell, from) },
    { "to", YAML_REQUIRED, "a length of the path, or a part of it in %",
      move_read_dwell_distance, offsetof(struct plan_dwell, to) },
};
const struct yaml_shape move_dwell_shape = { "dwell", move_dwell_fields,
                                             ARRAY_LEN(move_dwell_fields) };

static int move_read_dwells(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct plan_camera *camera = out;
    struct yaml_value item = *value;
    uint32_t count;

    camera->look = PLAN_LOOK_DWELL;
    if (yaml_value_list(value, 1, PLAN_CAMERA_DWELLS_MAX, &count) < 0)
        return -1;
    camera->dwell = calloc(count, sizeof *camera->dwell);
    if (camera->dwell == NULL)
        return yaml_value_refuse(value, "do not fit in memory");
    item.name = "dwell";
    item.expected = "a map with at, from and to";
    item.node = yaml_value_node(value)->first;
    while (camera->dwells < count) {
        struct plan_dwell *dwell = &camera->dwell[camera->dwells++];
        dwell->place = yaml_tree_place(value->tree, item.node);
        if (yaml_fields_read(&item, &move_dwell_shape, reader, dwell) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

static int move_read_dwell_ease(void *reader, const struct yaml_value *value,
                                void *out)
{
    struct plan_camera *camera = out;
    unsigned index;

    (void)reader;
    if (camera->look != PLAN_LOOK_DWELL)
        return yaml_value_refuse(value, "is not used without dwell");
    if (yaml_value_choice(value, move_dwell_eases, MOVE_DWELL_EASES, &index) <
        0)
        return -1;
    camera->ease = (enum motion_dwell_ease)index;
    return 0;
}

/* The first MOVE_LOOKS say what is looked at; one of them is given.  Those of a
 * path are not for a camera on the kinematics of a rig. */
#define MOVE_LOOKS 8
static const char *const move_path_looks[] = { "ahead", "along", "path",
                                               "dwell" };
static const struct yaml_field move_look_fields[] = {
    { "at", YAML_OPTIONAL, "a point such as [1 m, 0 mm, 1.2 m]",
      move_read_look_at, 0 },
    { "ahead", YAML_OPTIONAL, "a length above zero", move_read_ahead, 0 },
    { "along", YAML_OPTIONAL, "level, rotation-minimising or frenet",
      move_read_along, 0 },
    { "path", YAML_OPTIONAL, "a map with points, and curve, spacing, closed",
      move_read_look_path, 0 },
    { "dwell", YAML_OPTIONAL, "a list of 1 .. 1000 maps with at, from and to",
      move_read_dwells, 0 },
    { "keys", YAML_OPTIONAL,
      "a list of 2 .. 10000 maps with t or at, and angles, quaternion or "
      "forward",
      move_read_orients, 0 },
    { "subject", YAML_OPTIONAL, "a map with curve and keys", move_read_subject,
      0 },
    { "table", YAML_OPTIONAL,
      "a point such as [0 mm, 0 mm, 80 mm] from the turntable's centre",
      move_read_on_table, 0 },
    { "end", YAML_OPTIONAL, "straight, hold or closed, with ahead",
      move_read_ahead_end, 0 },
    { "ease", YAML_OPTIONAL, "quintic or cubic, with dwell",
      move_read_dwell_ease, 0 },
    { "curve", YAML_OPTIONAL, "c2, slerp or squad, with keys",
      move_read_orient_curve, 0 },
};
const struct yaml_shape move_look_shape = { "look", move_look_fields,
                                            ARRAY_LEN(move_look_fields) };

/* A rig's kinematics and a path of the camera are two ways to say where the
 * camera is. */
static int move_check_looks(const struct yaml_value *value,
                            const struct plan_camera *camera)
{
    struct yaml_value look = *value;

    look.name = "look";
    for (unsigned i = 0; i < ARRAY_LEN(move_path_looks); i++)
        if (camera->following.rig != NULL &&
            yaml_fields_find(value, move_path_looks[i]) != 0) {
            look.expected = "at, subject, table or keys";
            return yaml_value_refuse(
                &look, "has %s, which is not used with the rig's kinematics",
                move_path_looks[i]);
        }
    if (camera->following.rig == NULL &&
        (yaml_fields_find(value, "subject") != 0 ||
         yaml_fields_find(value, "table") != 0)) {
        look.expected = "kinematics in the rig file";
        return yaml_value_refuse(&look, "needs the place of the camera");
    }
    return 0;
}

int move_read_looks(struct move_reader *reader, const struct yaml_value *value,
                    struct plan_camera *camera)
{
    unsigned looks = 0;

    camera->look_place = yaml_tree_place(value->tree, value->node);
    for (unsigned i = 0; i < MOVE_LOOKS; i++)
        looks += yaml_fields_find(value, move_look_fields[i].name) != 0;
    if (looks > 1)
        return yaml_value_refuse(value, "names %u things to look at", looks);
    if (yaml_fields_read(value, &move_look_shape, reader, camera) < 0)
        return -1;
    return looks == 1 ? 0
                      : yaml_value_refuse(value, "names nothing to look at");
}

static int move_read_look(void *reader, const struct yaml_value *value,
                          void *out)
{
    if (yaml_value_need(value, YAML_TREE_MAP) < 0 ||
        move_check_looks(value, out) < 0)
        return -1;
    return move_read_looks(reader, value, out);
}

/* ---- the camera ---- */

static int move_read_roll_keys(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct plan_camera *camera = out;

    if (camera->following.rig != NULL && !camera->has_roll)
        return yaml_value_refuse(value, "has no axis: the head in the rig's "
                                        "kinematics does not roll");
    return move_read_roll_of(reader, value, camera);
}

int move_read_roll_of(struct move_reader *reader,
                      const struct yaml_value *value,
                      struct plan_camera *camera)
{
    if (camera->look == PLAN_LOOK_KEYS)
        return yaml_value_refuse(value,
                                 "is not used with keys of look, which roll");
    camera->roll = calloc(1, sizeof *camera->roll);
    if (camera->roll == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    return move_read_keyed(reader, value, UNITS_POSITION, UNITS_AXIS_DEG,
                           camera->roll);
}

static int move_read_camera_tolerance(void *reader,
                                      const struct yaml_value *value, void *out)
{
    struct move_reader self = *(const struct move_reader *)reader;

    self.units.unit = UNITS_AXIS_DEG;
    return move_read_positive(&self, value, UNITS_POSITION, out);
}

static int move_read_mount(void *reader, const struct yaml_value *value,
                           void *out)
{
    const struct move_reader *self = reader;

    if (self->rig->kinematics != NULL)
        return yaml_value_refuse(value,
                                 "is of the head in the rig's kinematics");
    return move_read_direction(reader, value, out);
}

static const struct yaml_field move_camera_fields[] = {
    { "axes", YAML_OPTIONAL, "a map with pan, tilt and roll", move_read_head,
      0 },
    { "forward", YAML_OPTIONAL,
      "the direction of pan 0 and tilt 0, such as [1, 0, 0]", move_read_mount,
      offsetof(struct plan_camera, forward) },
    { "up", YAML_OPTIONAL, "a direction across forward, such as [0, 0, 1]",
      move_read_mount, offsetof(struct plan_camera, up) },
    { "look", YAML_REQUIRED,
      "a map with one of at, ahead, along, path, dwell, keys, subject and "
      "table",
      move_read_look, 0 },
    { "roll", YAML_OPTIONAL, "a map with curve and keys, in deg",
      move_read_roll_keys, 0 },
    { "tolerance", YAML_OPTIONAL, "an angle above zero",
      move_read_camera_tolerance, offsetof(struct plan_camera, tolerance_q32) },
    { "focus", YAML_OPTIONAL, "yes: on the subject", move_read_focus, 0 },
    { "zoom", YAML_OPTIONAL, "a map with focal and at", move_read_zoom, 0 },
};
const struct yaml_shape move_camera_shape = { "camera", move_camera_fields,
                                              ARRAY_LEN(move_camera_fields) };

/* Keys of look may be times, and then there need not be a path. */
static bool move_camera_has_keys(const struct yaml_value *value)
{
    struct yaml_value look = *value;

    if (yaml_value_node(value)->kind != YAML_TREE_MAP)
        return false;
    look.node = yaml_fields_find(value, "look");
    return look.node != 0 && yaml_value_node(&look)->kind == YAML_TREE_MAP &&
           yaml_fields_find(&look, "keys") != 0;
}

/* The head and the mount of the rig. */
static int move_take_rig(struct move_reader *self,
                         const struct yaml_value *value)
{
    const struct plan_rig *from = self->rig->kinematics;
    struct plan_camera *camera = self->move->camera;
    struct plan_rig *rig = malloc(sizeof *rig);

    camera->following.rig = rig;
    if (rig == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    *rig = *from;
    camera->forward = rig->forward;
    camera->up = rig->up;
    camera->has_roll = rig->head[MOTION_HEAD_ROLL].is_given;
    self->units.unit = UNITS_AXIS_MM;
    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        if (!rig->head[i].is_given)
            continue;
        camera->limit[i] = self->rig->axis[rig->head[i].axis].limit;
        if (move_drive_rig_axis(self, value, rig->head[i].axis, PLAN_BY_CAMERA,
                                &camera->axis[i]) < 0)
            return -1;
    }
    return 0;
}

/* Orientations are keyed as those of the mount, which then must not turn, and of
 * axes that count from it. */
static bool move_is_mount_still(const struct plan_rig *rig)
{
    const struct motion_carrier *carrier = &rig->rig.carrier;

    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        if (rig->rig.head.axis[i].is_reversed ||
            rig->rig.head.axis[i].offset_q32 != 0)
            return false;
    return carrier->kind == &motion_carrier_linear ||
           (carrier->kind == &motion_carrier_arc &&
            !carrier->as.arc.is_turning) ||
           (carrier->kind == &motion_carrier_rail &&
            !carrier->as.rail.is_turning) ||
           (carrier->kind == &motion_carrier_jib &&
            carrier->as.jib.mount == MOTION_JIB_SPACE);
}

/* Either the rig says which axes the head has, or the move. */
static int move_read_camera_head(struct move_reader *self,
                                 const struct yaml_value *value)
{
    const bool is_given = yaml_value_node(value)->kind == YAML_TREE_MAP &&
                          yaml_fields_find(value, "axes") != 0;

    if (self->rig->kinematics != NULL &&
        self->rig->kinematics->arm.arm.count > 0)
        return yaml_value_refuse(value,
                                 "is for a head, and the rig has an arm: its "
                                 "tool is turned by the path's tool");
    if (self->rig->kinematics != NULL)
        return is_given ? yaml_value_refuse(
                              value, "has axes, which are those of the head in "
                                     "the rig's kinematics")
                        : move_take_rig(self, value);
    if (yaml_value_need(value, YAML_TREE_MAP) < 0)
        return -1;
    return is_given ? 0 : yaml_value_refuse(value, "lacks axes");
}

int move_read_camera(void *reader, const struct yaml_value *value, void *out)
{
    const int64_t one = (int64_t)1 << 62;
    struct move_reader *self = reader;
    struct plan_camera *camera;
    struct motion_dir across;

    (void)out;
    if (self->move->path == NULL && self->rig->kinematics == NULL &&
        !move_camera_has_keys(value))
        return yaml_value_refuse(value, "has no path to go on");
    if (self->move->path != NULL && self->rig->kinematics == NULL &&
        self->units.unit != UNITS_AXIS_MM)
        return yaml_value_refuse(value, "is on a path in %s, not in a length",
                                 units_axis_text(self->units.unit));
    camera = calloc(1, sizeof *camera);
    if (camera == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    self->move->camera = camera;
    camera->place = yaml_tree_place(value->tree, value->node);
    camera->ease = MOTION_DWELL_QUINTIC;
    camera->forward = (struct motion_dir){ { one, 0, 0 } };
    camera->up = (struct motion_dir){ { 0, 0, one } };
    camera->tolerance_q32 = MOTION_FIXED_ONE_Q32 / 100000;
    if (move_read_camera_head(self, value) < 0 ||
        yaml_fields_read(value, &move_camera_shape, self, camera) < 0)
        return -1;
    if (camera->look == PLAN_LOOK_KEYS && camera->following.rig != NULL &&
        !move_is_mount_still(camera->following.rig))
        return yaml_value_refuse(
            value, "has keys of look on a head whose mount turns, or whose "
                   "axes are reversed or offset");
    if (motion_dir_perpendicular(camera->forward, camera->up, &across) < 0)
        return yaml_value_refuse(value, "has parallel forward and up");
    return 0;
}
