/* motion/plan/plan_progress.h - how far long work has come, for whoever waits. */
#ifndef MOTION_PLAN_PLAN_PROGRESS_H
#define MOTION_PLAN_PLAN_PROGRESS_H

#include <stddef.h>
#include <stdint.h>

/* `tell` is called at the start of each part and, where a part is long, again
 * and again: what is done ("planning") to what ("camera"), and how much of how
 * much; of 0: unknown.  It must be quick; `what` is valid until the next call.
 * `what` NULL: the work is over, well or not. */
struct plan_progress {
    void (*tell)(void *context, const char *doing, const char *what,
                 int64_t done, int64_t of);
    void *context;
};

/* NULL for nobody. */
static inline void plan_progress_tell(const struct plan_progress *progress,
                                      const char *doing, const char *what,
                                      int64_t done, int64_t of)
{
    if (progress != NULL)
        progress->tell(progress->context, doing, what, done, of);
}

static inline void plan_progress_end(const struct plan_progress *progress)
{
    plan_progress_tell(progress, NULL, NULL, 0, 0);
}

#endif
