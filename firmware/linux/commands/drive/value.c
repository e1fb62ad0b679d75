/* firmware/linux/commands/drive/value.c - reading objects and registers, and
 * showing them; see verbs.h. */
#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/json.h"
#include "firmware/host/base/table.h"
#include "firmware/linux/commands/drive/verbs.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define VALUE_BYTES 128

/* ---- CANopen ---- */

/* "= 12.5 mm" for what the drive counts, of an axis whose gear is known. */
static void value_in_units(const struct rig_axis *axis,
                           struct drive_value *value)
{
    const size_t used = strlen(value->text);

    if (axis == NULL || strncmp(value->unit, "counts", 6) != 0)
        return;
    snprintf(value->text + used, sizeof value->text - used, "%s%.6g %s%s",
             used > 0 ? ", " : "",
             (double)value->value * (double)axis->counts_den /
                 (double)axis->counts_num,
             units_axis_text(axis->unit), value->unit + strlen("counts"));
}

static void value_take_text(struct drive_value *value, const uint8_t *bytes,
                            uint32_t length)
{
    uint32_t i = 0;

    for (; i < length && i < sizeof value->text - 1 && bytes[i] != 0; i++)
        value->text[i] = isprint(bytes[i]) ? (char)bytes[i] : '?';
    value->text[i] = '\0';
}

/* What is neither a quantity nor small is a code or bits. */
static void value_in_hex(const struct object *object, struct drive_value *value)
{
    const size_t used = strlen(value->text);

    if (object->unit[0] == '\0' && value->value > 9)
        snprintf(value->text + used, sizeof value->text - used, "%s0x%" PRIX64,
                 used > 0 ? ", " : "", value->value);
}

static void value_take(const struct rig_axis *axis, const struct object *object,
                       const uint8_t *bytes, uint32_t length,
                       struct drive_value *value)
{
    uint32_t raw = 0;

    if (object->type == OBJECT_TEXT || length > 4) {
        value_take_text(value, bytes, length);
        return;
    }
    for (uint32_t i = 0; i < length; i++)
        raw |= (uint32_t)bytes[i] << 8 * i;
    value->is_number = length > 0;
    value->value = object_value(object->type, length, raw);
    object_words(object, value->value, value->text);
    value_in_hex(object, value);
    value_in_units(axis, value);
}

static void value_type(const struct object *object, uint32_t length,
                       struct drive_value *value)
{
    const char *type = object_type_text(object->type);

    if (type[0] != '\0')
        snprintf(value->type, sizeof value->type, "%s", type);
    else if (length > 0 && length <= 4)
        snprintf(value->type, sizeof value->type, "u%u", 8 * length);
}

void drive_read_object_of(struct talk *talk, const struct rig_axis *axis,
                          const struct object *object, uint16_t index,
                          struct drive_value *value)
{
    struct object there = *object;
    uint8_t bytes[VALUE_BYTES] = { 0 };
    uint32_t length = 0;
    const int err = ask_can_read(&talk->can, index, object->sub, bytes,
                                 sizeof bytes, &length);

    there.index = index;
    *value = (struct drive_value){ .is_number = false };
    object_number(&there, value->number);
    snprintf(value->name, sizeof value->name, "%s", object->name);
    snprintf(value->unit, sizeof value->unit, "%s", object->unit);
    if (err < 0) {
        talk_text(talk, err, value->error);
        return;
    }
    value_type(object, length, value);
    value_take(axis, object, bytes, length, value);
}

void drive_read_object(struct talk *talk, const struct object *object,
                       struct drive_value *value)
{
    drive_read_object_of(talk, talk->axis, object, object->index, value);
}

/* ---- Modbus ---- */

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

static void value_item_words(const struct talk *talk,
                             const struct modbus_map_item *item,
                             struct drive_value *value)
{
    const struct modbus_map *map = talk->map;
    const char *alarm;

    if (map == NULL || item < map->item || item >= map->item + map->item_count)
        return;
    const uint8_t at = (uint8_t)(item - map->item);
    value_conditions(map, at, value);
    if (at == map->position)
        snprintf(value->unit, sizeof value->unit, "counts");
    value_in_units(talk->axis, value);
    if (at != map->alarm || value->value == 0)
        return;
    alarm = modbus_map_alarm_text(map, (uint32_t)value->value);
    snprintf(value->text, sizeof value->text, "%s",
             alarm == NULL ? "an alarm that the map does not know" : alarm);
}

void drive_read_item(struct talk *talk, const struct modbus_map_item *item,
                     struct drive_value *value)
{
    int err;

    *value = (struct drive_value){ .is_number = true };
    snprintf(value->number, sizeof value->number, "0x%04X", item->at);
    snprintf(value->name, sizeof value->name, "%s", item->name);
    snprintf(value->type, sizeof value->type, "%s",
             value_item_type[item->type]);
    err = ask_modbus_read_item(&talk->line, item, &value->value);
    if (err < 0)
        talk_text(talk, err, value->error);
    else
        value_item_words(talk, item, value);
}

/* ---- ODrive, moteus ---- */

/* "= 12.5 mm" for turns, of an axis whose gear is known. */
static void value_turns_in_units(const struct talk *talk,
                                 struct drive_value *value)
{
    int64_t num, den;

    if (talk->axis == NULL || strncmp(value->unit, "turns", 5) != 0)
        return;
    rig_axis_turns(talk->axis, &num, &den);
    snprintf(value->text, sizeof value->text, "%.6g %s%s",
             value->real * (double)den / (double)num,
             units_axis_text(talk->axis->unit), value->unit + strlen("turns"));
}

void drive_read_quantity(struct talk *talk, const struct quantity *quantity,
                         struct drive_value *value)
{
    uint32_t raw = 0;
    float real;
    int err;

    *value = (struct drive_value){ .is_number = true,
                                   .is_real = quantity->type == QUANTITY_F32 };
    quantity_number(quantity, value->number);
    snprintf(value->name, sizeof value->name, "%s", quantity->name);
    snprintf(value->type, sizeof value->type, "%s",
             quantity_type_text(quantity->type));
    snprintf(value->unit, sizeof value->unit, "%s", quantity->unit);
    err = ask_turns_read(&talk->turns, quantity, &raw);
    if (err < 0) {
        talk_text(talk, err, value->error);
        return;
    }
    value->value = quantity_value(quantity->type, raw);
    memcpy(&real, &raw, sizeof real);
    value->real = value->is_real ? (double)real : 0;
    if (quantity->words != NULL)
        snprintf(value->text, sizeof value->text, "%s",
                 quantity->words((unsigned)value->value));
    if (value->is_real)
        value_turns_in_units(talk, value);
}

/* ---- showing them ---- */

void drive_values_print(const struct drive_value *value, unsigned count)
{
    static const char *const head[] = { "<number", "<name", "<type",
                                        ">value",  "<unit", "<" };
    struct table table;

    table_init(&table, ARRAY_LEN(head), head);
    for (unsigned i = 0; i < count; i++) {
        const struct drive_value *row = &value[i];

        table_cell(&table, "%s", row->number);
        table_cell(&table, "%.40s", row->name);
        table_cell(&table, "%s", row->type);
        if (row->error[0] == '\0' && row->is_real)
            table_cell(&table, "%.7g", row->real);
        else if (row->error[0] == '\0' && row->is_number)
            table_cell(&table, "%" PRId64, row->value);
        else
            table_cell(&table, "-");
        table_cell(&table, "%s", row->unit);
        table_cell(&table, "%.60s",
                   row->error[0] != '\0' ? row->error : row->text);
    }
    table_print(&table, stdout);
    table_free(&table);
}

cJSON *drive_values_json(const struct drive_value *value, unsigned count)
{
    cJSON *list = cJSON_CreateArray();

    for (unsigned i = 0; i < count; i++) {
        const struct drive_value *row = &value[i];
        cJSON *object = cJSON_CreateObject();

        cJSON_AddStringToObject(object, "number", row->number);
        cJSON_AddStringToObject(object, "name", row->name);
        if (row->error[0] != '\0') {
            cJSON_AddStringToObject(object, "error", row->error);
        } else {
            cJSON_AddStringToObject(object, "type", row->type);
            if (row->is_real)
                cJSON_AddNumberToObject(object, "value", row->real);
            else if (row->is_number)
                json_add_integer(object, "value", row->value);
            cJSON_AddStringToObject(object, "unit", row->unit);
            cJSON_AddStringToObject(object, "text", row->text);
        }
        cJSON_AddItemToArray(list, object);
    }
    return list;
}
