/* firmware/host/move/move_edit_order.h - keys that edits let pass each other, in
 * the order of their times; for move_edit.c alone. */
#ifndef FIRMWARE_HOST_MOVE_MOVE_EDIT_ORDER_H
#define FIRMWARE_HOST_MOVE_MOVE_EDIT_ORDER_H

#include "firmware/host/move/move_edit.h"

struct edit {
    struct yaml_text yaml;
    const struct move_text_source *source;
    const struct move_edit *edit;
    uint32_t edits;
};

/* The list of the keys of an axis in its text. */
int move_edit_axis_keys(const struct edit *self, const char *axis,
                        struct yaml_value *keys);
/* How many keys of the axis are before the time; NULL: 0. */
uint32_t move_edit_before(const struct plan_axis *axis, double t_s);

/* After the edits, of which `text` is what they made: the places of keys that
 * passed each other are exchanged. */
int move_edit_order(const struct edit *self, struct move_text *text);

#endif
