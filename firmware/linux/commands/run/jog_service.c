/* firmware/linux/commands/run/jog_service.c - see jog_service.h. */
#include "firmware/linux/commands/run/jog_service.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

#include "firmware/control/playback.h"
#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/machine/view.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define JOG_SERVICE_SETTLE    2    /* looks more, the servo settles */
#define JOG_SERVICE_ANSWER_MS 1000 /* keys are not looked at meanwhile */

struct jog_service {
    struct jog_hand hand; /* for keys */
    struct served *served;
    const struct jog_wanted *want;
    struct machine_view view;
    struct memory_pool memory;
    char said[256];
};

static int64_t jog_now_ns(void)
{
    struct timespec now = { 0 };
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

static const struct machine_view_axis *jog_axis_of(struct jog_service *self,
                                                   unsigned axis)
{
    machine_view_from(self->hand.rig, self->served->status, &self->view);
    return &self->view.axis[axis];
}

static cJSON *jog_command(const struct jog_service *self, unsigned axis,
                          int64_t vel_q32, int64_t for_ns)
{
    cJSON *command = served_command("jog");
    cJSON_AddStringToObject(command, "axis", self->hand.rig->axis[axis].name);
    json_add_fixed(command, "speed", vel_q32, 32);
    cJSON_AddNumberToObject(command, "for", (double)for_ns / 1e9);
    return command;
}

/* --- a motion that the words say --- */

static enum status jog_home(struct jog_service *self)
{
    const struct jog_wanted *want = self->want;
    struct served *served = self->served;
    if (jog_axis_of(self, want->axis)->homed ||
        (want->kind != JOG_TO && !want->options->home))
        return STATUS_OK;
    if (!want->options->home) {
        error_say("slew jog: %s is not homed, so it cannot go to a position, "
                  "expected --home to home it first",
                  want->rig_axis->name);
        return STATUS_REFUSED;
    }
    cJSON *command = served_command("home");
    cJSON_AddItemToArray(cJSON_AddArrayToObject(command, "axes"),
                         cJSON_CreateString(want->rig_axis->name));
    const enum status status = served_then(served, command, "ready", "homing");
    if (status != STATUS_OK || jog_axis_of(self, want->axis)->homed)
        return status;
    error_say("slew jog: homing of %s failed", want->rig_axis->name);
    return STATUS_REFUSED;
}

/* The goal of BY and TO. */
static enum status jog_goal(struct jog_service *self, int64_t *goal_q32)
{
    const struct jog_wanted *want = self->want;
    const struct machine_view_axis *at = jog_axis_of(self, want->axis);
    const struct plan_limit *limit = &want->rig_axis->limit;
    *goal_q32 = want->pos_q32;
    if (want->kind == JOG_BY &&
        motion_fixed_add(at->demand_q32, want->pos_q32, goal_q32) < 0) {
        error_say("slew jog: %s: %s", want->rig_axis->name,
                  motion_err_text(MOTION_E_RANGE));
        return STATUS_REFUSED;
    }
    if (at->homed &&
        (*goal_q32 < limit->pos_min_q32 || *goal_q32 > limit->pos_max_q32))
        return jog_wanted_outside(want->rig_axis, *goal_q32);
    return STATUS_OK;
}

static enum status jog_to(struct jog_service *self, int64_t goal_q32)
{
    const struct jog_wanted *want = self->want;
    struct served *served = self->served;
    enum status status = STATUS_OK;
    while (status == STATUS_OK && !served->stopped) {
        if (strcmp(served->state, "ready") == 0 &&
            jog_axis_of(self, want->axis)->demand_q32 == goal_q32)
            return STATUS_OK;
        cJSON *command =
            jog_command(self, want->axis, want->speed_q32, JOG_DEAD_MAN_NS);
        json_add_fixed(command, "to", goal_q32, 32);
        status = served_do(served, command);
        if (status == STATUS_OK)
            status = served_step(served);
    }
    return status;
}

/* The last one is for what is left of the time. */
static enum status jog_at(struct jog_service *self)
{
    const struct jog_wanted *want = self->want;
    const int64_t until_ns = jog_now_ns() + want->for_ns;
    const int64_t vel_q32 = want->direction * want->speed_q32;
    enum status status = STATUS_OK;
    while (status == STATUS_OK && !self->served->stopped) {
        const int64_t left_ns = until_ns - jog_now_ns();
        if (left_ns < 1000000)
            break;
        status = served_do(
            self->served,
            jog_command(self, want->axis, vel_q32,
                        left_ns < JOG_DEAD_MAN_NS ? left_ns : JOG_DEAD_MAN_NS));
        if (status == STATUS_OK && left_ns < JOG_DEAD_MAN_NS)
            break;
        if (status == STATUS_OK)
            status = served_step(self->served);
    }
    return status == STATUS_OK ? served_wait(self->served, "ready") : status;
}

static enum status jog_once(struct jog_service *self, struct jog_result *result)
{
    int64_t goal_q32 = 0;
    enum status status = jog_home(self);
    if (status == STATUS_OK && self->want->kind != JOG_AT)
        status = jog_goal(self, &goal_q32);
    if (status != STATUS_OK)
        return status;
    result->from_q32 = jog_axis_of(self, self->want->axis)->demand_q32;
    const int64_t start_ns = jog_now_ns();
    status = self->want->kind == JOG_AT ? jog_at(self) : jog_to(self, goal_q32);
    if (status == STATUS_OK && self->served->stopped)
        status = served_wait(self->served, "ready");
    result->dur_ns = jog_now_ns() - start_ns;
    for (int i = 0; status == STATUS_OK && i < JOG_SERVICE_SETTLE; i++)
        status = served_step(self->served);
    return status;
}

/* --- by keys --- */

static struct jog_service *jog_service_of(struct jog_hand *hand)
{
    return (struct jog_service *)(void *)hand;
}

static void jog_see(struct jog_service *self)
{
    const struct served *served = self->served;
    const cJSON *turn = cJSON_GetObjectItem(served->status, "homing_turn");
    const char *step = cJSON_GetStringValue(cJSON_GetObjectItem(turn, "step"));
    const char *why = cJSON_GetStringValue(cJSON_GetObjectItem(turn, "text"));
    struct jog_hand *hand = &self->hand;
    (void)jog_axis_of(self, 0);
    hand->now_ns = jog_now_ns();
    hand->enabling = served->enabling;
    hand->homing = served->homing;
    for (int i = CONTROLLER_OFF; i <= CONTROLLER_FAULT; i++)
        if (strcmp(served->state,
                   controller_state_text((enum controller_state)i)) == 0)
            hand->state = (enum controller_state)i;
    snprintf(hand->doing, sizeof hand->doing, "%s",
             hand->homing && step != NULL ? step : served->state);
    snprintf(hand->fault, sizeof hand->fault, "%s", served->fault);
    if (hand->fault[0] == '\0' && why != NULL && why[0] != '\0')
        snprintf(hand->fault, sizeof hand->fault, "homing: %s", why);
    for (unsigned i = 0; i < hand->rig->axis_count; i++)
        hand->axis[i] = (struct jog_hand_axis){ self->view.axis[i].pos_q32,
                                                self->view.axis[i].vel_q32,
                                                self->view.axis[i].demand_q32,
                                                self->view.axis[i].homed };
}

/* "" when it is done; else why not. */
static const char *jog_try(struct jog_hand *hand, cJSON *command)
{
    struct jog_service *self = jog_service_of(hand);
    cJSON *answer = service_link_ask(&self->served->link, command,
                                     JOG_SERVICE_ANSWER_MS, NULL, NULL);
    const char *text =
        cJSON_GetStringValue(cJSON_GetObjectItem(answer, "text"));
    snprintf(self->said, sizeof self->said, "%s",
             answer == NULL ? "the service does not answer"
             : text != NULL ? text
                            : "");
    cJSON_Delete(answer);
    return self->said;
}

static bool jog_hand_step(struct jog_hand *hand)
{
    const struct timespec pause = { .tv_nsec = SERVED_LOOK_MS / 2 * 1000000L };
    struct jog_service *self = jog_service_of(hand);
    (void)nanosleep(&pause, NULL);
    if (served_look(self->served) != STATUS_OK ||
        served_goes_on(self->served) != STATUS_OK)
        return false;
    jog_see(self);
    return true;
}

static const char *jog_hand_move(struct jog_hand *hand, unsigned axis,
                                 int direction, int64_t speed_q32,
                                 int64_t for_ns)
{
    return jog_try(hand, jog_command(jog_service_of(hand), axis,
                                     direction * speed_q32, for_ns));
}

static void jog_hand_stop(struct jog_hand *hand, bool hard)
{
    jog_service_of(hand)->served->own_stops += hard;
    (void)jog_try(hand, served_command(hard ? "stop" : "jog stop"));
}

static const char *jog_hand_home(struct jog_hand *hand, unsigned axis)
{
    cJSON *command = served_command("home");
    cJSON_AddItemToArray(cJSON_AddArrayToObject(command, "axes"),
                         cJSON_CreateString(hand->rig->axis[axis].name));
    return jog_try(hand, command);
}

static const char *jog_hand_reset(struct jog_hand *hand)
{
    return jog_try(hand, served_command("reset"));
}

static void jog_hand_enable(struct jog_hand *hand)
{
    (void)jog_try(hand, served_command("enable"));
}

static const struct jog_hand_ops jog_service_ops = {
    .step = jog_hand_step,
    .move = jog_hand_move,
    .stop = jog_hand_stop,
    .home = jog_hand_home,
    .reset = jog_hand_reset,
    .enable = jog_hand_enable,
};

static enum status jog_by_keys(struct jog_service *self, struct jog_keys *keys)
{
    const struct jog_keys_config config = {
        .axis = self->want->axis,
        .speed_q32 = self->want->speed_q32,
        .dead_man_ns = self->want->dead_man_ns,
    };
    jog_see(self);
    self->served->draws = true;
    const enum status status =
        jog_keys_run(keys, &self->hand, &config, self->served->interrupts);
    self->served->draws = false;
    return status;
}

/* --- all of it --- */

static enum status jog_do(struct jog_service *self, struct jog_keys *keys,
                          struct jog_result *result)
{
    enum status status = served_enable(self->served);
    if (status == STATUS_OK)
        status = self->want->kind == JOG_BY_KEYS ? jog_by_keys(self, keys)
                                                 : jog_once(self, result);
    status = served_off(self->served, status);
    const struct machine_view_axis *at = jog_axis_of(self, self->want->axis);
    result->pos_q32 = at->pos_q32;
    result->homed = at->homed;
    snprintf(result->fault, sizeof result->fault, "%s", self->served->fault);
    return status;
}

enum status jog_service(struct served *served, const struct rig *rig,
                        const struct jog_wanted *want, struct jog_keys *keys,
                        struct jog_result *result)
{
    struct jog_service self = { .hand = { .ops = &jog_service_ops, .rig = rig },
                                .served = served,
                                .want = want };
    if (want->dead_man_ns > PLAYBACK_JOG_MAX_NS) {
        error_say("slew jog: --dead-man is longer than a service allows, "
                  "expected at most %g s",
                  PLAYBACK_JOG_MAX_NS / 1e9);
        return STATUS_INPUT;
    }
    self.hand.axis =
        memory_pool_new(&self.memory, rig->axis_count, sizeof *self.hand.axis);
    machine_view_init(&self.view, rig, &self.memory);
    enum status status = served_take(served, SERVED_LEASE_S);
    if (status == STATUS_OK)
        status = jog_do(&self, keys, result);
    memory_pool_free(&self.memory);
    return status;
}
