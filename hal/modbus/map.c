/* hal/modbus/map.c - see map.h. */
#include "hal/modbus/map.h"

#include <stddef.h>

#include "hal/support/float32.h"

#define F32_WHOLE     (INT64_C(1) << 24) /* every whole number up to it */
#define BLOCK_GAP_MAX 4                  /* registers read for nothing */
#define WORD          16u                /* bits cost a sixteenth */

void modbus_map_range(enum modbus_map_type type, int64_t *min, int64_t *max)
{
    static const int64_t range[][2] = {
        [MODBUS_U16] = { 0, UINT16_MAX },
        [MODBUS_I16] = { INT16_MIN, INT16_MAX },
        [MODBUS_U32] = { 0, UINT32_MAX },
        [MODBUS_I32] = { INT32_MIN, INT32_MAX },
        [MODBUS_F32] = { -F32_WHOLE, F32_WHOLE },
        [MODBUS_BIT] = { 0, 1 },
    };

    *min = range[type][0];
    *max = range[type][1];
}

static uint16_t modbus_map_swap(uint16_t value)
{
    return (uint16_t)(value >> 8 | value << 8);
}

/* The 32 bits of a pair. */
static uint32_t modbus_map_join(enum modbus_map_order order,
                                const uint16_t *reg)
{
    const bool low_first = order == MODBUS_CDAB || order == MODBUS_DCBA;
    uint16_t high = low_first ? reg[1] : reg[0];
    uint16_t low = low_first ? reg[0] : reg[1];

    if (order == MODBUS_BADC || order == MODBUS_DCBA) {
        high = modbus_map_swap(high);
        low = modbus_map_swap(low);
    }
    return (uint32_t)high << 16 | low;
}

bool modbus_map_is_number(enum modbus_map_type type,
                          enum modbus_map_order order, const uint16_t *reg)
{
    int64_t value;

    if (type != MODBUS_F32)
        return true;
    value = modbus_map_get(type, order, reg);
    return hal_float32_is_finite(modbus_map_join(order, reg)) &&
           value >= INT32_MIN && value <= INT32_MAX;
}

int64_t modbus_map_get(enum modbus_map_type type, enum modbus_map_order order,
                       const uint16_t *reg)
{
    uint32_t value;

    if (type == MODBUS_BIT)
        return reg[0] & 1;
    if (modbus_map_registers(type) == 1)
        return type == MODBUS_I16 ? (int16_t)reg[0] : reg[0];
    value = modbus_map_join(order, reg);
    if (type == MODBUS_F32)
        return hal_float32_to_fixed(value, 0);
    return type == MODBUS_I32 ? (int32_t)value : (int64_t)value;
}

void modbus_map_set(enum modbus_map_type type, enum modbus_map_order order,
                    int64_t value, uint16_t *reg)
{
    const bool low_first = order == MODBUS_CDAB || order == MODBUS_DCBA;
    const bool swapped = order == MODBUS_BADC || order == MODBUS_DCBA;
    const uint32_t bits =
        type == MODBUS_F32 ? hal_float32_from_fixed(value, 0) : (uint32_t)value;
    uint16_t high = (uint16_t)(bits >> 16), low = (uint16_t)bits;

    if (modbus_map_registers(type) == 1) {
        reg[0] = low;
        return;
    }
    if (swapped) {
        high = modbus_map_swap(high);
        low = modbus_map_swap(low);
    }
    reg[0] = low_first ? low : high;
    reg[1] = low_first ? high : low;
}

bool modbus_map_meets(const struct modbus_map_condition *condition,
                      int64_t value)
{
    return ((uint32_t)value & condition->mask) == condition->equals;
}

const char *modbus_map_alarm_text(const struct modbus_map *map, uint32_t code)
{
    for (unsigned i = 0; i < map->alarm_count; i++)
        if (map->alarms[i].code == code)
            return map->alarms[i].text;
    return NULL;
}

void modbus_map_put_read(const struct modbus_map_item *item,
                         struct hal_modbus_request *request)
{
    request->function = item->read;
    request->address = item->at;
    request->count = (uint16_t)modbus_map_registers(item->type);
}

void modbus_map_put_write(const struct modbus_map_item *item, int64_t value,
                          struct hal_modbus_request *request)
{
    request->function = item->write;
    request->address = item->at;
    request->count = (uint16_t)modbus_map_registers(item->type);
    modbus_map_set(item->type, item->order, value, request->value);
}

/* ---- blocks ---- */

/* The item of this class and function that stands lowest at or above `from`. */
static const struct modbus_map_item *
modbus_map_next(const struct modbus_map *map, enum modbus_map_poll poll,
                uint8_t read, uint32_t from)
{
    const struct modbus_map_item *next = NULL;

    for (unsigned i = 0; i < map->item_count; i++) {
        const struct modbus_map_item *item = &map->item[i];

        if (item->poll == poll && item->read == read && item->at >= from &&
            (next == NULL || item->at < next->at))
            next = item;
    }
    return next;
}

static bool modbus_map_touches(const struct modbus_map_item *item,
                               const struct modbus_map_block *request)
{
    return item->read == request->read &&
           item->at < (uint32_t)request->at + request->count &&
           item->at + modbus_map_registers(item->type) > request->at;
}

bool modbus_map_splits(const struct modbus_map *map,
                       const struct modbus_map_block *request)
{
    for (unsigned i = 0; i < map->apart_count; i++)
        if (modbus_map_touches(&map->item[map->apart[i].item[0]], request) &&
            modbus_map_touches(&map->item[map->apart[i].item[1]], request))
            return true;
    return false;
}

static bool modbus_map_joins(const struct modbus_map *map,
                             const struct modbus_map_block *block,
                             const struct modbus_map_item *item)
{
    const uint32_t block_end = (uint32_t)block->at + block->count;
    const uint32_t item_end = item->at + modbus_map_registers(item->type);
    const uint32_t unit = item->type == MODBUS_BIT ? WORD : 1;
    const uint32_t end = item_end > block_end ? item_end : block_end;
    const struct modbus_map_block both = { block->at,
                                           (uint16_t)(end - block->at),
                                           block->read };

    return item->at <= block_end + unit * BLOCK_GAP_MAX &&
           item_end - block->at <= unit * map->registers_max &&
           !modbus_map_splits(map, &both);
}

/* Those of one function, after the `count` that are there; how many then. */
static unsigned
modbus_map_blocks_of(const struct modbus_map *map, enum modbus_map_poll poll,
                     uint8_t read, unsigned count,
                     struct modbus_map_block block[MODBUS_MAP_BLOCKS_MAX])
{
    const struct modbus_map_item *item = modbus_map_next(map, poll, read, 0);
    const unsigned before = count;

    while (item != NULL) {
        const uint32_t end = item->at + modbus_map_registers(item->type);

        if (count > before && modbus_map_joins(map, &block[count - 1], item)) {
            struct modbus_map_block *last = &block[count - 1];

            if (end > (uint32_t)last->at + last->count)
                last->count = (uint16_t)(end - last->at);
        } else if (count < MODBUS_MAP_BLOCKS_MAX) {
            block[count++] =
                (struct modbus_map_block){ item->at, (uint16_t)(end - item->at),
                                           item->read };
        } else {
            return count;
        }
        item = modbus_map_next(map, poll, read, (uint32_t)item->at + 1);
    }
    return count;
}

unsigned modbus_map_blocks(const struct modbus_map *map,
                           enum modbus_map_poll poll,
                           struct modbus_map_block block[MODBUS_MAP_BLOCKS_MAX])
{
    unsigned count = 0;

    for (unsigned read = HAL_MODBUS_READ_COILS; read <= HAL_MODBUS_READ_INPUT;
         read++)
        count = modbus_map_blocks_of(map, poll, (uint8_t)read, count, block);
    return count;
}

/* ---- time ---- */

static int64_t modbus_map_writes_ns(const struct modbus_map *map,
                                    const struct modbus_map_sequence *sequence,
                                    const struct modbus_rtu_time *time,
                                    unsigned *n)
{
    int64_t dur_ns = 0;

    for (unsigned i = 0; i < sequence->count; i++) {
        const struct modbus_map_step *step = &sequence->step[i];
        struct hal_modbus_request request = { .unit = 1 };

        if (step->kind == MODBUS_STEP_WRITE) {
            modbus_map_put_write(&map->item[step->item], step->value, &request);
            dur_ns += modbus_rtu_transaction_ns(time, &request);
            ++*n;
        }
    }
    return dur_ns;
}

/* n grows by the blocks of the class. */
static int64_t modbus_map_reads_ns(const struct modbus_map *map,
                                   enum modbus_map_poll poll,
                                   const struct modbus_rtu_time *time,
                                   unsigned *n)
{
    struct modbus_map_block block[MODBUS_MAP_BLOCKS_MAX];
    const unsigned blocks = modbus_map_blocks(map, poll, block);
    int64_t dur_ns = 0;

    for (unsigned i = 0; i < blocks; i++) {
        const struct hal_modbus_request request = {
            .unit = 1,
            .function = block[i].read,
            .address = block[i].at,
            .count = block[i].count,
        };

        dur_ns += modbus_rtu_transaction_ns(time, &request);
    }
    *n += blocks;
    return dur_ns;
}

int64_t modbus_map_monitor_ns(const struct modbus_map *map,
                              const struct modbus_rtu_time *time, unsigned *n)
{
    const unsigned before = *n;
    const int64_t dur_ns =
        modbus_map_reads_ns(map, MODBUS_POLL_MONITOR, time, n);

    return dur_ns + (*n - before) * map->turnaround_ns;
}

int64_t modbus_map_cycle_ns(const struct modbus_map *map,
                            const struct modbus_rtu_time *time, bool streamed,
                            unsigned *n)
{
    const struct hal_modbus_request request = { .unit = 1,
                                                .function =
                                                    HAL_MODBUS_WRITE_MANY,
                                                .address = map->stream.at,
                                                .count =
                                                    map->stream.registers };
    int64_t dur_ns;

    *n = 0;
    dur_ns = modbus_map_reads_ns(map, MODBUS_POLL_FAST, time, n);
    if (streamed && map->stream.count > 0) {
        dur_ns += modbus_rtu_transaction_ns(time, &request);
        ++*n;
        dur_ns += modbus_map_writes_ns(
            map, &map->sequence[MODBUS_SEQUENCE_stream_go], time, n);
    }
    return dur_ns + *n * map->turnaround_ns;
}
