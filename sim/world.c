/* sim/world.c - see world.h. */
#include "sim/world.h"

#include <assert.h>
#include <stdbool.h>
#include <stddef.h>

#include "sim/util.h"

/* More calls than this at one instant: a member does not move on. */
#define SIM_WORLD_CALLS_AT_ONCE_MAX 1000000

static int64_t sim_world_now_ns(struct hal_clock *clock)
{
    return CONTAINER_OF(clock, struct sim_world, clock)->now_ns;
}

static int sim_world_wait_until(struct hal_clock *clock, int64_t t_ns)
{
    sim_world_run(CONTAINER_OF(clock, struct sim_world, clock), t_ns);
    return MOTION_OK;
}

static const struct hal_clock_ops sim_world_clock_ops = {
    .now_ns = sim_world_now_ns,
    .wait_until = sim_world_wait_until,
};

void sim_world_init(struct sim_world *world, int64_t start_ns)
{
    *world = (struct sim_world){ .clock.ops = &sim_world_clock_ops,
                                 .now_ns = start_ns };
}

static void sim_world_join(struct sim_world *world, struct sim_group *group,
                           struct sim_member *member)
{
    member->next = NULL;
    member->number = world->members++;
    if (group->last == NULL)
        group->first = member;
    else
        group->last->next = member;
    group->last = member;
}

static bool sim_world_is_legal(const struct sim_member *member)
{
    return member->ops != NULL && member->ops->due_ns != NULL &&
           member->ops->run != NULL;
}

int sim_world_add(struct sim_world *world, struct sim_member *member)
{
    if (!sim_world_is_legal(member))
        return MOTION_E_ARG;
    sim_world_join(world, &world->alone, member);
    return MOTION_OK;
}

int sim_world_add_to(struct sim_world *world, struct sim_group *group,
                     struct sim_member *member)
{
    if (!sim_world_is_legal(member))
        return MOTION_E_ARG;
    if (group->first == NULL) {
        if (world->last == NULL)
            world->first = group;
        else
            world->last->next = group;
        world->last = group;
    }
    sim_world_join(world, group, member);
    return MOTION_OK;
}

/* Asks its members anew: the one that is due first, the one added first on a
 * tie. */
static void sim_world_ask(struct sim_group *group)
{
    group->due = NULL;
    group->due_ns = SIM_WORLD_NEVER;
    for (struct sim_member *member = group->first; member != NULL;
         member = member->next) {
        const int64_t due_ns = member->ops->due_ns(member);

        if (due_ns < group->due_ns) {
            group->due_ns = due_ns;
            group->due = member;
        }
    }
}

static void sim_world_ask_all(struct sim_world *world)
{
    sim_world_ask(&world->alone);
    for (struct sim_group *group = world->first; group != NULL;
         group = group->next)
        sim_world_ask(group);
}

/* The group of the member that is due first, by what they last said. */
static struct sim_group *sim_world_next(struct sim_world *world)
{
    struct sim_group *next = &world->alone;

    for (struct sim_group *group = world->first; group != NULL;
         group = group->next)
        if (group->due_ns < next->due_ns ||
            (group->due_ns == next->due_ns && next->due != NULL &&
             group->due->number < next->due->number))
            next = group;
    return next;
}

/* The member of the group that is due first. */
static void sim_world_call(struct sim_world *world, struct sim_group *group,
                           unsigned *calls_at_once)
{
    if (group->due_ns > world->now_ns) {
        world->now_ns = group->due_ns;
        *calls_at_once = 0;
    }
    ++*calls_at_once;
    assert(*calls_at_once < SIM_WORLD_CALLS_AT_ONCE_MAX);
    group->due->ops->run(group->due, world->now_ns);
}

/* Groups that nobody else looks at: one after the other, each from now on. */
static void sim_world_run_apart(struct sim_world *world, int64_t until_ns)
{
    const int64_t begin_ns = world->now_ns;

    for (struct sim_group *group = world->first; group != NULL;
         group = group->next) {
        unsigned calls_at_once = 0;

        world->now_ns = begin_ns;
        for (sim_world_ask(group);
             group->due != NULL && group->due_ns <= until_ns;
             sim_world_ask(group))
            sim_world_call(world, group, &calls_at_once);
    }
}

static void sim_world_run_in_order(struct sim_world *world, int64_t until_ns)
{
    unsigned calls_at_once = 0;

    sim_world_ask_all(world);
    for (;;) {
        struct sim_group *group = sim_world_next(world);

        if (group->due == NULL || group->due_ns > until_ns)
            break;
        sim_world_call(world, group, &calls_at_once);
        if (group == &world->alone) {
            sim_world_ask_all(world);
        } else {
            sim_world_ask(group);
            sim_world_ask(&world->alone);
        }
    }
}

void sim_world_run(struct sim_world *world, int64_t until_ns)
{
    if (until_ns < world->now_ns)
        return;
    if (world->alone.first == NULL)
        sim_world_run_apart(world, until_ns);
    else
        sim_world_run_in_order(world, until_ns);
    world->now_ns = until_ns;
}

int64_t sim_world_due_ns(struct sim_world *world)
{
    sim_world_ask_all(world);
    return sim_world_next(world)->due_ns;
}
