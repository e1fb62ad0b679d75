/* tests/firmware/linux/machine/test_shutdown.c - the way out of a machine with a
 * drive that is lost with torque: which signals end the tries, on every kind of
 * drive, in virtual time. */
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "firmware/linux/machine/shutdown.h"
#include "tests/firmware/linux/machine/machine_bench.h"
#include "tests/support/kind/kind.h"

#define MS      INT64_C(1000000)
#define SECOND  (1000 * MS)
#define LOST_NS (2 * SECOND) /* after the first tick of the bench */

static struct rig rig;
static struct shutdown way_out;
static struct guardian_page page;

/* At so many ms after the loss of the drive, so many signals so far. */
struct signals {
    int64_t at_ms;
    int count;
};

static const struct row {
    const char *name;
    struct signals signal[8]; /* count 0 ends */
    int64_t ends_ms;          /* at the latest; 0: never */
} rows[] = {
    { "none", { { 0, 0 } }, 0 },
    { "one before", { { -100, 1 } }, 0 },
    { "one after", { { 1000, 1 } }, 0 },
    { "one while it is waited for", { { 8000, 1 } }, 0 },
    { "two before, for a quick stop", { { -340, 1 }, { -80, 2 } }, 0 },
    { "one before, one after", { { -100, 1 }, { 8000, 2 } }, 8500 },
    { "one after, one more", { { 8000, 1 }, { 9000, 2 } }, 9500 },
    { "two before, one after", { { -340, 1 }, { -80, 2 }, { 9000, 3 } }, 9500 },
    { "one after, one more before its time is over",
      { { 600, 1 }, { 1600, 2 } },
      8000 },
    { "Ctrl-\\", { { 8000, 2 } }, 8500 },
    { "a key that bounces", { { 8000, 1 }, { 8300, 2 } }, 0 },
    { "a key that is held down",
      { { 8000, 1 },
        { 8500, 2 },
        { 8750, 3 },
        { 9000, 4 },
        { 9250, 5 },
        { 9500, 6 } },
      0 },
    { "a key that is held down, and pressed",
      { { 8000, 1 }, { 8500, 2 }, { 8750, 3 }, { 12000, 4 } },
      12500 },
};

static int signals_at(const struct row *row, int64_t ms)
{
    int count = 0;

    for (unsigned i = 0; i < ARRAY_LEN(row->signal); i++)
        if (row->signal[i].count > 0 && ms >= row->signal[i].at_ms)
            count = row->signal[i].count;
    return count;
}

static bool has_torque(void)
{
    return kind_tests[rig.axis[0].kind]->has_torque(sim.servo[0]);
}

static void trouble(enum kind_trouble what)
{
    kind_tests[rig.axis[0].kind]->trouble(sim.servo[0], what);
}

/* As every program: until it has to end, then the way out.  True: DONE. */
static bool step(int signals)
{
    const int stops = shutdown_stops(&way_out, now_ns, signals);

    now_ns += rig.period_ns;
    (void)hal_clock_wait_until(machine.ports.clock, now_ns);
    if (stops > 0 || machine.controller.state == CONTROLLER_FAULT)
        shutdown_begin(&way_out, now_ns, 0);
    if (way_out.phase != SHUTDOWN_NONE)
        return shutdown_tick(&way_out, now_ns);
    machine_tick(&machine, now_ns);
    return false;
}

/* Towards the further end of its range. */
static void begin_jog(void)
{
    const struct plan_limit *limit = &rig.axis[0].limit;
    const int64_t from_q32 = machine.controller.axis[0].target.pos_q32;
    const bool up =
        limit->pos_max_q32 - from_q32 > from_q32 - limit->pos_min_q32;
    const struct controller_jog_goal goal = {
        .pos_q32 = up ? limit->pos_max_q32 : limit->pos_min_q32,
        .vel_q32 = limit->vel_q32 / 10,
    };

    assert_int_equal(controller_jog(&machine.controller, &machine.jog, &goal),
                     0);
}

/* A stop of it takes a second, so that it is under way when the drive is lost. */
static void open_rig(const char *path)
{
    memset(&page, 0, sizeof page);
    bench_load(path, &rig);
    for (unsigned i = 0; i < rig.axis_count; i++)
        rig.axis[i].stop_acc_q32 = rig.axis[i].limit.acc_q32 =
            rig.axis[i].limit.vel_q32 / 10;
    bench_build_ready(&rig);
    machine.ports.is_real = true;
    machine.ports.guardian = &page;
    shutdown_init(&way_out, &machine);
    begin_jog();
}

/* After a test that failed, too. */
static int close_rig(void **state)
{
    (void)state;
    if (machine.rig == NULL)
        return 0;
    shutdown_free(&way_out);
    machine_free(&machine);
    machine_sim_free(&sim);
    rig_free(&rig);
    return 0;
}

/* When it is DONE, ms after the loss; -1: not within half a minute. */
static int64_t end_of(const struct row *row)
{
    const int64_t lost_ns = now_ns + LOST_NS;
    bool is_lost = false;

    for (;;) {
        const int64_t ms = (now_ns - lost_ns) / MS;

        if (ms >= 30000)
            return -1;
        if (ms >= 0 && !is_lost) {
            assert_true(way_out.phase != SHUTDOWN_DONE);
            trouble(KIND_SILENT);
            is_lost = true;
        }
        if (step(signals_at(row, ms)))
            return ms;
    }
}

static const char *const rigs[] = { "examples/dolly/rig.yaml",
                                    "examples/modbus/rig.yaml",
                                    "examples/odrive/rig.yaml" };

static void judge(const char *path, const struct row *row, int64_t end_ms)
{
    print_message("%-26s %-45s %s %6lld ms\n", path, row->name,
                  end_ms < 0 ? "tried on," : "over at ", (long long)end_ms);
    assert_false(machine_is_off(&machine));
    assert_true(machine.lit);
    if (row->ends_ms == 0) {
        assert_int_equal(end_ms, -1);
        assert_true(way_out.waits);
        assert_int_equal(page.end, GUARDIAN_WATCHED);
        return;
    }
    assert_in_range(end_ms, 5000, row->ends_ms);
    assert_int_equal(page.end, GUARDIAN_LEFT);
}

static void only_a_second_signal_that_is_meant_ends_the_tries(void **state)
{
    (void)state;
    for (size_t r = 0; r < ARRAY_LEN(rigs); r++)
        for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
            open_rig(rigs[r]);
            judge(rigs[r], &rows[i], end_of(&rows[i]));
            (void)close_rig(NULL);
        }
}

/* And then it is off, as is everything. */
static void one_that_answers_again_is_switched_off(void **state)
{
    const struct row none = { .name = "none" };

    (void)state;
    for (size_t r = 0; r < ARRAY_LEN(rigs); r++) {
        int i = 0;

        open_rig(rigs[r]);
        assert_int_equal(end_of(&none), -1);
        trouble(KIND_HEALED);
        while (!step(0))
            assert_true(i++ < 10 * SECOND / rig.period_ns);
        print_message("%s: off %lld ms after it was there again\n", rigs[r],
                      (long long)(i * rig.period_ns / MS));
        assert_false(has_torque());
        assert_true(machine_is_off(&machine));
        assert_false(machine.lit);
        assert_int_equal(page.end, GUARDIAN_DONE);
        (void)close_rig(NULL);
    }
}

/* It answers, and keeps its torque: not lost, and tried on all the same. */
static void one_that_does_not_switch_off_is_tried_on(void **state)
{
    (void)state;
    open_rig("tests/data/ways_out/moteus.yaml");
    for (const int64_t end_ns = now_ns + SECOND; now_ns < end_ns;)
        (void)step(0);
    sim_servo_inject(sim.servo[0], SIM_SERVO_IGNORES_STATE);
    for (const int64_t end_ns = now_ns + 20 * SECOND; now_ns < end_ns;)
        assert_false(step(1));
    assert_true(way_out.waits && has_torque() && machine.lit);
    assert_false(machine_is_torque_lost(&machine));
    for (const int64_t end_ns = now_ns + SECOND / 2; now_ns < end_ns;)
        if (step(2))
            break;
    assert_int_equal(way_out.phase, SHUTDOWN_DONE);
    assert_int_equal(page.end, GUARDIAN_LEFT);
    (void)close_rig(NULL);
}

/* A simulated one never comes back. */
static void of_a_simulated_machine_it_is_said_after_its_time(void **state)
{
    const struct row none = { .name = "none" };

    (void)state;
    open_rig(rigs[0]);
    machine.ports.is_real = false;
    assert_in_range(end_of(&none), 5000, 8000);
    assert_false(machine_is_off(&machine));
    (void)close_rig(NULL);
}

/* ---- the guardian is lost ------------------------------------------------- */

/* Ticks while somebody looks on, or nobody. */
static void guarded_ticks(int64_t dur_ns, bool looks)
{
    for (const int64_t end_ns = now_ns + dur_ns; now_ns < end_ns;) {
        if (looks)
            atomic_fetch_add(&page.looks, 1);
        (void)step(0);
    }
}

/* By the rig's choice that is a stop, and nothing is enabled without one. */
static void without_a_guardian_a_rig_stops_if_it_says_so(void **state)
{
    (void)state;
    for (int choice = RIG_GUARDIAN_WARN; choice <= RIG_GUARDIAN_STOP;
         choice++) {
        const bool stops = choice == RIG_GUARDIAN_STOP;
        const struct controller *controller = &machine.controller;

        open_rig("examples/odrive/rig.yaml");
        rig.guardian = (enum rig_guardian)choice;
        guarded_ticks(SECOND, true);
        assert_int_equal(controller->state, CONTROLLER_MOVING);
        guarded_ticks(SECOND, false);
        assert_int_equal(machine.sight.lost, 1);
        assert_true(machine.sight.is_gone);
        assert_int_equal(controller->fault.fault,
                         stops ? CONTROLLER_FAULT_GUARDIAN
                               : CONTROLLER_FAULT_NONE);
        assert_int_equal(controller->state,
                         stops ? CONTROLLER_STOPPING : CONTROLLER_MOVING);
        if (stops) {
            way_out.phase = SHUTDOWN_DONE; /* a service stays */
            for (int i = 0; i < 5000; i++)
                tick();
            assert_false(has_torque());
            (void)controller_reset(&machine.controller);
            for (int i = 0; i < 5000; i++)
                tick();
            assert_int_equal(controller->state, CONTROLLER_FAULT);
        }
        (void)close_rig(NULL);
    }
}

/* ---- a thread that ends the program -------------------------------------- */

/* What its end is like, of a child that says it through a pipe. */
struct end {
    bool torque;
    double moved_at; /* counts/s when it was told to stop, */
    double cut_at;   /* and when its torque went */
    int phases;      /* of the way out, a bit each */
};

static double speed(void)
{
    const struct sim_servo *servo = sim.servo[0];

    return fabs((double)servo->plant.vel_q24 / (1 << 24));
}

static void *end_program(void *how)
{
    const struct timespec pause = { .tv_nsec = 50 * MS };

    nanosleep(&pause, NULL); /* the loop runs */
    if (how == NULL)
        exit(7);
    abort();
}

/* The loop, which nobody has told anything; it ends as the thread ends it. */
static void tick_until_killed(int to, void *how)
{
    const struct timespec moment = { .tv_nsec = 100000 };
    struct end end = { .torque = true };
    pthread_t thread;

    open_rig("examples/odrive/rig.yaml");
    for (int i = 0; i < 2 * SECOND / rig.period_ns; i++)
        (void)step(0);
    assert_int_equal(pthread_create(&thread, NULL, end_program, how), 0);
    for (bool is_over = false; !is_over;) {
        const bool torque = has_torque();
        const double was = speed();

        nanosleep(&moment, NULL);
        if (way_out.phase == SHUTDOWN_NONE)
            end.moved_at = was;
        is_over = step(0);
        end.phases |= 1 << way_out.phase;
        if (torque && !has_torque())
            end.cut_at = was;
        end.torque = has_torque();
        if (is_over)
            (void)!write(to, &end, sizeof end);
    }
    for (;;)
        pause();
}

static void ends(void *how, bool is_abort)
{
    struct end end;
    int pipes[2], status;

    assert_int_equal(pipe(pipes), 0);
    fflush(NULL);
    const pid_t child = fork();
    if (child == 0) {
        alarm(60);
        tick_until_killed(pipes[1], how);
    }
    close(pipes[1]);
    assert_int_equal(read(pipes[0], &end, sizeof end), sizeof end);
    close(pipes[0]);
    assert_int_equal(waitpid(child, &status, 0), child);
    print_message("%s: %g counts/s when it was told, %g when torque went\n",
                  is_abort ? "abort" : "exit", end.moved_at, end.cut_at);
    if (is_abort)
        assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT);
    else
        assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 7);
    assert_false(end.torque);
    assert_true(end.moved_at > 1000 && end.cut_at < end.moved_at / 100);
    assert_int_equal(end.phases & (1 << SHUTDOWN_REST | 1 << SHUTDOWN_QUICK),
                     1 << SHUTDOWN_REST);
}

static void a_thread_that_exits_or_aborts_waits_for_the_stop(void **state)
{
    (void)state;
    ends(NULL, false);
    ends(&page, true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(
            only_a_second_signal_that_is_meant_ends_the_tries, close_rig),
        cmocka_unit_test_teardown(one_that_answers_again_is_switched_off,
                                  close_rig),
        cmocka_unit_test_teardown(one_that_does_not_switch_off_is_tried_on,
                                  close_rig),
        cmocka_unit_test_teardown(
            of_a_simulated_machine_it_is_said_after_its_time, close_rig),
        cmocka_unit_test_teardown(without_a_guardian_a_rig_stops_if_it_says_so,
                                  close_rig),
        cmocka_unit_test_teardown(
            a_thread_that_exits_or_aborts_waits_for_the_stop, close_rig),
    };

    return cmocka_run_group_tests_name("shutdown", tests, NULL, NULL);
}
