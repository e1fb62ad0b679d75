/* tests/sim/device/cia402/test_sim_cia402_modes.c - the simulated drive in the
 * modes other than CSP, seen from its CAN port. */
#include "tests/sim/device/cia402/digital_inputs.h"
#include "tests/sim/device/cia402/sim_cia402_bench.h"

#define REACHED 0x0400u
#define LIMITED 0x0800u
#define BIT12   0x1000u
#define BIT13   0x2000u

/* Enabled in a mode; targets by SDO, RPDO1 carries the controlword. */
static struct bench *in_mode_of(const struct sim_cia402_config *config,
                                unsigned mode)
{
    struct bench *b = enabled_of(config);

    assert_int_equal(w8(b, 0x6060, 0, mode), 0);
    cycles(b, 2, 0x0F, here(b));
    assert_int_equal(rd(b, 0x6061, 0), mode);
    return b;
}

static struct bench *in_mode(unsigned mode)
{
    return in_mode_of(&drive_config, mode);
}

/* RPDO1 = controlword, and 0x607A that stays at what SDO wrote. */
static void hold(struct bench *b, int n, unsigned controlword, int32_t target)
{
    cycles(b, n, controlword, target);
}

static void profile(struct bench *b, uint32_t vel, uint32_t acc, uint32_t dec)
{
    assert_int_equal(w32(b, 0x6081, 0, vel), 0);
    assert_int_equal(w32(b, 0x6083, 0, acc), 0);
    assert_int_equal(w32(b, 0x6084, 0, dec), 0);
}

/* Cycles until bits of the statusword are so; fails after `most`. */
static int until(struct bench *b, unsigned mask, unsigned want,
                 unsigned controlword, int32_t target, int most)
{
    for (int i = 1; i <= most; i++) {
        cycle(b, controlword, target);
        if ((tpdo_status(b) & mask) == want)
            return i;
    }
    fail_msg("statusword 0x%04X after %d cycles at %d", tpdo_status(b), most,
             (int)tpdo_position(b));
    return 0;
}

/* ---- changing modes ---------------------------------------------------- */

static void it_has_the_modes_that_6502_says(void **state)
{
    struct bench *b = booted();

    (void)state;
    assert_int_equal(rd(b, 0x6502, 0), 0x1E5);
    for (unsigned mode = 0; mode <= 9; mode++) {
        const bool has = mode == 0 || (0x1E5u >> (mode - 1) & 1);

        assert_int_equal(w8(b, 0x6060, 0, mode), has ? 0 : 0x06090030);
    }
    free(b);
}

static void another_mode_waits_until_the_axis_stands(void **state)
{
    struct bench *b = enabled();
    int32_t target = cruise(b, 50);

    (void)state;
    assert_int_equal(w8(b, 0x6060, 0, 1), 0);
    for (int i = 0; i < 20; i++)
        cycle(b, 0x0F, target += 100);
    assert_int_equal(rd(b, 0x6061, 0), 8);
    cycles(b, 50, 0x0F, target);
    assert_int_equal(rd(b, 0x6061, 0), 1);
    free(b);
}

/* A cycle whose other frame comes behind SYNC, so that SYNC is not late. */
static void cycle_with(struct bench *b, const char *frame)
{
    const int64_t end_ns = b->world.now_ns + PERIOD_NS;

    say(b, "080#");
    say(b, frame);
    sim_world_run(&b->world, end_ns);
}

/* SYNC locks the inner loop: one as long as SYNC's period turns with SYNC. */
static void a_loop_as_slow_as_sync_changes_modes_too(void **state)
{
    struct sim_cia402_config slow = drive_config;
    struct bench *b;

    (void)state;
    slow.loop_ns = PERIOD_NS;
    b = enabled_of(&slow);
    cycle_with(b, "601#2F60600001000000");
    cycles(b, 3, 0x0F, here(b));
    cycle_with(b, "601#4061600000000000");
    expect_last(b, "581#4F61600001000000");
    free(b);
}

/* ---- PP ---------------------------------------------------------------- */

/* 100000 counts/s, 1e6 counts/s2: 0.1 s up, 5000 counts each ramp; 20000 counts
 * take 0.1 s + 0.1 s + 10000 / 100000 s = 0.3 s. */
static void a_profile_takes_the_time_of_its_trapezoid(void **state)
{
    struct bench *b = in_mode(1);
    int took;

    (void)state;
    profile(b, 100000, 1000000, 1000000);
    assert_int_equal(w32(b, 0x6067, 0, 1), 0);
    hold(b, 1, 0x0F, 30000);
    took = until(b, REACHED, 0, 0x3F, 30000, 5);
    took += until(b, REACHED, REACHED, 0x3F, 30000, 400);
    if (took < 295 || took > 315)
        fail_msg("took %d ms", took);
    assert_in_range(tpdo_position(b), 29999, 30001);
    free(b);
}

static void
the_profile_never_exceeds_its_speed_or_passes_its_target(void **state)
{
    struct bench *b = in_mode(1);
    int32_t before = 10000;
    int32_t fastest = 0;

    (void)state;
    profile(b, 80000, 2000000, 500000);
    hold(b, 1, 0x0F, -25000);
    for (int i = 0; i < 800; i++) {
        hold(b, 1, 0x1F, -25000);
        if (before - tpdo_position(b) > fastest)
            fastest = before - tpdo_position(b);
        before = tpdo_position(b);
        assert_true(before >= -25001);
    }
    assert_in_range(fastest, 79, 81);
    assert_in_range(before + 25000 + 1, 0, 2);
    free(b);
}

static void a_set_point_is_acknowledged_and_needs_an_edge(void **state)
{
    struct bench *b = in_mode(1);

    (void)state;
    profile(b, 100000, 1000000, 1000000);
    hold(b, 3, 0x0F, 11000);
    assert_int_equal(tpdo_status(b) & BIT12, 0);
    assert_int_equal(tpdo_position(b), 10000); /* no edge: it stands */
    until(b, BIT12, BIT12, 0x1F, 11000, 3);
    hold(b, 300, 0x1F, 20000); /* no edge: not taken */
    assert_int_equal(tpdo_status(b) & (BIT12 | REACHED), BIT12 | REACHED);
    assert_in_range(tpdo_position(b), 10990, 11010);
    until(b, BIT12, 0, 0x0F, 20000, 3);
    until(b, BIT12, BIT12, 0x1F, 20000, 3);
    free(b);
}

/* A second one waits for the first, a third has to wait outside. */
static void a_buffered_set_point_follows_the_first(void **state)
{
    struct bench *b = in_mode(1);
    int32_t highest = 0;

    (void)state;
    profile(b, 100000, 1000000, 1000000);
    until(b, BIT12, BIT12, 0x1F, 20000, 3);
    until(b, BIT12, 0, 0x0F, 20000, 3);
    until(b, BIT12, BIT12, 0x1F, 15000, 3);
    hold(b, 5, 0x0F, 15000);
    assert_int_equal(tpdo_status(b) & BIT12, BIT12); /* the buffer is full */
    for (int i = 0; i < 600; i++) {
        hold(b, 1, 0x0F, 15000);
        if (tpdo_position(b) > highest)
            highest = tpdo_position(b);
    }
    assert_in_range(highest, 19990, 20010);
    assert_in_range(tpdo_position(b), 14990, 15010);
    assert_int_equal(tpdo_status(b) & (BIT12 | REACHED), REACHED);
    free(b);
}

static void bit_5_changes_at_once_and_bit_6_is_relative(void **state)
{
    struct bench *b = in_mode(1);
    int32_t highest = 0;

    (void)state;
    profile(b, 100000, 1000000, 1000000);
    until(b, BIT12, BIT12, 0x3F, 60000, 3);
    hold(b, 150, 0x0F, 60000);
    assert_true(tpdo_position(b) > 15000);
    until(b, BIT12, BIT12, 0x3F, 12000, 3); /* behind: it turns round */
    for (int i = 0; i < 600; i++) {
        hold(b, 1, 0x0F, 12000);
        if (tpdo_position(b) > highest)
            highest = tpdo_position(b);
    }
    assert_true(highest < 32000);
    assert_in_range(tpdo_position(b), 11990, 12010);
    until(b, BIT12, BIT12, 0x7F, (int32_t)(uint32_t)-3000, 3);
    hold(b, 400, 0x0F, 0);
    assert_in_range(tpdo_position(b), 8990, 9010);
    free(b);
}

static void halt_stops_a_profile_and_its_end_goes_on(void **state)
{
    struct bench *b = in_mode(1);
    int32_t at;

    (void)state;
    profile(b, 100000, 1000000, 1000000);
    until(b, BIT12, BIT12, 0x1F, 60000, 3);
    hold(b, 150, 0x1F, 60000);
    until(b, REACHED, REACHED, 0x11F, 60000, 200);
    at = tpdo_position(b);
    assert_in_range(at, 11000, 50000);
    hold(b, 50, 0x11F, 60000);
    assert_in_range(tpdo_position(b), at - 20, at + 20);
    until(b, REACHED, 0, 0x1F, 60000, 3);
    until(b, REACHED, REACHED, 0x1F, 60000, 800);
    assert_in_range(tpdo_position(b), 59890, 60010);
    free(b);
}

static void a_target_outside_the_limits_goes_to_the_limit(void **state)
{
    struct bench *b = in_mode(1);

    (void)state;
    assert_int_equal(w32(b, 0x607D, 1, 0), 0);
    assert_int_equal(w32(b, 0x607D, 2, 13000), 0);
    profile(b, 100000, 1000000, 1000000);
    until(b, BIT12, BIT12, 0x1F, 60000, 3);
    hold(b, 400, 0x1F, 60000);
    assert_in_range(tpdo_position(b), 12990, 13010);
    assert_int_equal(tpdo_status(b) & LIMITED, LIMITED);
    free(b);
}

/* ---- PV ---------------------------------------------------------------- */

static void a_velocity_is_reached_by_the_ramps_and_said(void **state)
{
    struct bench *b = in_mode(3);
    int took;

    (void)state;
    profile(b, 1, 1000000, 500000);
    assert_int_equal(status(b) & BIT12, BIT12); /* stands */
    assert_int_equal(w32(b, 0x60FF, 0, 100000), 0);
    until(b, REACHED, 0, 0x0F, 0, 3);
    took = until(b, REACHED, REACHED, 0x0F, 0, 200);
    if (took < 90 || took > 115)
        fail_msg("took %d ms", took);
    assert_int_equal(tpdo_status(b) & BIT12, 0);
    hold(b, 20, 0x0F, 0);
    assert_in_range((int32_t)rd(b, 0x606C, 0), 99000, 101000);
    assert_int_equal(w32(b, 0x60FF, 0, 0), 0);
    took = until(b, BIT12, BIT12, 0x0F, 0, 400);
    if (took < 185 || took > 215)
        fail_msg("stopped in %d ms", took);
    free(b);
}

/* ---- IP and CSV -------------------------------------------------------- */

/* Maps a second object into RPDO1 instead of 0x607A. */
static struct bench *streaming(unsigned mode, uint32_t entry)
{
    struct bench *b = booted();

    configure(b);
    assert_int_equal(w32(b, 0x1400, 1, 0x80000201), 0);
    assert_int_equal(w8(b, 0x1600, 0, 0), 0);
    assert_int_equal(w32(b, 0x1600, 2, entry), 0);
    assert_int_equal(w8(b, 0x1600, 0, 2), 0);
    assert_int_equal(w32(b, 0x1400, 1, 0x201), 0);
    assert_int_equal(w8(b, 0x6060, 0, mode), 0);
    return b;
}

static void interpolation_needs_its_bit(void **state)
{
    struct bench *b = streaming(7, 0x60C10120);
    int32_t target;

    (void)state;
    enable(b);
    hold(b, 5, 0x0F, 12000);
    assert_int_equal(tpdo_position(b), 10000);
    assert_int_equal(tpdo_status(b) & BIT12, 0);
    hold(b, 3, 0x1F, 10000);
    assert_int_equal(tpdo_status(b) & BIT12, BIT12);
    target = 10000;
    for (int i = 0; i < 50; i++)
        cycle(b, 0x1F, target += 100);
    cycles(b, 20, 0x1F, target);
    assert_in_range(tpdo_position(b), target - 1, target + 1);
    free(b);
}

static void a_streamed_velocity_is_run_from_its_sync(void **state)
{
    struct bench *b = streaming(9, 0x60FF0020);
    int32_t at;

    (void)state;
    cycles(b, 3, 0x06, 0);
    cycles(b, 3, 0x07, 0);
    cycles(b, 30, 0x0F, 0);
    assert_string_equal(state_of(tpdo_status(b)), "enabled");
    cycles(b, 50, 0x0F, 50000);
    at = tpdo_position(b);
    cycles(b, 100, 0x0F, 50000);
    assert_in_range(tpdo_position(b) - at, 4995, 5005);
    cycles(b, 50, 0x0F, 0);
    at = tpdo_position(b);
    cycles(b, 50, 0x0F, 0);
    assert_in_range(tpdo_position(b), at - 1, at + 1);
    free(b);
}

/* Torque that is told beforehand need not come from an error: 2e6 counts/s2 at
 * 100 rad/s is one of a / omega^2 = 200 counts, and 20 permille of 1e8. */
static int32_t worst_error(unsigned torque_permille)
{
    struct sim_cia402_config config = drive_config;
    struct bench *b;
    int32_t target[3] = { 10000, 10000, 10000 }, worst = 0;

    config.plant.omega_mrad_s = 100000;
    b = enabled_of(&config);
    assert_int_equal(w16(b, 0x60B2, 0, torque_permille), 0);
    for (int i = 0; i < 200; i++) {
        target[2] = target[1];
        target[1] = target[0];
        target[0] += 2 * i;
        cycle(b, 0x0F, target[0]);
        if (i > 100 && abs(target[2] - tpdo_position(b)) > worst)
            worst = abs(target[2] - tpdo_position(b));
    }
    free(b);
    return worst;
}

static void torque_feed_forward_takes_the_error_away(void **state)
{
    const int32_t without = worst_error(0), with = worst_error(20);

    (void)state;
    assert_in_range(without, 180, 420);
    if (with > without / 5)
        fail_msg("%d counts without, %d with", (int)without, (int)with);
}

/* ---- homing ------------------------------------------------------------ */

/* Negative limit at -50000, home switch 20000 .. 30000, positive at 90000, an
 * index pulse every 4000 counts. */
static struct sim_cia402_config rail_config(int32_t start)
{
    struct sim_cia402_config config = drive_config;

    config.start_counts = start;
    config.rail = (struct sim_cia402_rail){
        .has_limits = true,
        .has_home = true,
        .limit_negative = -50000,
        .limit_positive = 90000,
        .home_from = 20000,
        .home_to = 30000,
        .index_every = 4000,
    };
    return config;
}

static void homing_speeds(struct bench *b)
{
    assert_int_equal(w32(b, 0x6099, 1, 200000), 0);
    assert_int_equal(w32(b, 0x6099, 2, 10000), 0);
    assert_int_equal(w32(b, 0x609A, 0, 5000000), 0);
    assert_int_equal(w32(b, 0x607C, 0, 500), 0);
}

/* Runs a method; where the home point is, on the plant's scale. */
static int32_t home_point(int method, int32_t start)
{
    const struct sim_cia402_config config = rail_config(start);
    struct bench *b = in_mode_of(&config, 6);
    int32_t zero;

    homing_speeds(b);
    assert_int_equal(w8(b, 0x6098, 0, (uint8_t)method), 0);
    hold(b, 3, 0x0F, 0);
    assert_int_equal(tpdo_status(b) & (REACHED | BIT12 | BIT13), REACHED);
    hold(b, 2, 0x1F, 0);
    until(b, BIT12 | BIT13 | REACHED, BIT12 | REACHED, 0x1F, 0, 9000);
    zero = here(b) - tpdo_position(b);
    free(b);
    return zero + 500;
}

static const struct {
    const char *name;
    int method;
    int32_t start, want;
} homings[] = {
    { "1: negative limit, next index", 1, 0, -48000 },
    { "2: positive limit, next index", 2, 0, 88000 },
    { "17: negative limit", 17, 0, -50000 },
    { "17: standing on it", 17, -50500, -50000 },
    { "18: positive limit", 18, 60000, 90000 },
    { "3: left of the switch", 3, 0, 16000 },
    { "4: right of its edge", 4, 0, 20000 },
    { "6: leftwards into it", 6, 40000, 28000 },
    { "7: index left of it", 7, 0, 16000 },
    { "7: from inside", 7, 25000, 16000 },
    { "7: from beyond, by the limit", 7, 50000, 16000 },
    { "8: index right of the left edge", 8, 0, 20000 },
    { "10: index right of it", 10, 0, 32000 },
    { "11: index right of it", 11, 50000, 32000 },
    { "14: index left of it", 14, 50000, 16000 },
    { "19: left edge, leaving", 19, 0, 20000 },
    { "20: left edge, entering", 20, 0, 20000 },
    { "20: from inside", 20, 22000, 20000 },
    { "23: left edge, leaving", 23, 0, 20000 },
    { "24: left edge, entering", 24, 0, 20000 },
    { "25: right edge, entering", 25, 0, 30000 },
    { "26: right edge, leaving", 26, 0, 30000 },
    { "27: right edge, leaving", 27, 50000, 30000 },
    { "27: by the limit", 27, 0, 30000 },
    { "28: right edge, entering", 28, 50000, 30000 },
    { "29: left edge, entering", 29, 50000, 20000 },
    { "30: left edge, leaving", 30, 50000, 20000 },
    { "33: next index down", 33, 1000, 0 },
    { "34: next index up", 34, 1000, 4000 },
    { "35: here", 35, 1234, 1234 },
    { "37: here", 37, -77, -77 },
};

/* An edge is seen at an inner step: 10000 counts/s x 250 us = 2.5 counts, and
 * two positions are rounded. */
static void every_method_finds_its_home(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(homings); i++) {
        const int32_t got = home_point(homings[i].method, homings[i].start);

        if (got < homings[i].want - 4 || got > homings[i].want + 4)
            fail_msg("%s: %d, not %d", homings[i].name, (int)got,
                     (int)homings[i].want);
    }
}

static void without_its_switch_homing_fails_and_stands(void **state)
{
    struct sim_cia402_config config = rail_config(0);
    struct bench *b;

    (void)state;
    config.rail.has_home = false;
    b = in_mode_of(&config, 6);
    homing_speeds(b);
    assert_int_equal(w8(b, 0x6098, 0, 23), 0);
    hold(b, 2, 0x1F, 0);
    until(b, BIT13, BIT13, 0x1F, 0, 9000);
    until(b, REACHED, REACHED, 0x1F, 0, 200);
    assert_int_equal(tpdo_status(b) & BIT12, 0);
    assert_string_equal(state_of(tpdo_status(b)), "enabled");
    free(b);
}

static void homing_is_interrupted_without_bit_4(void **state)
{
    const struct sim_cia402_config config = rail_config(-40000);
    struct bench *b = in_mode_of(&config, 6);

    (void)state;
    homing_speeds(b);
    assert_int_equal(w8(b, 0x6098, 0, 18), 0);
    hold(b, 100, 0x1F, 0);
    assert_int_equal(tpdo_status(b) & (REACHED | BIT12 | BIT13), 0);
    assert_int_equal(w8(b, 0x6098, 0, 17), 0x08000022); /* under way */
    until(b, REACHED, REACHED, 0x0F, 0, 200);
    assert_int_equal(tpdo_status(b) & (BIT12 | BIT13), 0);
    assert_true(here(b) < 80000);
    free(b);
}

/* ---- inputs ------------------------------------------------------------ */

static void the_touch_probe_stores_the_first_edge(void **state)
{
    struct bench *b = enabled();
    int32_t target = cruise(b, 50), at;

    (void)state;
    assert_int_equal(w16(b, 0x60B8, 0, 0x11), 0);
    assert_int_equal(rd(b, 0x60B9, 0), 1);
    for (int i = 0; i < 20; i++)
        cycle(b, 0x0F, target += 100);
    digital_inputs_set(&b->drive, 1u << 16);
    at = here(b);
    for (int i = 0; i < 20; i++)
        cycle(b, 0x0F, target += 100);
    assert_int_equal(rd(b, 0x60B9, 0), 3);
    assert_in_range((int32_t)rd(b, 0x60BA, 0), at - 2, at + 2);
    digital_inputs_set(&b->drive, 0);
    cycle(b, 0x0F, target);
    digital_inputs_set(&b->drive, 1u << 16); /* not the first */
    cycle(b, 0x0F, target);
    assert_in_range((int32_t)rd(b, 0x60BA, 0), at - 2, at + 2);
    assert_int_equal(rd(b, 0x60B9, 0), 3); /* falling was not asked for */
    assert_int_equal(w16(b, 0x60B8, 0, 0), 0);
    assert_int_equal(rd(b, 0x60B9, 0), 0);
    free(b);
}

static void the_switches_of_the_rail_show_in_60fd(void **state)
{
    static const struct {
        int32_t at;
        uint32_t want;
    } rows[] = {
        { -50001, 1 }, { -50000, 1 }, { -49999, 0 }, { 19999, 0 },
        { 20000, 4 },  { 30000, 4 },  { 30001, 0 },  { 90000, 2 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct sim_cia402_config config = rail_config(rows[i].at);
        struct bench *b = booted_of(&config);

        assert_int_equal(rd(b, 0x60FD, 0), rows[i].want);
        free(b);
    }
}

/* ---- SYNC with a counter ----------------------------------------------- */

static void a_sync_of_the_wrong_length_is_told_once_and_gone(void **state)
{
    struct bench *b = enabled();

    (void)state;
    assert_int_equal(w8(b, 0x1019, 0, 10), 0);
    forget(b);
    cycles(b, 5, 0x0F, here(b));
    assert_int_equal(count(b, 0x081), 1);
    expect_last(b, "081#4082110000000000");
    assert_int_equal(count(b, 0x181), 0);
    say(b, "080#01");
    pass(b, MS);
    assert_int_equal(count(b, 0x181), 1);
    expect_last(b, "081#0000000000000000");
    free(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_has_the_modes_that_6502_says),
        cmocka_unit_test(another_mode_waits_until_the_axis_stands),
        cmocka_unit_test(a_loop_as_slow_as_sync_changes_modes_too),
        cmocka_unit_test(a_profile_takes_the_time_of_its_trapezoid),
        cmocka_unit_test(
            the_profile_never_exceeds_its_speed_or_passes_its_target),
        cmocka_unit_test(a_set_point_is_acknowledged_and_needs_an_edge),
        cmocka_unit_test(a_buffered_set_point_follows_the_first),
        cmocka_unit_test(bit_5_changes_at_once_and_bit_6_is_relative),
        cmocka_unit_test(halt_stops_a_profile_and_its_end_goes_on),
        cmocka_unit_test(a_target_outside_the_limits_goes_to_the_limit),
        cmocka_unit_test(a_velocity_is_reached_by_the_ramps_and_said),
        cmocka_unit_test(interpolation_needs_its_bit),
        cmocka_unit_test(a_streamed_velocity_is_run_from_its_sync),
        cmocka_unit_test(torque_feed_forward_takes_the_error_away),
        cmocka_unit_test(every_method_finds_its_home),
        cmocka_unit_test(without_its_switch_homing_fails_and_stands),
        cmocka_unit_test(homing_is_interrupted_without_bit_4),
        cmocka_unit_test(the_touch_probe_stores_the_first_edge),
        cmocka_unit_test(the_switches_of_the_rail_show_in_60fd),
        cmocka_unit_test(a_sync_of_the_wrong_length_is_told_once_and_gone),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
