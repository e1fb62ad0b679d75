/* tests/hal/drive/cia402/quirk_servo_power.c - power states, modes and motor of
 * the servo with quirks.  See quirk_servo.h. */
#include <math.h>

#include "tests/hal/drive/cia402/quirk_servo.h"

#define LOOP_S   0.00025
#define FRICTION 50000.0 /* counts/s2, with the stage off */
#define AT_SPEED 1000.0  /* counts/s: the stage must not go off above */
#define JUMP     4000.0  /* counts in one period: its own following error */
#define EVENT_NS INT64_C(20000000)

#define HALT     0x0100
#define REACHED  0x0400
#define BIT_12   0x1000
#define HOME_BIT (REACHED | BIT_12)

static double quirk_of(struct quirk_servo *servo, unsigned index)
{
    return (double)(int32_t)quirk_get(servo, QUIRK_KEY(index, 0));
}

static int16_t quirk_option(struct quirk_servo *servo, unsigned index)
{
    return (int16_t)quirk_get(servo, QUIRK_KEY(index, 0));
}

/* ---- power states -------------------------------------------------------- */

void quirk_enter(struct quirk_servo *servo, enum quirk_state state)
{
    const bool energised = state == QUIRK_OPERATION ||
                           state == QUIRK_QUICK_STOP || state == QUIRK_REACTION;

    if (servo->energised && !energised && state != QUIRK_FAULT &&
        state != QUIRK_NOT_READY && fabs(servo->vel) > AT_SPEED)
        servo->coasted = true;
    servo->energised = energised;
    servo->state = state;
    servo->state_ns = servo->now_ns;
    servo->moving = servo->homing = false;
    servo->edges = 0;
    if (state != QUIRK_OPERATION)
        return;
    servo->operation_ns = servo->now_ns;
    servo->from = servo->pos;
    quirk_set_target(servo, QUIRK_KEY(0x607A, 0));
    quirk_set_target(servo, QUIRK_KEY(0x60C1, 1));
}

static void quirk_quick_stop(struct quirk_servo *servo)
{
    quirk_enter(servo, quirk_option(servo, 0x605A) == 0 ? QUIRK_DISABLED
                                                        : QUIRK_QUICK_STOP);
}

void quirk_servo_fault(struct quirk_servo *servo, uint16_t code)
{
    if (servo->state == QUIRK_FAULT || servo->state == QUIRK_REACTION)
        return;
    servo->needs_nmt = code == 0x8130 && servo->kind->reset_by_nmt;
    quirk_put(servo, QUIRK_KEY(0x603F, 0), code);
    quirk_emergency(servo, code);
    quirk_enter(servo, servo->energised && quirk_option(servo, 0x605E) > 0
                           ? QUIRK_REACTION
                           : QUIRK_FAULT);
}

void quirk_lose_connection(struct quirk_servo *servo)
{
    const uint32_t action = quirk_get(servo, QUIRK_KEY(0x6007, 0));

    if (servo->connection_lost)
        return;
    servo->connection_lost = true;
    if (action == 1) {
        quirk_servo_fault(servo, 0x8130);
        return;
    }
    quirk_emergency(servo, 0x8130);
    if (servo->kind->stops_alone)
        servo->nmt = 4;
    if (action == 2)
        quirk_enter(servo, QUIRK_DISABLED);
    else if (action == 3 && servo->state == QUIRK_OPERATION)
        quirk_quick_stop(servo);
    else if (action == 3 && servo->state == QUIRK_ON)
        quirk_enter(servo, QUIRK_DISABLED);
}

static void quirk_reset(struct quirk_servo *servo, uint16_t before)
{
    if ((servo->word & ~before & 0x80) == 0 || servo->needs_nmt ||
        ++servo->edges <= servo->kind->resets)
        return;
    quirk_put(servo, QUIRK_KEY(0x603F, 0), 0);
    quirk_emergency(servo, 0);
    quirk_enter(servo, QUIRK_DISABLED);
}

static bool quirk_says(uint16_t word, uint16_t mask, uint16_t value)
{
    return (word & (mask | 0x80)) == value;
}

/* Transitions 2, 3, 6, 7, 10; 4 waits for the brake. */
static void quirk_walk_off(struct quirk_servo *servo)
{
    const uint16_t word = servo->word;

    if (quirk_says(word, 0x02, 0) || quirk_says(word, 0x06, 0x02)) {
        if (servo->state != QUIRK_DISABLED)
            quirk_enter(servo, QUIRK_DISABLED);
    } else if (servo->state == QUIRK_DISABLED && quirk_says(word, 0x07, 0x06)) {
        quirk_enter(servo, QUIRK_READY);
    } else if (servo->state == QUIRK_READY && servo->voltage &&
               quirk_says(word, 0x0F, 0x07)) {
        quirk_enter(servo, QUIRK_ON);
    } else if (servo->state == QUIRK_ON && quirk_says(word, 0x07, 0x06)) {
        quirk_enter(servo, QUIRK_READY);
    }
}

/* Transitions 5 and 8, by the ramp or at once, 9 and 11. */
static void quirk_walk_on(struct quirk_servo *servo)
{
    const uint16_t word = servo->word;

    if (quirk_says(word, 0x02, 0))
        quirk_enter(servo, QUIRK_DISABLED);
    else if (quirk_says(word, 0x06, 0x02))
        quirk_quick_stop(servo);
    else if (quirk_says(word, 0x0F, 0x07) &&
             (quirk_option(servo, 0x605C) == 0 || servo->vel == 0))
        quirk_enter(servo, QUIRK_ON);
    else if (quirk_says(word, 0x07, 0x06) &&
             (quirk_option(servo, 0x605B) == 0 || servo->vel == 0))
        quirk_enter(servo, QUIRK_READY);
}

static bool quirk_is_leaving(const struct quirk_servo *servo)
{
    return quirk_says(servo->word, 0x0F, 0x07) ||
           quirk_says(servo->word, 0x07, 0x06);
}

/* A rising bit 4: a new set point, or the homing. */
static void quirk_start(struct quirk_servo *servo, uint16_t before)
{
    if (servo->state != QUIRK_OPERATION || (servo->word & ~before & 0x10) == 0)
        return;
    if (servo->mode == 1) {
        servo->moving = true;
        servo->moving_ns = servo->now_ns;
        servo->moves++;
        servo->target = (int32_t)quirk_get(servo, QUIRK_KEY(0x607A, 0));
    } else if (servo->mode == 6 && !servo->kind->ignores_start) {
        servo->homing = true;
        servo->homing_ns = servo->now_ns;
        servo->moves++;
    }
}

void quirk_take_word(struct quirk_servo *servo, uint16_t word)
{
    const uint16_t before = servo->word;

    if (servo->now_ns - servo->word_ns < servo->kind->word_gap_ns)
        return;
    servo->word_ns = servo->now_ns;
    servo->word = word;
    if (servo->state == QUIRK_FAULT)
        quirk_reset(servo, before);
    else if (servo->state == QUIRK_OPERATION)
        quirk_walk_on(servo);
    else if (servo->state == QUIRK_QUICK_STOP) {
        if (quirk_says(word, 0x02, 0))
            quirk_enter(servo, QUIRK_DISABLED);
    } else if (servo->state != QUIRK_REACTION &&
               servo->state != QUIRK_NOT_READY)
        quirk_walk_off(servo);
    quirk_start(servo, before);
}

/* ---- modes --------------------------------------------------------------- */

uint32_t quirk_write_mode(struct quirk_servo *servo, int8_t mode)
{
    const uint32_t modes = quirk_get(servo, QUIRK_KEY(0x6502, 0));

    if (servo->kind->mode_not_halted && (servo->word & HALT) != 0)
        return 0x08000022;
    if (mode < 1 || (modes >> (mode - 1) & 1) == 0)
        return 0x06090030;
    if (mode == 7 && servo->kind->ip_needs_3006 &&
        quirk_get(servo, QUIRK_KEY(0x3006, 0x3D)) != 1)
        return 0x08000022;
    servo->mode = mode;
    servo->mode_ns = servo->now_ns;
    servo->moving = servo->homing = false;
    servo->from = servo->to = servo->pos;
    return 0;
}

/* 0x607D, as it counts. */
static double quirk_inside(struct quirk_servo *servo, double target)
{
    const double less =
        servo->kind->limits_minus_offset ? quirk_of(servo, 0x607C) : 0;
    const double low = (int32_t)quirk_get(servo, QUIRK_KEY(0x607D, 1)) - less;
    const double high = (int32_t)quirk_get(servo, QUIRK_KEY(0x607D, 2)) - less;

    return low >= high ? target : fmin(fmax(target, low), high);
}

/* Interpolation is on while bit 4 is up (CiA 402-2, 12). */
static bool quirk_follows(const struct quirk_servo *servo)
{
    return servo->mode == 8 || (servo->mode == 7 && (servo->word & 0x10) != 0);
}

void quirk_set_target(struct quirk_servo *servo, uint32_t key)
{
    const uint32_t of_mode =
        servo->mode == 7 ? QUIRK_KEY(0x60C1, 1) : QUIRK_KEY(0x607A, 0);

    if (key != of_mode || servo->state != QUIRK_OPERATION ||
        !quirk_follows(servo))
        return;
    servo->from = servo->pos;
    servo->to =
        quirk_inside(servo, (int32_t)quirk_get(servo, key)) + servo->zero;
    servo->to_ns = servo->now_ns;
    servo->jumps = fabs(servo->to - servo->from) > JUMP;
    if (servo->to != servo->from)
        servo->moves++;
}

/* ---- motor --------------------------------------------------------------- */

static void quirk_approach(struct quirk_servo *servo, double vel, double acc)
{
    const double step = acc * LOOP_S;

    if (servo->vel < vel)
        servo->vel = fmin(servo->vel + step, vel);
    else
        servo->vel = fmax(servo->vel - step, vel);
    servo->pos += servo->vel * LOOP_S;
}

static void quirk_go_to(struct quirk_servo *servo, double target, double vel,
                        double acc)
{
    const double rest = target - servo->pos;
    const double most = sqrt(2 * acc * 0.8 * fabs(rest));

    quirk_approach(servo, copysign(fmin(most, vel), rest), acc);
    if (fabs(target - servo->pos) < 1 && fabs(servo->vel) < AT_SPEED) {
        servo->pos = target;
        servo->vel = 0;
        servo->moving = false;
    }
}

/* At home: 6064 by the offset, in one of its meanings. */
static void quirk_home(struct quirk_servo *servo, double place)
{
    const double offset = quirk_of(servo, 0x607C);

    servo->zero = place + servo->kind->home_wrong;
    if (servo->kind->offset == QUIRK_OFFSET_PLUS)
        servo->zero -= offset;
    else if (servo->kind->offset == QUIRK_OFFSET_MINUS)
        servo->zero += offset;
    else
        servo->pos += offset, servo->zero += offset;
    servo->homing = false;
    servo->homed = true;
}

static void quirk_run_homing(struct quirk_servo *servo)
{
    const int8_t method = (int8_t)quirk_get(servo, QUIRK_KEY(0x6098, 0));
    const double fast = (double)quirk_get(servo, QUIRK_KEY(0x6099, 1));
    const double displacement = servo->home_place - servo->pos;

    if (method == 35 || method == 37) {
        quirk_home(servo, servo->pos);
    } else if ((servo->word & 0x10) == 0) {
        servo->homing = false;
    } else {
        quirk_go_to(servo, servo->home_place, fast, quirk_of(servo, 0x609A));
        if (displacement == 0 && servo->vel == 0)
            quirk_home(servo, servo->home_place);
    }
}

/* Without a new target it goes on as it went (R #288). */
static void quirk_follow(struct quirk_servo *servo)
{
    const double part = (double)(servo->now_ns - servo->to_ns) / 1e6;
    const double before = servo->pos;

    servo->pos = servo->from + (servo->to - servo->from) * part;
    servo->vel = (servo->pos - before) / LOOP_S;
}

static void quirk_operate(struct quirk_servo *servo)
{
    const double dec = quirk_of(servo, 0x6084);
    const bool halted =
        servo->mode != 8 && servo->mode != 7 && (servo->word & HALT) != 0;

    if (quirk_is_leaving(servo)) {
        quirk_approach(servo, 0, dec);
        quirk_walk_on(servo);
    } else if (halted) {
        quirk_approach(servo, 0, dec);
    } else if (quirk_follows(servo)) {
        quirk_follow(servo);
    } else if (servo->mode == 3) {
        quirk_approach(servo, quirk_of(servo, 0x60FF), dec);
    } else if (servo->mode == 6 && servo->homing) {
        quirk_run_homing(servo);
    } else if (servo->mode == 1 && servo->moving) {
        quirk_go_to(servo, servo->target + servo->zero, quirk_of(servo, 0x6081),
                    dec);
    } else {
        quirk_approach(servo, 0, dec);
    }
}

static void quirk_motor(struct quirk_servo *servo)
{
    if (servo->state == QUIRK_OPERATION)
        quirk_operate(servo);
    else
        quirk_approach(servo, 0,
                       servo->energised ? quirk_of(servo, 0x6085) : FRICTION);
}

void quirk_power_step(struct quirk_servo *servo)
{
    const struct quirk_kind *kind = servo->kind;
    const int64_t here_ns = servo->now_ns - servo->state_ns;

    if (servo->jumps)
        quirk_servo_fault(servo, 0x8611);
    servo->jumps = false;
    quirk_motor(servo);
    if (servo->now_ns - servo->mode_ns >= kind->mode_ns)
        quirk_put(servo, QUIRK_KEY(0x6061, 0), (uint8_t)servo->mode);
    servo->voltage =
        kind->precharge_ns == 0 || (servo->state > QUIRK_READY) ||
        (servo->state == QUIRK_READY && here_ns >= kind->precharge_ns);
    if (servo->state == QUIRK_NOT_READY && servo->nmt != 0) {
        quirk_enter(servo, QUIRK_DISABLED);
    } else if (servo->state == QUIRK_ON && here_ns >= kind->brake_ns &&
               quirk_says(servo->word, 0x0F, 0x0F)) {
        quirk_enter(servo, QUIRK_OPERATION);
    } else if (servo->state == QUIRK_QUICK_STOP && servo->vel == 0 &&
               quirk_option(servo, 0x605A) < 5) {
        quirk_enter(servo, kind->re_enters && (servo->word & 0x09) == 0x09
                               ? QUIRK_OPERATION
                               : QUIRK_DISABLED);
    } else if (servo->state == QUIRK_REACTION && servo->vel == 0) {
        quirk_enter(servo, QUIRK_FAULT);
    }
}

/* ---- statusword ---------------------------------------------------------- */

static uint16_t quirk_home_bits(struct quirk_servo *servo)
{
    const struct quirk_kind *kind = servo->kind;
    const int64_t since_ns = servo->now_ns - servo->homing_ns;
    uint16_t bits = 0;

    if (servo->homing && (kind->old_bits || since_ns < kind->old_bits_ns))
        return servo->homed ? HOME_BIT : REACHED;
    if (!servo->homing)
        bits = servo->homed ? HOME_BIT : REACHED;
    if (kind->no_bit_10)
        bits &= (uint16_t)~REACHED;
    return bits;
}

static bool quirk_has_event(const struct quirk_servo *servo,
                            enum quirk_event event)
{
    const int64_t since_ns =
        servo->now_ns - servo->operation_ns - servo->kind->event_ns;

    return servo->kind->event == event && servo->state == QUIRK_OPERATION &&
           since_ns >= 0 && since_ns < EVENT_NS;
}

static uint16_t quirk_mode_bits(struct quirk_servo *servo)
{
    const bool stands = servo->vel == 0;
    const bool halted = (servo->word & HALT) != 0;
    const bool old =
        servo->now_ns - servo->moving_ns < servo->kind->old_reached_ns;

    if (servo->state != QUIRK_OPERATION)
        return servo->mode == 6 && servo->homed ? BIT_12 : 0;
    switch (servo->mode) {
    case 1:
        return (uint16_t)((servo->word & 0x10 ? BIT_12 : 0) |
                          (old || (stands && (!servo->moving || halted))
                               ? REACHED
                               : 0));
    case 3:
        return (
            uint16_t)((stands ? BIT_12 : 0) |
                      (servo->vel == quirk_of(servo, 0x60FF) ? REACHED : 0));
    case 6:
        return quirk_home_bits(servo);
    case 7:
        return quirk_follows(servo) ? BIT_12 : 0;
    default:
        return quirk_has_event(servo, QUIRK_LAGS) ? 0 : BIT_12;
    }
}

void quirk_latch_bits(struct quirk_servo *servo)
{
    for (unsigned i = QUIRK_LINGER - 1; i > 0; i--)
        servo->old_status[i] = servo->old_status[i - 1];
    servo->old_status[0] = quirk_mode_bits(servo);
    servo->bits = servo->old_status[servo->kind->linger];
}

uint16_t quirk_status(const struct quirk_servo *servo)
{
    static const uint16_t word[] = {
        [QUIRK_NOT_READY] = 0x00, [QUIRK_DISABLED] = 0x40,
        [QUIRK_READY] = 0x21,     [QUIRK_ON] = 0x23,
        [QUIRK_OPERATION] = 0x27, [QUIRK_QUICK_STOP] = 0x07,
        [QUIRK_REACTION] = 0x0F,  [QUIRK_FAULT] = 0x08,
    };

    return (uint16_t)(word[servo->state] | 0x0200 | servo->kind->status |
                      (servo->voltage ? 0x10 : 0) |
                      (quirk_has_event(servo, QUIRK_WARNS) ? 0x80 : 0) |
                      (quirk_has_event(servo, QUIRK_LIMITS) ? 0x800 : 0) |
                      servo->bits);
}
