/* firmware/linux/machine/shutdown.c - see shutdown.h. */
#include "firmware/linux/machine/shutdown.h"

#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/linux/base/error.h"
#include "firmware/linux/base/interrupt.h"

#define SHUTDOWN_NS_PER_S    INT64_C(1000000000)
#define SHUTDOWN_REST_NS     (5 * SHUTDOWN_NS_PER_S) /* on top of two stops */
#define SHUTDOWN_REST_MAX_NS (3600 * SHUTDOWN_NS_PER_S)
#define SHUTDOWN_EXIT_MS     5 /* from look to look of a thread that exits */

/* --- exit() and abort(): nothing here that a handler of a signal may not do --- */

static _Atomic int shutdown_live; /* machines that are not DONE */
static _Atomic bool shutdown_exits;
static _Thread_local bool shutdown_is_tick;

static void shutdown_await(void)
{
    if (shutdown_is_tick || atomic_load(&shutdown_live) == 0)
        return;
    atomic_store(&shutdown_exits, true);
    while (atomic_load(&shutdown_live) > 0)
        (void)poll(NULL, 0, SHUTDOWN_EXIT_MS);
}

static void shutdown_on_exit(void)
{
    shutdown_await();
}

/* Then it dies of it, as it would have. */
static void shutdown_on_abort(int number)
{
    shutdown_await();
    (void)signal(number, SIG_DFL);
    (void)raise(number);
}

/* From the first tick on there may be torque. */
static void shutdown_live_begin(struct shutdown *shutdown)
{
    static atomic_flag is_registered = ATOMIC_FLAG_INIT;
    if (shutdown->is_live)
        return;
    if (!atomic_flag_test_and_set(&is_registered)) {
        (void)atexit(shutdown_on_exit);
        (void)signal(SIGABRT, shutdown_on_abort);
    }
    shutdown->is_live = shutdown_is_tick = true;
    atomic_fetch_add(&shutdown_live, 1);
}

static void shutdown_live_end(struct shutdown *shutdown)
{
    if (shutdown->is_live)
        atomic_fetch_sub(&shutdown_live, 1);
    shutdown->is_live = false;
}

/* --- begin and end --- */

/* Twice what the slowest axis takes from full speed by its stop limits. */
static int64_t shutdown_rest_ns(const struct rig *rig)
{
    double most_s = 0;
    for (unsigned i = 0; i < rig->axis_count; i++) {
        const struct rig_axis *axis = &rig->axis[i];
        double s = (double)axis->limit.vel_q32 / (double)axis->stop_acc_q32;
        if (axis->stop_jerk_q32 > 0)
            s += (double)axis->stop_acc_q32 / (double)axis->stop_jerk_q32;
        most_s = s > most_s ? s : most_s;
    }
    const double ns = 2 * most_s * (double)SHUTDOWN_NS_PER_S;
    return ns < (double)SHUTDOWN_REST_MAX_NS ? (int64_t)ns + SHUTDOWN_REST_NS
                                             : SHUTDOWN_REST_MAX_NS;
}

void shutdown_init(struct shutdown *shutdown, struct machine *machine)
{
    shutdown->machine = machine;
    shutdown->rest_ns = shutdown_rest_ns(machine->rig);
    shutdown->least_ns = SHUTDOWN_LEAST_NS;
    shutdown->off_ns = SHUTDOWN_OFF_NS;
    shutdown->waiting_size =
        (size_t)machine->rig->axis_count * MACHINE_TORQUE_MAX + 1;
    shutdown->waiting =
        memory_pool_new(&shutdown->memory, shutdown->waiting_size, 1);
}

static void shutdown_enter(struct shutdown *shutdown, enum shutdown_phase phase,
                           int64_t now_ns)
{
    shutdown->phase = phase;
    shutdown->phase_ns = now_ns;
}

/* What is not confirmed off is the guardian's from now on. */
static void shutdown_done(struct shutdown *shutdown)
{
    const struct machine *machine = shutdown->machine;
    if (machine_is_off(machine))
        guardian_done(machine->ports.guardian);
    else
        guardian_leave(machine->ports.guardian);
    shutdown->phase = SHUTDOWN_DONE;
    shutdown_live_end(shutdown);
}

void shutdown_free(struct shutdown *shutdown)
{
    shutdown_live_end(shutdown);
    memory_pool_free(&shutdown->memory);
    memset(shutdown, 0, sizeof *shutdown);
}

/* --- signals --- */

int shutdown_stops(struct shutdown *shutdown, int64_t now_ns, int signals)
{
    const bool exits = signals == 0 && atomic_load(&shutdown_exits);
    const int stops = exits ? 1 : signals;
    const bool is_apart = shutdown->stops == 0 ||
                          now_ns - shutdown->stops_ns >= SHUTDOWN_APART_NS;
    if (exits)
        interrupt_end(); /* whoever else counts them is told */
    if (stops > shutdown->stops) {
        shutdown->may_give_up = is_apart && stops >= 2 &&
                                (atomic_load(&shutdown->waits) ||
                                 machine_is_torque_lost(shutdown->machine));
        shutdown->stops = stops;
        shutdown->stops_ns = now_ns;
    } else if (shutdown->may_give_up && is_apart) {
        shutdown->gives_up = true;
        if (shutdown->off_ns > SHUTDOWN_OFF_NS)
            shutdown->off_ns = SHUTDOWN_OFF_NS;
    }
    shutdown_live_begin(shutdown);
    return stops;
}

/* --- the way out --- */

static bool shutdown_moves(const struct machine *machine)
{
    const enum controller_state state = machine->controller.state;
    return homing_is_running(&machine->homing) || state == CONTROLLER_MOVING ||
           state == CONTROLLER_HOLDING || state == CONTROLLER_STOPPING;
}

static void shutdown_rested(struct shutdown *shutdown, int64_t now_ns)
{
    shutdown_enter(shutdown,
                   shutdown->settle_ns > 0 ? SHUTDOWN_SETTLE : SHUTDOWN_OFF,
                   now_ns);
}

void shutdown_begin(struct shutdown *shutdown, int64_t now_ns,
                    int64_t settle_ns)
{
    if (shutdown->phase != SHUTDOWN_NONE)
        return;
    shutdown->settle_ns = settle_ns;
    if (shutdown_moves(shutdown->machine))
        shutdown_enter(shutdown, SHUTDOWN_REST, now_ns);
    else
        shutdown_rested(shutdown, now_ns);
}

/* The controller knows by when a stop along a path is at rest, and sees to it. */
static void shutdown_rest(struct shutdown *shutdown, int64_t now_ns)
{
    struct machine *machine = shutdown->machine;
    controller_stop(&machine->controller);
    machine_tick(machine, now_ns);
    if (!shutdown_moves(machine))
        shutdown_rested(shutdown, now_ns);
    else if (now_ns - shutdown->phase_ns > shutdown->rest_ns &&
             machine->controller.rest_by_ns == 0)
        shutdown_enter(shutdown, SHUTDOWN_QUICK, now_ns);
}

static void shutdown_settle(struct shutdown *shutdown, int64_t now_ns)
{
    machine_tick(shutdown->machine, now_ns);
    if (now_ns - shutdown->phase_ns >= shutdown->settle_ns ||
        shutdown->machine->controller.state != CONTROLLER_READY)
        shutdown_enter(shutdown, SHUTDOWN_OFF, now_ns);
}

static void shutdown_quick(struct shutdown *shutdown, int64_t now_ns)
{
    machine_tick_quick_stop(shutdown->machine, now_ns);
    if (machine_is_at_rest(shutdown->machine) ||
        now_ns - shutdown->phase_ns >= SHUTDOWN_QUICK_NS)
        shutdown_enter(shutdown, SHUTDOWN_OFF, now_ns);
}

static void shutdown_wait(struct shutdown *shutdown)
{
    char text[MACHINE_TORQUE_MAX];
    size_t at = 0;
    if (atomic_load(&shutdown->waits))
        return;
    for (unsigned i = 0; i < shutdown->machine->rig->axis_count; i++) {
        machine_torque_text(shutdown->machine, i, text);
        if (text[0] != '\0')
            at += (size_t)snprintf(shutdown->waiting + at,
                                   shutdown->waiting_size - at, "%s: %s\n",
                                   shutdown->machine->rig->axis[i].name, text);
        if (at >= shutdown->waiting_size)
            break;
    }
    atomic_store(&shutdown->waits, true);
}

/* One that brakes has its time for that as well. */
static void shutdown_off(struct shutdown *shutdown, int64_t now_ns)
{
    struct machine *machine = shutdown->machine;
    const int64_t in_phase_ns = now_ns - shutdown->phase_ns;
    machine_tick_off(machine, now_ns);
    if (in_phase_ns < shutdown->least_ns)
        return;
    if (machine_is_off(machine)) {
        shutdown_done(shutdown);
        return;
    }
    if (in_phase_ns < shutdown->off_ns ||
        (machine_brakes(machine) &&
         in_phase_ns < shutdown->off_ns + SHUTDOWN_OFF_NS))
        return;
    if (machine->ports.is_real && !shutdown->gives_up)
        shutdown_wait(shutdown);
    else
        shutdown_done(shutdown);
}

bool shutdown_tick(struct shutdown *shutdown, int64_t now_ns)
{
    const int stops = shutdown->stops;
    static void (*const step[])(struct shutdown * shutdown, int64_t now_ns) = {
        [SHUTDOWN_REST] = shutdown_rest,
        [SHUTDOWN_SETTLE] = shutdown_settle,
        [SHUTDOWN_QUICK] = shutdown_quick,
        [SHUTDOWN_OFF] = shutdown_off,
    };
    if (stops >= 2 && shutdown->phase == SHUTDOWN_REST)
        shutdown_enter(shutdown, SHUTDOWN_QUICK, now_ns);
    if (stops >= 2 && shutdown->phase == SHUTDOWN_SETTLE)
        shutdown_enter(shutdown, SHUTDOWN_OFF, now_ns);
    if (shutdown->phase != SHUTDOWN_DONE)
        step[shutdown->phase](shutdown, now_ns);
    return shutdown->phase == SHUTDOWN_DONE;
}

/* --- what is said --- */

void shutdown_say_waiting(struct shutdown *shutdown)
{
    if (shutdown->said || !atomic_load(&shutdown->waits))
        return;
    char text[160];
    snprintf(text, sizeof text,
             "it is tried until the drive confirms it; Ctrl-C once more leaves "
             "that to the guardian, for %d s\n",
             (int)(GUARDIAN_OFF_NS / SHUTDOWN_NS_PER_S));
    shutdown->said = true;
    error_put("\n");
    error_put(shutdown->waiting);
    error_put(text);
}

bool shutdown_say_torque(const struct machine *machine)
{
    char text[MACHINE_TORQUE_MAX];
    for (unsigned i = 0; i < machine->rig->axis_count; i++) {
        machine_torque_text(machine, i, text);
        if (text[0] != '\0')
            error_say("%s: %s%s", machine->rig->axis[i].name, text,
                      machine->ports.guardian != NULL
                          ? "; the guardian goes on trying"
                          : "");
    }
    return machine_is_off(machine);
}
