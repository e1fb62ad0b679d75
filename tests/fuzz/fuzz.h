/* tests/fuzz/fuzz.h - what the fuzz targets share.
 *
 * One target per decoder: fuzz_NAME.c has LLVMFuzzerTestOneInput, which takes
 * any bytes, decodes them and states what must hold whatever they were.  It is
 * linked with libFuzzer (make fuzz) or with replay.c (make check). */
#ifndef TESTS_FUZZ_FUZZ_H
#define TESTS_FUZZ_FUZZ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/can.h"

/* Always 0. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* The name of a file in memory that holds these bytes, until the next call. */
const char *fuzz_file(const uint8_t *data, size_t size);

/* Ends the program with the sentence unless `holds`. */
void fuzz_claim(bool holds, const char *claim);

/* A message of a reader: one line about this file. */
void fuzz_claim_sentence(const char *path, const char *message);

/* Bytes of the input, one after the other; 0 when they are used up. */
struct fuzz_bytes {
    const uint8_t *at;
    size_t left;
};
uint8_t fuzz_u8(struct fuzz_bytes *bytes);
uint16_t fuzz_u16(struct fuzz_bytes *bytes); /* lower byte first */
/* As many as there are, at most `capacity`. */
size_t fuzz_take(struct fuzz_bytes *bytes, uint8_t *to, size_t capacity);
/* Id, length and flags, data. */
struct hal_can_frame fuzz_frame(struct fuzz_bytes *bytes);

#endif
