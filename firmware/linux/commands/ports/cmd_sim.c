/* firmware/linux/commands/ports/cmd_sim.c - slew sim: a rig's drives, simulated, on a
 * bus that others can reach. */
#include <arpa/inet.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/job/job.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/commands/ports/sim_export.h"
#include "firmware/linux/commands/ports/sim_fit.h"
#include "firmware/linux/commands/ports/sim_link.h"
#include "firmware/linux/machine/sim_live.h"
#include "sim/device/cia402/servo.h"
#include "sim/device/modbus/makers.h"

static volatile sig_atomic_t cmd_sim_ended;

static void cmd_sim_on_signal(int number)
{
    (void)number;
    cmd_sim_ended = 1;
}

static void cmd_sim_listen(void)
{
    static const int number[] = { SIGINT, SIGTERM, SIGHUP };
    struct sigaction action = { .sa_handler = cmd_sim_on_signal };
    sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < ARRAY_LEN(number); i++)
        sigaction(number[i], &action, NULL);
}

static void cmd_sim_say_where(const struct sim_server *server, uint32_t b)
{
    const struct rig_bus *bus = &server->rig->bus[b];
    const struct modbus_host *host = &server->device[b].host;
    if (rig_bus_is_can(bus))
        printf("%s on interface %s:", bus->name, bus->interface);
    else if (bus->kind == RIG_MODBUS_RTU)
        printf("%s on terminal %s: %u bit/s, 8%c%u;", bus->name, host->path,
               bus->modbus.line.baud, "EON"[bus->modbus.line.parity],
               bus -> modbus.line.stop_bits);
    else
        printf("%s on %s port %u:", bus->name, inet_ntoa(server->address),
               host->port);
}

/* On Modbus also whose drive it is: one that is made from its own map shows no
 * mistake in it. */
static void cmd_sim_say_axis(const struct rig *rig, uint32_t i)
{
    const struct rig_axis *axis = &rig->axis[i];
    const bool mapped = rig_kinds[axis->kind]->has_map;
    const struct sim_modbus_maker *maker =
        mapped ? machine_sim_maker(rig, i) : NULL;
    printf(" %s (node %u%s%s)", axis->name, axis->node_id, mapped ? ", " : "",
           maker != NULL ? maker->title
           : mapped      ? "made from its map"
                         : "");
}

static void cmd_sim_say(const struct sim_server *server)
{
    const struct rig *rig = server->rig;
    for (uint32_t b = 0; b < rig->bus_count; b++) {
        cmd_sim_say_where(server, b);
        for (uint32_t i = 0; i < rig->axis_count; i++)
            if (rig->axis[i].bus == b)
                cmd_sim_say_axis(rig, i);
        putchar('\n');
    }
    puts("interrupt (Ctrl-C) to end; help lists what can be typed");
    fflush(stdout);
}

/* Where drives on TCP listen: this machine alone when nothing is said. */
static enum status cmd_sim_address(const struct options *options,
                                   struct in_addr *address)
{
    address->s_addr = htonl(INADDR_LOOPBACK);
    if (options->address == NULL ||
        inet_pton(AF_INET, options->address, address) == 1)
        return STATUS_OK;
    error_say("slew sim: --address: '%s' is not an IPv4 address, expected one "
              "such as 0.0.0.0 (every interface) or 192.168.1.20",
              options->address);
    return STATUS_INPUT;
}

static enum status cmd_sim_script(const struct options *options,
                                  const struct rig *rig,
                                  struct fault_script *script)
{
    char message[YAML_MESSAGE_MAX];
    if (options->faults == NULL)
        return STATUS_OK;
    if (fault_script_load(&disk_files, options->faults, rig, script, message) <
        0) {
        error_say("%s", message);
        return STATUS_INPUT;
    }
    const int entry = sim_live_judges(script);
    if (entry < 0)
        return STATUS_OK;
    error_say("slew sim: --faults: %s:%u:%u: '%s' is an event of slew run, "
              "expected at, which counts from the start, or position",
              options->faults, script->entry[entry].place.line,
              script->entry[entry].place.column,
              fault_event_words[script->entry[entry].event]);
    return STATUS_INPUT;
}

/* Serve until it is interrupted, told to quit, or over. */
static enum status cmd_sim_play(const struct options *options,
                                struct sim_server *server,
                                const struct fault_script *script)
{
    struct sim_live live = { .server = NULL };
    enum status status = STATUS_OK;

    cmd_sim_say(server);
    if (sim_live_init(&live, server, script) < 0) {
        error_say("slew sim: the faults cannot be made on these drives");
        status = STATUS_SYSTEM;
    }
    while (status == STATUS_OK && !cmd_sim_ended && !live.quit &&
           (options->to_ns < 0 ||
            sim_server_now_ns(server) - live.start_ns < options->to_ns)) {
        sim_server_step(server);
        sim_live_step(&live);
    }
    sim_live_free(&live);
    return status;
}

static enum status cmd_sim_serve(const struct options *options,
                                 const struct rig *rig,
                                 struct sim_server *server)
{
    char message[YAML_MESSAGE_MAX];
    struct in_addr address;
    struct fault_script script;
    enum status status = cmd_sim_address(options, &address);
    if (status == STATUS_OK)
        status = cmd_sim_script(options, rig, &script);
    if (status != STATUS_OK)
        return status;
    if (sim_server_open(server, rig, address, message) < 0) {
        error_say("slew sim: %s", message);
        return STATUS_INPUT;
    }
    cmd_sim_ended = 0;
    cmd_sim_listen();
    status = sim_link_make(options->link, server);
    if (status == STATUS_OK)
        status = cmd_sim_play(options, server,
                              options->faults != NULL ? &script : NULL);
    sim_link_remove(options->link, server);
    sim_server_close(server);
    return status;
}

static enum status cmd_sim_rig(const struct options *options, struct rig *rig)
{
    char message[YAML_MESSAGE_MAX];
    enum status status = planning_rig(options->path[0], rig);
    if (status != STATUS_OK)
        return status;
    if (options->interface != NULL &&
        rig_set_interfaces(rig, options->interface, message) < 0) {
        error_say("slew sim: --interface: %s", message);
        return STATUS_INPUT;
    }
    struct sim_server *server = memory_new(1, sizeof *server);
    status = cmd_sim_serve(options, rig, server);
    memory_free(server);
    return status;
}

static enum status cmd_sim_run(const struct options *options)
{
    if (strcmp(options->path[0], "fit") == 0 && options->path_count > 1)
        return sim_fit_run(options);
    if (options->path_count == 2)
        return sim_export(options);
    if (options->path_count > 2) {
        error_say("slew sim: one argument too many: %s", options->path[2]);
        return STATUS_INPUT;
    }
    if (options->eds) {
        sim_cia402_write_eds(stdout);
        return STATUS_OK;
    }
    struct rig *rig = memory_new(1, sizeof *rig);
    enum status status = cmd_sim_rig(options, rig);
    rig_free(rig);
    memory_free(rig);
    return status;
}

static const struct option_row cmd_sim_option[] = {
    OPTIONS_INTERFACE,
    { "address", "ADDRESS", OPTION_TEXT, offsetof(struct options, address),
      "where drives on Modbus TCP listen (127.0.0.1); 0.0.0.0: everywhere" },
    { "eds", NULL, OPTION_FLAG, offsetof(struct options, eds),
      "print the data sheet (EDS) of a simulated CANopen drive, and end" },
    { "faults", "FILE", OPTION_TEXT, offsetof(struct options, faults),
      "what goes wrong, and when from now on (docs/FAULTS.md)" },
    { "link", "PATH", OPTION_TEXT, offsetof(struct options, link),
      "a symbolic link to the terminal of Modbus RTU, as long as it is there; "
      "or BUS=PATH,BUS=PATH" },
    { "for", "TIME", OPTION_TIME, offsetof(struct options, to_ns),
      "end after this time" },
    { "out", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "of export: the unit, a name that ends in .fmu; of fit: the rig with "
      "what was fitted, and the rig itself stays as it is" },
    { "fmi", "2|3", OPTION_COUNT, offsetof(struct options, fmi),
      "of export: the version of FMI (3)" },
    { "axis", "NAME", OPTION_TEXT, offsetof(struct options, axis),
      "of fit: this axis alone" },
    { "plot", "FILE", OPTION_TEXT, offsetof(struct options, plot),
      "of fit: draw the recording and the models of before and after, .svg or "
      ".png" },
    OPTIONS_DRY_RUN("of fit: say what was found, and write nothing"),
    { "json", NULL, OPTION_FLAG, offsetof(struct options, json),
      "of export and fit: write JSON to standard output" },
    { "help", NULL, OPTION_FLAG, offsetof(struct options, help), "this text" },
};

const struct command cmd_sim = {
    .name = "sim",
    .arguments = "RIG | DIRECTORY | export RIG | fit RIG RECORDING",
    .summary = "show a rig's drives, simulated, on real interfaces",
    .text =
        "Every drive of the rig on CAN answers on the interface of its bus, "
        "in\n"
        "real time, as a servo of its kind does: for another slew with "
        "--real,\n"
        "or for any other master.  A virtual interface will do:\n\n"
        "  ip link add dev vcan0 type vcan; ip link set vcan0 up\n\n"
        "Drives on Modbus RTU stand behind a pseudo-terminal, which is named,\n"
        "and by --link has the same name every time.  It passes bytes at any\n"
        "rate and parity; what the rig has is said, as 8E1, for a master that\n"
        "has to be told;\n"
        "those on TCP answer on the port of the rig, for this machine alone\n"
        "unless --address says otherwise: masters are not authenticated, so\n"
        "that only a network of your own should see them.\n\n"
        "What goes wrong with them is a fault script (--faults), or typed "
        "while\n"
        "they are there, a line each:\n\n"
        "  drive_fault pan code 0x3210\n"
        "  noise can1 rate 2 % for 5 s\n"
        "  list, end 1, end all, status, help, quit\n\n"
        "On a terminal every axis stands below what is typed, where it is, "
        "five\n"
        "times a second.\n\n"
        "export writes a functional mock-up unit (FMI 2.0 or 3.0,\n"
        "co-simulation) for Simulink, OpenModelica, FMPy and others: drivers,\n"
        "buses, drives and motors of the rig, with the set point of every "
        "axis\n"
        "as input and its position as output.\n\n"
        "fit finds what the servos are like from a recording of a run (slew "
        "run\n"
        "--record or --telemetry): bandwidth and damping of the position "
        "loop,\n"
        "and of a load inertia, resonance, friction and backlash, as far as "
        "the\n"
        "run shows them.  They are written into the rig, as sim of each axis;\n"
        "comments and layout stay.  See docs/PHYSICS.md.\n",
    .examples = "  slew sim --interface vcan0 rig.yaml\n"
                "  slew sim --interface can0=can2,can1=can3 examples/dolly\n"
                "  slew sim --address 192.168.1.20 rig.yaml\n"
                "  slew sim --link /tmp/servo rig.yaml\n"
                "  slew sim --faults faults.yaml rig.yaml\n"
                "  slew sim export --fmi 2 --out dolly.fmu examples/dolly\n"
                "  slew sim fit --dry-run --plot fit.svg rig.yaml run.mcap\n"
                "  slew sim fit --axis pan --out fitted.yaml rig.yaml "
                "run.mcap\n",
    .path_max = 3,
    COMMAND_OPTIONS(cmd_sim_option),
    .run = cmd_sim_run,
};
