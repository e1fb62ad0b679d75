/* tests/firmware/linux/service/test_service_random.c - sequences of random
 * commands of four clients, who hang up in mid-line, and of drives that fall
 * silent, in virtual time, judged tick by tick.
 *
 * What must hold: no set point outside any limit; nothing moves in a state that
 * forbids it; a stop ends in rest within its bound, and so does a jog whose
 * client is gone or says nothing; every line has one answer, in order but for
 * stops and plans; nobody
 * moves anything who has not got control; no fault without a cause; what goes to
 * a time of the move, from wherever, is held there in time and on its track to
 * the bit; and from wherever a sequence has led there is a way to OFF.
 *
 *   N=10000 build/tests/firmware/linux/service/test_service_random
 *   SEED=4711 N=1 ...     the one that failed */
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <time.h>

#include "tests/support/check.h"
#include "tests/support/kind/kind.h"
#include "tests/support/service_bench.h"

#define CLIENTS    4
#define SAID_MAX   65536
#define REST_S     2.0 /* of the slowest axis at twice its speed, and twice that */
#define JOG_REST_S 0.5 /* braking takes 0.2 s */
#define TICK_S     0.005

static const char rig_text[] =
    "title: Random\n"
    "tick: 5 ms\n"
    "watchdog: 50 ms\n"
    "buses: {can: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n"
    "  slide:\n"
    "    unit: mm\n"
    "    limits: {position: [-200 mm, 200 mm], velocity: 200 mm/s,"
    " acceleration: 1000 mm/s2, jerk: 20000 mm/s3}\n"
    "    stop: {acceleration: 2000 mm/s2, jerk: 80000 mm/s3}\n"
    "    following_error: {floor: 20 mm, time: 100 ms}\n"
    "    drive: {kind: cia402, bus: can, node: 1, counts: 4096 per mm}\n"
    "  lift:\n"
    "    unit: mm\n"
    "    limits: {position: [0 mm, 100 mm], velocity: 100 mm/s,"
    " acceleration: 800 mm/s2}\n"
    "    following_error: {floor: 20 mm, time: 100 ms}\n"
    "    drive: {kind: cia402, bus: can, node: 2, counts: 4096 per mm}\n"
    "    homing: {by: switch, speed: 80 mm/s, slow: 10 mm/s, distance: 200 mm,"
    " position: -3 mm}\n"
    "    sim: {start: 10 mm, home_switch: [-10 mm, -3 mm]}\n";

static const char *const move_text[] = {
    "axes: {slide: {curve: s-curve, keys: [[0, 0], [1, 60], [2.2, -40]]}}",
    ("axes:\\n  slide: {curve: quintic, keys: [[0, 10], [0.8, 20], [2, -30],"
     " [3, 10]]}\\n  lift: {curve: s-curve, keys: [[0, 5], [2, 60], [3, 5]]}"),
    "axes: {slide: {curve: s-curve, keys: [[0, 0], [0.1, 150]]}}", /* LIMIT */
    "axes: {pan: 1}",                                              /* INPUT */
};

struct client {
    int file;
    char said[SAID_MAX];
    size_t said_length;
    unsigned sent, answered; /* lines with an answer of their own turn */
    unsigned plans, planned; /* check and load, which have theirs later, and
                                stop, which has it at once */
    char error[32];          /* of the last answer; "" */
};

static struct service_bench bench;
static struct client client[CLIENTS];
static struct client *holder; /* by the answers */
static uint64_t seed, state;
static bool troubled; /* in this sequence */
static bool begins;   /* this tick takes a jog, or a way to the start */
static char trace[32][256];
static unsigned traced;

static void note(const char *format, ...) __attribute__((format(printf, 1, 2)));
static void note(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vsnprintf(trace[traced++ % ARRAY_LEN(trace)], sizeof trace[0], format,
              list);
    va_end(list);
}

static void violated(const char *what)
{
    for (unsigned i = traced < 32 ? 0 : traced - 32; i < traced; i++)
        print_error("  %s\n", trace[i % ARRAY_LEN(trace)]);
    fail_msg("SEED=%" PRIu64 ", at %.3f s in %s: %s", seed,
             (double)bench.loop.now_ns / 1e9,
             controller_state_text(bench.machine.controller.state), what);
}

static unsigned pick_below(unsigned below)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (unsigned)((state >> 33) % below);
}

/* --- the judge --- */

static struct {
    bool known, is_inside; /* the range of an axis that is homed */
    double pos, vel;       /* per tick, of the axis's unit */
    int64_t offset_q32;
    enum controller_state state;
    bool homing;
    unsigned ticks_since_homing;
} before[2];

static bool moves(void)
{
    const enum controller_state now = bench.machine.controller.state;
    return now == CONTROLLER_MOVING || now == CONTROLLER_HOLDING ||
           now == CONTROLLER_STOPPING ||
           homing_is_running(&bench.machine.homing);
}

static double q32(int64_t value)
{
    return (double)value / 4294967296.0;
}

static bool is_inside(unsigned i, double pos)
{
    const struct rig_axis *rig = &bench.rig.axis[i];
    return pos >= q32(rig->limit.pos_min_q32) - 1e-6 &&
           pos <= q32(rig->limit.pos_max_q32) + 1e-6;
}

static void judge_steps(unsigned i, double pos, double vel)
{
    const struct rig_axis *rig = &bench.rig.axis[i];
    const double acc =
        q32(rig->limit.acc_q32 > rig->stop_acc_q32 ? rig->limit.acc_q32
                                                   : rig->stop_acc_q32);
    if (fabs(vel) > q32(rig->limit.vel_q32) * TICK_S * 1.000001 + 1e-6)
        violated("a step over the limit of speed");
    if (fabs(vel - before[i].vel) > acc * TICK_S * TICK_S * 1.001 + 1e-6) {
        note("%s: %.3f after %.3f, at most %.0f, units/s", rig->name,
             vel / TICK_S, before[i].vel / TICK_S, acc);
        violated("a step over the limit of acceleration");
    }
    /* while homing searches its range does not count */
    if (!homing_is_running(&bench.machine.homing) &&
        before[i].ticks_since_homing * TICK_S > JOG_REST_S &&
        bench.machine.controller.axis[i].homed && before[i].is_inside &&
        !is_inside(i, pos))
        violated("a set point leaves the range");
}

/* What is so short begins and ends in the tick that takes it: half of the tick
 * faster, half of it slower. */
static double within_a_tick(unsigned i)
{
    return begins ? q32(bench.rig.axis[i].limit.acc_q32) * TICK_S * TICK_S / 4
                  : 0;
}

static void judge_axis(unsigned i)
{
    const struct controller *controller = &bench.machine.controller;
    const struct controller_axis *axis = &controller->axis[i];
    const bool homing = homing_is_running(&bench.machine.homing);
    const double pos = q32(axis->target.pos_q32);
    /* from a quick stop on no set point is sent: the drives brake */
    const bool held = axis->feedback.state == HAL_DRIVE_ENABLED &&
                      controller->reaction < CONTROLLER_REACT_QUICK &&
                      controller->state != CONTROLLER_OFF &&
                      controller->state != CONTROLLER_FAULT;
    const double vel = before[i].known ? pos - before[i].pos : 0;
    if (held && before[i].known && before[i].offset_q32 == axis->offset_q32) {
        judge_steps(i, pos, vel);
        if (controller->state == CONTROLLER_READY && !homing &&
            before[i].state == CONTROLLER_READY && !before[i].homing &&
            fabs(vel) > within_a_tick(i) + 1e-6) {
            note("%s: to %.6f, by %.9f", bench.rig.axis[i].name, pos, vel);
            violated("a set point moves in READY");
        }
    }
    before[i].vel = held && before[i].offset_q32 == axis->offset_q32 ? vel : 0;
    before[i].known = held;
    before[i].is_inside = axis->homed && is_inside(i, pos);
    before[i].pos = pos;
    before[i].offset_q32 = axis->offset_q32;
    before[i].state = controller->state;
    before[i].homing = homing;
    before[i].ticks_since_homing =
        homing ? 0 : before[i].ticks_since_homing + 1;
}

/* That the sequences came to something. */
static struct {
    uint64_t ticks, moving, holding, homing, jogging, back, faults, orphans;
    uint64_t coupled; /* jogging */
    /* arrivals at a time of the move, by what was left: nothing, a hold, one in
     * reverse, another way there; and stops and holds on the way */
    uint64_t gone[4], cut, paused;
} seen;

static void count(void)
{
    const struct controller *controller = &bench.machine.controller;
    const bool homing = homing_is_running(&bench.machine.homing);
    seen.homing += homing;
    seen.coupled +=
        bench.control.state->jogging && controller->axis[1].cam != NULL;
    seen.jogging += bench.control.state->jogging;
    seen.moving += controller->state == CONTROLLER_MOVING && !homing &&
                   !bench.control.state->jogging;
    seen.holding += controller->state == CONTROLLER_HOLDING;
    seen.back += controller->is_reversed && moves();
    seen.faults += controller->state == CONTROLLER_FAULT;
}

static void tick(void)
{
    const struct controller *controller = &bench.machine.controller;
    begins = false;
    for (unsigned i = 0; i < bench.control.flights; i++) {
        const struct service_flight *flight =
            &bench.control
                 .flight[(bench.control.flight_first + i) % SERVICE_FLIGHTS];
        begins |= flight->by_request ? bench.loop.request.kind != SERVICE_HOME
                                     : flight->command == MAILBOX_JOG;
    }
    service_bench_tick(&bench);
    for (unsigned i = 0; i < bench.rig.axis_count; i++)
        judge_axis(i);
    count();
    if (controller->fault.fault != CONTROLLER_FAULT_NONE && !troubled)
        violated(controller_fault_text(controller->fault.fault));
}

/* --- clients --- */

static void client_open(struct client *self)
{
    *self = (struct client){ .file = service_bench_connect(&bench) };
    if (self->file < 0)
        violated("no connection");
}

static void client_close(struct client *self)
{
    close(self->file);
    if (holder == self)
        holder = NULL;
    self->file = -1;
    service_bench_serve(&bench);
}

static void client_hears_line(struct client *self, const char *line)
{
    cJSON *object = cJSON_Parse(line);
    const cJSON *id = cJSON_GetObjectItem(object, "id");
    if (!cJSON_IsObject(object))
        violated("what came is no object");
    if (cJSON_HasObjectItem(object, "ok")) {
        const char *error =
            cJSON_GetStringValue(cJSON_GetObjectItem(object, "error"));
        if (cJSON_IsNumber(id) && id->valuedouble != ++self->answered)
            violated("an answer out of order");
        if (cJSON_IsString(id))
            self->planned++;
        snprintf(self->error, sizeof self->error, "%s",
                 error != NULL ? error : "");
        if (cJSON_IsTrue(cJSON_GetObjectItem(object, "ok")) != (error == NULL))
            violated("an answer that is neither yes nor no");
    }
    cJSON_Delete(object);
}

static void client_hear(struct client *self)
{
    ssize_t got;
    while (self->file >= 0 &&
           (got = recv(self->file, self->said + self->said_length,
                       SAID_MAX - self->said_length, 0)) != 0) {
        if (got < 0) {
            if (errno != EAGAIN)
                violated("the service has hung up");
            return;
        }
        self->said_length += (size_t)got;
        char *from = self->said, *end;
        while (
            (end = memchr(from, '\n',
                          self->said_length - (size_t)(from - self->said)))) {
            *end = '\0';
            client_hears_line(self, from);
            from = end + 1;
        }
        self->said_length -= (size_t)(from - self->said);
        memmove(self->said, from, self->said_length);
    }
}

static void client_send(struct client *self, const char *members, bool plans)
{
    char line[1024];
    plans |= strcmp(members, "\"command\":\"stop\"") == 0;
    const int length =
        plans ? snprintf(line, sizeof line, "{\"id\":\"p%u\",%s}\n",
                         ++self->plans, members)
              : snprintf(line, sizeof line, "{\"id\":%u,%s}\n", ++self->sent,
                         members);
    note("client %d: %s", (int)(self - client), members);
    if (send(self->file, line, (size_t)length, MSG_NOSIGNAL) != length)
        violated("a line cannot be sent");
}

/* Until every line has its answer; planning takes real time. */
static void answered(struct client *self)
{
    for (int i = 0; i < 2000; i++) {
        client_hear(self);
        if (self->answered == self->sent && self->planned == self->plans)
            return;
        if (service_bench_plans(&bench)) {
            (void)nanosleep(&(struct timespec){ .tv_nsec = 100000 }, NULL);
            service_bench_serve(&bench);
            i -= i % 2; /* slow machines: as long as it plans */
        } else {
            tick();
        }
    }
    violated("a line without an answer");
}

/* --- commands --- */

static const struct {
    const char *name;
    unsigned weight;
    bool held; /* for who has control */
} row[] = {
    { "hello", 1, false },   { "status", 1, false },  { "stream", 1, false },
    { "stop", 1, false },    { "take", 3, false },    { "dance", 1, false },
    { "renew", 1, true },    { "release", 1, true },  { "enable", 6, true },
    { "off", 1, true },      { "reset", 2, true },    { "home", 3, true },
    { "check", 1, true },    { "load", 3, true },     { "approach", 4, true },
    { "go", 2, true },       { "start", 5, true },    { "hold", 3, true },
    { "resume", 3, true },   { "reverse", 3, true },  { "override", 3, true },
    { "jog", 8, true },      { "jog stop", 2, true }, { "capture", 1, true },
    { "gear", 2, true },     { "cam", 1, true },      { "uncouple", 2, true },
    { "latency", 1, false },
};

static unsigned pick(void)
{
    unsigned all = 0, i = 0;
    for (unsigned k = 0; k < ARRAY_LEN(row); k++)
        all += row[k].weight;
    for (unsigned left = pick_below(all); left >= row[i].weight; i++)
        left -= row[i].weight;
    return i;
}

/* A time, in s or in frames, a key, or the start. */
static void compose_go(char *to, size_t size)
{
    switch (pick_below(4)) {
    case 0:
        snprintf(to, size, ",\"to\":%.2f", pick_below(350) / 100.0);
        break;
    case 1:
        snprintf(to, size, ",\"to\":\"f%u @ 24\"", pick_below(84));
        break;
    case 2:
        snprintf(to, size, ",\"axis\":\"slide\",\"key\":%u", pick_below(6));
        break;
    default:
        snprintf(to, size, ",\"to\":0");
    }
}

/* Its members, most of them sensible. */
static bool compose(unsigned which, char *text, size_t size)
{
    const char *name = row[which].name;
    int n = snprintf(text, size, "\"command\":\"%s\"", name);
    char *to = text + n;
    size -= (size_t)n;
    if (strcmp(name, "jog") == 0)
        snprintf(to, size, ",\"axis\":\"%s\",\"speed\":%d,\"for\":%.2f%s",
                 pick_below(2) ? "slide" : "lift", (int)pick_below(260) - 130,
                 0.01 + pick_below(200) / 100.0,
                 pick_below(4) ? "" : ",\"to\":20");
    else if (strcmp(name, "go") == 0)
        compose_go(to, size);
    else if (strcmp(name, "gear") == 0)
        snprintf(to, size,
                 ",\"axis\":\"lift\",\"to\":\"slide\",\"ratio\":%.2f%s%.1f",
                 (int)pick_below(400) / 100.0 - 2,
                 pick_below(2) ? ",\"over\":" : ",\"x\":",
                 (int)pick_below(800) / 2.0 - 200);
    else if (strcmp(name, "cam") == 0)
        snprintf(to, size,
                 ",\"axis\":\"lift\",\"to\":\"slide\",\"keys\":[[-200,%u],"
                 "[-100,%u],[0,%u],[150,%u]]",
                 pick_below(120), pick_below(100), pick_below(2) * 10,
                 pick_below(100));
    else if (strcmp(name, "uncouple") == 0)
        snprintf(to, size, ",\"axis\":\"%s\"",
                 pick_below(4) ? "lift" : "slide");
    else if (strcmp(name, "override") == 0)
        snprintf(to, size, ",\"percent\":%u",
                 pick_below(10) ? pick_below(201) : 500);
    else if (strcmp(name, "start") == 0)
        snprintf(to, size, ",\"times\":%u,\"ping_pong\":%s", pick_below(3),
                 pick_below(2) ? "true" : "false");
    else if (strcmp(name, "reverse") == 0)
        snprintf(to, size, ",\"back\":%s", pick_below(2) ? "true" : "false");
    else if (strcmp(name, "home") == 0)
        snprintf(to, size, "%s", pick_below(2) ? ",\"axes\":[\"lift\"]" : "");
    else if (strcmp(name, "take") == 0)
        snprintf(to, size, ",\"lease\":60");
    else if (strcmp(name, "stream") == 0)
        snprintf(to, size, ",\"rate\":%u", pick_below(101));
    const bool plans = strcmp(name, "load") == 0 || strcmp(name, "check") == 0;
    if (plans)
        snprintf(to, size, ",\"text\":\"%s\"",
                 move_text[pick_below(ARRAY_LEN(move_text))]);
    return plans;
}

/* One command, its answer, and what the answer must be. */
static void command(struct client *self, unsigned which)
{
    char text[512];
    const bool plans = compose(which, text, sizeof text);
    const bool may = holder == self || !row[which].held;
    client_send(self, text, plans && may);
    answered(self);
    note("  %s, %s", self->error,
         controller_state_text(bench.machine.controller.state));
    if (!may && strcmp(self->error, "CONTROL") != 0)
        violated("done for a client without control");
    if (strcmp(row[which].name, "take") == 0) {
        if ((self->error[0] == '\0') != (holder == NULL || holder == self))
            violated("control is given wrongly");
        if (self->error[0] == '\0')
            holder = self;
    }
    if (strcmp(row[which].name, "release") == 0 && may)
        holder = NULL;
}

/* --- what else happens --- */

static unsigned named(const char *name)
{
    unsigned i = 0;
    while (strcmp(row[i].name, name) != 0)
        i++;
    return i;
}

static void own(unsigned which_name)
{
    char text[64];
    snprintf(text, sizeof text, "\"command\":\"%s\"", row[which_name].name);
    client_send(holder, text, false);
    answered(holder);
}

static void ticks(unsigned count)
{
    while (count-- > 0)
        tick();
    for (unsigned i = 0; i < CLIENTS; i++)
        client_hear(&client[i]);
}

/* At rest within so long, from what moves now. */
static void rests(double seconds, const char *otherwise)
{
    for (double t = 0; moves(); t += TICK_S) {
        if (t > seconds)
            violated(otherwise);
        tick();
    }
}

/* The same of a jog, which may be held: it stands, in HOLDING. */
static bool jog_goes_on(void)
{
    return moves() && (bench.machine.controller.state != CONTROLLER_HOLDING ||
                       before[0].vel != 0 || before[1].vel != 0);
}

static void jog_rests(double seconds, const char *otherwise)
{
    for (double t = 0; jog_goes_on(); t += TICK_S) {
        if (t > seconds)
            violated(otherwise);
        tick();
    }
}

static void stop(void)
{
    struct client *self = &client[pick_below(CLIENTS)];
    client_send(self, "\"command\":\"stop\"", false);
    answered(self);
    rests(troubled ? 10 * REST_S : REST_S, "not at rest in time after a stop");
}

static void hang_up(struct client *self)
{
    const bool was_jogging = holder == self && bench.control.state->jogging;
    static const char half[] = "{\"command\":\"jog\",\"axis\":\"sli";
    note("client %d hangs up", (int)(self - client));
    if (pick_below(2))
        (void)send(self->file, half, strlen(half), MSG_NOSIGNAL);
    client_close(self);
    if (was_jogging)
        jog_rests(troubled ? 10 * REST_S : JOG_REST_S,
                  "a jog goes on without its client");
    seen.orphans += was_jogging;
    client_open(self);
}

/* Whoever jogs says nothing more; what was held does not go on either. */
static void silence(void)
{
    double from[2];
    if (!bench.control.state->jogging)
        return;
    note("silence");
    ticks((unsigned)((PLAYBACK_JOG_MAX_NS / 1e9 + REST_S) / TICK_S));
    if (jog_goes_on())
        violated("a jog goes on after its dead man's time");
    if (bench.machine.controller.state != CONTROLLER_HOLDING || holder == NULL)
        return;
    for (unsigned i = 0; i < 2; i++)
        from[i] = before[i].pos;
    own(named("resume"));
    jog_rests(JOG_REST_S, "a dead man's jog goes on");
    for (unsigned i = 0; i < 2; i++)
        if (fabs(before[i].pos - from[i]) > 1e-6)
            violated("a dead man's jog is resumed");
}

/* --- to a time of the move --- */

#define GO_S 20.0 /* 400 mm at a quarter of 200 mm/s, and what was left first */

static bool is_held(void)
{
    const struct controller *controller = &bench.machine.controller;
    return controller->state == CONTROLLER_HOLDING &&
           controller->rate.rate_q30 == 0 && before[0].vel == 0 &&
           before[1].vel == 0;
}

static bool is_there(void)
{
    return is_held() && bench.machine.playback.state == PLAYBACK_PLAYING;
}

/* Held at that time of it, every set point the track's to the bit. */
static void judge_arrival(int64_t at_ns_q12)
{
    const struct playback *playback = &bench.machine.playback;
    tick();
    if (bench.machine.controller.rate.s_ns_q12 != at_ns_q12)
        violated("it has gone to another time");
    for (unsigned i = 0; i < bench.rig.axis_count; i++) {
        struct motion_cursor cursor = { 0 };
        struct motion_sample sample;
        if (playback->axis[i].track == NULL)
            continue;
        motion_track_sample(playback->axis[i].track, &cursor, at_ns_q12,
                            &sample);
        if (sample.pos_q32 != bench.machine.controller.axis[i].target.pos_q32)
            violated("it is not where the move is at that time");
    }
}

/* A stop on the way: it does not go on by itself. */
static void cuts(void)
{
    stop();
    const double at[2] = { before[0].pos, before[1].pos };
    ticks(200);
    if (!troubled && (before[0].pos != at[0] || before[1].pos != at[1]))
        violated("it goes on after a stop");
    seen.cut++;
}

/* Goes on in time, at full speed, and arrives; a fault may end it. */
static bool arrives(void)
{
    client_send(holder, "\"command\":\"override\",\"percent\":100", false);
    answered(holder);
    for (double t = 0; !is_there(); t += TICK_S) {
        if (troubled && bench.machine.controller.state == CONTROLLER_FAULT)
            return false;
        if (t > GO_S)
            violated("it does not arrive");
        tick();
    }
    return true;
}

static void pauses(void)
{
    own(named("hold"));
    for (double t = 0; !is_held() && strcmp(holder->error, "STATE") != 0;
         t += TICK_S) {
        if (troubled && bench.machine.controller.state == CONTROLLER_FAULT)
            return;
        if (t > REST_S)
            violated("not at rest in time after a hold");
        tick();
    }
    seen.paused += bench.machine.playback.state == PLAYBACK_GOING;
}

/* To wherever, from where it stands, is held, is held in reverse, or is already
 * on its way.  True: it was held on its way, and another jump follows. */
static bool jump(void)
{
    const struct controller *controller = &bench.machine.controller;
    const struct playback *playback = &bench.machine.playback;
    const unsigned from = playback->state == PLAYBACK_GOING         ? 3
                          : controller->is_reversed                 ? 2
                          : controller->state == CONTROLLER_HOLDING ? 1
                                                                    : 0;
    command(holder, named("go"));
    if (holder->error[0] != '\0')
        return false;
    const int64_t at_ns_q12 = playback->at_ns_q12;
    ticks(pick_below(60));
    const unsigned then = playback->state == PLAYBACK_GOING ? pick_below(6) : 6;
    if (then == 0) {
        cuts();
        return false;
    }
    if (then == 1)
        return false; /* something else comes meanwhile */
    if (then <= 3) {
        pauses();
        if (pick_below(2) && playback->state == PLAYBACK_GOING)
            return true;
        if (playback->state == PLAYBACK_GOING)
            own(named("resume"));
    }
    if (!arrives())
        return false;
    judge_arrival(at_ns_q12);
    seen.gone[from]++;
    return false;
}

static void trouble(enum kind_trouble what)
{
    const unsigned i = pick_below(2);
    note("drive %u: trouble %d", i, (int)what);
    troubled = true;
    for (unsigned k = 0; k < 2; k++)
        if (what == KIND_HEALED || k == i)
            kind_tests[bench.rig.axis[k].kind]->trouble(bench.sim.servo[k],
                                                        what);
}

static void burst(void)
{
    char text[512];
    note("burst");
    for (unsigned n = 1 + pick_below(6); n > 0; n--) {
        struct client *self = &client[pick_below(CLIENTS)];
        unsigned which = pick();
        while (compose(which, text, sizeof text))
            which = pick();
        client_send(self, text, false);
    }
    for (unsigned i = 0; i < CLIENTS; i++)
        answered(&client[i]);
    holder = NULL; /* whose is it now?  as the service has it */
    for (unsigned i = 0; i < CLIENTS; i++) {
        client_send(&client[i], "\"command\":\"renew\"", false);
        answered(&client[i]);
        if (client[i].error[0] == '\0' && holder != NULL)
            violated("two clients have control");
        if (client[i].error[0] == '\0')
            holder = &client[i];
    }
}

/* --- a sequence --- */

/* What makes sense in the present state: random words alone come to nothing. */
static const char *sensible(void)
{
    static const char *const off[] = { "enable", "load" };
    static const char *const ready[] = { "home", "load",  "approach", "start",
                                         "jog",  "start", "approach", "jog",
                                         "go",   "go" };
    static const char *const coupled[] = { "jog", "jog", "jog", "uncouple" };
    static const char *const moving[] = { "hold", "reverse",  "override",
                                          "gear", "jog stop", "jog",
                                          "stop" };
    static const char *const holding[] = { "resume",   "reverse", "go",
                                           "override", "resume",  "stop" };
    const struct controller_axis *axis = bench.machine.controller.axis;
    if (holder == NULL)
        return "take";
    switch (bench.machine.controller.state) {
    case CONTROLLER_OFF:
        return off[pick_below(ARRAY_LEN(off))];
    case CONTROLLER_READY:
        if (axis[1].cam != NULL)
            return coupled[pick_below(ARRAY_LEN(coupled))];
        if (axis[1].homed && pick_below(2) == 0)
            return "gear";
        return ready[pick_below(ARRAY_LEN(ready))];
    case CONTROLLER_MOVING:
    case CONTROLLER_STOPPING:
        return moving[pick_below(ARRAY_LEN(moving))];
    case CONTROLLER_HOLDING:
        return holding[pick_below(ARRAY_LEN(holding))];
    case CONTROLLER_FAULT:
        break;
    }
    return "reset";
}

static void go_on(void)
{
    const struct controller *controller = &bench.machine.controller;
    command(holder != NULL ? holder : &client[pick_below(CLIENTS)],
            named(sensible()));
    for (int i = 0; controller->enabling && i < 100; i++)
        tick();
    ticks(pick_below(30));
}

static void step(void)
{
    const unsigned what = pick_below(180);
    if (what >= 160 && holder != NULL)
        while (jump())
            continue;
    else if (what >= 100)
        go_on();
    else if (what < 60)
        command(holder != NULL && pick_below(8) ? holder
                                                : &client[pick_below(CLIENTS)],
                pick());
    else if (what < 85)
        ticks(1 + pick_below(60));
    else if (what < 89)
        hang_up(&client[pick_below(CLIENTS)]);
    else if (what < 93)
        stop();
    else if (what < 94)
        silence();
    else if (what < 99)
        burst();
    else
        trouble(pick_below(2) ? KIND_SILENT : KIND_BLOCKED);
}

/* To a state, by these commands in OFF, READY and FAULT. */
static void reaches(enum controller_state state_wanted, const char *in_off,
                    const char *in_ready)
{
    const struct controller *controller = &bench.machine.controller;
    for (int i = 0; i < 8000; i++) {
        const char *name = controller->state == CONTROLLER_OFF     ? in_off
                           : controller->state == CONTROLLER_READY ? in_ready
                                                                   : "reset";
        if (controller->state == state_wanted && !controller->enabling)
            return;
        if (i % 100 == 0 && !controller->enabling)
            own(named(name));
        tick();
    }
    violated("OFF cannot be reached, or not be left");
}

/* From wherever it is: OFF, and without a fault.  A drive that was lost while it
 * was off is looked for after the next enable has failed. */
static void ends(void)
{
    if (troubled)
        trouble(KIND_HEALED);
    if (holder == NULL)
        command(&client[0], named("take"));
    stop();
    if (troubled)
        reaches(CONTROLLER_READY, "enable", "renew");
    reaches(CONTROLLER_OFF, "renew", "off");
    ticks(20);
    troubled = false;
}

/* Some begin where all axes are known, which is a long way by chance. */
static void prepares(void)
{
    command(&client[0], named("take"));
    reaches(CONTROLLER_READY, "enable", "renew");
    own(named("home"));
    rests(30, "homing goes on");
    if (pick_below(2) == 0)
        return;
    static const char *const in_turn[] = { "approach", "start", "hold",
                                           "reverse" };
    char text[512];
    snprintf(text, sizeof text, "\"command\":\"load\",\"text\":\"%s\"",
             move_text[pick_below(2)]);
    client_send(holder, text, true);
    answered(holder);
    for (unsigned i = 0, count = pick_below(5); i < count; i++) {
        own(named(in_turn[i]));
        if (i == 0)
            rests(GO_S, "it does not arrive");
        else
            ticks(pick_below(200));
    }
    if (pick_below(2))
        while (jump())
            continue;
}

/* From its seed alone: a machine and clients of its own. */
static void sequence(void)
{
    state = seed * UINT64_C(0x9E3779B97F4A7C15) + 1;
    traced = 0;
    memset(before, 0, sizeof before);
    if (service_bench_machine(&bench) < 0)
        violated("no machine");
    holder = NULL;
    for (unsigned i = 0; i < CLIENTS; i++)
        client_open(&client[i]);
    if (pick_below(4) == 0)
        prepares();
    for (unsigned n = 10 + pick_below(30); n > 0; n--)
        step();
    ends();
    seen.ticks += bench.machine.controller.ticks;
    for (unsigned i = 0; i < CLIENTS; i++)
        client_close(&client[i]);
    service_bench_unmake(&bench);
}

static void random_commands_keep_every_limit(void **unused)
{
    const char *count = getenv("N"), *first = getenv("SEED");
    const uint64_t from = first != NULL ? strtoull(first, NULL, 10) : 1;
    const uint64_t all = count != NULL ? strtoull(count, NULL, 10) : 600;
    (void)unused;
    for (seed = from; seed < from + all; seed++)
        sequence();
    print_message(
        "%" PRIu64 " sequences, %" PRIu64 " ticks: %" PRIu64
        " in moves, %" PRIu64 " back, %" PRIu64 " held, %" PRIu64
        " jogging, %" PRIu64 " homing, %" PRIu64 " in faults; %" PRIu64
        " jogs without their client, %" PRIu64 " ticks of them coupled\n"
        "went to a time: %" PRIu64 " from ready, %" PRIu64
        " from a hold, %" PRIu64 " from reverse, %" PRIu64
        " from on the way; %" PRIu64 " stopped and %" PRIu64
        " held on the way\n",
        all, seen.ticks, seen.moving, seen.back, seen.holding, seen.jogging,
        seen.homing, seen.faults, seen.orphans, seen.coupled, seen.gone[0],
        seen.gone[1], seen.gone[2], seen.gone[3], seen.cut, seen.paused);
    if (all < 500)
        return;
    assert_true(seen.moving > 2 * all && seen.back * 20 > all &&
                seen.holding > all && seen.jogging > 10 * all &&
                seen.homing > all && seen.faults > 0 && seen.orphans > 2 &&
                seen.coupled > all);
    for (unsigned i = 0; i < 4; i++)
        assert_true(seen.gone[i] > 0);
    assert_true(seen.gone[0] > all / 20 && seen.cut > 0 && seen.paused > 0);
}

static int up(void **unused)
{
    (void)unused;
    const int err = service_bench_open(&bench, rig_text);
    service_bench_unmake(&bench); /* every sequence has its own */
    return err;
}

static int down(void **unused)
{
    (void)unused;
    service_bench_close(&bench);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(random_commands_keep_every_limit, up,
                                        down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
