/* hal/drive/modbus/fields.c - what the fields of a map's groups can say, and
 * what that comes to in the axis's unit; see drive.h.  This part divides. */
#include <stddef.h>

#include "hal/drive/modbus/parts.h"
#include "motion/core/fixed.h"

#define NS_PER_S  INT64_C(1000000000)
#define S_PER_MIN 60
/* 1000 rpm in 1 ms, in revolutions per minute and second */
#define MS_PER_1000_RPM INT64_C(1000000)

/* a * b / c, INT64_MAX where that is too much; none is negative. */
static int64_t fields_scale(int64_t a, int64_t b, int64_t c)
{
    int64_t value = INT64_MAX;

    (void)motion_fixed_muldiv(a, b, c, &value);
    return value;
}

static int64_t fields_counts_num(const struct drive_modbus_config *config)
{
    return (int64_t)motion_fixed_abs(config->counts_num);
}

static int64_t fields_to_unit(const struct drive_modbus_config *config,
                              int64_t counts)
{
    return fields_scale(counts, config->counts_den, fields_counts_num(config));
}

/* value num / den 2^bits: accelerations in counts have more range than in
 * units, and less behind the point. */
static int64_t fields_shifted(int64_t value, int64_t num, int64_t den, int bits)
{
    struct hal_ratio ratio;

    return hal_ratio_init(&ratio, num, den, bits) < 0
               ? INT64_MAX
               : hal_ratio_scale(&ratio, value);
}

static int64_t fields_clamp(const struct modbus_map_field *field, int64_t value)
{
    if (value < field->min)
        return field->min;
    return value > field->max ? field->max : value;
}

/* ---- speed ---- */

/* So many steps of the register. */
static int64_t fields_speed_q32(const struct drive_modbus_config *config,
                                const struct modbus_map_field *field,
                                int64_t steps)
{
    int64_t counts_q32 =
        fields_scale(steps, field->den * MOTION_FIXED_ONE_Q32, field->num);

    if (field->unit == MODBUS_RPM)
        counts_q32 =
            fields_scale(counts_q32, config->map->resolution, S_PER_MIN);
    return counts_q32 == INT64_MAX ? INT64_MAX
                                   : fields_to_unit(config, counts_q32);
}

/* ---- ramps ---- */

/* Half as much again as the axis's stop: what it is behind is caught up while
 * it accelerates at its limit. */
static int64_t fields_ramp_q32(const struct drive_modbus_config *config)
{
    return fields_scale(config->acc_q32, 3, 2);
}

/* The field is num / den times counts/s2; where it is a time, num / den over
 * counts/s2. */
static void fields_ratio(const struct modbus_map *map,
                         const struct modbus_map_field *field, int64_t *num,
                         int64_t *den)
{
    *num = field->num;
    *den = field->den;
    if (field->unit == MODBUS_MS_PER_1000_RPM) {
        *num = fields_scale(*num * MS_PER_1000_RPM, map->resolution, 1);
        *den *= S_PER_MIN;
    } else if (field->unit == MODBUS_RPM) {
        *num *= S_PER_MIN;
        *den *= map->resolution;
    }
}

int64_t drive_modbus_ramp(const struct drive_modbus_config *config,
                          const struct modbus_map_field *field)
{
    const int64_t counts_q16 =
        fields_shifted(fields_ramp_q32(config), fields_counts_num(config),
                       config->counts_den, -16);
    const int64_t counts_s2 = (counts_q16 >> 16) + 1;
    int64_t num, den;

    fields_ratio(config->map, field, &num, &den);
    return fields_clamp(field, field->unit == MODBUS_MS_PER_1000_RPM
                                   ? num / den / counts_s2
                                   : fields_scale(counts_s2, num, den));
}

/* What the register's value is, as it was rounded and clamped. */
static int64_t fields_acc_q32(const struct drive_modbus_config *config,
                              const struct modbus_map_field *field)
{
    const int64_t value = drive_modbus_ramp(config, field);
    int64_t num, den, counts_q16;

    fields_ratio(config->map, field, &num, &den);
    if (field->unit == MODBUS_MS_PER_1000_RPM)
        counts_q16 = fields_scale(num, 65536, den) / (value < 1 ? 1 : value);
    else
        counts_q16 = fields_scale(fields_scale(value, 65536, 1), den, num);
    return fields_shifted(counts_q16, config->counts_den,
                          fields_counts_num(config), 16);
}

/* The drive's own: full speed in one cycle, or what the axis needs. */
static int64_t fields_own_q32(const struct drive_modbus_config *config)
{
    const int64_t steep_q32 =
        fields_scale(config->vel_max_q32, NS_PER_S, config->cycle_ns);
    const int64_t ramp_q32 = fields_ramp_q32(config);

    return steep_q32 > ramp_q32 ? steep_q32 : ramp_q32;
}

void drive_modbus_fields(const struct drive_modbus_config *config,
                         struct drive_modbus_fields *fields)
{
    const struct modbus_map_group *group = &config->map->stream;
    const int64_t own_q32 = fields_own_q32(config);
    unsigned ramps = 0;

    *fields = (struct drive_modbus_fields){
        .count_q32 = fields_to_unit(config, MOTION_FIXED_ONE_Q32),
        .vel_max_q32 = INT64_MAX,
        .acc_q32 = own_q32,
        .dec_q32 = own_q32,
    };
    for (unsigned i = 0; i < group->count; i++) {
        const struct modbus_map_field *field = &group->field[i];

        if (field->quantity == MODBUS_VELOCITY) {
            fields->step_q32 = fields_speed_q32(config, field, 1);
            fields->vel_max_q32 = fields_speed_q32(config, field, field->max);
        } else if (field->quantity == MODBUS_ACCELERATION) {
            fields->acc_q32 = fields_acc_q32(config, field);
            ramps++;
        } else if (field->quantity == MODBUS_DECELERATION) {
            fields->dec_q32 = fields_acc_q32(config, field);
            ramps++;
        }
    }
    fields->own_ramps = ramps < 2;
}

/* ---- the law of the stream ---- */

#define HARD            3 /* times the axis's stop: see is_hard */
#define LAW_TIME_MAX_NS (10 * NS_PER_S)
#define LAW_MAX_Q32     (INT64_MAX / 8) /* so that three may be added */

/* sqrt(count / 4 a): c / a x 10^12 x 2^16, of which the root is s x 2.56e8. */
static int64_t fields_count_ns(const struct drive_modbus_fields *fields,
                               int64_t acc_q32)
{
    const int64_t square =
        fields_scale(fields->count_q32, INT64_C(1000000000000) << 16, acc_q32) /
        4;

    return (int64_t)motion_fixed_isqrt_u64((uint64_t)square) * 125 / 32;
}

static int64_t fields_longest_ns(int64_t a_ns, int64_t b_ns)
{
    return a_ns > b_ns ? a_ns : b_ns;
}

static int64_t fields_times(int64_t rate, int64_t dur_ns)
{
    return fields_scale(rate, dur_ns, NS_PER_S);
}

int drive_modbus_law(const struct drive_modbus_config *config,
                     struct drive_modbus_law *law)
{
    struct drive_modbus_fields fields;
    int64_t step_ns, time_ns;

    drive_modbus_fields(config, &fields);
    if (config->vel_max_q32 > LAW_MAX_Q32 || fields.step_q32 > LAW_MAX_Q32 ||
        fields.count_q32 > LAW_MAX_Q32 || fields.dec_q32 == 0)
        return MOTION_E_RANGE;
    step_ns = fields_scale(fields.step_q32, NS_PER_S, config->acc_q32);
    if (step_ns > LAW_TIME_MAX_NS)
        step_ns = LAW_TIME_MAX_NS;
    time_ns = fields_longest_ns(config->cycle_ns, step_ns);
    time_ns =
        fields_longest_ns(time_ns, fields_count_ns(&fields, config->acc_q32));
    law->gain_q16 = NS_PER_S * 65536 / (4 * time_ns);
    law->correct_max_q32 = fields_times(config->acc_q32, 2 * time_ns);
    if (law->correct_max_q32 > config->vel_max_q32)
        law->correct_max_q32 = config->vel_max_q32;
    law->round_up_q32 = fields.step_q32 > 0 ? (fields.step_q32 - 1) / 2 : 0;
    law->is_hard = fields.dec_q32 / HARD > config->acc_q32;
    law->is_near =
        fields.step_q32 == 0 ||
        (!law->is_hard &&
         fields.step_q32 > fields_times(fields.dec_q32, config->cycle_ns));
    return hal_ratio_init(&law->brake, 1, fields.dec_q32, 31);
}
