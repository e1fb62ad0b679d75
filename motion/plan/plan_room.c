/* motion/plan/plan_room.c - see plan_room.h. */
#include "motion/plan/plan_room.h"

#include <stdlib.h>

#include "motion/core/err.h"

#define ROOM_FIRST 64

void plan_room_init(struct motion_track *track, int64_t pos_q32)
{
    motion_track_init(track, NULL, 0, pos_q32);
}

static int room_resize(struct motion_track *track, size_t capacity)
{
    struct motion_segment *segment =
        realloc(track->segment, capacity * sizeof *segment);

    if (segment == NULL)
        return MOTION_E_FULL;
    track->segment = segment;
    track->capacity = (uint32_t)capacity;
    return MOTION_OK;
}

int plan_room_grow(struct motion_track *track)
{
    const size_t capacity =
        track->capacity == 0 ? ROOM_FIRST : 2 * (size_t)track->capacity;

    return capacity > PLAN_ROOM_MAX ? MOTION_E_FULL
                                    : room_resize(track, capacity);
}

void plan_room_reserve(struct motion_track *track, size_t segments)
{
    if (segments > PLAN_ROOM_MAX)
        segments = PLAN_ROOM_MAX;
    if (segments > track->capacity)
        (void)room_resize(track, segments);
}

/* A block that cannot be made smaller stays as it is. */
void plan_room_trim(struct motion_track *track)
{
    if (track->count > 0 && track->count < track->capacity)
        (void)room_resize(track, track->count);
}

int plan_room_wait(struct motion_track *track, int64_t end_ns_q12)
{
    int err = MOTION_OK;

    while (err == MOTION_OK && track->end_ns_q12 < end_ns_q12) {
        const int64_t left = end_ns_q12 - track->end_ns_q12;
        const int64_t dur = left < MOTION_TRACK_SEGMENT_MAX_NS_Q12
                                ? left
                                : MOTION_TRACK_SEGMENT_MAX_NS_Q12;
        do
            err = motion_track_append_dwell(track, dur);
        while (err == MOTION_E_FULL && plan_room_grow(track) == MOTION_OK);
    }
    return err;
}
