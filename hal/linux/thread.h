/* hal/linux/thread.h - threads that take no signal. */
#ifndef HAL_LINUX_THREAD_H
#define HAL_LINUX_THREAD_H

#include <pthread.h>

/* As pthread_create, with all signals blocked in the new thread: they are for the
 * threads that wait for them. */
int thread_linux_start(pthread_t *thread, void *(*run)(void *), void *context);

#endif
