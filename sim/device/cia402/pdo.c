/* sim/device/cia402/pdo.c - PDO parameters, mapping, exchange.
 *
 * Order in which the parameters may be written: COB-ID with bit 31 set,
 * mapping count 0, entries, count, then type and timers, COB-ID without bit 31.
 * Every other order is refused, as some real drives do.
 * Source: CiA 301 7.2.2, 7.5.2.35 to 7.5.2.38. */
#include <string.h>

#include "sim/device/cia402/parts.h"

#define CIA402_PDO_INVALID   0x80000000u
#define CIA402_PDO_NO_REMOTE 0x40000000u

/* Fields of a communication record, in the order of its rows. */
enum cia402_pdo_field {
    CIA402_PDO_COUNT,
    CIA402_PDO_COB,
    CIA402_PDO_TYPE,
    CIA402_PDO_INHIBIT,
    CIA402_PDO_EVENT,
    CIA402_PDO_FIELDS
};
#define CIA402_MAP_FIELDS (1 + SIM_CIA402_ENTRIES)

_Static_assert(CIA402_RPDO2_COUNT - CIA402_RPDO1_COUNT == CIA402_PDO_FIELDS &&
                   CIA402_TPDO4_EVENT - CIA402_TPDO1_COUNT ==
                       SIM_CIA402_PDOS * CIA402_PDO_FIELDS - 1,
               "communication records are alike");
_Static_assert(CIA402_RMAP2_COUNT - CIA402_RMAP1_COUNT == CIA402_MAP_FIELDS &&
                   CIA402_TMAP4_8 - CIA402_TMAP1_COUNT ==
                       SIM_CIA402_PDOS * CIA402_MAP_FIELDS - 1,
               "mapping records are alike");

/* ---- parameters -------------------------------------------------------- */

static int cia402_pdo_com_row(bool transmit, int number, int field)
{
    int first = transmit ? CIA402_TPDO1_COUNT : CIA402_RPDO1_COUNT;

    return first + number * CIA402_PDO_FIELDS + field;
}

static int cia402_pdo_map_row(bool transmit, int number, int field)
{
    int first = transmit ? CIA402_TMAP1_COUNT : CIA402_RMAP1_COUNT;

    return first + number * CIA402_MAP_FIELDS + field;
}

/* Which parameter of which PDO a row is. */
struct cia402_pdo_place {
    bool transmit, mapping;
    int number, field;
};

static struct cia402_pdo_place cia402_pdo_place(int row)
{
    struct cia402_pdo_place place = { .transmit = row >= CIA402_TPDO1_COUNT };
    int map_first = cia402_pdo_map_row(place.transmit, 0, 0);
    int first = cia402_pdo_com_row(place.transmit, 0, 0), fields;

    place.mapping = row >= map_first;
    first = place.mapping ? map_first : first;
    fields = place.mapping ? CIA402_MAP_FIELDS : CIA402_PDO_FIELDS;
    place.number = (row - first) / fields;
    place.field = (row - first) % fields;
    return place;
}

static uint32_t cia402_pdo_check_cob(uint32_t old, uint32_t value)
{
    bool was_valid = !(old & CIA402_PDO_INVALID);
    bool is_valid = !(value & CIA402_PDO_INVALID);

    if (!cia402_com_is_free_id(value &
                               ~(CIA402_PDO_INVALID | CIA402_PDO_NO_REMOTE)))
        return CIA402_ABORT_RANGE;
    if (was_valid && is_valid && old != value)
        return CIA402_ABORT_DEVICE_STATE;
    return CIA402_DONE;
}

static uint32_t cia402_pdo_check_com(const struct sim_cia402 *self, int row,
                                     uint32_t value,
                                     const struct cia402_pdo_place *place)
{
    uint32_t cob = self->value[cia402_pdo_com_row(
        place->transmit, place->number, CIA402_PDO_COB)];

    if (place->field == CIA402_PDO_COB)
        return cia402_pdo_check_cob(self->value[row], value);
    if (place->field == CIA402_PDO_TYPE && value > 240 &&
        value < (place->transmit ? 252 : 254))
        return CIA402_ABORT_RANGE;
    if (place->field == CIA402_PDO_INHIBIT && !(cob & CIA402_PDO_INVALID))
        return CIA402_ABORT_DEVICE_STATE;
    return CIA402_DONE;
}

static unsigned cia402_pdo_entry_bits(uint32_t entry)
{
    return entry & 0xFF;
}

/* The row that an entry index << 16 | sub << 8 | bits means, or -1. */
static int cia402_pdo_entry_row(const struct sim_cia402 *self, uint32_t entry,
                                uint32_t *abort_code)
{
    uint16_t index = (uint16_t)(entry >> 16);

    *abort_code = CIA402_ABORT_NOT_MAPPABLE; /* another axis's, or the node's */
    return cia402_axes_take(self, &index) || index < 0x1000
               ? cia402_od_find(index, (uint8_t)(entry >> 8), abort_code)
               : -1;
}

static uint32_t cia402_pdo_check_entry(const struct sim_cia402 *self,
                                       uint32_t entry, bool transmit)
{
    uint32_t abort_code;
    int row;

    if (entry == 0) /* nothing */
        return CIA402_DONE;
    row = cia402_pdo_entry_row(self, entry, &abort_code);
    if (row < 0)
        return abort_code;
    if (!cia402_od_is_mappable(row, transmit) ||
        cia402_pdo_entry_bits(entry) != 8 * cia402_od_size(row))
        return CIA402_ABORT_NOT_MAPPABLE;
    return CIA402_DONE;
}

static uint32_t cia402_pdo_check_count(const struct sim_cia402 *self, int row,
                                       uint32_t count)
{
    unsigned bits = 0;

    for (uint32_t i = 1; i <= count; i++) {
        uint32_t entry = self->value[row + (int)i];

        if (entry == 0)
            return CIA402_ABORT_NOT_MAPPABLE;
        bits += cia402_pdo_entry_bits(entry);
    }
    return bits > 64 ? CIA402_ABORT_PDO_LENGTH : CIA402_DONE;
}

static uint32_t cia402_pdo_check_map(const struct sim_cia402 *self, int row,
                                     uint32_t value,
                                     const struct cia402_pdo_place *place)
{
    uint32_t cob = self->value[cia402_pdo_com_row(
        place->transmit, place->number, CIA402_PDO_COB)];

    if (!(cob & CIA402_PDO_INVALID))
        return CIA402_ABORT_DEVICE_STATE;
    if (place->field == 0)
        return cia402_pdo_check_count(self, row, value);
    if (self->value[row - place->field] != 0)
        return CIA402_ABORT_ACCESS;
    return cia402_pdo_check_entry(self, value, place->transmit);
}

uint32_t cia402_pdo_check(const struct sim_cia402 *self, int row,
                          uint32_t value)
{
    struct cia402_pdo_place place = cia402_pdo_place(row);

    return place.mapping ? cia402_pdo_check_map(self, row, value, &place)
                         : cia402_pdo_check_com(self, row, value, &place);
}

static void cia402_pdo_update_one(const struct sim_cia402 *self, bool transmit,
                                  int number, struct sim_cia402_pdo *pdo)
{
    uint32_t cob =
        self->value[cia402_pdo_com_row(transmit, number, CIA402_PDO_COB)];
    int map = cia402_pdo_map_row(transmit, number, 0);

    pdo->cob_id = cob & 0x7FF;
    pdo->type =
        (uint8_t)
            self->value[cia402_pdo_com_row(transmit, number, CIA402_PDO_TYPE)];
    pdo->count = (uint8_t)self->value[map];
    pdo->active = !(cob & CIA402_PDO_INVALID) && pdo->count > 0;
    pdo->bytes = 0;
    pdo->carries_target = false;
    for (int i = 0; i < pdo->count; i++) {
        uint32_t abort_code;
        int row =
            cia402_pdo_entry_row(self, self->value[map + 1 + i], &abort_code);

        pdo->row[i] = (uint8_t)row;
        pdo->size[i] = (uint8_t)cia402_od_size(row);
        pdo->bytes = (uint8_t)(pdo->bytes + pdo->size[i]);
        pdo->carries_target |= row == CIA402_TARGET_POSITION ||
                               row == CIA402_INTERPOLATION_TARGET ||
                               row == CIA402_TARGET_VELOCITY;
    }
    if (!pdo->active)
        pdo->pending = false;
}

void cia402_pdo_update(struct sim_cia402 *self)
{
    self->event_pdos = false;
    self->rpdo_ids = 0;
    for (int i = 0; i < SIM_CIA402_PDOS; i++) {
        cia402_pdo_update_one(self, false, i, &self->rpdo[i]);
        cia402_pdo_update_one(self, true, i, &self->tpdo[i]);
        self->event_pdos |= self->tpdo[i].active && self->tpdo[i].type >= 254;
        self->rpdo_ids |= UINT32_C(1) << (self->rpdo[i].cob_id & 31);
    }
}

/* ---- RPDO -------------------------------------------------------------- */

static uint32_t cia402_pdo_get(const uint8_t *data, unsigned size)
{
    uint32_t value = 0;

    for (unsigned byte = 0; byte < size; byte++)
        value |= (uint32_t)data[byte] << 8 * byte;
    return value;
}

/* The controlword, or all the others.  Out of range: that object stays as it
 * was. */
static void cia402_pdo_put(struct sim_cia402 *self,
                           const struct sim_cia402_pdo *pdo, bool controlword)
{
    const uint8_t *data = pdo->data;

    for (unsigned i = 0; i < pdo->count; i++) {
        const int row = pdo->row[i];
        const unsigned size = pdo->size[i];

        if (!cia402_od_is_dummy(row) &&
            (row == CIA402_CONTROLWORD) == controlword)
            (void)cia402_od_put(self, row, cia402_pdo_get(data, size));
        data += size;
    }
}

/* The controlword is obeyed when all that came with it is there. */
static void cia402_pdo_apply(struct sim_cia402 *self, int number)
{
    struct sim_cia402_pdo *pdo = &self->rpdo[number];

    pdo->pending = false;
    if (pdo->carries_target) {
        self->target_fresh = true;
        self->target_timeout_ns =
            INT64_C(1000000) *
            self->value[cia402_pdo_com_row(false, number, CIA402_PDO_EVENT)];
    }
    cia402_pdo_put(self, pdo, false);
    cia402_pdo_put(self, pdo, true);
}

/* Too short: not used.  Too long: the rest is.  Reported once in a row. */
static bool cia402_pdo_check_length(struct sim_cia402 *self,
                                    struct sim_cia402_pdo *pdo, unsigned len)
{
    bool wrong = len != pdo->bytes;

    if (wrong && !pdo->wrong_length)
        cia402_com_error(self,
                         len < pdo->bytes ? CIA402_EMCY_PDO_SHORT
                                          : CIA402_EMCY_PDO_LONG,
                         CIA402_ERROR_COM);
    if (!wrong && pdo->wrong_length)
        cia402_com_error_gone(self, CIA402_ERROR_COM);
    pdo->wrong_length = wrong;
    return len >= pdo->bytes;
}

static void cia402_pdo_receive(struct sim_cia402 *self, int number,
                               const struct hal_can_frame *frame)
{
    struct sim_cia402_pdo *pdo = &self->rpdo[number];

    if (!cia402_pdo_check_length(self, pdo, frame->len))
        return;
    memcpy(pdo->data, frame->data, pdo->bytes);
    pdo->pending = true;
    if (pdo->type >= 254)
        cia402_pdo_apply(self, number);
}

void cia402_pdo_sync_in(struct sim_cia402 *self)
{
    for (int i = 0; i < SIM_CIA402_PDOS; i++)
        if (self->rpdo[i].pending)
            cia402_pdo_apply(self, i);
}

/* ---- TPDO -------------------------------------------------------------- */

/* Fills in the data; says whether they differ from the last sent. */
static bool cia402_pdo_build(const struct sim_cia402 *self,
                             struct sim_cia402_pdo *pdo)
{
    uint8_t data[8] = { 0 };
    unsigned len = 0;
    bool changed;

    for (unsigned i = 0; i < pdo->count; i++)
        for (unsigned byte = 0; byte < pdo->size[i]; byte++)
            data[len++] = (uint8_t)(self->value[pdo->row[i]] >> 8 * byte);
    changed = memcmp(data, pdo->data, sizeof(data)) != 0;
    memcpy(pdo->data, data, sizeof(data));
    return changed;
}

static void cia402_pdo_send(struct sim_cia402 *self, struct sim_cia402_pdo *pdo)
{
    pdo->sync_count = 0;
    pdo->sent_ns = cia402_now_ns(self);
    cia402_com_send(self, pdo->cob_id, pdo->data, pdo->bytes);
}

static void cia402_pdo_sync_one(struct sim_cia402 *self,
                                struct sim_cia402_pdo *pdo)
{
    bool changed;

    if (!pdo->active || pdo->type > 240)
        return;
    if (pdo->type > 0 && ++pdo->sync_count < pdo->type)
        return;
    changed = cia402_pdo_build(self, pdo);
    if (pdo->type > 0 || changed)
        cia402_pdo_send(self, pdo);
}

void cia402_pdo_sync_out(struct sim_cia402 *self)
{
    if (self->nmt_state != CIA402_NMT_OPERATIONAL)
        return;
    cia402_motion_refresh(self);
    for (unsigned i = 0; i < SIM_CIA402_PDOS; i++)
        cia402_pdo_sync_one(self, &self->tpdo[i]);
}

/* Sends nothing before its inhibit time is over. */
static bool cia402_pdo_may_send(const struct sim_cia402 *self, int number)
{
    const struct sim_cia402_pdo *pdo = &self->tpdo[number];
    const uint32_t inhibit = /* 100 us */
        self->value[cia402_pdo_com_row(true, number, CIA402_PDO_INHIBIT)];

    return pdo->active && pdo->type >= 254 &&
           cia402_now_ns(self) - pdo->sent_ns >= inhibit * INT64_C(100000);
}

static void cia402_pdo_poll_one(struct sim_cia402 *self, int number)
{
    struct sim_cia402_pdo *pdo = &self->tpdo[number];
    const uint32_t event_ms =
        self->value[cia402_pdo_com_row(true, number, CIA402_PDO_EVENT)];
    const int64_t age_ns = cia402_now_ns(self) - pdo->sent_ns;
    const bool timed_out =
        event_ms > 0 && age_ns >= event_ms * INT64_C(1000000);

    if (cia402_pdo_build(self, pdo) || timed_out)
        cia402_pdo_send(self, pdo);
}

void cia402_pdo_poll(struct sim_cia402 *self)
{
    if (!self->event_pdos || self->nmt_state != CIA402_NMT_OPERATIONAL)
        return;
    for (int i = 0; i < SIM_CIA402_PDOS; i++)
        if (cia402_pdo_may_send(self, i)) {
            cia402_motion_refresh(self);
            cia402_pdo_poll_one(self, i);
        }
}

void cia402_pdo_start(struct sim_cia402 *self)
{
    cia402_motion_refresh(self);
    for (unsigned i = 0; i < SIM_CIA402_PDOS; i++) {
        struct sim_cia402_pdo *pdo = &self->tpdo[i];

        self->rpdo[i].pending = false;
        pdo->sync_count = 0;
        if (!pdo->active || pdo->type < 254)
            continue;
        (void)cia402_pdo_build(self, pdo);
        cia402_pdo_send(self, pdo);
    }
}

static void cia402_pdo_requested(struct sim_cia402 *self, uint32_t id)
{
    for (int i = 0; i < SIM_CIA402_PDOS; i++) {
        struct sim_cia402_pdo *pdo = &self->tpdo[i];
        uint32_t cob = self->value[cia402_pdo_com_row(true, i, CIA402_PDO_COB)];

        if (!pdo->active || pdo->cob_id != id || (cob & CIA402_PDO_NO_REMOTE))
            continue;
        cia402_motion_refresh(self);
        (void)cia402_pdo_build(self, pdo);
        cia402_pdo_send(self, pdo);
    }
}

void cia402_pdo_received(struct sim_cia402 *self,
                         const struct hal_can_frame *frame)
{
    if (self->nmt_state != CIA402_NMT_OPERATIONAL)
        return;
    if (frame->remote) {
        cia402_pdo_requested(self, frame->id);
        return;
    }
    for (int i = 0; i < SIM_CIA402_PDOS; i++)
        if (self->rpdo[i].active && self->rpdo[i].cob_id == frame->id &&
            !self->loses_rpdos)
            cia402_pdo_receive(self, i, frame);
}
