/* firmware/linux/commands/run/cmd_jog.c - slew jog: move one axis by hand. */
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
#include "firmware/linux/commands/run/jog_keys.h"
#include "firmware/linux/commands/run/jog_service.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/otg.h"

#define CMD_JOG_EVERY_NS INT64_C(2000000000)

struct cmd_jog {
    const struct options *options;
    struct live live; /* or, where a service has the rig, its rig alone */
    struct served served;
    struct jog_keys keys;
    struct jog_wanted want;
    struct jog_result result;
};

static const struct rig_axis *cmd_jog_axis(const struct cmd_jog *self)
{
    return self->want.rig_axis;
}

/* --- doing it --- */

static int cmd_jog_start(struct cmd_jog *self)
{
    struct controller *controller = &self->live.machine.controller;
    struct controller_jog_goal goal = { .axis = self->want.axis,
                                        .pos_q32 = self->want.pos_q32,
                                        .vel_q32 = self->want.speed_q32 };
    int err = MOTION_OK;
    self->result.from_q32 = controller->axis[self->want.axis].target.pos_q32;
    if (self->want.kind == JOG_BY)
        err = motion_fixed_add(self->result.from_q32, self->want.pos_q32,
                               &goal.pos_q32);
    if (self->want.kind == JOG_AT) {
        goal.pos_q32 = jog_far_q32(&self->live, self->want.axis,
                                   self->want.direction, self->want.speed_q32);
        goal.until_ns = self->live.now_ns + self->want.for_ns;
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
    if (err == MOTION_E_LIMIT && self->want.kind != JOG_AT &&
        motion_fixed_add(self->want.kind == JOG_BY ? self->result.from_q32 : 0,
                         self->want.pos_q32, &pos_q32) == MOTION_OK &&
        (pos_q32 < cmd_jog_axis(self)->limit.pos_min_q32 ||
         pos_q32 > cmd_jog_axis(self)->limit.pos_max_q32))
        return jog_wanted_outside(cmd_jog_axis(self), pos_q32);
    if (err < 0) {
        error_say("slew jog: %s: %s", cmd_jog_axis(self)->name,
                  motion_err_text(err));
        return STATUS_REFUSED;
    }
    while ((controller->state == CONTROLLER_MOVING ||
            controller->state == CONTROLLER_STOPPING) &&
           *interrupts == 0)
        live_tick(live);
    self->result.dur_ns = live->now_ns - start_ns;
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
    const bool homed = machine->controller.axis[self->want.axis].homed;
    char why[HOMING_TEXT_MAX];
    if (homed || (self->want.kind != JOG_TO && !self->options->home))
        return STATUS_OK;
    if (!self->options->home) {
        error_say("slew jog: %s is not homed, so it cannot go to a position, "
                  "expected --home to home it first",
                  cmd_jog_axis(self)->name);
        return STATUS_REFUSED;
    }
    homing_start(&machine->homing, (uint64_t)1 << self->want.axis);
    while (homing_is_running(&machine->homing) && *interrupts == 0)
        live_tick(&self->live);
    if (machine->homing.state == HOMING_DONE)
        return STATUS_OK;
    error_say("slew jog: homing of %s: %s", cmd_jog_axis(self)->name,
              homing_failure(&machine->homing, why));
    return *interrupts > 0 ? STATUS_INTERRUPTED : STATUS_REFUSED;
}

static enum status cmd_jog_keys(struct cmd_jog *self,
                                const volatile sig_atomic_t *interrupts)
{
    const struct jog_keys_config config = {
        .axis = self->want.axis,
        .speed_q32 = self->want.speed_q32,
        .dead_man_ns = self->want.dead_man_ns,
    };
    struct jog_hand_live hand;
    jog_hand_live_init(&hand, &self->live);
    self->live.warn.draws = true;
    const enum status status =
        jog_keys_run(&self->keys, &hand.hand, &config, interrupts);
    self->live.warn.draws = false;
    jog_hand_live_free(&hand);
    return status;
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
    if (status == STATUS_OK && self->want.kind == JOG_BY_KEYS)
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

static void cmd_jog_reached(struct cmd_jog *self)
{
    const struct controller_axis *at =
        &self->live.machine.controller.axis[self->want.axis];
    self->result.pos_q32 = at->feedback.pos_q32;
    self->result.homed = at->homed;
    machine_fault_text(&self->live.machine, self->result.fault);
}

static void cmd_jog_report(const struct cmd_jog *self, enum status status)
{
    const struct rig_axis *axis = cmd_jog_axis(self);
    const struct jog_result *result = &self->result;
    char from[NUMBER_MAX], pos[NUMBER_MAX];
    if (self->options->json) {
        cJSON *report = cJSON_CreateObject();
        cJSON_AddStringToObject(report, "axis", axis->name);
        cJSON_AddStringToObject(report, "unit", units_axis_text(axis->unit));
        json_add_fixed(report, "from", result->from_q32, 32);
        json_add_fixed(report, "position", result->pos_q32, 32);
        cJSON_AddBoolToObject(report, "homed", result->homed);
        cJSON_AddNumberToObject(report, "duration_s",
                                (double)result->dur_ns / 1e9);
        if (result->fault[0] != 0)
            cJSON_AddStringToObject(report, "fault", result->fault);
        json_report(report, status == STATUS_OK);
        return;
    }
    number_fixed(from, result->from_q32, 32, 4);
    number_fixed(pos, result->pos_q32, 32, 4);
    if (self->want.kind != JOG_BY_KEYS && result->dur_ns > 0)
        printf("%s: from %s to %s %s%s in %.3f s\n", axis->name, from, pos,
               units_axis_text(axis->unit), result->homed ? "" : " (unhomed)",
               (double)result->dur_ns / 1e9);
    if (result->fault[0] != 0)
        printf("fault: %s\n", result->fault);
}

/* --- the command --- */

static enum status cmd_jog_own(struct cmd_jog *self)
{
    const struct options *options = self->options;
    if (options->dry_run)
        return live_dry_run_alone(&self->live, options);
    enum status status =
        live_begin(&self->live, options, "jog", self->want.kind == JOG_BY_KEYS);
    if (status != STATUS_OK)
        return status;
    status = cmd_jog_live(self);
    cmd_jog_reached(self);
    cmd_jog_report(self, status);
    return status;
}

static bool cmd_jog_is_plain(const struct options *options)
{
    return !options->dry_run && !options->pty && options->interface == NULL;
}

static enum status cmd_jog_served(struct cmd_jog *self)
{
    const struct options *options = self->options;
    enum status status = served_allow(&self->served, cmd_jog_is_plain(options),
                                      "--dry-run and --interface");
    if (status != STATUS_OK)
        return status;
    if (!command_may_move(options, "jog"))
        return STATUS_INPUT;
    served_say(&self->served, "a service has this rig: it moves the axis");
    self->served.interrupts = interrupt_listen();
    status = jog_service(&self->served, self->live.rig, &self->want,
                         &self->keys, &self->result);
    interrupt_listen_no_more();
    if (status == STATUS_OK)
        status = cmd_jog_save(self);
    cmd_jog_report(self, status);
    return status;
}

static enum status cmd_jog_rig(struct cmd_jog *self)
{
    const struct options *options = self->options;
    enum status status = live_read(&self->live, options);
    if (status == STATUS_OK)
        status = jog_wanted_read(&self->want, options, &self->live);
    if (status != STATUS_OK)
        return status;
    if (!options->json)
        jog_wanted_intent(&self->want);
    status = live_fits(&self->live, options);
    if (status != STATUS_OK)
        return status;
    jog_keys_init(&self->keys, self->live.rig);
    return served_find(&self->served, options, "jog", cmd_jog_is_plain(options))
               ? cmd_jog_served(self)
               : cmd_jog_own(self);
}

static enum status cmd_jog_run(const struct options *options)
{
    struct cmd_jog *self = memory_new(1, sizeof *self);
    self->options = options;
    self->served.link.file = -1;
    enum status status = cmd_jog_rig(self);
    served_close(&self->served);
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
    OPTIONS_YES("do not prompt before a real drive moves"),
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
        "Drives are simulated unless --real is given.  Where a service has "
        "the\n"
        "rig it moves the axis, and stops it when this program is gone or "
        "says\n"
        "nothing for the dead-man time.\n\n" LIVE_HELP_STOP,
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
