/* sim/device/odrive/servo.c - frames, states, errors.  See servo.h. */
#include "sim/device/odrive/servo.h"

#include <math.h>
#include <string.h>

#include "sim/device/odrive/parts.h"
#include "sim/util.h"

#define ODRIVE_MS        INT64_C(1000000)
#define ODRIVE_S         1e9
#define ODRIVE_REBOOT_NS (400 * ODRIVE_MS)

#define ODRIVE_ERROR_INVALID_STATE UINT32_C(0x1)

/* The same trouble in the two firmwares. */
struct odrive_error {
    uint32_t of_05, of_06;
};
static const struct odrive_error odrive_watchdog = { 0x800, 0x1000000 };
static const struct odrive_error odrive_estop = { 0x4000, 0x2000000 };
static const struct odrive_error odrive_encoder = { 0x100, 0x8 };
static const struct odrive_error odrive_current = { 0, 0x1000 };
static const struct odrive_error odrive_hot = { 0, 0x2000 };

static struct sim_odrive *odrive_of(struct sim_servo *base)
{
    return CONTAINER_OF(base, struct sim_odrive, base);
}

/* ---- numbers on the wire ---- */

static float odrive_get_float(const uint8_t *at)
{
    float value;

    memcpy(&value, at, sizeof value);
    return value;
}

static uint32_t odrive_get_u32(const uint8_t *at)
{
    uint32_t value;

    memcpy(&value, at, sizeof value);
    return value;
}

static int odrive_get_i16(const uint8_t *at)
{
    int16_t value;

    memcpy(&value, at, sizeof value);
    return value;
}

static void odrive_put(uint8_t *at, const void *value)
{
    memcpy(at, value, 4);
}

static void odrive_transmit(struct sim_odrive *self, unsigned command,
                            const uint8_t data[8])
{
    struct hal_can_frame frame = {
        .id = (uint32_t)self->config.node * 32 + command,
        .len = 8,
    };

    memcpy(frame.data, data, 8);
    (void)hal_can_send(&self->base.port.can, &frame);
}

/* ---- what it says ---- */

static void odrive_heartbeat(struct sim_odrive *self)
{
    uint8_t data[8] = { 0 };

    odrive_put(data, &self->error);
    data[4] = self->axis_state;
    if (self->config.is_05) {
        data[5] = self->parts & 1;
        data[6] = self->parts >> 1 & 1;
        data[7] =
            (uint8_t)((self->parts >> 2 & 1) | (self->traj_done ? 0x80 : 0));
    } else {
        data[5] = self->result;
        data[6] = self->traj_done;
    }
    odrive_transmit(self, 0x01, data);
}

static void odrive_estimates(struct sim_odrive *self)
{
    float pos, vel;
    uint8_t data[8];

    sim_servo_advance(&self->base);
    pos =
        (float)((double)(sim_servo_reported_q24(&self->base) - self->zero_q24) /
                ODRIVE_TURN_Q24);
    vel = (float)((double)self->base.plant.vel_q24 / ODRIVE_TURN_Q24);
    if (self->base.nan)
        pos = NAN;
    odrive_put(data, &pos);
    odrive_put(&data[4], &vel);
    odrive_transmit(self, 0x09, data);
}

static void odrive_version(struct sim_odrive *self)
{
    static const uint8_t data[8] = { 2, 4, 4, 58, 0, 6, 9, 0 };

    odrive_transmit(self, 0x00, data);
}

static void odrive_errors(struct sim_odrive *self)
{
    const uint32_t motor = self->parts & 1; /* 0.5: u64 */
    uint8_t data[8] = { 0 };

    odrive_put(data, self->config.is_05 ? &motor : &self->error);
    if (!self->config.is_05)
        odrive_put(&data[4], &self->reason);
    odrive_transmit(self, 0x03, data);
}

static void odrive_pair(struct sim_odrive *self, unsigned command, float first,
                        float second)
{
    uint8_t data[8];

    odrive_put(data, &first);
    odrive_put(&data[4], &second);
    odrive_transmit(self, command, data);
}

static double odrive_torque_nm(struct sim_odrive *self)
{
    sim_servo_advance(&self->base);
    return sim_servo_torque(&self->base) * self->config.torque_nm;
}

static void odrive_currents(struct sim_odrive *self)
{
    const float current_a =
        (float)(odrive_torque_nm(self) / self->config.torque_constant);

    if (self->base.readings.missing)
        return;
    odrive_pair(self, 0x14, current_a, current_a);
}

static void odrive_temperatures(struct sim_odrive *self)
{
    sim_servo_advance(&self->base);
    const float warmth_degc = (float)sim_readings_warmth_degc(
        &self->base.readings, &self->base.plant);

    if (!self->base.readings.missing)
        odrive_pair(self, 0x15, 31.5f + warmth_degc, 27.25f + warmth_degc);
}

static void odrive_supply(struct sim_odrive *self)
{
    if (!self->base.readings.missing)
        odrive_pair(self, 0x17, 24.0f + (float)self->base.readings.more_v,
                    0.5f);
}

static void odrive_torques(struct sim_odrive *self)
{
    const float torque_nm = (float)odrive_torque_nm(self);

    odrive_pair(self, 0x1C, torque_nm, torque_nm);
}

static void odrive_powers(struct sim_odrive *self)
{
    odrive_pair(self, 0x1D, 12.0f, 0.0f);
}

/* A bit for the part, as it has none of its own. */
static void odrive_part_error(struct sim_odrive *self, unsigned command,
                              unsigned part)
{
    const uint32_t error = self->parts >> part & 1;
    uint8_t data[8] = { 0 };

    odrive_put(data, &error);
    odrive_transmit(self, command, data);
}

static void odrive_encoder_error(struct sim_odrive *self)
{
    odrive_part_error(self, 0x04, 1);
}

static void odrive_controller_error(struct sim_odrive *self)
{
    odrive_part_error(self, 0x1D, 2);
}

/* By command: who answers a remote frame in firmware 0.5 and in 0.6. */
static void (*const odrive_answers[32][2])(struct sim_odrive *self) = {
    [0x00] = { NULL, odrive_version },
    [0x03] = { odrive_errors, odrive_errors },
    [0x04] = { odrive_encoder_error, NULL },
    [0x09] = { odrive_estimates, odrive_estimates },
    [0x14] = { odrive_currents, odrive_currents },
    [0x15] = { NULL, odrive_temperatures },
    [0x17] = { odrive_supply, odrive_supply },
    [0x1C] = { NULL, odrive_torques },
    [0x1D] = { odrive_controller_error, odrive_powers },
};

static void odrive_requested(struct sim_odrive *self, unsigned command)
{
    if (odrive_answers[command][!self->config.is_05] != NULL)
        odrive_answers[command][!self->config.is_05](self);
}

/* ---- states and errors ---- */

static void odrive_enter(struct sim_odrive *self, enum sim_odrive_state state)
{
    odrive_motion_begin(self);
    self->axis_state = (uint8_t)state;
}

static void odrive_disarm(struct sim_odrive *self,
                          const struct odrive_error *error)
{
    const uint32_t bits = self->config.is_05 ? error->of_05 : error->of_06;

    self->error |= bits;
    self->reason = bits;
    self->result = 3;
    odrive_enter(self, SIM_ODRIVE_IDLE);
}

static bool odrive_fails(const struct sim_odrive *self)
{
    return self->error != 0 || self->parts != 0 || self->base.encoder_lost;
}

static void odrive_set_state(struct sim_odrive *self, uint32_t state)
{
    if (self->base.ignores_state)
        return;
    if (state == SIM_ODRIVE_IDLE) {
        self->result = self->axis_state == SIM_ODRIVE_IDLE ? 0 : 2;
        odrive_enter(self, SIM_ODRIVE_IDLE);
    } else if (odrive_fails(self)) {
        self->result = 3; /* stays in idle */
    } else if (state == SIM_ODRIVE_CLOSED_LOOP || state == SIM_ODRIVE_HOMING) {
        self->result = state == SIM_ODRIVE_HOMING; /* busy */
        odrive_enter(self, (enum sim_odrive_state)state);
    } else {
        self->result = 13;
        self->error |= self->config.is_05 ? ODRIVE_ERROR_INVALID_STATE : 0;
    }
}

void odrive_motion_homed(struct sim_odrive *self)
{
    self->result = 0;
    self->zero_q24 = (int64_t)self->config.home_counts * (1 << 24);
    self->axis_state = SIM_ODRIVE_IDLE;
}

static void odrive_clear(struct sim_odrive *self)
{
    self->error = 0;
    self->reason = 0;
    self->parts = self->base.encoder_lost ? 2 : 0;
    if (self->base.encoder_lost)
        self->error =
            self->config.is_05 ? odrive_encoder.of_05 : odrive_encoder.of_06;
}

/* ---- parameters of 0.6 ---- */

static void odrive_write_parameter(struct sim_odrive *self, unsigned endpoint,
                                   const uint8_t *value)
{
    if (endpoint == self->config.enable_watchdog)
        self->watchdog_on = value[0] != 0;
    else if (endpoint == self->config.watchdog_timeout)
        self->watchdog_s = odrive_get_float(value);
}

static void odrive_parameter(struct sim_odrive *self, const uint8_t *request)
{
    const unsigned endpoint = request[1] | (unsigned)request[2] << 8;
    uint8_t answer[8] = { 0, request[1], request[2] };

    if (request[0] == 1) {
        odrive_write_parameter(self, endpoint, &request[4]);
        return;
    }
    if (endpoint == self->config.enable_watchdog)
        answer[4] = self->watchdog_on;
    else if (endpoint == self->config.watchdog_timeout)
        odrive_put(&answer[4], &self->watchdog_s);
    else
        return;
    odrive_transmit(self, 0x05, answer);
}

/* ---- orders ---- */

static void odrive_input_pos(struct sim_odrive *self, const uint8_t *data)
{
    sim_servo_advance(&self->base);
    self->input_q24 =
        odrive_q24((double)odrive_get_float(data)) + self->zero_q24;
    self->input_vel_q24 = odrive_q24(odrive_get_i16(&data[4]) * 0.001);
    self->torque = (float)odrive_get_i16(&data[6]) * 0.001f;
    self->traj_new = true;
}

static void odrive_input_vel(struct sim_odrive *self, const uint8_t *data)
{
    sim_servo_advance(&self->base);
    self->input_vel_q24 = odrive_q24((double)odrive_get_float(data));
    self->torque = odrive_get_float(&data[4]);
}

static void odrive_mode(struct sim_odrive *self, const uint8_t *data)
{
    sim_servo_advance(&self->base);
    self->control_mode = odrive_get_u32(data);
    self->input_mode = odrive_get_u32(&data[4]);
}

static void odrive_estop_order(struct sim_odrive *self, const uint8_t *data)
{
    (void)data;
    odrive_disarm(self, &odrive_estop);
}

static void odrive_state_order(struct sim_odrive *self, const uint8_t *data)
{
    odrive_set_state(self, odrive_get_u32(data));
}

static void odrive_traj_vel(struct sim_odrive *self, const uint8_t *data)
{
    self->traj_vel = odrive_get_float(data);
}

static void odrive_traj_acc(struct sim_odrive *self, const uint8_t *data)
{
    self->traj_acc = odrive_get_float(data);
    self->traj_dec = odrive_get_float(&data[4]);
}

static void odrive_clear_order(struct sim_odrive *self, const uint8_t *data)
{
    (void)data;
    odrive_clear(self);
}

static void odrive_sdo_order(struct sim_odrive *self, const uint8_t *data)
{
    if (!self->config.is_05)
        odrive_parameter(self, data);
}

/* By command: how many bytes it has, and who does it. */
static const struct {
    uint8_t bytes;
    void (*run)(struct sim_odrive *self, const uint8_t *data);
} odrive_orders[32] = {
    [0x02] = { 0, odrive_estop_order }, [0x04] = { 8, odrive_sdo_order },
    [0x07] = { 4, odrive_state_order }, [0x0B] = { 8, odrive_mode },
    [0x0C] = { 8, odrive_input_pos },   [0x0D] = { 8, odrive_input_vel },
    [0x11] = { 4, odrive_traj_vel },    [0x12] = { 8, odrive_traj_acc },
    [0x18] = { 0, odrive_clear_order },
};

static void odrive_on_frame(struct sim_servo *base,
                            const struct hal_can_frame *frame)
{
    struct sim_odrive *self = odrive_of(base);
    const unsigned command = frame->id & 31;

    if (frame->extended || frame->fd || frame->id >> 5 != self->config.node)
        return;
    self->fed_ns = self->base.world->now_ns;
    if (frame->remote) {
        odrive_requested(self, command);
    } else if (odrive_orders[command].run != NULL &&
               frame->len >= odrive_orders[command].bytes) {
        self->orders++;
        odrive_orders[command].run(self, frame->data);
    }
}

/* ---- time ---- */

static void odrive_watch(struct sim_odrive *self)
{
    const bool is_armed = self->axis_state != SIM_ODRIVE_IDLE;

    if (self->watchdog_on && is_armed &&
        (double)(self->base.world->now_ns - self->fed_ns) >
            (double)self->watchdog_s * ODRIVE_S)
        odrive_disarm(self, &odrive_watchdog);
}

/* Due times that have passed are moved on; not caught up with. */
static bool odrive_is_due(int64_t *due_ns, int64_t period_ns, int64_t now_ns)
{
    if (*due_ns > now_ns)
        return false;
    *due_ns += period_ns;
    if (*due_ns <= now_ns)
        *due_ns = now_ns + period_ns;
    return true;
}

static int64_t odrive_due_ns(const struct sim_member *member)
{
    const struct sim_odrive *self =
        CONTAINER_OF_CONST(member, struct sim_odrive, base.member);
    int64_t due_ns = self->loop_due_ns;

    if (self->heartbeat_due_ns < due_ns)
        due_ns = self->heartbeat_due_ns;
    return self->estimates_due_ns < due_ns ? self->estimates_due_ns : due_ns;
}

static void odrive_run(struct sim_member *member, int64_t now_ns)
{
    struct sim_odrive *self =
        CONTAINER_OF(member, struct sim_odrive, base.member);

    sim_servo_advance(&self->base);
    if (odrive_is_due(&self->loop_due_ns, self->base.loop_ns, now_ns))
        odrive_watch(self);
    if (odrive_is_due(&self->heartbeat_due_ns, self->config.heartbeat_ns,
                      now_ns))
        odrive_heartbeat(self);
    if (odrive_is_due(&self->estimates_due_ns, self->config.estimates_ns,
                      now_ns))
        odrive_estimates(self);
}

/* ---- power ---- */

static void odrive_power_on(struct sim_odrive *self, int64_t boot_ns)
{
    const int64_t from_ns = self->base.world->now_ns + boot_ns;

    sim_servo_boot(&self->base, boot_ns);
    self->axis_state = SIM_ODRIVE_IDLE;
    self->error = self->reason = 0;
    self->zero_q24 = 0;
    self->parts = self->base.encoder_lost ? 2 : 0;
    self->control_mode = SIM_ODRIVE_CONTROL_POSITION;
    self->input_mode = SIM_ODRIVE_PASSTHROUGH;
    self->traj_vel = 2;
    self->traj_acc = self->traj_dec = 0.5f;
    self->traj_done = true;
    self->watchdog_on = false;
    self->watchdog_s = 0;
    self->heartbeat_due_ns = from_ns;
    self->estimates_due_ns =
        self->config.estimates_ns > 0 ? from_ns : SIM_WORLD_NEVER;
}

/* ---- what may happen to it ---- */

static void odrive_trip(struct sim_servo *base, uint32_t code)
{
    struct sim_odrive *self = odrive_of(base);
    const struct odrive_error error = { code, code };

    odrive_disarm(self, code != 0 ? &error : &odrive_current);
    if (self->config.is_05)
        self->parts |= 1;
}

static void odrive_heat(struct sim_servo *base, enum sim_servo_heat heat)
{
    struct sim_odrive *self = odrive_of(base);

    if (heat != SIM_SERVO_HOT)
        return;
    odrive_disarm(self, &odrive_hot);
    if (self->config.is_05)
        self->parts |= 1;
}

static void odrive_lose_encoder(struct sim_servo *base)
{
    struct sim_odrive *self = odrive_of(base);

    self->parts |= 2;
    odrive_disarm(self, &odrive_encoder);
}

static void odrive_reboot(struct sim_servo *base)
{
    odrive_power_on(odrive_of(base), ODRIVE_REBOOT_NS);
}

static uint32_t odrive_heartbeat_id(const struct sim_servo *base)
{
    return (uint32_t)CONTAINER_OF_CONST(base, struct sim_odrive, base)
                   ->config.node
               << 5 |
           0x01;
}

static const struct sim_servo_ops odrive_ops = {
    .member = { .due_ns = odrive_due_ns, .run = odrive_run },
    .on_frame = odrive_on_frame,
    .step = odrive_motion_step,
    .lose_encoder = odrive_lose_encoder,
    .trip = odrive_trip,
    .reboot = odrive_reboot,
    .heat = odrive_heat,
    .heartbeat_id = odrive_heartbeat_id,
};

/* ---- init ---- */

static void odrive_defaults(struct sim_odrive_config *config)
{
    if (config->heartbeat_ns == 0)
        config->heartbeat_ns = 100 * ODRIVE_MS;
    if (config->estimates_ns == 0)
        config->estimates_ns = 10 * ODRIVE_MS;
    if (config->torque_nm == 0)
        config->torque_nm = 1;
    if (config->torque_constant == 0)
        config->torque_constant = 0.4;
}

static bool odrive_is_legal(const struct sim_odrive_config *config)
{
    return config->node <= 62 && config->boot_ns >= 0 &&
           config->heartbeat_ns > 0 && config->torque_nm > 0 &&
           config->torque_constant > 0;
}

int sim_odrive_init(struct sim_odrive *self, struct sim_can_bus *bus,
                    const struct sim_odrive_config *config)
{
    int err;

    *self = (struct sim_odrive){ .config = *config };
    odrive_defaults(&self->config);
    if (!odrive_is_legal(&self->config))
        return MOTION_E_ARG;
    err = sim_servo_init(&self->base, bus, &odrive_ops, &config->plant,
                         config->start_counts, config->loop_ns);
    if (err < 0)
        return err;
    self->loop_due_ns = self->base.world->now_ns + self->base.loop_ns;
    odrive_power_on(self, self->config.boot_ns);
    return MOTION_OK;
}
