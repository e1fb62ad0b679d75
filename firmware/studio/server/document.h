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

/* The same of a file that a page may see, where the rig and the move are `rig`
 * and `move` (NULL: none): beside them or below, links followed, of a kind that
 * they name, a regular one, and nothing that begins with a dot. */
int64_t document_read_beside(const char *name, const char *rig,
                             const char *move, char **data,
                             char tag[DOCUMENT_TAG]);

#endif
