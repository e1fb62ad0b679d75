/* firmware/mcu/registers.c - see registers.h. */
#include "firmware/mcu/registers.h"

#include <string.h>

#include "hal/mcu/piece.h"
#include "hal/support/container_of.h"

#define ILLEGAL_ADDRESS 2
#define ILLEGAL_VALUE   3
#define FAILURE         4

/* --- what is read --------------------------------------------------------- */

static void registers_identity(const struct mcu_registers *self, uint16_t *word)
{
    const struct mcu_unit_config *config = self->unit->config;

    word[0] = MCU_MAP_MAGIC;
    word[1] = MCU_MAP_VERSION;
    word[2] = config->board;
    word[3] = MCU_AXES_MAX;
    mcu_words_put(word + 4, (uint64_t)config->period_ns, 2);
    mcu_words_put(word + 6, config->window, 2);
    word[8] = config->servos != NULL;
}

static void registers_fault(const struct controller *controller, uint16_t *word)
{
    const struct controller_fault_record *fault = &controller->fault;

    word[MCU_STATE_FAULT] = (uint16_t)fault->fault;
    word[MCU_STATE_FAULT_AXIS] = (uint16_t)fault->axis;
    word[MCU_STATE_DRIVE_CODE] = fault->drive_code;
    mcu_words_put(word + MCU_STATE_VALUE, (uint64_t)fault->value, 4);
    mcu_words_put(word + MCU_STATE_LIMIT, (uint64_t)fault->limit, 4);
}

static void registers_clock(const struct controller *controller, uint16_t *word)
{
    mcu_words_put(word + MCU_STATE_TICKS, controller->ticks, 2);
    mcu_words_put(word + MCU_STATE_LOST, controller->ticks_lost, 2);
    mcu_words_put(word + MCU_STATE_PATH_NS,
                  (uint64_t)(controller->rate.s_ns_q12 >> 12), 4);
    mcu_words_put(word + MCU_STATE_RATE_Q30,
                  (uint64_t)controller->rate.rate_q30, 2);
}

static void registers_upload(const struct mcu_upload *upload, uint16_t *word)
{
    mcu_words_put(word + MCU_STATE_MOVE_ID, upload->move_id, 2);
    word[MCU_STATE_HEADS] = upload->head_axes;
    word[MCU_STATE_PIECE] = (uint16_t)upload->last;
    mcu_words_put(word + MCU_STATE_TAKEN, upload->taken, 2);
    mcu_words_put(word + MCU_STATE_REFUSED, upload->refused, 2);
    word[MCU_STATE_READY] = mcu_upload_has(upload, upload->move_id);
    word[MCU_STATE_SETUP_AXES] = upload->setup_axes;
    word[MCU_STATE_DRIVE_AXES] = upload->drive_axes;
}

static void registers_state(const struct mcu_registers *self, uint16_t *word)
{
    const struct mcu_unit *unit = self->unit;
    const uint32_t stack =
        unit->config->stack_free != NULL ? unit->config->stack_free() : 0;

    word[MCU_STATE_STATE] = (uint16_t)unit->controller.state;
    registers_fault(&unit->controller, word);
    registers_clock(&unit->controller, word);
    mcu_words_put(word + MCU_STATE_TIME,
                  (uint64_t)(unit->config->now_ns != NULL
                                 ? unit->config->now_ns()
                                 : unit->tick_ns),
                  4);
    word[MCU_STATE_WAITING] = self->waiting.command != 0 ? self->sequence : 0;
    mcu_words_put(word + MCU_STATE_BEGAN, unit->began, 2);
    word[MCU_STATE_SEQUENCE] = self->sequence;
    word[MCU_STATE_RESULT] = self->result;
    registers_upload(self->upload, word);
    word[MCU_STATE_AXES] = (uint16_t)unit->axis_count;
    mcu_words_put(word + MCU_STATE_LOG_FIRST, mcu_log_first(&unit->log), 2);
    mcu_words_put(word + MCU_STATE_LOG_NEXT, unit->log.next, 2);
    mcu_words_put(word + MCU_STATE_LOG_CRC, unit->log.crc, 2);
    word[MCU_STATE_WATCH] = self->watch_ms;
    word[MCU_STATE_SILENT] = self->is_silent;
    word[MCU_STATE_STACK] = (uint16_t)(stack > UINT16_MAX ? UINT16_MAX : stack);
}

static void registers_axis(const struct mcu_registers *self, unsigned index,
                           uint16_t *word)
{
    const struct controller_axis *axis = &self->unit->axis[index];
    const struct mcu_window *window = &self->unit->window[index];

    mcu_words_put(word + MCU_AXIS_ACTUAL, (uint64_t)axis->feedback.pos_q32, 4);
    mcu_words_put(word + MCU_AXIS_TARGET, (uint64_t)axis->target.pos_q32, 4);
    word[MCU_AXIS_DRIVE] = (uint16_t)axis->feedback.state;
    mcu_words_put(word + MCU_AXIS_SEGMENTS, window->head.outline.count, 2);
    mcu_words_put(word + MCU_AXIS_FIRST, window->first, 2);
    mcu_words_put(word + MCU_AXIS_NEXT, window->filled, 2);
    mcu_words_put(word + MCU_AXIS_FREE, mcu_window_free(window), 2);
    word[MCU_AXIS_DRIVEN] = self->unit->driven >> index & 1;
}

/* Why its drive is in fault or not there: what fault_text says. */
static void registers_why(const struct mcu_registers *self, unsigned index,
                          uint16_t *word)
{
    const char *text = self->unit->axis[index].feedback.fault_text;

    for (unsigned i = 0; i < 2 * MCU_WHY_WORDS && text[i] != '\0'; i++)
        word[i / 2] |= (uint16_t)((uint8_t)text[i] << (i % 2 == 0 ? 8 : 0));
}

/* Entries one after the other, from log_index on. */
static uint8_t registers_log(const struct mcu_registers *self, unsigned count,
                             uint16_t *value)
{
    const struct mcu_log *log = &self->unit->log;
    unsigned done = 0;

    for (uint32_t index = self->log_index; done < count; index++) {
        const int64_t *entry = mcu_log_entry(log, index);
        if (entry == NULL)
            return ILLEGAL_VALUE;
        for (unsigned i = 0; i < log->stride && done < count; i++, done += 4) {
            const unsigned words = count - done < 4 ? count - done : 4;
            mcu_words_put(value + done, (uint64_t)entry[i], words);
        }
    }
    return 0;
}

/* A run of registers that is filled in as a whole, of which a part is read. */
static uint8_t registers_part(const uint16_t *word, unsigned words,
                              unsigned from, unsigned count, uint16_t *value)
{
    if (from >= words || count > words - from)
        return ILLEGAL_ADDRESS;
    memcpy(value, word + from, count * sizeof *value);
    return 0;
}

static uint8_t registers_get_why(const struct mcu_registers *self,
                                 unsigned from, unsigned count, uint16_t *value)
{
    const unsigned index = from / MCU_AXIS_STEP;
    uint16_t word[MCU_WHY_WORDS] = { 0 };

    if (index >= self->unit->axis_count)
        return ILLEGAL_ADDRESS;
    registers_why(self, index, word);
    return registers_part(word, MCU_WHY_WORDS, from % MCU_AXIS_STEP, count,
                          value);
}

static uint8_t registers_get_axis(const struct mcu_registers *self,
                                  unsigned from, unsigned count,
                                  uint16_t *value)
{
    const unsigned index = from / MCU_AXIS_STEP;
    uint16_t word[MCU_AXIS_WORDS] = { 0 };

    if (index >= MCU_AXES_MAX)
        return ILLEGAL_ADDRESS;
    registers_axis(self, index, word);
    return registers_part(word, MCU_AXIS_WORDS, from % MCU_AXIS_STEP, count,
                          value);
}

static uint8_t registers_get(const struct mcu_registers *self, unsigned address,
                             unsigned count, uint16_t *value)
{
    uint16_t word[MCU_STATE_WORDS] = { 0 };

    if (address == MCU_AT_LOG)
        return registers_log(self, count, value);
    if (address == MCU_AT_LOG_INDEX) {
        mcu_words_put(word, self->log_index, 2);
        return registers_part(word, 2, 0, count, value);
    }
    if (address >= MCU_AT_AXIS && address < MCU_AT_COMMAND)
        return registers_get_axis(self, address - MCU_AT_AXIS, count, value);
    if (address >= MCU_AT_WHY &&
        address < MCU_AT_WHY + MCU_AXES_MAX * MCU_AXIS_STEP)
        return registers_get_why(self, address - MCU_AT_WHY, count, value);
    if (address < MCU_AT_STATE) {
        registers_identity(self, word);
        return registers_part(word, MCU_IDENTITY_WORDS, address, count, value);
    }
    if (address >= MCU_AT_STATE + MCU_STATE_WORDS)
        return ILLEGAL_ADDRESS;
    registers_state(self, word);
    return registers_part(word, MCU_STATE_WORDS, address - MCU_AT_STATE, count,
                          value);
}

/* --- what is written ------------------------------------------------------ */

static uint16_t registers_result(int err)
{
    static const int16_t error[] = {
#define RESULT_ERR(name, value, err) [value] = (err),
        MCU_RESULT_LIST(RESULT_ERR)
#undef RESULT_ERR
    };

    for (unsigned i = 0; i < sizeof error / sizeof error[0]; i++)
        if (error[i] == err)
            return (uint16_t)i;
    return MCU_RESULT_ARG;
}

/* Divides: between ticks. */
static int registers_set_watch(struct mcu_registers *self, uint32_t ms)
{
    const uint64_t period_ns = (uint64_t)self->unit->config->period_ns;

    if (ms > MCU_WATCH_MAX)
        return MOTION_E_ARG;
    self->watch_ms = (uint16_t)ms;
    self->watch =
        (uint32_t)((ms * UINT64_C(1000000) + period_ns - 1) / period_ns);
    return MOTION_OK;
}

/* Set points are those of a tick, and so not changed by when it comes. */
static int registers_set_clock(struct mcu_registers *self, int32_t ppb)
{
    if (ppb < -MCU_CLOCK_MAX || ppb > MCU_CLOCK_MAX)
        return MOTION_E_ARG;
    self->unit->clock_ppb = ppb;
    return MOTION_OK;
}

static int registers_enable(struct mcu_registers *self)
{
    const int err = controller_enable(&self->unit->controller);

    if (err == MOTION_OK)
        self->is_silent = false;
    return err;
}

static int registers_do(struct mcu_registers *self, enum mcu_command command,
                        uint32_t value)
{
    struct controller *controller = &self->unit->controller;

    if (command == MCU_COMMAND_WATCH)
        return registers_set_watch(self, value);
    if (command == MCU_COMMAND_CLOCK)
        return registers_set_clock(self, (int32_t)value);
    if (self->unit->axis_count == 0)
        return MOTION_E_STATE;
    switch (command) {
    case MCU_COMMAND_ENABLE:
        return registers_enable(self);
    case MCU_COMMAND_START:
        return mcu_upload_has(self->upload, value) ? mcu_unit_start(self->unit)
                                                   : MOTION_E_AGAIN;
    case MCU_COMMAND_HOLD:
        return controller_hold(controller);
    case MCU_COMMAND_RESUME:
        return controller_resume(controller);
    case MCU_COMMAND_STOP:
        controller_stop(controller);
        return MOTION_OK;
    case MCU_COMMAND_OFF:
        return controller_off(controller);
    case MCU_COMMAND_RESET:
        return controller_reset(controller);
    case MCU_COMMAND_OVERRIDE:
        return controller_override(controller, value);
    case MCU_COMMAND_RAMP: /* in a tick alone */
        return self->waiting.command == 0 ? MOTION_E_ARG
                                          : controller_ramp_begin(controller);
    case MCU_COMMAND_WATCH:
    case MCU_COMMAND_CLOCK:
        break;
    }
    return MOTION_E_ARG;
}

/* What a board does together with its neighbours; a stop never waits. */
static int registers_wait(struct mcu_registers *self, enum mcu_command command,
                          uint32_t value, uint32_t at)
{
    const struct mcu_unit *unit = self->unit;
    const uint32_t ahead = at - unit->tick;

    if (command != MCU_COMMAND_START && command != MCU_COMMAND_HOLD &&
        command != MCU_COMMAND_RESUME && command != MCU_COMMAND_OVERRIDE &&
        command != MCU_COMMAND_RAMP)
        return MOTION_E_ARG;
    if (unit->axis_count == 0)
        return MOTION_E_STATE;
    if (command == MCU_COMMAND_START && !mcu_upload_has(self->upload, value))
        return MOTION_E_AGAIN;
    if (ahead == 0 || ahead > MCU_COMMAND_AHEAD)
        return MOTION_E_TIMEOUT;
    self->waiting = (struct mcu_waiting){ (uint16_t)command, value, at,
                                          unit->controller.state };
    return 1;
}

/* Judged from now on until its tick. */
static int registers_schedule(struct mcu_registers *self, const uint16_t *value)
{
    struct controller *controller = &self->unit->controller;
    const uint32_t ahead = self->waiting.at - self->unit->tick - 1;
    const struct controller_ramp ramp = {
        .rate_q30 = self->waiting.value,
        .tick_ns = (int32_t)mcu_words_get(value + MCU_RAMP_TICK, 2),
        .change = (int32_t)mcu_words_get(value + MCU_RAMP_CHANGE, 2),
        .flat = (int32_t)mcu_words_get(value + MCU_RAMP_FLAT, 2),
    };
    const int err = controller_ramp_schedule(
        controller, &ramp,
        controller->clock_ns + ahead * controller->config.period_ns);
    if (err < 0)
        self->waiting.command = 0;
    return err;
}

/* In the tick that it says. */
static int registers_tell(struct mcu_registers *self, enum mcu_command command,
                          const uint16_t *value, unsigned count)
{
    const bool is_ramp = command == MCU_COMMAND_RAMP;
    if (is_ramp != (count == MCU_COMMAND_RAMP_WORDS))
        return MOTION_E_ARG;
    const int waits =
        registers_wait(self, command, (uint32_t)mcu_words_get(value + 2, 2),
                       (uint32_t)mcu_words_get(value + 4, 2));
    const int err =
        is_ramp && waits > 0 ? registers_schedule(self, value) : MOTION_OK;
    return err < 0 ? err : waits;
}

static void registers_poll(struct mcu_registers *self)
{
    const struct mcu_waiting waiting = self->waiting;
    const struct mcu_unit *unit = self->unit;
    int err;

    if (waiting.command == 0)
        return;
    if (unit->axis_count == 0 || unit->controller.state != waiting.state)
        err = MOTION_E_STATE;
    else if (unit->tick + 1 == waiting.at)
        err = registers_do(self, (enum mcu_command)waiting.command,
                           waiting.value);
    else if (waiting.at - unit->tick - 1 < MCU_COMMAND_AHEAD)
        return;
    else
        err = MOTION_E_TIMEOUT;
    self->waiting.command = 0;
    self->result = registers_result(err);
}

/* Whoever moves it is gone. */
static void registers_watch(struct mcu_registers *self)
{
    struct mcu_unit *unit = self->unit;
    struct controller *controller = &unit->controller;

    if (self->watch == 0 || unit->axis_count == 0 ||
        unit->tick - self->heard < self->watch)
        return;
    self->heard = unit->tick - self->watch; /* it stays so, also at a wrap */
    if (controller->state == CONTROLLER_MOVING ||
        controller->state == CONTROLLER_HOLDING)
        controller_stop(controller);
    else if (controller->state == CONTROLLER_READY || controller->enabling)
        (void)controller_off(controller);
    else
        return;
    self->is_silent = true;
}

void mcu_registers_poll(struct mcu_registers *self)
{
    mcu_unit_hold(self->unit);
    registers_poll(self);
    registers_watch(self);
    mcu_unit_release(self->unit);
}

/* A master that got no answer sends its command again: the same sequence number
 * is the same command, which has been done.  Any other takes the place of one
 * that waits. */
static uint8_t registers_command(struct mcu_registers *self,
                                 const uint16_t *value, unsigned count)
{
    if (value[0] == 0)
        return ILLEGAL_VALUE;
    if (value[0] != self->sequence) {
        const enum mcu_command command = (enum mcu_command)value[1];
        self->sequence = value[0];
        self->waiting.command = 0;
        self->result = registers_result(
            count >= MCU_COMMAND_AT
                ? registers_tell(self, command, value, count)
                : registers_do(self, command,
                               (uint32_t)mcu_words_get(value + 2, 2)));
    }
    return self->result == MCU_RESULT_DONE || self->result == MCU_RESULT_WAITS
               ? 0
               : FAILURE;
}

/* --- Modbus --------------------------------------------------------------- */

static struct mcu_registers *registers_of(struct modbus_slave *slave)
{
    return CONTAINER_OF(slave, struct mcu_registers, slave);
}

static uint8_t mcu_registers_get(struct modbus_slave *slave,
                                 enum modbus_space space, uint16_t address,
                                 uint16_t count, uint16_t *value)
{
    struct mcu_registers *self = registers_of(slave);
    uint8_t exception;

    if (space != MODBUS_HOLDING && space != MODBUS_INPUT)
        return ILLEGAL_ADDRESS;
    mcu_unit_hold(self->unit);
    self->heard = self->unit->tick;
    exception = registers_get(self, address, count, value);
    mcu_unit_release(self->unit);
    return exception;
}

static uint8_t mcu_registers_set(struct modbus_slave *slave,
                                 enum modbus_space space, uint16_t address,
                                 uint16_t count, const uint16_t *value)
{
    struct mcu_registers *self = registers_of(slave);
    uint8_t exception;

    if (space != MODBUS_HOLDING)
        return ILLEGAL_ADDRESS;
    self->heard = self->unit->tick;
    if (address == MCU_AT_PIECE)
        return mcu_piece_exception(mcu_upload_put(self->upload, value, count));
    if (address == MCU_AT_LOG_INDEX && count == 2) {
        self->log_index = (uint32_t)mcu_words_get(value, 2);
        return 0;
    }
    if (address != MCU_AT_COMMAND ||
        (count != MCU_COMMAND_WORDS && count != MCU_COMMAND_AT &&
         count != MCU_COMMAND_RAMP_WORDS))
        return ILLEGAL_ADDRESS;
    mcu_unit_hold(self->unit);
    exception = registers_command(self, value, count);
    mcu_unit_release(self->unit);
    return exception;
}

static const struct modbus_slave_ops mcu_registers_ops = {
    .get = mcu_registers_get,
    .set = mcu_registers_set,
};

void mcu_registers_init(struct mcu_registers *self, struct mcu_unit *unit,
                        struct mcu_upload *upload)
{
    *self = (struct mcu_registers){ .slave.ops = &mcu_registers_ops,
                                    .unit = unit,
                                    .upload = upload };
}
