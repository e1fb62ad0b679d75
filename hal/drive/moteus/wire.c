/* hal/drive/moteus/wire.c - frames in and out; see drive.h. */
#include "hal/drive/moteus/parts.h"

#include "hal/support/container_of.h"
#include "hal/support/float32.h"
#include "motion/core/fixed.h"

#define MS         INT64_C(1000000)
#define REQUEST_NS (20 * MS) /* who has not been found */
#define LOST_NS    (60 * MS)

static struct drive_moteus *moteus_of(struct can_bus_node *node)
{
    return CONTAINER_OF(node, struct drive_moteus, node);
}

/* ---- out ---- */

static uint32_t moteus_float(int64_t value_q32)
{
    return hal_float32_from_fixed(value_q32, 32);
}

/* 0.001 Nm to Nm; 2^62 / 1000. */
static uint32_t moteus_torque(int32_t torque_mnm)
{
    int64_t torque_q32 = 0;

    (void)motion_fixed_mulshift(torque_mnm, INT64_C(4611686018427388), 30,
                                &torque_q32);
    return moteus_float(torque_q32);
}

static void moteus_put_mode(struct hal_can_frame *frame, enum moteus_mode mode)
{
    const uint32_t value = (uint32_t)mode;

    moteus_frame_write(frame, MOTEUS_INT8, MOTEUS_MODE, &value, 1);
}

/* It is to be reached as it is: no limits of its own (negative). */
static void moteus_put_target(struct hal_can_frame *frame, uint16_t watchdog_ms,
                              const uint32_t target[3])
{
    const uint32_t limits[3] = { watchdog_ms, UINT32_MAX, UINT32_MAX };

    moteus_put_mode(frame, MOTEUS_MODE_POSITION);
    moteus_frame_write(frame, MOTEUS_FLOAT, MOTEUS_COMMAND_POSITION, target, 3);
    moteus_frame_write(frame, MOTEUS_INT16, MOTEUS_COMMAND_TIMEOUT, limits, 3);
}

void drive_moteus_put_point(struct hal_can_frame *frame, uint16_t watchdog_ms,
                            const struct drive_turn_point *point)
{
    const uint32_t target[3] = { moteus_float(point->pos_q32),
                                 moteus_float(point->vel_q32),
                                 moteus_torque(point->torque_mnm) };

    moteus_put_target(frame, watchdog_ms, target);
}

/* From wherever it is. */
static void moteus_put_slow(const struct drive_moteus *self,
                            struct hal_can_frame *frame)
{
    const uint32_t target[3] = { HAL_FLOAT32_NAN,
                                 moteus_float(self->turn.target_vel_q32), 0 };

    moteus_put_target(frame, self->watchdog_ms, target);
}

/* Without a number: as it is configured. */
static uint32_t moteus_limit(int64_t value_q32)
{
    return value_q32 > 0 ? moteus_float(value_q32) : HAL_FLOAT32_NAN;
}

static void moteus_put_go(const struct drive_moteus *self,
                          struct hal_can_frame *frame)
{
    const struct drive_turn *turn = &self->turn;
    const bool to_a_place = turn->mode == HAL_DRIVE_PROFILE_POSITION;
    const uint32_t pos =
        to_a_place ? moteus_float(turn->go.pos_q32) : HAL_FLOAT32_NAN;
    const int64_t vel_q32 = turn->go.vel_q32;
    const uint32_t target[3] = { pos, to_a_place ? 0 : moteus_float(vel_q32),
                                 0 };
    const uint32_t timeout[1] = { self->watchdog_ms };
    const uint32_t limits[2] = { to_a_place ? moteus_limit(vel_q32)
                                            : HAL_FLOAT32_NAN,
                                 moteus_limit(turn->go.acc_q32) };

    moteus_put_mode(frame, MOTEUS_MODE_POSITION);
    moteus_frame_write(frame, MOTEUS_FLOAT, MOTEUS_COMMAND_POSITION, target, 3);
    moteus_frame_write(frame, MOTEUS_INT16, MOTEUS_COMMAND_TIMEOUT, timeout, 1);
    moteus_frame_write(frame, MOTEUS_FLOAT, MOTEUS_COMMAND_TIMEOUT + 1, limits,
                       2);
}

/* A drive in another mode than these is not to be taken out of it by a set
 * point: mode 0 first. */
static bool moteus_takes_targets(const struct drive_moteus *self)
{
    return self->mode <= MOTEUS_MODE_POSITION &&
           self->mode != MOTEUS_MODE_FAULT;
}

static void moteus_put_order(struct drive_moteus *self,
                             struct hal_can_frame *frame, bool wanted)
{
    const struct drive_turn_point point = drive_turn_point(&self->turn);

    if (self->stopping) {
        moteus_put_mode(frame, MOTEUS_MODE_STOPPED);
        self->stopping = false;
    } else if (!wanted || !moteus_takes_targets(self)) {
        return;
    } else if (self->turn.motion == DRIVE_TURN_SLOW) {
        moteus_put_slow(self, frame);
    } else if (self->turn.motion == DRIVE_TURN_GO) {
        moteus_put_go(self, frame);
        if (self->turn.go.sent_ns == 0)
            self->turn.go.sent_ns = self->turn.now_ns;
    } else {
        drive_moteus_put_point(frame, self->watchdog_ms, &point);
    }
}

void drive_moteus_put_questions(struct hal_can_frame *frame)
{
    moteus_frame_read(frame, MOTEUS_INT8, MOTEUS_MODE, 1);
    moteus_frame_read(frame, MOTEUS_FLOAT, MOTEUS_POSITION, 3);
    moteus_frame_read(frame, MOTEUS_INT8, MOTEUS_VOLTAGE, 3);
}

/* Whoever has not been found is asked now and then, and who was lost with torque:
 * one that answers again is not told blindly to stop. */
static bool moteus_is_requested(struct drive_moteus *self, bool wanted,
                                int64_t now_ns)
{
    const bool lost = self->turn.phase == DRIVE_TURN_LOST;

    if (lost ? wanted || self->stopping
             : self->turn.phase != DRIVE_TURN_START || self->heard)
        return true;
    if (now_ns < self->request_ns || (lost && !self->turn.torque))
        return false;
    self->request_ns = now_ns + (lost ? LOST_NS : REQUEST_NS);
    return true;
}

/* Of the readings it alone is not in every answer. */
static bool moteus_is_current_due(struct drive_moteus *self, int64_t now_ns)
{
    enum hal_reading reading;
    bool is_due = false;

    while ((reading = hal_readings_next(&self->turn.readings, now_ns)) !=
           HAL_READINGS)
        is_due |= reading == HAL_READING_CURRENT;
    return is_due;
}

static void drive_moteus_emit(struct can_bus_node *node, int64_t now_ns)
{
    struct drive_moteus *self = moteus_of(node);
    const bool wanted = drive_turn_next(&self->turn);
    struct hal_can_frame frame;

    if (!moteus_is_requested(self, wanted, now_ns))
        return;
    moteus_frame_begin(&frame, self->config.id, self->config.switched);
    moteus_put_order(self, &frame, wanted);
    drive_moteus_put_questions(&frame);
    if (self->turn.motion == DRIVE_TURN_GO)
        moteus_frame_read(&frame, MOTEUS_INT8, MOTEUS_TRAJECTORY_COMPLETE, 1);
    if (moteus_is_current_due(self, now_ns))
        moteus_frame_read(&frame, MOTEUS_INT16, MOTEUS_Q_CURRENT, 1);
    moteus_frame_end(&frame);
    (void)can_bus_send(node, &frame);
}

/* ---- every cycle ---- */

static void drive_moteus_step(struct can_bus_node *node, int64_t now_ns)
{
    struct drive_moteus *self = moteus_of(node);

    if (drive_turn_is_watched(&self->turn) &&
        now_ns - self->heard_ns > self->config.silence_ns) {
        drive_turn_say(&self->turn, self->is_nan ? DRIVE_TURN_NAN
                                                 : "does not answer any more");
        drive_turn_lose(&self->turn);
    }
    drive_turn_step(&self->turn, now_ns);
}

/* ---- in ---- */

/* What one answer says. */
struct moteus_answer {
    uint32_t pos, vel, torque; /* floats */
    int32_t mode, fault, complete;
    bool has_mode, has_place, has_fault, has_complete;
    int32_t milli[HAL_READINGS];
    unsigned readings; /* 1 << enum hal_reading: those it has */
};

/* The least integer stands for no number. */
static void moteus_take_reading(struct moteus_answer *answer,
                                const struct moteus_value *value)
{
    static const struct {
        unsigned reg;
        enum moteus_type type;
        int32_t none, milli;
    } row[HAL_READINGS] = {
        [HAL_READING_TEMPERATURE] = { MOTEUS_TEMPERATURE, MOTEUS_INT8, INT8_MIN,
                                      1000 },
        [HAL_READING_VOLTAGE] = { MOTEUS_VOLTAGE, MOTEUS_INT8, INT8_MIN, 500 },
        [HAL_READING_CURRENT] = { MOTEUS_Q_CURRENT, MOTEUS_INT16, INT16_MIN,
                                  100 },
    };

    for (unsigned i = 0; i < HAL_READINGS; i++)
        if (value->reg == row[i].reg && value->type == row[i].type &&
            value->raw != row[i].none) {
            answer->milli[i] = value->raw * row[i].milli;
            answer->readings |= 1u << i;
        }
}

static void moteus_take_value(struct moteus_answer *answer,
                              const struct moteus_value *value)
{
    const bool is_float = value->type == MOTEUS_FLOAT;

    if (value->reg == MOTEUS_MODE && !is_float) {
        answer->mode = value->raw;
        answer->has_mode = true;
    } else if (value->reg == MOTEUS_POSITION && is_float) {
        answer->pos = (uint32_t)value->raw;
    } else if (value->reg == MOTEUS_VELOCITY && is_float) {
        answer->vel = (uint32_t)value->raw;
        answer->has_place = true;
    } else if (value->reg == MOTEUS_TORQUE && is_float) {
        answer->torque = (uint32_t)value->raw;
    } else if (value->reg == MOTEUS_FAULT && !is_float) {
        answer->fault = value->raw;
        answer->has_fault = true;
    } else if (value->reg == MOTEUS_TRAJECTORY_COMPLETE && !is_float) {
        answer->complete = value->raw;
        answer->has_complete = true;
    } else {
        moteus_take_reading(answer, value);
    }
}

/* All of it or nothing. */
static bool moteus_read(const struct hal_can_frame *frame,
                        struct moteus_answer *answer)
{
    struct moteus_reader reader;
    struct moteus_value value;
    int got;

    *answer = (struct moteus_answer){ 0 };
    moteus_reader_begin(&reader, frame);
    while ((got = moteus_reader_next(&reader, &value)) == 1)
        moteus_take_value(answer, &value);
    return got == 0 && answer->has_mode && answer->has_place &&
           answer->has_fault && answer->mode >= 0 && answer->fault >= 0;
}

static void moteus_say(struct drive_moteus *self, int32_t fault)
{
    struct hal_text text;

    if (self->mode == MOTEUS_MODE_TIMEOUT) {
        drive_turn_say(&self->turn, "its watchdog ran out (mode 11)");
        self->turn.fault_code = MOTEUS_MODE_TIMEOUT;
        return;
    }
    text = drive_turn_say(&self->turn, "moteus fault ");
    hal_text_dec(&text, (uint32_t)fault);
    hal_text_put(&text, ": ");
    hal_text_put(&text, drive_moteus_fault_text((unsigned)fault));
    self->turn.fault_code = fault > 0 ? (uint16_t)fault : MOTEUS_MODE_FAULT;
}

static void moteus_take_state(struct drive_moteus *self,
                              const struct moteus_answer *answer)
{
    struct drive_turn *turn = &self->turn;

    self->mode = (uint8_t)answer->mode;
    turn->armed = self->mode == MOTEUS_MODE_POSITION;
    /* also after its watchdog, which may brake or hold */
    turn->torque = self->mode > MOTEUS_MODE_FAULT;
    turn->alarmed =
        self->mode == MOTEUS_MODE_FAULT || self->mode == MOTEUS_MODE_TIMEOUT;
    if (turn->alarmed && turn->fault_code == 0 &&
        turn->phase != DRIVE_TURN_LOST)
        moteus_say(self, answer->fault);
}

/* Two cycles after the go was sent an answer is about it. */
static void moteus_take_complete(struct drive_moteus *self,
                                 const struct moteus_answer *answer,
                                 int64_t now_ns)
{
    struct drive_turn *turn = &self->turn;

    if (answer->has_complete && turn->motion == DRIVE_TURN_GO &&
        turn->go.sent_ns != 0 &&
        now_ns - turn->go.sent_ns > 2 * turn->config.period_ns)
        turn->go_done = answer->complete != 0;
}

static bool moteus_take(struct drive_moteus *self,
                        const struct moteus_answer *answer, int64_t t_ns,
                        int64_t now_ns)
{
    struct drive_turn *turn = &self->turn;

    if (!drive_turn_note(turn, hal_float32_to_fixed(answer->pos, 32),
                         hal_float32_to_fixed(answer->vel, 32), t_ns))
        return false;
    self->heard = true;
    self->heard_ns = now_ns;
    drive_turn_note_torque(turn, answer->torque, MOTION_FIXED_ONE_Q32);
    moteus_take_state(self, answer);
    for (unsigned i = 0; i < HAL_READINGS; i++)
        if ((answer->readings >> i & 1) != 0)
            (void)hal_readings_put(&turn->readings, (enum hal_reading)i,
                                   answer->milli[i], now_ns);
    moteus_take_complete(self, answer, now_ns);
    return true;
}

/* Somebody else's: writes (their head is below 0x10) are orders. */
static enum can_bus_take moteus_overhear(const struct hal_can_frame *frame)
{
    return frame->len > 0 && frame->data[0] < 0x10 ? CAN_BUS_FOREIGN
                                                   : CAN_BUS_TAKEN;
}

static enum can_bus_take drive_moteus_receive(struct can_bus_node *node,
                                              const struct hal_can_frame *frame,
                                              int64_t now_ns)
{
    struct drive_moteus *self = moteus_of(node);
    struct moteus_answer answer;

    if (frame->remote || frame->id > 0xFFFF || !frame->fd)
        return CAN_BUS_NOT_MINE;
    if ((frame->id & 0xFF) == self->config.id)
        return moteus_overhear(frame);
    if (frame->id != (uint32_t)self->config.id << 8)
        return CAN_BUS_NOT_MINE;
    if (!moteus_read(frame, &answer))
        return CAN_BUS_MALFORMED;
    self->is_nan = !hal_float32_is_finite(answer.pos) ||
                   !hal_float32_is_finite(answer.vel);
    if (self->is_nan ||
        !moteus_take(self, &answer, frame->t_ns != 0 ? frame->t_ns : now_ns,
                     now_ns))
        return CAN_BUS_MALFORMED;
    return CAN_BUS_TAKEN;
}

const struct can_bus_node_ops drive_moteus_node_ops = {
    .receive = drive_moteus_receive,
    .step = drive_moteus_step,
    .emit = drive_moteus_emit,
};
