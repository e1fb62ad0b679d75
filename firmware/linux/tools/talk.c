/* firmware/linux/tools/talk.c - see talk.h. */
#include "firmware/linux/tools/talk.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/device/endpoints.h"
#include "firmware/host/device/modbus_map_load.h"
#include "firmware/host/device/own_file.h"
#include "hal/drive/cia402/drive.h"
#include "motion/core/err.h"

static int talk_fail(char message[YAML_MESSAGE_MAX], const char *who,
                     const char *what)
{
    snprintf(message, YAML_MESSAGE_MAX, "'%.60s' %s", who, what);
    return -1;
}

/* ---- who is meant ---- */

int talk_bus(const struct rig *rig, const char *name, bool can,
             char message[YAML_MESSAGE_MAX])
{
    int only = -1;
    unsigned count = 0;

    for (unsigned i = 0; i < rig->bus_count; i++) {
        if (name != NULL && strcmp(rig->bus[i].name, name) == 0)
            return (int)i;
        if (can && rig->bus[i].kind != RIG_CANOPEN)
            continue;
        only = (int)i;
        count++;
    }
    if (name != NULL)
        return talk_fail(message, name, "is not a bus of the rig");
    if (count != 1)
        return talk_fail(message, rig->title,
                         "has no such bus, or several, expected --bus NAME");
    return only;
}

/* A node or unit number, -1: none. */
static int talk_number(const char *text)
{
    char *end;
    const unsigned long number = strtoul(text, &end, 10);

    return end == text || *end != '\0' || number > UINT8_MAX ? -1 : (int)number;
}

static const struct {
    const char *word; /* of --kind; NULL: not of a CAN interface */
    uint8_t first, last;
    const char *expected;
} talk_kinds[] = {
    [TALK_CANOPEN] = { "canopen", 1, 127, "is no node, expected 1 .. 127" },
    [TALK_MODBUS] = { NULL, 1, 247, "is no unit, expected 1 .. 247" },
    [TALK_ODRIVE] = { "odrive", 0, 62, "is no ODrive, expected 0 .. 62" },
    [TALK_MOTEUS] = { "moteus", 1, 127, "is no moteus, expected 1 .. 127" },
};
#define TALK_KINDS ARRAY_LEN(talk_kinds)

/* Of the drives on a bus there is one kind only. */
static enum talk_kind talk_kind_of(const struct rig_bus *bus)
{
    if (bus->kind == RIG_CANOPEN)
        return TALK_CANOPEN;
    if (bus->kind != RIG_CAN)
        return TALK_MODBUS;
    return bus->data_bit_rate > 0 ? TALK_MOTEUS : TALK_ODRIVE;
}

/* What an interface that no rig describes is taken for. */
static int talk_take_kind(struct talk *talk, const struct talk_config *config,
                          bool is_rig, char message[YAML_MESSAGE_MAX])
{
    struct rig_bus *bus = &talk->rig.bus[0];

    for (unsigned i = 0; i < TALK_KINDS && config->kind != NULL; i++) {
        if (talk_kinds[i].word == NULL ||
            strcmp(config->kind, talk_kinds[i].word) != 0)
            continue;
        if (is_rig || !rig_bus_is_can(bus))
            return talk_fail(message, config->kind,
                             "is for a CAN interface that no rig describes");
        if (i == TALK_MOTEUS && bus->data_bit_rate == 0)
            return talk_fail(message, bus->name,
                             "takes no FD frames, which a moteus speaks");
        if (i == TALK_ODRIVE)
            bus->data_bit_rate = 0;
        bus->kind = i == TALK_CANOPEN ? RIG_CANOPEN : RIG_CAN;
        return 0;
    }
    return config->kind == NULL ? 0
                                : talk_fail(message, config->kind,
                                            "is not a kind of drive, expected "
                                            "canopen, odrive or moteus");
}

static int talk_who(struct talk *talk, const struct talk_config *config,
                    bool is_rig, unsigned *bus, char message[YAML_MESSAGE_MAX])
{
    const int axis = is_rig ? rig_axis_index(&talk->rig, config->who) : -1;
    const int number = talk_number(config->who);
    int found;

    if (axis >= 0) {
        *bus = talk->rig.axis[axis].bus;
        talk->kind = talk_kind_of(&talk->rig.bus[*bus]);
        talk->node = talk->rig.axis[axis].node_id;
        talk->node_axis = talk->rig.axis[axis].cia402.axis;
        return 0;
    }
    if (number < 0)
        return talk_fail(
            message, config->who,
            is_rig ? "is neither an axis of the rig nor a node number, "
                     "expected one of them"
                   : "is no number of a node, expected 1 .. 127, "
                     "on Modbus 1 .. 247");
    found = talk_bus(&talk->rig, config->bus, false, message);
    if (found < 0)
        return -1;
    *bus = (unsigned)found;
    talk->kind = talk_kind_of(&talk->rig.bus[found]);
    talk->node = (uint8_t)number;
    if (number < talk_kinds[talk->kind].first ||
        number > talk_kinds[talk->kind].last)
        return talk_fail(message, config->who, talk_kinds[talk->kind].expected);
    return 0;
}

const struct rig_axis *talk_axis_of(const struct talk *talk, uint8_t node_axis)
{
    const struct rig *rig = &talk->bench.rig;

    for (unsigned i = 0; i < rig->axis_count; i++)
        if (rig->axis[i].node_id == talk->node &&
            rig->axis[i].cia402.axis == node_axis)
            return &rig->axis[i];
    return NULL;
}

static void talk_find_axis(struct talk *talk)
{
    char which[sizeof "axis 8 of "] = "";

    talk->axis = talk_axis_of(talk, talk->node_axis);
    if (talk->node_axis > 0)
        snprintf(which, sizeof which, "axis %u of ",
                 (talk->node_axis & 7u) + 1u);
    snprintf(talk->label, sizeof talk->label, "%s%s%s%s %u on %.40s%s",
             talk->axis == NULL ? "" : talk->axis->name,
             talk->axis == NULL ? "" : " (", which,
             talk->kind == TALK_MODBUS ? "unit" : "node", talk->node,
             talk->bench.rig.bus[0].name, talk->axis == NULL ? "" : ")");
}

/* ---- what is known about it ---- */

static int talk_sheet(struct talk *talk, const struct talk_config *config,
                      char message[YAML_MESSAGE_MAX])
{
    const char *path = config->eds;

    talk->eds = NULL;
    if (path == NULL && talk->axis != NULL && talk->axis->eds[0] != '\0')
        path = talk->axis->eds;
    if (path == NULL)
        return 0;
    if (eds_load(path, &talk->sheet, message) < 0)
        return -1;
    talk->eds = &talk->sheet;
    return 0;
}

static int talk_map(struct talk *talk, const struct talk_config *config,
                    char message[YAML_MESSAGE_MAX])
{
    char path[OWN_FILE_PATH_MAX];

    talk->map = NULL;
    if (config->map != NULL) {
        if (own_file_find(OWN_FILE_MAPS, config->map, "./", path) < 0)
            return talk_fail(message, config->map,
                             "is no register map that can be read");
        if (modbus_map_load(path, &talk->own_map, message) < 0)
            return -1;
        talk->map = &talk->own_map;
    } else if (talk->axis != NULL && talk->axis->kind == RIG_MODBUS) {
        talk->map = &talk->bench.rig.map[talk->axis->map];
    }
    return 0;
}

static int talk_endpoints(struct talk *talk, const struct talk_config *config,
                          char message[YAML_MESSAGE_MAX])
{
    const char *path = config->endpoints;

    if (path == NULL && talk->axis != NULL && talk->axis->endpoints[0] != '\0')
        path = talk->axis->endpoints;
    if (path == NULL)
        return 0;
    talk->endpoints = endpoints_open(path);
    return talk->endpoints != NULL
               ? 0
               : talk_fail(message, path, "is no JSON file that can be read");
}

/* ---- open and close ---- */

static void talk_know_turns(struct talk *talk, const struct talk_config *config)
{
    const struct rig_bus *bus = &talk->bench.rig.bus[0];

    ask_turns_init(&talk->turns, talk->bench.ports.can[0],
                   talk->bench.ports.clock, config->line.timeout_ns);
    talk->turns.node = talk->node;
    talk->turns.is_moteus = talk->kind == TALK_MOTEUS;
    talk->turns.switched = bus->data_bit_rate > bus->bit_rate;
    if (!talk->bench.is_real)
        ask_turns_wait(&talk->turns, BENCH_BOOT_NS);
}

static int talk_know(struct talk *talk, const struct talk_config *config,
                     char message[YAML_MESSAGE_MAX])
{
    talk_find_axis(talk);
    if (talk_is_turns(talk)) {
        talk_know_turns(talk, config);
        return talk_endpoints(talk, config, message);
    }
    if (talk->kind == TALK_MODBUS) {
        ask_modbus_init(&talk->line, talk->bench.ports.modbus[0],
                        talk->bench.ports.clock, talk->node);
        return talk_map(talk, config, message);
    }
    ask_can_init(&talk->can, talk->bench.ports.can[0], talk->bench.ports.clock,
                 config->line.timeout_ns);
    (void)ask_can_node(&talk->can, talk->node);
    if (!talk->bench.is_real)
        ask_can_wait(&talk->can, BENCH_BOOT_NS);
    return talk_sheet(talk, config, message);
}

int talk_open(struct talk *talk, const struct talk_config *config,
              char message[YAML_MESSAGE_MAX])
{
    unsigned bus = 0;
    bool is_rig;

    talk->endpoints = NULL;
    talk->node_axis = 0;
    if (bench_name(config->target, &config->line, &talk->rig, &is_rig,
                   message) < 0 ||
        (is_rig && config->interface != NULL &&
         rig_set_interfaces(&talk->rig, config->interface, message) < 0) ||
        talk_take_kind(talk, config, is_rig, message) < 0 ||
        talk_who(talk, config, is_rig, &bus, message) < 0 ||
        bench_open(&talk->bench, &talk->rig, bus, config->is_real || !is_rig,
                   message) < 0) {
        rig_free(&talk->rig);
        return -1;
    }
    if (talk_know(talk, config, message) == 0)
        return 0;
    talk_close(talk);
    return -1;
}

void talk_close(struct talk *talk)
{
    bench_close(&talk->bench);
    rig_free(&talk->rig);
    endpoints_close(talk->endpoints);
    talk->endpoints = NULL;
}

/* ---- questions ---- */

static int talk_cia402_enabled(struct talk *talk)
{
    uint32_t value = 0;
    const int err = ask_can_read_number(&talk->can, 0x6041, 0, &value, NULL);

    if (err < 0)
        return err == MOTION_E_REFUSED ? MOTION_E_EMPTY : err;
    const enum cia402_state state = cia402_state_of((uint16_t)value);
    return state == CIA402_OPERATION_ENABLED ||
           state == CIA402_QUICK_STOP_ACTIVE || state == CIA402_FAULT_REACTION;
}

static int talk_turns_enabled(struct talk *talk)
{
    struct ask_turns_state state;
    const int err = ask_turns_state(&talk->turns, &state);

    return err < 0 ? err : state.has_torque;
}

int talk_is_enabled(struct talk *talk)
{
    bool met = false;
    int err;

    if (talk_is_turns(talk))
        return talk_turns_enabled(talk);
    if (talk->kind == TALK_CANOPEN)
        return talk_cia402_enabled(talk);
    if (talk->map == NULL)
        return MOTION_E_EMPTY;
    err =
        ask_modbus_status(&talk->line, talk->map, MODBUS_STATUS_enabled, &met);
    return err < 0 ? err : met;
}

void talk_text(const struct talk *talk, int err, char text[TALK_TEXT_MAX])
{
    if (talk_is_turns(talk))
        ask_turns_text(&talk->turns, err, text);
    else if (talk->kind == TALK_MODBUS)
        ask_modbus_text(&talk->line, err, text);
    else
        ask_can_text(&talk->can, err, text);
}
