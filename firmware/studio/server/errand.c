/* firmware/studio/server/errand.c - see errand.h. */
#include "firmware/studio/server/errand.h"

#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>

#include "firmware/host/base/memory.h"
#include "hal/linux/thread.h"

enum { ERRAND_RUNS, ERRAND_DONE, ERRAND_LEFT };

struct errand *errand_new(enum errand_kind kind, const char *path)
{
    struct errand *errand = memory_new(1, sizeof *errand);

    errand->kind = kind;
    snprintf(errand->path, sizeof errand->path, "%s", path);
    return errand;
}

static void errand_free(struct errand *errand)
{
    memory_free(errand->body);
    memory_free(errand->data);
    cJSON_Delete(errand->list);
    memory_free(errand);
}

static int64_t errand_do(struct errand *errand)
{
    switch (errand->kind) {
    case ERRAND_READ:
        return document_read(errand->path, &errand->data, errand->tag);
    case ERRAND_BESIDE:
        return document_read_beside(errand->name, errand->path,
                                    errand->move[0] != 0 ? errand->move : NULL,
                                    &errand->data, errand->tag);
    case ERRAND_WRITE: {
        char was[DOCUMENT_TAG];
        snprintf(was, sizeof was, "%s", errand->tag);
        return document_write(errand->path, errand->body, errand->length, was,
                              errand->tag);
    }
    case ERRAND_TAKES:
        errand->list = takes_list(errand->path);
        return 0;
    case ERRAND_KEEP:
        break;
    }
    return takes_write(errand->path, errand->name, errand->body,
                       errand->length);
}

static void *errand_main(void *context)
{
    struct errand *errand = context;

    errand->outcome = errand_do(errand);
    if (atomic_exchange(&errand->state, ERRAND_DONE) == ERRAND_LEFT)
        errand_free(errand);
    return NULL;
}

void errand_start(struct errand *errand)
{
    pthread_t thread;

    if (thread_linux_start(&thread, errand_main, errand) == 0) {
        (void)pthread_detach(thread);
        return;
    }
    errand->outcome = -EAGAIN;
    atomic_store(&errand->state, ERRAND_DONE);
}

bool errand_is_done(const struct errand *errand)
{
    return atomic_load(&errand->state) == ERRAND_DONE;
}

void errand_leave(struct errand *errand)
{
    if (errand != NULL &&
        atomic_exchange(&errand->state, ERRAND_LEFT) == ERRAND_DONE)
        errand_free(errand);
}
