/* hal/drive/cia402/walk.c - phases and power states.
 *
 *              list done              ENABLE: 06, 07, preload, 0F
 *   START_UP ------------> RUN: off <-----------------------------> enabled
 *      ^  ^                 |  ^         OFF: 07, 06; QUICK_STOP: 02
 *      |  | boot-up         |  |
 *      |  +--(start anew)   |  | cleared: bit 7 low, high, low
 *      |                    |  |
 *      | request RESET      v  |          request RESET
 *   LOST <------------- LATCHED <-------------------------> RESET
 *        silent, restarted,   drive fault, left operation by itself,
 *        refused              a step of the walk took too long
 *
 * The walk itself is a table: in which power state, for which request, which
 * controlword.  It holds no memory, so whatever the drive does, the next word
 * is right for where it is; only time-outs and the preload are remembered.
 * A latched fault turns the request into a quick stop and forgets that it was
 * to be enabled: nothing switches torque on again but a new request after a
 * reset. */
#include "hal/drive/cia402/parts.h"

#define RESET_LOW_SYNCS 2 /* bit 7 low before it rises */
#define RESET_WORD      0x0080
#define REMOTE          0x0200
#define VOLTAGE         0x0010
#define FAULT_OF_BUS    0x81 /* 0x8110, 0x8120, 0x8130 */
#define LOST_AGAIN_NS   INT64_C(100000000)
#define LAG_NS          INT64_C(100000000) /* of a quick stop behind our ramp */

static const struct {
    uint16_t mask, value;
    const char *text;
} cia402_states[] = {
    [CIA402_NOT_READY] = { 0x4F, 0x00, "not ready to switch on" },
    [CIA402_SWITCH_ON_DISABLED] = { 0x4F, 0x40, "switch on disabled" },
    [CIA402_READY] = { 0x6F, 0x21, "ready to switch on" },
    [CIA402_SWITCHED_ON] = { 0x6F, 0x23, "switched on" },
    [CIA402_OPERATION_ENABLED] = { 0x6F, 0x27, "operation enabled" },
    [CIA402_QUICK_STOP_ACTIVE] = { 0x6F, 0x07, "quick stop active" },
    [CIA402_FAULT_REACTION] = { 0x4F, 0x0F, "fault reaction active" },
    [CIA402_FAULT] = { 0x4F, 0x08, "fault" },
};

enum cia402_state cia402_state_of(uint16_t statusword)
{
    for (int i = CIA402_NOT_READY; i < CIA402_UNKNOWN; i++)
        if ((statusword & cia402_states[i].mask) == cia402_states[i].value)
            return (enum cia402_state)i;
    return CIA402_UNKNOWN;
}

const char *cia402_state_text(enum cia402_state state)
{
    if ((unsigned)state >= CIA402_UNKNOWN)
        return "unknown";
    return cia402_states[state].text;
}

/* Controlword by power state and request: off, enable, quick stop.  From Quick
 * stop active there is no way back to operation that all drives have. */
static const uint8_t drive_cia402_words[][3] = {
    [CIA402_NOT_READY] = { 0x00, 0x00, 0x00 },
    [CIA402_SWITCH_ON_DISABLED] = { 0x00, 0x06, 0x00 },
    [CIA402_READY] = { 0x06, 0x07, 0x02 },
    [CIA402_SWITCHED_ON] = { 0x06, 0x0F, 0x02 },
    [CIA402_OPERATION_ENABLED] = { 0x07, 0x0F, 0x02 },
    [CIA402_QUICK_STOP_ACTIVE] = { 0x00, 0x02, 0x02 },
    [CIA402_FAULT_REACTION] = { 0x00, 0x00, 0x00 },
    [CIA402_FAULT] = { 0x00, 0x00, 0x00 },
    [CIA402_UNKNOWN] = { 0x00, 0x00, 0x00 },
};

bool drive_cia402_is_enabled(const struct drive_cia402 *self)
{
    return self->phase == DRIVE_CIA402_RUN &&
           self->request == HAL_DRIVE_REQUEST_ENABLE &&
           self->state == HAL_DRIVE_ENABLED;
}

bool drive_cia402_is_watched(const struct drive_cia402 *self)
{
    return self->phase == DRIVE_CIA402_RUN ||
           self->phase == DRIVE_CIA402_RESET ||
           self->phase == DRIVE_CIA402_LATCHED;
}

/* Its own ramp begins after ours, and may end after it: torque stays for as
 * long as it brakes.  Where nothing is known of it, for as long as a ramp that
 * began when it was lost may take, and it may lag. */
static bool drive_cia402_still_brakes(const struct drive_cia402 *self)
{
    const int64_t since_ns = self->now_ns - self->walk_since_ns;

    if (self->phase == DRIVE_CIA402_LOST)
        return since_ns <= LAG_NS ||
               self->now_ns - self->lost_ns <= HAL_DRIVE_STOP_NS;
    return !drive_cia402_rests(self) && since_ns <= HAL_DRIVE_STOP_NS;
}

/* Nothing is known of its state: words that every state obeys. */
static uint16_t drive_cia402_lost_word(const struct drive_cia402 *self)
{
    return self->request == HAL_DRIVE_REQUEST_OFF &&
                   !drive_cia402_still_brakes(self)
               ? 0x00
               : 0x02;
}

/* What is latched may move by itself; what moves when it is to be off, 0x605C may
 * let coast: 0x605A brakes. */
static bool drive_cia402_goes_on(const struct drive_cia402 *self)
{
    return self->phase == DRIVE_CIA402_LATCHED ||
           self->phase == DRIVE_CIA402_RESET ||
           (self->request == HAL_DRIVE_REQUEST_OFF &&
            !drive_cia402_rests(self));
}

uint16_t drive_cia402_controlword(const struct drive_cia402 *self)
{
    const enum cia402_state power = drive_cia402_power(self);
    const struct drive_cia402_mode *mode = drive_cia402_mode(self);

    if (self->phase == DRIVE_CIA402_LOST)
        return drive_cia402_lost_word(self);
    if (self->request == HAL_DRIVE_REQUEST_TORQUE_OFF)
        return 0x00;
    if (self->phase == DRIVE_CIA402_RESET && power == CIA402_FAULT)
        return self->reset_cycles >= RESET_LOW_SYNCS ? RESET_WORD : 0;
    /* Also when it is still enabled from an earlier request: the statusword may
     * be older than the word that has ended it. */
    if (self->request == HAL_DRIVE_REQUEST_ENABLE && !self->preloaded &&
        (power == CIA402_SWITCHED_ON || power == CIA402_OPERATION_ENABLED))
        return 0x07;
    if (power == CIA402_OPERATION_ENABLED && drive_cia402_is_enabled(self))
        return drive_cia402_words[power][self->request] |
               mode->ops->mode_word(self);
    if ((power == CIA402_QUICK_STOP_ACTIVE &&
         drive_cia402_still_brakes(self)) ||
        (power == CIA402_OPERATION_ENABLED && drive_cia402_goes_on(self)))
        return drive_cia402_words[power][HAL_DRIVE_REQUEST_QUICK_STOP];
    return drive_cia402_words[power][self->request];
}

void drive_cia402_drop_list(struct drive_cia402 *self)
{
    self->list = NULL;
    self->job = DRIVE_CIA402_NO_JOB;
    canopen_sdo_drop(&self->node);
}

static void drive_cia402_forget_modes(struct drive_cia402 *self)
{
    drive_cia402_modes_reset(self);
    self->mode = self->mode_wanted = HAL_DRIVE_STREAM_POSITION;
    self->mode_known = true;
    self->modes = 1u << (drive_cia402_mode(self)->code - 1);
    self->homing = HAL_DRIVE_HOMING_NONE;
    self->job = DRIVE_CIA402_NO_JOB;
    self->probe = (struct drive_cia402_probe){ .there = false };
    self->speeds_fit = true;
    self->torque_in = self->torque_out = false;
    self->zero_counts = 0;
    self->has_offset = false;
    drive_cia402_forget_reach(self);
    for (unsigned end = 0; end < 2; end++) {
        self->limit_there[end] = false;
        drive_cia402_forget_limit(self, end);
    }
    for (unsigned i = 0; i < 8; i++)
        self->factor[i / 2][i % 2] = 0;
}

void drive_cia402_start_anew(struct drive_cia402 *self, int64_t now_ns)
{
    self->phase = DRIVE_CIA402_START_UP;
    self->state = HAL_DRIVE_OFFLINE;
    self->pdo_ok = false;
    self->is_live = false;
    self->is_configured = false;
    self->was_latched = false;
    self->was_found = false;
    drive_cia402_forget_pdo_ids(self);
    self->fault_code = 0;
    self->emcy_code = 0;
    self->fault_text[0] = '\0';
    self->vendor = 0;
    self->quirk = NULL;
    drive_cia402_settle(self);
    drive_cia402_forget_modes(self);
    drive_cia402_list_begin(self, drive_cia402_start_up, now_ns);
}

static void drive_cia402_run(struct drive_cia402 *self, int64_t now_ns)
{
    self->phase = DRIVE_CIA402_RUN;
    self->state = HAL_DRIVE_OFF;
    self->fault_code = 0;
    self->fault_text[0] = '\0';
    self->walk_state = CIA402_UNKNOWN;
    self->walk_since_ns = now_ns;
    self->preloaded = false;
    self->list = NULL;
    if (!self->mode_known) /* a fault came between */
        drive_cia402_modes_change(self, now_ns);
}

void drive_cia402_reset_begin(struct drive_cia402 *self)
{
    drive_cia402_drop_list(self);
    self->phase = DRIVE_CIA402_RESET;
    self->reset_cycles = 0;
    self->walk_since_ns = self->now_ns;
}

static void drive_cia402_start_up_step(struct drive_cia402 *self,
                                       int64_t now_ns)
{
    int err;

    drive_cia402_search_step(self);
    err = drive_cia402_list_step(self, now_ns);
    if (err == MOTION_OK && self->reset_by_nmt)
        drive_cia402_reset_begin(self);
    else if (err == MOTION_OK)
        drive_cia402_run(self, now_ns);
    else if (err != MOTION_E_AGAIN)
        drive_cia402_lose(self, err == MOTION_E_REFUSED ? HAL_DRIVE_FAULT
                                                        : HAL_DRIVE_OFFLINE);
}

/* Between two readings of the actual position, modulo 2^32. */
static int64_t drive_cia402_apart(int32_t a, int64_t b)
{
    const int32_t apart = (int32_t)((uint32_t)a - (uint32_t)b);

    return apart < 0 ? -(int64_t)apart : apart;
}

static void drive_cia402_preload_step(struct drive_cia402 *self, int64_t now_ns)
{
    int err;

    if (self->list == NULL)
        drive_cia402_list_begin(self, drive_cia402_preload, now_ns);
    err = drive_cia402_list_step(self, now_ns);
    if (err == MOTION_E_AGAIN)
        return;
    if (err == MOTION_OK &&
        drive_cia402_apart(self->preload_counts, self->actual_counts) >
            self->first_step_counts) {
        drive_cia402_say(self, "axis moves while it is being enabled");
        err = MOTION_E_AWAY;
    }
    if (err == MOTION_OK && drive_cia402_is_clamped(self)) {
        drive_cia402_say(self, "moved out of its software limits (0x607D)");
        err = MOTION_E_LIMIT;
    }
    if (err != MOTION_OK) {
        drive_cia402_latch(self);
        return;
    }
    self->list = NULL;
    self->preloaded = true;
    self->target_counts = self->preload_counts;
    self->target_speed_q16 = 0;
    self->target_torque = 0;
    self->walk_since_ns = now_ns;
}

/* Is this where the request ends, or may end? */
static bool drive_cia402_has_arrived(const struct drive_cia402 *self,
                                     enum cia402_state power)
{
    if (self->request == HAL_DRIVE_REQUEST_ENABLE)
        return power == CIA402_OPERATION_ENABLED && self->preloaded;
    if (power == CIA402_QUICK_STOP_ACTIVE)
        return self->request == HAL_DRIVE_REQUEST_QUICK_STOP;
    return power != CIA402_OPERATION_ENABLED && power != CIA402_SWITCHED_ON;
}

/* Long enough for one step; not for a drive that says it does not listen. */
static int64_t drive_cia402_patience_ns(const struct drive_cia402 *self,
                                        enum cia402_state power)
{
    const struct drive_cia402_config *config = &self->config;

    if ((self->statusword & REMOTE) == 0)
        return config->state_timeout_ns >> 2;
    if ((self->statusword & VOLTAGE) == 0)
        return config->precharge_timeout_ns;
    if (power == CIA402_SWITCHED_ON || power == CIA402_OPERATION_ENABLED)
        return config->brake_timeout_ns;
    if (power == CIA402_QUICK_STOP_ACTIVE) /* it may brake for so long */
        return HAL_DRIVE_STOP_NS + config->state_timeout_ns;
    return config->state_timeout_ns;
}

enum hal_drive_state drive_cia402_reported(const struct drive_cia402 *self)
{
    const enum cia402_state power = drive_cia402_power(self);

    if (self->phase != DRIVE_CIA402_RUN)
        return self->state;
    if (self->request == HAL_DRIVE_REQUEST_ENABLE)
        return power == CIA402_OPERATION_ENABLED && self->preloaded
                   ? HAL_DRIVE_ENABLED
                   : HAL_DRIVE_ENABLING;
    if (power == CIA402_OPERATION_ENABLED || power == CIA402_QUICK_STOP_ACTIVE)
        return HAL_DRIVE_QUICK_STOP;
    return HAL_DRIVE_OFF;
}

static void drive_cia402_walk_step(struct drive_cia402 *self,
                                   enum cia402_state power, int64_t now_ns)
{
    const struct drive_cia402_mode *mode;

    if (power != self->walk_state) {
        self->walk_state = power;
        self->walk_since_ns = now_ns;
        self->steps++;
    }
    if (self->job != DRIVE_CIA402_NO_JOB)
        drive_cia402_job_step(self, now_ns);
    else if (power == CIA402_SWITCHED_ON && !self->preloaded &&
             self->request == HAL_DRIVE_REQUEST_ENABLE)
        drive_cia402_preload_step(self, now_ns);
    else if (!drive_cia402_has_arrived(self, power) &&
             now_ns - self->walk_since_ns >
                 drive_cia402_patience_ns(self, power))
        drive_cia402_latch_stuck(self, drive_cia402_patience_ns(self, power));
    if (self->phase != DRIVE_CIA402_RUN)
        return;
    if (drive_cia402_reported(self) == HAL_DRIVE_ENABLED &&
        self->state != HAL_DRIVE_ENABLED)
        self->first_target = true;
    self->state = drive_cia402_reported(self);
    mode = drive_cia402_mode(self);
    if (self->state == HAL_DRIVE_ENABLED)
        mode->ops->mode_step(self, now_ns);
    if (self->phase == DRIVE_CIA402_RUN && self->state == HAL_DRIVE_ENABLED &&
        self->list == NULL)
        drive_cia402_limits_step(self, now_ns);
    if (self->phase != DRIVE_CIA402_RUN || self->list != NULL)
        return;
    if (self->node.sdo.state != CANOPEN_SDO_IDLE && !self->reading_asked)
        drive_cia402_probe_step(self, now_ns); /* its own answer */
    else if (!drive_cia402_readings_step(self, now_ns))
        drive_cia402_probe_step(self, now_ns);
}

static void drive_cia402_run_step(struct drive_cia402 *self, int64_t now_ns)
{
    const enum cia402_state power = drive_cia402_power(self);

    if (power == CIA402_FAULT || power == CIA402_FAULT_REACTION)
        drive_cia402_latch_fault(self);
    else if (drive_cia402_is_enabled(self) && power != CIA402_OPERATION_ENABLED)
        drive_cia402_latch_left(self);
    else
        drive_cia402_walk_step(self, power, now_ns);
}

/* After a lost heartbeat or an error of the bus some drives keep their fault
 * until the communication is reset; then they boot and are set up anew. */
static bool drive_cia402_reset_by_nmt(struct drive_cia402 *self, int64_t now_ns)
{
    if (self->reset_by_nmt || drive_cia402_power(self) != CIA402_FAULT ||
        self->fault_code >> 8 != FAULT_OF_BUS ||
        drive_cia402_holds_sibling(self) ||
        canopen_nmt(self->node.master, CANOPEN_NMT_RESET_COMMUNICATION,
                    self->config.node_id) != MOTION_OK)
        return false;
    self->reset_by_nmt = true;
    drive_cia402_start_node_anew(self, now_ns);
    return true;
}

/* Bit 7 has to rise while the drive is in Fault; anything else that was latched
 * is over once the axis stands without torque. */
static void drive_cia402_reset_step(struct drive_cia402 *self, int64_t now_ns)
{
    const enum cia402_state power = drive_cia402_power(self);
    struct hal_text text;

    if (now_ns - self->walk_since_ns > self->config.state_timeout_ns) {
        if (drive_cia402_reset_by_nmt(self, now_ns))
            return;
        text = drive_cia402_say(self, "not reset, still ");
        hal_text_put(&text, cia402_state_text(power));
        if (self->fault_code != 0) {
            hal_text_put(&text, ", code 0x");
            hal_text_hex(&text, self->fault_code, 4);
        }
        self->phase = DRIVE_CIA402_LATCHED;
    } else if (power == CIA402_FAULT) {
        self->reset_cycles++;
    } else if (power == CIA402_QUICK_STOP_ACTIVE && drive_cia402_stands(self)) {
        self->request = HAL_DRIVE_REQUEST_OFF;
    } else if (power != CIA402_FAULT_REACTION &&
               power != CIA402_OPERATION_ENABLED &&
               power != CIA402_QUICK_STOP_ACTIVE && drive_cia402_stands(self)) {
        self->emcy_code = 0;
        self->request = HAL_DRIVE_REQUEST_OFF;
        drive_cia402_run(self, now_ns);
    }
}

static void drive_cia402_latched_step(struct drive_cia402 *self)
{
    if (drive_cia402_power(self) == CIA402_QUICK_STOP_ACTIVE &&
        drive_cia402_stands(self))
        self->request = HAL_DRIVE_REQUEST_OFF; /* 0x605A = 5 to 8: it holds */
    if (drive_cia402_awaits_code(self))
        drive_cia402_code_step(self);
}

static void drive_cia402_lost_answer(struct drive_cia402 *self, int64_t now_ns)
{
    uint32_t value = 0;
    const int err = canopen_sdo_take(&self->node, &value, NULL);

    if (err == MOTION_E_TIMEOUT) {
        drive_cia402_search_lost(self);
    } else if (self->node.sdo.write &&
               (err == MOTION_OK || err == MOTION_E_REFUSED)) {
        self->lost_word = (uint16_t)self->node.sdo.value;
    } else if (err == MOTION_OK) {
        self->statusword = (uint16_t)value;
        self->status_ns = now_ns;
    }
}

/* It waits for a reset.  It may be enabled all the same: where it takes no PDO
 * (pre-operational, its map not ours) it takes SDOs, so it is told until it has
 * answered: quick stop, and off when that must be over.  Then it is asked what
 * has come of it. */
static void drive_cia402_lost_step(struct drive_cia402 *self, int64_t now_ns)
{
    const uint16_t word = drive_cia402_lost_word(self);
    int err;

    drive_cia402_search_step(self);
    drive_cia402_lost_answer(self, now_ns);
    if (now_ns - self->lost_ns > self->config.brake_timeout_ns)
        self->request = HAL_DRIVE_REQUEST_OFF;
    if (now_ns < self->lost_due_ns)
        return;
    err =
        word == self->lost_word
            ? canopen_sdo_read(&self->node, now_ns,
                               drive_cia402_object(self, 0x6041), 0)
            : canopen_sdo_write(&self->node, now_ns,
                                drive_cia402_object(self, 0x6040), 0, 2, word);
    if (err == MOTION_OK)
        self->lost_due_ns = now_ns + LOST_AGAIN_NS;
}

void drive_cia402_walk(struct drive_cia402 *self, int64_t now_ns)
{
    if (self->phase != DRIVE_CIA402_RUN || self->list != NULL)
        drive_cia402_readings_pause(self, now_ns);
    switch (self->phase) {
    case DRIVE_CIA402_START_UP:
        drive_cia402_start_up_step(self, now_ns);
        break;
    case DRIVE_CIA402_RUN:
        drive_cia402_run_step(self, now_ns);
        break;
    case DRIVE_CIA402_RESET:
        drive_cia402_reset_step(self, now_ns);
        break;
    case DRIVE_CIA402_LATCHED:
        drive_cia402_latched_step(self);
        break;
    case DRIVE_CIA402_LOST:
        drive_cia402_lost_step(self, now_ns);
        break;
    }
}
