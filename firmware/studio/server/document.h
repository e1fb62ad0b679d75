/* firmware/studio/server/document.h - a file that is edited elsewhere: read with
 * a mark of what it was, written only over that. */
#ifndef FIRMWARE_STUDIO_SERVER_DOCUMENT_H
#define FIRMWARE_STUDIO_SERVER_DOCUMENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define DOCUMENT_MAX ((size_t)16 * 1024 * 1024)
#define DOCUMENT_TAG 48

/* The bytes, with a 0 after them, to be freed; `tag` is their ETag.  Their
 * length, or a negative errno. */
int64_t document_read(const char *path, char **data, char tag[DOCUMENT_TAG]);
void document_tag(const char *data, size_t length, char tag[DOCUMENT_TAG]);

/* 0: written, whole, `tag` is the new one.  -EEXIST: the file is not what `was`
 * says, `tag` is what it is; nothing was written.  Or another negative errno. */
int document_write(const char *path, const char *data, size_t length,
                   const char *was, char tag[DOCUMENT_TAG]);

/* A new file, whole or not at all.  0, -EEXIST, or another negative errno. */
int document_create(const char *path, const char *data, size_t length);

/* May a page see the file of this name, where the rig and the move are `rig`
 * and `move` (NULL: none)?  Beside them or below, of a kind that they name, and
 * nothing that begins with a dot. */
bool document_is_public(const char *name, const char *rig, const char *move);

#endif
