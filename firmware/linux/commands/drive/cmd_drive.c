/* firmware/linux/commands/drive/cmd_drive.c - slew drive: look at one drive, read and
 * write what it is set to, clear its fault. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/drive/kind.h"

#define CMD_DRIVE_PATHS 12

static const struct {
    const char *name;
    int least, most; /* arguments after it */
    enum status (*run)(const struct options *options);
    const char *expected;
} cmd_drive_verb[] = {
    { "info", 2, 2, drive_info, "RIG AXIS, BUS NODE, or an EDS or DCF file" },
    { "get", 3, CMD_DRIVE_PATHS - 1, drive_get,
      "RIG AXIS or BUS NODE, then what is to be read" },
    { "set", 3, 4, drive_set,
      "RIG AXIS or BUS NODE, then an object or register and its value" },
    { "store", 2, 2, drive_store, "RIG AXIS or BUS NODE" },
    { "reset", 2, 2, drive_reset, "RIG AXIS or BUS NODE" },
    { "lss", 2, 3, drive_lss,
      "RIG or BUS, then scan, node NUMBER, rate BIT/S or store" },
};
#define CMD_DRIVE_VERBS ARRAY_LEN(cmd_drive_verb)

static enum status cmd_drive_run(const struct options *options)
{
    const int count = options->path_count - 1;

    if (strcmp(options->path[0], "info") == 0 && count == 1)
        return drive_sheet(options);
    for (size_t i = 0; i < CMD_DRIVE_VERBS; i++) {
        if (strcmp(options->path[0], cmd_drive_verb[i].name) != 0)
            continue;
        if (count >= cmd_drive_verb[i].least && count <= cmd_drive_verb[i].most)
            return cmd_drive_verb[i].run(options);
        error_say("slew drive %s: expected %s; see slew drive --help",
                  cmd_drive_verb[i].name, cmd_drive_verb[i].expected);
        return STATUS_INPUT;
    }
    error_say("slew drive: no verb '%.40s', expected info, get, set, "
              "store, reset or lss",
              options->path[0]);
    return STATUS_INPUT;
}

static const struct option_row cmd_drive_option[] = {
    OPTIONS_REAL("a rig's drives on its interfaces, not simulated ones"),
    OPTIONS_INTERFACE,
    { "bus", "NAME", OPTION_TEXT, offsetof(struct options, bus),
      "which bus of the rig, when a node is given and not an axis" },
    { "eds", "FILE", OPTION_TEXT, offsetof(struct options, sheet),
      "the drive's data sheet, for names, types and ranges" },
    { "map", "NAME", OPTION_TEXT, offsetof(struct options, map),
      "the drive's register map, on Modbus" },
    { "kind", "WORD", OPTION_TEXT, offsetof(struct options, kind),
      "of a node of a CAN interface: canopen (else), or one of those above" },
    { "endpoints", "FILE", OPTION_TEXT, offsetof(struct options, endpoints),
      "the drive's own list of parameters, for names and types" },
    { "type", "TYPE", OPTION_TEXT, offsetof(struct options, type),
      "u8, i8, u16, i16, u32, i32, on Modbus f32; where unknown" },
    { "baud", "RATE", OPTION_COUNT, offsetof(struct options, baud),
      "of a serial port that no rig describes (115200)" },
    { "parity", "WORD", OPTION_TEXT, offsetof(struct options, parity),
      "even, odd or none, likewise (even)" },
    { "timeout", "TIME", OPTION_TIME, offsetof(struct options, timeout_ns),
      "for each answer (CANopen 200 ms, Modbus 50 ms)" },
    { "identity", "NUMBERS", OPTION_TEXT, offsetof(struct options, identity),
      "lss: only the device VENDOR,PRODUCT,REVISION,SERIAL" },
    { "store", NULL, OPTION_FLAG, offsetof(struct options, store),
      "set, lss: keep it over power-off" },
    OPTIONS_YES(
        "write also to a drive that does not say whether it is enabled"),
    OPTIONS_COMMON,
};

/* What WHAT is of the kinds that say it. */
static void cmd_drive_kinds(FILE *file)
{
    for (unsigned i = 0; i < RIG_DRIVE_KINDS; i++)
        if (verb_kinds[i]->what != NULL)
            fprintf(file, "  --kind %-8s %s\n", tool_kinds[i]->word,
                    verb_kinds[i]->what);
}

const struct command cmd_drive = {
    .name = "drive",
    .arguments = "VERB RIG AXIS | VERB BUS NODE | info FILE.eds",
    .summary = "look at one drive, read and write its parameters",
    .text =
        "  info RIG AXIS              who it is, what it is set to, its "
        "errors\n"
        "  info FILE.eds              will it do, from the maker's data sheet\n"
        "  get RIG AXIS WHAT ...      read objects or registers\n"
        "  set RIG AXIS WHAT VALUE    write one and read it back (WHAT=VALUE)\n"
        "  store RIG AXIS             keep what was set over power-off\n"
        "  reset RIG AXIS             say why it is in fault, clear that\n"
        "  lss BUS scan               a device without node number\n"
        "  lss BUS node NUMBER        give it one\n"
        "  lss BUS rate BIT/S         give it a bit rate\n"
        "  lss BUS store              keep both over power-off\n"
        "\n"
        "RIG AXIS is an axis of a rig: simulated, or with --real the drive on\n"
        "its bus.  In their place a CAN interface and a node, a serial port "
        "and\n"
        "a unit, or HOST:PORT and a unit.  WHAT is an object, 6041 or 607D:1,\n"
        "or its name in the data sheet; on Modbus a register of the map, or "
        "an\n"
        "address such as 0x6002; of other kinds of drive see below.\n"
        "Nothing moves: while the drive may have torque nothing is written.\n",
    .examples = "  slew drive info servo.eds\n"
                "  slew drive info --real rig.yaml dolly\n"
                "  slew drive get can0 5 statusword 6064 --eds servo.eds\n"
                "  slew drive set --real rig.yaml dolly 6065 20000 --store\n"
                "  slew drive get /dev/ttyUSB0 1 position --map "
                "leadshine-el7\n"
                "  slew drive lss can0 node 5 --store\n",
    .more = cmd_drive_kinds,
    .path_max = CMD_DRIVE_PATHS,
    COMMAND_OPTIONS(cmd_drive_option),
    .run = cmd_drive_run,
};
