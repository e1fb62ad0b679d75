/* firmware/host/kind/turn/drive.c - see parts.h. */
#include "firmware/host/kind/turn/parts.h"

#include <math.h>

#include "firmware/host/base/decimal.h"
#include "hal/drive/turn/drive.h"

void rig_axis_turn(const struct rig_axis *axis, int64_t *num, int64_t *den)
{
    *num = axis->counts_num;
    *den = axis->counts_den * RIG_TURN_COUNTS;
}

int rig_read_rated_torque(void *reader, const struct yaml_value *value,
                          void *out)
{
    double torque_nm;

    if (rig_read_share(reader, value, 0.001, 10000, &torque_nm) < 0)
        return -1;
    *(int32_t *)out = (int32_t)llround(torque_nm * 1000);
    return 0;
}

/* To counts, reduced so that nothing gets lost. */
int rig_read_turn(void *reader, const struct yaml_value *value, void *out)
{
    struct rig_axis *axis = out;
    int64_t same;

    if (rig_read_ratio(reader, value, axis) < 0)
        return -1;
    same = (int64_t)decimal_gcd(RIG_TURN_COUNTS, (uint64_t)axis->counts_den);
    axis->counts_den /= same;
    if (axis->counts_den > INT64_MAX / RIG_TURN_COUNTS ||
        axis->counts_num > INT64_MAX / RIG_TURN_COUNTS ||
        axis->counts_num < -(INT64_MAX / RIG_TURN_COUNTS))
        return yaml_value_refuse(value, "has too many digits");
    axis->counts_num *= RIG_TURN_COUNTS / same;
    if (!rig_counts_fit(axis))
        return yaml_value_refuse(value,
                                 "gives more than %d turns at the end "
                                 "of the axis",
                                 DRIVE_TURN_MAX - 1);
    return 0;
}
