/* firmware/linux/tools/scan.h - who is on a bus?
 *
 * CAN: listens for heartbeats and boot-ups, then (if nobody else is master
 * there) asks every node number for 0x1000 at once and those that answer for
 * their identity, a drive for each of its axes, and looks for one device
 * without node number by LSS.  A drive that is not CANopen's (struct tool_ear)
 * may say by itself who it is; a CANopen question could be an order to it, so
 * none is sent when one was heard.  Those that are asked by FD frames are on
 * ports with FD.  Modbus: every unit is asked for register 0, those that answer for their
 * identification (2B, 11), and by the register maps that identify their drive.
 *
 * Nothing moves: only reads are sent. */
#ifndef FIRMWARE_LINUX_TOOLS_SCAN_H
#define FIRMWARE_LINUX_TOOLS_SCAN_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/linux/tools/bench.h"
#include "hal/canopen/lss.h"

#define SCAN_MAX      256
#define SCAN_NOTES    8
#define SCAN_LINE_MAX 24
#define SCAN_TEXT_MAX 56
#define SCAN_NOTE_MAX 256

struct scan_found {
    const char *kind; /* "CANopen" */
    bool has_identity;
    bool has_number;
    unsigned id;   /* node or unit */
    unsigned axis; /* of a node of several, from 1; 0: it has one */
    struct canopen_identity identity;
    char bus[PLAN_NAME_MAX];   /* as the user calls it */
    char line[SCAN_LINE_MAX];  /* serial Modbus: "115200 8E1" */
    char name[SCAN_TEXT_MAX];  /* vendor and product, as it says them */
    char state[SCAN_TEXT_MAX]; /* "pre-operational, switch on disabled" */
    char fits[SCAN_TEXT_MAX];  /* which `drive:` of a rig: "kind: cia402" */
};

struct scan {
    struct scan_found found[SCAN_MAX];
    unsigned count;
    char note[SCAN_NOTES][SCAN_NOTE_MAX]; /* what the user should know */
    unsigned notes;
    void (*progress)(const char *what, unsigned at, unsigned of); /* or NULL */
};

struct scan_config {
    int64_t listen_ns;    /* CAN: for heartbeats, before anything is sent */
    unsigned first, last; /* Modbus units */
};

/* One more, NULL when there is no room. */
struct scan_found *scan_add(struct scan *scan, const char *kind, unsigned id,
                            const char *bus);
void scan_note(struct scan *scan, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* A bench that is open.  MOTION_OK, or MOTION_E_IO: the bus is gone. */
int scan_can(struct scan *scan, struct bench *bench,
             const struct scan_config *config);
int scan_modbus(struct scan *scan, struct bench *bench,
                const struct scan_config *config);

#endif
