/* firmware/linux/player/run_keys.h - the keys of the terminal while a move
 * runs on the clock.
 *
 *   space     hold, and resume
 *   n         the next frame, where the shoot waits for one
 *   r         the other way along the path
 *   b         back to the start, and hold there
 *   g         go to a time, and hold there: "2.5", "f120", "00:00:02:12",
 *             then return; backspace on nothing leaves it
 *   l         how often the move is played in all, this time included: "3",
 *             then return; 0: until it is stopped
 *   c         say where the axes stand, as a key of the move
 *   +  -      10 % faster or slower, 10 to 200 %; 0 is 100 %
 *   q         stop along the path, as Ctrl-C once
 *
 * They go into the tick through the mailbox; what the controller refuses is
 * said on the terminal.  What needs the axes at rest holds them first.
 * Everything here is called by the thread that looks on, never by the tick. */
#ifndef FIRMWARE_LINUX_PLAYER_RUN_KEYS_H
#define FIRMWARE_LINUX_PLAYER_RUN_KEYS_H

#include "firmware/control/controller.h"
#include "firmware/control/mailbox.h"
#include "firmware/host/job/job.h"
#include "firmware/host/recording/telemetry.h"
#include "firmware/linux/base/terminal.h"

#define RUN_KEYS_TIME_MAX 24

/* What is done once the axes stand. */
enum run_keys_next { RUN_KEYS_NOTHING, RUN_KEYS_REVERSE, RUN_KEYS_GO };

/* What is being typed. */
enum run_keys_typing {
    RUN_KEYS_COMMANDS,
    RUN_KEYS_TIME,  /* of the move, to go to */
    RUN_KEYS_TIMES, /* to play it */
};

struct run_keys {
    struct terminal terminal;
    struct mailbox mailbox;
    const struct job *job;
    int64_t override_q30; /* in force, as far as has been answered */
    int64_t wanted_q30;   /* with what has been put since */
    enum telemetry_phase phase;
    bool follows; /* a clock sets the speed and the place */
    bool is_holding, is_standing, is_reversed; /* at the last row */
    bool is_waiting;                           /* for a frame to be taken */
    enum run_keys_next next;
    int64_t go_ns_q12;
    bool is_ping_pong; /* at the last row */
    enum run_keys_typing typing;
    char typed[RUN_KEYS_TIME_MAX];
    char shown[RUN_KEYS_TIME_MAX + 16]; /* and what for */
    int64_t *place_q32; /* of a CAPTURE, each axis of the rig; on the heap */
};

/* Takes the terminal and says which keys there are.  False: standard input or
 * standard error is none; nothing is taken then. */
bool run_keys_begin(struct run_keys *keys, const struct job *job,
                    int64_t override_q30, bool follows);
/* The terminal as it was; also when it was not taken. */
void run_keys_end(struct run_keys *keys);

void run_keys_take(struct run_keys *keys, const struct telemetry_row *row);
/* Keys to commands, answers to sentences; never waits. */
void run_keys_poll(struct run_keys *keys);
/* What is typed, for the line that is redrawn; NULL when nothing is. */
const char *run_keys_typed(struct run_keys *keys);

#endif
