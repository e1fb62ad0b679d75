/* motion/path/lookat_time.h - a look-at camera as a rotation in time, ready to
 * bake.
 *
 * The camera's distance along its path is a track (its speed law), and so may
 * be its tilt.  Which way the right vector points past the vertical depends on
 * how the camera came there, so the walk is taken once, on an even grid, and
 * its states are kept; the rotation at a time then goes on from the state
 * before it and is the same however often it is asked for.  Plan-time. */
#ifndef MOTION_PATH_LOOKAT_TIME_H
#define MOTION_PATH_LOOKAT_TIME_H

#include "motion/core/track.h"
#include "motion/path/lookat.h"

struct motion_lookat_time {
    const struct motion_lookat *lookat;
    const struct motion_target *target;
    const struct motion_lookat_path *path;
    const struct motion_track *distance; /* unit; outside the path its end */
    const struct motion_track *tilt;     /* degrees; NULL: none */
    struct motion_quat mount;            /* rotation of the head's base */
    /* filled in */
    struct motion_lookat_state *state;
    uint32_t states;
};

/* Walk from 0 to the end of the distance track in `states` even steps, >= 1; a
 * view that turns by less than a quarter turn in each is followed over the
 * vertical.  `state` has room for that many and is kept.  MOTION_E_ARG for no
 * states, MOTION_E_EMPTY for an empty distance track, else what
 * motion_lookat_at returns. */
int motion_lookat_time_init(struct motion_lookat_time *time,
                            struct motion_lookat_state *state, uint32_t states);

/* The rotation as seen from the mount; the context is the struct, so it fits
 * struct motion_turning (head.h). */
int motion_lookat_time_at(void *context, int64_t t_ns_q12,
                          struct motion_quat *q);

#endif
