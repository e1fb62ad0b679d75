/* firmware/host/rig/sim/rig_sim_quirks.c - where a simulated CiA 402 drive is not as
 * slew's own: what is missing, cannot be written, or is shipped otherwise. */
#include "firmware/host/rig/rig_parts.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/device/object.h"

#define QUIRKS_ANY_SUB 0xFF

static int quirks_add(struct rig_sim_quirks *quirks,
                      const struct yaml_value *value, const char *name,
                      enum rig_sim_quirk_kind kind, uint32_t number)
{
    char message[OBJECT_MESSAGE_MAX];
    struct object object;

    if (name == NULL || object_find(name, NULL, &object, message) < 0)
        return yaml_value_refuse(value, "is not an object");
    if (quirks->count == RIG_SIM_QUIRKS_MAX)
        return yaml_value_refuse(value, "is one object too many");
    quirks->object[quirks->count++] = (struct rig_sim_quirk){
        .index = object.index,
        .sub = strchr(name, ':') == NULL && kind != RIG_SIM_SHIPPED
                   ? QUIRKS_ANY_SUB
                   : object.sub,
        .kind = (uint8_t)kind,
        .value = number,
    };
    return 0;
}

static int quirks_read_list(struct rig_sim_quirks *quirks,
                            const struct yaml_value *value,
                            enum rig_sim_quirk_kind kind)
{
    uint32_t count;

    if (yaml_value_list(value, 1, RIG_SIM_QUIRKS_MAX, &count) < 0)
        return -1;
    for (uint32_t at = yaml_value_node(value)->first; at != 0;
         at = value->tree->node[at].next) {
        struct yaml_value item = yaml_value_at(value, at);
        item.expected = "an object such as 6502 or 1016:1";
        const char *const name = yaml_value_text(&item);
        if (name == NULL || quirks_add(quirks, &item, name, kind, 0) < 0)
            return -1;
    }
    return 0;
}

static int quirks_read_missing(void *reader, const struct yaml_value *value,
                               void *out)
{
    (void)reader;
    return quirks_read_list(out, value, RIG_SIM_MISSING);
}

static int quirks_read_read_only(void *reader, const struct yaml_value *value,
                                 void *out)
{
    (void)reader;
    return quirks_read_list(out, value, RIG_SIM_READ_ONLY);
}

static int quirks_read_shipped(void *reader, const struct yaml_value *value,
                               void *out)
{
    const struct yaml_tree *const tree = value->tree;

    (void)reader;
    if (yaml_value_need(value, YAML_TREE_MAP) < 0)
        return -1;
    for (uint32_t key = yaml_value_node(value)->first; key != 0;
         key = tree->node[tree->node[key].next].next) {
        struct yaml_value name = yaml_value_at(value, key);
        struct yaml_value number = yaml_value_at(value, tree->node[key].next);
        int64_t is;
        name.expected = "an object such as 605A or 1016:1";
        number.expected = "a whole number of 32 bits";
        if (yaml_value_integer(&number, INT32_MIN, UINT32_MAX, &is) < 0 ||
            quirks_add(out, &name, yaml_tree_text(tree, key), RIG_SIM_SHIPPED,
                       (uint32_t)is) < 0)
            return -1;
    }
    return 0;
}

static int quirks_read_emergency(void *reader, const struct yaml_value *value,
                                 void *out)
{
    const char *const text = yaml_value_text(value);
    char *end = NULL;

    (void)reader;
    if (text == NULL)
        return -1;
    errno = 0;
    const long code = strtol(text, &end, 0); /* as manuals have it, 0x3210 */
    if (errno != 0 || end == text || *end != 0 || code < 1 || code > UINT16_MAX)
        return yaml_value_refuse(value, "'%.20s' is no error code", text);
    *(uint16_t *)out = (uint16_t)code;
    return 0;
}

static int quirks_read_boot(void *reader, const struct yaml_value *value,
                            void *out)
{
    return rig_read_time(reader, value, RIG_MS, 60000 * RIG_MS, RIG_MS, out);
}

static const struct yaml_field rig_quirks_fields[] = {
    { "missing", YAML_OPTIONAL, "a list of objects such as [6502, 1016:1]",
      quirks_read_missing, 0 },
    { "read_only", YAML_OPTIONAL, "a list of objects such as [605A]",
      quirks_read_read_only, 0 },
    { "shipped", YAML_OPTIONAL, "objects with their values, such as {605A: 0}",
      quirks_read_shipped, 0 },
    { "fixed_mapping", YAML_OPTIONAL, "yes or no", yaml_read_bool,
      offsetof(struct rig_sim_quirks, fixed_mapping) },
    { "emergency", YAML_OPTIONAL, "an error code, 0x0001 .. 0xFFFF",
      quirks_read_emergency, offsetof(struct rig_sim_quirks, emergency) },
    { "boot", YAML_OPTIONAL, "1 ms .. 60 s in whole ms", quirks_read_boot,
      offsetof(struct rig_sim_quirks, boot_ns) },
};
const struct yaml_shape rig_quirks_shape = { "quirks", rig_quirks_fields,
                                             ARRAY_LEN(rig_quirks_fields) };

int rig_read_sim_quirks(void *reader, const struct yaml_value *value, void *out)
{
    if (((struct rig_reader *)reader)->axis->kind != RIG_CIA402)
        return yaml_value_refuse(value, "is only for a cia402 drive");
    return yaml_fields_read(value, &rig_quirks_shape, reader, out);
}
