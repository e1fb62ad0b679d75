/* firmware/host/rig/modbus_stream.c - see modbus_stream.h. */
#include "firmware/host/rig/modbus_stream.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "firmware/host/rig/modbus_budget.h"

/* What a step of the speed may take the motor where it comes with a hard ramp:
 * 4 / lambda of a position loop of 60 Hz with twice the stop acceleration, and
 * of one of 30 Hz with just that. */
#define STREAM_STEP_S 0.04

void modbus_stream_config(const struct rig *rig, unsigned i,
                          struct drive_modbus_config *config)
{
    const struct rig_axis *axis = &rig->axis[i];

    *config = (struct drive_modbus_config){
        .map = &rig->map[axis->map],
        .unit = axis->node_id,
        .counts_num = axis->counts_num,
        .counts_den = axis->counts_den,
        .vel_max_q32 = axis->limit.vel_q32,
        .acc_q32 = axis->stop_acc_q32,
        .cycle_ns = modbus_budget_cycle_ns(rig, axis->bus),
        .latency_ns = modbus_budget_latency_ns(rig, axis->bus),
        .mode = axis->point_to_point ? HAL_DRIVE_PROFILE_POSITION
                                     : HAL_DRIVE_STREAM_POSITION,
        .parameter = axis->item,
        .parameter_count = axis->parameter_count,
    };
}

/* An axis's numbers, in its unit and s. */
struct stream_sum {
    const struct rig *rig;
    const struct rig_axis *axis;
    const char *path;
    struct messages *messages;
    bool is_near, is_hard, own_ramps;
    double vel, acc, stop, floor, time;            /* of the rig */
    double tick, cycle, latency;                   /* of the line */
    double count, step, vel_max, ramp, brake, tau; /* of the drive */
};

static double stream_q32(int64_t value)
{
    return ldexp((double)value, -32);
}

static bool stream_sum(const struct rig *rig, unsigned i, const char *path,
                       struct stream_sum *sum)
{
    const struct rig_axis *axis = &rig->axis[i];
    struct drive_modbus_config config;
    struct drive_modbus_fields fields;
    struct drive_modbus_law law;

    modbus_stream_config(rig, i, &config);
    drive_modbus_fields(&config, &fields);
    if (drive_modbus_law(&config, &law) < 0)
        return false;
    *sum = (struct stream_sum){
        .rig = rig,
        .axis = axis,
        .path = path,
        .is_near = law.is_near,
        .is_hard = law.is_hard,
        .own_ramps = fields.own_ramps,
        .vel = stream_q32(axis->limit.vel_q32),
        .acc = stream_q32(axis->limit.acc_q32),
        .stop = stream_q32(axis->stop_acc_q32),
        .floor = stream_q32(axis->following_floor_q32),
        .time = (double)axis->following_k_ns / 1e9,
        .tick = (double)rig->period_ns / 1e9,
        .cycle = (double)config.cycle_ns / 1e9,
        .latency = (double)config.latency_ns / 1e9,
        .count = stream_q32(fields.count_q32),
        .step = stream_q32(fields.step_q32),
        .vel_max = stream_q32(fields.vel_max_q32),
        .ramp = fmin(stream_q32(fields.acc_q32), stream_q32(fields.dec_q32)),
        .brake = stream_q32(fields.dec_q32),
        .tau = 16384 / (double)law.gain_q16,
    };
    return true;
}

/* ---- what is said ---- */

static bool stream_refuse(const struct stream_sum *sum, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static bool stream_refuse(const struct stream_sum *sum, const char *format, ...)
{
    const struct rig_axis *axis = sum->axis;
    char what[512];
    va_list args;

    va_start(args, format);
    (void)vsnprintf(what, sizeof what, format, args);
    va_end(args);
    messages_add(
        sum->messages, MESSAGE_ERROR, "%s:%u:%u: axis %s %s%s would fit",
        sum->path, axis->place.line, axis->place.column, axis->name, what,
        sum->rig->map[axis->map].move.count > 0 ? ", or mode: point-to-point,"
                                                : "");
    return false;
}

/* ---- what is judged ---- */

static bool stream_speed_ok(const struct stream_sum *sum)
{
    const char *unit = units_axis_text(sum->axis->unit);

    return sum->vel <= sum->vel_max ||
           stream_refuse(sum,
                         "runs at up to %.3g %s/s, which the speed of its "
                         "drive's map cannot say, expected at most %.3g: such "
                         "a velocity",
                         sum->vel, unit, sum->vel_max);
}

static bool stream_ramp_ok(const struct stream_sum *sum)
{
    const char *unit = units_axis_text(sum->axis->unit);

    return sum->ramp > sum->acc ||
           stream_refuse(sum,
                         "accelerates at up to %.3g %s/s2, and the steepest "
                         "ramp that its drive's map can say is %.3g, expected "
                         "more: a lower acceleration",
                         sum->acc, unit, sum->ramp);
}

/* The stop acceleration from which on the ramps are not hard, or the steps
 * small enough. */
static double stream_stop_wanted(const struct stream_sum *sum)
{
    const double by_step = sum->step / STREAM_STEP_S;

    return sum->own_ramps ? by_step : fmin(by_step, sum->brake / 3);
}

/* Steps that a motor has to take as hard as its drive's ramps are. */
static bool stream_step_ok(const struct stream_sum *sum)
{
    const double took_s = sum->step / sum->stop;
    const char *unit = units_axis_text(sum->axis->unit);

    return !sum->is_hard || took_s <= STREAM_STEP_S ||
           stream_refuse(
               sum,
               "would run in steps of %.3g %s/s, one of its drive's speed, "
               "with ramps of %.3g %s/s2, %s: at its stop acceleration of %.3g "
               "that takes %.3g / %.3g = %.0f ms and %.3g^2 / %.3g = %.3g %s, "
               "expected at most %.0f ms: a stop acceleration of %.3g, if the "
               "motor has it",
               sum->step, unit, sum->brake, unit,
               sum->own_ramps ? "for the drive's own are taken for steep"
                              : "the gentlest that its map can say",
               sum->stop, sum->step, sum->stop, 1e3 * took_s, sum->step,
               sum->stop, sum->step * took_s, unit, 1e3 * STREAM_STEP_S,
               stream_stop_wanted(sum));
}

/* What does not depend on the speed. */
static double stream_late(const struct stream_sum *sum)
{
    const double late = sum->tick + sum->cycle + sum->latency;

    return sum->acc * late * late * sum->ramp / (2 * (sum->ramp - sum->acc));
}

static double stream_quantum(const struct stream_sum *sum, double vel)
{
    if (sum->is_near)
        return 0;
    return fmin(2 * sum->step * sum->tau,
                vel * (2 * sum->cycle + sum->latency));
}

/* Until the next set point; as far again where the drive goes there at once and
 * the motor after it. */
static double stream_run(const struct stream_sum *sum, double vel)
{
    const double share = sum->is_near && sum->is_hard ? 1 : 0.5;

    return vel * (share * sum->cycle + sum->tick);
}

static bool stream_following_ok(const struct stream_sum *sum, double vel)
{
    const double run = stream_run(sum, vel), late = stream_late(sum);
    const double quantum = stream_quantum(sum, vel), counts = 2 * sum->count;
    const double off = run + late + quantum + counts;
    const double allowed = fmax(sum->floor, vel * sum->time);
    const char *unit = units_axis_text(sum->axis->unit);

    return off <= allowed ||
           stream_refuse(
               sum,
               "gets a set point every %.1f ms on bus %s and may be off by "
               "%.3g %s at %.3g %s/s (%.3g that it runs by itself, %.3g "
               "while an acceleration of %.3g reaches it, %.3g by steps of the "
               "drive's speed, %.3g for two counts), expected at most its "
               "following error of %.3g: a floor of %.3g, a faster line",
               1e3 * sum->cycle, sum->rig->bus[sum->axis->bus].name, off, unit,
               vel, unit, run, late, sum->acc, quantum, counts, allowed, off);
}

/* Where the floor is left, and at full speed. */
static double stream_bend(const struct stream_sum *sum)
{
    return sum->vel * sum->time > sum->floor ? sum->floor / sum->time
                                             : sum->vel;
}

bool modbus_stream_check(const struct rig *rig, unsigned i, const char *path,
                         struct messages *messages)
{
    struct stream_sum sum;

    if (!stream_sum(rig, i, path, &sum))
        return true; /* machine_init refuses it */
    sum.messages = messages;
    return stream_speed_ok(&sum) && stream_ramp_ok(&sum) &&
           stream_step_ok(&sum) &&
           stream_following_ok(&sum, stream_bend(&sum)) &&
           stream_following_ok(&sum, sum.vel);
}

void modbus_stream_print(const struct rig *rig, unsigned i, FILE *file)
{
    struct stream_sum sum;
    const char *unit = units_axis_text(rig->axis[i].unit);

    if (!stream_sum(rig, i, "", &sum) || !sum.is_hard)
        return;
    if (sum.own_ramps)
        fprintf(file,
                "  %s: %s are its drive's own, taken for %.3g %s/s2: set them "
                "so, or steeper\n",
                sum.axis->name, sum.step > 0 ? "ramps" : "speed and ramps",
                sum.brake, unit);
    else
        fprintf(file,
                "  %s: its drive's ramps cannot be gentler than %.3g %s/s2, "
                "%.3g times the stop acceleration\n",
                sum.axis->name, sum.brake, unit, sum.brake / sum.stop);
}
