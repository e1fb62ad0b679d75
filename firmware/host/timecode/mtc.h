/* firmware/host/timecode/mtc.h - MIDI timecode: bytes to frames.
 *
 * Quarter frames, F1 0nnndddd: eight of them, a quarter of a frame apart, carry
 * the number of the frame in which the first was sent, so that a number is
 * complete every two frames.  From then on each quarter frame is a mark.  Bytes
 * of other messages are passed over; real-time messages may stand within one.
 * Source: MIDI 1.0 detailed specification, MIDI Time Code (RP-004). */
#ifndef FIRMWARE_HOST_TIMECODE_MTC_H
#define FIRMWARE_HOST_TIMECODE_MTC_H

#include <stdbool.h>
#include <stdint.h>

struct mtc_mark {
    uint64_t quarters; /* of frames since midnight, those that are left out in
                          drop-frame timecode not counted */
    unsigned fps;      /* whole: 24, 25 or 30 */
    bool drop;
};

struct mtc {
    bool data_follows; /* of a quarter frame */
    uint8_t piece[8];
    unsigned count; /* of pieces in order, at most 8 */
    unsigned next;  /* that is to come */
    struct mtc_mark last;
};

/* All zero at first.  True: *mark is the quarter frame that ends with this
 * byte. */
bool mtc_take(struct mtc *self, uint8_t byte, struct mtc_mark *mark);

#endif
