/* tests/support/one_processor.h - so that a pause is one of all threads.
 *
 * A shared machine takes a processor away for tenths of a second, and with it
 * one thread, while the others go on: an answer is late that nobody made late.
 * On one processor all are paused, or none. */
#ifndef TESTS_SUPPORT_ONE_PROCESSOR_H
#define TESTS_SUPPORT_ONE_PROCESSOR_H

#ifndef _GNU_SOURCE
#error "expected _GNU_SOURCE before the first header, for sched_setaffinity"
#endif
#include <sched.h>

/* From here on, threads and children too.  Not where it is not allowed. */
static inline void one_processor(void)
{
    const int number = sched_getcpu();
    cpu_set_t set;

    if (number < 0 || number >= CPU_SETSIZE)
        return;
    CPU_ZERO(&set);
    CPU_SET((size_t)number, &set);
    (void)sched_setaffinity(0, sizeof set, &set);
}

#endif
