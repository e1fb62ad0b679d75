/* firmware/linux/machine/machine_lock.h - the real things of a rig, for one
 * program of this computer at a time, and for one of its buses.
 *
 *   the rig file                   by its path, links followed
 *   a CAN interface                by its index
 *   a serial port                  by its device number, links followed
 *   a Modbus TCP server and port   by its addresses, all of this computer's
 *                                  being one; each unit by itself, so that two
 *                                  rigs may share a gateway, or all of them
 *
 * A digital line needs none: the kernel gives it to one at a time.
 * Taken before anything is opened or asked; base/lock.h says how it is held. */
#ifndef FIRMWARE_LINUX_MACHINE_MACHINE_LOCK_H
#define FIRMWARE_LINUX_MACHINE_MACHINE_LOCK_H

#include "firmware/host/rig/rig.h"
#include "firmware/linux/base/lock.h"

struct machine_lock_config {
    const char *rig_path; /* NULL: the file is not locked */
    bool all_units;       /* of Modbus TCP: not just those of the axes */
    bool numeric;         /* names of hosts are not looked up, which may take
                             long: they are locked as the file has them */
    /* Another's is taken over: the holder is killed where that is allowed, and
     * where not (or the name stays taken) its locks are done without. */
    bool takes_over;
};

struct machine_lock_name {
    int file; /* -1: done without */
    uint32_t bus;
    char name[LOCK_NAME_MAX];
};

/* All zero: holds nothing. */
struct machine_lock {
    struct memory_pool memory;
    struct machine_lock_name *name;
    size_t count;
};

/* MOTION_E_STATE: another program has one; MOTION_E_ARG: two buses are one
 * thing; MOTION_E_IO: it could not be found out.  With a sentence; nothing is
 * held then. */
int machine_lock_take(struct machine_lock *lock, const struct rig *rig,
                      const struct machine_lock_config *config,
                      char message[YAML_MESSAGE_MAX]);
void machine_lock_release(struct machine_lock *lock);

#endif
