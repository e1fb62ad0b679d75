/* firmware/host/job/job_facts.h - what is known of the segments of a track, from
 * one plan of a move to the next.
 *
 * Facts about a segment that did not change are shared, not copied: those that
 * one plan has added are a block, which stays while a plan uses any of them. */
#ifndef FIRMWARE_HOST_JOB_JOB_FACTS_H
#define FIRMWARE_HOST_JOB_JOB_FACTS_H

#include "motion/core/track.h"
#include "motion/plan/check.h"

struct job_facts_block;

struct job_facts_segment {
    struct plan_facts *facts;
    uint16_t block;
    bool is_inside; /* of `limit`, and the border before it: not judged again */
};

struct job_facts {
    struct job_facts_segment *segment; /* as in the track */
    uint32_t count;
    struct job_facts_block **block;
    uint16_t blocks;
    struct plan_limit limit;
};

/* Of a track; from those of another (NULL: none) what is the same is taken over. */
void job_facts_make(struct job_facts *facts, const struct motion_track *track,
                    const struct job_facts *former,
                    const struct motion_track *former_track);
/* It is going to be judged by these limits: by others, no verdict holds. */
void job_facts_judge(struct job_facts *facts, const struct plan_limit *limit);
void job_facts_free(struct job_facts *facts);

/* Of tracks of two jobs: do both say the same? */
bool job_same_segment(const struct motion_segment *a,
                      const struct motion_segment *b);

#endif
