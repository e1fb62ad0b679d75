/* firmware/host/rig/rig_map.c - units on Modbus lines and their register maps;
 * see rig_parts.h. */
#include "firmware/host/rig/rig_parts.h"

#include <string.h>

#include "firmware/host/device/modbus_map_load.h"

int rig_read_unit_number(void *reader, const struct yaml_value *value,
                         void *out)
{
    int64_t number = 0;

    if (yaml_value_integer(value, 1, 247, &number) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)number;
    return rig_claim_drive(reader, value);
}

/* Every file once. */
static int rig_load_map(const struct rig_reader *self,
                        const struct yaml_value *value, const char *path,
                        uint32_t *index)
{
    struct rig *rig = self->rig;
    const struct yaml_report *report = &value->tree->report;

    for (*index = 0; *index < rig->map_count; ++*index)
        if (strcmp(rig->map_path[*index], path) == 0)
            return 0;
    if (strlen(path) >= RIG_PATH_MAX)
        return yaml_value_refuse(value, "has too long a path");
    rig->map = memory_pool_more(&rig->memory, rig->map, rig->map_count,
                                sizeof *rig->map);
    rig->map_path = memory_pool_more(&rig->memory, rig->map_path,
                                     rig->map_count, sizeof *rig->map_path);
    memcpy(rig->map_path[*index], path, strlen(path) + 1);
    if (modbus_map_load(files_regular(self->files), path, &rig->map[*index],
                        report->message) < 0)
        return -1;
    rig->map_count++;
    return 0;
}

int rig_read_map(void *reader, const struct yaml_value *value, void *out)
{
    const struct files *files = ((struct rig_reader *)reader)->files;
    const char *name = yaml_value_text(value);
    char path[FILES_PATH_MAX], quote[YAML_QUOTE_MAX];

    if (name == NULL)
        return -1;
    if (!files->find(files, FILES_MAPS, name, value->tree->report.path, path))
        return yaml_value_refuse(value,
                                 "%s is not a register map that can be read",
                                 yaml_value_quote(quote, value));
    return rig_load_map(reader, value, path, out);
}
