/* hal/drive/cia402/fault.c - what went wrong, in words, latched. */
#include "hal/drive/cia402/parts.h"

#define REMOTE  0x0200
#define VOLTAGE 0x0010

#define EMCY_NS       INT64_C(100000000) /* before its statusword, at most */
#define CODE_AGAIN_NS INT64_C(50000000)

struct hal_text drive_cia402_say(struct drive_cia402 *self, const char *words)
{
    struct hal_text text;

    hal_text_init(&text, self->fault_text, sizeof self->fault_text);
    hal_text_put(&text, words);
    return text;
}

/* Without a division: 2^44 / 10^6, rounded up, is 5.5e-8 too much, so whole ms
 * below 2^38 ns come out whole, and the product fits in 63 bits. */
void drive_cia402_put_wait(struct hal_text *text, int64_t wait_ns)
{
    hal_text_put(text, " for ");
    hal_text_dec(text, (uint32_t)(wait_ns * 17592187 >> 44));
    hal_text_put(text, " ms");
}

/* fault_text has been said. */
void drive_cia402_latch(struct drive_cia402 *self)
{
    self->phase = DRIVE_CIA402_LATCHED;
    self->state = HAL_DRIVE_FAULT;
    self->request = HAL_DRIVE_REQUEST_QUICK_STOP;
    drive_cia402_modes_reset(self);
    self->preloaded = false;
    self->code_is_reason = false;
    self->code_tries = DRIVE_CIA402_TRIES;
    self->code_due_ns = self->now_ns;
    drive_cia402_drop_list(self);
}

void drive_cia402_lose(struct drive_cia402 *self, enum hal_drive_state state)
{
    drive_cia402_latch(self);
    self->phase = DRIVE_CIA402_LOST;
    self->state = state;
    self->lost_word = UINT16_MAX;
    self->lost_ns = self->lost_due_ns = self->now_ns;
    self->status_ns = 0;
    drive_cia402_search_begin(self);
}

void drive_cia402_say_fault(struct drive_cia402 *self, uint16_t code)
{
    struct hal_text text = drive_cia402_say(self, "drive fault 0x");

    self->fault_code = code;
    hal_text_hex(&text, code, 4);
    hal_text_put(&text, ": ");
    hal_text_put(&text, canopen_emcy_text(code));
}

/* An emergency that came with it has its code; one of long ago has another. */
void drive_cia402_latch_fault(struct drive_cia402 *self)
{
    drive_cia402_latch(self);
    if (self->emcy_code != 0 && self->now_ns - self->emcy_ns <= EMCY_NS) {
        drive_cia402_say_fault(self, self->emcy_code);
        return;
    }
    drive_cia402_say(self, "drive fault");
    self->code_is_reason = true;
}

bool drive_cia402_awaits_code(const struct drive_cia402 *self)
{
    const enum cia402_state power = drive_cia402_power(self);

    return self->phase == DRIVE_CIA402_LATCHED && self->fault_code == 0 &&
           self->code_tries > 0 &&
           (power == CIA402_FAULT_REACTION || power == CIA402_FAULT);
}

static void fault_has_no_code(struct drive_cia402 *self)
{
    self->code_due_ns = self->now_ns + CODE_AGAIN_NS;
    if (--self->code_tries == 0 && self->code_is_reason)
        drive_cia402_say(self, "drive fault, it gives no code");
}

/* 0x603F of this axis, which a drive may fill in a moment after its statusword. */
void drive_cia402_code_step(struct drive_cia402 *self)
{
    uint32_t code = 0;
    const int err = canopen_sdo_take(&self->node, &code, NULL);

    if (err == MOTION_OK && (uint16_t)code != 0)
        drive_cia402_say_fault(self, (uint16_t)code);
    else if (err != MOTION_E_STATE && err != MOTION_E_AGAIN)
        fault_has_no_code(self);
    else if (err == MOTION_E_STATE && self->now_ns >= self->code_due_ns)
        (void)canopen_sdo_read(&self->node, self->now_ns,
                               drive_cia402_object(self, 0x603F), 0);
}

void drive_cia402_put_status(const struct drive_cia402 *self,
                             struct hal_text *text)
{
    hal_text_put(text, ", 0x");
    hal_text_hex(text, drive_cia402_object(self, 0x6041), 4);
    hal_text_put(text, "=");
    hal_text_hex(text, self->statusword, 4);
}

/* Why it does not get on, best reason first, and what was waited for. */
void drive_cia402_latch_stuck(struct drive_cia402 *self, int64_t wait_ns)
{
    const enum cia402_state power = drive_cia402_power(self);
    struct hal_text text;

    if ((self->statusword & REMOTE) == 0) {
        text = drive_cia402_say(self, "not in remote mode");
    } else if ((self->statusword & VOLTAGE) == 0) {
        text = drive_cia402_say(self, "no power (STO or mains)");
    } else {
        text = drive_cia402_say(self, "stays in ");
        hal_text_put(&text, cia402_state_text(power));
    }
    drive_cia402_put_wait(&text, wait_ns);
    if (power == CIA402_SWITCHED_ON)
        hal_text_put(&text, " (brake)");
    drive_cia402_put_status(self, &text);
    drive_cia402_latch(self);
}

void drive_cia402_latch_left(struct drive_cia402 *self)
{
    struct hal_text text = drive_cia402_say(self, "left operation by itself: ");

    hal_text_put(&text, cia402_state_text(drive_cia402_power(self)));
    if ((self->statusword & VOLTAGE) == 0)
        hal_text_put(&text, ", no power");
    drive_cia402_put_status(self, &text);
    drive_cia402_latch(self);
}
