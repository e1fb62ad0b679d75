/* firmware/linux/kind/moteus/tool.c - a moteus asked by the tools: see
 * firmware/linux/tools/kind.h. */
#include <stdio.h>

#include "firmware/linux/kind/turn/tool.h"
#include "firmware/linux/tools/turn_client_parts.h"
#include "hal/drive/moteus/drive.h"
#include "hal/drive/moteus/frame.h"
#include "motion/core/err.h"

#define REFUSES_WRITE 0x30u
#define REFUSES_READ  0x31u

/* 11 bits say it when they can. */
static bool moteus_says(const struct turn_client *client,
                        const struct hal_can_frame *frame, const void *what)
{
    (void)what;
    return frame->fd && !frame->remote && frame->len > 0 &&
           frame->id == (uint32_t)client->node << 8;
}

/* Signs of what the tool has in mind do not matter on the wire. */
static enum moteus_type moteus_type_of(enum quantity_type type)
{
    static const enum moteus_type by_bytes[] = {
        [1] = MOTEUS_INT8, [2] = MOTEUS_INT16, [4] = MOTEUS_INT32
    };

    return type == QUANTITY_F32 ? MOTEUS_FLOAT
                                : by_bytes[quantity_type_size(type)];
}

static int moteus_exchange(struct turn_client *client,
                           struct hal_can_frame *frame,
                           struct hal_can_frame *answer)
{
    int err;

    moteus_frame_end(frame);
    err = turn_client_frame(client, frame, moteus_says, NULL,
                            client->timeout_ns, answer);
    if (err == MOTION_OK &&
        (answer->data[0] == REFUSES_WRITE || answer->data[0] == REFUSES_READ))
        return MOTION_E_REFUSED;
    return err;
}

static int moteus_read(struct turn_client *client,
                       const struct quantity *quantity, uint32_t *raw)
{
    struct hal_can_frame frame, answer;
    struct moteus_reader reader;
    struct moteus_value value;
    int err;

    moteus_frame_begin(&frame, client->node, client->switched);
    moteus_frame_read(&frame, moteus_type_of(quantity->type), quantity->at, 1);
    err = moteus_exchange(client, &frame, &answer);
    if (err < 0)
        return err;
    moteus_reader_begin(&reader, &answer);
    if (moteus_reader_next(&reader, &value) != 1 || value.reg != quantity->at)
        return MOTION_E_PROTOCOL;
    *raw = (uint32_t)value.raw;
    return MOTION_OK;
}

/* A write alone is not answered: the mode is asked for with it. */
static int moteus_write(struct turn_client *client,
                        const struct quantity *quantity, uint32_t raw)
{
    struct hal_can_frame frame, answer;

    moteus_frame_begin(&frame, client->node, client->switched);
    moteus_frame_write(&frame, moteus_type_of(quantity->type), quantity->at,
                       &raw, 1);
    moteus_frame_read(&frame, MOTEUS_INT8, MOTEUS_MODE, 1);
    return moteus_exchange(client, &frame, &answer);
}

static const struct quantity moteus_mode = { .kind = QUANTITY_REGISTER,
                                             .type = QUANTITY_I8,
                                             .at = MOTEUS_MODE };
static const struct quantity moteus_fault = { .kind = QUANTITY_REGISTER,
                                              .type = QUANTITY_I8,
                                              .at = MOTEUS_FAULT };

static int moteus_hello(struct turn_client *client)
{
    uint32_t mode;

    return moteus_read(client, &moteus_mode, &mode);
}

static int moteus_state(struct turn_client *client,
                        struct turn_client_state *state)
{
    uint32_t mode = 0;
    int err = moteus_read(client, &moteus_mode, &mode);

    if (err == MOTION_OK)
        err = moteus_read(client, &moteus_fault, &state->error);
    if (err < 0)
        return err;
    state->state = mode;
    state->is_fault = mode == MOTEUS_MODE_FAULT || mode == MOTEUS_MODE_TIMEOUT;
    state->has_torque = mode != MOTEUS_MODE_STOPPED && !state->is_fault;
    return MOTION_OK;
}

static int moteus_clear(struct turn_client *client)
{
    return moteus_write(client, &moteus_mode, MOTEUS_MODE_STOPPED);
}

static void moteus_reason(const struct turn_client *client,
                          const struct turn_client_state *state,
                          char text[TURN_CLIENT_REASON_MAX])
{
    (void)client;
    if (state->state == MOTEUS_MODE_TIMEOUT)
        snprintf(text, TURN_CLIENT_REASON_MAX,
                 "its watchdog ran out (mode 11)");
    else
        snprintf(text, TURN_CLIENT_REASON_MAX, "fault %u: %s",
                 (unsigned)state->error, drive_moteus_fault_text(state->error));
}

static const struct turn_client_family moteus_family = {
    .hello = moteus_hello,
    .read = moteus_read,
    .write = moteus_write,
    .state = moteus_state,
    .clear = moteus_clear,
    .state_text = drive_moteus_mode_text,
    .reason = moteus_reason,
};

/* ---- for the tools ---- */

static bool moteus_is_of(const struct hal_can_frame *frame, uint8_t *id,
                         uint8_t *state)
{
    return moteus_frame_is_hello(frame, id, state) && *id < 128;
}

static int moteus_take(struct rig_bus *bus, char message[YAML_MESSAGE_MAX])
{
    if (bus->data_bit_rate == 0)
        return session_refuse(message, bus->name,
                              "takes no FD frames, which a moteus speaks");
    bus->kind = RIG_CAN;
    return 0;
}

static int moteus_open(struct session *session,
                       const struct session_config *config,
                       char message[YAML_MESSAGE_MAX])
{
    return turn_open(session, config, &moteus_family, message);
}

const struct tool_kind tool_kind_moteus = {
    .word = "moteus",
    .number = "node",
    .first = 1,
    .last = 127,
    .expected = "is no moteus, expected 1 .. 127",
    .ear = { .text = "moteus",
             .is_of = moteus_is_of,
             .frames = 1,
             .client = moteus_frame_hello,
             .state_text = drive_moteus_mode_text },
    .take = moteus_take,
    .open = moteus_open,
    .is_enabled = turn_is_enabled,
    .text = turn_text,
    .reset = turn_reset,
};
