/* firmware/host/job/repair.h - a move file whose move breaks limits, and the
 * text of one whose move does not.
 *
 * The new text is read, planned and judged as any move before it is handed out:
 * what is written later is what was proven. */
#ifndef FIRMWARE_HOST_JOB_REPAIR_H
#define FIRMWARE_HOST_JOB_REPAIR_H

#include "firmware/host/job/job.h"
#include "firmware/host/move/move_text.h"

/* X(name, word, what it changes) */
#define REPAIR_LIST(X)                                                         \
    X(REPAIR_STRETCH, "stretch",                                               \
      "all spans by one factor; the duration where keys are not all")          \
    X(REPAIR_LOCAL, "local", "the spans that need it, by what each needs")     \
    X(REPAIR_SMOOTH, "smooth", "positions of keys, within --tolerance")        \
    X(REPAIR_SPEED, "speed", "the speed law of the path")

enum repair_method {
#define REPAIR_ENUM(name, word, text) name,
    REPAIR_LIST(REPAIR_ENUM)
#undef REPAIR_ENUM
        REPAIR_METHODS
};
extern const char *const repair_words[REPAIR_METHODS];

/* Zeroed, but for the first two. */
struct repair {
    struct job *before; /* opened; gets what there is to say */
    enum repair_method method;
    struct job *after;      /* opened from the new text; NULL until then */
    int64_t *tolerance_q32; /* smooth: of each axis; on the heap */
    bool on_frames;         /* times of keys are whole frames of the move */
    bool has_fit;           /* keys were changed: how */
    struct plan_fit fit;
    struct move_text text; /* data NULL: nothing has to change */
};

/* What a move is repaired by where nobody says it: local where it is of keys
 * alone, else stretch. */
enum repair_method repair_default(const struct job *job);
/* Tolerances of smooth, such as "1 mm" or "1 mm, 0.1 deg": each is of the axes
 * whose unit it fits; NULL: no key may move.  Called before repair_solve.
 * STATUS_INPUT with a message. */
enum status repair_tolerance(struct repair *self, const char *text);

/* STATUS_OK; STATUS_REFUSED where the method does not bring the move inside its
 * limits, STATUS_INPUT where it is not for such a move: with a message of
 * `before`. */
enum status repair_solve(struct repair *self, const struct files *files);
void repair_free(struct repair *self);

#endif
