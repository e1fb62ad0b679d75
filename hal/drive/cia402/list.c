/* hal/drive/cia402/list.c - walking a list of SDO steps.
 *
 * One transfer at a time; each row is tried three times when there is no
 * answer, and the first row that is refused ends the list with a sentence. */
#include "hal/drive/cia402/parts.h"

#define STATES 5 /* state time-outs for a value to become the wanted */

/* On the wire; the config's parameters are there already. */
static uint16_t step_index(const struct drive_cia402 *self,
                           const struct drive_cia402_step *step)
{
    return step->value_of == VALUE_PARAMETER
               ? step->index
               : drive_cia402_object(self, step->index);
}

void drive_cia402_skip_switches(struct drive_cia402 *self)
{
    while ((self->list[self->list_at + 1].need & STEP_SWITCHES) != 0)
        self->list_at++;
}

/* "0x6007:00 " and what is the matter with it. */
static struct hal_text step_say(struct drive_cia402 *self,
                                const struct drive_cia402_step *step,
                                const char *words)
{
    struct hal_text text = drive_cia402_say(self, "0x");

    hal_text_hex(&text, step_index(self, step), 4);
    hal_text_put(&text, ":");
    hal_text_hex(&text, step->sub, 2);
    hal_text_put(&text, " ");
    hal_text_put(&text, words);
    return text;
}

/* What slew would have it be. */
static uint32_t step_wish(const struct drive_cia402 *self,
                          const struct drive_cia402_step *step)
{
    return drive_cia402_values[step->value_of](self);
}

/* What it is to be. */
static uint32_t step_value(const struct drive_cia402 *self,
                           const struct drive_cia402_step *step)
{
    const struct drive_cia402_parameter *fixed =
        drive_cia402_fixed(self, step->index, step->sub);

    return fixed != NULL && step->value_of != VALUE_PARAMETER
               ? fixed->value
               : step_wish(self, step);
}

static bool step_is_cob(const struct drive_cia402_step *step)
{
    return step->value_of == VALUE_COB || step->value_of == VALUE_COB_OFF;
}

/* Bit 30 is the drive's affair: nothing is asked for by RTR. */
static bool step_agrees(const struct drive_cia402 *self,
                        const struct drive_cia402_step *step, uint32_t value)
{
    uint32_t care = UINT32_MAX >> 8 * (4u - step->size);

    if (step_is_cob(step))
        care &= ~DRIVE_CIA402_COB_NO_RTR;
    return ((value ^ step_value(self, step)) & care) == 0;
}

static bool step_is_of_map(const struct drive_cia402_step *step)
{
    return (step->index & 0x0200) != 0; /* 0x16xx, 0x1Axx */
}

/* One thing that differs, and the PDO is switched off and set up. */
static int step_match(struct drive_cia402 *self,
                      const struct drive_cia402_step *step, bool agrees)
{
    if (!agrees) {
        self->pdo_other = true;
        self->map_other |= step_is_of_map(step);
    }
    return MOTION_OK;
}

/* What makes the drive stop when we are silent, or cannot follow. */
static bool step_is_unwatched(const struct drive_cia402 *self,
                              const struct drive_cia402_step *step)
{
    return (step->need & STEP_WATCH) != 0 && self->config.unsupervised;
}

static int step_needs_watch(struct hal_text *text)
{
    hal_text_put(text, ": needs unsupervised: yes");
    return MOTION_E_REFUSED;
}

static int step_compare(struct drive_cia402 *self,
                        const struct drive_cia402_step *step, uint32_t value)
{
    const uint32_t want = step_value(self, step);
    struct hal_text text;

    if (step_agrees(self, step, value) || step_is_unwatched(self, step))
        return MOTION_OK;
    text = step_say(self, step, "reads back 0x");
    hal_text_hex(&text, value, 8);
    if ((step->need & STEP_WATCH) != 0)
        return step_needs_watch(&text);
    hal_text_put(&text, " instead of 0x");
    hal_text_hex(&text, want, 8);
    return MOTION_E_REFUSED;
}

/* Longer than a stop that CHECK_STANDS waits for. */
static int64_t step_wait_ns(const struct drive_cia402 *self)
{
    const int64_t wait_ns = STATES * self->config.state_timeout_ns;

    return self->list[self->list_at].check == CHECK_STANDS &&
                   wait_ns < 2 * HAL_DRIVE_STOP_NS
               ? 2 * HAL_DRIVE_STOP_NS
               : wait_ns;
}

static int step_done(struct drive_cia402 *self,
                     const struct drive_cia402_step *step, uint32_t value,
                     int64_t now_ns)
{
    int err;

    if (step->kind == STEP_MATCH)
        return step_match(self, step, step_agrees(self, step, value));
    if (step->kind == STEP_COMPARE)
        err = step_compare(self, step, value);
    else
        err = drive_cia402_checks[step->check](self, value);
    if (err == MOTION_E_AGAIN &&
        now_ns - self->list_since_ns > step_wait_ns(self)) {
        struct hal_text text = step_say(self, step, "stays at 0x");

        hal_text_hex(&text, value, 8);
        drive_cia402_put_wait(&text, step_wait_ns(self));
        return MOTION_E_REFUSED;
    }
    return err;
}

/* Bit 30, no RTR: some drives take a COB-ID only with it, some only without,
 * and not all show which. */
static bool step_turns_cob(struct drive_cia402 *self,
                           const struct drive_cia402_step *step)
{
    if (step->kind != STEP_WRITE || !step_is_cob(step) || self->cob_turned)
        return false;
    self->cob ^= DRIVE_CIA402_COB_NO_RTR;
    self->cob_turned = true;
    return true;
}

static int step_refused(struct drive_cia402 *self,
                        const struct drive_cia402_step *step)
{
    const uint32_t code = self->node.sdo.abort_code;
    struct hal_text text;

    if (step_turns_cob(self, step) ||
        (step->kind != STEP_MATCH && drive_cia402_search_again(self)))
        return MOTION_E_AGAIN;
    if ((step->need & STEP_IF_THERE) != 0)
        return drive_cia402_missing(self, step->check);
    if (step->kind == STEP_MATCH)
        return step_match(self, step, false);
    if ((step->need & STEP_OR_LEAVE) != 0 || step_is_unwatched(self, step))
        return MOTION_OK;
    if ((step->need & STEP_SWITCHES) != 0 && !self->config.inputs) {
        drive_cia402_skip_switches(self);
        return MOTION_OK;
    }
    if ((step->need & STEP_WATCH) != 0) {
        text = step_say(self, step, "refused (");
        hal_text_hex(&text, code, 8);
        hal_text_put(&text, ")");
        return step_needs_watch(&text);
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

    if ((step->need & STEP_FOREVER) == 0 &&
        ++self->list_tries < DRIVE_CIA402_TRIES)
        return MOTION_E_AGAIN;
    text = drive_cia402_say(self, "node ");
    hal_text_dec(&text, self->config.node_id);
    hal_text_put(&text, " does not answer");
    drive_cia402_put_wait(&text, canopen_sdo_timeout_ns(&self->node));
    hal_text_put(&text, ", object 0x");
    hal_text_hex(&text, step_index(self, step), 4);
    if (self->node.heartbeat_heard) {
        hal_text_put(&text, ", NMT ");
        hal_text_hex(&text, (uint32_t)self->node.nmt_state, 2);
    }
    if ((step->need & STEP_FOREVER) == 0)
        return MOTION_E_TIMEOUT;
    drive_cia402_search_silent(self);
    return MOTION_E_AGAIN;
}

static int step_start(struct drive_cia402 *self,
                      const struct drive_cia402_step *step, int64_t now_ns)
{
    int err;

    if (now_ns < self->list_due_ns)
        return MOTION_E_AGAIN;
    if (step->value_of == VALUE_LIMIT)
        drive_cia402_forget_limit(self, step->sub - 1u);
    if (step->kind == STEP_WRITE)
        err = canopen_sdo_write(&self->node, now_ns, step_index(self, step),
                                step->sub, step->size, step_value(self, step));
    else
        err = canopen_sdo_read(&self->node, now_ns, step_index(self, step),
                               step->sub);
    if (err != MOTION_OK && err != MOTION_E_AGAIN &&
        (step->need & STEP_FOREVER) == 0 &&
        now_ns - self->list_since_ns > step_wait_ns(self)) {
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
    struct hal_text text;
    int err;

    if (step->kind == STEP_NMT)
        err = canopen_nmt(self->node.master,
                          (enum canopen_nmt_command)step->value,
                          self->config.node_id);
    else
        err = drive_cia402_checks[step->check](self, 0);
    if (err == MOTION_OK || err == MOTION_E_REFUSED)
        return err;
    if ((step->need & STEP_FOREVER) != 0 ||
        now_ns - self->list_since_ns <= self->config.state_timeout_ns) {
        drive_cia402_search_repeat(self);
        return MOTION_E_AGAIN;
    }
    text = drive_cia402_say(
        self, self->pdo_ok && self->node.nmt_state == CANOPEN_NMT_OPERATIONAL
                  ? "operational, but no TPDO1 answers SYNC"
                  : "no heartbeat shows the requested NMT state");
    drive_cia402_put_wait(&text, self->config.state_timeout_ns);
    return MOTION_E_TIMEOUT;
}

/* Each parameter is written, then compared. */
static int step_parameters(struct drive_cia402 *self, int64_t now_ns)
{
    struct drive_cia402_parameter parameter;

    while (drive_cia402_parameter(self, self->parameter_at >> 1, &parameter)) {
        const struct drive_cia402_step step = {
            .kind = (self->parameter_at & 1) == 0 ? STEP_WRITE : STEP_COMPARE,
            .index = parameter.index,
            .sub = parameter.sub,
            .size = parameter.size,
            .value_of = VALUE_PARAMETER,
        };
        const int err = step_transfer(self, &step, now_ns);

        if (err != MOTION_OK)
            return err;
        self->parameter_at++;
        self->steps++;
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

static bool step_if_other(const struct drive_cia402 *self)
{
    const unsigned end = self->list[self->list_at].sub - 1u;

    return self->limit_there[end] &&
           self->limit_held[end] != drive_cia402_limit(self, end);
}

static bool step_if_pdo(const struct drive_cia402 *self)
{
    return self->pdo_other;
}

static bool step_if_map(const struct drive_cia402 *self)
{
    return self->map_other;
}

static bool step_if_other_axis(const struct drive_cia402 *self)
{
    return self->config.axis > 0;
}

static bool step_if_first(const struct drive_cia402 *self)
{
    return canopen_is_first(&self->node);
}

static bool step_if_quirks(const struct drive_cia402 *self)
{
    return self->given.quirk_count > 0;
}

static bool step_if_found(const struct drive_cia402 *self)
{
    return self->was_found;
}

/* From STEP_IF_COUNTED on, a bit each. */
static bool (*const step_gates[])(const struct drive_cia402 *self) = {
    step_if_counted,    step_if_guarded,  step_if_option, step_if_travel,
    step_if_limits,     step_if_velocity, step_if_torque, step_if_ip,
    step_unless_ip,     step_if_speed,    step_if_valid,  step_if_unsafe,
    step_if_other,      step_if_pdo,      step_if_map,    step_if_quirks,
    step_if_other_axis, step_if_first,    step_if_found,
};

static bool step_is_left_out(const struct drive_cia402 *self,
                             const struct drive_cia402_step *step)
{
    for (unsigned i = 0; i < sizeof step_gates / sizeof step_gates[0]; i++)
        if ((step->need & (unsigned)STEP_IF_COUNTED << i) != 0 &&
            !step_gates[i](self))
            return true;
    if (step->kind == STEP_MATCH && step_is_of_map(step) && self->map_other)
        return true;
    if (step->kind == STEP_WRITE &&
        drive_cia402_fixed(self, step->index, step->sub) != NULL)
        return true;
    return (step->need & STEP_IF_SET) != 0 && step_wish(self, step) == 0;
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
    self->list_since_ns = self->list_due_ns = now_ns;
}

/* Rows that need no answer are done at once; so at most the whole list. */
int drive_cia402_list_step(struct drive_cia402 *self, int64_t now_ns)
{
    while (self->list[self->list_at].kind != STEP_END) {
        const int err = step_do(self, &self->list[self->list_at], now_ns);

        if (err != MOTION_OK)
            return err;
        self->list_at++;
        self->steps++;
        self->list_tries = 0;
        self->list_since_ns = now_ns;
    }
    return MOTION_OK;
}
