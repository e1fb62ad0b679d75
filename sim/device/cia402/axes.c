/* sim/device/cia402/axes.c - several axes behind one node: which objects are
 * whose.  Source: CiA 301 7.5.2.1 (multiple device modules), CiA 402-2. */
#include "sim/device/cia402/parts.h"

#define AXES          8
#define AXES_OBJECTS  0x800
#define AXES_PDOS     64
#define AXES_PDO_KIND 0x200 /* 0x1400, 0x1600, 0x1800, 0x1A00 */

struct sim_cia402 *cia402_axes_first(const struct sim_cia402 *self)
{
    return self->first;
}

bool cia402_axes_is_first(const struct sim_cia402 *self)
{
    return self->first == self;
}

/* How far it is from the first axis's; 0: of the node. */
static unsigned axes_apart(uint16_t index)
{
    if (index >= 0x6000 && index < 0x6000 + AXES * AXES_OBJECTS)
        return AXES_OBJECTS;
    return index >= 0x1400 && index < 0x1C00 ? 1 : 0;
}

static unsigned axes_of(uint16_t index)
{
    return axes_apart(index) == 1 ? index % AXES_PDO_KIND / AXES_PDOS
                                  : (index - 0x6000u) / AXES_OBJECTS;
}

/* Of an axis that is not there: the first says so. */
static bool axes_has(const struct sim_cia402 *self, unsigned axis)
{
    const struct sim_cia402 *at = cia402_axes_first(self);

    while (at != NULL && at->config.axis != axis)
        at = at->next;
    return at != NULL;
}

bool cia402_axes_take(const struct sim_cia402 *self, uint16_t *index)
{
    const unsigned apart = axes_apart(*index);

    if (apart == 0)
        return cia402_axes_is_first(self);
    if (axes_of(*index) == self->config.axis) {
        *index = (uint16_t)(*index - (apart == 1 ? AXES_PDOS : AXES_OBJECTS) *
                                         self->config.axis);
        return true;
    }
    if (!cia402_axes_is_first(self) || axes_has(self, axes_of(*index)))
        return false;
    *index = 0; /* nobody has it */
    return true;
}

uint16_t cia402_axes_index(const struct sim_cia402 *self, uint16_t index)
{
    const unsigned apart = axes_apart(index);

    if (apart == 0)
        return index;
    return (uint16_t)(index + (apart == 1 ? AXES_PDOS : AXES_OBJECTS) *
                                  self->config.axis);
}

uint8_t cia402_axes_errors(const struct sim_cia402 *self)
{
    uint8_t errors = 0;

    for (self = cia402_axes_first(self); self != NULL; self = self->next)
        errors |= (uint8_t)self->value[CIA402_ERROR_REGISTER];
    return errors;
}

bool cia402_axes_is_legal(const struct sim_cia402_config *config)
{
    const struct sim_cia402 *at = config->with;

    if (config->axis >= AXES || (at != NULL && at->config.with != NULL) ||
        (at != NULL && at->config.node_id != config->node_id))
        return false;
    for (; at != NULL; at = at->next)
        if (at->config.axis == config->axis)
            return false;
    return true;
}

void cia402_axes_join(struct sim_cia402 *self)
{
    struct sim_cia402 *at = self->config.with;

    self->first = at != NULL ? at : self;
    while (at != NULL && at->next != NULL)
        at = at->next;
    if (at != NULL)
        at->next = self;
}
