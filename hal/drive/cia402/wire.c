/* hal/drive/cia402/wire.c - what the node hears and sends; its cycle. */
#include "hal/drive/cia402/parts.h"

#include "motion/core/fixed.h"

#define WARNING        0x0080
#define LIMIT_ACTIVE   0x0800
#define FOLLOWS        0x1000
#define HOMED          0x1000
#define LAG_SYNCS      20 /* it may take to follow once it is enabled */
#define UNANSWERED_MAX 3  /* SYNCs without TPDO1 beyond the one under way */

static struct drive_cia402 *drive_cia402_of_node(struct canopen_node *node)
{
    return CONTAINER_OF(node, struct drive_cia402, node);
}

/* ---- every cycle ---- */

/* The SYNC of this cycle latches what went out since the one before. */
static void drive_cia402_note_sync(struct drive_cia402 *self, int64_t now_ns)
{
    if (self->node.master->sync_ns != now_ns)
        return;
    self->latched_ns[2] = self->latched_ns[1];
    self->latched_ns[1] = self->latched_ns[0];
    self->latched_ns[0] = self->sent_ns;
    self->latched_counts[2] = self->latched_counts[1];
    self->latched_counts[1] = self->latched_counts[0];
    self->latched_counts[0] = self->sent_counts;
    self->syncs_unanswered++;
}

static void drive_cia402_watch(struct drive_cia402 *self)
{
    struct hal_text text;

    if (!drive_cia402_is_watched(self))
        return;
    if (self->node.nmt_state != CANOPEN_NMT_OPERATIONAL) {
        text = drive_cia402_say(self, "left NMT operational, state 0x");
        hal_text_hex(&text, (uint32_t)self->node.nmt_state, 2);
        drive_cia402_lose(self, HAL_DRIVE_OFFLINE);
    } else if (self->syncs_unanswered > UNANSWERED_MAX) {
        drive_cia402_say(self, "no position (TPDO1) for three SYNC periods");
        drive_cia402_lose(self, HAL_DRIVE_OFFLINE);
    }
}

/* Does the drive act on the target, so that the image must not move by
 * itself? */
static bool drive_cia402_holds_target(const struct drive_cia402 *self)
{
    const enum cia402_state power = drive_cia402_power(self);

    return power == CIA402_OPERATION_ENABLED ||
           power == CIA402_QUICK_STOP_ACTIVE ||
           (power == CIA402_SWITCHED_ON && self->preloaded);
}

/* The image holds what is written as target while the mode changes, and what
 * a mode that is moved by it was given. */
static bool drive_cia402_keeps_image(const struct drive_cia402 *self)
{
    return drive_cia402_mode(self)->uses_target ||
           (self->mode == HAL_DRIVE_STREAM_POSITION &&
            drive_cia402_mode(self)->streams) ||
           (self->job == DRIVE_CIA402_JOB_MODE && self->list_at > 0);
}

static void drive_cia402_follow_actual(struct drive_cia402 *self)
{
    const bool holds = drive_cia402_holds_target(self);

    if (!self->is_live || (holds && drive_cia402_keeps_image(self)))
        return;
    self->target_counts = (int32_t)(uint32_t)self->actual_counts;
    self->target_ns = 0;
    if (!holds)
        self->preloaded = false;
}

static void drive_cia402_step(struct canopen_node *node, int64_t now_ns)
{
    struct drive_cia402 *self = drive_cia402_of_node(node);

    self->now_ns = now_ns;
    drive_cia402_note_sync(self, now_ns);
    drive_cia402_watch(self);
    drive_cia402_walk(self, now_ns);
    drive_cia402_follow_actual(self);
}

/* ---- what comes in ---- */

static uint16_t drive_cia402_get_u16(const uint8_t *at)
{
    return (uint16_t)(at[0] | at[1] << 8);
}

static uint32_t drive_cia402_get_u32(const uint8_t *at)
{
    return (uint32_t)drive_cia402_get_u16(at) |
           (uint32_t)drive_cia402_get_u16(at + 2) << 16;
}

/* The speed is the displacement since the SYNC before; when that one went unanswered or
 * the tick was late, the old speed is the better guess. */
static void drive_cia402_note_speed(struct drive_cia402 *self, int32_t delta,
                                    int64_t delta_ns)
{
    const int64_t period_ns = self->config.sync_period_ns;

    if (2 * delta_ns <= period_ns || 2 * delta_ns >= 3 * period_ns)
        return;
    self->actual_delta_counts = delta;
    self->actual_vel_q32 =
        hal_ratio_scale(&self->to_vel, hal_ratio_scale(&self->to_rate, delta));
}

/* Homing makes the position jump, and with it begins to count anew. */
static void drive_cia402_note_homing(struct drive_cia402 *self, uint32_t counts,
                                     uint16_t word_before)
{
    self->actual_counts = (int32_t)counts;
    if ((self->statusword & ~word_before & HOMED) == 0)
        return;
    self->actual_delta_counts = 0;
    hal_standstill_rest(&self->standstill, self->actual_counts,
                        self->actual_ns);
    self->actual_vel_q32 = 0;
}

static void drive_cia402_note_actual(struct drive_cia402 *self, uint32_t counts,
                                     int64_t sync_ns, int64_t demand_ns)
{
    const int32_t delta =
        (int32_t)(counts - (uint32_t)self->actual_counts); /* modulo 2^32 */

    if (self->is_live) {
        self->actual_counts += delta;
        drive_cia402_note_speed(self, delta, sync_ns - self->actual_ns);
    } else {
        self->actual_counts = (int32_t)counts;
        self->actual_vel_q32 = 0;
        self->actual_delta_counts = 0;
        hal_standstill_rest(&self->standstill, self->actual_counts, sync_ns);
    }
    hal_standstill_note(&self->standstill, self->actual_counts,
                        self->near_counts, sync_ns);
    self->is_live = true;
    self->actual_ns = sync_ns;
    self->demand_ns = demand_ns;
}

/* ---- what it says without being in fault ---- */

/* Bit 12 falling; or, since it is enabled, not risen. */
static void drive_cia402_note_following(struct drive_cia402 *self)
{
    if (!drive_cia402_is_enabled(self) || !drive_cia402_mode(self)->streams ||
        drive_cia402_is_busy(self)) {
        self->has_followed = false;
        self->lag_syncs = 0;
    } else if ((self->statusword & FOLLOWS) != 0) {
        self->has_followed = true;
        self->lag_syncs = 0;
    } else if (self->lag_syncs < LAG_SYNCS) {
        self->lag_syncs++;
        if (self->lag_syncs == (self->has_followed ? 1 : LAG_SYNCS))
            self->events.count[HAL_DRIVE_EVENT_NOT_FOLLOWING]++;
    }
}

static void drive_cia402_note_events(struct drive_cia402 *self,
                                     uint16_t word_before)
{
    const uint16_t rose = (uint16_t)(self->statusword & ~word_before);

    if ((rose & WARNING) != 0)
        self->events.count[HAL_DRIVE_EVENT_WARNING]++;
    if ((rose & LIMIT_ACTIVE) != 0)
        self->events.count[HAL_DRIVE_EVENT_LIMIT]++;
    drive_cia402_note_following(self);
}

/* TPDO1 answers the last SYNC, or the one before it when it was on the wire
 * before the last was sent. */
static void drive_cia402_tpdo1(struct drive_cia402 *self,
                               const struct hal_can_frame *frame)
{
    const struct canopen *master = self->node.master;
    const bool late = frame->t_ns != 0 && frame->t_ns <= master->sync_ns;
    const int64_t sync_ns = late ? master->sync_previous_ns : master->sync_ns;
    const uint32_t counts = drive_cia402_get_u32(frame->data + 2);
    const uint16_t word_before = self->statusword;

    if (!self->pdo_ok || sync_ns == 0)
        return;
    self->statusword = drive_cia402_get_u16(frame->data);
    drive_cia402_note_events(self, word_before);
    drive_cia402_note_actual(self, counts, sync_ns,
                             self->latched_ns[late ? 2 : 1]);
    self->demand_counts = self->latched_counts[late ? 2 : 1];
    if (self->mode == HAL_DRIVE_HOMING)
        drive_cia402_note_homing(self, counts, word_before);
    if (self->torque_in)
        self->actual_torque = (int16_t)drive_cia402_get_u16(frame->data + 6);
    self->syncs_unanswered = late ? 1 : 0;
}

static bool drive_cia402_tpdo(struct canopen_node *node, unsigned number,
                              const struct hal_can_frame *frame)
{
    struct drive_cia402 *self = drive_cia402_of_node(node);

    if (number == 1) {
        if (frame->len < (self->torque_in ? 8 : 6))
            return false;
        drive_cia402_tpdo1(self, frame);
    } else if (number == 2) {
        if (frame->len < 4)
            return false;
        if (self->pdo_ok)
            self->inputs = drive_cia402_get_u32(frame->data);
    }
    return true;
}

static void drive_cia402_emcy(struct canopen_node *node, uint16_t code,
                              uint8_t reg, const uint8_t maker[5])
{
    struct drive_cia402 *self = drive_cia402_of_node(node);

    (void)reg;
    (void)maker;
    if (code != 0) {
        self->events.count[HAL_DRIVE_EVENT_EMERGENCY]++;
        self->events.emergency_code = code;
    }
    if (!canopen_is_single(node))
        return; /* whose it is, 0x603F says */
    self->emcy_code = code;
    self->emcy_ns = self->now_ns;
    if (self->phase == DRIVE_CIA402_LATCHED && self->fault_code == 0 &&
        code != 0 && drive_cia402_power(self) >= CIA402_FAULT_REACTION)
        drive_cia402_say_fault(self, code);
}

/* Before the configuration: good news, begin at once.  After it: the drive lost
 * its power for a moment, and with it all that was written.  That may be why it
 * was lost already. */
static void drive_cia402_boot_up(struct canopen_node *node, int64_t now_ns)
{
    struct drive_cia402 *self = drive_cia402_of_node(node);

    self->pdo_ok = false;
    if (self->phase == DRIVE_CIA402_START_UP) {
        drive_cia402_start_anew(self, now_ns);
    } else if (self->state == HAL_DRIVE_OFFLINE ||
               self->phase != DRIVE_CIA402_LOST) {
        drive_cia402_say(self, "restarted by itself (boot-up)");
        drive_cia402_lose(self, HAL_DRIVE_OFFLINE);
    }
}

static void drive_cia402_heartbeat_lost(struct canopen_node *node,
                                        int64_t now_ns)
{
    struct drive_cia402 *self = drive_cia402_of_node(node);

    (void)now_ns;
    if (!drive_cia402_is_watched(self))
        return;
    drive_cia402_say(self, "no heartbeat for three periods");
    drive_cia402_lose(self, HAL_DRIVE_OFFLINE);
}

static void drive_cia402_put_u32(uint8_t *at, uint32_t value)
{
    for (unsigned i = 0; i < 4; i++)
        at[i] = (uint8_t)(value >> 8 * i);
}

static unsigned drive_cia402_rpdo1(struct drive_cia402 *self, uint8_t data[8])
{
    const uint16_t torque = (uint16_t)self->target_torque;

    self->controlword = drive_cia402_controlword(self);
    self->sent_ns = self->target_ns;
    self->sent_counts = self->target_counts;
    data[0] = (uint8_t)self->controlword;
    data[1] = (uint8_t)(self->controlword >> 8);
    drive_cia402_put_u32(data + 2, (uint32_t)self->target_counts);
    data[6] = (uint8_t)torque;
    data[7] = (uint8_t)(torque >> 8);
    return self->torque_out ? 8 : 6;
}

/* Counts/s in Q16.  In STREAM_POSITION the loop around the position is here:
 * the speed of the set point and some of what the axis is off. */
static int64_t drive_cia402_streamed_q16(const struct drive_cia402 *self)
{
    const int64_t demand =
        self->demand_ns != 0 ? self->demand_counts : self->target_counts;
    const int32_t off = /* modulo 2^32 */
        (int32_t)((uint32_t)demand - (uint32_t)self->actual_counts);
    int64_t back_q16, sum_q16;

    if (!drive_cia402_is_enabled(self))
        return 0;
    if (self->mode == HAL_DRIVE_STREAM_VELOCITY)
        return self->target_speed_q16;
    if (motion_fixed_mulshift(off, self->config.gain_q16, 0, &back_q16) !=
            MOTION_OK ||
        motion_fixed_add(self->target_speed_q16, back_q16, &sum_q16) !=
            MOTION_OK)
        return 0;
    return sum_q16;
}

static unsigned drive_cia402_rpdo2(struct drive_cia402 *self, uint8_t data[8])
{
    const struct drive_cia402_mode *mode = drive_cia402_mode(self);
    int32_t speed;

    if (!mode->streams || !mode->uses_speed)
        return 0;
    if (drive_cia402_speed(self, drive_cia402_streamed_q16(self), &speed) !=
        MOTION_OK)
        speed = 0;
    drive_cia402_put_u32(data, (uint32_t)speed);
    return 4;
}

static unsigned drive_cia402_rpdo(struct canopen_node *node, unsigned number,
                                  uint8_t data[8])
{
    struct drive_cia402 *self = drive_cia402_of_node(node);

    if (number > 2 || !self->pdo_ok || self->phase == DRIVE_CIA402_START_UP)
        return 0;
    return number == 1 ? drive_cia402_rpdo1(self, data)
                       : drive_cia402_rpdo2(self, data);
}

const struct canopen_node_ops drive_cia402_node_ops = {
    .step = drive_cia402_step,
    .tpdo = drive_cia402_tpdo,
    .emcy = drive_cia402_emcy,
    .boot_up = drive_cia402_boot_up,
    .heartbeat_lost = drive_cia402_heartbeat_lost,
    .rpdo = drive_cia402_rpdo,
};
