/* hal/mcu/map.c - see map.h. */
#include "hal/mcu/map.h"

#include <stddef.h>

#include "hal/support/crc32.h"

#define RATIO_MAX INT64_C(1000000000)
#define NS_MAX    (INT64_C(3600) * 1000000000)

/* --- where the values are ------------------------------------------------- */

struct map_place {
    uint16_t offset;
    uint8_t size; /* bytes; 8: with a sign */
    uint32_t max; /* where there is no sign */
};

/* `inner` places one after the other, `outer` times. */
struct map_section {
    uint16_t offset;
    uint16_t outer, outer_step, inner, inner_step;
    const struct map_place *place;
    uint8_t count;
};

#define PLACE(type, member, max)                                               \
    {                                                                          \
        offsetof(struct type, member), sizeof((struct type *)0)->member, max   \
    }
#define SIZE(member) (sizeof((struct modbus_map *)0)->member)
#define SECTION(at, outer, outer_step, inner, inner_step, places)              \
    {                                                                          \
        offsetof(struct modbus_map, at), outer, outer_step, inner, inner_step, \
            places, sizeof(places) / sizeof(places)[0]                         \
    }

static const struct map_place map_head[] = {
    PLACE(modbus_map, line.baud, MODBUS_RTU_BAUD_MAX),
    PLACE(modbus_map, line.parity, MODBUS_PARITY_NONE),
    PLACE(modbus_map, line.stop_bits, 2),
    PLACE(modbus_map, line.gap_ns, 0),
    PLACE(modbus_map, turnaround_ns, 0),
    PLACE(modbus_map, timeout_ns, 0),
    PLACE(modbus_map, watchdog_ns, 0),
    PLACE(modbus_map, registers_max, HAL_MODBUS_WRITE_MAX),
    PLACE(modbus_map, resolution, 0),
    PLACE(modbus_map, item_count, MODBUS_MAP_ITEMS_MAX),
    PLACE(modbus_map, position, MODBUS_MAP_ITEMS_MAX - 1),
    PLACE(modbus_map, alarm, MODBUS_MAP_NO_ITEM),
};
static const struct map_place map_item[] = {
    PLACE(modbus_map_item, at, UINT16_MAX),
    PLACE(modbus_map_item, type, MODBUS_BIT),
    PLACE(modbus_map_item, order, MODBUS_DCBA),
    PLACE(modbus_map_item, read, HAL_MODBUS_READ_INPUT),
    PLACE(modbus_map_item, write, HAL_MODBUS_WRITE_MANY),
    PLACE(modbus_map_item, poll, MODBUS_POLL_MONITOR),
};
static const struct map_place map_condition[] = {
    PLACE(modbus_map_condition, item, MODBUS_MAP_NO_ITEM),
    PLACE(modbus_map_condition, mask, UINT32_MAX),
    PLACE(modbus_map_condition, equals, UINT32_MAX),
};
static const struct map_place map_group[] = {
    PLACE(modbus_map_group, at, UINT16_MAX),
    PLACE(modbus_map_group, count, MODBUS_MAP_FIELDS_MAX),
    PLACE(modbus_map_group, registers, 2 * MODBUS_MAP_FIELDS_MAX),
};
static const struct map_place map_field[] = {
    PLACE(modbus_map_field, type, MODBUS_F32),
    PLACE(modbus_map_field, order, MODBUS_DCBA),
    PLACE(modbus_map_field, quantity, MODBUS_DECELERATION),
    PLACE(modbus_map_field, unit, MODBUS_MS_PER_1000_RPM),
    PLACE(modbus_map_field, constant, 0),
    PLACE(modbus_map_field, num, 0),
    PLACE(modbus_map_field, den, 0),
    PLACE(modbus_map_field, min, 0),
    PLACE(modbus_map_field, max, 0),
};
static const struct map_place map_sequence[] = {
    PLACE(modbus_map_sequence, count, MODBUS_MAP_STEPS_MAX),
};
static const struct map_place map_step[] = {
    PLACE(modbus_map_step, kind, MODBUS_STEP_CHECK),
    PLACE(modbus_map_step, item, MODBUS_MAP_NO_ITEM),
    PLACE(modbus_map_step, status, MODBUS_STATUS_COUNT - 1),
    PLACE(modbus_map_step, value, 0),
    PLACE(modbus_map_step, dur_ns, 0),
};

static const struct map_section map_section[] = {
    { 0, 1, 0, 1, 0, map_head, sizeof map_head / sizeof map_head[0] },
    SECTION(item, 1, 0, MODBUS_MAP_ITEMS_MAX, SIZE(item[0]), map_item),
    SECTION(identify, 1, 0, 1, 0, map_condition),
    SECTION(status, 1, 0, MODBUS_STATUS_COUNT, SIZE(status[0]), map_condition),
    SECTION(move, 1, 0, 1, 0, map_group),
    SECTION(move.field, 1, 0, MODBUS_MAP_FIELDS_MAX, SIZE(move.field[0]),
            map_field),
    SECTION(stream, 1, 0, 1, 0, map_group),
    SECTION(stream.field, 1, 0, MODBUS_MAP_FIELDS_MAX, SIZE(stream.field[0]),
            map_field),
    SECTION(sequence, 1, 0, MODBUS_SEQUENCE_COUNT, SIZE(sequence[0]),
            map_sequence),
    SECTION(sequence[0].step, MODBUS_SEQUENCE_COUNT, SIZE(sequence[0]),
            MODBUS_MAP_STEPS_MAX, SIZE(sequence[0].step[0]), map_step),
};

/* The place of a value, and the offset of the place.  A PC looks on its tick,
 * which does not divide. */
static const struct map_place *map_find(unsigned index, size_t *offset)
{
    for (unsigned i = 0; i < sizeof map_section / sizeof map_section[0]; i++) {
        const struct map_section *section = &map_section[i];
        const unsigned row = (unsigned)section->inner * section->count;
        const unsigned all = section->outer * row;

        if (index < all) {
            unsigned outer = 0, inner = 0;
            for (; index >= row; index -= row)
                outer++;
            for (; index >= section->count; index -= section->count)
                inner++;
            *offset = section->offset + (size_t)outer * section->outer_step +
                      (size_t)inner * section->inner_step +
                      section->place[index].offset;
            return &section->place[index];
        }
        index -= all;
    }
    return NULL;
}

int64_t mcu_map_get(const struct modbus_map *map, unsigned index)
{
    size_t offset = 0;
    const struct map_place *place = map_find(index, &offset);
    const void *at = (const char *)map + offset;

    if (place == NULL)
        return 0;
    switch (place->size) {
    case 1:
        return *(const uint8_t *)at;
    case 2:
        return *(const uint16_t *)at;
    case 4:
        return *(const uint32_t *)at;
    default:
        return *(const int64_t *)at;
    }
}

bool mcu_map_set(struct modbus_map *map, unsigned index, int64_t value)
{
    size_t offset = 0;
    const struct map_place *place = map_find(index, &offset);
    void *at = (char *)map + offset;

    if (place == NULL ||
        (place->size < 8 && (value < 0 || value > (int64_t)place->max)))
        return false;
    switch (place->size) {
    case 1:
        *(uint8_t *)at = (uint8_t)value;
        break;
    case 2:
        *(uint16_t *)at = (uint16_t)value;
        break;
    case 4:
        *(uint32_t *)at = (uint32_t)value;
        break;
    default:
        *(int64_t *)at = value;
    }
    return true;
}

uint32_t mcu_map_crc(const struct modbus_map *map)
{
    uint32_t crc = 0;

    for (unsigned i = 0; i < MCU_MAP_VALUES; i++) {
        const uint64_t value = (uint64_t)mcu_map_get(map, i);
        uint8_t byte[8];

        for (unsigned k = 0; k < 8; k++)
            byte[k] = (uint8_t)(value >> 8 * k);
        crc = crc32_of(crc, byte, sizeof byte);
    }
    return crc;
}

/* --- what they may be ----------------------------------------------------- */

static bool map_is_time(int64_t dur_ns)
{
    return dur_ns >= 0 && dur_ns <= NS_MAX;
}

static bool map_head_is_sound(const struct modbus_map *map)
{
    return map_is_time(map->line.gap_ns) && map_is_time(map->turnaround_ns) &&
           map_is_time(map->timeout_ns) && map_is_time(map->watchdog_ns) &&
           map->registers_max >= 2 && map->resolution >= 1 &&
           map->resolution <= RATIO_MAX && map->position < map->item_count &&
           (map->alarm < map->item_count || map->alarm == MODBUS_MAP_NO_ITEM);
}

static bool map_item_is_sound(const struct modbus_map_item *item)
{
    const bool is_bit = item->type == MODBUS_BIT;
    const uint8_t one = is_bit ? HAL_MODBUS_WRITE_COIL : HAL_MODBUS_WRITE;
    const uint8_t many =
        is_bit ? HAL_MODBUS_WRITE_COILS : HAL_MODBUS_WRITE_MANY;

    return item->at + modbus_map_registers(item->type) <= UINT16_MAX + 1u &&
           item->read >= (is_bit ? HAL_MODBUS_READ_COILS : HAL_MODBUS_READ) &&
           item->read <=
               (is_bit ? HAL_MODBUS_READ_DISCRETE : HAL_MODBUS_READ_INPUT) &&
           (item->write == one || item->write == many);
}

static bool map_condition_is_sound(const struct modbus_map *map,
                                   const struct modbus_map_condition *condition)
{
    return condition->item < map->item_count ||
           condition->item == MODBUS_MAP_NO_ITEM;
}

static bool map_field_is_sound(const struct modbus_map_field *field)
{
    int64_t min = INT32_MIN, max = INT32_MAX; /* F32: beyond 2^24 in steps */

    if (field->quantity == MODBUS_CONST)
        return field->constant >= INT32_MIN && field->constant <= UINT32_MAX;
    if (field->type != MODBUS_F32)
        modbus_map_range(field->type, &min, &max);
    return field->num >= 1 && field->num <= RATIO_MAX && field->den >= 1 &&
           field->den <= RATIO_MAX && field->min >= min && field->max <= max &&
           field->min <= field->max;
}

static bool map_group_is_sound(const struct modbus_map_group *group)
{
    unsigned registers = 0;

    for (unsigned i = 0; i < group->count; i++) {
        if (!map_field_is_sound(&group->field[i]))
            return false;
        registers += modbus_map_registers(group->field[i].type);
    }
    return registers == group->registers &&
           group->at + registers <= UINT16_MAX + 1u;
}

static bool map_sequence_is_sound(const struct modbus_map *map,
                                  const struct modbus_map_sequence *sequence)
{
    for (unsigned i = 0; i < sequence->count; i++) {
        const struct modbus_map_step *step = &sequence->step[i];
        const bool has_item =
            step->kind == MODBUS_STEP_WRITE || step->kind == MODBUS_STEP_CHECK;

        if ((has_item && step->item >= map->item_count) ||
            !map_is_time(step->dur_ns))
            return false;
    }
    return true;
}

bool mcu_map_is_sound(const struct modbus_map *map)
{
    bool is_sound =
        map_head_is_sound(map) && map_condition_is_sound(map, &map->identify) &&
        map_group_is_sound(&map->move) && map_group_is_sound(&map->stream);

    for (unsigned i = 0; i < map->item_count; i++)
        is_sound = is_sound && map_item_is_sound(&map->item[i]);
    for (unsigned i = 0; i < MODBUS_STATUS_COUNT; i++)
        is_sound = is_sound && map_condition_is_sound(map, &map->status[i]);
    for (unsigned i = 0; i < MODBUS_SEQUENCE_COUNT; i++)
        is_sound = is_sound && map_sequence_is_sound(map, &map->sequence[i]);
    return is_sound;
}
