/* tests/hal/drive/modbus/test_line_troubles.c - moves on lines that have stray bytes,
 * echoes, noise and late answers, each with a share of up to 10 % of the frames, in
 * RTU and ASCII: done, or stopped with the sentence that is true, and the torque is
 * off at the end.  N=60 runs of each framing, SEED=.  On TCP: lost_lines. */
#include <math.h>

#include "tests/hal/drive/modbus/strict_bench.h"

#define RUNS       60
#define SHARE_MAX  0.1
#define TROUBLES   3
#define WAY_NS     (5000 * MS)
#define OFF_NS     (60000 * MS) /* a round takes a second, and each may fail */
#define NEAR_UNITS 0.02

static struct strict_bench bench;
static struct sim_modbus_faulty trouble[TROUBLES];
static double echo_share;
static int64_t longest_off_ns;

static const char *const sentences[] = {
    "no answer in time",
    "its answers are broken",
};

static uint64_t share_q32(long double most)
{
    return 1 + (uint64_t)(draw_unit() * most * 4294967295.0L);
}

/* A line with each of them behind the other, outermost what is late. */
static void begin(enum strict_modbus_kind kind, bool is_ascii)
{
    struct modbus_station *behind;

    strict_bench_load(&bench, kind);
    bench.map.line.is_ascii = is_ascii;
    strict_bench_begin(&bench, kind);
    bench.wire.adapter = &bench.seat;
    behind = &bench.faulty.station;
    for (unsigned i = 0; i < TROUBLES; i++) {
        sim_modbus_faulty_init(&trouble[i], behind, 1 + draw());
        behind = &trouble[i].station;
    }
    bench.device_seat.station = behind;
}

/* Wrong bits: a check sum of ASCII does not see all of them, so its noise is a
 * frame that is none. */
static void spoil(long double noise, long double late)
{
    const int64_t timeout_ns = bench.master.config.timeout_ns;

    trouble[0].from.fault = SIM_MODBUS_STRAYS;
    trouble[0].from.share_q32 = share_q32(SHARE_MAX);
    trouble[1].from.fault =
        bench.map.line.is_ascii ? SIM_MODBUS_NOISE : SIM_MODBUS_FLIP;
    trouble[1].from.share_q32 = share_q32(noise);
    trouble[2].from.fault = SIM_MODBUS_LATE;
    trouble[2].from.share_q32 = share_q32(late);
    trouble[2].from.late_ns = timeout_ns * (1 + (int64_t)draw_below(18)) /
                              10; /* within the silence */
    echo_share = (double)draw_unit() * SHARE_MAX;
}

static void pass(int64_t dur_ns)
{
    const int64_t end_ns = bench.world.now_ns + dur_ns;

    while (bench.world.now_ns < end_ns) {
        bench.wire.echo = (double)draw_unit() < echo_share;
        strict_bench_tick(&bench);
    }
}

/* Accept a sentence about the way out, a write or any request, with its reason. */
static bool is_true(const char *text)
{
    static const char *const ways[] = { "lost, then switched off: ",
                                        "lost; trying to switch it off: ",
                                        "not written: " };
    const char *rest = text;

    for (unsigned i = 0; i < ARRAY_LEN(ways); i++)
        if (strncmp(rest, ways[i], strlen(ways[i])) == 0)
            rest += strlen(ways[i]);
    for (unsigned k = 0; k < ARRAY_LEN(sentences); k++)
        if (rest > text && strcmp(rest, sentences[k]) == 0)
            return true;
    return false;
}

static void complain(unsigned run, bool is_ascii, const char *what)
{
    fail_msg("run %u, %s, %s: %s; torque %d, %u cuts, %s: %s", run,
             is_ascii ? "ASCII" : "RTU", bench.map.title, what,
             bench.servo.torque, bench.servo.cuts,
             hal_drive_state_text(bench.feedback.state),
             bench.feedback.fault_text);
}

/* True: done. */
static bool play(unsigned run, bool is_ascii, long double noise,
                 long double late)
{
    const enum strict_modbus_kind kind =
        (enum strict_modbus_kind)draw_below(ARRAY_LEN(strict_map));
    const bool streamed = draw_below(2) == 0;

    begin(kind, is_ascii);
    strict_bench_go(&bench, streamed);
    spoil(noise, late);
    pass(WAY_NS);
    const bool done = bench.feedback.state == HAL_DRIVE_ENABLED;
    if (done && streamed &&
        fabs((double)(bench.feedback.pos_q32 - bench.target.pos_q32) /
             (double)UNIT_Q32) > NEAR_UNITS)
        complain(run, is_ascii, "not there");
    bench.streams = false;
    hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_OFF);
    const int64_t off_ns = bench.world.now_ns;
    while ((bench.servo.torque || bench.servo.enabling) &&
           bench.world.now_ns - off_ns < OFF_NS)
        pass(MS);
    if (bench.world.now_ns - off_ns > longest_off_ns)
        longest_off_ns = bench.world.now_ns - off_ns;
    pass(6000 * MS);
    if (bench.servo.torque || bench.servo.cuts > 0)
        complain(run, is_ascii, "torque");
    if (bench.feedback.state != HAL_DRIVE_OFF &&
        !is_true(bench.feedback.fault_text))
        complain(run, is_ascii, "the sentence");
    return done;
}

static unsigned runs(void)
{
    const char *given = getenv("N");

    return given != NULL ? (unsigned)strtoul(given, NULL, 0) : RUNS;
}

/* All of them at once. */
static void a_bad_line_is_done_or_says_why(void **state)
{
    unsigned done[2] = { 0, 0 };

    (void)state;
    seed_from("a_bad_line_is_done_or_says_why");
    for (unsigned i = 0; i < 2 * runs(); i++)
        done[i % 2] += play(i, i % 2 == 1, SHARE_MAX, SHARE_MAX);
    print_message("%u runs each: RTU %u done, ASCII %u done; torque off after "
                  "%.1f s at most\n",
                  runs(), done[0], done[1], (double)longest_off_ns / 1e9);
    for (unsigned k = 0; k < 2; k++)
        assert_true(done[k] > 0 && done[k] < runs());
}

/* They are no reason to stop. */
static void strays_and_echoes_alone_stop_nothing(void **state)
{
    (void)state;
    seed_from("strays_and_echoes_alone_stop_nothing");
    for (unsigned i = 0; i < 2 * runs(); i++)
        if (!play(i, i % 2 == 1, 0, 0))
            complain(i, i % 2 == 1, "stopped");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_bad_line_is_done_or_says_why),
        cmocka_unit_test(strays_and_echoes_alone_stop_nothing),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
