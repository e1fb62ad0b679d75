/* hal/drive/cia402/probe.c - touch probe 1.
 *
 *   CLEAR   0x60B8 = 0: the drive forgets the edge before
 *   ARM     0x60B8 = on, first edge, rising or falling
 *   WATCH   0x60B9 every 10 ms, until it has the edge
 *   FETCH   0x60BA or 0x60BB
 *
 * The drive itself stores the position, so asking late loses nothing.  One SDO
 * at a time, and only while no list needs the channel: a list drops ours, then
 * it is asked anew.  A drive that refuses has no probe.  Source: CiA 402-2
 * 9.3. */
#include "hal/drive/cia402/parts.h"

#define PROBE_NS      INT64_C(10000000)
#define PROBE_ON      0x0001u
#define PROBE_RISING  0x0010u
#define PROBE_FALLING 0x0020u
#define PROBE_ROSE    0x0002u
#define PROBE_FELL    0x0004u

enum probe_step {
    PROBE_IDLE,
    PROBE_CLEAR,
    PROBE_ARM,
    PROBE_WATCH,
    PROBE_FETCH,
};

int drive_cia402_set_probe(struct hal_drive *drive, enum hal_drive_probe probe)
{
    struct drive_cia402 *self = drive_cia402_of(drive);

    if (self->state == HAL_DRIVE_OFFLINE)
        return MOTION_E_STATE;
    if (!self->probe.there)
        return MOTION_E_EMPTY;
    if ((unsigned)probe > HAL_DRIVE_PROBE_FALLING)
        return MOTION_E_ARG;
    self->probe.edge = probe;
    self->probe.latched = false;
    self->probe.step = PROBE_CLEAR;
    if (self->list == NULL)
        canopen_sdo_drop(&self->node);
    return MOTION_OK;
}

static void probe_request(struct drive_cia402 *self, int64_t now_ns)
{
    struct drive_cia402_probe *probe = &self->probe;
    const bool rising = probe->edge == HAL_DRIVE_PROBE_RISING;
    const uint32_t arm = PROBE_ON | (rising ? PROBE_RISING : PROBE_FALLING);

    if (now_ns < probe->due_ns)
        return;
    if (probe->step == PROBE_CLEAR || probe->step == PROBE_ARM)
        (void)canopen_sdo_write(&self->node, now_ns,
                                drive_cia402_object(self, 0x60B8), 0, 2,
                                probe->step == PROBE_ARM ? arm : 0);
    else if (probe->step == PROBE_WATCH)
        (void)canopen_sdo_read(&self->node, now_ns,
                               drive_cia402_object(self, 0x60B9), 0);
    else
        (void)canopen_sdo_read(
            &self->node, now_ns,
            drive_cia402_object(self, rising ? 0x60BA : 0x60BB), 0);
}

static void probe_answer(struct drive_cia402 *self, uint32_t value,
                         int64_t now_ns)
{
    struct drive_cia402_probe *probe = &self->probe;
    const bool rising = probe->edge == HAL_DRIVE_PROBE_RISING;

    if (probe->step == PROBE_CLEAR) {
        probe->step =
            probe->edge == HAL_DRIVE_PROBE_OFF ? PROBE_IDLE : PROBE_ARM;
    } else if (probe->step == PROBE_ARM) {
        probe->step = PROBE_WATCH;
    } else if (probe->step == PROBE_FETCH) {
        probe->counts = (int32_t)value;
        probe->latched = true;
        probe->step = PROBE_IDLE;
    } else if ((value & (rising ? PROBE_ROSE : PROBE_FELL)) != 0) {
        probe->step = PROBE_FETCH;
    } else {
        probe->due_ns = now_ns + PROBE_NS;
    }
}

void drive_cia402_probe_step(struct drive_cia402 *self, int64_t now_ns)
{
    uint32_t value = 0;
    int err;

    if (self->probe.step == PROBE_IDLE)
        return;
    err = canopen_sdo_take(&self->node, &value, NULL);
    if (err == MOTION_E_STATE)
        probe_request(self, now_ns);
    else if (err == MOTION_OK)
        probe_answer(self, value, now_ns);
    else if (err == MOTION_E_REFUSED)
        self->probe =
            (struct drive_cia402_probe){ .step = PROBE_IDLE, .there = false };
    else if (err == MOTION_E_TIMEOUT)
        self->probe.due_ns = now_ns + PROBE_NS; /* and again */
}
