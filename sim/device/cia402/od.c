/* sim/device/cia402/od.c - the object dictionary: rows, access, abort codes. */
#include <string.h>

#include "sim/device/cia402/parts.h"

enum cia402_type { U8, I8, U16, I16, U32, I32, TEXT, DOMAIN };

enum cia402_access {
    R = 1 << 0,
    W = 1 << 1,
    T = 1 << 2, /* mappable into a TPDO */
    P = 1 << 3, /* mappable into an RPDO */
    N = 1 << 4, /* the node id is added to the default */
    D = 1 << 5, /* dummy */
};

struct cia402_object {
    uint16_t index;
    uint8_t sub, type, access;
    int64_t init, min, max;
};

static const struct cia402_object cia402_object[] = {
#define CIA402_ROW_OBJECT(name, index, sub, type, access, init, min, max)      \
    { index, sub, type, access, init, min, max },
    CIA402_ROWS(CIA402_ROW_OBJECT)
#undef CIA402_ROW_OBJECT
};

#define CIA402_SEVERAL_DEVICES 0xFFFF0000u /* of 0x1000 */

_Static_assert(ARRAY_LEN(cia402_object) <= SIM_CIA402_OBJECTS_MAX,
               "SIM_CIA402_OBJECTS_MAX holds every row");

/* By the default value of a TEXT row. */
static const char *const cia402_text[] = { "slew servo", "1.0" };

static uint32_t cia402_od_ramp_default(int64_t acc_counts_s2)
{
    if (acc_counts_s2 < 1)
        return 1;
    return acc_counts_s2 > UINT32_MAX ? UINT32_MAX : (uint32_t)acc_counts_s2;
}

static void cia402_od_reset_ramps(struct sim_cia402 *self)
{
    int64_t acc_max = self->config.plant.acc_max_counts_s2;
    uint32_t profile = cia402_od_ramp_default(acc_max / 4);

    self->value[CIA402_PROFILE_ACCELERATION] = profile;
    self->value[CIA402_PROFILE_DECELERATION] = profile;
    self->value[CIA402_HOMING_ACCELERATION] = profile;
    self->value[CIA402_QUICK_STOP_DECELERATION] =
        cia402_od_ramp_default(acc_max / 2);
}

/* What 0x1010 keeps: settings, not what a master orders in passing. */
static bool cia402_od_is_parameter(int row)
{
    static const uint16_t order[] = { 0x6040, 0x6060, 0x6071, 0x607A,
                                      0x60B0, 0x60B1, 0x60B2, 0x60FF };
    const struct cia402_object *object = &cia402_object[row];

    for (unsigned i = 0; i < ARRAY_LEN(order); i++)
        if (object->index == order[i])
            return false;
    return (object->access & (R | W)) == (R | W) && object->index >= 0x1012;
}

void cia402_od_store(struct sim_cia402 *self)
{
    memcpy(self->stored, self->value, sizeof(self->stored));
    self->has_stored = true;
    self->value[CIA402_STORE] = 1; /* on command */
}

/* PDOs of another axis than the first: no identifiers, its own objects. */
static void cia402_od_reset_axis(struct sim_cia402 *self)
{
    for (unsigned row = 0; row < CIA402_ROW_COUNT && !self->has_stored; row++) {
        const uint16_t index = cia402_object[row].index & 0xFE00;
        const uint32_t value = self->value[row];

        if ((index == 0x1400 || index == 0x1800) && cia402_object[row].sub == 1)
            self->value[row] = CIA402_PDO_OFF;
        if ((index == 0x1600 || index == 0x1A00) &&
            cia402_object[row].sub > 0 && value != 0)
            self->value[row] =
                (uint32_t)cia402_axes_index(self, (uint16_t)(value >> 16))
                    << 16 |
                (value & 0xFFFF);
    }
}

void cia402_od_reset(struct sim_cia402 *self, bool communication_only)
{
    for (unsigned row = 0; row < CIA402_ROW_COUNT; row++) {
        const struct cia402_object *object = &cia402_object[row];

        if (communication_only && object->index >= 0x2000)
            continue;
        self->value[row] = (uint32_t)object->init;
        if (object->access & N)
            self->value[row] += self->config.node_id;
        if (self->has_stored && cia402_od_is_parameter((int)row))
            self->value[row] = self->stored[row];
    }
    if (!communication_only && !self->has_stored)
        cia402_od_reset_ramps(self);
    if (self->config.vendor != 0)
        self->value[CIA402_VENDOR] = self->config.vendor;
    if (self->config.product != 0)
        self->value[CIA402_PRODUCT] = self->config.product;
    if (self->config.serial != 0)
        self->value[CIA402_SERIAL] = self->config.serial;
    if (self->config.axis > 0)
        cia402_od_reset_axis(self);
    if (!communication_only && !self->has_stored)
        cia402_quirk_reset(self);
    cia402_pdo_update(self);
}

int cia402_od_find(uint16_t index, uint8_t sub, uint32_t *abort_code)
{
    *abort_code = CIA402_ABORT_NO_OBJECT;
    for (int row = 0; row < CIA402_ROW_COUNT; row++) {
        if (cia402_object[row].index != index)
            continue;
        if (cia402_object[row].sub == sub)
            return row;
        *abort_code = CIA402_ABORT_NO_SUB;
    }
    return -1;
}

void cia402_od_range(int row, int64_t *min, int64_t *max)
{
    *min = cia402_object[row].min;
    *max = cia402_object[row].max;
}

unsigned cia402_od_size(int row)
{
    static const uint8_t size[] = {
        [U8] = 1,  [I8] = 1,  [U16] = 2,  [I16] = 2,
        [U32] = 4, [I32] = 4, [TEXT] = 0, [DOMAIN] = 0,
    };

    return size[cia402_object[row].type];
}

uint16_t cia402_od_index(int row)
{
    return cia402_object[row].index;
}

uint8_t cia402_od_sub(int row)
{
    return cia402_object[row].sub;
}

/* The bytes of the object, the rest zero. */
static uint32_t cia402_od_cut(int row, uint32_t value)
{
    unsigned bytes = cia402_od_size(row);

    return bytes > 0 && bytes < 4 ? value & ((1u << 8 * bytes) - 1) : value;
}

const char *cia402_od_name(int row)
{
    static const char *const name[] = {
#define CIA402_ROW_NAME(name, index, sub, type, access, init, min, max) #name,
        CIA402_ROWS(CIA402_ROW_NAME)
#undef CIA402_ROW_NAME
    };

    return name[row];
}

unsigned cia402_od_type(int row)
{
    static const uint8_t type[] = {
        [U8] = 0x5,  [I8] = 0x2,  [U16] = 0x6,  [I16] = 0x3,
        [U32] = 0x7, [I32] = 0x4, [TEXT] = 0x9, [DOMAIN] = 0xF
    };

    return type[cia402_object[row].type];
}

const char *cia402_od_access(int row)
{
    if (!(cia402_object[row].access & W))
        return "ro";
    return cia402_object[row].access & R ? "rw" : "wo";
}

uint32_t cia402_od_default(int row)
{
    return cia402_od_cut(row, (uint32_t)cia402_object[row].init);
}

bool cia402_od_adds_node(int row)
{
    return (cia402_object[row].access & N) != 0;
}

bool cia402_od_is_dummy(int row)
{
    return (cia402_object[row].access & D) != 0;
}

bool cia402_od_is_long(int row)
{
    return cia402_object[row].type == TEXT || cia402_object[row].type == DOMAIN;
}

const uint8_t *cia402_od_bytes(const struct sim_cia402 *self, int row,
                               uint32_t *length)
{
    const char *text;

    if (cia402_object[row].type == DOMAIN) {
        *length = self->notes_length;
        return self->notes;
    }
    text = cia402_text[cia402_object[row].init];
    *length = (uint32_t)strlen(text);
    return (const uint8_t *)text;
}

uint32_t cia402_od_check_long(int row, uint32_t length)
{
    if (cia402_object[row].type != DOMAIN)
        return cia402_object[row].access & W ? CIA402_ABORT_LENGTH
                                             : CIA402_ABORT_READ_ONLY;
    return length > SIM_CIA402_NOTES ? CIA402_ABORT_TOO_LONG : CIA402_DONE;
}

void cia402_od_write_long(struct sim_cia402 *self, const uint8_t *bytes,
                          uint32_t length)
{
    memcpy(self->notes, bytes, length);
    self->notes_length = length;
}

bool cia402_od_is_mappable(int row, bool transmit)
{
    return (cia402_object[row].access & (transmit ? T | D : P | D)) != 0;
}

static int64_t cia402_od_number(int row, uint32_t value)
{
    switch (cia402_object[row].type) {
    case I8:
        return (int8_t)(uint8_t)value;
    case I16:
        return (int16_t)(uint16_t)value;
    case I32:
        return (int32_t)value;
    default:
        return value;
    }
}

int64_t cia402_od_signed(const struct sim_cia402 *self, int row)
{
    return cia402_od_number(row, self->value[row]);
}

static bool cia402_od_is_history(int row)
{
    return row >= CIA402_HISTORY_1 && row <= CIA402_HISTORY_4;
}

static bool cia402_od_is_reading(int row)
{
    return row == CIA402_CURRENT || row == CIA402_DC_LINK_VOLTAGE ||
           row == CIA402_TEMPERATURE;
}

uint32_t cia402_od_read(struct sim_cia402 *self, int row, uint32_t *value)
{
    const uint32_t refused = cia402_quirk_check(self, row, false);
    uint8_t access = cia402_object[row].access;

    if (refused != CIA402_DONE)
        return refused;
    if (access & D)
        return CIA402_ABORT_ACCESS;
    if (!(access & R))
        return CIA402_ABORT_WRITE_ONLY;
    if (cia402_od_is_history(row) &&
        cia402_object[row].sub > self->value[CIA402_HISTORY_COUNT])
        return CIA402_ABORT_NO_DATA;
    if (cia402_od_is_reading(row) && self->base.readings.missing)
        return CIA402_ABORT_NO_DATA;
    cia402_motion_refresh(self);
    *value = cia402_od_cut(row, self->value[row]);
    if (row == CIA402_ERROR_REGISTER)
        *value = cia402_axes_errors(self);
    if (row == CIA402_DEVICE_TYPE && self->next != NULL)
        *value |= CIA402_SEVERAL_DEVICES;
    return CIA402_DONE;
}

static uint32_t cia402_od_check_range(int row, uint32_t value)
{
    const struct cia402_object *object = &cia402_object[row];
    int64_t number = cia402_od_number(row, value);

    if (object->min == 0 && object->max == 0)
        return CIA402_DONE;
    if (number > object->max)
        return CIA402_ABORT_TOO_HIGH;
    return number < object->min ? CIA402_ABORT_TOO_LOW : CIA402_DONE;
}

/* Rules that a range cannot say. */
static uint32_t cia402_od_check(const struct sim_cia402 *self, int row,
                                uint32_t value)
{
    if (cia402_object[row].index < 0x2000)
        return cia402_com_check(self, row, value);
    if (row == CIA402_MODE && !cia402_mode_exists((int8_t)(uint8_t)value))
        return CIA402_ABORT_RANGE;
    if (row == CIA402_HOMING_METHOD)
        return cia402_home_check(self, (int8_t)(uint8_t)value);
    if (row == CIA402_PROBE_FUNCTION && value > 0xFF)
        return CIA402_ABORT_RANGE; /* there is no second probe */
    if (row == CIA402_INTERPOLATION_MODE && value != 0)
        return CIA402_ABORT_RANGE; /* linear alone */
    return CIA402_DONE;
}

static void cia402_od_changed(struct sim_cia402 *self, int row)
{
    if (cia402_object[row].index < 0x2000)
        cia402_com_changed(self, row);
    else if (row == CIA402_CONTROLWORD)
        cia402_power_control(self);
    else if (row == CIA402_PROBE_FUNCTION)
        cia402_inputs_probe(self);
    else if (row == CIA402_INJECT)
        sim_cia402_inject(
            self, (enum sim_cia402_fault)(self->value[CIA402_INJECT] - 1));
}

uint32_t cia402_od_put(struct sim_cia402 *self, int row, uint32_t value)
{
    uint32_t abort_code = cia402_od_check_range(row, value);

    if (abort_code == CIA402_DONE)
        abort_code = cia402_od_check(self, row, value);
    if (abort_code != CIA402_DONE)
        return abort_code;
    self->value[row] = value;
    cia402_od_changed(self, row);
    return CIA402_DONE;
}

uint32_t cia402_od_write(struct sim_cia402 *self, int row, unsigned size,
                         uint32_t value)
{
    const uint32_t refused = cia402_quirk_check(self, row, true);
    unsigned bytes = cia402_od_size(row);

    if (refused != CIA402_DONE)
        return refused;
    if (cia402_object[row].access & D)
        return CIA402_ABORT_ACCESS;
    if (!(cia402_object[row].access & W))
        return CIA402_ABORT_READ_ONLY;
    if (size != 0 && size != bytes)
        return CIA402_ABORT_LENGTH;
    return cia402_od_put(self, row, cia402_od_cut(row, value));
}
