/* firmware/linux/player/player.c - see player.h. */
#include "firmware/linux/player/player.h"

#include <pthread.h>
#include <sched.h>
#include <string.h>
#include <time.h>

#include "firmware/host/track/compiled.h"
#include "firmware/linux/machine/machine_trigger.h"
#include "firmware/linux/machine/pace.h"
#include "firmware/linux/player/player_phase.h"

#define PLAYER_MS         INT64_C(1000000)
#define PLAYER_OBSERVE_NS (20 * PLAYER_MS)
#define PLAYER_PRIORITY   40

static void player_storage(struct player *player, const struct rig *rig)
{
    const uint32_t axes = rig->axis_count;
    struct telemetry_row *row = &player->row;
#define CAPACITY(array, count)                                                 \
    array = memory_pool_new(&player->memory, count, sizeof *(array))
    CAPACITY(player->busy_ns, rig->bus_count);
    row->shot_count = rig_trigger_count(rig);
    CAPACITY(row->axis, axes);
    CAPACITY(row->bus_warnings, rig->bus_count);
    CAPACITY(row->shot, row->shot_count);
#undef CAPACITY
}

void player_free(struct player *player)
{
    recorder_free(&player->recorder);
    shutdown_free(&player->shutdown);
    memory_pool_free(&player->memory);
}

void player_init(struct player *player, struct machine *machine,
                 const struct job *job, const struct player_config *config,
                 const struct player_observer *observer)
{
    player_free(player);
    memset(player, 0, sizeof *player);
    player_storage(player, &job->rig);
    player->machine = machine;
    player->job = job;
    player->config = *config;
    player->observer = *observer;
    player->standing_ns = -1;
    recorder_init(&player->recorder, &job->rig);
    shutdown_init(&player->shutdown, machine);
    player->start = (struct run_start){ .wall_ns = config->start_wall_ns,
                                        .line = config->start_line };
    player->start_ns = run_start_align_ns(
        &player->start, machine->ports.clock,
        hal_clock_now_ns(machine->ports.clock), job->rig.period_ns);
    player->now_ns = player->start_ns;
    if (config->faults != NULL)
        config->faults->start_ns = player->start_ns;
}

/* --- looking on --- */

static void player_observe(void *context, struct telemetry_row *row)
{
    const struct player *player = context;
    const struct player_observer *observer = &player->observer;
    if (observer->telemetry != NULL)
        telemetry_write(observer->telemetry, row);
    if (observer->record != NULL)
        run_record_take(observer->record, row);
    if (observer->trace != NULL)
        trace_take(observer->trace, row);
    if (observer->progress != NULL && observer->keys != NULL)
        observer->progress->typed = run_keys_typed(observer->keys);
    if (observer->progress != NULL)
        progress_take(observer->progress, row);
    if (observer->keys != NULL)
        run_keys_take(observer->keys, row);
    if (player->config.follow != NULL)
        run_follow_take(player->config.follow,
                        row->phase == TELEMETRY_MOVE &&
                            row->state == CONTROLLER_MOVING &&
                            row->rate.rate_q30 > 0,
                        row->rate.s_ns_q12, player->start_ns + row->t_ns);
}

/* The figures of the report, from every tick: rows may be lost on the way to a
 * slow disk. */
static void player_count(const struct player *player,
                         const struct telemetry_row *row)
{
    const struct player_observer *observer = &player->observer;
    if (observer->report != NULL)
        report_take(observer->report, row);
    if (observer->shots != NULL)
        shots_take(observer->shots, row);
    if (observer->arrivals != NULL)
        arrivals_take(observer->arrivals, row);
}

/* Between two times that a move is played, or on the way to another place of
 * it, it is as before the first. */
static enum telemetry_phase player_row_phase(const struct player *player)
{
    return player->phase == TELEMETRY_MOVE &&
                   player->machine->playback.state == PLAYBACK_GOING
               ? TELEMETRY_APPROACH
               : player->phase;
}

static void player_record(struct player *player)
{
    struct telemetry_row *row = &player->row;
    row->t_ns = player->now_ns - player->start_ns;
    row->phase = player_row_phase(player);
    recorder_look(row, player->machine);
    recorder_look_shots(row, player->machine, player->start_ns);
    player_count(player, row);
    recorder_put(&player->recorder, row);
}

/* --- the loop --- */

static void player_next(struct player *player)
{
    const int64_t period_ns = player->job->rig.period_ns;
    int64_t late_ns;
    player->now_ns = pace_wait(player->machine->ports.clock,
                               player->now_ns + period_ns, period_ns, &late_ns);
    player->row.late_ns = late_ns;
    if (late_ns > player->late_ns)
        player->late_ns = late_ns;
}

/* A stop by a key is the first interrupt.  On the way out there is nothing left to
 * command. */
static int player_commands(struct player *player, int interrupts)
{
    struct run_keys *keys = player->observer.keys;
    if (keys != NULL && player->shutdown.phase == SHUTDOWN_NONE &&
        mailbox_step(&keys->mailbox, &player->machine->playback))
        player->stopped = true;
    return interrupts == 0 && player->stopped ? 1 : interrupts;
}

static void player_faults(struct player *player)
{
    struct machine_fault *faults = player->config.faults;
    if (faults == NULL)
        return;
    machine_fault_step(faults, player->now_ns, player->phase,
                       player->machine->controller.state);
    player->row.faults = faults->active;
}

static void player_tick(struct player *player, int interrupts)
{
    player_faults(player);
    if (player->config.loads != NULL)
        loads_step(player->config.loads, player->phase);
    player_next(player);
    interrupts = player_commands(player, interrupts);
    player_phase_tick(
        player, shutdown_stops(&player->shutdown, player->now_ns, interrupts));
    if (player->config.follow != NULL)
        run_follow_tick(player->config.follow);
    player_record(player);
    player_phase_step(player);
}

static void player_drain(struct player *player)
{
    recorder_drain(&player->recorder, player_observe, player);
    if (player->observer.can_log != NULL)
        can_log_drain(player->observer.can_log);
}

/* In virtual time nobody else looks after the rings. */
static bool player_must_drain(const struct player *player)
{
    const struct can_log *can_log = player->observer.can_log;
    return recorder_waiting(&player->recorder) >= RECORDER_ROWS / 2 ||
           (can_log != NULL && can_log_waiting(can_log) >= CAN_LOG_FRAMES / 2);
}

struct player_thread {
    struct player *player;
    _Atomic bool end;
};

static void *player_look_on(void *context)
{
    struct player_thread *thread = context;
    const int64_t wanted_ns = thread->player->config.observe_ns;
    const int64_t ns = wanted_ns > 0 ? wanted_ns : PLAYER_OBSERVE_NS;
    const struct timespec pause = { ns / (1000 * PLAYER_MS),
                                    ns % (1000 * PLAYER_MS) };
    while (!atomic_load(&thread->end)) {
        if (thread->player->job->compiled != NULL)
            compiled_fill(thread->player->job->compiled);
        player_drain(thread->player);
        if (thread->player->observer.keys != NULL)
            run_keys_poll(thread->player->observer.keys);
        if (thread->player->config.follow != NULL)
            (void)run_follow_poll(thread->player->config.follow,
                                  &thread->player->observer.keys->mailbox);
        run_start_say(&thread->player->start);
        shutdown_say_waiting(&thread->player->shutdown);
        nanosleep(&pause, NULL);
    }
    return NULL;
}

static void player_loop_virtual(struct player *player,
                                const volatile sig_atomic_t *interrupts)
{
    while (!player->ended) {
        player_tick(player, *interrupts);
        if (player_must_drain(player))
            player_drain(player);
    }
}

/* Ahead of everything that is not real-time, if we are allowed to; else we run
 * as we are and lost ticks show in the report. */
static void player_come_first(void)
{
    const struct sched_param first = { .sched_priority = PLAYER_PRIORITY };
    (void)pthread_setschedparam(pthread_self(), SCHED_FIFO, &first);
}

static void player_go_back(void)
{
    const struct sched_param normal = { .sched_priority = 0 };
    (void)pthread_setschedparam(pthread_self(), SCHED_OTHER, &normal);
}

static int player_loop_real(struct player *player,
                            const volatile sig_atomic_t *interrupts)
{
    struct player_thread thread = { .player = player };
    pthread_t id;
    atomic_init(&thread.end, false);
    if (pthread_create(&id, NULL, player_look_on, &thread) != 0)
        return -1;
    player_come_first();
    while (!player->ended)
        player_tick(player, *interrupts);
    player_go_back();
    atomic_store(&thread.end, true);
    pthread_join(id, NULL);
    return 0;
}

static void player_note_failures(struct player *player)
{
    struct shots *shots = player->observer.shots;
    for (unsigned i = 0; shots != NULL && i < player->machine->trigger_count;
         i++)
        shots->line[i].failures = player->machine->trigger[i].trigger.failures;
}

static void player_note_torque(struct player *player)
{
    struct report *report = player->observer.report;
    for (unsigned i = 0; i < player->job->rig.axis_count; i++)
        machine_torque_text(player->machine, i, report->torque[i]);
    report->torque_left = !machine_is_off(player->machine);
}

int player_run(struct player *player, const volatile sig_atomic_t *interrupts)
{
    struct report *report = player->observer.report;
    int err = 0;
    player->phase_ns = player->now_ns;
    if (player->config.realtime)
        err = player_loop_real(player, interrupts);
    else
        player_loop_virtual(player, interrupts);
    player_drain(player);
    machine_trigger_end(player->machine);
    player_note_failures(player);
    player_note_torque(player);
    report->end = player->end;
    report->times = player->machine->playback.played;
    report->is_repeated = player->machine->playback.times != 1;
    report->ticks = player->machine->controller.ticks;
    report->ticks_lost = player->machine->controller.ticks_lost;
    report->rows_dropped = player->recorder.dropped;
    report->realtime = player->config.realtime;
    report->late_ns = player->late_ns;
    return err;
}
