/* firmware/linux/kind/cia402/sim.c - the simulated drive of a CiA 402 axis: see
 * firmware/linux/machine/kind.h. */
#include "firmware/linux/kind/cia402/machine.h"
#include "motion/core/err.h"
#include "sim/device/cia402/servo.h"

#define SIM_BRAKE_NS INT64_C(80000000) /* its brake lets go */
#define SIM_BOOT_NS  INT64_C(150000000)

/* Lower and upper as counts, which fall where the axis is reversed. */
static int cia402_pair(const struct rig_axis *axis, const int64_t q32[2],
                       int32_t *low, int32_t *high)
{
    const bool reversed = axis->counts_num < 0;
    int err = machine_sim_place(axis, q32[reversed], low);
    return err < 0 ? err : machine_sim_place(axis, q32[!reversed], high);
}

/* Where nothing is said, a drive whose home switch is needed has it on the side
 * where it is looked for, up to the home point. */
static int cia402_home_switch(const struct rig *rig, unsigned i,
                              struct sim_cia402_rail *rail)
{
    const struct rig_axis *axis = &rig->axis[i];
    const bool negative =
        (axis->homing.by == HOMING_DRIVE || axis->homing.direction < 0) ==
        (axis->counts_num > 0);
    int32_t counts;
    if (axis->sim.has_home) {
        rail->has_home = true;
        return cia402_pair(axis, axis->sim.home_q32, &rail->home_from,
                           &rail->home_to);
    }
    if ((axis->homing.by != HOMING_DRIVE &&
         !rig_homes_by_drive_input(rig, i)) ||
        machine_sim_place(axis, axis->homing.pos_q32, &counts) < 0)
        return MOTION_OK;
    rail->has_home = true;
    rail->home_from = negative ? INT32_MIN : counts;
    rail->home_to = negative ? counts : INT32_MAX;
    return MOTION_OK;
}

static int cia402_rail(const struct rig *rig, unsigned i,
                       struct sim_cia402_rail *rail)
{
    const struct rig_axis *axis = &rig->axis[i];
    int64_t index = 0;
    int err = machine_sim_counts(axis, axis->sim.index_q32, &index);
    if (err == MOTION_OK && axis->sim.has_limits)
        err = cia402_pair(axis, axis->sim.limit_q32, &rail->limit_negative,
                          &rail->limit_positive);
    if (err == MOTION_OK)
        err = cia402_home_switch(rig, i, rail);
    index = index < 0 ? -index : index;
    if (err == MOTION_OK && index > INT32_MAX)
        err = MOTION_E_RANGE;
    rail->has_limits = axis->sim.has_limits;
    rail->index_every = (int32_t)index;
    return err;
}

/* The axis before it that has its node; NULL: none. */
static struct sim_cia402 *cia402_first(struct machine_sim *sim,
                                       const struct rig *rig,
                                       const struct rig_axis *axis)
{
    unsigned i = 0;

    while (rig->axis[i].bus != axis->bus ||
           rig->axis[i].node_id != axis->node_id)
        i++;
    return &rig->axis[i] == axis ? NULL : sim->servo[i];
}

static void cia402_sim_quirks(const struct rig_sim_quirks *from,
                              struct sim_cia402_config *config)
{
    for (unsigned i = 0; i < from->count; i++)
        config->quirk[i] = (struct sim_cia402_quirk){
            .index = from->object[i].index,
            .sub = from->object[i].sub,
            .kind = from->object[i].kind,
            .value = from->object[i].value,
        };
    config->quirks = from->count;
    config->fixed_mapping = from->fixed_mapping;
    config->boot_error = from->emergency;
    if (from->boot_ns > 0)
        config->boot_ns = from->boot_ns;
}

int cia402_sim_init(struct machine_sim *sim, const struct rig *rig, unsigned i)
{
    const struct rig_axis *axis = &rig->axis[i];
    struct sim_cia402_config config = {
        .node_id = axis->node_id,
        .axis = axis->node_axis,
        .with = cia402_first(sim, rig, axis),
        .loop_ns = CIA402_SIM_LOOP_NS,
        .brake_release_ns = SIM_BRAKE_NS,
        .boot_ns = SIM_BOOT_NS,
    };
    cia402_sim_quirks(&axis->sim.quirks, &config);
    if (axis->cia402.quirk_given) {
        config.vendor = rig->quirk[axis->cia402.quirk].vendor;
        config.product = rig->quirk[axis->cia402.quirk].product[0];
    }
    int err = machine_sim_plant(axis, &config.plant, &config.start_counts);
    if (err == MOTION_OK)
        err = cia402_rail(rig, i, &config.rail);
    if (err < 0)
        return err;
    return sim_cia402_init(sim->servo[i], &sim->wire[axis->bus], &config);
}

struct sim_servo *cia402_sim_servo(struct machine_sim *sim, unsigned i)
{
    return &((struct sim_cia402 *)sim->servo[i])->base;
}

int64_t cia402_sim_counts_q24(const struct machine_sim *sim, unsigned i)
{
    return sim_servo_pos_q24(&((const struct sim_cia402 *)sim->servo[i])->base);
}
