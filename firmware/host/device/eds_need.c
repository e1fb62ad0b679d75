/* firmware/host/device/eds_need.c - see eds_need.h. */
#include "firmware/host/device/eds_need.h"

#include <stddef.h>

#include "firmware/host/base/array.h"

#define RW     (NEED_READ | NEED_WRITE)
#define ALWAYS EDS_ALWAYS

const struct eds_need eds_needs[] = {
    { 0x1000, 0, NEED_READ, ALWAYS, "is it a drive" },
    { 0x1016, 1, RW, EDS_CONSUMER, "it stops when we are silent" },
    { 0x1017, 0, RW, EDS_HEARTBEAT, "its heartbeat" },
    { 0x100C, 0, RW, EDS_GUARDING, "its guard time" },
    { 0x100D, 0, RW, EDS_GUARDING, "how many times it is not, at most" },
    { 0x1019, 0, RW, EDS_COUNTER, "SYNC's counter" },
    { 0x1400, 1, RW, ALWAYS, "set points in a PDO" },
    { 0x1600, 0, RW, ALWAYS, "likewise, what it carries" },
    { 0x1401, 1, RW, EDS_CSV, "speeds in a second PDO" },
    { 0x1601, 0, RW, EDS_CSV, "likewise, what it carries" },
    { 0x1800, 1, RW, ALWAYS, "feedback in a PDO" },
    { 0x1A00, 0, RW, ALWAYS, "likewise, what it carries" },
    { 0x6007, 0, RW, EDS_SUPERVISED, "how it stops when we are" },
    { 0x6040, 0, NEED_MAP, ALWAYS, "controlword" },
    { 0x6041, 0, NEED_READ | NEED_MAP, ALWAYS, "statusword" },
    { 0x6060, 0, NEED_WRITE, ALWAYS, "mode" },
    { 0x6061, 0, NEED_READ, ALWAYS, "mode in force" },
    { 0x6064, 0, NEED_READ | NEED_MAP, ALWAYS, "actual position" },
    { 0x6065, 0, RW, ALWAYS, "following error window" },
    { 0x6066, 0, RW, EDS_SUPERVISED, "for how long outside it" },
    { 0x6085, 0, RW, ALWAYS, "quick-stop ramp" },
    { 0x607A, 0, RW | NEED_MAP, EDS_CSP | EDS_CSV, "target position" },
    { 0x60C1, 1, RW | NEED_MAP, EDS_IP, "target position of IP" },
    { 0x60FF, 0, NEED_WRITE | NEED_MAP, EDS_CSV, "target velocity" },
    { 0x6502, 0, NEED_READ, EDS_CSP, "CSP among its modes" },
    { 0x6502, 0, NEED_READ, EDS_IP, "IP among its modes" },
    { 0x6502, 0, NEED_READ, EDS_CSV, "CSV among its modes" },
    { 0x6502, 0, NEED_READ, EDS_HOMING, "homing among its modes" },
    { 0x6098, 0, RW, EDS_HOMING, "homing method" },
    { 0x6099, 1, NEED_WRITE, EDS_HOMING, "speed of the search" },
    { 0x6099, 2, NEED_WRITE, EDS_HOMING, "speed at the switch" },
    { 0x607C, 0, RW, 0, "home offset, set to 0" },
    { 0x605A, 0, NEED_READ, ALWAYS, "what a quick stop does" },
    { 0x605B, 0, RW, EDS_SHUTDOWN, "what a shutdown does" },
    { 0x605C, 0, RW, EDS_DISABLE, "what disabling does" },
    { 0x605D, 0, RW, EDS_HALT, "what a halt does" },
    { 0x605E, 0, RW, EDS_FAULT, "what a fault does" },
    { 0x1006, 0, RW, 0, "SYNC period" },
    { 0x603F, 0, NEED_READ, 0, "error code" },
    { 0x607D, 1, RW, 0, "software limit, negative" },
    { 0x607D, 2, RW, 0, "software limit, positive" },
    { 0x608F, 1, NEED_READ, 0, "encoder resolution, to be compared" },
    { 0x6091, 1, NEED_READ, 0, "gear, to be compared" },
    { 0x6092, 1, NEED_READ, 0, "feed, to be compared" },
    { 0x6096, 1, NEED_READ, 0, "velocity factor, to be compared" },
    { 0x60B2, 0, NEED_MAP, 0, "torque feed-forward" },
    { 0x6077, 0, NEED_READ | NEED_MAP, 0, "actual torque" },
    { 0x60B8, 0, RW, 0, "touch probe" },
    { 0x60B9, 0, NEED_READ, 0, "touch probe, its state" },
    { 0x60BA, 0, NEED_READ, 0, "touch probe, position at a rising edge" },
    { 0x60BB, 0, NEED_READ, 0, "touch probe, at a falling edge" },
    { 0x60C2, 1, RW, 0, "interpolation period" },
    { 0x60FD, 0, NEED_READ | NEED_MAP, 0, "limit switches" },
};
const unsigned eds_need_count = ARRAY_LEN(eds_needs);

const char *eds_need_text(const struct eds_need *need)
{
    static const struct {
        unsigned use;
        const char *words;
    } uses[] = {
#define EDS_USE_ROW(name, bit, words) { name, words },
        EDS_USE_LIST(EDS_USE_ROW)
#undef EDS_USE_ROW
    };

    if (eds_is_needed(need, EDS_PLAIN))
        return "must";
    for (size_t i = 0; i < ARRAY_LEN(uses); i++)
        if (eds_is_needed(need, uses[i].use))
            return uses[i].words;
    return "may";
}

/* Its bit of 0x6502, and what to say of one that lacks it. */
static const char *eds_lacks_mode(const struct eds_object *object,
                                  const struct eds_need *need)
{
    static const struct {
        unsigned use, bit;
        const char *lacks;
    } modes[] = { { EDS_CSP, 7, "has no CSP" },
                  { EDS_IP, 6, "has no IP" },
                  { EDS_CSV, 8, "has no CSV" },
                  { EDS_HOMING, 5, "has no homing" } };

    for (size_t i = 0; i < ARRAY_LEN(modes); i++)
        if (need->index == 0x6502 && object->has_value &&
            eds_is_needed(need, modes[i].use) &&
            ((uint64_t)object->value >> modes[i].bit & 1) == 0)
            return modes[i].lacks;
    return NULL;
}

const char *eds_lacks(const struct eds *eds, const struct eds_need *need,
                      uint16_t index)
{
    const struct eds_object *object = eds_find(eds, index, need->sub);

    if (object == NULL)
        return "not there";
    if ((object->unread & EDS_UNREAD_ACCESS) != 0 &&
        (need->access & (NEED_READ | NEED_WRITE)) != 0)
        return "has no AccessType that can be read";
    if ((object->unread & EDS_UNREAD_MAPPING) != 0 &&
        (need->access & NEED_MAP) != 0)
        return "has no PDOMapping that can be read";
    if ((need->access & NEED_READ) != 0 && !object->readable)
        return "cannot be read";
    if ((need->access & NEED_WRITE) != 0 && !object->writable)
        return "cannot be written";
    if ((need->access & NEED_MAP) != 0 && !object->mappable)
        return "cannot be mapped";
    return eds_lacks_mode(object, need);
}

unsigned eds_missing(const struct eds *eds, unsigned uses)
{
    unsigned missing = 0;

    for (unsigned i = 0; i < eds_need_count; i++)
        missing += eds_is_needed(&eds_needs[i], uses) &&
                   eds_lacks(eds, &eds_needs[i], eds_needs[i].index) != NULL;
    return missing;
}
