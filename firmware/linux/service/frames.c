/* firmware/linux/service/frames.c - see frames.h. */
#include "firmware/linux/service/frames.h"

#include "firmware/host/base/memory.h"

void service_frame_init(struct service_frame *frame, const struct rig *rig,
                        struct memory_pool *pool)
{
    *frame = (struct service_frame){ .ticks = 0 };
    frame->axis = memory_pool_new(pool, rig->axis_count, sizeof *frame->axis);
    machine_view_init(&frame->state.view, rig, pool);
}

void service_frames_init(struct service_frames *frames, const struct rig *rig,
                         struct memory_pool *pool)
{
    service_frame_init(&frames->frame, rig, pool);
    service_frame_init(&frames->out, rig, pool);
    atomic_init(&frames->full, false);
}

static void range_join(struct service_range *range,
                       const struct service_range *from, bool is_first)
{
    range->last = from->last;
    if (is_first || from->low < range->low)
        range->low = from->low;
    if (is_first || from->high > range->high)
        range->high = from->high;
}

void service_frame_join(struct service_frame *frame,
                        const struct service_frame *from)
{
    const bool is_first = frame->ticks == 0;

    for (unsigned i = 0; i < from->state.view.axes; i++) {
        struct service_frame_axis *axis = &frame->axis[i];
        const struct service_frame_axis *with = &from->axis[i];
        range_join(&axis->demand_q32, &with->demand_q32, is_first);
        range_join(&axis->actual_q32, &with->actual_q32, is_first);
        range_join(&axis->following_q32, &with->following_q32, is_first);
    }
    if (is_first || from->late_ns > frame->late_ns)
        frame->late_ns = from->late_ns;
    frame->ticks += from->ticks;
    service_state_copy(&frame->state, &from->state);
}

static void range_add(struct service_range *range, int64_t value, bool is_first)
{
    const struct service_range one = { value, value, value };

    range_join(range, &one, is_first);
}

void service_frames_put(struct service_frames *frames,
                        const struct service_state *state)
{
    struct service_frame *frame = &frames->frame;
    const bool is_first = frame->ticks == 0;

    if (is_first)
        frames->begun_ns = state->now_ns;
    for (unsigned i = 0; i < state->view.axes; i++) {
        const struct machine_view_axis *view = &state->view.axis[i];
        range_add(&frame->axis[i].demand_q32, view->demand_q32, is_first);
        range_add(&frame->axis[i].actual_q32, view->pos_q32, is_first);
        range_add(&frame->axis[i].following_q32, view->following_q32, is_first);
    }
    if (is_first || state->late_ns > frame->late_ns)
        frame->late_ns = state->late_ns;
    frame->ticks++;
    if (state->now_ns - frames->begun_ns < SERVICE_FRAME_NS ||
        atomic_load(&frames->full))
        return;
    service_state_copy(&frame->state, state);
    frames->out.ticks = 0;
    service_frame_join(&frames->out, frame);
    frame->ticks = 0;
    atomic_store(&frames->full, true);
}

bool service_frames_take(struct service_frames *frames,
                         struct service_frame *frame)
{
    if (!atomic_load(&frames->full))
        return false;
    service_frame_join(frame, &frames->out);
    atomic_store(&frames->full, false);
    return true;
}
