/* firmware/host/base/timecode.h - "00:01:00:12" as a number of frames.
 *
 *   HH:MM:SS:FF   every frame counted
 *   HH:MM:SS;FF   drop-frame, at 30000/1001 and 60000/1001 frames/s: 2 (4)
 *                 numbers are left out at the start of every minute that is not
 *                 a multiple of ten, so that it follows the wall clock
 *
 * A second has the frame rate's nearest whole number of frames from above, 24 at
 * 24000/1001.  Source: SMPTE ST 12-1, 5.2. */
#ifndef FIRMWARE_HOST_BASE_TIMECODE_H
#define FIRMWARE_HOST_BASE_TIMECODE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/base/units.h"

/* Frames from 00:00:00:00 on, below 2^36; NULL, or what is wrong with it:
 * "has 75 seconds in a minute".  fps.den > 0. */
const char *timecode_frames(const char *text, struct units_fps fps,
                            uint64_t *frames);

/* Of a number that is read as such, with `per_s` frames in its seconds; drop: 2
 * are left out where there are 30, 4 where there are 60.  False: there is no
 * such number. */
bool timecode_count(unsigned hours, unsigned minutes, unsigned seconds,
                    unsigned frame, unsigned per_s, bool drop,
                    uint64_t *frames);

#endif
