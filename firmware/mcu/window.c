/* firmware/mcu/window.c - see window.h. */
#include "firmware/mcu/window.h"

#include <string.h>

#include "motion/core/err.h"

void mcu_window_init(struct mcu_window *window, struct motion_segment *ring,
                     uint32_t capacity)
{
    memset(window, 0, sizeof *window);
    window->ring = ring;
    window->capacity = capacity;
    mcu_window_show(window, capacity);
}

bool mcu_head_is_sound(const struct mcu_head *head)
{
    for (int i = MOTION_POS; i <= MOTION_JERK; i++)
        if (head->outline.extreme[i].min > head->outline.extreme[i].max)
            return false;
    return head->end_ns_q12 >= 0 && head->end_ns_q12 <= MOTION_TRACK_MAX_NS_Q12;
}

void mcu_window_open(struct mcu_window *window, const struct mcu_head *head)
{
    mcu_window_init(window, window->ring, window->capacity);
    window->head = *head;
    mcu_window_show(window, window->capacity);
}

static bool mcu_window_is_inside(const struct mcu_window *window,
                                 const struct motion_segment *segment)
{
    const struct motion_extreme *most = window->head.outline.extreme;
    struct motion_extreme extreme[MOTION_JERK + 1];

    motion_segment_extremes(segment, extreme);
    for (int i = MOTION_POS; i <= MOTION_JERK; i++)
        if (extreme[i].min < most[i].min || extreme[i].max > most[i].max)
            return false;
    return true;
}

/* Where what has been put ends. */
struct window_end {
    uint32_t number;
    int64_t t_ns_q12;
    struct motion_state state;
};

static int mcu_window_judge(const struct mcu_window *window,
                            struct window_end *end,
                            struct motion_segment *segment)
{
    int err;

    segment->start_ns_q12 = end->t_ns_q12;
    err = motion_segment_restore(segment);
    if (err < 0)
        return err;
    if (end->number > 0 && segment->pos_q32 != end->state.pos_q32)
        return MOTION_E_DISCONTINUITY;
    if (!mcu_window_is_inside(window, segment))
        return MOTION_E_LIMIT;
    motion_segment_state(segment, segment->dur_ns_q12, &end->state);
    end->t_ns_q12 += segment->dur_ns_q12;
    end->number++;
    if (end->number == window->head.outline.count &&
        (end->t_ns_q12 != window->head.end_ns_q12 ||
         memcmp(&end->state, &window->head.end, sizeof end->state) != 0))
        return MOTION_E_DISCONTINUITY;
    return MOTION_OK;
}

/* Written where nobody looks until `filled` says that all of it is there. */
int mcu_window_put(struct mcu_window *window,
                   const struct motion_segment given[], unsigned count)
{
    const uint32_t filled = window->filled;
    struct window_end end = { filled, window->end_ns_q12, window->end };

    if (count > window->head.outline.count - filled)
        return MOTION_E_ORDER;
    if (count > mcu_window_free(window))
        return MOTION_E_FULL;
    for (unsigned i = 0; i < count; i++) {
        const uint32_t slot = (filled + i) & (window->capacity - 1);
        struct motion_segment segment = given[i];
        const int err = mcu_window_judge(window, &end, &segment);
        if (err < 0)
            return err;
        window->ring[slot] = segment;
        window->ring[slot + window->capacity] = segment;
    }
    window->end = end.state;
    window->end_ns_q12 = end.t_ns_q12;
    window->filled = end.number;
    return MOTION_OK;
}

static bool mcu_window_is_same(const struct motion_segment *a,
                               const struct motion_segment *b)
{
    return a->dur_ns_q12 == b->dur_ns_q12 && a->pos_q32 == b->pos_q32 &&
           memcmp(a->coef, b->coef, sizeof a->coef) == 0 &&
           a->remainder == b->remainder && a->frac == b->frac;
}

/* The tick may let go of more meanwhile, but nothing is written over it. */
bool mcu_window_has(const struct mcu_window *window, uint32_t number,
                    const struct motion_segment given[], unsigned count)
{
    const uint32_t first = window->first;

    for (unsigned i = 0; i < count; i++)
        if (number + i >= first &&
            !mcu_window_is_same(
                &window->ring[(number + i) & (window->capacity - 1)],
                &given[i]))
            return false;
    return true;
}

uint32_t mcu_window_free(const struct mcu_window *window)
{
    return window->capacity - (window->filled - window->first);
}

bool mcu_window_is_ready(const struct mcu_window *window)
{
    return window->filled == window->head.outline.count ||
           mcu_window_free(window) == 0;
}

void mcu_window_show(struct mcu_window *window, uint32_t most)
{
    const uint32_t first = window->first;
    const uint32_t count = window->filled - first;

    window->track.segment = window->ring + (first & (window->capacity - 1));
    window->track.count = count < most ? count : most;
    window->track.end_ns_q12 = window->head.end_ns_q12;
    window->track.end = window->head.end;
    window->track.end_frac = window->head.end_frac;
    window->track.outline = &window->head.outline;
}

/* A segment is kept until the one after it is over too: the cursor may go back
 * by one.  At most as many as the window has.  An axis that the window holds
 * as a whole stays there, to be played again. */
void mcu_window_advance(struct mcu_window *window, int64_t t_ns_q12)
{
    const uint32_t filled = window->filled;
    const bool is_whole = window->head.outline.count <= window->capacity;
    uint32_t first = window->first;

    while (!is_whole && first + 2 < filled &&
           window->ring[(first + 2) & (window->capacity - 1)].start_ns_q12 <=
               t_ns_q12)
        first++;
    window->first = first;
    mcu_window_show(window, window->capacity);
}
