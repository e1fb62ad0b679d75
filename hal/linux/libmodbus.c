/* hal/linux/libmodbus.c - mailbox and thread; see libmodbus.h. */
#include "hal/linux/libmodbus.h"

#include <poll.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "hal/linux/libmodbus_port.h"
#include "hal/linux/thread.h"
#include "hal/support/container_of.h"

#define MS           INT64_C(1000000)
#define NS_PER_S     INT64_C(1000000000)
#define TIMEOUT_NS   (50 * MS)
#define BROADCAST_NS (10 * MS)

/* ---- the thread ---- */

static void modbus_libmodbus_wait(struct modbus_libmodbus *self)
{
    struct pollfd wait = { .fd = self->wake, .events = POLLIN };
    uint64_t count;

    if (poll(&wait, 1,
             self->context == NULL ? (int)(MODBUS_LIBMODBUS_RETRY_NS / MS)
                                   : -1) > 0)
        (void)!read(self->wake, &count, sizeof count);
}

static void modbus_libmodbus_serve(struct modbus_libmodbus *self)
{
    const uint64_t next =
        atomic_load_explicit(&self->finished, memory_order_relaxed);
    struct modbus_libmodbus_box *box = &self->box[next % HAL_MODBUS_MAILBOX];

    modbus_libmodbus_transact(self, box);
    const int err = box->reply.err;
    atomic_store_explicit(&self->finished, next + 1, memory_order_release);
    modbus_libmodbus_recover(self, err);
}

static void *modbus_libmodbus_run(void *context)
{
    struct modbus_libmodbus *self = context;

    while (!atomic_load(&self->stop)) {
        modbus_libmodbus_up(self);
        if (atomic_load_explicit(&self->submitted, memory_order_acquire) ==
            atomic_load_explicit(&self->finished, memory_order_relaxed))
            modbus_libmodbus_wait(self);
        else
            modbus_libmodbus_serve(self);
    }
    modbus_libmodbus_down(self);
    return NULL;
}

static void modbus_libmodbus_kick(struct modbus_libmodbus *self)
{
    const uint64_t one = 1;

    /* The counter would have to be at 2^64 - 1 for this to fail. */
    (void)!write(self->wake, &one, sizeof one);
}

/* ---- the mailbox ---- */

static struct modbus_libmodbus *modbus_libmodbus_of(struct hal_modbus *line)
{
    return CONTAINER_OF(line, struct modbus_libmodbus, modbus);
}

static int modbus_libmodbus_submit(struct hal_modbus *line,
                                   const struct hal_modbus_request *request,
                                   uint32_t tag)
{
    struct modbus_libmodbus *self = modbus_libmodbus_of(line);
    const uint64_t next =
        atomic_load_explicit(&self->submitted, memory_order_relaxed);
    struct modbus_libmodbus_box *box = &self->box[next % HAL_MODBUS_MAILBOX];

    if (!modbus_pdu_is_request(request) ||
        (modbus_libmodbus_is_rtu(self) ? request->unit == 255
                                       : request->unit == HAL_MODBUS_BROADCAST))
        return MOTION_E_ARG;
    if (next - self->collected == HAL_MODBUS_MAILBOX) {
        self->stats.refused++;
        return MOTION_E_FULL;
    }
    box->request = *request;
    box->reply = (struct hal_modbus_reply){ .tag = tag };
    atomic_store_explicit(&self->submitted, next + 1, memory_order_release);
    modbus_libmodbus_kick(self);
    return MOTION_OK;
}

static int modbus_libmodbus_collect(struct hal_modbus *line,
                                    struct hal_modbus_reply *reply)
{
    struct modbus_libmodbus *self = modbus_libmodbus_of(line);
    const struct modbus_libmodbus_box *box =
        &self->box[self->collected % HAL_MODBUS_MAILBOX];

    if (self->collected ==
        atomic_load_explicit(&self->finished, memory_order_acquire))
        return 0;
    *reply = box->reply;
    hal_modbus_count(&self->stats, reply);
    if (reply->err == MOTION_OK) {
        self->stats.busy_ns += (uint64_t)(reply->done_ns - reply->sent_ns);
        if (modbus_libmodbus_is_rtu(self))
            self->stats.ideal_ns +=
                (uint64_t)modbus_rtu_transaction_ns(&self->time, &box->request);
    }
    self->collected++;
    return 1;
}

static int modbus_libmodbus_is_up(struct hal_modbus *line)
{
    return atomic_load(&modbus_libmodbus_of(line)->up);
}

static void modbus_libmodbus_stats(struct hal_modbus *line,
                                   struct hal_modbus_stats *stats)
{
    struct modbus_libmodbus *self = modbus_libmodbus_of(line);

    *stats = self->stats;
    stats->stray = atomic_load(&self->stray);
    stats->echoes = atomic_load(&self->echoes);
    stats->late = atomic_load(&self->late);
    stats->reconnects = atomic_load(&self->reconnects);
}

static const struct hal_modbus_ops modbus_libmodbus_ops = {
    .submit = modbus_libmodbus_submit,
    .collect = modbus_libmodbus_collect,
    .is_up = modbus_libmodbus_is_up,
    .stats = modbus_libmodbus_stats,
};

/* ---- open and close ---- */

static int modbus_libmodbus_default(int64_t *dur_ns, int64_t preset_ns)
{
    if (*dur_ns == 0)
        *dur_ns = preset_ns;
    return *dur_ns >= MS && *dur_ns <= 10 * NS_PER_S ? MOTION_OK : MOTION_E_ARG;
}

static int modbus_libmodbus_check(struct modbus_libmodbus *self)
{
    struct modbus_line_config *config = &self->config;

    if (modbus_libmodbus_default(&config->timeout_ns, TIMEOUT_NS) < 0 ||
        modbus_libmodbus_default(&config->drain_ns, 2 * config->timeout_ns) <
            0 ||
        modbus_libmodbus_default(&config->broadcast_ns, BROADCAST_NS) < 0)
        return MOTION_E_ARG;
    if (!modbus_libmodbus_is_rtu(self))
        return config->host[0] != '\0' && config->port != 0 ? MOTION_OK
                                                            : MOTION_E_ARG;
    if (!modbus_line_is_baud(config->line.baud))
        return MOTION_E_ARG;
    return modbus_rtu_time_init(&self->time, &config->line);
}

int modbus_libmodbus_open(struct modbus_libmodbus *self,
                          const struct modbus_line_config *config)
{
    int err;

    memset(self, 0, sizeof *self);
    self->modbus.ops = &modbus_libmodbus_ops;
    self->config = *config;
    self->echo.is_known = config->echo;
    err = modbus_libmodbus_check(self);
    if (err < 0)
        return err;
    if (config->takes_over && modbus_libmodbus_is_rtu(self))
        self->hurried = MODBUS_LIBMODBUS_HURRIED;
    self->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (self->wake < 0)
        return MOTION_E_IO;
    err = thread_linux_start(&self->thread, modbus_libmodbus_run, self) == 0
              ? MOTION_OK
              : MOTION_E_IO;
    if (err < 0)
        close(self->wake);
    return err;
}

void modbus_libmodbus_close(struct modbus_libmodbus *self)
{
    atomic_store(&self->stop, true);
    modbus_libmodbus_kick(self);
    pthread_join(self->thread, NULL);
    close(self->wake);
}
