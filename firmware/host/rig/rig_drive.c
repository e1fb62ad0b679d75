/* firmware/host/rig/rig_drive.c - an axis's drive. */
#include "firmware/host/rig/rig_parts.h"

#include <string.h>

#include "firmware/host/yaml/yaml_units.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

int rig_read_drive_kind(void *reader, const struct yaml_value *value, void *out)
{
    unsigned index;
    (void)reader;
    if (yaml_value_choice(value, rig_drive_kinds, RIG_DRIVE_KINDS, &index) < 0)
        return -1;
    *(enum rig_drive_kind *)out = (enum rig_drive_kind)index;
    return 0;
}

static const char *rig_bus_rates_text(const struct rig_bus *bus)
{
    if (bus->kind != RIG_CAN)
        return bus->modbus.line.is_ascii ? " with framing: ascii" : "";
    return bus->data_bit_rate > 0 ? " with FD frames" : " without FD frames";
}

int rig_read_drive_bus(void *reader, const struct yaml_value *value, void *out)
{
    const struct rig *rig = ((struct rig_reader *)reader)->rig;
    const char *names[RIG_BUSES_MAX];
    unsigned index;

    if (rig->bus_count == 0)
        return yaml_value_refuse(value, "is none, as the rig has no 'buses'");
    for (uint32_t i = 0; i < rig->bus_count; i++)
        names[i] = rig->bus[i].name;
    if (yaml_value_choice(value, names, rig->bus_count, &index) < 0)
        return -1;
    *(uint32_t *)out = index;
    if (!rig_kinds[((struct rig_reader *)reader)->axis->kind]->is_for(
            &rig->bus[index]))
        return yaml_value_refuse(value,
                                 "%s is a %s bus%s, not one for this kind "
                                 "of drive",
                                 names[index],
                                 rig_bus_kinds[rig->bus[index].kind],
                                 rig_bus_rates_text(&rig->bus[index]));
    return 0;
}

int rig_read_drive_node(void *reader, const struct yaml_value *value, void *out)
{
    struct rig_reader *self = reader;
    const struct rig_axis *axis = self->axis;
    const struct rig_bus *bus = &self->rig->bus[axis->bus];

    if (rig_read_node_id(reader, value, out) < 0)
        return -1;
    if (bus->kind == RIG_CANOPEN && axis->node_id == bus->node_id)
        return yaml_value_refuse(value, "%u is our own on bus %s",
                                 axis->node_id, bus->name);
    return rig_claim_drive(self, value);
}

static int rig_read_counts_num(void *reader, const struct yaml_value *value,
                               void *out)
{
    char quote[YAML_QUOTE_MAX];
    (void)reader;
    if (yaml_value_integer(value, -INT64_MAX, INT64_MAX, out) < 0)
        return -1;
    if (*(int64_t *)out == 0)
        return yaml_value_refuse(value, "%s is zero",
                                 yaml_value_quote(quote, value));
    return 0;
}

static int rig_read_counts_den(void *reader, const struct yaml_value *value,
                               void *out)
{
    (void)reader;
    return yaml_value_integer(value, 1, INT64_MAX, out);
}

static const struct yaml_field rig_counts_fields[] = {
    { "num", YAML_REQUIRED,
      "a whole number of counts, negative for a reversed "
      "axis",
      rig_read_counts_num, offsetof(struct rig_axis, counts_num) },
    { "den", YAML_OPTIONAL, "the whole number of units they are for",
      rig_read_counts_den, offsetof(struct rig_axis, counts_den) },
};
const struct yaml_shape rig_counts_shape = { "counts", rig_counts_fields,
                                             ARRAY_LEN(rig_counts_fields) };

/* They fit when they do in Q32.32 after the conversion. */
bool rig_counts_fit(const struct rig_axis *axis)
{
    int64_t counts_q32;
    return motion_fixed_muldiv(axis->limit.pos_min_q32, axis->counts_num,
                               axis->counts_den, &counts_q32) == MOTION_OK &&
           motion_fixed_muldiv(axis->limit.pos_max_q32, axis->counts_num,
                               axis->counts_den, &counts_q32) == MOTION_OK;
}

int rig_read_ratio(struct rig_reader *reader, const struct yaml_value *value,
                   struct rig_axis *axis)
{
    const bool is_map = yaml_value_node(value)->kind == YAML_TREE_MAP;

    axis->counts_den = 1;
    return is_map ? yaml_fields_read(value, &rig_counts_shape, reader, axis)
                  : yaml_units_read_counts(value, axis->unit, &axis->counts_num,
                                           &axis->counts_den);
}

int rig_read_counts(void *reader, const struct yaml_value *value, void *out)
{
    struct rig_axis *axis = out;

    if (rig_read_ratio(reader, value, axis) < 0)
        return -1;
    if (!rig_counts_fit(axis))
        return yaml_value_refuse(value, "gives more than 2147483647 counts at "
                                        "the end of the axis");
    return 0;
}

const char *rig_kind_of(const struct yaml_value *value)
{
    const struct yaml_tree *tree = value->tree;

    if (yaml_value_node(value)->kind != YAML_TREE_MAP)
        return "";
    for (uint32_t key = yaml_value_node(value)->first; key != 0;
         key = tree->node[tree->node[key].next].next)
        if (strcmp(yaml_tree_text(tree, key), "kind") == 0 &&
            tree->node[tree->node[key].next].kind == YAML_TREE_TEXT)
            return yaml_tree_text(tree, tree->node[key].next);
    return "";
}

int rig_read_pairs(const struct yaml_value *value, const unsigned *count,
                   unsigned most, void *of,
                   int (*read)(void *of, const struct yaml_value *key,
                               const struct yaml_value *value))
{
    const struct yaml_tree *tree = value->tree;

    if (yaml_value_need(value, YAML_TREE_MAP) < 0)
        return -1;
    for (uint32_t key = yaml_value_node(value)->first; key != 0;
         key = tree->node[tree->node[key].next].next) {
        const struct yaml_value name = {
            tree, key, yaml_tree_text(tree, key),
            "an object such as 6065 or 607D:1, or its name"
        };
        const struct yaml_value number = {
            tree, tree->node[key].next, yaml_tree_text(tree, key),
            "a whole number, such as 20000 or 0x1F u16"
        };

        if (*count == most)
            return yaml_value_refuse(&name, "is one of more than %u", most);
        if (read(of, &name, &number) < 0)
            return -1;
    }
    return 0;
}

/* The first says what is wrong with a word that is no kind. */
int rig_read_drive(void *reader, const struct yaml_value *value, void *out)
{
    const char *word = rig_kind_of(value);
    unsigned kind = RIG_DRIVE_KINDS - 1;

    while (kind > 0 && strcmp(word, rig_drive_kinds[kind]) != 0)
        kind--;
    return rig_kinds[kind]->read(reader, value, out);
}
