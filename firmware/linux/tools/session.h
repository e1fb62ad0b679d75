/* firmware/linux/tools/session.h - one drive to be asked: an axis of a rig, or a
 * node of an interface, whatever it speaks.  Nothing here makes it move. */
#ifndef FIRMWARE_LINUX_TOOLS_SESSION_H
#define FIRMWARE_LINUX_TOOLS_SESSION_H

#include "firmware/host/device/eds.h"
#include "firmware/linux/tools/bench.h"
#include "firmware/linux/tools/canopen_client.h"
#include "firmware/linux/tools/modbus_client.h"
#include "firmware/linux/tools/turn_client.h"

#define SESSION_LABEL_MAX 96

struct tool_kind;

struct session_config {
    const char *target;    /* as bench_name takes it */
    const char *who;       /* an axis of the rig, or a node or unit number */
    const char *bus;       /* of a rig with several, when `who` is a number */
    const char *interface; /* other interfaces than the rig's, or NULL */
    const char *eds;       /* a data sheet, or NULL: the axis's own */
    const char *map;       /* a register map, or NULL: the axis's own */
    const char *endpoints; /* an ODrive's list, or NULL: the axis's own */
    const char *kind;      /* of a node of a CAN interface; NULL: canopen */
    bool is_real;          /* a rig's drives, not simulated ones */
    struct bench_line line;
};

struct session {
    struct rig rig;
    struct bench bench;
    const struct rig_axis *axis; /* in bench.rig; NULL: a node only */
    uint8_t node;
    uint8_t node_axis; /* of several behind a CANopen node, from 0 */
    const struct tool_kind *kind;
    const struct eds *eds;        /* NULL: none */
    const struct modbus_map *map; /* NULL: none */
    struct cJSON *endpoints;      /* NULL: none */
    struct eds sheet;
    struct modbus_map own_map;
    struct canopen_client can;
    struct modbus_client line;
    struct turn_client turn;
    char label[SESSION_LABEL_MAX]; /* "dolly (node 1 on can0)" */
};

/* The rig's axis that is this one of the node; NULL: it has none. */
const struct rig_axis *session_axis_of(const struct session *session,
                                       uint8_t node_axis);
/* Opens what is named and the drive's bus.  0, or -1 with a sentence; nothing
 * is open then. */
int session_open(struct session *session, const struct session_config *config,
                 char message[YAML_MESSAGE_MAX]);
void session_close(struct session *session);

/* Which bus of a rig is meant: the one of that name, or the only one (of CAN
 * when `can`).  Its number, or -1 with a sentence. */
int session_bus(const struct rig *rig, const char *name, bool can,
                char message[YAML_MESSAGE_MAX]);

/* May it have torque?  1 yes, 0 no, MOTION_E_EMPTY when it does not say, or
 * another error. */
int session_is_enabled(struct session *session);
/* Why a question was not answered, whatever the bus. */
#define SESSION_TEXT_MAX 80
void session_text(const struct session *session, int err,
                  char text[SESSION_TEXT_MAX]);

#endif
