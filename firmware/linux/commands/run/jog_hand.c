/* firmware/linux/commands/run/jog_hand.c - see jog_hand.h. */
#include "firmware/linux/commands/run/jog_hand.h"

#include <stdio.h>

#include "firmware/host/base/memory.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define JOG_FAR_S 100 /* an axis that is not homed */

static struct live *jog_hand_of(struct jog_hand *hand)
{
    return ((struct jog_hand_live *)(void *)hand)->live;
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

static void jog_hand_see(struct jog_hand *hand)
{
    const struct live *live = jog_hand_of(hand);
    const struct controller *controller = &live->machine.controller;
    const struct homing *homing = &live->machine.homing;
    char why[HOMING_TEXT_MAX];
    hand->now_ns = live->now_ns;
    hand->state = controller->state;
    hand->enabling = controller->enabling;
    hand->homing = homing_is_running(homing);
    snprintf(hand->doing, sizeof hand->doing, "%s",
             hand->homing ? homing_state_text(homing->state)
                          : controller_state_text(hand->state));
    machine_fault_text(&live->machine, hand->fault);
    if (hand->fault[0] == '\0' && homing->state == HOMING_FAILED)
        snprintf(hand->fault, sizeof hand->fault, "homing: %s",
                 homing_failure(homing, why));
    for (unsigned i = 0; i < hand->rig->axis_count; i++) {
        const struct controller_axis *axis = &controller->axis[i];
        hand->axis[i] =
            (struct jog_hand_axis){ axis->feedback.pos_q32,
                                    axis->feedback.vel_q32,
                                    axis->target.pos_q32, axis->homed };
    }
}

static bool jog_hand_step(struct jog_hand *hand)
{
    live_tick(jog_hand_of(hand));
    jog_hand_see(hand);
    return true;
}

static const char *jog_hand_move(struct jog_hand *hand, unsigned axis,
                                 int direction, int64_t speed_q32,
                                 int64_t for_ns)
{
    struct live *live = jog_hand_of(hand);
    const struct controller_jog_goal goal = {
        .axis = axis,
        .pos_q32 = jog_far_q32(live, axis, direction, speed_q32),
        .vel_q32 = speed_q32,
        .until_ns = live->now_ns + for_ns,
    };
    const int err =
        controller_jog(&live->machine.controller, &live->machine.jog, &goal);
    jog_hand_see(hand);
    return err < 0 ? motion_err_text(err) : "";
}

static void jog_hand_stop(struct jog_hand *hand, bool hard)
{
    struct live *live = jog_hand_of(hand);
    controller_jog_stop(&live->machine.controller, &live->machine.jog, hard);
    jog_hand_see(hand);
}

static const char *jog_hand_home(struct jog_hand *hand, unsigned axis)
{
    const int err =
        homing_start(&jog_hand_of(hand)->machine.homing, (uint64_t)1 << axis);
    jog_hand_see(hand);
    return err < 0 ? "homing begins at rest only" : "";
}

static const char *jog_hand_reset(struct jog_hand *hand)
{
    const int err = controller_reset(&jog_hand_of(hand)->machine.controller);
    jog_hand_see(hand);
    return err < 0 ? "not possible now" : "";
}

static void jog_hand_enable(struct jog_hand *hand)
{
    (void)controller_enable(&jog_hand_of(hand)->machine.controller);
    jog_hand_see(hand);
}

static const struct jog_hand_ops jog_hand_live_ops = {
    .step = jog_hand_step,
    .move = jog_hand_move,
    .stop = jog_hand_stop,
    .home = jog_hand_home,
    .reset = jog_hand_reset,
    .enable = jog_hand_enable,
};

void jog_hand_live_init(struct jog_hand_live *self, struct live *live)
{
    *self = (struct jog_hand_live){
        .hand = { .ops = &jog_hand_live_ops,
                  .rig = live->rig,
                  .axis = memory_new(live->rig->axis_count,
                                     sizeof *self->hand.axis) },
        .live = live,
    };
    jog_hand_see(&self->hand);
}

void jog_hand_live_free(struct jog_hand_live *self)
{
    memory_free(self->hand.axis);
}
