/* firmware/linux/tools/doctor_can.c - CAN interfaces; see doctor.h. */
#include "firmware/linux/tools/doctor_parts.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define CAN_ARPHRD      280 /* of the kernel's if_arp.h */
#define CAN_QUEUE       64  /* frames that hal/linux/socketcan.h needs */
#define CAN_RATE        1000000
#define CAN_SAMPLE_LOW  700 /* permille; CiA 301 table 1 has 875 */
#define CAN_SAMPLE_HIGH 900

static const struct rig_bus *can_bus(const struct doctor *doctor,
                                     const char *interface)
{
    const struct rig *rig = doctor->config.rig;

    for (unsigned i = 0; rig != NULL && i < rig->bus_count; i++)
        if (strcmp(rig->bus[i].interface, interface) == 0)
            return &rig->bus[i];
    return NULL;
}

static void can_advise_up(struct doctor *doctor, const char *name,
                          const struct can_link *link, unsigned rate)
{
    if (strcmp(link->kind, "can") == 0)
        doctor_advise(doctor,
                      "sudo ip link set %s down; sudo ip link set %s up "
                      "txqueuelen 128 type can bitrate %u restart-ms 0",
                      name, name, rate);
    else
        doctor_advise(doctor, "sudo ip link set %s up", name);
}

static void can_timing(struct doctor *doctor, const char *name,
                       const struct can_link *link)
{
    if (link->sample_permille == 0)
        return;
    if (link->sample_permille < CAN_SAMPLE_LOW ||
        link->sample_permille > CAN_SAMPLE_HIGH) {
        doctor_say(doctor, DOCTOR_ADVICE, "can",
                   "%s samples at %u.%u %% of a bit, CANopen at 87.5 %%", name,
                   link->sample_permille / 10u, link->sample_permille % 10u);
        doctor_advise(doctor,
                      "sudo ip link set %s down; sudo ip link set %s up type "
                      "can bitrate %" PRIu32 " sample-point 0.875",
                      name, name, link->bit_rate);
    }
}

static void can_counters(struct doctor *doctor, const char *name,
                         const struct can_link *link)
{
    if (link->state == HAL_CAN_BUS_OFF) {
        doctor_say(doctor, DOCTOR_BAD, "can", "%s is in bus-off", name);
        doctor_advise(doctor,
                      "check bit rate, termination (60 ohm between the wires) "
                      "and that a second node is on; then sudo ip link set %s "
                      "type can restart",
                      name);
    } else if (link->tx_errors > 0 || link->rx_errors > 0) {
        doctor_say(doctor, DOCTOR_ADVICE, "can",
                   "%s: %s, error counters %u sending, %u receiving", name,
                   hal_can_state_text(link->state), link->tx_errors,
                   link->rx_errors);
        doctor_advise(doctor, "check termination (60 ohm between the wires), "
                              "bit rate, and that a second node is on");
    }
}

/* What would make the port refuse to open, see hal/linux/socketcan_setup.c. */
static bool can_configured(struct doctor *doctor, const char *name,
                           const struct can_link *link,
                           const struct rig_bus *bus)
{
    const enum doctor_verdict bad = bus == NULL ? DOCTOR_ADVICE : DOCTOR_BAD;
    const unsigned rate = bus == NULL ? CAN_RATE : bus->bit_rate;

    if (!link->up)
        doctor_say(doctor, bad, "can", "%s is down", name);
    else if (bus != NULL && link->bit_rate != 0 && link->bit_rate != rate)
        doctor_say(doctor, bad, "can",
                   "%s runs at %" PRIu32 " bit/s, bus %s of the rig at %u",
                   name, link->bit_rate, bus->name, rate);
    else if (strcmp(link->kind, "can") == 0 && link->restart_ms != 0)
        doctor_say(doctor, bad, "can",
                   "%s comes back from bus-off by itself (restart-ms %" PRIu32
                   ")",
                   name, link->restart_ms);
    else
        return true;
    can_advise_up(doctor, name, link,
                  bus == NULL && link->bit_rate != 0 ? link->bit_rate : rate);
    return false;
}

static bool can_takes_fd(struct doctor *doctor, const char *name,
                         const struct can_link *link, const struct rig_bus *bus)
{
    if (bus == NULL || bus->data_bit_rate == 0 || link->fd)
        return true;
    doctor_say(doctor, DOCTOR_BAD, "can",
               "%s takes no FD frames, bus %s of the rig has them", name,
               bus->name);
    doctor_advise(doctor,
                  "sudo ip link set %s down; sudo ip link set %s up mtu 72 "
                  "type can bitrate %u dbitrate %u fd on",
                  name, name, bus->bit_rate, bus->data_bit_rate);
    return false;
}

static void can_judge(struct doctor *doctor, const char *name,
                      const struct can_link *link, const struct rig_bus *bus)
{
    if (!can_configured(doctor, name, link, bus) ||
        !can_takes_fd(doctor, name, link, bus))
        return;
    if (link->tx_queue < CAN_QUEUE) {
        doctor_say(doctor, bus == NULL ? DOCTOR_ADVICE : DOCTOR_BAD, "can",
                   "%s queues %u frames, slew needs %d", name, link->tx_queue,
                   CAN_QUEUE);
        doctor_advise(doctor, "sudo ip link set %s txqueuelen 128", name);
        return;
    }
    can_counters(doctor, name, link);
    can_timing(doctor, name, link);
    if (link->state == HAL_CAN_BUS_OFF)
        return;
    if (link->bit_rate != 0)
        doctor_say(doctor, DOCTOR_OK, "can",
                   "%s is up, %" PRIu32 " bit/s%s, queue of %u", name,
                   link->bit_rate, link->fd ? ", FD" : "", link->tx_queue);
    else
        doctor_say(doctor, DOCTOR_OK, "can", "%s is up (%s), queue of %u", name,
                   link->kind[0] == '\0' ? "virtual" : link->kind,
                   link->tx_queue);
}

static void can_interface(struct doctor *doctor, const char *name)
{
    struct can_link link = { 0 };

    if (doctor->config.link == NULL || doctor->config.link(name, &link) < 0) {
        doctor_say(doctor, DOCTOR_NOTE, "can",
                   "%s is there; the kernel was not queried about it", name);
        return;
    }
    can_judge(doctor, name, &link, can_bus(doctor, name));
}

/* Interfaces that the rig names and that are not there. */
static void can_missing(struct doctor *doctor,
                        char name[DOCTOR_NAMES][DOCTOR_NAME_MAX],
                        unsigned count)
{
    const struct rig *rig = doctor->config.rig;

    for (unsigned i = 0; rig != NULL && i < rig->bus_count; i++) {
        const struct rig_bus *bus = &rig->bus[i];
        unsigned k = 0;

        if (!rig_bus_is_can(bus))
            continue;
        if (bus->interface[0] == '\0') {
            doctor_say(doctor, DOCTOR_NOTE, "can",
                       "bus %s of the rig has no interface", bus->name);
            doctor_advise(doctor, "give it one: interface: can0, or "
                                  "--interface can0");
            continue;
        }
        while (k < count && strcmp(name[k], bus->interface) != 0)
            k++;
        if (k < count)
            continue;
        doctor_say(doctor, DOCTOR_BAD, "can",
                   "there is no interface %s (bus %s of the rig)",
                   bus->interface, bus->name);
        doctor_advise(doctor, "is the adapter plugged in and its driver "
                              "loaded? `ip -details link` lists what is there");
    }
}

void doctor_can(struct doctor *doctor)
{
    static char name[DOCTOR_NAMES][DOCTOR_NAME_MAX];
    static char can[DOCTOR_NAMES][DOCTOR_NAME_MAX];
    const unsigned all = doctor_list(doctor, "/sys/class/net", "", name);
    unsigned count = 0;

    for (unsigned i = 0; i < all; i++) {
        int64_t type = 0;

        if (!doctor_read_number(doctor, &type, "/sys/class/net/%s/type",
                                name[i]) ||
            type != CAN_ARPHRD)
            continue;
        memcpy(can[count++], name[i], DOCTOR_NAME_MAX);
        can_interface(doctor, name[i]);
    }
    can_missing(doctor, can, count);
    if (count == 0 && doctor->config.rig == NULL)
        doctor_say(doctor, DOCTOR_NOTE, "can", "no CAN interface");
}
