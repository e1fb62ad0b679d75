/* firmware/host/move/move_load_follow.c - the subject of a camera on the
 * kinematics of the rig, moving or on the turntable, and the lens that follows it.  See move_load.h. */
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/move/move_load.h"
#include "motion/core/fixed.h"
#include "motion/plan/camera/plan_camera.h"

#define FOLLOW_KEYS_MAX 10000

/* ---- the subject --------------------------------------------------------- */

/* One without parameters and velocities. */
static int follow_read_curve(void *reader, const struct yaml_value *value,
                             void *out)
{
    enum plan_curve *curve = out;

    if (move_read_curve(reader, value, curve) < 0)
        return -1;
    const struct plan_curve_rules *rules = plan_curve_rules(*curve);
    if (rules->vel == PLAN_MUST || rules->handles)
        return yaml_value_refuse(
            value, "'%s' has keys with velocities or handles", rules->name);
    return 0;
}

static int follow_read_key(struct move_reader *self,
                           const struct yaml_value *value,
                           struct plan_axis subject[PLAN_SPACE_AXES])
{
    struct plan_key key = { .place =
                                yaml_tree_place(value->tree, value->node) };
    struct yaml_value item[2];
    int64_t q32[PLAN_SPACE_AXES];
    const uint32_t count = subject[0].key_count;

    if (yaml_value_pair(value, item) < 0)
        return -1;
    item[0].expected = "a time";
    item[1].expected = "a point such as [1 m, 0 mm, 1.2 m]";
    if (yaml_units_read(&item[0], UNITS_TIME, &self->units, &key.key.t_ns_q12) <
            0 ||
        move_read_vector(self, &item[1], PLAN_SPACE_AXES, q32) < 0)
        return -1;
    if (key.key.t_ns_q12 < 0 ||
        (count > 0 &&
         key.key.t_ns_q12 <= subject[0].key[count - 1].key.t_ns_q12))
        return yaml_value_refuse(value, "is not later than the one before");
    for (int i = 0; i < PLAN_SPACE_AXES; i++) {
        key.key.pos_q32 = q32[i];
        subject[i].key[subject[i].key_count++] = key;
    }
    return 0;
}

static int follow_read_keys(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct plan_axis *subject = out;
    struct yaml_value item = *value;
    uint32_t count;

    if (yaml_value_list(value, 1, FOLLOW_KEYS_MAX, &count) < 0)
        return -1;
    for (int i = 0; i < PLAN_SPACE_AXES; i++) {
        subject[i].key = calloc(count, sizeof *subject[i].key);
        if (subject[i].key == NULL)
            return yaml_value_refuse(value, "do not fit in memory");
    }
    item.name = "key";
    item.expected = "[time, point] such as [2 s, [1 m, 0 mm, 1.2 m]]";
    item.node = yaml_value_node(value)->first;
    for (uint32_t i = 0; i < count; i++) {
        if (follow_read_key(reader, &item, subject) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

static const struct yaml_field move_subject_fields[] = {
    { "curve", YAML_OPTIONAL, "a curve whose keys are times and points alone",
      follow_read_curve, offsetof(struct plan_axis, curve) },
    { "keys", YAML_REQUIRED,
      "a list of 1 .. 10000 keys such as [2 s, [1 m, 0 mm, 1.2 m]]",
      follow_read_keys, 0 },
};
const struct yaml_shape move_subject_shape = { "subject", move_subject_fields,
                                               ARRAY_LEN(move_subject_fields) };

int move_read_subject(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    struct plan_camera *camera = out;
    struct plan_axis *const outer = self->axis;
    struct plan_axis *subject = calloc(PLAN_SPACE_AXES, sizeof *subject);

    camera->look = PLAN_LOOK_SUBJECT;
    camera->following.subject = subject;
    if (subject == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    for (int i = 0; i < PLAN_SPACE_AXES; i++) {
        subject[i] = (struct plan_axis){
            .name = { "xyz"[i] },
            .curve = PLAN_CURVE_QUINTIC,
            .mu_q32 = MOTION_FIXED_ONE_Q32,
            .k1_q32 = (MOTION_FIXED_ONE_Q32 + 1) / 3,
            .k2_q32 = (2 * MOTION_FIXED_ONE_Q32 + 1) / 3,
            .blend_ns_q12 = MOTION_FIXED_S_Q12 / 2,
            .place = yaml_tree_place(value->tree, value->node),
        };
    }
    self->axis = subject;
    const int err =
        yaml_fields_read(value, &move_subject_shape, reader, subject);
    self->axis = outer;
    for (int i = 1; i < PLAN_SPACE_AXES; i++)
        subject[i].curve = subject[0].curve;
    return err;
}

int move_read_on_table(void *reader, const struct yaml_value *value, void *out)
{
    const struct move_reader *self = reader;
    struct plan_camera *camera = out;

    camera->look = PLAN_LOOK_TABLE;
    if (self->rig->kinematics == NULL || !self->rig->kinematics->table.is_given)
        return yaml_value_refuse(value, "is on a turntable, and the rig's "
                                        "kinematics have none");
    return move_read_vector(self, value, PLAN_SPACE_AXES, camera->point_q32);
}

/* ---- the lens ------------------------------------------------------------ */

static int follow_read_lens(struct move_reader *self,
                            const struct yaml_value *value,
                            enum plan_lens which)
{
    struct plan_camera *camera = self->move->camera;
    const struct plan_rig *rig = camera->following.rig;
    uint32_t index = 0;

    if (rig == NULL || !rig->lens[which].is_given)
        return yaml_value_refuse(value, "has no axis under lens in the rig's "
                                        "kinematics");
    if (camera->look == PLAN_LOOK_KEYS)
        return yaml_value_refuse(value, "has no subject to follow");
    if (move_drive_rig_axis(self, value, rig->lens[which].axis, PLAN_BY_CAMERA,
                            &index) < 0)
        return -1;
    camera->following.has_lens[which] = true;
    camera->following.rig->lens[which].axis = index;
    return 0;
}

int move_read_focus(void *reader, const struct yaml_value *value, void *out)
{
    bool follows = false;

    (void)out;
    if (yaml_value_bool(value, &follows) < 0)
        return -1;
    return follows ? follow_read_lens(reader, value, PLAN_LENS_FOCUS) : 0;
}

static int follow_read_focal(void *reader, const struct yaml_value *value,
                             void *out)
{
    return move_read_positive(reader, value, UNITS_POSITION, out);
}

static int follow_read_focal_time(void *reader, const struct yaml_value *value,
                                  void *out)
{
    const struct move_reader *self = reader;
    int64_t *t_ns_q12 = out;

    if (yaml_units_read(value, UNITS_TIME, &self->units, t_ns_q12) < 0)
        return -1;
    return *t_ns_q12 < 0 ? yaml_value_refuse(value, "is before the move begins")
                         : 0;
}

static const struct yaml_field move_zoom_fields[] = {
    { "focal", YAML_REQUIRED, "a focal length such as 35 mm", follow_read_focal,
      offsetof(struct plan_camera, following.focal_q32) },
    { "at", YAML_OPTIONAL, "the time at which the lens has it",
      follow_read_focal_time,
      offsetof(struct plan_camera, following.focal_ns_q12) },
};
const struct yaml_shape move_zoom_shape = { "zoom", move_zoom_fields,
                                            ARRAY_LEN(move_zoom_fields) };

int move_read_zoom(void *reader, const struct yaml_value *value, void *out)
{
    return yaml_fields_read(value, &move_zoom_shape, reader, out) < 0
               ? -1
               : follow_read_lens(reader, value, PLAN_LENS_ZOOM);
}

/* ---- the rig ------------------------------------------------------------- */

/* From the index of an axis in the rig to its index in the move. */
static int follow_find(const struct move_reader *self,
                       const struct yaml_value *value,
                       struct plan_rig_axis *axis)
{
    const char *name;

    if (!axis->is_given)
        return 0;
    name = self->rig->axis[axis->axis].name;
    for (uint32_t i = 0; i < self->move->axis_count; i++)
        if (strcmp(self->move->axis[i].name, name) == 0) {
            axis->axis = i;
            return 0;
        }
    return yaml_value_refuse(value,
                             "is carried by the axis '%s', which the move does "
                             "not drive",
                             name);
}

int move_check_rig(const struct move_reader *self,
                   const struct yaml_value *move)
{
    struct plan_camera *camera = self->move->camera;
    struct yaml_value value = *move;

    if (camera == NULL || camera->following.rig == NULL)
        return 0;
    struct plan_rig *rig = camera->following.rig;
    value.node = yaml_fields_find(move, "camera");
    value.name = "camera";
    value.expected = "keys for it (one holds it in a place), or a path";
    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        if (follow_find(self, &value, &rig->carrier[i]) < 0)
            return -1;
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        rig->head[i] =
            (struct plan_rig_axis){ i != MOTION_HEAD_ROLL || camera->has_roll,
                                    camera->axis[i] };
    if (camera->look != PLAN_LOOK_TABLE)
        rig->table.is_given = false;
    return follow_find(self, &value, &rig->table);
}
