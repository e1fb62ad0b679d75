/* hal/drive/modbus/drive.c - what the controller asks, and what goes over the
 * line; see drive.h. */
#include "hal/drive/modbus/parts.h"

#include <stddef.h>

#include "hal/support/container_of.h"
#include "hal/support/first.h"
#include "motion/core/fixed.h"

#define FAILURES_MAX 3
#define RETRY_NS     INT64_C(1000000000)
/* Without a pause: of a line that has just been opened (hal/linux/libmodbus.h),
 * with a drive on it that may be moving. */
#define HURRIED_TRIES 3
#define SLOW_CYCLES   16 /* one slow block every so many cycles */

#define OFF_PAUSE_NS INT64_C(200000000) /* after a failure while LOST */

/* A cookie is a job, and above it the serial of a sequence's step. */
#define JOB_MASK    0xFFu
#define STEP_SERIAL 8

/* What a request was; fast and slow blocks follow their number. */
enum drive_modbus_job {
    JOB_IDENTIFY,
    JOB_STEP,   /* of the sequence that runs */
    JOB_STREAM, /* a set point */
    JOB_GO,     /* of stream_go */
    JOB_MOVE,
    JOB_ALARM,
    JOB_FAST,
    JOB_SLOW = JOB_FAST + MODBUS_MAP_BLOCKS_MAX,
    JOB_PARAMETER = JOB_SLOW + MODBUS_MAP_BLOCKS_MAX,
};

static struct drive_modbus *drive_modbus_of(struct hal_drive *drive)
{
    return CONTAINER_OF(drive, struct drive_modbus, drive);
}

static struct drive_modbus *drive_modbus_of_node(struct modbus_node *node)
{
    return CONTAINER_OF(node, struct drive_modbus, node);
}

/* ---- what is asked over the line ---- */

static void request_block(const struct modbus_map_block *block,
                          struct hal_modbus_request *request)
{
    request->function = block->read;
    request->address = block->at;
    request->count = block->count;
}

static bool drive_modbus_streams(const struct drive_modbus *self)
{
    return self->state == HAL_DRIVE_ENABLED && self->target_ns != 0 &&
           self->config.map->stream.count > 0;
}

/* The set point, then the writes that make it count. */
static bool request_stream(struct drive_modbus *self,
                           struct hal_modbus_request *request, uint16_t *job)
{
    const struct modbus_map_sequence *go =
        &self->config.map->sequence[MODBUS_SEQUENCE_stream_go];

    if (self->turn == 0) {
        self->go_at = 0;
        self->turn = 1;
        if (drive_modbus_streams(self)) {
            drive_modbus_put_stream(self, request);
            *job = JOB_STREAM;
            return true;
        }
    }
    if (self->turn == 1 && drive_modbus_streams(self) && self->begun &&
        self->go_at < go->count) {
        const struct modbus_map_step *step = &go->step[self->go_at++];

        modbus_map_put_write(&self->config.map->item[step->item], step->value,
                             request);
        *job = JOB_GO;
        return true;
    }
    return false;
}

static bool request_slow(struct drive_modbus *self,
                         struct hal_modbus_request *request, uint16_t *job)
{
    if (self->slow_count == 0 || ++self->slow_wait < SLOW_CYCLES)
        return false;
    self->slow_wait = 0;
    if (self->slow_turn >= self->slow_count)
        self->slow_turn = 0;
    request_block(&self->slow[self->slow_turn], request);
    *job = (uint16_t)(JOB_SLOW + self->slow_turn++);
    return true;
}

/* Turn 0: set point, 1 ..: fast blocks, those that are monitored; then perhaps a
 * slow one. */
static bool request_in_turn(struct drive_modbus *self,
                            struct hal_modbus_request *request, uint16_t *job)
{
    if (self->turn > self->fast_count + self->monitor_count) {
        self->turn = 0;
        if (request_slow(self, request, job))
            return true;
    }
    if (request_stream(self, request, job))
        return true;
    request_block(&self->fast[self->turn - 1], request);
    *job = (uint16_t)(JOB_FAST + self->turn - 1);
    self->turn++;
    return true;
}

static bool request_identify(struct drive_modbus *self,
                             struct hal_modbus_request *request, uint16_t *job)
{
    const struct modbus_map *map = self->config.map;

    if (self->identify_requested || self->now_ns < self->retry_ns)
        return false;
    modbus_map_put_read(&map->item[map->identify.item], request);
    self->identify_requested = true;
    *job = JOB_IDENTIFY;
    return true;
}

static bool request_once(struct drive_modbus *self,
                         struct hal_modbus_request *request, uint16_t *job)
{
    const struct modbus_map *map = self->config.map;

    if (drive_modbus_run_request(self, request)) {
        *job = (uint16_t)(JOB_STEP | self->run.serial << STEP_SERIAL);
        return true;
    }
    if (drive_modbus_parameter_request(self, request)) {
        *job = JOB_PARAMETER;
        return true;
    }
    if (self->move == DRIVE_MODBUS_MOVE_WANTED) {
        drive_modbus_put_move(self, request);
        self->move = DRIVE_MODBUS_MOVE_SENT;
        *job = JOB_MOVE;
        return true;
    }
    if (self->phase == DRIVE_MODBUS_LATCHED && !self->alarm_requested &&
        map->alarm != MODBUS_MAP_NO_ITEM) {
        modbus_map_put_read(&map->item[map->alarm], request);
        self->alarm_requested = true;
        *job = JOB_ALARM;
        return true;
    }
    return false;
}

static bool drive_modbus_next_request(struct modbus_node *node, int64_t now_ns,
                                      struct hal_modbus_request *request,
                                      uint16_t *cookie)
{
    struct drive_modbus *self = drive_modbus_of_node(node);

    self->now_ns = now_ns;
    if (now_ns < self->retry_ns || (self->phase == DRIVE_MODBUS_LOST &&
                                    self->off == DRIVE_MODBUS_OFF_DONE))
        return false;
    if (!self->identified)
        return request_identify(self, request, cookie);
    return request_once(self, request, cookie) ||
           request_in_turn(self, request, cookie);
}

/* ---- what is answered ---- */

static void take_item(struct drive_modbus *self, unsigned index,
                      const uint16_t *reg, int64_t t_ns)
{
    const struct modbus_map *map = self->config.map;
    const struct modbus_map_item *item = &map->item[index];

    if (!modbus_map_is_number(item->type, item->order, reg)) {
        if (index == map->position)
            drive_modbus_doubt_position(self, "its position is no number");
        return;
    }
    self->value[index] = modbus_map_get(item->type, item->order, reg);
    if (item->reading > 0 && self->value[index] <= INT32_MAX &&
        self->value[index] >= INT32_MIN)
        (void)hal_readings_put(&self->readings,
                               (enum hal_reading)(item->reading - 1),
                               self->value[index] * item->milli, t_ns);
    if (index == map->status[MODBUS_STATUS_homed].item)
        drive_modbus_note_homed(self);
    if (index == map->position)
        drive_modbus_note_position(self, self->value[index], t_ns);
}

static void take_bit(struct drive_modbus *self, unsigned index, uint16_t bit,
                     const struct hal_modbus_reply *reply)
{
    const uint16_t value = (uint16_t)(reply->value[bit >> 4] >> (bit & 15) & 1);

    take_item(self, index, &value, reply->answer_ns);
}

static void take_block(struct drive_modbus *self,
                       const struct modbus_map_block *block,
                       const struct hal_modbus_reply *reply)
{
    const struct modbus_map *map = self->config.map;

    for (unsigned i = 0; i < map->item_count; i++) {
        const struct modbus_map_item *item = &map->item[i];
        const uint32_t end = item->at + modbus_map_registers(item->type);

        if (item->read != block->read || item->at < block->at ||
            end > (uint32_t)block->at + reply->count)
            continue;
        if (item->type == MODBUS_BIT)
            take_bit(self, i, (uint16_t)(item->at - block->at), reply);
        else
            take_item(self, i, &reply->value[item->at - block->at],
                      reply->answer_ns);
    }
}

static void take_identity(struct drive_modbus *self,
                          const struct hal_modbus_reply *reply)
{
    const struct modbus_map *map = self->config.map;
    const struct modbus_map_item *item = &map->item[map->identify.item];

    self->identify_requested = false;
    if (reply->err == MOTION_OK &&
        modbus_map_meets(&map->identify, modbus_map_get(item->type, item->order,
                                                        reply->value))) {
        self->identified = true;
        return;
    }
    if (self->identify_tries < HURRIED_TRIES)
        self->identify_tries++;
    else
        self->retry_ns = self->now_ns + RETRY_NS;
    if (reply->err != MOTION_OK && reply->err != MOTION_E_REFUSED) {
        drive_modbus_say(self, hal_modbus_reply_text(reply));
        return;
    }
    drive_modbus_say(self, map->identify_else);
    drive_modbus_lose(self, HAL_DRIVE_FAULT);
    self->off =
        DRIVE_MODBUS_OFF_DONE; /* what a write does to it is undefined */
    self->run.sequence = NULL;
}

static void take_alarm(struct drive_modbus *self,
                       const struct hal_modbus_reply *reply)
{
    const struct modbus_map *map = self->config.map;
    const struct modbus_map_item *item = &map->item[map->alarm];

    self->alarm_heard =
        reply->err == MOTION_OK || reply->err == MOTION_E_REFUSED;
    self->alarm_requested = self->alarm_heard; /* or once more */
    if (reply->err != MOTION_OK || self->phase != DRIVE_MODBUS_LATCHED)
        return;
    self->value[map->alarm] =
        modbus_map_get(item->type, item->order, reply->value);
    drive_modbus_say_alarm(self);
}

/* The group stream has been written: what must follow it once? */
static void take_stream(struct drive_modbus *self)
{
    self->streams++;
    if (self->begun || self->begin_requested || !drive_modbus_streams(self))
        return;
    self->begin_requested = true;
    drive_modbus_run_begin(self, MODBUS_SEQUENCE_stream_begin);
}

static void take_good(struct drive_modbus *self, uint16_t job,
                      const struct hal_modbus_reply *reply)
{
    if (job == JOB_STREAM) {
        take_stream(self);
    } else if (job == JOB_MOVE && self->move == DRIVE_MODBUS_MOVE_SENT) {
        /* unless it was halted meanwhile */
        drive_modbus_run_begin(self, MODBUS_SEQUENCE_move_go);
    } else if (job >= JOB_SLOW) {
        take_block(self, &self->slow[job - JOB_SLOW], reply);
    } else if (job >= JOB_FAST) {
        take_block(self, &self->fast[job - JOB_FAST], reply);
        if (job >= JOB_FAST + self->fast_count)
            return;
        self->fresh = (uint8_t)(self->fresh | 1u << (job - JOB_FAST));
        self->polls++;
        if (job == JOB_FAST + self->fast_count - 1 && self->cycles < UINT8_MAX)
            self->cycles++;
    }
}

/* A drive that refuses motion stops the group. */
static void take_refusal(struct drive_modbus *self, uint16_t job,
                         const struct hal_modbus_reply *reply)
{
    const bool motion = job == JOB_STREAM || job == JOB_GO || job == JOB_MOVE;
    struct hal_text text;

    if (self->phase != DRIVE_MODBUS_RUN && self->phase != DRIVE_MODBUS_START)
        return;
    if (reply->exception == 5 || reply->exception == 6)
        return; /* busy: the next one comes anyway */
    text = drive_modbus_say(self, motion ? "a set point was refused: "
                                         : "a read was refused: ");
    hal_text_put(&text, hal_modbus_exception_text(reply->exception));
    drive_modbus_latch(self);
}

static void take_failure(struct drive_modbus *self,
                         const struct hal_modbus_reply *reply)
{
    if (self->move == DRIVE_MODBUS_MOVE_SENT && self->run.sequence == NULL) {
        /* it may have been heard: never twice */
        self->move = DRIVE_MODBUS_MOVE_RUNNING;
        self->cycles = 0;
    }
    if (self->failures < FAILURES_MAX)
        self->failures++;
    if (self->phase == DRIVE_MODBUS_LOST)
        self->retry_ns = self->now_ns + OFF_PAUSE_NS;
    if (self->failures < FAILURES_MAX || self->phase == DRIVE_MODBUS_LOST)
        return;
    if (self->phase == DRIVE_MODBUS_START) {
        drive_modbus_start(self);
        self->retry_ns = self->now_ns + RETRY_NS;
        return;
    }
    if (self->phase != DRIVE_MODBUS_LATCHED)
        drive_modbus_say(self, hal_modbus_reply_text(reply));
    drive_modbus_lose(self, HAL_DRIVE_OFFLINE);
}

/* Whoever is at the other end of a connection that broke may have been off
 * meanwhile. */
static void drive_modbus_down(struct modbus_node *node)
{
    struct drive_modbus *self = drive_modbus_of_node(node);

    if (self->phase == DRIVE_MODBUS_START || self->phase == DRIVE_MODBUS_LOST)
        return;
    if (self->phase != DRIVE_MODBUS_LATCHED)
        drive_modbus_say(self, HAL_MODBUS_BROKE);
    drive_modbus_lose(self, HAL_DRIVE_OFFLINE);
}

static void drive_modbus_reply(struct modbus_node *node, uint16_t cookie,
                               const struct hal_modbus_reply *reply)
{
    struct drive_modbus *self = drive_modbus_of_node(node);
    const uint16_t job = cookie & JOB_MASK;
    const bool answered =
        reply->err == MOTION_OK || reply->err == MOTION_E_REFUSED;
    const bool again = answered && self->failures > 0;

    if (job == JOB_IDENTIFY) {
        take_identity(self, reply);
        return;
    }
    if (answered)
        self->failures = 0;
    if (job == JOB_STEP && cookie >> STEP_SERIAL == self->run.serial)
        drive_modbus_run_reply(self, reply);
    else if (job == JOB_ALARM)
        take_alarm(self, reply);
    else if (job == JOB_PARAMETER)
        drive_modbus_parameter_reply(self, reply);
    else if (reply->err == MOTION_OK)
        take_good(self, job, reply);
    else if (reply->err == MOTION_E_REFUSED)
        take_refusal(self, job, reply);
    if (again && job != JOB_STEP)
        drive_modbus_off_heard(self);
    if (!answered)
        take_failure(self, reply);
}

static void drive_modbus_step(struct modbus_node *node, int64_t now_ns)
{
    struct drive_modbus *self = drive_modbus_of_node(node);

    self->now_ns = now_ns;
    drive_modbus_walk(self);
}

const struct modbus_node_ops drive_modbus_node_ops = {
    .step = drive_modbus_step,
    .next_request = drive_modbus_next_request,
    .reply = drive_modbus_reply,
    .down = drive_modbus_down,
};

/* ---- what the controller asks ---- */

static void drive_modbus_request_reset(struct drive_modbus *self)
{
    if (self->phase == DRIVE_MODBUS_LOST) {
        self->request = HAL_DRIVE_REQUEST_OFF;
        drive_modbus_start(self);
        self->retry_ns = self->now_ns;
    } else if (self->phase == DRIVE_MODBUS_LATCHED) {
        self->reset_requested = true;
    }
}

static void drive_modbus_request(struct hal_drive *drive,
                                 enum hal_drive_request request)
{
    struct drive_modbus *self = drive_modbus_of(drive);

    if (request == HAL_DRIVE_REQUEST_RESET) {
        drive_modbus_request_reset(self);
        return;
    }
    if (request == HAL_DRIVE_REQUEST_TORQUE_OFF &&
        self->phase != DRIVE_MODBUS_RUN)
        request = HAL_DRIVE_REQUEST_OFF;
    if (request == self->request ||
        (request == HAL_DRIVE_REQUEST_OFF &&
         self->request == HAL_DRIVE_REQUEST_TORQUE_OFF))
        return;
    if (self->phase == DRIVE_MODBUS_RUN) {
        self->request = request;
        drive_modbus_pursue(self);
    } else if (self->phase == DRIVE_MODBUS_START) {
        self->request = request; /* once it was found */
    }
}

static int drive_modbus_set_target(struct hal_drive *drive,
                                   const struct hal_drive_target *target)
{
    struct drive_modbus *self = drive_modbus_of(drive);
    const int64_t pos_q32 = target->pos_q32 - self->zero_q32;
    const int64_t counts = hal_ratio_scale(&self->to_counts, pos_q32);

    if (!drive_modbus_fits(self, counts))
        return MOTION_E_RANGE;
    if (self->state != HAL_DRIVE_ENABLED ||
        self->mode != HAL_DRIVE_STREAM_POSITION)
        return MOTION_OK;
    if (!hal_first_fits(&self->first_target, counts - self->actual_counts,
                        self->first_step_counts)) {
        drive_modbus_say(self, HAL_FIRST_AWAY);
        drive_modbus_latch(self);
        return MOTION_E_AWAY;
    }
    self->target = *target;
    self->target.pos_q32 = pos_q32;
    self->target_ns = self->now_ns;
    drive_modbus_note_target(self);
    return MOTION_OK;
}

static void put_limits(const struct drive_modbus *self,
                       struct hal_drive_feedback *feedback)
{
    const bool low =
        drive_modbus_status(self, MODBUS_STATUS_limit_negative, false);
    const bool high =
        drive_modbus_status(self, MODBUS_STATUS_limit_positive, false);
    const bool reversed = self->config.counts_num < 0;

    feedback->limit_negative = reversed ? high : low;
    feedback->limit_positive = reversed ? low : high;
}

/* The disable has run its course; where the map has a status for it, what was
 * polled since says so too. */
static bool torque_is_off(const struct drive_modbus *self)
{
    if (self->state == HAL_DRIVE_OFF)
        return !drive_modbus_has_torque(self, false);
    return self->identified && drive_modbus_is_down(self) &&
           self->off == DRIVE_MODBUS_OFF_DONE;
}

/* What is done about its torque, then why. */
static void put_text(const struct drive_modbus *self,
                     struct hal_drive_feedback *feedback)
{
    const bool done = self->off == DRIVE_MODBUS_OFF_DONE;
    struct hal_text text;

    hal_text_init(&text, feedback->fault_text, sizeof feedback->fault_text);
    if (self->phase == DRIVE_MODBUS_LOST && self->identified)
        hal_text_put(&text, done ? "lost, then switched off: "
                                 : "lost; trying to switch it off: ");
    else if (self->phase == DRIVE_MODBUS_LATCHED && !done && self->off_failed)
        hal_text_put(&text, "not off: ");
    hal_text_put(&text, self->fault_text);
}

static void drive_modbus_feedback(struct hal_drive *drive,
                                  struct hal_drive_feedback *feedback)
{
    const struct drive_modbus *self = drive_modbus_of(drive);

    *feedback = (struct hal_drive_feedback){
        .state = self->state,
        .torque_off = torque_is_off(self),
        .pos_q32 = hal_ratio_scale(&self->to_pos, self->actual_counts) +
                   self->zero_q32,
        .vel_q32 = self->actual_vel_q32,
        .t_ns = self->actual_ns,
        .following = self->state == HAL_DRIVE_ENABLED,
        .mode = self->mode,
        .arrived = self->went && self->move == DRIVE_MODBUS_NO_MOVE,
        .homing = self->homing,
        .fault_code = self->fault_code,
        .fault_code_awaited =
            self->phase == DRIVE_MODBUS_LATCHED && self->fault_code == 0 &&
            self->config.map->alarm != MODBUS_MAP_NO_ITEM && !self->alarm_heard,
    };
    feedback->demand_known =
        drive_modbus_demand(self, self->actual_ns, &feedback->demand_q32);
    feedback->demand_q32 += self->zero_q32;
    put_limits(self, feedback);
    put_text(self, feedback);
}

static const struct hal_drive_found *drive_modbus_found(struct hal_drive *drive)
{
    return &drive_modbus_of(drive)->found;
}

static int drive_modbus_reach(struct hal_drive *drive, int64_t pos_q32,
                              struct hal_drive_reach *reach)
{
    const struct drive_modbus *self = drive_modbus_of(drive);

    *reach = (struct hal_drive_reach){
        .counts = hal_ratio_scale(&self->to_counts, pos_q32 - self->zero_q32),
        .min_counts = INT32_MIN,
        .max_counts = INT32_MAX,
    };
    return drive_modbus_fits(self, reach->counts) ? MOTION_OK : MOTION_E_RANGE;
}

const struct hal_drive_ops drive_modbus_ops = {
    .request = drive_modbus_request,
    .set_target = drive_modbus_set_target,
    .feedback = drive_modbus_feedback,
    .modes = drive_modbus_modes,
    .set_mode = drive_modbus_set_mode,
    .go = drive_modbus_go,
    .home = drive_modbus_home,
    .halt = drive_modbus_halt,
    .found = drive_modbus_found,
    .reach = drive_modbus_reach,
};
