/* firmware/studio/server/example.c - see example.h. */
#include "firmware/studio/server/example.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/linux/base/error.h"
#include "firmware/studio/embedded.h"

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

static int example_folders(char *path)
{
    for (char *at = strchr(path + 1, '/'); at != NULL;
         at = strchr(at + 1, '/')) {
        *at = '\0';
        (void)mkdir(path, 0755);
        *at = '/';
    }
    return mkdir(path, 0755) < 0 && errno != EEXIST ? -errno : 0;
}

/* Whole, or not there. */
static int example_file(const char *directory, const struct embedded_file *from)
{
    char path[FILES_PATH_MAX + 32], partial[FILES_PATH_MAX + 64];
    int err = 0;

    snprintf(path, sizeof path, "%s/%s", directory, from->name);
    snprintf(partial, sizeof partial, "%s.partial", path);
    if (access(path, F_OK) == 0)
        return 0;
    (void)unlink(partial);
    const int file = open(
        partial, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (file < 0)
        return -errno;
    if (write(file, from->data, from->length) != (ssize_t)from->length)
        err = -EIO;
    if (close(file) < 0 && err == 0)
        err = -errno;
    if (err == 0 && rename(partial, path) < 0)
        err = -errno;
    if (err < 0)
        (void)unlink(partial);
    return err;
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
