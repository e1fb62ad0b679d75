/* firmware/studio/server/example.c - see example.h. */
#include "firmware/studio/server/example.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/linux/base/error.h"
#include "firmware/linux/service/place.h"
#include "firmware/studio/embedded.h"
#include "firmware/studio/server/document.h"

static void example_directory(char path[FILES_PATH_MAX])
{
    const char *data = getenv("XDG_DATA_HOME");
    const char *home = getenv("HOME");

    if (data != NULL && data[0] == '/')
        snprintf(path, FILES_PATH_MAX, "%s/slew/example", data);
    else if (home != NULL && home[0] == '/')
        snprintf(path, FILES_PATH_MAX, "%s/.local/share/slew/example", home);
    else
        snprintf(path, FILES_PATH_MAX, "/tmp/slew-%u/example",
                 (unsigned)getuid());
}

/* What lies in /tmp may be somebody else's. */
static int example_folders(char *path)
{
    for (char *at = strchr(path + 1, '/'); at != NULL;
         at = strchr(at + 1, '/')) {
        *at = '\0';
        (void)mkdir(path, 0700);
        const bool is_ours =
            strncmp(path, "/tmp/", 5) != 0 || service_place_is_trusted(path);
        *at = '/';
        if (!is_ours)
            return -EPERM;
    }
    return mkdir(path, 0700) < 0 && errno != EEXIST ? -errno : 0;
}

static int example_file(const char *directory, const struct embedded_file *from)
{
    char path[FILES_PATH_MAX + 32];

    snprintf(path, sizeof path, "%s/%s", directory, from->name);
    const int err =
        document_create(path, (const char *)from->data, from->length);
    return err == -EEXIST ? 0 : err;
}

int example_write(char path[FILES_PATH_MAX])
{
    int err;

    example_directory(path);
    err = example_folders(path);
    for (const struct embedded_file *file = embedded_example;
         err == 0 && file->name != NULL; file++)
        err = example_file(path, file);
    if (err == 0)
        return 0;
    error_say("slew studio: %s: %s, expected a place for an example, or a rig "
              "as slew studio RIG",
              path, strerror(-err));
    return -1;
}
