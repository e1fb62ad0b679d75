/* tests/support/kind/virtual/kind.c - a virtual axis, which has no servo that
 * could have torque or fail; see tests/support/kind/kind.h. */
#include "tests/support/kind/kind.h"

static bool virtual_has_torque(const void *servo)
{
    (void)servo;
    return false;
}

static void virtual_trouble(void *servo, enum kind_trouble trouble)
{
    (void)servo;
    (void)trouble;
}

const struct kind_test kind_test_virtual = {
    .has_torque = virtual_has_torque,
    .trouble = virtual_trouble,
};
