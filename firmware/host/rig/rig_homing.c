/* firmware/host/rig/rig_homing.c - how an axis finds out where it is. */
#include "firmware/host/rig/rig_parts.h"

#include "motion/core/fixed.h"

#define RIG_ORDER_MAX   RIG_AXES_MAX
#define RIG_HOMING_MAX  (600000 * RIG_MS)
#define RIG_HOMING_TIME (60000 * RIG_MS)
#define RIG_PUSH_MIN    10 /* permille of the rated torque */
#define RIG_PUSH_MAX    3000
#define RIG_STOP_SHARE  20 /* of the speed limit, at a hard stop: 1/20 */

const char *const rig_homing_kinds[RIG_HOMING_KINDS] = {
    [HOMING_NONE] = "none",           [HOMING_SWITCH] = "switch",
    [HOMING_DRIVE] = "drive",         [HOMING_HERE] = "here",
    [HOMING_HARD_STOP] = "hard-stop",
};
const char *const rig_homing_inputs[RIG_HOMING_INPUTS] = {
    [HOMING_INPUT_HOME] = "home",
    [HOMING_INPUT_LIMIT_NEGATIVE] = "limit-negative",
    [HOMING_INPUT_LIMIT_POSITIVE] = "limit-positive",
};
const char *const rig_homing_ways[RIG_HOMING_WAYS] = { "negative", "positive" };

static struct homing_config *rig_homing_of(void *reader)
{
    return &((struct rig_reader *)reader)->axis->homing;
}

static int rig_homing_only(const struct yaml_value *value, void *reader,
                           enum homing_by by)
{
    const struct homing_config *homing = rig_homing_of(reader);
    return homing->by == by
               ? 0
               : yaml_value_refuse(value, "is not for homing by %s",
                                   rig_homing_kinds[homing->by]);
}

/* For what it looks for, slew itself. */
static int rig_homing_searches(const struct yaml_value *value, void *reader)
{
    return rig_homing_of(reader)->by == HOMING_HARD_STOP
               ? 0
               : rig_homing_only(value, reader, HOMING_SWITCH);
}

static int rig_homing_any(const struct yaml_value *value, void *reader)
{
    return rig_homing_of(reader)->by != HOMING_NONE
               ? 0
               : yaml_value_refuse(value, "is not for homing by none");
}

static const struct rig_kind *rig_homing_drive(void *reader)
{
    return rig_kinds[((struct rig_reader *)reader)->axis->kind];
}

/* A drive that homes at its own speeds, by what it was set up for. */
static int rig_homing_told(const struct yaml_value *value, void *reader)
{
    const char *is_set_up = rig_homing_drive(reader)->homes_as_set_up;
    return rig_homing_of(reader)->by == HOMING_DRIVE && is_set_up != NULL
               ? yaml_value_refuse(value, "is not for %s", is_set_up)
               : 0;
}

/* Does the drive say how hard it presses, and of what that is a share? */
static int rig_homing_torque(const struct yaml_value *value, void *reader)
{
    const struct rig_kind *drive = rig_homing_drive(reader);
    const struct yaml_value unrated = {
        value->tree, value->node, value->name,
        "rated_torque in the axis's drive, of which torque is a share"
    };
    if (!drive->reports_torque)
        return yaml_value_refuse(
            value, "hard-stop is not for a %s drive, which reports no torque",
            rig_drive_kinds[((struct rig_reader *)reader)->axis->kind]);
    if (drive->torque_in_nm &&
        ((struct rig_reader *)reader)->axis->rated_torque_mnm == 0)
        return yaml_value_refuse(&unrated,
                                 "hard-stop has a drive without rated_torque");
    return 0;
}

static int rig_read_homing_by(void *reader, const struct yaml_value *value,
                              void *out)
{
    unsigned index;
    if (yaml_value_choice(value, rig_homing_kinds, RIG_HOMING_KINDS, &index) <
        0)
        return -1;
    const char *cannot = rig_homing_drive(reader)->cannot_home;
    if (index == HOMING_DRIVE && cannot != NULL)
        return yaml_value_refuse(value, "drive is not for %s", cannot);
    if (index == HOMING_HARD_STOP && rig_homing_torque(value, reader) < 0)
        return -1;
    *(enum homing_by *)out = (enum homing_by)index;
    return 0;
}

static int rig_read_homing_input(void *reader, const struct yaml_value *value,
                                 void *out)
{
    struct homing_config *homing = rig_homing_of(reader);
    unsigned index;
    if (rig_homing_only(value, reader, HOMING_SWITCH) < 0 ||
        yaml_value_choice(value, rig_homing_inputs, RIG_HOMING_INPUTS, &index) <
            0)
        return -1;
    *(enum homing_input *)out = (enum homing_input)index;
    if (index == HOMING_INPUT_LIMIT_POSITIVE)
        homing->direction = 1;
    return 0;
}

/* A limit switch is met in its own direction. */
static int rig_read_homing_direction(void *reader,
                                     const struct yaml_value *value, void *out)
{
    const struct homing_config *homing = rig_homing_of(reader);
    unsigned index;
    if (rig_homing_searches(value, reader) < 0 ||
        yaml_value_choice(value, rig_homing_ways, RIG_HOMING_WAYS, &index) < 0)
        return -1;
    const int direction = index == 0 ? -1 : 1;
    if (homing->input != HOMING_INPUT_HOME && direction != homing->direction)
        return yaml_value_refuse(value, "leads away from the input, %s",
                                 rig_homing_inputs[homing->input]);
    *(int *)out = direction;
    return 0;
}

static int rig_read_homing_speed(void *reader, const struct yaml_value *value,
                                 void *out)
{
    const struct rig_axis *axis = ((struct rig_reader *)reader)->axis;
    char quote[YAML_QUOTE_MAX];
    if (rig_homing_any(value, reader) < 0 ||
        rig_read_velocity(reader, value, out) < 0)
        return -1;
    if (*(int64_t *)out > axis->limit.vel_q32)
        return yaml_value_refuse(value, "%s is above the axis's limit",
                                 yaml_value_quote(quote, value));
    return 0;
}

static int rig_read_homing_slow(void *reader, const struct yaml_value *value,
                                void *out)
{
    const struct homing_config *homing = rig_homing_of(reader);
    char quote[YAML_QUOTE_MAX];
    if (rig_read_homing_speed(reader, value, out) < 0 ||
        rig_homing_told(value, reader) < 0)
        return -1;
    if (homing->by == HOMING_HERE)
        return yaml_value_refuse(value, "is not for homing by here");
    if (*(int64_t *)out > homing->fast_q32)
        return yaml_value_refuse(value, "%s is above the speed of the search",
                                 yaml_value_quote(quote, value));
    return 0;
}

static int rig_read_homing_distance(void *reader,
                                    const struct yaml_value *value, void *out)
{
    if (rig_homing_searches(value, reader) < 0)
        return -1;
    return rig_read_positive(reader, value, UNITS_POSITION, out);
}

/* Of the rated torque. */
static int rig_read_homing_torque(void *reader, const struct yaml_value *value,
                                  void *out)
{
    char quote[YAML_QUOTE_MAX];
    int64_t ratio_q32, permille;
    if (rig_homing_only(value, reader, HOMING_HARD_STOP) < 0 ||
        rig_read_quantity(reader, value, UNITS_RATIO, &ratio_q32) < 0)
        return -1;
    if (motion_fixed_muldiv(ratio_q32, 1000, MOTION_FIXED_ONE_Q32, &permille) <
            0 ||
        permille < RIG_PUSH_MIN || permille > RIG_PUSH_MAX)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    *(int32_t *)out = (int32_t)permille;
    return 0;
}

static int rig_read_homing_clear(void *reader, const struct yaml_value *value,
                                 void *out)
{
    if (rig_homing_only(value, reader, HOMING_HARD_STOP) < 0)
        return -1;
    return rig_read_positive(reader, value, UNITS_POSITION, out);
}

static int rig_read_homing_position(void *reader,
                                    const struct yaml_value *value, void *out)
{
    if (rig_homing_any(value, reader) < 0)
        return -1;
    return rig_read_quantity(reader, value, UNITS_POSITION, out);
}

static int rig_read_homing_go(void *reader, const struct yaml_value *value,
                              void *out)
{
    const struct plan_limit *limit =
        &((struct rig_reader *)reader)->axis->limit;
    int64_t *go_q32 = out;
    if (rig_read_homing_position(reader, value, out) < 0)
        return -1;
    if (*go_q32 < limit->pos_min_q32 || *go_q32 > limit->pos_max_q32)
        return yaml_value_refuse(value, "is outside the axis's limits");
    rig_homing_of(reader)->goes = true;
    return 0;
}

static int rig_read_homing_order(void *reader, const struct yaml_value *value,
                                 void *out)
{
    int64_t order;
    if (rig_homing_any(value, reader) < 0 ||
        yaml_value_integer(value, 1, RIG_ORDER_MAX, &order) < 0)
        return -1;
    *(unsigned *)out = (unsigned)order;
    return 0;
}

static int rig_read_homing_timeout(void *reader, const struct yaml_value *value,
                                   void *out)
{
    if (rig_homing_any(value, reader) < 0)
        return -1;
    return rig_read_time(reader, value, 100 * RIG_MS, RIG_HOMING_MAX, RIG_MS,
                         out);
}

static int rig_read_homing_method(void *reader, const struct yaml_value *value,
                                  void *out)
{
    int64_t method;
    if (rig_homing_only(value, reader, HOMING_DRIVE) < 0 ||
        rig_homing_told(value, reader) < 0 ||
        yaml_value_integer(value, -128, 127, &method) < 0)
        return -1;
    /* CiA 402-2, 0x6098: no homing method assigned */
    if (method == 0 && rig_homing_drive(reader)->has_methods)
        return yaml_value_refuse(value, "0 is no homing (by: none)");
    *(int *)out = (int)method;
    return 0;
}

static const struct yaml_field rig_homing_fields[] = {
    { "by", YAML_REQUIRED, "switch, hard-stop, drive, here or none",
      rig_read_homing_by, offsetof(struct homing_config, by) },
    { "input", YAML_OPTIONAL, "home, limit-negative or limit-positive",
      rig_read_homing_input, offsetof(struct homing_config, input) },
    { "direction", YAML_OPTIONAL, "negative or positive",
      rig_read_homing_direction, offsetof(struct homing_config, direction) },
    { "speed", YAML_OPTIONAL, "the speed of the search, such as 20 mm/s",
      rig_read_homing_speed, offsetof(struct homing_config, fast_q32) },
    { "slow", YAML_OPTIONAL, "the speed at the switch, such as 2 mm/s",
      rig_read_homing_slow, offsetof(struct homing_config, slow_q32) },
    { "distance", YAML_OPTIONAL, "the distance to search, such as 500 mm",
      rig_read_homing_distance, offsetof(struct homing_config, distance_q32) },
    { "torque", YAML_OPTIONAL, "1 % .. 300 % of the rated torque",
      rig_read_homing_torque, offsetof(struct homing_config, push_permille) },
    { "clear", YAML_OPTIONAL, "the distance that it backs off, such as 2 mm",
      rig_read_homing_clear, offsetof(struct homing_config, clear_q32) },
    { "position", YAML_OPTIONAL, "the position of the home point",
      rig_read_homing_position, offsetof(struct homing_config, pos_q32) },
    { "go", YAML_OPTIONAL, "the position to go to afterwards",
      rig_read_homing_go, offsetof(struct homing_config, go_q32) },
    { "order", YAML_OPTIONAL, "1 .. 64, lower ones first",
      rig_read_homing_order, offsetof(struct homing_config, order) },
    { "timeout", YAML_OPTIONAL, "100 ms .. 10 min in whole ms",
      rig_read_homing_timeout, offsetof(struct homing_config, timeout_ns) },
    { "method", YAML_OPTIONAL, "the drive's own number, -128 .. 127",
      rig_read_homing_method, offsetof(struct homing_config, method) },
};
const struct yaml_shape rig_homing_shape = { "homing", rig_homing_fields,
                                             ARRAY_LEN(rig_homing_fields) };

/* A stop is met at a twentieth of the speed limit, a quarter of that again, and
 * left by what that covers in a quarter of a second. */
static int rig_fill_hard_stop(const struct yaml_value *value,
                              const struct rig_axis *axis, bool has_speed,
                              struct homing_config *homing)
{
    if (homing->push_permille == 0)
        return yaml_value_refuse(value, "by hard-stop has no 'torque', which "
                                        "the stop is known by");
    if (!has_speed)
        homing->fast_q32 = axis->limit.vel_q32 / RIG_STOP_SHARE + 1;
    if (homing->slow_q32 == 0)
        homing->slow_q32 = homing->fast_q32 / 4 + 1;
    if (homing->clear_q32 == 0)
        homing->clear_q32 = homing->fast_q32 / 4 + 1;
    return 0;
}

/* What was left out: a quarter of the speed limit, a tenth of that at the
 * switch, and as far as the range is long. */
int rig_read_homing(void *reader, const struct yaml_value *value, void *out)
{
    const struct rig_axis *axis = ((struct rig_reader *)reader)->axis;
    struct homing_config *homing = out;
    if (rig_axis_is_virtual(axis))
        return yaml_value_refuse(value, "is not for %s",
                                 rig_homing_drive(reader)->cannot_home);
    if (rig_homing_drive(reader)->samples)
        return yaml_value_refuse(value, "is not for an axis of a board, which "
                                        "stands where its servo says");
    const int64_t usual_q32 = axis->limit.vel_q32 / 4 + 1;
    const bool is_range_wide =
        motion_fixed_sub(axis->limit.pos_max_q32, axis->limit.pos_min_q32,
                         &homing->distance_q32) < 0;

    homing->direction = -1;
    homing->order = 1;
    homing->timeout_ns = RIG_HOMING_TIME;
    homing->fast_q32 = usual_q32;
    if (is_range_wide)
        homing->distance_q32 = INT64_MAX / 4;
    if (yaml_fields_read(value, &rig_homing_shape, reader, out) < 0)
        return -1;
    if (homing->by == HOMING_DRIVE)
        return rig_homing_drive(reader)->judge_homing(reader, value, homing);
    if (homing->by == HOMING_HARD_STOP)
        return rig_fill_hard_stop(value, axis, homing->fast_q32 != usual_q32,
                                  homing);
    if (homing->slow_q32 == 0)
        homing->slow_q32 = homing->fast_q32 / 10 + 1;
    return 0;
}

static bool rig_has_line(const struct rig *rig, uint32_t axis,
                         enum homing_input input)
{
    static const enum rig_line_kind kinds[RIG_HOMING_INPUTS] = {
        [HOMING_INPUT_HOME] = RIG_LINE_HOME,
        [HOMING_INPUT_LIMIT_NEGATIVE] = RIG_LINE_LIMIT_NEGATIVE,
        [HOMING_INPUT_LIMIT_POSITIVE] = RIG_LINE_LIMIT_POSITIVE,
    };

    for (uint32_t i = 0; i < rig->line_count; i++)
        if (rig->line[i].kind == kinds[input] && rig->line[i].axis == (int)axis)
            return true;
    return false;
}

bool rig_homes_by_drive_input(const struct rig *rig, uint32_t axis)
{
    const struct homing_config *homing = &rig->axis[axis].homing;

    return rig_kinds[rig->axis[axis].kind]->has_inputs &&
           homing->by == HOMING_SWITCH &&
           !rig_has_line(rig, axis, homing->input);
}

/* The lines are read after the axes. */
int rig_check_homing(const struct yaml_value *value, const struct rig *rig)
{
    for (uint32_t i = 0; i < rig->axis_count; i++) {
        const struct homing_config *homing = &rig->axis[i].homing;

        if (homing->by == HOMING_SWITCH && homing->input == HOMING_INPUT_HOME &&
            !rig_kinds[rig->axis[i].kind]->has_inputs &&
            !rig_has_line(rig, i, HOMING_INPUT_HOME))
            return yaml_report_at(&value->tree->report, rig->axis[i].place,
                                  "%s is homed by its home switch, expected a "
                                  "gpio line of kind home for it",
                                  rig->axis[i].name);
    }
    return 0;
}
