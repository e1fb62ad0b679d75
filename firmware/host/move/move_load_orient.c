/* firmware/host/move/move_load_orient.c - `look.keys` of move.yaml: orientations
 * through which a head turns.  See move_load.h. */
#include <stdlib.h>

#include "firmware/host/base/array.h"
#include "firmware/host/move/move_load.h"
#include "motion/plan/camera/plan_camera.h"

/* Of an angle of a head: more than any cable takes, less than it can count. */
#define ORIENT_DEG_MAX 1000000

const char *const move_orients[MOVE_ORIENTS] = {
    [MOTION_ORIENT_SLERP] = "slerp",
    [MOTION_ORIENT_SQUAD] = "squad",
    [MOTION_ORIENT_C2] = "c2",
};

/* A key while its map is read: forward and up make a frame together. */
struct orient_reading {
    struct plan_orient_key key;
    struct motion_dir forward, up;
};

/* ---- when, or where on the path ---- */

static int move_read_orient_time(void *reader, const struct yaml_value *value,
                                 void *out)
{
    const struct move_reader *self = reader;
    int64_t *t_ns_q12 = out;
    char quote[YAML_QUOTE_MAX];

    if (yaml_units_read(value, UNITS_TIME, &self->units, t_ns_q12) < 0)
        return -1;
    return *t_ns_q12 >= 0
               ? 0
               : yaml_value_refuse(value, "%s is before the start of the move",
                                   yaml_value_quote(quote, value));
}

static int move_read_orient_at(void *reader, const struct yaml_value *value,
                               void *out)
{
    const struct move_reader *self = reader;

    if (self->move->path == NULL)
        return yaml_value_refuse(value, "is a place on a path, and the move "
                                        "has none");
    return move_read_distance(self, value, out);
}

/* ---- the orientation ---- */

static int move_read_orient_angles(void *reader, const struct yaml_value *value,
                                   void *out)
{
    struct units_context units = ((const struct move_reader *)reader)->units;
    const int64_t most = ORIENT_DEG_MAX * MOTION_FIXED_ONE_Q32;
    struct plan_orient_key *key = out;
    struct yaml_value item = *value;
    char quote[YAML_QUOTE_MAX];
    uint32_t count;

    units.unit = UNITS_AXIS_DEG;
    if (yaml_value_list(value, MOTION_HEAD_AXES - 1, MOTION_HEAD_AXES, &count) <
        0)
        return -1;
    item.node = yaml_value_node(value)->first;
    key->has_angles = true;
    motion_head_set_deg_q32(&key->head, MOTION_HEAD_ROLL, 0);
    for (uint32_t i = 0; i < count; i++) {
        int64_t deg_q32 = 0;
        if (yaml_units_read(&item, UNITS_POSITION, &units, &deg_q32) < 0)
            return -1;
        if (deg_q32 > most || deg_q32 < -most)
            return yaml_value_refuse(&item, "%s is beyond %d deg",
                                     yaml_value_quote(quote, &item),
                                     ORIENT_DEG_MAX);
        motion_head_set_deg_q32(&key->head, (enum motion_head_axis)i, deg_q32);
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

static int move_read_quaternion(void *reader, const struct yaml_value *value,
                                void *out)
{
    const struct move_reader *self = reader;
    int64_t wxyz[4];

    if (yaml_units_read_list(value, UNITS_RATIO, &self->units, NULL, 4, wxyz) <
        0)
        return -1;
    return motion_quat_unit(wxyz, out) < 0
               ? yaml_value_refuse(value, "is no rotation")
               : 0;
}

int move_read_direction(void *reader, const struct yaml_value *value, void *out)
{
    const struct move_reader *self = reader;
    int64_t q32[3];

    if (yaml_units_read_list(value, UNITS_RATIO, &self->units, NULL, 3, q32) <
        0)
        return -1;
    return motion_vec_unit(motion_vec_from_q32(q32), out) < 0
               ? yaml_value_refuse(value, "is no direction")
               : 0;
}

/* Up is made perpendicular to forward. */
static int orient_view(const struct yaml_value *value,
                       struct orient_reading *reading)
{
    const struct motion_dir forward = reading->forward;
    struct motion_dir axis[3] = { { { 0 } }, { { 0 } }, { { 0 } } };

    if (yaml_fields_find(value, "forward") == 0)
        return 0;
    if (motion_dir_perpendicular(reading->up, forward, &axis[1]) < 0)
        return yaml_value_refuse(value, "has parallel forward and up");
    axis[0] = motion_dir_cross(forward, axis[1]);
    axis[2] = motion_dir_neg(forward);
    return motion_quat_from_axes(axis, &reading->key.q) < 0
               ? yaml_value_refuse(value, "is no rotation")
               : 0;
}

/* ---- keys ---- */

/* The first two say when, the next three which way: one of each is given. */
#define ORIENT_WHEN  2
#define ORIENT_WHICH 3
static const struct yaml_field move_orient_fields[] = {
    { "t", YAML_OPTIONAL, "a time, each later than the one before",
      move_read_orient_time, offsetof(struct orient_reading, key.t_ns_q12) },
    { "at", YAML_OPTIONAL, "a length of the path, or a part of it in %",
      move_read_orient_at, offsetof(struct orient_reading, key.at) },
    { "angles", YAML_OPTIONAL,
      "pan, tilt and roll of the head such as [30 deg, -5 deg, 0 deg]",
      move_read_orient_angles, offsetof(struct orient_reading, key) },
    { "quaternion", YAML_OPTIONAL, "w, x, y and z such as [1, 0, 0, 0]",
      move_read_quaternion, offsetof(struct orient_reading, key.q) },
    { "forward", YAML_OPTIONAL, "a direction such as [1, 0, 0]",
      move_read_direction, offsetof(struct orient_reading, forward) },
    { "up", YAML_OPTIONAL, "a direction across forward, such as [0, 0, 1]",
      move_read_direction, offsetof(struct orient_reading, up) },
};
const struct yaml_shape move_orient_shape = { "orientation", move_orient_fields,
                                              ARRAY_LEN(move_orient_fields) };

static unsigned orient_given(const struct yaml_value *value, unsigned from,
                             unsigned count)
{
    unsigned given = 0;

    for (unsigned i = from; i < from + count; i++)
        given += yaml_fields_find(value, move_orient_fields[i].name) != 0;
    return given;
}

static int move_check_orient(const struct yaml_value *value, bool is_along,
                             bool is_first, bool was_along)
{
    if (orient_given(value, 0, ORIENT_WHEN) != 1)
        return yaml_value_refuse(value, "gives not just one of t and at");
    if (!is_first && is_along != was_along)
        return yaml_value_refuse(value, "gives %s, and the first one %s",
                                 is_along ? "at" : "t", was_along ? "at" : "t");
    if (orient_given(value, ORIENT_WHEN, ORIENT_WHICH) != 1)
        return yaml_value_refuse(value, "gives not just one of angles, "
                                        "quaternion and forward");
    if (yaml_fields_find(value, "up") && !yaml_fields_find(value, "forward"))
        return yaml_value_refuse(value, "gives up without forward");
    return 0;
}

static int move_read_orient(struct move_reader *reader,
                            const struct yaml_value *value,
                            struct plan_camera *camera)
{
    struct plan_orient *orient = &camera->orient;
    struct orient_reading reading = {
        .key.place = yaml_tree_place(value->tree, value->node),
        .up = camera->up,
    };
    bool is_along;

    if (yaml_value_need(value, YAML_TREE_MAP) < 0)
        return -1;
    is_along = yaml_fields_find(value, "at") != 0;
    if (yaml_fields_read(value, &move_orient_shape, reader, &reading) < 0 ||
        move_check_orient(value, is_along, orient->count == 0,
                          orient->is_along) < 0 ||
        orient_view(value, &reading) < 0)
        return -1;
    orient->is_along = is_along;
    orient->key[orient->count++] = reading.key;
    return 0;
}

int move_read_orients(void *reader, const struct yaml_value *value, void *out)
{
    struct plan_camera *camera = out;
    struct plan_orient *orient = &camera->orient;
    struct yaml_value item = *value;
    uint32_t count;

    camera->look = PLAN_LOOK_KEYS;
    orient->curve = MOTION_ORIENT_C2;
    if (yaml_value_list(value, 2, PLAN_ORIENT_KEYS_MAX, &count) < 0)
        return -1;
    orient->key = calloc(count, sizeof *orient->key);
    if (orient->key == NULL)
        return yaml_value_refuse(value, "do not fit in memory");
    item.name = "orientation";
    item.expected = "a map such as {t: 2 s, angles: [30 deg, -5 deg, 0 deg]}";
    item.node = yaml_value_node(value)->first;
    while (orient->count < count) {
        if (move_read_orient(reader, &item, camera) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

int move_read_orient_curve(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct plan_camera *camera = out;
    unsigned index;

    (void)reader;
    if (camera->look != PLAN_LOOK_KEYS)
        return yaml_value_refuse(value, "is not used without keys");
    if (yaml_value_choice(value, move_orients, MOVE_ORIENTS, &index) < 0)
        return -1;
    camera->orient.curve = (enum motion_orient_curve)index;
    return 0;
}
