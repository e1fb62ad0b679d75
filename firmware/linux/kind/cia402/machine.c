/* firmware/linux/kind/cia402/machine.c - the driver of a CiA 402 axis: see
 * firmware/linux/machine/kind.h. */
#include "firmware/linux/kind/cia402/machine.h"

#include "firmware/host/base/array.h"
#include "hal/drive/cia402/drive.h"
#include "hal/support/ratio.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "sim/device/cia402/servo.h"

#define CIA402_RETRY_NS INT64_C(1000000000)
#define CIA402_BOOT_NS  INT64_C(5000000000)

/* Whole counts, magnitude; 0 (leave the drive's own) beyond u32. */
static uint32_t cia402_counts(const struct rig_axis *axis, int64_t value_q32)
{
    struct hal_ratio to_counts;
    if (hal_ratio_init(&to_counts, axis->counts_num, axis->counts_den, -32) < 0)
        return 0;
    uint64_t magnitude =
        motion_fixed_abs(hal_ratio_scale(&to_counts, value_q32));
    return magnitude > UINT32_MAX ? 0 : (uint32_t)magnitude;
}

/* The drive watches beside us and sees no other axis: it gets twice the room
 * that we leave at full speed, so that our own watch, which brings all axes to
 * rest together, comes first.  0, leave, when it does not fit. */
static uint32_t cia402_following_counts(const struct rig_axis *axis)
{
    const int64_t margin_q32 =
        rig_axis_following_q32(axis, axis->limit.vel_q32);
    return margin_q32 > INT64_MAX / 2 ? 0 : cia402_counts(axis, 2 * margin_q32);
}

/* Two ticks, in whole ms. */
static uint16_t cia402_following_ms(const struct rig *rig)
{
    return (uint16_t)((2 * rig->period_ns + 999999) / 1000000);
}

/* In the drive's own count, which is the axis's unless slew homes it. */
static void cia402_put_limits(struct drive_cia402_config *config,
                              const struct rig_axis *axis)
{
    config->limits_when_homed = axis->homing.by == HOMING_DRIVE;
    if (axis->homing.by != HOMING_NONE && axis->homing.by != HOMING_DRIVE)
        return;
    config->pos_min_q32 = axis->limit.pos_min_q32;
    config->pos_max_q32 = axis->limit.pos_max_q32;
}

static void cia402_put_own(struct drive_cia402_config *config,
                           const struct rig_cia402 *cia402)
{
    config->stream = cia402->stream;
    config->stream_given = cia402->stream_given;
    config->gain_q16 = cia402->gain_q16;
    config->pdo = cia402->pdo;
    config->torque = cia402->torque;
    config->vel_num = cia402->velocity.num;
    config->vel_den = cia402->velocity.den;
    config->acc_num = cia402->acceleration.num;
    config->acc_den = cia402->acceleration.den;
    config->travel_q32 = cia402->travel_q32;
    config->guard_period_ns = cia402->guard_period_ns;
    config->nmt_reset = cia402->nmt_reset;
    config->sdo_timeout_ns = cia402->time.sdo_ns;
    config->state_timeout_ns = cia402->time.state_ns;
    config->brake_timeout_ns = cia402->time.brake_ns;
    config->precharge_timeout_ns = cia402->time.precharge_ns;
    for (unsigned i = 0; i < DRIVE_CIA402_OPTIONS; i++)
        config->option[i] = cia402->option[i];
}

static void cia402_put_quirks(struct drive_cia402_config *config,
                              const struct rig *rig,
                              const struct rig_cia402 *cia402)
{
    config->quirk_is_given = cia402->quirk_given;
    config->quirk = rig_quirks(rig, cia402, &config->quirk_count);
}

static int cia402_init(struct machine *machine, unsigned i)
{
    const struct rig *rig = machine->rig;
    const struct rig_axis *axis = &rig->axis[i];
    struct drive_cia402_config config = {
        .node_id = axis->node_id,
        .counts_num = axis->counts_num,
        .counts_den = axis->counts_den,
        .sync_period_ns = rig->period_ns,
        .heartbeat_period_ns = rig->heartbeat_ns,
        .watchdog_ns = rig->watchdog_ns,
        .quick_stop_counts_s2 = cia402_counts(axis, axis->stop_acc_q32),
        .vel_max_q32 = axis->limit.vel_q32,
        .parameter = axis->object,
        .parameter_count = axis->parameter_count,
        .following_error_counts = cia402_following_counts(axis),
        .following_error_ms = cia402_following_ms(rig),
        .axis = axis->node_axis,
        .inputs = rig_homes_by_drive_input(rig, i),
        .unsupervised = axis->unsupervised,
        .readings = axis->monitor.wanted,
        .temperature = { axis->monitor.temperature_index,
                         axis->monitor.temperature_sub,
                         axis->monitor.temperature_milli },
    };
    cia402_put_limits(&config, axis);
    cia402_put_own(&config, &axis->cia402);
    cia402_put_quirks(&config, rig, &axis->cia402);
    struct drive_cia402 *drive = machine->drive[i];
    machine->axis[i] = &drive->drive;
    return drive_cia402_init(drive, &machine->bus[axis->bus], &config);
}

static struct hal_readings *cia402_readings(struct machine *machine, unsigned i)
{
    return &((struct drive_cia402 *)machine->drive[i])->readings;
}

/* Three tries of an SDO, five states for a mode. */
static int64_t cia402_wait_ns(const struct rig_times *time)
{
    const int64_t wait_ns[] = { time->boot_ns, time->brake_ns,
                                time->precharge_ns, 3 * time->sdo_ns,
                                5 * time->state_ns };
    int64_t most_ns = CIA402_BOOT_NS;
    for (size_t i = 0; i < ARRAY_LEN(wait_ns); i++)
        if (wait_ns[i] > most_ns)
            most_ns = wait_ns[i];
    return most_ns;
}

/* The longest wait of a drive for one thing, so that the drive itself is the
 * one to say what did not come; whose quirks it has is not known yet. */
static int64_t cia402_patience_ns(const struct rig *rig,
                                  const struct rig_axis *axis)
{
    unsigned count;
    const struct drive_cia402_quirk *quirk =
        rig_quirks(rig, &axis->cia402, &count);
    int64_t most_ns = cia402_wait_ns(&axis->cia402.time);
    for (unsigned i = 0; i < count; i++) {
        const struct rig_times time = {
            .sdo_ns = quirk[i].sdo_timeout_ns,
            .state_ns = quirk[i].state_timeout_ns,
            .brake_ns = quirk[i].brake_timeout_ns,
            .precharge_ns = quirk[i].precharge_timeout_ns,
        };
        const int64_t wait_ns = cia402_wait_ns(&time);
        if (wait_ns > most_ns)
            most_ns = wait_ns;
    }
    return most_ns > CIA402_BOOT_NS ? most_ns + CIA402_RETRY_NS : most_ns;
}

static uint16_t cia402_statusword(const struct machine *machine, unsigned i)
{
    return ((const struct drive_cia402 *)machine->drive[i])->statusword;
}

const struct machine_kind machine_kind_cia402 = {
    .drive_size = sizeof(struct drive_cia402),
    .sim_size = sizeof(struct sim_cia402),
    .init = cia402_init,
    .readings = cia402_readings,
    .patience_ns = cia402_patience_ns,
    .statusword = cia402_statusword,
    .sim_init = cia402_sim_init,
    .sim_servo = cia402_sim_servo,
    .sim_loop_ns = CIA402_SIM_LOOP_NS,
    .sim_counts_q24 = cia402_sim_counts_q24,
};
