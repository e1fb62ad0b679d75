/* tests/hal/drive/cia402/quirk_servo.c - objects, SDO, PDO, NMT of the servo
 * with quirks.  See quirk_servo.h. */
#include "tests/hal/drive/cia402/quirk_servo.h"

#include <math.h>
#include <string.h>

#include "sim/util.h"

#define MS     INT64_C(1000000)
#define LOOP   INT64_C(250000)
#define OFF    UINT32_C(0x80000000)
#define NO_RTR UINT32_C(0x40000000)

static const struct {
    uint16_t index;
    uint8_t sub, size;
    bool read_only;
    uint32_t value;
} quirk_dictionary[] = {
    { 0x1000, 0, 4, true, 0x00020192 }, { 0x1001, 0, 1, true, 0 },
    { 0x1005, 0, 4, false, 0x80 },      { 0x1006, 0, 4, false, 0 },
    { 0x100C, 0, 2, false, 0 },         { 0x100D, 0, 1, false, 0 },
    { 0x1016, 1, 4, false, 0 },         { 0x1017, 0, 2, false, 0 },
    { 0x1018, 1, 4, true, 0x5A },       { 0x1018, 2, 4, true, 0x1000 },
    { 0x3006, 0x3D, 2, false, 0 },      { 0x6007, 0, 2, false, 1 },
    { 0x603F, 0, 2, true, 0 },          { 0x6040, 0, 2, false, 0 },
    { 0x6041, 0, 2, true, 0 },          { 0x605A, 0, 2, false, 2 },
    { 0x605B, 0, 2, false, 0 },         { 0x605C, 0, 2, false, 1 },
    { 0x605D, 0, 2, false, 1 },         { 0x605E, 0, 2, false, 2 },
    { 0x6060, 0, 1, false, 0 },         { 0x6061, 0, 1, true, 0 },
    { 0x6064, 0, 4, true, 0 },          { 0x6065, 0, 4, false, 2000 },
    { 0x6066, 0, 2, false, 0 },         { 0x607A, 0, 4, false, 0 },
    { 0x607C, 0, 4, false, 0 },         { 0x607D, 1, 4, false, 0 },
    { 0x607D, 2, 4, false, 0 },         { 0x6081, 0, 4, false, 10000 },
    { 0x6083, 0, 4, false, 200000 },    { 0x6084, 0, 4, false, 200000 },
    { 0x6085, 0, 4, false, 1000000 },   { 0x6098, 0, 1, false, 0 },
    { 0x6099, 1, 4, false, 10000 },     { 0x6099, 2, 4, false, 1000 },
    { 0x609A, 0, 4, false, 500000 },    { 0x60C1, 1, 4, false, 0 },
    { 0x60C2, 1, 1, false, 1 },         { 0x60C2, 2, 1, false, 0xFD },
    { 0x60FD, 0, 4, true, 0 },          { 0x60FF, 0, 4, false, 0 },
    { 0x6502, 0, 4, true, 0xA5 },       { 0x67FF, 0, 4, true, 0x00020192 },
};

/* ---- axes ---------------------------------------------------------------- */

/* Which axis an object is of, and where the first has its like. */
static unsigned quirk_axis_of(uint32_t key, uint32_t *own)
{
    const unsigned index = key >> 8;
    unsigned axis = 0, further = 0;

    if (index >= 0x6000 && index < 0xA000) {
        axis = (index - 0x6000) / 0x800;
        further = axis * 0x800;
    } else if (index >= 0x1400 && index < 0x1C00) {
        axis = (index & 0x1FF) / 64;
        further = axis * 64;
    }
    *own = key - (further << 8);
    return axis;
}

/* Has this one to answer for it?  The first for what nobody has. */
static bool quirk_is_own(const struct quirk_servo *servo, uint32_t key,
                         uint32_t *own)
{
    const unsigned axis = quirk_axis_of(key, own);

    if (servo->kind->axes == 0 || axis >= servo->kind->axes)
        *own = key;
    if (servo->kind->axes == 0)
        return true;
    return axis == servo->kind->axis ||
           (axis >= servo->kind->axes && servo->kind->axis == 0);
}

/* Of an entry of a map. */
static uint32_t quirk_mapped(const struct quirk_servo *servo, uint32_t entry)
{
    uint32_t own;

    return quirk_is_own(servo, entry >> 8, &own) ? own : 0;
}

/* ---- objects ------------------------------------------------------------- */

struct quirk_object *quirk_servo_object(struct quirk_servo *servo, uint32_t key)
{
    for (unsigned i = 0; i < servo->objects; i++)
        if (servo->object[i].key == key)
            return &servo->object[i];
    return NULL;
}

uint32_t quirk_get(struct quirk_servo *servo, uint32_t key)
{
    const struct quirk_object *object = quirk_servo_object(servo, key);

    return object == NULL ? 0 : object->value;
}

void quirk_put(struct quirk_servo *servo, uint32_t key, uint32_t value)
{
    struct quirk_object *object = quirk_servo_object(servo, key);

    if (object != NULL)
        object->value = value;
}

static bool quirk_is_listed(const uint32_t *list, unsigned capacity,
                            uint32_t key)
{
    for (unsigned i = 0; i < capacity && list[i] != 0; i++)
        if (list[i] == key)
            return true;
    return false;
}

static void quirk_add(struct quirk_servo *servo, uint32_t key, uint8_t size,
                      bool read_only, uint32_t value)
{
    const struct quirk_kind *kind = servo->kind;

    if (quirk_is_listed(kind->missing, ARRAY_LEN(kind->missing), key) ||
        (kind->guarding && (key >> 8 == 0x1016 || key >> 8 == 0x1017)) ||
        (!kind->ip_needs_3006 && key >> 8 == 0x3006) ||
        (kind->axes == 0 && key >> 8 == 0x67FF))
        return;
    read_only |=
        quirk_is_listed(kind->read_only, ARRAY_LEN(kind->read_only), key);
    for (unsigned i = 0; i < ARRAY_LEN(kind->initial); i++)
        if (kind->initial[i].key == key)
            value = kind->initial[i].value;
    servo->object[servo->objects++] =
        (struct quirk_object){ key, size, read_only, value };
}

/* As after power on: nothing has been saved. */
static void quirk_fill(struct quirk_servo *servo)
{
    static const uint32_t cob[2][4] = { { 0x200, 0x300, 0x400, 0x500 },
                                        { 0x180, 0x280, 0x380, 0x480 } };

    servo->objects = 0;
    for (unsigned i = 0; i < ARRAY_LEN(quirk_dictionary); i++)
        quirk_add(servo,
                  QUIRK_KEY(quirk_dictionary[i].index, quirk_dictionary[i].sub),
                  quirk_dictionary[i].size, quirk_dictionary[i].read_only,
                  quirk_dictionary[i].value);
    for (unsigned k = 0; k < 4; k++) {
        const unsigned rx = 0x1400 + k, tx = 0x1800 + k;
        const bool other = servo->kind->axis > 0;

        quirk_add(servo, QUIRK_KEY(rx, 1), 4, false,
                  other ? OFF : cob[0][k] + servo->id);
        quirk_add(servo, QUIRK_KEY(rx, 2), 1, false, 255);
        quirk_add(servo, QUIRK_KEY(tx, 1), 4, false,
                  other ? OFF | NO_RTR
                        : NO_RTR | (k > 0 ? OFF : 0) | (cob[1][k] + servo->id));
        quirk_add(servo, QUIRK_KEY(tx, 2), 1, false, 255);
        quirk_add(servo, QUIRK_KEY(tx, 3), 2, false, 10);
        for (unsigned map = 0; map < 2; map++) {
            const unsigned at = (map == 0 ? 0x1600 : 0x1A00) + k;

            quirk_add(servo, QUIRK_KEY(at, 0), 1, false, 1);
            quirk_add(servo, QUIRK_KEY(at, 1), 4, false,
                      map == 0 ? 0x60400010 : 0x60410010);
            for (uint8_t n = 2; n <= 4; n++)
                quirk_add(servo, QUIRK_KEY(at, n), 4, false, 0);
        }
    }
}

/* ---- what may be written --------------------------------------------------- */

static bool quirk_is_valid(struct quirk_servo *servo, unsigned index)
{
    return (quirk_get(servo, QUIRK_KEY(index, 1)) & OFF) == 0;
}

static uint32_t quirk_map_bits(struct quirk_servo *servo, unsigned index,
                               uint32_t count)
{
    uint32_t bits = 0;

    for (uint32_t n = 1; n <= count; n++)
        bits += quirk_get(servo, QUIRK_KEY(index, n)) & 0xFF;
    return bits;
}

/* 0x16xx and 0x1Axx: only while the PDO is off and its map is empty. */
static uint32_t quirk_judge_map(struct quirk_servo *servo, unsigned index,
                                uint8_t sub, uint32_t value)
{
    const struct quirk_object *object =
        quirk_servo_object(servo, quirk_mapped(servo, value));

    if (quirk_is_valid(servo, index - 0x200))
        return 0x08000022;
    if (sub == 0)
        return value > 4                                  ? 0x06090031
               : quirk_map_bits(servo, index, value) > 64 ? 0x06040042
                                                          : 0;
    if (quirk_get(servo, QUIRK_KEY(index, 0)) != 0)
        return 0x06010000;
    return object == NULL || object->size * 8u != (value & 0xFF) ? 0x06040041
                                                                 : 0;
}

/* "It is not allowed to change bits 0 to 29 while the PDO exists." */
static uint32_t quirk_judge_cob(struct quirk_servo *servo, uint32_t key,
                                uint32_t value)
{
    const uint32_t now = quirk_get(servo, key);

    const bool transmits = key >> 8 >= 0x1800;

    if ((servo->kind->cob_bit_30 != 0 && ((now ^ value) & NO_RTR) != 0) ||
        (servo->kind->tpdo_bit_30 && transmits && (value & NO_RTR) == 0) ||
        (servo->kind->rpdo_no_bit_30 && !transmits && (value & NO_RTR) != 0))
        return 0x06090030;
    if ((now & OFF) == 0 && ((now ^ value) & 0x1FFFFFFF) != 0)
        return 0x08000022;
    if ((value & OFF) == 0 && (value & 0x1FFFFFFF) <= 0x180)
        return 0x06090030; /* restricted: CiA 301 table 40 */
    return 0;
}

static uint32_t quirk_judge(struct quirk_servo *servo, uint32_t key,
                            uint32_t value)
{
    const unsigned index = key >> 8;
    const uint8_t sub = key & 0xFF;

    for (unsigned i = 0; i < ARRAY_LEN(servo->kind->only); i++)
        if (servo->kind->only[i].key == key && key != 0 &&
            servo->kind->only[i].value != value)
            return servo->kind->only[i].abort;
    if ((index & 0xFFFC) == 0x1600 || (index & 0xFFFC) == 0x1A00)
        return quirk_judge_map(servo, index, sub, value);
    if (((index & 0xFFFC) == 0x1400 || (index & 0xFFFC) == 0x1800) && sub == 1)
        return quirk_judge_cob(servo, key, value);
    if ((index & 0xFFFC) == 0x1800 && sub == 3 && quirk_is_valid(servo, index))
        return 0x06090030;
    if (index == 0x6060)
        return quirk_write_mode(servo, (int8_t)value);
    if (index == 0x605A && (int16_t)value > 8)
        return 0x06090031;
    return 0;
}

static uint32_t quirk_write(struct quirk_servo *servo, uint32_t key,
                            unsigned size, uint32_t value)
{
    struct quirk_object *object = quirk_servo_object(servo, key);
    uint32_t abort;

    if (object == NULL) {
        for (uint8_t sub = 0; sub < 8; sub++)
            if (quirk_servo_object(servo, (key & ~UINT32_C(0xFF)) | sub))
                return 0x06090011;
        return 0x06020000;
    }
    if (object->read_only)
        return 0x06010002;
    if (object->size != size)
        return 0x06070010;
    abort = quirk_judge(servo, key, value);
    if (abort != 0)
        return abort;
    object->value = value;
    if (key >> 8 == 0x6040)
        quirk_take_word(servo, (uint16_t)value);
    quirk_set_target(servo, key);
    if (key >> 8 == 0x1016)
        servo->heard_ns = servo->kind->watches_late ? 0 : servo->now_ns;
    return 0;
}

/* ---- SDO ----------------------------------------------------------------- */

void quirk_send(struct quirk_servo *servo, uint32_t id, const void *data,
                unsigned len)
{
    struct hal_can_frame frame = { .id = id, .len = (uint8_t)len };

    memcpy(frame.data, data, len);
    (void)hal_can_send(&servo->port.can, &frame);
}

void quirk_emergency(struct quirk_servo *servo, uint16_t code)
{
    const uint8_t data[8] = { (uint8_t)code, (uint8_t)(code >> 8), 1 };

    quirk_send(servo, 0x80u + servo->id, data, 8);
}

static uint32_t quirk_u32(const uint8_t *at, unsigned size)
{
    uint32_t value = 0;

    for (unsigned i = size; i-- > 0;)
        value = value << 8 | at[i];
    return value;
}

static uint32_t quirk_refuses(struct quirk_servo *servo, uint32_t key)
{
    const struct quirk_kind *kind = servo->kind;

    if (kind->passing.key == key && servo->passed < kind->passing.times) {
        servo->passed++;
        return kind->passing.abort;
    }
    for (unsigned i = 0; i < ARRAY_LEN(kind->refuses); i++)
        if (kind->refuses[i].key == key)
            return kind->refuses[i].abort;
    return 0;
}

static bool quirk_is_mute(const struct quirk_servo *servo, uint8_t command,
                          uint32_t key)
{
    return servo->kind->cob_mute && command != 0x40 && (key & 0xFF) == 1 &&
           (key >> 10 == 0x1400 >> 2 || key >> 10 == 0x1800 >> 2);
}

/* What is set for the node is so for each axis. */
static void quirk_overhear(struct quirk_servo *servo, uint32_t key,
                           const struct hal_can_frame *frame)
{
    const unsigned size = 4 - (frame->data[0] >> 2 & 3);

    if (key < QUIRK_KEY(0x1400, 0) && (frame->data[0] & 0xE3) == 0x23)
        (void)quirk_write(servo, key, size, quirk_u32(frame->data + 4, size));
}

/* Answer in the order of the requests. */
static void quirk_reply(struct quirk_servo *servo,
                        const struct hal_can_frame *frame)
{
    const unsigned one_in = servo->kind->late_one_in;
    const unsigned last = servo->answers - 1;
    int64_t due_ns = servo->now_ns + servo->kind->sdo_ns;

    if (servo->answers == QUIRK_ANSWERS)
        return;
    if (one_in != 0 && servo->answers > 0)
        due_ns = servo->answer[last].due_ns + servo->kind->sdo_ns;
    if (one_in != 0 && ++servo->answered % one_in == 0)
        due_ns += servo->kind->late_ns;
    servo->answer[servo->answers].frame = *frame;
    servo->answer[servo->answers++].due_ns = due_ns;
}

static void quirk_segment(struct quirk_servo *servo)
{
    const struct quirk_object *object = &servo->segment;
    struct hal_can_frame to = { .id = 0x580u + servo->id, .len = 8 };

    to.data[0] = (uint8_t)((7 - object->size) << 1 | 1);
    for (unsigned i = 0; i < object->size; i++)
        to.data[1 + i] = (uint8_t)(object->value >> 8 * i);
    quirk_reply(servo, &to);
}

static void quirk_sdo(struct quirk_servo *servo,
                      const struct hal_can_frame *frame)
{
    const uint8_t command = frame->data[0];
    uint32_t key = QUIRK_KEY(quirk_u32(frame->data + 1, 2), frame->data[3]);
    const bool is_own = quirk_is_own(servo, key, &key);
    const struct quirk_object *object = quirk_servo_object(servo, key);
    struct hal_can_frame to = { .id = 0x580u + servo->id, .len = 8 };
    uint32_t value = 0, abort = 0;

    if ((command & 0xE0) == 0x60) {
        quirk_segment(servo);
        return;
    }
    if (!is_own) {
        quirk_overhear(servo, key, frame);
        return;
    }
    if (frame->len != 8 || command == 0x80 ||
        quirk_is_mute(servo, command, key))
        return;
    abort = quirk_refuses(servo, key);
    memcpy(to.data, frame->data, 4);
    quirk_put(servo, QUIRK_KEY(0x6041, 0), quirk_status(servo));
    if (abort != 0) {
        ;
    } else if (command == 0x40 && object != NULL &&
               servo->kind->reads != QUIRK_EXPEDITED) {
        to.data[0] = servo->kind->reads == QUIRK_SEGMENTS ? 0x41 : 0x40;
        value = servo->kind->reads == QUIRK_SEGMENTS ? object->size : 0;
        servo->segment = *object;
    } else if (command == 0x40 && object != NULL) {
        to.data[0] = (uint8_t)(0x43 | (4 - object->size) << 2);
        value = object->value;
    } else if (command == 0x40) {
        abort = quirk_write(servo, key, 4, 0); /* which is not there */
    } else if ((command & 0xE3) == 0x23) {
        const unsigned size = 4 - (command >> 2 & 3);

        abort = quirk_write(servo, key, size, quirk_u32(frame->data + 4, size));
        to.data[0] = 0x60;
    } else {
        abort = 0x05040001;
    }
    if (abort != 0)
        to.data[0] = 0x80;
    for (unsigned i = 0; i < 4; i++)
        to.data[4 + i] = (uint8_t)((abort != 0 ? abort : value) >> 8 * i);
    quirk_reply(servo, &to);
}

static void quirk_answer(struct quirk_servo *servo)
{
    while (servo->answers > 0 && servo->answer[0].due_ns <= servo->now_ns) {
        (void)hal_can_send(&servo->port.can, &servo->answer[0].frame);
        servo->requested = false;
        memmove(servo->answer, servo->answer + 1,
                --servo->answers * sizeof servo->answer[0]);
    }
}

/* ---- PDO ----------------------------------------------------------------- */

static void quirk_rpdo(struct quirk_servo *servo, unsigned k,
                       const struct hal_can_frame *frame)
{
    const unsigned map = 0x1600 + k;
    const uint32_t count = quirk_get(servo, QUIRK_KEY(map, 0));
    const uint8_t *at = frame->data;

    if (frame->len * 8u < quirk_map_bits(servo, map, count)) {
        quirk_emergency(servo, 0x8210);
        return;
    }
    for (uint32_t n = 1; n <= count; n++) {
        const uint32_t entry = quirk_get(servo, QUIRK_KEY(map, n));
        const unsigned size = (entry & 0xFF) / 8;

        const uint32_t key = quirk_mapped(servo, entry);

        quirk_put(servo, key, quirk_u32(at, size));
        quirk_set_target(servo, key);
        if (key >> 8 == 0x6040)
            quirk_take_word(servo, (uint16_t)quirk_u32(at, size));
        at += size;
    }
}

static void quirk_tpdo(struct quirk_servo *servo, unsigned k)
{
    const unsigned map = 0x1A00 + k, com = 0x1800 + k;
    const uint32_t count = quirk_get(servo, QUIRK_KEY(map, 0));
    const uint32_t type = quirk_get(servo, QUIRK_KEY(com, 2));
    const int64_t inhibit_ns = quirk_get(servo, QUIRK_KEY(com, 3)) * MS / 10;
    uint8_t data[8] = { 0 };
    unsigned len = 0;

    if (!quirk_is_valid(servo, com) || type < 1 || type > 240 ||
        servo->now_ns - servo->sent_ns < inhibit_ns - MS / 2 || servo->muted)
        return;
    for (uint32_t n = 1; n <= count; n++) {
        const uint32_t entry = quirk_get(servo, QUIRK_KEY(map, n));
        const uint32_t value = quirk_get(servo, quirk_mapped(servo, entry));

        for (unsigned i = 0; i < (entry & 0xFF) / 8; i++)
            data[len++] = (uint8_t)(value >> 8 * i);
    }
    servo->sent_ns = servo->now_ns;
    quirk_send(servo, quirk_get(servo, QUIRK_KEY(com, 1)) & 0x7FF, data, len);
}

static void quirk_sync(struct quirk_servo *servo)
{
    if (servo->nmt != 5)
        return;
    for (unsigned k = 0; k < 4; k++)
        if (servo->rpdo_waits[k]) {
            servo->rpdo_waits[k] = false;
            quirk_rpdo(servo, k, &servo->rpdo[k]);
        }
    quirk_latch_bits(servo);
    quirk_put(servo, QUIRK_KEY(0x6041, 0), quirk_status(servo));
    for (unsigned k = 0; k < 4; k++)
        quirk_tpdo(servo, k);
}

static void quirk_take_rpdo(struct quirk_servo *servo,
                            const struct hal_can_frame *frame)
{
    for (unsigned k = 0; k < 4; k++) {
        const uint32_t cob = quirk_get(servo, QUIRK_KEY(0x1400 + k, 1));

        if ((cob & OFF) != 0 || (cob & 0x7FF) != frame->id || servo->nmt != 5)
            continue;
        if (quirk_get(servo, QUIRK_KEY(0x1400 + k, 2)) > 240) {
            quirk_rpdo(servo, k, frame);
            continue;
        }
        servo->rpdo[k] = *frame;
        servo->rpdo_waits[k] = true;
    }
}

/* ---- NMT, heartbeat, guarding -------------------------------------------- */

static void quirk_boot(struct quirk_servo *servo)
{
    const uint8_t beat = 0x7F, up = 0;

    quirk_fill(servo);
    if (servo->kind->beats_first)
        quirk_send(servo, 0x700u + servo->id, &beat, 1);
    if (servo->kind->axis == 0)
        quirk_send(servo, 0x700u + servo->id, &up, 1);
    servo->requested = false;
    servo->nmt = 0x7F;
    servo->toggle = 0;
    servo->heard_ns = servo->guarded_ns = 0;
    memset(servo->rpdo_waits, 0, sizeof servo->rpdo_waits);
    servo->connection_lost = false;
    servo->needs_nmt = false;
    if (servo->kind->emcy_at_boot)
        quirk_emergency(servo, 0x3130);
}

/* The power section goes on through a reset of the communication. */
static void quirk_restart(struct quirk_servo *servo, bool power)
{
    servo->nmt = 0;
    servo->answers = 0;
    servo->boot_ns = servo->now_ns + 5 * MS;
    if (power)
        quirk_enter(servo, QUIRK_NOT_READY);
}

static void quirk_nmt(struct quirk_servo *servo, const uint8_t *data)
{
    if (data[1] != 0 && data[1] != servo->id)
        return;
    if (servo->nmt == 4 && servo->kind->wakes_by != 0 &&
        data[0] != servo->kind->wakes_by)
        return;
    if (data[0] == 1 && servo->starts++ < servo->kind->starts_ignored)
        return;
    if (data[0] == 1) {
        servo->nmt = 5;
        servo->started_unset |= !quirk_is_valid(servo, 0x1400) ||
                                !quirk_is_valid(servo, 0x1800) ||
                                quirk_get(servo, QUIRK_KEY(0x6060, 0)) == 0;
    } else if (data[0] == 2)
        servo->nmt = 4;
    else if (data[0] == 0x80)
        servo->nmt = 0x7F;
    else if (data[0] == 0x81 || data[0] == 0x82)
        quirk_restart(servo, data[0] == 0x81);
}

static void quirk_guard(struct quirk_servo *servo)
{
    const uint8_t data = servo->nmt | servo->toggle;

    quirk_send(servo, 0x700u + servo->id, &data, 1);
    servo->toggle ^= 0x80;
    servo->guarded_ns = servo->now_ns;
}

static void quirk_watch(struct quirk_servo *servo)
{
    const uint32_t consumer = quirk_get(servo, QUIRK_KEY(0x1016, 1));
    const int64_t most_ns = (int64_t)(consumer & 0xFFFF) * MS;
    const int64_t life_ns = (int64_t)quirk_get(servo, QUIRK_KEY(0x100C, 0)) *
                            quirk_get(servo, QUIRK_KEY(0x100D, 0)) * MS;

    if ((most_ns > 0 && servo->heard_ns > 0 &&
         servo->now_ns - servo->heard_ns > most_ns) ||
        (servo->kind->guarding && life_ns > 0 && servo->guarded_ns > 0 &&
         servo->now_ns - servo->guarded_ns > life_ns))
        quirk_lose_connection(servo);
}

static void quirk_beat(struct quirk_servo *servo)
{
    const int64_t period_ns =
        (int64_t)quirk_get(servo, QUIRK_KEY(0x1017, 0)) * MS;

    if (period_ns == 0 || servo->kind->axis > 0 ||
        servo->now_ns - servo->beat_ns < period_ns)
        return;
    servo->beat_ns = servo->now_ns;
    quirk_send(servo, 0x700u + servo->id, &servo->nmt, 1);
}

static void quirk_hear(void *context, const struct hal_can_frame *frame)
{
    struct quirk_servo *servo = context;
    const uint32_t consumer = quirk_get(servo, QUIRK_KEY(0x1016, 1));

    servo->now_ns = frame->t_ns;
    if (servo->nmt == 0)
        return;
    if (frame->id == 0x600u + servo->id && frame->data[0] != 0x80) {
        servo->crowded += servo->requested;
        servo->requested = true;
    } else if (frame->id == 0x580u + servo->id) {
        servo->requested = false;
    }
    if (frame->remote) {
        if (frame->id == 0x700u + servo->id && servo->kind->guarding)
            quirk_guard(servo);
    } else if (frame->id == 0 && frame->len == 2) {
        quirk_nmt(servo, frame->data);
    } else if (frame->id == 0x80) {
        quirk_sync(servo);
    } else if (frame->id == 0x600u + servo->id && servo->nmt != 4 &&
               !servo->deaf) {
        quirk_sdo(servo, frame);
    } else if (frame->id == 0x700u + (consumer >> 16 & 0x7F)) {
        servo->heard_ns = servo->now_ns;
        servo->connection_lost = false;
    } else {
        quirk_take_rpdo(servo, frame);
    }
}

/* ---- in the world ---------------------------------------------------------- */

static int64_t quirk_due(const struct sim_member *member)
{
    return CONTAINER_OF_CONST(member, struct quirk_servo, member)->due_ns;
}

static void quirk_happen(struct quirk_servo *servo)
{
    const struct quirk_kind *kind = servo->kind;

    if (kind->event == QUIRK_NOTHING || servo->event_done ||
        servo->state != QUIRK_OPERATION ||
        servo->now_ns - servo->operation_ns < kind->event_ns)
        return;
    servo->event_done = true;
    if (kind->event == QUIRK_LEAVES) {
        quirk_enter(servo, QUIRK_DISABLED);
        servo->coasted = false; /* its own doing */
    } else if (kind->event == QUIRK_EMCY)
        quirk_emergency(servo, 0x8130);
    else if (kind->event == QUIRK_REBOOTS)
        quirk_restart(servo, true);
    else if (kind->event == QUIRK_NMT_DROP)
        servo->nmt = 0x7F;
    else if (kind->event == QUIRK_MUTE || kind->event == QUIRK_DEAF)
        servo->muted = true;
    servo->deaf = kind->event == QUIRK_DEAF;
}

static void quirk_run(struct sim_member *member, int64_t now_ns)
{
    struct quirk_servo *servo =
        CONTAINER_OF(member, struct quirk_servo, member);

    servo->now_ns = now_ns;
    servo->due_ns = now_ns + LOOP;
    if (servo->nmt == 0 && now_ns >= servo->boot_ns)
        quirk_boot(servo);
    if (servo->nmt != 0) {
        quirk_answer(servo);
        quirk_beat(servo);
        quirk_watch(servo);
        quirk_happen(servo);
    }
    quirk_power_step(servo);
    quirk_put(servo, QUIRK_KEY(0x6064, 0),
              (uint32_t)(int32_t)lround(servo->pos - servo->zero));
}

int quirk_servo_init(struct quirk_servo *servo, struct sim_can_bus *bus,
                     uint8_t id, const struct quirk_kind *kind)
{
    static const struct sim_member_ops ops = { quirk_due, quirk_run };

    memset(servo, 0, sizeof *servo);
    servo->member.ops = &ops;
    servo->kind = kind;
    servo->id = id;
    servo->now_ns = servo->due_ns = bus->world->now_ns;
    servo->boot_ns = servo->now_ns + 5 * MS + kind->boot_ns;
    servo->pos = 123456;
    servo->home_place = 120000;
    quirk_fill(servo);
    sim_can_port_init(&servo->port, bus);
    servo->port.on_frame = quirk_hear;
    servo->port.context = servo;
    return sim_world_add(bus->world, &servo->member);
}
