/* tests/support/kind/slew_mcu/kind.c - an axis of a board; see
 * tests/support/kind/kind.h. */
#include "tests/support/kind/kind.h"
#include "firmware/linux/kind/slew_mcu/board_sim.h"

static bool slew_mcu_has_torque(const void *servo)
{
    const struct mcu_unit *unit = &((const struct board_sim *)servo)->unit;

    for (unsigned i = 0; i < unit->axis_count; i++)
        if (unit->drive[i].state == HAL_DRIVE_ENABLED)
            return true;
    return false;
}

/* An axis without a motor is not blocked. */
static void slew_mcu_trouble(void *servo, enum kind_trouble trouble)
{
    ((struct board_sim *)servo)->is_hung = trouble == KIND_SILENT;
}

const struct kind_test kind_test_slew_mcu = {
    .has_torque = slew_mcu_has_torque,
    .trouble = slew_mcu_trouble,
};
