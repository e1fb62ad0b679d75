/* sim/sim_cia402.h - a CiA 402 servo drive as it looks from its CAN port.
 *
 * Object dictionary with access rules and abort codes, NMT states, heartbeat
 * producer and consumer, PDO communication and mapping parameters (refused in
 * the order real drives refuse them), SYNC, the power state machine with its
 * sixteen transitions, quick stop option codes, fault reaction, following error
 * window, CSP with interpolation over one SYNC period, position actual from the
 * plant.  Written from CiA 301 and CiA 402-2, independently of hal/. */
#ifndef SIM_SIM_CIA402_H
#define SIM_SIM_CIA402_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/plant.h"
#include "sim/sim_can.h"

struct sim_cia402_config {
    uint8_t node_id;
    struct sim_plant_config plant;
    int32_t start_counts;     /* where it stands at power-on */
    int64_t loop_ns;          /* inner loop, 62500 .. 1000000 */
    int64_t brake_release_ns; /* Switched on -> Operation enabled takes this */
    int64_t boot_ns;          /* power-on to boot-up message */
};

/* What a test or a script may do to it. */
enum sim_cia402_fault {
    SIM_CIA402_OVERCURRENT, /* EMCY 0x2310, fault reaction, Fault */
    SIM_CIA402_REBOOT,      /* power cycle: boot-up, all volatile gone */
    SIM_CIA402_SILENT,      /* off the bus: hears and says nothing */
    SIM_CIA402_BLOCKED,     /* the rotor does not move */
    SIM_CIA402_CLEAR,       /* SILENT and BLOCKED end */
};

/* One object dictionary entry; defined in sim_cia402.c. */
struct sim_cia402_object;

#define SIM_CIA402_OBJECTS_MAX 96

struct sim_cia402 {
    struct sim_member member;
    struct sim_can_port port;
    struct sim_world *world;
    struct sim_cia402_config config;
    struct sim_plant plant;
    uint32_t value[SIM_CIA402_OBJECTS_MAX]; /* by row of the dictionary */
    int power_state; /* private to sim_cia402.c, as all below */
    uint8_t nmt_state;
    bool silent, blocked;
    int64_t loop_due_ns, heartbeat_due_ns, boot_due_ns, state_due_ns;
    int64_t consumer_due_ns;
    int32_t target_counts, target_previous_counts;
    int64_t sync_ns, sync_period_ns;
    uint64_t following_error_ns;
};

/* Adds the drive to the bus and the world, powered from the world's now. */
int sim_cia402_init(struct sim_cia402 *self, struct sim_can_bus *bus,
                    const struct sim_cia402_config *config);
void sim_cia402_inject(struct sim_cia402 *self, enum sim_cia402_fault fault);
/* What an outside measuring device would see. */
int64_t sim_cia402_pos_q24(const struct sim_cia402 *self);

#endif
