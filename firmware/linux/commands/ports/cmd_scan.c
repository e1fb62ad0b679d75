/* firmware/linux/commands/ports/cmd_scan.c - slew scan: who is on this bus? */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/table.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/tools/scan.h"
#include "firmware/linux/tools/session.h"
#include "motion/core/err.h"

#define CMD_SCAN_LISTEN_NS  INT64_C(1200000000)
#define CMD_SCAN_TIMEOUT_NS INT64_C(20000000)
#define CMD_SCAN_BAUDS      8

/* What a Modbus line is tried with. */
struct cmd_scan_lines {
    uint32_t baud[CMD_SCAN_BAUDS];
    unsigned bauds;
    enum modbus_parity parity[3];
    unsigned parities;
};

struct cmd_scan {
    struct rig rig;
    bool is_rig, is_real;
    struct cmd_scan_lines lines;
    struct scan_config config;
    struct scan scan;
};

static enum status cmd_scan_complain(const char *what)
{
    error_say("slew scan: %s", what);
    return STATUS_INPUT;
}

/* ---- arguments ---- */

static enum status cmd_scan_bauds(const char *text,
                                  struct cmd_scan_lines *lines)
{
    static const char *const all = "9600,19200,38400,57600,115200";

    if (text == NULL)
        return STATUS_OK;
    text = strcmp(text, "all") == 0 ? all : text;
    while (lines->bauds < CMD_SCAN_BAUDS) {
        char *end;
        const unsigned long baud = strtoul(text, &end, 10);

        if (end == text || baud > UINT32_MAX ||
            !modbus_line_is_baud((uint32_t)baud))
            break;
        lines->baud[lines->bauds++] = (uint32_t)baud;
        if (*end == '\0')
            return STATUS_OK;
        text = end + (*end == ',');
    }
    return cmd_scan_complain("--baud: expected all, or up to 8 rates such as "
                             "9600,115200");
}

static enum status cmd_scan_parities(const char *text,
                                     struct cmd_scan_lines *lines)
{
    static const char *const words[] = { [MODBUS_PARITY_EVEN] = "even",
                                         [MODBUS_PARITY_ODD] = "odd",
                                         [MODBUS_PARITY_NONE] = "none" };

    for (unsigned i = 0; text != NULL && i < 3; i++)
        if (strcmp(text, words[i]) == 0 || strcmp(text, "all") == 0)
            lines->parity[lines->parities++] = (enum modbus_parity)i;
    return text == NULL || lines->parities > 0
               ? STATUS_OK
               : cmd_scan_complain("--parity: expected even, odd, none or all");
}

static enum status cmd_scan_units(const char *text, struct scan_config *config)
{
    char *end;

    config->first = 1;
    config->last = 247;
    if (text == NULL)
        return STATUS_OK;
    config->first = (unsigned)strtoul(text, &end, 10);
    config->last = config->first;
    if (*end == '-')
        config->last = (unsigned)strtoul(end + 1, &end, 10);
    if (*end == '\0' && config->first >= 1 && config->last <= 247 &&
        config->first <= config->last)
        return STATUS_OK;
    return cmd_scan_complain("--units: expected a number or a range in 1 .. "
                             "247, such as 1-32");
}

static enum status cmd_scan_read(const struct options *options,
                                 struct cmd_scan *self)
{
    enum status status = cmd_scan_bauds(options->bauds, &self->lines);

    if (status == STATUS_OK)
        status = cmd_scan_parities(options->parity, &self->lines);
    if (status == STATUS_OK)
        status = cmd_scan_units(options->units, &self->config);
    self->config.listen_ns =
        options->listen_ns > 0 ? options->listen_ns : CMD_SCAN_LISTEN_NS;
    return status;
}

/* ---- one bus, with one line setting ---- */

static void cmd_scan_progress(const char *what, unsigned at, unsigned of)
{
    if (isatty(STDERR_FILENO))
        fprintf(stderr, at == of ? "\r                    \r" : "\r%s %u of %u",
                what, at, of);
}

static enum status cmd_scan_bus(struct cmd_scan *self, const struct rig *rig,
                                unsigned bus)
{
    struct bench *bench = memory_new(1, sizeof *bench);
    char message[YAML_MESSAGE_MAX];
    int err;

    if (bench_open(bench, rig, bus, self->is_real, true, message) < 0) {
        error_say("%s", message);
        memory_free(bench);
        return STATUS_INPUT;
    }
    err = bench_is_can(bench) ? scan_can(&self->scan, bench, &self->config)
                              : scan_modbus(&self->scan, bench, &self->config);
    bench_close(bench);
    memory_free(bench);
    if (err == MOTION_OK)
        return STATUS_OK;
    error_say("slew scan: %s: %s", rig->bus[bus].name, motion_err_text(err));
    return STATUS_SYSTEM;
}

/* ---- all of them ---- */

/* Baud rates and parities only make sense for a real serial port. */
static enum status cmd_scan_line(struct cmd_scan *self, unsigned bus)
{
    struct rig_bus *const at = &self->rig.bus[bus];
    struct modbus_rtu_line *const line = &at->modbus.line;
    const struct rig_bus written = *at;
    enum status status = STATUS_OK;
    const struct cmd_scan_lines *lines = &self->lines;
    const unsigned bauds = lines->bauds > 0 ? lines->bauds : 1;
    const unsigned parities = lines->parities > 0 ? lines->parities : 1;

    for (unsigned i = 0; i < bauds * parities && status == STATUS_OK; i++) {
        *at = written;
        if (lines->bauds > 0)
            line->baud = lines->baud[i / parities];
        if (lines->parities > 0) {
            line->parity = lines->parity[i % parities];
            line->stop_bits = line->parity == MODBUS_PARITY_NONE ? 2 : 1;
        }
        at->bit_rate = line->baud;
        status = cmd_scan_bus(self, &self->rig, bus);
    }
    *at = written;
    return status;
}

static enum status cmd_scan_all(struct cmd_scan *self, int only)
{
    enum status status = STATUS_OK;

    for (unsigned bus = 0; bus < self->rig.bus_count && status == STATUS_OK;
         bus++) {
        if (only >= 0 && bus != (unsigned)only)
            continue;
        status = self->is_real && self->rig.bus[bus].kind == RIG_MODBUS_RTU
                     ? cmd_scan_line(self, bus)
                     : cmd_scan_bus(self, &self->rig, bus);
    }
    return status;
}

/* ---- what was found ---- */

static void cmd_scan_identity(struct table *table,
                              const struct scan_found *found)
{
    const struct canopen_identity *identity = &found->identity;

    if (found->has_identity)
        table_cell(table, "%" PRIX32 "/%" PRIX32 "/%" PRIX32 "/%" PRIu32,
                   identity->vendor, identity->product, identity->revision,
                   identity->serial);
    else
        table_cell(table, "%s", found->line);
}

static void cmd_scan_text(const struct scan *scan)
{
    static const char *const head[] = {
        "<bus",  ">id",    "<kind",    "<vendor/product/revision/serial",
        "<name", "<state", "<in a rig"
    };
    struct table table;

    table_init(&table, ARRAY_LEN(head), head);
    for (unsigned i = 0; i < scan->count; i++) {
        const struct scan_found *found = &scan->found[i];

        table_cell(&table, "%s", found->bus);
        if (!found->has_number)
            table_cell(&table, "-");
        else
            table_cell(&table, "%u", found->id);
        table_cell(&table, "%s", found->kind);
        cmd_scan_identity(&table, found);
        table_cell(&table, "%s", found->name);
        table_cell(&table, "%s", found->state);
        table_cell(&table, "%s", found->fits);
    }
    if (scan->count > 0)
        table_print(&table, stdout);
    table_free(&table);
    for (unsigned i = 0; i < scan->notes; i++)
        printf("note: %s\n", scan->note[i]);
    printf("%u found\n", scan->count);
}

static cJSON *cmd_scan_json_found(const struct scan_found *found)
{
    cJSON *object = cJSON_CreateObject();

    cJSON_AddStringToObject(object, "bus", found->bus);
    cJSON_AddStringToObject(object, "kind", found->kind);
    if (found->has_number)
        json_add_integer(object, "id", found->id);
    if (found->axis > 0)
        json_add_integer(object, "axis", found->axis);
    if (found->has_identity) {
        json_add_integer(object, "vendor", found->identity.vendor);
        json_add_integer(object, "product", found->identity.product);
        json_add_integer(object, "revision", found->identity.revision);
        json_add_integer(object, "serial", found->identity.serial);
    }
    if (found->line[0] != '\0')
        cJSON_AddStringToObject(object, "line", found->line);
    cJSON_AddStringToObject(object, "name", found->name);
    cJSON_AddStringToObject(object, "state", found->state);
    cJSON_AddStringToObject(object, "fits", found->fits);
    return object;
}

static void cmd_scan_json(const struct scan *scan)
{
    cJSON *report = cJSON_CreateObject();
    cJSON *found = cJSON_AddArrayToObject(report, "found");
    cJSON *notes = cJSON_AddArrayToObject(report, "notes");

    for (unsigned i = 0; i < scan->count; i++)
        cJSON_AddItemToArray(found, cmd_scan_json_found(&scan->found[i]));
    for (unsigned i = 0; i < scan->notes; i++)
        cJSON_AddItemToArray(notes, cJSON_CreateString(scan->note[i]));
    json_report(report, true);
}

/* ---- the command ---- */

static int cmd_scan_name(const struct options *options, struct cmd_scan *self,
                         char message[YAML_MESSAGE_MAX])
{
    const struct bench_line line = {
        .baud = self->lines.bauds > 0 ? self->lines.baud[0] : 0,
        .parity = self->lines.parities > 0 ? self->lines.parity[0]
                                           : MODBUS_PARITY_EVEN,
        .timeout_ns =
            options->timeout_ns > 0 ? options->timeout_ns : CMD_SCAN_TIMEOUT_NS,
    };

    if (bench_name(options->path[0], &line, &self->rig, &self->is_rig,
                   message) < 0)
        return -1;
    self->is_real = options->real || !self->is_rig;
    if (!self->is_rig || options->interface == NULL)
        return 0;
    return rig_set_interfaces(&self->rig, options->interface, message);
}

static enum status cmd_scan_run(const struct options *options)
{
    static struct cmd_scan self;
    char message[YAML_MESSAGE_MAX];
    int only = -1;
    enum status status;

    self = (struct cmd_scan){ .scan.progress = cmd_scan_progress };
    status = cmd_scan_read(options, &self);
    if (status != STATUS_OK)
        return status;
    if (cmd_scan_name(options, &self, message) < 0 ||
        (options->bus != NULL &&
         (only = session_bus(&self.rig, options->bus, false, message)) < 0)) {
        error_say("%s", message);
        return STATUS_INPUT;
    }
    status = cmd_scan_all(&self, only);
    if (status != STATUS_OK)
        return status;
    if (options->json)
        cmd_scan_json(&self.scan);
    else
        cmd_scan_text(&self.scan);
    return self.scan.count > 0 ? STATUS_OK : STATUS_REFUSED;
}

static const struct option_row cmd_scan_option[] = {
    OPTIONS_REAL("a rig's buses on its interfaces, not simulated ones"),
    OPTIONS_INTERFACE,
    { "bus", "NAME", OPTION_TEXT, offsetof(struct options, bus),
      "only this bus of the rig" },
    { "listen", "TIME", OPTION_TIME, offsetof(struct options, listen_ns),
      "CAN: for heartbeats, before anything is asked (1.2 s)" },
    { "units", "RANGE", OPTION_TEXT, offsetof(struct options, units),
      "Modbus: which units are asked (1-247)" },
    { "baud", "RATES", OPTION_TEXT, offsetof(struct options, bauds),
      "serial port: 9600,115200 or all (115200, or the rig's)" },
    { "parity", "WORD", OPTION_TEXT, offsetof(struct options, parity),
      "serial port: even, odd, none or all (even, or the rig's)" },
    { "timeout", "TIME", OPTION_TIME, offsetof(struct options, timeout_ns),
      "Modbus: how long a unit may take to answer (20 ms)" },
    OPTIONS_COMMON,
};

const struct command cmd_scan = {
    .name = "scan",
    .arguments = "RIG | DIRECTORY | CAN | SERIAL PORT | HOST:PORT",
    .summary = "who is on this bus",
    .text =
        "CAN: listens for heartbeats, then reads the identity of every node, "
        "and "
        "looks\n"
        "for a device that has no node number yet.  While another master is "
        "on\n"
        "the bus, or ODrives are, it only listens.\n"
        "\n"
        "Modbus: reads register 0 of every unit, then its identification; "
        "at\n"
        "every baud rate and parity that is named.  A unit that is not there\n"
        "costs its time-out and a silence: some 15 s for all at one setting.\n"
        "\n"
        "A rig's buses are simulated unless --real is given.  Only reads are\n"
        "sent, nothing moves.  The status is 1 when nothing was found.\n",
    .examples =
        "  slew scan can0\n"
        "  slew scan /dev/ttyUSB0 --baud all --parity all --units 1-16\n"
        "  slew scan 192.168.1.20:502 --units 1-10\n"
        "  slew scan --real --json rig.yaml\n",
    .path_max = 1,
    COMMAND_OPTIONS(cmd_scan_option),
    .run = cmd_scan_run,
};
