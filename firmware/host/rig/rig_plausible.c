/* firmware/host/rig/rig_plausible.c - numbers of a rig that each may be, and
 * cannot be meant together.
 *
 * A stop that would be a step is refused where it is read; what is hardly wanted
 * is said when the rig is used, each with the numbers and with what would be
 * usual.  An axis that nothing watches is said too, as simulations do without,
 * and refused before real drives move. */
#include "firmware/host/rig/rig_parts.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"

#define PLAUSIBLE_STOP      100.0    /* times the limits' acceleration: said, */
#define PLAUSIBLE_STOP_MOST 100000.0 /* and refused; */
#define PLAUSIBLE_JERK      100.0    /* as many times more of the jerk */
#define PLAUSIBLE_HEARTBEAT (500 * RIG_MS)
#define PLAUSIBLE_TIMEOUT   (2000 * RIG_MS)
#define PLAUSIBLE_LOST      3 /* heartbeats, or answers, until it is noticed */
#define PLAUSIBLE_WATCH     (10000 * RIG_MS)

static double plausible_real(int64_t value_q32)
{
    return ldexp((double)value_q32, -32);
}

static double plausible_range(const struct rig_axis *axis)
{
    return plausible_real(axis->limit.pos_max_q32) -
           plausible_real(axis->limit.pos_min_q32);
}

static double plausible_s(int64_t ns)
{
    return (double)ns / 1e9;
}

static const char *plausible_unit(const struct rig_axis *axis)
{
    return units_axis_text(axis->unit);
}

/* ---- what is refused ---- */

int rig_judge_stop(const struct yaml_value *value, int64_t stop_q32,
                   int64_t limit_q32, bool is_jerk)
{
    const double most =
        is_jerk ? PLAUSIBLE_STOP_MOST * PLAUSIBLE_JERK : PLAUSIBLE_STOP_MOST;
    const double times = (double)stop_q32 / (double)limit_q32;
    struct yaml_value at = *value;

    if (times <= most)
        return 0;
    at.expected = "what the motor can do, as a rule 2 to 10 times the limit";
    return yaml_value_refuse(&at,
                             "is %.4g times the axis's own limit, a step of "
                             "its %s",
                             times, is_jerk ? "acceleration" : "speed");
}

/* What nothing watches, or trips at rest: "" where it may.  A register map has an
 * arithmetic of its own for what is less than a count. */
#define UNWATCHED_MAX 320
static void plausible_unwatched(const struct rig_axis *axis,
                                char text[UNWATCHED_MAX])
{
    const double count =
        fabs((double)axis->counts_den / (double)axis->counts_num);
    const double range = plausible_range(axis);
    const double floor = plausible_real(axis->following_floor_q32);
    const bool counts = axis->kind == RIG_CIA402 || axis->kind == RIG_MODBUS;
    const char *unit = plausible_unit(axis);

    text[0] = '\0';
    if (floor > range)
        snprintf(text, UNWATCHED_MAX,
                 "%s has a following_error of %.10g %s, which an axis that is "
                 "%.10g %s long never exceeds: nothing watches it, expected "
                 "less, as a rule 1 %% of that: %.4g %s",
                 axis->name, floor, unit, range, unit, range / 100, unit);
    else if (counts && count > range)
        snprintf(text, UNWATCHED_MAX,
                 "%s has one count for every %.4g %s of its range of %.4g %s, "
                 "expected more, as a rule 100 and more for the following "
                 "error",
                 axis->name, count, unit, range, unit);
    else if (axis->kind == RIG_CIA402 && count > floor)
        snprintf(text, UNWATCHED_MAX,
                 "%s has one count for every %.4g %s, and its following_error "
                 "allows %.4g %s, which is a fault at rest, expected more "
                 "counts, as a rule 100 and more for it",
                 axis->name, count, unit, floor, unit);
}

int rig_may_move_drives(const struct rig *rig, const char *path,
                        char message[YAML_MESSAGE_MAX])
{
    char text[UNWATCHED_MAX];

    for (uint32_t i = 0; i < rig->axis_count; i++) {
        const struct rig_axis *axis = &rig->axis[i];

        plausible_unwatched(axis, text);
        if (text[0] == '\0' || rig_axis_is_virtual(axis))
            continue;
        snprintf(message, YAML_MESSAGE_MAX, "%.150s:%u:%u: %s", path,
                 axis->place.line, axis->place.column, text);
        return -1;
    }
    return 0;
}

/* ---- what is said ---- */

struct plausible {
    const struct rig *rig;
    void (*say)(void *context, struct plan_place place, const char *text);
    void *context;
    enum rig_warning warning; /* that is looked for */
};

static void plausible_say(const struct plausible *self, struct plan_place place,
                          const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static void plausible_say(const struct plausible *self, struct plan_place place,
                          const char *format, ...)
{
    char text[UNWATCHED_MAX + 32];
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(text, UNWATCHED_MAX, format, arguments);
    va_end(arguments);
    const size_t length = strlen(text);
    snprintf(text + length, sizeof text - length, " [%s]",
             rig_warning_word[self->warning]);
    self->say(self->context, place, text);
}

static void plausible_following(const struct plausible *self,
                                const struct rig_axis *axis)
{
    /* a board is looked at as seldom as its line is slow */
    const int64_t most_q32 =
        rig_kinds[axis->kind]->samples
            ? axis->following_floor_q32
            : rig_axis_following_q32(axis, axis->limit.vel_q32);
    const double most = plausible_real(most_q32);
    const double range = plausible_range(axis);
    char text[UNWATCHED_MAX];

    plausible_unwatched(axis, text);
    if (text[0] != '\0')
        plausible_say(self, axis->place, "%s", text);
    else if (most > range / 2)
        plausible_say(self, axis->place,
                      "%s may be off its set point by %.4g %s at its speed of "
                      "%.4g %s/s, more than half of its range of %.4g %s: "
                      "following_error is as a rule 1 %% of it, and 20 ms",
                      axis->name, most, plausible_unit(axis),
                      plausible_real(axis->limit.vel_q32), plausible_unit(axis),
                      range, plausible_unit(axis));
}

static void plausible_limits(const struct plausible *self,
                             const struct rig_axis *axis)
{
    const char *unit = plausible_unit(axis);
    const double tick = plausible_s(self->rig->period_ns);
    const double speed = plausible_real(axis->limit.vel_q32);
    const double acc = plausible_real(axis->limit.acc_q32);
    const double jerk = plausible_real(axis->limit.jerk_q32);
    const double range = plausible_range(axis);

    if (speed * tick >= range)
        plausible_say(self, axis->place,
                      "%s passes its whole range of %.4g %s within one tick of "
                      "%.4g ms at its speed of %.4g %s/s",
                      axis->name, range, unit, 1e3 * tick, speed, unit);
    if (jerk * tick >= acc)
        plausible_say(self, axis->place,
                      "%s has a jerk of %.4g %s/s3, which is its whole "
                      "acceleration of %.4g %s/s2 within one tick of %.4g ms: "
                      "it limits nothing, as less than %.4g would",
                      axis->name, jerk, unit, acc, unit, 1e3 * tick,
                      acc / tick);
}

static void plausible_stop(const struct plausible *self,
                           const struct rig_axis *axis)
{
    const double stop = plausible_real(axis->stop_acc_q32);
    const double acc = plausible_real(axis->limit.acc_q32);
    const double jerk = plausible_real(axis->limit.jerk_q32);
    const double stop_jerk = plausible_real(axis->stop_jerk_q32);
    const char *unit = plausible_unit(axis);

    if (stop > PLAUSIBLE_STOP * acc)
        plausible_say(self, axis->place,
                      "%s stops with %.4g %s/s2, %.4g times its limit of %.4g: "
                      "a motor has 2 to 10 times it as a rule",
                      axis->name, stop, unit, stop / acc, acc);
    if (stop_jerk > PLAUSIBLE_STOP * PLAUSIBLE_JERK * jerk && jerk > 0)
        plausible_say(self, axis->place,
                      "%s stops with a jerk of %.4g %s/s3, %.4g times its "
                      "limit of %.4g: that is a blow to what it carries",
                      axis->name, stop_jerk, unit, stop_jerk / jerk, jerk);
}

/* Its quick stop and its own watch of the following error are set in counts. */
static void plausible_drive(const struct plausible *self,
                            const struct rig_axis *axis)
{
    const double counts =
        fabs((double)axis->counts_num / (double)axis->counts_den);
    const double stop = plausible_real(axis->stop_acc_q32) * counts;
    const double window =
        2 * counts *
        plausible_real(rig_axis_following_q32(axis, axis->limit.vel_q32));

    if (axis->kind != RIG_CIA402)
        return;
    if (stop > UINT32_MAX)
        plausible_say(self, axis->place,
                      "%s stops with %.4g counts/s2, and 0x6085 of its drive "
                      "says at most 4294967295: its quick stop is left as the "
                      "drive has it",
                      axis->name, stop);
    if (window > UINT32_MAX)
        plausible_say(self, axis->place,
                      "%s may be off by %.4g counts, and 0x6065 of its drive "
                      "says at most 4294967295: its window is left as the "
                      "drive has it",
                      axis->name, window);
}

static void plausible_homing(const struct plausible *self,
                             const struct rig_axis *axis)
{
    const struct homing_config *homing = &axis->homing;
    const double speed = plausible_real(homing->fast_q32);
    const double acc = plausible_real(axis->limit.acc_q32);
    const double rest = speed * speed / (2 * acc);
    const double range = plausible_range(axis);

    if ((homing->by == HOMING_SWITCH || homing->by == HOMING_HARD_STOP) &&
        rest > range)
        plausible_say(self, axis->place,
                      "%s needs %.4g %s to rest from its homing speed of %.4g "
                      "%s/s, and its range is %.4g %s: a speed of %.4g would "
                      "be right for it",
                      axis->name, rest, plausible_unit(axis), speed,
                      plausible_unit(axis), range, plausible_unit(axis),
                      sqrt(0.02 * acc * range));
}

static void plausible_times(const struct plausible *self,
                            const struct rig_axis *axis)
{
    const int64_t heartbeat_ns = self->rig->heartbeat_ns;
    const struct rig_bus *bus =
        axis->bus != RIG_NO_BUS ? &self->rig->bus[axis->bus] : NULL;

    if (bus != NULL && bus->modbus.timeout_ns > PLAUSIBLE_TIMEOUT)
        plausible_say(self, axis->place,
                      "%s is known to be lost after %.4g s, three answers that "
                      "do not come on bus %s: they take 1 s at most as a rule",
                      axis->name,
                      PLAUSIBLE_LOST * plausible_s(bus->modbus.timeout_ns),
                      bus->name);
    if (rig_kinds[axis->kind]->has_heartbeat &&
        heartbeat_ns > PLAUSIBLE_HEARTBEAT)
        plausible_say(self, axis->place,
                      "%s is known to be lost by its heartbeat after %.4g s, "
                      "three of them: they come as a rule every 100 ms or less",
                      axis->name, PLAUSIBLE_LOST * plausible_s(heartbeat_ns));
    if (axis->watch_ns > PLAUSIBLE_WATCH)
        plausible_say(self, axis->place,
                      "%s goes on for %.4g s where its board does not hear "
                      "slew any more (watch): that is 1 s as a rule",
                      axis->name, plausible_s(axis->watch_ns));
}

/* Two motors push one bridge, and nothing keeps them together. */
static void plausible_racking(const struct plausible *self,
                              const struct rig_axis *axis)
{
    const struct plan_rig *const camera = self->rig->kinematics;

    if (!rig_has_bridge(self->rig) ||
        axis != &self->rig->axis[camera->carrier[0].axis] ||
        rig_rail_beside(self->rig, camera->carrier[0].axis) >= 0)
        return;
    const char *const other = self->rig->axis[camera->carrier[1].axis].name;
    plausible_say(self, axis->place,
                  "%s and %s carry one bridge, and homing, jogs and the way to "
                  "a move may rack it: they move as one with gantry: {bridge: "
                  "{rails: [%s, %s], racking: ...}}",
                  axis->name, other, axis->name, other);
}

void rig_plausible(const struct rig *rig,
                   void (*say)(void *context, struct plan_place place,
                               const char *text),
                   void *context)
{
    static const struct {
        enum rig_warning warning;
        void (*judge)(const struct plausible *self,
                      const struct rig_axis *axis);
    } plausible[] = {
        { RIG_WARNING_FOLLOWING, plausible_following },
        { RIG_WARNING_LIMITS, plausible_limits },
        { RIG_WARNING_STOP, plausible_stop },
        { RIG_WARNING_DRIVE, plausible_drive },
        { RIG_WARNING_HOMING, plausible_homing },
        { RIG_WARNING_TIMES, plausible_times },
        { RIG_WARNING_RACKING, plausible_racking },
    };
    struct plausible self = { rig, say, context, RIG_WARNING_FOLLOWING };

    for (uint32_t i = 0; i < rig->axis_count; i++)
        for (size_t k = 0; k < ARRAY_LEN(plausible); k++) {
            self.warning = plausible[k].warning;
            if ((rig->axis[i].acknowledged >> self.warning & 1) == 0)
                plausible[k].judge(&self, &rig->axis[i]);
        }
}
