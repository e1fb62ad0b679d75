/* firmware/control/estop.c - see estop.h. */
#include "firmware/control/estop.h"

#include <stddef.h>

#include "firmware/control/parts.h"

/* Nobody presses it any more: what the last time has shown. */
static void estop_released(struct controller_estop *estop)
{
    if (estop->is_active)
        estop->disagrees = !estop->both || estop->is_late;
    estop->is_active = estop->both = estop->is_late = estop->differs = false;
}

bool controller_estop_bars(const struct controller_estop *estop)
{
    return estop->is_active || estop->disagrees;
}

void controller_estop_look(struct controller_estop *estop, int64_t now_ns)
{
    const bool first = controller_input(estop->channel[0]);
    const bool second =
        estop->channel[1] != NULL ? controller_input(estop->channel[1]) : first;
    if (!first && !second) {
        estop_released(estop);
        return;
    }
    estop->is_active = true;
    estop->both |= first && second;
    if (first != second && !estop->differs)
        estop->differ_ns = now_ns;
    estop->differs = first != second;
    if (estop->differs && now_ns - estop->differ_ns > estop->discrepancy_ns)
        estop->is_late = estop->disagrees = true;
}
