/* sim/device/cia402/com.c - NMT, heartbeat, EMCY.  See parts.h. */
#include <string.h>

#include "sim/device/cia402/parts.h"

#define CIA402_MS 1000000

/* Reset communication takes this long at most. */
#define CIA402_RESET_COM_NS CIA402_MS

void cia402_com_send(struct sim_cia402 *self, uint32_t id, const uint8_t *data,
                     unsigned len)
{
    struct hal_can_frame frame = { .id = id, .len = (uint8_t)len };

    memcpy(frame.data, data, len);
    /* A full queue loses the frame; the port counts it. */
    (void)hal_can_send(&cia402_axes_first(self)->base.port.can, &frame);
}

/* ---- NMT --------------------------------------------------------------- */

static void cia402_com_send_emcy(struct sim_cia402 *self, uint16_t code);

static void cia402_com_enter(struct sim_cia402 *self, enum cia402_nmt state)
{
    if (self->nmt_state == state)
        return;
    self->nmt_state = (uint8_t)state;
    cia402_long_end(self);
    if (state == CIA402_NMT_OPERATIONAL)
        cia402_pdo_start(self);
    if (state == CIA402_NMT_STOPPED)
        cia402_power_connection_lost(self);
}

static int64_t cia402_com_heartbeat_ns(const struct sim_cia402 *self)
{
    return (int64_t)self->value[CIA402_PRODUCER] * CIA402_MS;
}

static void cia402_com_start_heartbeat(struct sim_cia402 *self)
{
    int64_t period_ns = cia402_com_heartbeat_ns(self);

    cia402_timer_stop(self, SIM_CIA402_HEARTBEAT);
    if (period_ns > 0 && self->nmt_state != CIA402_NMT_BOOTING)
        cia402_timer_set(self, SIM_CIA402_HEARTBEAT,
                         cia402_now_ns(self) + period_ns);
}

void cia402_com_boot_up(struct sim_cia402 *self)
{
    if (self->config.node_id == CIA402_NO_NODE)
        return; /* stays so until LSS gives it one */
    cia402_guard_start(self);
    const uint8_t boot_up = CIA402_NMT_BOOTING;

    if (cia402_axes_is_first(self))
        cia402_com_send(self, 0x700u + self->config.node_id, &boot_up, 1);
    cia402_com_enter(self, CIA402_NMT_PRE_OPERATIONAL);
    if (self->config.boot_error != 0 && cia402_axes_is_first(self))
        cia402_com_send_emcy(self, self->config.boot_error);
    cia402_com_start_heartbeat(self);
    if (self->power == CIA402_POWER_NOT_READY)
        cia402_power_reset(self);
}

void cia402_com_boot_in(struct sim_cia402 *self, int64_t delay_ns)
{
    self->nmt_state = CIA402_NMT_BOOTING;
    cia402_long_end(self);
    cia402_timer_stop(self, SIM_CIA402_HEARTBEAT);
    cia402_timer_stop(self, SIM_CIA402_CONSUMER);
    cia402_timer_stop(self, SIM_CIA402_GUARD);
    cia402_timer_set(self, SIM_CIA402_BOOT, cia402_now_ns(self) + delay_ns);
}

void cia402_com_restart(struct sim_cia402 *self)
{
    if (self->lss.node_stored != 0)
        self->config.node_id = self->lss.node_stored;
    self->config.node_id = cia402_axes_first(self)->config.node_id;
    self->lss = (struct sim_cia402_lss){ .node_stored = self->lss.node_stored };
    cia402_motion_off(self);
    memset(self->rpdo, 0, sizeof(self->rpdo));
    memset(self->tpdo, 0, sizeof(self->tpdo));
    cia402_od_reset(self, false);
    cia402_timer_stop(self, SIM_CIA402_BRAKE);
    self->power = CIA402_POWER_NOT_READY;
    self->controlword = 0;
    self->following_error = false;
    self->targets_late = false;
    self->master_lost = false;
    self->sync_ns = -1;
    cia402_com_boot_in(self, self->config.boot_ns);
}

static void cia402_com_reset_communication(struct sim_cia402 *self)
{
    int64_t delay_ns = self->config.boot_ns < CIA402_RESET_COM_NS
                           ? self->config.boot_ns
                           : CIA402_RESET_COM_NS;

    if (self->lss.node_next != 0)
        self->config.node_id = self->lss.node_next;
    self->config.node_id = cia402_axes_first(self)->config.node_id;
    cia402_power_connection_lost(self);
    cia402_od_reset(self, true);
    self->sync_ns = -1;
    cia402_com_boot_in(self, delay_ns);
}

void cia402_com_restart_node(struct sim_cia402 *self)
{
    for (self = cia402_axes_first(self); self != NULL; self = self->next)
        cia402_com_restart(self);
}

/* To each axis, each by its own port. */
void cia402_com_nmt(struct sim_cia402 *self, const struct hal_can_frame *frame)
{
    if (frame->len != 2 ||
        (frame->data[1] != 0 && frame->data[1] != self->config.node_id))
        return;
    switch (frame->data[0]) {
    case 0x01:
        cia402_com_enter(self, CIA402_NMT_OPERATIONAL);
        break;
    case 0x02:
        cia402_com_enter(self, CIA402_NMT_STOPPED);
        break;
    case 0x80:
        cia402_com_enter(self, CIA402_NMT_PRE_OPERATIONAL);
        break;
    case 0x81:
        cia402_com_restart(self);
        break;
    case 0x82:
        cia402_com_reset_communication(self);
        break;
    default:
        break;
    }
}

/* ---- heartbeat --------------------------------------------------------- */

void cia402_com_heartbeat(struct sim_cia402 *self)
{
    cia402_com_send(self, 0x700u + self->config.node_id, &self->nmt_state, 1);
    cia402_timer_set(self, SIM_CIA402_HEARTBEAT,
                     cia402_now_ns(self) + cia402_com_heartbeat_ns(self));
}

void cia402_com_consume(struct sim_cia402 *self,
                        const struct hal_can_frame *frame)
{
    uint32_t consumer = self->value[CIA402_CONSUMER];
    int64_t timeout_ns = (int64_t)(consumer & 0xFFFF) * CIA402_MS;

    if (timeout_ns == 0 || frame->len != 1 ||
        frame->id != 0x700 + (consumer >> 16))
        return;
    if (self->master_lost) {
        self->master_lost = false;
        cia402_com_error_gone(self, CIA402_ERROR_COM);
    }
    cia402_timer_set(self, SIM_CIA402_CONSUMER,
                     cia402_now_ns(self) + timeout_ns);
}

/* 0x1029:1 says where NMT goes, 0x6007 what the motor does. */
static void cia402_com_behave(struct sim_cia402 *self, uint32_t behaviour)
{
    if (behaviour == 2)
        cia402_com_enter(self, CIA402_NMT_STOPPED);
    else if (behaviour == 0 && self->nmt_state == CIA402_NMT_OPERATIONAL)
        cia402_com_enter(self, CIA402_NMT_PRE_OPERATIONAL);
    cia402_power_connection_lost(self);
}

void cia402_com_master_lost(struct sim_cia402 *self)
{
    const uint32_t behaviour = self->value[CIA402_ERROR_BEHAVIOUR];

    self->master_lost = true;
    cia402_com_error(self, CIA402_EMCY_HEARTBEAT, CIA402_ERROR_COM);
    for (; self != NULL; self = self->next) {
        sim_servo_advance(&self->base);
        cia402_com_behave(self, behaviour);
    }
}

/* ---- EMCY -------------------------------------------------------------- */

static void cia402_com_send_emcy(struct sim_cia402 *self, uint16_t code)
{
    const uint8_t data[8] = {
        (uint8_t)code,
        (uint8_t)(code >> 8),
        cia402_axes_errors(self),
    };
    bool spoken = self->nmt_state == CIA402_NMT_PRE_OPERATIONAL ||
                  self->nmt_state == CIA402_NMT_OPERATIONAL;

    self = cia402_axes_first(self);
    if (spoken && !(self->value[CIA402_EMCY_COB] >> 31))
        cia402_com_send(self, self->value[CIA402_EMCY_COB] & 0x7FF, data, 8);
}

static void cia402_com_remember(struct sim_cia402 *self, uint16_t code)
{
    const uint32_t depth = CIA402_HISTORY_4 - CIA402_HISTORY_1 + 1;

    memmove(&self->value[CIA402_HISTORY_1 + 1], &self->value[CIA402_HISTORY_1],
            (depth - 1) * sizeof(self->value[0]));
    self->value[CIA402_HISTORY_1] = code;
    if (self->value[CIA402_HISTORY_COUNT] < depth)
        self->value[CIA402_HISTORY_COUNT]++;
}

void cia402_com_error(struct sim_cia402 *self, uint16_t code, uint8_t bits)
{
    self->value[CIA402_ERROR_REGISTER] |= bits | CIA402_ERROR_GENERIC;
    self->value[CIA402_ERROR_CODE] = code;
    cia402_com_remember(cia402_axes_first(self), code);
    cia402_com_send_emcy(self, code);
}

void cia402_com_error_gone(struct sim_cia402 *self, uint8_t bits)
{
    uint32_t left = self->value[CIA402_ERROR_REGISTER] &
                    ~(uint32_t)(bits | CIA402_ERROR_GENERIC);

    if (self->power == CIA402_POWER_FAULT ||
        self->power == CIA402_POWER_REACTION ||
        self->value[CIA402_ERROR_REGISTER] == 0)
        return;
    if (left != 0) {
        self->value[CIA402_ERROR_REGISTER] = left | CIA402_ERROR_GENERIC;
        return;
    }
    self->value[CIA402_ERROR_REGISTER] = 0;
    self->value[CIA402_ERROR_CODE] = 0;
    if (cia402_axes_errors(self) == 0)
        cia402_com_send_emcy(self, CIA402_EMCY_NONE);
}

/* ---- objects of the communication area --------------------------------- */

bool cia402_com_is_free_id(uint32_t id)
{
    static const struct {
        uint16_t first, last;
    } taken[] = {
        { 0x000, 0x07F }, { 0x101, 0x180 }, { 0x581, 0x5FF }, { 0x601, 0x67F },
        { 0x6E0, 0x6FF }, { 0x701, 0x77F }, { 0x780, 0x7FF },
    };

    if (id > 0x7FF)
        return false;
    for (unsigned i = 0; i < ARRAY_LEN(taken); i++)
        if (id >= taken[i].first && id <= taken[i].last)
            return false;
    return true;
}

uint32_t cia402_com_check(const struct sim_cia402 *self, int row,
                          uint32_t value)
{
    bool legal = true;

    if (row >= CIA402_RPDO1_COUNT && row <= CIA402_TMAP4_8)
        return cia402_pdo_check(self, row, value);
    if (row == CIA402_STORE)
        return value == CIA402_SAVE ? CIA402_DONE : CIA402_ABORT_STORE;
    if (row == CIA402_HISTORY_COUNT)
        legal = value == 0;
    else if (row == CIA402_SYNC_COB)
        legal = cia402_com_is_free_id(value); /* bit 30: we are no producer */
    else if (row == CIA402_EMCY_COB)
        legal = cia402_com_is_free_id(value & 0x7FFFFFFF);
    return legal ? CIA402_DONE : CIA402_ABORT_RANGE;
}

void cia402_com_changed(struct sim_cia402 *self, int row)
{
    if (row == CIA402_HISTORY_COUNT)
        memset(&self->value[CIA402_HISTORY_1], 0, 4 * sizeof(self->value[0]));
    else if (row == CIA402_STORE)
        cia402_od_store(self);
    else if (row == CIA402_CONSUMER) /* watched from the first one heard */
        cia402_timer_stop(self, SIM_CIA402_CONSUMER);
    else if (row == CIA402_PRODUCER)
        cia402_com_start_heartbeat(self);
    else if (row == CIA402_GUARD_TIME || row == CIA402_LIFE_FACTOR)
        cia402_timer_stop(self, SIM_CIA402_GUARD); /* from the first asked on */
    else if (row >= CIA402_RPDO1_COUNT && row <= CIA402_TMAP4_8)
        cia402_pdo_update(self);
}
