/* firmware/linux/commands/cmd_jog.c - slew jog: move one axis by hand. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/units.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/jog_keys.h"
#include "firmware/linux/commands/live.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/otg.h"

#define CMD_JOG_DEAD_MAN_NS INT64_C(250000000)
#define CMD_JOG_EVERY_NS    INT64_C(2000000000)

/* What the words after the axis say. */
enum cmd_jog_kind { JOG_BY_KEYS, JOG_BY, JOG_TO, JOG_AT };

struct cmd_jog {
    const struct options *options;
    struct live live;
    struct jog_keys keys;
    unsigned axis;
    enum cmd_jog_kind kind;
    int64_t pos_q32;   /* BY: distance, TO: where */
    int64_t speed_q32; /* highest, > 0 */
    int direction;     /* AT */
    int64_t for_ns;    /* AT */
    int64_t from_q32, dur_ns;
};

static const struct rig_axis *cmd_jog_axis(const struct cmd_jog *self)
{
    return &self->live.rig->axis[self->axis];
}

/* --- the words --- */

/* All words from `first` up to `end`, parted by blanks: units may stand
 * apart. */
static void cmd_jog_join(const struct cmd_jog *self, int first, int end,
                         char *text, size_t capacity)
{
    size_t at = 0;
    text[0] = 0;
    for (int i = first; i < end && at < capacity; i++)
        at += (size_t)snprintf(text + at, capacity - at, "%s%s",
                               i > first ? " " : "", self->options->path[i]);
}

static int cmd_jog_value(const struct cmd_jog *self, int first, int end,
                         enum units_quantity quantity, int64_t *out)
{
    const struct units_context units = { .unit = cmd_jog_axis(self)->unit };
    char text[128], sentence[UNITS_SENTENCE_MAX];
    cmd_jog_join(self, first, end, text, sizeof text);
    if (units_parse(text, quantity, &units, out, sentence) == 0)
        return 0;
    error_say("slew jog: %s", sentence);
    return -1;
}

static int cmd_jog_fail(void)
{
    error_say("slew jog: expected +10mm, -10mm, to 45deg, or at 5mm/s for 2s");
    return -1;
}

static int cmd_jog_find(const struct cmd_jog *self, const char *word)
{
    for (int i = 2; i < self->options->path_count; i++)
        if (strcmp(self->options->path[i], word) == 0)
            return i;
    return -1;
}

static int cmd_jog_read_at(struct cmd_jog *self)
{
    const int count = self->options->path_count;
    const int split = cmd_jog_find(self, "for");
    int64_t for_ns_q12;
    if (split < 4 || split + 1 >= count)
        return cmd_jog_fail();
    if (cmd_jog_value(self, 3, split, UNITS_VELOCITY, &self->speed_q32) < 0 ||
        cmd_jog_value(self, split + 1, count, UNITS_TIME, &for_ns_q12) < 0)
        return -1;
    self->kind = JOG_AT;
    self->direction = self->speed_q32 < 0 ? -1 : 1;
    if (self->speed_q32 < 0)
        self->speed_q32 = -self->speed_q32;
    self->for_ns = for_ns_q12 / MOTION_FIXED_NS_Q12;
    return self->speed_q32 == 0 || self->for_ns <= 0 ? cmd_jog_fail() : 0;
}

static int cmd_jog_read(struct cmd_jog *self)
{
    const struct options *options = self->options;
    const char *word = options->path_count > 2 ? options->path[2] : NULL;
    if (word == NULL)
        return 0;
    if (strcmp(word, "at") == 0)
        return cmd_jog_read_at(self);
    self->kind = strcmp(word, "to") == 0 ? JOG_TO : JOG_BY;
    if (self->kind == JOG_BY && strchr("+- ", word[0]) == NULL)
        return cmd_jog_fail();
    const int first = self->kind == JOG_TO ? 3 : 2;
    if (first >= options->path_count)
        return cmd_jog_fail();
    return cmd_jog_value(self, first, options->path_count, UNITS_POSITION,
                         &self->pos_q32);
}

/* --speed, or a quarter of the limit. */
static int cmd_jog_speed(struct cmd_jog *self)
{
    const struct rig_axis *axis = cmd_jog_axis(self);
    const struct units_context units = { .unit = axis->unit };
    char sentence[UNITS_SENTENCE_MAX];
    if (self->kind == JOG_AT)
        return 0;
    if (self->options->speed == NULL) {
        self->speed_q32 =
            self->kind == JOG_BY_KEYS ? 0 : axis->limit.vel_q32 / 4 + 1;
        return 0;
    }
    if (units_parse(self->options->speed, UNITS_VELOCITY, &units,
                    &self->speed_q32, sentence) < 0) {
        error_say("slew jog: --speed: %s", sentence);
        return -1;
    }
    if (self->speed_q32 > 0)
        return 0;
    error_say("slew jog: --speed is not above zero, expected a speed such as "
              "5mm/s");
    return -1;
}

/* Which end it would leave. */
static enum status cmd_jog_outside(const struct cmd_jog *self, int64_t pos_q32)
{
    const struct rig_axis *axis = cmd_jog_axis(self);
    const bool below = pos_q32 < axis->limit.pos_min_q32;
    const char *unit = units_axis_text(axis->unit);
    char pos[NUMBER_MAX], min[NUMBER_MAX], max[NUMBER_MAX];
    number_short(pos, pos_q32, 32);
    number_short(min, axis->limit.pos_min_q32, 32);
    number_short(max, axis->limit.pos_max_q32, 32);
    error_say("slew jog: %s %s is %s the %s limit of %s, expected a position "
              "from %s to %s %s",
              pos, unit, below ? "below" : "above", below ? "lower" : "upper",
              axis->name, min, max, unit);
    return STATUS_REFUSED;
}

static enum status cmd_jog_limits(const struct cmd_jog *self)
{
    const struct rig_axis *axis = cmd_jog_axis(self);
    char speed[NUMBER_MAX], limit[NUMBER_MAX];
    if (self->speed_q32 > axis->limit.vel_q32) {
        number_short(speed, self->speed_q32, 32);
        number_short(limit, axis->limit.vel_q32, 32);
        error_say(
            "slew jog: %s %s/s is above the limit of %s, expected at most "
            "%s %s/s",
            speed, units_axis_text(axis->unit), axis->name, limit,
            units_axis_text(axis->unit));
        return STATUS_REFUSED;
    }
    if (self->kind != JOG_TO || (self->pos_q32 >= axis->limit.pos_min_q32 &&
                                 self->pos_q32 <= axis->limit.pos_max_q32))
        return STATUS_OK;
    return cmd_jog_outside(self, self->pos_q32);
}

/* --- what will happen --- */

/* How long a displacement takes from rest to rest; -1: it cannot be planned. */
static double cmd_jog_duration_s(const struct cmd_jog *self,
                                 int64_t displacement_q32)
{
    const struct plan_limit *limit = &cmd_jog_axis(self)->limit;
    struct motion_otg_plan plan;
    const struct motion_otg_move move = {
        .goal = { .pos_q32 = displacement_q32 },
        .limit = { .vel_max_q32 = self->speed_q32,
                   .vel_min_q32 = -self->speed_q32,
                   .acc_max_q32 = limit->acc_q32,
                   .acc_min_q32 = -limit->acc_q32,
                   .jerk_q32 = limit->jerk_q32 },
    };
    if (motion_otg_make(&move, &plan, NULL) < 0)
        return -1;
    return number_double(plan.dur_ns_q12, 12) / 1e9;
}

static void cmd_jog_intent(const struct cmd_jog *self)
{
    const struct rig_axis *axis = cmd_jog_axis(self);
    const char *unit = units_axis_text(axis->unit);
    char pos[NUMBER_MAX], speed[NUMBER_MAX], acc[NUMBER_MAX];
    number_short(pos, self->pos_q32, 32);
    number_short(speed, self->speed_q32, 32);
    number_short(acc, axis->limit.acc_q32, 32);
    printf("%s drives, %s: ", self->options->real ? "REAL" : "simulated",
           axis->name);
    if (self->kind == JOG_AT)
        printf("%s %s/s in the %s direction for %.3f s, then to rest", speed,
               unit, self->direction < 0 ? "negative" : "positive",
               (double)self->for_ns / 1e9);
    else if (self->kind == JOG_BY)
        printf("%s %s from where it is, %.3f s", pos, unit,
               cmd_jog_duration_s(self, self->pos_q32));
    else if (self->kind == JOG_TO)
        printf("to %s %s", pos, unit);
    else
        printf("by keys");
    if (self->kind == JOG_BY || self->kind == JOG_TO)
        printf(", at most %s %s/s", speed, unit);
    printf(", at most %s %s/s2\n", acc, unit);
    fflush(stdout);
}

/* --- doing it --- */

static int cmd_jog_start(struct cmd_jog *self)
{
    struct controller *controller = &self->live.machine.controller;
    struct controller_jog_goal goal = { .axis = self->axis,
                                        .pos_q32 = self->pos_q32,
                                        .vel_q32 = self->speed_q32 };
    int err = MOTION_OK;
    self->from_q32 = controller->axis[self->axis].target.pos_q32;
    if (self->kind == JOG_BY)
        err = motion_fixed_add(self->from_q32, self->pos_q32, &goal.pos_q32);
    if (self->kind == JOG_AT) {
        goal.pos_q32 = jog_far_q32(&self->live, self->axis, self->direction,
                                   self->speed_q32);
        goal.until_ns = self->live.now_ns + self->for_ns;
    }
    return err < 0 ? err
                   : controller_jog(controller, &self->live.machine.jog, &goal);
}

static enum status cmd_jog_once(struct cmd_jog *self,
                                const volatile sig_atomic_t *interrupts)
{
    struct live *live = &self->live;
    const struct controller *controller = &live->machine.controller;
    const int64_t start_ns = live->now_ns;
    int64_t pos_q32;
    int err = cmd_jog_start(self);
    if (err == MOTION_E_LIMIT && self->kind != JOG_AT &&
        motion_fixed_add(self->kind == JOG_BY ? self->from_q32 : 0,
                         self->pos_q32, &pos_q32) == MOTION_OK &&
        (pos_q32 < cmd_jog_axis(self)->limit.pos_min_q32 ||
         pos_q32 > cmd_jog_axis(self)->limit.pos_max_q32))
        return cmd_jog_outside(self, pos_q32);
    if (err < 0) {
        error_say("slew jog: %s: %s", cmd_jog_axis(self)->name,
                  motion_err_text(err));
        return STATUS_REFUSED;
    }
    while ((controller->state == CONTROLLER_MOVING ||
            controller->state == CONTROLLER_STOPPING) &&
           *interrupts < 2) {
        if (*interrupts == 1)
            controller_jog_stop(&live->machine.controller, &live->machine.jog,
                                true);
        live_tick(live);
    }
    self->dur_ns = live->now_ns - start_ns;
    for (int i = 0; i < 100 && controller->state == CONTROLLER_READY; i++)
        live_tick(live); /* the servo settles */
    if (*interrupts > 0)
        return STATUS_INTERRUPTED;
    return controller->fault.fault == CONTROLLER_FAULT_NONE ? STATUS_OK
                                                            : STATUS_REFUSED;
}

/* Is the axis homed, or does it not matter? */
static enum status cmd_jog_home(struct cmd_jog *self,
                                const volatile sig_atomic_t *interrupts)
{
    struct machine *machine = &self->live.machine;
    const bool homed = machine->controller.axis[self->axis].homed;
    char why[HOMING_TEXT_MAX];
    if (homed || (self->kind != JOG_TO && !self->options->home))
        return STATUS_OK;
    if (!self->options->home) {
        error_say("slew jog: %s is not homed, so it cannot go to a position, "
                  "expected --home to home it first",
                  cmd_jog_axis(self)->name);
        return STATUS_REFUSED;
    }
    homing_start(&machine->homing, (uint64_t)1 << self->axis);
    while (homing_is_running(&machine->homing) && *interrupts < 2) {
        if (*interrupts == 1)
            controller_stop(&machine->controller);
        live_tick(&self->live);
    }
    if (machine->homing.state == HOMING_DONE)
        return STATUS_OK;
    error_say("slew jog: homing of %s: %s", cmd_jog_axis(self)->name,
              homing_failure(&machine->homing, why));
    return *interrupts > 0 ? STATUS_INTERRUPTED : STATUS_REFUSED;
}

static enum status cmd_jog_keys(struct cmd_jog *self,
                                const volatile sig_atomic_t *interrupts)
{
    const struct options *options = self->options;
    const struct jog_keys_config config = {
        .axis = self->axis,
        .speed_q32 = self->speed_q32,
        .dead_man_ns = options->dead_man_ns < 0 ? CMD_JOG_DEAD_MAN_NS
                                                : options->dead_man_ns,
    };
    return jog_keys_run(&self->keys, &self->live, &config, interrupts);
}

static enum status cmd_jog_save(const struct cmd_jog *self)
{
    const struct options *options = self->options;
    if (options->keys == NULL || self->keys.keys == 0)
        return STATUS_OK;
    return jog_keys_save(&self->keys, options->keys,
                         options->key_every_ns < 0 ? CMD_JOG_EVERY_NS
                                                   : options->key_every_ns) < 0
               ? STATUS_SYSTEM
               : STATUS_OK;
}

static enum status cmd_jog_live(struct cmd_jog *self)
{
    const volatile sig_atomic_t *interrupts = interrupt_listen();
    enum status status = STATUS_REFUSED;
    if (live_enable(&self->live, interrupts))
        status = cmd_jog_home(self, interrupts);
    if (status == STATUS_OK && self->kind == JOG_BY_KEYS)
        status = cmd_jog_keys(self, interrupts);
    else if (status == STATUS_OK)
        status = cmd_jog_once(self, interrupts);
    const bool off = live_off(&self->live, interrupts);
    interrupt_listen_no_more();
    if (!off)
        return STATUS_REFUSED;
    return status == STATUS_OK ? cmd_jog_save(self) : status;
}

/* --- what came of it --- */

static void cmd_jog_report(const struct cmd_jog *self, enum status status)
{
    const struct rig_axis *axis = cmd_jog_axis(self);
    const struct controller_axis *at =
        &self->live.machine.controller.axis[self->axis];
    char from[NUMBER_MAX], pos[NUMBER_MAX], fault[LIVE_FAULT_MAX];
    live_fault_text(&self->live, fault);
    if (self->options->json) {
        cJSON *report = cJSON_CreateObject();
        cJSON_AddBoolToObject(report, "ok", status == STATUS_OK);
        cJSON_AddStringToObject(report, "axis", axis->name);
        cJSON_AddStringToObject(report, "unit", units_axis_text(axis->unit));
        json_add_fixed(report, "from", self->from_q32, 32);
        json_add_fixed(report, "position", at->feedback.pos_q32, 32);
        cJSON_AddBoolToObject(report, "homed", at->homed);
        cJSON_AddNumberToObject(report, "duration_s",
                                (double)self->dur_ns / 1e9);
        if (fault[0] != 0)
            cJSON_AddStringToObject(report, "fault", fault);
        json_print(report, stdout);
        return;
    }
    number_fixed(from, self->from_q32, 32, 4);
    number_fixed(pos, at->feedback.pos_q32, 32, 4);
    if (self->kind != JOG_BY_KEYS && self->dur_ns > 0)
        printf("%s: from %s to %s %s%s in %.3f s\n", axis->name, from, pos,
               units_axis_text(axis->unit), at->homed ? "" : " (unhomed)",
               (double)self->dur_ns / 1e9);
    if (fault[0] != 0)
        printf("fault: %s\n", fault);
}

/* --- the command --- */

static enum status cmd_jog_words(struct cmd_jog *self)
{
    const struct options *options = self->options;
    if (options->path_count < 2) {
        error_say("slew jog: which axis? expected RIG AXIS");
        return STATUS_INPUT;
    }
    const int axis = live_axis(&self->live, "jog", options->path[1]);
    if (axis < 0)
        return STATUS_INPUT;
    self->axis = (unsigned)axis;
    if (cmd_jog_read(self) < 0 || cmd_jog_speed(self) < 0)
        return STATUS_INPUT;
    if (options->keys != NULL && access(options->keys, F_OK) == 0) {
        error_say("%s: is there already, expected a new file for the keys",
                  options->keys);
        return STATUS_INPUT;
    }
    return cmd_jog_limits(self);
}

static enum status cmd_jog_rig(struct cmd_jog *self)
{
    const struct options *options = self->options;
    enum status status = live_read(&self->live, options);
    if (status == STATUS_OK)
        status = cmd_jog_words(self);
    if (status != STATUS_OK)
        return status;
    if (!options->json)
        cmd_jog_intent(self);
    if (options->dry_run)
        return live_dry_run_alone(&self->live, options);
    jog_keys_init(&self->keys, self->live.rig);
    status = live_begin(&self->live, options, "jog", self->kind == JOG_BY_KEYS);
    if (status != STATUS_OK)
        return status;
    status = cmd_jog_live(self);
    cmd_jog_report(self, status);
    return status;
}

static enum status cmd_jog_run(const struct options *options)
{
    struct cmd_jog *self = memory_new(1, sizeof *self);
    self->options = options;
    enum status status = cmd_jog_rig(self);
    live_close(&self->live);
    jog_keys_free(&self->keys);
    memory_free(self);
    return status;
}

static const struct option_row cmd_jog_option[] = {
    { "speed", "SPEED", OPTION_TEXT, offsetof(struct options, speed),
      "at most so fast (a quarter of the limit; by keys a tenth)" },
    { "home", NULL, OPTION_FLAG, offsetof(struct options, home),
      "home the axis first when its position is not known" },
    { "keys", "FILE", OPTION_TEXT, offsetof(struct options, keys),
      "by keys: write the positions that s has set as a move" },
    { "key-every", "TIME", OPTION_TIME, offsetof(struct options, key_every_ns),
      "time between two of them (2 s)" },
    { "dead-man", "TIME", OPTION_TIME, offsetof(struct options, dead_man_ns),
      "by keys: stop when no key has come for so long (250ms)" },
    OPTIONS_DRY_RUN("say what would happen and stop there"),
    OPTIONS_REAL("move the real drive, on the interfaces of the rig"),
    OPTIONS_YES("do not ask before a real drive moves"),
    OPTIONS_PORTS,
    OPTIONS_COMMON,
};

const struct command cmd_jog = {
    .name = "jog",
    .arguments =
        "RIG AXIS [+DISTANCE | -DISTANCE | to POSITION | at SPEED for TIME]",
    .summary = "move one axis by hand: a distance, to a position, or by keys",
    .text =
        "Moves one axis in the least time inside its limits, and stops; the\n"
        "others stand with torque.  Without a motion the keys of the terminal\n"
        "move it: left and right while held, with shift faster, up and down\n"
        "another axis, space stops, h homes, s sets a key of a move, r resets\n"
        "after a fault, q leaves.  The axis stops when no key comes any more,\n"
        "also when the terminal is gone.\n\n"
        "An axis that is not homed can be moved, but not to a position.\n"
        "A limit switch, the e-stop and every fault stop a jog as a move.\n\n"
        "Drives are simulated unless --real is given.\n\n" LIVE_HELP_STOP,
    .examples = "  slew jog rig.yaml dolly +10mm\n"
                "  slew jog --speed 5mm/s rig.yaml dolly -2.5 mm\n"
                "  slew jog rig.yaml pan to 45deg\n"
                "  slew jog rig.yaml pan at -5deg/s for 2s\n"
                "  slew jog --keys move.yaml rig.yaml dolly\n",
    .path_max = 8,
    .negative = true,
    COMMAND_OPTIONS(cmd_jog_option),
    .run = cmd_jog_run,
};
