/* firmware/linux/machine/view.h - what drives, buses and lines say at one time,
 * as a copy that is handed on: to a monitor, out of the tick of a service, and
 * as JSON over its socket. */
#ifndef FIRMWARE_LINUX_MACHINE_VIEW_H
#define FIRMWARE_LINUX_MACHINE_VIEW_H

#include <cjson/cJSON.h>

#include "firmware/linux/machine/machine.h"

#define MACHINE_VIEW_WORD_MAX 64

struct machine_view_axis {
    enum hal_drive_state drive;
    bool known; /* the drive has said where it is */
    bool homed;
    int64_t pos_q32, vel_q32, following_q32; /* actual; behind its set point */
    int64_t demand_q32;                      /* where it was sent last */
    int64_t offset_q32;                      /* the drive's zero */
    const struct controller_cam *cam; /* follows another axis; NULL: none */
    bool torque_known;
    int32_t torque_permille;
    bool home_switch, limit_negative, limit_positive, probe_latched;
    bool has_statusword;
    uint16_t statusword, fault_code;
    char fault_text[64];
};

struct machine_view_bus {
    int can_state;                /* enum hal_can_state; -1: it is no CAN bus */
    int64_t busy_ns;              /* as machine_busy_ns */
    uint64_t errors;              /* what happened on it that should not */
    struct hal_modbus_stats line; /* Modbus; all zero */
};

/* As many of each as the rig has. */
struct machine_view {
    unsigned axes, buses, lines;
    struct machine_view_axis *axis;
    struct machine_view_bus *bus;
    int *line; /* 1, 0; below 0: it cannot be read */
};

/* All zero, with memory from the pool. */
void machine_view_init(struct machine_view *view, const struct rig *rig,
                       struct memory_pool *pool);
/* Between two of one rig. */
void machine_view_copy(struct machine_view *to,
                       const struct machine_view *from);
/* Buses and lines alone. */
void machine_view_copy_ports(struct machine_view *to,
                             const struct machine_view *from);

/* The axes; cheap enough for every tick. */
void machine_view_axes(const struct machine *machine,
                       struct machine_view *view);
/* Buses and lines; reading a line that is an output asks the system. */
void machine_view_ports(struct machine *machine, struct machine_view *view);

/* "0x0637 operation enabled, warning"; "" for drives that have none. */
void machine_view_word(const struct machine_view_axis *axis,
                       char text[MACHINE_VIEW_WORD_MAX]);

/* An axis, and to `object` the lists "buses" and "lines", as docs/API.md has
 * them; and back again: what is not there or is of another kind is zero. */
cJSON *machine_view_to_axis(const struct rig_axis *rig,
                            const struct machine_view_axis *axis);
/* `strays`, `echoes`, `broken`, `late` of a Modbus bus, and what they `say`. */
void machine_view_to_line(const struct rig_bus *bus,
                          const struct hal_modbus_stats *line, cJSON *item);
void machine_view_to_ports(const struct rig *rig,
                           const struct machine_view *view, cJSON *object);
void machine_view_from(const struct rig *rig, const cJSON *object,
                       struct machine_view *view);

#endif
