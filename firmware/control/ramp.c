/* firmware/control/ramp.c - the shortest change of rate that fits.
 *
 * Candidates are a grid of A and J, from the steepest that p''' leaves now to a
 * quarter of what is right at the highest speed of the tracks (ramp_bound.c).
 * They are tried in the order of their durations, and around the first that
 * fits its neighbours on ever finer grids, while looks are left.  A candidate
 * starts in the tick in which it is judged, so it is judged as it will be. */
#include "firmware/control/ramp.h"

/* Looks after which no other candidate is tried, in a tick of the search and of
 * a request. */
#define RAMP_LOOKS_SEEK 512
#define RAMP_LOOKS_STOP 8192
/* What making a candidate and laying out the grid count as. */
#define RAMP_LOOKS_MAKE  8
#define RAMP_LOOKS_SWEEP 256

/* How many ticks before its end every length of what brings r' > 0 to 0 is tried;
 * how many ticks later that may begin at the latest. */
#define RAMP_LEVEL_NEAR 16
#define RAMP_LEVEL_WAIT 64

/* value / 2^(eighths / 8), at least 1 */
static int64_t ramp_rung(int64_t value, unsigned eighths)
{
    static const uint32_t root_q30[8] = { 0x40000000, 0x3AB031BA, 0x35D13F33,
                                          0x31590D81, 0x2D413CCD, 0x2981CEDC,
                                          0x260DFC14, 0x22DE3FD1 };
    const int64_t part =
        ramp_muldiv(value, root_q30[eighths % 8], (int64_t)1 << 30);
    return ramp_most(part >> (eighths / 8), 1);
}

/* From `high` down to `low`, in eighths of an octave; at least two octaves. */
static unsigned ramp_span(int64_t high, int64_t low)
{
    const unsigned high_bits = motion_fixed_clz_u64((uint64_t)high);
    const unsigned low_bits = motion_fixed_clz_u64((uint64_t)low);
    return 8 * (low_bits > high_bits + 1 ? low_bits - high_bits + 1 : 2);
}

/* A place on the plane of A and J, eighths of an octave down from the
 * steepest. */
struct ramp_place {
    unsigned accel, jerk;
};

static struct ramp_place ramp_place(const struct controller_seek *seek,
                                    unsigned which)
{
    const unsigned accel = which / CONTROLLER_RAMP_JERKS;
    const unsigned jerk = which % CONTROLLER_RAMP_JERKS;
    return (struct ramp_place){
        accel * seek->accel_span / (CONTROLLER_RAMP_ACCELS - 1),
        jerk * seek->jerk_span / (CONTROLLER_RAMP_JERKS - 1),
    };
}

static struct motion_clock_bound
ramp_candidate(const struct controller_seek *seek, struct ramp_place place)
{
    return (struct motion_clock_bound){
        ramp_rung(seek->most.accel_q30, place.accel),
        ramp_rung(seek->most.jerk_q30, place.jerk),
    };
}

/* In between those that are shorter and those that are longer; the same ticks
 * as another's make the same ramp. */
static void ramp_insert(struct controller_seek *seek, uint64_t *key,
                        unsigned which, uint64_t ticks)
{
    unsigned at = seek->count;
    while (at > 0 && key[at - 1] > ticks)
        at--;
    if (at > 0 && key[at - 1] == ticks)
        return;
    for (unsigned i = seek->count; i > at; i--) {
        key[i] = key[i - 1];
        seek->order[i] = seek->order[i - 1];
    }
    key[at] = ticks;
    seek->order[at] = (uint8_t)which;
    seek->count++;
}

/* Lay out the grid for the state there is, the shortest first. */
static void ramp_sweep(struct controller *controller, int64_t begin_ns,
                       bool stop)
{
    struct motion_clock_rate now;
    motion_clock_warp_at(&controller->warp, begin_ns, &now);
    now.s_ns_q12 = ramp_least(now.s_ns_q12, controller->move_end_ns_q12);
    struct controller_seek *seek = &controller->seek;
    uint64_t key[CONTROLLER_RAMP_CANDIDATES];
    const struct motion_clock_bound least =
        controller_ramp_bound(controller, &now, stop, 4);
    seek->most = controller_ramp_steepest(controller, &now, stop);
    seek->accel_span = ramp_span(seek->most.accel_q30, least.accel_q30);
    seek->jerk_span = ramp_span(seek->most.jerk_q30, least.jerk_q30);
    seek->stop = stop;
    seek->which = 0;
    seek->count = 0;
    for (unsigned i = 0; i < CONTROLLER_RAMP_CANDIDATES; i++) {
        const struct motion_clock_bound bound =
            ramp_candidate(seek, ramp_place(seek, i));
        int64_t n[MOTION_CLOCK_WARP_PIECES];
        if (motion_clock_warp_ticks(&now, controller->wanted_q30, &bound,
                                    controller->config.period_ns,
                                    n) == MOTION_OK)
            ramp_insert(seek, key, i,
                        (uint64_t)(n[0] + n[1] + n[2]) << 32 | (uint64_t)n[0]);
    }
}

void controller_ramp_reset(struct controller *controller)
{
    controller->seek = (struct controller_seek){ 0 };
}

bool controller_slows(const struct controller *controller)
{
    return (controller->state == CONTROLLER_HOLDING ||
            controller->state == CONTROLLER_STOPPING) &&
           controller->wanted_q30 == 0 && controller->rest_by_ns != 0;
}

int64_t controller_due_ns(const struct controller *controller)
{
    return controller_slows(controller) ? controller->rest_by_ns : INT64_MAX;
}

/* Where a ramp begins: now, or at the end of the one that brings r' to 0. */
static int64_t ramp_begin_ns(const struct controller *controller)
{
    const struct motion_clock_warp *warp = &controller->warp;
    return controller->seek.is_level
               ? ramp_most(warp->t0_ns + warp->dur_ns, controller->clock_ns)
               : controller->clock_ns;
}

/* In fewer ticks no ramp brings r' > 0 to 0; without a limit one does.  0: in no
 * more ticks either, as the limits force r'' > 0 here. */
static int64_t ramp_level_ticks(const struct controller *controller,
                                const struct motion_clock_rate *now, bool stop)
{
    const int64_t jerk_q30 =
        controller_ramp_margin(controller, now, true, stop);
    if (jerk_q30 <= 0)
        return 0;
    return ramp_muldiv(ramp_size(now->accel_q30), RAMP_SECOND_NS, jerk_q30) /
               controller->config.period_ns +
           1;
}

/* What may come before r' is brought to 0: so many ticks with this r''. */
struct ramp_wait {
    int64_t ticks, jerk_q30;
};

/* Is r' brought to 0 by one r'' over so many ticks, after `wait`?  Negative: not
 * in more ticks either, the rate would leave its range. */
static int ramp_levels(const struct controller *controller,
                       const struct ramp_wait *wait, int64_t ticks, bool stop,
                       struct ramp_effort *effort,
                       struct motion_clock_warp *warp)
{
    const int err = motion_clock_warp_level(
        &controller->warp, controller->clock_ns, wait->ticks, wait->jerk_q30,
        ticks, controller->config.period_ns, warp);
    effort->looks -= RAMP_LOOKS_MAKE;
    return err < 0 ? err
                   : controller_ramp_judge(controller, warp, stop, effort);
}

/* Between `low` ticks, which are too few, and `high`, whose ramp is *warp. */
static void ramp_level_between(const struct controller *controller,
                               const struct ramp_wait *wait, int64_t low,
                               int64_t high, bool stop,
                               struct ramp_effort *effort,
                               struct motion_clock_warp *warp)
{
    while (high - low > 1 && effort->looks > 0) {
        const int64_t ticks = low + (high - low) / 2;
        struct motion_clock_warp other;
        if (ramp_levels(controller, wait, ticks, stop, effort, &other) > 0) {
            high = ticks;
            *warp = other;
        } else {
            low = ticks;
        }
    }
}

/* The state of the clock after `wait`. */
static struct motion_clock_rate ramp_after(const struct controller *controller,
                                           const struct ramp_wait *wait)
{
    const int64_t period_ns = controller->config.period_ns;
    struct motion_clock_rate then = controller_ramp_now(controller);
    struct motion_clock_warp warp;
    if (wait->ticks == 0 ||
        motion_clock_warp_level(&controller->warp, controller->clock_ns,
                                wait->ticks, wait->jerk_q30, 1, period_ns,
                                &warp) < 0)
        return then;
    motion_clock_warp_at(&warp, warp.t0_ns + wait->ticks * period_ns, &then);
    then.s_ns_q12 = ramp_least(then.s_ns_q12, controller->move_end_ns_q12);
    return then;
}

/* The next length of a ladder, after one that did not fit `left` ticks before its
 * end: an eighth of these more, for what fails long before its end fails by its
 * r'', and so do all that are a little longer.  Near the end every one, as one
 * alone may fit among those that do not, just before a border of segments. */
static int64_t ramp_level_longer(int64_t ticks, int64_t left)
{
    return ticks + ramp_most((left - RAMP_LEVEL_NEAR) / 8, ticks / 32) + 1;
}

/* In so few ticks as the limits allow, after `wait`. */
static bool ramp_level_least(const struct controller *controller,
                             const struct ramp_wait *wait, bool stop,
                             struct ramp_effort *effort,
                             struct motion_clock_warp *warp)
{
    const struct motion_clock_rate then = ramp_after(controller, wait);
    const int64_t period_ns = controller->config.period_ns;
    const int64_t wait_ns = wait->ticks * period_ns;
    int64_t ticks = ramp_level_ticks(controller, &then, stop), low = ticks - 1;
    effort->dt_ns = wait_ns;
    while (ticks > 0 && effort->looks > 0) {
        const int fits =
            ramp_levels(controller, wait, ticks, stop, effort, warp);
        if (fits < 0 || (fits == 0 && effort->dt_ns < wait_ns))
            return false; /* nor with another end */
        if (fits > 0) {
            ramp_level_between(controller, wait, low, ticks, stop, effort,
                               warp);
            return true;
        }
        low = ticks;
        ticks = ramp_level_longer(ticks,
                                  (warp->dur_ns - effort->dt_ns) / period_ns);
    }
    return false;
}

/* What slows down does not speed up first: whatever ramp will fit, r' is
 * brought to 0 from now on, as fast as the limits allow, where the ramp in
 * force would go up, and the search goes on from there.  Where the limits leave
 * no r'' < 0 yet r' rises no further until they do, or as little as they leave,
 * in sixteenths of what the ramp in force would. */
static void ramp_level(struct controller *controller, bool stop,
                       struct ramp_effort *effort)
{
    struct controller_seek *seek = &controller->seek;
    const struct motion_clock_rate now = controller_ramp_now(controller);
    const bool rises =
        now.accel_q30 > 0 || controller->warp.rate1_q30 > now.rate_q30;
    struct ramp_wait wait = { 0, 0 };
    struct motion_clock_warp warp;
    if (seek->is_level || !rises || controller->wanted_q30 >= now.rate_q30)
        return;
    while (!ramp_level_least(controller, &wait, stop, effort, &warp)) {
        wait.ticks += wait.ticks / 2 + 1;
        if (wait.ticks > RAMP_LEVEL_WAIT)
            wait =
                (struct ramp_wait){ 1, wait.jerk_q30 + now.jerk_q30 / 16 + 1 };
        if (now.accel_q30 <= 0 || wait.jerk_q30 > now.jerk_q30 ||
            effort->looks <= 0)
            return;
    }
    controller->warp = warp;
    seek->is_level = true;
}

/* Does the ramp of a candidate fit?  Negative: it ends too late. */
static int ramp_try(const struct controller *controller, int64_t begin_ns,
                    struct ramp_place place, struct ramp_effort *effort,
                    struct motion_clock_warp *warp)
{
    const struct controller_seek *seek = &controller->seek;
    const struct motion_clock_bound bound = ramp_candidate(seek, place);
    effort->looks -= RAMP_LOOKS_MAKE;
    if (motion_clock_warp_ramp(&controller->warp, begin_ns,
                               controller->wanted_q30, &bound,
                               controller->config.period_ns, warp) < 0)
        return 0;
    if (warp->t0_ns + warp->dur_ns > controller_due_ns(controller))
        return MOTION_E_LIMIT;
    return controller_ramp_judge(controller, warp, seek->stop, effort);
}

/* Judged by its length alone, which is cheap. */
static bool ramp_is_shorter(const struct controller *controller,
                            int64_t begin_ns, struct ramp_place place,
                            const struct motion_clock_warp *warp)
{
    const struct motion_clock_bound bound =
        ramp_candidate(&controller->seek, place);
    struct motion_clock_rate now;
    int64_t n[MOTION_CLOCK_WARP_PIECES];
    motion_clock_warp_at(&controller->warp, begin_ns, &now);
    return motion_clock_warp_ticks(&now, controller->wanted_q30, &bound,
                                   controller->config.period_ns,
                                   n) == MOTION_OK &&
           (n[0] + n[1] + n[2]) * controller->config.period_ns < warp->dur_ns;
}

/* A shorter one beside it, `step` away? */
static bool ramp_beside(const struct controller *controller, int64_t begin_ns,
                        struct ramp_place *place, unsigned step,
                        struct ramp_effort *effort,
                        struct motion_clock_warp *warp)
{
    static const struct {
        int accel, jerk;
    } neighbour[] = { { -1, -1 }, { 0, -1 }, { -1, 0 }, { 1, -1 }, { -1, 1 } };
    const struct controller_seek *seek = &controller->seek;
    for (unsigned i = 0;
         i < sizeof neighbour / sizeof neighbour[0] && effort->looks > 0; i++) {
        /* below 0 is beyond the span, too */
        const struct ramp_place next = {
            place->accel + (unsigned)(neighbour[i].accel * (int)step),
            place->jerk + (unsigned)(neighbour[i].jerk * (int)step),
        };
        struct motion_clock_warp other;
        if (next.accel <= seek->accel_span && next.jerk <= seek->jerk_span &&
            ramp_is_shorter(controller, begin_ns, next, warp) &&
            ramp_try(controller, begin_ns, next, effort, &other) > 0) {
            *place = next;
            *warp = other;
            return true;
        }
    }
    return false;
}

/* The grid is coarse: the best of it is moved by half a step, and so on, down
 * to an eighth of an octave. */
static void ramp_refine(const struct controller *controller, int64_t begin_ns,
                        struct ramp_place place, struct ramp_effort *effort,
                        struct motion_clock_warp *warp)
{
    const struct controller_seek *seek = &controller->seek;
    const int64_t jerks = seek->jerk_span / (CONTROLLER_RAMP_JERKS - 1);
    unsigned step = (unsigned)ramp_most(jerks / 2, 1);
    while (step > 0 && effort->looks > 0)
        if (!ramp_beside(controller, begin_ns, &place, step, effort, warp))
            step /= 2;
}

/* The next candidates, at most `looks` and what the last one takes.  Those that
 * would end too late are none. */
static bool ramp_search(struct controller *controller, bool stop, int64_t looks)
{
    struct controller_seek *seek = &controller->seek;
    struct ramp_effort effort = { .looks = looks };
    ramp_level(controller, stop, &effort);
    const int64_t begin_ns = ramp_begin_ns(controller);
    if (seek->which >= seek->count || seek->stop != stop) {
        ramp_sweep(controller, begin_ns, stop);
        effort.looks -= RAMP_LOOKS_SWEEP;
    }
    while (seek->which < seek->count && effort.looks > 0) {
        const struct ramp_place place =
            ramp_place(seek, seek->order[seek->which++]);
        struct motion_clock_warp warp;
        const int fits = ramp_try(controller, begin_ns, place, &effort, &warp);
        if (fits < 0)
            seek->which = seek->count; /* those that follow are longer */
        if (fits <= 0)
            continue;
        ramp_refine(controller, begin_ns, place, &effort, &warp);
        if (begin_ns > controller->clock_ns)
            motion_clock_warp_join(&controller->warp, &warp);
        else
            controller->warp = warp;
        controller_ramp_reset(controller);
        return true;
    }
    return false;
}

bool controller_ramp_stop(struct controller *controller)
{
    const struct motion_clock_warp before = controller->warp;
    controller_ramp_reset(controller);
    if (ramp_search(controller, true, RAMP_LOOKS_STOP))
        return true;
    controller->warp = before;
    return false;
}

/* Asked for again: the ramp under way brings r' to 0 by one r'', which the
 * tightest of its places has set.  With that one behind, a steeper one may fit:
 * while the rate still rises it is looked for anew, and what was found before
 * stays in force where that finds less. */
void controller_ramp_begin(struct controller *controller, bool again)
{
    const bool stop = controller->reaction != CONTROLLER_REACT_NONE;
    const struct motion_clock_warp before = controller->warp;
    const struct controller_seek seek = controller->seek;
    const bool has_ramp = again && before.rate1_q30 == 0;
    if (has_ramp && controller_ramp_now(controller).accel_q30 <= 0)
        return;
    controller_ramp_reset(controller);
    if (ramp_search(controller, stop, RAMP_LOOKS_STOP) || !again ||
        (controller->seek.is_level && !has_ramp))
        return;
    controller->warp = before;
    controller->seek = seek;
}

bool controller_ramp_rises(const struct controller *controller)
{
    return controller_slows(controller) &&
           controller_ramp_now(controller).accel_q30 > 0;
}

/* How long the ramp in force takes to bring r' to 0; 0 where it raises it
 * throughout. */
static int64_t ramp_rises_ns(const struct controller *controller)
{
    const struct motion_clock_warp *warp = &controller->warp;
    int64_t end_ns = warp->t0_ns;
    for (unsigned i = 0; i < warp->count; i++) {
        const struct motion_clock_piece *piece = &warp->piece[i];
        const int64_t from_ns = ramp_most(end_ns, controller->clock_ns);
        struct motion_clock_rate from;
        end_ns += piece->dur_ns;
        if (end_ns <= controller->clock_ns || piece->jerk_q30 >= 0)
            continue;
        motion_clock_warp_at(warp, from_ns, &from);
        return from_ns - controller->clock_ns +
               ramp_muldiv(ramp_size(from.accel_q30), RAMP_SECOND_NS,
                           -piece->jerk_q30);
    }
    return 0;
}

/* On the way of the ramp in force to r' = 0 its tightest place passes, with no
 * request then: could a level a quarter shorter begin now, or, while that ramp
 * still waits, any that is shorter? */
static bool ramp_levels_sooner(const struct controller *controller)
{
    static const struct ramp_wait none = { 0, 0 };
    const struct motion_clock_rate now = controller_ramp_now(controller);
    const bool stop = controller->reaction != CONTROLLER_REACT_NONE;
    struct ramp_effort effort = { .looks = RAMP_LOOKS_SEEK };
    struct motion_clock_warp warp;
    const int64_t rises_ns = ramp_rises_ns(controller);
    const int64_t period_ns = controller->config.period_ns;
    const int64_t least = ramp_level_ticks(controller, &now, stop);
    int64_t ticks = ramp_muldiv(rises_ns, 3, 4) / period_ns;
    if (ticks < least && now.jerk_q30 >= 0 && least < rises_ns / period_ns)
        ticks = least;
    return least > 0 && ticks >= least &&
           ramp_levels(controller, &none, ticks, stop, &effort, &warp) > 0;
}

void controller_ramp_seek(struct controller *controller)
{
    const struct motion_clock_rate now = controller_ramp_now(controller);
    if (controller_ramp_rises(controller) && ramp_levels_sooner(controller))
        controller_ramp_begin(controller, true);
    if (controller->warp.rate1_q30 == controller->wanted_q30)
        return;
    const int64_t left_ns =
        controller_due_ns(controller) - controller->clock_ns;
    const bool stop =
        left_ns <= controller_ramp_rest_ns(controller, &now, true, 4);
    (void)ramp_search(controller, stop, RAMP_LOOKS_SEEK);
}
