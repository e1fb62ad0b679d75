/* firmware/mcu/servos.c - see servos.h. */
#include "firmware/mcu/servos.h"

#include <string.h>

#include "hal/mcu/map.h"

void mcu_servos_clear(struct mcu_servos *servos)
{
    memset(servos, 0, sizeof *servos);
}

bool mcu_servo_is_sound(const struct mcu_servos *servos,
                        const struct mcu_servo *servo)
{
    const struct modbus_map *map = &servos->map;

    if (servo->config.parameter_count > MCU_SERVO_PARAMETERS ||
        servo->feedback_max_age_ns <= 0 || !mcu_map_is_sound(map) ||
        map->stream.count == 0)
        return false;
    for (unsigned i = 0; i < servo->config.parameter_count; i++)
        if (servo->parameter[i].item >= map->item_count)
            return false;
    return true;
}

static int servos_start_line(struct mcu_servos *servos, unsigned depth)
{
    const struct modbus_master_config config = {
        .line = servos->map.line,
        .timeout_ns = servos->map.timeout_ns,
    };
    const int err = modbus_master_init(&servos->master, &config);

    return err < 0
               ? err
               : modbus_bus_init(&servos->bus, &servos->master.modbus, depth);
}

int mcu_servos_start(struct mcu_servos *servos, uint16_t axes)
{
    int err = MOTION_OK;
    bool is_open = false;

    servos->is_on = false;
    for (unsigned i = 0; i < MCU_AXES_MAX && err == MOTION_OK; i++) {
        struct mcu_servo *servo = &servos->servo[i];

        if ((axes >> i & 1) == 0)
            continue;
        if (!is_open)
            err = servos_start_line(servos, servo->depth);
        is_open = true;
        servo->config.map = &servos->map;
        servo->config.parameter = servo->parameter;
        if (err == MOTION_OK)
            err = drive_modbus_init(&servos->drive[i], &servos->bus,
                                    &servo->config);
    }
    servos->is_on = is_open && err == MOTION_OK;
    return err;
}
