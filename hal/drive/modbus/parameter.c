/* hal/drive/modbus/parameter.c - registers that are written at start-up, with
 * torque off, and read back; see drive.h. */
#include <stddef.h>

#include "hal/drive/modbus/parts.h"

#define PARAMETER_TRIES 3

static const struct drive_modbus_parameter *
parameter_of(const struct drive_modbus *self)
{
    return &self->config.parameter[self->parameter_at >> 1];
}

static bool parameter_is_read(const struct drive_modbus *self)
{
    return (self->parameter_at & 1) != 0;
}

bool drive_modbus_parameters_done(const struct drive_modbus *self)
{
    return self->parameter_at >> 1 >= self->config.parameter_count;
}

/* After init and disable, which leave no sequence behind. */
bool drive_modbus_parameter_request(struct drive_modbus *self,
                                    struct hal_modbus_request *request)
{
    const struct modbus_map_item *item;

    if (self->phase != DRIVE_MODBUS_START || self->parameter_requested ||
        self->run.sequence != NULL || self->start_at < DRIVE_MODBUS_STARTS ||
        drive_modbus_parameters_done(self))
        return false;
    item = &self->config.map->item[parameter_of(self)->item];
    if (parameter_is_read(self))
        modbus_map_put_read(item, request);
    else
        modbus_map_put_write(item, parameter_of(self)->value, request);
    self->parameter_requested = true;
    return true;
}

static void parameter_fail(struct drive_modbus *self, const char *words,
                           const struct hal_modbus_reply *reply)
{
    const struct modbus_map *map = self->config.map;
    struct hal_text text =
        drive_modbus_say(self, map->item[parameter_of(self)->item].name);

    hal_text_put(&text, words);
    hal_text_put(&text, hal_modbus_reply_text(reply));
    drive_modbus_latch(self);
}

static void parameter_put(struct hal_text *text, int64_t value)
{
    if (value < 0)
        hal_text_put(text, "-");
    hal_text_dec(text, (uint32_t)(value < 0 ? -value : value));
}

static void parameter_differs(struct drive_modbus *self, int64_t value)
{
    const struct modbus_map *map = self->config.map;
    struct hal_text text =
        drive_modbus_say(self, map->item[parameter_of(self)->item].name);

    hal_text_put(&text, " reads back ");
    parameter_put(&text, value);
    hal_text_put(&text, " instead of ");
    parameter_put(&text, parameter_of(self)->value);
    drive_modbus_latch(self);
}

static void parameter_next(struct drive_modbus *self,
                           const struct hal_modbus_reply *reply)
{
    const struct modbus_map_item *item =
        &self->config.map->item[parameter_of(self)->item];
    const int64_t value = modbus_map_get(item->type, item->order, reply->value);

    if (parameter_is_read(self) &&
        !modbus_map_is_number(item->type, item->order, reply->value)) {
        struct hal_text text = drive_modbus_say(self, item->name);

        hal_text_put(&text, " reads back no number");
        drive_modbus_latch(self);
        return;
    }
    if (parameter_is_read(self) && value != parameter_of(self)->value) {
        parameter_differs(self, value);
        return;
    }
    self->parameter_at++;
    self->parameter_tries = 0;
}

void drive_modbus_parameter_reply(struct drive_modbus *self,
                                  const struct hal_modbus_reply *reply)
{
    if (!self->parameter_requested || self->phase != DRIVE_MODBUS_START)
        return; /* of a start that was broken off */
    self->parameter_requested = false;
    if (reply->err == MOTION_OK)
        parameter_next(self, reply);
    else if (!drive_modbus_is_passing(reply) ||
             ++self->parameter_tries == PARAMETER_TRIES)
        parameter_fail(self,
                       parameter_is_read(self) ? " was not read back: "
                                               : " was not written: ",
                       reply);
}
