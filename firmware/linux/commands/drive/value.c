/* firmware/linux/commands/drive/value.c - what was read, and
 * showing it; see verbs.h. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/json.h"
#include "firmware/host/base/table.h"
#include "firmware/linux/commands/drive/verbs.h"

/* "= 12.5 mm" for what the drive counts, of an axis whose gear is known. */
void drive_value_in_units(const struct rig_axis *axis,
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
