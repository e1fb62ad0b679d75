/* firmware/studio/wasm/store.c - see store.h. */
#include "firmware/studio/wasm/store.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/studio/embedded.h"

struct store_bytes {
    uint32_t users;
    size_t length;
    char *data;
};

static const struct store *store_of(const struct files *files)
{
    return (const struct store *)(const void *)files;
}

/* --- putting and sharing --- */

static void store_leave(struct store_bytes *bytes)
{
    if (--bytes->users > 0)
        return;
    memory_free(bytes->data);
    memory_free(bytes);
}

static uint32_t store_find(const struct store *store, const char *name)
{
    uint32_t i = 0;

    while (i < store->count && strcmp(store->entry[i].name, name) != 0)
        i++;
    return i;
}

static struct store_bytes *store_bytes_of(const char *data, size_t length)
{
    struct store_bytes *bytes = memory_new(1, sizeof *bytes);

    bytes->users = 1;
    bytes->length = length;
    bytes->data = memory_new(length + 1, 1);
    memcpy(bytes->data, data, length);
    return bytes;
}

int store_put(struct store *store, const char *name, const char *data,
              size_t length)
{
    const uint32_t at = store_find(store, name);

    if (strlen(name) >= FILES_PATH_MAX)
        return -ENAMETOOLONG;
    if (at < store->count) {
        store_leave(store->entry[at].bytes);
        if (data == NULL)
            store->entry[at] = store->entry[--store->count];
    }
    if (data == NULL)
        return 0;
    if (at == store->count) {
        store->entry = memory_resize(store->entry, (size_t)store->count + 1,
                                     sizeof *store->entry);
        snprintf(store->entry[at].name, FILES_PATH_MAX, "%s", name);
        store->count++;
    }
    store->entry[at].bytes = store_bytes_of(data, length);
    return 0;
}

void store_free(struct store *store)
{
    for (uint32_t i = 0; i < store->count; i++)
        store_leave(store->entry[i].bytes);
    memory_free(store->entry);
    memory_free(store->missing);
    *store = (struct store){ .entry = NULL };
}

/* --- looking --- */

static const struct embedded_file *store_own(const char *name)
{
    const struct embedded_file *file = embedded_own;

    while (file->name != NULL && strcmp(file->name, name) != 0)
        file++;
    return file->name == NULL ? NULL : file;
}

const char *store_look(const struct store *store, const char *name,
                       size_t *length)
{
    const uint32_t at = store_find(store, name);
    const struct embedded_file *own;

    if (at < store->count) {
        *length = store->entry[at].bytes->length;
        return store->entry[at].bytes->data;
    }
    own = store_own(name);
    if (own == NULL)
        return NULL;
    *length = own->length;
    return (const char *)own->data;
}

static void store_miss(const struct store *store, const char *name)
{
    struct store_missing *missing = store->missing;

    for (uint32_t i = 0; i < missing->count; i++)
        if (strcmp(missing->name[i], name) == 0)
            return;
    if (missing->count < STORE_MISSING_MAX && strlen(name) < FILES_PATH_MAX)
        snprintf(missing->name[missing->count++], FILES_PATH_MAX, "%s", name);
}

/* --- as files: the number of a file is its place, of its own ones after the
 * others --- */

static int store_open(const struct files *files, const char *path)
{
    const struct store *store = store_of(files);
    const uint32_t at = store_find(store, path);
    const struct embedded_file *own;

    if (at < store->count)
        return (int)at;
    own = store_own(path);
    if (own != NULL)
        return (int)(store->count + (uint32_t)(own - embedded_own));
    store_miss(store, path);
    return -ENOENT;
}

static void store_close(const struct files *files, int file)
{
    (void)files;
    (void)file;
}

static const char *store_bytes_at(const struct store *store, int file,
                                  size_t *length)
{
    const uint32_t at = (uint32_t)file;

    if (at < store->count) {
        *length = store->entry[at].bytes->length;
        return store->entry[at].bytes->data;
    }
    *length = embedded_own[at - store->count].length;
    return (const char *)embedded_own[at - store->count].data;
}

static int64_t store_read(const struct files *files, int file, void *to,
                          size_t size, uint64_t offset)
{
    size_t length;
    const char *data = store_bytes_at(store_of(files), file, &length);

    if (offset >= length)
        return 0;
    if (size > length - (size_t)offset)
        size = length - (size_t)offset;
    memcpy(to, data + offset, size);
    return (int64_t)size;
}

static int64_t store_size(const struct files *files, int file)
{
    size_t length;

    (void)store_bytes_at(store_of(files), file, &length);
    return (int64_t)length;
}

/* As on a disk: beside the file that names it. */
static bool store_where(const struct files *files, const char *kind,
                        const char *name, const char *beside,
                        char path[FILES_PATH_MAX])
{
    const struct store *store = store_of(files);
    const size_t length = strlen(name);
    const char *slash = name[0] == '/' ? NULL : strrchr(beside, '/');
    const bool is_path = length >= 6 && strcmp(name + length - 5, ".yaml") == 0;
    int n;

    if (is_path)
        n = snprintf(path, FILES_PATH_MAX, "%.*s%s",
                     slash == NULL ? 0 : (int)(slash - beside) + 1, beside,
                     name);
    else
        n = snprintf(path, FILES_PATH_MAX, "%s/%s.yaml", kind, name);
    if (n <= 0 || n >= FILES_PATH_MAX)
        return false;
    if (store_look(store, path, &(size_t){ 0 }) != NULL)
        return true;
    if (is_path)
        store_miss(store, path);
    return false;
}

static int store_compare(const void *a, const void *b)
{
    return strcmp(a, b);
}

static unsigned store_names(const struct files *files, const char *kind,
                            char name[FILES_NAMES_MAX][FILES_NAME_MAX])
{
    const size_t skip = strlen(kind) + 1;
    unsigned count = 0;

    (void)files;
    for (const struct embedded_file *own = embedded_own;
         own->name != NULL && count < FILES_NAMES_MAX; own++) {
        const size_t length = strlen(own->name);
        if (strncmp(own->name, kind, skip - 1) == 0 &&
            own->name[skip - 1] == '/' && length < skip + FILES_NAME_MAX)
            snprintf(name[count++], FILES_NAME_MAX, "%.*s",
                     (int)(length - skip - 5), own->name + skip);
    }
    qsort(name, count, FILES_NAME_MAX, store_compare);
    return count;
}

void store_snapshot(const struct store *store, struct store *snapshot)
{
    *snapshot = (struct store){
        .files = { .open = store_open,
                   .close = store_close,
                   .read = store_read,
                   .size = store_size,
                   .find = store_where,
                   .names = store_names },
        .count = store->count,
        .missing = memory_new(1, sizeof *snapshot->missing),
    };
    snapshot->entry =
        memory_resize(NULL, (size_t)store->count + 1, sizeof *snapshot->entry);
    for (uint32_t i = 0; i < store->count; i++) {
        snapshot->entry[i] = store->entry[i];
        snapshot->entry[i].bytes->users++;
    }
}

bool store_is_same(const struct store *a, const struct store *b,
                   const char *but)
{
    if (a->count != b->count || a->missing->count + b->missing->count > 0)
        return false;
    for (uint32_t i = 0; i < a->count; i++)
        if (strcmp(a->entry[i].name, b->entry[i].name) != 0 ||
            (a->entry[i].bytes != b->entry[i].bytes &&
             strcmp(a->entry[i].name, but) != 0))
            return false;
    return true;
}
