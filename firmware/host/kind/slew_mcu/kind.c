/* firmware/host/kind/slew_mcu/kind.c - a board that runs slew's controller, as
 * axes in a rig file; see firmware/host/rig/kind.h. */
#include <inttypes.h>
#include <stdio.h>

#include "firmware/host/rig/modbus_budget.h"
#include "firmware/host/rig/rig_parts.h"
#include "hal/mcu/piece.h"

#define BOARD_WATCH_NS  (1000 * RIG_MS)
#define BOARD_ANSWER_NS (100 * RIG_MS)
/* Questions that a watch has to outlast. */
#define BOARD_WATCH_CYCLES 3

static bool slew_mcu_is_for(const struct rig_bus *bus)
{
    return !rig_bus_is_can(bus) && !bus->modbus.line.is_ascii;
}

static int rig_read_board(void *reader, const struct yaml_value *value,
                          void *out)
{
    int64_t number = 0;

    (void)reader;
    if (yaml_value_integer(value, 1, 247, &number) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)number;
    return 0;
}

/* Its unit is known by then. */
static int rig_read_board_axis(void *reader, const struct yaml_value *value,
                               void *out)
{
    int64_t number = 0;

    if (yaml_value_integer(value, 0, MCU_AXES_MAX - 1, &number) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)number;
    return rig_claim_drive(reader, value);
}

static int rig_read_watch(void *reader, const struct yaml_value *value,
                          void *out)
{
    return rig_read_time(reader, value, 10 * RIG_MS, MCU_WATCH_MAX * RIG_MS,
                         RIG_MS, out);
}

static int rig_read_servo_map(void *reader, const struct yaml_value *value,
                              void *out)
{
    struct rig_axis *axis = out;

    axis->has_servo_map = true;
    return rig_read_map(reader, value, &axis->map);
}

static const struct yaml_field rig_slew_mcu_fields[] = {
    { "kind", YAML_REQUIRED, RIG_KIND_WORDS, rig_read_drive_kind,
      offsetof(struct rig_axis, kind) },
    { "bus", YAML_REQUIRED, "the name of a bus", rig_read_drive_bus,
      offsetof(struct rig_axis, bus) },
    { "node", YAML_REQUIRED, "the unit number of the board, 1 .. 247",
      rig_read_board, offsetof(struct rig_axis, node_id) },
    { "axis", YAML_REQUIRED, "an axis of the board, 0 .. 5",
      rig_read_board_axis, offsetof(struct rig_axis, node_axis) },
    { "watch", YAML_OPTIONAL, "10 ms .. 60 s in whole ms", rig_read_watch,
      offsetof(struct rig_axis, watch_ns) },
    { "servo", YAML_OPTIONAL,
      "the unit number of its servo on the board's own line, 1 .. 247",
      rig_read_board, offsetof(struct rig_axis, servo) },
    { "map", YAML_OPTIONAL,
      "one of slew's register maps, such as leadshine-el7, or a path that "
      "ends in .yaml",
      rig_read_servo_map, 0 },
    { "counts", YAML_OPTIONAL,
      "counts per unit of the axis, such as '10000 per rev' or "
      "{num: 1048576, den: 360}",
      rig_read_counts, 0 },
    { "unsupervised", YAML_OPTIONAL,
      "yes: the servo does not stop by itself when its line is dead, and "
      "something else takes its torque off",
      yaml_read_bool, offsetof(struct rig_axis, unsupervised) },
};
const struct yaml_shape rig_slew_mcu_shape = { "slew_mcu_drive",
                                               rig_slew_mcu_fields,
                                               ARRAY_LEN(rig_slew_mcu_fields) };

/* Boards and servos share no unit, and axes of one board have one watch, 0: not
 * said. */
static int slew_mcu_judge_board(const struct rig_reader *reader,
                                const struct yaml_value *value,
                                struct rig_axis *axis)
{
    const struct rig *rig = reader->rig;

    for (const struct rig_axis *other = rig->axis; other < axis; other++) {
        if (other->bus != axis->bus || other->node_id != axis->node_id)
            continue;
        if (other->kind != axis->kind)
            return yaml_value_refuse(value,
                                     "has node %u, and on bus %s that is "
                                     "the drive of axis %s",
                                     axis->node_id, rig->bus[axis->bus].name,
                                     other->name);
        if (axis->watch_ns == 0)
            axis->watch_ns = other->watch_ns;
        if (axis->watch_ns != other->watch_ns)
            return yaml_value_refuse(value,
                                     "has another watch than axis %s of "
                                     "the same board",
                                     other->name);
    }
    if (axis->watch_ns == 0)
        axis->watch_ns = BOARD_WATCH_NS;
    return 0;
}

/* All servos of a board are driven by one map. */
static int slew_mcu_judge_servo(struct rig_reader *reader,
                                const struct yaml_value *value,
                                const struct rig_axis *axis)
{
    const struct rig *rig = reader->rig;
    const struct modbus_map *map = &rig->map[axis->map];
    struct yaml_value drive = *value, servo = *value;
    char owner[RIG_OWNER_MAX];

    for (const struct rig_axis *other = rig->axis; other < axis; other++) {
        if (other->servo == 0 || other->bus != axis->bus ||
            other->node_id != axis->node_id)
            continue;
        if (other->map != axis->map)
            return yaml_value_refuse(value,
                                     "has another map than axis %s of "
                                     "the same board, which has one for "
                                     "all of its servos",
                                     other->name);
    }
    servo.name = "servo";
    servo.node = yaml_fields_find(value, servo.name);
    servo.expected = "a servo of its own on the board's line";
    snprintf(owner, sizeof owner, "axis %s", axis->name);
    if (rig_claim(reader, &servo, owner, "%u of board %u on bus %s",
                  axis->servo, axis->node_id, rig->bus[axis->bus].name) < 0)
        return -1;
    if (map->stream.count == 0)
        return yaml_value_refuse(value, "has a map without stream, which "
                                        "cannot follow set points");
    drive.expected = "unsupervised: yes once its torque-off input is wired";
    return map->watchdog_ns == 0 && !axis->unsupervised
               ? yaml_value_refuse(&drive, "does not stop by itself when its "
                                           "line is dead")
               : 0;
}

/* A virtual axis has no counts; where it stands is said in the axis's unit. */
static int slew_mcu_read(struct rig_reader *reader,
                         const struct yaml_value *value, struct rig_axis *axis)
{
    if (yaml_fields_read(value, &rig_slew_mcu_shape, reader, axis) < 0 ||
        slew_mcu_judge_board(reader, value, axis) < 0)
        return -1;
    if ((axis->servo != 0) != axis->has_servo_map ||
        (axis->servo != 0) != (axis->counts_num != 0))
        return yaml_value_refuse(value, "has not all of servo, map and counts, "
                                        "which a servo on the board's line "
                                        "needs: expected all three, or none "
                                        "for a virtual axis");
    if (axis->servo != 0)
        return slew_mcu_judge_servo(reader, value, axis);
    axis->counts_num = RIG_TURN_COUNTS;
    axis->counts_den = 1;
    return 0;
}

static int slew_mcu_judge_axis(const struct rig_reader *reader,
                               const struct yaml_value *value)
{
    struct yaml_value entry = *value;

    entry.expected = "a smaller range or fewer counts";
    return reader->axis->servo == 0
               ? 0
               : rig_check_modbus_range(&entry,
                                        &reader->rig->map[reader->axis->map],
                                        reader->axis);
}

/* Once all are known: the axes of a board are its first ones, and its line lets
 * it hear often enough. */
static int slew_mcu_judge_rig(const struct yaml_value *value,
                              const struct rig *rig, unsigned index)
{
    const struct rig_axis *axis = &rig->axis[index];
    const int64_t need_ns =
        BOARD_WATCH_CYCLES * modbus_budget_cycle_ns(rig, axis->bus);
    bool has_lower = axis->node_axis == 0;

    for (unsigned i = 0; i < rig->axis_count; i++)
        if (rig->axis[i].bus == axis->bus &&
            rig->axis[i].node_id == axis->node_id &&
            rig->axis[i].node_axis + 1 == axis->node_axis)
            has_lower = true;
    if (!has_lower)
        return yaml_value_refuse(value,
                                 "has axis %s as axis %u of board %u, and no "
                                 "axis is its axis %u: expected the first ones "
                                 "of a board, without a gap",
                                 axis->name, axis->node_axis, axis->node_id,
                                 axis->node_axis - 1u);
    if (axis->watch_ns < need_ns)
        return yaml_value_refuse(value,
                                 "has a watch of %" PRId64
                                 " ms for the board of axis %s, and three "
                                 "rounds of its line take %" PRId64
                                 " ms: expected more, or a faster line",
                                 axis->watch_ns / RIG_MS, axis->name,
                                 (need_ns + RIG_MS - 1) / RIG_MS);
    return 0;
}

/* The board watches the PC; who watches the board is the servo's own matter. */
static const char *slew_mcu_unsupervised(const struct rig *rig,
                                         const struct rig_axis *axis)
{
    return axis->servo != 0 && rig->map[axis->map].watchdog_ns == 0
               ? "the register map of its servo has no watchdog: when the "
                 "board "
                 "is dead, or its line to the servo, the servo goes on to its "
                 "last set point, and nothing but its torque-off input takes "
                 "its torque"
               : NULL;
}

/* --- its share of the line --- */

static int64_t board_transaction_ns(const struct modbus_rtu_time *time,
                                    enum hal_modbus_function function,
                                    uint16_t count)
{
    const struct hal_modbus_request request = { .unit = 1,
                                                .function = (uint8_t)function,
                                                .count = count };

    return modbus_rtu_transaction_ns(time, &request);
}

/* What the axis says; with the first one of the board what that says, and a piece
 * of a move between each two of these. */
static int64_t slew_mcu_turn_ns(const struct rig *rig, unsigned axis,
                                const struct modbus_rtu_time *time,
                                bool streamed, unsigned *transactions)
{
    const struct rig_axis *own = &rig->axis[axis];
    const int64_t piece_ns =
        board_transaction_ns(time, HAL_MODBUS_WRITE_MANY, MCU_PIECE_MAX);
    int64_t sum_ns =
        board_transaction_ns(time, HAL_MODBUS_READ, MCU_AXIS_WORDS) + piece_ns;

    (void)streamed;
    *transactions = 2;
    for (unsigned i = 0; i < axis; i++)
        if (rig->axis[i].bus == own->bus &&
            rig->axis[i].node_id == own->node_id)
            return sum_ns;
    *transactions = 4;
    return sum_ns + piece_ns +
           board_transaction_ns(time, HAL_MODBUS_READ, MCU_STATE_WORDS);
}

static int64_t slew_mcu_answer_ns(const struct rig *rig, unsigned i)
{
    (void)rig;
    (void)i;
    return BOARD_ANSWER_NS;
}

const struct rig_kind rig_kind_slew_mcu = {
    .code_max = UINT16_MAX,
    .is_for = slew_mcu_is_for,
    .read = slew_mcu_read,
    .judge_axis = slew_mcu_judge_axis,
    .unsupervised = slew_mcu_unsupervised,
    .judge_rig = slew_mcu_judge_rig,
    .cannot_home = "a board, whose axes stand where their servos say",
    .samples = true,
    .turn_ns = slew_mcu_turn_ns,
    .answer_ns = slew_mcu_answer_ns,
};
