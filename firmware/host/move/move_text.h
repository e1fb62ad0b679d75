/* firmware/host/move/move_text.h - a repaired move in the text of its file
 * (yaml_text.h): only values that change are replaced. */
#ifndef FIRMWARE_HOST_MOVE_MOVE_TEXT_H
#define FIRMWARE_HOST_MOVE_MOVE_TEXT_H

#include "firmware/host/rig/rig.h"
#include "firmware/host/yaml/yaml_text.h"
#include "motion/plan/fit/fit.h"

struct move_text {
    char *data; /* with a 0 after it; on the heap */
    size_t length;
    struct yaml_text_edit *edit; /* what was replaced, as it stands; on the
                                    heap */
    uint32_t changed;            /* how many they are */
    bool moved; /* beside them, keys have exchanged their places */
};

/* The file at `path`, from which `was` was read, and what is to be another in
 * it; the sentence about what cannot. */
struct move_text_source {
    const struct files *files;
    const char *path;
    const struct rig *rig;
    const struct plan_move *was;
    char *message;                /* YAML_MESSAGE_MAX */
    const struct yaml_text *text; /* of the file, read before; NULL: not yet */
    bool on_frames;               /* times of keys are whole frames */
};

/* 0, or -1 with the sentence written and nothing allocated. */

/* The times, positions, velocities, accelerations and handles of `fit`. */
int move_text_keys(const struct move_text_source *source,
                   const struct plan_fit *fit, struct move_text *text);
/* A duration, pre-roll and post-roll, in the place of those there are or before
 * the axes (the path, ...); 0: none is written. */
struct move_text_times {
    int64_t duration_ns_q12, pre_roll_ns_q12, post_roll_ns_q12;
};
int move_text_duration(const struct move_text_source *source,
                       const struct move_text_times *times,
                       struct move_text *text);
/* The speed law of the path, that much slower: speeds by it, times times it,
 * accelerations by its square. */
int move_text_slower(const struct move_text_source *source, double by,
                     struct move_text *text);
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
