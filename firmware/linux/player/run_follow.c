/* firmware/linux/player/run_follow.c - see run_follow.h. */
#include "firmware/linux/player/run_follow.h"

#include <errno.h>
#include <fcntl.h>
#include <ltc.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "firmware/host/base/number.h"
#include "firmware/host/base/timecode.h"
#include "firmware/linux/player/run_start.h"
#include "motion/core/fixed.h"

#define FOLLOW_S         INT64_C(1000000000)
#define FOLLOW_LOST_NS   (FOLLOW_S / 4)  /* without a mark */
#define FOLLOW_FAR_NS    (FOLLOW_S / 10) /* a mark that is further off */
#define FOLLOW_BEHIND_NS (FOLLOW_S / 2)  /* what is more is not caught up */
#define FOLLOW_EVERY_NS  (FOLLOW_S / 10) /* between two changes of speed */
#define FOLLOW_SETTLE_NS (4 * FOLLOW_S)  /* before figures count */
#define FOLLOW_LEAST_Q30 (FOLLOW_ONE_Q30 / 200000) /* 5 ppm */
#define FOLLOW_DRIFT     2000 /* of two clocks, at most: 1/2000 */
#define FOLLOW_WAIT_MS   50
#define FOLLOW_BUFFER    4096
#define FOLLOW_QUEUE     32 /* frames of LTC in one read */

static int64_t follow_frame_ns(const struct run_follow *self, int64_t frames,
                               int64_t parts)
{
    const struct units_fps *fps = &self->config.fps;
    int64_t ns = 0;
    (void)motion_fixed_muldiv(frames, FOLLOW_S * (int64_t)fps->den,
                              parts * (int64_t)fps->num, &ns);
    return ns;
}

static unsigned follow_whole_fps(const struct run_follow *self)
{
    const struct units_fps *fps = &self->config.fps;
    return (unsigned)((fps->num + fps->den - 1) / fps->den);
}

/* --- timecode, in the thread that reads --- */

static void follow_wrong_fps(struct run_follow *self, unsigned fps)
{
    snprintf(self->wrong, sizeof self->wrong,
             "the timecode has %u frames/s, the move has %u: it is not "
             "followed",
             fps, follow_whole_fps(self));
}

static void follow_take_mtc(struct run_follow *self, const uint8_t *bytes,
                            size_t count, int64_t now_ns)
{
    struct mtc_mark mark;
    for (size_t i = 0; i < count; i++) {
        if (!mtc_take(&self->mtc, bytes[i], &mark))
            continue;
        if (mark.fps != follow_whole_fps(self))
            follow_wrong_fps(self, mark.fps);
        else
            follow_mark(&self->follow,
                        follow_frame_ns(self, (int64_t)mark.quarters, 4),
                        now_ns);
    }
}

static int64_t follow_samples_ns(int64_t samples)
{
    return samples * FOLLOW_S / RUN_FOLLOW_SAMPLES;
}

/* What came is late by turns, and never early: the earliest counts, as far as
 * the two clocks do not drift apart. */
static void follow_samples(struct run_follow *self, size_t count,
                           int64_t now_ns)
{
    const bool first = self->samples == 0;
    self->samples += (int64_t)count;
    const int64_t base_ns = now_ns - follow_samples_ns(self->samples);
    const int64_t drift_ns = (now_ns - self->base_seen_ns) / FOLLOW_DRIFT;
    self->base_seen_ns = now_ns;
    if (first || base_ns < self->base_ns + drift_ns)
        self->base_ns = base_ns;
    else
        self->base_ns += drift_ns;
}

static void follow_take_frame(struct run_follow *self, const LTCFrameExt *frame)
{
    const int64_t long_ns =
        (frame->off_end - frame->off_start + 1) * FOLLOW_S / RUN_FOLLOW_SAMPLES;
    const int64_t frame_ns = follow_frame_ns(self, 1, 1);
    const bool drop = frame->ltc.dfbit != 0;
    LTCFrame ltc = frame->ltc;
    SMPTETimecode time;
    uint64_t frames;
    if (frame->reverse)
        return;
    if (long_ns < frame_ns - frame_ns / 50 ||
        long_ns > frame_ns + frame_ns / 50) {
        follow_wrong_fps(self, (unsigned)((FOLLOW_S + long_ns / 2) / long_ns));
        return;
    }
    ltc_frame_to_time(&time, &ltc, 0);
    if (!timecode_count(time.hours, time.mins, time.secs, time.frame,
                        follow_whole_fps(self), drop, &frames))
        return;
    follow_mark(&self->follow, follow_frame_ns(self, (int64_t)frames, 1),
                self->base_ns + follow_samples_ns(frame->off_start));
}

static void follow_take_ltc(struct run_follow *self, int16_t *samples,
                            size_t count, int64_t now_ns)
{
    LTCFrameExt frame;
    ltc_decoder_write_s16(self->ltc, samples, count, self->samples);
    follow_samples(self, count, now_ns);
    while (ltc_decoder_read(self->ltc, &frame) > 0)
        follow_take_frame(self, &frame);
}

/* An odd byte of a sample waits at the beginning for the next read. */
static size_t follow_take(struct run_follow *self, void *buffer, size_t size,
                          int64_t now_ns)
{
    pthread_mutex_lock(&self->lock);
    if (self->config.kind == RUN_FOLLOW_MTC)
        follow_take_mtc(self, buffer, size, now_ns);
    else
        follow_take_ltc(self, buffer, size / 2, now_ns);
    pthread_mutex_unlock(&self->lock);
    return self->config.kind == RUN_FOLLOW_LTC ? size % 2 : 0;
}

/* Nobody writes to a pipe yet, or any more. */
static void follow_pause(void)
{
    const struct timespec pause = { .tv_nsec = FOLLOW_WAIT_MS * 1000000L };
    (void)nanosleep(&pause, NULL);
}

static void *follow_read(void *context)
{
    struct run_follow *self = context;
    union {
        uint8_t byte[FOLLOW_BUFFER];
        int16_t sample[FOLLOW_BUFFER / 2];
    } buffer;
    size_t kept = 0;
    while (!atomic_load(&self->ends)) {
        struct pollfd ready = { .fd = self->file, .events = POLLIN };
        if (poll(&ready, 1, FOLLOW_WAIT_MS) <= 0)
            continue;
        const ssize_t got =
            read(self->file, buffer.byte + kept, sizeof buffer.byte - kept);
        const int64_t now_ns = hal_clock_now_ns(self->clock);
        if (got <= 0) {
            follow_pause();
            continue;
        }
        const size_t size = kept + (size_t)got;
        kept = follow_take(self, buffer.byte, size, now_ns);
        if (kept > 0)
            buffer.byte[0] = buffer.byte[size - 1];
    }
    return NULL;
}

/* --- up and down --- */

const char *run_follow_clock(struct run_follow_config *config,
                             const struct rig *rig, bool is_real,
                             const char *text)
{
    config->kind = RUN_FOLLOW_LINE;
    config->path = NULL;
    config->line = -1;
    if (strncmp(text, "ltc:", 4) == 0 || strncmp(text, "mtc:", 4) == 0) {
        config->kind = text[0] == 'l' ? RUN_FOLLOW_LTC : RUN_FOLLOW_MTC;
        config->path = text + 4;
        return NULL;
    }
    for (uint32_t i = 0; i < rig->line_count; i++)
        if (rig->line[i].kind == RIG_LINE_FRAME &&
            strcmp(rig->line[i].name, text) == 0)
            config->line = (int)i;
    if (config->line < 0)
        return "is no clock, expected ltc:FILE, mtc:FILE, or the name of a "
               "line "
               "of this rig of kind frame";
    return !is_real && rig->line[config->line].sim_every_ns == 0
               ? "is a simulated line without pulses, expected sim: TIME in "
                 "the "
                 "rig, or --real"
               : NULL;
}

static int follow_open(struct run_follow *self)
{
    self->file = self->config.is_open ? self->config.file
                                      : open(self->config.path,
                                             O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (self->file < 0)
        return errno;
    if (self->config.kind == RUN_FOLLOW_LTC)
        self->ltc = ltc_decoder_create(
            RUN_FOLLOW_SAMPLES / (int)follow_whole_fps(self), FOLLOW_QUEUE);
    const int err = pthread_create(&self->thread, NULL, follow_read, self);
    self->runs = err == 0;
    return err;
}

int run_follow_begin(struct run_follow *self,
                     const struct run_follow_config *config,
                     struct hal_clock *clock, struct hal_gpio *gpio)
{
    *self = (struct run_follow){ .config = *config,
                                 .clock = clock,
                                 .gpio = gpio,
                                 .file = -1,
                                 .sent_q30 = FOLLOW_ONE_Q30 };
    atomic_init(&self->due_ns, RUN_START_NEVER);
    follow_init(&self->follow, FOLLOW_LOST_NS, FOLLOW_FAR_NS,
                RUN_FOLLOW_SPAN_Q30);
    self->zero_ns = follow_frame_ns(self, config->zero_frame, 1);
    (void)pthread_mutex_init(&self->lock, NULL);
    const int err = config->path == NULL ? 0 : follow_open(self);
    if (err != 0)
        run_follow_end(self);
    return err;
}

void run_follow_end(struct run_follow *self)
{
    if (self->config.kind == RUN_FOLLOW_NONE)
        return;
    atomic_store(&self->ends, true);
    if (self->runs)
        (void)pthread_join(self->thread, NULL);
    self->runs = false;
    if (self->file >= 0)
        (void)close(self->file);
    self->file = -1;
    if (self->ltc != NULL)
        (void)ltc_decoder_free(self->ltc);
    self->ltc = NULL;
    (void)pthread_mutex_destroy(&self->lock);
    self->config.kind = RUN_FOLLOW_NONE;
}

/* --- the tick --- */

void run_follow_tick(struct run_follow *self)
{
    struct hal_gpio_event event;
    self->is_pulse = false;
    if (self->gpio == NULL || hal_gpio_event(self->gpio, &event) != 1 ||
        !event.active)
        return;
    const uint32_t put = atomic_load(&self->put);
    atomic_store(&self->pulse_ns[put % RUN_FOLLOW_PULSES], event.t_ns);
    atomic_store(&self->put, put + 1);
    self->is_pulse = true;
}

int64_t run_follow_due_ns(struct run_follow *self, int64_t now_ns,
                          int64_t ready_ns, int64_t period_ns)
{
    if (self->gpio != NULL) {
        if (now_ns < ready_ns || !self->is_pulse)
            return RUN_START_NEVER;
        atomic_store(&self->start, atomic_load(&self->put));
        return now_ns;
    }
    const int64_t due_ns = atomic_load(&self->due_ns);
    if (due_ns == RUN_START_NEVER || due_ns <= now_ns)
        return due_ns;
    return now_ns + (due_ns - now_ns + period_ns - 1) / period_ns * period_ns;
}

/* --- who looks on --- */

static void follow_pulse(struct run_follow *self, int64_t t_ns)
{
    const int64_t frame_ns = follow_frame_ns(self, 1, 1);
    const int64_t since_ns = t_ns - self->last_ns;
    int64_t frames = (since_ns + frame_ns / 2) / frame_ns;
    if (self->taken == 1 || frames > INT32_MAX)
        frames = 1;
    if (frames > 0) { /* else a pulse twice */
        self->frame += frames;
        self->last_ns = t_ns;
        follow_mark(&self->follow, follow_frame_ns(self, self->frame, 1), t_ns);
    }
    if (self->taken == atomic_load(&self->start))
        self->zero_ns =
            follow_frame_ns(self, self->frame, 1) - self->config.from_ns;
}

static void follow_pulses(struct run_follow *self)
{
    const uint32_t put = atomic_load(&self->put);
    if (put - self->taken > RUN_FOLLOW_PULSES)
        self->taken = put - RUN_FOLLOW_PULSES;
    while (self->taken != put) {
        const int64_t t_ns =
            atomic_load(&self->pulse_ns[self->taken % RUN_FOLLOW_PULSES]);
        self->taken++;
        follow_pulse(self, t_ns);
    }
}

void run_follow_take(struct run_follow *self, bool is_moving, int64_t s_ns_q12,
                     int64_t now_ns)
{
    if (is_moving && !self->is_moving)
        self->moving_ns = now_ns;
    self->is_moving = is_moving;
    self->s_ns = s_ns_q12 / MOTION_FIXED_NS_Q12;
    self->t_ns = now_ns;
}

static void follow_say(const struct run_follow *self, const char *sentence)
{
    if (self->config.say != NULL)
        self->config.say(self->config.context, sentence);
    else
        fprintf(stderr, "\r\033[K%s\n", sentence);
}

/* What is not steered any more is held: it would go on by itself. */
static bool follow_hold(struct run_follow *self, struct mailbox *mailbox)
{
    const bool lost = self->follow.state == FOLLOW_LOST;
    if (self->follow.state == self->said)
        return false;
    self->said = self->follow.state;
    if ((!lost && self->follow.state != FOLLOW_JUMPED) || !self->is_moving)
        return false;
    const int err = mailbox_put(mailbox, MAILBOX_HOLD, 0);
    follow_say(self, lost ? "the clock that is followed is lost: the move is "
                            "held"
                          : "the clock that is followed has jumped: the move "
                            "is held");
    return err == MOTION_OK;
}

static void follow_count(struct run_follow *self, int64_t behind_ns)
{
    if (self->t_ns - self->moving_ns < FOLLOW_SETTLE_NS)
        return;
    const int64_t off_ns = behind_ns < 0 ? -behind_ns : behind_ns;
    if (!self->any || off_ns > self->worst_ns)
        self->worst_ns = off_ns;
    if (!self->any || self->sent_q30 < self->least_q30)
        self->least_q30 = self->sent_q30;
    if (!self->any || self->sent_q30 > self->most_q30)
        self->most_q30 = self->sent_q30;
    self->any = true;
}

static bool follow_steer(struct run_follow *self, struct mailbox *mailbox)
{
    const int64_t theirs_ns = self->zero_ns + self->s_ns;
    const int64_t behind_ns =
        follow_s_ns(&self->follow, self->t_ns) - theirs_ns;
    if (behind_ns > FOLLOW_BEHIND_NS || behind_ns < -FOLLOW_BEHIND_NS) {
        if (!self->said_far)
            follow_say(self,
                       "the move is more than half a second from the clock "
                       "that it follows: that is not caught up");
        self->said_far = true;
        return false;
    }
    self->said_far = false;
    follow_count(self, behind_ns);
    const int64_t rate_q30 =
        follow_rate_q30(&self->follow, theirs_ns, self->t_ns);
    const int64_t more_q30 = rate_q30 - self->sent_q30;
    if ((more_q30 < FOLLOW_LEAST_Q30 && more_q30 > -FOLLOW_LEAST_Q30) ||
        mailbox_put(mailbox, MAILBOX_OVERRIDE, rate_q30) != MOTION_OK)
        return false;
    self->sent_q30 = rate_q30;
    return true;
}

/* What is lost before the start starts nothing. */
static int64_t follow_due_ns(const struct run_follow *self)
{
    return self->follow.state == FOLLOW_LOCKED
               ? follow_t_ns(&self->follow,
                             self->zero_ns + self->config.from_ns)
               : RUN_START_NEVER;
}

bool run_follow_poll(struct run_follow *self, struct mailbox *mailbox)
{
    const int64_t now_ns = hal_clock_now_ns(self->clock);
    bool put;
    pthread_mutex_lock(&self->lock);
    follow_pulses(self);
    follow_look(&self->follow, now_ns);
    if (self->wrong[0] != '\0' && !self->said_wrong) {
        follow_say(self, self->wrong);
        self->said_wrong = true;
    }
    if (self->gpio == NULL)
        atomic_store(&self->due_ns, follow_due_ns(self));
    put = follow_hold(self, mailbox);
    if (self->is_moving && self->follow.state == FOLLOW_LOCKED &&
        now_ns - self->looked_ns >= FOLLOW_EVERY_NS) {
        self->looked_ns = now_ns;
        put |= follow_steer(self, mailbox);
    }
    pthread_mutex_unlock(&self->lock);
    return put;
}

const char *run_follow_report(const struct run_follow *self,
                              char text[RUN_FOLLOW_TEXT])
{
    text[0] = '\0';
    if (self->any)
        snprintf(text, RUN_FOLLOW_TEXT,
                 "followed to %.3f ms, at %.4f to %.4f %% of its speed",
                 (double)self->worst_ns / 1e6,
                 100 * number_double(self->least_q30, 30),
                 100 * number_double(self->most_q30, 30));
    return text;
}
