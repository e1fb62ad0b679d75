/* firmware/linux/service/control.h - the protocol of a service: what lines of
 * JSON mean, and who may move what.  docs/API.md, "The service", is its
 * reference.
 *
 * Runs in a thread that is not real-time.  Clients take turns, a request each.
 * One that goes to the tick waits until what went there before is answered, a
 * tick at most, and only its own client's later ones wait with it; jogs and
 * overrides wait for none of each other.  A stop goes beside that, from any client,
 * at once (clients.h), and takes back what was asked for before it and would set
 * something in motion. */
#ifndef FIRMWARE_LINUX_SERVICE_CONTROL_H
#define FIRMWARE_LINUX_SERVICE_CONTROL_H

#include "firmware/linux/service/clients.h"
#include "firmware/linux/service/loop.h"
#include "firmware/linux/service/planner.h"

#define SERVICE_VERSION         1
#define SERVICE_FOLLOW_TEXT     200
#define SERVICE_COUPLE_TEXT_MAX 400

/* What an axis follows another by: two, of which the tick has one at most. */
struct service_cam {
    struct controller_cam cam[2];
    struct motion_track track[2]; /* on the heap */
    unsigned which;               /* the tick took last */
    int64_t low_q32;              /* of the one that is being made */
};

/* What is on its way to the tick. */
struct service_flight {
    bool by_request;
    enum mailbox_command command;
    uint64_t asker; /* number of the client; 0: nobody waits for the answer */
    unsigned seat;
    char id[SERVICE_ID_MAX];
};
/* Of clients: the rest of the mailbox is for what the service sends itself. */
#define SERVICE_FLIGHTS_ASKED (MAILBOX_CAPACITY - 4)
#define SERVICE_FLIGHTS       (MAILBOX_CAPACITY + 1)

struct service_control {
    const struct rig *rig;
    const char *rig_path;
    uint32_t rig_crc;
    bool is_real, is_locked;
    const char *rig_text;
    size_t rig_length;
    const char *clock; /* a stream that clients may follow, its real path; NULL:
                          none but those below the rig's folder */
    struct service_loop *loop;
    struct service_recording *recording; /* NULL: none */
    struct service_planner planner;
    struct service_clients clients;

    const struct service_state *state; /* as it was last read */
    int64_t now_ns;
    struct service_move *move, *old_move; /* loaded; the one before it, which
                                             the controller may still name */
    uint32_t loads;

    struct service_client *holder; /* has control; NULL: nobody */
    int64_t lease_ns, lease_end_ns;
    struct {
        uint64_t asker; /* number of the client; 0: nothing is planned */
        unsigned seat;
        bool loads;
        char id[SERVICE_ID_MAX];
        int64_t since_ns, told_ns;
    } plan;

    bool jogged;         /* the holder has sent a jog */
    bool jog_stops;      /* a jog whose holder is gone is to be stopped */
    int64_t jog_held_ns; /* the holder's jogs follow one another until then */
    uint32_t jog_held_stops; /* there had been so many as the first one came */

    bool goes_on; /* a request was done: there may be another */
    struct service_flight flight[SERVICE_FLIGHTS]; /* to the tick, in order */
    unsigned flight_first, flights;
    int64_t *capture_q32; /* of each axis of the rig */
    struct service_cam *cam;

    /* a clock that a move keeps to */
    bool follow_opened;
    struct run_follow follow;
    char follow_text[SERVICE_FOLLOW_TEXT]; /* what was said of it last */
};

/* What it needs for each axis of its rig, which is set, from the pool. */
void service_control_reserve(struct service_control *control,
                             struct memory_pool *pool);
/* What a client may ask for: see docs/API.md. */
void service_control_step(struct service_control *control, int timeout_ms);

/* commands.c: the next request of a client; false: there is none, or it waits. */
bool service_command(struct service_control *control,
                     struct service_client *client);
/* The answer to what was on its way. */
void service_command_answer(struct service_control *control,
                            const struct service_flight *flight,
                            const struct mailbox_entry *entry);
/* Something was sent that nobody waits for. */
void service_flies(struct service_control *control,
                   enum mailbox_command command);
/* The client that asked; NULL: it is gone. */
struct service_client *service_asker(struct service_control *control,
                                     uint64_t number, unsigned seat);
/* commands_move.c: what has become of a plan; and nobody waits for one any
 * more, of which its client is told why, unless that is gone. */
void service_plan_step(struct service_control *control);
void service_plan_give_up(struct service_control *control, const char *why);
/* commands_record.c: a file named by the time; its end is an event, a fault a
 * line in it. */
void service_record_by_time(struct service_control *control);
void service_record_step(struct service_control *control);
void service_record_fault(struct service_control *control, int64_t now_ns,
                          const char *text);
/* commands_couple.c: the tick took the spare cam of an axis; the end. */
void service_cam_taken(struct service_control *control, unsigned axis);
void service_cam_free(struct service_control *control);
/* commands_follow.c: steers, and ends what is over; the end, once the tick is. */
void service_follow_control(struct service_control *control);
void service_follow_free(struct service_control *control);
/* {"event": NAME, "t_s": ...} */
cJSON *service_event_object(const char *name, int64_t now_ns);
/* Who has control. */
cJSON *service_control_object(const struct service_control *control,
                              const struct service_client *client);
void service_tell_all(struct service_control *control, const cJSON *object);
/* The holder has lost it, or given it back. */
void service_release(struct service_control *control, const char *why);

/* report.c: the state of the machine, into an object. */
/* Its name without CONTROLLER_FAULT_, for programs. */
const char *service_fault_code(enum controller_fault fault);
void service_report_state(const struct service_control *control, cJSON *object);
/* The rest of what drives, buses and lines say, into the same. */
void service_report_machine(const struct service_control *control,
                            cJSON *object);
/* And what the service is: versions, rig, axes, figures of the tick. */
void service_report_hello(const struct service_control *control, cJSON *object);
void service_report_tick(const struct service_control *control, cJSON *object);
/* Those, and how often a tick was how late. */
void service_report_latency(const struct service_control *control,
                            cJSON *object);

#endif
