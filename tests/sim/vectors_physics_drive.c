/* tests/sim/vectors_physics_drive.c - families of sim/physics/drivetrain.h. */
#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/physics/drivetrain.h"
#include "tests/motion/vectors_json.h"
#include "tests/sim/oracle.h"
#include "tests/sim/vectors_physics.h"

#define EVENTS_MAX     4096
#define EVENT_MARGIN_S 0.1
#define SETTLE_S       10.0
#define CYCLES_S       30.0

struct drive {
    const cJSON *item;
    struct sim_drivetrain drive;
    struct sim_drivetrain_config config;
    struct sim_drivetrain_input input;
    struct sim_drivetrain_event events[EVENTS_MAX];
    const char *torque, *support; /* names of inputs */
    double torque_scale;
    /* limit cycle */
    struct physics_crossings load;
    double highest, lowest;
};

static void drive_watch_cycle(struct drive *self, double t_s, double step_s)
{
    const int last = self->config.inertias - 1;
    const double angle = self->drive.y[last];

    if (t_s < SETTLE_S)
        return;
    physics_crossings_add(&self->load, t_s + step_s, step_s,
                          angle - self->config.loop.ref_rad,
                          sim_drivetrain_speed_rad_s(&self->drive, last));
    self->highest = fmax(self->highest, angle);
    self->lowest = fmin(self->lowest, angle);
}

static void drive_set_input(struct drive *self, double t_s)
{
    self->input.torque_n_m = physics_input(self->item, self->torque, t_s);
    for (int i = 0; i < SIM_SIGNAL_COEFFICIENTS; i++)
        self->input.torque_n_m.c[i] *= self->torque_scale;
    if (self->support != NULL)
        self->input.support_rad = physics_input(self->item, self->support, t_s);
    if (self->config.motor.inductance_h > 0)
        self->input.voltage_v = physics_input(self->item, "voltage", t_s);
}

static int drive_step(void *plant, double t_s, double step_s)
{
    struct drive *const self = plant;

    drive_set_input(self, t_s);
    if (sim_drivetrain_step(&self->drive, t_s, step_s, &self->input) < 0)
        return -1;
    drive_watch_cycle(self, t_s, step_s);
    drive_set_input(self, t_s + step_s);
    return 0;
}

/* Of an ideal loop what it is told, within its limit and what the voltage drives
 * against the motor's own. */
static double drive_current(const struct drive *self)
{
    const struct sim_motor *const motor = &self->config.motor;
    const int n = self->config.inertias;
    const double back_v = motor->torque_constant_n_m_a * self->drive.y[n];
    double current = self->input.current_a.c[0];

    if (motor->inductance_h > 0)
        return self->drive.y[2 * n];
    if (motor->current_limit_a > 0)
        current = fmax(-motor->current_limit_a,
                       fmin(motor->current_limit_a, current));
    if (motor->voltage_limit_v > 0)
        current =
            fmax((-motor->voltage_limit_v - back_v) / motor->resistance_ohm,
                 fmin((motor->voltage_limit_v - back_v) / motor->resistance_ohm,
                      current));
    return current;
}

static int drive_read(void *plant, const char *q, double *to, int capacity)
{
    struct drive *const self = plant;
    const struct sim_drivetrain *const drive = &self->drive;
    const int i = q[0] != '\0' ? q[strlen(q) - 1] - '1' : -1;

    (void)capacity;
    if (i >= 0 && i < self->config.inertias && strncmp(q, "angle_", 6) == 0)
        to[0] = drive->y[i];
    else if (i >= 0 && i < self->config.inertias &&
             strncmp(q, "speed_", 6) == 0)
        to[0] = sim_drivetrain_speed_rad_s(drive, i);
    else if (i >= 0 && i + 1 < self->config.inertias &&
             strncmp(q, "twist_", 6) == 0)
        to[0] = sim_drivetrain_twist_rad(drive, i);
    else if (strcmp(q, "x") == 0 || strcmp(q, "angle") == 0)
        to[0] = drive->y[0];
    else if (strcmp(q, "v") == 0 || strcmp(q, "speed") == 0)
        to[0] = sim_drivetrain_speed_rad_s(drive, 0);
    else if (strcmp(q, "current") == 0)
        to[0] = drive_current(self);
    else if (strcmp(q, "energy") == 0)
        to[0] = oracle_drivetrain_energy_j(drive);
    else if (strcmp(q, "momentum") == 0)
        to[0] = self->config.coupling[0].ratio *
                    self->config.inertia[0].inertia_kg_m2 *
                    sim_drivetrain_speed_rad_s(drive, 0) +
                self->config.inertia[1].inertia_kg_m2 *
                    sim_drivetrain_speed_rad_s(drive, 1);
    else
        return -1;
    return 1;
}

/* Times (or speeds) of the events of one kind. */
static int drive_events(const struct drive *self, enum sim_drivetrain_kind kind,
                        bool speeds, double *to, int capacity)
{
    int count = 0;

    for (unsigned i = 0; i < self->drive.events_count && i < EVENTS_MAX; i++) {
        if (self->events[i].kind == kind && count < capacity)
            to[count++] = speeds ? fabs(self->events[i].speed_rad_s)
                                 : self->events[i].t_s;
    }
    return count;
}

static int drive_slips(const struct drive *self, const cJSON *entry, double *to,
                       int capacity)
{
    const cJSON *kind = cJSON_GetArrayItem(vectors_get(entry, "kinds"), 0);
    int count = 0;

    for (unsigned i = 0; i < self->drive.events_count && i < EVENTS_MAX; i++) {
        const bool slips = self->events[i].kind == SIM_DRIVETRAIN_SLIP;
        if (count == capacity)
            break;
        if (strcmp(vectors_string(kind), slips ? "slip" : "stop") != 0)
            return -1;
        to[count++] = self->events[i].t_s;
        kind = kind->next;
    }
    return count;
}

static int drive_last(const struct drive *self, enum sim_drivetrain_kind kind,
                      double *to)
{
    double times[EVENTS_MAX];
    const int count = drive_events(self, kind, false, times, EVENTS_MAX);

    if (count == 0)
        return 0;
    to[0] = times[count - 1];
    return 1;
}

static int drive_slip_period(const struct drive *self, double *to)
{
    double times[EVENTS_MAX];
    const int count =
        drive_events(self, SIM_DRIVETRAIN_SLIP, false, times, EVENTS_MAX);

    if (count < 2)
        return 0;
    to[0] = times[count - 1] - times[count - 2];
    return 1;
}

/* From the last slip to the stop after it. */
static int drive_jump(const struct drive *self, double *to)
{
    const struct sim_drivetrain_event *const events = self->events;
    unsigned last = self->drive.events_count;

    if (last > EVENTS_MAX)
        return -1;
    while (last > 0 && events[last - 1].kind != SIM_DRIVETRAIN_STICK)
        last--;
    if (last < 2)
        return 0;
    to[0] = events[last - 1].angle_rad - events[last - 2].angle_rad;
    return 1;
}

/* --- the linear drive: y' = rate y + push torque ------------------------------ */

#define LINEAR_MAX (2 * SIM_DRIVETRAIN_INERTIAS)

struct linear {
    int size;
    double rate[LINEAR_MAX][LINEAR_MAX], push[LINEAR_MAX];
};

/* y' at y and a torque, by a step and two halves. */
static void drive_rate(const struct sim_drivetrain_config *config,
                       const double *y, double torque, double *rate)
{
    const double step_s = 1e-7;
    const struct sim_drivetrain_input input = { .torque_n_m.c[0] = torque };
    const int size = 2 * config->inertias;
    struct sim_drivetrain drive;

    for (int halves = 1; halves <= 2; halves++) {
        (void)sim_drivetrain_init(&drive, config);
        memcpy(drive.y, y, (size_t)size * sizeof *y);
        sim_drivetrain_reset(&drive);
        (void)sim_drivetrain_step(&drive, 0, step_s / halves, &input);
        for (int i = 0; i < size; i++) {
            const double mean = (drive.y[i] - y[i]) / (step_s / halves);
            rate[i] = halves == 1 ? mean : 2 * mean - rate[i];
        }
    }
}

static void drive_linear(const struct sim_drivetrain_config *config,
                         struct linear *linear)
{
    double y[LINEAR_MAX] = { 0 }, column[LINEAR_MAX];

    linear->size = 2 * config->inertias;
    drive_rate(config, y, 1, linear->push);
    for (int j = 0; j < linear->size; j++) {
        y[j] = 1;
        drive_rate(config, y, 0, column);
        y[j] = 0;
        for (int i = 0; i < linear->size; i++)
            linear->rate[i][j] = column[i];
    }
}

/* (i omega - rate)^-1 push: y over the torque; Gauss, largest pivot. */
static void linear_respond(const struct linear *linear, double freq_hz,
                           double complex y[LINEAR_MAX])
{
    const double omega = 6.283185307179586 * freq_hz;
    const int n = linear->size;
    double complex a[LINEAR_MAX][LINEAR_MAX + 1];

    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++)
            a[i][j] = (i == j ? I * omega : 0) - linear->rate[i][j];
        a[i][n] = linear->push[i];
    }
    for (int i = 0; i < n; i++) {
        int pivot = i;
        for (int k = i + 1; k < n; k++)
            pivot = cabs(a[k][i]) > cabs(a[pivot][i]) ? k : pivot;
        for (int j = i; j <= n; j++) {
            const double complex kept = a[i][j];
            a[i][j] = a[pivot][j];
            a[pivot][j] = kept;
        }
        for (int k = i + 1; k < n; k++)
            for (int j = n; j >= i; j--)
                a[k][j] -= a[k][i] / a[i][i] * a[i][j];
    }
    for (int i = n - 1; i >= 0; i--) {
        y[i] = a[i][n];
        for (int j = i + 1; j < n; j++)
            y[i] -= a[i][j] * y[j];
        y[i] /= a[i][i];
    }
}

static double drive_gain(const struct linear *linear, double freq_hz)
{
    double complex y[LINEAR_MAX];

    linear_respond(linear, freq_hz, y);
    return cabs(y[linear->size / 2]);
}

/* Maxima (sign 1) or minima of the motor's gain, from low to high, over a
 * geometric grid and then by golden section. */
static int drive_extremes(const struct sim_drivetrain_config *config, int sign,
                          double *to, int capacity)
{
    struct linear linear;
    const double ratio = 1.002, golden = 0.6180339887498949;
    double before = 0, here = 0;
    int count = 0, seen = 0;

    drive_linear(config, &linear);
    for (double freq = 1e-3; freq < 1e5 && count < capacity; freq *= ratio) {
        const double next = sign * drive_gain(&linear, freq);
        if (seen++ >= 2 && here > before && here >= next) {
            double low = freq / ratio / ratio, high = freq;
            for (int i = 0; i < 60; i++) {
                const double a = high - golden * (high - low),
                             b = low + golden * (high - low);
                if (sign * drive_gain(&linear, a) >
                    sign * drive_gain(&linear, b))
                    high = b;
                else
                    low = a;
            }
            to[count++] = 0.5 * (low + high);
        }
        before = here;
        here = next;
    }
    return count;
}

static int drive_response(const struct drive *self, const cJSON *entry,
                          double *to, int capacity)
{
    const char *const q = vectors_text(entry, "q");
    const int n = self->config.inertias;
    const cJSON *freq;
    double complex y[LINEAR_MAX];
    struct linear linear;
    int count = 0;

    drive_linear(&self->config, &linear);
    cJSON_ArrayForEach(freq, vectors_get(entry, "freq_hz"))
    {
        linear_respond(&linear, freq->valuedouble, y);
        if (count == capacity)
            return -1;
        if (strcmp(q, "gain_motor") == 0)
            to[count++] = cabs(y[n]);
        else if (strcmp(q, "phase_motor") == 0)
            to[count++] = carg(y[n]);
        else if (strcmp(q, "gain_load") == 0)
            to[count++] = cabs(y[2 * n - 1]);
        else
            return -1;
    }
    return count;
}

static int drive_result(void *plant, const cJSON *entry, double *to,
                        int capacity)
{
    struct drive *const self = plant;
    const char *const q = vectors_text(entry, "q");
    const bool cycles = self->config.loop.kp_n_m_rad != 0;

    if (cJSON_HasObjectItem(entry, "freq_hz"))
        return drive_response(self, entry, to, capacity);
    if (strcmp(q, "resonance") == 0)
        return drive_extremes(&self->config, 1, to, capacity);
    if (strcmp(q, "antiresonance") == 0)
        return drive_extremes(&self->config, -1, to, capacity);
    if (strcmp(q, "events") == 0)
        return drive_slips(self, entry, to, capacity);
    if (strcmp(q, "stop_time") == 0)
        return drive_last(self, SIM_DRIVETRAIN_STICK, to);
    if (strcmp(q, "rest_time") == 0)
        return drive_last(self, SIM_DRIVETRAIN_REST, to);
    if (strcmp(q, "corner_time") == 0)
        return drive_events(self, SIM_DRIVETRAIN_VOLTAGE, false, to, capacity);
    if (strcmp(q, "first_contact") == 0)
        return drive_events(self, SIM_DRIVETRAIN_CONTACT, false, to, capacity);
    if (strcmp(q, "contact_times") == 0)
        return drive_events(self, SIM_DRIVETRAIN_STOP, false, to, capacity);
    if (strcmp(q, "rebound_speeds") == 0)
        return drive_events(self, SIM_DRIVETRAIN_STOP, true, to, capacity);
    if (strcmp(q, "rest_x") == 0)
        return drive_read(self, "x", to, capacity);
    if (strcmp(q, "jump") == 0)
        return drive_jump(self, to);
    if (strcmp(q, "period") == 0 && !cycles)
        return drive_slip_period(self, to);
    if (strcmp(q, "period") == 0)
        to[0] = physics_crossings_period(&self->load, EVENTS_MAX);
    else if (strcmp(q, "amplitude") == 0 && cycles)
        to[0] = 0.5 * (self->highest - self->lowest);
    else
        return -1;
    return 1;
}

/* How long to run for what is listed without times. */
static double drive_duration(const cJSON *item)
{
    const cJSON *entry;
    double want[EVENTS_MAX], duration = 0;

    cJSON_ArrayForEach(entry, vectors_get(item, "expect"))
    {
        const char *const unit = vectors_text(entry, "unit");
        const int count =
            physics_flatten(vectors_get(entry, "want"), want, EVENTS_MAX);
        if (strcmp(unit, "s") != 0 || cJSON_HasObjectItem(entry, "t"))
            continue;
        for (int i = 0; i < count; i++)
            duration = fmax(duration, want[i] + EVENT_MARGIN_S);
    }
    return duration;
}

static struct drive *drive_new(const cJSON *item, struct physics_plant *plant)
{
    struct drive *const self = calloc(1, sizeof *self);

    if (self == NULL)
        return NULL;
    *plant = (struct physics_plant){ self, drive_step, drive_read, drive_result,
                                     drive_duration(item) };
    self->item = item;
    self->torque = "torque";
    self->torque_scale = 1;
    self->config.inertias = 1;
    self->highest = -INFINITY;
    self->lowest = INFINITY;
    return self;
}

static bool drive_begin(struct drive *self, const double *y)
{
    if (sim_drivetrain_init(&self->drive, &self->config) < 0)
        return false;
    self->drive.events = self->events;
    self->drive.events_max = EVENTS_MAX;
    memcpy(self->drive.y, y,
           2 * (size_t)self->config.inertias * sizeof self->drive.y[0]);
    sim_drivetrain_reset(&self->drive);
    drive_set_input(self, 0);
    return true;
}

static double value_or(const cJSON *item, const char *name, double other)
{
    const double value = vectors_value_of(item, name);

    return isnan(value) ? other : value;
}

static bool drive_row(struct sim_drivetrain_config *config, const cJSON *system)
{
    double of[SIM_DRIVETRAIN_INERTIAS];
    const int n = cJSON_GetArraySize(vectors_get(system, "inertia"));

    config->inertias = n;
    if (n < 1 || n > SIM_DRIVETRAIN_INERTIAS ||
        !physics_list(system, "inertia", of, n))
        return false;
    for (int i = 0; i < n; i++)
        config->inertia[i].inertia_kg_m2 = of[i];
    if (cJSON_HasObjectItem(system, "viscous")) {
        if (!physics_list(system, "viscous", of, n))
            return false;
        for (int i = 0; i < n; i++)
            config->inertia[i].viscous_n_m_s = of[i];
    }
    for (int i = 0; i + 1 < n; i++) {
        const cJSON *const stiffness = vectors_get(system, "stiffness");
        const cJSON *const damping = vectors_get(system, "damping");
        config->coupling[i] = (struct sim_coupling){
            .stiffness_n_m_rad = cJSON_IsArray(stiffness)
                                     ? vectors_number_at(stiffness, i)
                                     : vectors_value(stiffness),
            .damping_n_m_s = cJSON_IsArray(damping)
                                 ? vectors_number_at(damping, i)
                                 : vectors_value(damping),
            .gap_rad = i == 0 ? value_or(system, "gap", 0) : 0,
            .ratio = i == 0 ? value_or(system, "gear_ratio", 1) : 1,
        };
    }
    return true;
}

static bool drive_state(const cJSON *item, int n, double *y)
{
    const cJSON *const initial = vectors_get(item, "initial");

    return physics_list(initial, "angle", y, n) &&
           physics_list(initial, "speed", y + n, n);
}

bool physics_make_drive(const cJSON *item, struct physics_plant *plant)
{
    struct drive *const self = drive_new(item, plant);
    const cJSON *const system = vectors_get(item, "system");
    const cJSON *const controller = vectors_get(system, "controller");
    double y[2 * SIM_DRIVETRAIN_INERTIAS];

    if (self == NULL || !drive_row(&self->config, system) ||
        !drive_state(item, self->config.inertias, y))
        return false;
    if (controller != NULL) {
        self->config.loop = (struct sim_loop){
            .kp_n_m_rad = vectors_value_of(controller, "kp"),
            .ki_n_m_rad_s = vectors_value_of(controller, "ki"),
            .kd_n_m_s = vectors_value_of(controller, "kd"),
            .ref_rad = vectors_value_of(controller, "ref"),
        };
        plant->duration_s = CYCLES_S;
    }
    return drive_begin(self, y);
}

bool physics_make_friction(const cJSON *item, struct physics_plant *plant)
{
    struct drive *const self = drive_new(item, plant);
    const cJSON *const system = vectors_get(item, "system");
    const cJSON *const friction = vectors_get(system, "friction");
    const cJSON *const pull = vectors_get(system, "pull");
    const cJSON *const initial = vectors_get(item, "initial");

    if (self == NULL)
        return false;
    self->support = "pull_x";
    self->config.inertia[0] = (struct sim_inertia){
        .inertia_kg_m2 = vectors_value_of(system, "inertia"),
        .viscous_n_m_s = vectors_value_of(friction, "viscous"),
        .coulomb_n_m = vectors_value_of(friction, "coulomb"),
        .static_n_m = vectors_value_of(friction, "static"),
        .stribeck_rad_s = vectors_value_of(friction, "stribeck_speed"),
        .spring_n_m_rad =
            value_or(pull, "stiffness", value_or(system, "spring", 0)),
        .spring_n_m_s = value_or(pull, "damping", 0),
    };
    const double y[2] = { vectors_value_of(initial, "x"),
                          vectors_value_of(initial, "v") };
    return drive_begin(self, y);
}

bool physics_make_end_stop(const cJSON *item, struct physics_plant *plant)
{
    struct drive *const self = drive_new(item, plant);
    const cJSON *const system = vectors_get(item, "system");
    const cJSON *const initial = vectors_get(item, "initial");
    const struct sim_stop stop = {
        .high = true,
        .high_rad = vectors_value_of(system, "stop"),
        .restitution = vectors_value_of(system, "restitution"),
    };
    double y[2 * SIM_DRIVETRAIN_INERTIAS] = { vectors_value_of(initial, "x"),
                                              vectors_value_of(initial, "v") };

    if (self == NULL)
        return false;
    self->torque = "force";
    if (cJSON_HasObjectItem(system, "inertia")) {
        if (!drive_row(&self->config, system) ||
            !drive_state(item, self->config.inertias, y))
            return false;
    } else {
        self->config.inertia[0].inertia_kg_m2 =
            vectors_value_of(system, "mass");
        self->config.inertia[0].load_n_m = -value_or(system, "force", 0);
    }
    self->config.inertia[self->config.inertias - 1].stop = stop;
    return drive_begin(self, y);
}

bool physics_make_motor(const cJSON *item, struct physics_plant *plant)
{
    struct drive *const self = drive_new(item, plant);
    const cJSON *const system = vectors_get(item, "system");
    const cJSON *const initial = vectors_get(item, "initial");

    if (self == NULL)
        return false;
    self->config.inertia[0] = (struct sim_inertia){
        .inertia_kg_m2 = vectors_value_of(system, "inertia"),
        .viscous_n_m_s = vectors_value_of(system, "viscous"),
        .load_n_m = value_or(system, "load_torque_at_motor", 0),
    };
    self->config.motor = (struct sim_motor){
        .torque_constant_n_m_a = vectors_value_of(system, "torque_constant"),
        .resistance_ohm = vectors_value_of(system, "resistance"),
        .inductance_h = vectors_value_of(system, "inductance"),
        .current_limit_a = value_or(system, "current_limit", 0),
        .voltage_limit_v = value_or(system, "voltage_limit", 0),
    };
    self->input.current_a.c[0] = value_or(system, "current_command", 0);
    const double y[2] = { vectors_value_of(initial, "angle"),
                          vectors_value_of(initial, "speed") };
    if (!drive_begin(self, y))
        return false;
    self->drive.y[2] = value_or(initial, "current", 0);
    return true;
}

/* A rigid gear: all at its output. */
bool physics_make_arm(const cJSON *item, struct physics_plant *plant)
{
    struct drive *const self = drive_new(item, plant);
    const cJSON *const system = vectors_get(item, "system");
    const cJSON *const initial = vectors_get(item, "initial");
    const double gear = vectors_value_of(system, "gear_ratio");
    const double mass = vectors_value_of(system, "mass");
    const double length = vectors_value_of(system, "length");

    if (self == NULL)
        return false;
    self->torque_scale = gear;
    self->config.inertia[0] = (struct sim_inertia){
        .inertia_kg_m2 =
            vectors_value_of(system, "motor_inertia") * gear * gear +
            mass * length * length,
        .viscous_n_m_s =
            vectors_value_of(system, "motor_viscous") * gear * gear,
        .gravity_n_m = mass * length * vectors_value_of(system, "gravity"),
    };
    const double y[2] = { vectors_value_of(initial, "angle"),
                          vectors_value_of(initial, "speed") };
    return drive_begin(self, y);
}
