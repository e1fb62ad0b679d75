/* tests/firmware/control/stateful_read.c - a move that is read while it is
 * played: its tracks are windows (motion/core/track.h), moved on after each tick
 * as whoever reads a file or receives an upload does, and in half of them no
 * further than to some place. */
#include "tests/firmware/control/stateful.h"

#define MS INT64_C(1000000)

/* Of the moves that the operator starts. */
void stateful_draw_reader(struct stateful *bench)
{
    struct stateful_reader *reader = &bench->reader[bench->spare];
    /* a window begins no move with a follower */
    reader->is_on = stateful_is_wide(bench) &&
                    stateful_one_in(bench, stateful_any_coupled(bench) ? 8 : 2);
    if (!reader->is_on)
        return;
    reader->spare_ns_q12 = stateful_in(bench, 5 * bench->period_ns, 300 * MS) *
                           MOTION_FIXED_NS_Q12;
    reader->stalls = !stateful_one_in(bench, 4);
    reader->stall_share = stateful_between(bench, 0, 1);
}

static uint32_t segment_at(const struct motion_track *whole, int64_t t_ns_q12)
{
    uint32_t at = 0;
    while (at + 1 < whole->count &&
           whole->segment[at + 1].start_ns_q12 <= t_ns_q12)
        at++;
    return at;
}

/* From where the move is to as far as was read, which never gets less. */
static void read_show(struct stateful_reader *reader, unsigned i,
                      int64_t s_ns_q12)
{
    const struct motion_track *whole = reader->whole[i];
    struct motion_track *window = &reader->window[i];
    int64_t to_ns_q12 = s_ns_q12 + reader->ahead_ns_q12;
    if (reader->stalls && to_ns_q12 > reader->stall_ns_q12)
        to_ns_q12 = reader->stall_ns_q12;
    const uint32_t first = segment_at(whole, s_ns_q12);
    const uint32_t last = segment_at(whole, to_ns_q12);
    window->segment = &whole->segment[first];
    window->count = last < first ? 1 : last - first + 1;
}

static void read_open(struct stateful_reader *reader, unsigned i,
                      const struct motion_track *whole)
{
    struct motion_track_outline *outline = &reader->outline[i];
    outline->count = whole->count;
    for (int which = MOTION_POS; which <= MOTION_JERK; which++)
        motion_track_extreme(whole, (enum motion_quantity)which,
                             &outline->extreme[which]);
    reader->whole[i] = whole;
    reader->window[i] = *whole;
    reader->window[i].outline = outline;
}

void stateful_read_begin(struct stateful *bench,
                         const struct motion_track *track[])
{
    struct stateful_reader *reader = &bench->reader[bench->spare];
    int64_t end_ns_q12 = 0;
    for (unsigned i = 0; i < bench->axes; i++) {
        if (track[i] == NULL)
            continue;
        if (track[i]->count == 0)
            continue;
        read_open(reader, i, track[i]);
        track[i] = &reader->window[i];
        if (track[i]->end_ns_q12 > end_ns_q12)
            end_ns_q12 = track[i]->end_ns_q12;
    }
    reader->stall_ns_q12 = (int64_t)(reader->stall_share * (double)end_ns_q12);
    reader->ahead_ns_q12 =
        controller_reserve_ns_q12(&bench->controller, track,
                                  MOTION_CLOCK_WARP_MAX_Q30) +
        reader->spare_ns_q12;
    for (unsigned i = 0; i < bench->axes; i++)
        if (track[i] == &reader->window[i])
            read_show(reader, i, 0);
}

void stateful_read_begun(struct stateful *bench)
{
    const struct stateful_reader *reader = &bench->reader[bench->spare];
    bench->judge.causes &= ~((uint32_t)1 << CONTROLLER_FAULT_TRACK);
    if (reader->is_on && reader->stalls)
        stateful_may_come(bench, CONTROLLER_FAULT_TRACK);
}

static const struct stateful_reader *reader_of(const struct stateful *bench,
                                               unsigned i)
{
    for (unsigned k = 0; k < ARRAY_LEN(bench->reader); k++)
        if (bench->controller.axis[i].track == &bench->reader[k].window[i])
            return &bench->reader[k];
    return NULL;
}

void stateful_read_step(struct stateful *bench)
{
    for (unsigned k = 0; k < ARRAY_LEN(bench->reader); k++)
        for (unsigned i = 0; i < bench->axes; i++)
            if (reader_of(bench, i) == &bench->reader[k])
                read_show(&bench->reader[k], i,
                          bench->controller.rate.s_ns_q12);
}

const struct motion_track *stateful_track(const struct stateful *bench,
                                          unsigned i)
{
    const struct stateful_reader *reader = reader_of(bench, i);
    return reader != NULL ? reader->whole[i] : bench->controller.axis[i].track;
}
