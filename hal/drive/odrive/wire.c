/* hal/drive/odrive/wire.c - frames in and out; see drive.h. */
#include "hal/drive/odrive/parts.h"

#include "hal/support/container_of.h"
#include "hal/support/float32.h"
#include "motion/core/fixed.h"

#define NODE_SHIFT 5u
#define COMMANDS   0x1Fu
#define BEATS_LOST 3
#define MS         INT64_C(1000000)
/* A heartbeat that left the drive before it took a go says nothing of it. */
#define GO_TAKEN_NS (3 * MS)
/* From one question for its torque to the next. */
#define TORQUE_NS (10 * MS)
/* The time between two questions for why it has switched itself off. */
#define REASON_AGAIN_NS (100 * MS)

static struct drive_odrive *odrive_of(struct can_bus_node *node)
{
    return CONTAINER_OF(node, struct drive_odrive, node);
}

/* ---- out ---- */

static struct hal_can_frame odrive_frame_to(uint8_t node,
                                            enum odrive_command command)
{
    return (struct hal_can_frame){
        .id = (uint32_t)node << NODE_SHIFT | (uint32_t)command,
    };
}

static struct hal_can_frame odrive_frame(const struct drive_odrive *self,
                                         enum odrive_command command)
{
    return odrive_frame_to(self->config.node, command);
}

void odrive_request(struct drive_odrive *self, enum odrive_command command)
{
    struct hal_can_frame frame = odrive_frame(self, command);

    frame.remote = true;
    (void)can_bus_send(&self->node, &frame);
}

int odrive_send(struct drive_odrive *self, enum odrive_command command,
                const uint8_t *data, unsigned length)
{
    struct hal_can_frame frame = odrive_frame(self, command);

    frame.len = (uint8_t)length;
    for (unsigned i = 0; i < length; i++)
        frame.data[i] = data[i];
    return can_bus_send(&self->node, &frame);
}

int odrive_send_u32(struct drive_odrive *self, enum odrive_command command,
                    uint32_t first, uint32_t second, unsigned count)
{
    uint8_t data[8];

    hal_float32_put(&data[0], first);
    hal_float32_put(&data[4], second);
    return odrive_send(self, command, data, 4 * count);
}

/* In 16 bits, held at their ends: a cast would change the sign. */
static void odrive_put_i16(uint8_t at[2], int64_t value)
{
    uint16_t word = (uint16_t)value;

    if (value > INT16_MAX)
        word = INT16_MAX;
    else if (value < INT16_MIN)
        word = (uint16_t)INT16_MIN;
    at[0] = (uint8_t)word;
    at[1] = (uint8_t)(word >> 8);
}

void drive_odrive_put_point(struct hal_can_frame *frame, uint8_t node,
                            const struct drive_turn_point *point)
{
    int64_t vel = 0; /* 0.001 turns/s */

    /* 1000 / 2^32 makes it smaller: it always fits */
    (void)motion_fixed_mulshift(point->vel_q32, 1000, 32, &vel);
    *frame = odrive_frame_to(node, ODRIVE_SET_INPUT_POS);
    frame->len = 8;
    hal_float32_put(frame->data, hal_float32_from_fixed(point->pos_q32, 32));
    odrive_put_i16(&frame->data[4], vel);
    odrive_put_i16(&frame->data[6], point->torque_mnm);
}

void odrive_send_target(struct drive_odrive *self)
{
    const struct drive_turn_point point = drive_turn_point(&self->turn);
    struct hal_can_frame frame;

    drive_odrive_put_point(&frame, self->config.node, &point);
    (void)can_bus_send(&self->node, &frame);
}

/* Of a drive that may not hear each frame: both in every cycle.  The input
 * first, as that of a go is 0. */
static void odrive_slow(struct drive_odrive *self)
{
    const uint32_t vel = hal_float32_from_fixed(self->turn.target_vel_q32, 32);

    (void)odrive_send_u32(self, ODRIVE_SET_INPUT_VEL, vel, 0, 2);
    (void)odrive_send_u32(self, ODRIVE_SET_MODE, ODRIVE_CONTROL_VELOCITY,
                          ODRIVE_PASSTHROUGH, 2);
    self->passes = false;
}

/* After a go, back to our own set points: the first one before the mode, which
 * would make for the place of the go. */
static void odrive_pass(struct drive_odrive *self)
{
    odrive_send_target(self);
    if (!self->passes &&
        odrive_send_u32(self, ODRIVE_SET_MODE, ODRIVE_CONTROL_POSITION,
                        ODRIVE_PASSTHROUGH, 2) == MOTION_OK)
        self->passes = true;
}

static uint32_t odrive_ramp(int64_t acc_q32)
{
    return hal_float32_from_fixed(acc_q32, 32);
}

/* The limits, then the mode, then where to.  Again in the next cycle when one
 * was refused. */
static void odrive_send_go(struct drive_odrive *self)
{
    const struct drive_turn *turn = &self->turn;
    const int64_t acc_q32 = turn->go.acc_q32, dec_q32 = turn->go.dec_q32;
    const uint32_t vel = hal_float32_from_fixed(turn->go.vel_q32, 32);
    uint8_t input[8] = { 0 };
    int err = odrive_send_u32(self, ODRIVE_SET_TRAJ_VEL, vel, 0, 1);

    if (err == MOTION_OK && acc_q32 > 0 && dec_q32 > 0)
        err = odrive_send_u32(self, ODRIVE_SET_TRAJ_ACC, odrive_ramp(acc_q32),
                              odrive_ramp(dec_q32), 2);
    if (err == MOTION_OK)
        err = odrive_send_u32(self, ODRIVE_SET_MODE, ODRIVE_CONTROL_POSITION,
                              ODRIVE_TRAPEZOIDAL, 2);
    self->passes = false;
    hal_float32_put(input, hal_float32_from_fixed(
                               drive_turn_raw_q32(turn, turn->go.pos_q32), 32));
    if (err == MOTION_OK)
        err = odrive_send(self, ODRIVE_SET_INPUT_POS, input, sizeof input);
    if (err == MOTION_OK)
        self->turn.go.sent_ns = turn->now_ns;
}

/* What asks for a reading. */
static const enum odrive_command odrive_readings[HAL_READINGS] = {
    [HAL_READING_TEMPERATURE] = ODRIVE_GET_TEMPERATURE,
    [HAL_READING_VOLTAGE] = ODRIVE_GET_SUPPLY,
    [HAL_READING_CURRENT] = ODRIVE_GET_IQ,
};

static void odrive_request_readings(struct drive_odrive *self, int64_t now_ns)
{
    enum hal_reading reading;

    if (!drive_turn_is_watched(&self->turn))
        return;
    while ((reading = hal_readings_next(&self->turn.readings, now_ns)) !=
           HAL_READINGS)
        odrive_request(self, odrive_readings[reading]);
}

static void odrive_send_order(struct drive_odrive *self)
{
    if (self->turn.motion == DRIVE_TURN_SLOW)
        odrive_slow(self);
    else if (self->turn.motion != DRIVE_TURN_GO)
        odrive_pass(self);
    else if (self->turn.go.sent_ns == 0)
        odrive_send_go(self);
}

static void drive_odrive_emit(struct can_bus_node *node, int64_t now_ns)
{
    struct drive_odrive *self = odrive_of(node);

    if (drive_turn_next(&self->turn) && self->turn.motion != DRIVE_TURN_HOME)
        odrive_send_order(self);
    odrive_request_readings(self, now_ns);
}

/* ---- every cycle ---- */

static void odrive_watch(struct drive_odrive *self, int64_t now_ns)
{
    if (!drive_turn_is_watched(&self->turn))
        return;
    if (now_ns - self->heartbeat_ns > BEATS_LOST * self->config.heartbeat_ns) {
        drive_turn_say(&self->turn, "no heartbeat for three periods");
        drive_turn_lose(&self->turn);
    } else if (now_ns - self->turn.actual_ns > self->config.silence_ns) {
        drive_turn_say(&self->turn, self->is_nan
                                        ? DRIVE_TURN_NAN
                                        : "reports no position any more");
        drive_turn_lose(&self->turn);
    }
}

/* Ask why it has switched itself off, until it answers, where the heartbeat does not
 * say so. */
static void odrive_request_reason(struct drive_odrive *self)
{
    const bool wanted = self->turn.phase == DRIVE_TURN_LATCHED &&
                        self->family == DRIVE_ODRIVE_06 &&
                        self->turn.fault_code == 0;

    self->reason_heard = self->reason_heard && wanted;
    self->turn.code_awaited = wanted && !self->reason_heard;
    if (!self->turn.code_awaited || self->turn.now_ns < self->reason_due_ns)
        return;
    odrive_request(self, ODRIVE_GET_ERROR);
    self->reason_due_ns = self->turn.now_ns + REASON_AGAIN_NS;
}

static bool odrive_says_current(const struct drive_odrive *self)
{
    return self->family == DRIVE_ODRIVE_05;
}

static void odrive_watch_torque(struct drive_odrive *self, int64_t now_ns)
{
    if (now_ns - self->torque_ns > 3 * TORQUE_NS)
        drive_turn_forget_torque(&self->turn);
    if (!self->config.reads_torque || !drive_turn_is_watched(&self->turn) ||
        now_ns < self->torque_due_ns)
        return;
    self->torque_due_ns = now_ns + TORQUE_NS;
    odrive_request(self, odrive_says_current(self) ? ODRIVE_GET_IQ
                                                   : ODRIVE_GET_TORQUES);
}

static void drive_odrive_step(struct can_bus_node *node, int64_t now_ns)
{
    struct drive_odrive *self = odrive_of(node);

    odrive_watch(self, now_ns);
    drive_turn_step(&self->turn, now_ns);
    odrive_request_reason(self);
    if (!self->was_told && self->turn.phase != DRIVE_TURN_LOST &&
        self->heartbeat_ns != 0)
        odrive_request(self, ODRIVE_GET_ESTIMATES);
    self->was_told = false;
    odrive_watch_torque(self, now_ns);
}

/* ---- in ---- */

static void odrive_say_error(struct drive_odrive *self, uint32_t error)
{
    struct hal_text text = drive_turn_say(&self->turn, "ODrive error 0x");
    uint16_t code = 1;

    for (uint32_t bits = error; (bits & 1) == 0 && bits != 0; bits >>= 1)
        code++;
    self->turn.fault_code = code;
    hal_text_hex(&text, error, 8);
    hal_text_put(&text, ": ");
    hal_text_put(&text, drive_odrive_error_text(self->family, error));
}

/* 0.5: error flags of motor, encoder and controller stand in bytes 5, 6 and 7;
 * the axis's own error may be 0 then. */
static void odrive_say_part(struct drive_odrive *self)
{
    struct hal_text text = drive_turn_say(&self->turn, "ODrive: error of its ");
    const char *part = "controller";

    if ((self->parts & 1) != 0)
        part = "motor";
    else if ((self->parts & 2) != 0)
        part = "encoder";
    hal_text_put(&text, part);
    self->turn.fault_code = 1;
}

static void odrive_note_parts(struct drive_odrive *self, const uint8_t data[8])
{
    self->parts = 0;
    if (self->family == DRIVE_ODRIVE_06)
        return;
    self->parts =
        (uint8_t)((data[5] & 1) | (data[6] & 1) << 1 | (data[7] & 1) << 2);
}

void odrive_say(struct drive_odrive *self)
{
    const bool parts = self->family == DRIVE_ODRIVE_05 && self->parts != 0;

    self->turn.alarmed = self->error != 0 || parts;
    if (self->turn.fault_code != 0 || self->turn.phase == DRIVE_TURN_LOST)
        return;
    if (self->error != 0)
        odrive_say_error(self, self->error);
    else if (parts)
        odrive_say_part(self);
}

static void odrive_note_done(struct drive_odrive *self, const uint8_t data[8],
                             int64_t now_ns)
{
    struct drive_turn *turn = &self->turn;
    const bool done = self->family == DRIVE_ODRIVE_06 ? (data[6] & 1) != 0
                                                      : (data[7] & 0x80) != 0;

    if (turn->motion == DRIVE_TURN_GO && turn->go.sent_ns != 0 &&
        now_ns - turn->go.sent_ns > turn->config.period_ns + GO_TAKEN_NS)
        turn->go_done = done;
}

/* What bytes 5 to 7 mean is not known before the family is. */
static void odrive_take_heartbeat(struct drive_odrive *self,
                                  const uint8_t data[8], int64_t now_ns)
{
    if (self->axis_state == ODRIVE_HOMING && data[4] != ODRIVE_HOMING)
        self->passes = false; /* it restores the mode of before */
    self->heartbeat_ns = now_ns;
    self->error = hal_float32_get(data);
    self->axis_state = data[4];
    self->result = data[5];
    self->turn.armed = data[4] == ODRIVE_CLOSED_LOOP;
    self->turn.torque = data[4] > ODRIVE_IDLE;
    odrive_note_parts(self, data);
    if (self->start != DRIVE_ODRIVE_FOUND)
        return;
    odrive_note_done(self, data, now_ns);
    odrive_say(self);
}

static bool odrive_take_estimates(struct drive_odrive *self,
                                  const struct hal_can_frame *frame,
                                  int64_t now_ns)
{
    const uint32_t pos = hal_float32_get(frame->data);
    const uint32_t vel = hal_float32_get(&frame->data[4]);

    self->is_nan = !hal_float32_is_finite(pos) || !hal_float32_is_finite(vel);
    if (self->is_nan ||
        !drive_turn_note(&self->turn, hal_float32_to_fixed(pos, 32),
                         hal_float32_to_fixed(vel, 32),
                         frame->t_ns != 0 ? frame->t_ns : now_ns))
        return false;
    self->was_told = true;
    return true;
}

/* The target, then what there is: Nm, and of 0.5 A. */
static void odrive_take_torque(struct drive_odrive *self, unsigned command,
                               const uint8_t data[8], int64_t now_ns)
{
    const bool is_current = odrive_says_current(self);

    if (!self->config.reads_torque || self->start != DRIVE_ODRIVE_FOUND ||
        command !=
            (unsigned)(is_current ? ODRIVE_GET_IQ : ODRIVE_GET_TORQUES) ||
        (is_current && self->config.torque_constant_q32 == 0))
        return;
    drive_turn_note_torque(&self->turn, hal_float32_get(&data[4]),
                           is_current ? self->config.torque_constant_q32
                                      : MOTION_FIXED_ONE_Q32);
    self->torque_ns = now_ns;
}

static void odrive_put_reading(struct drive_odrive *self,
                               enum hal_reading reading, uint32_t bits,
                               int64_t now_ns)
{
    if (hal_float32_is_finite(bits))
        (void)hal_readings_put_q16(&self->turn.readings, reading,
                                   hal_float32_to_fixed(bits, 16), now_ns);
}

/* A motor without a sensor has no number, or 0. */
static void odrive_take_temperature(struct drive_odrive *self,
                                    const uint8_t data[8], int64_t now_ns)
{
    const uint32_t stage = hal_float32_get(data);
    const uint32_t motor = hal_float32_get(&data[4]);
    const bool is_motor =
        hal_float32_is_finite(motor) &&
        hal_float32_to_fixed(motor, 16) > hal_float32_to_fixed(stage, 16);

    odrive_put_reading(self, HAL_READING_TEMPERATURE,
                       hal_float32_is_finite(stage) && is_motor ? motor : stage,
                       now_ns);
}

static void odrive_take_reading(struct drive_odrive *self, unsigned command,
                                const uint8_t data[8], int64_t now_ns)
{
    if (command == ODRIVE_GET_TEMPERATURE && self->family == DRIVE_ODRIVE_06)
        odrive_take_temperature(self, data, now_ns);
    else if (command == ODRIVE_GET_SUPPLY)
        odrive_put_reading(self, HAL_READING_VOLTAGE, hal_float32_get(data),
                           now_ns);
    else if (command == ODRIVE_GET_IQ)
        odrive_put_reading(self, HAL_READING_CURRENT, hal_float32_get(&data[4]),
                           now_ns);
}

/* active_errors, then disarm_reason. */
static void odrive_take_error(struct drive_odrive *self, const uint8_t data[8])
{
    uint32_t error = hal_float32_get(data);

    self->reason = hal_float32_get(&data[4]);
    self->reason_heard = self->turn.phase == DRIVE_TURN_LATCHED;
    if (error == 0)
        error = self->reason;
    if (self->turn.phase == DRIVE_TURN_LATCHED && self->turn.fault_code == 0 &&
        error != 0)
        odrive_say_error(self, error);
}

static bool odrive_is_order(unsigned command)
{
    return command == ODRIVE_ESTOP || command == ODRIVE_SET_AXIS_STATE ||
           command == ODRIVE_SET_MODE || command == ODRIVE_SET_INPUT_POS ||
           command == ODRIVE_SET_INPUT_VEL ||
           command == ODRIVE_SET_INPUT_TORQUE;
}

static enum can_bus_take odrive_take(struct drive_odrive *self,
                                     unsigned command,
                                     const struct hal_can_frame *frame,
                                     int64_t now_ns)
{
    if (odrive_is_order(command))
        return CAN_BUS_FOREIGN;
    if (frame->len != 8)
        return CAN_BUS_MALFORMED;
    odrive_take_reading(self, command, frame->data, now_ns);
    if (command == ODRIVE_HEARTBEAT)
        odrive_take_heartbeat(self, frame->data, now_ns);
    else if (command == ODRIVE_GET_VERSION)
        odrive_take_version(self, frame->data);
    else if (command == ODRIVE_GET_ESTIMATES &&
             !odrive_take_estimates(self, frame, now_ns))
        return CAN_BUS_MALFORMED;
    else if (command == ODRIVE_GET_ERROR && self->family == DRIVE_ODRIVE_06)
        odrive_take_error(self, frame->data);
    else if (command == ODRIVE_TX_SDO && self->family == DRIVE_ODRIVE_06)
        odrive_take_parameter(self, frame->data);
    else
        odrive_take_torque(self, command, frame->data, now_ns);
    return CAN_BUS_TAKEN;
}

/* Another client's requests are not ours. */
static enum can_bus_take drive_odrive_receive(struct can_bus_node *node,
                                              const struct hal_can_frame *frame,
                                              int64_t now_ns)
{
    struct drive_odrive *self = odrive_of(node);

    if (frame->extended || frame->fd ||
        frame->id >> NODE_SHIFT != self->config.node)
        return CAN_BUS_NOT_MINE;
    if (frame->remote)
        return CAN_BUS_TAKEN;
    return odrive_take(self, frame->id & COMMANDS, frame, now_ns);
}

const struct can_bus_node_ops drive_odrive_node_ops = {
    .receive = drive_odrive_receive,
    .step = drive_odrive_step,
    .emit = drive_odrive_emit,
};
