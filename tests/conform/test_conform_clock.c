/* tests/conform/test_conform_clock.c - the claims of conform_clock.h on Linux's
 * clock, on the simulated world's, and on the world that follows Linux's.
 * Reads the real clock. */
#include "firmware/linux/base/disk.h"
#include "tests/conform/conform_clock.h"

#include <string.h>

#include "firmware/linux/machine/machine_sim.h"
#include "hal/linux/clock.h"
#include "sim/world.h"

#define MS INT64_C(1000000)

static int linux_clock(void)
{
    struct clock_linux clock;
    struct conform_clock bench = { "clock_linux", clock_linux_init(&clock),
                                   5 * MS };

    return conform_clock(&bench);
}

static int world_clock(void)
{
    struct sim_world world;
    struct conform_clock bench = { "the simulated world", &world.clock, 0 };

    sim_world_init(&world, 1000 * MS);
    return conform_clock(&bench);
}

static int follower_clock(void)
{
    static struct machine_sim sim;
    static struct rig rig;
    struct machine_ports ports;
    char message[YAML_MESSAGE_MAX];
    struct conform_clock bench = { "the world in real time", NULL, 5 * MS };

    if (rig_load(&disk_files, "examples/odrive/rig.yaml", &rig, message) < 0 ||
        machine_sim_init(&sim, &rig, true, &ports, message) < 0) {
        print_error("%s\n", message);
        return 1;
    }
    bench.clock = ports.clock;
    return conform_clock(&bench);
}

int main(void)
{
    return linux_clock() + world_clock() + follower_clock();
}
