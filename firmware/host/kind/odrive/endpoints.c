/* firmware/host/kind/odrive/endpoints.c - where an ODrive's watchdog is; see
 * endpoints.h. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/device/endpoints.h"
#include "firmware/host/kind/odrive/parts.h"

int rig_endpoints_path(char path[RIG_PATH_MAX], const char *name,
                       const char *rig_path)
{
    const char *slash = strrchr(rig_path, '/');
    const int dir =
        slash == NULL || name[0] == '/' ? 0 : (int)(slash - rig_path + 1);

    return snprintf(path, RIG_PATH_MAX, "%.*s%s", dir, rig_path, name) <
                   RIG_PATH_MAX
               ? 0
               : -1;
}

int rig_endpoints_load(const struct files *files, const char *path,
                       struct rig_axis *axis)
{
    struct cJSON *list = endpoints_open(files, path);

    if (list == NULL)
        return -1;
    axis->enable_watchdog =
        endpoints_number(list, "axis0.config.enable_watchdog");
    axis->watchdog_timeout =
        endpoints_number(list, "axis0.config.watchdog_timeout");
    endpoints_close(list);
    return 0;
}
