/* motion/plan/camera/plan_along.h - axes that take something along a path through
 * space, by inverse kinematics: what carries a head (plan_carry.h), an arm
 * (plan_tool.h).
 *
 * Where more than one answer is, the nearest to the one before is taken.  So the
 * path is walked along first, in rows, from each to the next; what the baker
 * looks at afterwards, in any order, starts from the row before it. */
#ifndef MOTION_PLAN_PLAN_ALONG_H
#define MOTION_PLAN_PLAN_ALONG_H

#include "motion/plan/camera/plan_bake.h"
#include "motion/plan/path/plan_path.h"

#define PLAN_ALONG_CAUSES (2 * PLAN_SPACE_AXES + 1 + MOTION_ARM_JOINTS_MAX)

struct plan_along {
    const struct plan_path *path;
    struct plan_error *error;
    /* The mechanism's, called with `context`.  open, if not NULL: once the path
     * is planned, to say what else the axes follow; on an error with its
     * sentence.  begin: once `rows` and `place`
     * are there, before row 0 .. rows in order.  refusal: its own words for an
     * error, else NULL. */
    void *context;
    int (*open)(void *context, const struct plan_drive *drive);
    int (*begin)(void *context);
    int (*row)(void *context, uint32_t row, int64_t t_ns_q12);
    int (*at)(void *context, int64_t t_ns_q12, enum motion_bake_side side,
              struct motion_bake_point point[]);
    const char *(*refusal)(int err);

    struct motion_track place[PLAN_SPACE_AXES];
    struct plan_bake bake;
    const struct motion_track *cause[PLAN_ALONG_CAUSES]; /* with the path's */
    uint32_t causes;
    const int64_t *time_ns_q12; /* other times when a derivative may step */
    uint32_t times;
    uint32_t rows;
    int64_t last_ns_q12; /* that was looked at */
};

/* The axes follow this track too. */
void plan_along_cause(struct plan_along *self,
                      const struct motion_track *track);

/* The row at or before a time. */
uint32_t plan_along_row(const struct plan_along *self, int64_t t_ns_q12);

/* Plan the path, and `axes` tracks that are empty; as plan_path_tracks
 * (plan_path.h) on an error, with the place and the time in the sentence.
 * *bound_q32 is raised to how far an axis may be from what the path requires. */
int plan_along_tracks(struct plan_along *self, struct plan_drive *drive,
                      struct motion_track *const list[], uint32_t axes,
                      int64_t *bound_q32);

#endif
