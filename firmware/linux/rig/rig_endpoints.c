/* firmware/linux/rig/rig_endpoints.c - ODrive's list of its parameters,
 * flat_endpoints.json: {"endpoints": {"axis0.config.x": {"id": 123, ...}}}. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <string.h>

#include "firmware/linux/base/memory.h"
#include "firmware/linux/rig/rig_parts.h"

/* That of firmware 0.6.10 has 100 kB. */
#define ENDPOINTS_MAX (4u << 20)

int rig_endpoints_path(char path[RIG_ENDPOINTS_PATH_MAX], const char *name,
                       const char *rig_path)
{
    const char *slash = strrchr(rig_path, '/');
    const int dir =
        slash == NULL || name[0] == '/' ? 0 : (int)(slash - rig_path + 1);

    return snprintf(path, RIG_ENDPOINTS_PATH_MAX, "%.*s%s", dir, rig_path,
                    name) < RIG_ENDPOINTS_PATH_MAX
               ? 0
               : -1;
}

/* Id of axis0.config.<name>; 0: not there. */
static uint16_t endpoints_find(const cJSON *endpoints, const char *name)
{
    char path[64];
    const cJSON *id;

    snprintf(path, sizeof path, "axis0.config.%s", name);
    id = cJSON_GetObjectItemCaseSensitive(
        cJSON_GetObjectItemCaseSensitive(endpoints, path), "id");
    if (!cJSON_IsNumber(id) || id->valueint < 1 || id->valueint > UINT16_MAX)
        return 0;
    return (uint16_t)id->valueint;
}

static int endpoints_parse(const char *text, size_t length,
                           struct rig_axis *axis)
{
    cJSON *list = cJSON_ParseWithLength(text, length);
    const cJSON *endpoints =
        cJSON_GetObjectItemCaseSensitive(list, "endpoints");

    if (!cJSON_IsObject(list)) {
        cJSON_Delete(list);
        return -1;
    }
    axis->enable_watchdog = endpoints_find(endpoints, "enable_watchdog");
    axis->watchdog_timeout = endpoints_find(endpoints, "watchdog_timeout");
    cJSON_Delete(list);
    return 0;
}

int rig_endpoints_load(const char *path, struct rig_axis *axis)
{
    FILE *file = fopen(path, "rb");
    char *text;
    size_t length;
    int err = -1;

    if (file == NULL)
        return -1;
    text = memory_resize(NULL, ENDPOINTS_MAX, 1);
    length = fread(text, 1, ENDPOINTS_MAX, file);
    if (ferror(file) == 0 && length < ENDPOINTS_MAX)
        err = endpoints_parse(text, length, axis);
    memory_free(text);
    fclose(file);
    return err;
}
