/* sim/world.c - see world.h. */
#include "sim/world.h"

#include <assert.h>
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

int sim_world_add(struct sim_world *world, struct sim_member *member)
{
    if (!member->ops || !member->ops->due_ns || !member->ops->run)
        return MOTION_E_ARG;
    member->next = NULL;
    if (world->last == NULL)
        world->first = member;
    else
        world->last->next = member;
    world->last = member;
    return MOTION_OK;
}

/* The member that is due first, the one added first on a tie. */
static struct sim_member *sim_world_next(const struct sim_world *world,
                                         int64_t *due_ns)
{
    struct sim_member *next = NULL;

    *due_ns = SIM_WORLD_NEVER;
    for (struct sim_member *member = world->first; member != NULL;
         member = member->next) {
        int64_t member_due_ns = member->ops->due_ns(member);

        if (member_due_ns < *due_ns) {
            *due_ns = member_due_ns;
            next = member;
        }
    }
    return next;
}

void sim_world_run(struct sim_world *world, int64_t until_ns)
{
    unsigned calls_at_once = 0;

    if (until_ns < world->now_ns)
        return;
    for (;;) {
        int64_t due_ns;
        struct sim_member *member = sim_world_next(world, &due_ns);

        if (!member || due_ns > until_ns)
            break;
        if (due_ns > world->now_ns) {
            world->now_ns = due_ns;
            calls_at_once = 0;
        }
        calls_at_once++;
        assert(calls_at_once < SIM_WORLD_CALLS_AT_ONCE_MAX);
        member->ops->run(member, world->now_ns);
    }
    world->now_ns = until_ns;
}

int64_t sim_world_due_ns(const struct sim_world *world)
{
    int64_t due_ns;

    (void)sim_world_next(world, &due_ns);
    return due_ns;
}
