/* sim/device/cia402/servo.c - timers, frames in, injections.  See servo.h. */
#include "sim/device/cia402/servo.h"

#include "sim/device/cia402/parts.h"

/* ---- timers ------------------------------------------------------------ */

static void sim_cia402_schedule(struct sim_cia402 *self)
{
    self->due_ns = SIM_WORLD_NEVER;
    for (unsigned i = 0; i < SIM_CIA402_TIMERS; i++)
        if (self->timer_ns[i] < self->due_ns)
            self->due_ns = self->timer_ns[i];
}

static void sim_cia402_loop(struct sim_cia402 *self)
{
    cia402_timer_set(self, SIM_CIA402_LOOP,
                     cia402_now_ns(self) + self->base.loop_ns);
    sim_servo_advance(&self->base);
    cia402_mode_update(self);
    cia402_pdo_poll(self);
    cia402_long_poll(self);
}

static int64_t sim_cia402_due_ns(const struct sim_member *member)
{
    return CONTAINER_OF_CONST(member, struct sim_cia402, base.member)->due_ns;
}

static void sim_cia402_run(struct sim_member *member, int64_t now_ns)
{
    static void (*const handler[])(struct sim_cia402 *) = {
        [SIM_CIA402_LOOP] = sim_cia402_loop,
        [SIM_CIA402_BOOT] = cia402_com_boot_up,
        [SIM_CIA402_HEARTBEAT] = cia402_com_heartbeat,
        [SIM_CIA402_CONSUMER] = cia402_com_master_lost,
        [SIM_CIA402_BRAKE] = cia402_power_brake_released,
        [SIM_CIA402_TARGET] = cia402_stream_targets_late,
        [SIM_CIA402_GUARD] = cia402_com_master_lost,
    };
    struct sim_cia402 *self =
        CONTAINER_OF(member, struct sim_cia402, base.member);

    for (unsigned i = 0; i < SIM_CIA402_TIMERS; i++) {
        if (self->timer_ns[i] > now_ns)
            continue;
        cia402_timer_stop(self, (enum sim_cia402_timer)i);
        handler[i](self);
    }
    sim_cia402_schedule(self);
}

/* ---- frames in --------------------------------------------------------- */

/* A turn of the inner loop, which starts anew from here: one that is as long as
 * SYNC's period has no other.  RPDOs that came since the last SYNC come into
 * force, then the target is latched, then inputs are sent. */
static void sim_cia402_sync(struct sim_cia402 *self)
{
    sim_cia402_loop(self);
    cia402_stream_sync(self);
    cia402_pdo_sync_in(self);
    cia402_mode_latch(self);
    cia402_pdo_sync_out(self);
}

/* Its length says whether it counts, which must be what 0x1019 says. */
static void sim_cia402_sync_frame(struct sim_cia402 *self,
                                  const struct hal_can_frame *frame)
{
    bool counts = cia402_axes_first(self)->value[CIA402_SYNC_OVERFLOW] > 1;

    if (frame->len == counts) {
        if (self->wrong_sync)
            cia402_com_error_gone(self, CIA402_ERROR_COM);
        self->wrong_sync = false;
        sim_cia402_sync(self);
    } else if (!self->wrong_sync && cia402_axes_is_first(self)) {
        self->wrong_sync = true;
        cia402_com_error(self, CIA402_EMCY_SYNC_LENGTH, CIA402_ERROR_COM);
    }
}

/* What is the node's, the first axis takes. */
static bool sim_cia402_is_for_first(const struct sim_cia402 *self,
                                    const struct hal_can_frame *frame)
{
    return (frame->remote && frame->id == 0x700u + self->config.node_id) ||
           frame->id == (self->value[CIA402_TIME_COB] & 0x7FF) ||
           frame->id > 0x700;
}

static void sim_cia402_dispatch(struct sim_cia402 *self,
                                const struct hal_can_frame *frame)
{
    uint32_t id = frame->id;

    if (!cia402_axes_is_first(self) && sim_cia402_is_for_first(self, frame))
        return;
    if (frame->remote && id == 0x700u + self->config.node_id)
        cia402_guard_requested(self);
    else if (frame->remote)
        cia402_pdo_received(self, frame);
    else if (id == 0)
        cia402_com_nmt(self, frame);
    else if (id == cia402_axes_first(self)->value[CIA402_SYNC_COB])
        sim_cia402_sync_frame(self, frame);
    else if (id == (self->value[CIA402_TIME_COB] & 0x7FF))
        cia402_guard_time(self, frame);
    else if (id == 0x600u + self->config.node_id)
        cia402_sdo_request(self, frame);
    else if (id > 0x700)
        cia402_com_consume(self, frame);
    else
        cia402_pdo_received(self, frame);
}

/* As an acceptance filter would: of others' PDOs, most of what is on a wire,
 * nearly all end here. */
static bool sim_cia402_is_for_others(const struct sim_cia402 *self,
                                     const struct hal_can_frame *frame)
{
    return !frame->remote && frame->id > 0x180 && frame->id < 0x580 &&
           !(self->rpdo_ids >> (frame->id & 31) & 1) &&
           frame->id != cia402_axes_first(self)->value[CIA402_SYNC_COB] &&
           frame->id != (self->value[CIA402_TIME_COB] & 0x7FF);
}

static void sim_cia402_on_frame(struct sim_servo *base,
                                const struct hal_can_frame *frame)
{
    struct sim_cia402 *self = CONTAINER_OF(base, struct sim_cia402, base);
    bool booting = self->nmt_state == CIA402_NMT_BOOTING;
    bool nameless = self->config.node_id == CIA402_NO_NODE;

    if (frame->extended || frame->fd || (booting && !nameless) ||
        sim_cia402_is_for_others(self, frame))
        return;
    if (frame->id == 0x7E5 && !frame->remote && cia402_axes_is_first(self))
        cia402_lss_request(self, frame);
    else if (!nameless)
        sim_cia402_dispatch(self, frame);
    sim_cia402_schedule(self);
}

/* ---- injections -------------------------------------------------------- */

static void sim_cia402_overcurrent(struct sim_cia402 *self)
{
    cia402_power_fault(self, CIA402_EMCY_OVERCURRENT, CIA402_ERROR_CURRENT);
}

static void sim_cia402_silent(struct sim_cia402 *self)
{
    for (self = cia402_axes_first(self); self != NULL; self = self->next)
        sim_servo_inject(&self->base, SIM_SERVO_SILENT);
}

static void sim_cia402_blocked(struct sim_cia402 *self)
{
    sim_servo_inject(&self->base, SIM_SERVO_BLOCKED);
}

static void sim_cia402_clear(struct sim_cia402 *self)
{
    struct sim_cia402 *axis = cia402_axes_first(self);

    for (; axis != NULL; axis = axis->next)
        sim_servo_inject(&axis->base, SIM_SERVO_CLEAR);
    self->no_power = false;
    self->loses_rpdos = false;
}

static void sim_cia402_frozen(struct sim_cia402 *self)
{
    sim_servo_inject(&self->base, SIM_SERVO_FROZEN);
}

static void sim_cia402_no_power(struct sim_cia402 *self)
{
    self->no_power = true;
    cia402_power_lost(self);
}

static void sim_cia402_deaf(struct sim_cia402 *self)
{
    self->loses_rpdos = true;
}

void sim_cia402_inject(struct sim_cia402 *self, enum sim_cia402_fault fault)
{
    static void (*const inject[SIM_CIA402_FAULTS])(struct sim_cia402 *) = {
        [SIM_CIA402_OVERCURRENT] = sim_cia402_overcurrent,
        [SIM_CIA402_REBOOT] = cia402_com_restart_node,
        [SIM_CIA402_SILENT] = sim_cia402_silent,
        [SIM_CIA402_BLOCKED] = sim_cia402_blocked,
        [SIM_CIA402_CLEAR] = sim_cia402_clear,
        [SIM_CIA402_FROZEN] = sim_cia402_frozen,
        [SIM_CIA402_NO_POWER] = sim_cia402_no_power,
        [SIM_CIA402_DEAF] = sim_cia402_deaf,
    };

    if (fault >= SIM_CIA402_FAULTS)
        return;
    sim_servo_advance(&self->base);
    inject[fault](self);
    for (self = cia402_axes_first(self); self != NULL; self = self->next)
        sim_cia402_schedule(self);
}

/* ---- init -------------------------------------------------------------- */

static bool sim_cia402_is_legal(const struct sim_cia402_config *config)
{
    return config->node_id >= 1 &&
           (config->node_id <= 127 || config->node_id == CIA402_NO_NODE) &&
           config->brake_release_ns >= 0 && config->boot_ns >= 0 &&
           config->rail.index_every >= 0 && cia402_axes_is_legal(config);
}

/* As something that happens to it from outside: the register 0x1001 by the
 * class of the code (CiA 301 7.2.7.1). */
static void sim_cia402_trip(struct sim_servo *base, uint32_t code)
{
    static const uint8_t bits[16] = {
        [2] = CIA402_ERROR_CURRENT,
        [3] = 0x04,
        [4] = 0x08,
        [7] = CIA402_ERROR_PROFILE,
        [8] = CIA402_ERROR_COM,
    };
    struct sim_cia402 *self = CONTAINER_OF(base, struct sim_cia402, base);

    if (code == 0)
        sim_cia402_overcurrent(self);
    else
        cia402_power_fault(self, (uint16_t)code,
                           (uint8_t)(0x01 | bits[code >> 12 & 15]));
    sim_cia402_schedule(self);
}

static void sim_cia402_reboot(struct sim_servo *base)
{
    struct sim_cia402 *self = CONTAINER_OF(base, struct sim_cia402, base);

    cia402_com_restart_node(self);
    for (self = cia402_axes_first(self); self != NULL; self = self->next)
        sim_cia402_schedule(self);
}

static void sim_cia402_heat(struct sim_servo *base, enum sim_servo_heat heat)
{
    struct sim_cia402 *self = CONTAINER_OF(base, struct sim_cia402, base);

    if (heat == SIM_SERVO_HOT)
        cia402_power_fault(self, CIA402_EMCY_OVERLOAD, CIA402_ERROR_CURRENT);
    else if (heat == SIM_SERVO_COOL)
        cia402_com_error_gone(self, CIA402_ERROR_CURRENT);
    else if (self->power < CIA402_POWER_REACTION)
        cia402_com_error(self, CIA402_EMCY_LOAD_WARNING, CIA402_ERROR_CURRENT);
}

static uint32_t sim_cia402_heartbeat_id(const struct sim_servo *base)
{
    return 0x700u +
           CONTAINER_OF_CONST(base, struct sim_cia402, base)->config.node_id;
}

static const struct sim_servo_ops sim_cia402_ops = {
    .member = { .due_ns = sim_cia402_due_ns, .run = sim_cia402_run },
    .on_frame = sim_cia402_on_frame,
    .step = cia402_motion_step,
    .trip = sim_cia402_trip,
    .reboot = sim_cia402_reboot,
    .heat = sim_cia402_heat,
    .heartbeat_id = sim_cia402_heartbeat_id,
};

int sim_cia402_init(struct sim_cia402 *self, struct sim_can_bus *bus,
                    const struct sim_cia402_config *config)
{
    int err;

    *self = (struct sim_cia402){ .config = *config };
    if (!sim_cia402_is_legal(config))
        return MOTION_E_ARG;
    err = sim_servo_init(&self->base, bus, &sim_cia402_ops, &config->plant,
                         config->start_counts, config->loop_ns);
    if (err < 0)
        return err;
    cia402_axes_join(self);
    for (unsigned i = 0; i < SIM_CIA402_TIMERS; i++)
        cia402_timer_stop(self, (enum sim_cia402_timer)i);
    cia402_timer_set(self, SIM_CIA402_LOOP,
                     cia402_now_ns(self) + self->base.loop_ns);
    cia402_com_restart(self);
    sim_cia402_schedule(self);
    return MOTION_OK;
}
