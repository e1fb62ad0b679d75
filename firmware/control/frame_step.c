/* firmware/control/frame_step.c - see frame_step.h. */
#include "firmware/control/frame_step.h"

#include <stddef.h>

#include "firmware/control/parts.h"

#define FRAME_STEP_EDGES 64 /* looked at on a tick, at most */

/* Edges to active among those not asked for yet; of a debounced line one that
 * cannot be read is active, and no edge. */
static uint32_t frame_step_edges(struct frame_step *self)
{
    struct hal_gpio_event event;
    uint32_t active = 0;
    int got = 1;
    for (int i = 0; i < FRAME_STEP_EDGES && got == 1; i++) {
        got = hal_gpio_event(self->line, &event);
        active += got == 1 && event.active;
    }
    self->failed |= got < 0 || hal_gpio_get(self->line) < 0;
    return self->failed ? 0 : active;
}

void frame_step_begin(struct frame_step *self,
                      const struct frame_step_config *config,
                      struct hal_gpio *line)
{
    *self = (struct frame_step){ .config = *config,
                                 .line = line,
                                 .next_ns_q12 = config->first_ns_q12 };
    if (config->count > 0 && line != NULL)
        (void)frame_step_edges(self);
}

/* Has the path come to a frame, or beyond one, since the last tick?  A step or
 * none, but where it was taken to another place. */
static bool frame_step_passes(struct frame_step *self, int64_t s_ns_q12)
{
    const struct frame_step_config *config = &self->config;
    const uint32_t before = self->frame;
    while (self->frame < config->count && self->next_ns_q12 <= s_ns_q12) {
        self->frame++;
        self->next_ns_q12 += config->period_ns_q12;
    }
    while (self->frame > 0 &&
           self->next_ns_q12 - config->period_ns_q12 > s_ns_q12) {
        self->frame--;
        self->next_ns_q12 -= config->period_ns_q12;
    }
    return self->frame > before;
}

static void frame_step_wait(struct frame_step *self,
                            struct controller *controller, uint32_t edges)
{
    if (controller->state != CONTROLLER_HOLDING) {
        self->waits = self->stands = false; /* told to go on, or stopped */
        return;
    }
    if (!self->stands) {
        self->early += edges;
        self->stands = controller_clock_stands(controller);
    } else if (edges > 0 && controller_resume(controller) == MOTION_OK) {
        self->waits = self->stands = false;
    }
}

void frame_step_tick(struct frame_step *self, struct playback *playback)
{
    struct controller *controller = playback->controller;
    if (self->config.count == 0)
        return;
    const uint32_t edges = self->line != NULL ? frame_step_edges(self) : 0;
    if (self->waits) {
        frame_step_wait(self, controller, edges);
        return;
    }
    self->early += edges;
    if (playback->state == PLAYBACK_PLAYING &&
        frame_step_passes(self, controller->rate.s_ns_q12) &&
        controller->state == CONTROLLER_MOVING && !controller->is_reversed)
        self->waits = controller_hold(controller) == MOTION_OK;
}
