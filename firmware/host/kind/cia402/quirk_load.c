/* firmware/host/kind/cia402/quirk_load.c - see
 * firmware/host/rig/sim/quirk_load.h. */
#include "firmware/host/rig/sim/quirk_load.h"

#include <stdio.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/kind/cia402/parts.h"

/* ---- whose ---- */

static int quirk_read_title(void *reader, const struct yaml_value *value,
                            void *out)
{
    (void)reader;
    return yaml_value_copy(value, out, QUIRK_TITLE_MAX);
}

static int quirk_read_number(void *reader, const struct yaml_value *value,
                             void *out)
{
    int64_t number = 0;

    (void)reader;
    if (yaml_value_number(value, 1, UINT32_MAX, &number) < 0)
        return -1;
    *(uint32_t *)out = (uint32_t)number;
    return 0;
}

/* The vendor is known by now. */
static int quirk_read_ignore(void *reader, const struct yaml_value *value,
                             void *out)
{
    struct drive_cia402_quirk *quirk = out;

    if (quirk_read_number(reader, value, &quirk->vendor_ignore) < 0)
        return -1;
    if ((quirk->vendor & quirk->vendor_ignore) != 0)
        return yaml_value_refuse(value, "has bits of vendor");
    return 0;
}

static int quirk_read_products(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct drive_cia402_quirk *quirk = out;
    const struct yaml_tree *tree = value->tree;
    uint32_t count, node;

    if (quirk->vendor == 0)
        return yaml_value_refuse(value, "is given without vendor");
    if (yaml_value_list(value, 1, DRIVE_CIA402_QUIRK_PRODUCTS, &count) < 0)
        return -1;
    for (node = yaml_value_node(value)->first; node != 0;
         node = tree->node[node].next) {
        const struct yaml_value item = yaml_value_at(value, node);

        if (quirk_read_number(reader, &item,
                              &quirk->product[quirk->product_count]) < 0)
            return -1;
        quirk->product_count++;
    }
    return 0;
}

/* ---- what they do otherwise ---- */

static const char *const quirk_modes[] = { "csp", "ip" };

static int quirk_read_mode(void *reader, const struct yaml_value *value,
                           void *out)
{
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, quirk_modes, ARRAY_LEN(quirk_modes), &index) <
        0)
        return -1;
    *(bool *)out = index == 1;
    return 0;
}

#define QUIRK(member) offsetof(struct drive_cia402_quirk, member)

static const struct yaml_field quirk_times_fields[] = {
    { "sdo", YAML_OPTIONAL, "10 ms .. 10 s in whole ms", rig_read_answer_time,
      QUIRK(sdo_timeout_ns) },
    { "state", YAML_OPTIONAL, "100 ms .. 2 min in whole ms", rig_read_wait_time,
      QUIRK(state_timeout_ns) },
    { "brake", YAML_OPTIONAL, "100 ms .. 2 min in whole ms", rig_read_wait_time,
      QUIRK(brake_timeout_ns) },
    { "precharge", YAML_OPTIONAL, "100 ms .. 2 min in whole ms",
      rig_read_wait_time, QUIRK(precharge_timeout_ns) },
};
static const struct yaml_shape quirk_times_shape = {
    "times", quirk_times_fields, ARRAY_LEN(quirk_times_fields)
};

static int quirk_read_times(void *reader, const struct yaml_value *value,
                            void *out)
{
    return yaml_fields_read(value, &quirk_times_shape, reader, out);
}

static int quirk_read_parameters(void *reader, const struct yaml_value *value,
                                 void *out)
{
    struct drive_cia402_quirk *quirk = out;
    struct rig_objects list = { NULL, quirk->parameter, &quirk->parameter_count,
                                DRIVE_CIA402_QUIRK_PARAMETERS };

    (void)reader;
    return rig_read_objects(value, &list);
}

/* Nothing that keeps the axis safe may be waved through; a following error that
 * the drive judges by values of its own is still judged, here too. */
static int quirk_read_fixed(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct drive_cia402_quirk *quirk = out;
    struct rig_objects list = { NULL, quirk->fixed, &quirk->fixed_count,
                                DRIVE_CIA402_QUIRK_FIXED };

    (void)reader;
    if (rig_read_objects(value, &list) < 0)
        return -1;
    for (unsigned i = 0; i < quirk->fixed_count; i++)
        if (quirk->fixed[i].index != 0x6065 && quirk->fixed[i].index != 0x6066)
            return yaml_value_refuse(value, "has 0x%04X, which slew sets",
                                     quirk->fixed[i].index);
    return 0;
}

static int quirk_read_notes(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct quirk_file *file = out;
    const struct yaml_tree *tree = value->tree;
    uint32_t count, node;

    (void)reader;
    if (yaml_value_list(value, 1, QUIRK_NOTES_MAX, &count) < 0)
        return -1;
    for (node = yaml_value_node(value)->first; node != 0;
         node = tree->node[node].next) {
        const struct yaml_value item = yaml_value_at(value, node);

        if (yaml_value_copy(&item, file->note[file->note_count++],
                            QUIRK_NOTE_MAX) < 0)
            return -1;
    }
    return 0;
}

#define FILE_OF(member) offsetof(struct quirk_file, member)

static const struct yaml_field quirk_fields[] = {
    { "title", YAML_REQUIRED, "a text of at most 95 bytes", quirk_read_title,
      FILE_OF(title) },
    { "vendor", YAML_OPTIONAL, "the number in 0x1018:1, such as 0xFB",
      quirk_read_number, FILE_OF(quirk.vendor) },
    { "vendor_ignore", YAML_OPTIONAL,
      "bits of 0x1018:1 that are none of the vendor's", quirk_read_ignore,
      FILE_OF(quirk) },
    { "products", YAML_OPTIONAL,
      "a list of 1 .. 8 numbers in 0x1018:2, such as [0x65520000]",
      quirk_read_products, FILE_OF(quirk) },
    { "mode", YAML_OPTIONAL, "csp or ip", quirk_read_mode,
      FILE_OF(quirk.interpolates) },
    { "guarding", YAML_OPTIONAL, "yes, no, true or false", yaml_read_bool,
      FILE_OF(quirk.guarding) },
    { "homing_without_bit_10", YAML_OPTIONAL, "yes, no, true or false",
      yaml_read_bool, FILE_OF(quirk.homing_without_bit_10) },
    { "times", YAML_OPTIONAL, "a map with sdo, state, brake and precharge",
      quirk_read_times, FILE_OF(quirk) },
    { "options", YAML_OPTIONAL,
      "a map with quick_stop, shutdown, disable, halt and fault",
      rig_read_options, FILE_OF(quirk.option) },
    { "parameters", YAML_OPTIONAL,
      "a map of objects and their values, such as {3006:3D: 1 u16}",
      quirk_read_parameters, FILE_OF(quirk) },
    { "fixed", YAML_OPTIONAL, "a map of 6065, 6066 and their values",
      quirk_read_fixed, FILE_OF(quirk) },
    { "notes", YAML_OPTIONAL, "a list of 1 .. 8 texts of at most 191 bytes",
      quirk_read_notes, 0 },
};
static const struct yaml_shape quirk_shape = { "quirks", quirk_fields,
                                               ARRAY_LEN(quirk_fields) };

const struct yaml_shape *const quirk_shapes[] = {
    &quirk_shape,
    &quirk_times_shape,
    &rig_option_shape,
    NULL,
};
const struct yaml_words quirk_words[] = {
    { "quirks.mode", quirk_modes, ARRAY_LEN(quirk_modes) },
    { NULL, NULL, 0 },
};

int quirk_load(const struct files *files, const char *path,
               struct quirk_file *file, char *message)
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct rig_reader reader = { .rig = NULL };
    struct yaml_tree tree;
    int err;

    *file = (struct quirk_file){ .note_count = 0 };
    if (yaml_tree_load(files, &tree, &report) < 0)
        return -1;
    const struct yaml_value root = { &tree, 0, "the quirks",
                                     "a map with title, vendor and products" };
    err = yaml_fields_read(&root, &quirk_shape, &reader, file);
    yaml_tree_free(&tree);
    return err;
}

/* ---- those that come with slew ---- */

static int quirk_load_own(const struct files *files, struct quirk_set *set,
                          const char *name, char *message)
{
    struct quirk_file file;
    char path[FILES_PATH_MAX];

    if (!files->find(files, FILES_QUIRKS, name, "", path)) {
        snprintf(message, YAML_MESSAGE_MAX,
                 "%s.yaml of " FILES_QUIRKS " cannot be read", name);
        return -1;
    }
    if (quirk_load(files, path, &file, message) < 0)
        return -1;
    set->quirk[set->count++] = file.quirk;
    return 0;
}

const struct quirk_set *quirk_own(const struct files *files, char *message)
{
    static struct quirk_set *own;
    struct quirk_set *set;
    unsigned count;

    if (own != NULL)
        return own;
    set = memory_new(1, sizeof *set);
    count = files->names(files, FILES_QUIRKS, set->name);
    set->count = 0;
    for (unsigned i = 0; i < count; i++)
        if (quirk_load_own(files, set, set->name[i], message) < 0) {
            memory_free(set);
            return NULL;
        }
    own = set;
    return own;
}
