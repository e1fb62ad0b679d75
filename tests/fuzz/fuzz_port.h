/* tests/fuzz/fuzz_port.h - a CAN port that takes everything and hears the
 * input. */
#ifndef TESTS_FUZZ_FUZZ_PORT_H
#define TESTS_FUZZ_FUZZ_PORT_H

#include "hal/can.h"
#include "tests/fuzz/fuzz.h"

struct fuzz_port {
    struct hal_can can;
    bool fd;
    struct fuzz_bytes bytes;
    unsigned turn; /* frames until the next cycle */
};

void fuzz_port_init(struct fuzz_port *port);

#endif
