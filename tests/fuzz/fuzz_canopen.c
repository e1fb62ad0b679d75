/* tests/fuzz/fuzz_canopen.c - the master with a drive, a guarded node and LSS,
 * and nobody at the other end but the input: frames and pauses. */
#include <string.h>

#include "hal/canopen/lss.h"
#include "hal/drive/cia402/drive.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/fuzz_port.h"

#define MS INT64_C(1000000)

struct fuzz_canopen {
    struct fuzz_port port;
    struct canopen master;
    struct canopen_lss lss;
    struct canopen_node node;
    struct drive_cia402 drive;
    uint8_t into[256];
    int64_t now_ns;
};

static void fuzz_canopen_init(struct fuzz_canopen *self)
{
    static const struct canopen_node_ops none = { .step = NULL };
    const struct canopen_config config = { .node_id = 127,
                                           .sync_period_ns = MS,
                                           .heartbeat_period_ns = 20 * MS,
                                           .sdo_gap_ns = 1 };
    const struct drive_cia402_config drive = {
        .node_id = 5, .counts_num = 1000, .counts_den = 1, .sync_period_ns = MS
    };

    memset(self, 0, sizeof *self);
    fuzz_port_init(&self->port);
    self->now_ns = 1000 * MS;
    fuzz_claim(canopen_init(&self->master, &self->port.can, &config) == 0 &&
                   drive_cia402_init(&self->drive, &self->master, &drive) == 0,
               "a master and a drive");
    self->node = (struct canopen_node){ .ops = &none,
                                        .id = 6,
                                        .guard_period_ns = 50 * MS };
    fuzz_claim(canopen_add(&self->master, &self->node) == 0, "a node");
    canopen_lss_init(&self->lss, &self->master);
    self->master.lss = &self->lss;
}

/* What a person could ask for next. */
static void fuzz_canopen_request(struct fuzz_canopen *self, uint8_t what)
{
    static const uint8_t from[200] = { 1, 2, 3 };

    (void)canopen_sdo_take(&self->node, NULL, NULL);
    (void)canopen_lss_take(&self->lss);
    switch (what % 8) {
    case 0:
        hal_drive_request(&self->drive.drive,
                          (enum hal_drive_request)(what / 8 % 4));
        return;
    case 1:
        (void)canopen_sdo_read(&self->node, self->now_ns, 0x1018, 1);
        return;
    case 2:
        (void)canopen_sdo_read_bytes(&self->node, self->now_ns, 0x1008, 0,
                                     self->into, sizeof self->into,
                                     (what & 8) != 0);
        return;
    case 3:
        (void)canopen_sdo_write_bytes(&self->node, self->now_ns, 0x1F50, 1,
                                      from, 1 + what % sizeof from,
                                      (what & 8) != 0);
        return;
    case 4:
        (void)canopen_lss_scan(&self->lss, self->now_ns);
        return;
    case 5:
        (void)canopen_lss_set_node(&self->lss, self->now_ns, 7);
        return;
    case 6:
        (void)canopen_sdo_write(&self->node, self->now_ns, 0x1017, 0, 2, what);
        return;
    default:
        self->now_ns += what * MS;
        return;
    }
}

static void fuzz_canopen_cycle(struct fuzz_canopen *self)
{
    const struct hal_drive_target target = { .pos_q32 = INT64_C(7) << 32 };
    struct hal_drive_feedback feedback;

    self->now_ns += MS;
    (void)hal_fieldbus_begin(&self->master.fieldbus, self->now_ns);
    hal_drive_feedback(&self->drive.drive, &feedback);
    fuzz_claim(feedback.state <= HAL_DRIVE_FAULT, "a drive has a state");
    fuzz_claim(memchr(feedback.fault_text, 0, sizeof feedback.fault_text) !=
                   NULL,
               "a fault has a text that ends");
    fuzz_claim(feedback.t_ns <= self->now_ns, "nothing is from the future");
    (void)hal_drive_set_target(&self->drive.drive, &target);
    hal_fieldbus_end(&self->master.fieldbus, self->now_ns);
    fuzz_claim(self->node.sdo.at <= sizeof self->into || self->node.sdo.write,
               "a read stays in its room");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct fuzz_canopen self;

    fuzz_canopen_init(&self);
    self.port.bytes = (struct fuzz_bytes){ data, size };
    while (self.port.bytes.left > 0) {
        const uint8_t what = fuzz_u8(&self.port.bytes);
        self.port.turn = what & 3;
        if (what & 4)
            fuzz_canopen_request(&self, fuzz_u8(&self.port.bytes));
        fuzz_canopen_cycle(&self);
    }
    return 0;
}
