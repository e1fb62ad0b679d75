/* firmware/host/job/job_facts.c - see job_facts.h. */
#include "firmware/host/job/job_facts.h"

#include <string.h>

#include "firmware/host/base/memory.h"

/* With more of them, all is copied into one of its own. */
#define FACTS_BLOCKS 64

struct job_facts_block {
    uint32_t users;
    struct plan_facts facts[];
};

bool job_same_segment(const struct motion_segment *a,
                      const struct motion_segment *b)
{
    return a->start_ns_q12 == b->start_ns_q12 &&
           a->dur_ns_q12 == b->dur_ns_q12 && a->pos_q32 == b->pos_q32 &&
           memcmp(a->coef, b->coef, sizeof a->coef) == 0 &&
           a->frac == b->frac && a->remainder == b->remainder &&
           a->degree == b->degree;
}

/* A page draws extremes. */
static void facts_of(const struct motion_segment *segment,
                     struct plan_facts *facts)
{
    plan_facts_of(segment, facts);
    plan_facts_exact(segment, facts);
}

/* --- blocks ------------------------------------------------------------------ */

static struct job_facts_block *facts_block(uint32_t count)
{
    struct job_facts_block *block =
        memory_new(1, sizeof *block + (size_t)count * sizeof block->facts[0]);

    block->users = 1;
    return block;
}

static void facts_leave(struct job_facts_block *block)
{
    if (--block->users == 0)
        memory_free(block);
}

static struct job_facts_block *facts_add(struct job_facts *facts,
                                         uint32_t count)
{
    struct job_facts_block *block = facts_block(count);

    facts->block[facts->blocks++] = block;
    return block;
}

/* --- what is taken over ------------------------------------------------------ */

/* Segments of the former track at the same place, in the order of time; those that
 * are not the same are left without facts.  How many there are of these. */
static uint32_t facts_match(struct job_facts *facts,
                            const struct motion_track *track,
                            const struct job_facts *former,
                            const struct motion_track *former_track)
{
    uint32_t missing = 0, k = 0;
    bool is_next = true; /* the segment before was the one before k, too */

    for (uint32_t i = 0; i < track->count; i++) {
        const struct motion_segment *segment = &track->segment[i];
        while (k < former->count &&
               former_track->segment[k].start_ns_q12 < segment->start_ns_q12) {
            k++;
            is_next = false;
        }
        if (k < former->count &&
            job_same_segment(segment, &former_track->segment[k])) {
            facts->segment[i] = former->segment[k++];
            if (!is_next)
                facts->segment[i].is_inside = false;
            is_next = true;
        } else {
            missing++;
            is_next = false;
        }
    }
    return missing;
}

/* The blocks of the former that are in use, and no others. */
static void facts_share(struct job_facts *facts, const struct job_facts *former)
{
    uint16_t now[FACTS_BLOCKS] = { 0 }; /* from 1: its place here */

    for (uint32_t i = 0; i < facts->count; i++) {
        struct job_facts_segment *segment = &facts->segment[i];
        if (segment->facts == NULL)
            continue;
        if (now[segment->block] == 0) {
            struct job_facts_block *block = former->block[segment->block];
            block->users++;
            facts->block[facts->blocks++] = block;
            now[segment->block] = facts->blocks;
        }
        segment->block = (uint16_t)(now[segment->block] - 1);
    }
}

/* In a block of its own, all of them. */
static void facts_gather(struct job_facts *facts)
{
    struct job_facts_block *block = facts_block(facts->count);

    for (uint32_t i = 0; i < facts->count; i++) {
        block->facts[i] = *facts->segment[i].facts;
        facts->segment[i].facts = &block->facts[i];
        facts->segment[i].block = 0;
    }
    for (uint16_t i = 0; i < facts->blocks; i++)
        facts_leave(facts->block[i]);
    facts->blocks = 1;
    facts->block[0] = block;
}

void job_facts_make(struct job_facts *facts, const struct motion_track *track,
                    const struct job_facts *former,
                    const struct motion_track *former_track)
{
    uint32_t missing = track->count, added = 0;

    *facts = (struct job_facts){
        .segment = memory_new((size_t)track->count + 1, sizeof *facts->segment),
        .count = track->count,
        .block = memory_new(FACTS_BLOCKS, sizeof(struct job_facts_block *)),
    };
    if (former != NULL) {
        facts->limit = former->limit;
        missing = facts_match(facts, track, former, former_track);
        facts_share(facts, former);
    }
    if (missing == 0)
        return;
    struct job_facts_block *block = facts_add(facts, missing);
    for (uint32_t i = 0; i < track->count; i++) {
        struct job_facts_segment *segment = &facts->segment[i];
        if (segment->facts != NULL)
            continue;
        segment->facts = &block->facts[added++];
        segment->block = (uint16_t)(facts->blocks - 1);
        facts_of(&track->segment[i], segment->facts);
    }
    if (facts->blocks == FACTS_BLOCKS)
        facts_gather(facts);
}

void job_facts_judge(struct job_facts *facts, const struct plan_limit *limit)
{
    const struct plan_limit *a = &facts->limit;

    if (a->pos_min_q32 == limit->pos_min_q32 &&
        a->pos_max_q32 == limit->pos_max_q32 && a->vel_q32 == limit->vel_q32 &&
        a->acc_q32 == limit->acc_q32 && a->jerk_q32 == limit->jerk_q32 &&
        a->period_ns == limit->period_ns)
        return;
    facts->limit = *limit;
    for (uint32_t i = 0; i < facts->count; i++)
        facts->segment[i].is_inside = false;
}

void job_facts_free(struct job_facts *facts)
{
    for (uint16_t i = 0; i < facts->blocks; i++)
        facts_leave(facts->block[i]);
    memory_free(facts->segment);
    memory_free(facts->block);
    *facts = (struct job_facts){ .segment = NULL };
}
