/* tests/hal/drive/slew_mcu/test_drive_slew_mcu.c - axes of boards beside axes of
 * the PC: the driver, the controller and the board's own program on a simulated
 * line. */
#include <stdlib.h>
#include <string.h>

#include "firmware/control/arm.h"
#include "firmware/control/parts.h"
#include "firmware/linux/kind/slew_mcu/board_sim.h"
#include "hal/drive/slew_mcu/drive.h"
#include "hal/drive/virtual/drive.h"
#include "hal/modbus/master.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define ONE    (INT64_C(1) << 32)
#define MS     INT64_C(1000000)
#define AXES   4 /* 0, 1: of the board; 2: of another; 3: the PC's own */
#define BOARDS 2
#define LONG   300 /* segments: more than a board's window holds */

static const struct modbus_rtu_line wire = { .baud = 115200,
                                             .parity = MODBUS_PARITY_NONE,
                                             .stop_bits = 1 };

struct bench {
    struct sim_world world;
    struct sim_modbus_line line;
    struct modbus_master master;
    struct sim_modbus_seat seat;
    struct modbus_bus bus;
    struct board_sim board[BOARDS];
    struct drive_slew_mcu drive[AXES - 1];
    struct drive_virtual_bus nearby;
    struct drive_virtual own;
    struct controller_axis_config config[AXES];
    struct controller_axis axis[AXES];
    struct controller controller;
    struct playback playback;
    struct playback_axis playback_axis[AXES];
    struct motion_segment segment[AXES][LONG];
    struct motion_track track[AXES];
    int64_t now_ns;
    /* of every tick of the move on the PC: its set points */
    int64_t sent[AXES][20000];
    unsigned rows;
    int64_t most_q32; /* following error of the boards' axes */
};
static struct bench *bench;

static int64_t jerk_q32; /* of all axes; 0: no limit */
static int slow = -1;    /* this axis brakes a thousand times slower */

static void tick(void)
{
    struct controller *controller = &bench->controller;
    struct hal_fieldbus_worst worst = { HAL_FIELDBUS_GOOD, 0 };
    const bool moved = controller->state == CONTROLLER_MOVING ||
                       (controller->state == CONTROLLER_HOLDING &&
                        bench->playback.arm == PLAYBACK_RUNNING);

    bench->now_ns += MS;
    sim_world_run(&bench->world, bench->now_ns);
    worst.health = hal_fieldbus_begin(&bench->bus.fieldbus, bench->now_ns);
    (void)hal_fieldbus_begin(&bench->nearby.fieldbus, bench->now_ns);
    controller_step(controller, bench->now_ns, worst);
    if (moved && controller->reaction == CONTROLLER_REACT_NONE &&
        bench->playback.state == PLAYBACK_PLAYING && bench->rows < 20000) {
        for (unsigned i = 0; i < AXES; i++)
            bench->sent[i][bench->rows] = bench->axis[i].target.pos_q32;
        bench->rows++;
    }
    for (unsigned i = 0; i < AXES - 1; i++)
        if (llabs(bench->axis[i].following_q32) > bench->most_q32)
            bench->most_q32 = llabs(bench->axis[i].following_q32);
    playback_step(&bench->playback);
    hal_fieldbus_end(&bench->bus.fieldbus, bench->now_ns);
}

static bool comes(enum controller_state state, unsigned ticks)
{
    for (unsigned i = 0; i < ticks; i++) {
        tick();
        if (bench->controller.state == state)
            return true;
    }
    return false;
}

static void set_up_axis(unsigned i)
{
    bench->config[i] = (struct controller_axis_config){
        .pos_min_q32 = -1000 * ONE,
        .pos_max_q32 = 1000 * ONE,
        .limit = { 400 * ONE, 40000 * ONE, jerk_q32 },
        .stop = { 400 * ONE, 80000 * ONE, 2 * jerk_q32 },
        .following_floor_q32 = ONE,
        .following_k_ns = 20 * MS,
        .feedback_max_age_ns = 500 * MS,
    };
    if ((int)i == slow)
        bench->config[i].limit.acc_q32 = bench->config[i].stop.acc_q32 =
            40 * ONE;
}

static struct drive_slew_mcu_config drive_config(unsigned i)
{
    const struct controller_axis_config *own = &bench->config[i];

    return (struct drive_slew_mcu_config){
        .unit = i < 2 ? 1 : 2,
        .axis = i < 2 ? i : 0,
        .setup = { .pos_min_q32 = own->pos_min_q32,
                   .pos_max_q32 = own->pos_max_q32,
                   .vel_q32 = own->limit.vel_q32,
                   .acc_q32 = own->limit.acc_q32,
                   .jerk_q32 = own->limit.jerk_q32,
                   .stop_vel_q32 = own->stop.vel_q32,
                   .stop_acc_q32 = own->stop.acc_q32,
                   .stop_jerk_q32 = own->stop.jerk_q32,
                   .following_floor_q32 = ONE,
                   .pos_q32 = (int64_t)i * ONE },
        .watch_ms = 400,
        .lead_ns = 300 * MS,
    };
}

static void set_up(void)
{
    const struct modbus_master_config master = { .line = wire,
                                                 .timeout_ns = 20 * MS };
    struct controller_config config = { .period_ns = MS, .axis_count = AXES };
    struct hal_drive *drive[AXES];

    free(bench);
    bench = calloc(1, sizeof *bench);
    assert_non_null(bench);
    bench->now_ns = 1000 * MS;
    sim_world_init(&bench->world, bench->now_ns);
    assert_int_equal(sim_modbus_line_init(&bench->line, &bench->world, &wire),
                     MOTION_OK);
    assert_int_equal(modbus_master_init(&bench->master, &master), MOTION_OK);
    assert_int_equal(sim_modbus_seat_init(&bench->seat, &bench->line,
                                          &bench->master.station),
                     MOTION_OK);
    assert_int_equal(modbus_bus_init(&bench->bus, &bench->master.modbus, 2),
                     MOTION_OK);
    for (unsigned i = 0; i < BOARDS; i++)
        assert_int_equal(board_sim_init(&bench->board[i], &bench->world,
                                        &bench->line, (uint8_t)(i + 1), &wire),
                         MOTION_OK);
    for (unsigned i = 0; i < AXES; i++)
        set_up_axis(i);
    for (unsigned i = 0; i < AXES - 1; i++) {
        const struct drive_slew_mcu_config own = drive_config(i);
        assert_int_equal(drive_slew_mcu_init(&bench->drive[i], &bench->bus,
                                             i == 1 ? &bench->drive[0] : NULL,
                                             &own),
                         MOTION_OK);
        drive[i] = &bench->drive[i].drive;
    }
    drive_virtual_bus_init(&bench->nearby);
    drive_virtual_init(&bench->own, &bench->nearby, 3 * ONE);
    drive[AXES - 1] = &bench->own.drive;
    config.axis = bench->config;
    assert_int_equal(
        controller_init(&bench->controller, &config, bench->axis, drive, NULL),
        MOTION_OK);
    playback_init(&bench->playback, &bench->controller, NULL,
                  bench->playback_axis);
}

/* Axis i goes from `i` units to so many more and back, in `count` segments. */
static void make_move(unsigned count, int64_t ms)
{
    const struct motion_track *track[AXES];

    for (unsigned i = 0; i < AXES; i++) {
        struct motion_state from = { .pos_q32 = (int64_t)i * ONE };
        motion_track_init(&bench->track[i], bench->segment[i], LONG,
                          from.pos_q32);
        for (unsigned k = 0; k < count; k++) {
            struct motion_state to = {
                .pos_q32 = (int64_t)(i + (k + 1 == count ? 0 : k % 7)) * ONE
            };
            assert_int_equal(motion_track_append_quintic(
                                 &bench->track[i], (ms * MS) << 12, &from, &to),
                             MOTION_OK);
            from = to;
        }
        track[i] = &bench->track[i];
    }
    assert_int_equal(playback_load(&bench->playback, track), MOTION_OK);
}

static void get_ready(void)
{
    for (unsigned i = 0; i < 300; i++)
        tick(); /* they are found */
    assert_int_equal(controller_enable(&bench->controller), MOTION_OK);
    assert_true(comes(CONTROLLER_READY, 2000));
}

/* The log of each board is what the PC sent, tick for tick, to the bit. */
static void boards_did_the_same(void)
{
    for (unsigned i = 0; i < 5; i++)
        tick(); /* a board's last tick is in its own time */
    for (unsigned b = 0; b < BOARDS; b++) {
        const struct mcu_unit *unit = &bench->board[b].unit;
        const uint32_t first = mcu_log_first(&unit->log);
        assert_int_equal(unit->log.next, bench->rows);
        for (uint32_t n = first; n < unit->log.next; n++) {
            const int64_t *entry = mcu_log_entry(&unit->log, n);
            for (unsigned i = 0; i < unit->axis_count; i++)
                if (entry[1 + i] != bench->sent[b == 0 ? i : 2][n])
                    fail_msg("board %u, tick %u, axis %u", b, n, i);
        }
    }
}

static void a_move_is_the_same_on_boards_and_begins_together(void **state)
{
    (void)state;
    set_up();
    get_ready();
    make_move(20, 200);
    assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 3000));
    assert_true(comes(CONTROLLER_READY, 5000));
    assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
    assert_int_equal(bench->rows, 4000);
    boards_did_the_same();
    /* the first tick of each, on the PC's clock, and the PC's own */
    for (unsigned b = 0; b < BOARDS; b++) {
        const struct board_sim *board = &bench->board[b];
        const int64_t began_ns =
            board->begin_ns + (int64_t)board->unit.began * BOARD_SIM_TICK;
        assert_true(llabs(began_ns - bench->playback.start_ns - MS) <= MS);
    }
    /* 6 units in 200 ms: 56 units/s at most, a tick is 0.06 units */
    assert_true(bench->most_q32 < ONE / 4);
}

static void a_move_longer_than_the_window_streams(void **state)
{
    (void)state;
    set_up();
    get_ready();
    make_move(LONG, 60);
    assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 20000));
    assert_true(comes(CONTROLLER_READY, 20000));
    assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
    assert_int_equal(bench->rows, 18000);
    boards_did_the_same();
}

/* --- clocks that go at other speeds --- */

/* How much later than by our clock its next tick comes. */
static int64_t behind_ns(const struct board_sim *board)
{
    return board->due_ps / 1000 - (board->ticks + 1) * BOARD_SIM_TICK;
}

/* The last ticks that a board has in its log are those of its tracks. */
static void logs_are_the_tracks(void)
{
    for (unsigned b = 0; b < BOARDS; b++) {
        const struct mcu_unit *unit = &bench->board[b].unit;
        for (unsigned i = 0; i < unit->axis_count; i++) {
            struct motion_cursor cursor = { 0 };
            for (uint32_t n = mcu_log_first(&unit->log); n < unit->log.next;
                 n++) {
                const int64_t *entry = mcu_log_entry(&unit->log, n);
                struct motion_sample sample;
                motion_track_sample(&bench->track[b == 0 ? i : 2], &cursor,
                                    entry[0] * MOTION_FIXED_NS_Q12, &sample);
                assert_int_equal(entry[1 + i], sample.pos_q32);
            }
        }
    }
}

/* A move of 5 min, with oscillators that are off by so much. */
static int64_t most_apart_ns(const int32_t off_ppb[BOARDS])
{
    int64_t from_ns[BOARDS], most_ns = 0;
    set_up();
    for (unsigned b = 0; b < BOARDS; b++)
        bench->board[b].off_ppb = off_ppb[b];
    get_ready();
    make_move(LONG, 1000);
    assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 20000));
    for (unsigned b = 0; b < BOARDS; b++)
        from_ns[b] = behind_ns(&bench->board[b]);
    while (bench->controller.state == CONTROLLER_MOVING) {
        tick();
        for (unsigned b = 0; b < BOARDS; b++) {
            const int64_t ns = llabs(behind_ns(&bench->board[b]) - from_ns[b]);
            most_ns = ns > most_ns ? ns : most_ns;
        }
    }
    assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
    assert_int_equal(bench->controller.state, CONTROLLER_READY);
    for (unsigned i = 0; i < 5; i++)
        tick(); /* a board's last tick is in its own time */
    for (unsigned b = 0; b < BOARDS; b++)
        assert_int_equal(bench->board[b].unit.log.next, LONG * 1000);
    logs_are_the_tracks();
    return most_ns;
}

/* Unsteered they would be 15 ms and 60 ms apart in the end. */
static void clocks_that_differ_stay_together(void **state)
{
    static const struct {
        int32_t off_ppb[BOARDS];
        int64_t most_ns;
    } rows[] = {
        { { 0, 0 }, 100000 },
        { { 50000, -50000 }, 600000 },
        { { -200000, 200000 }, 2000000 },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const int64_t most_ns = most_apart_ns(rows[i].off_ppb);
        print_message("%d ppm: at most %.3f ms apart in 5 min\n",
                      abs(rows[i].off_ppb[0]) / 1000, (double)most_ns / 1e6);
        if (most_ns > rows[i].most_ns)
            fail_msg("above %.3f ms", (double)rows[i].most_ns / 1e6);
    }
}

/* What it needed in the move before it has from the start of the next. */
static void the_next_move_begins_with_what_the_last_needed(void **state)
{
    static const int32_t far[BOARDS] = { -200000, 200000 };
    (void)state;
    (void)most_apart_ns(far);
    assert_true(abs(bench->board[0].unit.clock_ppb - 200000) < 20000);
    for (unsigned i = 0; i < 500; i++)
        tick(); /* the boards say that they are at the end */
    make_move(20, 200);
    assert_int_equal(playback_go(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 20000));
    const int64_t from_ns = behind_ns(&bench->board[0]);
    while (bench->controller.state == CONTROLLER_MOVING)
        tick();
    assert_int_equal(bench->controller.state, CONTROLLER_READY);
    assert_true(llabs(behind_ns(&bench->board[0]) - from_ns) <= MS / 5);
    assert_true(abs(bench->board[0].unit.clock_ppb - 200000) < 40000);
}

static void it_is_played_again_from_where_it_is(void **state)
{
    (void)state;
    set_up();
    get_ready();
    make_move(4, 200);
    assert_int_equal(playback_repeat(&bench->playback, 3, false), MOTION_OK);
    assert_int_equal(playback_repeat(&bench->playback, 2, true), MOTION_E_ARG);
    assert_int_equal(playback_go(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    for (unsigned i = 0; i < 10000 && bench->playback.state != PLAYBACK_IDLE;
         i++)
        tick();
    assert_int_equal(bench->playback.played, 3);
    assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
}

static void an_override_is_the_boards_too(void **state)
{
    (void)state;
    set_up();
    get_ready();
    make_move(10, 200);
    assert_int_equal(playback_override(&bench->playback, INT64_C(1) << 29),
                     MOTION_OK);
    assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 3000));
    tick();
    assert_true(comes(CONTROLLER_READY, 6000));
    assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
    assert_int_equal(bench->rows, 4000);
    boards_did_the_same();
}

/* Also while they move: through the same rates, tick for tick. */
static void an_override_under_way_is_the_boards_too(void **state)
{
    (void)state;
    set_up();
    get_ready();
    make_move(20, 200);
    assert_int_equal(playback_override(&bench->playback, INT64_C(1) << 29),
                     MOTION_OK);
    assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 3000));
    assert_int_equal(playback_override(&bench->playback, INT64_C(3) << 31),
                     MOTION_E_ARG);
    assert_int_equal(playback_override(&bench->playback, 0), MOTION_E_STATE);
    for (int64_t eighths = 5; eighths <= 8; eighths++) {
        for (unsigned i = 0; i < 900; i++)
            tick();
        assert_int_equal(playback_override(&bench->playback, eighths << 27),
                         MOTION_OK);
    }
    assert_true(comes(CONTROLLER_READY, 6000));
    assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
    assert_int_equal(bench->controller.override_q30, INT64_C(1) << 30);
    assert_true(bench->rows < 6900);
    boards_did_the_same();
}

/* The next row before `row` that is another; 0: there is none. */
static unsigned row_before(unsigned b, unsigned row)
{
    const int64_t *const one = bench->sent[b == 0 ? 0 : 2];
    const int64_t *const other = bench->sent[b == 0 ? 1 : 2];
    unsigned at = row;
    while (at > 0 && one[at] == one[row] && other[at] == other[row])
        at--;
    return at;
}

/* The set points in the log of a board are those of the PC, one after the other,
 * from the last one back; how long both stood is left out. */
static void boards_went_the_same_way(void)
{
    for (unsigned b = 0; b < BOARDS; b++) {
        const struct mcu_unit *unit = &bench->board[b].unit;
        const unsigned last = unit->axis_count;
        const int64_t *before = mcu_log_entry(&unit->log, unit->log.next - 1);
        unsigned row = bench->rows - 1;
        for (uint32_t n = unit->log.next; n-- > mcu_log_first(&unit->log);) {
            const int64_t *entry = mcu_log_entry(&unit->log, n);
            if (entry[1] != before[1] || entry[last] != before[last])
                row = row_before(b, row);
            if (entry[1] != bench->sent[b == 0 ? 0 : 2][row] ||
                entry[last] != bench->sent[b == 0 ? 1 : 2][row])
                fail_msg("board %u, entry %u of %u, row %u of %u", b, n,
                         unit->log.next, row, bench->rows);
            before = entry;
        }
    }
}

static bool all_clocks_stand(void)
{
    for (unsigned b = 0; b < BOARDS; b++)
        if (bench->board[b].unit.controller.rate.rate_q30 != 0)
            return false;
    return bench->controller.rate.rate_q30 == 0;
}

/* At one place of the path: every clock says the same time of it. */
static void all_are_at_one_place(void)
{
    for (unsigned i = 0; i < 3000 && !all_clocks_stand(); i++)
        tick();
    for (unsigned i = 0; i < 100; i++)
        tick();
    assert_true(all_clocks_stand());
    assert_int_equal(bench->controller.state, CONTROLLER_HOLDING);
    for (unsigned b = 0; b < BOARDS; b++)
        assert_int_equal(bench->board[b].unit.controller.rate.s_ns_q12,
                         bench->controller.rate.s_ns_q12);
    for (unsigned i = 0; i < AXES - 1; i++)
        assert_int_equal(bench->axis[i].target.pos_q32,
                         bench->board[i / 2].unit.axis[i % 2].target.pos_q32);
}

static bool boards_stand(void)
{
    for (unsigned b = 0; b < BOARDS; b++)
        if (mcu_unit_is_moving(&bench->board[b].unit))
            return false;
    return true;
}

/* What is not as on a good day. */
struct hold_row {
    unsigned from, step; /* ticks of the move before the hold */
    int32_t off_ppb;     /* of one board, the other is off the other way */
    unsigned lost;       /* ticks of the PC, before each hold */
    int64_t jerk_q32;
    bool again; /* held in the ramp of the resume */
};

static void hold_and_resume(const struct hold_row *row, unsigned when)
{
    const int64_t rate_q30 = INT64_C(1) << (when % 2 == 0 ? 29 : 30);
    jerk_q32 = row->jerk_q32;
    set_up();
    bench->board[0].off_ppb = row->off_ppb;
    bench->board[1].off_ppb = -row->off_ppb;
    get_ready();
    make_move(20, 200);
    assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 3000));
    for (unsigned i = 0; i < when; i++)
        tick();
    bench->now_ns += row->lost * MS;
    assert_int_equal(playback_hold(&bench->playback), MOTION_OK);
    assert_int_equal(playback_hold(&bench->playback), MOTION_OK);
    assert_true(comes(CONTROLLER_HOLDING, 1000));
    all_are_at_one_place();
    assert_int_equal(playback_override(&bench->playback, rate_q30), MOTION_OK);
    assert_int_equal(playback_resume(&bench->playback), MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 2000));
    if (row->again && when < 2500) {
        assert_int_equal(playback_hold(&bench->playback), MOTION_OK);
        assert_true(comes(CONTROLLER_HOLDING, 2000));
        all_are_at_one_place();
        assert_int_equal(playback_resume(&bench->playback), MOTION_OK);
        assert_true(comes(CONTROLLER_MOVING, 2000));
    }
    assert_true(comes(CONTROLLER_READY, 12000));
    for (unsigned i = 0; i < 500; i++)
        tick(); /* the boards say that they are at the end */
    assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
    assert_int_equal(bench->playback.state, PLAYBACK_IDLE);
    boards_went_the_same_way();
}

/* Held anywhere and resumed, also slower: the boards' axes are where the PC's
 * clock says at every tick of both ramps, and the move is the whole one. */
static void a_hold_keeps_all_at_one_place_of_the_path(void **state)
{
    static const struct hold_row rows[] = {
        { 1, 331, 0, 0, 0, false },
        { 7, 977, 200000, 0, 0, false },
        { 100, 977, 0, 5, 0, false },
        { 211, 977, -50000, 3, 3000000 * ONE, true },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        for (unsigned when = rows[i].from; when < 3200; when += rows[i].step) {
            hold_and_resume(&rows[i], when);
            /* as in a move without a hold, and what was lost */
            assert_true(bench->most_q32 <
                        ONE / 4 + (int64_t)rows[i].lost * ONE / 16);
        }
    jerk_q32 = 0;
}

/* Too late to begin before the end, it is played to its end. */
static void a_hold_just_before_the_end_is_none(void **state)
{
    (void)state;
    set_up();
    get_ready();
    make_move(10, 100);
    assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 3000));
    for (unsigned i = 0; i < 900; i++)
        tick();
    assert_int_equal(playback_hold(&bench->playback), MOTION_OK);
    assert_true(comes(CONTROLLER_READY, 1000));
    assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
    boards_did_the_same();
}

/* By a limit of its own that the rig does not have: the rig is in fault, and
 * everything at rest. */
static void a_board_that_cannot_follow_is_a_fault_of_the_rig(void **state)
{
    (void)state;
    set_up();
    get_ready();
    make_move(20, 200);
    /* as much as the move needs */
    bench->board[1].unit.axis_config[0].limit.acc_q32 =
        controller_peak(&bench->track[2], MOTION_ACC) + 1;
    assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 3000));
    for (unsigned i = 0; i < 1000; i++)
        tick();
    assert_int_equal(playback_hold(&bench->playback), MOTION_OK);
    assert_true(comes(CONTROLLER_FAULT, 2000));
    assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_DRIVE);
    assert_int_equal(bench->controller.fault.axis, 2);
    assert_string_equal(bench->axis[2].feedback.fault_text,
                        "the board did not follow the rate of the move");
    for (unsigned i = 0; i < 1000; i++)
        tick();
    assert_true(boards_stand());
}

/* Stopped in its middle: all rest, no jump, and the next move begins from where
 * each axis is. */
static void a_stop_stops_all_and_they_go_on_from_there(void **state)
{
    (void)state;
    for (unsigned when = 5; when < 1500; when += 211) {
        set_up();
        get_ready();
        make_move(20, 100);
        assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                         MOTION_OK);
        assert_true(comes(CONTROLLER_MOVING, 3000));
        for (unsigned i = 0; i < when; i++)
            tick();
        controller_stop(&bench->controller);
        assert_true(comes(CONTROLLER_READY, 3000));
        for (unsigned i = 0; i < 300; i++)
            tick();
        assert_true(boards_stand());
        assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
        for (unsigned i = 0; i < 2; i++)
            assert_int_equal(bench->axis[i].target.pos_q32,
                             bench->board[0].unit.axis[i].target.pos_q32);
        bench->rows = 0;
        assert_int_equal(playback_go(&bench->playback, 0, PLAYBACK_PLAY),
                         MOTION_OK);
        for (unsigned i = 0;
             i < 20000 && bench->playback.state != PLAYBACK_IDLE; i++)
            tick();
        assert_int_equal(bench->playback.played, 1);
        assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
        boards_did_the_same();
    }
}

/* What it cannot be repeated as was asked for before it was loaded. */
static void a_move_that_is_loaded_later_is_played_once(void **state)
{
    (void)state;
    set_up();
    get_ready();
    assert_int_equal(playback_repeat(&bench->playback, 0, true), MOTION_OK);
    make_move(4, 200);
    assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 3000));
    assert_true(comes(CONTROLLER_READY, 3000));
    for (unsigned i = 0; i < 500; i++)
        tick();
    assert_int_equal(bench->controller.state, CONTROLLER_READY);
    assert_int_equal(bench->playback.played, 1);
    assert_int_equal(bench->playback.err, MOTION_OK);
}

/* Until READY no drive loses its torque and none moves on after it; the next move
 * begins with the way to its start. */
static void rests_in_ready_and_goes_on(void)
{
    for (unsigned i = 0; bench->controller.state != CONTROLLER_READY; i++) {
        assert_true(i < 6000);
        tick();
        assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
        for (unsigned k = 0; k < AXES; k++)
            assert_int_equal(bench->axis[k].feedback.state, HAL_DRIVE_ENABLED);
    }
    assert_true(boards_stand());
    for (unsigned i = 0; i < AXES - 1; i++)
        assert_int_equal(bench->axis[i].target.pos_q32,
                         bench->board[i / 2].unit.axis[i % 2].target.pos_q32);
    assert_int_equal(playback_override(&bench->playback, ONE >> 2), MOTION_OK);
    assert_int_equal(playback_go(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    for (unsigned i = 0; i < 60000 && bench->playback.state != PLAYBACK_IDLE;
         i++)
        tick();
    assert_int_equal(bench->playback.played, 1);
    assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
}

static void begin_slowly(int which)
{
    slow = which;
    set_up();
    slow = -1;
    get_ready();
    make_move(8, 1000);
    assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 3000));
}

/* The boards stand long before the PC's axis, or one of them long after it. */
static void a_stop_beside_a_slower_axis_ends_in_ready(void **state)
{
    (void)state;
    for (int which = 0; which < AXES; which++)
        for (unsigned when = 40; when < 4000; when += 1117) {
            begin_slowly(which);
            for (unsigned i = 0; i < when; i++)
                tick();
            controller_stop(&bench->controller);
            rests_in_ready_and_goes_on();
        }
}

/* Some commands in 100 ms, in one tick or some apart; a stop is the last. */
static void whatever_is_asked_before_a_stop_it_ends_in_ready(void **state)
{
    uint64_t seed = 7;
    (void)state;
    for (unsigned n = 0; n < 24; n++) {
        begin_slowly((int)check_random_in(&seed, 0, AXES - 1));
        for (int64_t i = check_random_in(&seed, 0, 3000); i > 0; i--)
            tick();
        for (int64_t k = check_random_in(&seed, 2, 8); k > 0; k--) {
            const int64_t which = check_random_in(&seed, 0, 3);
            if (which == 0)
                (void)playback_hold(&bench->playback);
            else if (which == 1)
                (void)playback_resume(&bench->playback);
            else if (which == 2)
                (void)playback_override(&bench->playback,
                                        check_random_in(&seed, 1, 100) *
                                            (ONE >> 2) / 100);
            else if (k == 1)
                controller_stop(&bench->controller);
            for (int64_t i = check_random_in(&seed, -10, 30); i > 0; i--)
                tick();
        }
        controller_stop(&bench->controller);
        rests_in_ready_and_goes_on();
    }
}

/* At any time of loading and waiting too: nothing begins. */
static void a_stop_before_the_start_begins_nothing(void **state)
{
    (void)state;
    for (unsigned when = 1; when < 700; when += 67) {
        set_up();
        get_ready();
        make_move(20, 100);
        assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                         MOTION_OK);
        for (unsigned i = 0; i < when; i++)
            tick();
        if (bench->controller.state == CONTROLLER_MOVING)
            break;
        controller_stop(&bench->controller);
        for (unsigned i = 0; i < 2000; i++) {
            tick();
            assert_true(boards_stand());
        }
        assert_int_equal(bench->controller.state, CONTROLLER_READY);
        assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_NONE);
    }
}

/* The line is cut: the boards stop by their own watch, the rest along the
 * path. */
static void a_line_that_is_cut_stops_everything(void **state)
{
    int64_t cut_ns;

    (void)state;
    set_up();
    get_ready();
    make_move(60, 200);
    assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 5000));
    for (unsigned i = 0; i < 1000; i++)
        tick();
    bench->line.cut = true;
    cut_ns = bench->now_ns;
    while (bench->controller.fault.fault == CONTROLLER_FAULT_NONE)
        tick();
    assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_OFFLINE);
    assert_string_equal(
        bench->axis[bench->controller.fault.axis].feedback.fault_text,
        "the board does not answer");
    assert_true(bench->now_ns - cut_ns < 400 * MS);
    assert_int_equal(bench->controller.state, CONTROLLER_STOPPING);
    while (bench->now_ns - cut_ns < 1000 * MS)
        tick();
    assert_int_equal(bench->controller.state, CONTROLLER_FAULT);
    assert_true(boards_stand());
    for (unsigned b = 0; b < BOARDS; b++)
        assert_int_equal(bench->board[b].unit.controller.state, CONTROLLER_OFF);
    /* and comes back: nothing begins by itself */
    bench->line.cut = false;
    for (unsigned i = 0; i < 3000; i++)
        tick();
    for (unsigned b = 0; b < BOARDS; b++)
        assert_int_equal(bench->board[b].unit.controller.state, CONTROLLER_OFF);
    assert_int_equal(controller_reset(&bench->controller), MOTION_OK);
    assert_true(comes(CONTROLLER_OFF, 5000));
    assert_int_equal(controller_enable(&bench->controller), MOTION_OK);
    assert_true(comes(CONTROLLER_READY, 5000));
}

/* Who moved them is gone, and what it still asked for has been answered. */
static void take_over(void)
{
    struct hal_modbus_reply reply;

    bench->now_ns += 100 * MS;
    sim_world_run(&bench->world, bench->now_ns);
    while (hal_modbus_collect(&bench->master.modbus, &reply) == 1)
        ;
    assert_int_equal(modbus_bus_init(&bench->bus, &bench->master.modbus, 2),
                     MOTION_OK);
    for (unsigned i = 0; i < AXES - 1; i++) {
        const struct drive_slew_mcu_config own = drive_config(i);
        assert_int_equal(drive_slew_mcu_init(&bench->drive[i], &bench->bus,
                                             i == 1 ? &bench->drive[0] : NULL,
                                             &own),
                         MOTION_OK);
    }
}

/* Another tick of the line alone. */
static void look_on(void)
{
    bench->now_ns += MS;
    sim_world_run(&bench->world, bench->now_ns);
    (void)hal_fieldbus_begin(&bench->bus.fieldbus, bench->now_ns);
    hal_fieldbus_end(&bench->bus.fieldbus, bench->now_ns);
}

/* The number of the command may be that of the one before: it stops nevertheless. */
static void a_board_that_is_taken_over_stops_first(void **state)
{
    const struct mcu_unit *unit;

    (void)state;
    for (uint16_t last = 1; last <= 3; last++) {
        set_up();
        get_ready();
        make_move(60, 200);
        assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                         MOTION_OK);
        assert_true(comes(CONTROLLER_MOVING, 5000));
        unit = &bench->board[0].unit;
        bench->board[0].registers.sequence = last;
        take_over();
        assert_true(mcu_unit_is_moving(unit));
        while (unit->controller.state == CONTROLLER_MOVING)
            look_on();
        assert_int_equal(unit->controller.state, CONTROLLER_STOPPING);
        for (unsigned i = 0; i < 3000; i++)
            look_on();
        assert_int_equal(unit->controller.state, CONTROLLER_OFF);
        assert_int_equal(bench->drive[0].own.found.count, 1);
    }
}

/* Half a second into a move of the boards and of those beside them. */
static void get_under_way(void)
{
    set_up();
    get_ready();
    make_move(60, 200);
    assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                     MOTION_OK);
    assert_true(comes(CONTROLLER_MOVING, 5000));
    for (unsigned i = 0; i < 500; i++)
        tick();
}

static void a_board_in_fault_stops_the_group(void **state)
{
    (void)state;
    get_under_way();
    controller_raise(&bench->board[1].unit.controller, CONTROLLER_FAULT_ESTOP,
                     -1, 0, 0);
    const int64_t since_ns = bench->now_ns;
    while (bench->controller.fault.fault == CONTROLLER_FAULT_NONE)
        tick();
    assert_true(bench->now_ns - since_ns < 100 * MS);
    assert_int_equal(bench->controller.fault.fault, CONTROLLER_FAULT_DRIVE);
    assert_int_equal(bench->controller.fault.axis, 2);
    assert_int_equal(bench->controller.reaction, CONTROLLER_REACT_STOP);
    assert_non_null(strstr(bench->axis[2].feedback.fault_text, "the board: "));
    for (unsigned i = 0; i < 2000; i++)
        tick();
    assert_int_equal(bench->controller.state, CONTROLLER_FAULT);
    assert_true(boards_stand());
}

/* One board is reset by its watchdog: it is lost, the others stop. */
static void a_board_that_is_reset_is_lost(void **state)
{
    (void)state;
    get_under_way();
    mcu_unit_init(&bench->board[1].unit, &bench->board[1].config);
    mcu_upload_init(&bench->board[1].upload, &bench->board[1].unit);
    mcu_registers_init(&bench->board[1].registers, &bench->board[1].unit,
                       &bench->board[1].upload);
    bench->board[1].begin_ns = bench->now_ns;
    bench->board[1].ticks = 0;
    for (unsigned i = 0; i < 2000; i++)
        tick();
    assert_int_equal(bench->controller.state, CONTROLLER_FAULT);
    assert_int_equal(bench->controller.fault.axis, 2);
    assert_string_equal(bench->axis[2].feedback.fault_text,
                        "the board was reset");
    assert_true(boards_stand());
}

/* Answers are spoilt and late: a move is what it is, or a named fault; where a
 * board plays, it plays the move. */
static void a_bad_line_changes_no_set_point(void **state)
{
    struct sim_modbus_faulty faulty[BOARDS];

    (void)state;
    for (enum sim_modbus_fault fault = SIM_MODBUS_LATE;
         fault < SIM_MODBUS_FAULTS; fault++) {
        set_up();
        for (unsigned b = 0; b < BOARDS; b++) {
            sim_modbus_faulty_init(&faulty[b], &bench->board[b].slave.station,
                                   7 + b);
            bench->board[b].seat.station = &faulty[b].station;
        }
        get_ready();
        for (unsigned b = 0; b < BOARDS; b++) {
            faulty[b].from.fault = fault;
            faulty[b].from.late_ns = 5 * MS;
            faulty[b].from.share_q32 = (UINT64_C(1) << 32) / 50;
        }
        make_move(20, 200);
        assert_int_equal(playback_begin(&bench->playback, 0, PLAYBACK_PLAY),
                         MOTION_OK);
        for (unsigned i = 0; i < 12000; i++)
            tick();
        for (unsigned b = 0; b < BOARDS; b++)
            assert_true(faulty[b].from.spoilt > 0);
        if (bench->controller.fault.fault == CONTROLLER_FAULT_NONE &&
            bench->playback.err == MOTION_OK) {
            assert_int_equal(bench->rows, 4000);
            boards_did_the_same();
        }
        assert_true(boards_stand());
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_move_is_the_same_on_boards_and_begins_together),
        cmocka_unit_test(a_move_longer_than_the_window_streams),
        cmocka_unit_test(clocks_that_differ_stay_together),
        cmocka_unit_test(the_next_move_begins_with_what_the_last_needed),
        cmocka_unit_test(it_is_played_again_from_where_it_is),
        cmocka_unit_test(an_override_is_the_boards_too),
        cmocka_unit_test(an_override_under_way_is_the_boards_too),
        cmocka_unit_test(a_hold_keeps_all_at_one_place_of_the_path),
        cmocka_unit_test(a_hold_just_before_the_end_is_none),
        cmocka_unit_test(a_board_that_cannot_follow_is_a_fault_of_the_rig),
        cmocka_unit_test(a_stop_stops_all_and_they_go_on_from_there),
        cmocka_unit_test(a_move_that_is_loaded_later_is_played_once),
        cmocka_unit_test(a_stop_beside_a_slower_axis_ends_in_ready),
        cmocka_unit_test(whatever_is_asked_before_a_stop_it_ends_in_ready),
        cmocka_unit_test(a_stop_before_the_start_begins_nothing),
        cmocka_unit_test(a_line_that_is_cut_stops_everything),
        cmocka_unit_test(a_board_in_fault_stops_the_group),
        cmocka_unit_test(a_board_that_is_taken_over_stops_first),
        cmocka_unit_test(a_board_that_is_reset_is_lost),
        cmocka_unit_test(a_bad_line_changes_no_set_point),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);

    free(bench);
    return failed;
}
