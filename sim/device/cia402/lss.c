/* sim/device/cia402/lss.c - the node number set from outside.  Source: CiA 305.
 *
 * A new number is in force after reset communication; a device without one
 * takes it when it leaves the configuration state.  The bit rate cannot be
 * changed: this maker's error 1. */
#include "sim/device/cia402/parts.h"

#define LSS_BOOT_NS INT64_C(1000000)

static void cia402_lss_answer(struct sim_cia402 *self, uint8_t command,
                              uint32_t value)
{
    const uint8_t data[8] = { command, (uint8_t)value, (uint8_t)(value >> 8),
                              (uint8_t)(value >> 16), (uint8_t)(value >> 24) };

    cia402_com_send(self, 0x7E4, data, 8);
}

static uint32_t cia402_lss_part(const struct sim_cia402 *self, unsigned part)
{
    return self->value[CIA402_VENDOR + (int)part];
}

static uint32_t cia402_lss_value(const struct hal_can_frame *frame)
{
    return cia402_sdo_get_u32(&frame->data[1]);
}

static void cia402_lss_leave(struct sim_cia402 *self)
{
    self->lss.configuring = false;
    if (self->config.node_id != CIA402_NO_NODE || self->lss.node_next == 0 ||
        self->lss.node_next == CIA402_NO_NODE)
        return;
    self->config.node_id = self->lss.node_next;
    cia402_od_reset(self, true);
    cia402_com_boot_in(self, LSS_BOOT_NS);
}

static void cia402_lss_switch_all(struct sim_cia402 *self,
                                  const struct hal_can_frame *frame)
{
    if (frame->data[1] == 1)
        self->lss.configuring = true;
    else if (self->lss.configuring)
        cia402_lss_leave(self);
}

/* Vendor, product, revision, serial, in this order. */
static void cia402_lss_switch(struct sim_cia402 *self,
                              const struct hal_can_frame *frame)
{
    unsigned part = frame->data[0] - 0x40u;

    if (part == 0)
        self->lss.matched = 0;
    if (part != self->lss.matched ||
        cia402_lss_value(frame) != cia402_lss_part(self, part)) {
        self->lss.matched = 0;
        return;
    }
    self->lss.matched++;
    if (part < 3)
        return;
    self->lss.matched = 0;
    self->lss.configuring = true;
    cia402_lss_answer(self, 0x44, 0);
}

/* Only for a device without number: is it us, in the bits from `bit` up? */
static void cia402_lss_scan(struct sim_cia402 *self,
                            const struct hal_can_frame *frame)
{
    uint8_t bit = frame->data[5], part = frame->data[6], next = frame->data[7];

    if (self->config.node_id != CIA402_NO_NODE || self->lss.configuring ||
        part > 3 || next > 3)
        return;
    if (bit == 128) {
        self->lss.scan_part = 0;
        cia402_lss_answer(self, 0x4F, 0);
        return;
    }
    if (bit > 31 || part != self->lss.scan_part ||
        (cia402_lss_value(frame) ^ cia402_lss_part(self, part)) >> bit != 0)
        return;
    cia402_lss_answer(self, 0x4F, 0);
    if (bit == 0 && next != part) {
        self->lss.scan_part = next;
        self->lss.configuring = next < part;
    }
}

static void cia402_lss_set_node(struct sim_cia402 *self, uint8_t id)
{
    bool legal = (id >= 1 && id <= 127) || id == CIA402_NO_NODE;

    if (legal)
        self->lss.node_next = id;
    cia402_lss_answer(self, 0x11, legal ? 0 : 1);
}

static void cia402_lss_configure(struct sim_cia402 *self,
                                 const struct hal_can_frame *frame)
{
    uint8_t command = frame->data[0];

    if (command == 0x11) {
        cia402_lss_set_node(self, frame->data[1]);
    } else if (command == 0x13) {
        cia402_lss_answer(self, 0x13, 1);
    } else if (command == 0x17) {
        if (self->lss.node_next != 0)
            self->lss.node_stored = self->lss.node_next;
        cia402_lss_answer(self, 0x17, 0);
    } else if (command >= 0x5A && command <= 0x5D) {
        cia402_lss_answer(self, command,
                          cia402_lss_part(self, command - 0x5Au));
    } else if (command == 0x5E) {
        cia402_lss_answer(self, 0x5E, self->config.node_id);
    }
}

void cia402_lss_request(struct sim_cia402 *self,
                        const struct hal_can_frame *frame)
{
    uint8_t command = frame->data[0];

    if (frame->len != 8)
        return;
    if (command == 0x04)
        cia402_lss_switch_all(self, frame);
    else if (command >= 0x40 && command <= 0x43)
        cia402_lss_switch(self, frame);
    else if (command == 0x51)
        cia402_lss_scan(self, frame);
    else if (self->lss.configuring)
        cia402_lss_configure(self, frame);
}
