/* firmware/host/kind/moteus/kind.c - a moteus in a rig file; see
 * firmware/host/rig/kind.h. */
#include "firmware/host/kind/turn/budget.h"
#include "firmware/host/kind/turn/parts.h"
#include "hal/drive/moteus/drive.h"
#include "hal/drive/moteus/frame.h"

static bool moteus_is_for(const struct rig_bus *bus)
{
    return bus->kind == RIG_CAN && bus->data_bit_rate > 0;
}

static const struct yaml_field rig_moteus_fields[] = {
    { "kind", YAML_REQUIRED, RIG_KIND_WORDS, rig_read_drive_kind,
      offsetof(struct rig_axis, kind) },
    { "bus", YAML_REQUIRED, "the name of a bus", rig_read_drive_bus,
      offsetof(struct rig_axis, bus) },
    { "node", YAML_REQUIRED, "an id, 1 .. 127, of its own on the bus",
      rig_read_drive_node, offsetof(struct rig_axis, node_id) },
    { "turns", YAML_REQUIRED, RIG_TURN_EXPECTED, rig_read_turn, 0 },
    { "rated_torque", YAML_OPTIONAL, RIG_RATED_TORQUE_EXPECTED,
      rig_read_rated_torque, offsetof(struct rig_axis, rated_torque_mnm) },
    RIG_MONITOR_FIELD,
};
const struct yaml_shape rig_moteus_shape = { "moteus_drive", rig_moteus_fields,
                                             ARRAY_LEN(rig_moteus_fields) };

static int moteus_read(struct rig_reader *reader,
                       const struct yaml_value *value, struct rig_axis *axis)
{
    struct yaml_value lower = *value;

    if (yaml_fields_read(value, &rig_moteus_shape, reader, axis) < 0)
        return -1;
    lower.expected = "a highest voltage of at most 63 V";
    return (axis->monitor.wanted >> HAL_READING_VOLTAGE & 1) == 0 ||
                   axis->monitor.limit[HAL_READING_VOLTAGE].high_milli <= 63000
               ? 0
               : yaml_value_refuse(&lower, "monitors a voltage beyond the 63.5 "
                                           "V that its drive can say");
}

static unsigned moteus_readings(const struct rig *rig,
                                const struct rig_axis *axis)
{
    (void)rig;
    (void)axis;
    return (1u << HAL_READINGS) - 1;
}

/* ---- what it has on its bus ---- */

/* One frame with set point and questions, and an answer. */
#define MOTEUS_ORDER_BYTES  32
#define MOTEUS_ANSWER_BYTES 24
/* With the question for the current, and its answer. */
#define MOTEUS_CURRENT_BYTES        48
#define MOTEUS_ANSWER_CURRENT_BYTES 32

static bool moteus_asks_current(const struct rig_axis *axis)
{
    return (axis->monitor.wanted >> HAL_READING_CURRENT & 1) != 0;
}

static unsigned moteus_frames(const struct rig *rig, unsigned i,
                              struct rig_frame frame[RIG_FRAMES_MAX])
{
    const struct rig_bus *bus = &rig->bus[rig->axis[i].bus];
    const int64_t tick_ns = rig->period_ns;

    frame[0] =
        (struct rig_frame){ "set point", tick_ns,
                            turn_fd_bits(bus, MOTEUS_ORDER_BYTES), 0, 0 };
    frame[1] =
        (struct rig_frame){ "feedback", tick_ns,
                            turn_fd_bits(bus, MOTEUS_ANSWER_BYTES), 0, 1 };
    /* what those two are longer by when they have the current */
    frame[2] =
        (struct rig_frame){ "current", HAL_READING_NS,
                            turn_fd_bits(bus, MOTEUS_CURRENT_BYTES) -
                                turn_fd_bits(bus, MOTEUS_ORDER_BYTES) +
                                turn_fd_bits(bus, MOTEUS_ANSWER_CURRENT_BYTES) -
                                turn_fd_bits(bus, MOTEUS_ANSWER_BYTES),
                            0, 0 };
    return moteus_asks_current(&rig->axis[i]) ? 3 : 2;
}

/* Mode, position, velocity, torque, voltage, temperature, fault: the answer to
 * drive_moteus_put_questions; 24 V, 25 degrees. */
static void moteus_answer(struct hal_can_frame *frame,
                          const struct rig_axis *axis,
                          const struct drive_turn_point *point)
{
    static const uint8_t bytes[] = { 0x21, 0x00, MOTEUS_MODE_POSITION, 0x2F,
                                     MOTEUS_POSITION };
    static const uint8_t rest[] = { 0x23, MOTEUS_VOLTAGE, 48, 25, 0 };

    *frame = (struct hal_can_frame){ .id = (uint32_t)axis->node_id << 8,
                                     .fd = true };
    frame->extended = frame->id > 0x7FF;
    for (unsigned i = 0; i < sizeof bytes; i++)
        frame->data[frame->len++] = bytes[i];
    turn_put_estimates(&frame->data[frame->len], point);
    frame->len += 12; /* and no torque */
    for (unsigned i = 0; i < sizeof rest; i++)
        frame->data[frame->len++] = rest[i];
    moteus_frame_end(frame);
}

static void moteus_expect(const struct rig *rig, unsigned i,
                          const struct motion_state *state,
                          double bits[RIG_FRAMES_MAX])
{
    const struct rig_axis *axis = &rig->axis[i];
    const struct drive_turn_point point = turn_point_of(axis, state);
    const struct rig_bus *bus = &rig->bus[axis->bus];
    const bool switched = bus->data_bit_rate > bus->bit_rate;
    struct hal_can_frame frame;

    moteus_frame_begin(&frame, axis->node_id, switched);
    drive_moteus_put_point(&frame, (uint16_t)(rig->watchdog_ns / 1000000),
                           &point);
    drive_moteus_put_questions(&frame);
    moteus_frame_end(&frame);
    bits[0] = turn_frame_bits(bus, &frame);
    moteus_answer(&frame, axis, &point);
    frame.switched = switched;
    bits[1] = turn_frame_bits(bus, &frame);
    bits[2] = 0;
    if (moteus_asks_current(axis)) {
        struct rig_frame most[RIG_FRAMES_MAX];

        (void)moteus_frames(rig, i, most);
        bits[2] = most[2].bits;
    }
}

const struct rig_kind rig_kind_moteus = {
    .code_max = UINT8_MAX,
    .is_for = moteus_is_for,
    .read = moteus_read,
    .reports_torque = true,
    .readings = moteus_readings,
    .torque_in_nm = true,
    .cannot_home = "a moteus, which has no homing of its own",
    .frames = moteus_frames,
    .expect = moteus_expect,
};
