/* firmware/studio/server/document.c - see document.h. */
#include "firmware/studio/server/document.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/linux/base/disk.h"
#include "hal/support/crc32.h"

void document_tag(const char *data, size_t length, char tag[DOCUMENT_TAG])
{
    uint64_t hash = UINT64_C(14695981039346656037);

    for (size_t i = 0; i < length; i++)
        hash = (hash ^ (unsigned char)data[i]) * UINT64_C(1099511628211);
    snprintf(tag, DOCUMENT_TAG, "\"%016llx-%zx\"", (unsigned long long)hash,
             length);
}

int64_t document_read(const char *path, char **data, char tag[DOCUMENT_TAG])
{
    const int64_t length =
        files_load(files_regular(&disk_files), path, DOCUMENT_MAX, data);

    if (length >= 0)
        document_tag(*data, (size_t)length, tag);
    return length;
}

static int document_write_all(int file, const char *data, size_t length)
{
    while (length > 0) {
        const ssize_t put = write(file, data, length);
        if (put < 0 && errno != EINTR)
            return -errno;
        data += put > 0 ? put : 0;
        length -= put > 0 ? (size_t)put : 0;
    }
    return fsync(file) < 0 ? -errno : 0;
}

/* With the rights that the file has. */
static int document_replace(const char *path, const char *data, size_t length)
{
    char partial[4096 + 16];
    struct stat status;
    int err;

    snprintf(partial, sizeof partial, "%s.partial", path);
    if (stat(path, &status) < 0)
        return -errno;
    (void)unlink(partial);
    const int file =
        open(partial, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW,
             status.st_mode & 0777);
    if (file < 0)
        return -errno;
    err = fchmod(file, status.st_mode & 0777) < 0 ? -errno : 0;
    if (err == 0)
        err = document_write_all(file, data, length);
    if (close(file) < 0 && err == 0)
        err = -errno;
    if (err == 0 && rename(partial, path) < 0)
        err = -errno;
    if (err < 0)
        (void)unlink(partial);
    return err;
}

int document_write(const char *path, const char *data, size_t length,
                   const char *was, char tag[DOCUMENT_TAG])
{
    char *now;
    const int64_t had = document_read(path, &now, tag);

    if (had < 0)
        return (int)had;
    memory_free(now);
    if (strcmp(was, tag) != 0)
        return -EEXIST;
    const int err = document_replace(path, data, length);
    if (err == 0)
        document_tag(data, length, tag);
    return err;
}

int document_create(const char *path, const char *data, size_t length)
{
    char partial[4096 + 16];
    int err;

    snprintf(partial, sizeof partial, "%s.partial", path);
    if (access(path, F_OK) == 0)
        return -EEXIST;
    (void)unlink(partial);
    const int file = open(
        partial, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (file < 0)
        return -errno;
    err = document_write_all(file, data, length);
    if (close(file) < 0 && err == 0)
        err = -errno;
    if (err == 0 && link(partial, path) < 0)
        err = -errno;
    (void)unlink(partial);
    return err;
}

/* --- what a page may see ---------------------------------------------------- */

static bool document_is_of_a_kind(const char *name)
{
    static const char *const kinds[] = { ".yaml", ".yml", ".eds",
                                         ".json", ".csv", ".slt" };
    const char *dot = strrchr(name, '.');

    for (unsigned i = 0; dot != NULL && i < ARRAY_LEN(kinds); i++)
        if (strcmp(dot, kinds[i]) == 0)
            return true;
    return false;
}

static bool document_is_below(const char *name, const char *beside)
{
    const char *slash = beside == NULL ? NULL : strrchr(beside, '/');
    const size_t length = slash == NULL ? 0 : (size_t)(slash - beside) + 1;

    return beside != NULL && strncmp(name, beside, length) == 0 &&
           name[length] != '/';
}

static const char *document_rest(const char *name, const char *beside)
{
    const char *slash = strrchr(beside, '/');
    const char *rest = name + (slash == NULL ? 0 : slash - beside + 1);

    return rest[0] != '.' && strstr(rest, "/.") == NULL &&
                   document_is_of_a_kind(rest)
               ? rest
               : NULL;
}

/* A file that is open, as the one of its name. */
struct document_files {
    struct files files;
    int file;
};

static int document_open(const struct files *files, const char *path)
{
    (void)path;
    return ((const struct document_files *)(const void *)files)->file;
}

int64_t document_read_beside(const char *name, const char *rig,
                             const char *move, char **data,
                             char tag[DOCUMENT_TAG])
{
    const char *beside = document_is_below(name, rig)    ? rig
                         : document_is_below(name, move) ? move
                                                         : NULL;
    const char *rest = beside == NULL ? NULL : document_rest(name, beside);
    struct document_files own = { .files = disk_files };
    char folder[FILES_PATH_MAX];

    if (rest == NULL)
        return -ENOENT;
    disk_folder(beside, folder);
    own.files.open = document_open;
    own.file = disk_open_below(folder, rest, false);
    if (own.file < 0)
        return own.file;
    const int64_t length = files_load(&own.files, name, DOCUMENT_MAX, data);
    if (length >= 0)
        document_tag(*data, (size_t)length, tag);
    return length;
}
