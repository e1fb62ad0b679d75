/* firmware/linux/fmu/fmu_model.c - see fmu_model.h. */
#include "firmware/linux/fmu/fmu_model.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "motion/core/fixed.h"

#define MODEL_PATIENCE_NS INT64_C(20000000000) /* to be enabled, at most */

static int64_t model_q32(double value)
{
    const double most = 0x1p31 - 1;
    return (int64_t)llrint(ldexp(value > most    ? most
                                 : value < -most ? -most
                                                 : value,
                                 32));
}

static double model_real(int64_t value_q32)
{
    return ldexp((double)value_q32, -32);
}

/* --- before time 0 --- */

static void model_defaults(struct fmu_model *model, unsigned i)
{
    const struct rig_axis *const axis = &model->rig.axis[i];
    double *const value = model->axis[i].value;

    value[FMU_START_POSITION] = model_real(axis->sim.start_q32);
    value[FMU_BANDWIDTH] = axis->sim.omega_mrad_s / 1000.0;
    value[FMU_DAMPING] = axis->sim.zeta_permille / 1000.0;
    value[FMU_DEMAND_POSITION] = value[FMU_START_POSITION];
    value[FMU_ACTUAL_POSITION] = value[FMU_START_POSITION];
    value[FMU_PLANT_POSITION] = value[FMU_START_POSITION];
}

int fmu_model_init(struct fmu_model *model, const struct files *files,
                   const char *path)
{
    struct rig *const rig = &model->rig;

    if (rig_load(files, path, rig, model->message) < 0)
        return -1;
    model->axis =
        memory_pool_new(&model->memory, rig->axis_count, sizeof *model->axis);
    model->enable = true;
    for (unsigned i = 0; i < rig->axis_count; i++) {
        if (rig->axis[i].point_to_point) {
            snprintf(model->message, sizeof model->message,
                     "%s: axis %s follows its drive's profile, expected axes "
                     "that follow set points",
                     path, rig->axis[i].name);
            return -1;
        }
        if (rig_axis_is_virtual(&rig->axis[i])) {
            snprintf(model->message, sizeof model->message,
                     "%s: axis %s is virtual, expected axes with drives", path,
                     rig->axis[i].name);
            return -1;
        }
        rig->axis[i].homing.by = HOMING_NONE;
        model_defaults(model, i);
    }
    return 0;
}

void fmu_model_free(struct fmu_model *model)
{
    machine_free(&model->machine);
    machine_sim_free(&model->sim);
    rig_free(&model->rig);
    memory_pool_free(&model->memory);
    memset(model, 0, sizeof *model);
}

static int model_parameters(struct fmu_model *model, unsigned i)
{
    struct rig_axis *const axis = &model->rig.axis[i];
    const double *const value = model->axis[i].value;
    const double omega = rint(1000 * value[FMU_BANDWIDTH]);
    const double zeta = rint(1000 * value[FMU_DAMPING]);

    if (!(omega >= 1000 && omega <= 4000000) ||
        !(zeta >= 100 && zeta <= 2000)) {
        snprintf(model->message, sizeof model->message,
                 "axis %s: servo.bandwidth %g, servo.damping %g: expected "
                 "1 .. 4000 rad/s and 0.1 .. 2",
                 axis->name, value[FMU_BANDWIDTH], value[FMU_DAMPING]);
        return -1;
    }
    axis->sim.omega_mrad_s = (uint32_t)omega;
    axis->sim.zeta_permille = (uint16_t)zeta;
    axis->sim.start_q32 = model_q32(value[FMU_START_POSITION]);
    return 0;
}

/* --- a tick --- */

/* What the acceleration takes of the rated torque. */
static int32_t model_torque(const struct rig_axis *axis, double acceleration)
{
    const double permille = rint(acceleration * model_real(axis->torque_q32));
    return fabs(permille) <= INT32_MAX ? (int32_t)permille : 0;
}

static struct hal_drive_target model_target(const struct fmu_model *model,
                                            unsigned i)
{
    const double *const value = model->axis[i].value;
    const double after_s = 1e-9 * (double)(model->tick_ns - model->point_ns);
    const double acc = value[FMU_DEMAND_ACCELERATION];
    const double vel = value[FMU_DEMAND_VELOCITY] + acc * after_s;
    const double ahead =
        (value[FMU_DEMAND_VELOCITY] + acc * after_s / 2) * after_s;

    return (struct hal_drive_target){
        .pos_q32 = model_q32(value[FMU_DEMAND_POSITION] + ahead),
        .vel_q32 = model_q32(vel),
        .acc_q32 = model_q32(acc),
        .torque_permille = model_torque(&model->rig.axis[i], acc),
    };
}

/* Faults are cleared first; a drive is enabled once it says that it is off. */
static void model_requests(struct fmu_model *model)
{
    const bool rises = model->enable && !model->was_enabled;
    const bool falls = !model->enable && model->was_enabled;

    model->was_enabled = model->enable;
    for (unsigned i = 0; i < model->rig.axis_count; i++) {
        if (rises || falls)
            hal_drive_request(model->machine.axis[i],
                              rises ? HAL_DRIVE_REQUEST_RESET
                                    : HAL_DRIVE_REQUEST_OFF);
        model->axis[i].is_awaited =
            rises || (model->axis[i].is_awaited && model->enable);
    }
}

/* Before it follows, its set point is where it is. */
static void model_tick_axis(struct fmu_model *model, unsigned i, bool follow)
{
    struct fmu_axis *const axis = &model->axis[i];
    struct hal_drive *const drive = model->machine.axis[i];
    struct hal_drive_feedback *const seen =
        &model->machine.controller.axis[i].feedback;

    hal_drive_feedback(drive, seen);
    if (axis->is_awaited && seen->state == HAL_DRIVE_OFF) {
        hal_drive_request(drive, HAL_DRIVE_REQUEST_ENABLE);
        axis->is_awaited = false;
    }
    const struct hal_drive_target target =
        follow && seen->state == HAL_DRIVE_ENABLED
            ? model_target(model, i)
            : (struct hal_drive_target){ .pos_q32 = seen->pos_q32 };
    axis->out_of_range = hal_drive_set_target(drive, &target) == MOTION_E_RANGE;
    axis->value[FMU_ACTUAL_POSITION] = model_real(seen->pos_q32);
    axis->value[FMU_ACTUAL_VELOCITY] = model_real(seen->vel_q32);
    axis->value[FMU_ENABLED] = seen->state == HAL_DRIVE_ENABLED;
    axis->value[FMU_FAULT] = seen->state == HAL_DRIVE_FAULT ||
                             (follow && seen->state == HAL_DRIVE_OFFLINE);
}

static void model_tick(struct fmu_model *model, bool follow)
{
    const int64_t now_ns = model->origin_ns + model->tick_ns;
    struct machine *const machine = &model->machine;

    sim_world_run(&model->sim.world, now_ns);
    for (unsigned i = 0; i <= model->rig.bus_count; i++)
        (void)hal_fieldbus_begin(machine->fieldbus[i], now_ns);
    model_requests(model);
    for (unsigned i = 0; i < model->rig.axis_count; i++)
        model_tick_axis(model, i, follow);
    for (unsigned i = 0; i <= model->rig.bus_count; i++)
        hal_fieldbus_end(machine->fieldbus[i], now_ns);
    model->tick_ns += model->rig.period_ns;
}

static void model_look(struct fmu_model *model)
{
    for (unsigned i = 0; i < model->rig.axis_count; i++)
        model->axis[i].value[FMU_PLANT_POSITION] =
            model_real(machine_sim_pos_q32(&model->sim, i));
}

/* --- stepping --- */

/* The first axis that does not follow yet; axis_count: all do. */
static unsigned model_first_off(const struct fmu_model *model)
{
    unsigned i = 0;
    while (i < model->rig.axis_count && model->axis[i].value[FMU_ENABLED] != 0)
        i++;
    return i;
}

static int model_enable(struct fmu_model *model)
{
    unsigned off = 0;

    do {
        model_tick(model, false);
        off = model_first_off(model);
    } while (off < model->rig.axis_count && model->tick_ns < MODEL_PATIENCE_NS);
    if (off == model->rig.axis_count)
        return 0;
    const char *const why =
        model->machine.controller.axis[off].feedback.fault_text;
    snprintf(model->message, sizeof model->message,
             "axis %s: its simulated drive is not enabled: %s",
             model->rig.axis[off].name, why[0] != '\0' ? why : "no answer");
    return -1;
}

int fmu_model_start(struct fmu_model *model)
{
    struct machine_ports ports;
    const bool enable = model->enable;

    model->is_running = false;
    for (unsigned i = 0; i < model->rig.axis_count; i++)
        if (model_parameters(model, i) < 0)
            return -1;
    if (machine_sim_init(&model->sim, &model->rig, false, &ports,
                         model->message) < 0 ||
        machine_init(&model->machine, &model->rig, &ports, model->message) < 0)
        return -1;
    model->origin_ns = model->sim.world.now_ns;
    model->tick_ns = model->rig.period_ns;
    model->enable = true;
    model->was_enabled = false;
    if (model_enable(model) < 0)
        return -1;
    model->enable = enable;
    model->origin_ns += model->tick_ns;
    model->now_ns = model->point_ns = model->tick_ns = 0;
    sim_world_run(&model->sim.world, model->origin_ns);
    model_look(model);
    model->is_running = true;
    return 0;
}

void fmu_model_step(struct fmu_model *model, int64_t until_ns)
{
    model->point_ns = model->now_ns;
    while (model->tick_ns < until_ns)
        model_tick(model, true);
    if (until_ns > model->now_ns) {
        model->now_ns = until_ns;
        sim_world_run(&model->sim.world, model->origin_ns + until_ns);
    }
    model_look(model);
}

/* --- values --- */

static int model_complain(struct fmu_model *model, uint32_t reference,
                          const char *what)
{
    snprintf(model->message, sizeof model->message, "value reference %u: %s",
             reference, what);
    return -1;
}

static double *model_value(struct fmu_model *model, uint32_t reference,
                           bool is_boolean, bool sets)
{
    unsigned i;
    enum fmu_of_axis of;
    const char *wrong = NULL;

    if (!fmu_find(&model->rig, reference, &i, &of))
        wrong = "there is no such variable";
    else if ((fmu_of_axis[of].unit == FMU_UNIT_BOOLEAN) != is_boolean)
        wrong = "is of another type";
    else if (sets && fmu_of_axis[of].causality == FMU_OUTPUT)
        wrong = "is an output";
    else if (sets && fmu_of_axis[of].causality == FMU_PARAMETER &&
             model->is_running)
        wrong = "is a parameter, which is set before the initialisation ends";
    if (wrong == NULL)
        return &model->axis[i].value[of];
    (void)model_complain(model, reference, wrong);
    return NULL;
}

int fmu_model_get(struct fmu_model *model, uint32_t reference, bool is_boolean,
                  double *value)
{
    if (reference == FMU_ENABLE && is_boolean) {
        *value = model->enable;
        return 0;
    }
    const double *const of = model_value(model, reference, is_boolean, false);
    if (of == NULL)
        return -1;
    *value = *of;
    return 0;
}

int fmu_model_set(struct fmu_model *model, uint32_t reference, bool is_boolean,
                  double value)
{
    if (!isfinite(value))
        return model_complain(model, reference, "is not a finite number");
    if (reference == FMU_ENABLE && is_boolean) {
        model->enable = value != 0;
        return 0;
    }
    double *const of = model_value(model, reference, is_boolean, true);
    if (of == NULL)
        return -1;
    *of = value;
    return 0;
}
