/* firmware/studio/server/takes.c - see takes.h. */
#include "firmware/studio/server/takes.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "firmware/host/base/files.h"
#include "firmware/studio/server/document.h"

bool takes_is_name(const char *name)
{
    const size_t stem = strspn(name, "abcdefghijklmnopqrstuvwxyz"
                                     "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_");

    return stem > 0 && stem + sizeof ".csv" <= TAKES_NAME &&
           strcmp(name + stem, ".csv") == 0;
}

static bool takes_under(const char *beside, const char *name, char *path,
                        size_t size)
{
    const char *slash = strrchr(beside, '/');
    const int n = snprintf(path, size, "%.*stakes%s%s",
                           slash == NULL ? 0 : (int)(slash - beside) + 1,
                           beside, name[0] == '\0' ? "" : "/", name);

    return n > 0 && (size_t)n < size;
}

bool takes_path(const char *beside, const char *name, char *path, size_t size)
{
    return takes_is_name(name) && takes_under(beside, name, path, size);
}

static void takes_add(const char *beside, const char *name, cJSON *list)
{
    char path[FILES_PATH_MAX];
    struct stat status;
    cJSON *take;

    if (!takes_path(beside, name, path, sizeof path) ||
        stat(path, &status) < 0 || !S_ISREG(status.st_mode))
        return;
    take = cJSON_CreateObject();
    cJSON_AddStringToObject(take, "name", name);
    cJSON_AddNumberToObject(take, "bytes", (double)status.st_size);
    cJSON_AddItemToArray(list, take);
}

cJSON *takes_list(const char *beside)
{
    char path[FILES_PATH_MAX];
    struct dirent **entry = NULL;
    cJSON *object = cJSON_CreateObject();
    cJSON *list = cJSON_AddArrayToObject(object, "takes");
    const int count = takes_under(beside, "", path, sizeof path)
                          ? scandir(path, &entry, NULL, alphasort)
                          : 0;

    for (int i = 0; i < count; i++) {
        if (count - i <= TAKES_MOST)
            takes_add(beside, entry[i]->d_name, list);
        free(entry[i]);
    }
    free(entry);
    return object;
}

int takes_write(const char *beside, const char *name, const char *data,
                size_t length)
{
    char path[FILES_PATH_MAX];

    if (!takes_under(beside, "", path, sizeof path))
        return -ENAMETOOLONG;
    if (mkdir(path, 0755) < 0 && errno != EEXIST)
        return -errno;
    return takes_path(beside, name, path, sizeof path)
               ? document_create(path, data, length)
               : -EINVAL;
}
