/* firmware/linux/service/service.c - see service.h. */
#define _GNU_SOURCE /* mlockall's flags */
#include "firmware/linux/service/service.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "firmware/host/base/memory.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/machine/machine_real.h"
#include "firmware/linux/machine/machine_sim.h"
#include "firmware/linux/service/control.h"
#include "firmware/linux/service/notify.h"
#include "firmware/linux/service/place.h"
#include "hal/support/crc32.h"
#include "motion/core/err.h"

#define SERVICE_STEP_MS 10
#define SERVICE_RIG_MAX 1048576

/* All in one piece, of which every page is touched before the memory is
 * locked. */
struct service {
    const struct service_config *config;
    struct rig rig;
    char *rig_text;
    size_t rig_length;
    struct guardian guardian;
    struct machine_sim sim;
    struct machine_real real;
    struct machine machine;
    struct service_loop loop;
    struct service_frames frames;
    struct service_recording recording;
    struct service_control control;
    char path[SERVICE_PATH_MAX];
    char *clock; /* the real path, for free() */
    bool is_open;
    int64_t watchdog_ns, fed_ns, fed_tick_ns;
};

/* --- up --- */

static enum status service_read(struct service *self)
{
    const struct service_config *config = self->config;
    struct messages messages = { .text = NULL };
    char message[YAML_MESSAGE_MAX];
    const int64_t length = files_load(&disk_files, config->rig_path,
                                      SERVICE_RIG_MAX, &self->rig_text);
    if (length < 0)
        return error_file(config->rig_path, strerror((int)-length));
    self->rig_length = (size_t)length;
    const enum status status =
        job_read_rig(&disk_files, config->rig_path, &self->rig, &messages);
    error_tell(&messages);
    if (status != STATUS_OK)
        return status;
    if (config->clock != NULL &&
        (self->clock = realpath(config->clock, NULL)) == NULL)
        return error_file(config->clock, strerror(errno));
    if (config->interface == NULL ||
        rig_set_interfaces(&self->rig, config->interface, message) == 0)
        return STATUS_OK;
    error_say("slew %s: --interface: %s", config->command, message);
    return STATUS_INPUT;
}

static enum status service_socket(struct service *self)
{
    const struct service_config *config = self->config;
    if (config->socket == NULL) {
        if (service_place_new(config->rig_path, config->command, self->path) <
            0)
            return STATUS_SYSTEM;
    } else if (snprintf(self->path, sizeof self->path, "%s", config->socket) >=
               (int)sizeof self->path) {
        return error_file(config->socket, "the name of the socket is too long");
    }
    if (service_clients_open(&self->control.clients, self->path,
                             config->group ? 0660 : 0600) < 0)
        return STATUS_SYSTEM;
    self->is_open = true;
    return STATUS_OK;
}

static enum status service_machine(struct service *self)
{
    const struct service_config *config = self->config;
    struct machine_ports ports;
    char message[YAML_MESSAGE_MAX];
    if (config->real &&
        rig_may_move_drives(&self->rig, config->rig_path, message) < 0) {
        error_say("%s", message);
        return STATUS_INPUT;
    }
    const struct machine_real_config real = { .lock.rig_path = config->rig_path,
                                              .reaches = true };
    int err =
        config->real
            ? machine_real_init(&self->real, &self->rig, &real, &ports, message)
            : machine_sim_init(&self->sim, &self->rig, true, &ports, message);
    if (err == MOTION_OK) {
        ports.guardian = self->guardian.page;
        return machine_init(&self->machine, &self->rig, &ports, message) < 0
                   ? error_file(config->rig_path, message)
                   : STATUS_OK;
    }
    const enum status status = error_file(config->rig_path, message);
    return config->real && machine_real_may_come(err) ? STATUS_REFUSED : status;
}

static enum status service_planner(struct service *self)
{
    const struct service_config *config = self->config;
    const int err = service_planner_start(&self->control.planner, &self->rig,
                                          config->rig_path, &config->plan);
    if (err == 0)
        return STATUS_OK;
    error_say("slew %s: no process to plan in: %s", config->command,
              strerror(err));
    return STATUS_SYSTEM;
}

static void service_control(struct service *self)
{
    struct service_control *control = &self->control;
    control->rig = &self->rig;
    control->rig_path = self->config->rig_path;
    control->rig_crc = crc32_of(0, self->rig_text, self->rig_length);
    control->is_real = self->config->real;
    control->clock = self->clock;
    control->loop = &self->loop;
    control->clients.mailbox = &self->loop.mailbox;
    service_control_reserve(control, &self->loop.memory);
    control->recording = &self->recording;
    control->rig_text = self->rig_text;
    control->rig_length = self->rig_length;
    control->state = service_board_read(&self->loop.board);
}

/* Whatever the tick touches is there and stays there. */
static void service_lock(struct service *self)
{
    self->control.is_locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    if (!self->control.is_locked)
        fprintf(stderr,
                "the memory is not locked (%s), so a tick may wait for a page: "
                "expected a larger RLIMIT_MEMLOCK or CAP_IPC_LOCK\n",
                strerror(errno));
}

static enum status service_begin(struct service *self)
{
    service_lock(self);
    const int err = service_loop_start(&self->loop);
    if (err != 0) {
        error_say("slew %s: no thread for the tick: %s", self->config->command,
                  strerror(err));
        return STATUS_SYSTEM;
    }
    const int refused = service_clients_start(&self->control.clients);
    if (refused != 0) {
        error_say("slew %s: no thread for clients: %s", self->config->command,
                  strerror(refused));
        self->loop.end = 1;
        service_loop_join(&self->loop);
        return STATUS_SYSTEM;
    }
    if (self->loop.refused != 0)
        fprintf(stderr,
                "the tick has no real-time priority (%s): expected "
                "RLIMIT_RTPRIO %d or CAP_SYS_NICE\n",
                strerror(self->loop.refused), SERVICE_PRIORITY);
    return STATUS_OK;
}

/* --- running --- */

/* The manager hears of us as long as the tick goes on. */
static void service_feed(struct service *self)
{
    const struct service_control *control = &self->control;
    if (self->watchdog_ns == 0 ||
        control->now_ns - self->fed_ns < self->watchdog_ns / 4 ||
        control->state->now_ns == self->fed_tick_ns)
        return;
    self->fed_ns = control->now_ns;
    self->fed_tick_ns = control->state->now_ns;
    service_notify("WATCHDOG=1");
}

static void service_serve(struct service *self,
                          const volatile sig_atomic_t *interrupts)
{
    error_hasten(true);
    while (!self->loop.ended) {
        service_control_step(&self->control, SERVICE_STEP_MS);
        service_feed(self);
        if (*interrupts > 0 && self->loop.end == 0)
            service_notify("STOPPING=1");
        self->loop.end = *interrupts;
        shutdown_say_waiting(&self->loop.shutdown);
    }
    service_loop_join(&self->loop);
    error_hasten(false);
}

/* The tick runs already: where this fails it has to end. */
static enum status service_beside(struct service *self)
{
    const struct service_beside *beside = self->config->beside;
    if (beside == NULL || beside->start(beside->context, &self->rig, self->path,
                                        &self->frames) == 0)
        return STATUS_OK;
    self->loop.end = 1;
    service_loop_join(&self->loop);
    return STATUS_SYSTEM;
}

static enum status service_live(struct service *self)
{
    sigset_t before;
    const volatile sig_atomic_t *interrupts = interrupt_listen();
    interrupt_mask(&before); /* for the threads that it starts */
    service_control(self);
    enum status status = service_begin(self);
    if (status == STATUS_OK)
        status = service_beside(self);
    interrupt_unmask(&before);
    if (status == STATUS_OK) {
        printf("%s: %s drives, a tick of %.3f ms, socket %s\n",
               self->config->rig_path,
               self->config->real ? "REAL" : "simulated",
               (double)self->rig.period_ns / 1e6, self->path);
        fflush(stdout);
        if (self->config->records)
            service_record_by_time(&self->control);
        self->watchdog_ns = service_notify_watchdog_ns();
        service_notify("READY=1");
        service_serve(self, interrupts);
        status =
            shutdown_say_torque(&self->machine) ? STATUS_OK : STATUS_REFUSED;
    }
    interrupt_listen_no_more();
    return status;
}

/* A lamp goes out with the torque, and not without it. */
static void service_leave_lamps(struct service *self)
{
    for (unsigned i = 0; i < self->real.gpio.count; i++)
        if (self->rig.line[i].kind == RIG_LINE_LAMP)
            machine_gpio_leave(&self->real.gpio, i);
}

static void service_down(struct service *self)
{
    struct service_control *control = &self->control;
    if (self->config->beside != NULL)
        self->config->beside->stop(self->config->beside->context);
    if (!machine_is_off(&self->machine))
        service_leave_lamps(self);
    service_clients_stop(&control->clients);
    if (self->is_open)
        service_clients_close(&control->clients, self->path);
    service_planner_end(&control->planner);
    service_recording_free(&self->recording);
    service_move_free(control->move);
    service_move_free(control->old_move);
    service_cam_free(control);
    service_follow_free(control);
    machine_real_close(&self->real);
    guardian_end(&self->guardian);
    service_loop_free(&self->loop);
    machine_free(&self->machine);
    machine_sim_free(&self->sim);
    rig_free(&self->rig);
    memory_free(self->rig_text);
    free(self->clock);
}

enum status service_run(const struct service_config *config)
{
    struct service *self = memory_new(1, sizeof *self);
    self->config = config;
    enum status status = service_read(self);
    if (status == STATUS_OK)
        status = service_planner(self);
    if (status == STATUS_OK && config->real &&
        guardian_start(&self->guardian, &self->rig) < 0)
        status = STATUS_SYSTEM;
    if (status == STATUS_OK)
        status = service_socket(self);
    if (status == STATUS_OK)
        status = service_machine(self);
    if (status == STATUS_OK) {
        service_loop_init(&self->loop, &self->machine, config->cpu);
        service_frames_init(&self->frames, &self->rig, &self->loop.memory);
        self->loop.frames = config->beside != NULL ? &self->frames : NULL;
        service_recording_init(&self->recording, config->recordings, &self->rig,
                               self->machine.ports.clock);
        self->loop.recording = &self->recording;
        status = service_live(self);
    }
    service_down(self);
    memory_free(self);
    return status;
}
