/* hal/drive/cia402/fault.c - what went wrong, in words, latched. */
#include "hal/drive/cia402/parts.h"

#define REMOTE  0x0200
#define VOLTAGE 0x0010

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
    self->fault_code_requested = false;
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
    struct hal_text text;

    self->fault_code = code;
    if (code == 0) {
        drive_cia402_say(self, "drive fault, it gives no code");
        return;
    }
    text = drive_cia402_say(self, "drive fault 0x");
    hal_text_hex(&text, code, 4);
    hal_text_put(&text, ": ");
    hal_text_put(&text, canopen_emcy_text(code));
}

void drive_cia402_latch_fault(struct drive_cia402 *self)
{
    drive_cia402_latch(self);
    drive_cia402_say_fault(self, self->emcy_code);
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
