/* firmware/linux/service/loop.h - the tick of a service, in a thread of its
 * own.
 *
 * Until its end is asked for it does commands and moves; then it takes the way out
 * (firmware/linux/machine/shutdown.h), and has ended.
 *
 * It looks at the mailbox and at one request per tick, and says what it did on
 * the board.  It allocates nothing, takes no lock, opens and writes nothing:
 * whoever sends commands or reads states cannot delay it. */
#ifndef FIRMWARE_LINUX_SERVICE_LOOP_H
#define FIRMWARE_LINUX_SERVICE_LOOP_H

#include <pthread.h>

#include "firmware/control/mailbox.h"
#include "firmware/control/playback.h"
#include "firmware/host/recording/row_notes.h"
#include "firmware/linux/machine/shutdown.h"
#include "firmware/linux/service/follow.h"
#include "firmware/linux/service/frames.h"
#include "firmware/linux/service/recording.h"
#include "firmware/linux/service/shoot.h"

#define SERVICE_PRIORITY 40

/* What START plays: of each axis of the rig a track, or NULL where it stands;
 * and where its drive goes by its own profile, its goals. */
struct service_motion {
    const struct motion_track **track;
    const struct controller_goal **goal;
    unsigned *goal_count;
    struct frame_step_config steps; /* of a shoot that waits for each frame, */
    int step_line;                  /* for this line of the rig; -1: none */
    const struct plan_shots *shots; /* by line of the rig; NULL: no events */
};

enum service_request_kind { SERVICE_START, SERVICE_HOME, SERVICE_GO };

struct service_request {
    enum service_request_kind kind;
    const struct service_motion *motion; /* START, GO: outlives the move */
    int64_t at_ns_q12;                   /* GO: to there, and held, */
    bool stands;                         /* or READY */
    int64_t times;                       /* 0: until a stop */
    bool is_ping_pong;
    struct run_follow *follow; /* START: a clock that begins it; NULL: none */
    uint64_t axes;             /* HOME: a bit each */
    int err;                   /* the answer, */
    char why[JOB_APPROACH_TEXT_MAX]; /* and of START and GO in words */
};

enum service_request_turn { SERVICE_FREE, SERVICE_ASKED, SERVICE_DONE };

struct service_loop {
    struct machine *machine;
    struct memory_pool memory; /* taken before the first tick */
    struct mailbox mailbox;
    struct service_board board;
    struct service_frames *frames;       /* NULL: nobody takes any */
    struct service_recording *recording; /* NULL: there is none */
    int cpu;                             /* -1: any */
    pthread_t thread;                    /* once it was started */

    /* The sender's while FREE or DONE, the tick's while ASKED. */
    struct service_request request;
    _Atomic int turn;   /* enum service_request_turn */
    _Atomic int end;    /* asked for so often: signals, interrupt.h */
    _Atomic bool ended; /* nothing runs any more */
    struct shutdown shutdown;
    _Atomic int refused; /* errno why it has no real-time priority; 0: it has */

    /* the tick's alone */
    int64_t now_ns, late_ns, late_most_ns;
    long page_faults_before, page_faults;
    uint64_t lost; /* as it was said last, and when */
    int64_t lost_ns;
    enum controller_state state;
    bool fault_told, homing;
    struct row_notes_axis *axis_said;
    struct row_notes_bus *bus_said;
    uint32_t guardian_said;
    struct service_shoot shoot;
    struct service_follow follow;
    int64_t viewed_ns; /* buses and lines, the last time */
    struct machine_view view;
};

/* `loop` is all zero; service_loop_free in the end. */
void service_loop_init(struct service_loop *loop, struct machine *machine,
                       int cpu);
/* Waits for the next tick and does it: all that the thread does, for whoever has
 * none. */
void service_loop_tick(struct service_loop *loop);
/* 0, or an errno.  The caller has blocked the signals, which are for others. */
int service_loop_start(struct service_loop *loop);
/* Waits until it has ended. */
void service_loop_join(struct service_loop *loop);
void service_loop_free(struct service_loop *loop);

#endif
