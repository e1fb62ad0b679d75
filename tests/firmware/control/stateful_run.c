/* tests/firmware/control/stateful_run.c - the tick, the episode, and what is
 * printed of one. */
#include <stdio.h>
#include <string.h>

#include "motion/core/err.h"
#include "tests/firmware/control/stateful.h"

#define START_NS  INT64_C(1000000000)
#define END_TICKS 20000 /* for the way to OFF */

const char *stateful_violation_text(enum stateful_violation violation)
{
    static const char *const text[] = {
#define VIOLATION_TEXT(name, text) text,
        STATEFUL_VIOLATION_LIST(VIOLATION_TEXT)
#undef VIOLATION_TEXT
    };
    return text[violation];
}

/* --- notes ----------------------------------------------------------------- */

void stateful_note(struct stateful *bench, const char *format, ...)
{
    const size_t length = strlen(bench->note);
    va_list list;
    va_start(list, format);
    if (length + 2 < sizeof bench->note) {
        (void)vsnprintf(bench->note + length, sizeof bench->note - length,
                        format, list);
        strncat(bench->note, "; ",
                sizeof bench->note - strlen(bench->note) - 1);
    }
    va_end(list);
}

void stateful_violate(struct stateful *bench, enum stateful_violation violation,
                      int axis, const char *format, ...)
{
    va_list list;
    if (bench->violation != STATEFUL_NONE)
        return;
    bench->violation = violation;
    bench->bad_axis = axis;
    va_start(list, format);
    (void)vsnprintf(bench->what, sizeof bench->what, format, list);
    va_end(list);
}

static void run_trace(struct stateful *bench)
{
    const size_t slot = bench->ticks % STATEFUL_TRACE;
    bench->trace[slot].tick = bench->ticks;
    bench->trace[slot].state = bench->controller.state;
    bench->trace[slot].homing = bench->homing.state;
    bench->trace[slot].rate_q30 = bench->controller.rate.rate_q30;
    for (unsigned i = 0; i < bench->axes; i++)
        bench->trace[slot].pos_q32[i] = bench->judge.past[i].pos_q32[0];
    memcpy(bench->trace[slot].note, bench->note, sizeof bench->note);
    bench->note[0] = '\0';
}

static void print_axis(const struct stateful *bench, unsigned i)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    printf("    axis %u: range %.3f .. %.3f, limit %.3f %.1f %.0f, stop %.1f "
           "%.0f, droop %.3f%s\n",
           i, stateful_unit(config->pos_min_q32),
           stateful_unit(config->pos_max_q32),
           stateful_unit(config->limit.vel_q32),
           (double)config->limit.acc_q32 / 0x1p32,
           (double)config->limit.jerk_q32 / 0x1p32,
           (double)config->stop.acc_q32 / 0x1p32,
           (double)config->stop.jerk_q32 / 0x1p32,
           stateful_unit(bench->axis[i].droop_q32),
           bench->controller.axis[i].homed ? "" : ", not homed");
}

static void print_tick(const struct stateful *bench, size_t slot)
{
    printf("    %6" PRIu64 " %-8s %-8.8s %6.4f", bench->trace[slot].tick,
           controller_state_text(bench->trace[slot].state),
           homing_state_text(bench->trace[slot].homing),
           (double)bench->trace[slot].rate_q30 * 0x1p-30);
    for (unsigned i = 0; i < bench->axes; i++)
        printf(" %.6f", stateful_unit(bench->trace[slot].pos_q32[i]));
    printf("  %s\n", bench->trace[slot].note);
}

/* The last ticks, and of those before the ones with commands. */
void stateful_print(const struct stateful *bench)
{
    const uint64_t count =
        bench->ticks < STATEFUL_TRACE ? bench->ticks : STATEFUL_TRACE;
    printf("  SEED=%#" PRIx64 ", tick %" PRIu64 ", axis %d: %s: %s\n",
           bench->first_seed, bench->ticks, bench->bad_axis,
           stateful_violation_text(bench->violation), bench->what);
    printf("    period %.1f ms; fault: %s\n", (double)bench->period_ns / 1e6,
           controller_fault_text(bench->controller.fault.fault));
    for (unsigned i = 0; i < bench->axes; i++)
        print_axis(bench, i);
    printf("      tick state    homing   rate   set points, commands\n");
    for (uint64_t n = count; n > 0; n--) {
        const size_t slot = (bench->ticks + 1 - n) % STATEFUL_TRACE;
        if (n <= 12 || bench->trace[slot].note[0] != '\0')
            print_tick(bench, slot);
    }
    fflush(stdout);
}

static void run_tally(struct stateful *bench)
{
    struct stateful_tally *tally = &bench->tally;
    tally->state[bench->controller.state]++;
    if (bench->homing.state !=
        bench->trace[(bench->ticks - 1) % STATEFUL_TRACE].homing)
        tally->homing[bench->homing.state]++;
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->judge.past[i].any_range)
            tally->range++;
}

/* --- the tick -------------------------------------------------------------- */

static void begin_lines(struct stateful *bench,
                        struct controller_switches switches[])
{
    for (int channel = 0; channel < STATEFUL_CHANNELS; channel++)
        bench->estop.line[channel].gpio.ops = &stateful_line_ops;
    for (unsigned i = 0; i < bench->axes; i++) {
        struct stateful_line *line = bench->line[i];
        const struct stateful_zone *zone = bench->axis[i].zone;
        struct hal_gpio **const input[] = { &switches[i].limit_negative,
                                            &switches[i].limit_positive,
                                            &switches[i].home };
        for (int which = 0; which < STATEFUL_SWITCHES; which++) {
            line[which] =
                (struct stateful_line){ .gpio.ops = &stateful_line_ops,
                                        .axis = &bench->axis[i],
                                        .which = (enum stateful_switch)which };
            if (zone[which].there && !zone[which].by_drive)
                *input[which] = &line[which].gpio;
        }
    }
}

void stateful_begin(struct stateful *bench)
{
    struct hal_drive *drive[STATEFUL_AXES];
    struct controller_switches switches[STATEFUL_AXES] = { { .home = NULL } };
    const struct controller_inputs inputs = {
        .estop = { &bench->estop.line[0].gpio, bench->estop.channels > 1
                                                   ? &bench->estop.line[1].gpio
                                                   : NULL },
        .discrepancy_ns = bench->estop.discrepancy_ns,
        .axis = switches,
    };
    bench->config.axis = bench->axis_config;
    bench->period_ns = bench->config.period_ns;
    bench->now_ns = START_NS;
    bench->burst = -1;
    for (unsigned i = 0; i < bench->axes; i++) {
        bench->axis[i].period_ns = bench->period_ns;
        bench->axis[i].now_ns = bench->now_ns;
        stateful_axis_init(&bench->axis[i]);
        drive[i] = &bench->axis[i].drive;
    }
    stateful_begin_boards(bench);
    begin_lines(bench, switches);
    assert_int_equal(controller_init(&bench->controller, &bench->config,
                                     bench->state, drive, &inputs),
                     MOTION_OK);
    playback_init(&bench->playback, &bench->controller, &bench->jog,
                  bench->playback_axis);
    mailbox_init(&bench->mailbox);
    stateful_shots_begin(bench);
    assert_int_equal(homing_init(&bench->homing, &bench->controller,
                                 &bench->jog, bench->home),
                     MOTION_OK);
}

static void run_time(struct stateful *bench)
{
    for (int n = 0; n <= bench->lost; n++) {
        bench->now_ns += bench->period_ns;
        for (unsigned i = 0; i < bench->axes; i++)
            if (bench->axis[i].board == NULL)
                stateful_axis_advance(&bench->axis[i]);
        for (unsigned k = 0; k < STATEFUL_BOARDS; k++)
            if (bench->board[k].count > 0)
                stateful_board_advance(&bench->board[k]);
    }
    bench->skipped = bench->lost;
    bench->lost = 0;
    bench->clock_ns += bench->period_ns;
    bench->ticks++;
}

void stateful_tick(struct stateful *bench)
{
    run_time(bench);
    stateful_judge_before(bench);
    controller_step(&bench->controller, bench->now_ns, bench->bus);
    controller_jog_step(&bench->controller, &bench->jog);
    homing_step(&bench->homing);
    stateful_judge_after(bench);
    stateful_play_step(bench);
    stateful_judge_boards(bench);
    stateful_shots_step(bench);
    stateful_read_step(bench);
    for (unsigned i = 0; i < bench->axes; i++)
        stateful_axis_sync(&bench->axis[i]);
    run_tally(bench);
    run_trace(bench);
}

void stateful_ticks(struct stateful *bench, int ticks)
{
    while (ticks-- > 0 && bench->violation == STATEFUL_NONE)
        stateful_tick(bench);
}

/* --- the episode ------------------------------------------------------------ */

/* Whatever there was: a stop, off, reset end in OFF. */
static void run_off(struct stateful *bench)
{
    stateful_stop(bench);
    for (int n = 0; n < END_TICKS && bench->violation == STATEFUL_NONE; n++) {
        if (bench->controller.state == CONTROLLER_OFF)
            break;
        if (bench->controller.state == CONTROLLER_READY && n > 10)
            (void)stateful_off(bench);
        if (bench->judge.pressed.is_unproved && n % 50 == 20)
            stateful_press(bench);
        if (n % 50 == 30)
            stateful_heal(bench);
        if (bench->controller.state == CONTROLLER_FAULT && n % 50 == 0)
            (void)stateful_reset(bench);
        stateful_tick(bench);
    }
    (void)stateful_off(bench);
    stateful_ticks(bench, 50);
    if (bench->controller.state != CONTROLLER_OFF)
        stateful_violate(bench, STATEFUL_NO_END, -1, "%s",
                         controller_state_text(bench->controller.state));
    else if (stateful_enable(bench) < 0)
        stateful_violate(bench, STATEFUL_NO_END, -1, "no way out of it");
}

static void run_episode(struct stateful *bench, uint64_t ticks)
{
    stateful_draw_rig(bench);
    stateful_begin(bench);
    stateful_tick(bench);
    while (bench->ticks < ticks && bench->violation == STATEFUL_NONE) {
        stateful_draw_commands(bench);
        stateful_tick(bench);
    }
    if (bench->violation != STATEFUL_NONE)
        return;
    stateful_heal(bench);
    run_off(bench);
}

static void run_seed(struct stateful *bench, uint64_t seed)
{
    const struct stateful_tally tally = bench->tally;
    memset(bench, 0, sizeof *bench);
    bench->tally = tally;
    bench->first_seed = seed;
    bench->seed = seed * UINT64_C(0x9E3779B97F4A7C15) | 1;
}

void stateful_plain_episode(struct stateful *bench, uint64_t seed,
                            uint64_t ticks)
{
    run_seed(bench, seed);
    run_episode(bench, ticks);
}

void stateful_episode(struct stateful *bench, uint64_t seed, uint64_t ticks)
{
    if (seed % 4 == 0) {
        stateful_plain_episode(bench, seed, ticks);
        return;
    }
    run_seed(bench, seed);
    bench->kind = (struct stateful_kind){
        .has_units = stateful_one_in(bench, 3),
        .has_boards = stateful_one_in(bench, 2),
        .has_cams = stateful_one_in(bench, 2),
        .has_shots = stateful_one_in(bench, 2),
        .has_clients = stateful_one_in(bench, 2),
    };
    run_episode(bench, ticks);
}
