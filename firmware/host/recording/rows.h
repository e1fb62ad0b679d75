/* firmware/host/recording/rows.h - rows that are found whole when the program
 * is killed: handed to the system a buffer at a time and once per second of
 * their time, never a part of one. */
#ifndef FIRMWARE_HOST_RECORDING_ROWS_H
#define FIRMWARE_HOST_RECORDING_ROWS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#define ROWS_BUFFER 65536

struct rows {
    FILE *file; /* with a buffer of ROWS_BUFFER, else rows may be cut by it */
    size_t waiting;
    uint64_t rows_waiting, rows_lost; /* lost: not handed over, for an error */
    bool failed;
    int64_t handed_ns;
};

void rows_init(struct rows *rows, FILE *file);
/* `length` bytes, at most ROWS_BUFFER, of time t_ns.  Errors stay in the
 * file's error flag. */
void rows_put(struct rows *rows, const char *text, size_t length, int64_t t_ns);

/* Hand over what waits. */
void rows_end(struct rows *rows);

#endif
