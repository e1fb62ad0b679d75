/* motion/plan/plan_progress.h - how far planning has come, for whoever
 * waits. */
#ifndef MOTION_PLAN_PLAN_PROGRESS_H
#define MOTION_PLAN_PLAN_PROGRESS_H

#include <stddef.h>
#include <stdint.h>

/* `tell` is called at the start of each part and, of a camera, at every look:
 * what is planned, and how much of it is done.  It must be quick, and `what` is
 * valid as long as the move.  NULL: planning is over, well or not. */
struct plan_progress {
    void (*tell)(void *context, const char *what, int64_t done, int64_t of);
    void *context;
};

/* NULL for nobody. */
static inline void plan_progress_tell(const struct plan_progress *progress,
                                      const char *what, int64_t done,
                                      int64_t of)
{
    if (progress != NULL)
        progress->tell(progress->context, what, done, of);
}

#endif
