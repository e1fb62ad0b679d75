/* firmware/linux/commands/run/live.c - see live.h. */
#include "firmware/linux/commands/run/live.h"

#include <stdio.h>
#include <string.h>

#include "firmware/host/job/budget.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/machine/pace.h"
#include "motion/core/err.h"

#define LIVE_LOOK_NS INT64_C(300000000) /* --dry-run: at least */

enum status live_use(struct live *live, const struct options *options,
                     struct rig *rig)
{
    char message[YAML_MESSAGE_MAX];
    live->rig = rig;
    if (options->real && options->pty) {
        error_say(
            "slew: --pty is for simulated drives, expected it without --real");
        return STATUS_INPUT;
    }
    if (options->interface == NULL ||
        rig_set_interfaces(rig, options->interface, message) == 0)
        return STATUS_OK;
    error_say("slew: --interface: %s", message);
    return STATUS_INPUT;
}

enum status live_read(struct live *live, const struct options *options)
{
    live->rig = &live->own;
    enum status status = planning_rig(options->path[0], &live->own);
    return status == STATUS_OK ? live_use(live, options, &live->own) : status;
}

enum status live_fits(const struct live *live, const struct options *options)
{
    struct messages messages = { .text = NULL };
    char path[PLANNING_PATH_MAX];
    const enum status status = planning_rig_path(options->path[0], path);
    if (status != STATUS_OK)
        return status;
    const bool fits = budget_check(live->rig, path, &messages);
    error_tell(&messages);
    return fits ? STATUS_OK : STATUS_REFUSED;
}

enum status live_ports(struct live *live, const struct options *options,
                       struct machine_ports *ports)
{
    char message[YAML_MESSAGE_MAX];
    live->on_clock = options->real || options->realtime || options->pty;
    char path[PLANNING_PATH_MAX];
    enum status status = planning_rig_path(options->path[0], path);
    if (status != STATUS_OK)
        return status;
    if (options->real && rig_may_move_drives(live->rig, path, message) < 0) {
        error_say("%s", message);
        return STATUS_INPUT;
    }
    const struct machine_real_config config = { .lock.rig_path = path,
                                                .reaches = true };
    int err = options->real ? machine_real_init(&live->real, live->rig, &config,
                                                ports, message)
                            : machine_sim_init(&live->sim, live->rig,
                                               live->on_clock, ports, message);
    if (err == MOTION_OK && options->pty)
        err = machine_modbus_open(&live->pty, live->rig, true, ports, message);
    ports->guardian = live->guardian.page;
    if (err == MOTION_OK)
        return STATUS_OK;
    status = error_file(options->path[0], message);
    return options->real && machine_real_may_come(err) ? STATUS_REFUSED
                                                       : status;
}

enum status live_build(struct live *live, const struct options *options,
                       const struct machine_ports *ports)
{
    char message[YAML_MESSAGE_MAX];
    if (machine_init(&live->machine, live->rig, ports, message) < 0)
        return error_file(options->path[0], message);
    live->start_ns = hal_clock_now_ns(ports->clock);
    live->now_ns = live->start_ns;
    shutdown_init(&live->shutdown, &live->machine);
    return STATUS_OK;
}

enum status live_open(struct live *live, const struct options *options,
                      bool paced)
{
    struct machine_ports ports;
    enum status status = live_ports(live, options, &ports);
    live->is_paced = paced && !live->on_clock;
    clock_linux_init(&live->pace);
    if (status == STATUS_OK)
        status = live_build(live, options, &ports);
    error_hasten(status == STATUS_OK && live->on_clock);
    return status;
}

/* A lamp goes out with the torque, and not without it. */
static void live_leave_lamps(struct live *live)
{
    for (unsigned i = 0; i < live->real.gpio.count; i++)
        if (live->rig->line[i].kind == RIG_LINE_LAMP)
            machine_gpio_leave(&live->real.gpio, i);
}

void live_close(struct live *live)
{
    error_hasten(false);
    if (!machine_is_off(&live->machine))
        live_leave_lamps(live);
    machine_modbus_close(&live->pty);
    machine_real_close(&live->real);
    guardian_end(&live->guardian);
    shutdown_free(&live->shutdown);
    live_warn_free(&live->warn);
    machine_free(&live->machine);
    machine_sim_free(&live->sim);
    rig_free(&live->own);
}

/* Behind by more than this, virtual time does not catch up. */
#define LIVE_BEHIND_NS INT64_C(50000000)
static void live_pace(struct live *live)
{
    struct hal_clock *clock = &live->pace.clock;
    const int64_t behind_ns =
        hal_clock_now_ns(clock) - live->pace_ns - live->now_ns;
    if (live->pace_ns == 0 || behind_ns > LIVE_BEHIND_NS)
        live->pace_ns = hal_clock_now_ns(clock) - live->now_ns;
    while (hal_clock_wait_until(clock, live->pace_ns + live->now_ns) < 0)
        ; /* a signal woke us; it has been counted */
}

static void live_wait(struct live *live)
{
    const int64_t period_ns = live->rig->period_ns;
    int64_t late_ns;
    live->now_ns += period_ns;
    if (live->is_paced)
        live_pace(live);
    live->now_ns =
        pace_wait(live->machine.ports.clock, live->now_ns, period_ns, &late_ns);
}

void live_tick(struct live *live)
{
    live_wait(live);
    (void)shutdown_stops(&live->shutdown, live->now_ns, 0);
    machine_tick(&live->machine, live->now_ns);
    live_warn_step(&live->warn, &live->machine, live->now_ns);
}

bool live_enable(struct live *live, const volatile sig_atomic_t *interrupts)
{
    const struct controller *controller = &live->machine.controller;
    live_tick(live);
    if (controller_enable(&live->machine.controller) < 0)
        return false;
    while (controller->state == CONTROLLER_OFF && *interrupts == 0)
        live_tick(live);
    return controller->state == CONTROLLER_READY;
}

bool live_off(struct live *live, const volatile sig_atomic_t *interrupts)
{
    shutdown_begin(&live->shutdown, live->now_ns, 0);
    do {
        live_wait(live);
        (void)shutdown_stops(&live->shutdown, live->now_ns, *interrupts);
        shutdown_say_waiting(&live->shutdown);
    } while (!shutdown_tick(&live->shutdown, live->now_ns));
    error_hasten(false);
    return shutdown_say_torque(&live->machine);
}

void live_leave(struct live *live, const volatile sig_atomic_t *interrupts)
{
    if (live->shutdown.machine != NULL && !machine_is_off(&live->machine))
        (void)live_off(live, interrupts);
}

int live_axis(const struct live *live, const char *command, const char *name)
{
    char list[QUOTE_LIST_MAX];
    const int axis = rig_axis_index(live->rig, name);
    if (axis < 0)
        error_say("slew %s: no axis \"%s\" in the rig, expected %s", command,
                  name, rig_axis_list(live->rig, list));
    return axis;
}

enum status live_confirm(struct live *live, const struct options *options,
                         const char *command)
{
    if (!command_may_move(options, command))
        return STATUS_INPUT;
    if (options->real && guardian_start(&live->guardian, live->rig) < 0)
        return STATUS_SYSTEM;
    return STATUS_OK;
}

enum status live_begin(struct live *live, const struct options *options,
                       const char *command, bool paced)
{
    enum status status = live_confirm(live, options, command);
    if (status == STATUS_OK)
        status = live_open(live, options, paced);
    if (status == STATUS_OK)
        live_warn_init(&live->warn, live->rig, command);
    return status;
}

/* --- what can be known before anything moves --- */

static bool live_all_there(const struct live *live)
{
    for (unsigned i = 0; i < live->rig->axis_count; i++)
        if (live->machine.controller.axis[i].feedback.state ==
            HAL_DRIVE_OFFLINE)
            return false;
    return true;
}

static void live_say_found(const struct live *live, unsigned i)
{
    const struct hal_drive_found *found = machine_found(&live->machine, i);
    char text[WARNING_TEXT_MAX];
    if (found == NULL || found->count == 0)
        return;
    const struct warning warning = machine_warning_found(found);
    warning_text(&warning, &live->rig->axis[i], text);
    error_say("%s", text);
}

static bool live_look_axis(const struct live *live, unsigned i, FILE *file)
{
    const struct hal_drive_feedback *feedback =
        &live->machine.controller.axis[i].feedback;
    const bool ok = feedback->state == HAL_DRIVE_OFF;
    if (!ok)
        error_say("%s: %s%s%s", live->rig->axis[i].name,
                  hal_drive_state_text(feedback->state),
                  feedback->fault_text[0] != 0 ? ", " : "",
                  feedback->fault_text);
    else if (file != NULL)
        fprintf(file, "%s: the drive is there, and off\n",
                live->rig->axis[i].name);
    live_say_found(live, i);
    return ok;
}

/* --dry-run, on what is open: are the drives there, each off and without fault,
 * and nothing in the way?  Nothing is enabled.  A line for each on `file`
 * (NULL: none).  STATUS_OK, or STATUS_REFUSED: the real run would end so,
 * too. */
static enum status live_look(struct live *live, FILE *file,
                             const volatile sig_atomic_t *interrupts)
{
    const int64_t start_ns = live->now_ns;
    char text[MACHINE_FAULT_MAX];
    bool ok = true;
    do
        live_tick(live);
    while (*interrupts == 0 && (live->now_ns - start_ns < LIVE_LOOK_NS ||
                                (!live_all_there(live) &&
                                 !controller_waited_for_drives(
                                     &live->machine.controller, start_ns))));
    if (*interrupts > 0)
        return STATUS_INTERRUPTED;
    for (unsigned i = 0; i < live->rig->axis_count; i++)
        ok &= live_look_axis(live, i, file);
    machine_fault_text(&live->machine, text); /* the e-stop */
    if (text[0] == 0)
        machine_trouble_text(&live->machine, text);
    if (text[0] == 0)
        return ok ? STATUS_OK : STATUS_REFUSED;
    error_say("%s", text);
    return STATUS_REFUSED;
}

enum status live_dry_run(struct live *live, const struct options *options)
{
    if (!options->real)
        return STATUS_OK;
    enum status status = live_open(live, options, false);
    if (status != STATUS_OK)
        return status;
    const volatile sig_atomic_t *interrupts = interrupt_listen();
    status = live_look(live, options->json ? NULL : stdout, interrupts);
    live_leave(live, interrupts);
    interrupt_listen_no_more();
    return status;
}

enum status live_dry_run_alone(struct live *live, const struct options *options)
{
    const enum status status = live_dry_run(live, options);
    if (status == STATUS_OK && options->json) {
        cJSON *report = cJSON_CreateObject();
        cJSON_AddBoolToObject(report, "dry_run", true);
        json_report(report, true);
    }
    return status;
}
