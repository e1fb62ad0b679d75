/* firmware/linux/player/loads.c - see loads.h. */
#include "firmware/linux/player/loads.h"

#include <cjson/cJSON.h>

#include "firmware/host/base/number.h"
#include "firmware/host/base/units.h"
#include "motion/core/fixed.h"

void loads_init(struct loads *loads, struct machine_sim *sim)
{
    loads_free(loads);
    loads->sim = sim;
    loads->axis = memory_pool_new(&loads->memory, sim->rig->axis_count,
                                  sizeof *loads->axis);
}

void loads_free(struct loads *loads)
{
    memory_pool_free(&loads->memory);
    *loads = (struct loads){ 0 };
}

static void loads_take(struct loads *loads, unsigned i,
                       enum telemetry_phase phase)
{
    struct load_seen *seen = &loads->axis[i];
    const int64_t off_q32 =
        (int64_t)motion_fixed_abs(machine_sim_twist_q32(loads->sim, i));

    if (phase == TELEMETRY_MOVE && off_q32 > seen->off_q32)
        seen->off_q32 = off_q32;
    /* the last tick of settling counts */
    if (phase == TELEMETRY_SETTLE) {
        seen->ended = true;
        seen->swing_q32 = machine_sim_swing_q32(loads->sim, i);
    }
}

void loads_step(struct loads *loads, enum telemetry_phase phase)
{
    const struct rig *rig = loads->sim->rig;

    for (unsigned i = 0; i < rig->axis_count; i++)
        if (rig->axis[i].sim.load.given)
            loads_take(loads, i, phase);
}

void loads_print(const struct loads *loads, FILE *file)
{
    const struct rig *rig = loads->sim->rig;

    for (unsigned i = 0; i < rig->axis_count; i++) {
        const struct load_seen *seen = &loads->axis[i];
        const char *unit = units_axis_text(rig->axis[i].unit);
        if (!rig->axis[i].sim.load.given)
            continue;
        fprintf(file, "load:      %s was off its motor by %.4g %s at most",
                rig->axis[i].name, (double)seen->off_q32 * 0x1p-32, unit);
        if (seen->ended)
            fprintf(file, ", and swings by %.4g %s at the end",
                    (double)seen->swing_q32 * 0x1p-32, unit);
        fputc('\n', file);
    }
}

void loads_json(const struct loads *loads, cJSON *object)
{
    const struct rig *rig = loads->sim->rig;
    cJSON *list = cJSON_AddArrayToObject(object, "loads");

    for (unsigned i = 0; i < rig->axis_count; i++) {
        const struct load_seen *seen = &loads->axis[i];
        if (!rig->axis[i].sim.load.given)
            continue;
        cJSON *item = cJSON_CreateObject();
        cJSON_AddStringToObject(item, "axis", rig->axis[i].name);
        cJSON_AddNumberToObject(item, "off_motor",
                                (double)seen->off_q32 * 0x1p-32);
        if (seen->ended)
            cJSON_AddNumberToObject(item, "swing_at_end",
                                    (double)seen->swing_q32 * 0x1p-32);
        else
            cJSON_AddNullToObject(item, "swing_at_end");
        cJSON_AddItemToArray(list, item);
    }
}
