/* firmware/control/mailbox.c - see mailbox.h. */
#include "firmware/control/mailbox.h"

#include "firmware/control/controller.h"
#include "motion/core/err.h"

void mailbox_init(struct mailbox *mailbox)
{
    mailbox->put = 0;
    mailbox->done = 0;
    mailbox->stops = 0;
    mailbox->answered = 0;
    mailbox->stopped = 0;
}

int mailbox_put(struct mailbox *mailbox, enum mailbox_command command,
                int64_t value)
{
    const uint32_t put = mailbox->put;
    if ((unsigned)command >= MAILBOX_COMMANDS)
        return MOTION_E_ARG;
    if (put - mailbox->answered >= MAILBOX_CAPACITY)
        return MOTION_E_FULL;
    mailbox->entry[put % MAILBOX_CAPACITY] =
        (struct mailbox_entry){ .command = command, .value = value };
    mailbox->put = put + 1;
    return MOTION_OK;
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

static int mailbox_hold(struct controller *controller, int64_t value)
{
    (void)value;
    return controller_hold(controller);
}

static int mailbox_resume(struct controller *controller, int64_t value)
{
    (void)value;
    return controller_resume(controller);
}

bool mailbox_step(struct mailbox *mailbox, struct controller *controller)
{
    static int (*const function[])(struct controller *, int64_t) = {
#define MAILBOX_FUNCTION(name, function) [name] = function,
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
        controller_stop(controller);
    for (unsigned i = 0; i < MAILBOX_CAPACITY && done != put; i++, done++) {
        struct mailbox_entry *entry = &mailbox->entry[done % MAILBOX_CAPACITY];
        entry->err = stop ? MOTION_E_STATE
                          : function[entry->command](controller, entry->value);
    }
    mailbox->done = done;
    return stop;
}
