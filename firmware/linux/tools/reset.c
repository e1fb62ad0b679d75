/* firmware/linux/tools/reset.c - see reset.h. */
#include "firmware/linux/tools/kind.h"

int reset_drive(struct talk *talk, struct reset *reset)
{
    *reset = (struct reset){ .was_fault = false };
    return talk->kind->reset(talk, reset);
}
