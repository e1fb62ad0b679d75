/* firmware/linux/base/disk.c - see disk.h. */
#define _GNU_SOURCE /* O_PATH */
#include "firmware/linux/base/disk.h"

#include <dirent.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* --- by their path --- */

static int disk_open(const struct files *files, const char *path)
{
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    (void)files;
    return file < 0 ? -errno : file;
}

/* Looked at before it is opened, and through what was opened. */
static int disk_open_regular(const struct files *files, const char *path)
{
    struct stat status;
    (void)files;
    if (stat(path, &status) < 0)
        return -errno;
    if (!S_ISREG(status.st_mode))
        return S_ISDIR(status.st_mode) ? -EISDIR : FILES_E_KIND;
    const int file = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (file < 0)
        return -errno;
    if (fstat(file, &status) == 0 && S_ISREG(status.st_mode))
        return file;
    close(file);
    return FILES_E_KIND;
}

/* By a descriptor that can only be looked at: what the name stands for is not
 * touched before it is known, and is opened as what was looked at, whatever
 * becomes of the name meanwhile. */
static int disk_open_looked_at(int look, const char *folder, bool streams)
{
    const size_t length = strlen(folder);
    char own[32], place[PATH_MAX];
    struct stat status;

    snprintf(own, sizeof own, "/proc/self/fd/%d", look);
    const ssize_t n = readlink(own, place, sizeof place - 1);
    if (n <= (ssize_t)length || strncmp(place, folder, length) != 0 ||
        (length > 1 && place[length] != '/'))
        return FILES_E_PLACE;
    if (fstat(look, &status) < 0 ||
        !(S_ISREG(status.st_mode) || (streams && S_ISFIFO(status.st_mode))))
        return FILES_E_KIND;
    const int file = open(own, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    return file < 0 ? -errno : file;
}

/* Of what is elsewhere not even that it is not there is said. */
int disk_open_below(const char *folder, const char *path, bool streams)
{
    const size_t length = strlen(folder);
    char whole[PATH_MAX];
    const int n = path[0] == '/'
                      ? snprintf(whole, sizeof whole, "%s", path)
                      : snprintf(whole, sizeof whole, "%s/%s", folder, path);

    if (length == 0 || n >= (int)sizeof whole)
        return FILES_E_PLACE;
    const int look = open(whole, O_PATH | O_CLOEXEC);
    if (look < 0)
        return strncmp(whole, folder, length) == 0 &&
                       strstr(whole, "/..") == NULL
                   ? -errno
                   : FILES_E_PLACE;
    const int file = disk_open_looked_at(look, folder, streams);
    close(look);
    return file;
}

void disk_folder(const char *path, char folder[FILES_PATH_MAX])
{
    char *real = realpath(path, NULL);
    char *slash = real == NULL ? NULL : strrchr(real, '/');

    folder[0] = '\0';
    if (slash != NULL && slash - real < FILES_PATH_MAX)
        snprintf(folder, FILES_PATH_MAX, "%.*s",
                 slash == real ? 1 : (int)(slash - real), real);
    free(real);
}

static void disk_close(const struct files *files, int file)
{
    (void)files;
    close(file);
}

static int64_t disk_read(const struct files *files, int file, void *to,
                         size_t size, uint64_t offset)
{
    ssize_t got;

    (void)files;
    do {
        got = pread(file, to, size, (off_t)offset);
        if (got < 0 && errno == ESPIPE)
            got = read(file, to, size);
    } while (got < 0 && errno == EINTR);
    return got < 0 ? -errno : got;
}

static int64_t disk_size(const struct files *files, int file)
{
    struct stat status;

    (void)files;
    return fstat(file, &status) < 0 ? -errno : status.st_size;
}

/* --- those that come with slew --- */

static bool disk_is_there(const char *path)
{
    return access(path, R_OK) == 0;
}

/* `directory` of a path, with its last slash. */
static size_t disk_directory(const char *path)
{
    const char *slash = strrchr(path, '/');

    return slash == NULL ? 0 : (size_t)(slash - path) + 1;
}

static int disk_find_under(const char *directory, const char *kind,
                           const char *file, char path[FILES_PATH_MAX])
{
    static const char *const place[] = { "/share/slew", "" };

    for (unsigned i = 0; i < 2; i++) {
        const int n = snprintf(path, FILES_PATH_MAX, "%s%s/%s/%s", directory,
                               place[i], kind, file);
        if (n > 0 && n < FILES_PATH_MAX && disk_is_there(path))
            return 0;
    }
    return -1;
}

static int disk_find_own(const char *kind, const char *file,
                         char path[FILES_PATH_MAX])
{
    char program[FILES_PATH_MAX];
    const ssize_t length =
        readlink("/proc/self/exe", program, sizeof program - 1);
    size_t end;

    if (length < 0)
        return -1;
    program[length] = '\0';
    for (end = disk_directory(program); end > 1;
         end = disk_directory(program)) {
        program[end - 1] = '\0';
        if (disk_find_under(program, kind, file, path) == 0)
            return 0;
    }
    return -1;
}

static bool disk_find(const struct files *files, const char *kind,
                      const char *name, const char *beside,
                      char path[FILES_PATH_MAX])
{
    const size_t length = strlen(name);
    const size_t directory = name[0] == '/' ? 0 : disk_directory(beside);
    char file[FILES_NAME_MAX];
    int n;

    (void)files;
    if (length < 6 || strcmp(name + length - 5, ".yaml") != 0) {
        n = snprintf(file, sizeof file, "%s.yaml", name);
        return n < FILES_NAME_MAX && disk_find_own(kind, file, path) == 0;
    }
    n = snprintf(path, FILES_PATH_MAX, "%.*s%s", (int)directory, beside, name);
    return n > 0 && n < FILES_PATH_MAX && disk_is_there(path);
}

static int disk_compare(const void *a, const void *b)
{
    return strcmp(a, b);
}

static unsigned disk_names(const struct files *files, const char *kind,
                           char name[FILES_NAMES_MAX][FILES_NAME_MAX])
{
    char path[FILES_PATH_MAX];
    unsigned count = 0;
    DIR *handle = disk_find_own(kind, "", path) < 0 ? NULL : opendir(path);

    (void)files;
    if (handle == NULL)
        return 0;
    for (struct dirent *entry;
         (entry = readdir(handle)) != NULL && count < FILES_NAMES_MAX;) {
        const char *dot = strrchr(entry->d_name, '.');
        const size_t length = dot == NULL ? 0 : (size_t)(dot - entry->d_name);

        if (length == 0 || length >= FILES_NAME_MAX - 5 ||
            strcmp(dot, ".yaml") != 0)
            continue;
        memcpy(name[count], entry->d_name, length);
        name[count++][length] = '\0';
    }
    closedir(handle);
    qsort(name, count, FILES_NAME_MAX, disk_compare);
    return count;
}

static const struct files disk_regular = {
    .open = disk_open_regular,
    .close = disk_close,
    .read = disk_read,
    .size = disk_size,
    .find = disk_find,
    .names = disk_names,
};

const struct files disk_files = {
    .regular = &disk_regular,
    .open = disk_open,
    .close = disk_close,
    .read = disk_read,
    .size = disk_size,
    .find = disk_find,
    .names = disk_names,
};
