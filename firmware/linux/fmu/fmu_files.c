/* firmware/linux/fmu/fmu_files.c - see fmu_files.h. */
#include "firmware/linux/fmu/fmu_files.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/linux/base/disk.h"
#include "sim/util.h"

#define LIST_MAX (1 << 20) /* bytes */

/* The operations have their files as const, as a disk's are; a record grows. */
static struct fmu_files *fmu_files_of(const struct files *files)
{
    return (struct fmu_files *)files;
}

static const char *fmu_files_copy(struct fmu_files *self, const char *text)
{
    const size_t size = strlen(text) + 1;
    return memcpy(memory_pool_new(&self->memory, size, 1), text, size);
}

static struct fmu_line *fmu_files_add(struct fmu_files *self)
{
    self->line = memory_pool_more(&self->memory, self->line, self->count,
                                  sizeof *self->line);
    struct fmu_line *const line = &self->line[self->count++];
    for (unsigned i = 0; i < FMU_WORDS; i++)
        line->word[i] = "";
    return line;
}

/* The line with these words first; NULL: none. */
static const struct fmu_line *fmu_files_line(const struct fmu_files *self,
                                             const char *const word[],
                                             unsigned count)
{
    for (unsigned i = 0; i < self->count; i++) {
        unsigned same = 0;
        while (same < count &&
               strcmp(self->line[i].word[same], word[same]) == 0)
            same++;
        if (same == count)
            return &self->line[i];
    }
    return NULL;
}

static void fmu_files_note(struct fmu_files *self, const char *const word[],
                           unsigned count)
{
    if (fmu_files_line(self, word, count) != NULL)
        return;
    struct fmu_line *const line = fmu_files_add(self);
    for (unsigned i = 0; i < count; i++)
        line->word[i] = fmu_files_copy(self, word[i]);
}

bool fmu_line_is_plain(const struct fmu_line *line)
{
    for (unsigned i = 0; i < FMU_WORDS; i++)
        if (strpbrk(line->word[i], "\t\r\n") != NULL)
            return false;
    return true;
}

/* --- noting --- */

static int fmu_record_open(const struct files *files, const char *path)
{
    struct fmu_files *const self = fmu_files_of(files);
    const char *const word[] = { "open", path };
    char name[32];

    if (fmu_files_line(self, word, 2) == NULL) {
        snprintf(name, sizeof name, "file%u.yaml", self->opened++);
        fmu_files_note(self, word, 2);
        self->line[self->count - 1].word[2] = fmu_files_copy(self, name);
    }
    return disk_files.open(&disk_files, path);
}

static bool fmu_record_find(const struct files *files, const char *kind,
                            const char *name, const char *beside,
                            char path[FILES_PATH_MAX])
{
    struct fmu_files *const self = fmu_files_of(files);
    if (!disk_files.find(&disk_files, kind, name, beside, path))
        return false;
    fmu_files_note(
        self, (const char *const[]){ "find", kind, name, beside, path }, 5);
    return true;
}

static unsigned fmu_record_names(const struct files *files, const char *kind,
                                 char name[FILES_NAMES_MAX][FILES_NAME_MAX])
{
    const unsigned count = disk_files.names(&disk_files, kind, name);
    for (unsigned i = 0; i < count; i++)
        fmu_files_note(fmu_files_of(files),
                       (const char *const[]){ "name", kind, name[i] }, 3);
    return count;
}

void fmu_files_record(struct fmu_files *self, const char *rig)
{
    *self = (struct fmu_files){ .files = disk_files };
    self->files.regular = NULL;
    fmu_files_note(self, (const char *const[]){ "rig", rig }, 2);
    self->files.open = fmu_record_open;
    self->files.find = fmu_record_find;
    self->files.names = fmu_record_names;
}

/* --- reading back --- */

static int fmu_read_open(const struct files *files, const char *path)
{
    const struct fmu_files *const self = fmu_files_of(files);
    const struct fmu_line *const line =
        fmu_files_line(self, (const char *const[]){ "open", path }, 2);
    char at[2 * FILES_PATH_MAX];

    if (line == NULL || strchr(line->word[2], '/') != NULL)
        return -ENOENT;
    const int length =
        snprintf(at, sizeof at, "%s/%s", self->directory, line->word[2]);
    return length < (int)sizeof at ? disk_files.open(&disk_files, at)
                                   : -ENAMETOOLONG;
}

static bool fmu_read_find(const struct files *files, const char *kind,
                          const char *name, const char *beside,
                          char path[FILES_PATH_MAX])
{
    const struct fmu_line *const line =
        fmu_files_line(fmu_files_of(files),
                       (const char *const[]){ "find", kind, name, beside }, 4);
    return line != NULL &&
           snprintf(path, FILES_PATH_MAX, "%s", line->word[4]) < FILES_PATH_MAX;
}

static unsigned fmu_read_names(const struct files *files, const char *kind,
                               char name[FILES_NAMES_MAX][FILES_NAME_MAX])
{
    const struct fmu_files *const self = fmu_files_of(files);
    unsigned count = 0;
    for (unsigned i = 0; i < self->count && count < FILES_NAMES_MAX; i++)
        if (strcmp(self->line[i].word[0], "name") == 0 &&
            strcmp(self->line[i].word[1], kind) == 0 &&
            strlen(self->line[i].word[2]) < FILES_NAME_MAX)
            snprintf(name[count++], FILES_NAME_MAX, "%s",
                     self->line[i].word[2]);
    return count;
}

static void fmu_files_split(struct fmu_files *self, char *text)
{
    for (char *end; text != NULL && *text != '\0'; text = end) {
        end = strchr(text, '\n');
        if (end != NULL)
            *end++ = '\0';
        struct fmu_line *const line = fmu_files_add(self);
        for (unsigned i = 0; i < FMU_WORDS && text != NULL; i++) {
            char *const tab = strchr(text, '\t');
            if (tab != NULL)
                *tab = '\0';
            line->word[i] = fmu_files_copy(self, text);
            text = tab != NULL ? tab + 1 : NULL;
        }
    }
}

int fmu_files_open(struct fmu_files *self, const char *directory)
{
    char list[FILES_PATH_MAX + sizeof FMU_LIST];
    char *text;

    *self = (struct fmu_files){ .files = disk_files };
    self->files.regular = NULL; /* they are ours all */
    self->files.open = fmu_read_open;
    self->files.find = fmu_read_find;
    self->files.names = fmu_read_names;
    if (snprintf(self->directory, sizeof self->directory, "%s", directory) >=
        (int)sizeof self->directory)
        return -1;
    snprintf(list, sizeof list, "%s/%s", directory, FMU_LIST);
    if (files_load(&disk_files, list, LIST_MAX, &text) < 0)
        return -1;
    fmu_files_split(self, text);
    free(text);
    return fmu_files_token(self)[0] != '\0' ? 0 : -1;
}

void fmu_files_free(struct fmu_files *self)
{
    memory_pool_free(&self->memory);
    *self = (struct fmu_files){ 0 };
}

static const char *fmu_files_word(const struct fmu_files *self,
                                  const char *first)
{
    const struct fmu_line *const line = fmu_files_line(self, &first, 1);
    return line != NULL ? line->word[1] : "";
}

const char *fmu_files_rig(const struct fmu_files *self)
{
    return fmu_files_word(self, "rig");
}

const char *fmu_files_token(const struct fmu_files *self)
{
    return fmu_files_word(self, "token");
}
