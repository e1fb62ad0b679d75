/* firmware/host/exchange/import_odd.h - the row of a table that cannot be meant: an
 * exponent cut off, a wrap at half a turn, a frame twice, a row that is not there.
 *
 * Every position is foretold by a cubic through two rows on either side.  A row is odd
 * where it is further from that than the axis's limits explain and than nearly all
 * others are.  Of fewer than 16 rows, of which one disturbs half, by the speed from
 * row to row: where all that is far too fast is a turn, or one row that both neighbours
 * are far from. */
#ifndef FIRMWARE_HOST_EXCHANGE_IMPORT_ODD_H
#define FIRMWARE_HOST_EXCHANGE_IMPORT_ODD_H

#include "firmware/host/rig/rig.h"

enum import_odd_kind {
    IMPORT_ODD_NONE,
    IMPORT_ODD_OFF,      /* far from both neighbours */
    IMPORT_ODD_EXPONENT, /* the same, and a power of ten of it is not */
    IMPORT_ODD_TURN,     /* nearly a whole turn from the row before */
    IMPORT_ODD_TWICE,    /* where the row before is, while others move */
    IMPORT_ODD_MISSING,  /* twice as far from the row before as others are */
    IMPORT_ODD_STEP,     /* a jump from the row before */
};

struct import_odd {
    enum import_odd_kind kind;
    uint32_t row;  /* key, from 0 */
    uint32_t more; /* other places where rows are odd */
    int exponent;
};

/* The first odd row of an axis as it was read. */
void import_odd(const struct rig_axis *on, const struct plan_axis *axis,
                struct import_odd *odd);

/* "row 2 (line 3), 6.858 deg, is far from both neighbours, ..."; "" for none. */
#define IMPORT_ODD_MAX 320
void import_odd_text(const struct import_odd *odd, const struct rig_axis *on,
                     const struct plan_axis *axis, char text[IMPORT_ODD_MAX]);

#endif
