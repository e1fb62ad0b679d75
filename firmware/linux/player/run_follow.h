/* firmware/linux/player/run_follow.h - a move that keeps to another clock: LTC
 * from a sound card, MIDI timecode, or frame pulses on a line.
 *
 * A thread of its own reads timecode with the time at which each byte came; pulses are
 * seen by the tick, which hands them over in a ring.  Whoever looks on compares
 * theirs with the move's time and steers its speed through the mailbox, so that
 * the tick gets nothing of it but when to start, and a ramp is one within the
 * limits as every other.  When the clock is lost or jumps, the move is held. */
#ifndef FIRMWARE_LINUX_PLAYER_RUN_FOLLOW_H
#define FIRMWARE_LINUX_PLAYER_RUN_FOLLOW_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/follow.h"
#include "firmware/control/mailbox.h"
#include "firmware/host/base/units.h"
#include "firmware/host/rig/rig.h"
#include "firmware/host/timecode/mtc.h"
#include "hal/clock.h"
#include "hal/gpio.h"

/* Speeds up and slows down by so much at most. */
#define RUN_FOLLOW_SPAN_Q30 (FOLLOW_ONE_Q30 / 50)

enum run_follow_kind {
    RUN_FOLLOW_NONE,
    RUN_FOLLOW_LINE,
    RUN_FOLLOW_MTC,
    RUN_FOLLOW_LTC, /* PCM, 16 bits signed, mono, RUN_FOLLOW_SAMPLES a second */
};
#define RUN_FOLLOW_SAMPLES 48000

struct run_follow_config {
    enum run_follow_kind kind;
    const char *path; /* of the stream; NULL of a line */
    bool is_open;     /* the stream is `file` already, for it to close */
    int file;
    int line;             /* of the rig; -1: none */
    struct units_fps fps; /* of the move, and of theirs */
    int64_t zero_frame;   /* of theirs, where the move's time is 0 */
    int64_t from_ns;      /* of the move's time, where it begins */
    /* what the operator should hear; NULL: on stderr, over the line of progress */
    void (*say)(void *context, const char *sentence);
    void *context;
};

#define RUN_FOLLOW_PULSES 64 /* a power of 2 */
#define RUN_FOLLOW_TEXT   128

struct run_follow {
    struct run_follow_config config;
    struct hal_clock *clock;
    struct hal_gpio *gpio;  /* of a line */
    _Atomic int64_t due_ns; /* when to start; RUN_START_NEVER: not known yet */

    /* from the tick to who looks on */
    _Atomic int64_t pulse_ns[RUN_FOLLOW_PULSES];
    _Atomic uint32_t put;
    _Atomic uint32_t start; /* the pulse that started the move, from 1 */
    bool is_pulse;          /* the tick's: one came in this tick */

    /* between the thread that reads and who looks on */
    pthread_mutex_t lock;
    struct follow follow;        /* theirs: ns of frames since their 0 */
    char wrong[RUN_FOLLOW_TEXT]; /* why it cannot be followed, or "" */

    /* the reader's */
    pthread_t thread;
    bool runs;
    _Atomic bool ends;
    int file;
    struct mtc mtc;
    struct LTCDecoder *ltc;
    int64_t samples;
    int64_t base_ns, base_seen_ns; /* when the first of them was, as it seemed
                                      then */

    /* who looks on */
    uint32_t taken;
    int64_t frame, last_ns; /* of pulses */
    int64_t zero_ns;        /* theirs at the move's 0 */
    int64_t s_ns, t_ns;     /* of the last row, */
    bool is_moving;         /* and whether a move runs forward there */
    int64_t moving_ns;      /* since when */
    int64_t looked_ns, sent_q30;
    enum follow_state said;
    bool said_far, said_wrong;
    /* once it had time to lock in */
    int64_t worst_ns, least_q30, most_q30;
    bool any;
};

/* "ltc:FILE", "mtc:FILE" or the name of a line of the rig: kind, path (of that text)
 * and line.  NULL, or why it is none, as the end of a sentence. */
const char *run_follow_clock(struct run_follow_config *config,
                             const struct rig *rig, bool is_real,
                             const char *text);
/* Opens the stream and begins to read it.  0, or an errno; then there is nothing
 * to end.  `gpio`: the line; NULL: none. */
int run_follow_begin(struct run_follow *self,
                     const struct run_follow_config *config,
                     struct hal_clock *clock, struct hal_gpio *gpio);
void run_follow_end(struct run_follow *self);

/* The tick's: after the lines were read; and when to start, RUN_START_NEVER: not
 * known yet. */
void run_follow_tick(struct run_follow *self);
int64_t run_follow_due_ns(struct run_follow *self, int64_t now_ns,
                          int64_t ready_ns, int64_t period_ns);

/* Who looks on: whether the move runs forward and where it was at the tick of that
 * time; and what is to be done: true, one command was put into the mailbox. */
void run_follow_take(struct run_follow *self, bool is_moving, int64_t s_ns_q12,
                     int64_t now_ns);
bool run_follow_poll(struct run_follow *self, struct mailbox *mailbox);

/* "followed to 0.4 ms, at 99.98 to 100.03 %"; "": there is nothing to say. */
const char *run_follow_report(const struct run_follow *self,
                              char text[RUN_FOLLOW_TEXT]);

#endif
