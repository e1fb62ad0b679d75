/* firmware/linux/player/player_phase.c - see player_phase.h. */
#include "firmware/linux/player/player_phase.h"

#include <stdio.h>

#include "firmware/host/track/compiled.h"
#include "firmware/linux/machine/machine_trigger.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define PLAYER_MS INT64_C(1000000)

#define PLAYER_REST_NS   (200 * PLAYER_MS) /* after the approach */
#define PLAYER_SETTLE_NS (500 * PLAYER_MS)
#define PLAYER_SHOTS_NS  (20000 * PLAYER_MS) /* pulses end, at most */

static void player_enter(struct player *player, enum telemetry_phase phase)
{
    player->phase = phase;
    player->phase_ns = player->now_ns;
}

static int64_t player_in_phase_ns(const struct player *player)
{
    return player->now_ns - player->phase_ns;
}

static void player_measure_load(struct player *player)
{
    int64_t dur_ns = player->now_ns - player->move_ns;
    for (unsigned i = 0; i < player->job->rig.bus_count && dur_ns > 0; i++)
        player->observer.report->bus[i].load =
            (double)(machine_busy_ns(player->machine, i) - player->busy_ns[i]) /
            (double)dur_ns;
}

/* On the way out: what is recorded follows it, once it is past the rest along the
 * path. */
static void player_follow_shutdown(struct player *player)
{
    const enum shutdown_phase way = player->shutdown.phase;
    const enum telemetry_phase phase =
        way >= SHUTDOWN_OFF ? TELEMETRY_STOP : TELEMETRY_SETTLE;
    player->ended = way == SHUTDOWN_DONE;
    if (way <= SHUTDOWN_REST || player->phase == phase)
        return;
    if (player->phase == TELEMETRY_MOVE)
        player_measure_load(player);
    if (way == SHUTDOWN_QUICK) {
        player->end = REPORT_QUICK_STOPPED;
        machine_trigger_end(player->machine);
    }
    if (phase == TELEMETRY_STOP)
        machine_trigger_disarm(player->machine);
    player_enter(player, phase);
}

static void player_finish(struct player *player, enum report_end end)
{
    player->end = end;
    shutdown_begin(&player->shutdown, player->now_ns, 0);
    player_follow_shutdown(player);
}

/* Axes of the move that have to be homed, a bit each. */
static uint64_t player_unhomed(const struct player *player)
{
    uint64_t axes = 0;
    for (unsigned i = 0; i < player->job->move.axis_count; i++)
        axes |= (uint64_t)1 << player->job->rig_axis[i];
    return axes & homing_wanted(&player->machine->homing);
}

static void player_enable(struct player *player)
{
    struct controller *controller = &player->machine->controller;
    if (controller->ticks == 1)
        controller_enable(controller);
    if (controller->state != CONTROLLER_READY)
        return;
    player_enter(player, TELEMETRY_HOME);
    homing_start(&player->machine->homing, player_unhomed(player));
}

static void player_home(struct player *player)
{
    const struct homing *homing = &player->machine->homing;
    char why[HOMING_TEXT_MAX];
    if (homing->state == HOMING_DONE)
        player_enter(player, TELEMETRY_APPROACH);
    if (homing->state != HOMING_FAILED)
        return;
    snprintf(player->observer.report->fault_text,
             sizeof player->observer.report->fault_text, "homing of %.16s: %s",
             player->job->rig.axis[homing->axis].name,
             homing_failure(homing, why));
    player_finish(player, homing->error == HOMING_STOPPED ? REPORT_STOPPED
                                                          : REPORT_FAULT);
}

/* As the playback counts them. */
static int64_t player_times(const struct player *player)
{
    const int64_t times = player->config.times;
    return times < 0 ? 0 : times > 1 ? times : 1;
}

/* The tracks, and the goals of axes that go by a profile of their drive's. */
static int player_load(struct player *player)
{
    const struct job *job = player->job;
    struct playback *playback = &player->machine->playback;
    const struct motion_track *track[CONTROLLER_AXES_MAX] = { NULL };
    for (unsigned i = 0; i < job->move.axis_count; i++)
        track[job->rig_axis[i]] = &job->track[i];
    const int err = playback_load(playback, track);
    if (err < 0)
        return err;
    for (unsigned i = 0; i < job->move.axis_count; i++)
        if (job->goal[i] != NULL)
            playback_set_goals(playback, job->rig_axis[i], job->goal[i],
                               job->goal_count[i]);
    return playback_repeat(playback, player_times(player),
                           player->config.is_ping_pong);
}

static int player_start_approach(struct player *player)
{
    const int err = player_load(player);
    player->approaching = true;
    return err < 0 ? err
                   : playback_go(&player->machine->playback,
                                 player->config.from_ns_q12, PLAYBACK_STAND);
}

static struct hal_gpio *player_step_line(const struct player *player)
{
    const struct job *job = player->job;
    return job->step_line == NULL
               ? NULL
               : &player->machine->input[job->step_line - job->rig.line].gpio;
}

static int player_start_move(struct player *player)
{
    struct controller *controller = &player->machine->controller;
    controller_override(controller, player->config.override_q30);
    const int err = playback_begin(&player->machine->playback,
                                   player->config.from_ns_q12, PLAYBACK_PLAY);
    player->is_arming = err == MOTION_OK;
    return err;
}

/* Once drives that sample by themselves have what they need. */
static int player_begin_move(struct player *player)
{
    const int err = player->machine->playback.err;
    if (playback_is_arming(&player->machine->playback))
        return MOTION_OK;
    player->is_arming = false;
    if (err < 0)
        return err;
    machine_trigger_go(player->machine);
    frame_step_begin(&player->machine->step, &player->job->steps,
                     player_step_line(player));
    player->move_ns = player->now_ns;
    for (unsigned i = 0; i < player->job->rig.bus_count; i++)
        player->busy_ns[i] = machine_busy_ns(player->machine, i);
    player_enter(player, TELEMETRY_MOVE);
    return MOTION_OK;
}

/* Whole ticks, and time enough for what leads the first event. */
static int64_t player_rest_ns(const struct player *player)
{
    const int64_t period_ns = player->job->rig.period_ns;
    const int64_t lead_ns =
        machine_trigger_lead_ns(player->machine) + 2 * period_ns;
    const int64_t rest_ns = lead_ns > PLAYER_REST_NS ? lead_ns : PLAYER_REST_NS;
    return (rest_ns + period_ns - 1) / period_ns * period_ns;
}

/* RUN_START_NEVER: not known yet. */
static int64_t player_due_ns(struct player *player)
{
    const int64_t period_ns = player->job->rig.period_ns;
    const int64_t ready_ns = player->phase_ns + player_rest_ns(player);
    if (player->config.follow != NULL) {
        const int64_t due_ns = run_follow_due_ns(
            player->config.follow, player->now_ns, ready_ns, period_ns);
        player->start.late = due_ns < ready_ns;
        return due_ns;
    }
    if (player->start.line == NULL)
        return run_start_due_ns(&player->start, player->machine->ports.clock,
                                player->now_ns, ready_ns, period_ns);
    return player->now_ns < ready_ns
               ? RUN_START_NEVER
               : run_start_edge_ns(&player->start, player->now_ns,
                                   machine_trigger_lead_ns(player->machine),
                                   period_ns);
}

static void player_refuse_start(struct player *player)
{
    snprintf(player->observer.report->fault_text,
             sizeof player->observer.report->fault_text, "%s",
             player->start.passed
                 ? "the wall clock was set past the time of the start"
             : player->start.late
                 ? "the axes were not ready at the time of the start"
                 : "the line that starts the move cannot be read");
    player_finish(player, REPORT_FAULT);
}

static int player_rest(struct player *player)
{
    const int64_t start_ns = player_due_ns(player);
    if (player->start.late || player->start.passed || player->start.failed) {
        player_refuse_start(player);
        return MOTION_OK;
    }
    if (start_ns == RUN_START_NEVER)
        return MOTION_OK;
    if (!player->machine->running_up ||
        player->machine->start.t0_ns != start_ns)
        machine_trigger_arm(player->machine, player->job->shots, start_ns,
                            player->config.override_q30);
    if (player->now_ns < start_ns)
        return MOTION_OK;
    const int err = player_start_move(player);
    return err < 0 ? err : player_begin_move(player);
}

static void player_cannot(struct player *player, const char *what, int err)
{
    char why[JOB_APPROACH_TEXT_MAX];
    machine_refusal_text(player->machine, err, why);
    snprintf(player->observer.report->fault_text,
             sizeof player->observer.report->fault_text, "cannot %s: %s", what,
             why);
    player_finish(player, REPORT_FAULT);
}

static void player_approach(struct player *player)
{
    const struct controller *controller = &player->machine->controller;
    int err = MOTION_OK;
    if (player->is_arming)
        err = player_begin_move(player);
    else if (!player->approaching)
        err = player_start_approach(player);
    else if (controller->state == CONTROLLER_MOVING)
        player->phase_ns = player->now_ns; /* the rest begins after it */
    else if (controller->state == CONTROLLER_READY)
        err = player_rest(player);
    if (err < 0)
        player_cannot(player, "start", err);
}

/* The script's hold: once, at its time; resumed after standing for a while. */
static void player_script(struct player *player)
{
    struct controller *controller = &player->machine->controller;
    if (player->config.hold_at_ns < 0 ||
        player->machine->playback.state != PLAYBACK_PLAYING)
        return;
    if (!player->held && controller->rate.s_ns_q12 / MOTION_FIXED_NS_Q12 >=
                             player->config.hold_at_ns)
        player->held = playback_hold(&player->machine->playback) == MOTION_OK;
    if (controller->state != CONTROLLER_HOLDING ||
        controller->rate.rate_q30 != 0)
        return;
    if (player->standing_ns < 0)
        player->standing_ns = player->now_ns;
    if (player->now_ns - player->standing_ns >= player->config.resume_after_ns)
        (void)playback_resume(&player->machine->playback);
}

/* It stands, or goes on to the end of a frame: to rest along the path, and off
 * from there. */
static void player_lose_step(struct player *player)
{
    snprintf(player->observer.report->fault_text,
             sizeof player->observer.report->fault_text, "%s",
             "the line that steps the shoot cannot be read");
    player_finish(player, REPORT_FAULT);
}

static void player_move(struct player *player)
{
    player_script(player);
    if (player->machine->step.failed && player->end == REPORT_DONE)
        player_lose_step(player);
    if (player->machine->controller.state != CONTROLLER_READY ||
        player->machine->playback.state != PLAYBACK_IDLE)
        return;
    player_measure_load(player);
    if (player->machine->playback.err < 0)
        player_cannot(player, "go on", player->machine->playback.err);
    else
        player_enter(player, TELEMETRY_SETTLE);
}

static void player_settle(struct player *player)
{
    const bool idle = player->end == REPORT_STOPPED ||
                      machine_trigger_is_idle(player->machine) ||
                      player_in_phase_ns(player) >= PLAYER_SHOTS_NS;
    if (player_in_phase_ns(player) >= PLAYER_SETTLE_NS && idle)
        player_finish(player, player->end);
}

void player_phase_step(struct player *player)
{
    static void (*const step[])(struct player *) = {
        [TELEMETRY_ENABLE] = player_enable,     [TELEMETRY_HOME] = player_home,
        [TELEMETRY_APPROACH] = player_approach, [TELEMETRY_MOVE] = player_move,
        [TELEMETRY_SETTLE] = player_settle,
    };
    if (player->shutdown.phase == SHUTDOWN_NONE)
        step[player->phase](player);
}

/* --- what cuts the walk short --- */

/* More than the fault itself says. */
static const char *player_fault_text(const struct player *player)
{
    const struct controller *controller = &player->machine->controller;
    const struct compiled *compiled = player->job->compiled;
    const char *error = compiled != NULL ? compiled_error(compiled) : NULL;
    if (controller->fault.fault == CONTROLLER_FAULT_TRACK)
        return error != NULL ? error : "";
    return controller->fault.reason;
}

static void player_note_fault(struct player *player)
{
    const struct controller *controller = &player->machine->controller;
    struct report *report = player->observer.report;
    if (controller->fault.fault == CONTROLLER_FAULT_NONE ||
        (report->fault.fault != CONTROLLER_FAULT_NONE &&
         report->fault.is_whole))
        return;
    report->fault = controller->fault;
    report->monitored =
        controller->fault.axis >= 0 &&
        player->machine->monitor[controller->fault.axis] != NULL &&
        drive_monitor_is_latched(
            player->machine->monitor[controller->fault.axis]);
    if (controller->fault.axis >= 0 &&
        controller->fault.fault != CONTROLLER_FAULT_INPUT)
        snprintf(report->fault_text, sizeof report->fault_text, "%s",
                 player_fault_text(player));
    else
        machine_trouble_text(player->machine, report->fault_text);
}

static void player_watch(struct player *player)
{
    player_note_fault(player);
    if (player->machine->controller.state == CONTROLLER_FAULT)
        player_finish(player, REPORT_FAULT);
}

/* Of a move it is measured where it has come to rest. */
static void player_interrupt(struct player *player)
{
    const bool moves = player->phase >= TELEMETRY_MOVE;
    if (player->end == REPORT_DONE)
        player->end = REPORT_STOPPED;
    shutdown_begin(&player->shutdown, player->now_ns,
                   moves ? PLAYER_SETTLE_NS : 0);
}

/* Between ticks: windows of a compiled move go on with it. */
static void player_advance(struct player *player)
{
    struct compiled *compiled = player->job->compiled;
    if (compiled == NULL || player->phase != TELEMETRY_MOVE)
        return;
    compiled_advance(compiled, player->machine->controller.rate.s_ns_q12);
    if (!player->config.realtime)
        compiled_fill(compiled);
}

static void player_way_out(struct player *player)
{
    (void)shutdown_tick(&player->shutdown, player->now_ns);
    player_note_fault(player);
    if (player->shutdown.phase < SHUTDOWN_QUICK &&
        player->machine->controller.state == CONTROLLER_FAULT)
        player->end = REPORT_FAULT;
    player_follow_shutdown(player);
}

void player_phase_tick(struct player *player, int stops)
{
    if (stops > 0 && player->shutdown.phase == SHUTDOWN_NONE)
        player_interrupt(player);
    player_advance(player);
    if (player->shutdown.phase != SHUTDOWN_NONE) {
        player_way_out(player);
    } else {
        machine_tick(player->machine, player->now_ns);
        player_watch(player);
    }
}
