/* tests/firmware/linux/service/test_stop.c - a stop from anyone, in any company: in
 * force within two ticks of being sent, whoever else sends whatever, and nothing
 * that was asked for before it moves anything after it.  Others are served in
 * their turn.
 *
 * In virtual time: sockets, lines, queues and the tick are the service's own, its
 * two threads take turns here, a look of the reader and two turns of the server per
 * millisecond.  Times are of nominal ticks, from the bytes in the socket's buffer
 * to the tick that obeys, or to the bytes of the answer.
 *
 *   TRIES=100000 build/tests/firmware/linux/service/test_stop */
#include <inttypes.h>
#include <math.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include "tests/support/check.h"
#include "tests/support/service_bench.h"

#define FLOOD_PER_MS 2 /* jogs of the holder: 2000 a second */
#define MOST_TICKS   2
#define MOST_MS      100
#define REST_TICKS   2000
#define LET_GO_MS    40 /* twice what a jog of the flood lasts */
#define BINS         64

#define CAMERA "gpio: {camera: {kind: trigger, line: GPIO5, width: 50 ms}}\n"
#define DOLLY                                                                  \
    "axes:\n"                                                                  \
    "  dolly:\n    unit: mm\n    limits: {position: [-9000 mm, 9000 mm],"      \
    " velocity: 300 mm/s, acceleration: 9000 mm/s2, jerk: 2000000 mm/s3}\n"    \
    "    following_error: {floor: 90 mm, time: 20 ms}\n"
static const char *const rig_text[] = {
    "tick: 1 ms\n" CAMERA DOLLY "    drive: {kind: virtual}\n",
    "tick: 10 ms\n" CAMERA DOLLY "    drive: {kind: virtual}\n",
};
static const char servo_rig[] =
    "tick: 5 ms\nbuses: {can: {kind: canopen, bit_rate: 1 Mbit/s}}\n" DOLLY
    "    homing: {by: here}\n"
    "    drive: {kind: cia402, bus: can, node: 1, counts: 4096 per mm}\n";

static const char jog[] =
    "{\"command\":\"jog\",\"axis\":\"dolly\",\"speed\":20,\"to\":9000,"
    "\"for\":2}\n";
static const char jog_stop[] = "{\"command\":\"jog stop\"}\n";
static const char jog_flood[] =
    "{\"command\":\"jog\",\"axis\":\"dolly\",\"speed\":20,\"to\":9000,"
    "\"for\":0.02}\n";

struct client {
    int file;
    bool is_deaf; /* it never reads */
    char said[65536];
    size_t length;
    double waits_for; /* an id; 0: nothing */
    unsigned since;   /* the tick when it was sent */
    bool is_ok;
};

static struct service_bench bench;
static struct client client[SERVICE_CLIENTS];
static unsigned ticks;
static double last_id;

/* --- clients --- */

static void say(struct client *self, const char *text, size_t length)
{
    const ssize_t sent =
        send(self->file, text, length, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent >= 0 && sent != (ssize_t)length)
        (void)!sent; /* half a line is a line that others may be behind */
}

static void say_line(struct client *self, const char *text)
{
    say(self, text, strlen(text));
}

/* With an id of its own, to be waited for. */
static void ask(struct client *self, const char *members)
{
    char line[512];
    self->waits_for = ++last_id;
    self->since = ticks;
    self->is_ok = false;
    snprintf(line, sizeof line, "{\"id\":%.0f,%s}\n", last_id, members);
    assert_int_equal(send(self->file, line, strlen(line), MSG_NOSIGNAL),
                     (ssize_t)strlen(line));
}

static void hear_line(struct client *self, const char *text)
{
    if (strstr(text, "\"id\":") == NULL)
        return;
    cJSON *object = cJSON_Parse(text);
    const cJSON *id = cJSON_GetObjectItem(object, "id");
    assert_non_null(object);
    if (cJSON_IsNumber(id) && id->valuedouble == self->waits_for) {
        self->waits_for = 0;
        self->is_ok = cJSON_IsTrue(cJSON_GetObjectItem(object, "ok"));
    }
    cJSON_Delete(object);
}

static void hear(struct client *self)
{
    ssize_t got;
    while (!self->is_deaf &&
           (got = recv(self->file, self->said + self->length,
                       sizeof self->said - self->length, MSG_DONTWAIT)) > 0) {
        char *from = self->said, *end;
        self->length += (size_t)got;
        while ((end = memchr(from, '\n',
                             self->length - (size_t)(from - self->said)))) {
            *end = '\0';
            hear_line(self, from);
            from = end + 1;
        }
        self->length -= (size_t)(from - self->said);
        memmove(self->said, from, self->length);
    }
}

/* --- the service --- */

static void turn(void)
{
    (void)service_clients_look(&bench.control.clients, 0);
    service_control_step(&bench.control, 0);
}

/* What others send in a millisecond. */
static void (*company)(void);

static void tick(void)
{
    const int64_t ms = bench.rig.period_ns / 1000000;
    service_loop_tick(&bench.loop);
    ticks++;
    for (int64_t i = 0; i < ms; i++) {
        if (company != NULL)
            company();
        turn();
        service_control_step(&bench.control, 0);
    }
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++)
        if ((i < 2 || i % 8 == ticks % 8) && client[i].file >= 0)
            hear(&client[i]);
}

static enum controller_state state(void)
{
    return bench.machine.controller.state;
}

static void until(enum controller_state wanted)
{
    for (unsigned i = 0; state() != wanted; i++) {
        if (i > REST_TICKS)
            fail_msg("%s, expected %s", controller_state_text(state()),
                     controller_state_text(wanted));
        tick();
    }
}

/* The answer that it waits for; true: it was ok. */
static bool answered(struct client *self)
{
    for (unsigned i = 0; self->waits_for != 0; i++) {
        if (i > REST_TICKS)
            fail_msg("no answer to %.0f", self->waits_for);
        tick();
    }
    return self->is_ok;
}

static void done(struct client *self, const char *members)
{
    ask(self, members);
    if (!answered(self))
        fail_msg("refused: %s", members);
}

static void up(const char *rig, unsigned clients)
{
    assert_int_equal(service_bench_ready(&bench, rig), 0);
    company = NULL;
    ticks = 0;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++) {
        client[i] = (struct client){ .file = -1 };
        if (i < clients)
            client[i].file = service_bench_connect(&bench);
        turn();
    }
    done(&client[0], "\"command\":\"take\",\"lease\":60");
    done(&client[0], "\"command\":\"enable\"");
    until(CONTROLLER_READY);
}

static int down(void **test)
{
    (void)test;
    company = NULL;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++)
        if (client[i].file >= 0)
            close(client[i].file);
    if (bench.control.rig != NULL)
        service_bench_close(&bench);
    memset(&bench, 0, sizeof bench);
    return 0;
}

/* --- figures --- */

struct figures {
    unsigned count[BINS], all, most;
};

static void figures_add(struct figures *self, unsigned value)
{
    self->count[value < BINS ? value : BINS - 1]++;
    self->all++;
    self->most = value > self->most ? value : self->most;
}

static unsigned figures_share(const struct figures *self, double share)
{
    unsigned below = 0, value = 0;
    while (value < BINS && (below += self->count[value]) < share * self->all)
        value++;
    return value;
}

static void figures_print(const struct figures *self, const char *what)
{
    print_message("%s: %u tries, p50 %u, p99 %u, max %u ticks\n", what,
                  self->all, figures_share(self, 0.5),
                  figures_share(self, 0.99), self->most);
}

/* --- in company --- */

/* Let go after a stop, and press again. */
static void flood(void)
{
    static enum controller_state last;
    static unsigned quiet_ms;
    if (last == CONTROLLER_MOVING && state() != CONTROLLER_MOVING)
        quiet_ms = LET_GO_MS;
    last = state();
    quiet_ms -= quiet_ms > 0;
    for (unsigned i = 0; quiet_ms == 0 && i < FLOOD_PER_MS; i++)
        say_line(&client[0], jog_flood);
}

/* All that the others have in store: what is fine, what is none of their
 * business, what is none at all, what never ends, and much of it. */
static void crowd(void)
{
    static char values[4096];
    static const char *const line[] = {
        "{\"command\":\"status\"}\n",
        "{\"command\":\"latency\"}\n",
        "{\"command\":\"renew\"}\n",
        "{\"command\":\"jog\",\"axis\":\"dolly\",\"speed\":1}\n",
        "{\"command\":\"take\"}\n",
        "{\"command\":\"check\",\"text\":\"stop\"}\n",
        "{\"command\":\"hello\",\"x\":{\"command\":\"stop\"}}\n",
        "nonsense\n\n\n{}\n[]\n{{{\n",
        "{\"command\":\"hel", /* the rest comes later, with another line */
        "{\"command\":\"stream\",\"rate\":100}\n",
    };
    if (values[0] == '\0') {
        memset(values, '1', sizeof values);
        for (size_t i = 1; i < sizeof values; i += 2)
            values[i] = ',';
        values[0] = '[';
        values[sizeof values - 1] = '\n';
    }
    flood();
    say_line(&client[63], line[0]); /* whose answers nobody reads */
    for (unsigned i = 0; i < 6; i++) {
        struct client *self = &client[2 + draw_below(SERVICE_CLIENTS - 3)];
        const unsigned which = draw_below(ARRAY_LEN(line) + 1);
        if (which < ARRAY_LEN(line))
            say_line(self, line[which]);
        else
            say(self, values, sizeof values);
    }
}

/* A stop while the axis is jogged by who floods: the ticks until it is obeyed. */
static unsigned try_stop(struct client *self)
{
    const unsigned stops = bench.machine.controller.stops;
    const unsigned since = ticks;
    say_line(self, "{\"id\":\"s\",\"command\":\"stop\"}\n");
    if (draw_below(2) == 0) /* read before the tick that comes, or after it */
        turn();
    while (bench.machine.controller.stops == stops) {
        if (ticks - since > REST_TICKS)
            return ticks - since;
        tick();
    }
    assert_true(state() == CONTROLLER_STOPPING || state() == CONTROLLER_READY);
    return ticks - since;
}

static int tries(void)
{
    const char *given = getenv("TRIES");
    return given != NULL ? atoi(given) : check_cases(2000);
}

static void company_of(const char *rig, const char *what)
{
    const int all = tries();
    struct figures stop = { .all = 0 }, look = { .all = 0 }, own = { .all = 0 };
    const int64_t period_ms =
        (up(rig, SERVICE_CLIENTS), bench.rig.period_ns / 1000000);
    for (unsigned i = 40; i < SERVICE_CLIENTS; i++)
        client[i].is_deaf = true;
    seed_from(what);
    company = crowd;
    for (int i = 0; i < all; i++) {
        /* now and then the holder itself, and one that reads nothing */
        struct client *self = i % 10 == 0   ? &client[0]
                              : i % 10 == 1 ? &client[63]
                                            : &client[1];
        until(CONTROLLER_MOVING);
        for (unsigned n = draw_below(4); n > 0; n--)
            tick();
        until(CONTROLLER_MOVING);
        if (i % 16 == 0) {
            ask(&client[1], "\"command\":\"status\"");
            assert_true(answered(&client[1]));
            figures_add(&look, ticks - client[1].since);
            ask(&client[0], "\"command\":\"renew\"");
            assert_true(answered(&client[0]));
            figures_add(&own, ticks - client[0].since);
            until(CONTROLLER_MOVING);
        }
        figures_add(&stop, try_stop(self));
    }
    print_message("%s, 64 clients:\n", what);
    figures_print(&stop, "  a stop is obeyed");
    figures_print(&look, "  status is answered");
    figures_print(&own, "  renew of the holder is answered");
    assert_in_range(stop.most, 1, MOST_TICKS);
    assert_in_range(look.most * (unsigned)period_ms, 0, MOST_MS);
    assert_in_range(own.most * (unsigned)period_ms, 0, MOST_MS);
}

static void a_stop_is_obeyed_in_two_ticks_of_1_ms(void **test)
{
    (void)test;
    company_of(rig_text[0], "ticks of 1 ms");
}

static void a_stop_is_obeyed_in_two_ticks_of_10_ms(void **test)
{
    (void)test;
    company_of(rig_text[1], "ticks of 10 ms");
}

/* --- behind whatever waits --- */

static void rests_for_ever(void)
{
    until(CONTROLLER_READY);
    const int64_t at = bench.machine.controller.axis[0].target.pos_q32;
    for (unsigned i = 0; i < 300; i++) {
        tick();
        assert_true(bench.machine.controller.axis[0].target.pos_q32 == at);
    }
}

static void jogging(void)
{
    if (state() == CONTROLLER_READY) /* let go of what a stop has ended */
        say_line(&client[0], jog_stop);
    say_line(&client[0], jog);
    until(CONTROLLER_MOVING);
}

static void behind_requests(void)
{
    for (unsigned i = 0; i < 300; i++)
        say_line(&client[0], i % 2 ? "{\"command\":\"hold\"}\n" : jog);
}

static void behind_half_a_line_of_another(void)
{
    static char half[150000];
    memset(half, ' ', sizeof half);
    say(&client[2], half, sizeof half);
    for (unsigned i = 0; i < 200; i++)
        turn();
}

/* Answers of minutes: its buffer and the kernel's are full, and so is its queue. */
static void behind_answers_that_nobody_reads(void)
{
    client[1].is_deaf = true;
    for (unsigned i = 0; i < 3000; i++) {
        say_line(&client[1], "{\"command\":\"hello\"}\n");
        turn();
    }
    assert_true(bench.control.clients.client[1].out_length > SERVICE_OUT / 2);
    assert_int_equal(bench.control.clients.client[1].count, SERVICE_QUEUE);
}

static void behind_a_plan(void)
{
    say_line(
        &client[0],
        "{\"command\":\"check\",\"text\":\"axes: {dolly: {curve: bezier, "
        "keys: [[0, 0], [9, 90]]}}\\nshoot: {mode: go-motion, blur: 50 %,"
        " frames: 100000, exposure: 100 ms, move: 1 s, line: camera}\\n\"}\n");
    for (unsigned i = 0; i < 20; i++)
        tick();
    assert_true(bench.control.planner.works);
}

static void behind_nothing(void)
{
}

static void a_stop_is_behind_nothing(void **test)
{
    static const struct {
        void (*before)(void);
        unsigned who;
        bool rests; /* nobody has sent more that comes after it */
    } row[] = {
        { behind_nothing, 1, true },
        { behind_requests, 0, true },
        { behind_requests, 1, false },
        { behind_half_a_line_of_another, 1, true },
        { behind_answers_that_nobody_reads, 1, true },
        { behind_a_plan, 0, true },
        { behind_a_plan, 1, true },
    };
    for (size_t i = 0; i < 2 * ARRAY_LEN(row); i++) {
        const size_t k = i / 2;
        up(rig_text[i % 2], 4);
        jogging();
        row[k].before();
        /* lines in front of it in its own socket: each look reads some */
        for (unsigned n = 0; n < 30 && row[k].who == 0; n++)
            turn();
        const unsigned took = try_stop(&client[row[k].who]);
        if (took > MOST_TICKS)
            fail_msg("row %zu: %u ticks", k, took);
        if (row[k].rests)
            rests_for_ever();
        (void)down(test);
    }
}

/* What a client has sent and then stopped moves nothing, in however few bytes it
 * comes; and what another has sent before. */
static void a_stop_takes_back_what_came_before_it(void **test)
{
    static const char load[] =
        "\"command\":\"load\",\"text\":\"axes: {dolly: {curve: s-curve, keys: "
        "[[0, 0], [2, 50]]}}\"";
    static const char *const before[] = {
        "{\"command\":\"jog\",\"axis\":\"dolly\",\"speed\":20}\n",
        "{\"command\":\"start\"}\n",
        "{\"command\":\"go\",\"to\":1}\n",
        "{\"command\":\"home\"}\n",
        "{\"command\":\"override\",\"percent\":50}\n{\"command\":\"start\"}\n",
        "{\"command\":\"status\"}\n{\"command\":\"go\",\"to\":1}\n",
    };
    (void)test;
    up(servo_rig, 2);
    done(&client[0], "\"command\":\"home\"");
    until(CONTROLLER_READY);
    for (unsigned i = 0; i < 50; i++)
        tick();
    ask(&client[0], load);
    while (client[0].waits_for != 0) {
        (void)nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
        tick();
    }
    assert_true(client[0].is_ok);
    for (unsigned i = 0; i < 3 * ARRAY_LEN(before); i++) {
        say_line(&client[0], before[i / 3]);
        if (i % 3 == 1)
            (void)service_clients_look(&bench.control.clients, 0);
        if (i % 3 == 2) /* on its way to the tick, which obeys both at once */
            turn();
        say_line(&client[i % 2], "{\"command\":\"stop\"}\n");
        if (i % 3 == 2)
            (void)service_clients_look(&bench.control.clients, 0);
        rests_for_ever();
        assert_int_equal(state(), CONTROLLER_READY);
    }
    done(&client[0], "\"command\":\"start\"");
    until(CONTROLLER_MOVING);
}

static void torque_off_is_not_taken_back(void **test)
{
    (void)test;
    up(rig_text[0], 2);
    ask(&client[0], "\"command\":\"off\"");
    turn();
    say_line(&client[1], "{\"command\":\"stop\"}\n");
    assert_true(answered(&client[0]));
    assert_int_equal(state(), CONTROLLER_OFF);
}

/* What is written otherwise, or with all that may stand around it. */
static void a_stop_is_known_however_it_is_written(void **test)
{
    static const struct {
        const char *text;
        bool stops;
    } row[] = {
        { "{\"command\":\"stop\"}", true },
        { " { \"command\" :\t\"stop\" } \r", true },
        { "{\"id\":\"a\\\"b\",\"command\":\"stop\"}", true },
        { "{\"id\":{},\"command\":\"stop\"}", true },
        { "{\"x\":[[{\"command\":\"jog\"}],1],\"command\":\"stop\",\"y\":null}",
          true },
        { "{\"command\":\"st\\u006fp\"}", true },
        { "{\"command\":\"stop\",\"command\":\"hello\"}", true },
        { "{\"command\":\"hello\",\"command\":\"stop\"}", false },
        { "{\"command\":\"jog stop\"}", false },
        { "{\"command\":[\"stop\"]}", false },
        { "{\"command\":\"stop\"", false },
        { "{\"command\":\"stop\"}}", false },
        { "[{\"command\":\"stop\"}]", false },
        { "{\"x\":{\"command\":\"stop\"}}", false },
        { "{\"Command\":\"stop\"}", false },
        { "\"command\":\"stop\"", false },
        { "{\"text\":\"\\\"command\\\":\\\"stop\\\"\"}", false },
    };
    (void)test;
    up(rig_text[0], 2);
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        const unsigned stops = bench.machine.controller.stops;
        jogging();
        say_line(&client[1], row[i].text);
        say_line(&client[1], "\n");
        for (unsigned n = 0; n < 5; n++)
            tick();
        if ((bench.machine.controller.stops != stops) != row[i].stops)
            fail_msg("%s", row[i].text);
        until(row[i].stops ? CONTROLLER_READY : CONTROLLER_MOVING);
    }
}

/* --- of one that has gone --- */

static int knock(void)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const int file = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    snprintf(address.sun_path, sizeof address.sun_path, "%s", bench.socket);
    assert_int_equal(
        connect(file, (const struct sockaddr *)&address, sizeof address), 0);
    return file;
}

struct parting {
    bool is_known; /* it has been greeted, and follows a stream */
    bool is_half;  /* it closes both ways and keeps the socket */
    unsigned many; /* it asks for what it does not read */
};

static void says_stop_and_hangs_up(const struct parting *self,
                                   bool server_first)
{
    struct client who = { .file = knock() };
    for (unsigned n = 0; self->is_known && n < 10; n++)
        turn();
    if (self->is_known)
        say_line(&who, "{\"command\":\"stream\",\"rate\":100}\n");
    for (unsigned n = 0; self->is_known && n < 100; n++)
        turn();
    for (unsigned n = 0; n < self->many; n++)
        say_line(&who, "{\"command\":\"status\"}\n");
    say_line(&who, "{\"command\":\"stop\"}\n");
    if (self->is_half)
        assert_int_equal(shutdown(who.file, SHUT_RDWR), 0);
    else
        close(who.file);
    if (server_first)
        service_control_step(&bench.control, 0);
    for (unsigned n = 0; n < 40; n++)
        tick();
    if (self->is_half)
        close(who.file);
}

/* The stop counts also where what its client is told fails before it was read. */
static void a_stop_of_one_that_has_hung_up_is_obeyed(void **test)
{
    static const struct parting row[] = {
        { false, false, 0 },   { true, false, 0 },   { false, true, 0 },
        { true, true, 0 },     { false, false, 1 },  { true, false, 1 },
        { false, false, 200 }, { true, false, 200 }, { true, true, 200 },
    };
    (void)test;
    up(rig_text[0], 1);
    for (size_t i = 0; i < 2 * ARRAY_LEN(row); i++) {
        jogging();
        const unsigned stops = bench.machine.controller.stops;
        says_stop_and_hangs_up(&row[i / 2], i % 2 == 0);
        if (bench.machine.controller.stops == stops)
            fail_msg("row %zu: no stop", i);
        until(CONTROLLER_READY);
    }
}

/* --- turns --- */

/* A gamepad with four sticks at 60 Hz, a slider; and far more than a tick takes, of
 * which the last counts. */
static void of_more_than_a_tick_takes_the_last_counts(void **test)
{
    static const char *const members[] = {
        "\"command\":\"jog\",\"axis\":\"dolly\",\"speed\":20,\"to\":9000",
        "\"command\":\"override\",\"percent\":80",
    };
    for (size_t k = 0; k < ARRAY_LEN(members); k++) {
        up(rig_text[1], 2);
        for (unsigned i = 0; i < 3000; i++) {
            ask(&client[0], members[k]);
            if (i % 30 == 29)
                tick();
            else
                turn();
        }
        assert_true(answered(&client[0]));
        ask(&client[0], "\"command\":\"status\"");
        assert_true(answered(&client[0]));
        if (k == 0)
            until(CONTROLLER_MOVING);
        (void)down(test);
    }
}

static unsigned answers, failures, refusals;

static void count_lines(struct client *self)
{
    static char text[262144];
    size_t length = 0;
    for (ssize_t got; (got = recv(self->file, text + length,
                                  sizeof text - 1 - length, 0)) > 0;)
        length += (size_t)got;
    text[length] = '\0';
    for (char *at = text, *end; (end = strchr(at, '\n')) != NULL;
         at = end + 1) {
        *end = '\0';
        cJSON *object = cJSON_Parse(at);
        const char *error =
            cJSON_GetStringValue(cJSON_GetObjectItem(object, "error"));
        assert_non_null(object);
        if (cJSON_HasObjectItem(object, "ok")) {
            assert_true(cJSON_IsNumber(cJSON_GetObjectItem(object, "id")));
            answers++;
            failures += error != NULL;
        }
        refusals += error != NULL && strcmp(error, "FULL") == 0;
        cJSON_Delete(object);
    }
}

static void what_is_beyond_the_queue_is_refused_at_once(void **test)
{
    char line[100];
    (void)test;
    up(rig_text[1], 2);
    client[0].is_deaf = true; /* here */
    answers = refusals = 0;
    count_lines(&client[0]);
    answers = 0;
    for (unsigned i = 0; i < 100; i++) {
        snprintf(line, sizeof line, "{\"id\":%u,\"command\":\"hold\"}\n", i);
        say_line(&client[0], line);
    }
    for (unsigned i = 0; i < 20; i++)
        (void)service_clients_look(&bench.control.clients, 0);
    service_control_step(&bench.control, 0);
    count_lines(&client[0]);
    assert_int_equal(refusals, 100 - SERVICE_QUEUE);
    assert_int_equal(answers, refusals);
    for (unsigned i = 0; i < 100; i++)
        tick();
    count_lines(&client[0]);
    assert_int_equal(answers, 100);
    assert_int_equal(refusals, 100 - SERVICE_QUEUE);
}

/* However they are cut, and whatever is taken of those before meanwhile. */
static void lines_that_come_in_pieces_are_whole(void **test)
{
    enum { LINES = 2000 };
    static char text[LINES * 160];
    const struct service_client *seat = &bench.control.clients.client[0];
    size_t length = 0;
    (void)test;
    up(rig_text[0], 2);
    seed_from("pieces");
    for (unsigned i = 0; i < LINES; i++)
        length += (size_t)snprintf(
            text + length, sizeof text - length,
            "{\"id\":%u,\"x\":\"%.*s\",\"command\":\"renew\"}\n", i,
            (int)draw_below(90),
            "0123456789012345678901234567890123456789012345678901234567890123"
            "45678901234567890123456789");
    client[0].is_deaf = true; /* here */
    count_lines(&client[0]);
    answers = failures = 0;
    for (size_t sent = 0, piece; sent < length; sent += piece) {
        piece = 1 + draw_below(700);
        piece = piece < length - sent ? piece : length - sent;
        say(&client[0], text + sent, piece);
        (void)service_clients_look(&bench.control.clients, 0);
        while (seat->count > draw_below(40))
            service_control_step(&bench.control, 0);
        count_lines(&client[0]);
    }
    for (unsigned i = 0; i < 100; i++)
        turn();
    count_lines(&client[0]);
    assert_int_equal(answers, LINES);
    assert_int_equal(failures, 0);
    assert_int_equal(seat->used, 0);
}

/* As long as a line may be, with as much in it as can be: the others wait for
 * none of it. */
static void lines_of_many_values_are_refused_unread(void **test)
{
    static const char begin[] = "{\"id\":5,\"command\":\"hello\",\"x\":[0";
    static char line[SERVICE_LINE_MAX];
    (void)test;
    up(rig_text[0], 2);
    memset(line, '1', sizeof line);
    for (size_t i = 0; i < sizeof line; i += 2)
        line[i] = ',';
    memcpy(line, begin, sizeof begin - 1);
    memcpy(line + sizeof line - 4, "0]}\n", 4);
    for (size_t sent = 0; sent < sizeof line;) {
        const ssize_t got =
            send(client[1].file, line + sent, sizeof line - sent, MSG_DONTWAIT);
        sent += got > 0 ? (size_t)got : 0;
        turn();
    }
    client[1].waits_for = 5;
    assert_false(answered(&client[1]));
    assert_int_equal(bench.control.clients.client[1].count, 0);
    ask(&client[1], "\"command\":\"status\"");
    assert_true(answered(&client[1]));
}

/* --- at any time --- */

static void a_stop_is_taken_while_the_service_homes_and_ends(void **test)
{
    (void)test;
    up(servo_rig, 2);
    ask(&client[0], "\"command\":\"home\"");
    turn();
    assert_in_range(try_stop(&client[1]), 1, MOST_TICKS);
    until(CONTROLLER_READY);
    jogging();
    bench.loop.end = 1; /* SIGTERM */
    ask(&client[1], "\"command\":\"stop\"");
    assert_true(answered(&client[1]));
    assert_in_range(ticks - client[1].since, 0, 1);
    ask(&client[0], "\"command\":\"jog\",\"axis\":\"dolly\",\"speed\":20");
    assert_false(answered(&client[0]));
    for (unsigned i = 0; i < 1000 && !bench.loop.ended; i++)
        tick();
    assert_true(bench.loop.ended);
    assert_true(machine_is_off(&bench.machine));
}

/* Its streams have filled the socket and what the service keeps of them. */
static void a_stop_is_answered_behind_streams_that_nobody_reads(void **test)
{
    (void)test;
    up(rig_text[0], 2);
    done(&client[1], "\"command\":\"stream\",\"rate\":100");
    client[1].is_deaf = true;
    for (unsigned i = 0; i < 20000; i++)
        tick();
    assert_true(bench.control.clients.client[1].dropped > 0);
    ask(&client[1], "\"command\":\"stop\"");
    tick();
    client[1].is_deaf = false;
    assert_true(answered(&client[1]));
}

/* All seats are looked at at once, which the system allows for files that may be
 * open.  In a process of its own, as a limit that is lowered stays so. */
static void few_files_are_made_more_or_refused(void **test)
{
    const struct rlimit low = { 60, 4096 }, lowest = { 60, 60 };
    int status;
    (void)test;
    fflush(NULL);
    const pid_t child = fork();
    if (child == 0) {
        struct service_clients clients = { .listener = -1 };
        if (setrlimit(RLIMIT_NOFILE, &low) < 0 ||
            service_bench_ready(&bench, rig_text[0]) != 0)
            _exit(1);
        const int file = service_bench_connect(&bench);
        char said[64] = "";
        for (int i = 0; i < 10; i++)
            service_bench_tick(&bench);
        if (recv(file, said, sizeof said - 1, 0) <= 0)
            _exit(2);
        service_bench_close(&bench);
        if (setrlimit(RLIMIT_NOFILE, &lowest) < 0)
            _exit(3);
        _exit(service_clients_open(&clients, bench.socket, 0600) < 0 ? 0 : 4);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

int main(void)
{
#define STOP_TEST(claim) cmocka_unit_test_teardown(claim, down)
    const struct CMUnitTest tests[] = {
        STOP_TEST(a_stop_is_obeyed_in_two_ticks_of_1_ms),
        STOP_TEST(a_stop_is_obeyed_in_two_ticks_of_10_ms),
        STOP_TEST(a_stop_is_behind_nothing),
        STOP_TEST(a_stop_takes_back_what_came_before_it),
        STOP_TEST(torque_off_is_not_taken_back),
        STOP_TEST(a_stop_is_known_however_it_is_written),
        STOP_TEST(a_stop_of_one_that_has_hung_up_is_obeyed),
        STOP_TEST(few_files_are_made_more_or_refused),
        STOP_TEST(of_more_than_a_tick_takes_the_last_counts),
        STOP_TEST(what_is_beyond_the_queue_is_refused_at_once),
        STOP_TEST(lines_that_come_in_pieces_are_whole),
        STOP_TEST(lines_of_many_values_are_refused_unread),
        STOP_TEST(a_stop_is_answered_behind_streams_that_nobody_reads),
        STOP_TEST(a_stop_is_taken_while_the_service_homes_and_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
