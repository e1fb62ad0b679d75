/* sim/device/cia402/quirk.c - where a drive is not as this one is built: objects
 * that are not there, that cannot be written, or that are shipped with another
 * value.  See parts.h. */
#include "sim/device/cia402/parts.h"

static bool cia402_quirk_is_of(const struct sim_cia402 *self,
                               const struct sim_cia402_quirk *quirk, int row)
{
    return cia402_axes_index(self, quirk->index) == cia402_od_index(row) &&
           (quirk->sub == SIM_CIA402_ANY_SUB ||
            quirk->sub == cia402_od_sub(row));
}

static bool cia402_quirk_is_mapping(int row)
{
    const uint16_t index = cia402_od_index(row) & 0xFE00;

    return index == 0x1600 || index == 0x1A00;
}

uint32_t cia402_quirk_check(const struct sim_cia402 *self, int row,
                            bool is_write)
{
    if (is_write && self->config.fixed_mapping && cia402_quirk_is_mapping(row))
        return CIA402_ABORT_READ_ONLY;
    for (unsigned i = 0; i < self->config.quirks; i++) {
        const struct sim_cia402_quirk *const quirk = &self->config.quirk[i];
        if (!cia402_quirk_is_of(self, quirk, row))
            continue;
        if (quirk->kind == SIM_CIA402_MISSING)
            return quirk->sub == SIM_CIA402_ANY_SUB ? CIA402_ABORT_NO_OBJECT
                                                    : CIA402_ABORT_NO_SUB;
        if (quirk->kind == SIM_CIA402_READ_ONLY && is_write)
            return CIA402_ABORT_READ_ONLY;
    }
    return CIA402_DONE;
}

void cia402_quirk_reset(struct sim_cia402 *self)
{
    for (unsigned i = 0; i < self->config.quirks; i++) {
        const struct sim_cia402_quirk *const quirk = &self->config.quirk[i];
        if (quirk->kind != SIM_CIA402_SHIPPED)
            continue;
        for (int row = 0; row < CIA402_ROW_COUNT; row++)
            if (cia402_quirk_is_of(self, quirk, row))
                self->value[row] = quirk->value;
    }
}
