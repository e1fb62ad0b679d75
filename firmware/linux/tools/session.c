/* firmware/linux/tools/session.c - see session.h. */
#include "firmware/linux/tools/session.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/quote.h"
#include "firmware/host/device/endpoints.h"
#include "firmware/linux/tools/kind.h"

int session_refuse(char message[YAML_MESSAGE_MAX], const char *who,
                   const char *what)
{
    snprintf(message, YAML_MESSAGE_MAX, "'%.60s' %s", who, what);
    return -1;
}

/* ---- who is meant ---- */

int session_bus(const struct rig *rig, const char *name, bool can,
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
        return session_refuse(message, name, "is not a bus of the rig");
    if (count != 1)
        return session_refuse(
            message, rig->title,
            "has no bus of that kind, or several, expected --bus NAME");
    return only;
}

/* A node or unit number, -1: none. */
static int session_number(const char *text)
{
    char *end;
    const unsigned long number = strtoul(text, &end, 10);

    return end == text || *end != '\0' || number > UINT8_MAX ? -1 : (int)number;
}

#define SESSION_ROW(NAME, name, word) [RIG_##NAME] = &tool_kind_##name,
const struct tool_kind *const tool_kinds[] = { RIG_KIND_LIST(SESSION_ROW) };

static int session_unknown_kind(const char *word,
                                char message[YAML_MESSAGE_MAX])
{
    const char *words[RIG_DRIVE_KINDS];
    char list[QUOTE_LIST_MAX], what[YAML_MESSAGE_MAX / 2];
    unsigned count = 0;

    for (unsigned i = 0; i < RIG_DRIVE_KINDS; i++)
        if (tool_kinds[i]->word != NULL)
            words[count++] = tool_kinds[i]->word;
    snprintf(what, sizeof what, "is not a kind of drive, expected %s",
             quote_list(list, words, count));
    return session_refuse(message, word, what);
}

/* What an interface that no rig describes is taken for. */
static int session_take_kind(struct session *session,
                             const struct session_config *config, bool is_rig,
                             char message[YAML_MESSAGE_MAX])
{
    struct rig_bus *bus = session->rig.bus;

    for (unsigned i = 0; i < RIG_DRIVE_KINDS && config->kind != NULL; i++) {
        const struct tool_kind *kind = tool_kinds[i];

        if (kind->word == NULL || strcmp(config->kind, kind->word) != 0)
            continue;
        if (is_rig || !rig_bus_is_can(bus))
            return session_refuse(
                message, config->kind,
                "is for a CAN interface that no rig describes");
        return kind->take(bus, message);
    }
    return config->kind == NULL ? 0
                                : session_unknown_kind(config->kind, message);
}

static int session_who(struct session *session,
                       const struct session_config *config, bool is_rig,
                       unsigned *bus, char message[YAML_MESSAGE_MAX])
{
    const int axis = is_rig ? rig_axis_index(&session->rig, config->who) : -1;
    const int number = session_number(config->who);
    int found;

    if (axis >= 0) {
        if (rig_axis_is_virtual(&session->rig.axis[axis]))
            return session_refuse(message, config->who,
                                  "is a virtual axis, which has no drive");
        *bus = session->rig.axis[axis].bus;
        session->kind = tool_kinds[session->rig.axis[axis].kind];
        session->node = session->rig.axis[axis].node_id;
        session->node_axis = session->rig.axis[axis].node_axis;
        return 0;
    }
    if (number < 0)
        return session_refuse(
            message, config->who,
            is_rig ? "is neither an axis of the rig nor a node number, "
                     "expected one of them"
                   : "is no number of a node, expected 1 .. 127, "
                     "on Modbus 1 .. 247");
    found = session_bus(&session->rig, config->bus, false, message);
    if (found < 0)
        return -1;
    *bus = (unsigned)found;
    session->kind = tool_kinds[rig_kind_on(&session->rig.bus[found])];
    session->node = (uint8_t)number;
    if (number < session->kind->first || number > session->kind->last)
        return session_refuse(message, config->who, session->kind->expected);
    return 0;
}

const struct rig_axis *session_axis_of(const struct session *session,
                                       uint8_t node_axis)
{
    const struct rig *rig = &session->bench.rig;

    for (unsigned i = 0; i < rig->axis_count; i++)
        if (rig->axis[i].node_id == session->node &&
            rig->axis[i].node_axis == node_axis)
            return &rig->axis[i];
    return NULL;
}

static void session_find_axis(struct session *session)
{
    char which[sizeof "axis 8 of "] = "";

    session->axis = session_axis_of(session, session->node_axis);
    if (session->node_axis > 0)
        snprintf(which, sizeof which, "axis %u of ",
                 (session->node_axis & 7u) + 1u);
    snprintf(session->label, sizeof session->label, "%s%s%s%s %u on %.40s%s",
             session->axis == NULL ? "" : session->axis->name,
             session->axis == NULL ? "" : " (", which, session->kind->number,
             session->node, session->bench.rig.bus[0].name,
             session->axis == NULL ? "" : ")");
}

/* ---- open and close ---- */

int session_open(struct session *session, const struct session_config *config,
                 char message[YAML_MESSAGE_MAX])
{
    unsigned bus = 0;
    bool is_rig;

    session->endpoints = NULL;
    session->eds = NULL;
    session->sheet = (struct eds){ .count = 0 };
    session->map = NULL;
    session->node_axis = 0;
    if (bench_name(config->target, &config->line, &session->rig, &is_rig,
                   message) < 0 ||
        (is_rig && config->interface != NULL &&
         rig_set_interfaces(&session->rig, config->interface, message) < 0) ||
        session_take_kind(session, config, is_rig, message) < 0 ||
        session_who(session, config, is_rig, &bus, message) < 0 ||
        bench_open(&session->bench, &session->rig, bus,
                   config->is_real || !is_rig,
                   !is_rig || rig_axis_index(&session->rig, config->who) < 0,
                   message) < 0) {
        rig_free(&session->rig);
        return -1;
    }
    session_find_axis(session);
    if (session->kind->open(session, config, message) == 0)
        return 0;
    session_close(session);
    return -1;
}

void session_close(struct session *session)
{
    bench_close(&session->bench);
    rig_free(&session->rig);
    eds_free(&session->sheet);
    endpoints_close(session->endpoints);
    session->endpoints = NULL;
}

/* ---- questions ---- */

int session_is_enabled(struct session *session)
{
    return session->kind->is_enabled(session);
}

void session_text(const struct session *session, int err,
                  char text[SESSION_TEXT_MAX])
{
    session->kind->text(session, err, text);
}
