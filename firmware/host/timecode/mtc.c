/* firmware/host/timecode/mtc.c - see mtc.h. */
#include "firmware/host/timecode/mtc.h"

#include "firmware/host/base/timecode.h"

#define MTC_QUARTER_FRAME 0xF1
#define MTC_REAL_TIME     0xF8 /* this and above */
#define MTC_PIECES        8

/* Of all eight.  False: no time of day. */
static bool mtc_number(struct mtc *self)
{
    static const unsigned fps[4] = { 24, 25, 30, 30 };
    const uint8_t *piece = self->piece;
    const unsigned type = piece[7] >> 1 & 3;
    uint64_t frames;
    if (!timecode_count(
            (piece[7] & 1u) << 4 | piece[6], (unsigned)piece[5] << 4 | piece[4],
            (unsigned)piece[3] << 4 | piece[2], (piece[1] & 1u) << 4 | piece[0],
            fps[type], type == 2, &frames))
        return false;
    self->last = (struct mtc_mark){ .quarters = 4 * frames + MTC_PIECES - 1,
                                    .fps = fps[type],
                                    .drop = type == 2 };
    return true;
}

static bool mtc_piece(struct mtc *self, uint8_t data, struct mtc_mark *mark)
{
    const unsigned which = data >> 4;
    const bool was_whole = self->count == MTC_PIECES;
    if (which != self->next)
        self->count = 0;
    self->next = (which + 1) % MTC_PIECES;
    self->piece[which] = data & 15;
    if (self->count == 0 && which != 0)
        return false; /* a number begins with the first */
    if (self->count < MTC_PIECES)
        self->count++;
    if (self->count < MTC_PIECES)
        return false;
    if (which == MTC_PIECES - 1 && !mtc_number(self)) {
        self->count = 0;
        return false;
    }
    if (which != MTC_PIECES - 1 || !was_whole)
        self->last.quarters += which != MTC_PIECES - 1;
    *mark = self->last;
    return true;
}

bool mtc_take(struct mtc *self, uint8_t byte, struct mtc_mark *mark)
{
    if (byte >= MTC_REAL_TIME)
        return false;
    if (byte >= 0x80) {
        self->data_follows = byte == MTC_QUARTER_FRAME;
        return false;
    }
    if (!self->data_follows)
        return false;
    self->data_follows = false; /* a system message has no running status */
    return mtc_piece(self, byte, mark);
}
