/* firmware/studio/wasm/store.h - files in memory, by name.
 *
 * A snapshot shares the bytes of what it is of, and stays as it is whatever is
 * put or removed later.  Names of files that were asked for and are not there
 * are kept, so that whoever has them can put them. */
#ifndef FIRMWARE_STUDIO_WASM_STORE_H
#define FIRMWARE_STUDIO_WASM_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/base/files.h"

#define STORE_MISSING_MAX 64

struct store_bytes;

struct store_entry {
    char name[FILES_PATH_MAX];
    struct store_bytes *bytes;
};

struct store_missing {
    uint32_t count;
    char name[STORE_MISSING_MAX][FILES_PATH_MAX];
};

/* Zeroed, it is empty but for what is embedded; store_snapshot makes one that
 * can be read. */
struct store {
    struct files files; /* first */
    struct store_entry *entry;
    uint32_t count;
    struct store_missing *missing;
};

/* A copy of `length` bytes; NULL: no such file any more.  0, or a negative
 * errno: the name is too long. */
int store_put(struct store *store, const char *name, const char *data,
              size_t length);
void store_free(struct store *store);

/* To be freed with store_free. */
void store_snapshot(const struct store *store, struct store *snapshot);

/* Two snapshots of one store: does one hold what the other does, `but` aside, and
 * has none of them missed a file? */
bool store_is_same(const struct store *a, const struct store *b,
                   const char *but);

/* The bytes of a file; NULL: there is none. */
const char *store_look(const struct store *store, const char *name,
                       size_t *length);

#endif
