/* firmware/linux/commands/run/jog_keys.c - see jog_keys.h. */
#include "firmware/linux/commands/run/jog_keys.h"

#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/output.h"

#define JOG_SHOW_NS   INT64_C(100000000)
#define JOG_FASTER    5
#define JOG_TYPED_MAX 256 /* keys at one time */

static const struct rig_axis *jog_rig(const struct jog_keys *self)
{
    return &self->rig->axis[self->axis];
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
    if (self->hand->homing) {
        jog_say(self, "it is being homed; space stops that");
        return;
    }
    jog_say(self, self->hand->ops->move(self->hand, self->axis, direction,
                                        jog_speed(self, fast),
                                        self->config.dead_man_ns));
}

static void jog_stop(struct jog_keys *self, bool hard)
{
    self->hand->ops->stop(self->hand, hard);
}

static void jog_choose(struct jog_keys *self, unsigned step)
{
    if (self->hand->homing) {
        jog_say(self, "it is being homed; space stops that");
        return;
    }
    if (self->hand->state != CONTROLLER_READY) {
        jog_stop(self, false);
        jog_say(self, "stopping first");
        return;
    }
    self->axis = (self->axis + step) % self->rig->axis_count;
    jog_say(self, "");
}

static void jog_home(struct jog_keys *self)
{
    jog_say(self, jog_rig(self)->homing.by == HOMING_NONE
                      ? "this axis has no homing in the rig"
                      : self->hand->ops->home(self->hand, self->axis));
}

/* An axis that is not homed has no position to write down. */
static void jog_set_key(struct jog_keys *self)
{
    const unsigned axes = self->rig->axis_count;
    for (unsigned i = 0; i < axes; i++)
        if (!self->hand->axis[i].homed) {
            jog_say(self, "not while an axis is unhomed");
            return;
        }
    if (self->keys == JOG_KEYS_MAX) {
        jog_say(self, "no room for another key");
        return;
    }
    for (unsigned i = 0; i < axes; i++)
        self->key_q32[self->keys * axes + i] = self->hand->axis[i].target_q32;
    self->keys++;
    snprintf(self->said, sizeof self->said, "key %u set", self->keys);
}

static void jog_reset(struct jog_keys *self)
{
    const char *why = self->hand->ops->reset(self->hand);
    jog_say(self, why[0] != '\0' ? why : "reset; enabling");
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
        jog_choose(self, self->rig->axis_count - 1);
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

static bool jog_is_stop(int key)
{
    static const int others[] = {
        TERMINAL_LEFT,
        TERMINAL_FAST_LEFT,
        TERMINAL_RIGHT,
        TERMINAL_FAST_RIGHT,
        TERMINAL_UP,
        TERMINAL_DOWN,
        TERMINAL_END,
        'h',
        's',
        'r',
        'q',
    };
    size_t i = 0;
    while (i < ARRAY_LEN(others) && others[i] != key)
        i++;
    return i == ARRAY_LEN(others);
}

/* --- what is shown --- */

static void jog_show(struct jog_keys *self)
{
    const struct jog_hand *hand = self->hand;
    const struct jog_hand_axis *axis = &hand->axis[self->axis];
    const char *unit = units_axis_text(jog_rig(self)->unit);
    char pos[NUMBER_MAX], vel[NUMBER_MAX], line[512];
    if (hand->now_ns - self->shown_ns < JOG_SHOW_NS)
        return;
    self->shown_ns = hand->now_ns;
    number_fixed(pos, axis->pos_q32, 32, 3);
    number_fixed(vel, axis->vel_q32, 32, 2);
    snprintf(line, sizeof line, "\r\033[K%s %s %s%s  %s %s/s  %s  %s%s%s",
             jog_rig(self)->name, pos, unit, axis->homed ? "" : " (unhomed)",
             vel, unit, hand->doing, hand->fault,
             hand->fault[0] != 0 ? "  " : "", self->said);
    terminal_write(&self->terminal, line);
}

/* --- the loop --- */

/* After a reset the drives are off: torque again, as r asked for. */
static void jog_enable_again(const struct jog_keys *self)
{
    if (self->hand->state == CONTROLLER_OFF && !self->hand->enabling)
        self->hand->ops->enable(self->hand);
}

static bool jog_is_over(const struct jog_keys *self)
{
    const enum controller_state state = self->hand->state;
    return self->leaving &&
           (state == CONTROLLER_READY || state == CONTROLLER_OFF ||
            state == CONTROLLER_FAULT);
}

/* What was typed: from the last stop among it on, which is before all else. */
static bool jog_typed(struct jog_keys *self)
{
    int key[JOG_TYPED_MAX];
    unsigned count = 0, from = 0;
    while (count < JOG_TYPED_MAX &&
           (key[count] = terminal_key(&self->terminal)) != TERMINAL_NONE) {
        if (jog_is_stop(key[count]))
            from = count;
        if (key[count++] == TERMINAL_END)
            break;
    }
    for (unsigned i = from; i < count; i++)
        jog_key(self, key[i]);
    return count > 0 && key[count - 1] == TERMINAL_END;
}

/* False: nobody is there any more. */
static bool jog_tick(struct jog_keys *self)
{
    if (!self->hand->ops->step(self->hand))
        return false;
    if (jog_typed(self))
        return true;
    jog_enable_again(self);
    jog_show(self);
    return true;
}

void jog_keys_init(struct jog_keys *self, const struct rig *rig)
{
    memset(self, 0, sizeof *self);
    self->rig = rig;
    self->key_q32 = memory_new((size_t)JOG_KEYS_MAX * rig->axis_count,
                               sizeof *self->key_q32);
}

void jog_keys_free(struct jog_keys *self)
{
    memory_free(self->key_q32);
}

enum status jog_keys_run(struct jog_keys *self, struct jog_hand *hand,
                         const struct jog_keys_config *config,
                         const volatile sig_atomic_t *interrupts)
{
    self->hand = hand;
    self->config = *config;
    self->axis = config->axis;
    enum status status = STATUS_OK;
    if (terminal_open(&self->terminal) < 0) {
        error_say("slew jog: standard input is not a terminal, expected a "
                  "motion such "
                  "as +10mm");
        return STATUS_INPUT;
    }
    terminal_write(&self->terminal,
                   "left/right jog, with shift faster; up/down axis; space "
                   "stop; h home; s set key; r reset; q quit\r\n");
    while (status == STATUS_OK && !jog_is_over(self) && *interrupts < 2) {
        if (*interrupts == 1 && !self->leaving)
            jog_key(self, 'q');
        if (!jog_tick(self))
            status = STATUS_REFUSED;
    }
    terminal_write(&self->terminal, "\r\n");
    terminal_close(&self->terminal);
    return status;
}

/* --- the move that was set --- */

static void jog_save_axis(const struct jog_keys *self, unsigned axis,
                          int64_t every_ns, FILE *file)
{
    const struct rig_axis *rig = &self->rig->axis[axis];
    char t[NUMBER_MAX], pos[NUMBER_MAX];
    fprintf(file, "  %s:\n    curve: quintic\n    keys:\n", rig->name);
    for (unsigned k = 0; k < self->keys; k++) {
        number_fixed(t, (int64_t)k * every_ns, 0, 0);
        number_fixed(pos, self->key_q32[k * self->rig->axis_count + axis], 32,
                     9);
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
    for (unsigned i = 0; i < self->rig->axis_count; i++)
        jog_save_axis(self, i, every_ns, output.file);
    return output_commit(&output);
}
