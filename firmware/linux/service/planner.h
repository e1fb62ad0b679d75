/* firmware/linux/service/planner.h - reads and plans moves in a thread of its
 * own, one at a time.
 *
 * Of a move, what did not change since the one before it is taken over from there;
 * the tracks are the same to the bit.
 *
 * Neither the tick nor whoever answers the clients waits for it. */
#ifndef FIRMWARE_LINUX_SERVICE_PLANNER_H
#define FIRMWARE_LINUX_SERVICE_PLANNER_H

#include <pthread.h>
#include <stdatomic.h>

#include "firmware/host/job/job_approach.h"
#include "firmware/linux/service/loop.h"

#define SERVICE_PLAN_TEXT_MAX 2048

/* The way of an axis to its first key; by its drive's own profile: a goal. */
struct service_approach {
    struct motion_segment storage[JOB_APPROACH_SEGMENTS];
    struct motion_track track;
    struct controller_goal goal;
};

/* A move that was planned and judged, and the way to its first keys. */
struct service_move {
    struct job job;
    struct service_motion motion;
    enum status status;               /* OK: it may be played */
    char text[SERVICE_PLAN_TEXT_MAX]; /* why not, a line each */
    char *move_text;                  /* of its file */
    uint32_t planned, reused;         /* its spans; of the move before it */
    struct service_motion approach;
    struct service_approach *axis; /* of the rig */
    struct memory_pool memory;
};

void service_move_free(struct service_move *move);
/* Fills in `approach`: from where the axes of the rig were sent last to their
 * first keys at a quarter of their limits.  0: they are there; 1: there is
 * something to play; or an error of motion_ease_append_limited.  Not while it is
 * played. */
int service_move_approach(struct service_move *move,
                          const struct machine_view_axis axis[]);

enum service_plan_turn {
    SERVICE_PLAN_IDLE,
    SERVICE_PLAN_WORKING,
    SERVICE_PLAN_DONE,
    SERVICE_PLAN_END, /* the thread is to end */
};

struct service_planner {
    const char *rig_path;
    const char *rig_text; /* of the rig as the service has read it */
    size_t rig_length;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    enum service_plan_turn turn;
    char *text; /* of the move, the planner's to free */
    struct service_move *move;
    struct job *former; /* the thread's own; NULL: none was planned well */
};

/* 0 or an errno. */
int service_planner_start(struct service_planner *planner, const char *rig_path,
                          const char *rig_text, size_t rig_length);
/* Waits for what is being planned. */
void service_planner_end(struct service_planner *planner);
/* Of the text of a move file, a copy of which is made; false: one is being
 * planned. */
bool service_planner_ask(struct service_planner *planner, const char *text);
/* The move, the caller's now; NULL: nothing has been planned yet. */
struct service_move *service_planner_take(struct service_planner *planner);

#endif
