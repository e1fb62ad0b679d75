/* tests/support/kind/kind.c - see kind.h. */
#include "tests/support/kind/kind.h"
#include "hal/drive/turn/drive.h"

#define KIND_ROW(NAME, name, word) [RIG_##NAME] = &kind_test_##name,
const struct kind_test *const kind_tests[] = { RIG_KIND_LIST(KIND_ROW) };

const struct sim_plant_config kind_turn_plant = {
    .omega_mrad_s = 400000,
    .zeta_permille = 1000,
    .vel_max_counts_s = 10 * 65536,
    .acc_max_counts_s2 = 1000 * 65536,
};

const struct drive_turn_config kind_turn_config = {
    .turns_num = 1,
    .turns_den = KIND_TURN_UNITS,
    .period_ns = 1000000,
    .latency_ns = 200000,
    .answer_ns = 130000,
    .stop_acc_q32 = INT64_C(200) << 32,
};
