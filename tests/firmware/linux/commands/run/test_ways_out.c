/* tests/firmware/linux/commands/run/test_ways_out.c - however a run ends, no torque
 * is left behind: every way out in every phase, on every kind of drive, judged
 * by what the simulated servos themselves do.  Takes long. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/machine/off.h"
#include "tests/firmware/linux/player/player_bench.h"
#include "tests/support/kind/kind.h"

#define MS     INT64_C(1000000)
#define SECOND (1000 * MS)

enum way {
    ONCE,    /* one interrupt */
    TWICE,   /* two, and a hundred more while torque goes off */
    LATE,    /* the second one while the first stop is under way */
    FAULT,   /* an axis goes wrong by itself */
    LOST,    /* it says nothing any more, for ever */
    RETURNS, /* for two seconds */
    UNDISTURBED,
    WAYS
};

static const char *const way_text[WAYS] = { "once",       "twice", "late",
                                            "fault",      "lost",  "returns",
                                            "undisturbed" };

static struct {
    enum way way;
    enum telemetry_phase phase; /* in which it happens, */
    int64_t after_ns;           /* so long after its begin */
    int64_t happened_ns;        /* 0: not yet */
    bool returned;
} given;

static const struct kind_test *kind_of(unsigned i)
{
    return kind_tests[bench.job.rig.axis[i].kind];
}

static bool has_torque(unsigned i)
{
    return kind_of(i)->has_torque(bench.sim.servo[i]);
}

static void corrupt(unsigned i, bool lose)
{
    kind_of(i)->trouble(bench.sim.servo[i], lose ? KIND_SILENT : KIND_BLOCKED);
}

static void heal(unsigned i)
{
    kind_of(i)->trouble(bench.sim.servo[i], KIND_HEALED);
}

static void happen(void)
{
    const int64_t now_ns = bench.sim.world.now_ns;
    if (given.happened_ns == 0) {
        if (bench.player.phase != given.phase ||
            now_ns - bench.player.phase_ns < given.after_ns)
            return;
        given.happened_ns = now_ns;
        if (given.way == FAULT || given.way == LOST || given.way == RETURNS)
            corrupt(0, given.way != FAULT);
        else if (given.way != UNDISTURBED)
            bench.interrupts = given.way == TWICE ? 2 : 1;
    }
    if (given.way == LATE && now_ns - given.happened_ns >= 50 * MS)
        bench.interrupts = 2;
    if (given.way == RETURNS && !given.returned &&
        now_ns - given.happened_ns >= 2 * SECOND) {
        given.returned = true;
        heal(0);
    }
}

static int64_t before_wait(int64_t t_ns)
{
    happen();
    return t_ns;
}

static void build(const char *directory)
{
    memset(&given, 0, sizeof given);
    bench_open(&directory, 1, false);
}

static void play(enum way way, enum telemetry_phase phase, int64_t after_ns)
{
    const struct player_config config = {
        .override_q30 = MOTION_CLOCK_WARP_ONE_Q30,
        .hold_at_ns = -1,
    };
    given.way = way;
    given.phase = phase;
    given.after_ns = after_ns;
    bench_play(&config, (struct player_observer){ .report = NULL });
}

static bool any_torque(void)
{
    for (unsigned i = 0; i < bench.job.rig.axis_count; i++)
        if (has_torque(i))
            return true;
    return false;
}

/* What is said is what is so; what could be switched off is. */
static void judge(const char *rig)
{
    for (unsigned i = 0; i < bench.job.rig.axis_count; i++) {
        const bool lost = i == 0 && given.way == LOST && given.happened_ns > 0;
        const bool said = bench.report.torque[i][0] == 0;
        if (has_torque(i) && (said || !lost))
            fail_msg("%s, %s in %s after %lld ms: %s has torque%s", rig,
                     way_text[given.way], telemetry_phase_text(given.phase),
                     (long long)(given.after_ns / MS),
                     bench.job.rig.axis[i].name, said ? ", unsaid" : "");
        if (!said && !lost)
            fail_msg("%s, %s in %s after %lld ms: %s: %s", rig,
                     way_text[given.way], telemetry_phase_text(given.phase),
                     (long long)(given.after_ns / MS),
                     bench.job.rig.axis[i].name, bench.report.torque[i]);
    }
    assert_int_equal(bench.report.torque_left, !machine_is_off(&bench.machine));
    assert_int_equal(bench.machine.lit, bench.report.torque_left);
    const bool requested =
        given.happened_ns > 0 && given.phase != TELEMETRY_STOP;
    if (given.way == ONCE)
        assert_int_equal(bench.report.end,
                         requested ? REPORT_STOPPED : REPORT_DONE);
}

/* A quick stop takes 3 s at most, and torque is off, or named, 5 s after that was
 * requested (docs/FAULTS.md); what is seen is seen at ticks. */
static void judge_times(const char *rig)
{
    const int64_t late_ns = 2 * bench.job.rig.period_ns;
    const int64_t stop_ns = bench.player.phase_ns - given.happened_ns;
    const int64_t off_ns = bench.sim.world.now_ns - bench.player.phase_ns;
    const bool is_quick = given.way == TWICE || given.way == LATE;
    assert_int_equal(bench.player.phase, TELEMETRY_STOP);
    if (off_ns > 5 * SECOND + late_ns ||
        (given.happened_ns > 0 && is_quick &&
         stop_ns > 50 * MS + 3 * SECOND + late_ns))
        fail_msg("%s, %s in %s: stopped %lld ms, off %lld ms", rig,
                 way_text[given.way], telemetry_phase_text(given.phase),
                 (long long)(stop_ns / MS), (long long)(off_ns / MS));
}

static void every_way_out(const char *rig)
{
    static const int64_t after_ns[] = { MS, 60 * MS, 700 * MS };
    for (int way = 0; way < WAYS; way++)
        for (int phase = TELEMETRY_ENABLE; phase <= TELEMETRY_STOP; phase++) {
            build(rig);
            play((enum way)way, (enum telemetry_phase)phase,
                 after_ns[(way + phase) % (int)ARRAY_LEN(after_ns)]);
            judge(rig);
            judge_times(rig);
            bench_free();
        }
}

static void no_cia402_drive_keeps_torque(void **state)
{
    (void)state;
    every_way_out("examples/dolly");
}

static void none_after_homing_either(void **state)
{
    (void)state;
    every_way_out("tests/data/homing");
}

static void no_modbus_drive_keeps_torque(void **state)
{
    (void)state;
    every_way_out("examples/modbus");
}

static void no_drive_that_counts_turns_keeps_torque(void **state)
{
    (void)state;
    every_way_out("examples/odrive");
}

/* The mailbox of a line is the process's: what was under way dies with it. */
static void forget_replies(void)
{
    struct hal_modbus_reply reply;
    (void)hal_clock_wait_until(&bench.sim.world.clock,
                               bench.sim.world.now_ns + SECOND / 20);
    for (unsigned i = 0; i < bench.job.rig.bus_count; i++)
        if (!rig_bus_is_can(&bench.job.rig.bus[i]))
            while (hal_modbus_collect(bench.machine.ports.modbus[i], &reply) >
                   0)
                ;
}

/* slew off, of drives that somebody left on. */
static void a_drive_that_was_left_on_is_switched_off(void **state)
{
    static const char *const rigs[] = { "examples/dolly", "examples/modbus",
                                        "examples/odrive" };
    (void)state;
    for (size_t r = 0; r < ARRAY_LEN(rigs); r++) {
        char message[YAML_MESSAGE_MAX] = "";
        build(rigs[r]);
        int64_t now_ns = bench.sim.world.now_ns;
        given.way = UNDISTURBED;
        for (unsigned i = 0;
             i < 20000 && bench.machine.controller.state != CONTROLLER_READY;
             i++) {
            now_ns += bench.job.rig.period_ns;
            (void)hal_clock_wait_until(&bench.clock, now_ns);
            machine_tick(&bench.machine, now_ns);
            (void)controller_enable(&bench.machine.controller);
        }
        assert_int_equal(bench.machine.controller.state, CONTROLLER_READY);
        assert_true(any_torque());
        /* a master that knows nothing of the one before */
        static struct machine next;
        forget_replies();
        now_ns = bench.sim.world.now_ns;
        if (machine_init(&next, &bench.job.rig, &bench.machine.ports, message) <
            0)
            fail_msg("%s", message);
        next.powered = (1u << bench.job.rig.axis_count) - 1;
        for (int64_t end_ns = now_ns + 2 * SECOND;
             now_ns < end_ns && !machine_is_off(&next);) {
            now_ns += bench.job.rig.period_ns;
            (void)hal_clock_wait_until(&bench.clock, now_ns);
            machine_tick_off(&next, now_ns);
        }
        if (!machine_is_off(&next) || any_torque())
            fail_msg("%s: powered %#" PRIx64 ", torque %d", rigs[r],
                     next.powered, any_torque());
        bench_free();
    }
}

static void off_answers_for_every_axis(void **state)
{
    static struct off_axis axis[RIG_AXES_MAX];
    const struct off_config config = { .timeout_ns = SECOND };
    (void)state;
    build("examples/dolly");
    assert_true(off_all(&bench.job.rig, &config, axis, NULL));
    for (unsigned i = 0; i < bench.job.rig.axis_count; i++) {
        assert_true(axis[i].is_off);
        assert_string_equal(axis[i].text, "torque is off");
    }
    const struct off_config real = { .real = true, .timeout_ns = SECOND };
    assert_false(off_all(&bench.job.rig, &real, axis, NULL));
    for (unsigned i = 0; i < bench.job.rig.axis_count; i++) {
        assert_false(axis[i].is_off);
        assert_non_null(strstr(axis[i].text, "not confirmed off: bus can"));
    }
    bench_free();
}

/* --- the operator's signals ---------------------------------------------- */

static void pause_ms(int ms)
{
    const struct timespec pause = { ms / 1000, ms % 1000 * 1000000L };
    nanosleep(&pause, NULL);
}

/* Up to 249 ms: however long this machine takes for it, less than 250 counts as
 * one only if it was less; so the clock is asked. */
static void a_bounced_key_is_one_press(void **state)
{
    (void)state;
    for (int tries = 0; tries < 20; tries++) {
        struct timespec from, to;
        const volatile sig_atomic_t *count = interrupt_listen();
        clock_gettime(CLOCK_MONOTONIC, &from);
        for (int i = 0; i < 5; i++) {
            raise(i % 2 ? SIGTSTP : SIGINT);
            pause_ms(10);
        }
        const int bounced = *count;
        clock_gettime(CLOCK_MONOTONIC, &to);
        pause_ms(260);
        raise(SIGINT);
        const int twice = *count;
        interrupt_listen_no_more();
        assert_int_equal(twice, 2);
        if (to.tv_sec * 1000 + to.tv_nsec / 1000000 -
                (from.tv_sec * 1000 + from.tv_nsec / 1000000) <
            249) {
            assert_int_equal(bounced, 1);
            return;
        }
    }
    skip();
}

static void hammering_comes_to_the_second(void **state)
{
    (void)state;
    const volatile sig_atomic_t *count = interrupt_listen();
    for (int i = 0; i < 8; i++) {
        raise(SIGINT);
        pause_ms(50);
    }
    const int end = *count;
    interrupt_listen_no_more();
    assert_int_equal(end, 2);
}

static void the_end_of_the_system_or_the_terminal_is_one(void **state)
{
    (void)state;
    const volatile sig_atomic_t *count = interrupt_listen();
    raise(SIGTERM);
    pause_ms(300);
    raise(SIGTERM);
    raise(SIGHUP);
    const int one = *count;
    raise(SIGQUIT);
    const int two = *count;
    interrupt_listen_no_more();
    assert_int_equal(one, 1);
    assert_int_equal(two, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_cia402_drive_keeps_torque),
        cmocka_unit_test(none_after_homing_either),
        cmocka_unit_test(no_modbus_drive_keeps_torque),
        cmocka_unit_test(no_drive_that_counts_turns_keeps_torque),
        cmocka_unit_test(a_drive_that_was_left_on_is_switched_off),
        cmocka_unit_test(off_answers_for_every_axis),
        cmocka_unit_test(a_bounced_key_is_one_press),
        cmocka_unit_test(hammering_comes_to_the_second),
        cmocka_unit_test(the_end_of_the_system_or_the_terminal_is_one),
    };
    return cmocka_run_group_tests_name("ways_out", tests, NULL, NULL);
}
