/* firmware/linux/kind/slew_mcu/tool.c - a board asked by the tools: see
 * firmware/linux/tools/kind.h. */
#include <stdio.h>
#include <string.h>

#include "firmware/control/controller.h"
#include "firmware/linux/tools/kind.h"
#include "hal/mcu/piece.h"
#include "motion/core/err.h"

static int tool_read(struct session *session, uint16_t address, uint16_t count)
{
    const struct hal_modbus_request request = { .unit = session->node,
                                                .function = HAL_MODBUS_READ,
                                                .address = address,
                                                .count = count };

    return modbus_client(&session->line, &request);
}

static int slew_mcu_open(struct session *session,
                         const struct session_config *config,
                         char message[YAML_MESSAGE_MAX])
{
    (void)config;
    (void)message;
    modbus_client_init(&session->line, session->bench.ports.modbus[0],
                       session->bench.ports.clock, session->node);
    return 0;
}

static int slew_mcu_is_enabled(struct session *session)
{
    const int err =
        tool_read(session,
                  (uint16_t)(MCU_AT_AXIS + MCU_AXIS_STEP * session->node_axis +
                             MCU_AXIS_DRIVE),
                  1);
    const enum hal_drive_state state =
        (enum hal_drive_state)session->line.reply.value[0];

    return err < 0
               ? err
               : state == HAL_DRIVE_ENABLING || state == HAL_DRIVE_ENABLED ||
                     state == HAL_DRIVE_QUICK_STOP;
}

static void slew_mcu_text(const struct session *session, int err,
                          char text[SESSION_TEXT_MAX])
{
    modbus_client_text(&session->line, err, text);
}

/* ---- reset ---- */

/* Its state, and the command after the last one. */
static int reset_look(struct session *session, uint16_t state[MCU_STATE_WORDS])
{
    const int err = tool_read(session, MCU_AT_STATE, MCU_STATE_WORDS);

    memcpy(state, session->line.reply.value, MCU_STATE_WORDS * sizeof *state);
    return err;
}

static int reset_command(struct session *session, uint16_t sequence)
{
    struct hal_modbus_request request = { .unit = session->node,
                                          .function = HAL_MODBUS_WRITE_MANY,
                                          .address = MCU_AT_COMMAND,
                                          .count = MCU_COMMAND_WORDS };

    mcu_words_put(request.value, sequence == UINT16_MAX ? 1 : sequence + 1u, 1);
    mcu_words_put(request.value + 1, MCU_COMMAND_RESET, 1);
    return modbus_client(&session->line, &request);
}

static int slew_mcu_reset(struct session *session, struct reset *reset)
{
    uint16_t state[MCU_STATE_WORDS];
    int err = reset_look(session, state);

    if (err < 0)
        return err;
    reset->was_fault = state[MCU_STATE_STATE] == CONTROLLER_FAULT;
    if (reset->was_fault) {
        snprintf(reset->reason, sizeof reset->reason, "%s",
                 controller_fault_text(
                     (enum controller_fault)state[MCU_STATE_FAULT]));
        err = reset_command(session, state[MCU_STATE_SEQUENCE]);
        if (err == MOTION_OK)
            err = reset_look(session, state);
    }
    reset->is_fault = state[MCU_STATE_STATE] == CONTROLLER_FAULT;
    snprintf(
        reset->state, sizeof reset->state, "%s",
        controller_state_text((enum controller_state)state[MCU_STATE_STATE]));
    return err;
}

const struct tool_kind tool_kind_slew_mcu = {
    .number = "unit",
    .first = 1,
    .last = 247,
    .expected = "is no unit, expected 1 .. 247",
    .open = slew_mcu_open,
    .is_enabled = slew_mcu_is_enabled,
    .text = slew_mcu_text,
    .reset = slew_mcu_reset,
};
