/* firmware/linux/player/loads.c - see loads.h. */
#include "firmware/linux/player/loads.h"

#include <cjson/cJSON.h>
#include <math.h>

#include "firmware/host/base/number.h"
#include "firmware/host/base/units.h"
#include "firmware/host/job/job.h"
#include "motion/core/fixed.h"

void loads_init(struct loads *loads, struct machine_sim *sim)
{
    loads_free(loads);
    loads->sim = sim;
    loads->axis = memory_pool_new(&loads->memory, sim->rig->axis_count,
                                  sizeof *loads->axis);
    loads->payload = memory_pool_new(&loads->memory, sim->rig->payload_count,
                                     sizeof *loads->payload);
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

static void loads_take_payload(struct loads *loads, unsigned i,
                               enum telemetry_phase phase)
{
    const struct sim_payload *const payload = &loads->sim->payload[i];
    struct payload_seen *const seen = &loads->payload[i];
    const double off_m = sim_payload_off_m(payload);

    if (phase != TELEMETRY_MOVE && phase != TELEMETRY_SETTLE)
        return;
    if (fabs(payload->force) > seen->force)
        seen->force = fabs(payload->force);
    if (off_m > seen->off_m)
        seen->off_m = off_m;
    if (phase == TELEMETRY_SETTLE) {
        seen->ended = true;
        seen->at_end_m = off_m;
    }
}

void loads_step(struct loads *loads, enum telemetry_phase phase)
{
    const struct rig *rig = loads->sim->rig;

    if (loads->move_ns == 0 && phase == TELEMETRY_MOVE)
        loads->move_ns = loads->sim->world.now_ns;
    for (unsigned i = 0; i < rig->axis_count; i++)
        if (rig->axis[i].sim.load.given)
            loads_take(loads, i, phase);
    for (unsigned i = 0; i < rig->payload_count; i++)
        loads_take_payload(loads, i, phase);
}

static bool loads_is_torque(const struct rig_payload *payload)
{
    return payload->kind == RIG_PAYLOAD_BALL;
}

static void loads_print_payload(const struct loads *loads, unsigned i,
                                FILE *file)
{
    const struct payload_seen *const seen = &loads->payload[i];
    const struct rig *const rig = loads->sim->rig;
    const struct rig_payload *const payload = &rig->payload[i];

    fprintf(file, "payload:   %s on %s was off its rest by %.3g m at most",
            payload->name, rig->axis[payload->axis].name, seen->off_m);
    if (loads->sim->payload[i].gone)
        fputs(", and fell off its plate", file);
    else if (seen->ended)
        fprintf(file, ", %.3g m at the end", seen->at_end_m);
    fprintf(file, "; %.3g %s against its axis%s\n", seen->force,
            loads_is_torque(payload) ? "N m" : "N",
            payload->inertia > 0 ? "" : ", which it does not move");
}

/* Of the move, in s. */
static double loads_move_s(const struct loads *loads, int64_t at_ns)
{
    return 1e-9 * (double)(at_ns - loads->move_ns);
}

static void loads_print_camera(const struct loads *loads, unsigned i,
                               FILE *file)
{
    const struct sim_gpio_camera *const camera = &loads->sim->line[i].camera;

    fprintf(file, "camera:    on %s took %u %s", loads->sim->rig->line[i].name,
            camera->pictures,
            number_word(camera->pictures, "picture", "pictures"));
    if (camera->pictures > 0)
        fprintf(file, ", from %.3f s to %.3f s of the move",
                loads_move_s(loads, camera->first_ns),
                loads_move_s(loads, camera->last_ns));
    if (camera->closest_ns > 0)
        fprintf(file, ", %.3f s apart at least",
                1e-9 * (double)camera->closest_ns);
    if (camera->shortest_ns > 0)
        fprintf(file, "; pulses of %.0f ms at least",
                1e-6 * (double)camera->shortest_ns);
    fputc('\n', file);
}

static void loads_json_cameras(const struct loads *loads, cJSON *object)
{
    const struct rig *const rig = loads->sim->rig;
    cJSON *const list = cJSON_AddArrayToObject(object, "cameras");

    for (unsigned i = 0; i < rig->line_count; i++) {
        const struct sim_gpio_camera *const camera =
            &loads->sim->line[i].camera;
        if (rig->line[i].kind != RIG_LINE_TRIGGER)
            continue;
        cJSON *const item = cJSON_CreateObject();
        cJSON_AddStringToObject(item, "line", rig->line[i].name);
        cJSON_AddNumberToObject(item, "pictures", camera->pictures);
        if (camera->pictures > 0) {
            cJSON_AddNumberToObject(item, "first_s",
                                    loads_move_s(loads, camera->first_ns));
            cJSON_AddNumberToObject(item, "last_s",
                                    loads_move_s(loads, camera->last_ns));
        }
        cJSON_AddNumberToObject(item, "closest_s",
                                1e-9 * (double)camera->closest_ns);
        cJSON_AddNumberToObject(item, "shortest_pulse_s",
                                1e-9 * (double)camera->shortest_ns);
        cJSON_AddItemToArray(list, item);
    }
}

void loads_print(const struct loads *loads, const struct job *job, FILE *file)
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
    for (unsigned i = 0; i < rig->payload_count; i++)
        loads_print_payload(loads, i, file);
    for (unsigned i = 0; i < rig->line_count; i++)
        if (rig->line[i].kind == RIG_LINE_TRIGGER && loads->move_ns != 0 &&
            (job->shots[i].count > 0 ||
             loads->sim->line[i].camera.pictures > 0))
            loads_print_camera(loads, i, file);
}

static void loads_json_payloads(const struct loads *loads, cJSON *object)
{
    const struct rig *const rig = loads->sim->rig;
    cJSON *const list = cJSON_AddArrayToObject(object, "payloads");

    for (unsigned i = 0; i < rig->payload_count; i++) {
        const struct payload_seen *const seen = &loads->payload[i];
        cJSON *const item = cJSON_CreateObject();
        cJSON_AddStringToObject(item, "name", rig->payload[i].name);
        cJSON_AddStringToObject(item, "axis",
                                rig->axis[rig->payload[i].axis].name);
        cJSON_AddNumberToObject(item, "off_m", seen->off_m);
        if (seen->ended)
            cJSON_AddNumberToObject(item, "off_at_end_m", seen->at_end_m);
        else
            cJSON_AddNullToObject(item, "off_at_end_m");
        cJSON_AddNumberToObject(
            item, loads_is_torque(&rig->payload[i]) ? "torque_n_m" : "force_n",
            seen->force);
        cJSON_AddBoolToObject(item, "gone", loads->sim->payload[i].gone);
        cJSON_AddItemToArray(list, item);
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
    if (rig->payload_count > 0)
        loads_json_payloads(loads, object);
    if (rig_trigger_count(rig) > 0)
        loads_json_cameras(loads, object);
}
