/* motion/plan/plan_track.c - see plan_track.h. */
#include "motion/plan/plan_track.h"

#include <stdlib.h>

#include "motion/core/err.h"

#define CAPACITY_FIRST 64

void plan_track_init(struct motion_track *track, int64_t pos_q32)
{
    motion_track_init(track, NULL, 0, pos_q32);
}

static int capacity_resize(struct motion_track *track, size_t capacity)
{
    struct motion_segment *segment =
        realloc(track->segment, capacity * sizeof *segment);

    if (segment == NULL)
        return MOTION_E_FULL;
    track->segment = segment;
    track->capacity = (uint32_t)capacity;
    return MOTION_OK;
}

int plan_track_grow(struct motion_track *track)
{
    const size_t capacity =
        track->capacity == 0 ? CAPACITY_FIRST : 2 * (size_t)track->capacity;

    return capacity > PLAN_TRACK_MAX ? MOTION_E_FULL
                                     : capacity_resize(track, capacity);
}

void plan_track_reserve(struct motion_track *track, size_t segments)
{
    if (segments > PLAN_TRACK_MAX)
        segments = PLAN_TRACK_MAX;
    if (segments > track->capacity)
        (void)capacity_resize(track, segments);
}

/* A block that cannot be made smaller stays as it is. */
void plan_track_trim(struct motion_track *track)
{
    if (track->count > 0 && track->count < track->capacity)
        (void)capacity_resize(track, track->count);
}

int plan_track_wait(struct motion_track *track, int64_t end_ns_q12)
{
    int err = MOTION_OK;

    while (err == MOTION_OK && track->end_ns_q12 < end_ns_q12) {
        const int64_t left = end_ns_q12 - track->end_ns_q12;
        const int64_t dur = left < MOTION_TRACK_SEGMENT_MAX_NS_Q12
                                ? left
                                : MOTION_TRACK_SEGMENT_MAX_NS_Q12;
        do
            err = motion_track_append_dwell(track, dur);
        while (err == MOTION_E_FULL && plan_track_grow(track) == MOTION_OK);
    }
    return err;
}

/* FNV-1a by words; the high half is folded in, as a product carries upwards
 * only. */
uint64_t plan_hash_add(uint64_t hash, int64_t value)
{
    hash = (hash ^ (uint64_t)value) * UINT64_C(1099511628211);
    return hash ^ hash >> 32;
}

uint64_t plan_track_hash(const struct motion_track *track)
{
    uint64_t hash = plan_hash_add(PLAN_HASH_START, track->count);

    for (uint32_t i = 0; i < track->count; i++) {
        const struct motion_segment *segment = &track->segment[i];
        hash = plan_hash_add(hash, segment->start_ns_q12);
        hash = plan_hash_add(hash, segment->dur_ns_q12);
        hash = plan_hash_add(hash, segment->pos_q32);
        for (unsigned k = 0; k <= MOTION_TRACK_DEGREE; k++)
            hash = plan_hash_add(hash, segment->coef[k]);
        hash = plan_hash_add(hash, segment->remainder);
        hash = plan_hash_add(hash, segment->frac);
    }
    hash = plan_hash_add(hash, track->end_ns_q12);
    hash = plan_hash_add(hash, track->end.pos_q32);
    hash = plan_hash_add(hash, track->end.vel_q32);
    return plan_hash_add(hash, track->end.acc_q32);
}
