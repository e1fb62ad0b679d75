/* tests/patient_clock.c - a monotonic clock that stands still while the machine
 * does not run us.
 *
 * A shared machine pauses a process for tenths of a second.  A controller that
 * then stops for lost ticks is right, and a test of something else is none the
 * wiser.  A program linked with
 *
 *   -Wl,--wrap=clock_gettime -Wl,--wrap=clock_nanosleep
 *
 * and this file is as it was, but CLOCK_MONOTONIC leaves out every time in which
 * none of its threads ran: a thread of its own looks every millisecond, and
 * where more than PAUSE_NS passed between two looks of anybody, so much is taken
 * out.  A tick that waits for something while the process runs is as late as it
 * is: that is counted. */
#define _GNU_SOURCE /* clock_nanosleep */
#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdint.h>
#include <stdlib.h>
#include <time.h>

#define NS_PER_S INT64_C(1000000000)
#define LOOK_NS  INT64_C(1000000)
#define PAUSE_NS (5 * LOOK_NS)

int __real_clock_gettime(clockid_t clock, struct timespec *now);
int __real_clock_nanosleep(clockid_t clock, int flags,
                           const struct timespec *time, struct timespec *left);
int __wrap_clock_gettime(clockid_t clock, struct timespec *now);
int __wrap_clock_nanosleep(clockid_t clock, int flags,
                           const struct timespec *time, struct timespec *left);

static pthread_once_t once = PTHREAD_ONCE_INIT;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static int64_t seen_ns, paused_ns;

static int64_t patient_ns(const struct timespec *time)
{
    return time->tv_sec * NS_PER_S + time->tv_nsec;
}

static struct timespec patient_time(int64_t ns)
{
    return (struct timespec){ ns / NS_PER_S, ns % NS_PER_S };
}

static int64_t patient_now_ns(void)
{
    struct timespec real;

    pthread_mutex_lock(&lock);
    __real_clock_gettime(CLOCK_MONOTONIC, &real);
    const int64_t gap_ns = patient_ns(&real) - seen_ns;
    if (gap_ns > PAUSE_NS)
        paused_ns += gap_ns - LOOK_NS;
    seen_ns += gap_ns;
    const int64_t now_ns = seen_ns - paused_ns;
    pthread_mutex_unlock(&lock);
    return now_ns;
}

static void *patient_look_on(void *context)
{
    const struct timespec pause = { .tv_nsec = LOOK_NS };

    for (;;) {
        (void)patient_now_ns();
        nanosleep(&pause, NULL);
    }
    return context;
}

static void patient_start(void)
{
    struct timespec real;
    sigset_t all, before;
    pthread_t thread;

    __real_clock_gettime(CLOCK_MONOTONIC, &real);
    seen_ns = patient_ns(&real);
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    if (pthread_create(&thread, NULL, patient_look_on, NULL) != 0)
        abort();
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    pthread_detach(thread);
}

int __wrap_clock_gettime(clockid_t clock, struct timespec *now)
{
    if (clock != CLOCK_MONOTONIC)
        return __real_clock_gettime(clock, now);
    pthread_once(&once, patient_start);
    *now = patient_time(patient_now_ns());
    return 0;
}

/* In slices, for a pause in one of them is none of the time slept. */
int __wrap_clock_nanosleep(clockid_t clock, int flags,
                           const struct timespec *time, struct timespec *left)
{
    if (clock != CLOCK_MONOTONIC || flags != TIMER_ABSTIME)
        return __real_clock_nanosleep(clock, flags, time, left);
    pthread_once(&once, patient_start);
    for (;;) {
        const int64_t wait_ns = patient_ns(time) - patient_now_ns();
        const struct timespec slice =
            patient_time(wait_ns < LOOK_NS ? wait_ns : LOOK_NS);

        if (wait_ns <= 0)
            return 0;
        if (__real_clock_nanosleep(CLOCK_MONOTONIC, 0, &slice, NULL) == EINTR)
            return EINTR;
    }
}
