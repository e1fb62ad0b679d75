/* firmware/linux/player/run_start.c - see run_start.h. */
#include "firmware/linux/player/run_start.h"

#include <stdio.h>
#include <time.h>

#define RUN_START_READINGS 5
#define RUN_START_EDGES    64 /* looked at on a tick, at most */
/* The wall clock was set; what is less is how exactly it can be read. */
#define RUN_START_SET_NS 500000
#define RUN_START_SAY_NS INT64_C(100000000)

int64_t run_start_offset_ns(struct hal_clock *clock)
{
    int64_t best_ns = INT64_MAX, offset_ns = 0;
    for (int i = 0; i < RUN_START_READINGS; i++) {
        struct timespec wall;
        const int64_t before_ns = hal_clock_now_ns(clock);
        clock_gettime(CLOCK_REALTIME, &wall); /* cannot fail for this clock */
        const int64_t took_ns = hal_clock_now_ns(clock) - before_ns;
        if (took_ns >= best_ns)
            continue;
        best_ns = took_ns;
        offset_ns = wall.tv_sec * INT64_C(1000000000) + wall.tv_nsec -
                    (before_ns + took_ns / 2);
    }
    return offset_ns;
}

int64_t run_start_align_ns(struct run_start *start, struct hal_clock *clock,
                           int64_t now_ns, int64_t period_ns)
{
    if (start->wall_ns == 0)
        return now_ns;
    start->due_ns = start->wall_ns - run_start_offset_ns(clock);
    const int64_t over_ns = (start->due_ns - now_ns) % period_ns;
    return over_ns > 0 ? now_ns - (period_ns - over_ns) : now_ns + over_ns;
}

/* An edge to active among those not asked for yet; a line that cannot be read
 * is active where it is debounced, and starts nothing. */
static bool run_start_look(struct run_start *start)
{
    struct hal_gpio_event event;
    bool active = false;
    int got = 1;
    for (int i = 0; i < RUN_START_EDGES && got == 1; i++) {
        got = hal_gpio_event(start->line, &event);
        active |= got == 1 && event.active;
    }
    start->failed |= got < 0 || hal_gpio_get(start->line) < 0;
    return active && !start->failed;
}

int64_t run_start_edge_ns(struct run_start *start, int64_t now_ns,
                          int64_t lead_ns, int64_t period_ns)
{
    if (start->seen)
        return start->due_ns;
    const bool active = run_start_look(start);
    start->seen = active && start->listening;
    start->listening = true;
    start->due_ns = now_ns + (lead_ns + period_ns - 1) / period_ns * period_ns;
    return start->seen ? start->due_ns : RUN_START_NEVER;
}

/* By whole ticks, so that these stay where they are.  One that was on its way to
 * its time is not begun late, nor at once. */
static void run_start_set(struct run_start *start, int64_t set_ns,
                          int64_t now_ns, int64_t period_ns)
{
    const int64_t more_ns =
        (set_ns + (set_ns > 0 ? period_ns : -period_ns) / 2) / period_ns *
        period_ns;
    start->due_ns += more_ns;
    start->passed |= more_ns != 0 && start->due_ns < now_ns;
    atomic_store(&start->set_ns, atomic_load(&start->set_ns) - set_ns);
}

/* Both clocks run at one rate, however that is adjusted; only a step makes them
 * differ. */
int64_t run_start_due_ns(struct run_start *start, struct hal_clock *clock,
                         int64_t now_ns, int64_t ready_ns, int64_t period_ns)
{
    if (start->wall_ns == 0)
        return ready_ns;
    const int64_t set_ns =
        start->wall_ns - run_start_offset_ns(clock) - start->due_ns;
    if (set_ns > RUN_START_SET_NS || set_ns < -RUN_START_SET_NS)
        run_start_set(start, set_ns, now_ns, period_ns);
    start->late = start->due_ns < ready_ns;
    return start->due_ns;
}

void run_start_say(struct run_start *start)
{
    const int64_t set_ns = atomic_load(&start->set_ns);
    const int64_t more_ns = set_ns - start->said_ns;
    if (start->passed ||
        (more_ns < RUN_START_SAY_NS && more_ns > -RUN_START_SAY_NS))
        return;
    start->said_ns = set_ns;
    fprintf(stderr,
            "\r\033[Kthe wall clock was set by %+.1f s: the move starts at its "
            "time by the clock as it is now\n",
            (double)more_ns / 1e9);
}
