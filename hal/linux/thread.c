/* hal/linux/thread.c - see thread.h. */
#include "hal/linux/thread.h"

#include <signal.h>
#include <stddef.h>

int thread_linux_start(pthread_t *thread, void *(*run)(void *), void *context)
{
    sigset_t all, before;
    int err;

    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    err = pthread_create(thread, NULL, run, context);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return err;
}
