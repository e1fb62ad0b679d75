/* hal/drive/cia402/values.c - what the lists of SDO steps write, and what they
 * do with what they read: two tables. */
#include "hal/drive/cia402/parts.h"

#include "hal/support/quotient.h"
#include "motion/core/fixed.h"

#define SYNC_PRODUCED  UINT32_C(0x40000000)
#define DEVICE_PROFILE 402
#define INHIBIT_NS     100000 /* unit of 0x1800:3 */
#define QUICK_STOP     0x605A

/* ---- values ---- */

static uint32_t value_fixed(const struct drive_cia402 *self)
{
    return self->list[self->list_at].value;
}

/* The axis's object of the same kind. */
static uint32_t value_entry_of(const struct drive_cia402 *self, uint32_t entry)
{
    return (uint32_t)drive_cia402_object(self, (uint16_t)(entry >> 16)) << 16 |
           (entry & 0xFFFF);
}

static uint32_t value_entry(const struct drive_cia402 *self)
{
    return value_entry_of(self, self->list[self->list_at].value);
}

static uint32_t value_heartbeat(const struct drive_cia402 *self)
{
    return self->guard_ms > 0 ? 0 : self->heartbeat_ms;
}

static uint32_t value_consumer(const struct drive_cia402 *self)
{
    if (self->guard_ms > 0)
        return 0;
    return (uint32_t)self->node.master->config.node_id << 16 |
           self->watchdog_ms;
}

static uint32_t value_sync_us(const struct drive_cia402 *self)
{
    return self->sync_us;
}

static uint32_t value_interpolation_count(const struct drive_cia402 *self)
{
    return self->interpolation_count;
}

static uint32_t value_interpolation_exponent(const struct drive_cia402 *self)
{
    return (uint8_t)self->interpolation_exponent;
}

static uint32_t value_following(const struct drive_cia402 *self)
{
    return self->config.following_error_counts;
}

static uint32_t value_quick_stop(const struct drive_cia402 *self)
{
    return self->config.quick_stop_counts_s2;
}

static uint32_t value_preload(const struct drive_cia402 *self)
{
    return (uint32_t)self->preload_counts;
}

static uint32_t value_parameter(const struct drive_cia402 *self)
{
    struct drive_cia402_parameter parameter = { .value = 0 };

    (void)drive_cia402_parameter(self, self->parameter_at >> 1, &parameter);
    return parameter.value;
}

static uint32_t value_mode(const struct drive_cia402 *self)
{
    return (uint8_t)drive_cia402_mode_wanted(self)->code;
}

static uint32_t value_sync_overflow(const struct drive_cia402 *self)
{
    return self->node.master->config.sync_overflow;
}

static uint32_t value_guard_time(const struct drive_cia402 *self)
{
    return self->guard_ms;
}

static uint32_t value_life_factor(const struct drive_cia402 *self)
{
    return self->guard_ms > 0 ? self->life_factor : 0;
}

/* The row's index says which. */
static uint32_t value_option(const struct drive_cia402 *self)
{
    const unsigned option = self->list[self->list_at].index - 0x605Au;

    return (uint32_t)(uint16_t)self->config.option[option].value;
}

static uint32_t value_following_time(const struct drive_cia402 *self)
{
    return self->config.following_error_ms;
}

static uint32_t value_limit(const struct drive_cia402 *self)
{
    return (uint32_t)drive_cia402_limit(self,
                                        self->list[self->list_at].sub - 1u);
}

static uint32_t value_target_entry(const struct drive_cia402 *self)
{
    return value_entry_of(
        self, self->config.stream == DRIVE_CIA402_IP ? 0x60C10120 : 0x607A0020);
}

static uint32_t value_torque_out_entry(const struct drive_cia402 *self)
{
    return self->torque_out ? value_entry_of(self, 0x60B20010) : 0;
}

static uint32_t value_torque_in_entry(const struct drive_cia402 *self)
{
    return self->torque_in ? value_entry_of(self, 0x60770010) : 0;
}

static uint32_t value_rpdo1_count(const struct drive_cia402 *self)
{
    return self->torque_out ? 3 : 2;
}

static uint32_t value_tpdo1_count(const struct drive_cia402 *self)
{
    return self->torque_in ? 3 : 2;
}

static uint32_t value_go_target(const struct drive_cia402 *self)
{
    return (uint32_t)self->go.target_counts;
}

static uint32_t value_go_speed(const struct drive_cia402 *self)
{
    return (uint32_t)self->go.speed;
}

static uint32_t value_go_velocity(const struct drive_cia402 *self)
{
    return self->go.vel;
}

static uint32_t value_go_acceleration(const struct drive_cia402 *self)
{
    return self->go.acc;
}

static uint32_t value_go_deceleration(const struct drive_cia402 *self)
{
    return self->go.dec;
}

static uint32_t value_home_method(const struct drive_cia402 *self)
{
    return (uint8_t)self->home.method;
}

static uint32_t value_home_fast(const struct drive_cia402 *self)
{
    return self->home.fast;
}

static uint32_t value_home_slow(const struct drive_cia402 *self)
{
    return self->home.slow;
}

static uint32_t value_home_acceleration(const struct drive_cia402 *self)
{
    return self->home.acc;
}

/* Bit 30 as it was. */
static uint32_t value_cob(const struct drive_cia402 *self)
{
    const uint32_t own = drive_cia402_own_pdo_id(self);
    const uint32_t predefined =
        self->list[self->list_at].value + self->config.node_id;

    return (own != 0 ? own : predefined) |
           (self->cob & DRIVE_CIA402_COB_NO_RTR);
}

static uint32_t value_cob_off(const struct drive_cia402 *self)
{
    return self->cob | DRIVE_CIA402_COB_OFF;
}

/* ---- checks ---- */

static int check_nothing(struct drive_cia402 *self, uint32_t value)
{
    (void)self;
    (void)value;
    return MOTION_OK;
}

static int check_device(struct drive_cia402 *self, uint32_t value)
{
    struct hal_text text;

    if ((value & 0xFFFF) == DEVICE_PROFILE) {
        self->fault_text[0] = '\0'; /* "does not answer" is over */
        return MOTION_OK;
    }
    text = drive_cia402_say(self, "not a CiA 402 drive: device type 0x");
    hal_text_hex(&text, value, 8);
    return MOTION_E_REFUSED;
}

static int check_vendor(struct drive_cia402 *self, uint32_t value)
{
    self->vendor = value;
    return MOTION_OK;
}

static int check_modes(struct drive_cia402 *self, uint32_t value)
{
    static const char *const name[] = {
        [DRIVE_CIA402_CSP] = "no cyclic position mode: 0x6502 is 0x",
        [DRIVE_CIA402_IP] = "no interpolated position: 0x6502 is 0x",
        [DRIVE_CIA402_CSV] = "no cyclic velocity mode: 0x6502 is 0x",
    };
    const int8_t code = drive_cia402_mode_wanted(self)->code;
    struct hal_text text;

    self->modes = value | self->config.modes_also;
    if ((self->modes >> (code - 1) & 1) != 0)
        return MOTION_OK;
    text = drive_cia402_say(self, name[self->config.stream]);
    hal_text_hex(&text, value, 8);
    return MOTION_E_REFUSED;
}

static int check_pre_operational(struct drive_cia402 *self, uint32_t value)
{
    (void)value;
    return self->node.nmt_state == CANOPEN_NMT_PRE_OPERATIONAL_STATE
               ? MOTION_OK
               : MOTION_E_AGAIN;
}

static int check_mode(struct drive_cia402 *self, uint32_t value)
{
    return value == value_mode(self) ? MOTION_OK : MOTION_E_AGAIN;
}

/* Two on a bus tear every cycle apart. */
static int check_sync(struct drive_cia402 *self, uint32_t value)
{
    struct hal_text text;

    if ((value & SYNC_PRODUCED) == 0)
        return MOTION_OK;
    text = drive_cia402_say(self, "0x1005:00 is 0x");
    hal_text_hex(&text, value, 8);
    hal_text_put(&text, ": the drive sends SYNC itself");
    return MOTION_E_REFUSED;
}

static int check_error_code(struct drive_cia402 *self, uint32_t value)
{
    self->emcy_code = (uint16_t)value;
    self->emcy_ns = self->now_ns;
    return MOTION_OK;
}

static int check_inputs(struct drive_cia402 *self, uint32_t value)
{
    self->inputs = value;
    return MOTION_OK;
}

/* While the mode changes the image of RPDO1 is that, too, but where set points
 * hold the axis. */
static int check_actual(struct drive_cia402 *self, uint32_t value)
{
    self->preload_counts = (int32_t)value;
    if (self->job == DRIVE_CIA402_JOB_MODE &&
        !drive_cia402_mode(self)->streams) {
        self->target_counts = self->preload_counts;
        self->target_ns = 0;
    }
    return MOTION_OK;
}

/* Between writing the target and reading it back the axis, and with it our
 * RPDO, may have moved a little. */
static int check_preload(struct drive_cia402 *self, uint32_t value)
{
    const int32_t off =
        (int32_t)(value - (uint32_t)self->preload_counts); /* modulo 2^32 */
    struct hal_text text;

    if (off <= self->first_step_counts && off >= -self->first_step_counts)
        return MOTION_OK;
    text = drive_cia402_say(self, "0x");
    hal_text_hex(&text,
                 drive_cia402_object(self, self->list[self->list_at].index), 4);
    hal_text_put(&text, " is not at the actual position: off by 0x");
    hal_text_hex(&text, (uint32_t)off, 8);
    return MOTION_E_REFUSED;
}

static int check_factor(struct drive_cia402 *self, uint32_t value)
{
    return drive_cia402_note_factor(self, value);
}

static int check_factors(struct drive_cia402 *self, uint32_t value)
{
    (void)value;
    return drive_cia402_check_factors(self);
}

static int check_probe(struct drive_cia402 *self, uint32_t value)
{
    (void)value;
    self->probe.there = true;
    return MOTION_OK;
}

static int check_torque_out(struct drive_cia402 *self, uint32_t value)
{
    (void)value;
    self->torque_out = true;
    return MOTION_OK;
}

static int check_torque_in(struct drive_cia402 *self, uint32_t value)
{
    (void)value;
    self->torque_in = true;
    return MOTION_OK;
}

/* From here on TPDO1 is what we mapped. */
static int check_pdo_ours(struct drive_cia402 *self, uint32_t value)
{
    (void)value;
    self->pdo_ok = true;
    self->is_live = false;
    return MOTION_OK;
}

static int check_live(struct drive_cia402 *self, uint32_t value)
{
    (void)value;
    return self->node.nmt_state == CANOPEN_NMT_OPERATIONAL && self->is_live
               ? MOTION_OK
               : MOTION_E_AGAIN;
}

static int check_cob(struct drive_cia402 *self, uint32_t value)
{
    self->cob = value;
    self->cob_turned = false;
    return MOTION_OK;
}

/* Of a PDO that is used: what is right already is not written, since it may be
 * fixed.  Its map and type are asked next. */
static int check_pdo(struct drive_cia402 *self, uint32_t value)
{
    const struct drive_cia402_step *step = &self->list[self->list_at];

    if (drive_cia402_check_pdo_id(self, value) != MOTION_OK) {
        if ((step->need & STEP_SWITCHES) == 0 || self->config.inputs ||
            (value & DRIVE_CIA402_COB_OFF) == 0)
            return MOTION_E_REFUSED;
        drive_cia402_skip_switches(self);
        return MOTION_OK;
    }
    self->pdo_other =
        ((value ^ value_cob(self)) & ~DRIVE_CIA402_COB_NO_RTR) != 0;
    self->map_other = false;
    return check_cob(self, value);
}

/* "0x605A:00 is 0x00000007" and what that does. */
static int check_refuse(struct drive_cia402 *self, uint32_t value,
                        const char *words)
{
    const struct drive_cia402_step *step = &self->list[self->list_at];
    struct hal_text text = drive_cia402_say(self, "0x");

    hal_text_hex(&text, drive_cia402_object(self, step->index), 4);
    hal_text_put(&text, ":");
    hal_text_hex(&text, step->sub, 2);
    hal_text_put(&text, " is 0x");
    hal_text_hex(&text, value, 8);
    hal_text_put(&text, words);
    return MOTION_E_REFUSED;
}

/* One of the two alone: what the other is then nobody can say. */
static int limit_is_alone(struct drive_cia402 *self, unsigned end)
{
    drive_cia402_say(self, end == 0 ? "0x607D:01 is there, 0x607D:02 is not"
                                    : "0x607D:02 is there, 0x607D:01 is not");
    return MOTION_E_REFUSED;
}

/* It has them, and these. */
static int check_limit(struct drive_cia402 *self, uint32_t value)
{
    const unsigned end = self->list[self->list_at].sub - 1u;

    if (end == 1 && !self->limit_there[0])
        return limit_is_alone(self, 1);
    if (drive_cia402_note_limit(self, end, (int32_t)value))
        return MOTION_OK;
    return check_refuse(self, value, ", not what was written");
}

/* TPDO1 answers every SYNC. */
static int check_inhibit(struct drive_cia402 *self, uint32_t value)
{
    if ((int64_t)(value & 0xFFFF) * INHIBIT_NS < self->config.sync_period_ns)
        return MOTION_OK;
    return check_refuse(self, value, ", TPDO1 would leave out SYNCs");
}

static int check_option(struct drive_cia402 *self, uint32_t value)
{
    self->option = (int16_t)(uint16_t)value;
    return MOTION_OK;
}

static bool option_is_given(const struct drive_cia402 *self)
{
    return self->config.option[self->list[self->list_at].index - 0x605Au].given;
}

/* 2 brakes by 0x6085, then switches off; what the rig says is its own. */
bool drive_cia402_option_is_unsafe(const struct drive_cia402 *self)
{
    if (option_is_given(self))
        return false;
    return self->list[self->list_at].index == QUICK_STOP ? self->option != 2
                                                         : self->option == 0;
}

/* 1 to 4 brake and switch off; 5 to 8 hold, also when nobody is there to switch
 * off: if the rig says so. */
static int check_brakes(struct drive_cia402 *self, uint32_t value)
{
    const int32_t option = (int16_t)(uint16_t)value;
    const bool quick = self->list[self->list_at].index == QUICK_STOP;

    if (option == 0)
        return check_refuse(self, value,
                            quick ? ", a quick stop would coast"
                                  : ", a halt would coast");
    if (quick && (option > 4 || option < 0) && !option_is_given(self))
        return check_refuse(self, value,
                            ", torque would stay after a quick stop");
    return MOTION_OK;
}

/* ---- one that is found with its stage on ---- */

#define SPEED_NS                                                               \
    INT64_C(5000000) /* between two readings of its place, at least */

static int check_stage(struct drive_cia402 *self, uint32_t value)
{
    const enum cia402_state power = cia402_state_of((uint16_t)value);

    self->was_found = power == CIA402_OPERATION_ENABLED ||
                      power == CIA402_QUICK_STOP_ACTIVE ||
                      power == CIA402_FAULT_REACTION;
    if (self->was_found) {
        self->found.count++;
        self->found.vel_q32 = 0;
        self->found.goes_on = false;
    }
    return MOTION_OK;
}

static int check_place(struct drive_cia402 *self, uint32_t value)
{
    self->actual_counts = (int32_t)value;
    hal_standstill_begin(&self->standstill, self->actual_counts, self->now_ns);
    return MOTION_OK;
}

static int check_speed(struct drive_cia402 *self, uint32_t value)
{
    const int32_t delta = (int32_t)(value - (uint32_t)self->actual_counts);
    const int64_t dt_ns = self->now_ns - self->standstill.since_ns;

    if (dt_ns < SPEED_NS)
        return MOTION_E_AGAIN;
    (void)motion_fixed_mulshift(hal_ratio_scale(&self->to_pos, delta),
                                hal_per_second_q20(dt_ns), 20,
                                &self->found.vel_q32);
    return check_place(self, value);
}

static int check_stands(struct drive_cia402 *self, uint32_t value)
{
    const int32_t delta = (int32_t)(value - (uint32_t)self->actual_counts);

    self->actual_counts += delta;
    hal_standstill_note(&self->standstill, self->actual_counts,
                        self->near_counts, self->now_ns);
    if (hal_standstill_is(&self->standstill, self->now_ns))
        return MOTION_OK;
    self->found.goes_on =
        self->now_ns - self->list_since_ns > HAL_DRIVE_STOP_NS;
    return self->found.goes_on ? MOTION_OK : MOTION_E_AGAIN;
}

static int check_offset(struct drive_cia402 *self, uint32_t value)
{
    self->has_offset = value != 0;
    return MOTION_OK;
}

/* After its homing: by the home point, which is its zero. */
static int check_home(struct drive_cia402 *self, uint32_t value)
{
    const int32_t counts = (int32_t)value;

    if (counts > self->home.off_max_counts ||
        counts < -self->home.off_max_counts)
        return check_refuse(self, value, " after homing, not near 0");
    self->preload_counts = counts;
    self->zero_counts = self->home.zero_counts;
    self->has_offset = false;
    return MOTION_OK;
}

int drive_cia402_missing(struct drive_cia402 *self,
                         enum drive_cia402_check check)
{
    if (check == CHECK_LIMIT && self->limit_there[0])
        return limit_is_alone(self, 0);
    if (check == CHECK_PRODUCT)
        return drive_cia402_identify(self, 0);
    if (check == CHECK_COB)
        self->cob = DRIVE_CIA402_COB_OFF;
    if (check == CHECK_OPTION)
        self->option = 2;
    if (check == CHECK_OFFSET)
        self->has_offset = false;
    if (check == CHECK_REACH)
        drive_cia402_forget_reach(self);
    return MOTION_OK;
}

/* Called by list.c. */
uint32_t (*const drive_cia402_values[])(const struct drive_cia402 *self) = {
    [VALUE_FIXED] = value_fixed,
    [VALUE_ENTRY] = value_entry,
    [VALUE_COB] = value_cob,
    [VALUE_COB_OFF] = value_cob_off,
    [VALUE_HEARTBEAT] = value_heartbeat,
    [VALUE_CONSUMER] = value_consumer,
    [VALUE_SYNC_US] = value_sync_us,
    [VALUE_INTERPOLATION_COUNT] = value_interpolation_count,
    [VALUE_INTERPOLATION_EXPONENT] = value_interpolation_exponent,
    [VALUE_FOLLOWING] = value_following,
    [VALUE_QUICK_STOP] = value_quick_stop,
    [VALUE_PRELOAD] = value_preload,
    [VALUE_PARAMETER] = value_parameter,
    [VALUE_MODE] = value_mode,
    [VALUE_SYNC_OVERFLOW] = value_sync_overflow,
    [VALUE_GUARD_TIME] = value_guard_time,
    [VALUE_LIFE_FACTOR] = value_life_factor,
    [VALUE_OPTION] = value_option,
    [VALUE_FOLLOWING_TIME] = value_following_time,
    [VALUE_LIMIT] = value_limit,
    [VALUE_TARGET_ENTRY] = value_target_entry,
    [VALUE_TORQUE_OUT_ENTRY] = value_torque_out_entry,
    [VALUE_TORQUE_IN_ENTRY] = value_torque_in_entry,
    [VALUE_RPDO1_COUNT] = value_rpdo1_count,
    [VALUE_TPDO1_COUNT] = value_tpdo1_count,
    [VALUE_GO_TARGET] = value_go_target,
    [VALUE_GO_SPEED] = value_go_speed,
    [VALUE_GO_VELOCITY] = value_go_velocity,
    [VALUE_GO_ACCELERATION] = value_go_acceleration,
    [VALUE_GO_DECELERATION] = value_go_deceleration,
    [VALUE_HOME_METHOD] = value_home_method,
    [VALUE_HOME_FAST] = value_home_fast,
    [VALUE_HOME_SLOW] = value_home_slow,
    [VALUE_HOME_ACCELERATION] = value_home_acceleration,
};
int (*const drive_cia402_checks[])(struct drive_cia402 *self,
                                   uint32_t value) = {
    [CHECK_NOTHING] = check_nothing,
    [CHECK_DEVICE] = check_device,
    [CHECK_VENDOR] = check_vendor,
    [CHECK_PRODUCT] = drive_cia402_identify,
    [CHECK_MODES] = check_modes,
    [CHECK_PRE_OPERATIONAL] = check_pre_operational,
    [CHECK_MODE] = check_mode,
    [CHECK_ERROR_CODE] = check_error_code,
    [CHECK_INPUTS] = check_inputs,
    [CHECK_ACTUAL] = check_actual,
    [CHECK_PRELOAD] = check_preload,
    [CHECK_PDO_OURS] = check_pdo_ours,
    [CHECK_SIBLINGS] = drive_cia402_check_siblings,
    [CHECK_LIVE] = check_live,
    [CHECK_FACTOR] = check_factor,
    [CHECK_FACTORS] = check_factors,
    [CHECK_PROBE] = check_probe,
    [CHECK_LIMIT] = check_limit,
    [CHECK_TORQUE_OUT] = check_torque_out,
    [CHECK_TORQUE_IN] = check_torque_in,
    [CHECK_COB] = check_cob,
    [CHECK_PDO] = check_pdo,
    [CHECK_INHIBIT] = check_inhibit,
    [CHECK_OPTION] = check_option,
    [CHECK_BRAKES] = check_brakes,
    [CHECK_OFFSET] = check_offset,
    [CHECK_HOME] = check_home,
    [CHECK_STAGE] = check_stage,
    [CHECK_PLACE] = check_place,
    [CHECK_SPEED] = check_speed,
    [CHECK_STANDS] = check_stands,
    [CHECK_REACH] = drive_cia402_note_reach,
    [CHECK_SYNC] = check_sync,
};
