/* firmware/linux/service/loop.c - see loop.h. */
#define _GNU_SOURCE /* RUSAGE_THREAD, pthread_attr_setaffinity_np */
#include "firmware/linux/service/loop.h"

#include <errno.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>

#include "firmware/linux/machine/pace.h"
#include "motion/core/err.h"

#define LOOP_SAID_NS     INT64_C(1000000000) /* once in */
#define LOOP_VIEW_NS     INT64_C(50000000)   /* between two looks at buses */
#define LOOP_STACK       262144
#define LOOP_FAULT_TICKS 32 /* between two looks at page faults */

void service_loop_init(struct service_loop *loop, struct machine *machine,
                       int cpu)
{
    loop->machine = machine;
    shutdown_init(&loop->shutdown, machine);
    loop->cpu = cpu;
    loop->now_ns = hal_clock_now_ns(machine->ports.clock);
    loop->state = machine->controller.state;
    mailbox_init(&loop->mailbox);
    service_board_init(&loop->board, machine->rig, &loop->memory);
    machine_view_init(&loop->view, machine->rig, &loop->memory);
    loop->axis_said = memory_pool_new(&loop->memory, machine->rig->axis_count,
                                      sizeof *loop->axis_said);
    loop->bus_said = memory_pool_new(&loop->memory, machine->rig->bus_count,
                                     sizeof *loop->bus_said);
    for (unsigned i = 0; i < machine->rig->axis_count; i++)
        loop->axis_said[i].drive_ns = loop->now_ns - LOOP_SAID_NS;
    for (unsigned i = 0; i < machine->rig->bus_count; i++)
        loop->bus_said[i].ns = loop->now_ns - LOOP_SAID_NS;
}

void service_loop_free(struct service_loop *loop)
{
    shutdown_free(&loop->shutdown);
    memory_pool_free(&loop->memory);
}

/* --- what is said --- */

static void loop_homing_text(const struct machine *machine,
                             char text[HOMING_TEXT_MAX])
{
    char why[HOMING_TEXT_MAX];
    text[0] = '\0';
    if (machine->homing.state == HOMING_FAILED)
        snprintf(text, HOMING_TEXT_MAX, "%s",
                 homing_failure(&machine->homing, why));
}

static void loop_say(struct service_loop *loop, enum service_event_kind kind)
{
    struct service_event event = {
        .kind = kind,
        .now_ns = loop->now_ns,
        .state = loop->machine->controller.state,
        .fault = loop->machine->controller.fault.fault,
        .count = loop->machine->controller.ticks_lost,
    };
    if (kind == SERVICE_EVENT_FAULT) {
        event.now_ns = loop->machine->controller.fault.t_ns;
        machine_fault_text(loop->machine, event.text);
    }
    if (kind == SERVICE_EVENT_HOMING)
        loop_homing_text(loop->machine, event.text);
    service_board_put(&loop->board, &event);
}

static void loop_say_axis(struct service_loop *loop, unsigned i)
{
    struct row_notes_axis *said = &loop->axis_said[i];
    const struct warning *warning = &loop->machine->warnings[i].newest;
    struct service_event event = {
        .now_ns = loop->now_ns,
        .state = loop->machine->controller.state,
        .index = i,
    };
    if (row_notes_warning(said, warning)) {
        event.kind = SERVICE_EVENT_WARNING;
        event.warning = *warning;
        service_board_put(&loop->board, &event);
    }
    if (row_notes_drive(said,
                        &loop->machine->controller.axis[i].feedback.events,
                        loop->now_ns, LOOP_SAID_NS, &event.drive)) {
        event.kind = SERVICE_EVENT_DRIVE;
        service_board_put(&loop->board, &event);
    }
}

static void loop_say_bus(struct service_loop *loop, unsigned i)
{
    const uint32_t warnings = machine_bus_warnings(loop->machine, i);
    const struct service_event event = {
        .kind = SERVICE_EVENT_BUS,
        .now_ns = loop->now_ns,
        .state = loop->machine->controller.state,
        .index = i,
        .count = warnings,
    };
    if (row_notes_bus(&loop->bus_said[i], warnings, loop->now_ns, LOOP_SAID_NS))
        service_board_put(&loop->board, &event);
}

static void loop_say_guardian(struct service_loop *loop)
{
    const struct guardian_sight *sight = &loop->machine->sight;
    const struct service_event event = {
        .kind = SERVICE_EVENT_GUARDIAN,
        .now_ns = loop->now_ns,
        .state = loop->machine->controller.state,
        .count = sight->lost,
        .is_gone = sight->is_gone,
    };
    if (row_notes_guardian(&loop->guardian_said, sight->lost))
        service_board_put(&loop->board, &event);
}

static void loop_say_events(struct service_loop *loop)
{
    const struct controller *controller = &loop->machine->controller;
    const bool homing = homing_is_running(&loop->machine->homing);
    if (controller->state != loop->state)
        loop_say(loop, SERVICE_EVENT_STATE);
    for (unsigned i = 0; i < loop->machine->rig->axis_count; i++)
        loop_say_axis(loop, i);
    for (unsigned i = 0; i < loop->machine->rig->bus_count; i++)
        loop_say_bus(loop, i);
    loop_say_guardian(loop);
    if (controller->fault.is_whole && !loop->fault_told)
        loop_say(loop, SERVICE_EVENT_FAULT);
    if (loop->homing && !homing)
        loop_say(loop, SERVICE_EVENT_HOMING);
    if (controller->ticks_lost != loop->lost &&
        loop->now_ns - loop->lost_ns >= LOOP_SAID_NS) {
        loop_say(loop, SERVICE_EVENT_LOST);
        loop->lost = controller->ticks_lost;
        loop->lost_ns = loop->now_ns;
    }
    loop->state = controller->state;
    loop->fault_told = controller->fault.is_whole;
    loop->homing = homing;
}

/* Three copies take turns on the board, so what is not looked at on every tick
 * is kept here.  Of what the rig has, no more. */
static void loop_view(struct service_loop *loop, struct machine_view *view)
{
    struct machine *machine = loop->machine;
    if (loop->now_ns - loop->viewed_ns >= LOOP_VIEW_NS) {
        machine_view_ports(machine, &loop->view);
        loop->viewed_ns = loop->now_ns;
    }
    machine_view_axes(machine, view);
    machine_view_copy_ports(view, &loop->view);
}

static void loop_publish(struct service_loop *loop)
{
    const struct machine *machine = loop->machine;
    const struct controller *controller = &machine->controller;
    struct service_state *state = service_board_next(&loop->board);
    state->now_ns = loop->now_ns;
    state->ticks = controller->ticks;
    state->ticks_lost = controller->ticks_lost;
    state->late_ns = loop->late_ns;
    state->late_most_ns = loop->late_most_ns;
    state->page_faults = loop->page_faults;
    state->commands_done = atomic_load(&loop->mailbox.done);
    state->state = controller->state;
    state->enabling = controller->enabling;
    state->homing = homing_is_running(&machine->homing);
    state->starting = loop->shoot.is_due || service_follow_waits(&loop->follow);
    state->waits_for = machine->step.waits ? machine->step.frame : 0;
    state->jogging = controller->jog == &machine->jog &&
                     controller->state != CONTROLLER_READY &&
                     controller->state != CONTROLLER_OFF &&
                     controller->state != CONTROLLER_FAULT && !state->homing;
    state->reversed = controller->is_reversed;
    state->fault = controller->fault;
    machine_fault_text(machine, state->fault_text);
    loop_homing_text(machine, state->homing_text);
    state->homing_state = machine->homing.state;
    state->homing_axis = machine->homing.axis;
    state->rate = controller->rate;
    state->move_end_ns_q12 = controller->move_end_ns_q12;
    state->override_q30 = controller->override_q30;
    state->off = machine_is_off(machine);
    loop_view(loop, &state->view);
    if (loop->frames != NULL)
        service_frames_put(loop->frames, state);
    service_board_publish(&loop->board);
    if (loop->recording != NULL)
        service_recording_tick(loop->recording, machine, loop->now_ns,
                               loop->late_ns);
}

/* --- what is asked for --- */

static int loop_load(struct service_loop *loop,
                     const struct service_request *request)
{
    struct playback *playback = &loop->machine->playback;
    const struct service_motion *motion = request->motion;
    const int err = playback_load(playback, motion->track);
    if (err < 0)
        return err;
    for (unsigned i = 0; i < loop->machine->rig->axis_count; i++)
        if (motion->goal[i] != NULL)
            playback_set_goals(playback, i, motion->goal[i],
                               motion->goal_count[i]);
    frame_step_begin(&loop->machine->step, &motion->steps,
                     motion->steps.count == 0 || motion->step_line < 0
                         ? NULL
                         : &loop->machine->input[motion->step_line].gpio);
    return playback_repeat(playback, request->times, request->is_ping_pong);
}

/* The axes stand where it begins. */
static int loop_start(struct service_loop *loop,
                      const struct service_request *request)
{
    const struct plan_shots *shots = request->motion->shots;
    const int err = loop_load(loop, request);
    if (err < 0)
        return err;
    service_shoot_drop(&loop->shoot, loop->machine);
    if (request->follow != NULL)
        return service_follow_arm(&loop->follow, request->follow, loop->machine,
                                  loop->now_ns);
    return shots != NULL
               ? service_shoot_arm(&loop->shoot, loop->machine, shots)
               : playback_begin(&loop->machine->playback, 0, PLAYBACK_PLAY);
}

/* Is it what is played, or on its way to a time, and not to its first keys? */
static bool loop_plays(const struct service_loop *loop,
                       const struct service_motion *motion)
{
    const struct playback *playback = &loop->machine->playback;
    for (unsigned i = 0; i < loop->machine->rig->axis_count; i++)
        if (playback->axis[i].track != motion->track[i])
            return false;
    return playback->is_loaded && playback->state != PLAYBACK_IDLE;
}

/* From where the axes are, or from where it is held. */
static int loop_go(struct service_loop *loop,
                   const struct service_request *request)
{
    int err = MOTION_OK;
    if (loop->machine->controller.state == CONTROLLER_READY)
        err = loop_load(loop, request);
    else if (!loop_plays(loop, request->motion))
        err = MOTION_E_STATE;
    return err < 0
               ? err
               : playback_go(&loop->machine->playback, request->at_ns_q12,
                             request->stands ? PLAYBACK_STAND : PLAYBACK_HOLD);
}

static int loop_answer(struct service_loop *loop,
                       const struct service_request *request)
{
    switch (request->kind) {
    case SERVICE_START:
        return loop_start(loop, request);
    case SERVICE_GO:
        return loop_go(loop, request);
    case SERVICE_HOME:
        break;
    }
    return homing_start(&loop->machine->homing, request->axes);
}

/* True: there was a request; its answer is read once the board is out.  What was
 * asked for together with a stop does not undo it. */
static bool loop_request(struct service_loop *loop, bool is_stopped)
{
    struct service_request *request = &loop->request;
    if (atomic_load(&loop->turn) != SERVICE_ASKED)
        return false;
    request->why[0] = '\0';
    request->err = is_stopped ? MOTION_E_STATE : loop_answer(loop, request);
    if (request->err < 0 && !is_stopped && request->kind != SERVICE_HOME)
        machine_refusal_text(loop->machine, request->err, request->why);
    return true;
}

/* --- the tick --- */

/* Before its first tick the controller has no time to count from. */
static bool loop_obey(struct service_loop *loop)
{
    if (loop->machine->controller.ticks == 0)
        return false;
    return loop_request(loop,
                        mailbox_step(&loop->mailbox, &loop->machine->playback));
}

static void loop_run(struct service_loop *loop)
{
    const bool answered = loop_obey(loop);
    service_shoot_begin(&loop->shoot, loop->machine);
    machine_tick(loop->machine, loop->now_ns);
    service_shoot_step(&loop->shoot, loop->machine);
    service_follow_step(&loop->follow, loop->machine, loop->now_ns);
    loop_say_events(loop);
    loop_publish(loop);
    if (answered)
        atomic_store(&loop->turn, SERVICE_DONE);
}

static void loop_step(struct service_loop *loop)
{
    const int stops =
        shutdown_stops(&loop->shutdown, loop->now_ns, atomic_load(&loop->end));
    if (loop->shutdown.phase == SHUTDOWN_NONE && stops == 0) {
        loop_run(loop);
        return;
    }
    if (loop->shutdown.phase == SHUTDOWN_NONE)
        service_shoot_drop(&loop->shoot, loop->machine);
    shutdown_begin(&loop->shutdown, loop->now_ns, 0);
    if (shutdown_tick(&loop->shutdown, loop->now_ns))
        atomic_store(&loop->ended, true);
    loop_say_events(loop);
    loop_publish(loop);
}

/* --- the clock, and what the system did to us --- */

static void loop_wait(struct service_loop *loop)
{
    const int64_t period_ns = loop->machine->rig->period_ns;
    loop->now_ns =
        pace_wait(loop->machine->ports.clock, loop->now_ns + period_ns,
                  period_ns, &loop->late_ns);
    _Atomic uint32_t *count =
        &loop->board.late[service_late_bin(loop->late_ns / 1000)];
    atomic_store_explicit(count,
                          atomic_load_explicit(count, memory_order_relaxed) + 1,
                          memory_order_relaxed);
    if (loop->late_ns > loop->late_most_ns)
        loop->late_most_ns = loop->late_ns;
}

static long loop_page_faults(void)
{
    struct rusage usage = { .ru_minflt = 0 };
    (void)getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_minflt + usage.ru_majflt;
}

void service_loop_tick(struct service_loop *loop)
{
    loop_wait(loop);
    loop_step(loop);
}

static void *loop_main(void *context)
{
    struct service_loop *loop = context;
    loop->page_faults_before = loop_page_faults();
    for (unsigned i = 1; !atomic_load(&loop->ended); i++) {
        if (i % LOOP_FAULT_TICKS == 0)
            loop->page_faults = loop_page_faults() - loop->page_faults_before;
        service_loop_tick(loop);
    }
    return NULL;
}

/* --- the thread --- */

/* Ahead of everything that is not real-time where that is allowed. */
static int loop_create(struct service_loop *loop, bool first)
{
    const struct sched_param priority = { .sched_priority = SERVICE_PRIORITY };
    pthread_attr_t attributes;
    cpu_set_t cpus;
    int err = pthread_attr_init(&attributes);
    if (err != 0)
        return err;
    (void)pthread_attr_setstacksize(&attributes, LOOP_STACK);
    if (loop->cpu >= 0) {
        CPU_ZERO(&cpus);
        CPU_SET((unsigned)loop->cpu, &cpus);
        err = pthread_attr_setaffinity_np(&attributes, sizeof cpus, &cpus);
    }
    if (first) {
        (void)pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
        (void)pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
        (void)pthread_attr_setschedparam(&attributes, &priority);
    }
    if (err == 0)
        err = pthread_create(&loop->thread, &attributes, loop_main, loop);
    if (err == 0)
        (void)pthread_setname_np(loop->thread, "slew-tick");
    (void)pthread_attr_destroy(&attributes);
    return err;
}

int service_loop_start(struct service_loop *loop)
{
    const int64_t period_ns = loop->machine->rig->period_ns;
    loop->now_ns = hal_clock_now_ns(loop->machine->ports.clock) + period_ns;
    const int err = loop_create(loop, true);
    atomic_store(&loop->refused, err);
    return err == EPERM ? loop_create(loop, false) : err;
}

void service_loop_join(struct service_loop *loop)
{
    (void)pthread_join(loop->thread, NULL);
}
