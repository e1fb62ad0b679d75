/* firmware/linux/kind/modbus/tool.c - a Modbus servo asked by the tools: see
 * firmware/linux/tools/kind.h. */
#include <inttypes.h>
#include <stdio.h>

#include "firmware/host/device/modbus_map_load.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/tools/kind.h"
#include "motion/core/err.h"

/* ---- open ---- */

static int modbus_find_map(struct session *session,
                           const struct session_config *config,
                           char message[YAML_MESSAGE_MAX])
{
    char path[FILES_PATH_MAX];

    if (config->map != NULL) {
        if (!disk_files.find(&disk_files, FILES_MAPS, config->map, "./", path))
            return session_refuse(message, config->map,
                                  "is no register map that can be read");
        if (modbus_map_load(&disk_files, path, &session->own_map, message) < 0)
            return -1;
        session->map = &session->own_map;
    } else if (session->axis != NULL && session->axis->kind == RIG_MODBUS) {
        session->map = &session->bench.rig.map[session->axis->map];
    }
    return 0;
}

static int modbus_open(struct session *session,
                       const struct session_config *config,
                       char message[YAML_MESSAGE_MAX])
{
    modbus_client_init(&session->line, session->bench.ports.modbus[0],
                       session->bench.ports.clock, session->node);
    return modbus_find_map(session, config, message);
}

static int modbus_is_enabled(struct session *session)
{
    bool met = false;
    int err;

    if (session->map == NULL)
        return MOTION_E_EMPTY;
    err = modbus_client_status(&session->line, session->map,
                               MODBUS_STATUS_enabled, &met);
    return err < 0 ? err : met;
}

static void modbus_text(const struct session *session, int err,
                        char text[SESSION_TEXT_MAX])
{
    modbus_client_text(&session->line, err, text);
}

/* ---- reset ---- */

static void reset_alarm(struct session *session, struct reset *reset)
{
    const struct modbus_map *map = session->map;
    const char *text;
    int64_t code = 0;

    if (map->alarm == MODBUS_MAP_NO_ITEM ||
        modbus_client_read_item(&session->line, &map->item[map->alarm], &code) <
            0) {
        snprintf(reset->reason, sizeof reset->reason, "it does not say why");
        return;
    }
    text = modbus_map_alarm_text(map, (uint32_t)code);
    snprintf(reset->reason, sizeof reset->reason, "alarm 0x%" PRIX64 ": %s",
             code, text == NULL ? "it is not in the map" : text);
}

static int modbus_reset(struct session *session, struct reset *reset)
{
    int err;

    if (session->map == NULL)
        return MOTION_E_EMPTY;
    err = modbus_client_status(&session->line, session->map,
                               MODBUS_STATUS_fault, &reset->was_fault);
    if (err < 0)
        return err;
    reset->is_fault = reset->was_fault;
    if (reset->was_fault) {
        reset_alarm(session, reset);
        err = modbus_client_sequence(&session->line, session->map,
                                     MODBUS_SEQUENCE_reset);
        if (err == MOTION_OK)
            err = modbus_client_status(&session->line, session->map,
                                       MODBUS_STATUS_fault, &reset->is_fault);
    }
    snprintf(reset->state, sizeof reset->state, "%s",
             reset->is_fault ? "fault" : "no fault");
    return err;
}

const struct tool_kind tool_kind_modbus = {
    .number = "unit",
    .first = 1,
    .last = 247,
    .expected = "is no unit, expected 1 .. 247",
    .open = modbus_open,
    .is_enabled = modbus_is_enabled,
    .text = modbus_text,
    .reset = modbus_reset,
};
