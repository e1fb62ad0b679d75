/* firmware/linux/service/state.h - what the tick of a service says to the rest
 * of the process.
 *
 * Three copies: one is the tick's, one is the reader's, and one goes from hand
 * to hand by one atomic exchange.  Neither side waits for the other, and what
 * the reader has is whole.  Events go through a ring beside it, so that a state
 * that lasted one tick is seen too; when nobody reads they are counted. */
#ifndef FIRMWARE_LINUX_SERVICE_STATE_H
#define FIRMWARE_LINUX_SERVICE_STATE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "firmware/linux/machine/view.h"

#define SERVICE_EVENTS 64 /* a power of 2 */

/* Wake-ups are counted by how late they were: by whole us below the first, by
 * so many us from there on, and those of the last and later together. */
#define SERVICE_LATE_FINE_US 2000
#define SERVICE_LATE_STEP_US 100
#define SERVICE_LATE_MOST_US 20000
#define SERVICE_LATE_BINS                                                      \
    (SERVICE_LATE_FINE_US + 1 +                                                \
     (SERVICE_LATE_MOST_US - SERVICE_LATE_FINE_US) / SERVICE_LATE_STEP_US)

struct service_state {
    int64_t now_ns; /* nominal time of the tick, CLOCK_MONOTONIC */
    uint64_t ticks, ticks_lost;
    int64_t late_ns, late_most_ns; /* of the wake-up; since the start */
    long page_faults;              /* of the tick's thread since the start */
    uint32_t commands_done;        /* of the mailbox, ever */
    enum controller_state state;
    bool enabling, homing, jogging, reversed;
    bool starting; /* a move whose first event comes before its start, or whose
                      clock is not there yet */
    struct controller_fault_record fault;
    char fault_text[MACHINE_FAULT_MAX]; /* "pan: the drive ...", or "" */
    char homing_text[HOMING_TEXT_MAX];  /* why the last one failed, or "" */
    enum homing_state homing_state;
    unsigned homing_axis; /* in its turn, or that failed */
    struct motion_clock_rate rate;
    int64_t move_end_ns_q12;
    int64_t override_q30;
    uint32_t waits_for; /* this frame of a shoot, from 1; 0: for none */
    bool off;           /* every drive that had torque says that it has none */
    struct machine_view view;
};

enum service_event_kind {
    SERVICE_EVENT_STATE,    /* the controller's state has changed */
    SERVICE_EVENT_FAULT,    /* text: what it is */
    SERVICE_EVENT_HOMING,   /* it is over; text: why it failed, or "" */
    SERVICE_EVENT_LOST,     /* ticks were lost: count */
    SERVICE_EVENT_WARNING,  /* of an axis; text: what it is */
    SERVICE_EVENT_DRIVE,    /* what the drive of an axis says without a fault */
    SERVICE_EVENT_BUS,      /* a bus warns: count, since the start */
    SERVICE_EVENT_GUARDIAN, /* it was lost: count, since the start; is_gone */
};

struct service_event {
    enum service_event_kind kind;
    int64_t now_ns;
    enum controller_state state;
    enum controller_fault fault;
    uint64_t count;
    unsigned index; /* WARNING, DRIVE: axis of the rig; BUS: bus */
    bool is_gone;   /* GUARDIAN: no other has taken its place */
    union {
        struct warning warning;
        struct hal_drive_events drive; /* since the last such event */
    };
    char text[MACHINE_FAULT_MAX];
};

struct service_board {
    struct service_state copy[3];
    _Atomic unsigned between; /* index; SERVICE_FRESH when it was not read */
    unsigned tick, reader;    /* indices, each of one side alone */
    struct service_event event[SERVICE_EVENTS];
    _Atomic uint32_t put, taken;
    _Atomic uint32_t events_lost;
    _Atomic uint32_t late[SERVICE_LATE_BINS]; /* how often */
};

/* The bin of a wake-up, and the least us of a bin. */
static inline unsigned service_late_bin(int64_t us)
{
    if (us < SERVICE_LATE_FINE_US)
        return us < 0 ? 0 : (unsigned)us;
    if (us >= SERVICE_LATE_MOST_US)
        return SERVICE_LATE_BINS - 1;
    return SERVICE_LATE_FINE_US +
           (unsigned)(us - SERVICE_LATE_FINE_US) / SERVICE_LATE_STEP_US;
}

static inline unsigned service_late_us(unsigned bin)
{
    return bin < SERVICE_LATE_FINE_US
               ? bin
               : SERVICE_LATE_FINE_US +
                     (bin - SERVICE_LATE_FINE_US) * SERVICE_LATE_STEP_US;
}

#define SERVICE_FRESH 4u

static inline void service_board_init(struct service_board *board,
                                      const struct rig *rig,
                                      struct memory_pool *pool)
{
    board->tick = 0;
    board->reader = 1;
    atomic_init(&board->between, 2);
    for (unsigned i = 0; i < 3; i++)
        machine_view_init(&board->copy[i].view, rig, pool);
}

/* Between two of one rig. */
static inline void service_state_copy(struct service_state *to,
                                      const struct service_state *from)
{
    const struct machine_view view = to->view;
    *to = *from;
    to->view = view;
    machine_view_copy(&to->view, &from->view);
}

/* The tick's: the copy to be filled in, all of it; and out with it. */
static inline struct service_state *
service_board_next(struct service_board *board)
{
    return &board->copy[board->tick];
}

static inline void service_board_publish(struct service_board *board)
{
    board->tick =
        atomic_exchange(&board->between, board->tick | SERVICE_FRESH) & 3u;
}

/* The reader's: the latest. */
static inline const struct service_state *
service_board_read(struct service_board *board)
{
    if ((atomic_load(&board->between) & SERVICE_FRESH) != 0)
        board->reader = atomic_exchange(&board->between, board->reader) & 3u;
    return &board->copy[board->reader];
}

/* The tick's. */
static inline void service_board_put(struct service_board *board,
                                     const struct service_event *event)
{
    const uint32_t put = atomic_load(&board->put);
    if (put - atomic_load(&board->taken) == SERVICE_EVENTS) {
        atomic_store(&board->events_lost, atomic_load(&board->events_lost) + 1);
        return;
    }
    board->event[put % SERVICE_EVENTS] = *event;
    atomic_store(&board->put, put + 1);
}

/* The reader's; false: there is none. */
static inline bool service_board_take(struct service_board *board,
                                      struct service_event *event)
{
    const uint32_t taken = atomic_load(&board->taken);
    if (taken == atomic_load(&board->put))
        return false;
    *event = board->event[taken % SERVICE_EVENTS];
    atomic_store(&board->taken, taken + 1);
    return true;
}

#endif
