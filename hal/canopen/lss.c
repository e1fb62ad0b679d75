/* hal/canopen/lss.c - see lss.h.
 *
 * The scan asks for one bit of the identity after the other, from the highest:
 * "is it so far, with this bit 0?"  A device that it fits says yes; silence
 * means 1.  After bit 0 of a part a last question confirms it, and turns the
 * device's attention to the next part. */
#include "hal/canopen/lss.h"

#include "hal/canopen/sdo.h"

#define LSS_TIMEOUT_NS INT64_C(200000000)
#define LSS_SCAN_NS    INT64_C(10000000) /* silence that means no */
#define LSS_PARTS      4u

enum lss_command {
    LSS_SWITCH_ALL = 0x04,
    LSS_SET_NODE = 0x11,
    LSS_SET_BIT_RATE = 0x13,
    LSS_STORE = 0x17,
    LSS_SWITCH_VENDOR = 0x40, /* to 0x43: product, revision, serial */
    LSS_SWITCHED = 0x44,
    LSS_IDENTIFIED = 0x4F,
    LSS_SCAN = 0x51,
    LSS_REQUEST_VENDOR = 0x5A, /* to 0x5D */
    LSS_REQUEST_NODE = 0x5E,
};

void canopen_lss_init(struct canopen_lss *lss, struct canopen *master)
{
    *lss = (struct canopen_lss){ .master = master };
    master->lss = lss;
}

static int lss_send(struct canopen_lss *lss, uint8_t command, uint32_t value,
                    uint32_t more)
{
    struct hal_can_frame frame = { .id = CANOPEN_COB_LSS_REQUEST, .len = 8 };

    frame.data[0] = command;
    for (unsigned i = 0; i < 4; i++)
        frame.data[1 + i] = (uint8_t)(value >> 8 * i);
    for (unsigned i = 0; i < 3; i++)
        frame.data[5 + i] = (uint8_t)(more >> 8 * i);
    return can_cycle_send(&lss->master->cycle, &frame);
}

static bool lss_is_busy(const struct canopen_lss *lss)
{
    return lss->state != CANOPEN_LSS_IDLE;
}

int canopen_lss_switch_all(struct canopen_lss *lss, bool configure)
{
    if (lss_is_busy(lss))
        return MOTION_E_STATE;
    return lss_send(lss, LSS_SWITCH_ALL, configure, 0);
}

static int lss_start(struct canopen_lss *lss, int64_t now_ns, uint8_t command,
                     uint32_t value, uint8_t answer)
{
    int err;

    if (lss_is_busy(lss))
        return MOTION_E_STATE;
    err = lss_send(lss, command, value, 0);
    if (err != MOTION_OK)
        return err;
    lss->state = CANOPEN_LSS_WAIT;
    lss->command = answer;
    lss->deadline_ns = now_ns + LSS_TIMEOUT_NS;
    return MOTION_OK;
}

int canopen_lss_switch(struct canopen_lss *lss, int64_t now_ns,
                       const struct canopen_identity *identity)
{
    const uint32_t first[] = { identity->vendor, identity->product,
                               identity->revision };
    int err;

    if (lss_is_busy(lss))
        return MOTION_E_STATE;
    for (unsigned i = 0; i < 3; i++) {
        err = lss_send(lss, (uint8_t)(LSS_SWITCH_VENDOR + i), first[i], 0);
        if (err != MOTION_OK)
            return err;
    }
    return lss_start(lss, now_ns, LSS_SWITCH_VENDOR + 3, identity->serial,
                     LSS_SWITCHED);
}

int canopen_lss_set_node(struct canopen_lss *lss, int64_t now_ns, uint8_t id)
{
    if (id == 0 || (id > 127 && id != 255))
        return MOTION_E_ARG;
    return lss_start(lss, now_ns, LSS_SET_NODE, id, LSS_SET_NODE);
}

/* Table 0, its row. */
int canopen_lss_set_bit_rate(struct canopen_lss *lss, int64_t now_ns,
                             enum canopen_lss_bit_rate bit_rate)
{
    if ((unsigned)bit_rate > CANOPEN_LSS_10K || (unsigned)bit_rate == 5)
        return MOTION_E_ARG;
    return lss_start(lss, now_ns, LSS_SET_BIT_RATE, (uint32_t)bit_rate << 8,
                     LSS_SET_BIT_RATE);
}

int canopen_lss_store(struct canopen_lss *lss, int64_t now_ns)
{
    return lss_start(lss, now_ns, LSS_STORE, 0, LSS_STORE);
}

int canopen_lss_request_node(struct canopen_lss *lss, int64_t now_ns)
{
    return lss_start(lss, now_ns, LSS_REQUEST_NODE, 0, LSS_REQUEST_NODE);
}

int canopen_lss_request_identity(struct canopen_lss *lss, int64_t now_ns,
                                 unsigned part)
{
    if (part >= LSS_PARTS)
        return MOTION_E_ARG;
    return lss_start(lss, now_ns, (uint8_t)(LSS_REQUEST_VENDOR + part), 0,
                     (uint8_t)(LSS_REQUEST_VENDOR + part));
}

int canopen_lss_take(struct canopen_lss *lss)
{
    const int state = (int)lss->state;

    if (state == CANOPEN_LSS_WAIT || state == CANOPEN_LSS_SCAN)
        return MOTION_E_AGAIN;
    if (state == CANOPEN_LSS_IDLE)
        return MOTION_E_STATE;
    lss->state = CANOPEN_LSS_IDLE;
    lss->scan_checks = false;
    if (state == CANOPEN_LSS_REFUSED)
        return MOTION_E_REFUSED;
    return state == CANOPEN_LSS_TIMEOUT ? MOTION_E_TIMEOUT : MOTION_OK;
}

/* ---- scan ---- */

static uint32_t *lss_part(struct canopen_lss *lss, unsigned part)
{
    uint32_t *const at[] = { &lss->found.vendor, &lss->found.product,
                             &lss->found.revision, &lss->found.serial };

    return at[part];
}

/* bit 128: is anyone there at all? */
static int lss_scan_request(struct canopen_lss *lss, int64_t now_ns,
                            uint8_t bit, uint8_t next)
{
    lss->scan_heard = false;
    lss->deadline_ns = now_ns + LSS_SCAN_NS;
    return lss_send(lss, LSS_SCAN, *lss_part(lss, lss->scan_part),
                    (uint32_t)bit | (uint32_t)lss->scan_part << 8 |
                        (uint32_t)next << 16);
}

#define LSS_ANYONE  128u /* scan_bit: the first question */
#define LSS_CONFIRM 64u  /* the last of a part */

int canopen_lss_scan(struct canopen_lss *lss, int64_t now_ns)
{
    int err;

    if (lss_is_busy(lss))
        return MOTION_E_STATE;
    lss->found = (struct canopen_identity){ 0 };
    lss->scan_checks = false;
    lss->scan_part = 0;
    lss->scan_bit = LSS_ANYONE;
    err = lss_scan_request(lss, now_ns, LSS_ANYONE, 0);
    if (err == MOTION_OK)
        lss->state = CANOPEN_LSS_SCAN;
    return err;
}

/* The part is known: confirm, and on to the next. */
static void lss_scan_confirm(struct canopen_lss *lss, int64_t now_ns)
{
    const uint8_t next =
        lss->scan_part + 1u < LSS_PARTS ? (uint8_t)(lss->scan_part + 1) : 0;

    lss->scan_bit = LSS_CONFIRM;
    (void)lss_scan_request(lss, now_ns, 0, next);
}

static void lss_scan_check(struct canopen_lss *lss, int64_t now_ns)
{
    lss->state = CANOPEN_LSS_IDLE;
    lss->scan_checks = true;
    if (canopen_lss_request_identity(lss, now_ns, lss->scan_part) != MOTION_OK)
        lss->state = CANOPEN_LSS_TIMEOUT;
}

static void lss_scan_checked(struct canopen_lss *lss, int64_t now_ns)
{
    lss->scan_checks = false;
    if (lss->value != *lss_part(lss, lss->scan_part))
        lss->state = CANOPEN_LSS_TIMEOUT;
    else if (++lss->scan_part < LSS_PARTS)
        lss_scan_check(lss, now_ns);
}

static void lss_scan_next_part(struct canopen_lss *lss, int64_t now_ns)
{
    if (!lss->scan_heard) {
        lss->state = CANOPEN_LSS_TIMEOUT;
    } else if (++lss->scan_part == LSS_PARTS) {
        lss->scan_part = 0;
        lss_scan_check(lss, now_ns);
    } else {
        lss->scan_bit = 31;
        (void)lss_scan_request(lss, now_ns, 31, lss->scan_part);
    }
}

static void lss_scan_step(struct canopen_lss *lss, int64_t now_ns)
{
    if (lss->scan_bit == LSS_CONFIRM) {
        lss_scan_next_part(lss, now_ns);
    } else if (lss->scan_bit == LSS_ANYONE) {
        lss->state = lss->scan_heard ? CANOPEN_LSS_SCAN : CANOPEN_LSS_TIMEOUT;
        lss->scan_bit = 31;
        if (lss->scan_heard)
            (void)lss_scan_request(lss, now_ns, 31, 0);
    } else {
        if (!lss->scan_heard)
            *lss_part(lss, lss->scan_part) |= UINT32_C(1) << lss->scan_bit;
        if (lss->scan_bit == 0) {
            lss_scan_confirm(lss, now_ns);
            return;
        }
        lss->scan_bit--;
        (void)lss_scan_request(lss, now_ns, lss->scan_bit, lss->scan_part);
    }
}

/* ---- answers ---- */

static bool lss_has_error(uint8_t command)
{
    return command == LSS_SET_NODE || command == LSS_SET_BIT_RATE ||
           command == LSS_STORE;
}

void canopen_lss_receive(struct canopen_lss *lss,
                         const struct hal_can_frame *frame, int64_t now_ns)
{
    if (frame->len != 8) {
        lss->master->stats.malformed++;
    } else if (lss->state == CANOPEN_LSS_SCAN &&
               frame->data[0] == LSS_IDENTIFIED) {
        lss->scan_heard = true; /* judged when the time is over */
    } else if (lss->state != CANOPEN_LSS_WAIT ||
               frame->data[0] != lss->command) {
        lss->master->stats.unexpected++;
    } else if (lss_has_error(lss->command) && frame->data[1] != 0) {
        lss->error = frame->data[1];
        lss->state = CANOPEN_LSS_REFUSED;
    } else {
        lss->value = lss->command == LSS_REQUEST_NODE
                         ? frame->data[1]
                         : canopen_sdo_get_u32(&frame->data[1]);
        lss->state = CANOPEN_LSS_DONE;
        if (lss->scan_checks)
            lss_scan_checked(lss, now_ns);
    }
}

void canopen_lss_expire(struct canopen_lss *lss, int64_t now_ns)
{
    if (now_ns < lss->deadline_ns)
        return;
    if (lss->state == CANOPEN_LSS_SCAN)
        lss_scan_step(lss, now_ns);
    else if (lss->state == CANOPEN_LSS_WAIT)
        lss->state = CANOPEN_LSS_TIMEOUT;
}
