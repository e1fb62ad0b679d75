/* tests/fuzz/fuzz_service.c - the protocol of a service: two clients send any
 * bytes, in any pieces, hang up and come back, while ticks go on.
 *
 * A byte says what comes: bits 0-1 what (0 bytes, 1 a command, 2 ticks, 3 hang
 * up), bit 2 which client; then how many bytes, which command, how many ticks. */
#include <errno.h>
#include <time.h>

#include "tests/fuzz/fuzz.h"
#include "tests/support/service_bench.h"

#define FUZZ_CLIENTS 2
#define FUZZ_SAID    262144

static const char fuzz_rig[] =
    "tick: 5 ms\nbuses: {can: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n  slide:\n    unit: mm\n    limits: {position: [-200 mm, 200 mm],"
    " velocity: 200 mm/s, acceleration: 1000 mm/s2}\n"
    "    following_error: {floor: 20 mm, time: 100 ms}\n"
    "    drive: {kind: cia402, bus: can, node: 1, counts: 4096 per mm}\n";

static const char *const fuzz_command[] = {
    "\"hello\"",
    "\"status\"",
    "\"stream\",\"rate\":100",
    "\"stop\"",
    "\"take\"",
    "\"renew\"",
    "\"release\"",
    "\"enable\"",
    "\"off\"",
    "\"reset\"",
    "\"home\"",
    ("\"load\",\"text\":\"axes: {slide: {curve: s-curve, keys: [[0, 0], [1, "
     "9]]}}\""),
    "\"approach\"",
    "\"start\",\"times\":0,\"ping_pong\":true",
    "\"hold\"",
    "\"resume\"",
    "\"reverse\"",
    "\"override\",\"percent\":150",
    "\"jog\",\"axis\":\"slide\",\"speed\":-50",
    "\"jog stop\"",
    "\"capture\"",
};
#define FUZZ_COMMANDS (sizeof fuzz_command / sizeof fuzz_command[0])

static struct service_bench bench;
static int file[FUZZ_CLIENTS];

static void fuzz_close_bench(void)
{
    service_bench_close(&bench);
}

/* Whole lines, each an object. */
static void fuzz_hear(int from)
{
    static char said[FUZZ_SAID];
    size_t length = 0;
    ssize_t got;
    while ((got = recv(from, said + length, sizeof said - 1 - length, 0)) > 0)
        length += (size_t)got;
    said[length] = '\0';
    for (char *at = said, *end; (end = strchr(at, '\n')) != NULL;
         at = end + 1) {
        *end = '\0';
        cJSON *object = cJSON_Parse(at);
        fuzz_claim(cJSON_IsObject(object), "every line is an object");
        cJSON_Delete(object);
    }
}

static void fuzz_tick(unsigned count)
{
    const struct controller *controller = &bench.machine.controller;
    while (count-- > 0)
        service_bench_tick(&bench);
    fuzz_claim(controller->fault.fault == CONTROLLER_FAULT_NONE,
               "no words are a fault");
}

static void fuzz_send(struct fuzz_bytes *bytes, int to)
{
    uint8_t piece[256];
    const size_t length = fuzz_take(bytes, piece, fuzz_u8(bytes));
    (void)send(to, piece, length, MSG_NOSIGNAL);
}

static void fuzz_say(struct fuzz_bytes *bytes, int to)
{
    char line[256];
    const int length = snprintf(line, sizeof line, "{\"command\":%s}\n",
                                fuzz_command[fuzz_u8(bytes) % FUZZ_COMMANDS]);
    (void)send(to, line, (size_t)length, MSG_NOSIGNAL);
}

/* Planning takes real time; what comes of it does not depend on that. */
static void fuzz_wait_for_plan(void)
{
    while (service_bench_plans(&bench)) {
        (void)nanosleep(&(struct timespec){ .tv_nsec = 50000 }, NULL);
        service_bench_serve(&bench);
    }
}

static void fuzz_step(struct fuzz_bytes *bytes)
{
    const uint8_t what = fuzz_u8(bytes);
    int *client = &file[what >> 2 & 1];
    switch (what & 3) {
    case 0:
        fuzz_send(bytes, *client);
        break;
    case 1:
        fuzz_say(bytes, *client);
        break;
    case 2:
        fuzz_tick(fuzz_u8(bytes) % 32u);
        break;
    default:
        close(*client);
        *client = service_bench_connect(&bench);
        break;
    }
    service_bench_serve(&bench);
    fuzz_wait_for_plan();
    if (what & 8) /* else it never reads */
        fuzz_hear(*client);
}

static void fuzz_up(void)
{
    static bool is_open;
    const bool first = !is_open;
    is_open = true;
    fuzz_claim((first ? service_bench_open(&bench, fuzz_rig)
                      : service_bench_machine(&bench)) == 0,
               "there is a machine");
    if (first)
        (void)atexit(fuzz_close_bench);
    for (unsigned i = 0; i < FUZZ_CLIENTS; i++) {
        file[i] = service_bench_connect(&bench);
        fuzz_claim(file[i] >= 0, "a client can connect");
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_bytes bytes = { data, size };
    fuzz_up();
    fuzz_tick(2);
    for (unsigned n = 0; bytes.left > 0 && n < 256; n++)
        fuzz_step(&bytes);
    const bool jogs = bench.control.state->jogging;
    for (unsigned i = 0; i < FUZZ_CLIENTS; i++) {
        fuzz_hear(file[i]);
        close(file[i]);
    }
    fuzz_tick(100);
    fuzz_claim(!jogs || !bench.control.state->jogging ||
                   bench.machine.controller.state == CONTROLLER_HOLDING,
               "a jog ends with its client");
    service_bench_unmake(&bench);
    return 0;
}
