/* hal/drive/modbus/run.c - one sequence of a map, step by step; see
 * drive.h. */
#include <stddef.h>

#include "hal/drive/modbus/parts.h"

void drive_modbus_run_begin(struct drive_modbus *self,
                            enum modbus_map_sequence_name name)
{
    self->run = (struct drive_modbus_run){
        .sequence = &self->config.map->sequence[name],
        .serial = self->run.serial,
        .since_ns = self->now_ns,
    };
    self->cycles = 0;
}

bool drive_modbus_runs(const struct drive_modbus *self,
                       enum modbus_map_sequence_name name)
{
    return self->run.sequence == &self->config.map->sequence[name];
}

const struct modbus_map_step *
drive_modbus_run_at(const struct drive_modbus *self)
{
    const struct drive_modbus_run *run = &self->run;

    if (run->sequence == NULL || run->at >= run->sequence->count)
        return NULL;
    return &run->sequence->step[run->at];
}

bool drive_modbus_run_request(struct drive_modbus *self,
                              struct hal_modbus_request *request)
{
    const struct modbus_map_step *step = drive_modbus_run_at(self);

    if (step == NULL || self->run.requested || self->off_waits)
        return false;
    if (step->kind == MODBUS_STEP_WRITE)
        modbus_map_put_write(&self->config.map->item[step->item], step->value,
                             request);
    else if (step->kind == MODBUS_STEP_CHECK)
        modbus_map_put_read(&self->config.map->item[step->item], request);
    else
        return false;
    self->run.requested = true;
    self->run.serial++;
    return true;
}

void drive_modbus_run_next(struct drive_modbus *self)
{
    self->run.at++;
    self->run.tries = 0;
    self->run.requested = false;
    self->run.since_ns = self->now_ns;
    self->cycles = 0;
}

bool drive_modbus_run_checks(const struct drive_modbus *self,
                             const struct hal_modbus_reply *reply)
{
    const struct modbus_map_step *step = drive_modbus_run_at(self);
    const struct modbus_map_item *item = &self->config.map->item[step->item];

    return step->kind != MODBUS_STEP_CHECK ||
           modbus_map_get(item->type, item->order, reply->value) == step->value;
}

static void run_differs(struct drive_modbus *self,
                        const struct hal_modbus_reply *reply)
{
    const struct modbus_map_step *step = drive_modbus_run_at(self);
    const struct modbus_map_item *item = &self->config.map->item[step->item];
    const int64_t value = modbus_map_get(item->type, item->order, reply->value);
    struct hal_text text = drive_modbus_say(self, item->name);

    hal_text_put(&text, " reads 0x");
    hal_text_hex(&text, (uint32_t)value, value > UINT16_MAX ? 8 : 4);
    hal_text_put(&text, ", expected 0x");
    hal_text_hex(&text, (uint32_t)step->value, 4);
    drive_modbus_latch(self);
}

/* "Busy" and what was lost on its way may be tried again: steps write values,
 * they start nothing that adds up. */
void drive_modbus_run_reply(struct drive_modbus *self,
                            const struct hal_modbus_reply *reply)
{
    struct hal_text text;

    if (!self->run.requested || drive_modbus_run_at(self) == NULL)
        return; /* of a sequence that was broken off */
    if (drive_modbus_is_down(self) ||
        (self->phase == DRIVE_MODBUS_START &&
         drive_modbus_runs(self, MODBUS_SEQUENCE_stop))) {
        drive_modbus_off_reply(self, reply);
        return;
    }
    self->run.requested = false;
    if (reply->err == MOTION_OK && drive_modbus_run_checks(self, reply)) {
        drive_modbus_run_next(self);
    } else if (reply->err == MOTION_OK) {
        run_differs(self, reply);
    } else if (!drive_modbus_is_passing(reply) ||
               ++self->run.tries == DRIVE_MODBUS_STEP_TRIES) {
        text = drive_modbus_say(self, "not written: ");
        hal_text_put(&text, hal_modbus_reply_text(reply));
        drive_modbus_latch(self);
    }
}

static const char *run_status_text(enum modbus_map_status status)
{
    static const char *const text[] = {
#define RUN_STATUS_TEXT(name) #name,
        MODBUS_MAP_STATUS_LIST(RUN_STATUS_TEXT)
#undef RUN_STATUS_TEXT
    };

    return text[status];
}

/* One that homes is there by this homing. */
static bool run_meets(const struct drive_modbus *self,
                      const struct modbus_map_step *step)
{
    if (step->status == MODBUS_STATUS_homed && step->value != 0 &&
        self->homing == HAL_DRIVE_HOMING_RUNNING)
        return drive_modbus_is_home(self);
    return drive_modbus_status(self, step->status, false) == (step->value != 0);
}

static int run_until(struct drive_modbus *self,
                     const struct modbus_map_step *step)
{
    struct hal_text text;

    if (self->cycles >= DRIVE_MODBUS_FRESH && run_meets(self, step)) {
        drive_modbus_run_next(self);
        return MOTION_E_AGAIN;
    }
    if (self->now_ns - self->run.since_ns <= step->dur_ns)
        return MOTION_E_AGAIN;
    text = drive_modbus_say(self, "not ");
    if (step->value == 0)
        hal_text_put(&text, "without ");
    hal_text_put(&text, run_status_text(step->status));
    hal_text_put(&text, " in time");
    return MOTION_E_TIMEOUT;
}

bool drive_modbus_run_rolls(const struct drive_modbus *self)
{
    return (self->cycles < DRIVE_MODBUS_FRESH || !drive_modbus_rests(self)) &&
           self->now_ns - self->run.since_ns <= HAL_DRIVE_ROLL_NS;
}

int drive_modbus_run_step(struct drive_modbus *self)
{
    const struct modbus_map_step *step = drive_modbus_run_at(self);

    if (step == NULL)
        return drive_modbus_runs(self, MODBUS_SEQUENCE_stop) &&
                       drive_modbus_run_rolls(self)
                   ? MOTION_E_AGAIN
                   : MOTION_OK;
    switch (step->kind) {
    case MODBUS_STEP_WRITE:
    case MODBUS_STEP_CHECK:
        break; /* moved on by its reply */
    case MODBUS_STEP_UNTIL:
        return run_until(self, step);
    case MODBUS_STEP_DELAY:
        if (self->now_ns - self->run.since_ns >= step->dur_ns)
            drive_modbus_run_next(self);
        break;
    }
    return MOTION_E_AGAIN;
}
