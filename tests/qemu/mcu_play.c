/* tests/qemu/mcu_play.c - the board of firmware/mcu without a line, in its own
 * time: a move that lies in memory (tests/firmware/mcu/play_file.h) is uploaded
 * piece by piece, streamed through a window and played; the checksum of every
 * tick's set points is that of the run on a PC. */
#include "firmware/mcu/upload.h"
#include "tests/firmware/mcu/play_file.h"
#include "tests/qemu/start.h"
#include "tests/support/piece_text.h"

#define PLAY_WINDOW 32
#define PLAY_ENABLE 100 /* ticks until the axes are on */

extern const struct play_file play_file; /* where QEMU puts it: qemu.mk */

static struct motion_segment play_ring[MCU_AXES_MAX * 2 * PLAY_WINDOW];
static int64_t play_log[1 + MCU_AXES_MAX];
static struct mcu_unit_config play_config = { .ring = play_ring,
                                              .window = PLAY_WINDOW,
                                              .log = play_log,
                                              .log_words = 1 + MCU_AXES_MAX };
static struct mcu_unit play_unit;
static struct mcu_upload play_upload;
static const uint16_t *play_next[MCU_AXES_MAX];
static int64_t play_now_ns;

static uint32_t play_fail(const char *what, uint32_t value)
{
    start_print(what);
    start_print(": ");
    start_print_u32(value);
    start_print("\n");
    return 1;
}

static enum mcu_piece_result play_put(unsigned axis)
{
    const uint16_t *piece = play_next[axis];
    const enum mcu_piece_result result =
        mcu_upload_put(&play_upload, piece + 1, piece[0]);

    if (result == MCU_PIECE_TAKEN)
        play_next[axis] = piece + 1 + piece[0];
    return result;
}

/* A set-up or a head of every axis. */
static uint32_t play_put_all(void)
{
    for (unsigned i = 0; i < play_file.axes; i++) {
        const enum mcu_piece_result result = play_put(i);
        if (result != MCU_PIECE_TAKEN)
            return play_fail(piece_text(result), i);
    }
    return 0;
}

static uint32_t play_stream(void)
{
    for (unsigned i = 0; i < play_file.axes; i++)
        while (*play_next[i] != 0) {
            const enum mcu_piece_result result = play_put(i);
            if (result == MCU_PIECE_E_FULL)
                break;
            if (result != MCU_PIECE_TAKEN)
                return play_fail(piece_text(result), i);
        }
    return 0;
}

static void play_tick(void)
{
    play_now_ns += play_config.period_ns;
    mcu_unit_tick(&play_unit, play_now_ns);
}

static uint32_t play_start(void)
{
    const uint8_t *const file = (const uint8_t *)&play_file;

    if (play_file.magic != PLAY_FILE_MAGIC)
        return play_fail("there is no move", play_file.magic);
    for (unsigned i = 0; i < play_file.axes; i++)
        play_next[i] = (const uint16_t *)(file + play_file.begin[i]);
    play_config.period_ns = play_file.period_ns;
    mcu_unit_init(&play_unit, &play_config);
    mcu_upload_init(&play_upload, &play_unit);
    for (unsigned i = 0; i < 2; i++) /* again: what is there stays */
        if (play_put_all() != 0)
            return 1;
    if (play_stream() != 0)
        return 1;
    if (controller_enable(&play_unit.controller) < 0)
        return play_fail("not enabled", 0);
    for (unsigned i = 0; i < PLAY_ENABLE; i++)
        play_tick();
    if (!mcu_upload_has(&play_upload, play_file.move_id) ||
        mcu_unit_start(&play_unit) < 0)
        return play_fail("not started", play_upload.taken);
    return 0;
}

int main(void)
{
    if (play_start() != 0)
        return 1;
    while (mcu_unit_is_moving(&play_unit)) {
        play_tick();
        if (play_stream() != 0)
            return 1;
    }
    if (play_unit.controller.state != CONTROLLER_READY)
        return (int)play_fail("fault", play_unit.controller.fault.fault);
    if (play_unit.log.next != play_file.ticks)
        return (int)play_fail("not as many ticks", play_unit.log.next);
    if (play_unit.log.crc != play_file.crc)
        return (int)play_fail("another checksum", play_unit.log.crc);
    return 0;
}
