/* firmware/host/move/move_edit.h - edits of a move's text: keys that move, come
 * and go, and values anywhere.
 *
 * All edits of a list are of the text as it is, indices of keys too.  Values are
 * texts as a file has them; where one is a number without a unit, it gets that of
 * the axis, or s, if the value that it replaces has a unit. */
#ifndef FIRMWARE_HOST_MOVE_MOVE_EDIT_H
#define FIRMWARE_HOST_MOVE_MOVE_EDIT_H

#include "firmware/host/move/move_text.h"

enum move_edit_kind {
    MOVE_EDIT_KEY,    /* fields of a key; a value NULL takes one out */
    MOVE_EDIT_ADD,    /* a key, with its fields */
    MOVE_EDIT_REMOVE, /* a key */
    MOVE_EDIT_SET,    /* the value at a path of names and indices */
};

#define MOVE_EDIT_FIELDS 12
#define MOVE_EDIT_PATH   8

struct move_edit_field {
    const char *name, *value;
};

struct move_edit {
    enum move_edit_kind kind;
    const char *axis;
    uint32_t key;
    double t_s; /* the time that it gets, where that is a number; else NaN */
    struct move_edit_field field[MOVE_EDIT_FIELDS];
    unsigned fields;
    const char *path[MOVE_EDIT_PATH]; /* SET; value: field[0] */
    unsigned paths;
    /* Keys of another curve than an axis's (a weight, the warp): the path is that of the
     * map with its keys, and their values are in `unit`; NULL: those of the axis.  They
     * are not put in order. */
    const struct plan_axis *curve;
    const char
        *unit; /* "%", "deg" or "s"; SET: of a number, where the value before
                         has one; NULL: it stands as it is */
};

/* The edits in the text of source->path, of which source->was was read; keys of
 * an axis that would pass each other are put in the order of their times.  With
 * source->text the file is not read again.  0, or
 * -1 with the sentence written and nothing allocated; move_text_free. */
int move_edit_apply(const struct move_text_source *source,
                    const struct move_edit edit[], uint32_t edits,
                    struct move_text *text);

#endif
