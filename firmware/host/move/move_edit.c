/* firmware/host/move/move_edit.c - see move_edit.h.
 *
 *   text -> edits of its values, keys and entries -> text
 *        -> where keys passed each other: move_edit_order.c */
#include "firmware/host/move/move_edit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/move/move_edit_order.h"
#include "firmware/host/yaml/yaml_edit.h"
#include "motion/core/fixed.h"

static const char *const edit_short[] = { "t", "p", "v", "a" };
#define EDIT_SHORT (sizeof edit_short / sizeof *edit_short)

static struct yaml_value edit_root(const struct edit *self)
{
    return (struct yaml_value){ &self->yaml.tree, 0, "the move",
                                "a move with axes" };
}

/* --- where keys are ---------------------------------------------------------- */

/* The list of the keys of an axis. */
static int edit_find_list(const struct edit *self, const char *const path[],
                          unsigned paths, const char *axis,
                          struct yaml_value *keys)
{
    const struct yaml_value root = edit_root(self);

    *keys = root;
    for (unsigned i = 0; i < paths && (i == 0 || keys->node != 0); i++)
        *keys = yaml_value_at(&root, yaml_fields_find(keys, path[i]));
    if (keys->node != 0)
        keys->node = yaml_fields_find(keys, "keys");
    if (keys->node == 0 || yaml_value_node(keys)->kind != YAML_TREE_LIST)
        return yaml_value_refuse(&root, "has no keys of an axis \"%s\"", axis);
    keys->name = "key";
    return 0;
}

int move_edit_axis_keys(const struct edit *self, const char *axis,
                        struct yaml_value *keys)
{
    const char *const path[] = { "axes", axis };

    return edit_find_list(self, path, 2, axis, keys);
}

static int edit_find_keys(const struct edit *self, const struct move_edit *edit,
                          struct yaml_value *keys)
{
    return edit->curve != NULL
               ? edit_find_list(self, edit->path, edit->paths, edit->axis, keys)
               : move_edit_axis_keys(self, edit->axis, keys);
}

static int edit_find_key(const struct edit *self, const struct move_edit *edit,
                         struct yaml_value *keys, struct yaml_value *key)
{
    if (edit_find_keys(self, edit, keys) < 0)
        return -1;
    *key = yaml_value_at(keys, yaml_value_node(keys)->first);
    for (uint32_t i = 0; i < edit->key && key->node != 0; i++)
        key->node = yaml_value_node(key)->next;
    return key->node != 0
               ? 0
               : yaml_value_refuse(keys, "has no number %u", edit->key + 1);
}

/* Of a key as a map or in the short form; false: it is not there. */
static bool edit_find_field(const struct yaml_value *key, const char *name,
                            struct yaml_value *field)
{
    const struct yaml_tree_node *node = yaml_value_node(key);

    *field = (struct yaml_value){ key->tree, 0, name, "the value itself" };
    if (node->kind == YAML_TREE_MAP) {
        field->node = yaml_fields_find(key, name);
        return field->node != 0;
    }
    uint32_t at = node->first;
    for (unsigned i = 0; i < EDIT_SHORT && at != 0; i++) {
        if (strcmp(edit_short[i], name) == 0) {
            field->node = at;
            return true;
        }
        at = key->tree->node[at].next;
    }
    return false;
}

/* --- values ------------------------------------------------------------------ */

static bool edit_is_number(const char *text)
{
    return text[0] != 0 && strspn(text, "+-.0123456789eE") == strlen(text);
}

/* As values of this field are written: with the unit where the text `like` has
 * one. */
static int edit_value(const struct edit *self, const struct move_edit *edit,
                      const struct yaml_value *about, const char *name,
                      const char *value, const char *like,
                      char text[YAML_TEXT_VALUE_MAX])
{
    const int index = rig_axis_index(self->source->rig, edit->axis);
    const bool is_axis = edit->curve == NULL;
    char unit[NUMBER_UNIT_MAX] = "s";
    char share[32];
    const char *place = strchr("tpva", name[0]);
    const bool is_number =
        place != NULL && name[1] == 0 && edit_is_number(value);
    const bool plain =
        !is_number || (is_axis && index < 0) || edit_is_number(like);
    int length;

    if (!plain && name[0] != 't' && is_axis)
        number_unit(unit, self->source->rig->axis[index].unit,
                    (unsigned)(place - "tpva" - 1));
    if (!plain && name[0] != 't' && !is_axis)
        snprintf(unit, sizeof unit, "%s", edit->unit);
    /* Without a unit a weight is a share of 1. */
    if (plain && is_number && !is_axis && name[0] == 'p' &&
        strcmp(edit->unit, "%") == 0) {
        snprintf(share, sizeof share, "%.12g", strtod(value, NULL) / 100);
        value = share;
    }
    length = plain ? snprintf(text, YAML_TEXT_VALUE_MAX, "%s", value)
                   : snprintf(text, YAML_TEXT_VALUE_MAX, "%s %s", value, unit);
    return length < YAML_TEXT_VALUE_MAX
               ? 0
               : yaml_value_refuse(about, "would have too long a value");
}

/* What a neighbour says: of a field that the key itself does not have. */
static const char *edit_like(const struct yaml_value *key)
{
    struct yaml_value field;

    return edit_find_field(key, "t", &field) &&
                   yaml_value_node(&field)->kind == YAML_TREE_TEXT
               ? yaml_tree_text(field.tree, field.node)
               : "";
}

/* --- a key that is there ----------------------------------------------------- */

static bool edit_is_short(const char *name)
{
    for (unsigned i = 0; i < EDIT_SHORT; i++)
        if (strcmp(edit_short[i], name) == 0)
            return true;
    return false;
}

/* The value in brackets as a whole: a list such as [dt, dp]. */
static int edit_replace(struct edit *self, const struct yaml_value *field,
                        const char *text)
{
    size_t from, to;

    if (yaml_value_node(field)->kind == YAML_TREE_TEXT)
        return yaml_text_replace(&self->yaml, field, text);
    if (yaml_edit_span(&self->yaml, field, &from, &to) < 0)
        return -1;
    return yaml_text_put(&self->yaml, from, to - from, field, text);
}

static int edit_field(struct edit *self, const struct move_edit *edit,
                      const struct yaml_value *key,
                      const struct move_edit_field *to, bool is_map)
{
    const struct yaml_tree_node *node = yaml_value_node(key);
    char text[YAML_TEXT_VALUE_MAX];
    struct yaml_value field;
    const bool found = edit_find_field(key, to->name, &field);

    if (to->value == NULL) {
        if (!found)
            return 0;
        return node->kind == YAML_TREE_MAP
                   ? yaml_edit_remove(&self->yaml, key, to->name)
                   : yaml_edit_remove_item(&self->yaml, key, field.node);
    }
    const char *like = found && yaml_value_node(&field)->kind == YAML_TREE_TEXT
                           ? yaml_tree_text(field.tree, field.node)
                           : edit_like(key);
    if (edit_value(self, edit, key, to->name, to->value, like, text) < 0)
        return -1;
    if (found)
        return edit_replace(self, &field, text);
    if (node->kind == YAML_TREE_MAP)
        return yaml_edit_add(&self->yaml, key, to->name, text);
    /* In the short form: named, when the list becomes a map. */
    char named[YAML_TEXT_VALUE_MAX];
    size_t from, end;
    if (yaml_edit_span(&self->yaml, key, &from, &end) < 0)
        return -1;
    const int length =
        snprintf(named, sizeof named, is_map ? ", %s: %s" : ", %s%s",
                 is_map ? to->name : "", text);
    if (length < 0 || length >= (int)sizeof named)
        return yaml_value_refuse(key, "would have too long a value");
    return yaml_text_put(&self->yaml, end - 1, 0, key, named);
}

/* The short form has t, p, v, a in this order, none left out. */
static bool edit_needs_names(const struct move_edit *edit,
                             const struct yaml_value *key)
{
    uint32_t length = yaml_value_node(key)->length;

    if (yaml_value_node(key)->kind != YAML_TREE_LIST)
        return false;
    for (unsigned i = 0; i < edit->fields; i++) {
        const struct move_edit_field *field = &edit->field[i];
        struct yaml_value found;
        if (field->value == NULL ? edit_find_field(key, field->name, &found) &&
                                       yaml_value_node(&found)->next != 0
                                 : !edit_is_short(field->name))
            return true;
        if (field->value == NULL || edit_find_field(key, field->name, &found))
            continue;
        if (length >= EDIT_SHORT ||
            strcmp(edit_short[length], field->name) != 0)
            return true;
        length++;
    }
    return false;
}

static int edit_key(struct edit *self, const struct move_edit *edit)
{
    struct yaml_value keys, key;
    int err = edit_find_key(self, edit, &keys, &key);

    if (err < 0)
        return err;
    const bool names = edit_needs_names(edit, &key);
    for (unsigned i = 0; err == 0 && i < edit->fields; i++)
        err = edit_field(self, edit, &key, &edit->field[i], names);
    if (err == 0 && names)
        err = yaml_edit_name_items(&self->yaml, &key, edit_short, EDIT_SHORT);
    return err;
}

/* --- a key that comes -------------------------------------------------------- */

static const struct plan_axis *edit_axis(const struct edit *self,
                                         const char *name)
{
    const struct plan_move *was = self->source->was;

    for (uint32_t i = 0; i < was->axis_count; i++)
        if (strcmp(was->axis[i].name, name) == 0)
            return &was->axis[i];
    return NULL;
}

/* How many keys of the axis are before the time. */
uint32_t move_edit_before(const struct plan_axis *axis, double t_s)
{
    uint32_t count = 0;

    while (axis != NULL && count < axis->key_count &&
           (double)axis->key[count].key.t_ns_q12 / (double)MOTION_FIXED_S_Q12 <=
               t_s)
        count++;
    return count;
}

/* t, p, v, a in this order, none left out, and nothing else. */
static bool edit_fits_short(const struct move_edit *edit)
{
    for (unsigned i = 0; i < edit->fields; i++)
        if (i >= EDIT_SHORT || strcmp(edit->field[i].name, edit_short[i]) != 0)
            return false;
    return true;
}

/* As a new key is written. */
static int edit_new_key(const struct edit *self, const struct move_edit *edit,
                        const struct yaml_value *beside,
                        char text[YAML_TEXT_VALUE_MAX])
{
    const bool fits = edit_fits_short(edit);
    size_t used = 0;
    unsigned written = 0;

    for (unsigned i = 0; i < edit->fields; i++) {
        const struct move_edit_field *field = &edit->field[i];
        char value[YAML_TEXT_VALUE_MAX];
        if (field->value == NULL)
            continue;
        if (edit_value(self, edit, beside, field->name, field->value,
                       edit_like(beside), value) < 0)
            return -1;
        used += (size_t)snprintf(
            text + used, YAML_TEXT_VALUE_MAX - used, "%s%s%s%s",
            written++ > 0 ? ", "
            : fits        ? "["
                          : "{",
            fits ? "" : field->name, fits ? "" : ": ", value);
        if (used + 2 > YAML_TEXT_VALUE_MAX)
            return yaml_value_refuse(beside, "would be followed by a key that "
                                             "is too long");
    }
    if (written < 2)
        return yaml_value_refuse(beside, "would be followed by a key without "
                                         "a time or a position");
    snprintf(text + used, YAML_TEXT_VALUE_MAX - used, fits ? "]" : "}");
    return 0;
}

static int edit_add(struct edit *self, const struct move_edit *edit)
{
    struct yaml_value keys, beside;
    char text[YAML_TEXT_VALUE_MAX];
    const uint32_t before = move_edit_before(
        edit->curve != NULL ? edit->curve : edit_axis(self, edit->axis),
        edit->t_s);

    if (edit_find_keys(self, edit, &keys) < 0)
        return -1;
    beside = yaml_value_at(&keys, yaml_value_node(&keys)->first);
    if (beside.node == 0)
        return yaml_value_refuse(&keys, "is empty");
    if (edit_new_key(self, edit, &beside, text) < 0)
        return -1;
    uint32_t at = beside.node;
    for (uint32_t i = 0; i < before && at != 0; i++)
        at = keys.tree->node[at].next;
    return yaml_edit_add_item(&self->yaml, &keys, at, text);
}

static int edit_remove(struct edit *self, const struct move_edit *edit)
{
    struct yaml_value keys, key;

    if (edit_find_key(self, edit, &keys, &key) < 0)
        return -1;
    return yaml_edit_remove_item(&self->yaml, &keys, key.node);
}

/* --- a value anywhere -------------------------------------------------------- */

static uint32_t edit_child(const struct yaml_value *value, const char *name)
{
    const struct yaml_tree_node *node = yaml_value_node(value);
    char *end;

    if (node->kind == YAML_TREE_MAP)
        return yaml_fields_find(value, name);
    if (node->kind != YAML_TREE_LIST)
        return 0;
    unsigned long index = strtoul(name, &end, 10);
    uint32_t child = *end == 0 && name[0] != 0 ? node->first : 0;
    while (child != 0 && index-- > 0)
        child = value->tree->node[child].next;
    return child;
}

/* A number in the unit of the edit, where what it replaces has one. */
static int edit_replace_number(struct edit *self, const struct move_edit *edit,
                               const struct yaml_value *value, const char *text)
{
    char with_unit[YAML_TEXT_VALUE_MAX];

    if (edit->unit == NULL || !edit_is_number(text) ||
        yaml_value_node(value)->kind != YAML_TREE_TEXT ||
        edit_is_number(yaml_tree_text(value->tree, value->node)))
        return edit_replace(self, value, text);
    if (snprintf(with_unit, sizeof with_unit, "%s %s", text, edit->unit) >=
        (int)sizeof with_unit)
        return yaml_value_refuse(value, "would have too long a value");
    return edit_replace(self, value, with_unit);
}

static int edit_set(struct edit *self, const struct move_edit *edit)
{
    struct yaml_value value = edit_root(self);
    const char *text = edit->field[0].value;

    for (unsigned i = 0; i < edit->paths; i++) {
        const uint32_t child = edit_child(&value, edit->path[i]);
        const bool last = i + 1 == edit->paths;
        if (last && text == NULL)
            return child == 0
                       ? 0
                       : yaml_edit_remove(&self->yaml, &value, edit->path[i]);
        if (last && child == 0 &&
            yaml_value_node(&value)->kind == YAML_TREE_MAP)
            return yaml_edit_add(&self->yaml, &value, edit->path[i], text);
        if (child == 0)
            return yaml_value_refuse(&value, "has no \"%s\"", edit->path[i]);
        value = (struct yaml_value){ value.tree, child, edit->path[i],
                                     "what the edit names" };
    }
    return edit->paths == 0 ? yaml_value_refuse(&value, "is no single value")
                            : edit_replace_number(self, edit, &value, text);
}

/* --- all of them ------------------------------------------------------------- */

static int edit_one(struct edit *self, const struct move_edit *edit)
{
    switch (edit->kind) {
    case MOVE_EDIT_KEY:
        return edit_key(self, edit);
    case MOVE_EDIT_ADD:
        return edit_add(self, edit);
    case MOVE_EDIT_REMOVE:
        return edit_remove(self, edit);
    default:
        return edit_set(self, edit);
    }
}

/* What was read before is only looked at: its edits are those of this list. */
static int edit_open(struct edit *self)
{
    const struct move_text_source *source = self->source;
    const struct yaml_report report = { source->path, source->message,
                                        YAML_MESSAGE_MAX };

    if (source->text == NULL)
        return yaml_text_open(&self->yaml, source->files, &report);
    self->yaml = *source->text;
    self->yaml.tree.report = report;
    return 0;
}

static void edit_close(struct edit *self)
{
    if (self->source->text == NULL)
        yaml_text_close(&self->yaml);
    else
        memory_free(self->yaml.edit);
}

int move_edit_apply(const struct move_text_source *source,
                    const struct move_edit edit[], uint32_t edits,
                    struct move_text *text)
{
    struct edit self = { .source = source, .edit = edit, .edits = edits };
    int err = edit_open(&self);

    *text = (struct move_text){ .data = NULL };
    for (uint32_t i = 0; i < edits && err == 0; i++)
        err = edit_one(&self, &edit[i]);
    if (err == 0) {
        text->data = yaml_text_make(&self.yaml, &text->length);
        text->edit = self.yaml.edit;
        text->changed = self.yaml.edits;
        self.yaml.edit = NULL;
        err = move_edit_order(&self, text);
    }
    edit_close(&self);
    if (err < 0)
        move_text_free(text);
    return err;
}
