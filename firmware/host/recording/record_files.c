/* firmware/host/recording/record_files.c - see record_files.h. */
#include "firmware/host/recording/record_files.h"

#include <string.h>

#include "firmware/host/base/array.h"

/* Above every descriptor of a system. */
#define RECORD_FILES_FIRST (1 << 30)

static const struct record_files *record_files_of(const struct files *files)
{
    return (const struct record_files *)(const void *)files;
}

_Static_assert(offsetof(struct record_files, files) == 0, "the cast above");

static int record_files_get(const struct files *files, const char *path)
{
    const struct record_files *self = record_files_of(files);
    for (int i = 0; i < (int)ARRAY_LEN(self->kept); i++)
        if (strcmp(path, self->kept[i].path) == 0)
            return RECORD_FILES_FIRST + i;
    return self->base->open(self->base, path);
}

static void record_files_close(const struct files *files, int file)
{
    const struct record_files *self = record_files_of(files);
    if (file < RECORD_FILES_FIRST)
        self->base->close(self->base, file);
}

static int64_t record_files_read(const struct files *files, int file, void *to,
                                 size_t size, uint64_t offset)
{
    const struct record_files *self = record_files_of(files);
    if (file < RECORD_FILES_FIRST)
        return self->base->read(self->base, file, to, size, offset);
    const size_t length = self->kept[file - RECORD_FILES_FIRST].length;
    const size_t left = offset < length ? length - (size_t)offset : 0;
    const size_t part = left < size ? left : size;
    if (part > 0)
        memcpy(to, self->kept[file - RECORD_FILES_FIRST].text + offset, part);
    return (int64_t)part;
}

static int64_t record_files_size(const struct files *files, int file)
{
    const struct record_files *self = record_files_of(files);
    return file < RECORD_FILES_FIRST
               ? self->base->size(self->base, file)
               : (int64_t)self->kept[file - RECORD_FILES_FIRST].length;
}

static bool record_files_find(const struct files *files, const char *kind,
                              const char *name, const char *beside,
                              char path[FILES_PATH_MAX])
{
    const struct files *base = record_files_of(files)->base;
    return base->find(base, kind, name, beside, path);
}

static unsigned record_files_names(const struct files *files, const char *kind,
                                   char name[FILES_NAMES_MAX][FILES_NAME_MAX])
{
    const struct files *base = record_files_of(files)->base;
    return base->names(base, kind, name);
}

static bool record_files_keep(struct record_files *self, unsigned i,
                              const char *recording,
                              const struct record_file *about, const char *key)
{
    snprintf(self->kept[i].path, sizeof self->kept[i].path, "%s",
             record_value(about->plan, about->plan_count, key));
    self->kept[i].text = record_attachment(
        self->base, recording, self->kept[i].path, &self->kept[i].length);
    return self->kept[i].text != NULL;
}

int record_files_open(struct record_files *self, const struct files *base,
                      const char *recording, char message[YAML_MESSAGE_MAX])
{
    struct record_file about;
    *self = (struct record_files){
        .files = { .open = record_files_get,
                   .close = record_files_close,
                   .read = record_files_read,
                   .size = record_files_size,
                   .find = record_files_find,
                   .names = record_files_names },
        .base = base,
    };
    int err = record_read(&about, base, recording, NULL, NULL, message);
    if (err == 0 && (!record_files_keep(self, 0, recording, &about, "rig") ||
                     !record_files_keep(self, 1, recording, &about, "move"))) {
        snprintf(message, YAML_MESSAGE_MAX,
                 "%.300s: does not have the files that were played, expected "
                 "RIG MOVE and --telemetry with it",
                 recording);
        err = -1;
    }
    record_file_free(&about);
    return err;
}

void record_files_free(struct record_files *self)
{
    for (size_t i = 0; i < ARRAY_LEN(self->kept); i++)
        memory_free(self->kept[i].text);
    *self = (struct record_files){ .base = NULL };
}
