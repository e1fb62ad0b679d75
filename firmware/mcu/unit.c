/* firmware/mcu/unit.c - see unit.h. */
#include "firmware/mcu/unit.h"

#include <string.h>

#include "hal/support/crc32.h"

/* Segments that the controller looks at closely when a move begins; what
 * follows is judged by the head. */
#define UNIT_START_SEGMENTS 4

void mcu_unit_init(struct mcu_unit *unit, const struct mcu_unit_config *config)
{
    memset(unit, 0, sizeof *unit);
    unit->config = config;
    drive_virtual_bus_init(&unit->bus);
    for (unsigned i = 0; i < MCU_AXES_MAX; i++)
        mcu_window_init(&unit->window[i],
                        config->ring + (size_t)2 * i * config->window,
                        config->window);
}

void mcu_unit_hold(const struct mcu_unit *unit)
{
    if (unit->config->hold != NULL)
        unit->config->hold();
}

void mcu_unit_release(const struct mcu_unit *unit)
{
    if (unit->config->release != NULL)
        unit->config->release();
}

/* --- the log -------------------------------------------------------------- */

static void mcu_log_init(struct mcu_unit *unit)
{
    const uint32_t stride = unit->axis_count + 1;

    unit->log = (struct mcu_log){
        .word = unit->config->log,
        .stride = stride,
        .capacity = unit->config->log_words / stride,
    };
}

static void mcu_log_put(struct mcu_unit *unit)
{
    struct mcu_log *log = &unit->log;
    int64_t *const entry = log->word + (size_t)log->slot * log->stride;

    if (log->capacity == 0)
        return;
    if (log->held == 0)
        unit->began = unit->tick;
    entry[0] = unit->controller.rate.s_ns_q12 >> 12;
    for (unsigned i = 0; i < unit->axis_count; i++)
        entry[1 + i] = unit->axis[i].target.pos_q32;
    log->crc = crc32_of(log->crc, entry, log->stride * sizeof *entry);
    log->slot = log->slot + 1 < log->capacity ? log->slot + 1 : 0;
    log->next++;
    if (log->held < log->capacity)
        log->held++;
}

uint32_t mcu_log_first(const struct mcu_log *log)
{
    return log->next - log->held;
}

const int64_t *mcu_log_entry(const struct mcu_log *log, uint32_t index)
{
    const uint32_t back = log->next - index; /* 1: the newest */
    uint32_t slot;

    if (back == 0 || back > log->held)
        return NULL;
    slot =
        log->slot >= back ? log->slot - back : log->slot + log->capacity - back;
    return log->word + (size_t)slot * log->stride;
}

/* --- between ticks -------------------------------------------------------- */

static bool unit_is_off(const struct mcu_unit *unit)
{
    if (unit->axis_count == 0)
        return true;
    for (unsigned i = 0; i < unit->axis_count; i++) {
        const enum hal_drive_state state = unit->axis[i].feedback.state;
        if (state == HAL_DRIVE_ENABLING || state == HAL_DRIVE_ENABLED ||
            state == HAL_DRIVE_QUICK_STOP)
            return false;
    }
    return unit->controller.state == CONTROLLER_OFF &&
           !unit->controller.enabling;
}

int mcu_unit_clear(struct mcu_unit *unit)
{
    if (!unit_is_off(unit))
        return MOTION_E_STATE;
    unit->axis_count = 0;
    unit->driven = 0;
    return MOTION_OK;
}

/* The drives there are, if any, are forgotten from here on. */
static int unit_start_line(struct mcu_unit *unit, uint16_t driven)
{
    const struct mcu_unit_config *config = unit->config;
    int err = MOTION_OK;

    if (driven == 0)
        return MOTION_OK;
    unit->axis_count = 0;
    unit->driven = 0;
    if (config->open_line != NULL)
        err = config->open_line(&config->servos->map.line);
    return err < 0 ? err : mcu_servos_start(config->servos, driven);
}

static struct controller_axis_config unit_axis(const struct mcu_setup *setup)
{
    return (struct controller_axis_config){
        .pos_min_q32 = setup->pos_min_q32,
        .pos_max_q32 = setup->pos_max_q32,
        .limit = { setup->vel_q32, setup->acc_q32, setup->jerk_q32 },
        .stop = { setup->stop_vel_q32, setup->stop_acc_q32,
                  setup->stop_jerk_q32 },
        .following_floor_q32 = setup->following_floor_q32,
        .following_k_ns = setup->following_k_ns,
    };
}

int mcu_unit_set_up(struct mcu_unit *unit, unsigned count,
                    const struct mcu_setup setup[], uint16_t driven)
{
    struct hal_drive *drive[MCU_AXES_MAX];
    struct controller_axis_config axis[MCU_AXES_MAX];
    struct controller_config config = {
        .period_ns = unit->config->period_ns,
        .axis_count = count,
        .axis = axis,
    };
    struct controller controller;
    int err;

    if (count < 1 || count > MCU_AXES_MAX)
        return MOTION_E_ARG;
    if (!unit_is_off(unit))
        return MOTION_E_STATE;
    for (unsigned i = 0; i < count; i++) {
        axis[i] = unit_axis(&setup[i]);
        drive[i] = &unit->drive[i].drive;
        if ((driven >> i & 1) == 0)
            continue;
        drive[i] = &unit->config->servos->drive[i].drive;
        axis[i].feedback_max_age_ns =
            unit->config->servos->servo[i].feedback_max_age_ns;
    }
    err = controller_init(&controller, &config, unit->axis, drive, NULL);
    if (err == MOTION_OK)
        err = unit_start_line(unit, driven);
    if (err < 0)
        return err;
    unit->driven = driven;
    memcpy(unit->axis_config, axis, sizeof axis);
    controller.config.axis = unit->axis_config;
    unit->controller = controller;
    unit->axis_count = count;
    for (unsigned i = 0; i < count; i++) {
        drive_virtual_init(&unit->drive[i], &unit->bus, setup[i].pos_q32);
        mcu_window_init(&unit->window[i], unit->window[i].ring,
                        unit->config->window);
    }
    mcu_log_init(unit);
    return MOTION_OK;
}

bool mcu_unit_is_moving(const struct mcu_unit *unit)
{
    return unit->controller.state == CONTROLLER_MOVING ||
           unit->controller.state == CONTROLLER_HOLDING ||
           unit->controller.state == CONTROLLER_STOPPING;
}

int mcu_unit_start(struct mcu_unit *unit)
{
    const struct motion_track *track[MCU_AXES_MAX];
    int err;

    if (unit->controller.state != CONTROLLER_READY)
        return MOTION_E_STATE;
    for (unsigned i = 0; i < unit->axis_count; i++) {
        struct mcu_window *window = &unit->window[i];
        if (!mcu_window_is_ready(window) || window->first != 0)
            return MOTION_E_AGAIN;
        mcu_window_show(window, UNIT_START_SEGMENTS);
        track[i] = window->head.outline.count > 0 ? &window->track : NULL;
    }
    err = controller_start(&unit->controller, track, NULL);
    if (err == MOTION_OK)
        mcu_log_init(unit);
    return err;
}

/* --- the tick ------------------------------------------------------------- */

static void mcu_unit_advance(struct mcu_unit *unit)
{
    for (unsigned i = 0; i < unit->axis_count; i++)
        if (unit->axis[i].track != NULL)
            mcu_window_advance(&unit->window[i],
                               unit->controller.rate.s_ns_q12);
}

static struct hal_fieldbus_worst mcu_unit_begin(struct mcu_unit *unit,
                                                int64_t now_ns)
{
    struct hal_fieldbus_worst worst = { HAL_FIELDBUS_GOOD, 0 };

    (void)hal_fieldbus_begin(&unit->bus.fieldbus, now_ns);
    if (unit->driven != 0)
        worst.health =
            hal_fieldbus_begin(&unit->config->servos->bus.fieldbus, now_ns);
    return worst;
}

void mcu_unit_tick(struct mcu_unit *unit, int64_t now_ns)
{
    const bool was_moving = mcu_unit_is_moving(unit);
    struct hal_fieldbus_worst worst;

    unit->tick++;
    unit->tick_ns = now_ns;
    if (unit->axis_count == 0)
        return;
    worst = mcu_unit_begin(unit, now_ns);
    mcu_unit_advance(unit);
    controller_step(&unit->controller, now_ns, worst);
    if (unit->driven != 0)
        hal_fieldbus_end(&unit->config->servos->bus.fieldbus, now_ns);
    if (was_moving)
        mcu_log_put(unit);
}
