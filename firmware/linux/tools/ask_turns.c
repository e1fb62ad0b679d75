/* firmware/linux/tools/ask_turns.c - see ask_turns.h. */
#include <stdio.h>

#include "firmware/linux/tools/ask_turns_parts.h"
#include "motion/core/err.h"

#define ASK_STEP_NS    INT64_C(500000)
#define ASK_TIMEOUT_NS INT64_C(200000000)

void ask_turns_init(struct ask_turns *ask, struct hal_can *can,
                    struct hal_clock *clock, int64_t timeout_ns)
{
    *ask = (struct ask_turns){ .can = can,
                               .clock = clock,
                               .timeout_ns = timeout_ns != 0 ? timeout_ns
                                                             : ASK_TIMEOUT_NS };
}

/* ---- frames ---- */

int ask_turns_send(struct ask_turns *ask, const struct hal_can_frame *frame)
{
    const int err = hal_can_send(ask->can, frame);

    return err == MOTION_OK ? hal_can_flush(ask->can) : err;
}

int ask_turns_frame(struct ask_turns *ask, const struct hal_can_frame *question,
                    ask_turns_match *match, const void *what, int64_t most_ns,
                    struct hal_can_frame *answer)
{
    const int64_t end_ns = hal_clock_now_ns(ask->clock) + most_ns;
    int err = MOTION_OK;
    int got;

    while (hal_can_recv(ask->can, answer) == 1) {
        /* from before the question */
    }
    if (question != NULL)
        err = ask_turns_send(ask, question);
    while (err == MOTION_OK && hal_clock_now_ns(ask->clock) < end_ns) {
        while ((got = hal_can_recv(ask->can, answer)) == 1)
            if (match(ask, answer, what))
                return MOTION_OK;
        if (got < 0)
            return MOTION_E_IO;
        (void)hal_clock_wait_until(ask->clock,
                                   hal_clock_now_ns(ask->clock) + ASK_STEP_NS);
    }
    return err == MOTION_OK ? MOTION_E_TIMEOUT : err;
}

void ask_turns_wait(struct ask_turns *ask, int64_t dur_ns)
{
    (void)hal_clock_wait_until(ask->clock,
                               hal_clock_now_ns(ask->clock) + dur_ns);
}

/* ---- by its kind ---- */

int ask_turns_hello(struct ask_turns *ask)
{
    return ask->family->hello(ask);
}

int ask_turns_read(struct ask_turns *ask, const struct quantity *quantity,
                   uint32_t *raw)
{
    return ask->family->read(ask, quantity, raw);
}

int ask_turns_write(struct ask_turns *ask, const struct quantity *quantity,
                    uint32_t raw)
{
    return ask->family->write(ask, quantity, raw);
}

int ask_turns_state(struct ask_turns *ask, struct ask_turns_state *state)
{
    *state = (struct ask_turns_state){ .is_fault = false };
    return ask->family->state(ask, state);
}

int ask_turns_clear(struct ask_turns *ask)
{
    return ask->family->clear(ask);
}

const char *ask_turns_state_text(const struct ask_turns *ask, unsigned state)
{
    return ask->family->state_text(state);
}

void ask_turns_reason(const struct ask_turns *ask,
                      const struct ask_turns_state *state,
                      char text[ASK_TURNS_REASON_MAX])
{
    text[0] = '\0';
    ask->family->reason(ask, state, text);
}

void ask_turns_text(const struct ask_turns *ask, int err,
                    char text[ASK_TURNS_TEXT_MAX])
{
    if (err == MOTION_E_TIMEOUT)
        snprintf(text, ASK_TURNS_TEXT_MAX, "node %u does not answer",
                 ask->node);
    else if (err == MOTION_E_REFUSED)
        snprintf(text, ASK_TURNS_TEXT_MAX,
                 "the drive refuses it: not there, or not for this");
    else if (err == MOTION_E_IO)
        snprintf(
            text, ASK_TURNS_TEXT_MAX, "the bus is gone: %s",
            hal_can_state_text((enum hal_can_state)hal_can_state(ask->can)));
    else
        snprintf(text, ASK_TURNS_TEXT_MAX, "%s", motion_err_text(err));
}
