/* firmware/studio/server/errand.h - what a request wants of the disk, done in a
 * thread of its own: a disk that takes its time holds up no WebSocket, and no stop
 * that comes through one. */
#ifndef FIRMWARE_STUDIO_SERVER_ERRAND_H
#define FIRMWARE_STUDIO_SERVER_ERRAND_H

#include <cjson/cJSON.h>

#include "firmware/host/base/files.h"
#include "firmware/studio/server/document.h"
#include "firmware/studio/server/takes.h"

enum errand_kind {
    ERRAND_READ,   /* path */
    ERRAND_BESIDE, /* name, beside path (the rig) or move */
    ERRAND_WRITE,  /* body to path, over what `tag` says */
    ERRAND_TAKES,  /* those beside path */
    ERRAND_KEEP,   /* body as the take `name` beside path */
};

struct errand {
    enum errand_kind kind;
    char path[FILES_PATH_MAX], move[FILES_PATH_MAX], name[FILES_PATH_MAX];
    char *body; /* the errand's */
    size_t length;
    char tag[DOCUMENT_TAG]; /* WRITE: what it was; then what the file is */
    /* once it is done */
    int64_t outcome; /* a length, 0, or a negative errno */
    char *data;      /* READ, BESIDE; to be taken, else the errand's */
    cJSON *list;     /* TAKES; the same */
    _Atomic int state;
};

/* All zero but for its kind and path; move NULL: none. */
struct errand *errand_new(enum errand_kind kind, const char *path);
void errand_start(struct errand *errand);
bool errand_is_done(const struct errand *errand);
/* Nobody waits for it: it is freed, or goes on to its end by itself.  NULL is
 * nothing. */
void errand_leave(struct errand *errand);

#endif
