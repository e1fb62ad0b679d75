/* hal/modbus/master.c - see master.h. */
#include "hal/modbus/master.h"

#include <stddef.h>

#include "hal/support/container_of.h"

#define MS           INT64_C(1000000)
#define TIMEOUT_NS   (50 * MS)
#define BROADCAST_NS (10 * MS)

static struct modbus_master *modbus_master_of(const struct modbus_station *at)
{
    return CONTAINER_OF(at, struct modbus_master, station);
}

/* ---- the mailbox ---- */

static unsigned modbus_master_slot(unsigned head, unsigned count)
{
    return (head + count) & (HAL_MODBUS_MAILBOX - 1);
}

static int modbus_master_submit(struct hal_modbus *line,
                                const struct hal_modbus_request *request,
                                uint32_t tag)
{
    struct modbus_master *self =
        CONTAINER_OF(line, struct modbus_master, modbus);
    struct modbus_master_box *box;

    if (!modbus_pdu_is_request(request))
        return MOTION_E_ARG;
    if (self->box_count + self->reply_count == HAL_MODBUS_MAILBOX) {
        self->stats.refused++;
        return MOTION_E_FULL;
    }
    box = &self->box[modbus_master_slot(self->box_head, self->box_count++)];
    box->request = *request;
    box->tag = tag;
    return MOTION_OK;
}

static int modbus_master_collect(struct hal_modbus *line,
                                 struct hal_modbus_reply *reply)
{
    struct modbus_master *self =
        CONTAINER_OF(line, struct modbus_master, modbus);

    if (self->reply_count == 0)
        return 0;
    *reply = self->reply[self->reply_head];
    self->reply_head = modbus_master_slot(self->reply_head, 1);
    self->reply_count--;
    return 1;
}

static int modbus_master_is_up(struct hal_modbus *line)
{
    return !CONTAINER_OF(line, struct modbus_master, modbus)->down;
}

static void modbus_master_stats(struct hal_modbus *line,
                                struct hal_modbus_stats *stats)
{
    *stats = CONTAINER_OF(line, struct modbus_master, modbus)->stats;
}

static const struct hal_modbus_ops modbus_master_ops = {
    .submit = modbus_master_submit,
    .collect = modbus_master_collect,
    .is_up = modbus_master_is_up,
    .stats = modbus_master_stats,
};

/* ---- transactions ---- */

static void modbus_master_count(struct modbus_master *self,
                                const struct hal_modbus_request *request,
                                const struct hal_modbus_reply *reply)
{
    hal_modbus_count(&self->stats, reply);
    if (reply->err != MOTION_OK)
        return;
    self->stats.busy_ns += (uint64_t)(reply->done_ns - reply->sent_ns);
    self->stats.ideal_ns +=
        (uint64_t)modbus_rtu_transaction_ns(&self->time, request);
}

/* The oldest request has its answer, as *found says. */
static void modbus_master_finish(struct modbus_master *self,
                                 struct hal_modbus_reply *reply, int64_t now_ns)
{
    const struct modbus_master_box *box = &self->box[self->box_head];

    reply->tag = box->tag;
    reply->sent_ns = self->sent_ns;
    reply->done_ns = now_ns;
    modbus_master_count(self, &box->request, reply);
    self->reply[modbus_master_slot(self->reply_head, self->reply_count++)] =
        *reply;
    self->box_head = modbus_master_slot(self->box_head, 1);
    self->box_count--;
}

static void modbus_master_drain(struct modbus_master *self, int64_t now_ns)
{
    self->state = MODBUS_MASTER_DRAINING;
    self->receiver.length = 0;
    self->deadline_ns = now_ns + self->config.drain_ns;
    self->drain_limit_ns = now_ns + 4 * self->config.drain_ns;
}

static void modbus_master_fail(struct modbus_master *self, int err,
                               int64_t now_ns)
{
    struct hal_modbus_reply *reply =
        &self->reply[modbus_master_slot(self->reply_head, self->reply_count)];

    *reply = (struct hal_modbus_reply){ .err = err };
    modbus_master_finish(self, reply, now_ns);
    modbus_master_drain(self, now_ns);
}

static unsigned modbus_master_begin(struct modbus_master *self, int64_t now_ns,
                                    uint8_t frame[MODBUS_RTU_FRAME_MAX])
{
    const int length =
        modbus_rtu_put_request(&self->box[self->box_head].request, frame);

    self->sent_ns = now_ns;
    self->state = MODBUS_MASTER_SENDING;
    self->receiver.length = 0;
    self->disturbed = false;
    return (unsigned)length; /* submit has looked at it */
}

/* What came is followed by silence: it should be the answer. */
static void modbus_master_judge(struct modbus_master *self, int64_t now_ns)
{
    const struct hal_modbus_request *request =
        &self->box[self->box_head].request;
    struct hal_modbus_reply *reply =
        &self->reply[modbus_master_slot(self->reply_head, self->reply_count)];

    *reply = (struct hal_modbus_reply){ 0 };
    modbus_rtu_take_answer(request, self->receiver.byte, self->receiver.length,
                           reply);
    if (self->disturbed || reply->err == MOTION_E_PROTOCOL) {
        modbus_master_fail(self, MOTION_E_PROTOCOL, now_ns);
        return;
    }
    reply->answer_ns = self->receiver.last_ns -
                       modbus_rtu_chars_ns(&self->time, self->receiver.length);
    modbus_master_finish(self, reply, now_ns);
    self->receiver.length = 0;
    self->state = MODBUS_MASTER_IDLE;
    self->free_ns = now_ns;
}

static void modbus_master_broadcast_done(struct modbus_master *self,
                                         int64_t now_ns)
{
    struct hal_modbus_reply reply = { .err = MOTION_OK, .answer_ns = now_ns };

    modbus_master_finish(self, &reply, now_ns);
    self->state = MODBUS_MASTER_IDLE;
    self->free_ns = now_ns;
}

static bool modbus_master_broadcasts(const struct modbus_master *self)
{
    return self->box[self->box_head].request.unit == HAL_MODBUS_BROADCAST;
}

static void modbus_master_wait(struct modbus_master *self, int64_t now_ns)
{
    if (self->receiver.length > 0)
        modbus_master_judge(self, now_ns);
    else if (modbus_master_broadcasts(self))
        modbus_master_broadcast_done(self, now_ns);
    else
        modbus_master_fail(self, MOTION_E_TIMEOUT, now_ns);
}

/* A line that somebody never lets go of must not keep its callers waiting. */
static void modbus_master_drain_step(struct modbus_master *self, int64_t now_ns)
{
    if (now_ns >= self->deadline_ns) {
        self->state = MODBUS_MASTER_IDLE;
        self->free_ns = now_ns;
    } else if (now_ns >= self->drain_limit_ns && self->box_count > 0) {
        self->sent_ns = now_ns;
        modbus_master_fail(self, MOTION_E_TIMEOUT, now_ns);
    }
}

static void modbus_master_refuse(struct modbus_master *self, int64_t now_ns)
{
    while (self->box_count > 0) {
        self->sent_ns = now_ns;
        modbus_master_fail(self, MOTION_E_IO, now_ns);
    }
}

/* ---- the station ---- */

static void modbus_master_recv(struct modbus_station *station,
                               const uint8_t *bytes, unsigned length,
                               int64_t now_ns)
{
    struct modbus_master *self = modbus_master_of(station);

    switch (self->state) {
    case MODBUS_MASTER_WAITING:
        modbus_receiver_take(&self->receiver, bytes, length, now_ns);
        self->deadline_ns = now_ns + self->time.gap_ns;
        return;
    case MODBUS_MASTER_DRAINING:
        self->deadline_ns = now_ns + self->config.drain_ns;
        break;
    case MODBUS_MASTER_SENDING:
        self->disturbed = true;
        break;
    case MODBUS_MASTER_IDLE:
        self->free_ns = now_ns + self->time.gap_ns;
        break;
    }
    self->stats.stray += length;
}

static int64_t modbus_master_due_ns(const struct modbus_station *station)
{
    const struct modbus_master *self = modbus_master_of(station);

    if (self->down && self->state != MODBUS_MASTER_SENDING)
        return self->box_count > 0 ? 0 : MODBUS_STATION_NEVER;
    switch (self->state) {
    case MODBUS_MASTER_IDLE:
        return self->box_count > 0 ? self->free_ns : MODBUS_STATION_NEVER;
    case MODBUS_MASTER_SENDING:
        return MODBUS_STATION_NEVER;
    case MODBUS_MASTER_DRAINING:
        if (self->box_count > 0 && self->drain_limit_ns < self->deadline_ns)
            return self->drain_limit_ns;
        return self->deadline_ns;
    case MODBUS_MASTER_WAITING:
        break;
    }
    return self->deadline_ns;
}

static unsigned modbus_master_poll(struct modbus_station *station,
                                   int64_t now_ns,
                                   uint8_t frame[MODBUS_RTU_FRAME_MAX])
{
    struct modbus_master *self = modbus_master_of(station);

    if (now_ns < modbus_master_due_ns(station))
        return 0;
    if (self->down) {
        modbus_master_refuse(self, now_ns);
        return 0;
    }
    if (self->state == MODBUS_MASTER_WAITING)
        modbus_master_wait(self, now_ns);
    else if (self->state == MODBUS_MASTER_DRAINING)
        modbus_master_drain_step(self, now_ns);
    if (self->state == MODBUS_MASTER_IDLE && self->box_count > 0)
        return modbus_master_begin(self, now_ns, frame);
    return 0;
}

/* A driver may hand over an answer only when it is whole. */
static int64_t modbus_master_patience_ns(const struct modbus_master *self)
{
    const struct hal_modbus_request *request =
        &self->box[self->box_head].request;
    const unsigned answer = modbus_pdu_answer_length(request) + 3;

    if (modbus_master_broadcasts(self))
        return self->config.broadcast_ns;
    return self->config.timeout_ns + modbus_rtu_chars_ns(&self->time, answer);
}

static void modbus_master_sent(struct modbus_station *station, int64_t now_ns)
{
    struct modbus_master *self = modbus_master_of(station);

    if (self->state != MODBUS_MASTER_SENDING)
        return;
    self->state = MODBUS_MASTER_WAITING;
    self->deadline_ns = now_ns + modbus_master_patience_ns(self);
}

static const struct modbus_station_ops modbus_master_station_ops = {
    .recv = modbus_master_recv,
    .due_ns = modbus_master_due_ns,
    .poll = modbus_master_poll,
    .sent = modbus_master_sent,
};

static int modbus_master_default(int64_t *dur_ns, int64_t preset_ns)
{
    if (*dur_ns == 0)
        *dur_ns = preset_ns;
    return *dur_ns >= MS && *dur_ns <= 10000 * MS ? MOTION_OK : MOTION_E_ARG;
}

int modbus_master_init(struct modbus_master *self,
                       const struct modbus_master_config *config)
{
    *self = (struct modbus_master){
        .modbus.ops = &modbus_master_ops,
        .station.ops = &modbus_master_station_ops,
        .config = *config,
    };
    if (modbus_rtu_time_init(&self->time, &config->line) != MOTION_OK ||
        modbus_master_default(&self->config.timeout_ns, TIMEOUT_NS) < 0 ||
        modbus_master_default(&self->config.drain_ns,
                              2 * self->config.timeout_ns) < 0 ||
        modbus_master_default(&self->config.broadcast_ns, BROADCAST_NS) < 0)
        return MOTION_E_ARG;
    return MOTION_OK;
}
