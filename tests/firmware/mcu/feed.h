/* tests/firmware/mcu/feed.h - a compiled move as pieces for a board, and what its
 * run on this machine has sent to the drives.
 *
 * The telemetry is that of `slew run RIG MOVE.slt`, whose twelve decimals tell
 * every Q32.32 from the next. */
#ifndef TESTS_FIRMWARE_MCU_FEED_H
#define TESTS_FIRMWARE_MCU_FEED_H

#include "firmware/host/job/job.h"
#include "hal/mcu/piece.h"

struct feed_rows {
    int64_t (*row)[1 + MCU_AXES_MAX]; /* path_ns, then the set points */
    uint32_t count, capacity;
};

struct feed {
    struct job job;
    unsigned axes;
    uint32_t move_id;
    uint32_t sent[MCU_AXES_MAX]; /* segments */
    struct feed_rows want;
    struct modbus_map map; /* of feed_use_drives, with the rig's line */
    struct mcu_servo servo[MCU_AXES_MAX];
    uint32_t drive_crc[MCU_AXES_MAX]; /* 0: a virtual drive */
};

/* 0, or -1 with a line on stderr. */
int feed_open(struct feed *feed, const char *rig, const char *move,
              const char *telemetry);
void feed_close(struct feed *feed);

/* The axes' servo drives, on the board's own line.  0, or -1 with a line on
 * stderr. */
int feed_use_drives(struct feed *feed);
/* The next piece of their map, from *from on; 0: all have been. */
int feed_put_map(const struct feed *feed, unsigned *from,
                 uint16_t piece[MCU_PIECE_MAX]);
unsigned feed_put_drive(struct feed *feed, unsigned axis,
                        uint16_t piece[MCU_PIECE_MAX]);

const char *feed_axis_name(const struct feed *feed, unsigned axis);
/* Registers of the piece. */
unsigned feed_put_setup(const struct feed *feed, unsigned axis,
                        uint16_t piece[MCU_PIECE_MAX]);
unsigned feed_put_head(const struct feed *feed, unsigned axis,
                       uint16_t piece[MCU_PIECE_MAX]);
/* The next piece of an axis, of at most `most` segments; *count: how many.  0:
 * all have been sent.  The caller adds to sent what was taken. */
int feed_put_next(const struct feed *feed, unsigned axis, unsigned most,
                  uint16_t piece[MCU_PIECE_MAX], uint32_t *count);

/* CRC-32 of all set points, as the board computes it of its log. */
uint32_t feed_crc(const struct feed *feed);

#endif
