/* tests/firmware/control/stateful_mishap.c - what goes wrong by itself: drives,
 * inputs, the bus, lost ticks, and the reader of a move. */
#include "tests/firmware/control/stateful.h"

#define MS INT64_C(1000000)

void stateful_may_come(struct stateful *bench, enum controller_fault fault)
{
    bench->judge.causes |= (uint32_t)1 << fault;
}

static void break_drive(struct stateful *bench)
{
    const unsigned i = (unsigned)stateful_in(bench, 0, bench->axes - 1);
    struct stateful_axis *axis = &bench->axis[i];
    if (axis->board != NULL) {
        stateful_break_board(bench, axis->board);
        return;
    }
    axis->ill = stateful_one_in(bench, 2);
    axis->state = HAL_DRIVE_FAULT;
    stateful_may_come(bench, CONTROLLER_FAULT_DRIVE);
    stateful_note(bench, "(drive %u: fault)", i);
}

static void drop_drive(struct stateful *bench)
{
    const unsigned i = (unsigned)stateful_in(bench, 0, bench->axes - 1);
    struct stateful_axis *axis = &bench->axis[i];
    if (axis->board != NULL) {
        stateful_break_board(bench, axis->board);
        return;
    }
    axis->away = true;
    axis->state = HAL_DRIVE_OFFLINE;
    stateful_may_come(bench, CONTROLLER_FAULT_OFFLINE);
    stateful_note(bench, "(drive %u: gone)", i);
}

static void leave_operation(struct stateful *bench)
{
    const unsigned i = (unsigned)stateful_in(bench, 0, bench->axes - 1);
    struct stateful_axis *axis = &bench->axis[i];
    if (axis->state != HAL_DRIVE_ENABLED || axis->board != NULL)
        return;
    axis->state =
        stateful_one_in(bench, 2) ? HAL_DRIVE_OFF : HAL_DRIVE_QUICK_STOP;
    axis->request = HAL_DRIVE_REQUEST_OFF;
    axis->wait = axis->off_ticks;
    stateful_may_come(bench, CONTROLLER_FAULT_STATE);
    stateful_note(bench, "(drive %u: leaves)", i);
}

static void go_stale(struct stateful *bench)
{
    const unsigned i = (unsigned)stateful_in(bench, 0, bench->axes - 1);
    if (bench->axis[i].board != NULL) {
        stateful_break_board(bench, bench->axis[i].board);
        return;
    }
    bench->axis[i].stale_ticks = (int)stateful_in(bench, 1, 8);
    stateful_may_come(bench, CONTROLLER_FAULT_STALE);
    stateful_note(bench, "(drive %u: stale)", i);
}

static void slip(struct stateful *bench)
{
    const unsigned i = (unsigned)stateful_in(bench, 0, bench->axes - 1);
    bench->axis[i].slip_q32 +=
        stateful_q32(bench->axis[i].scale * stateful_between(bench, -3, 3));
    stateful_may_come(bench, CONTROLLER_FAULT_FOLLOWING);
    stateful_note(bench, "(drive %u: slips)", i);
}

/* Its contacts close and open by themselves: together, or not, or one alone. */
static void press_estop(struct stateful *bench)
{
    struct stateful_estop *estop = &bench->estop;
    const int apart = 2 + (int)(2 * estop->discrepancy_ns / bench->period_ns);
    const int held = (int)stateful_in(bench, 1, 50);
    const bool alone = estop->channels > 1 && stateful_one_in(bench, 4);
    const unsigned first =
        estop->channels > 1 ? (unsigned)stateful_in(bench, 0, 1) : 0;
    for (unsigned n = 0; n < (alone ? 1 : estop->channels); n++) {
        const unsigned channel = (first + n) % estop->channels;
        const bool with = n == 0 || stateful_one_in(bench, 3);
        const int later = with ? 0 : (int)stateful_in(bench, 0, apart);
        estop->press_ticks[channel] = 1 + later;
        estop->release_ticks[channel] = 1 + held + later;
    }
    stateful_note(bench, "(e-stop%s)", alone ? ", one channel" : "");
}

void stateful_press(struct stateful *bench)
{
    struct stateful_estop *estop = &bench->estop;
    for (unsigned channel = 0; channel < estop->channels; channel++) {
        estop->line[channel].active = true;
        estop->press_ticks[channel] = 0;
        estop->release_ticks[channel] = 10;
    }
    stateful_note(bench, "(e-stop)");
}

static void break_bus(struct stateful *bench)
{
    static const struct {
        enum hal_fieldbus_health health;
        enum controller_fault fault;
    } row[] = { { HAL_FIELDBUS_FOREIGN, CONTROLLER_FAULT_MASTER },
                { HAL_FIELDBUS_PASSIVE, CONTROLLER_FAULT_BUS_PASSIVE },
                { HAL_FIELDBUS_FULL, CONTROLLER_FAULT_BUS_FULL },
                { HAL_FIELDBUS_DOWN, CONTROLLER_FAULT_BUS } };
    const int64_t k = stateful_in(bench, 0, ARRAY_LEN(row) - 1);
    bench->bus.health = row[k].health;
    bench->bus_ticks = (int)stateful_in(bench, 1, 5);
    stateful_may_come(bench, row[k].fault);
    stateful_note(bench, "(bus %d)", (int)bench->bus.health);
}

static void lose_ticks(struct stateful *bench)
{
    bench->lost =
        (int)stateful_in(bench, 1, stateful_one_in(bench, 5) ? 100 : 8);
    stateful_may_come(bench, CONTROLLER_FAULT_OVERRUN);
    bench->judge.lost = true;
    if (stateful_any_boards(bench)) /* theirs go on */
        stateful_may_come(bench, CONTROLLER_FAULT_FOLLOWING);
    stateful_note(bench, "(%d ticks lost)", bench->lost);
}

/* Whatever it is told, at up to three times what it may brake by. */
static void run_away(struct stateful *bench)
{
    const unsigned i = (unsigned)stateful_in(bench, 0, bench->axes - 1);
    if (bench->axis[i].board != NULL)
        return; /* it watches its axes by itself */
    const double most = (double)bench->axis_config[i].stop.acc_q32 / 0x1p32;
    const double runaway = most * stateful_between(bench, 0.1, 3);
    bench->axis[i].runaway = stateful_one_in(bench, 2) ? runaway : -runaway;
    stateful_may_come(bench, CONTROLLER_FAULT_FOLLOWING);
    stateful_note(bench, "(drive %u: runs away)", i);
}

static void hold_back(struct stateful *bench)
{
    const unsigned i = (unsigned)stateful_in(bench, 0, bench->axes - 1);
    if (bench->axis[i].board != NULL)
        return;
    bench->axis[i].lag_s = stateful_between(bench, 0.005, 0.5);
    stateful_may_come(bench, CONTROLLER_FAULT_FOLLOWING);
    stateful_note(bench, "(drive %u: held back)", i);
}

static void draw_mishap(struct stateful *bench)
{
    static void (*const mishap[])(struct stateful *) = {
        break_drive, drop_drive,  leave_operation, go_stale, slip,
        press_estop, press_estop, break_bus,       run_away, hold_back
    };
    const size_t count =
        stateful_is_wide(bench) ? ARRAY_LEN(mishap) : ARRAY_LEN(mishap) - 2;
    if (stateful_one_in(bench, 900))
        mishap[stateful_in(bench, 0, (int64_t)count - 1)](bench);
    if (stateful_one_in(bench, 400))
        lose_ticks(bench);
}

void stateful_heal(struct stateful *bench)
{
    struct stateful_estop *estop = &bench->estop;
    for (unsigned channel = 0; channel < estop->channels; channel++) {
        estop->line[channel].active = false;
        estop->press_ticks[channel] = estop->release_ticks[channel] = 0;
    }
    bench->bus.health = HAL_FIELDBUS_GOOD;
    stateful_heal_boards(bench);
    for (unsigned i = 0; i < bench->axes; i++) {
        bench->axis[i].ill = bench->axis[i].away = false;
        if (!stateful_axis_has_torque(&bench->axis[i])) /* once it stands */
            bench->axis[i].runaway = bench->axis[i].lag_s = 0;
    }
}

static void draw_heal(struct stateful *bench)
{
    if (bench->bus_ticks > 0 && --bench->bus_ticks == 0)
        bench->bus.health = HAL_FIELDBUS_GOOD;
    if (stateful_one_in(bench, 100))
        stateful_heal(bench);
}

static void move_contacts(struct stateful_estop *estop)
{
    for (unsigned channel = 0; channel < estop->channels; channel++) {
        int *press = &estop->press_ticks[channel];
        int *release = &estop->release_ticks[channel];
        if (*press > 0 && --*press == 0)
            estop->line[channel].active = true;
        if (*release > 0 && --*release == 0)
            estop->line[channel].active = false;
    }
}

void stateful_draw_mishaps(struct stateful *bench)
{
    draw_heal(bench);
    draw_mishap(bench);
    move_contacts(&bench->estop);
}
