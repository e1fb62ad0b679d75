/* tests/firmware/mcu/play.c - play a compiled move on a board and compare every
 * set point with those of a run on this machine, to the bit.
 *
 *     play DEVICE RIG MOVE.slt TELEMETRY.csv [DAMAGED [SETTLE]]
 *
 * Before every eight pieces so many frames are sent that are damaged.  The
 * telemetry is as feed.h says.  With SETTLE the axes are the rig's Modbus servos
 * on the board's own line, each of which is to be so near to the end of the
 * move, in its unit, within a few seconds.  Status 0: all are equal; 3: the
 * board stopped with a fault.  "started" on stderr: the move is under way. */
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "tests/firmware/mcu/damage.h"
#include "tests/firmware/mcu/feed.h"
#include "tests/firmware/mcu/master.h"
#include "tests/support/piece_text.h"
#include "tests/support/rtu_frame.h"

#define PLAY_PAUSE_NS 20000000
#define PLAY_BYTE_NS  100000 /* of the line */
#define PLAY_AWAIT_S  20     /* for a state, and for an axis at its place */
#define PLAY_AHEAD    100    /* ticks, of the start */
#define PLAY_STARTS   5
#define PLAY_LOGS     5 /* looks at the log, until it has what is asked for */
#define PLAY_BATCH    8 /* pieces between two looks at the log */

struct play {
    struct master master;
    struct feed feed;
    uint32_t seen; /* entries of the log that were read one by one */
    uint64_t wrong;
    unsigned damaged, damaged_due; /* frames per eight pieces, eighths of one */
    unsigned damaged_sent;
    double settle;   /* > 0: with servo drives */
    double lag_most; /* of an actual position behind its set point */
    uint16_t state[MCU_STATE_WORDS];
};

static double play_now(void)
{
    struct timespec t;

    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

/* --- to the board --------------------------------------------------------- */

static unsigned play_draw(unsigned end)
{
    static uint32_t seed = 1;

    seed = seed * 1664525u + 1013904223u;
    return (unsigned)(((uint64_t)seed * end) >> 32);
}

static int play_disturb(struct play *play, const uint16_t piece[],
                        unsigned count)
{
    struct hal_modbus_request request = { .unit = 1,
                                          .function = HAL_MODBUS_WRITE_MANY,
                                          .address = MCU_AT_PIECE,
                                          .count = (uint16_t)count };

    memcpy(request.value, piece, count * sizeof *piece);
    play->damaged_due += play->damaged;
    for (; play->damaged_due >= 8; play->damaged_due -= 8) {
        uint8_t frame[DAMAGE_MAX];
        unsigned length = (unsigned)rtu_frame_put_request(&request, frame);
        length = damage_frame(frame, length, play_draw(DAMAGE_KINDS),
                              play_draw(length));
        if (write(modbus_get_socket(play->master.line), frame, length) < 0)
            return -1;
        play->damaged_sent++;
        nanosleep(&(struct timespec){ .tv_nsec = PLAY_PAUSE_NS +
                                                 length * PLAY_BYTE_NS },
                  NULL);
        modbus_flush(play->master.line);
    }
    return 0;
}

static int play_send(struct play *play, const uint16_t piece[], unsigned count)
{
    enum mcu_piece_result result;

    if (play_disturb(play, piece, count) < 0)
        return -1;
    if (master_piece(&play->master, piece, count, &result) < 0)
        return -1;
    if (result == MCU_PIECE_E_FULL)
        return 0;
    if (mcu_piece_exception(result) == 0)
        return 1;
    fprintf(stderr, "a piece was refused: %s\n", piece_text(result));
    return -1;
}

static int play_send_drives(struct play *play)
{
    uint16_t piece[MCU_PIECE_MAX];
    unsigned from = 0;

    for (int words; (words = feed_put_map(&play->feed, &from, piece)) > 0;)
        if (play_send(play, piece, (unsigned)words) < 1)
            return -1;
    for (unsigned i = 0; i < play->feed.axes; i++)
        if (play_send(play, piece, feed_put_drive(&play->feed, i, piece)) < 1)
            return -1;
    return 0;
}

static int play_set_up(struct play *play)
{
    if (play->settle > 0 && play_send_drives(play) < 0)
        return -1;
    for (unsigned i = 0; i < play->feed.axes; i++) {
        uint16_t piece[MCU_PIECE_MAX];
        if (play_send(play, piece, feed_put_setup(&play->feed, i, piece)) < 1)
            return -1;
    }
    return 0;
}

static int play_send_heads(struct play *play)
{
    for (unsigned i = 0; i < play->feed.axes; i++) {
        uint16_t piece[MCU_PIECE_MAX];
        if (play_send(play, piece, feed_put_head(&play->feed, i, piece)) < 1)
            return -1;
    }
    return 0;
}

/* The next piece of an axis: 1 sent, 0 nothing to send or no room. */
static int play_send_next(struct play *play, unsigned axis)
{
    uint16_t piece[MCU_PIECE_MAX];
    uint32_t count;
    const int words =
        feed_put_next(&play->feed, axis, MCU_PIECE_SEGMENTS, piece, &count);
    int sent = words;

    if (words > 0)
        sent = play_send(play, piece, (unsigned)words);
    if (sent == 1)
        play->feed.sent[axis] += count;
    return sent;
}

/* Up to so many pieces; how many went. */
static int play_stream(struct play *play, int most)
{
    int done = 0, round;

    do {
        round = 0;
        for (unsigned i = 0; i < play->feed.axes; i++) {
            const int sent = play_send_next(play, i);
            if (sent < 0)
                return -1;
            round += sent;
        }
        done += round;
    } while (round > 0 && done < most);
    return done;
}

/* --- from the board ------------------------------------------------------- */

static int play_look(struct play *play)
{
    return master_read(&play->master, MCU_AT_STATE, MCU_STATE_WORDS,
                       play->state);
}

static int play_await(struct play *play, enum controller_state state)
{
    const double end = play_now() + PLAY_AWAIT_S;

    do
        if (play_look(play) < 0 || play->state[MCU_STATE_STATE] == state)
            return play->state[MCU_STATE_STATE] == state ? 0 : -1;
    while (play_now() < end &&
           play->state[MCU_STATE_STATE] != CONTROLLER_FAULT);
    fprintf(stderr, "the board is %s, not %s\n",
            controller_state_text(
                (enum controller_state)play->state[MCU_STATE_STATE]),
            controller_state_text(state));
    return -1;
}

static void play_compare(struct play *play, uint32_t index,
                         const uint16_t *entry)
{
    const int64_t *want = play->feed.want.row[index];

    for (unsigned i = 0; i <= play->feed.axes; i++) {
        const int64_t got = (int64_t)mcu_words_get(entry + 4 * i, 4);
        if (index < play->feed.want.count && got == want[i])
            continue;
        if (play->wrong++ < 5)
            fprintf(stderr,
                    "entry %" PRIu32 ", %s: %" PRId64 ", not %" PRId64 "\n",
                    play->seen,
                    i == 0 ? "path" : feed_axis_name(&play->feed, i - 1), got,
                    index < play->feed.want.count ? want[i] : 0);
    }
    play->seen++;
}

/* The newest entries, as many as one request takes.  Where this machine was so busy
 * that the board has written over them since, those that are the newest now. */
static int play_read_log(struct play *play)
{
    const unsigned stride = 4 * (1 + play->feed.axes);
    uint32_t next, count;
    uint16_t value[HAL_MODBUS_READ_MAX];

    for (int tries = 1;; tries++) {
        next = (uint32_t)mcu_words_get(play->state + MCU_STATE_LOG_NEXT, 2);
        count = HAL_MODBUS_READ_MAX / stride;
        if (count > next)
            count = next;
        if (count == 0)
            return 0;
        if (master_log(&play->master, next - count, count * stride, value) >= 0)
            break;
        if (errno != EMBXILVAL || tries == PLAY_LOGS || play_look(play) < 0)
            return -1;
    }
    for (uint32_t i = 0; i < count; i++)
        play_compare(play, next - count + i, value + i * stride);
    return 0;
}

/* How far an axis is behind its set point. */
static int play_lag(struct play *play, unsigned axis, double *lag)
{
    uint16_t word[MCU_AXIS_TARGET + 4];

    if (master_read(&play->master, MCU_AT_AXIS + axis * MCU_AXIS_STEP,
                    MCU_AXIS_TARGET + 4, word) < 0)
        return -1;
    *lag = ldexp((double)(int64_t)(mcu_words_get(word + MCU_AXIS_TARGET, 4) -
                                   mcu_words_get(word, 4)),
                 -32);
    if (fabs(*lag) > play->lag_most)
        play->lag_most = fabs(*lag);
    return 0;
}

static int play_lags(struct play *play)
{
    double lag;

    for (unsigned i = 0; play->settle > 0 && i < play->feed.axes; i++)
        if (play_lag(play, i, &lag) < 0)
            return -1;
    return 0;
}

static int play_settle(struct play *play)
{
    const double end = play_now() + PLAY_AWAIT_S;
    double lag = 0;

    for (unsigned i = 0; play->settle > 0 && i < play->feed.axes; i++) {
        do
            if (play_lag(play, i, &lag) < 0)
                return -1;
        while (fabs(lag) > play->settle && play_now() < end);
        if (fabs(lag) > play->settle) {
            fprintf(stderr, "%s ends %g beside its place\n",
                    feed_axis_name(&play->feed, i), lag);
            return -1;
        }
    }
    return 0;
}

/* The board says it has what was sent. */
static int play_check_sent(struct play *play)
{
    for (unsigned i = 0; i < play->feed.axes; i++) {
        uint16_t word[2];
        if (master_read(&play->master,
                        MCU_AT_AXIS + i * MCU_AXIS_STEP + MCU_AXIS_NEXT, 2,
                        word) < 0)
            return -1;
        if (mcu_words_get(word, 2) == play->feed.sent[i])
            continue;
        fprintf(stderr, "the board has %" PRIu64 " segments, not %" PRIu32 "\n",
                mcu_words_get(word, 2), play->feed.sent[i]);
        return -1;
    }
    return 0;
}

/* Every set point that was sent, by the checksum that the board keeps. */
static int play_check_all(const struct play *play)
{
    const uint16_t *state = play->state;

    if (mcu_words_get(state + MCU_STATE_LOG_NEXT, 2) == play->feed.want.count &&
        mcu_words_get(state + MCU_STATE_LOG_CRC, 2) == feed_crc(&play->feed))
        return 0;
    fprintf(stderr, "the checksum of all set points is not that of the run\n");
    return -1;
}

/* In a tick that is said beforehand; when this machine was so busy that it has
 * passed, in a later one. */
static int play_start(struct play *play)
{
    const uint16_t *state = play->state;

    for (int i = 0; i < PLAY_STARTS; i++) {
        uint32_t at;
        if (play_look(play) < 0)
            return -1;
        at = (uint32_t)(mcu_words_get(state + MCU_STATE_TIME, 4) /
                        (uint64_t)play->feed.job.rig.period_ns) +
             PLAY_AHEAD;
        if (master_command_at(&play->master, MCU_COMMAND_START,
                              play->feed.move_id, at) < 0)
            fputs("the start was refused\n", stderr);
        do
            if (play_look(play) < 0)
                return -1;
        while (state[MCU_STATE_WAITING] != 0);
        if (state[MCU_STATE_RESULT] == MCU_RESULT_LATE)
            continue;
        if (play_look(play) == 0 && state[MCU_STATE_RESULT] == 0 &&
            mcu_words_get(state + MCU_STATE_BEGAN, 2) == at)
            return 0;
        break;
    }
    fprintf(stderr, "it did not begin in its tick\n");
    return -1;
}

static int play_run(struct play *play)
{
    if (play_set_up(play) < 0 || play_send_heads(play) < 0 ||
        play_stream(play, INT32_MAX) < 0 || play_check_sent(play) < 0 ||
        master_command(&play->master, MCU_COMMAND_ENABLE, 0) < 0 ||
        play_await(play, CONTROLLER_READY) < 0 || play_start(play) < 0)
        return -1;
    fputs("started\n", stderr);
    do {
        nanosleep(&(struct timespec){ .tv_nsec = PLAY_PAUSE_NS }, NULL);
        if (play_stream(play, PLAY_BATCH) < 0 || play_look(play) < 0 ||
            play_read_log(play) < 0 || play_lags(play) < 0)
            return -1;
    } while (play->state[MCU_STATE_STATE] == CONTROLLER_MOVING);
    if (play_await(play, CONTROLLER_READY) < 0 || play_read_log(play) < 0 ||
        play_check_sent(play) < 0 || play_check_all(play) < 0 ||
        play_settle(play) < 0)
        return -1;
    return master_command(&play->master, MCU_COMMAND_OFF, 0);
}

/* --- */

static void play_report(const struct play *play, double s)
{
    uint64_t segments = 0;

    for (unsigned i = 0; i < play->feed.axes; i++)
        segments += play->feed.sent[i];
    printf("%u axes, %" PRIu64 " segments, %" PRIu32
           " ticks equal by checksum, %" PRIu32 " of them read, %" PRIu64
           " values differ; %.1f s, %u damaged frames, %u requests repeated, "
           "%u words of stack never used, %" PRIu64 " ticks lost\n",
           play->feed.axes, segments, play->feed.want.count, play->seen,
           play->wrong, s, play->damaged_sent, play->master.repeated,
           play->state[MCU_STATE_STACK],
           mcu_words_get(play->state + MCU_STATE_LOST, 2));
    if (play->settle > 0)
        printf("servo drives: at most %.4g behind their set points, at the end "
               "within %g\n",
               play->lag_most, play->settle);
}

/* Its fault and, of an axis, why. */
static void play_say_fault(struct play *play)
{
    const unsigned axis = play->state[MCU_STATE_FAULT_AXIS];
    char why[2 * MCU_WHY_WORDS + 1] = "";
    uint16_t word[MCU_WHY_WORDS];

    if (axis < play->feed.axes &&
        master_read(&play->master, MCU_AT_WHY + axis * MCU_AXIS_STEP,
                    MCU_WHY_WORDS, word) == 0)
        for (unsigned i = 0; i < 2 * MCU_WHY_WORDS; i++)
            why[i] = (char)(word[i / 2] >> (i % 2 == 0 ? 8 : 0));
    fprintf(stderr, "the board is %s: %s%s%s%s%s\n",
            controller_state_text(
                (enum controller_state)play->state[MCU_STATE_STATE]),
            axis < play->feed.axes ? feed_axis_name(&play->feed, axis) : "",
            axis < play->feed.axes ? ": " : "",
            controller_fault_text(
                (enum controller_fault)play->state[MCU_STATE_FAULT]),
            why[0] != '\0' ? ", " : "", why);
}

int main(int argc, char *argv[])
{
    static struct play play;
    double begin;
    int err, status = 0;

    if (argc < 5 || argc > 7) {
        fputs("usage: play DEVICE RIG MOVE.slt TELEMETRY.csv [DAMAGED "
              "[SETTLE]]\n",
              stderr);
        return 2;
    }
    if (argc > 5)
        play.damaged = (unsigned)strtoul(argv[5], NULL, 10);
    if (argc > 6)
        play.settle = strtod(argv[6], NULL);
    if (feed_open(&play.feed, argv[2], argv[3], argv[4]) < 0 ||
        (play.settle > 0 && feed_use_drives(&play.feed) < 0) ||
        master_open(&play.master, argv[1]) < 0)
        return 2;
    begin = play_now();
    err = play_run(&play);
    status = err < 0 ? 1 : 0;
    if (err < 0 && play_look(&play) == 0) {
        play_say_fault(&play);
        status = play.state[MCU_STATE_STATE] == CONTROLLER_FAULT ? 3 : 1;
    }
    if (err == 0)
        play_report(&play, play_now() - begin);
    master_close(&play.master);
    feed_close(&play.feed);
    return err < 0 || play.wrong == 0 ? status : 1;
}
