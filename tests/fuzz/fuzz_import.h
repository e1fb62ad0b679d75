/* tests/fuzz/fuzz_import.h - the moves of one other program; what is taken can
 * be written as move.yaml. */
#ifndef TESTS_FUZZ_FUZZ_IMPORT_H
#define TESTS_FUZZ_FUZZ_IMPORT_H

#include <stddef.h>
#include <stdint.h>

struct import_format;

int fuzz_import(const char *format, const uint8_t *data, size_t size);
int fuzz_import_with(const struct import_format *format, const uint8_t *data,
                     size_t size);

#endif
