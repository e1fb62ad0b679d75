/* hal/drive/cia402/axis.c - one of several axes of a node: where its objects
 * are, which identifiers its PDOs have, and what the axes do together. */
#include "hal/drive/cia402/parts.h"

#define COB_ID 0x3FFFFFFFu /* with bit 29: 29 bits, never free */

/* ---- objects ------------------------------------------------------------- */

#define AXIS_OBJECTS 0x800
#define AXIS_PDOS    64

static bool object_is_of_axis(uint16_t index)
{
    return index >= 0x6000 && index < 0x6000 + AXIS_OBJECTS;
}

/* 0x1400 to 0x1BFF: parameters and maps of both kinds of PDO. */
static bool object_is_of_pdo(uint16_t index)
{
    return index >= 0x1400 && index < 0x1C00;
}

uint16_t drive_cia402_object_of(uint8_t axis, uint16_t number, uint16_t index)
{
    if (object_is_of_axis(index))
        return (uint16_t)(index + AXIS_OBJECTS * axis);
    if (!object_is_of_pdo(index))
        return index;
    return (uint16_t)(index + (number != 0 ? number - 1 : AXIS_PDOS * axis));
}

uint16_t drive_cia402_object(const struct drive_cia402 *self, uint16_t index)
{
    return drive_cia402_object_of(self->config.axis, self->config.pdo.number,
                                  index);
}

/* ---- identifiers --------------------------------------------------------- */

void drive_cia402_forget_pdo_ids(struct drive_cia402 *self)
{
    for (unsigned at = 0; at < CANOPEN_OWN_PDOS; at++) {
        self->node.rpdo_id[at] = self->config.pdo.rpdo_id[at];
        self->node.tpdo_id[at] = self->config.pdo.tpdo_id[at];
    }
}

/* The identifier that the PDO of this row has been given. */
uint16_t drive_cia402_own_pdo_id(const struct drive_cia402 *self)
{
    const uint16_t index = self->list[self->list_at].index;
    const unsigned at = index & 1;

    return index >= 0x1800 ? self->node.tpdo_id[at] : self->node.rpdo_id[at];
}

/* Another axis than the first has no predefined identifiers: the drive's own,
 * if they can be had. */
int drive_cia402_check_pdo_id(struct drive_cia402 *self, uint32_t value)
{
    const struct drive_cia402_step *step = &self->list[self->list_at];
    const bool transmits = step->index >= 0x1800;
    const bool is_off_by_us = !transmits && (step->index & 1) != 0;
    const uint32_t id = value & COB_ID;
    struct hal_text text;

    if (self->config.axis == 0 || drive_cia402_own_pdo_id(self) != 0)
        return MOTION_OK;
    if (((value & DRIVE_CIA402_COB_OFF) == 0 || is_off_by_us) &&
        canopen_pdo_id_is_free(self->node.master, &self->node, id)) {
        if (transmits)
            self->node.tpdo_id[step->index & 1] = (uint16_t)id;
        else
            self->node.rpdo_id[step->index & 1] = (uint16_t)id;
        return MOTION_OK;
    }
    text = drive_cia402_say(self, "0x");
    hal_text_hex(&text, drive_cia402_object(self, step->index), 4);
    hal_text_put(&text, ":01 is 0x");
    hal_text_hex(&text, value, 8);
    hal_text_put(&text, transmits ? ", not free: needs pdo: tx"
                                  : ", not free: needs pdo: rx");
    hal_text_put(&text, (step->index & 1) != 0 ? "2" : "");
    return MOTION_E_REFUSED;
}

/* ---- with the others ----------------------------------------------------- */

/* The next axis of the device, in a ring. */
static struct drive_cia402 *axis_sibling(const struct drive_cia402 *self)
{
    return CONTAINER_OF(self->node.sibling, struct drive_cia402, node);
}

/* The node may start when each of its axes is set up. */
int drive_cia402_check_siblings(struct drive_cia402 *self, uint32_t value)
{
    const struct drive_cia402 *other = axis_sibling(self);
    struct hal_text text;

    (void)value;
    self->is_configured = true;
    for (; other != self; other = axis_sibling(other)) {
        if (other->phase == DRIVE_CIA402_LOST) {
            text = drive_cia402_say(self, "axis ");
            hal_text_dec(&text, other->config.axis + 1u);
            hal_text_put(&text, " of node ");
            hal_text_dec(&text, self->config.node_id);
            hal_text_put(&text, " could not be set up");
            return MOTION_E_REFUSED;
        }
        if (!other->is_configured)
            return MOTION_E_AGAIN;
    }
    return MOTION_OK;
}

static bool axis_is_being_reset(const struct drive_cia402 *self)
{
    return self->phase == DRIVE_CIA402_RESET ||
           (self->phase == DRIVE_CIA402_START_UP && self->reset_by_nmt);
}

void drive_cia402_start_node_anew(struct drive_cia402 *self, int64_t now_ns)
{
    struct drive_cia402 *other = axis_sibling(self);
    bool latched;

    drive_cia402_start_anew(self, now_ns);
    for (; other != self; other = axis_sibling(other)) {
        other->reset_by_nmt = axis_is_being_reset(other);
        other->request = HAL_DRIVE_REQUEST_OFF;
        latched = other->phase == DRIVE_CIA402_LATCHED || other->was_latched;
        drive_cia402_start_anew(other, now_ns);
        other->was_latched = latched;
    }
}

bool drive_cia402_holds_sibling(const struct drive_cia402 *self)
{
    const struct drive_cia402 *other = axis_sibling(self);

    for (; other != self; other = axis_sibling(other))
        if (drive_cia402_is_watched(other) &&
            drive_cia402_power(other) >= CIA402_OPERATION_ENABLED &&
            drive_cia402_power(other) <= CIA402_FAULT_REACTION)
            return true;
    return false;
}
