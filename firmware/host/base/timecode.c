/* firmware/host/base/timecode.c - see timecode.h. */
#include "firmware/host/base/timecode.h"

#include <stddef.h>

enum { HOURS, MINUTES, SECONDS, FRAMES, PARTS };

struct timecode {
    uint64_t part[PARTS];
    bool is_drop;
};

/* One or more digits, four of them at most (1000 frames/s). */
static const char *timecode_part(const char *at, uint64_t *value)
{
    unsigned digits = 0;
    *value = 0;
    for (; *at >= '0' && *at <= '9'; at++, digits++)
        if (digits < 4)
            *value = *value * 10 + (uint64_t)(*at - '0');
    return digits >= 1 && digits <= 4 ? at : NULL;
}

/* A colon between two parts; before the frames it may be a semicolon. */
static bool timecode_read(const char *text, struct timecode *timecode)
{
    const char *at = text;
    for (int i = 0; i < PARTS; i++) {
        if (i > 0) {
            timecode->is_drop = i == FRAMES && *at == ';';
            if (*at != ':' && !timecode->is_drop)
                return false;
            at++;
        }
        at = timecode_part(at, &timecode->part[i]);
        if (at == NULL)
            return false;
    }
    return *at == 0;
}

/* Numbers left out at the start of a minute; 0: a rate without drop-frame. */
static uint64_t timecode_dropped(struct units_fps fps)
{
    if (fps.den != 1001)
        return 0;
    return fps.num == 30000 ? 2 : fps.num == 60000 ? 4 : 0;
}

static const char *timecode_check(const struct timecode *timecode,
                                  uint64_t per_s, uint64_t dropped)
{
    const uint64_t *part = timecode->part;
    if (part[HOURS] > 99)
        return "has more than 99 hours";
    if (part[MINUTES] > 59)
        return "has more than 59 minutes in an hour";
    if (part[SECONDS] > 59)
        return "has more than 59 seconds in a minute";
    if (part[FRAMES] >= per_s)
        return "has more frames in a second than the frame rate";
    if (!timecode->is_drop)
        return NULL;
    if (dropped == 0)
        return "is drop-frame, which 30000/1001 and 60000/1001 frames/s have";
    if (part[SECONDS] == 0 && part[FRAMES] < dropped && part[MINUTES] % 10 != 0)
        return "is a number that drop-frame timecode leaves out";
    return NULL;
}

static uint64_t timecode_number(const struct timecode *timecode, uint64_t per_s,
                                uint64_t dropped)
{
    const uint64_t *part = timecode->part;
    const uint64_t minutes = part[HOURS] * 60 + part[MINUTES];
    const uint64_t all = (minutes * 60 + part[SECONDS]) * per_s + part[FRAMES];
    return timecode->is_drop ? all - dropped * (minutes - minutes / 10) : all;
}

const char *timecode_frames(const char *text, struct units_fps fps,
                            uint64_t *frames)
{
    const uint64_t per_s = (fps.num + fps.den - 1) / fps.den;
    const uint64_t dropped = timecode_dropped(fps);
    struct timecode timecode = { .is_drop = false };
    const char *wrong;
    if (!timecode_read(text, &timecode))
        return "is no timecode";
    wrong = timecode_check(&timecode, per_s, dropped);
    if (wrong != NULL)
        return wrong;
    *frames = timecode_number(&timecode, per_s, dropped);
    return NULL;
}

bool timecode_count(unsigned hours, unsigned minutes, unsigned seconds,
                    unsigned frame, unsigned per_s, bool drop, uint64_t *frames)
{
    const uint64_t dropped = per_s / 15;
    const struct timecode timecode = { { hours, minutes, seconds, frame },
                                       drop };
    if (timecode_check(&timecode, per_s, dropped) != NULL)
        return false;
    *frames = timecode_number(&timecode, per_s, dropped);
    return true;
}
