/* tests/hal/drive/cia402/test_cia402_search.c - a node that gives no answer, and
 * what is asked until it does.
 *
 * Another master stops the node (NMT 02) at every turn of its life.  In Stopped
 * it has neither SDO nor PDO, and whatever torque it had: it is found again, is
 * without torque within a bound, and is enabled after a reset.  Two servos that
 * were written apart: slew's own, which obeys 0x6007 when it is stopped, and a
 * strict one (quirk_servo.h), which goes on as it is. */
#include <string.h>

#include "hal/drive/cia402/drive.h"
#include "motion/core/fixed.h"
#include "sim/device/cia402/parts.h"
#include "tests/hal/canopen/canopen_bench.h"
#include "tests/hal/drive/cia402/quirk_servo.h"

#define ONE  MOTION_FIXED_ONE_Q32
#define NODE 5
#define AXES 2
#define KEY  QUIRK_KEY

#define STOPPED         0x02
#define PRE_OPERATIONAL 0x80

enum maker { OURS, STRICT, MAKERS };
static const char *const makers[MAKERS] = { "ours", "strict" };

/* What the master's commands were, and what the node has sent while Stopped. */
struct ear {
    struct sim_can_port port;
    unsigned count;
    uint8_t command[64];
    bool is_stopped;  /* by us, until the master says something else, */
    int64_t since_ns; /* and what was on its way is over */
    unsigned said_stopped;
};

static struct bench {
    enum maker maker;
    unsigned axes;
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port port, other;
    struct ear ear;
    struct quirk_kind kind[AXES];
    struct quirk_servo strict[AXES];
    struct sim_cia402 ours;
    struct canopen master;
    struct drive_cia402 drive[AXES];
    struct hal_drive_feedback seen[AXES];
} bench;

static void ear_hear(void *context, const struct hal_can_frame *frame)
{
    struct ear *ear = context;

    if (frame->id == 0 && ear->count < ARRAY_LEN(ear->command)) {
        ear->command[ear->count++] = frame->data[0];
        ear->is_stopped = frame->data[0] == STOPPED;
        ear->since_ns = frame->t_ns;
    } else if (ear->is_stopped && frame->t_ns - ear->since_ns > MS &&
               (frame->id & 0x7F) == NODE &&
               frame->id >> 7 != 0xE /* heartbeat */ &&
               frame->id >> 7 != 0xC /* our request */ &&
               frame->id >> 7 != 0x4 && frame->id >> 7 != 0x6 /* our PDO */) {
        ear->said_stopped++;
    }
}

static void bench_servo(struct bench *b)
{
    const struct sim_cia402_config config = {
        .plant = CANOPEN_BENCH_PLANT,
        .node_id = NODE,
        .start_counts = 123456,
        .loop_ns = 250000,
        .brake_release_ns = 20 * MS,
        .boot_ns = 30 * MS,
    };

    if (b->maker == OURS)
        assert_int_equal(sim_cia402_init(&b->ours, &b->bus, &config), 0);
    for (unsigned i = 0; b->maker == STRICT && i < b->axes; i++)
        assert_int_equal(
            quirk_servo_init(&b->strict[i], &b->bus, NODE, &b->kind[i]), 0);
}

static void bench_drives(struct bench *b,
                         const struct drive_cia402_config *given)
{
    for (unsigned i = 0; i < b->axes; i++) {
        struct drive_cia402_config config = *given;

        config.node_id = NODE;
        config.axis = (uint8_t)i;
        config.counts_num = 1000;
        config.counts_den = 1;
        config.sync_period_ns = MS;
        config.following_error_counts = 5000;
        config.quick_stop_counts_s2 = 2000000;
        if (i > 0)
            config.pdo = (struct drive_cia402_pdos){ .rpdo_id = { 0x405 },
                                                     .tpdo_id = { 0x385 } };
        assert_int_equal(drive_cia402_init(&b->drive[i], &b->master, &config),
                         0);
    }
}

static const struct drive_cia402_config plain = { .following_error_ms = 2 };

static void bench_of(enum maker maker, const struct quirk_kind *kind,
                     unsigned axes, const struct drive_cia402_config *config)
{
    static const struct canopen_config master = CANOPEN_BENCH_MASTER;
    struct bench *b = &bench;

    memset(b, 0, sizeof *b);
    b->maker = maker;
    b->axes = axes;
    for (unsigned i = 0; i < axes; i++) {
        b->kind[i] = *kind;
        b->kind[i].axes = (uint8_t)(axes > 1 ? axes : 0);
        b->kind[i].axis = (uint8_t)i;
    }
    canopen_bench_wire(&b->world, &b->bus, &b->port);
    sim_can_port_init(&b->other, &b->bus);
    sim_can_port_init(&b->ear.port, &b->bus);
    b->ear.port.on_frame = ear_hear;
    b->ear.port.context = &b->ear;
    assert_int_equal(canopen_init(&b->master, &b->port.can, &master), 0);
    bench_servo(b);
    bench_drives(b, config);
}

static void tick(void)
{
    struct bench *b = &bench;

    sim_world_run(&b->world, b->world.now_ns + MS);
    (void)hal_fieldbus_begin(&b->master.fieldbus, b->world.now_ns);
    for (unsigned i = 0; i < b->axes; i++)
        hal_drive_feedback(&b->drive[i].drive, &b->seen[i]);
    hal_fieldbus_end(&b->master.fieldbus, b->world.now_ns);
}

static void ticks(unsigned count)
{
    while (count-- > 0)
        tick();
}

static void command(uint8_t what)
{
    const struct hal_can_frame frame = { .len = 2, .data = { what, NODE } };

    assert_int_equal(hal_can_send(&bench.other.can, &frame), 0);
}

static unsigned commands(uint8_t what)
{
    unsigned count = 0;

    for (unsigned i = 0; i < bench.ear.count; i++)
        count += bench.ear.command[i] == what;
    return count;
}

static bool until(enum hal_drive_state state, unsigned most)
{
    while (most-- > 0 && bench.seen[0].state != state)
        tick();
    return bench.seen[0].state == state;
}

static void request(enum hal_drive_request what)
{
    for (unsigned i = 0; i < bench.axes; i++)
        hal_drive_request(&bench.drive[i].drive, what);
}

/* By the servo itself. */
static bool has_torque(void)
{
    if (bench.maker == STRICT)
        return bench.strict[0].state == QUIRK_OPERATION ||
               bench.strict[0].state == QUIRK_QUICK_STOP;
    return bench.ours.power >= CIA402_POWER_ENABLED &&
           bench.ours.power <= CIA402_POWER_REACTION;
}

static bool is_stopped(void)
{
    return bench.maker == STRICT ? bench.strict[0].nmt == 4
                                 : bench.ours.nmt_state == CIA402_NMT_STOPPED;
}

static bool is_enabled(unsigned most)
{
    request(HAL_DRIVE_REQUEST_ENABLE);
    return until(HAL_DRIVE_ENABLED, most);
}

/* ---- the node is stopped --------------------------------------------------- */

/* Set points of 20 units/s. */
static void move(unsigned count)
{
    const int64_t from_q32 = bench.seen[0].pos_q32;

    for (unsigned i = 0; i < count; i++) {
        const struct hal_drive_target target = { .pos_q32 =
                                                     from_q32 + i * ONE / 50 };

        (void)hal_drive_set_target(&bench.drive[0].drive, &target);
        tick();
    }
}

static void boots(void)
{
    ticks(60);
}

static void is_found(void)
{
    assert_true(until(HAL_DRIVE_OFF, 3000));
}

static void is_up(void)
{
    is_found();
    assert_true(is_enabled(1000));
    ticks(10);
}

static void goes(void)
{
    is_up();
    move(100);
}

static void one_that_is_stopped_is_found_and_used_again(void **state)
{
    static const struct {
        const char *when;
        void (*live)(void);
        bool is_search, has_torque;
    } rows[] = {
        { "before it is looked for", boots, true, false },
        { "while it is off", is_found, false, false },
        { "while it stands with torque", is_up, false, true },
        { "in motion", goes, false, true },
    };

    (void)state;
    for (enum maker maker = OURS; maker < MAKERS; maker++)
        for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
            unsigned lost = 0, off = 0;

            bench_of(maker, &(struct quirk_kind){ .boot_ns = 0 }, 1, &plain);
            if (rows[i].is_search)
                sim_can_port_set_off(&bench.port, true);
            rows[i].live();
            assert_int_equal(has_torque(), rows[i].has_torque);
            command(STOPPED);
            if (rows[i].is_search) {
                ticks(5);
                sim_can_port_set_off(&bench.port, false);
            }
            while (!rows[i].is_search && lost < 100 &&
                   bench.seen[0].state != HAL_DRIVE_OFFLINE) {
                tick();
                lost++;
            }
            assert_in_range(lost, 0, 10);
            request(HAL_DRIVE_REQUEST_OFF);
            while (off < 2000 && (has_torque() || !bench.seen[0].torque_off)) {
                if (rows[i].is_search && bench.seen[0].state == HAL_DRIVE_OFF)
                    break;
                tick();
                off++;
            }
            print_message("%s, stopped %s: lost after %u ms, confirmed off "
                          "after %u ms more: %s\n",
                          makers[maker], rows[i].when, lost, off,
                          bench.seen[0].fault_text);
            assert_in_range(off, 0, 1999);
            assert_false(has_torque());
            assert_int_equal(bench.ear.said_stopped, 0);
            assert_true(commands(PRE_OPERATIONAL) > 0);
            request(HAL_DRIVE_REQUEST_RESET);
            assert_true(until(HAL_DRIVE_OFF, 3000));
            assert_true(is_enabled(1000));
            move(50);
            assert_true(bench.seen[0].following);
        }
}

/* In the middle of the search, row by row: every 7 ms of it. */
static void a_search_that_is_stopped_goes_on(void **state)
{
    (void)state;
    for (enum maker maker = OURS; maker < MAKERS; maker++) {
        unsigned worst = 0, length = 0;

        bench_of(maker, &(struct quirk_kind){ .boot_ns = 0 }, 1, &plain);
        while (bench.seen[0].state != HAL_DRIVE_OFF && length++ < 3000)
            tick();
        for (unsigned at = 1; at < length; at += 7) {
            unsigned took = 0;

            bench_of(maker, &(struct quirk_kind){ .boot_ns = 0 }, 1, &plain);
            ticks(at);
            command(STOPPED);
            ticks(2);
            bench.ear.is_stopped = is_stopped(); /* or it boots */
            while (took < 8000 && bench.seen[0].state != HAL_DRIVE_OFF) {
                tick();
                took++;
                if (bench.drive[0].phase == DRIVE_CIA402_LOST)
                    request(HAL_DRIVE_REQUEST_RESET);
            }
            if (took >= 8000)
                fail_msg("%s, stopped at %u ms: %s", makers[maker], at,
                         bench.seen[0].fault_text);
            worst = took > worst ? took : worst;
            assert_int_equal(bench.ear.said_stopped, 0);
        }
        print_message("%s: a search of %u ms, %u ms at most when it was "
                      "stopped in it\n",
                      makers[maker], length, worst);
    }
}

/* Its heartbeat is enough: no time-out is waited for. */
static void one_that_says_that_it_is_stopped_is_told_at_once(void **state)
{
    (void)state;
    for (enum maker maker = OURS; maker < MAKERS; maker++) {
        struct drive_cia402_config config = plain;

        config.sdo_timeout_ns = 10000 * MS;
        bench_of(maker, &(struct quirk_kind){ .boot_ns = 0 }, 1, &config);
        goes();
        command(STOPPED);
        ticks(200);
        assert_true(commands(PRE_OPERATIONAL) > 1); /* the search's first */
        assert_false(is_stopped());
        for (unsigned i = 0; i < 600 && !bench.seen[0].torque_off; i++)
            tick();
        assert_true(bench.seen[0].torque_off);
        request(HAL_DRIVE_REQUEST_RESET);
        assert_true(until(HAL_DRIVE_OFF, 1000));
    }
}

/* 0x1029: it stops itself when it does not hear us, and with guarding it has no
 * heartbeat that tells. */
static void one_that_stops_itself_is_found_again(void **state)
{
    static const struct quirk_kind kinds[] = {
        { .stops_alone = true },
        { .stops_alone = true, .guarding = true },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(kinds); i++) {
        struct drive_cia402_config config = plain;

        config.guard_period_ns = kinds[i].guarding ? 20 * MS : 0;
        bench_of(STRICT, &kinds[i], 1, &config);
        goes();
        sim_can_port_set_off(&bench.port, true); /* our cable */
        ticks(300);
        assert_int_equal(bench.strict[0].nmt, 4);
        assert_false(has_torque());
        sim_can_port_set_off(&bench.port, false);
        ticks(1000);
        assert_true(bench.seen[0].torque_off);
        request(HAL_DRIVE_REQUEST_RESET);
        assert_true(until(HAL_DRIVE_OFF, 3000));
        assert_true(is_enabled(1000));
    }
}

/* One that hears nothing but a reset is reset where the rig says so, once in a
 * search. */
static void a_reset_is_sent_where_the_rig_wants_it(void **state)
{
    static const struct {
        enum canopen_nmt_command by, given;
        bool is_found;
    } rows[] = {
        { CANOPEN_NMT_PRE_OPERATIONAL, 0, true },
        { CANOPEN_NMT_RESET_COMMUNICATION, 0, false },
        { CANOPEN_NMT_RESET_COMMUNICATION, CANOPEN_NMT_RESET_COMMUNICATION,
          true },
        { CANOPEN_NMT_RESET_NODE, CANOPEN_NMT_RESET_NODE, true },
        { CANOPEN_NMT_RESET_NODE, CANOPEN_NMT_RESET_COMMUNICATION, false },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct quirk_kind kind = { .wakes_by = (uint8_t)rows[i].by };
        struct drive_cia402_config config = plain;
        unsigned resets;

        config.nmt_reset = rows[i].given;
        bench_of(STRICT, &kind, 1, &config);
        is_found();
        command(STOPPED);
        ticks(50);
        request(HAL_DRIVE_REQUEST_RESET);
        assert_int_equal(until(HAL_DRIVE_OFF, 5000), rows[i].is_found);
        resets = commands(CANOPEN_NMT_RESET_NODE) +
                 commands(CANOPEN_NMT_RESET_COMMUNICATION);
        assert_int_equal(resets, rows[i].given != 0 &&
                                     rows[i].by != CANOPEN_NMT_PRE_OPERATIONAL);
        if (!rows[i].is_found)
            assert_non_null(strstr(bench.seen[0].fault_text,
                                   "does not answer for 200 ms, object "
                                   "0x1000, NMT 04"));
    }
}

static void a_start_that_is_not_heard_is_sent_again(void **state)
{
    (void)state;
    for (unsigned ignored = 0; ignored < 4; ignored++) {
        bench_of(STRICT, &(struct quirk_kind){ .starts_ignored = ignored }, 1,
                 &plain);
        is_found();
        assert_int_equal(commands(CANOPEN_NMT_START), ignored + 1);
    }
    bench_of(STRICT, &(struct quirk_kind){ .starts_ignored = 1000 }, 1, &plain);
    assert_false(until(HAL_DRIVE_OFF, 5000));
    assert_non_null(strstr(bench.seen[0].fault_text,
                           "no heartbeat shows the requested NMT state"));
}

/* One that comes no further than its boot-up message is found once it does. */
static void one_that_boots_again_and_again_is_found_in_the_end(void **state)
{
    const struct hal_can_frame boot_up = { .id = 0x700 + NODE, .len = 1 };

    (void)state;
    bench_of(STRICT, &(struct quirk_kind){ .boot_ns = 0 }, 1, &plain);
    for (unsigned i = 0; i < 200; i++) {
        assert_int_equal(hal_can_send(&bench.other.can, &boot_up), 0);
        ticks(15);
        assert_int_equal(bench.seen[0].state, HAL_DRIVE_OFFLINE);
    }
    assert_true(until(HAL_DRIVE_OFF, 1000));
    assert_true(is_enabled(1000));
}

/* ---- it refuses ------------------------------------------------------------ */

static void an_abort_for_the_time_being_is_tried_again(void **state)
{
    static const struct {
        uint32_t abort;
        bool passes;
    } codes[] = {
        { 0x05040000, true },  /* protocol timed out */
        { 0x06060000, true },  /* hardware error */
        { 0x08000021, true },  /* local control */
        { 0x08000022, true },  /* present device state */
        { 0x06010000, false }, /* access */
        { 0x06090030, false }, /* value */
        { 0x08000000, false }, /* general */
    };
    static const uint32_t keys[] = { KEY(0x1000, 0), KEY(0x6040, 0),
                                     KEY(0x6007, 0), KEY(0x1800, 2) };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(codes); i++)
        for (size_t k = 0; k < ARRAY_LEN(keys); k++)
            for (unsigned times = 1; times <= 3; times++) {
                const struct quirk_kind kind = {
                    .passing = { keys[k], codes[i].abort, times }
                };
                const bool is_match = keys[k] == KEY(0x1800, 2);
                const bool at_once =
                    (codes[i].passes && times < 3) || (is_match && times == 1);

                bench_of(STRICT, &kind, 1, &plain);
                if (until(HAL_DRIVE_OFF, 1500) != at_once && !is_match)
                    fail_msg("%08X of %06X, %u times: %s", codes[i].abort,
                             keys[k], times, bench.seen[0].fault_text);
                if (!at_once)
                    assert_int_equal(bench.seen[0].state,
                                     is_match ? (int)bench.seen[0].state
                                              : HAL_DRIVE_FAULT);
                /* and once it takes it, a reset is all it needs */
                for (unsigned again = 0;
                     again < 3 && bench.seen[0].state != HAL_DRIVE_OFF;
                     again++) {
                    request(HAL_DRIVE_REQUEST_RESET);
                    (void)until(HAL_DRIVE_OFF, 1500);
                }
                if (bench.seen[0].state != HAL_DRIVE_OFF)
                    fail_msg("%08X of %06X, %u times, after resets: %s",
                             codes[i].abort, keys[k], times,
                             bench.seen[0].fault_text);
            }
}

/* ---- what it says of its torque -------------------------------------------- */

/* No TPDO any more: it is asked by SDO, and believed. */
static void torque_is_confirmed_off_by_sdo(void **state)
{
    (void)state;
    bench_of(STRICT, &(struct quirk_kind){ .boot_ns = 0 }, 1, &plain);
    goes();
    bench.strict[0].muted = true;
    ticks(20);
    assert_int_equal(bench.seen[0].state, HAL_DRIVE_OFFLINE);
    assert_false(bench.seen[0].torque_off);
    request(HAL_DRIVE_REQUEST_OFF);
    for (unsigned i = 0; i < 5000 && !bench.seen[0].torque_off; i++)
        tick();
    assert_true(bench.seen[0].torque_off);
    assert_false(has_torque());
    /* nothing at all is no word of it */
    bench.strict[0].deaf = true;
    ticks(800);
    assert_false(bench.seen[0].torque_off);
}

static void one_that_refuses_is_asked_all_the_same(void **state)
{
    const struct quirk_kind kind = {
        .refuses = { { KEY(0x6502, 0), 0x06020000 },
                     { KEY(0x6060, 0), 0x06010002 } },
    };

    (void)state;
    bench_of(STRICT, &kind, 1, &plain);
    assert_true(until(HAL_DRIVE_FAULT, 3000));
    request(HAL_DRIVE_REQUEST_OFF);
    for (unsigned i = 0; i < 5000 && !bench.seen[0].torque_off; i++)
        tick();
    assert_true(bench.seen[0].torque_off);
}

/* An axis of it that is lost takes no other out of operation. */
static void a_sibling_in_operation_is_left_alone(void **state)
{
    (void)state;
    for (unsigned lost = 0; lost < AXES; lost++) {
        const unsigned other = 1 - lost;

        bench_of(STRICT, &(struct quirk_kind){ .boot_ns = 0 }, 2, &plain);
        for (unsigned i = 0;
             i < 5000 && (bench.seen[0].state != HAL_DRIVE_OFF ||
                          bench.seen[1].state != HAL_DRIVE_OFF);
             i++)
            tick();
        assert_true(is_enabled(1000));
        ticks(100);
        assert_int_equal(bench.seen[1].state, HAL_DRIVE_ENABLED);
        bench.ear.count = 0;
        bench.strict[lost].muted = bench.strict[lost].deaf = true;
        ticks(2000);
        assert_int_equal(bench.seen[lost].state, HAL_DRIVE_OFFLINE);
        assert_int_equal(bench.seen[other].state, HAL_DRIVE_ENABLED);
        assert_int_equal(bench.ear.count, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_that_is_stopped_is_found_and_used_again),
        cmocka_unit_test(a_search_that_is_stopped_goes_on),
        cmocka_unit_test(one_that_says_that_it_is_stopped_is_told_at_once),
        cmocka_unit_test(one_that_stops_itself_is_found_again),
        cmocka_unit_test(a_reset_is_sent_where_the_rig_wants_it),
        cmocka_unit_test(a_start_that_is_not_heard_is_sent_again),
        cmocka_unit_test(one_that_boots_again_and_again_is_found_in_the_end),
        cmocka_unit_test(an_abort_for_the_time_being_is_tried_again),
        cmocka_unit_test(torque_is_confirmed_off_by_sdo),
        cmocka_unit_test(one_that_refuses_is_asked_all_the_same),
        cmocka_unit_test(a_sibling_in_operation_is_left_alone),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
