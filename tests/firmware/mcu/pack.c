/* tests/firmware/mcu/pack.c - a compiled move and what its run should be, for
 * tests/qemu/mcu_play.c.
 *
 *     pack RIG MOVE.slt TELEMETRY.csv >FILE */
#include <stdio.h>

#include "firmware/host/rig/rig.h"
#include "tests/firmware/mcu/feed.h"
#include "tests/firmware/mcu/play_file.h"

static uint32_t pack_put(const uint16_t *piece, unsigned count)
{
    const uint16_t head = (uint16_t)count;

    fwrite(&head, sizeof head, 1, stdout);
    fwrite(piece, sizeof *piece, count, stdout);
    return (uint32_t)((1 + count) * sizeof *piece);
}

/* Bytes written; 0: an error, said on stderr. */
static uint32_t pack_axis(struct feed *feed, unsigned axis)
{
    uint16_t piece[MCU_PIECE_MAX];
    unsigned length = feed_put_setup(feed, axis, piece);
    uint32_t bytes = pack_put(piece, length), count;
    int words;

    length = feed_put_head(feed, axis, piece);
    bytes += pack_put(piece, length);
    while ((words = feed_put_next(feed, axis, 1, piece, &count)) > 0) {
        bytes += pack_put(piece, (unsigned)words);
        feed->sent[axis] += count;
    }
    return words < 0 ? 0 : bytes + pack_put(piece, 0);
}

static int pack(struct feed *feed)
{
    struct play_file head = { .magic = PLAY_FILE_MAGIC,
                              .axes = feed->axes,
                              .period_ns = (uint32_t)feed->job.rig.period_ns,
                              .move_id = feed->move_id,
                              .ticks = feed->want.count,
                              .crc = feed_crc(feed) };
    uint32_t at = sizeof head;

    if (fseek(stdout, sizeof head, SEEK_SET) != 0)
        return -1;
    for (unsigned i = 0; i < feed->axes; i++) {
        const uint32_t bytes = pack_axis(feed, i);
        if (bytes == 0)
            return -1;
        head.begin[i] = at;
        at += bytes;
    }
    rewind(stdout);
    fwrite(&head, sizeof head, 1, stdout);
    return fflush(stdout);
}

int main(int argc, char *argv[])
{
    static struct feed feed;
    int err;

    if (argc != 4) {
        fputs("usage: pack RIG MOVE.slt TELEMETRY.csv >FILE\n", stderr);
        return 2;
    }
    if (feed_open(&feed, argv[1], argv[2], argv[3]) < 0)
        return 2;
    err = pack(&feed);
    feed_close(&feed);
    return err < 0 ? 1 : 0;
}
