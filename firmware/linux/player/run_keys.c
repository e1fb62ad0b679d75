/* firmware/linux/player/run_keys.c - see run_keys.h. */
#include "firmware/linux/player/run_keys.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/units.h"
#include "firmware/host/job/job_shots.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/player/progress.h"
#include "motion/core/err.h"

#define RUN_KEYS_STEP  10 /* % */
#define RUN_KEYS_LEAST 10
#define RUN_KEYS_MOST  200

#define RUN_KEYS_TIMES_DIGITS 9

#define RUN_KEYS_BACKSPACE 127
#define RUN_KEYS_DIGITS    6 /* of a place that is said */

bool run_keys_begin(struct run_keys *keys, const struct job *job,
                    int64_t override_q30, bool follows)
{
    *keys =
        (struct run_keys){ .job = job,
                           .follows = follows,
                           .override_q30 = override_q30,
                           .wanted_q30 = override_q30,
                           .place_q32 = memory_new(job->rig.axis_count,
                                                   sizeof *keys->place_q32) };
    mailbox_init(&keys->mailbox);
    if (!isatty(STDERR_FILENO) || terminal_open(&keys->terminal) < 0)
        return false;
    fputs(
        follows
            ? "keys: space holds and resumes, c says where it stands, q stops\n"
            : "keys: space holds and resumes, r reverses, b goes back to the "
              "start, "
              "g to a time,\n"
              "      l sets how often it is played, c says where it stands,\n"
              "      + and - change the speed, 0 is 100 %, q stops\n",
        stderr);
    if (job->steps.count > 0)
        fputs("      n takes the frame that waits\n", stderr);
    return true;
}

void run_keys_end(struct run_keys *keys)
{
    terminal_close(&keys->terminal);
    memory_free(keys->place_q32);
    keys->place_q32 = NULL;
}

void run_keys_take(struct run_keys *keys, const struct telemetry_row *row)
{
    keys->phase = row->phase;
    keys->is_holding = row->state == CONTROLLER_HOLDING;
    keys->is_standing = keys->is_holding && row->rate.rate_q30 == 0;
    keys->is_waiting = row->waits_for > 0 && keys->is_standing;
    keys->is_ping_pong = row->is_ping_pong;
    if (row->rate.rate_q30 != 0)
        keys->is_reversed = row->rate.rate_q30 < 0;
}

/* On a line of its own, above the one that is redrawn. */
static void run_keys_say(const char *sentence)
{
    fprintf(stderr, "\r\033[K%s\n", sentence);
}

static bool run_keys_put(struct run_keys *keys, enum mailbox_command command,
                         int64_t value)
{
    if (mailbox_put(&keys->mailbox, command, value) == MOTION_OK)
        return true;
    run_keys_say("too many keys at once, this one is left out");
    return false;
}

static void run_keys_override(struct run_keys *keys, int percent)
{
    const int64_t rate_q30 =
        ((int64_t)percent * MOTION_CLOCK_WARP_ONE_Q30 + 50) / 100;
    if (percent < RUN_KEYS_LEAST || percent > RUN_KEYS_MOST)
        return;
    if (keys->phase != TELEMETRY_MOVE) {
        run_keys_say("the speed can be changed once the move has begun");
        return;
    }
    /* Camera triggers need their time between two shots. */
    struct messages messages = { .text = NULL };
    if (rate_q30 > keys->override_q30 &&
        !job_shots_check(keys->job, rate_q30, &messages)) {
        error_tell(&messages);
        return;
    }
    if (run_keys_put(keys, MAILBOX_OVERRIDE, rate_q30))
        keys->wanted_q30 = rate_q30;
}

/* --- along the path -------------------------------------------------------- */

/* Now, or once it stands. */
static void run_keys_then(struct run_keys *keys, enum run_keys_next next)
{
    if (keys->phase != TELEMETRY_MOVE) {
        run_keys_say("there is no move yet to go along");
    } else if (job_has_shots(keys->job)) {
        run_keys_say("this move has events, it is played from its start to its "
                     "end");
    } else {
        keys->next = next;
        if (!keys->is_holding)
            (void)run_keys_put(keys, MAILBOX_HOLD, 0);
    }
}

static void run_keys_go_on(struct run_keys *keys)
{
    const enum run_keys_next next = keys->next;
    if (keys->phase != TELEMETRY_MOVE)
        keys->next = RUN_KEYS_NOTHING;
    if (keys->next == RUN_KEYS_NOTHING || !keys->is_standing)
        return;
    keys->next = RUN_KEYS_NOTHING;
    if (next == RUN_KEYS_GO)
        (void)run_keys_put(keys, MAILBOX_GO, keys->go_ns_q12);
    else if (run_keys_put(keys, MAILBOX_REVERSE, !keys->is_reversed))
        (void)run_keys_put(keys, MAILBOX_RESUME, 0);
}

static void run_keys_go_to(struct run_keys *keys, int64_t t_ns_q12)
{
    keys->go_ns_q12 = t_ns_q12;
    run_keys_then(keys, RUN_KEYS_GO);
}

static void run_keys_typed_time(struct run_keys *keys)
{
    const struct units_context units = {
        .fps = { keys->job->move.fps_num, keys->job->move.fps_den },
    };
    char sentence[UNITS_SENTENCE_MAX];
    int64_t t_ns_q12;
    if (units_parse(keys->typed, UNITS_TIME, &units, &t_ns_q12, sentence) < 0)
        run_keys_say(sentence);
    else
        run_keys_go_to(keys, t_ns_q12);
}

/* In all, the time that is played now included. */
static void run_keys_typed_times(struct run_keys *keys)
{
    const size_t digits = strspn(keys->typed, "0123456789");
    if (digits == 0 || digits > RUN_KEYS_TIMES_DIGITS || keys->typed[digits])
        run_keys_say("expected how often it is played in all, 0 to 999999999; "
                     "0: until it is stopped");
    else if (keys->phase != TELEMETRY_MOVE)
        run_keys_say("there is no move yet to be played again");
    else if (job_has_shots(keys->job))
        run_keys_say("this move has events, it is played once");
    else
        (void)run_keys_put(
            keys, keys->is_ping_pong ? MAILBOX_PING_PONG : MAILBOX_LOOP,
            strtoll(keys->typed, NULL, 10));
}

static void run_keys_type_of(struct run_keys *keys, enum run_keys_typing typing)
{
    keys->typing = typing;
    keys->typed[0] = 0;
}

static void run_keys_type(struct run_keys *keys, int key)
{
    const enum run_keys_typing typing = keys->typing;
    const size_t length = strlen(keys->typed);
    if (key == '\n' || key == '\r') {
        keys->typing = RUN_KEYS_COMMANDS;
        if (typing == RUN_KEYS_TIME)
            run_keys_typed_time(keys);
        else
            run_keys_typed_times(keys);
    } else if (key == RUN_KEYS_BACKSPACE || key == '\b') {
        keys->typing = length > 0 ? typing : RUN_KEYS_COMMANDS;
        keys->typed[length > 0 ? length - 1 : 0] = 0;
    } else if (key >= ' ' && key < RUN_KEYS_BACKSPACE &&
               length + 1 < sizeof keys->typed) {
        keys->typed[length] = (char)key;
        keys->typed[length + 1] = 0;
    }
}

const char *run_keys_typed(struct run_keys *keys)
{
    if (keys->typing == RUN_KEYS_COMMANDS)
        return NULL;
    snprintf(keys->shown, sizeof keys->shown, "%s: %s",
             keys->typing == RUN_KEYS_TIME ? "go to" : "times", keys->typed);
    return keys->shown;
}

static void run_keys_capture(struct run_keys *keys)
{
    const struct mailbox_entry entry = { .command = MAILBOX_CAPTURE,
                                         .pos_q32 = keys->place_q32 };
    if (mailbox_send(&keys->mailbox, &entry) < 0)
        run_keys_say("too many keys at once, this one is left out");
}

/* "at 2.500 s: dolly 120.25 mm, pan 3 deg" */
static void run_keys_captured(const struct run_keys *keys, int64_t s_ns_q12)
{
    const struct job *job = keys->job;
    char text[NUMBER_MAX];
    number_seconds(text, s_ns_q12);
    fprintf(stderr, "\r\033[Kat %s s:", text);
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        const struct rig_axis *axis = job_rig_axis(job, i);
        number_fixed(text, keys->place_q32[job->rig_axis[i]], 32,
                     RUN_KEYS_DIGITS);
        fprintf(stderr, "%s %s %s %s", i > 0 ? "," : "", axis->name, text,
                units_axis_text(axis->unit));
    }
    fputc('\n', stderr);
}

/* --- keys and answers ------------------------------------------------------ */

static void run_keys_path(struct run_keys *keys, int key)
{
    if (key == 'r') {
        run_keys_then(keys, RUN_KEYS_REVERSE);
    } else if (key == 'b') {
        run_keys_go_to(keys, 0);
    } else if (key == 'g') {
        run_keys_type_of(keys, RUN_KEYS_TIME);
    } else if (key == 'l') {
        run_keys_type_of(keys, RUN_KEYS_TIMES);
    } else if (key == 'c') {
        run_keys_capture(keys);
    }
}

static void run_keys_next_frame(struct run_keys *keys)
{
    if (keys->is_waiting)
        (void)run_keys_put(keys, MAILBOX_RESUME, 0);
    else
        run_keys_say("no frame waits now");
}

static void run_keys_press(struct run_keys *keys, int key)
{
    const int percent = progress_percent(keys->wanted_q30);
    if (key == 'q')
        mailbox_stop(&keys->mailbox);
    else if (keys->follows && strchr("+=-0rbgl", key) != NULL)
        run_keys_say("a clock sets the speed and the place of this move");
    else if (keys->typing != RUN_KEYS_COMMANDS)
        run_keys_type(keys, key);
    else if (key == '+' || key == '=')
        run_keys_override(keys, percent + RUN_KEYS_STEP);
    else if (key == '-')
        run_keys_override(keys, percent - RUN_KEYS_STEP);
    else if (key == '0')
        run_keys_override(keys, 100);
    else if (key == 'n')
        run_keys_next_frame(keys);
    else if (key != ' ')
        run_keys_path(keys, key);
    else if (run_keys_put(keys,
                          keys->is_holding ? MAILBOX_RESUME : MAILBOX_HOLD, 0))
        keys->next = RUN_KEYS_NOTHING;
}

/* Why, and what then. */
static void run_keys_no_way(const struct mailbox_entry *answer, char sentence[],
                            size_t size)
{
    const char *what = answer->command == MAILBOX_GO ? "go there" : "reverse";
    if (answer->err == MOTION_E_ARG)
        snprintf(sentence, size, "it cannot %s: %s", what,
                 answer->command == MAILBOX_GO
                     ? "the time is not within the move"
                     : "a compiled move, or an axis that goes by its drive's "
                       "profile, only goes forward");
    else
        snprintf(sentence, size, "it cannot %s: %s", what,
                 motion_err_text(answer->err));
}

static bool run_keys_is_loop(const struct mailbox_entry *answer)
{
    return answer->command == MAILBOX_LOOP ||
           answer->command == MAILBOX_PING_PONG;
}

static void run_keys_repeated(const struct run_keys *keys, int64_t times)
{
    char sentence[80];
    const char *turns =
        keys->is_ping_pong ? ", every second time in reverse" : "";
    if (times == 0)
        snprintf(sentence, sizeof sentence, "played until it is stopped%s",
                 turns);
    else
        snprintf(sentence, sizeof sentence,
                 "played %" PRId64 " time%s in all%s", times,
                 times == 1 ? "" : "s", turns);
    run_keys_say(sentence);
}

static void run_keys_refused(const struct run_keys *keys,
                             const struct mailbox_entry *answer)
{
    char sentence[160];
    if (answer->command == MAILBOX_CAPTURE)
        snprintf(sentence, sizeof sentence, "no position to capture: %s",
                 answer->err == MOTION_E_STATE ? "hold the axes first"
                                               : motion_err_text(answer->err));
    else if (answer->command == MAILBOX_GO ||
             answer->command == MAILBOX_REVERSE)
        run_keys_no_way(answer, sentence, sizeof sentence);
    else if (run_keys_is_loop(answer))
        snprintf(sentence, sizeof sentence,
                 "it cannot be played again: a compiled move is played once");
    else if (answer->command == MAILBOX_OVERRIDE && keys->follows)
        snprintf(sentence, sizeof sentence,
                 "the move cannot be played so fast as its clock goes");
    else if (answer->command == MAILBOX_OVERRIDE)
        snprintf(sentence, sizeof sentence,
                 "the speed stays at %d %%: at %d %% the move would break a "
                 "limit",
                 progress_percent(keys->override_q30),
                 progress_percent(answer->value));
    else
        snprintf(sentence, sizeof sentence, "there is nothing to %s now",
                 answer->command == MAILBOX_HOLD ? "hold" : "resume");
    run_keys_say(sentence);
}

static void run_keys_answer(struct run_keys *keys,
                            const struct mailbox_entry *answer)
{
    if (answer->err < 0)
        run_keys_refused(keys, answer);
    else if (answer->command == MAILBOX_CAPTURE)
        run_keys_captured(keys, answer->value);
    else if (answer->command == MAILBOX_REVERSE)
        keys->is_reversed = answer->value != 0;
    else if (answer->command == MAILBOX_GO)
        keys->is_reversed = false;
    else if (run_keys_is_loop(answer))
        run_keys_repeated(keys, answer->value);
    if (answer->command != MAILBOX_OVERRIDE)
        return;
    if (answer->err == MOTION_OK)
        keys->override_q30 = answer->value;
    else if (keys->wanted_q30 == answer->value)
        keys->wanted_q30 = keys->override_q30;
}

void run_keys_poll(struct run_keys *keys)
{
    struct mailbox_entry answer;
    while (mailbox_answer(&keys->mailbox, &answer))
        run_keys_answer(keys, &answer);
    if (!keys->terminal.is_open)
        return;
    run_keys_go_on(keys);
    for (int i = 0; i < MAILBOX_CAPACITY; i++) {
        const int key = terminal_key(&keys->terminal);
        if (key == TERMINAL_NONE || key == TERMINAL_END)
            return;
        run_keys_press(keys, key);
    }
}
