/* firmware/linux/machine/machine_sim_payload.c - what simulated axes carry, moved
 * with them and against them; see machine_sim.h. */
#include <math.h>

#include "firmware/linux/machine/kind.h"
#include "sim/util.h"

#define PAYLOAD_STEP_NS INT64_C(1000000)
#define PAYLOAD_STEP_S  1e-3
#define PAYLOAD_PULL    0x1p46 /* counts/s2, at most */

void machine_sim_payload_config(const struct rig_payload *from,
                                struct sim_payload_config *config)
{
    *config = (struct sim_payload_config){
        .kind = (enum sim_payload_kind)from->kind,
        .mass_kg = from->mass_kg,
        .cable_kg = from->cable_kg,
        .length_m = from->length_m,
        .width_m = from->width_m,
        .collides = from->collides,
        .damping = from->damping,
        .radius_m = from->radius_m,
        .friction = from->friction,
        .start_m = from->start_m,
        .wall_m = from->wall_m,
    };
}

static double payload_at(const struct machine_sim *sim, unsigned i)
{
    const struct rig_payload *const payload = &sim->rig->payload[i];

    return rig_payload_at(sim->rig, payload,
                          machine_sim_pos_q32(sim, payload->axis) +
                              sim->zero_q32[payload->axis]);
}

/* An acceleration of the axis: force over inertia is in m/s2 or rad/s2. */
static double payload_pull(const struct machine_sim *sim, unsigned i)
{
    const struct rig_payload *const payload = &sim->rig->payload[i];
    const struct rig_axis *const axis = &sim->rig->axis[payload->axis];
    const double arm = payload->arm_m > 0 ? payload->arm_m : 1;
    const double acc = -sim->payload[i].force * arm / payload->inertia;
    const double counts = acc * arm / rig_payload_scale(sim->rig, payload) *
                          (double)axis->counts_num / (double)axis->counts_den;

    return fmax(-PAYLOAD_PULL, fmin(PAYLOAD_PULL, counts));
}

static void payload_move(struct machine_sim *sim, unsigned i)
{
    struct sim_payload *const payload = &sim->payload[i];
    const double at = payload_at(sim, i);

    if (sim_payload_step(payload, PAYLOAD_STEP_S, at,
                         (at - payload->at) / PAYLOAD_STEP_S) < 0)
        sim->payload_failed++;
}

static void payload_run(struct sim_member *member, int64_t now_ns)
{
    struct machine_sim *const sim =
        CONTAINER_OF(member, struct machine_sim, payloads);
    const struct rig *const rig = sim->rig;

    for (unsigned i = 0; i < rig->payload_count; i++)
        payload_move(sim, i);
    for (unsigned axis = 0; axis < rig->axis_count; axis++) {
        double pull = 0;
        bool any = false;
        for (unsigned i = 0; i < rig->payload_count; i++)
            if (rig->payload[i].axis == axis && rig->payload[i].inertia > 0) {
                pull += payload_pull(sim, i);
                any = true;
            }
        if (any)
            sim_plant_pull(machine_sim_plant_of(sim, axis), pull);
    }
    sim->payloads_due_ns = now_ns + PAYLOAD_STEP_NS;
}

static int64_t payload_due_ns(const struct sim_member *member)
{
    return CONTAINER_OF_CONST(member, struct machine_sim, payloads)
        ->payloads_due_ns;
}

static const struct sim_member_ops payload_ops = {
    .due_ns = payload_due_ns,
    .run = payload_run,
};

int machine_sim_payloads(struct machine_sim *sim, unsigned *axis)
{
    const struct rig *const rig = sim->rig;

    for (unsigned i = 0; i < rig->payload_count; i++) {
        struct sim_payload_config config;
        machine_sim_payload_config(&rig->payload[i], &config);
        *axis = rig->payload[i].axis;
        const int err =
            sim_payload_init(&sim->payload[i], &config, payload_at(sim, i));
        if (err < 0)
            return err;
    }
    sim->payloads.ops = &payload_ops;
    sim->payloads_due_ns = sim->world.now_ns + PAYLOAD_STEP_NS;
    return rig->payload_count > 0 ? sim_world_add(&sim->world, &sim->payloads)
                                  : MOTION_OK;
}
