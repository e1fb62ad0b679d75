/* hal/drive_cia402_start.c - the lists of SDO steps: start-up and preload.
 *
 * The order is the one that every drive accepts: all in
 * pre-operational; a PDO is switched off, its map emptied, filled, counted, its
 * type set and switched on last; torque is not asked for before the drive has
 * shown that it will stop by itself when it no longer hears us.
 * Source: CiA 301 7.3.1, 7.5.2; CiA 402-2 8. */
#include "hal/drive_cia402_parts.h"

#define COB_OFF        UINT32_C(0x80000000)
#define COB_RPDO1      UINT32_C(0x200)
#define COB_TPDO1      UINT32_C(0x180)
#define COB_TPDO2      UINT32_C(0x280)
#define COB_TPDO3      UINT32_C(0x380)
#define COB_TPDO4      UINT32_C(0x480)
#define EVERY_SYNC     1
#define ON_CHANGE      255
#define MODE_CSP       8
#define DEVICE_PROFILE 402

/* ---- values ---- */

static uint32_t value_fixed(const struct drive_cia402 *self)
{
    return self->list[self->list_at].value;
}

static uint32_t value_heartbeat(const struct drive_cia402 *self)
{
    return self->heartbeat_ms;
}

static uint32_t value_consumer(const struct drive_cia402 *self)
{
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
    return self->config.parameter[self->parameter_at >> 1].value;
}

/* A PDO's COB-ID is the row's value plus the node id. */
static uint32_t value_cob(const struct drive_cia402 *self)
{
    return self->list[self->list_at].value + self->config.node_id;
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

static int check_modes(struct drive_cia402 *self, uint32_t value)
{
    struct hal_text text;

    if ((value >> (MODE_CSP - 1) & 1) != 0)
        return MOTION_OK;
    text = drive_cia402_say(self, "no cyclic position mode: 0x6502 is 0x");
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
    (void)self;
    return value == MODE_CSP ? MOTION_OK : MOTION_E_AGAIN;
}

static int check_error_code(struct drive_cia402 *self, uint32_t value)
{
    self->emcy_code = (uint16_t)value;
    return MOTION_OK;
}

static int check_inputs(struct drive_cia402 *self, uint32_t value)
{
    self->inputs = value;
    return MOTION_OK;
}

static int check_actual(struct drive_cia402 *self, uint32_t value)
{
    self->preload_counts = (int32_t)value;
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
    text = drive_cia402_say(self,
                            "0x607A is not at the actual position: off by 0x");
    hal_text_hex(&text, (uint32_t)off, 8);
    return MOTION_E_REFUSED;
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

/* Called by drive_cia402_list.c. */
uint32_t (*const drive_cia402_values[])(const struct drive_cia402 *self) = {
    [VALUE_FIXED] = value_fixed,
    [VALUE_COB] = value_cob,
    [VALUE_HEARTBEAT] = value_heartbeat,
    [VALUE_CONSUMER] = value_consumer,
    [VALUE_SYNC_US] = value_sync_us,
    [VALUE_INTERPOLATION_COUNT] = value_interpolation_count,
    [VALUE_INTERPOLATION_EXPONENT] = value_interpolation_exponent,
    [VALUE_FOLLOWING] = value_following,
    [VALUE_QUICK_STOP] = value_quick_stop,
    [VALUE_PRELOAD] = value_preload,
    [VALUE_PARAMETER] = value_parameter,
};
int (*const drive_cia402_checks[])(struct drive_cia402 *self,
                                   uint32_t value) = {
    [CHECK_NOTHING] = check_nothing,
    [CHECK_DEVICE] = check_device,
    [CHECK_MODES] = check_modes,
    [CHECK_PRE_OPERATIONAL] = check_pre_operational,
    [CHECK_MODE] = check_mode,
    [CHECK_ERROR_CODE] = check_error_code,
    [CHECK_INPUTS] = check_inputs,
    [CHECK_ACTUAL] = check_actual,
    [CHECK_PRELOAD] = check_preload,
    [CHECK_PDO_OURS] = check_pdo_ours,
    [CHECK_LIVE] = check_live,
};

/* ---- the lists ---- */

/* clang-format off */
#define READ(need, index, sub, check) \
    { STEP_READ, need, index, sub, 0, 0, VALUE_FIXED, check }
#define WRITE(need, index, sub, size, value) \
    { STEP_WRITE, need, index, sub, size, value, VALUE_FIXED, CHECK_NOTHING }
#define WRITE_OF(need, index, sub, size, value_of) \
    { STEP_WRITE, need, index, sub, size, 0, value_of, CHECK_NOTHING }
#define COMPARE(need, index, sub, size, value) \
    { STEP_COMPARE, need, index, sub, size, value, VALUE_FIXED, CHECK_NOTHING }
#define COMPARE_OF(need, index, sub, size, value_of) \
    { STEP_COMPARE, need, index, sub, size, 0, value_of, CHECK_NOTHING }
#define COB(kind, need, index, value) \
    { kind, need, index, 1, 4, value, VALUE_COB, CHECK_NOTHING }
#define NMT(command) \
    { STEP_NMT, STEP_NEEDED, 0, 0, 0, command, VALUE_FIXED, CHECK_NOTHING }
#define UNTIL(check) \
    { STEP_UNTIL, STEP_NEEDED, 0, 0, 0, 0, VALUE_FIXED, check }
#define PARAMETERS \
    { STEP_PARAMETERS, STEP_NEEDED, 0, 0, 0, 0, VALUE_FIXED, CHECK_NOTHING }
#define END \
    { STEP_END, STEP_NEEDED, 0, 0, 0, 0, VALUE_FIXED, CHECK_NOTHING }

const struct drive_cia402_step drive_cia402_start_up[] = {
    READ(STEP_FOREVER, 0x1000, 0, CHECK_DEVICE),
    NMT(CANOPEN_NMT_PRE_OPERATIONAL),
    /* A drive that an earlier master left enabled ramps down now. */
    WRITE(STEP_NEEDED, 0x6040, 0, 2, 0x02),
    READ(STEP_IF_THERE, 0x6502, 0, CHECK_MODES),
    /* Heartbeat both ways; what the drive does when ours is gone. */
    WRITE_OF(STEP_NEEDED, 0x1017, 0, 2, VALUE_HEARTBEAT),
    COMPARE_OF(STEP_NEEDED, 0x1017, 0, 2, VALUE_HEARTBEAT),
    UNTIL(CHECK_PRE_OPERATIONAL),
    WRITE_OF(STEP_NEEDED, 0x1016, 1, 4, VALUE_CONSUMER),
    COMPARE_OF(STEP_NEEDED, 0x1016, 1, 4, VALUE_CONSUMER),
    WRITE(STEP_NEEDED, 0x6007, 0, 2, 3),
    COMPARE(STEP_NEEDED, 0x6007, 0, 2, 3),
    /* SYNC period, for the drive's watch and for its interpolation. */
    WRITE_OF(STEP_IF_THERE | STEP_IF_SET, 0x1006, 0, 4, VALUE_SYNC_US),
    WRITE_OF(STEP_IF_THERE, 0x60C2, 1, 1, VALUE_INTERPOLATION_COUNT),
    WRITE_OF(STEP_IF_THERE, 0x60C2, 2, 1, VALUE_INTERPOLATION_EXPONENT),
    COMPARE_OF(STEP_IF_THERE, 0x60C2, 1, 1, VALUE_INTERPOLATION_COUNT),
    COMPARE_OF(STEP_IF_THERE, 0x60C2, 2, 1, VALUE_INTERPOLATION_EXPONENT),
    /* Limits. */
    WRITE_OF(STEP_IF_SET, 0x6065, 0, 4, VALUE_FOLLOWING),
    COMPARE_OF(STEP_IF_SET, 0x6065, 0, 4, VALUE_FOLLOWING),
    WRITE_OF(STEP_IF_SET, 0x6085, 0, 4, VALUE_QUICK_STOP),
    COMPARE_OF(STEP_IF_SET, 0x6085, 0, 4, VALUE_QUICK_STOP),
    /* What the user sets. */
    PARAMETERS,
    /* RPDO1: controlword, target position. */
    COB(STEP_WRITE, STEP_NEEDED, 0x1400, COB_OFF | COB_RPDO1),
    WRITE(STEP_NEEDED, 0x1600, 0, 1, 0),
    WRITE(STEP_NEEDED, 0x1600, 1, 4, 0x60400010),
    WRITE(STEP_NEEDED, 0x1600, 2, 4, 0x607A0020),
    WRITE(STEP_NEEDED, 0x1600, 0, 1, 2),
    WRITE(STEP_NEEDED, 0x1400, 2, 1, EVERY_SYNC),
    COB(STEP_WRITE, STEP_NEEDED, 0x1400, COB_RPDO1),
    COMPARE(STEP_NEEDED, 0x1600, 0, 1, 2),
    COMPARE(STEP_NEEDED, 0x1600, 1, 4, 0x60400010),
    COMPARE(STEP_NEEDED, 0x1600, 2, 4, 0x607A0020),
    COMPARE(STEP_NEEDED, 0x1400, 2, 1, EVERY_SYNC),
    COB(STEP_COMPARE, STEP_NEEDED, 0x1400, COB_RPDO1),
    /* TPDO1: statusword, actual position. */
    COB(STEP_WRITE, STEP_NEEDED, 0x1800, COB_OFF | COB_TPDO1),
    WRITE(STEP_NEEDED, 0x1A00, 0, 1, 0),
    WRITE(STEP_NEEDED, 0x1A00, 1, 4, 0x60410010),
    WRITE(STEP_NEEDED, 0x1A00, 2, 4, 0x60640020),
    WRITE(STEP_NEEDED, 0x1A00, 0, 1, 2),
    WRITE(STEP_NEEDED, 0x1800, 2, 1, EVERY_SYNC),
    WRITE(STEP_IF_THERE, 0x1800, 3, 2, 0),
    WRITE(STEP_IF_THERE, 0x1800, 5, 2, 0),
    COB(STEP_WRITE, STEP_NEEDED, 0x1800, COB_TPDO1),
    COMPARE(STEP_NEEDED, 0x1A00, 0, 1, 2),
    COMPARE(STEP_NEEDED, 0x1A00, 1, 4, 0x60410010),
    COMPARE(STEP_NEEDED, 0x1A00, 2, 4, 0x60640020),
    COMPARE(STEP_NEEDED, 0x1800, 2, 1, EVERY_SYNC),
    COB(STEP_COMPARE, STEP_NEEDED, 0x1800, COB_TPDO1),
    /* TPDO2: switches, when one changes, at most every 5 ms. */
    COB(STEP_WRITE, STEP_SWITCHES, 0x1801, COB_OFF | COB_TPDO2),
    WRITE(STEP_SWITCHES, 0x1A01, 0, 1, 0),
    WRITE(STEP_SWITCHES, 0x1A01, 1, 4, 0x60FD0020),
    WRITE(STEP_SWITCHES, 0x1A01, 0, 1, 1),
    WRITE(STEP_SWITCHES, 0x1801, 2, 1, ON_CHANGE),
    WRITE(STEP_SWITCHES, 0x1801, 3, 2, 50),
    COB(STEP_WRITE, STEP_SWITCHES, 0x1801, COB_TPDO2),
    /* The rest of its default chatter is off. */
    COB(STEP_WRITE, STEP_IF_THERE, 0x1802, COB_OFF | COB_TPDO3),
    COB(STEP_WRITE, STEP_IF_THERE, 0x1803, COB_OFF | COB_TPDO4),
    READ(STEP_IF_THERE, 0x603F, 0, CHECK_ERROR_CODE),
    READ(STEP_IF_THERE, 0x60FD, 0, CHECK_INPUTS),
    WRITE(STEP_NEEDED, 0x6060, 0, 1, MODE_CSP),
    READ(STEP_NEEDED, 0x6061, 0, CHECK_MODE),
    READ(STEP_NEEDED, 0x6064, 0, CHECK_ACTUAL),
    WRITE_OF(STEP_NEEDED, 0x607A, 0, 4, VALUE_PRELOAD),
    READ(STEP_NEEDED, 0x607A, 0, CHECK_PRELOAD),
    UNTIL(CHECK_PDO_OURS),
    NMT(CANOPEN_NMT_START),
    UNTIL(CHECK_LIVE),
    END,
};

/* Between Switched on and Operation enabled. */
const struct drive_cia402_step drive_cia402_preload[] = {
    READ(STEP_NEEDED, 0x6064, 0, CHECK_ACTUAL),
    WRITE_OF(STEP_NEEDED, 0x607A, 0, 4, VALUE_PRELOAD),
    READ(STEP_NEEDED, 0x607A, 0, CHECK_PRELOAD),
    END,
};
/* clang-format on */
