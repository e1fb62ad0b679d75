/* firmware/linux/tools/talk.c - see talk.h. */
#include "firmware/linux/tools/talk.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/quote.h"
#include "firmware/host/device/endpoints.h"
#include "firmware/linux/tools/kind.h"

int talk_refuse(char message[YAML_MESSAGE_MAX], const char *who,
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
        return talk_refuse(message, name, "is not a bus of the rig");
    if (count != 1)
        return talk_refuse(message, rig->title,
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

#define TALK_ROW(NAME, name) [RIG_##NAME] = &tool_kind_##name,
const struct tool_kind *const tool_kinds[] = { RIG_KIND_LIST(TALK_ROW) };

static int talk_unknown_kind(const char *word, char message[YAML_MESSAGE_MAX])
{
    const char *words[RIG_DRIVE_KINDS];
    char list[QUOTE_LIST_MAX], what[YAML_MESSAGE_MAX / 2];
    unsigned count = 0;

    for (unsigned i = 0; i < RIG_DRIVE_KINDS; i++)
        if (tool_kinds[i]->word != NULL)
            words[count++] = tool_kinds[i]->word;
    snprintf(what, sizeof what, "is not a kind of drive, expected %s",
             quote_list(list, words, count));
    return talk_refuse(message, word, what);
}

/* What an interface that no rig describes is taken for. */
static int talk_take_kind(struct talk *talk, const struct talk_config *config,
                          bool is_rig, char message[YAML_MESSAGE_MAX])
{
    struct rig_bus *bus = &talk->rig.bus[0];

    for (unsigned i = 0; i < RIG_DRIVE_KINDS && config->kind != NULL; i++) {
        const struct tool_kind *kind = tool_kinds[i];

        if (kind->word == NULL || strcmp(config->kind, kind->word) != 0)
            continue;
        if (is_rig || !rig_bus_is_can(bus))
            return talk_refuse(message, config->kind,
                               "is for a CAN interface that no rig describes");
        return kind->take(bus, message);
    }
    return config->kind == NULL ? 0 : talk_unknown_kind(config->kind, message);
}

static int talk_who(struct talk *talk, const struct talk_config *config,
                    bool is_rig, unsigned *bus, char message[YAML_MESSAGE_MAX])
{
    const int axis = is_rig ? rig_axis_index(&talk->rig, config->who) : -1;
    const int number = talk_number(config->who);
    int found;

    if (axis >= 0) {
        *bus = talk->rig.axis[axis].bus;
        talk->kind = tool_kinds[rig_kind_on(&talk->rig.bus[*bus])];
        talk->node = talk->rig.axis[axis].node_id;
        talk->node_axis = talk->rig.axis[axis].cia402.axis;
        return 0;
    }
    if (number < 0)
        return talk_refuse(
            message, config->who,
            is_rig ? "is neither an axis of the rig nor a node number, "
                     "expected one of them"
                   : "is no number of a node, expected 1 .. 127, "
                     "on Modbus 1 .. 247");
    found = talk_bus(&talk->rig, config->bus, false, message);
    if (found < 0)
        return -1;
    *bus = (unsigned)found;
    talk->kind = tool_kinds[rig_kind_on(&talk->rig.bus[found])];
    talk->node = (uint8_t)number;
    if (number < talk->kind->first || number > talk->kind->last)
        return talk_refuse(message, config->who, talk->kind->expected);
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
             talk->axis == NULL ? "" : " (", which, talk->kind->number,
             talk->node, talk->bench.rig.bus[0].name,
             talk->axis == NULL ? "" : ")");
}

/* ---- open and close ---- */

int talk_open(struct talk *talk, const struct talk_config *config,
              char message[YAML_MESSAGE_MAX])
{
    unsigned bus = 0;
    bool is_rig;

    talk->endpoints = NULL;
    talk->eds = NULL;
    talk->map = NULL;
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
    talk_find_axis(talk);
    if (talk->kind->open(talk, config, message) == 0)
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

int talk_is_enabled(struct talk *talk)
{
    return talk->kind->is_enabled(talk);
}

void talk_text(const struct talk *talk, int err, char text[TALK_TEXT_MAX])
{
    talk->kind->text(talk, err, text);
}
