/* motion/plan/plan_track.h - segments of a track on the heap, as many as needed.
 *
 * The functions of motion/ write into room that the caller gave and say
 * MOTION_E_FULL when it is too little, with the track as it was.  Whoever calls
 * them here makes more room then and asks again:
 *
 *     do
 *         err = motion_...(track, ...);
 *     while (err == MOTION_E_FULL && plan_track_grow(track) == MOTION_OK); */
#ifndef MOTION_PLAN_PLAN_TRACK_H
#define MOTION_PLAN_PLAN_TRACK_H

#include "motion/core/track.h"

/* Most segments of one track. */
#define PLAN_TRACK_MAX 4000000

/* Empty, at a position, without room; free with plan_track_free (move.h). */
void plan_track_init(struct motion_track *track, int64_t pos_q32);
/* Twice the room; MOTION_E_FULL when there is no memory, or above
 * PLAN_TRACK_MAX; the track is unchanged then. */
int plan_track_grow(struct motion_track *track);
/* Room for so many segments, as far as there is memory: what begins anew when
 * it is full begins less often. */
void plan_track_reserve(struct motion_track *track, size_t segments);
/* Give back what is not used. */
void plan_track_trim(struct motion_track *track);
/* Stand still until `end_ns_q12`, if that is later.  MOTION_E_FULL,
 * MOTION_E_RANGE. */
int plan_track_wait(struct motion_track *track, int64_t end_ns_q12);

/* A hash of every bit that decides what a sample is: two plans of a move are the
 * same where their hashes are.  Not against an adversary. */
uint64_t plan_track_hash(const struct motion_track *track);
/* One more value into a hash, which begins with PLAN_HASH_START. */
#define PLAN_HASH_START UINT64_C(14695981039346656037)
uint64_t plan_hash_add(uint64_t hash, int64_t value);

#endif
