/* firmware/linux/tools/reset.c - see reset.h. */
#include "firmware/linux/tools/kind.h"

int reset_drive(struct session *session, struct reset *reset)
{
    *reset = (struct reset){ .was_fault = false };
    return session->kind->reset(session, reset);
}
