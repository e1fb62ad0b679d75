/* firmware/host/move/move_load_couple.c - `couplings` of move.yaml: axes that
 * follow another one by a gear or a cam.  See move_load.h. */
#include <stdlib.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/move/move_load.h"
#include "motion/plan/plan_couple.h"

#define MOVE_CAM_MAX 1000

/* One of them while it is read. */
struct move_coupling {
    struct plan_coupling own;
    bool has_offset;
};

/* Of an axis of the move, in its own unit. */
static int move_couple_place(const struct move_reader *self, uint32_t axis,
                             const struct yaml_value *value, int64_t *out)
{
    const int found = rig_axis_index(self->rig, self->move->axis[axis].name);
    struct units_context units = self->units;
    units.unit = self->rig->axis[found].unit;
    return yaml_units_read(value, UNITS_POSITION, &units, out);
}

static int move_read_master(void *reader, const struct yaml_value *value,
                            void *out)
{
    const struct plan_move *move = ((struct move_reader *)reader)->move;
    struct move_coupling *self = out;
    const char *names[RIG_AXES_MAX];
    unsigned count = 0, index;
    uint32_t axis[RIG_AXES_MAX];

    for (uint32_t i = 0; i < move->axis_count; i++)
        if (move->axis[i].driver != PLAN_BY_COUPLING) {
            axis[count] = i;
            names[count++] = move->axis[i].name;
        }
    if (yaml_value_choice(value, names, count, &index) < 0)
        return -1;
    self->own.master = axis[index];
    return 0;
}

static int move_read_numerator(void *reader, const struct yaml_value *value,
                               void *out)
{
    (void)reader;
    if (yaml_value_integer(value, -PLAN_RATIO_MAX, PLAN_RATIO_MAX, out) < 0)
        return -1;
    return *(int64_t *)out != 0 ? 0 : yaml_value_refuse(value, "is 0");
}

static int move_read_denominator(void *reader, const struct yaml_value *value,
                                 void *out)
{
    (void)reader;
    return yaml_value_integer(value, 1, PLAN_RATIO_MAX, out);
}

static int move_read_couple_offset(void *reader, const struct yaml_value *value,
                                   void *out)
{
    struct move_coupling *self = out;

    self->has_offset = true;
    return move_couple_place(reader, self->own.axis, value,
                             &self->own.offset_q32);
}

static int move_read_cam_key(const struct move_reader *reader,
                             struct plan_coupling *own,
                             const struct yaml_value *item)
{
    struct plan_key *key = &own->cam.key[own->cam.key_count];
    struct yaml_value place[2];
    int64_t m_q32;

    if (yaml_value_pair(item, place) < 0 ||
        move_couple_place(reader, own->master, &place[0], &m_q32) < 0 ||
        move_couple_place(reader, own->axis, &place[1], &key->key.pos_q32) < 0)
        return -1;
    if (own->cam.key_count == 0)
        own->low_q32 = m_q32;
    key->place = yaml_tree_place(item->tree, item->node);
    if (plan_couple_time(m_q32 - own->low_q32, &key->key.t_ns_q12) < 0 ||
        (own->cam.key_count > 0 && key->key.t_ns_q12 <= key[-1].key.t_ns_q12))
        return yaml_value_refuse(&place[0], "is not above the one before");
    own->cam.key_count++;
    return 0;
}

static int move_read_cam(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct plan_coupling *own = &((struct move_coupling *)out)->own;
    struct yaml_value item = *value;
    uint32_t count;

    if (yaml_value_list(value, 2, MOVE_CAM_MAX, &count) < 0)
        return -1;
    own->cam.key = calloc(count, sizeof *own->cam.key);
    if (own->cam.key == NULL)
        memory_fail();
    item.name = "pair";
    item.expected = "[where the master is, where the axis is then], the first "
                    "ones increasing";
    item.node = yaml_value_node(value)->first;
    for (uint32_t i = 0; i < count; i++) {
        if (move_read_cam_key(reader, own, &item) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

/* Of a cam alone, and one that goes through its pairs without more words. */
static int move_read_cam_curve(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct plan_axis *cam = &((struct move_coupling *)out)->own.cam;

    if (cam->key_count == 0)
        return yaml_value_refuse(value, "is not for a gear");
    if (move_read_curve(reader, value, &cam->curve) < 0)
        return -1;
    const struct plan_curve_rules *rules = plan_curve_rules(cam->curve);
    return rules->blend || rules->shape || rules->handles ||
                   rules->vel == PLAN_MUST
               ? yaml_value_refuse(value, "%s is not for a cam", rules->name)
               : 0;
}

static const struct yaml_field move_coupling_fields[] = {
    { "master", YAML_REQUIRED, "an axis of the move that is not coupled itself",
      move_read_master, 0 },
    { "numerator", YAML_OPTIONAL, "-1000000 .. 1000000, not 0, of a gear",
      move_read_numerator, offsetof(struct move_coupling, own.numerator) },
    { "denominator", YAML_OPTIONAL, "1 .. 1000000, of a gear",
      move_read_denominator, offsetof(struct move_coupling, own.denominator) },
    { "offset", YAML_OPTIONAL,
      "a position, where a gear's axis is when its master is at 0",
      move_read_couple_offset, 0 },
    { "cam", YAML_OPTIONAL,
      "a list of 2 .. 1000 pairs such as [100 mm, 12 deg], of master and axis",
      move_read_cam, 0 },
    { "curve", YAML_OPTIONAL, "the kind of curve of a cam", move_read_cam_curve,
      0 },
};
const struct yaml_shape move_coupling_shape = {
    "coupling", move_coupling_fields, ARRAY_LEN(move_coupling_fields)
};

/* A cam, or a gear. */
static int move_check_coupling(const struct move_coupling *self,
                               const struct yaml_value *value)
{
    const struct plan_coupling *own = &self->own;
    const bool is_gear = own->numerator != 0 || own->denominator != 0;

    if (is_gear == (own->cam.key_count > 0))
        return yaml_value_refuse(value, is_gear
                                            ? "has a gear and a cam"
                                            : "has neither a gear nor a cam");
    if (is_gear && (own->numerator == 0 || own->denominator == 0))
        return yaml_value_refuse(value, "has half of a ratio");
    if (!is_gear && self->has_offset)
        return yaml_value_refuse(value, "has an offset beside a cam");
    return 0;
}

static int move_read_coupling(void *reader, uint32_t key,
                              const struct yaml_value *entry)
{
    struct move_reader *self = reader;
    struct plan_move *move = self->move;
    const struct yaml_value name = {
        entry->tree, key, "coupling",
        "an axis of the rig that nothing else drives"
    };
    struct yaml_value value = *entry;
    struct move_coupling coupling = {
        .own = { .cam = { .curve = PLAN_CURVE_C2,
                          .mu_q32 = MOTION_FIXED_ONE_Q32,
                          .k1_q32 = (MOTION_FIXED_ONE_Q32 + 1) / 3,
                          .k2_q32 = (2 * MOTION_FIXED_ONE_Q32 + 1) / 3,
                          .place = yaml_tree_place(entry->tree, key) },
                 .place = yaml_tree_place(entry->tree, key) }
    };
    int err;

    if (move_drive_axis(self, &name, PLAN_BY_COUPLING, &coupling.own.axis) < 0)
        return -1;
    value.expected = "a map with master, and numerator and denominator, or cam";
    err = yaml_fields_read(&value, &move_coupling_shape, reader, &coupling);
    if (err == 0)
        err = move_check_coupling(&coupling, &value);
    move->coupling[move->couplings++] = coupling.own;
    return err;
}

int move_read_couplings(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    struct plan_move *move = self->move;

    (void)out;
    if (move_refuse_guest(self, value) < 0)
        return -1;
    move->coupling = calloc(RIG_AXES_MAX, sizeof *move->coupling);
    if (move->coupling == NULL)
        memory_fail();
    return yaml_fields_each(value, RIG_AXES_MAX, reader, move_read_coupling);
}
