/* tests/support/service_bench.h - a service on simulated drives in virtual time,
 * in one thread: whoever has it does the ticks, and is its clients.
 *
 * The socket is a real one; the planner is a thread of its own, as it is, and is
 * waited for. */
#ifndef TESTS_SUPPORT_SERVICE_BENCH_H
#define TESTS_SUPPORT_SERVICE_BENCH_H

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "firmware/host/job/job.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/machine/machine_sim.h"
#include "firmware/linux/service/control.h"
#include "hal/support/crc32.h"

static const struct service_plan_limit service_bench_plan = {
    .mib = 1024, /* with sanitizers */
};

struct service_bench {
    char directory[32], socket[64], rig_path[64];
    const char *rig_text;
    struct rig rig;
    struct machine_sim sim;
    struct machine machine;
    struct service_loop loop;
    struct service_control control;
};

/* -1: it cannot be.  The bench is all zero; the planner goes on when the
 * machine is built anew. */
static inline int service_bench_machine(struct service_bench *self)
{
    struct service_control *control = &self->control;
    struct machine_ports ports;
    char message[YAML_MESSAGE_MAX];
    if (machine_sim_init(&self->sim, &self->rig, false, &ports, message) < 0 ||
        machine_init(&self->machine, &self->rig, &ports, message) < 0)
        return -1;
    memset(&self->loop, 0, sizeof self->loop);
    service_loop_init(&self->loop, &self->machine, -1);
    service_control_reserve(control, &self->loop.memory);
    control->holder = NULL;
    control->jogged = control->jog_stops = false;
    control->flights = 0;
    control->loop = &self->loop;
    control->clients.mailbox = &self->loop.mailbox;
    control->state = service_board_read(&self->loop.board);
    return 0;
}

static inline int service_bench_open(struct service_bench *self,
                                     const char *rig_text)
{
    struct service_control *control = &self->control;
    struct messages messages = { .text = NULL };
    self->rig_text = rig_text;
    snprintf(self->directory, sizeof self->directory, "/tmp/slew-bench-XXXXXX");
    if (mkdtemp(self->directory) == NULL)
        return -1;
    snprintf(self->socket, sizeof self->socket, "%s/socket", self->directory);
    snprintf(self->rig_path, sizeof self->rig_path, "%s/rig.yaml",
             self->directory);
    FILE *file = fopen(self->rig_path, "w");
    if (file == NULL || fputs(rig_text, file) < 0 || fclose(file) != 0)
        return -1;
    const enum status status =
        job_read_rig(&disk_files, self->rig_path, &self->rig, &messages);
    messages_free(&messages);
    if (status != STATUS_OK)
        return -1;
    control->rig = &self->rig;
    control->rig_path = self->rig_path;
    control->rig_crc = crc32_of(0, rig_text, strlen(rig_text));
    if (service_planner_start(&control->planner, &self->rig, self->rig_path,
                              &service_bench_plan) != 0)
        return -1;
    return service_clients_open(&control->clients, self->socket, 0600) < 0
               ? -1
               : service_bench_machine(self);
}

static inline void service_bench_unmake(struct service_bench *self)
{
    struct service_control *control = &self->control;
    service_move_free(control->move);
    service_move_free(control->old_move);
    control->move = control->old_move = NULL;
    service_cam_free(control);
    service_follow_free(control);
    service_loop_free(&self->loop);
    machine_free(&self->machine);
    machine_sim_free(&self->sim);
}

static inline void service_bench_close(struct service_bench *self)
{
    service_clients_close(&self->control.clients, self->socket);
    service_planner_end(&self->control.planner);
    service_bench_unmake(self);
    rig_free(&self->rig);
    unlink(self->rig_path);
    rmdir(self->directory);
}

/* What clients have sent is read, and answered once a tick has taken it. */
static inline void service_bench_serve(struct service_bench *self)
{
    (void)service_clients_look(&self->control.clients, 0);
    service_control_step(&self->control, 0);
}

static inline void service_bench_tick(struct service_bench *self)
{
    service_loop_tick(&self->loop);
    service_bench_serve(self);
}

/* Opened, with its drives found. */
static inline int service_bench_ready(struct service_bench *self,
                                      const char *rig_text)
{
    memset(self, 0, sizeof *self);
    if (service_bench_open(self, rig_text) < 0)
        return -1;
    for (int i = 0; i < 100; i++)
        service_bench_tick(self);
    return 0;
}

static inline bool service_bench_plans(const struct service_bench *self)
{
    return self->control.planner.works;
}

/* A new client; it never waits. */
static inline int service_bench_connect(struct service_bench *self)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const int file = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    snprintf(address.sun_path, sizeof address.sun_path, "%s", self->socket);
    if (file < 0 ||
        connect(file, (struct sockaddr *)&address, sizeof address) < 0)
        return -1;
    (void)fcntl(file, F_SETFL, O_NONBLOCK);
    service_bench_serve(self);
    return file;
}

#endif
