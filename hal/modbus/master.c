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
    self->stats.stray += self->listener.strays;
    self->stats.echoes += self->listener.echoes;
    self->listener.strays = self->listener.echoes = 0;
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
                                    uint8_t frame[MODBUS_FRAME_MAX])
{
    const struct hal_modbus_request *request =
        &self->box[self->box_head].request;
    const unsigned length = /* submit has looked at it */
        (unsigned)modbus_serial_put_request(self->time.is_ascii, request,
                                            frame);

    self->sent_ns = now_ns;
    self->state = MODBUS_MASTER_SENDING;
    modbus_listener_begin(&self->listener, self->time.is_ascii, request, frame,
                          length, modbus_echo_expects(&self->echo));
    return length;
}

/* Free for the next one: after the silence that ends a frame. */
static void modbus_master_idle(struct modbus_master *self, int64_t now_ns)
{
    self->state = MODBUS_MASTER_IDLE;
    self->free_ns = now_ns;
}

static void modbus_master_broadcast_done(struct modbus_master *self,
                                         int64_t now_ns)
{
    struct hal_modbus_reply reply = { .err = MOTION_OK, .answer_ns = now_ns };

    modbus_master_finish(self, &reply, now_ns);
    modbus_master_idle(self, now_ns);
}

static bool modbus_master_broadcasts(const struct modbus_master *self)
{
    return self->box[self->box_head].request.unit == HAL_MODBUS_BROADCAST;
}

/* The answer, where it is among what was heard until heard_ns: it is the line's
 * until it has been silent. */
static bool modbus_master_answered(struct modbus_master *self, bool is_last,
                                   int64_t heard_ns)
{
    struct hal_modbus_reply *reply =
        &self->reply[modbus_master_slot(self->reply_head, self->reply_count)];
    const unsigned length =
        modbus_listener_find(&self->listener, is_last, reply);

    if (length == 0)
        return false;
    modbus_echo_note(&self->echo, &self->listener);
    reply->answer_ns =
        heard_ns -
        modbus_rtu_chars_ns(&self->time, self->listener.length + length);
    self->stats.stray += self->listener.length;
    self->state = MODBUS_MASTER_ENDING;
    self->deadline_ns = heard_ns + self->time.gap_ns;
    return true;
}

static void modbus_master_ended(struct modbus_master *self, int64_t now_ns)
{
    modbus_master_finish(
        self,
        &self->reply[modbus_master_slot(self->reply_head, self->reply_count)],
        now_ns);
    modbus_master_idle(self, now_ns);
}

/* Nothing more is waited for. */
static void modbus_master_wait(struct modbus_master *self, int64_t now_ns)
{
    struct hal_modbus_reply *reply =
        &self->reply[modbus_master_slot(self->reply_head, self->reply_count)];

    if (modbus_master_broadcasts(self))
        modbus_master_broadcast_done(self, now_ns);
    else if (!modbus_master_answered(self, true, self->heard_ns))
        modbus_master_fail(self, reply->err, now_ns);
}

/* A line that somebody never lets go of must not keep its callers waiting. */
static void modbus_master_drain_step(struct modbus_master *self, int64_t now_ns)
{
    if (now_ns >= self->deadline_ns) {
        modbus_master_idle(self, now_ns);
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

/* A device on RTU hears the end of a request by silence, so that what begins within 1.5
 * characters of it counts as heard while it was sent. */
static bool modbus_master_is_early(const struct modbus_master *self,
                                   unsigned length, int64_t now_ns)
{
    return self->state == MODBUS_MASTER_WAITING && !self->time.is_ascii &&
           now_ns - modbus_rtu_chars_ns(&self->time, length) <
               self->sent_end_ns + modbus_rtu_chars_ns(&self->time, 3) / 2;
}

/* What began in time may end a little later. */
static void modbus_master_hear(struct modbus_master *self, const uint8_t *bytes,
                               unsigned length, int64_t now_ns)
{
    const int64_t silent_ns = now_ns + self->time.gap_ns;

    modbus_listener_take(&self->listener, bytes, length);
    self->heard_ns = now_ns;
    if (modbus_master_is_early(self, length, now_ns))
        modbus_listener_sent(&self->listener);
    if (self->state == MODBUS_MASTER_WAITING &&
        !modbus_master_broadcasts(self) &&
        !modbus_master_answered(self, false, now_ns) &&
        self->deadline_ns < silent_ns && silent_ns <= self->limit_ns)
        self->deadline_ns = silent_ns;
}

static void modbus_master_recv(struct modbus_station *station,
                               const uint8_t *bytes, unsigned length,
                               int64_t now_ns)
{
    struct modbus_master *self = modbus_master_of(station);

    switch (self->state) {
    case MODBUS_MASTER_SENDING:
    case MODBUS_MASTER_WAITING:
        modbus_master_hear(self, bytes, length, now_ns);
        return;
    case MODBUS_MASTER_DRAINING:
        self->deadline_ns = now_ns + self->config.drain_ns;
        break;
    case MODBUS_MASTER_ENDING:
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
    case MODBUS_MASTER_ENDING:
        break;
    }
    return self->deadline_ns;
}

static unsigned modbus_master_poll(struct modbus_station *station,
                                   int64_t now_ns,
                                   uint8_t frame[MODBUS_FRAME_MAX])
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
    else if (self->state == MODBUS_MASTER_ENDING)
        modbus_master_ended(self, now_ns);
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
    const unsigned answer =
        modbus_rtu_frame_chars(&self->time, modbus_pdu_answer_length(request));

    if (modbus_master_broadcasts(self))
        return self->config.broadcast_ns;
    return self->config.timeout_ns + modbus_rtu_chars_ns(&self->time, answer);
}

static void modbus_master_sent(struct modbus_station *station, int64_t now_ns)
{
    struct modbus_master *self = modbus_master_of(station);

    if (self->state != MODBUS_MASTER_SENDING)
        return;
    modbus_listener_sent(&self->listener);
    self->sent_end_ns = now_ns;
    self->state = MODBUS_MASTER_WAITING;
    self->deadline_ns = now_ns + modbus_master_patience_ns(self);
    self->limit_ns =
        self->deadline_ns + modbus_rtu_chars_ns(&self->time, MODBUS_FRAME_MAX);
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
        .echo.is_known = config->echo,
    };
    if (modbus_rtu_time_init(&self->time, &config->line) != MOTION_OK ||
        modbus_master_default(&self->config.timeout_ns, TIMEOUT_NS) < 0 ||
        modbus_master_default(&self->config.drain_ns,
                              2 * self->config.timeout_ns) < 0 ||
        modbus_master_default(&self->config.broadcast_ns, BROADCAST_NS) < 0)
        return MOTION_E_ARG;
    return MOTION_OK;
}
