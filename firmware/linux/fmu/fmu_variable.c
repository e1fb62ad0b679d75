/* firmware/linux/fmu/fmu_variable.c - see fmu_variable.h. */
#include "firmware/linux/fmu/fmu_variable.h"

_Static_assert((int)FMU_AXIS_VARIABLES <= FMU_AXIS_STRIDE,
               "references of two axes do not overlap");

#define FMU_AXIS_ROW(id, text, causes, units, says)                            \
    [FMU_##id] = { .name = (text),                                             \
                   .description = (says),                                      \
                   .causality = FMU_##causes,                                  \
                   .unit = FMU_UNIT_##units },
const struct fmu_variable fmu_of_axis[FMU_AXIS_VARIABLES] = { FMU_AXIS_LIST(
    FMU_AXIS_ROW) };

bool fmu_find(const struct rig *rig, uint32_t reference, unsigned *axis,
              enum fmu_of_axis *of)
{
    if (reference < FMU_AXIS_FIRST)
        return false;
    *axis = (reference - FMU_AXIS_FIRST) / FMU_AXIS_STRIDE;
    *of = (enum fmu_of_axis)((reference - FMU_AXIS_FIRST) % FMU_AXIS_STRIDE);
    return *axis < rig->axis_count && *of < FMU_AXIS_VARIABLES;
}
