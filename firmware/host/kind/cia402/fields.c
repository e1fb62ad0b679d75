/* firmware/host/kind/cia402/fields.c - what only a CiA 402 drive has: how set
 * points go to it, its units, option codes, guarding. */
#include "firmware/host/kind/cia402/parts.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"

const char *const rig_cia402_modes[RIG_CIA402_MODES] = {
    [DRIVE_CIA402_CSP] = "csp",
    [DRIVE_CIA402_IP] = "ip",
    [DRIVE_CIA402_CSV] = "csv",
};

int rig_read_cia402_mode(void *reader, const struct yaml_value *value,
                         void *out)
{
    unsigned index;
    (void)reader;
    if (yaml_value_choice(value, rig_cia402_modes, RIG_CIA402_MODES, &index) <
        0)
        return -1;
    ((struct rig_cia402 *)out)->stream = (enum drive_cia402_stream)index;
    ((struct rig_cia402 *)out)->stream_given = true;
    return 0;
}

int rig_read_cia402_bandwidth(void *reader, const struct yaml_value *value,
                              void *out)
{
    const struct rig_axis *axis = ((struct rig_reader *)reader)->axis;
    char quote[YAML_QUOTE_MAX];
    int64_t mrad_s;

    if (axis->cia402.stream != DRIVE_CIA402_CSV)
        return yaml_value_refuse(value, "is given without mode: csv");
    if (rig_read_positive(reader, value, UNITS_FREQUENCY, &mrad_s) < 0)
        return -1;
    if (mrad_s < 628 || mrad_s > 314160)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    *(int64_t *)out = (mrad_s << 16) / 1000;
    return 0;
}

/* The limits are known by now. */
int rig_read_cia402_torque(void *reader, const struct yaml_value *value,
                           void *out)
{
    const struct rig_axis *axis = ((struct rig_reader *)reader)->axis;
    char quote[YAML_QUOTE_MAX];
    int64_t ratio_q32;

    if (rig_read_quantity(reader, value, UNITS_RATIO, &ratio_q32) < 0)
        return -1;
    if (ratio_q32 < 0 || ratio_q32 > 3 * MOTION_FIXED_ONE_Q32 ||
        motion_fixed_muldiv(ratio_q32, INT64_C(1000) << 32, axis->limit.acc_q32,
                            out) != MOTION_OK)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    ((struct rig_reader *)reader)->axis->cia402.torque = true;
    return 0;
}

/* 0x60B2 has 16 bits of permille, and a stop takes more than the limits do. */
int rig_check_cia402_torque(const struct yaml_value *value,
                            const struct rig_axis *axis)
{
    int64_t permille;

    if (axis->torque_q32 == 0 ||
        (motion_fixed_mulshift(axis->stop_acc_q32, axis->torque_q32, 64,
                               &permille) == MOTION_OK &&
         permille <= INT16_MAX))
        return 0;
    return yaml_value_refuse(value, "takes more torque at its stop "
                                    "acceleration than the 16 bits of its "
                                    "drive's torque feed-forward (0x60B2) can "
                                    "say, 32.767 times the rated one");
}

int rig_read_cia402_revolution(void *reader, const struct yaml_value *value,
                               void *out)
{
    return rig_read_positive(reader, value, UNITS_POSITION, out);
}

int rig_read_cia402_guarding(void *reader, const struct yaml_value *value,
                             void *out)
{
    struct rig_reader *self = reader;

    return rig_read_time(self, value, RIG_MS,
                         self->rig->watchdog_ns / 2 / RIG_MS * RIG_MS, RIG_MS,
                         out);
}

const char *const rig_nmt_resets[RIG_NMT_RESETS] = { "none", "communication",
                                                     "node" };

int rig_read_cia402_nmt_reset(void *reader, const struct yaml_value *value,
                              void *out)
{
    static const enum canopen_nmt_command commands[RIG_NMT_RESETS] = {
        0, CANOPEN_NMT_RESET_COMMUNICATION, CANOPEN_NMT_RESET_NODE
    };
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, rig_nmt_resets, RIG_NMT_RESETS, &index) < 0)
        return -1;
    *(enum canopen_nmt_command *)out = commands[index];
    return 0;
}

/* ---- times --------------------------------------------------------------- */

int rig_read_answer_time(void *reader, const struct yaml_value *value,
                         void *out)
{
    return rig_read_time(reader, value, 10 * RIG_MS, 10000 * RIG_MS, RIG_MS,
                         out);
}

int rig_read_wait_time(void *reader, const struct yaml_value *value, void *out)
{
    return rig_read_time(reader, value, 100 * RIG_MS, 120000 * RIG_MS, RIG_MS,
                         out);
}

static const struct yaml_field rig_times_fields[] = {
    { "sdo", YAML_OPTIONAL, "10 ms .. 10 s in whole ms", rig_read_answer_time,
      offsetof(struct rig_times, sdo_ns) },
    { "state", YAML_OPTIONAL, "100 ms .. 2 min in whole ms", rig_read_wait_time,
      offsetof(struct rig_times, state_ns) },
    { "boot", YAML_OPTIONAL, "100 ms .. 2 min in whole ms", rig_read_wait_time,
      offsetof(struct rig_times, boot_ns) },
    { "brake", YAML_OPTIONAL, "100 ms .. 2 min in whole ms", rig_read_wait_time,
      offsetof(struct rig_times, brake_ns) },
    { "precharge", YAML_OPTIONAL, "100 ms .. 2 min in whole ms",
      rig_read_wait_time, offsetof(struct rig_times, precharge_ns) },
};
const struct yaml_shape rig_times_shape = { "times", rig_times_fields,
                                            ARRAY_LEN(rig_times_fields) };

int rig_read_times(void *reader, const struct yaml_value *value, void *out)
{
    return yaml_fields_read(value, &rig_times_shape, reader, out);
}

/* ---- ratios ------------------------------------------------------------ */

static int rig_read_whole(void *reader, const struct yaml_value *value,
                          void *out)
{
    (void)reader;
    return yaml_value_integer(value, 1, UINT32_MAX, out);
}

static const struct yaml_field rig_scale_fields[] = {
    { "num", YAML_REQUIRED, "so many of the drive's units", rig_read_whole,
      offsetof(struct rig_scale, num) },
    { "den", YAML_OPTIONAL, "for so many of counts/s or counts/s2",
      rig_read_whole, offsetof(struct rig_scale, den) },
};
const struct yaml_shape rig_scale_shape = { "scale", rig_scale_fields,
                                            ARRAY_LEN(rig_scale_fields) };

int rig_read_scale(void *reader, const struct yaml_value *value, void *out)
{
    struct rig_scale *scale = out;

    scale->den = 1;
    return yaml_fields_read(value, &rig_scale_shape, reader, out);
}

/* ---- option codes ------------------------------------------------------ */

static int rig_read_option(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct drive_cia402_option_code *option = out;
    int64_t code;
    (void)reader;
    if (yaml_value_integer(value, INT8_MIN, 8, &code) < 0)
        return -1;
    option->given = true;
    option->value = (int8_t)code;
    return 0;
}

/* Those that slew relies on brake. */
static int rig_read_braking(void *reader, const struct yaml_value *value,
                            void *out)
{
    if (rig_read_option(reader, value, out) < 0)
        return -1;
    if (((struct drive_cia402_option_code *)out)->value == 0) {
        struct yaml_value code = *value;
        code.expected = "a code that brakes, such as 2";
        return yaml_value_refuse(&code,
                                 "is 0, with which the axis would coast");
    }
    return 0;
}

#define OPTION(name, which, meaning, read)                                     \
    {                                                                          \
        name, YAML_OPTIONAL, meaning, read,                                    \
            (which) * sizeof(struct drive_cia402_option_code)                  \
    }
static const struct yaml_field rig_option_fields[] = {
    OPTION("quick_stop", DRIVE_CIA402_QUICK_STOP, "the code of 0x605A",
           rig_read_braking),
    OPTION("shutdown", DRIVE_CIA402_SHUTDOWN, "the code of 0x605B",
           rig_read_option),
    OPTION("disable", DRIVE_CIA402_DISABLE, "the code of 0x605C",
           rig_read_option),
    OPTION("halt", DRIVE_CIA402_HALT, "the code of 0x605D", rig_read_braking),
    OPTION("fault", DRIVE_CIA402_FAULT, "the code of 0x605E", rig_read_option),
};
const struct yaml_shape rig_option_shape = { "options", rig_option_fields,
                                             ARRAY_LEN(rig_option_fields) };

int rig_read_options(void *reader, const struct yaml_value *value, void *out)
{
    return yaml_fields_read(value, &rig_option_shape, reader, out);
}

int rig_check_cia402(const struct yaml_value *value,
                     const struct rig_axis *axis)
{
    if (axis->cia402.stream == DRIVE_CIA402_CSV && axis->cia402.gain_q16 == 0) {
        struct yaml_value drive = *value;
        drive.expected = "both, such as bandwidth: 5 Hz";
        return yaml_value_refuse(&drive, "has mode: csv but no bandwidth");
    }
    return 0;
}
