/* tests/support/pause_watch.h - has the machine paused this process?
 *
 * A thread that sleeps a millisecond at a time and sees when it slept much
 * longer: then nobody else ran either (one_processor.h). */
#ifndef TESTS_SUPPORT_PAUSE_WATCH_H
#define TESTS_SUPPORT_PAUSE_WATCH_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <time.h>

#include "tests/support/check.h"

#define PAUSE_WATCH_NS INT64_C(15000000) /* less is no pause */

struct pause_watch {
    pthread_t thread;
    _Atomic unsigned pauses;
    _Atomic bool stop;
};

static inline int64_t pause_watch_now_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

static inline void pause_watch_rest(long ns)
{
    const struct timespec rest = { .tv_nsec = ns };

    (void)nanosleep(&rest, NULL);
}

static inline void *pause_watch_run(void *context)
{
    struct pause_watch *watch = context;
    int64_t seen_ns = pause_watch_now_ns();

    while (!atomic_load(&watch->stop)) {
        pause_watch_rest(1000000);
        const int64_t now_ns = pause_watch_now_ns();

        if (now_ns - seen_ns > PAUSE_WATCH_NS)
            atomic_fetch_add(&watch->pauses, 1);
        seen_ns = now_ns;
    }
    return NULL;
}

static inline void pause_watch_start(struct pause_watch *watch)
{
    atomic_store(&watch->pauses, 0);
    atomic_store(&watch->stop, false);
    assert_int_equal(
        pthread_create(&watch->thread, NULL, pause_watch_run, watch), 0);
}

static inline void pause_watch_end(struct pause_watch *watch)
{
    atomic_store(&watch->stop, true);
    pthread_join(watch->thread, NULL);
}

/* So far, the one that has just ended too. */
static inline unsigned pause_watch_count(struct pause_watch *watch)
{
    pause_watch_rest(20000000);
    return atomic_load(&watch->pauses);
}

#endif
