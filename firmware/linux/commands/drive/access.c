/* firmware/linux/commands/drive/access.c - slew drive get, set and store. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/error.h"
#include "firmware/host/base/json.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/yaml/yaml_fields.h"
#include "firmware/linux/commands/drive/verbs.h"
#include "hal/drive/moteus/frame.h"
#include "motion/core/err.h"

#define ACCESS_VALUES   OPTIONS_PATHS_MAX
#define ACCESS_STORE    0x1010
#define ACCESS_SAVE     UINT32_C(0x65766173) /* "save", CiA 301 7.5.2.13 */
#define ACCESS_STORE_NS INT64_C(5000000000)
#define ACCESS_CONTROL  0x6040

/* One of them, by the kind of drive. */
struct access_what {
    struct object object;
    struct quantity quantity;
    const struct modbus_map_item *item;
    struct modbus_map_item raw;
};

/* ---- what is meant ---- */

static const char *access_item_list(const struct modbus_map *map,
                                    const char *text, const char **near)
{
    static const char *name[MODBUS_MAP_ITEMS_MAX];
    static char list[QUOTE_LIST_MAX];

    for (unsigned i = 0; i < map->item_count; i++)
        name[i] = map->item[i].name;
    *near = yaml_nearest(text, name, map->item_count);
    return quote_list(list, name, map->item_count);
}

/* An address, read and written as one register or two. */
static bool access_address(const char *text, const struct options *options,
                           struct access_what *what)
{
    static const struct {
        const char *word;
        enum modbus_map_type type;
    } types[] = { { "u16", MODBUS_U16 },
                  { "i16", MODBUS_I16 },
                  { "u32", MODBUS_U32 },
                  { "i32", MODBUS_I32 },
                  { "f32", MODBUS_F32 } };
    char *end;
    const unsigned long at = strtoul(text, &end, 0);

    if (end == text || *end != '\0' || at > UINT16_MAX)
        return false;
    what->raw = (struct modbus_map_item){ .at = (uint16_t)at,
                                          .read = HAL_MODBUS_READ,
                                          .type = MODBUS_U16 };
    for (size_t i = 0; i < ARRAY_LEN(types); i++)
        if (options->type != NULL && strcmp(options->type, types[i].word) == 0)
            what->raw.type = types[i].type;
    what->raw.write = modbus_map_registers(what->raw.type) == 1
                          ? HAL_MODBUS_WRITE
                          : HAL_MODBUS_WRITE_MANY;
    what->item = &what->raw;
    return true;
}

static int access_register(const struct talk *talk, const char *text,
                           const struct options *options,
                           struct access_what *what)
{
    const char *near, *list;

    if (access_address(text, options, what))
        return 0;
    for (unsigned i = 0; talk->map != NULL && i < talk->map->item_count; i++)
        if (strcmp(talk->map->item[i].name, text) == 0) {
            what->item = &talk->map->item[i];
            return 0;
        }
    if (talk->map == NULL) {
        error_say("slew drive: '%.40s' is no address, expected one such "
                  "as 0x6002, or --map",
                  text);
        return -1;
    }
    list = access_item_list(talk->map, text, &near);
    error_say("slew drive: the map has no register '%.40s', expected an "
              "address, or %s%s%s%s",
              text, list, near == NULL ? "" : " (did you mean '",
              near == NULL ? "" : near, near == NULL ? "" : "'?)");
    return -1;
}

static enum status access_object(const struct talk *talk, const char *text,
                                 const struct options *options,
                                 struct access_what *what)
{
    char message[OBJECT_MESSAGE_MAX];

    if (object_find(text, talk->eds, &what->object, message) < 0)
        return drive_complain(message);
    if (what->object.type == OBJECT_UNKNOWN && options->type != NULL &&
        !object_type_of(options->type, &what->object.type))
        return drive_complain("--type: expected u8, i8, u16, i16, u32 or i32");
    return STATUS_OK;
}

static enum status access_find(struct talk *talk, const char *text,
                               const struct options *options,
                               struct access_what *what)
{
    if (talk_is_turns(talk))
        return drive_find_quantity(talk, text, options, &what->quantity);
    if (talk->kind == TALK_CANOPEN)
        return access_object(talk, text, options, what);
    return access_register(talk, text, options, what) < 0 ? STATUS_INPUT
                                                          : STATUS_OK;
}

static void access_read(struct talk *talk, const struct access_what *what,
                        struct drive_value *value)
{
    if (talk_is_turns(talk))
        drive_read_quantity(talk, &what->quantity, value);
    else if (talk->kind == TALK_MODBUS)
        drive_read_item(talk, what->item, value);
    else
        drive_read_object(talk, &what->object, value);
}

/* ---- get ---- */

static enum status access_show(const struct options *options,
                               const struct talk *talk,
                               const struct drive_value *value, unsigned count)
{
    bool bad = false;

    for (unsigned i = 0; i < count; i++)
        bad = bad || value[i].error[0] != '\0';
    if (options->json) {
        cJSON *report = cJSON_CreateObject();

        cJSON_AddBoolToObject(report, "ok", !bad);
        cJSON_AddStringToObject(report, "drive", talk->label);
        cJSON_AddItemToObject(report, "values",
                              drive_values_json(value, count));
        json_print(report, stdout);
    } else {
        drive_values_print(value, count);
    }
    return bad ? STATUS_REFUSED : STATUS_OK;
}

enum status drive_get(const struct options *options)
{
    static struct access_what what[ACCESS_VALUES];
    static struct drive_value value[ACCESS_VALUES];
    const unsigned count = (unsigned)options->path_count - 3;
    struct talk *talk;
    enum status status = drive_open(options, &talk);

    if (status != STATUS_OK)
        return status;
    for (unsigned i = 0; i < count && status == STATUS_OK; i++)
        status = access_find(talk, options->path[3 + i], options, &what[i]);
    for (unsigned i = 0; i < count && status == STATUS_OK; i++)
        access_read(talk, &what[i], &value[i]);
    if (status == STATUS_OK)
        status = access_show(options, talk, value, count);
    drive_close(talk);
    return status;
}

/* ---- set ---- */

/* Nobody knows how long it is: as long as what the drive answers. */
static void access_guess(struct talk *talk, struct object *object)
{
    static const uint8_t type[] = { 0, OBJECT_U8, OBJECT_U16, OBJECT_U32,
                                    OBJECT_U32 };
    uint32_t raw;
    uint8_t size = 0;

    if (object->type == OBJECT_UNKNOWN &&
        ask_can_read_number(&talk->can, object->index, object->sub, &raw,
                            &size) == MOTION_OK &&
        size < sizeof type)
        object->type = type[size];
}

static enum status access_parse_quantity(const struct quantity *quantity,
                                         const char *text, int64_t *value)
{
    char message[QUANTITY_MESSAGE_MAX];
    uint32_t raw = 0;

    if (quantity_parse(quantity, text, &raw, message) < 0)
        return drive_complain(message);
    *value = quantity_value(quantity->type, raw);
    return STATUS_OK;
}

static enum status access_parse(struct talk *talk, const char *text,
                                struct access_what *what, int64_t *value)
{
    char message[OBJECT_MESSAGE_MAX];
    int64_t min, max;
    char *end;

    if (talk_is_turns(talk))
        return access_parse_quantity(&what->quantity, text, value);
    if (talk->kind == TALK_CANOPEN) {
        access_guess(talk, &what->object);
        return object_parse(&what->object, text, value, message) == 0
                   ? STATUS_OK
                   : drive_complain(message);
    }
    *value = strtoll(text, &end, 0);
    modbus_map_range(what->item->type, &min, &max);
    if (end != text && *end == '\0' && *value >= min && *value <= max)
        return STATUS_OK;
    error_say("slew drive: '%.40s' is not a value, expected %" PRId64
              " .. %" PRId64,
              text, min, max);
    return STATUS_INPUT;
}

static int access_write(struct talk *talk, const struct access_what *what,
                        int64_t value)
{
    if (talk_is_turns(talk))
        return ask_turns_write(&talk->turns, &what->quantity, (uint32_t)value);
    if (talk->kind == TALK_MODBUS)
        return ask_modbus_write_item(&talk->line, what->item, value);
    return ask_can_write_number(
        &talk->can, what->object.index, what->object.sub,
        (uint8_t)object_type_size(what->object.type), (uint32_t)value);
}

/* What is only ever written cannot be read back. */
static bool access_is_silent(const struct talk *talk,
                             const struct access_what *what)
{
    if (talk_is_turns(talk))
        return !what->quantity.readable;
    return talk->kind == TALK_CANOPEN && what->object.in_eds &&
           !what->object.readable;
}

static enum status access_verify(struct talk *talk,
                                 const struct access_what *what, int64_t value,
                                 const struct options *options)
{
    static struct drive_value back;

    if (access_is_silent(talk, what)) {
        printf("%s: written; it cannot be read back\n", talk->label);
        return STATUS_OK;
    }
    access_read(talk, what, &back);
    const enum status status = access_show(options, talk, &back, 1);

    if (status != STATUS_OK || back.value == value)
        return status;
    error_say("slew drive: %s: %s reads back %" PRId64 ", expected %" PRId64,
              talk->label, back.number, back.value, value);
    return STATUS_REFUSED;
}

/* Takes a drive seconds: its memory is erased first. */
static enum status access_store(struct talk *talk)
{
    int err;

    if (talk->kind == TALK_MODBUS)
        return drive_complain("a Modbus drive stores by a register of its own: "
                              "see its manual, and slew drive set");
    if (talk_is_turns(talk))
        return drive_complain("it is stored by its maker's program: odrivetool "
                              "save_configuration, moteus_tool conf write");
    talk->can.timeout_ns = ACCESS_STORE_NS;
    (void)ask_can_node(&talk->can, talk->node);
    err = ask_can_write_number(&talk->can, ACCESS_STORE, 1, 4, ACCESS_SAVE);
    return err < 0 ? drive_failed(talk, "cannot store (1010:1)", err)
                   : STATUS_OK;
}

/* "6065 20000" or "6065=20000"; a negative one only so, or after --. */
static const char *access_words(const struct options *options, char *name,
                                size_t room)
{
    const char *first = options->path[3], *equals = strchr(first, '=');
    const size_t length =
        equals == NULL ? strlen(first) : (size_t)(equals - first);

    if ((equals == NULL) != (options->path_count == 5) || length >= room)
        return NULL;
    memcpy(name, first, length);
    name[length] = '\0';
    return equals == NULL ? options->path[4] : equals + 1;
}

/* The controlword, the mode of a moteus. */
static bool access_moves(const struct talk *talk,
                         const struct access_what *what)
{
    return talk->kind == TALK_CANOPEN
               ? what->object.index == ACCESS_CONTROL
               : talk->kind == TALK_MOTEUS && what->quantity.at == MOTEUS_MODE;
}

static enum status access_set(struct talk *talk, const struct options *options)
{
    static struct access_what what;
    char name[OBJECT_MESSAGE_MAX];
    const char *text = access_words(options, name, sizeof name);
    enum status status;
    int64_t value = 0;
    int err;

    if (text == NULL)
        return drive_complain("set: expected an object or register and its "
                              "value, such as 6065 20000 or 607D:1=-2000");
    status = access_find(talk, name, options, &what);
    if (status != STATUS_OK)
        return status;
    if (access_moves(talk, &what))
        return drive_complain("that moves drives: slew run and slew drive "
                              "reset write it");
    if (talk_is_turns(talk) && !what.quantity.writable)
        return drive_complain("that is for reading only");
    status = drive_must_be_off(talk, options);
    if (status == STATUS_OK)
        status = access_parse(talk, text, &what, &value);
    if (status != STATUS_OK)
        return status;
    err = access_write(talk, &what, value);
    if (err < 0)
        return drive_failed(talk, name, err);
    status = access_verify(talk, &what, value, options);
    return status == STATUS_OK && options->store ? access_store(talk) : status;
}

enum status drive_set(const struct options *options)
{
    struct talk *talk;
    enum status status = drive_open(options, &talk);

    if (status != STATUS_OK)
        return status;
    status = access_set(talk, options);
    drive_close(talk);
    return status;
}

enum status drive_store(const struct options *options)
{
    struct talk *talk;
    enum status status = drive_open(options, &talk);

    if (status != STATUS_OK)
        return status;
    status = drive_must_be_off(talk, options);
    if (status == STATUS_OK)
        status = access_store(talk);
    if (status == STATUS_OK)
        printf("%s: stored\n", talk->label);
    drive_close(talk);
    return status;
}
