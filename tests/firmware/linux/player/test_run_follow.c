/* tests/firmware/linux/player/test_run_follow.c - LTC, as a sound card would
 * hand it over: made by libltc's encoder, through a pipe, in real time. */
#include <fcntl.h>
#include <ltc.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "firmware/linux/player/run_follow.h"
#include "firmware/linux/player/run_start.h"
#include "hal/linux/clock.h"
#include "tests/support/check.h"

#define S       INT64_C(1000000000)
#define BUFFERS 90

static char directory[] = "/tmp/slew-follow-XXXXXX", path[64];
static struct clock_linux clock_of;
static struct hal_clock *ours;

static int up(void **state)
{
    (void)state;
    if (mkdtemp(directory) == NULL)
        return -1;
    snprintf(path, sizeof path, "%s/ltc", directory);
    ours = clock_linux_init(&clock_of);
    return mkfifo(path, 0600);
}

static int down(void **state)
{
    (void)state;
    (void)unlink(path);
    return rmdir(directory);
}

static void wait_until(int64_t t_ns)
{
    while (hal_clock_now_ns(ours) < t_ns)
        (void)nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
}

/* A second of it and some: frames from 01:00:00:00 on, 16 bits a sample.
 * Returns when the first was handed over. */
static int64_t play(double fps, struct run_follow *follow,
                    struct mailbox *mailbox)
{
    LTCEncoder *encoder = ltc_encoder_create(
        RUN_FOLLOW_SAMPLES, fps, fps > 29.0 ? LTC_TV_525_60 : LTC_TV_625_50, 0);
    SMPTETimecode time = { .hours = 1 };
    const int file = open(path, O_WRONLY);
    const int64_t begin_ns = hal_clock_now_ns(ours);
    static int16_t sample[RUN_FOLLOW_SAMPLES];
    int64_t samples = 0;
    assert_non_null(encoder);
    assert_true(file >= 0);
    ltc_encoder_set_timecode(encoder, &time);
    for (int i = 0; i < BUFFERS; i++) {
        ltcsnd_sample_t *buffer;
        ltc_encoder_encode_frame(encoder);
        const int count = ltc_encoder_get_bufferptr(encoder, &buffer, 1);
        for (int k = 0; k < count; k++)
            sample[k] = (int16_t)((buffer[k] - 128) * 200);
        samples += count;
        wait_until(begin_ns + samples * S / RUN_FOLLOW_SAMPLES);
        /* an odd number of bytes, then the rest */
        const ssize_t size = (ssize_t)((size_t)count * sizeof *sample);
        assert_int_equal(write(file, sample, 3), 3);
        assert_int_equal(write(file, (char *)sample + 3, (size_t)size - 3),
                         size - 3);
        ltc_encoder_inc_timecode(encoder);
        run_follow_poll(follow, mailbox);
    }
    (void)nanosleep(&(struct timespec){ .tv_nsec = 50000000 }, NULL);
    run_follow_poll(follow, mailbox);
    (void)close(file);
    ltc_encoder_free(encoder);
    return begin_ns;
}

static struct run_follow_config at_25(void)
{
    return (struct run_follow_config){
        .kind = RUN_FOLLOW_LTC,
        .path = path,
        .line = -1,
        .fps = { 25, 1 },
        .zero_frame = (3600 + 60) * 25, /* in a minute */
    };
}

static void frames_of_a_sound_card_are_known(void **state)
{
    const struct run_follow_config config = at_25();
    struct run_follow follow;
    struct mailbox mailbox;
    (void)state;
    mailbox_init(&mailbox);
    assert_int_equal(run_follow_begin(&follow, &config, ours, NULL), 0);
    assert_true(atomic_load(&follow.due_ns) == RUN_START_NEVER);
    const int64_t begin_ns = play(25, &follow, &mailbox);
    const int64_t due_ns = atomic_load(&follow.due_ns);
    if (follow.follow.state != FOLLOW_LOCKED || due_ns == RUN_START_NEVER)
        fail_msg("not locked: %d, %u marks", (int)follow.follow.state,
                 follow.follow.marks);
    /* each sample is known once its block has come, so a machine that is busy
     * makes it late, and what it makes of the rate counts sixty times */
    const double off_s = (double)(due_ns - begin_ns) / 1e9 - 60;
    if (off_s < -1.5 || off_s > 1.5)
        fail_msg("off by %.3f s in a minute", off_s);
    const double now_s =
        (double)(follow_s_ns(&follow.follow, begin_ns + 3 * S) - 3603 * S) /
        1e9;
    if (now_s < -0.08 || now_s > 0.04)
        fail_msg("off by %.3f s", now_s);
    run_follow_end(&follow);
}

static void another_frame_rate_is_said(void **state)
{
    struct run_follow_config config = at_25();
    struct run_follow follow;
    struct mailbox mailbox;
    (void)state;
    mailbox_init(&mailbox);
    assert_int_equal(run_follow_begin(&follow, &config, ours, NULL), 0);
    (void)play(30, &follow, &mailbox);
    assert_true(atomic_load(&follow.due_ns) == RUN_START_NEVER);
    assert_string_equal(follow.wrong, "the timecode has 30 frames/s, the move "
                                      "has 25: it is not followed");
    run_follow_end(&follow);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_of_a_sound_card_are_known),
        cmocka_unit_test(another_frame_rate_is_said),
    };
    return cmocka_run_group_tests_name("run_follow", tests, up, down);
}
