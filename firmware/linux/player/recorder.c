/* firmware/linux/player/recorder.c - see recorder.h. */
#include "firmware/linux/player/recorder.h"

#include <string.h>

void recorder_init(struct recorder *recorder, const struct rig *rig)
{
    struct memory_pool *memory = &recorder->memory;
    const size_t shots = rig_trigger_count(rig), axes = rig->axis_count,
                 buses = rig->bus_count;
    memory_pool_free(memory);
    struct telemetry_axis *axis =
        memory_pool_new(memory, RECORDER_ROWS * axes, sizeof *axis);
    struct telemetry_shot *shot =
        memory_pool_new(memory, RECORDER_ROWS * shots, sizeof *shot);
    uint32_t *bus = memory_pool_new(memory, RECORDER_ROWS * buses, sizeof *bus);
    for (size_t i = 0; i < RECORDER_ROWS; i++)
        recorder->row[i] = (struct telemetry_row){
            .axis = axis + i * axes,
            .bus_warnings = bus + i * buses,
            .shot = shot + i * shots,
            .shot_count = (unsigned)shots,
        };
    recorder->axis_count = rig->axis_count;
    recorder->bus_count = rig->bus_count;
    atomic_init(&recorder->put, 0);
    atomic_init(&recorder->taken, 0);
    recorder->dropped = 0;
}

/* What the controller plays in this phase. */
static const struct motion_track *
recorder_track(const struct telemetry_row *row, const struct machine *machine,
               unsigned axis)
{
    const struct playback_axis *loaded = &machine->playback.axis[axis];
    if (row->phase == TELEMETRY_APPROACH && loaded->approach.count > 0)
        return &loaded->approach;
    return row->phase == TELEMETRY_MOVE ? loaded->track : NULL;
}

/* Jerk is not needed to move, so the controller does not work it out. */
static void recorder_add_jerk(struct telemetry_row *row,
                              const struct machine *machine, unsigned axis)
{
    const struct motion_track *track = recorder_track(row, machine, axis);
    struct motion_state state, warped;
    if (track == NULL || row->rate.s_ns_q12 >= track->end_ns_q12)
        return;
    motion_track_state(track, row->rate.s_ns_q12, &state);
    motion_clock_warp_chain(&row->rate, &state, &warped);
    row->axis[axis].demand.jerk_q32 = warped.jerk_q32;
}

void recorder_look(struct telemetry_row *row, const struct machine *machine)
{
    const struct controller *controller = &machine->controller;
    row->rate = controller->rate;
    row->state = (int)controller->state;
    row->is_fault = controller->fault.fault != CONTROLLER_FAULT_NONE;
    row->is_told = row->is_fault && controller->fault.is_whole;
    row->waits_for = machine->step.waits ? machine->step.frame : 0;
    row->guardian_lost = machine->sight.lost;
    row->guardian_gone = machine->sight.is_gone;
    row->played = machine->playback.played;
    row->times = machine->playback.times;
    row->is_ping_pong = machine->playback.is_ping_pong;
    for (unsigned i = 0; i < machine->rig->axis_count; i++) {
        const struct controller_axis *axis = &controller->axis[i];
        row->axis[i] = (struct telemetry_axis){
            .demand = { axis->target.pos_q32, axis->target.vel_q32,
                        axis->target.acc_q32, 0 },
            .actual_q32 = axis->feedback.pos_q32,
            .actual_vel_q32 = axis->feedback.vel_q32,
            .following_q32 = axis->following_q32,
            .goals = axis->leg.at,
            .events = axis->feedback.events,
            .warning = machine->warnings[i].newest,
        };
        (void)machine_statusword(machine, i, &row->axis[i].statusword);
        recorder_add_jerk(row, machine, i);
    }
    for (unsigned i = 0; i < machine->rig->bus_count; i++)
        row->bus_warnings[i] = machine_bus_warnings(machine, i);
}

void recorder_look_shots(struct telemetry_row *row,
                         const struct machine *machine, int64_t start_ns)
{
    memset(row->shot, 0, row->shot_count * sizeof *row->shot);
    for (unsigned i = 0; i < machine->trigger_count; i++)
        if (machine->trigger[i].shot > 0)
            row->shot[i] =
                (struct telemetry_shot){ machine->trigger[i].shot,
                                         machine->trigger[i].shot_ns - start_ns,
                                         machine->trigger[i].aim };
}

void recorder_free(struct recorder *recorder)
{
    memory_pool_free(&recorder->memory);
}

uint64_t recorder_waiting(const struct recorder *recorder)
{
    /* `taken` first: it never passes the `put` read after it. */
    uint64_t taken =
        atomic_load_explicit(&recorder->taken, memory_order_acquire);
    return atomic_load_explicit(&recorder->put, memory_order_acquire) - taken;
}

/* Release after writing a row, acquire before reading it: the reader sees whole
 * rows, and the writer reuses a slot only after it was read. */
bool recorder_put(struct recorder *recorder, const struct telemetry_row *row)
{
    uint64_t put = atomic_load_explicit(&recorder->put, memory_order_relaxed);
    if (recorder_waiting(recorder) == RECORDER_ROWS) {
        recorder->dropped++;
        return false;
    }
    struct telemetry_row *to = &recorder->row[put % RECORDER_ROWS];
    memcpy(to->axis, row->axis, recorder->axis_count * sizeof *to->axis);
    memcpy(to->bus_warnings, row->bus_warnings,
           recorder->bus_count * sizeof *to->bus_warnings);
    memcpy(to->shot, row->shot, to->shot_count * sizeof *to->shot);
    to->t_ns = row->t_ns;
    to->late_ns = row->late_ns;
    to->guardian_lost = row->guardian_lost;
    to->guardian_gone = row->guardian_gone;
    to->number = (uint32_t)(put + recorder->dropped);
    to->rate = row->rate;
    to->phase = row->phase;
    to->state = row->state;
    to->is_fault = row->is_fault;
    to->is_told = row->is_told;
    to->faults = row->faults;
    to->waits_for = row->waits_for;
    to->played = row->played;
    to->times = row->times;
    to->is_ping_pong = row->is_ping_pong;
    atomic_store_explicit(&recorder->put, put + 1, memory_order_release);
    return true;
}

void recorder_drain(struct recorder *recorder,
                    void (*take)(void *context, struct telemetry_row *row),
                    void *context)
{
    uint64_t put = atomic_load_explicit(&recorder->put, memory_order_acquire);
    uint64_t taken =
        atomic_load_explicit(&recorder->taken, memory_order_relaxed);
    for (; taken < put; taken++) {
        take(context, &recorder->row[taken % RECORDER_ROWS]);
        atomic_store_explicit(&recorder->taken, taken + 1,
                              memory_order_release);
    }
}
