/* firmware/linux/service/planner.h - reads and plans moves in a process of its
 * own, one at a time.
 *
 *   service ----text, "plan", "give up"----> planner's process
 *      ^                                        | forks
 *      '---- a move, or why there is none ----- a process per move
 *
 * A text of a client may be anything, and so is what planning it takes: the
 * system bounds its time and its memory, which is not that of the tick, and ends
 * it at any time.  Whatever becomes of it, the service goes on.  Nobody waits for
 * it. */
#ifndef FIRMWARE_LINUX_SERVICE_PLANNER_H
#define FIRMWARE_LINUX_SERVICE_PLANNER_H

#include <sys/types.h>

#include "firmware/linux/service/move.h"

#define SERVICE_PLAN_FILE 262144
#define SERVICE_PLAN_MOVES                                                     \
    3 /* at one time: loaded, before that, and a new one */

struct service_plan_limit {
    int64_t time_ns; /* 0: 60 s */
    int64_t mib;     /* of memory; 0: 512; of a move that is kept a quarter */
};

enum service_plan_state {
    SERVICE_PLAN_NONE,   /* nothing is planned, or it still is */
    SERVICE_PLAN_DONE,   /* here is the move */
    SERVICE_PLAN_TIME,   /* it took too long, */
    SERVICE_PLAN_MEMORY, /* or too much memory, */
    SERVICE_PLAN_FAILED, /* or the planner has failed */
};

/* What is being done, for whoever waits. */
struct service_plan_progress {
    char doing[16], what[64]; /* "planning", "camera" */
    int64_t done, of;         /* of 0: unknown */
};

struct service_planner {
    const struct rig *rig;
    const char *rig_path;
    char
        folder[FILES_PATH_MAX]; /* of the rig; "": none, nothing can be named */
    struct service_plan_limit limit;
    pid_t process;
    int link; /* to it; -1: there is none any more */
    struct {
        int file;  /* in memory, that both have */
        bool lent; /* a move is in it */
    } result[SERVICE_PLAN_MOVES];
    unsigned slot;                  /* of the plan asked for last */
    struct service_plan_page *page; /* memory that both have */
    uint32_t number;                /* of the plan asked for last */
    bool works;
};

/* Forks: before there is another thread, and before memory is locked.  The rig
 * has been read, and stays.  0, or an errno. */
int service_planner_start(struct service_planner *planner,
                          const struct rig *rig, const char *rig_path,
                          const struct service_plan_limit *limit);
/* Whatever is being planned is given up. */
void service_planner_end(struct service_planner *planner);
/* The text of a move file, less than SERVICE_PLAN_FILE bytes, which is copied;
 * false: one is being planned, there are SERVICE_PLAN_MOVES, or there is no planner. */
bool service_planner_ask(struct service_planner *planner, const char *text);
void service_planner_give_up(struct service_planner *planner);
/* Once per plan that was not given up: what has become of it; with DONE a move,
 * the caller's. */
enum service_plan_state service_planner_take(struct service_planner *planner,
                                             struct service_move **move);
void service_planner_progress(const struct service_planner *planner,
                              struct service_plan_progress *progress);

#endif
