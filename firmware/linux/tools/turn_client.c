/* firmware/linux/tools/turn_client.c - see turn_client.h. */
#include <stdio.h>

#include "firmware/linux/tools/client_text.h"
#include "firmware/linux/tools/turn_client_parts.h"
#include "motion/core/err.h"

#define REQUEST_STEP_NS    INT64_C(500000)
#define REQUEST_TIMEOUT_NS INT64_C(200000000)

void turn_client_init(struct turn_client *client, struct hal_can *can,
                      struct hal_clock *clock, int64_t timeout_ns)
{
    *client = (struct turn_client){ .can = can,
                                    .clock = clock,
                                    .timeout_ns = timeout_ns != 0
                                                      ? timeout_ns
                                                      : REQUEST_TIMEOUT_NS };
}

/* ---- frames ---- */

int turn_client_send(struct turn_client *client,
                     const struct hal_can_frame *frame)
{
    const int err = hal_can_send(client->can, frame);

    return err == MOTION_OK ? hal_can_flush(client->can) : err;
}

int turn_client_frame(struct turn_client *client,
                      const struct hal_can_frame *question,
                      turn_client_match *match, const void *what,
                      int64_t most_ns, struct hal_can_frame *answer)
{
    const int64_t end_ns = hal_clock_now_ns(client->clock) + most_ns;
    int err = MOTION_OK;
    int got;

    while (hal_can_recv(client->can, answer) == 1) {
        /* from before the question */
    }
    if (question != NULL)
        err = turn_client_send(client, question);
    while (err == MOTION_OK && hal_clock_now_ns(client->clock) < end_ns) {
        while ((got = hal_can_recv(client->can, answer)) == 1)
            if (match(client, answer, what))
                return MOTION_OK;
        if (got < 0)
            return MOTION_E_IO;
        (void)hal_clock_wait_until(
            client->clock, hal_clock_now_ns(client->clock) + REQUEST_STEP_NS);
    }
    return err == MOTION_OK ? MOTION_E_TIMEOUT : err;
}

void turn_client_wait(struct turn_client *client, int64_t dur_ns)
{
    (void)hal_clock_wait_until(client->clock,
                               hal_clock_now_ns(client->clock) + dur_ns);
}

/* ---- by its kind ---- */

int turn_client_hello(struct turn_client *client)
{
    return client->family->hello(client);
}

int turn_client_read(struct turn_client *client,
                     const struct quantity *quantity, uint32_t *raw)
{
    return client->family->read(client, quantity, raw);
}

int turn_client_write(struct turn_client *client,
                      const struct quantity *quantity, uint32_t raw)
{
    return client->family->write(client, quantity, raw);
}

int turn_client_state(struct turn_client *client,
                      struct turn_client_state *state)
{
    *state = (struct turn_client_state){ .is_fault = false };
    return client->family->state(client, state);
}

int turn_client_clear(struct turn_client *client)
{
    return client->family->clear(client);
}

const char *turn_client_state_text(const struct turn_client *client,
                                   unsigned state)
{
    return client->family->state_text(state);
}

void turn_client_reason(const struct turn_client *client,
                        const struct turn_client_state *state,
                        char text[TURN_CLIENT_REASON_MAX])
{
    text[0] = '\0';
    client->family->reason(client, state, text);
}

void turn_client_text(const struct turn_client *client, int err,
                      char text[TURN_CLIENT_TEXT_MAX])
{
    if (err == MOTION_E_REFUSED)
        snprintf(text, TURN_CLIENT_TEXT_MAX,
                 "the drive refuses it: not there, or not for this");
    else
        client_text(client->can, client->node, err, text, TURN_CLIENT_TEXT_MAX);
}
