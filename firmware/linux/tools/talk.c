/* firmware/linux/tools/talk.c - see talk.h. */
#include "firmware/linux/tools/talk.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/linux/rig/modbus_map_load.h"
#include "hal/drive_cia402.h"
#include "motion/err.h"

static int talk_fail(char message[RIG_MESSAGE_MAX], const char *who,
                     const char *what)
{
    snprintf(message, RIG_MESSAGE_MAX, "'%.60s' %s", who, what);
    return -1;
}

/* ---- who is meant ---- */

int talk_bus(const struct rig *rig, const char *name, bool can,
             char message[RIG_MESSAGE_MAX])
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
        return talk_fail(message, name, "is no bus of the rig");
    if (count != 1)
        return talk_fail(message, rig->title,
                         "has not exactly one such bus, expected --bus NAME");
    return only;
}

/* A node or unit number; 0: none. */
static uint8_t talk_number(const char *text, unsigned most)
{
    char *end;
    const unsigned long number = strtoul(text, &end, 10);

    if (end == text || *end != '\0' || number < 1 || number > most)
        return 0;
    return (uint8_t)number;
}

static int talk_who(struct talk *talk, const struct talk_config *config,
                    bool is_rig, unsigned *bus, char message[RIG_MESSAGE_MAX])
{
    const int axis = is_rig ? rig_axis_index(&talk->rig, config->who) : -1;
    int found;

    if (axis >= 0) {
        *bus = talk->rig.axis[axis].bus;
        talk->node = talk->rig.axis[axis].node_id;
        return 0;
    }
    talk->node = talk_number(config->who, 255);
    if (talk->node == 0)
        return talk_fail(message, config->who,
                         is_rig ? "is no axis of the rig and no number"
                                : "is no number of a node, expected 1 .. 127, "
                                  "on Modbus 1 .. 247");
    found = talk_bus(&talk->rig, config->bus, false, message);
    if (found < 0)
        return -1;
    *bus = (unsigned)found;
    if (talk->rig.bus[found].kind == RIG_CANOPEN ? talk->node > 127
                                                 : talk->node > 247)
        return talk_fail(message, config->who,
                         "is no node, expected 1 .. 127, on Modbus 1 .. 247");
    return 0;
}

static void talk_find_axis(struct talk *talk)
{
    talk->axis = NULL;
    for (unsigned i = 0; i < talk->bench.rig.axis_count; i++)
        if (talk->bench.rig.axis[i].node_id == talk->node)
            talk->axis = &talk->bench.rig.axis[i];
    snprintf(talk->label, sizeof talk->label, "%s%s%s %u on %.40s%s",
             talk->axis == NULL ? "" : talk->axis->name,
             talk->axis == NULL ? "" : " (", talk->is_modbus ? "unit" : "node",
             talk->node, talk->bench.rig.bus[0].name,
             talk->axis == NULL ? "" : ")");
}

/* ---- what is known about it ---- */

static int talk_sheet(struct talk *talk, const struct talk_config *config,
                      char message[RIG_MESSAGE_MAX])
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
                    char message[RIG_MESSAGE_MAX])
{
    char path[MODBUS_MAP_PATH_MAX];

    talk->map = NULL;
    if (config->map != NULL) {
        if (modbus_map_find(config->map, "./", path) < 0)
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

/* ---- open and close ---- */

static int talk_know(struct talk *talk, const struct talk_config *config,
                     char message[RIG_MESSAGE_MAX])
{
    talk_find_axis(talk);
    if (talk->is_modbus) {
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
              char message[RIG_MESSAGE_MAX])
{
    unsigned bus = 0;
    bool is_rig;

    if (bench_name(config->target, &config->line, &talk->rig, &is_rig,
                   message) < 0 ||
        (is_rig && config->interface != NULL &&
         rig_set_interfaces(&talk->rig, config->interface, message) < 0) ||
        talk_who(talk, config, is_rig, &bus, message) < 0)
        return -1;
    if (talk->rig.bus[bus].kind == RIG_CAN)
        return talk_fail(message, talk->rig.bus[bus].name,
                         "is a CAN bus without CANopen, whose drives have "
                         "objects and registers of their own");
    talk->is_modbus = talk->rig.bus[bus].kind != RIG_CANOPEN;
    if (bench_open(&talk->bench, &talk->rig, bus, config->is_real || !is_rig,
                   message) < 0)
        return -1;
    if (talk_know(talk, config, message) == 0)
        return 0;
    talk_close(talk);
    return -1;
}

void talk_close(struct talk *talk)
{
    bench_close(&talk->bench);
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

int talk_is_enabled(struct talk *talk)
{
    bool met = false;
    int err;

    if (!talk->is_modbus)
        return talk_cia402_enabled(talk);
    if (talk->map == NULL)
        return MOTION_E_EMPTY;
    err =
        ask_modbus_status(&talk->line, talk->map, MODBUS_STATUS_enabled, &met);
    return err < 0 ? err : met;
}

void talk_text(const struct talk *talk, int err, char text[TALK_TEXT_MAX])
{
    if (talk->is_modbus)
        ask_modbus_text(&talk->line, err, text);
    else
        ask_can_text(&talk->can, err, text);
}
