/* firmware/host/move/move_text.h - new times in the text of a move file.
 *
 * The text is the document: only the values that change are replaced, where
 * they stand; comments, order and layout stay as they are. */
#ifndef FIRMWARE_HOST_MOVE_MOVE_TEXT_H
#define FIRMWARE_HOST_MOVE_MOVE_TEXT_H

#include "firmware/host/rig/rig.h"
#include "motion/plan/fit.h"

struct move_text {
    char *data; /* with a 0 after it; on the heap */
    size_t length;
    uint32_t changed; /* values that were replaced */
};

/* The file at `path`, from which `was` was read, with the times, velocities,
 * accelerations and handles of `fit` where these are others.  0, or -1 with the
 * sentence written and nothing allocated. */
int move_text_retime(const struct files *files, const char *path,
                     const struct rig *rig, const struct plan_move *was,
                     const struct plan_fit *fit, struct move_text *text,
                     char message[YAML_MESSAGE_MAX]);
void move_text_free(struct move_text *text);

/* Files among which the one at `path` is `text`, so that it can be read as a
 * move before it is written; pass &over->files. */
struct move_text_files {
    struct files files; /* first */
    const struct files *below;
    const char *path;
    const struct move_text *text;
};
void move_text_over(struct move_text_files *over, const struct files *below,
                    const char *path, const struct move_text *text);

#endif
