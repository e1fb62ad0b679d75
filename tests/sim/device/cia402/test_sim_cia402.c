/* tests/sim/device/cia402/test_sim_cia402.c - the simulated drive, seen from
 * its CAN port. */
#include "tests/sim/device/cia402/digital_inputs.h"
#include "tests/sim/device/cia402/sim_cia402_bench.h"

/* ---- start, NMT, heartbeat --------------------------------------------- */

static void boot_up_is_said_once_after_the_boot_time(void **state)
{
    struct bench *b = bench_of(&drive_config);

    (void)state;
    sim_world_run(&b->world, 5 * MS);
    listen(b);
    assert_int_equal(b->heard_count, 0);
    pass(b, 100 * MS);
    assert_int_equal(b->heard_count, 1);
    expect_last(b, "701#00");
    expect_state(b, "disabled");
    free(b);
}

static void before_boot_up_nothing_is_answered(void **state)
{
    struct bench *b = bench_of(&drive_config);

    (void)state;
    query(b, "601#4000100000000000", "");
    assert_int_equal(hal_can_state(&b->master.can), HAL_CAN_ACTIVE);
    free(b);
}

static void bytes_are_those_of_the_published_vectors(void **state)
{
    static const char *const vectors[][2] = {
        { "601#2F60600008000000", "581#6060600000000000" },
        { "601#237A600010270000", "581#607A600000000000" },
        { "601#2B40600006000000", "581#6040600000000000" },
        { "601#2B40600007000000", "581#6040600000000000" },
        { "601#2B4060000F000000", "581#6040600000000000" },
        { "601#4041600000000000", "581#4B41600037120000" },
        { "601#4022220000000000", "581#8022220000000206" },
        { "601#4041600500000000", "581#8041600511000906" },
        { "601#2300180181010080", "581#6000180100000000" },
        { "601#4000100000000000", "581#4300100092010200" },
        { "601#4061600000000000", "581#4F61600008000000" },
        { "601#4064600000000000", "581#4364600010270000" },
        /* a 10-byte text, in segments */
        { "601#4008100000000000", "581#410810000A000000" },
        { "601#6000000000000000", "581#00736C6577207365" },
        { "601#7000000000000000", "581#1972766F00000000" },
        { "601#4009100000000000", "581#47091000312E3000" },
        /* size not given */
        { "601#2260600008000000", "581#6060600000000000" },
    };
    struct bench *b = booted();

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(vectors); i++)
        query(b, vectors[i][0], vectors[i][1]);
    free(b);
}

static void pdo_and_heartbeat_bytes_are_those_of_the_vectors(void **state)
{
    struct bench *b = enabled();

    (void)state;
    w16(b, 0x1017, 0, 10);
    cycles(b, 30, 0x0F, 10000); /* 201#0F0010270000 */
    expect_last(b, "181#371210270000");
    expect_last(b, "701#05");
    free(b);
}

static void heartbeats_come_on_the_dot_and_say_the_state(void **state)
{
    struct bench *b = booted();
    int64_t first_ns;

    (void)state;
    w16(b, 0x1017, 0, 20);
    forget(b);
    pass(b, 1000 * MS);
    assert_int_equal(count(b, 0x701), 50);
    first_ns = b->heard[0].t_ns;
    for (size_t i = 0; i < b->heard_count; i++)
        assert_int_equal(b->heard[i].t_ns, first_ns + (int64_t)i * 20 * MS);
    expect_last(b, "701#7F");
    say(b, "000#0101");
    pass(b, 25 * MS);
    expect_last(b, "701#05");
    say(b, "000#0200"); /* 0: all nodes */
    pass(b, 25 * MS);
    expect_last(b, "701#04");
    say(b, "000#8002"); /* another node's */
    pass(b, 25 * MS);
    expect_last(b, "701#04");
    say(b, "000#8001");
    pass(b, 25 * MS);
    expect_last(b, "701#7F");
    free(b);
}

static void resets_say_boot_up_again_and_forget(void **state)
{
    struct bench *b = booted();

    (void)state;
    w16(b, 0x1017, 0, 20);
    w32(b, 0x6081, 0, 777);
    forget(b);
    say(b, "000#8201"); /* communication */
    pass(b, 30 * MS);
    assert_int_equal(count(b, 0x701), 1);
    expect_last(b, "701#00");
    assert_int_equal(rd(b, 0x1017, 0), 0);
    assert_int_equal(rd(b, 0x6081, 0), 777);
    forget(b);
    say(b, "000#8101"); /* node */
    pass(b, 30 * MS);
    expect_last(b, "701#00");
    assert_int_equal(rd(b, 0x6081, 0), 0);
    free(b);
}

static void sdo_is_silent_when_stopped(void **state)
{
    struct bench *b = booted();

    (void)state;
    say(b, "000#0201");
    pass(b, MS);
    query(b, "601#4000100000000000", "");
    say(b, "000#8001");
    pass(b, MS);
    query(b, "601#4000100000000000", "581#4300100092010200");
    query(b, "601#40001000", ""); /* SDOs have 8 bytes */
    free(b);
}

static void pdos_only_in_operational(void **state)
{
    struct bench *b = booted();

    (void)state;
    configure(b);
    say(b, "000#8001");
    pass(b, MS);
    forget(b);
    cycles(b, 5, 0x06, 0);
    assert_int_equal(b->heard_count, 0);
    expect_state(b, "disabled");
    say(b, "000#0101");
    pass(b, MS);
    cycles(b, 5, 0x06, 0);
    assert_int_equal(count(b, 0x181), 5);
    expect_state(b, "ready");
    free(b);
}

/* ---- dictionary -------------------------------------------------------- */

static const struct {
    const char *name, *request;
    uint32_t code;
} aborts[] = {
    { "no such object", "601#4022220000000000", 0x06020000 },
    { "no such object, write", "601#2F22220000000000", 0x06020000 },
    { "no such sub", "601#4018100500000000", 0x06090011 },
    { "no such sub, write", "601#2318100500000000", 0x06090011 },
    { "no PDO sub 4", "601#4000140400000000", 0x06090011 },
    { "too short", "601#2F7A600000000000", 0x06070010 },
    { "too long", "601#2B60600008000000", 0x06070010 },
    { "three bytes", "601#277A600000000000", 0x06070010 },
    { "read only", "601#2300100000000000", 0x06010002 },
    { "read only before length", "601#2F00100000000000", 0x06010002 },
    { "write only", "601#4000200000000000", 0x06010001 },
    { "dummies are no objects", "601#4005000000000000", 0x06010000 },
    { "too high", "601#2B5A600009000000", 0x06090031 },
    { "too low", "601#2B5A6000FFFF0000", 0x06090032 },
    { "zero deceleration", "601#2385600000000000", 0x06090032 },
    { "mode we have not", "601#2F60600004000000", 0x06090030 },
    { "mode that nobody has", "601#2F6060000A000000", 0x06090031 },
    { "homing method we have not", "601#2F986000FF000000", 0x06090030 },
    { "homing method 15, reserved", "601#2F9860000F000000", 0x06090030 },
    { "second touch probe", "601#2BB8600000010000", 0x06090030 },
    { "interpolation but linear", "601#2BC06000FFFF0000", 0x06090030 },
    { "negative mode", "601#2F606000FF000000", 0x06090032 },
    { "history is cleared by 0 only", "601#2F03100001000000", 0x06090030 },
    { "empty history", "601#4003100100000000", 0x08000024 },
    { "we produce no SYNC", "601#2305100080000040", 0x06090030 },
    { "NMT id for EMCY", "601#2314100000000000", 0x06090030 },
    { "segmented write of a text", "601#2108100008000000", 0x06010002 },
    { "segmented write of a number", "601#2117100002000000", 0x06070010 },
    { "segmented write, too long", "601#2102200001040000", 0x06070012 },
    { "block write, too long", "601#C602200001040000", 0x06070012 },
    { "block read of a number", "601#A400100020000000", 0x05040001 },
    { "block of no segments", "601#A408100000000000", 0x05040002 },
    { "block of 128 segments", "601#A408100080000000", 0x05040002 },
    { "block start without a transfer", "601#A300000000000000", 0x05040001 },
    { "injection 0", "601#2F00200000000000", 0x06090032 },
    { "RPDO type 241", "601#2F001402F1000000", 0x06090030 },
    { "RPDO type 252", "601#2F001402FC000000", 0x06090030 },
    { "TPDO type 251", "601#2F001802FB000000", 0x06090030 },
    { "SDO id for a PDO", "601#2300140101060080", 0x06090030 },
    { "29 bits for a PDO", "601#23001401000200A0", 0x06090030 },
    { "PDO id changed while valid", "601#2300140102020000", 0x08000022 },
    { "inhibit time while valid", "601#2B00180301000000", 0x08000022 },
    { "mapping count while valid", "601#2F00160000000000", 0x08000022 },
    { "mapping entry while valid", "601#2300160110004060", 0x08000022 },
    { "mapping entry, count not 0", "601#2301160110004060", 0x06010000 },
    { "mapping entry, no object", "601#2302160120002222", 0x06020000 },
    { "mapping entry, no sub", "601#2302160110014060", 0x06090011 },
    { "mapping entry, wrong bits", "601#2302160120004060", 0x06040041 },
    { "status into an RPDO", "601#2302160110004160", 0x06040041 },
    { "target mode into a TPDO", "601#23021A0108006060", 0x06040041 },
    { "never mappable", "601#2302160120000010", 0x06040041 },
    { "empty entries counted", "601#2F02160001000000", 0x06040041 },
    { "nine entries", "601#2F02160009000000", 0x06090031 },
};

static void every_refusal_has_its_abort_code(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(aborts); i++) {
        struct bench *b = booted();
        const struct hal_can_frame *reply;
        struct hal_can_frame request = frame_of(aborts[i].request);
        uint32_t code;

        forget(b);
        say(b, aborts[i].request);
        pass(b, MS);
        reply = last(b, 0x581);
        assert_non_null(reply);
        code = reply->data[4] | (uint32_t)reply->data[5] << 8 |
               (uint32_t)reply->data[6] << 16 | (uint32_t)reply->data[7] << 24;
        if (reply->data[0] != 0x80 || code != aborts[i].code ||
            memcmp(&reply->data[1], &request.data[1], 3) != 0)
            fail_msg("%s: %s", aborts[i].name, text_of(reply));
        free(b);
    }
}

static void mappings_beyond_64_bits_are_refused(void **state)
{
    struct bench *b = booted();

    (void)state;
    assert_int_equal(w32(b, 0x1602, 1, 0x607A0020), 0);
    assert_int_equal(w32(b, 0x1602, 2, 0x60FF0020), 0);
    assert_int_equal(w32(b, 0x1602, 3, 0x60600008), 0);
    assert_int_equal(w8(b, 0x1602, 0, 3), 0x06040042);
    assert_int_equal(w8(b, 0x1602, 0, 2), 0);
    free(b);
}

static void segments_need_their_toggle_and_an_open_transfer(void **state)
{
    struct bench *b = booted();

    (void)state;
    query(b, "601#6000000000000000", "581#8000000001000405");
    query(b, "601#4008100000000000", "581#410810000A000000");
    query(b, "601#7000000000000000", "581#8008100000000305");
    query(b, "601#6000000000000000", "581#8000000001000405");
    query(b, "601#4008100000000000", "581#410810000A000000");
    query(b, "601#8008100000000405", ""); /* the client gives up */
    query(b, "601#6000000000000000", "581#8000000001000405");
    free(b);
}

static void every_object_a_csp_master_needs_can_be_read(void **state)
{
    static const uint16_t objects[] = {
        0x1000, 0x1001, 0x1003, 0x1005, 0x1006, 0x1007, 0x1014, 0x1016, 0x1017,
        0x1018, 0x1019, 0x1029, 0x1400, 0x1401, 0x1402, 0x1403, 0x1600, 0x1601,
        0x1602, 0x1603, 0x1800, 0x1801, 0x1802, 0x1803, 0x1A00, 0x1A01, 0x1A02,
        0x1A03, 0x6007, 0x603F, 0x6040, 0x6041, 0x605A, 0x605B, 0x605C, 0x605D,
        0x605E, 0x6060, 0x6061, 0x6062, 0x6063, 0x6064, 0x6065, 0x6066, 0x6067,
        0x6068, 0x606B, 0x606C, 0x6077, 0x607A, 0x607D, 0x607F, 0x6080, 0x6081,
        0x6083, 0x6084, 0x6085, 0x60B0, 0x60B1, 0x60B2, 0x60C2, 0x60C5, 0x60C6,
        0x60F4, 0x60FD, 0x60FF, 0x6502,
    };
    struct bench *b = booted();

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(objects); i++) {
        (void)rd(b, objects[i], 0);
        if (last(b, 0x581)->data[0] == 0x80)
            fail_msg("%04X: %s", objects[i], text_of(last(b, 0x581)));
    }
    query(b, "601#40C2600200000000", "581#4FC26002FD000000"); /* i8 -3 */
    free(b);
}

/* ---- the state machine ------------------------------------------------- */

struct walk {
    const char *name;
    struct {
        unsigned control;
        const char *state;
    } step[8];
};

static const struct walk walks[] = {
    { "2 3 4 5 6 7",
      { { 0x06, "ready" },
        { 0x07, "on" },
        { 0x0F, "enabled" },
        { 0x07, "on" },
        { 0x06, "ready" },
        { 0x00, "disabled" } } },
    { "7 by quick stop", { { 0x06, "ready" }, { 0x02, "disabled" } } },
    { "8",
      { { 0x06, "ready" },
        { 0x07, "on" },
        { 0x0F, "enabled" },
        { 0x06, "ready" } } },
    { "9",
      { { 0x06, "ready" },
        { 0x07, "on" },
        { 0x0F, "enabled" },
        { 0x00, "disabled" } } },
    { "10", { { 0x06, "ready" }, { 0x07, "on" }, { 0x00, "disabled" } } },
    { "10 by quick stop",
      { { 0x06, "ready" }, { 0x07, "on" }, { 0x02, "disabled" } } },
    { "no steps are left out",
      { { 0x07, "disabled" },
        { 0x0F, "disabled" },
        { 0x06, "ready" },
        { 0x0F, "ready" },
        { 0x07, "on" } } },
    { "fault reset does nothing without a fault",
      { { 0x80, "disabled" }, { 0x06, "ready" }, { 0x86, "ready" } } },
};

static void the_walk_follows_the_numbered_transitions(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(walks); i++) {
        struct bench *b = booted();

        w8(b, 0x6060, 0, 8);
        w32(b, 0x607A, 0, 10000);
        for (size_t j = 0; walks[i].step[j].state; j++) {
            const char *got;

            w16(b, 0x6040, 0, walks[i].step[j].control);
            pass(b, 2 * MS);
            got = state_of(status(b));
            if (strcmp(got, walks[i].step[j].state) != 0)
                fail_msg("%s: step %zu: %s, not %s", walks[i].name, j, got,
                         walks[i].step[j].state);
        }
        free(b);
    }
}

static void without_a_mode_it_does_not_enable(void **state)
{
    struct bench *b = booted();

    (void)state;
    w16(b, 0x6040, 0, 0x06);
    w16(b, 0x6040, 0, 0x07);
    w16(b, 0x6040, 0, 0x0F);
    expect_state(b, "on");
    free(b);
}

static void the_brake_takes_its_time(void **state)
{
    struct sim_cia402_config config = drive_config;
    struct bench *b;

    (void)state;
    config.brake_release_ns = 50 * MS;
    b = booted_of(&config);
    configure(b);
    cycles(b, 3, 0x06, 10000);
    cycles(b, 3, 0x07, 10000);
    cycles(b, 50, 0x0F, 10000);
    assert_string_equal(state_of(tpdo_status(b)), "on");
    cycles(b, 5, 0x0F, 10000);
    assert_string_equal(state_of(tpdo_status(b)), "enabled");
    cycles(b, 5, 0x07, 10000);
    cycles(b, 20, 0x0F, 10000);
    cycles(b, 20, 0x07, 10000); /* thought better of it */
    cycles(b, 40, 0x07, 10000);
    assert_string_equal(state_of(tpdo_status(b)), "on");
    free(b);
}

static void a_fault_goes_through_its_reaction_and_needs_an_edge(void **state)
{
    struct bench *b = enabled();

    (void)state;
    cruise(b, 20);
    forget(b);
    sim_cia402_inject(&b->drive, SIM_CIA402_OVERCURRENT); /* 13 */
    cycle(b, 0x0F, here(b));
    expect_last(b, "081#1023030000000000");
    cycles(b, 1, 0x0F, here(b));
    assert_string_equal(state_of(tpdo_status(b)), "reaction");
    cycles(b, 50, 0x0F, here(b)); /* 14 */
    assert_string_equal(state_of(tpdo_status(b)), "fault");
    assert_int_equal(rd(b, 0x603F, 0), 0x2310);
    assert_int_equal(rd(b, 0x1001, 0), 0x03);
    assert_int_equal(rd(b, 0x1003, 0), 1);
    assert_int_equal(rd(b, 0x1003, 1), 0x2310);

    cycles(b, 3, 0x06, here(b)); /* not obeyed */
    assert_string_equal(state_of(tpdo_status(b)), "fault");
    forget(b);
    cycles(b, 3, 0x80, here(b)); /* 15 */
    assert_string_equal(state_of(tpdo_status(b)), "disabled");
    expect_last(b, "081#0000000000000000");

    sim_cia402_inject(&b->drive, SIM_CIA402_OVERCURRENT);
    cycles(b, 3, 0x80, here(b)); /* no edge: bit 7 was left at 1 */
    assert_string_equal(state_of(tpdo_status(b)), "fault");
    cycles(b, 3, 0x00, here(b));
    cycles(b, 3, 0x80, here(b));
    assert_string_equal(state_of(tpdo_status(b)), "disabled");
    assert_int_equal(rd(b, 0x1003, 0), 2);
    assert_int_equal(w8(b, 0x1003, 0, 0), 0);
    assert_int_equal(rd(b, 0x1003, 0), 0);
    free(b);
}

/* From 100000 counts/s: v^2 / 2a.  The axis lags by a / omega^2 in a
 * ramp, and its power goes off while it is still creeping; option 0 coasts with
 * acc_max / 4; the ramp of option 3 is over before the loop can follow it. */
static const struct {
    int option;
    const char *during, *after;
    int displacement_counts, slack_counts;
} quick_stops[] = {
    { 0, "disabled", "disabled", 200, 15 },
    { 1, "quick stop", "disabled", 1000, 20 }, /* 6084 = 5e6 */
    { 2, "quick stop", "disabled", 500, 40 },  /* 6085 = 10e6 */
    { 3, "quick stop", "disabled", 50, 60 },   /* the current limit, 1e8 */
    { 5, "quick stop", "quick stop", 1000, 1 },
    { 6, "quick stop", "quick stop", 500, 1 },
    { 7, "quick stop", "quick stop", 50, 1 },
};

static void quick_stop_ramps_and_ends_as_605a_says(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(quick_stops); i++) {
        struct bench *b = booted();
        int32_t from, displacement;

        w16(b, 0x605A, 0, (uint32_t)quick_stops[i].option);
        w32(b, 0x6084, 0, 5000000);
        w32(b, 0x6085, 0, 10000000);
        configure(b);
        enable(b);
        cruise(b, 30);
        cycle(b, 0x02, 0);
        say(b, "080#"); /* in force; this TPDO says where */
        pass(b, 200000);
        from = tpdo_position(b);
        if (strcmp(state_of(tpdo_status(b)), quick_stops[i].during) != 0)
            fail_msg("option %d: not during", quick_stops[i].option);
        pass(b, 200 * MS);
        displacement = here(b) - from;
        if (abs(displacement - quick_stops[i].displacement_counts) >
            quick_stops[i].slack_counts)
            fail_msg("option %d: %d counts", quick_stops[i].option,
                     displacement);
        if (strcmp(state_of(status(b)), quick_stops[i].after) != 0)
            fail_msg("option %d: not after", quick_stops[i].option);
        free(b);
    }
}

static void quick_stop_with_option_5_can_be_left_by_16_and_12(void **state)
{
    struct bench *b = booted();

    (void)state;
    w16(b, 0x605A, 0, 6);
    configure(b);
    enable(b);
    cycles(b, 20, 0x02, here(b));
    assert_string_equal(state_of(tpdo_status(b)), "quick stop");
    cycles(b, 3, 0x0F, here(b));
    assert_string_equal(state_of(tpdo_status(b)), "enabled"); /* 16 */
    cycles(b, 3, 0x02, here(b));
    cycles(b, 3, 0x00, here(b));
    assert_string_equal(state_of(tpdo_status(b)), "disabled"); /* 12 */
    free(b);
}

static void quick_stop_with_option_2_cannot_be_taken_back(void **state)
{
    struct bench *b = enabled();

    (void)state;
    w32(b, 0x6085, 0, 1000000); /* 100 ms from 100000 counts/s */
    cruise(b, 30);
    cycles(b, 10, 0x02, 0);
    cycles(b, 10, 0x0F, 0);
    assert_string_equal(state_of(tpdo_status(b)), "quick stop");
    cycles(b, 120, 0x0F, 0);
    assert_string_equal(state_of(tpdo_status(b)), "disabled");
    free(b);
}

static void the_error_history_keeps_the_last_four(void **state)
{
    struct bench *b = booted();

    (void)state;
    for (int i = 0; i < 6; i++)
        sim_cia402_inject(&b->drive, SIM_CIA402_OVERCURRENT);
    assert_int_equal(rd(b, 0x1003, 0), 4);
    assert_int_equal(rd(b, 0x1003, 4), 0x2310);
    free(b);
}

static void disabling_ramps_first_and_can_be_taken_back(void **state)
{
    struct bench *b = enabled();
    int32_t target;

    (void)state;
    w32(b, 0x6084, 0, 1000000); /* 100 ms from 100000 counts/s */
    cruise(b, 30);
    cycles(b, 50, 0x07, 0);
    assert_string_equal(state_of(tpdo_status(b)), "enabled");
    assert_int_equal(tpdo_status(b) & 0x1000, 0); /* does not follow */
    cycles(b, 80, 0x07, 0);
    assert_string_equal(state_of(tpdo_status(b)), "on");

    enable(b);
    target = cruise(b, 30);
    cycles(b, 10, 0x07, target);
    target = here(b) + 600; /* where it can go on */
    cycles(b, 10, 0x0F, target);
    assert_string_equal(state_of(tpdo_status(b)), "enabled");
    assert_int_equal(tpdo_status(b) & 0x1000, 0x1000);
    free(b);
}

static void halt_ramps_stays_enabled_and_goes_on(void **state)
{
    struct bench *b = enabled();
    int32_t at;

    (void)state;
    w32(b, 0x6084, 0, 10000000);
    cruise(b, 30);
    at = here(b);
    cycles(b, 40, 0x10F, 0); /* targets are not looked at */
    assert_string_equal(state_of(tpdo_status(b)), "enabled");
    assert_int_equal(tpdo_status(b) & 0x1400, 0x0400);
    assert_in_range(here(b) - at, 500, 800);
    at = here(b);
    cycles(b, 10, 0x0F, at + 50);
    assert_int_equal(tpdo_status(b) & 0x1400, 0x1000);
    assert_in_range(here(b) - at, 49, 51);
    free(b);
}

static void halt_holds_from_the_moment_of_enabling(void **state)
{
    struct bench *b = booted();

    (void)state;
    configure(b);
    cycles(b, 3, 0x06, 10300);
    cycles(b, 3, 0x07, 10300);
    cycles(b, 20, 0x10F, 10300);
    assert_string_equal(state_of(tpdo_status(b)), "enabled");
    assert_int_equal(tpdo_status(b) & 0x1400, 0x0400);
    assert_int_equal(here(b), 10000);
    free(b);
}

/* ---- following --------------------------------------------------------- */

static void sync_latches_the_position_of_that_instant(void **state)
{
    struct bench *b = enabled();
    int32_t before;

    (void)state;
    w32(b, 0x6085, 0, 1000000); /* quick stop, 100 ms */
    cruise(b, 60);
    cycles(b, 2, 0x02, 0);
    before = tpdo_position(b);
    for (int i = 0; i < 50; i++) {
        int64_t wait_ns = 300000 + i * 7919; /* no multiple of the loop */
        int32_t at;

        say(b, "080#");
        sim_world_run(&b->world, b->world.now_ns + 48000); /* its 48 bits */
        at = (int32_t)((sim_servo_pos_q24(&b->drive.base) + (1 << 23)) >> 24);
        assert_int_equal(b->drive.base.plant_ns, b->world.now_ns);
        sim_world_run(&b->world, b->world.now_ns + wait_ns);
        listen(b);
        assert_int_equal(tpdo_position(b), at);
        assert_true(at > before + 10);
        before = at;
    }
    free(b);
}

/* Target k goes out after SYNC k, is latched at SYNC k+1 and reached at k+2. */
static void a_ramp_is_followed_two_cycles_later_without_lag(void **state)
{
    struct bench *b = enabled();
    int32_t target;

    (void)state;
    target = cruise(b, 60);
    for (int i = 0; i < 50; i++) {
        cycle(b, 0x0F, target += 100);
        /* This cycle's SYNC: targets two cycles back are reached. */
        assert_in_range(tpdo_position(b), target - 201, target - 199);
    }
    assert_int_equal(tpdo_status(b) & 0x3000, 0x1000);
    free(b);
}

/* The demand is a straight line in each cycle, so the plant moves evenly:
 * sampled at every inner step, no step of position differs from the mean by
 * more than the rounding of positions. */
static void between_syncs_the_demand_is_a_straight_line(void **state)
{
    struct bench *b = enabled();
    int32_t target;
    int64_t before_q24;

    (void)state;
    target = cruise(b, 100);
    for (int i = 0; i < 20; i++) {
        char text[32];

        target += 100;
        snprintf(text, sizeof(text), "201#0F00%02X%02X%02X%02X", target & 0xFF,
                 target >> 8 & 0xFF, target >> 16 & 0xFF, 0);
        say(b, "080#");
        sim_world_run(&b->world, b->world.now_ns + 48000);
        say(b, text);
        before_q24 = sim_servo_pos_q24(&b->drive.base);
        for (int j = 1; j < 4; j++) {
            int64_t pos_q24;

            sim_world_run(&b->world, b->world.now_ns + 250000);
            pos_q24 = sim_servo_pos_q24(&b->drive.base);
            assert_in_range(pos_q24 - before_q24, (25 << 24) - (1 << 14),
                            (25 << 24) + (1 << 14));
            before_q24 = pos_q24;
        }
        sim_world_run(&b->world, b->world.now_ns + 202000);
    }
    free(b);
}

static void any_sync_period_is_measured_unless_60c2_says_one(void **state)
{
    static const struct {
        uint32_t ms;
        bool even; /* 2 ms SYNC */
    } rows[] = { { 0, true }, { 2, true }, { 1, false } };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct bench *b = enabled();
        int64_t min_q24 = INT64_MAX, max_q24 = 0;
        int32_t target = here(b);

        assert_int_equal(w8(b, 0x60C2, 1, rows[i].ms), 0);
        for (int j = 0; j < 200; j++) {
            cycle(b, 0x0F, target += 50);
            for (int k = 0; k < 8; k++) {
                int64_t vel_q24;

                sim_world_run(&b->world, b->world.now_ns + 125000);
                vel_q24 = b->drive.base.plant.vel_q24;
                if (j < 100)
                    continue;
                min_q24 = vel_q24 < min_q24 ? vel_q24 : min_q24;
                max_q24 = vel_q24 > max_q24 ? vel_q24 : max_q24;
            }
        }
        if ((max_q24 - min_q24 < max_q24 / 100) != rows[i].even)
            fail_msg("60C2 = %u ms: velocity %" PRId64 " to %" PRId64,
                     rows[i].ms, min_q24 >> 24, max_q24 >> 24);
        free(b);
    }
}

static void a_pause_of_sync_is_not_taken_for_a_period(void **state)
{
    struct bench *b = enabled();
    int32_t from;

    (void)state;
    w16(b, 0x6007, 0, 0);
    pass(b, 1000 * MS);
    from = here(b);
    say(b, "201#0F0074270000"); /* 10100 */
    say(b, "080#");
    pass(b, 30 * MS);
    assert_in_range(here(b) - from, 99, 100);
    free(b);
}

static void a_jump_beyond_the_window_is_a_following_error(void **state)
{
    struct bench *b = enabled();

    (void)state;
    assert_int_equal(w32(b, 0x6065, 0, 500), 0);
    cycles(b, 5, 0x0F, here(b));
    forget(b);
    cycles(b, 3, 0x0F, here(b) + 20000);
    expect_last(b, "081#1186210000000000");
    cycles(b, 60, 0x0F, here(b));
    assert_string_equal(state_of(tpdo_status(b)), "fault");
    assert_int_equal(tpdo_status(b) & 0x2000, 0x2000);
    assert_int_equal(rd(b, 0x603F, 0), 0x8611);
    free(b);
}

static void the_following_error_waits_for_6066(void **state)
{
    struct bench *b = enabled();

    (void)state;
    w32(b, 0x6065, 0, 500);
    w16(b, 0x6066, 0, 30);
    sim_cia402_inject(&b->drive, SIM_CIA402_BLOCKED);
    cycles(b, 20, 0x0F, here(b) + 1000);
    assert_string_equal(state_of(tpdo_status(b)), "enabled");
    assert_int_equal(tpdo_status(b) & 0x2000, 0x2000);
    cycles(b, 20, 0x0F, here(b) + 1000);
    assert_string_equal(state_of(tpdo_status(b)), "fault");
    free(b);
}

static void without_preload_the_axis_jumps_and_faults(void **state)
{
    struct bench *b = booted();

    (void)state;
    configure(b);
    w32(b, 0x6065, 0, 1000);
    cycles(b, 3, 0x06, 0); /* it stands at 10000 */
    cycles(b, 3, 0x07, 0);
    cycles(b, 60, 0x0F, 0);
    assert_string_equal(state_of(tpdo_status(b)), "fault");
    free(b);
}

static void the_soft_limits_hold_the_axis_and_show_in_bit_11(void **state)
{
    struct bench *b = enabled();

    (void)state;
    w32(b, 0x607D, 1, 9000);
    w32(b, 0x607D, 2, 10100);
    cycles(b, 40, 0x0F, 10300);
    assert_in_range(here(b), 10099, 10100);
    assert_int_equal(tpdo_status(b) & 0x0800, 0x0800);
    cycles(b, 40, 0x0F, 10050);
    assert_int_equal(tpdo_status(b) & 0x0800, 0);
    free(b);
}

static void the_profile_velocity_limit_slows_the_demand(void **state)
{
    struct bench *b = enabled();
    int32_t from = here(b);

    (void)state;
    w32(b, 0x607F, 0, 50000); /* 50 counts per cycle */
    cycles(b, 91, 0x0F, from + 5000);
    assert_int_equal(tpdo_status(b) & 0x0800, 0x0800);
    assert_in_range(here(b) - from, 4400, 4500);
    cycles(b, 40, 0x0F, from + 5000);
    assert_int_equal(tpdo_status(b) & 0x0800, 0);
    assert_in_range(here(b) - from, 4999, 5000);
    free(b);
}

static void positions_wrap_at_32_bits(void **state)
{
    struct sim_cia402_config config = drive_config;
    struct bench *b;
    uint32_t target = INT32_MAX - 2000;

    (void)state;
    config.start_counts = INT32_MAX - 2000;
    b = enabled_of(&config);
    for (int i = 0; i < 40; i++)
        cycle(b, 0x0F, (int32_t)(target += 100));
    cycles(b, 40, 0x0F, (int32_t)target);
    assert_int_equal(tpdo_position(b), (int32_t)target);
    assert_true(tpdo_position(b) < 0);
    assert_string_equal(state_of(tpdo_status(b)), "enabled");
    free(b);
}

/* ---- watching the master ----------------------------------------------- */

static const struct {
    int option;
    const char *soon, *later;
} losses[] = {
    { 0, "enabled", "enabled" },
    { 1, "reaction", "fault" },
    { 2, "disabled", "disabled" },
    { 3, "quick stop", "disabled" },
};

static void a_silent_master_is_reacted_to_as_6007_says(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(losses); i++) {
        struct bench *b = enabled();

        w16(b, 0x6007, 0, (uint32_t)losses[i].option);
        w32(b, 0x1016, 1, 0x7F0032); /* node 127, 50 ms */
        w8(b, 0x2001, 0, 0);         /* targets are not watched */
        w32(b, 0x6085, 0, 1000000);  /* 100 ms */
        for (int j = 0; j < 20; j++) {
            say(b, "77F#05");
            cruise(b, 10);
        }
        pass(b, 40 * MS); /* 39 and the frame's time: not yet */
        assert_int_equal(count(b, 0x081), 0);
        /* cruise left it standing at the end of its line: give it speed */
        say(b, "77F#05");
        cruise(b, 48);
        pass(b, 4 * MS);
        expect_last(b, "081#3081110000000000");
        assert_int_equal(count(b, 0x081), 1);
        if (losses[i].option == 0 || losses[i].option == 2)
            expect_state(b, losses[i].soon);
        pass(b, 300 * MS);
        if (strcmp(state_of(status(b)), losses[i].later) != 0)
            fail_msg("6007 = %d: %s", losses[i].option, state_of(status(b)));
        free(b);
    }
}

static void heartbeat_loss_moves_nmt_as_1029_says_and_recovers(void **state)
{
    static const char *const heartbeat[] = { "701#7F", "701#05", "701#04" };

    (void)state;
    for (uint32_t option = 0; option < 3; option++) {
        struct bench *b = booted();

        w8(b, 0x1029, 1, option);
        w16(b, 0x1017, 0, 10);
        w32(b, 0x1016, 1, 0x7F0032);
        say(b, "000#0101");
        pass(b, 200 * MS);  /* nothing heard yet: not watched */
        say(b, "77F#0505"); /* no heartbeat */
        pass(b, 100 * MS);
        assert_int_equal(count(b, 0x081), 0);
        say(b, "77F#05");
        pass(b, 100 * MS);
        expect_last(b, heartbeat[option]);
        expect_last(b, "081#3081110000000000");
        say(b, "000#0101");
        say(b, "77F#05");
        pass(b, 20 * MS);
        expect_last(b, "081#0000000000000000");
        assert_int_equal(rd(b, 0x1001, 0), 0);
        free(b);
    }
}

static void targets_that_stay_away_are_reacted_to(void **state)
{
    static const struct {
        uint8_t missed;
        uint16_t event_ms;
        int64_t after_ms;
    } rows[] = { { 20, 0, 20 }, { 5, 0, 5 }, { 20, 35, 35 } };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        for (int with_sync = 0; with_sync < 2; with_sync++) {
            struct bench *b = enabled();
            int64_t at_ns, last_ns;

            w16(b, 0x6007, 0, 3);
            w8(b, 0x2001, 0, rows[i].missed);
            w16(b, 0x1400, 5, rows[i].event_ms);
            cruise(b, 30);
            forget(b);
            say(b, "080#"); /* the last RPDO is latched here */
            last_ns = b->world.now_ns;
            for (int j = 0; j < 60; j++) {
                pass(b, MS);
                if (with_sync)
                    say(b, "080#");
            }
            expect_last(b, "081#5082110000000000");
            at_ns = last(b, 0x081)->t_ns - last_ns;
            assert_in_range(at_ns, rows[i].after_ms * MS,
                            (rows[i].after_ms + 1) * MS);
            pass(b, 100 * MS);
            expect_state(b, "disabled");
            free(b);
        }
}

static void with_6007_zero_the_last_target_is_held(void **state)
{
    struct bench *b = enabled();
    int32_t target;

    (void)state;
    w16(b, 0x6007, 0, 0);
    target = cruise(b, 30);
    forget(b);
    for (int i = 0; i < 50; i++) {
        say(b, "080#");
        pass(b, MS);
    }
    expect_last(b, "081#5082110000000000");
    assert_int_equal(tpdo_position(b), target);
    assert_string_equal(state_of(tpdo_status(b)), "enabled");
    assert_int_equal(tpdo_status(b) & 0x80, 0x80); /* warning */
    cycles(b, 3, 0x0F, target);
    expect_last(b, "081#0000000000000000");
    assert_int_equal(tpdo_status(b) & 0x80, 0);
    free(b);
}

static void nmt_stop_is_a_lost_connection(void **state)
{
    struct bench *b = enabled();

    (void)state;
    w16(b, 0x6007, 0, 3);
    w8(b, 0x2001, 0, 0); /* targets are not watched */
    cycles(b, 2, 0x0F, 10000);
    say(b, "000#0201");
    pass(b, 50 * MS);
    say(b, "000#8001");
    pass(b, MS);
    expect_state(b, "disabled");
    free(b);
}

/* ---- PDOs -------------------------------------------------------------- */

static void a_short_rpdo_is_not_used_and_a_long_one_is(void **state)
{
    struct bench *b = booted();

    (void)state;
    configure(b);
    forget(b);
    for (int i = 0; i < 3; i++) {
        say(b, "201#0600");
        say(b, "080#");
        pass(b, MS);
    }
    assert_int_equal(count(b, 0x081), 1); /* said once */
    expect_last(b, "081#1082110000000000");
    assert_string_equal(state_of(tpdo_status(b)), "disabled");
    cycles(b, 2, 0x00, 10000);
    expect_last(b, "081#0000000000000000");
    say(b, "201#0600102700000000");
    pass(b, MS);
    expect_last(b, "081#2082110000000000");
    say(b, "080#");
    pass(b, MS);
    expect_state(b, "ready");
    free(b);
}

static void an_rpdo_of_type_255_acts_at_once(void **state)
{
    struct bench *b = booted();

    (void)state;
    configure(b);
    assert_int_equal(w8(b, 0x1400, 2, 255), 0);
    say(b, "201#060010270000");
    pass(b, MS);
    expect_state(b, "ready");
    assert_int_equal(w8(b, 0x1400, 2, 0), 0);
    say(b, "201#070010270000");
    pass(b, MS);
    expect_state(b, "ready"); /* not before SYNC */
    say(b, "080#");
    pass(b, MS);
    expect_state(b, "on");
    free(b);
}

static void tpdo_types_say_at_which_syncs(void **state)
{
    struct bench *b = booted();

    (void)state;
    configure(b);
    assert_int_equal(w8(b, 0x1800, 2, 3), 0);
    forget(b);
    cycles(b, 12, 0, 10000);
    assert_int_equal(count(b, 0x181), 4);
    assert_int_equal(w8(b, 0x1800, 2, 0), 0); /* on change */
    cycles(b, 2, 0, 10000);
    forget(b);
    cycles(b, 5, 0, 10000);
    assert_int_equal(count(b, 0x181), 0);
    cycles(b, 5, 6, 10000);
    assert_int_equal(count(b, 0x181), 1);
    assert_string_equal(state_of(tpdo_status(b)), "ready");
    free(b);
}

static void event_driven_tpdos_keep_inhibit_time_and_event_timer(void **state)
{
    struct bench *b = booted();

    (void)state;
    assert_int_equal(w32(b, 0x1800, 1, 0x80000181), 0);
    assert_int_equal(w8(b, 0x1800, 2, 255), 0);
    assert_int_equal(w16(b, 0x1800, 3, 100), 0); /* 10 ms */
    assert_int_equal(w16(b, 0x1800, 5, 50), 0);
    assert_int_equal(w32(b, 0x1800, 1, 0x181), 0);
    forget(b);
    say(b, "000#0101");
    pass(b, 20 * MS);
    assert_int_equal(count(b, 0x181), 1); /* once on entering */
    forget(b);
    pass(b, 500 * MS);
    assert_in_range(count(b, 0x181), 9, 10); /* event timer */
    w16(b, 0x6040, 0, 6);
    pass(b, 15 * MS);
    assert_string_equal(state_of(tpdo_status(b)), "ready");
    forget(b);
    for (int i = 0; i < 20; i++) { /* a change every ms */
        say(b, "601#2B40600007000000");
        pass(b, MS);
        say(b, "601#2B40600006000000");
        pass(b, MS);
    }
    assert_in_range(count(b, 0x181), 3, 4);
    free(b);
}

static void a_remote_frame_asks_for_a_tpdo(void **state)
{
    struct bench *b = booted();

    (void)state;
    configure(b);
    w32(b, 0x1800, 1, 0x80000181);
    w8(b, 0x1800, 2, 253);
    w32(b, 0x1800, 1, 0x181);
    forget(b);
    cycles(b, 3, 0, 10000);
    assert_int_equal(count(b, 0x181), 0);
    query(b, "181#R", "181#500210270000");
    w32(b, 0x1800, 1, 0x80000181);
    w32(b, 0x1800, 1, 0x40000181); /* no remote frames */
    query(b, "181#R", "");
    free(b);
}

static void dummies_pad_a_mapping(void **state)
{
    struct bench *b = booted();

    (void)state;
    assert_int_equal(w32(b, 0x1402, 1, 0x80000401), 0);
    assert_int_equal(w32(b, 0x1602, 1, 0x60600008), 0);
    assert_int_equal(w32(b, 0x1602, 2, 0x00050008), 0);
    assert_int_equal(w32(b, 0x1602, 3, 0x60400010), 0);
    assert_int_equal(w8(b, 0x1602, 0, 3), 0);
    assert_int_equal(w8(b, 0x1402, 2, 255), 0);
    assert_int_equal(w32(b, 0x1402, 1, 0x401), 0);
    say(b, "000#0101");
    say(b, "401#08AA0600");
    pass(b, MS);
    expect_state(b, "ready");
    assert_int_equal(rd(b, 0x6061, 0), 8);
    free(b);
}

/* ---- injections -------------------------------------------------------- */

static void a_reboot_forgets_all_and_keeps_the_place(void **state)
{
    struct bench *b = enabled();
    int32_t at;

    (void)state;
    cruise(b, 30);
    forget(b);
    sim_cia402_inject(&b->drive, SIM_CIA402_REBOOT);
    pass(b, 20 * MS);
    expect_last(b, "701#00");
    expect_state(b, "disabled");
    assert_int_equal(rd(b, 0x6060, 0), 0);
    assert_int_equal(rd(b, 0x1600, 0), 1);
    at = here(b);
    pass(b, 100 * MS);
    assert_int_equal(here(b), at);
    assert_true(at > 12000);
    free(b);
}

static void silence_is_mutual_and_the_drive_stops_by_itself(void **state)
{
    struct bench *b = enabled();

    (void)state;
    w16(b, 0x6007, 0, 3);
    w32(b, 0x1016, 1, 0x7F0032);
    say(b, "77F#05");
    cruise(b, 10);
    sim_cia402_inject(&b->drive, SIM_CIA402_SILENT);
    forget(b);
    cycles(b, 5, 0x0F, here(b));
    assert_int_equal(b->heard_count, 0);
    pass(b, 200 * MS);
    assert_int_equal(hal_can_state(&b->master.can), HAL_CAN_PASSIVE);
    assert_int_equal(b->drive.base.plant.vel_q24, 0);
    sim_cia402_inject(&b->drive, SIM_CIA402_CLEAR);
    pass(b, 10 * MS);
    expect_state(b, "disabled");
    free(b);
}

static void a_frozen_encoder_moves_unseen(void **state)
{
    struct bench *b = enabled();
    int32_t at = here(b);

    (void)state;
    sim_cia402_inject(&b->drive, SIM_CIA402_FROZEN);
    cycles(b, 40, 0x0F, at + 300);
    assert_int_equal(tpdo_position(b), at);
    assert_in_range(here(b), at + 299, at + 300);
    sim_cia402_inject(&b->drive, SIM_CIA402_CLEAR);
    cycles(b, 2, 0x0F, at + 300);
    assert_int_equal(tpdo_position(b), at + 300);
    free(b);
}

static void without_power_it_says_so_and_does_not_enable(void **state)
{
    struct bench *b = enabled();

    (void)state;
    sim_cia402_inject(&b->drive, SIM_CIA402_NO_POWER);
    cycles(b, 3, 0x0F, here(b));
    assert_string_equal(state_of(tpdo_status(b)), "disabled");
    assert_int_equal(tpdo_status(b) & 0x10, 0);
    assert_int_equal(rd(b, 0x60FD, 0), 8);
    cycles(b, 3, 0x06, here(b));
    assert_string_equal(state_of(tpdo_status(b)), "disabled");
    w8(b, 0x2000, 0, 1 + SIM_CIA402_CLEAR); /* over the wire */
    enable(b);
    free(b);
}

static void inputs_show_in_60fd(void **state)
{
    struct bench *b = booted();

    (void)state;
    digital_inputs_set(&b->drive, 0x00010003);
    assert_int_equal(rd(b, 0x60FD, 0), 0x00010003);
    free(b);
}

static void bad_configs_are_refused_and_add_nothing(void **state)
{
    struct sim_cia402_config bad[6];

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(bad); i++)
        bad[i] = drive_config;
    bad[0].node_id = 0;
    bad[1].node_id = 128;
    bad[2].loop_ns = 62499;
    bad[3].loop_ns = 1000001;
    bad[4].boot_ns = -1;
    bad[5].plant.omega_mrad_s = 0;
    for (size_t i = 0; i < ARRAY_LEN(bad); i++) {
        static struct sim_cia402 drive;
        struct sim_world world;
        struct sim_can_bus bus;

        sim_world_init(&world, 0);
        sim_can_bus_init(&bus, &world, 1000000);
        assert_int_equal(sim_cia402_init(&drive, &bus, &bad[i]), MOTION_E_ARG);
        assert_ptr_equal(bus.group.last, &bus.member);
        assert_null(bus.first);
    }
}

/* Ids the drive listens to, objects it has, nonsense in between. */
static struct hal_can_frame random_frame(uint64_t *seed)
{
    static const uint32_t id[] = { 0x000, 0x080, 0x201, 0x301, 0x601, 0x77F };
    static const uint8_t command[] = { 0x2F, 0x2B, 0x23, 0x22, 0x40, 0x60 };
    static const uint16_t index[] = { 0x1016, 0x1017, 0x1400, 0x1401, 0x1600,
                                      0x1601, 0x1800, 0x1A00, 0x2000, 0x6007,
                                      0x6040, 0x605A, 0x6060, 0x6065, 0x607A,
                                      0x607D, 0x6085, 0x60B0, 0x60C2 };
    struct hal_can_frame frame = { .len = 8 };
    uint16_t object;

    *seed = *seed * UINT64_C(6364136223846793005) + 1442695040888963407u;
    object = index[(*seed >> 40) % ARRAY_LEN(index)];
    frame.id = id[(*seed >> 33) % ARRAY_LEN(id)];
    memcpy(frame.data, seed, 8);
    if (frame.id == 0x601) {
        frame.data[0] = command[(*seed >> 48) % ARRAY_LEN(command)];
        frame.data[1] = (uint8_t)object;
        frame.data[2] = (uint8_t)(object >> 8);
        frame.data[3] = (uint8_t)((*seed >> 20) % 4);
    } else if (frame.id == 0 || *seed >> 60 == 0) {
        frame.len = (uint8_t)((*seed >> 57) % 8 < 7 ? 2 : 1);
        frame.data[0] = (uint8_t)((*seed >> 30) % 16 ? 1 : *seed >> 35);
        frame.data[1] = 0;
    } else if (frame.id == 0x201 && (*seed >> 50) % 8) {
        frame.data[0] = (uint8_t)(0x0F >> (*seed >> 47) % 3);
        frame.data[1] = 0;
    }
    return frame;
}

/* Sanitizers watch; afterwards a reset makes it a usable drive again. */
static void no_sequence_of_frames_breaks_it(void **state)
{
    const uint64_t first = 77;
    uint64_t seed = first;
    struct bench *b = enabled();

    (void)state;
    for (int i = 0; i < 20000; i++) {
        struct hal_can_frame frame = random_frame(&seed);

        (void)hal_can_send(&b->master.can, &frame);
        if (i % 3 == 0) {
            pass(b, MS / 2);
            forget(b);
        }
    }
    sim_cia402_inject(&b->drive, SIM_CIA402_CLEAR);
    pass(b, 50 * MS);
    say(b, "000#8100");
    pass(b, 50 * MS);
    forget(b);
    configure(b);
    cycles(b, 2, 0x00, here(b));
    for (int i = 0; i < 10000 && b->drive.base.plant.vel_q24 != 0; i++)
        cycles(b, 1, 0x00, 0);
    if (b->drive.base.plant.vel_q24 != 0)
        fail_msg("seed %" PRIu64 ": still moving", first);
    enable(b);
    free(b);
}

/* FNV-1a over every frame heard and the position after each cycle. */
static uint64_t fingerprint(void)
{
    struct bench *b = enabled();
    uint64_t hash = UINT64_C(14695981039346656037);
    int32_t target = here(b);

    w16(b, 0x1017, 0, 7);
    for (int i = 0; i < 600; i++) {
        cycle(b, 0x0F, target += i % 90);
        if (i == 400)
            sim_cia402_inject(&b->drive, SIM_CIA402_OVERCURRENT);
        hash = (hash ^ (uint64_t)sim_servo_pos_q24(&b->drive.base)) *
               UINT64_C(1099511628211);
        for (size_t j = 0; j < b->heard_count; j++)
            for (unsigned k = 0; k < 8; k++)
                hash = (hash ^ b->heard[j].data[k] ^
                        (uint64_t)b->heard[j].t_ns << 8) *
                       UINT64_C(1099511628211);
        forget(b);
    }
    free(b);
    return hash;
}

static void two_runs_are_the_same_to_the_bit(void **state)
{
    (void)state;
    assert_int_equal(fingerprint(), fingerprint());
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(boot_up_is_said_once_after_the_boot_time),
        cmocka_unit_test(before_boot_up_nothing_is_answered),
        cmocka_unit_test(bytes_are_those_of_the_published_vectors),
        cmocka_unit_test(pdo_and_heartbeat_bytes_are_those_of_the_vectors),
        cmocka_unit_test(heartbeats_come_on_the_dot_and_say_the_state),
        cmocka_unit_test(resets_say_boot_up_again_and_forget),
        cmocka_unit_test(sdo_is_silent_when_stopped),
        cmocka_unit_test(pdos_only_in_operational),
        cmocka_unit_test(every_refusal_has_its_abort_code),
        cmocka_unit_test(mappings_beyond_64_bits_are_refused),
        cmocka_unit_test(segments_need_their_toggle_and_an_open_transfer),
        cmocka_unit_test(every_object_a_csp_master_needs_can_be_read),
        cmocka_unit_test(the_walk_follows_the_numbered_transitions),
        cmocka_unit_test(without_a_mode_it_does_not_enable),
        cmocka_unit_test(the_brake_takes_its_time),
        cmocka_unit_test(a_fault_goes_through_its_reaction_and_needs_an_edge),
        cmocka_unit_test(quick_stop_ramps_and_ends_as_605a_says),
        cmocka_unit_test(quick_stop_with_option_5_can_be_left_by_16_and_12),
        cmocka_unit_test(quick_stop_with_option_2_cannot_be_taken_back),
        cmocka_unit_test(the_error_history_keeps_the_last_four),
        cmocka_unit_test(disabling_ramps_first_and_can_be_taken_back),
        cmocka_unit_test(halt_ramps_stays_enabled_and_goes_on),
        cmocka_unit_test(halt_holds_from_the_moment_of_enabling),
        cmocka_unit_test(sync_latches_the_position_of_that_instant),
        cmocka_unit_test(a_ramp_is_followed_two_cycles_later_without_lag),
        cmocka_unit_test(between_syncs_the_demand_is_a_straight_line),
        cmocka_unit_test(any_sync_period_is_measured_unless_60c2_says_one),
        cmocka_unit_test(a_pause_of_sync_is_not_taken_for_a_period),
        cmocka_unit_test(a_jump_beyond_the_window_is_a_following_error),
        cmocka_unit_test(the_following_error_waits_for_6066),
        cmocka_unit_test(without_preload_the_axis_jumps_and_faults),
        cmocka_unit_test(the_soft_limits_hold_the_axis_and_show_in_bit_11),
        cmocka_unit_test(the_profile_velocity_limit_slows_the_demand),
        cmocka_unit_test(positions_wrap_at_32_bits),
        cmocka_unit_test(a_silent_master_is_reacted_to_as_6007_says),
        cmocka_unit_test(heartbeat_loss_moves_nmt_as_1029_says_and_recovers),
        cmocka_unit_test(targets_that_stay_away_are_reacted_to),
        cmocka_unit_test(with_6007_zero_the_last_target_is_held),
        cmocka_unit_test(nmt_stop_is_a_lost_connection),
        cmocka_unit_test(a_short_rpdo_is_not_used_and_a_long_one_is),
        cmocka_unit_test(an_rpdo_of_type_255_acts_at_once),
        cmocka_unit_test(tpdo_types_say_at_which_syncs),
        cmocka_unit_test(event_driven_tpdos_keep_inhibit_time_and_event_timer),
        cmocka_unit_test(a_remote_frame_asks_for_a_tpdo),
        cmocka_unit_test(dummies_pad_a_mapping),
        cmocka_unit_test(a_reboot_forgets_all_and_keeps_the_place),
        cmocka_unit_test(silence_is_mutual_and_the_drive_stops_by_itself),
        cmocka_unit_test(a_frozen_encoder_moves_unseen),
        cmocka_unit_test(without_power_it_says_so_and_does_not_enable),
        cmocka_unit_test(inputs_show_in_60fd),
        cmocka_unit_test(bad_configs_are_refused_and_add_nothing),
        cmocka_unit_test(no_sequence_of_frames_breaks_it),
        cmocka_unit_test(two_runs_are_the_same_to_the_bit),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
