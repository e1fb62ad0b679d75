/* tests/hal/drive/modbus/test_stream_sweep.c - streamed Modbus axes of many
 * kinds in simulation: every rig that slew check accepts runs its move without
 * a fault and inside its following error, and its motor does not swing.
 *
 * First maps x lines x gearings of one move with the values that a rig has by
 * default, then SWEEPS=300 rigs of random map, line, gearing, limits, following
 * error, tick, motor, and a second drive on the line. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/host/job/budget.h"
#include "firmware/host/rig/modbus_stream.h"
#include "sim/device/modbus/servo.h"
#include "tests/firmware/linux/machine/machine_bench.h"
#include "tests/support/kind/drives.h"

#define SWEEP_DIR     "build/test_stream_sweep"
#define SWEEP_REST_NS INT64_C(2000000000) /* watched after the move */
#define SWEEP_SEED    UINT64_C(7)

static const char *const sweep_maps[] = { "leadshine-el7", "leadshine-cs2rs",
                                          "oriental-az", "lexium-32",
                                          "delta-asda" };
static const char *const sweep_lines[] = {
    "{kind: modbus-tcp, host: localhost}",
    "{kind: modbus-rtu, device: /dev/ttyUSB0, baud: 115200, parity: none, "
    "stop_bits: 2}",
    "{kind: modbus-rtu, device: /dev/ttyUSB0, baud: 38400, parity: none, "
    "stop_bits: 2}",
};

struct sweep_rig {
    const char *map, *line;
    int64_t counts; /* per revolution of the axis */
    double tick_ms, bandwidth;
    double vel, acc, stop, floor, time_ms; /* deg, s */
    double displacement, dur;              /* of the move, from 0 */
    bool two;                              /* another drive on the line */
};

struct sweep_result {
    bool accepted;
    enum controller_fault fault;
    double off;     /* most, of what is allowed */
    double vel_off; /* of the motor from the set point, deg/s */
    double after;   /* peak to peak, 1.5 s after the move, deg */
};

/* ---- files ---- */

static FILE *sweep_open(const char *name)
{
    char path[128];
    FILE *file;

    (void)mkdir(SWEEP_DIR, 0777);
    snprintf(path, sizeof path, SWEEP_DIR "/%s.yaml", name);
    file = fopen(path, "w");
    assert_non_null(file);
    return file;
}

static void sweep_put_axis(FILE *file, const struct sweep_rig *rig,
                           const char *name, int node)
{
    fprintf(file,
            "  %s:\n    unit: deg\n"
            "    limits: {position: [%g deg, %g deg], velocity: %g deg/s, "
            "acceleration: %g deg/s2}\n"
            "    stop: {acceleration: %g deg/s2}\n"
            "    following_error: {floor: %g deg, time: %g ms}\n"
            "    drive: {kind: modbus, bus: line, node: %d, map: %s, counts: "
            "%" PRId64 " per rev, unsupervised: yes}\n"
            "    sim: {bandwidth: %g Hz}\n",
            name, fmin(0, rig->displacement) - 0.001,
            fmax(0, rig->displacement) + 0.001, rig->vel, rig->acc, rig->stop,
            rig->floor, rig->time_ms, node, rig->map, rig->counts,
            rig->bandwidth);
}

static void sweep_write(const struct sweep_rig *rig)
{
    FILE *file = sweep_open("rig");

    fprintf(file, "title: sweep\ntick: %g ms\nbuses:\n  line: %s\naxes:\n",
            rig->tick_ms, rig->line);
    sweep_put_axis(file, rig, "pan", 1);
    if (rig->two)
        sweep_put_axis(file, rig, "idle", 2);
    fclose(file);
    file = sweep_open("move");
    fprintf(file,
            "title: sweep\nfps: 25\naxes:\n  pan:\n    curve: quintic\n"
            "    keys: [[0 s, 0 deg], [%g s, %g deg]]\n",
            rig->dur, rig->displacement);
    fclose(file);
}

/* ---- a run ---- */

static double units(int64_t q32)
{
    return ldexp((double)q32, -32);
}

static void sweep_measure(const struct sweep_rig *rig,
                          struct sweep_result *result)
{
    const struct controller_axis *axis = &machine.controller.axis[0];
    const struct sim_plant *plant = &SERVO_OF(sim_modbus_servo, &sim, 0)->plant;
    const double vel = units(axis->target.vel_q32);
    const double motor = ldexp((double)plant->vel_q24, -24) * 360 /
                         (double)llabs(rig->counts) *
                         (rig->counts < 0 ? -1 : 1);
    const double allowed = fmax(rig->floor, fabs(vel) * rig->time_ms / 1000);

    result->vel_off = fmax(result->vel_off, fabs(motor - vel));
    result->off = fmax(result->off, fabs(units(axis->following_q32)) / allowed);
}

static void sweep_stand(const struct sweep_rig *rig,
                        struct sweep_result *result)
{
    int64_t low = INT64_MAX, high = INT64_MIN;

    for (const int64_t end_ns = now_ns + SWEEP_REST_NS; now_ns < end_ns;) {
        const int64_t pos_q24 =
            SERVO_OF(sim_modbus_servo, &sim, 0)->plant.pos_q24;

        tick();
        sweep_measure(rig, result);
        if (end_ns - now_ns > SWEEP_REST_NS / 4)
            continue;
        low = pos_q24 < low ? pos_q24 : low;
        high = pos_q24 > high ? pos_q24 : high;
    }
    result->after =
        ldexp((double)(high - low), -24) * 360 / (double)llabs(rig->counts);
}

static void sweep_run(const struct sweep_rig *rig, struct sweep_result *result)
{
    const struct motion_track *track[CONTROLLER_AXES_MAX] = { &job.track[0] };

    bench_build_ready(&job.rig);
    ticks(200);
    assert_int_equal(controller_start(&machine.controller, track, NULL), 0);
    while (machine.controller.state == CONTROLLER_MOVING) {
        tick();
        sweep_measure(rig, result);
    }
    if (machine.controller.state == CONTROLLER_READY)
        sweep_stand(rig, result);
    result->fault = machine.controller.fault.fault;
}

static struct sweep_result sweep_one(const struct sweep_rig *rig)
{
    struct sweep_result result = { .accepted = false };

    sweep_write(rig);
    if (job_setup(SWEEP_DIR) == 0) {
        job_check(&job, INT64_C(1) << 30);
        result.accepted = job.violation_count == 0 &&
                          budget_check(&job.rig, job.rig_path, &job.messages);
        messages_free(&job.messages);
        if (result.accepted)
            sweep_run(rig, &result);
    }
    return result;
}

/* ---- the judge ---- */

/* How far the motor's speed may be from the set point's: a step of the drive's
 * speed, and the correction; what the motor (twice the stop acceleration)
 * changes until a set point has reached it, its own loop included; what it
 * reaches over a step of the position, which is two counts, and what the axis
 * runs in a cycle where the drive goes there at once. */
static double sweep_vel_bound(const struct sweep_rig *rig)
{
    struct drive_modbus_config config;
    struct drive_modbus_fields fields;
    struct drive_modbus_law law;
    double late_s, step;

    modbus_stream_config(&job.rig, 0, &config);
    drive_modbus_fields(&config, &fields);
    assert_int_equal(drive_modbus_law(&config, &law), MOTION_OK);
    late_s = (double)(config.cycle_ns + config.latency_ns) / 1e9 +
             rig->tick_ms / 1000 + 2 / (6.2832 * rig->bandwidth);
    step = 2 * units(fields.count_q32);
    if (law.is_near && law.is_hard)
        step += rig->vel * (double)config.cycle_ns / 1e9;
    return units(fields.step_q32 + law.correct_max_q32) +
           2 * rig->stop * late_s + sqrt(4 * rig->stop * step);
}

static void sweep_judge(const struct sweep_rig *rig,
                        const struct sweep_result *result)
{
    const double bound = sweep_vel_bound(rig);
    const double count = 360 / (double)llabs(rig->counts);

    if (result->fault == CONTROLLER_FAULT_NONE && result->off <= 1 &&
        result->vel_off <= bound && result->after <= 2 * count)
        return;
    fail_msg("%s on %.40s, %" PRId64 " per rev, tick %g ms, %g Hz, velocity "
             "%g, acceleration %g, stop %g, following error %g and %g ms, %g "
             "deg in %g s%s: %s, %.2f of its following error, motor off by "
             "%.3f deg/s (at most %.3f), %.4f deg after it",
             rig->map, rig->line, rig->counts, rig->tick_ms, rig->bandwidth,
             rig->vel, rig->acc, rig->stop, rig->floor, rig->time_ms,
             rig->displacement, rig->dur, rig->two ? ", two drives" : "",
             controller_fault_text(result->fault), result->off, result->vel_off,
             bound, result->after);
}

struct sweep_count {
    unsigned rigs, accepted;
    double off, vel_off;
};

static void sweep_add(struct sweep_count *count, const struct sweep_rig *rig)
{
    const struct sweep_result result = sweep_one(rig);

    count->rigs++;
    if (result.accepted) {
        count->accepted++;
        count->off = fmax(count->off, result.off);
        count->vel_off =
            fmax(count->vel_off, result.vel_off / sweep_vel_bound(rig));
        sweep_judge(rig, &result);
    }
    job_free(&job);
}

static void sweep_end(const struct sweep_count *count)
{
    printf("%u of %u rigs accepted; at most %.2f of the following error, %.2f "
           "of the motor's bound\n",
           count->accepted, count->rigs, count->off, count->vel_off);
    assert_true(2 * count->accepted >= count->rigs);
}

/* ---- the tests ---- */

static void the_grid_of_default_values(void **state)
{
    static const int64_t counts[] = { 10000, 36000, 131072, 500000, 3600000 };
    struct sweep_count count = { .rigs = 0 };

    (void)state;
    for (unsigned m = 0; m < ARRAY_LEN(sweep_maps); m++)
        for (unsigned l = 0; l < ARRAY_LEN(sweep_lines); l++)
            for (unsigned g = 0; g < ARRAY_LEN(counts); g++) {
                const struct sweep_rig rig = { .map = sweep_maps[m],
                                               .line = sweep_lines[l],
                                               .counts = counts[g],
                                               .tick_ms = 1,
                                               .bandwidth = 25,
                                               .vel = 30,
                                               .acc = 10,
                                               .stop = 10,
                                               .floor = 1,
                                               .time_ms = 20,
                                               .displacement = 60,
                                               .dur = 10 };

                sweep_add(&count, &rig);
            }
    sweep_end(&count);
}

/* Evenly in the logarithm. */
static double between(uint64_t *seed, double low, double high)
{
    const double r = ldexp((double)(check_random(seed) >> 11), -53);

    return low * pow(high / low, r);
}

static bool perhaps(uint64_t *seed)
{
    return check_random_in(seed, 0, 1) == 1;
}

/* Up to the limits of velocity and acceleration, as a quintic reaches them. */
static void random_move(uint64_t *seed, struct sweep_rig *rig)
{
    const double part = between(seed, 0.5, 1);

    rig->displacement = between(seed, 1, 200);
    rig->dur = fmax(1.8751 * rig->displacement / (rig->vel * part),
                    sqrt(5.7736 * rig->displacement / (rig->acc * part)));
    if (rig->dur > 20) {
        rig->displacement *= 20 / rig->dur;
        rig->dur = 20;
    }
    rig->dur = ceil(1000 * rig->dur) / 1000;
    if (perhaps(seed))
        rig->displacement = -rig->displacement;
}

static void random_rig(uint64_t *seed, struct sweep_rig *rig)
{
    static const double tick_ms[] = { 0.5, 1, 2, 5 };

    rig->map = sweep_maps[check_random_in(seed, 0, 4)];
    rig->line = sweep_lines[check_random_in(seed, 0, 2)];
    rig->counts = (int64_t)between(seed, 3000, 1e7);
    if (perhaps(seed))
        rig->counts = -rig->counts;
    rig->tick_ms = tick_ms[check_random_in(seed, 0, 3)];
    rig->bandwidth = between(seed, 15, 60);
    rig->vel = between(seed, 1, 200);
    rig->acc = rig->vel * between(seed, 0.2, 5);
    rig->stop = rig->acc * (perhaps(seed) ? 1 : between(seed, 1, 10));
    rig->floor = between(seed, 0.1, 10);
    rig->time_ms = floor(between(seed, 1, 100));
    rig->two = check_random_in(seed, 0, 3) == 0;
    random_move(seed, rig);
}

static void random_rigs(void **state)
{
    const char *const text = getenv("SWEEPS");
    const unsigned rigs = text == NULL ? 300 : (unsigned)atoi(text);
    struct sweep_count count = { .rigs = 0 };
    uint64_t seed = SWEEP_SEED;

    (void)state;
    while (count.rigs < rigs) {
        struct sweep_rig rig;

        random_rig(&seed, &rig);
        sweep_add(&count, &rig);
    }
    sweep_end(&count);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_grid_of_default_values),
        cmocka_unit_test(random_rigs),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
