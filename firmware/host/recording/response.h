/* firmware/host/recording/response.h - a recorded step response: times and one
 * measured column of a CSV file. */
#ifndef FIRMWARE_HOST_RECORDING_RESPONSE_H
#define FIRMWARE_HOST_RECORDING_RESPONSE_H

#include <stdint.h>

#include "firmware/host/base/files.h"

#define RESPONSE_MESSAGE_MAX 448
#define RESPONSE_BYTES_MAX   (32u << 20)
#define RESPONSE_COLUMNS_MAX 256

struct response {
    double *t_s, *x; /* on the heap */
    uint32_t rows;
};

/* Rows of numbers, separated by commas, semicolons, tabs or blanks, in double quotes or
 * not; lines that
 * are empty or begin with # do not count, and the first may be a header.  The
 * first column is the time, in s, or as the header's name ends: _ms, _us, _ns.
 * `column` names the measured one by its header; NULL: the second.  0, or -1 with
 * one sentence.  response_free in either case. */
int response_read(const struct files *files, const char *path,
                  const char *column, struct response *response,
                  char message[RESPONSE_MESSAGE_MAX]);
void response_free(struct response *response);

#endif
