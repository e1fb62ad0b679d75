/* tests/fuzz/fuzz_can_bus.c - an ODrive and a moteus driver, and nobody at the
 * other end but the input: frames, FD too, and pauses. */
#include <string.h>

#include "hal/drive/moteus/drive.h"
#include "hal/drive/odrive/drive.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/fuzz_port.h"

#define MS     INT64_C(1000000)
#define DRIVES 2

struct fuzz_can_bus {
    struct fuzz_port port;
    struct can_bus bus;
    struct drive_odrive odrive;
    struct drive_moteus moteus;
    struct hal_drive *drive[DRIVES];
    int64_t now_ns;
};

static void fuzz_can_bus_init(struct fuzz_can_bus *self)
{
    static const struct drive_turn_config turns = { .turns_num = 1,
                                                    .turns_den = 10,
                                                    .period_ns = MS,
                                                    .latency_ns = 200000,
                                                    .answer_ns = 130000,
                                                    .stop_acc_q32 = 200 << 16 };
    const struct drive_odrive_config odrive = { .node = 3, .turn = turns };
    const struct drive_moteus_config moteus = { .id = 5,
                                                .switched = true,
                                                .turn = turns };

    memset(self, 0, sizeof *self);
    fuzz_port_init(&self->port);
    self->port.fd = true;
    self->now_ns = 1000 * MS;
    can_bus_init(&self->bus, &self->port.can);
    fuzz_claim(drive_odrive_init(&self->odrive, &self->bus, &odrive) == 0 &&
                   drive_moteus_init(&self->moteus, &self->bus, &moteus) == 0,
               "two drives on a bus");
    self->drive[0] = &self->odrive.turn.drive;
    self->drive[1] = &self->moteus.turn.drive;
}

static void fuzz_can_bus_request(struct fuzz_can_bus *self, uint8_t what)
{
    struct hal_drive *drive = self->drive[what & 1];
    const struct hal_drive_go go = { .pos_q32 = INT64_C(1) << 32,
                                     .vel_q32 = INT64_C(1) << 32 };

    switch (what / 2 % 4) {
    case 0:
        hal_drive_request(drive, (enum hal_drive_request)(what / 8 % 4));
        return;
    case 1:
        (void)hal_drive_set_mode(
            drive, (enum hal_drive_mode)(what / 8 % HAL_DRIVE_MODES));
        return;
    case 2:
        (void)hal_drive_go(drive, &go);
        return;
    default:
        self->now_ns += what * MS;
        return;
    }
}

static void fuzz_can_bus_look(struct fuzz_can_bus *self,
                              struct hal_drive *drive)
{
    struct hal_drive_target target = { .pos_q32 = 0 };
    struct hal_drive_feedback feedback;

    hal_drive_feedback(drive, &feedback);
    fuzz_claim(feedback.state <= HAL_DRIVE_FAULT, "a drive has a state");
    fuzz_claim(memchr(feedback.fault_text, 0, sizeof feedback.fault_text) !=
                   NULL,
               "a fault has a text that ends");
    fuzz_claim(feedback.t_ns <= self->now_ns, "nothing is from the future");
    target.pos_q32 = feedback.pos_q32;
    (void)hal_drive_set_target(drive, &target);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct fuzz_can_bus self;

    fuzz_can_bus_init(&self);
    self.port.bytes = (struct fuzz_bytes){ data, size };
    while (self.port.bytes.left > 0) {
        const uint8_t what = fuzz_u8(&self.port.bytes);
        self.port.turn = what & 3;
        if (what & 4)
            fuzz_can_bus_request(&self, fuzz_u8(&self.port.bytes));
        self.now_ns += MS;
        (void)hal_fieldbus_begin(&self.bus.fieldbus, self.now_ns);
        for (unsigned i = 0; i < DRIVES; i++)
            fuzz_can_bus_look(&self, self.drive[i]);
        hal_fieldbus_end(&self.bus.fieldbus, self.now_ns);
    }
    return 0;
}
