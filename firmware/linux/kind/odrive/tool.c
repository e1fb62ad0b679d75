/* firmware/linux/kind/odrive/tool.c - an ODrive asked by the tools: see
 * firmware/linux/tools/kind.h. */
#include <stdio.h>
#include <string.h>

#include "firmware/linux/kind/turn/tool.h"
#include "firmware/linux/tools/turn_client_parts.h"
#include "hal/drive/odrive/drive.h"
#include "motion/core/err.h"

#define NODE_SHIFT   5u
#define VERSION      0x00u
#define HEARTBEAT    0x01u
#define RX_SDO       0x04u
#define TX_SDO       0x05u
#define CLEAR_ERRORS 0x18u
#define SDO_READ     0u
#define SDO_WRITE    1u
#define IDLE         1u
/* A heartbeat comes every 100 ms as delivered. */
#define BEAT_NS  INT64_C(2000000000)
#define WRITE_NS INT64_C(20000000)

static struct hal_can_frame odrive_frame(const struct turn_client *client,
                                         unsigned command)
{
    return (struct hal_can_frame){ .id = (uint32_t)client->node << NODE_SHIFT |
                                         command };
}

/* `what`: the command. */
static bool odrive_says(const struct turn_client *client,
                        const struct hal_can_frame *frame, const void *what)
{
    const unsigned command = *(const unsigned *)what;

    return !frame->extended && !frame->remote && !frame->fd &&
           frame->len == 8 && frame->id == odrive_frame(client, command).id;
}

static int odrive_request(struct turn_client *client, unsigned command,
                          struct hal_can_frame *answer)
{
    struct hal_can_frame question = odrive_frame(client, command);

    question.remote = true;
    return turn_client_frame(client, &question, odrive_says, &command,
                             client->timeout_ns, answer);
}

/* It says that by itself. */
static int odrive_beat(struct turn_client *client, struct hal_can_frame *beat)
{
    const unsigned command = HEARTBEAT;

    return turn_client_frame(client, NULL, odrive_says, &command, BEAT_NS,
                             beat);
}

/* Firmware 0.5 does not answer. */
static int odrive_hello(struct turn_client *client)
{
    struct hal_can_frame frame;
    int err = odrive_beat(client, &frame);

    if (err < 0)
        return err;
    err = odrive_request(client, VERSION, &frame);
    client->is_05 = err == MOTION_E_TIMEOUT;
    if (err == MOTION_OK)
        memcpy(client->version, frame.data, sizeof client->version);
    return client->is_05 ? MOTION_OK : err;
}

/* ---- values ---- */

static uint32_t odrive_raw(const uint8_t *at, unsigned bytes)
{
    uint32_t raw = 0;

    for (unsigned i = 0; i < bytes; i++)
        raw |= (uint32_t)at[i] << 8 * i;
    return raw;
}

static bool odrive_answers_sdo(const struct turn_client *client,
                               const struct hal_can_frame *frame,
                               const void *what)
{
    const struct quantity *quantity = what;
    const unsigned command = TX_SDO;

    return odrive_says(client, frame, &command) &&
           odrive_raw(&frame->data[1], 2) == quantity->at;
}

static struct hal_can_frame odrive_sdo(const struct turn_client *client,
                                       const struct quantity *quantity,
                                       unsigned what, uint32_t raw)
{
    struct hal_can_frame frame = odrive_frame(client, RX_SDO);

    frame.len = 8;
    frame.data[0] = (uint8_t)what;
    frame.data[1] = (uint8_t)quantity->at;
    frame.data[2] = (uint8_t)(quantity->at >> 8);
    for (unsigned i = 0; i < 4; i++)
        frame.data[4 + i] = (uint8_t)(raw >> 8 * i);
    return frame;
}

static int odrive_read(struct turn_client *client,
                       const struct quantity *quantity, uint32_t *raw)
{
    const unsigned bytes = quantity_type_size(quantity->type);
    struct hal_can_frame question, answer;
    unsigned at = quantity->offset;
    int err;

    if (quantity->kind == QUANTITY_ENDPOINT) {
        question = odrive_sdo(client, quantity, SDO_READ, 0);
        err = turn_client_frame(client, &question, odrive_answers_sdo, quantity,
                                client->timeout_ns, &answer);
        at = 4;
    } else if (quantity->at == HEARTBEAT) {
        err = odrive_beat(client, &answer);
    } else {
        err = odrive_request(client, quantity->at, &answer);
    }
    if (err == MOTION_OK)
        *raw = odrive_raw(&answer.data[at], bytes);
    return err;
}

/* Newer firmware confirms it, older does not: it is read back. */
static int odrive_write(struct turn_client *client,
                        const struct quantity *quantity, uint32_t raw)
{
    const struct hal_can_frame frame =
        odrive_sdo(client, quantity, SDO_WRITE, raw);
    const int err = turn_client_send(client, &frame);

    turn_client_wait(client, WRITE_NS);
    return err;
}

/* ---- state ---- */

static int odrive_state(struct turn_client *client,
                        struct turn_client_state *state)
{
    struct hal_can_frame beat;
    const int err = odrive_beat(client, &beat);

    if (err < 0)
        return err;
    state->error = odrive_raw(beat.data, 4);
    state->state = beat.data[4];
    if (client->is_05)
        state->parts = (uint8_t)((beat.data[5] & 1) | (beat.data[6] & 1) << 1 |
                                 (beat.data[7] & 1) << 2);
    state->is_fault = state->error != 0 || state->parts != 0;
    state->has_torque = state->state > IDLE;
    return MOTION_OK;
}

static int odrive_clear(struct turn_client *client)
{
    struct hal_can_frame frame = odrive_frame(client, CLEAR_ERRORS);
    int err;

    frame.len = client->is_05 ? 0 : 1;
    err = turn_client_send(client, &frame);
    turn_client_wait(client, WRITE_NS);
    return err;
}

/* Every bit has words of its own. */
static void odrive_reason(const struct turn_client *client,
                          const struct turn_client_state *state,
                          char text[TURN_CLIENT_REASON_MAX])
{
    static const char *const part[] = { "motor", "encoder", "controller" };
    int length = snprintf(text, TURN_CLIENT_REASON_MAX, "error 0x%08X",
                          (unsigned)state->error);
    const char *between = ": ";

    for (unsigned i = 0; i < 32 && length < TURN_CLIENT_REASON_MAX; i++) {
        if ((state->error >> i & 1) == 0)
            continue;
        length +=
            snprintf(text + length, (size_t)(TURN_CLIENT_REASON_MAX - length),
                     "%s%s", between,
                     drive_odrive_error_text(client->is_05 ? DRIVE_ODRIVE_05
                                                           : DRIVE_ODRIVE_06,
                                             UINT32_C(1) << i));
        between = ", ";
    }
    for (unsigned i = 0; i < 3 && length < TURN_CLIENT_REASON_MAX; i++) {
        if ((state->parts >> i & 1) == 0)
            continue;
        length +=
            snprintf(text + length, (size_t)(TURN_CLIENT_REASON_MAX - length),
                     "%serror of its %s", between, part[i]);
        between = ", ";
    }
}

static const struct turn_client_family odrive_family = {
    .hello = odrive_hello,
    .read = odrive_read,
    .write = odrive_write,
    .state = odrive_state,
    .clear = odrive_clear,
    .state_text = drive_odrive_state_text,
    .reason = odrive_reason,
};

/* ---- for the tools ---- */

#define ODRIVE_05_CONTROLLER 0x81u

/* Error, state 1..14, and then result, done, 0; with firmware 0.5 three bytes that
 * say whether motor, encoder and controller have an error, the last with a bit for
 * a trajectory that is done: no CANopen frame of these identifiers looks like that
 * twice. */
static bool odrive_is_of(const struct hal_can_frame *frame, uint8_t *id,
                         uint8_t *state)
{
    if (frame->extended || frame->remote || frame->fd ||
        (frame->id & 0x1F) != HEARTBEAT || frame->len != 8 ||
        frame->data[4] < 1 || frame->data[4] > 14 || frame->data[6] > 1 ||
        (frame->data[7] & ~ODRIVE_05_CONTROLLER) != 0 || frame->id >> 7 == 0xB)
        return false;
    *id = frame->id >> 5 & 0x3F;
    *state = frame->data[4];
    return true;
}

static int odrive_take(struct rig_bus *bus, char message[YAML_MESSAGE_MAX])
{
    (void)message;
    bus->data_bit_rate = 0;
    bus->kind = RIG_CAN;
    return 0;
}

static int odrive_open(struct session *session,
                       const struct session_config *config,
                       char message[YAML_MESSAGE_MAX])
{
    return turn_open(session, config, &odrive_family, message);
}

const struct tool_kind tool_kind_odrive = {
    .word = "odrive",
    .number = "node",
    .first = 0,
    .last = 62,
    .expected = "is no ODrive, expected 0 .. 62",
    .ear = { .text = "ODrive",
             .is_of = odrive_is_of,
             .frames = 2,
             .state_text = drive_odrive_state_text },
    .take = odrive_take,
    .open = odrive_open,
    .is_enabled = turn_is_enabled,
    .text = turn_text,
    .reset = turn_reset,
};
