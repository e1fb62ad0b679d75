/* firmware/linux/commands/jog_keys.c - see jog_keys.h. */
#include "firmware/linux/commands/jog_keys.h"

#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/output.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define JOG_SHOW_NS INT64_C(100000000)
#define JOG_FASTER  5
#define JOG_FAR_S   100 /* an axis that does not know where it is */

static const struct rig_axis *jog_rig(const struct jog_keys *self)
{
    return &self->live->rig->axis[self->axis];
}

static struct controller *jog_controller(const struct jog_keys *self)
{
    return &self->live->machine.controller;
}

int64_t jog_far_q32(const struct live *live, unsigned axis, int direction,
                    int64_t speed_q32)
{
    const struct controller_axis *at = &live->machine.controller.axis[axis];
    const struct plan_limit *limit = &live->rig->axis[axis].limit;
    const int64_t most_q32 = speed_q32 < INT64_MAX / JOG_FAR_S / 4
                                 ? speed_q32 * JOG_FAR_S
                                 : INT64_MAX / 4;
    int64_t far_q32;
    if (at->homed)
        return direction < 0 ? limit->pos_min_q32 : limit->pos_max_q32;
    if (motion_fixed_add(at->target.pos_q32,
                         direction < 0 ? -most_q32 : most_q32, &far_q32) < 0)
        return at->target.pos_q32;
    return far_q32;
}

static int64_t jog_speed(const struct jog_keys *self, bool fast)
{
    const int64_t limit_q32 = jog_rig(self)->limit.vel_q32;
    int64_t speed_q32 = limit_q32 / 10 + 1;
    if (self->config.speed_q32 > 0 && self->axis == self->config.axis)
        speed_q32 = self->config.speed_q32;
    if (!fast)
        return speed_q32;
    return speed_q32 < limit_q32 / JOG_FASTER ? JOG_FASTER * speed_q32
                                              : limit_q32;
}

/* --- what keys do --- */

static void jog_say(struct jog_keys *self, const char *what)
{
    snprintf(self->said, sizeof self->said, "%s", what);
}

static void jog_move(struct jog_keys *self, int direction, bool fast)
{
    const int64_t speed_q32 = jog_speed(self, fast);
    if (homing_is_running(&self->live->machine.homing)) {
        jog_say(self, "it is being homed; space stops that");
        return;
    }
    const struct controller_jog_goal goal = {
        .axis = self->axis,
        .pos_q32 = jog_far_q32(self->live, self->axis, direction, speed_q32),
        .vel_q32 = speed_q32,
        .until_ns = self->live->now_ns + self->config.dead_man_ns,
    };
    int err =
        controller_jog(jog_controller(self), &self->live->machine.jog, &goal);
    jog_say(self, err < 0 ? motion_err_text(err) : "");
}

static void jog_choose(struct jog_keys *self, unsigned step)
{
    if (homing_is_running(&self->live->machine.homing)) {
        jog_say(self, "it is being homed; space stops that");
        return;
    }
    if (jog_controller(self)->state != CONTROLLER_READY) {
        controller_jog_stop(jog_controller(self), &self->live->machine.jog,
                            false);
        jog_say(self, "stopping first");
        return;
    }
    self->axis = (self->axis + step) % self->live->rig->axis_count;
    jog_say(self, "");
}

static void jog_home(struct jog_keys *self)
{
    struct homing *homing = &self->live->machine.homing;
    if (jog_rig(self)->homing.by == HOMING_NONE)
        jog_say(self, "this axis has no homing in the rig");
    else if (homing_start(homing, (uint64_t)1 << self->axis) < 0)
        jog_say(self, "homing begins at rest only");
    else
        jog_say(self, "");
}

/* An axis that is not homed has no position to write down. */
static void jog_set_key(struct jog_keys *self)
{
    const struct controller *controller = jog_controller(self);
    for (unsigned i = 0; i < self->live->rig->axis_count; i++)
        if (!controller->axis[i].homed) {
            jog_say(self, "not while an axis is unhomed");
            return;
        }
    if (self->keys == JOG_KEYS_MAX) {
        jog_say(self, "no room for another key");
        return;
    }
    for (unsigned i = 0; i < self->live->rig->axis_count; i++)
        self->key_q32[self->keys * self->live->rig->axis_count + i] =
            controller->axis[i].target.pos_q32;
    self->keys++;
    snprintf(self->said, sizeof self->said, "key %u set", self->keys);
}

static void jog_reset(struct jog_keys *self)
{
    if (controller_reset(jog_controller(self)) < 0)
        jog_say(self, "not possible now");
    else
        jog_say(self, "reset; enabling");
}

static void jog_stop(struct jog_keys *self, bool hard)
{
    controller_jog_stop(jog_controller(self), &self->live->machine.jog, hard);
}

static void jog_key(struct jog_keys *self, int key)
{
    switch (key) {
    case TERMINAL_LEFT:
    case TERMINAL_FAST_LEFT:
        jog_move(self, -1, key == TERMINAL_FAST_LEFT);
        break;
    case TERMINAL_RIGHT:
    case TERMINAL_FAST_RIGHT:
        jog_move(self, 1, key == TERMINAL_FAST_RIGHT);
        break;
    case TERMINAL_UP:
        jog_choose(self, self->live->rig->axis_count - 1);
        break;
    case TERMINAL_DOWN:
        jog_choose(self, 1);
        break;
    case 'h':
        jog_home(self);
        break;
    case 's':
        jog_set_key(self);
        break;
    case 'r':
        jog_reset(self);
        break;
    case 'q':
    case TERMINAL_END:
        self->leaving = true;
        jog_stop(self, false);
        break;
    default:
        jog_stop(self, true); /* space, and whatever was hit in alarm */
        break;
    }
}

/* --- what is shown --- */

static const char *jog_state(const struct jog_keys *self)
{
    const struct homing *homing = &self->live->machine.homing;
    if (homing_is_running(homing))
        return homing_state_text(homing->state);
    return controller_state_text(jog_controller(self)->state);
}

static void jog_show(struct jog_keys *self)
{
    const struct controller_axis *axis =
        &jog_controller(self)->axis[self->axis];
    const struct homing *homing = &self->live->machine.homing;
    const char *unit = units_axis_text(jog_rig(self)->unit);
    char pos[NUMBER_MAX], vel[NUMBER_MAX], fault[LIVE_FAULT_MAX], line[512];
    char why[HOMING_TEXT_MAX];
    if (self->live->now_ns - self->shown_ns < JOG_SHOW_NS)
        return;
    self->shown_ns = self->live->now_ns;
    number_fixed(pos, axis->feedback.pos_q32, 32, 3);
    number_fixed(vel, axis->feedback.vel_q32, 32, 2);
    live_fault_text(self->live, fault);
    if (fault[0] == 0 && homing->state == HOMING_FAILED)
        snprintf(fault, sizeof fault, "homing: %s",
                 homing_failure(homing, why));
    snprintf(line, sizeof line, "\r\033[K%s %s %s%s  %s %s/s  %s  %s%s%s",
             jog_rig(self)->name, pos, unit, axis->homed ? "" : " (unhomed)",
             vel, unit, jog_state(self), fault, fault[0] != 0 ? "  " : "",
             self->said);
    terminal_write(&self->terminal, line);
}

/* --- the loop --- */

/* After a reset the drives are off: torque again, as r asked for. */
static void jog_enable_again(const struct jog_keys *self)
{
    struct controller *controller = jog_controller(self);
    if (controller->state == CONTROLLER_OFF && !controller->enabling)
        (void)controller_enable(controller);
}

static bool jog_is_over(const struct jog_keys *self)
{
    const enum controller_state state = jog_controller(self)->state;
    return self->leaving &&
           (state == CONTROLLER_READY || state == CONTROLLER_OFF ||
            state == CONTROLLER_FAULT);
}

static void jog_tick(struct jog_keys *self)
{
    live_tick(self->live);
    for (int key; (key = terminal_key(&self->terminal)) != TERMINAL_NONE;) {
        jog_key(self, key);
        if (key == TERMINAL_END)
            return;
    }
    jog_enable_again(self);
    jog_show(self);
}

void jog_keys_init(struct jog_keys *self, const struct rig *rig)
{
    memset(self, 0, sizeof *self);
    self->key_q32 = memory_new((size_t)JOG_KEYS_MAX * rig->axis_count,
                               sizeof *self->key_q32);
}

void jog_keys_free(struct jog_keys *self)
{
    memory_free(self->key_q32);
}

enum status jog_keys_run(struct jog_keys *self, struct live *live,
                         const struct jog_keys_config *config,
                         const volatile sig_atomic_t *interrupts)
{
    self->live = live;
    self->config = *config;
    self->axis = config->axis;
    if (terminal_open(&self->terminal) < 0) {
        error_say("slew jog: standard input is not a terminal, expected a "
                  "motion such "
                  "as +10mm");
        return STATUS_INPUT;
    }
    terminal_write(&self->terminal,
                   "left/right jog, with shift faster; up/down axis; space "
                   "stop; h home; s set key; r reset; q quit\r\n");
    while (!jog_is_over(self) && *interrupts < 2) {
        if (*interrupts == 1 && !self->leaving)
            jog_key(self, 'q');
        jog_tick(self);
    }
    terminal_write(&self->terminal, "\r\n");
    terminal_close(&self->terminal);
    return STATUS_OK;
}

/* --- the move that was set --- */

static void jog_save_axis(const struct jog_keys *self, unsigned axis,
                          int64_t every_ns, FILE *file)
{
    const struct rig_axis *rig = &self->live->rig->axis[axis];
    char t[NUMBER_MAX], pos[NUMBER_MAX];
    fprintf(file, "  %s:\n    curve: quintic\n    keys:\n", rig->name);
    for (unsigned k = 0; k < self->keys; k++) {
        number_fixed(t, (int64_t)k * every_ns, 0, 0);
        number_fixed(pos, self->key_q32[k * self->live->rig->axis_count + axis],
                     32, 9);
        fprintf(file, "      - [%s ns, %s %s]\n", t, pos,
                units_axis_text(rig->unit));
    }
}

int jog_keys_save(const struct jog_keys *self, const char *path,
                  int64_t every_ns)
{
    struct output output;
    if (output_open(&output, path) < 0)
        return -1;
    fputs("axes:\n", output.file);
    for (unsigned i = 0; i < self->live->rig->axis_count; i++)
        jog_save_axis(self, i, every_ns, output.file);
    return output_commit(&output);
}
