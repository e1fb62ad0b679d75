/* tests/support/fake_can.h - a CAN port played by the test: frames in, frames
 * out.
 *
 * Frames are written as candump does: "601#2F60600008000000". */
#ifndef TESTS_SUPPORT_FAKE_CAN_H
#define TESTS_SUPPORT_FAKE_CAN_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/check.h"

#include "hal/can.h"
#include "hal/support/container_of.h"

#define FAKE_CAN_FRAMES 4096
#define FAKE_CAN_TEXT   (16 + 2 * HAL_CAN_FD_DATA_MAX)

struct fake_can {
    struct hal_can can;
    struct hal_can_frame in[FAKE_CAN_FRAMES], out[FAKE_CAN_FRAMES];
    unsigned in_at, in_count; /* read, written */
    unsigned out_at, out_count;
    int refuse; /* this many sends from now on are refused */
    int recv_err;
    int state;
};

static int fake_can_send(struct hal_can *can, const struct hal_can_frame *frame)
{
    struct fake_can *fake = CONTAINER_OF(can, struct fake_can, can);

    if (fake->refuse > 0) {
        fake->refuse--;
        return MOTION_E_FULL;
    }
    assert_true(fake->out_count < FAKE_CAN_FRAMES);
    assert_true(hal_can_is_legal(frame, true));
    fake->out[fake->out_count++] = *frame;
    return MOTION_OK;
}

static int fake_can_flush(struct hal_can *can)
{
    (void)can;
    return MOTION_OK;
}

static int fake_can_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    struct fake_can *fake = CONTAINER_OF(can, struct fake_can, can);

    if (fake->recv_err != 0)
        return fake->recv_err;
    if (fake->in_at == fake->in_count)
        return 0;
    *frame = fake->in[fake->in_at++];
    return 1;
}

static int fake_can_state(struct hal_can *can)
{
    return CONTAINER_OF(can, struct fake_can, can)->state;
}

static void fake_can_stats(struct hal_can *can, struct hal_can_stats *stats)
{
    (void)can;
    memset(stats, 0, sizeof *stats);
}

static const struct hal_can_ops fake_can_ops = {
    .send = fake_can_send,
    .flush = fake_can_flush,
    .recv = fake_can_recv,
    .state = fake_can_state,
    .stats = fake_can_stats,
};

static inline void fake_can_init(struct fake_can *fake)
{
    memset(fake, 0, sizeof *fake);
    fake->can.ops = &fake_can_ops;
}

/* Forget what went by, so that a long run fits. */
static inline void fake_can_wipe(struct fake_can *fake)
{
    fake->in_at = fake->in_count = fake->out_at = fake->out_count = 0;
}

static inline void fake_can_put_frame(struct fake_can *fake,
                                      const struct hal_can_frame *frame)
{
    assert_true(fake->in_count < FAKE_CAN_FRAMES);
    fake->in[fake->in_count++] = *frame;
}

static inline struct hal_can_frame fake_can_parse(const char *text)
{
    struct hal_can_frame frame = { 0 };
    const char *data = strchr(text, '#');

    assert_non_null(data);
    frame.id = (uint32_t)strtoul(text, NULL, 16);
    frame.remote = strcmp(data, "#R") == 0;
    for (data++; !frame.remote && *data != '\0'; data += 2) {
        const char pair[3] = { data[0], data[1], '\0' };

        assert_true(frame.len < HAL_CAN_FD_DATA_MAX);
        frame.data[frame.len++] = (uint8_t)strtoul(pair, NULL, 16);
    }
    frame.fd = frame.len > HAL_CAN_DATA_MAX;
    frame.extended = frame.id > 0x7FF;
    return frame;
}

/* To arrive at t_ns; 0: the time is not known. */
static inline void fake_can_put_at(struct fake_can *fake, const char *text,
                                   int64_t t_ns)
{
    struct hal_can_frame frame = fake_can_parse(text);

    frame.t_ns = t_ns;
    fake_can_put_frame(fake, &frame);
}

static inline void fake_can_put(struct fake_can *fake, const char *text)
{
    fake_can_put_at(fake, text, 0);
}

static inline void fake_can_print(const struct hal_can_frame *frame,
                                  char text[FAKE_CAN_TEXT])
{
    int at = snprintf(text, FAKE_CAN_TEXT, frame->remote ? "%03X#R" : "%03X#",
                      (unsigned)frame->id);

    for (unsigned i = 0; i < frame->len; i++)
        at += snprintf(text + at, FAKE_CAN_TEXT - (size_t)at, "%02X",
                       frame->data[i]);
}

/* The next frame that was sent must be this one; NULL: there is none. */
static inline void fake_can_expect_at(struct fake_can *fake, const char *want,
                                      const char *file, int line)
{
    char got[FAKE_CAN_TEXT] = "nothing";

    if (fake->out_at < fake->out_count)
        fake_can_print(&fake->out[fake->out_at++], got);
    if (strcmp(got, want != NULL ? want : "nothing") != 0) {
        print_error("%s:%d: sent %s, expected %s\n", file, line, got,
                    want != NULL ? want : "nothing");
        _fail(file, line);
    }
}
#define fake_can_expect(fake, want)                                            \
    fake_can_expect_at(fake, want, __FILE__, __LINE__)

#endif
