/* firmware/linux/kind/modbus/verbs.c - slew drive for a Modbus servo: see
 * firmware/linux/commands/drive/kind.h. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/yaml/yaml_fields.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/drive/kind.h"
#include "motion/core/err.h"

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
                           struct drive_what *what)
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

static int access_register(const struct session *session, const char *text,
                           const struct options *options,
                           struct drive_what *what)
{
    const char *near, *list;

    if (access_address(text, options, what))
        return 0;
    for (unsigned i = 0; session->map != NULL && i < session->map->item_count;
         i++)
        if (strcmp(session->map->item[i].name, text) == 0) {
            what->item = &session->map->item[i];
            return 0;
        }
    if (session->map == NULL) {
        error_say("slew drive: '%.40s' is no address, expected one such "
                  "as 0x6002, or --map",
                  text);
        return -1;
    }
    list = access_item_list(session->map, text, &near);
    error_say("slew drive: the map has no register '%.40s', expected an "
              "address, or %s%s%s%s",
              text, list, near == NULL ? "" : " (did you mean '",
              near == NULL ? "" : near, near == NULL ? "" : "'?)");
    return -1;
}

static enum status modbus_find(struct session *session, const char *text,
                               const struct options *options,
                               struct drive_what *what)
{
    return access_register(session, text, options, what) < 0 ? STATUS_INPUT
                                                             : STATUS_OK;
}

/* ---- values ---- */

static const char *const value_item_type[] = {
    [MODBUS_U16] = "u16", [MODBUS_I16] = "i16", [MODBUS_U32] = "u32",
    [MODBUS_I32] = "i32", [MODBUS_F32] = "f32", [MODBUS_BIT] = "bit"
};

/* What of the map's conditions on this register is met. */
static void value_conditions(const struct modbus_map *map, uint8_t item,
                             struct drive_value *value)
{
    static const char *const name[] = {
#define VALUE_STATUS(word) #word,
        MODBUS_MAP_STATUS_LIST(VALUE_STATUS)
#undef VALUE_STATUS
    };
    for (unsigned i = 0; i < MODBUS_STATUS_COUNT; i++) {
        const size_t used = strlen(value->text);

        if (map->status[i].item == item &&
            modbus_map_meets(&map->status[i], value->value))
            snprintf(value->text + used, sizeof value->text - used, "%s%s",
                     used > 0 ? ", " : "", name[i]);
    }
}

static void value_item_words(const struct session *session,
                             const struct modbus_map_item *item,
                             struct drive_value *value)
{
    const struct modbus_map *map = session->map;
    const char *alarm;

    if (map == NULL || item < map->item || item >= map->item + map->item_count)
        return;
    const uint8_t at = (uint8_t)(item - map->item);
    value_conditions(map, at, value);
    if (at == map->position)
        snprintf(value->unit, sizeof value->unit, "counts");
    drive_value_in_units(session->axis, value);
    if (at != map->alarm || value->value == 0)
        return;
    alarm = modbus_map_alarm_text(map, (uint32_t)value->value);
    snprintf(value->text, sizeof value->text, "%s",
             alarm == NULL ? "an alarm that is not in the map" : alarm);
}

static void modbus_read_item(struct session *session,
                             const struct modbus_map_item *item,
                             struct drive_value *value)
{
    int err;

    *value = (struct drive_value){ .is_number = true };
    snprintf(value->number, sizeof value->number, "0x%04X", item->at);
    snprintf(value->name, sizeof value->name, "%s", item->name);
    snprintf(value->type, sizeof value->type, "%s",
             value_item_type[item->type]);
    err = modbus_client_read_item(&session->line, item, &value->value);
    if (err < 0)
        session_text(session, err, value->error);
    else
        value_item_words(session, item, value);
}

static void modbus_read(struct session *session, const struct drive_what *what,
                        struct drive_value *value)
{
    modbus_read_item(session, what->item, value);
}

static enum status modbus_parse(struct session *session, const char *text,
                                struct drive_what *what, int64_t *value)
{
    int64_t min, max;
    char *end;

    (void)session;
    *value = strtoll(text, &end, 0);
    modbus_map_range(what->item->type, &min, &max);
    if (end != text && *end == '\0' && *value >= min && *value <= max)
        return STATUS_OK;
    error_say("slew drive: '%.40s' is not a value, expected %" PRId64
              " .. %" PRId64,
              text, min, max);
    return STATUS_INPUT;
}

static int modbus_write(struct session *session, const struct drive_what *what,
                        int64_t value)
{
    return modbus_client_write_item(&session->line, what->item, value);
}

static enum status modbus_store(struct session *session)
{
    (void)session;
    return drive_complain("a Modbus drive stores by a register of its own: "
                          "see its manual, and slew drive set");
}

static enum status modbus_info(struct session *session, struct drive_info *info)
{
    if (session->map == NULL)
        return drive_complain("expected --map: without one nothing can be "
                              "read from a Modbus drive");
    for (unsigned i = 0; i < session->map->item_count; i++)
        modbus_read_item(session, &session->map->item[i],
                         &info->value[info->count++]);
    info->ok = info->value[session->map->position].error[0] == '\0';
    return STATUS_OK;
}

const struct verb_kind verb_kind_modbus = {
    .find = modbus_find,
    .read = modbus_read,
    .parse = modbus_parse,
    .write = modbus_write,
    .store = modbus_store,
    .info = modbus_info,
};
