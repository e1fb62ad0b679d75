/* firmware/control/mailbox.c - see mailbox.h. */
#include "firmware/control/mailbox.h"

#include <stddef.h>

#include "firmware/control/playback.h"
#include "motion/core/err.h"

void mailbox_init(struct mailbox *mailbox)
{
    mailbox->put = 0;
    mailbox->done = 0;
    mailbox->stops = 0;
    mailbox->answered = 0;
    mailbox->stopped = 0;
}

int mailbox_send(struct mailbox *mailbox, const struct mailbox_entry *entry)
{
    const uint32_t put = mailbox->put;
    if ((unsigned)entry->command >= MAILBOX_COMMANDS ||
        (entry->command == MAILBOX_CAPTURE && entry->pos_q32 == NULL) ||
        (entry->command == MAILBOX_COUPLE && entry->cam == NULL))
        return MOTION_E_ARG;
    if (put - mailbox->answered >= MAILBOX_CAPACITY)
        return MOTION_E_FULL;
    mailbox->entry[put % MAILBOX_CAPACITY] = *entry;
    mailbox->put = put + 1;
    return MOTION_OK;
}

int mailbox_put(struct mailbox *mailbox, enum mailbox_command command,
                int64_t value)
{
    const struct mailbox_entry entry = { .command = command, .value = value };
    return mailbox_send(mailbox, &entry);
}

bool mailbox_answer(struct mailbox *mailbox, struct mailbox_entry *answer)
{
    if (mailbox->answered == mailbox->done)
        return false;
    *answer = mailbox->entry[mailbox->answered++ % MAILBOX_CAPACITY];
    return true;
}

void mailbox_stop(struct mailbox *mailbox)
{
    const uint32_t stops = mailbox->stops;
    mailbox->stops = stops + 1;
}

/* --- one function per command --- */

static int mailbox_enable(struct playback *playback,
                          struct mailbox_entry *entry)
{
    (void)entry;
    return controller_enable(playback->controller);
}

static int mailbox_off(struct playback *playback, struct mailbox_entry *entry)
{
    (void)entry;
    return controller_off(playback->controller);
}

static int mailbox_reset(struct playback *playback, struct mailbox_entry *entry)
{
    (void)entry;
    return controller_reset(playback->controller);
}

static int mailbox_start(struct playback *playback, struct mailbox_entry *entry)
{
    (void)entry;
    return playback_go(playback, 0, PLAYBACK_PLAY);
}

static int mailbox_hold(struct playback *playback, struct mailbox_entry *entry)
{
    (void)entry;
    return playback_hold(playback);
}

static int mailbox_resume(struct playback *playback,
                          struct mailbox_entry *entry)
{
    (void)entry;
    return playback_resume(playback);
}

static int mailbox_reverse(struct playback *playback,
                           struct mailbox_entry *entry)
{
    return playback_reverse(playback, entry->value != 0);
}

static int mailbox_go(struct playback *playback, struct mailbox_entry *entry)
{
    return playback_go(playback, entry->value, PLAYBACK_HOLD);
}

static int mailbox_loop(struct playback *playback, struct mailbox_entry *entry)
{
    return playback_repeat(playback, entry->value, false);
}

static int mailbox_ping_pong(struct playback *playback,
                             struct mailbox_entry *entry)
{
    return playback_repeat(playback, entry->value, true);
}

static int mailbox_override(struct playback *playback,
                            struct mailbox_entry *entry)
{
    return playback_override(playback, entry->value);
}

static int mailbox_jog(struct playback *playback, struct mailbox_entry *entry)
{
    return playback_jog(playback, entry->axis, entry->value, entry->vel_q32,
                        entry->for_ns);
}

static int mailbox_jog_stop(struct playback *playback,
                            struct mailbox_entry *entry)
{
    controller_jog_stop(playback->controller, playback->jog, entry->value != 0);
    return MOTION_OK;
}

static int mailbox_capture(struct playback *playback,
                           struct mailbox_entry *entry)
{
    return playback_capture(playback, entry->pos_q32, &entry->value);
}

static int mailbox_couple(struct playback *playback,
                          struct mailbox_entry *entry)
{
    return playback_couple(playback, entry->axis, entry->cam);
}

static int mailbox_uncouple(struct playback *playback,
                            struct mailbox_entry *entry)
{
    return controller_uncouple(playback->controller, entry->axis);
}

bool mailbox_step(struct mailbox *mailbox, struct playback *playback)
{
    static int (*const function[])(struct playback *,
                                   struct mailbox_entry *) = {
#define MAILBOX_FUNCTION(name, word, function) [name] = function,
        MAILBOX_COMMAND_LIST(MAILBOX_FUNCTION)
#undef MAILBOX_FUNCTION
    };
    /* Commands first taken, then the stops: one that was counted before a
     * command was put is seen in the same tick as it, or before. */
    const uint32_t put = mailbox->put;
    const uint32_t stops = mailbox->stops;
    const bool stop = stops != mailbox->stopped;
    mailbox->stopped = stops;
    uint32_t done = mailbox->done;
    if (stop)
        controller_stop(playback->controller);
    for (unsigned i = 0; i < MAILBOX_CAPACITY && done != put; i++, done++) {
        struct mailbox_entry *entry = &mailbox->entry[done % MAILBOX_CAPACITY];
        entry->err = stop && entry->command != MAILBOX_OFF
                         ? MOTION_E_STATE
                         : function[entry->command](playback, entry);
    }
    mailbox->done = done;
    return stop;
}
