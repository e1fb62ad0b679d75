/* tests/firmware/linux/machine/test_every_way_out.c - every way out x every kind of
 * drive x {moving, at rest, lost, mute, other master}, in virtual time.  Torque is
 * that of the simulated servo, its speed that of the motor; a table says whether
 * torque was off at the end, and how fast the axis moved when it went. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/linux/commands/planning.h"
#include "firmware/linux/kind/slew_mcu/board_sim.h"
#include "firmware/linux/machine/kind.h"
#include "firmware/linux/machine/machine_sim.h"
#include "firmware/linux/machine/shutdown.h"
#include "sim/bus/can_trouble.h"
#include "tests/support/check.h"
#include "tests/support/kind/kind.h"

#define MS     INT64_C(1000000)
#define SECOND (1000 * MS)

/* A program leaves by one of these, whoever it is: run, jog, home, a service. */
enum way {
    END,    /* by itself: it is done, or has an error */
    ONCE,   /* one signal */
    TWICE,  /* two */
    FAULT,  /* one whose reaction is a stop */
    STAYS,  /* the same of a service, which does not leave */
    KILLED, /* and the guardian sees it */
    OFF,    /* it and the guardian killed at once, then slew off */
    RUN,    /* likewise, then another slew run, to its end */
    LOOK,   /* likewise, then one that enables nothing: monitor, --dry-run */
    WAYS,
};
static const char *const way_text[WAYS] = {
    "end",    "Ctrl-C",   "Ctrl-C twice", "fault",   "fault, stays",
    "killed", "slew off", "slew run",     "monitor",
};

enum state {
    MOVING,
    AT_REST,
    LOST,    /* in motion, for 1.5 s */
    MUTE,    /* in motion: it hears, and says nothing for ever */
    FOREIGN, /* another master moves it, and goes on where a bus has two */
    STATES,
};
static const char *const state_text[STATES] = {
    "moving", "at rest", "lost", "mute", "other master",
};

static const struct row {
    const char *name;
    /* Its own watchdog takes torque in motion, when it hears nothing for
     * 100 ms (docs/FAULTS.md, "The guardian"). */
    bool lets_go;
} rows[] = {
    { "cia402", false },        { "modbus", false },  { "profile", false },
    { "odrive", false },        { "moteus", false },  { "board", false },
    { "odrive_watched", true }, { "virtual", false },
};

/* ---- one case ---------------------------------------------------------------- */

static struct job job;
static struct machine_sim sim;
static struct machine first,
    next; /* next: of the program that comes after it */
static struct sim_can_port
    other_port; /* of that program, where buses are CAN */
static struct hal_can *other_can;
static struct sim_can_trouble trouble;
static struct machine_ports ports;
static struct shutdown way_out;
static struct guardian_page page;
static int64_t now_ns;
static bool goes_on;     /* the first machine's program does */
static int64_t heals_ns; /* of a cable that is cut */

/* What is seen of the motor. */
static struct {
    bool torque;
    double speed;  /* deg/s */
    double cut_at; /* that speed when torque went for the last time */
} seen;

static struct sim_servo *on_can(void)
{
    const struct machine_kind *kind = machine_kinds[job.rig.axis[0].kind];

    return kind->sim_servo != NULL ? kind->sim_servo(&sim, 0) : NULL;
}

/* NULL: none, of a virtual axis. */
static struct sim_modbus_servo *on_modbus(void)
{
    switch (job.rig.axis[0].kind) {
    case RIG_MODBUS:
        return machine_sim_modbus_servo(&sim, 0);
    case RIG_SLEW_MCU:
        return ((struct board_sim *)sim.servo[0])->servo;
    default:
        return NULL;
    }
}

static double speed(void)
{
    const struct rig_axis *axis = &job.rig.axis[0];
    const double per_unit = (double)axis->counts_num / (double)axis->counts_den;

    if (rig_axis_is_virtual(axis))
        return 0;
    const struct sim_plant *plant =
        on_can() != NULL ? &on_can()->plant : &on_modbus()->plant;
    return fabs((double)plant->vel_q24 / (1 << 24) / per_unit);
}

static bool has_torque(void)
{
    const enum rig_drive_kind kind = job.rig.axis[0].kind;

    return kind == RIG_SLEW_MCU ? on_modbus()->enabled
                                : kind_tests[kind]->has_torque(sim.servo[0]);
}

static void look(void)
{
    const bool torque = has_torque();

    if (seen.torque && !torque)
        seen.cut_at = seen.speed;
    seen.torque = torque;
    seen.speed = speed();
}

/* Neither side hears the other. */
static void cut(bool is_cut)
{
    if (rig_axis_is_virtual(&job.rig.axis[0]))
        return;
    if (on_can() != NULL)
        sim_can_port_set_off(&on_can()->port, is_cut);
    else
        machine_sim_modbus_wire(&sim, 0)->cut = is_cut;
}

/* Time passes; the first program ticks, if it goes on beside the next. */
static void pass(void)
{
    for (unsigned i = 0; i < 10; i++) {
        now_ns += job.rig.period_ns / 10;
        (void)hal_clock_wait_until(ports.clock, now_ns);
        look();
    }
    if (now_ns >= heals_ns)
        cut(false);
    if (goes_on)
        machine_tick(&first, now_ns);
}

static void ticks(struct machine *of, int64_t dur_ns)
{
    for (const int64_t end_ns = now_ns + dur_ns; now_ns < end_ns;) {
        pass();
        machine_tick(of, now_ns);
    }
}

static void until(enum controller_state state)
{
    for (int i = 0; i < 4000 && first.controller.state != state; i++)
        ticks(&first, 1);
    if (first.controller.state != state)
        fail_msg("%s", controller_state_text(first.controller.state));
}

/* ---- what it is about -------------------------------------------------------- */

static void open_case(const char *name)
{
    char rig[64], message[YAML_MESSAGE_MAX] = "";
    const char *const path[] = { rig, "tests/data/ways_out/move.yaml" };

    snprintf(rig, sizeof rig, "tests/data/ways_out/%s.yaml", name);
    memset(&seen, 0, sizeof seen);
    memset(&page, 0, sizeof page);
    memset(&trouble, 0, sizeof trouble);
    goes_on = false;
    heals_ns = 0;
    assert_int_equal(planning_open(&job, path, 2, false), STATUS_OK);
    if (machine_sim_init(&sim, &job.rig, false, &ports, message) < 0 ||
        machine_init(&first, &job.rig, &ports, message) < 0)
        fail_msg("%s", message);
    now_ns = hal_clock_now_ns(ports.clock);
}

static int close_case(void **state)
{
    (void)state;
    if (first.rig == NULL)
        return 0;
    shutdown_free(&way_out);
    if (next.rig != NULL)
        machine_free(&next);
    machine_free(&first);
    machine_sim_free(&sim);
    job_free(&job);
    memset(&first, 0, sizeof first);
    memset(&next, 0, sizeof next);
    return 0;
}

/* READY at the start of the move, where it stands. */
static void make_ready(void)
{
    const struct motion_track *track[1] = { &job.track[0] };

    ticks(&first, 1);
    assert_int_equal(controller_enable(&first.controller), 0);
    until(CONTROLLER_READY);
    assert_int_equal(playback_load(&first.playback, track), 0);
    if (job.goal[0] != NULL)
        playback_set_goals(&first.playback, 0, job.goal[0], job.goal_count[0]);
    assert_int_equal(playback_go(&first.playback, 0, PLAYBACK_STAND), 0);
    ticks(&first, SECOND);
    until(CONTROLLER_READY);
    ticks(&first, SECOND / 2);
}

static void make_move(void)
{
    assert_int_equal(playback_begin(&first.playback, 0, PLAYBACK_PLAY), 0);
    until(CONTROLLER_MOVING);
    ticks(&first, 3 * SECOND);
    if (!rig_axis_is_virtual(&job.rig.axis[0]))
        assert_true(seen.speed > 10);
}

/* A board hangs: it hears nothing either, and its servo has torque. */
static void silence(void)
{
    const enum rig_drive_kind kind = job.rig.axis[0].kind;

    if (on_can() != NULL) {
        if (on_can()->port.trouble == NULL)
            assert_int_equal(
                sim_can_trouble_init(&trouble, &on_can()->port, false, 1), 0);
        on_can()->port.trouble->impairment.loss_q32 = UINT64_C(1) << 32;
    } else if (kind == RIG_SLEW_MCU) {
        kind_tests[kind]->trouble(sim.servo[0], KIND_SILENT);
    } else if (kind == RIG_MODBUS) {
        on_modbus()->faulty.from.fault = SIM_MODBUS_MUTE;
    }
}

/* ---- who leaves -------------------------------------------------------------- */

/* What is under way on a line is its program's alone. */
static void forget_replies(void)
{
    struct hal_modbus_reply reply;

    for (int i = 0; i < 1000 && sim.master[0].box_count > 0; i++)
        pass();
    while (hal_modbus_collect(ports.modbus[0], &reply) > 0)
        ;
}

/* A program that knows nothing of the first one, on a CAN port of its own. */
static struct machine *another(void)
{
    struct machine_ports own = ports;
    char message[YAML_MESSAGE_MAX] = "";

    if (on_can() != NULL) {
        sim_can_port_init(&other_port, &sim.wire[0]);
        other_can = &other_port.can;
        own.can = &other_can;
    } else if (!rig_axis_is_virtual(&job.rig.axis[0])) {
        forget_replies();
    }
    if (machine_init(&next, &job.rig, &own, message) < 0)
        fail_msg("%s", message);
    return &next;
}

/* So far; the second one is too early to mean that it is enough. */
static int signals(enum way way, int64_t since_ns)
{
    if (way == TWICE)
        return since_ns < 300 * MS ? 1 : 2;
    return way == ONCE;
}

/* The way out, to its end; true: within 20 s. */
static bool leave(struct machine *machine, enum way way)
{
    const int64_t begin_ns = now_ns;
    bool is_over = false;

    machine->ports.is_real = true;
    machine->ports.guardian = &page;
    shutdown_init(&way_out, machine);
    way_out.gives_up = way == KILLED || way == OFF; /* after its time */
    while (!is_over && now_ns - begin_ns < 20 * SECOND) {
        pass();
        if (way == STAYS ||
            (way == FAULT && machine->controller.state != CONTROLLER_FAULT &&
             now_ns - begin_ns < SECOND)) {
            machine_tick(machine, now_ns);
            is_over = now_ns - begin_ns > 8 * SECOND;
            if (machine->controller.fault.fault == CONTROLLER_FAULT_NONE)
                controller_trip(&machine->controller,
                                CONTROLLER_FAULT_GUARDIAN);
            continue;
        }
        (void)shutdown_stops(&way_out, now_ns, signals(way, now_ns - begin_ns));
        shutdown_begin(&way_out, now_ns, 0);
        is_over = shutdown_tick(&way_out, now_ns);
    }
    return is_over;
}

/* As live.c does. */
static bool waits(const struct machine *machine, enum way way)
{
    const struct controller *controller = &machine->controller;

    if (way == RUN)
        return controller->state != CONTROLLER_READY &&
               controller->state != CONTROLLER_FAULT;
    return way == LOOK &&
           controller->axis[0].feedback.state == HAL_DRIVE_OFFLINE;
}

/* Which machine it is that leaves, in the state of its first moment. */
static struct machine *who_leaves(enum way way, enum state state)
{
    const bool is_next = way >= KILLED || state == FOREIGN;
    struct machine *machine = is_next ? another() : &first;

    goes_on = state == FOREIGN && on_can() != NULL;
    if (way == KILLED) /* until the guardian sees it */
        for (int64_t end_ns = now_ns + 270 * MS; now_ns < end_ns;)
            pass();
    if (way == KILLED || way == OFF)
        machine->powered = 1; /* off.c: whatever it finds */
    else if (way >= KILLED || state == FOREIGN)
        ticks(machine, 300 * MS);
    if (way == RUN)
        (void)controller_enable(&machine->controller);
    for (const int64_t begin_ns = now_ns;
         now_ns - begin_ns < 10 * SECOND && waits(machine, way);)
        ticks(machine, 1);
    return machine;
}

/* ---- what is judged ---------------------------------------------------------- */

#define STANDS 0.3 /* deg/s, a hundredth of the axis's limit */

/* Nobody speaks to it for longer than its watchdog waits. */
static bool is_alone(enum way way, enum state state)
{
    return way >= KILLED || state == LOST;
}

static const char *torque_text(const struct machine *machine)
{
    const bool is_missing =
        machine == &next &&
        machine->controller.axis[0].feedback.state == HAL_DRIVE_OFFLINE;

    if (!has_torque())
        return "off";
    if (!machine_is_off(machine))
        return "on, named";
    return is_missing ? "on, not there" : "ON, UNSAID";
}

static const char *cut_text(const struct row *row, enum way way,
                            enum state state)
{
    if (has_torque())
        return "";
    if (seen.cut_at <= STANDS)
        return "stopped first";
    return row->lets_go && is_alone(way, state) ? "by its watchdog, in motion"
                                                : "CUT IN MOTION";
}

/* One that says nothing may keep its torque, and that is said; every other one
 * has none, was stopped first, and has said so itself. */
static void judge(const struct row *row, enum way way, enum state state,
                  const struct machine *machine, bool is_over)
{
    const char *torque = torque_text(machine), *cut = cut_text(row, way, state);

    print_message("%-15s %-13s %-13s %-14s %-14s %5.2f deg/s\n", row->name,
                  way_text[way], state_text[state], torque, cut, seen.cut_at);
    assert_string_not_equal(torque, "ON, UNSAID");
    assert_string_not_equal(cut, "CUT IN MOTION");
    if (way == STAYS) { /* with a fault: what was lost waits for a reset */
        assert_int_equal(page.end, GUARDIAN_WATCHED);
        assert_true(state >= LOST || machine_is_off(machine));
    } else if (rig_axis_is_virtual(&job.rig.axis[0]) || state != MUTE) {
        assert_string_equal(torque, "off");
        assert_true(is_over && machine_is_off(machine));
        assert_int_equal(page.end, GUARDIAN_DONE);
        assert_false(machine->lit);
    } else if (!machine_is_off(machine)) {
        /* tried on, or left after its time */
        assert_int_equal(is_over, way == KILLED || way == OFF);
        assert_int_equal(page.end, is_over ? GUARDIAN_LEFT : GUARDIAN_WATCHED);
        assert_true(machine->lit);
    }
}

static void play(const struct row *row, enum way way, enum state state)
{
    open_case(row->name);
    make_ready();
    if (state != AT_REST)
        make_move();
    heals_ns = now_ns + 3 * SECOND / 2;
    if (state == LOST)
        cut(true);
    if (state == MUTE)
        silence();
    if (state == LOST || state == MUTE)
        ticks(&first, 40 * MS);
    struct machine *machine = who_leaves(way, state);
    const bool is_over = leave(machine, way);
    judge(row, way, state, machine, is_over);
    (void)close_case(NULL);
}

static void every_way_out(void **state)
{
    (void)state;
    print_message("%-15s %-13s %-13s %-14s %-14s %s\n", "drive", "way out",
                  "state", "torque", "and the axis", "when it went");
    for (size_t r = 0; r < ARRAY_LEN(rows); r++)
        for (int way = 0; way < WAYS; way++)
            for (int s = 0; s < STATES; s++)
                play(&rows[r], (enum way)way, (enum state)s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(every_way_out, close_case),
    };

    return cmocka_run_group_tests_name("every_way_out", tests, NULL, NULL);
}
