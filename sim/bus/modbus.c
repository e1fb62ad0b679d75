/* sim/bus/modbus.c - see modbus.h. */
#include "sim/bus/modbus.h"

#include "sim/util.h"

static int64_t sim_modbus_due_ns(const struct sim_member *member)
{
    const struct sim_modbus_seat *seat =
        CONTAINER_OF_CONST(member, struct sim_modbus_seat, member);

    if (seat->length > 0)
        return seat->end_ns;
    return seat->station->ops->due_ns(seat->station);
}

/* Whoever is sending already and the new one spoil each other. */
static void sim_modbus_collide(struct sim_modbus_seat *seat)
{
    struct sim_modbus_line *line = seat->line;

    for (struct sim_modbus_seat *other = line->first; other != NULL;
         other = other->next) {
        if (other == seat || other->length == 0 ||
            other->end_ns <= seat->begin_ns)
            continue;
        other->garbled = true;
        seat->garbled = true;
        line->collisions++;
    }
}

/* So many of the first characters come while the adapter still has the line. */
static unsigned sim_modbus_covered(const struct sim_modbus_line *line,
                                   const struct sim_modbus_seat *seat)
{
    const struct sim_modbus_seat *adapter = line->adapter;
    unsigned covered = 0;

    if (line->turn_ns == 0 || adapter == NULL || adapter == seat)
        return 0;
    while (covered < seat->length &&
           seat->begin_ns + modbus_rtu_chars_ns(&line->time, covered) <
               adapter->end_ns + line->turn_ns)
        covered++;
    return covered;
}

static void sim_modbus_hear(struct sim_modbus_seat *to,
                            const struct sim_modbus_seat *from,
                            unsigned covered, unsigned length)
{
    if (covered < length)
        to->station->ops->recv(to->station, from->frame + covered,
                               length - covered, from->end_ns);
}

static void sim_modbus_deliver(struct sim_modbus_seat *seat)
{
    struct sim_modbus_line *line = seat->line;
    const unsigned length = seat->length;
    const unsigned covered = sim_modbus_covered(line, seat);
    const bool dead = line->cut || line->deaf || line->closed;

    line->frames++;
    line->busy_ns += (uint64_t)(seat->end_ns - seat->begin_ns);
    seat->length = 0;
    for (unsigned i = 0; seat->garbled && i < length; i++)
        seat->frame[i] = (uint8_t)(seat->frame[i] & 0x5A);
    for (struct sim_modbus_seat *other = dead ? NULL : line->first;
         other != NULL; other = other->next)
        if (other != seat || (line->echo && seat == line->adapter))
            sim_modbus_hear(other, seat, covered, length);
    seat->station->ops->sent(seat->station, seat->end_ns);
}

static void sim_modbus_begin(struct sim_modbus_seat *seat, int64_t now_ns)
{
    seat->length = seat->station->ops->poll(seat->station, now_ns, seat->frame);
    if (seat->length == 0)
        return;
    seat->begin_ns = now_ns;
    seat->end_ns =
        now_ns + modbus_rtu_chars_ns(&seat->line->time, seat->length);
    seat->garbled = false;
    sim_modbus_collide(seat);
}

static void sim_modbus_run(struct sim_member *member, int64_t now_ns)
{
    struct sim_modbus_seat *seat =
        CONTAINER_OF(member, struct sim_modbus_seat, member);

    if (seat->length > 0)
        sim_modbus_deliver(seat);
    else
        sim_modbus_begin(seat, now_ns);
}

static const struct sim_member_ops sim_modbus_member_ops = {
    .due_ns = sim_modbus_due_ns,
    .run = sim_modbus_run,
};

int sim_modbus_line_init(struct sim_modbus_line *line, struct sim_world *world,
                         const struct modbus_rtu_line *config)
{
    *line = (struct sim_modbus_line){ .world = world };
    return modbus_rtu_time_init(&line->time, config);
}

int sim_modbus_seat_init(struct sim_modbus_seat *seat,
                         struct sim_modbus_line *line,
                         struct modbus_station *station)
{
    int err;

    *seat = (struct sim_modbus_seat){ .member.ops = &sim_modbus_member_ops,
                                      .line = line,
                                      .station = station };
    err = sim_world_add(line->world, &seat->member);
    if (err < 0)
        return err;
    if (line->last == NULL)
        line->first = seat;
    else
        line->last->next = seat;
    line->last = seat;
    return MOTION_OK;
}
