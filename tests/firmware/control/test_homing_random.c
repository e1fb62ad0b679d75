/* tests/firmware/control/test_homing_random.c - homing from random positions, at
 * random speeds, to switches that bounce, are wired wrongly, stick or are pressed
 * already, to inputs of the drive, by the drive, and to hard stops.
 *
 * What must hold: the axis is homed to within one count of the truth, or it is
 * said why not; and no hard stop is met faster than the axis looks for one, by
 * any other way of homing not at all.
 *
 *   N=500 build/tests/firmware/control/test_homing_random
 *   SEED=17 N=1 ...      the one that failed
 *
 * Nothing can tell these apart, so they are not drawn: a switch that is wired
 * the wrong way round and stands between two places that are both "pressed",
 * and an axis that begins beyond a limit switch that does not work.  Wrong
 * wiring begins inside the range. */
#include <inttypes.h>

#include "tests/firmware/control/homing_bench.h"

#define MS INT64_C(1000000)

/* Of tests/data/homing/rig.yaml, as far as the first axis has them. */
enum { STOP, HOME, LEFT, RIGHT, LINES };

enum way { BY_LINE, BY_INPUT, BY_DRIVE, BY_HARD_STOP, WAYS };
enum trouble {
    NO_TROUBLE,
    BOUNCES,
    INVERTED,     /* normally closed taken for normally open */
    HOME_IS_LEFT, /* two wires exchanged */
    HOME_IS_RIGHT,
    STUCK_ACTIVE,
    STUCK_OPEN,
    DEAD, /* the chip does not answer */
    TROUBLES,
};

static uint64_t seed, state;
static unsigned homed[WAYS], failed[WAYS], errors[64], reached[TROUBLES];

static int64_t below(int64_t most)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (int64_t)((state >> 20) % (uint64_t)most);
}

static int64_t between(int64_t low, int64_t high)
{
    return low + below(high - low + 1);
}

/* --- time, and what the wires do in it --- */

static enum trouble trouble;
static enum way way;
static int64_t bounce_ns;
static bool was_pressed;

static void wires(int64_t now_ns)
{
    struct sim_gpio *line = &sim.line[HOME];
    const bool pressed = way == BY_LINE && sim.pressed[HOME];
    if (trouble == BOUNCES && pressed != was_pressed)
        bounce_ns = now_ns + between(1, 8) * MS;
    if (trouble == INVERTED)
        sim_gpio_drive(line, pressed ? SIM_GPIO_LOW : SIM_GPIO_HIGH);
    else if (trouble == BOUNCES && now_ns < bounce_ns)
        sim_gpio_drive(line, below(2) ? SIM_GPIO_LOW : SIM_GPIO_HIGH);
    else if (trouble == BOUNCES)
        sim_gpio_drive(line, pressed ? SIM_GPIO_HIGH : SIM_GPIO_LOW);
    was_pressed = pressed;
}

static void tick(void)
{
    const int64_t now_ns = sim.world.now_ns + rig.period_ns;
    for (int64_t t_ns = sim.world.now_ns; t_ns < now_ns;) {
        t_ns += rig.period_ns / 4;
        sim_world_run(&sim.world, t_ns);
        if (trouble == BOUNCES || trouble == INVERTED)
            wires(t_ns);
    }
    machine_tick(&machine, now_ns);
}

/* --- a case --- */

static void read_rig(const char *path, unsigned axis)
{
    read_axis(path, axis);
    if (rig.line_count > 0)
        rig.line_count = LINES;
}

/* As fine as slow covers in the time from an edge until it is seen: half of a
 * count in 2.5 ms. */
static void draw_speeds(void)
{
    struct rig_axis *axis = &rig.axis[0];
    struct homing_config *homing = &axis->homing;
    const int64_t counts = between(20, 200); /* per mm */
    axis->counts_num = axis->counts_num < 0 ? -counts : counts;
    axis->counts_den = 1;
    homing->slow_q32 = UNIT * 200 / counts; /* 10 mm/s .. 1 mm/s */
    homing->fast_q32 = between(homing->slow_q32 / UNIT + 1, 95) * UNIT;
    homing->timeout_ns = 600000 * MS;
}

static void exchange(int with)
{
    const struct rig_line home = rig.line[HOME];
    rig.line[HOME].sim_low_q32 = rig.line[with].sim_low_q32;
    rig.line[HOME].sim_high_q32 = rig.line[with].sim_high_q32;
    rig.line[with].sim_low_q32 = home.sim_low_q32;
    rig.line[with].sim_high_q32 = home.sim_high_q32;
}

/* On it, beside it, on a limit switch, or anywhere. */
static int64_t draw_start(void)
{
    if (trouble >= INVERTED || below(3) > 0)
        return between(0, 600000) * UM;
    return between(-24000, -5000) * UM;
}

static void draw_line(void)
{
    read_rig("tests/data/homing/rig.yaml", 0);
    struct rig_sim *servo = &rig.axis[0].sim;
    draw_speeds();
    trouble = below(3) == 0 ? (enum trouble)between(INVERTED, TROUBLES - 1)
              : below(2)    ? BOUNCES
                            : NO_TROUBLE;
    servo->has_stops = true;
    servo->stop_q32[0] = -45 * UNIT;
    servo->stop_q32[1] = 655 * UNIT;
    rig.line[HOME].sim_low_q32 = -10 * UNIT - between(2000, 5000) * UM;
    if (trouble == HOME_IS_LEFT)
        exchange(LEFT);
    if (trouble == HOME_IS_RIGHT)
        exchange(RIGHT);
    servo->start_q32 = draw_start();
}

static void draw_input(void)
{
    read_rig("tests/data/homing/drive.yaml", (unsigned)below(4));
    struct rig_sim *servo = &rig.axis[0].sim;
    draw_speeds();
    servo->start_q32 = between(0, 290000) * UM;
    servo->has_stops = true;
    servo->stop_q32[0] = -60 * UNIT;
    servo->stop_q32[1] = 660 * UNIT;
}

/* 27: to the home switch, from above. */
static void draw_drive(void)
{
    read_rig("tests/data/homing/rig.yaml", 0);
    struct homing_config *homing = &rig.axis[0].homing;
    rig.line_count = 1;
    draw_speeds();
    homing->by = HOMING_DRIVE;
    homing->method = 27;
    rig.axis[0].sim.start_q32 = between(0, 600000) * UM;
}

static void draw_hard_stop(void)
{
    const bool by_turns = below(2) == 0;
    read_rig(by_turns ? "tests/data/homing/hard_stop_turns.yaml"
                      : "tests/data/homing/hard_stop.yaml",
             (unsigned)below(by_turns ? 3 : 2));
    draw_speeds();
    struct rig_axis *axis = &rig.axis[0];
    axis->homing.fast_q32 =
        between(axis->homing.slow_q32 / UNIT + 1, 20) * UNIT;
    axis->homing.distance_q32 = 700 * UNIT;
    /* at the stop, too */
    axis->sim.start_q32 = below(8) == 0
                              ? axis->sim.stop_q32[axis->homing.direction > 0]
                              : between(0, 290000) * UM;
}

/* Simulated switches and stops of a drive are at whole counts from there. */
static void start_at_a_count(void)
{
    struct rig_axis *axis = &rig.axis[0];
    const int64_t counts = llabs(axis->counts_num);
    const int64_t whole = axis->sim.start_q32 / (UNIT / counts);
    axis->sim.start_q32 = whole * UNIT / counts;
}

static void power_on(void)
{
    char who[32];
    snprintf(who, sizeof who, "SEED=%" PRIu64 ": ", seed);
    homing_build(who);
    if (trouble == STUCK_ACTIVE || trouble == STUCK_OPEN || trouble == DEAD)
        machine_sim_stick(&sim, HOME,
                          trouble == STUCK_ACTIVE ? SIM_GPIO_HIGH
                          : trouble == STUCK_OPEN ? SIM_GPIO_LOW
                                                  : SIM_GPIO_DEAD);
    homing_enable(who);
}

/* --- and what came of it --- */

static void judge_stops(void)
{
    const struct rig_axis *axis = &rig.axis[0];
    /* set points are whole counts, of which the servo smooths the most */
    const double ripple = 200.0 / (double)llabs(axis->counts_num);
    const double most =
        way == BY_HARD_STOP
            ? (double)axis->homing.fast_q32 / (double)UNIT + ripple
            : 0;
    if (met() > most)
        fail_msg("SEED=%" PRIu64
                 ", way %d, trouble %d: a hard stop is met at %.3f mm/s, %s",
                 seed, (int)way, (int)trouble, met(),
                 homing_error_text(machine.homing.error));
}

static void judge_place(void)
{
    const double says =
        (double)machine.controller.axis[0].feedback.pos_q32 / (double)UNIT;
    const double is =
        (double)(machine_sim_pos_q32(&sim, 0) + sim.zero_q32[0]) / (double)UNIT;
    const double count = 1.0 / (double)llabs(rig.axis[0].counts_num);
    /* simulated switches and servos look about them four times in a ms */
    const double step =
        (double)rig.axis[0].homing.slow_q32 / (double)UNIT * 2 * 0.00025;
    if (says - is > count + step || is - says > count + step)
        fail_msg("SEED=%" PRIu64 ", way %d, trouble %d: it says %.4f mm and is "
                 "at %.4f, a count is %.4f",
                 seed, (int)way, (int)trouble, says, is, count);
}

static void one_homing(void)
{
    static void (*const draw[WAYS])(void) = { draw_line, draw_input, draw_drive,
                                              draw_hard_stop };
    state = seed * UINT64_C(0x9E3779B97F4A7C15) + 1;
    trouble = NO_TROUBLE;
    bounce_ns = 0;
    was_pressed = false;
    way = below(2) ? BY_LINE : (enum way)below(WAYS);
    draw[way]();
    start_at_a_count();
    power_on();
    assert_int_equal(homing_start(&machine.homing, 1), MOTION_OK);
    for (int i = 0; homing_is_running(&machine.homing); i++) {
        if (i > 700000)
            fail_msg("SEED=%" PRIu64 ": it never ends", seed);
        tick();
    }
    for (int i = 0; i < 200; i++)
        tick();
    judge_stops();
    reached[trouble]++;
    if (machine.homing.state == HOMING_DONE) {
        homed[way]++;
        judge_place();
        return;
    }
    failed[way]++;
    errors[machine.homing.error]++;
    if (trouble <= BOUNCES)
        fail_msg("SEED=%" PRIu64 ", way %d: %s, %s", seed, (int)way,
                 homing_error_text(machine.homing.error),
                 controller_fault_text(machine.controller.fault.fault));
    assert_true(machine.homing.error != HOMING_OK);
    assert_false(machine.controller.axis[0].homed);
}

static void it_knows_its_place_or_says_why_not(void **unused)
{
    const char *count = getenv("N"), *first = getenv("SEED");
    const uint64_t from = first != NULL ? strtoull(first, NULL, 10) : 1;
    const uint64_t all = count != NULL ? strtoull(count, NULL, 10) : 100;
    (void)unused;
    for (seed = from; seed < from + all; seed++)
        one_homing();
    for (int i = 0; i < WAYS; i++)
        print_message("way %d: %u homed, %u not\n", i, homed[i], failed[i]);
    for (int i = 0; i < 64; i++)
        if (errors[i] > 0)
            print_message("  %u x %s\n", errors[i],
                          homing_error_text((enum homing_error)i));
    for (int i = 0; all >= 100 && i < TROUBLES; i++)
        assert_true(reached[i] > 0);
    for (int i = 0; all >= 100 && i < WAYS; i++)
        assert_true(homed[i] > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_knows_its_place_or_says_why_not),
    };
    return cmocka_run_group_tests_name("homing_random", tests, NULL, down);
}
