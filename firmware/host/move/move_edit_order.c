/* firmware/host/move/move_edit_order.c - see move_edit_order.h.
 *
 * It reads the text that the edits made, so that which edit moved what is needed
 * for the times of keys alone. */
#include "firmware/host/move/move_edit_order.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/yaml/yaml_edit.h"
#include "motion/core/fixed.h"

struct edit_slot {
    double t_s;
    uint32_t was; /* its place in the text */
};

static int edit_by_time(const void *a, const void *b)
{
    const struct edit_slot *x = a, *y = b;

    if (x->t_s != y->t_s)
        return x->t_s < y->t_s ? -1 : 1;
    return (x->was > y->was) - (x->was < y->was);
}

static const struct move_edit *edit_of(const struct edit *self,
                                       enum move_edit_kind kind,
                                       const char *axis, uint32_t key)
{
    const struct move_edit *found = NULL;

    for (uint32_t i = 0; i < self->edits; i++) {
        const struct move_edit *edit = &self->edit[i];
        if (edit->kind == kind && strcmp(edit->axis, axis) == 0 &&
            edit->key == key)
            found = edit;
    }
    return found;
}

static bool edit_has_time(const struct move_edit *edit)
{
    for (unsigned i = 0; i < edit->fields; i++)
        if (strcmp(edit->field[i].name, "t") == 0)
            return true;
    return false;
}

/* Times of the keys of an axis as they stand in the new text; how many, 0 where
 * one is not a number. */
static uint32_t edit_slots(const struct edit *self,
                           const struct plan_axis *axis, struct edit_slot *slot)
{
    uint32_t count = 0;

    for (uint32_t i = 0; i <= axis->key_count; i++) {
        for (uint32_t k = 0; k < self->edits; k++) {
            const struct move_edit *add = &self->edit[k];
            if (add->kind != MOVE_EDIT_ADD ||
                strcmp(add->axis, axis->name) != 0 ||
                move_edit_before(axis, add->t_s) != i)
                continue;
            slot[count] = (struct edit_slot){ add->t_s, count };
            count++;
        }
        if (i == axis->key_count ||
            edit_of(self, MOVE_EDIT_REMOVE, axis->name, i) != NULL)
            continue;
        const struct move_edit *moved =
            edit_of(self, MOVE_EDIT_KEY, axis->name, i);
        const double t_s = moved != NULL && edit_has_time(moved)
                               ? moved->t_s
                               : (double)axis->key[i].key.t_ns_q12 /
                                     (double)MOTION_FIXED_S_Q12;
        if (isnan(t_s))
            return 0;
        slot[count] = (struct edit_slot){ t_s, count };
        count++;
    }
    return count;
}

struct edit_part {
    size_t from, to;
};

/* Of each item of the list; of one on lines of its own with what stands behind
 * it. */
static int edit_parts(const struct yaml_text *yaml,
                      const struct yaml_value *keys, struct edit_part *part)
{
    const bool flow = yaml_edit_is_flow(yaml, keys);
    struct yaml_value key = yaml_value_at(keys, yaml_value_node(keys)->first);

    for (uint32_t i = 0; key.node != 0; i++) {
        if (yaml_edit_span(yaml, &key, &part[i].from, &part[i].to) < 0)
            return -1;
        while (!flow && part[i].to < yaml->length &&
               strchr("\r\n", yaml->data[part[i].to]) == NULL)
            part[i].to++;
        key.node = yaml_value_node(&key)->next;
    }
    return 0;
}

static void edit_exchange(struct move_text *text, const struct edit_part *part,
                          const struct edit_slot *slot, uint32_t count)
{
    char *data = memory_new(text->length + 1, 1);
    size_t from = 0, length = 0;

    for (uint32_t i = 0; i <= count; i++) {
        const size_t to = i == count ? text->length : part[i].from;
        memcpy(data + length, text->data + from, to - from);
        length += to - from;
        if (i == count)
            break;
        const struct edit_part *other = &part[slot[i].was];
        memcpy(data + length, text->data + other->from,
               other->to - other->from);
        length += other->to - other->from;
        from = part[i].to;
    }
    memory_free(text->data);
    text->data = data;
    text->length = length;
    text->moved = true;
}

static int edit_order_axis(const struct edit *self,
                           const struct plan_axis *axis, struct move_text *text)
{
    const struct yaml_report report = { self->source->path,
                                        self->source->message,
                                        YAML_MESSAGE_MAX };
    const size_t most = (size_t)axis->key_count + self->edits + 1;
    struct edit_slot *slot = memory_new(most, sizeof *slot);
    struct edit_part *part = memory_new(most, sizeof *part);
    const uint32_t count = edit_slots(self, axis, slot);
    struct move_text_files over;
    struct edit again = { .source = self->source };
    struct yaml_value keys;
    bool sorted = true;
    int err = 0;

    for (uint32_t i = 1; i < count; i++)
        sorted = sorted && slot[i - 1].t_s <= slot[i].t_s;
    if (!sorted) {
        move_text_over(&over, self->source->files, self->source->path, text);
        err = yaml_text_open(&again.yaml, &over.files, &report);
        if (err == 0)
            err = move_edit_axis_keys(&again, axis->name, &keys);
        if (err == 0 && yaml_value_node(&keys)->length != count)
            err = yaml_value_refuse(&keys, "are not those of the edits");
        if (err == 0)
            err = edit_parts(&again.yaml, &keys, part);
        qsort(slot, count, sizeof *slot, edit_by_time);
        if (err == 0)
            edit_exchange(text, part, slot, count);
        yaml_text_close(&again.yaml);
    }
    memory_free(slot);
    memory_free(part);
    return err;
}

int move_edit_order(const struct edit *self, struct move_text *text)
{
    const struct plan_move *was = self->source->was;
    int err = 0;

    for (uint32_t i = 0; i < was->axis_count && err == 0; i++) {
        bool touched = false;
        for (uint32_t k = 0; k < self->edits; k++)
            touched =
                touched || (self->edit[k].kind != MOVE_EDIT_SET &&
                            strcmp(self->edit[k].axis, was->axis[i].name) == 0);
        if (touched && was->axis[i].key_count > 0)
            err = edit_order_axis(self, &was->axis[i], text);
    }
    return err;
}
