/* tests/fuzz/fuzz_sdo_server.c - a simulated servo that hears nothing but the
 * input: SDO, PDO, NMT, LSS, SYNC, whatever.  What it sends can be sent, and
 * afterwards it still answers, unless LSS has given it another number. */
#include <string.h>

#include "hal/canopen/canopen.h"
#include "sim/device/cia402/servo.h"
#include "tests/fuzz/fuzz.h"

#define MS   INT64_C(1000000)
#define NODE 5

struct fuzz_server {
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port port;
    struct sim_cia402 servo;
};

static void fuzz_server_init(struct fuzz_server *self)
{
    const struct sim_cia402_config servo = {
        .node_id = NODE,
        .plant = { .omega_mrad_s = 200000,
                   .zeta_permille = 1000,
                   .vel_max_counts_s = 2000000,
                   .acc_max_counts_s2 = 20000000 },
        .loop_ns = 1000000,
    };

    memset(self, 0, sizeof *self);
    sim_world_init(&self->world, 1000 * MS);
    fuzz_claim(sim_can_bus_init(&self->bus, &self->world, 1000000) == 0,
               "a bus");
    sim_can_port_init(&self->port, &self->bus);
    fuzz_claim(sim_cia402_init(&self->servo, &self->bus, &servo) == 0,
               "a servo on a bus");
}

static unsigned fuzz_server_hear(struct fuzz_server *self, uint32_t id)
{
    struct hal_can_frame frame;
    unsigned heard = 0;

    while (hal_can_recv(&self->port.can, &frame) == 1) {
        fuzz_claim(hal_can_is_legal(&frame, false), "an answer is a frame");
        heard += frame.id == id;
    }
    return heard;
}

static void fuzz_server_send(struct fuzz_server *self,
                             const struct hal_can_frame *frame)
{
    (void)hal_can_send(&self->port.can, frame);
    sim_world_run(&self->world, self->world.now_ns + MS);
    (void)fuzz_server_hear(self, 0);
}

/* Each round at least one frame gets out that nobody acknowledged, and may
 * silence the servo anew. */
static void fuzz_server_end_injections(struct fuzz_server *self)
{
    do {
        sim_cia402_inject(&self->servo, SIM_CIA402_CLEAR);
        sim_world_run(&self->world, self->world.now_ns + 10 * MS);
        (void)fuzz_server_hear(self, 0);
    } while (self->port.tx.count > 0 || self->servo.base.port.off);
}

/* Reset it, and ask for its device type. */
static void fuzz_server_asks(struct fuzz_server *self)
{
    static const struct hal_can_frame reset = {
        .len = 2, .data = { CANOPEN_NMT_RESET_NODE, 0 }
    };
    static const struct hal_can_frame request = {
        .id = 0x600 + NODE, .len = 8, .data = { 0x40, 0x00, 0x10 }
    };

    (void)hal_can_send(&self->port.can, &reset);
    sim_world_run(&self->world, self->world.now_ns + 200 * MS);
    (void)fuzz_server_hear(self, 0);
    (void)hal_can_send(&self->port.can, &request);
    sim_world_run(&self->world, self->world.now_ns + 20 * MS);
    fuzz_claim(fuzz_server_hear(self, 0x580 + NODE) == 1, "it answers again");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct fuzz_server self;
    struct fuzz_bytes bytes = { data, size };
    unsigned frames = 0;
    bool numbered = false;

    fuzz_server_init(&self);
    while (bytes.left > 0 && frames++ < 200) {
        const struct hal_can_frame frame = fuzz_frame(&bytes);
        numbered |= frame.id == 0x7E5;
        fuzz_server_send(&self, &frame);
    }
    fuzz_server_end_injections(&self);
    if (!numbered)
        fuzz_server_asks(&self);
    return 0;
}
