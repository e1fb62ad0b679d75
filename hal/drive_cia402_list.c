/* hal/drive_cia402_list.c - walking a list of SDO steps.
 *
 * One transfer at a time; each row is tried three times when there is no
 * answer, and the first row that is refused ends the list with a sentence. */
#include "hal/drive_cia402_parts.h"

#define STEP_TRIES   3
#define STEP_WAIT_NS INT64_C(5000000000) /* for a value to become the wanted */

/* "0x6007:00 " and what is the matter with it. */
static struct hal_text step_say(struct drive_cia402 *self,
                                const struct drive_cia402_step *step,
                                const char *words)
{
    struct hal_text text = drive_cia402_say(self, "0x");

    hal_text_hex(&text, step->index, 4);
    hal_text_put(&text, ":");
    hal_text_hex(&text, step->sub, 2);
    hal_text_put(&text, " ");
    hal_text_put(&text, words);
    return text;
}

static uint32_t step_value(const struct drive_cia402 *self,
                           const struct drive_cia402_step *step)
{
    return drive_cia402_values[step->value_of](self);
}

static int step_compare(struct drive_cia402 *self,
                        const struct drive_cia402_step *step, uint32_t value)
{
    const uint32_t want = step_value(self, step);
    const uint32_t care = UINT32_MAX >> 8 * (4u - step->size);
    struct hal_text text;

    if (((value ^ want) & care) == 0)
        return MOTION_OK;
    text = step_say(self, step, "reads back 0x");
    hal_text_hex(&text, value, 8);
    hal_text_put(&text, " instead of 0x");
    hal_text_hex(&text, want, 8);
    return MOTION_E_REFUSED;
}

static int step_done(struct drive_cia402 *self,
                     const struct drive_cia402_step *step, uint32_t value,
                     int64_t now_ns)
{
    int err;

    if (step->kind == STEP_COMPARE)
        err = step_compare(self, step, value);
    else
        err = drive_cia402_checks[step->check](self, value);
    if (err == MOTION_E_AGAIN && now_ns - self->list_since_ns > STEP_WAIT_NS) {
        struct hal_text text = step_say(self, step, "stays at 0x");

        hal_text_hex(&text, value, 8);
        return MOTION_E_REFUSED;
    }
    return err;
}

static bool abort_is_missing(uint32_t code)
{
    return code == CANOPEN_ABORT_NO_OBJECT || code == CANOPEN_ABORT_NO_SUB ||
           code == CANOPEN_ABORT_READ_ONLY || code == CANOPEN_ABORT_WRITE_ONLY;
}

static int step_refused(struct drive_cia402 *self,
                        const struct drive_cia402_step *step)
{
    const uint32_t code = self->node.sdo.abort_code;
    struct hal_text text;

    if ((step->need & STEP_IF_THERE) != 0 && abort_is_missing(code))
        return drive_cia402_missing(self, step->check);
    if ((step->need & STEP_OR_LEAVE) != 0)
        return MOTION_OK;
    if ((step->need & STEP_SWITCHES) != 0) {
        while ((self->list[self->list_at + 1].need & STEP_SWITCHES) != 0)
            self->list_at++;
        return MOTION_OK;
    }
    text = step_say(self, step, "refused: ");
    hal_text_put(&text, canopen_abort_text(code));
    hal_text_put(&text, " (");
    hal_text_hex(&text, code, 8);
    hal_text_put(&text, ")");
    return MOTION_E_REFUSED;
}

static int step_silent(struct drive_cia402 *self,
                       const struct drive_cia402_step *step)
{
    struct hal_text text;

    if ((step->need & STEP_FOREVER) == 0 && ++self->list_tries < STEP_TRIES)
        return MOTION_E_AGAIN;
    text = drive_cia402_say(self, "node ");
    hal_text_dec(&text, self->config.node_id);
    hal_text_put(&text, " does not answer, object 0x");
    hal_text_hex(&text, step->index, 4);
    return (step->need & STEP_FOREVER) != 0 ? MOTION_E_AGAIN : MOTION_E_TIMEOUT;
}

static int step_start(struct drive_cia402 *self,
                      const struct drive_cia402_step *step, int64_t now_ns)
{
    int err;

    if (step->kind == STEP_WRITE)
        err = canopen_sdo_write(&self->node, now_ns, step->index, step->sub,
                                step->size, step_value(self, step));
    else
        err = canopen_sdo_read(&self->node, now_ns, step->index, step->sub);
    if (err != MOTION_OK && err != MOTION_E_AGAIN &&
        (step->need & STEP_FOREVER) == 0 &&
        now_ns - self->list_since_ns > STEP_WAIT_NS) {
        step_say(self, step, "could not be sent");
        return err;
    }
    return MOTION_E_AGAIN;
}

static int step_transfer(struct drive_cia402 *self,
                         const struct drive_cia402_step *step, int64_t now_ns)
{
    uint32_t value = 0;
    const int err = canopen_sdo_take(&self->node, &value, NULL);

    if (err == MOTION_E_STATE)
        return step_start(self, step, now_ns);
    if (err == MOTION_E_REFUSED)
        return step_refused(self, step);
    if (err == MOTION_E_TIMEOUT)
        return step_silent(self, step);
    return err == MOTION_OK ? step_done(self, step, value, now_ns) : err;
}

/* NMT or waiting: nothing to take, but a limit on the time. */
static int step_other(struct drive_cia402 *self,
                      const struct drive_cia402_step *step, int64_t now_ns)
{
    int err;

    if (step->kind == STEP_NMT)
        err = canopen_nmt(self->node.master,
                          (enum canopen_nmt_command)step->value,
                          self->config.node_id);
    else
        err = drive_cia402_checks[step->check](self, 0);
    if (err == MOTION_OK || err == MOTION_E_REFUSED)
        return err;
    if (now_ns - self->list_since_ns <= self->config.state_timeout_ns)
        return MOTION_E_AGAIN;
    if (self->pdo_ok && self->node.nmt_state == CANOPEN_NMT_OPERATIONAL)
        drive_cia402_say(self, "operational, but no TPDO1 answers SYNC");
    else
        drive_cia402_say(self, "no heartbeat shows the NMT state asked for");
    return MOTION_E_TIMEOUT;
}

/* Each parameter is written, then compared. */
static int step_parameters(struct drive_cia402 *self, int64_t now_ns)
{
    while (self->parameter_at >> 1 < self->config.parameter_count) {
        const struct drive_cia402_parameter *parameter =
            &self->config.parameter[self->parameter_at >> 1];
        const struct drive_cia402_step step = {
            .kind = (self->parameter_at & 1) == 0 ? STEP_WRITE : STEP_COMPARE,
            .index = parameter->index,
            .sub = parameter->sub,
            .size = parameter->size,
            .value_of = VALUE_PARAMETER,
        };
        const int err = step_transfer(self, &step, now_ns);

        if (err != MOTION_OK)
            return err;
        self->parameter_at++;
        self->list_tries = 0;
        self->list_since_ns = now_ns;
    }
    return MOTION_OK;
}

/* ---- rows that are left out ---- */

static bool step_if_counted(const struct drive_cia402 *self)
{
    return self->node.master->config.sync_overflow > 0;
}

static bool step_if_guarded(const struct drive_cia402 *self)
{
    return self->guard_ms > 0;
}

static bool step_if_option(const struct drive_cia402 *self)
{
    const unsigned option = self->list[self->list_at].index - 0x605Au;

    return self->config.option[option].given;
}

static bool step_if_travel(const struct drive_cia402 *self)
{
    return self->turn_q32 != 0;
}

static bool step_if_limits(const struct drive_cia402 *self)
{
    return self->config.pos_min_q32 != self->config.pos_max_q32;
}

static bool step_if_velocity(const struct drive_cia402 *self)
{
    return self->config.velocity || self->config.stream == DRIVE_CIA402_CSV;
}

static bool step_if_torque(const struct drive_cia402 *self)
{
    return self->config.torque;
}

static bool step_if_ip(const struct drive_cia402 *self)
{
    return self->config.stream == DRIVE_CIA402_IP;
}

static bool step_unless_ip(const struct drive_cia402 *self)
{
    return self->config.stream != DRIVE_CIA402_IP;
}

static bool step_if_speed(const struct drive_cia402 *self)
{
    return drive_cia402_mode_wanted(self)->uses_speed;
}

static bool step_if_valid(const struct drive_cia402 *self)
{
    return (self->cob & DRIVE_CIA402_COB_OFF) == 0;
}

static bool step_if_unsafe(const struct drive_cia402 *self)
{
    return drive_cia402_option_is_unsafe(self);
}

/* From STEP_IF_COUNTED on, a bit each. */
static bool (*const step_gates[])(const struct drive_cia402 *self) = {
    step_if_counted, step_if_guarded,  step_if_option, step_if_travel,
    step_if_limits,  step_if_velocity, step_if_torque, step_if_ip,
    step_unless_ip,  step_if_speed,    step_if_valid,  step_if_unsafe,
};

static bool step_is_left_out(const struct drive_cia402 *self,
                             const struct drive_cia402_step *step)
{
    for (unsigned i = 0; i < sizeof step_gates / sizeof step_gates[0]; i++)
        if ((step->need & (unsigned)STEP_IF_COUNTED << i) != 0 &&
            !step_gates[i](self))
            return true;
    return (step->need & STEP_IF_SET) != 0 && step_value(self, step) == 0;
}

static int step_do(struct drive_cia402 *self,
                   const struct drive_cia402_step *step, int64_t now_ns)
{
    if (step->kind == STEP_PARAMETERS)
        return step_parameters(self, now_ns);
    if (step_is_left_out(self, step))
        return MOTION_OK;
    if (step->kind == STEP_NMT || step->kind == STEP_UNTIL)
        return step_other(self, step, now_ns);
    return step_transfer(self, step, now_ns);
}

void drive_cia402_list_begin(struct drive_cia402 *self,
                             const struct drive_cia402_step *list,
                             int64_t now_ns)
{
    canopen_sdo_drop(&self->node);
    self->list = list;
    self->list_at = 0;
    self->parameter_at = 0;
    self->list_tries = 0;
    self->list_since_ns = now_ns;
}

/* Rows that need no answer are done at once; so at most the whole list. */
int drive_cia402_list_step(struct drive_cia402 *self, int64_t now_ns)
{
    while (self->list[self->list_at].kind != STEP_END) {
        const int err = step_do(self, &self->list[self->list_at], now_ns);

        if (err != MOTION_OK)
            return err;
        self->list_at++;
        self->list_tries = 0;
        self->list_since_ns = now_ns;
    }
    return MOTION_OK;
}
