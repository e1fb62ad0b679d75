/* firmware/linux/base/lock.h - what one program of this computer has at a time.
 *
 * A lock is a name that the kernel holds: a listening socket of the abstract
 * namespace (unix(7)).  It is gone with its process, however that ends; nothing
 * is left on a disk; every user's programs see it and no directory has to be
 * shared; and whoever is refused learns from the kernel which process has it,
 * also of one that hangs.  Programs of another network namespace (a container)
 * have names of their own, as they have CAN interfaces of their own. */
#ifndef FIRMWARE_LINUX_BASE_LOCK_H
#define FIRMWARE_LINUX_BASE_LOCK_H

#include <stdbool.h>
#include <sys/types.h>

#define LOCK_NAME_MAX 80

/* A file that is the lock until it is released.  A child that is forked has it
 * not, so that a guardian can have it once its parent is gone; nor has a program
 * that is executed.  Or a negative errno: EADDRINUSE where it is taken. */
int lock_take(const char *name);
void lock_release(int file);

#define LOCK_HOLDER_MAX 360
struct lock_holder {
    pid_t pid; /* 0: not seen from here */
    /* "process 1234 of anna, "slew run rig.yaml" in /home/anna" */
    char text[LOCK_HOLDER_MAX];
};

/* Has anybody the lock?  Then say who. */
bool lock_ask(const char *name, struct lock_holder *holder);

#endif
