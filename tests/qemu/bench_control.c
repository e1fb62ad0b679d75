/* tests/qemu/bench_control.c - instructions of one tick of the controller with
 * six axes, drivers left out: the worst in each state, at many places of a move
 * that uses all of its limits.  The stop limits are those, or twice as large.
 * A command counts to the tick that follows it.  Status 1 when a tick takes more
 * than LIMIT_MOVING before the command, or than LIMIT_SEEK, or a start more for a
 * long move than for a short one.  A change of rate is found step by step
 * (firmware/control/ramp_step.h).
 *
 * Time of QEMU with -icount, as in bench_tick.c, by timer 0 of mps2-an386 (Arm
 * CMSDK APB timer, 32 bits at 25 MHz: SysTick would wrap). */
#include "firmware/control/controller.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/qemu/start.h"

#define AXES        6
#define LEGS        6
#define START_SHORT 10
#define START_LONG  2000
#define PERIOD_NS   INT64_C(1000000)
#define EPISODES    8
#define UNIT        MOTION_FIXED_ONE_Q32

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define TIMER_CTRL        REGISTER(0x40000000)
#define TIMER_VALUE       REGISTER(0x40000004)
#define TIMER_RELOAD      REGISTER(0x40000008)

#define NOPS   64
#define NOP_8  "nop\n nop\n nop\n nop\n nop\n nop\n nop\n nop\n "
#define NOP_64 NOP_8 NOP_8 NOP_8 NOP_8 NOP_8 NOP_8 NOP_8 NOP_8

struct bench_drive {
    struct hal_drive drive;
    struct hal_drive_target given;
    enum hal_drive_state state;
};

static struct controller controller;
static struct controller_axis_config axis_config[AXES];
static struct controller_axis axis[AXES];
static struct bench_drive drive[AXES];
static struct motion_segment storage[AXES][LEGS];
static struct motion_track track[AXES];
static struct motion_segment start_storage[START_LONG]; /* of all axes */
static struct motion_track start_track;
static struct motion_track_summary start_summary;
static int start_err;
static int64_t now_ns;

static void bench_request(struct hal_drive *self, enum hal_drive_request what)
{
    ((struct bench_drive *)self)->state =
        what == HAL_DRIVE_REQUEST_ENABLE       ? HAL_DRIVE_ENABLED
        : what == HAL_DRIVE_REQUEST_QUICK_STOP ? HAL_DRIVE_QUICK_STOP
                                               : HAL_DRIVE_OFF;
}

static int bench_set(struct hal_drive *self,
                     const struct hal_drive_target *target)
{
    ((struct bench_drive *)self)->given = *target;
    return MOTION_OK;
}

static void bench_feedback(struct hal_drive *self,
                           struct hal_drive_feedback *feedback)
{
    const struct bench_drive *own = (struct bench_drive *)self;
    feedback->state = own->state;
    feedback->pos_q32 = own->given.pos_q32 - (own->given.vel_q32 >> 9);
    feedback->t_ns = now_ns - PERIOD_NS;
    feedback->demand_age_ns = PERIOD_NS;
    feedback->following = true;
}

static const struct hal_drive_ops bench_ops = {
    .request = bench_request,
    .set_target = bench_set,
    .feedback = bench_feedback,
};

static uint32_t bench_now(void)
{
    return UINT32_MAX - TIMER_VALUE;
}

/* A command that takes effect at the next tick. */
typedef void bench_command(void);

static void bench_none(void)
{
}

static void bench_hold(void)
{
    (void)controller_hold(&controller);
}

static void bench_stop(void)
{
    controller_stop(&controller);
}

static void bench_slower(void)
{
    (void)controller_override(&controller, MOTION_CLOCK_WARP_ONE_Q30 / 4);
}

static void bench_faster(void)
{
    (void)controller_override(&controller, MOTION_CLOCK_WARP_ONE_Q30);
}

static void bench_fault(void)
{
    drive[0].state = HAL_DRIVE_FAULT;
}

#define SCHEDULED_AHEAD 100 /* ticks */
static struct controller_ramp scheduled;
static int64_t scheduled_ns;

static void bench_schedule(void)
{
    (void)controller_ramp_schedule(&controller, &scheduled, scheduled_ns);
}

static void bench_begin_ramp(void)
{
    (void)controller_ramp_begin(&controller);
}

/* Instructions of one tick, and of the command before it. */
static uint32_t bench_tick(bench_command *command)
{
    const uint32_t begin = bench_now();
    __asm__ volatile(NOP_64);
    const uint32_t unit = bench_now() - begin;
    now_ns += PERIOD_NS;
    const uint32_t start = bench_now();
    command();
    controller_step(&controller, now_ns,
                    (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
    return (uint32_t)((uint64_t)(bench_now() - start) * NOPS / unit);
}

/* To and fro by a quintic, each axis in another time; its peaks are 1.875 d/T,
 * 5.774 d/T^2 and 60 d/T^3 (Biagiotti & Melchiorri, 2.1.5), which are the
 * limits, but for a thousandth. */
static int bench_axis(unsigned i)
{
    const int64_t d = 100 * UNIT, ms = 700 + 130 * (int64_t)i;
    const int64_t vel = d * 1877 / ms, acc = d / ms * 5780 * 1000 / ms;
    const int64_t jerk = d / ms * 60060 * 1000 / ms * 1000 / ms;
    struct motion_state from = { 0 }, to = { 0 };
    axis_config[i] = (struct controller_axis_config){
        .pos_min_q32 = -1000 * UNIT,
        .pos_max_q32 = 1000 * UNIT,
        .limit = { vel, acc, jerk },
        .following_floor_q32 = UNIT / 1000,
        .following_k_ns = 4 * PERIOD_NS,
        .torque_q32 = UNIT / 10,
    };
    motion_track_init(&track[i], storage[i], LEGS, 0);
    for (int leg = 0; leg < LEGS; leg++) {
        to.pos_q32 = leg % 2 ? 0 : d;
        const int err = motion_track_append_quintic(
            &track[i], ms * (MOTION_FIXED_S_Q12 / 1000), &from, &to);
        if (err < 0)
            return err;
        from = to;
    }
    return MOTION_OK;
}

static int bench_ready(int64_t stop_times)
{
    struct hal_drive *drives[AXES];
    const struct controller_config config = {
        .period_ns = PERIOD_NS,
        .axis_count = AXES,
        .axis = axis_config,
    };
    for (unsigned i = 0; i < AXES; i++) {
        const struct motion_clock_limit *limit = &axis_config[i].limit;
        axis_config[i].stop = (struct motion_clock_limit){
            limit->vel_q32,
            limit->acc_q32 * stop_times,
            limit->jerk_q32 * stop_times,
        };
        drive[i] = (struct bench_drive){ .drive.ops = &bench_ops };
        drives[i] = &drive[i].drive;
    }
    now_ns = 1000 * PERIOD_NS;
    if (controller_init(&controller, &config, axis, drives, NULL) < 0)
        return -1;
    (void)bench_tick(bench_none);
    if (controller_enable(&controller) < 0)
        return -1;
    (void)bench_tick(bench_none);
    return MOTION_OK;
}

static int bench_begin(int64_t stop_times)
{
    const struct motion_track *tracks[AXES];
    for (unsigned i = 0; i < AXES; i++)
        tracks[i] = &track[i];
    const int err = bench_ready(stop_times);
    return err < 0 ? err : controller_start(&controller, tracks, NULL);
}

static void bench_start(void)
{
    const struct motion_track *tracks[AXES];
    for (unsigned i = 0; i < AXES; i++)
        tracks[i] = &start_track;
    start_err = controller_start(&controller, tracks, NULL);
}

/* The legs of the slowest axis, which all are fast enough for.  0: an error. */
static uint32_t bench_start_of(uint32_t count)
{
    struct motion_state from = { 0 };
    motion_track_init(&start_track, start_storage, START_LONG, 0);
    for (uint32_t leg = 0; leg < count; leg++) {
        const struct motion_state to = { .pos_q32 =
                                             leg % 2 == 0 ? 100 * UNIT : 0 };
        if (motion_track_append_quintic(&start_track,
                                        track[AXES - 1].segment[0].dur_ns_q12,
                                        &from, &to) < 0)
            return 0;
        from = to;
    }
    motion_track_summarise(&start_track, &start_summary);
    if (bench_ready(2) < 0)
        return 0;
    const uint32_t instructions = bench_tick(bench_start);
    return start_err < 0 ? 0 : instructions;
}

static uint32_t most(uint32_t a, uint32_t b)
{
    return a > b ? a : b;
}

/* The worst ticks of all episodes of a kind. */
struct bench_worst {
    uint32_t moving; /* before the command */
    uint32_t request, after, ticks, quick;
};

static bool bench_is_over(void)
{
    return controller.state == CONTROLLER_FAULT ||
           controller.state == CONTROLLER_READY ||
           (controller.rate.rate_q30 == 0 &&
            controller.state == CONTROLLER_HOLDING) ||
           (controller.state == CONTROLLER_MOVING &&
            controller.warp.rate1_q30 == controller.wanted_q30 &&
            controller.rate.rate_q30 == controller.wanted_q30);
}

/* What comes before the command of every fourth episode, so many ticks. */
#define BEFORE_DOWN 30
#define BEFORE_UP   60

static bench_command *bench_before(unsigned n, unsigned ticks)
{
    if ((n % 4 == 1 && ticks == BEFORE_DOWN) ||
        (n % 4 == 3 && ticks == BEFORE_UP + 250))
        return bench_slower;
    return n % 4 == 3 && ticks == BEFORE_UP ? bench_faster : bench_none;
}

/* A move until the command, of some with the rate on its way down or up; then
 * until it is obeyed. */
static int bench_episode(unsigned n, int64_t stop_times, bench_command *command,
                         struct bench_worst *worst)
{
    const unsigned until = 40 + n * 111 % 2200;
    uint32_t ticks = 1;
    if (bench_begin(stop_times) < 0)
        return -1;
    for (unsigned k = 0; k < until; k++) {
        const uint32_t count = bench_tick(bench_before(n, until - k));
        if (n % 2 == 0)
            worst->moving = most(worst->moving, count);
        else
            worst->after = most(worst->after, count);
    }
    worst->request = most(worst->request, bench_tick(command));
    for (; !bench_is_over(); ticks++)
        worst->after = most(worst->after, bench_tick(bench_none));
    worst->ticks = most(worst->ticks, ticks);
    worst->quick += controller.reaction == CONTROLLER_REACT_QUICK ? 1 : 0;
    return MOTION_OK;
}

/* A scheduled ramp: found by somebody else, which does not count. */
static int bench_scheduled(unsigned n, struct bench_worst *worst)
{
    int32_t tried = 0;
    if (bench_begin(2) < 0)
        return -1;
    for (unsigned k = 0; k < 40 + n * 111; k++)
        (void)bench_tick(bench_none);
    scheduled = (struct controller_ramp){ .rate_q30 = 0 };
    do {
        worst->moving = most(worst->moving, bench_tick(bench_none));
        scheduled_ns = controller.clock_ns + SCHEDULED_AHEAD * PERIOD_NS;
    } while (controller_ramp_find(&controller, scheduled_ns, &scheduled,
                                  &tried) == 0);
    worst->request = most(worst->request, bench_tick(bench_schedule));
    while (controller.clock_ns < scheduled_ns)
        worst->request = most(worst->request, bench_tick(bench_none));
    worst->after = most(worst->after, bench_tick(bench_begin_ramp));
    if (controller.state != CONTROLLER_HOLDING)
        return -1;
    uint32_t ticks = 1;
    for (; !bench_is_over(); ticks++)
        worst->after = most(worst->after, bench_tick(bench_none));
    worst->ticks = most(worst->ticks, ticks);
    return MOTION_OK;
}

static void bench_report(const char *what, uint32_t count)
{
    start_print(what);
    start_print_u32(count);
    start_print("\n");
}

/* False: more than its limit. */
static bool bench_is_kept(const struct bench_worst *worst, const char *request)
{
    bench_report("    moving          ", worst->moving);
    bench_report(request, worst->request);
    bench_report("    until rest      ", worst->after);
    bench_report("    ticks of that   ", worst->ticks);
    return worst->moving <= LIMIT_MOVING && worst->request <= LIMIT_SEEK &&
           worst->after <= LIMIT_SEEK;
}

/* Over at once: more than its limit. */
static bool bench_kind(const char *what, int64_t stop_times,
                       bench_command *command)
{
    struct bench_worst worst = { 0 };
    for (unsigned n = 0; n < EPISODES; n++)
        if (bench_episode(n, stop_times, command, &worst) < 0)
            return false;
    start_print(what);
    const bool is_kept = bench_is_kept(&worst, "    with the request ");
    bench_report("    quick stops     ", worst.quick);
    return is_kept;
}

static bool bench_ramps(void)
{
    struct bench_worst worst = { 0 };
    for (unsigned n = 0; n < EPISODES; n++)
        if (bench_scheduled(n, &worst) < 0)
            return false;
    start_print("  scheduled ramp\n");
    return bench_is_kept(&worst, "    until it begins ");
}

/* False: it takes longer for a long move, by more than a count is off. */
static bool bench_starts(void)
{
    const uint32_t few = bench_start_of(START_SHORT);
    const uint32_t many = bench_start_of(START_LONG);
    start_print("  start\n");
    bench_report("    of 10 segments  ", few);
    bench_report("    of 2000         ", many);
    return few > 0 && many > 0 && many <= few + few / 100;
}

int main(void)
{
    TIMER_RELOAD = UINT32_MAX;
    TIMER_VALUE = UINT32_MAX;
    TIMER_CTRL = 1;
    for (unsigned i = 0; i < AXES; i++)
        if (bench_axis(i) < 0)
            return 2;
    const bool fault =
        bench_kind("  fault, stop limits twice the limits\n", 2, bench_fault);
    const bool tight =
        bench_kind("  fault, stop limits the limits\n", 1, bench_fault);
    const bool stop = bench_kind("  stop\n", 2, bench_stop);
    const bool hold = bench_kind("  hold\n", 2, bench_hold);
    const bool slower = bench_kind("  override\n", 2, bench_slower);
    const bool ramps = bench_ramps();
    const bool starts = bench_starts();
    if (fault && tight && stop && hold && slower && ramps && starts)
        return 0;
    start_print("more than a tick may take\n");
    return 1;
}
