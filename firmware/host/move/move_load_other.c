/* firmware/host/move/move_load_other.c - `layers`, `fade` and `warp` of
 * move.yaml: what is done to a move as a whole.  See move_load.h. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/move/move_load.h"
#include "motion/plan/compose.h"
#include "motion/plan/plan_blend.h"

/* ---- another move ---- */

static int move_need_memory(const struct yaml_value *value, const void *memory)
{
    return memory != NULL ? 0
                          : yaml_value_refuse(value, "does not fit in memory");
}

/* Its axes, written here. */
static int move_read_other_axes(void *reader, const struct yaml_value *value,
                                void *out)
{
    struct move_reader inner = *(const struct move_reader *)reader;
    struct plan_other *other = out;

    inner.move = other->move;
    if (plan_move_reserve(other->move, inner.rig->axis_count) < 0)
        return yaml_value_refuse(value, "do not fit in memory");
    return move_read_axes(&inner, value, NULL);
}

/* The file beside the one that names it. */
static int move_beside(const struct move_reader *self,
                       const struct yaml_value *value, char path[],
                       size_t capacity)
{
    const char *name = yaml_value_text(value);
    const char *slash = strrchr(self->path, '/');
    const int folder = slash == NULL || (name != NULL && name[0] == '/')
                           ? 0
                           : (int)(slash - self->path) + 1;

    if (name == NULL)
        return -1;
    if (snprintf(path, capacity, "%.*s%s", folder, self->path, name) >=
        (int)capacity)
        return yaml_value_refuse(value, "is too long");
    return 0;
}

/* Its axes, in another file.  A sentence about that file stands alone. */
static int move_read_other_file(void *reader, const struct yaml_value *value,
                                void *out)
{
    const struct move_reader *self = reader;
    struct plan_other *other = out;
    char path[4096];

    if (other->move->axis_count > 0)
        return yaml_value_refuse(value, "is given beside axes");
    if (move_beside(self, value, path, sizeof path) < 0)
        return -1;
    snprintf(other->file, sizeof other->file, "%s", yaml_value_text(value));
    return move_load_as(files_regular(self->files), path, true, self->rig,
                        other->move, value->tree->report.message);
}

static int move_read_fade_weight(void *reader, const struct yaml_value *value,
                                 void *out)
{
    struct move_reader *self = reader;

    return move_read_keyed(self, value, UNITS_RATIO, self->units.unit, out);
}

static const struct yaml_field move_other_fields[] = {
    { "axes", YAML_OPTIONAL, "a map of axes by name", move_read_other_axes, 0 },
    { "move", YAML_OPTIONAL, "a file with a move for the same rig, or axes",
      move_read_other_file, 0 },
    { "weight", YAML_REQUIRED, "a map with curve and keys such as [4 s, 100 %]",
      move_read_fade_weight, offsetof(struct plan_other, weight) },
};
const struct yaml_shape move_layer_shape = { "layer", move_other_fields,
                                             ARRAY_LEN(move_other_fields) - 1 };
const struct yaml_shape move_fade_shape = { "fade", move_other_fields,
                                            ARRAY_LEN(move_other_fields) };

/* Each of its axes must be one of this move. */
static int move_match(const struct move_reader *self,
                      const struct yaml_value *value, struct plan_other *other)
{
    const struct plan_move *move = self->move;

    other->of = calloc(other->move->axis_count, sizeof *other->of);
    if (move_need_memory(value, other->of) < 0)
        return -1;
    for (uint32_t i = 0; i < other->move->axis_count; i++) {
        const struct plan_axis *axis = &other->move->axis[i];
        uint32_t k = 0;
        while (k < move->axis_count &&
               strcmp(move->axis[k].name, axis->name) != 0)
            k++;
        if (k == move->axis_count)
            return yaml_report_at(
                &value->tree->report,
                other->file[0] != 0 ? other->place : axis->place,
                "%s has the axis '%s', which nothing else drives, expected "
                "axes that this move has already",
                value->name, axis->name);
        other->of[i] = k;
    }
    return 0;
}

static int move_read_other(struct move_reader *self,
                           const struct yaml_value *value,
                           const struct yaml_shape *shape,
                           struct plan_other *other)
{
    other->place = yaml_tree_place(value->tree, value->node);
    other->move = calloc(1, sizeof *other->move);
    if (move_need_memory(value, other->move) < 0 ||
        yaml_fields_read(value, shape, self, other) < 0)
        return -1;
    if (other->move->axis_count == 0)
        return yaml_value_refuse(value, "moves nothing");
    return move_match(self, value, other);
}

/* ---- layers, fade, warp ---- */

int move_read_layers(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    struct plan_move *move = self->move;
    struct yaml_value item = *value;
    uint32_t count;

    (void)out;
    if (move_refuse_guest(self, value) < 0 ||
        yaml_value_list(value, 1, PLAN_LAYERS_MAX, &count) < 0)
        return -1;
    move->layer = calloc(count, sizeof *move->layer);
    if (move_need_memory(value, move->layer) < 0)
        return -1;
    item.name = "layer";
    item.expected = "a map with axes, or with move";
    item.node = yaml_value_node(value)->first;
    while (move->layers < count) {
        if (move_read_other(self, &item, &move_layer_shape,
                            &move->layer[move->layers++]) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

int move_read_fade(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;

    (void)out;
    if (move_refuse_guest(self, value) < 0)
        return -1;
    self->move->fade = calloc(1, sizeof *self->move->fade);
    if (move_need_memory(value, self->move->fade) < 0)
        return -1;
    return move_read_other(self, value, &move_fade_shape, self->move->fade);
}

int move_read_warp(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;

    (void)out;
    if (move_refuse_guest(self, value) < 0)
        return -1;
    self->move->warp = calloc(1, sizeof *self->move->warp);
    if (move_need_memory(value, self->move->warp) < 0)
        return -1;
    return move_read_keyed(self, value, UNITS_TIME, self->units.unit,
                           self->move->warp);
}
