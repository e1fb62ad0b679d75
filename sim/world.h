/* sim/world.h - virtual time: everything simulated hangs here.
 *
 * A world is a list of members (buses, devices), each of which says when it
 * next has something to do.  Running the world to a time calls them in the
 * order of time, ties in the order in which they were added, so two runs of the
 * same program are the same to the bit.  No threads, no real clock.
 *
 * Members may stand in groups, such as a bus and the devices on it, so that the
 * cost of an event does not grow with the number of buses: what a member of a
 * group does changes nothing in any other group.  While every member stands in
 * one, each group is run by itself, which is the same to it: the order of time is
 * that within a group then. */
#ifndef SIM_WORLD_H
#define SIM_WORLD_H

#include <stdint.h>

#include "hal/clock.h"

/* Nothing to do. */
#define SIM_WORLD_NEVER INT64_MAX

struct sim_member;

struct sim_member_ops {
    /* Next time this member has something to do, or SIM_WORLD_NEVER.  Cheap:
     * asked before every event, in a group of every event there alone. */
    int64_t (*due_ns)(const struct sim_member *member);
    /* Do what is due at `now_ns`: the time given by due_ns, or later when that
     * had already passed.  Must move due_ns on. */
    void (*run)(struct sim_member *member, int64_t now_ns);
};

struct sim_member {
    const struct sim_member_ops *ops;
    struct sim_member *next; /* in its group, in the order of adding */
    unsigned number;         /* among all of the world, in that order */
};

/* All zero before the first member. */
struct sim_group {
    struct sim_group *next;
    struct sim_member *first, *last;
    struct sim_member *due; /* first of them all, as of the last event */
    int64_t due_ns;
};

struct sim_world {
    struct hal_clock clock; /* wait_until runs the world up to then */
    int64_t now_ns;
    unsigned members;
    struct sim_group alone; /* those in no other group */
    struct sim_group *first, *last;
};

void sim_world_init(struct sim_world *world, int64_t start_ns);

/* The member is the caller's, once in one world.  MOTION_OK; MOTION_E_ARG when
 * it has no operations. */
int sim_world_add(struct sim_world *world, struct sim_member *member);
/* The same, in a group.  What its run does may change when members of this
 * group and those that were added without one are due, no others. */
int sim_world_add_to(struct sim_world *world, struct sim_group *group,
                     struct sim_member *member);

/* All that is due up to and including `until_ns`; then now is `until_ns`.  A
 * time that has passed does nothing.  Not to be called from a member's run. */
void sim_world_run(struct sim_world *world, int64_t until_ns);

/* When something is due next, SIM_WORLD_NEVER: never. */
int64_t sim_world_due_ns(struct sim_world *world);

#endif
