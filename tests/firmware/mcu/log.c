/* tests/firmware/mcu/log.c - the log of a board as CSV, and its state.
 *
 *     log DEVICE
 *
 * A line per tick of the last move: path time in ns, then the set point of each
 * axis in 2^-32 of its unit; last a line "state STATE silent 0|1". */
#include <inttypes.h>
#include <stdio.h>

#include "tests/firmware/mcu/master.h"

static int log_print(struct master *master, const uint16_t *state)
{
    const unsigned stride = 4 * (1 + (unsigned)state[MCU_STATE_AXES]);
    const unsigned most = HAL_MODBUS_READ_MAX / stride;
    const uint32_t next =
        (uint32_t)mcu_words_get(state + MCU_STATE_LOG_NEXT, 2);
    uint16_t value[HAL_MODBUS_READ_MAX];

    for (uint32_t at = (uint32_t)mcu_words_get(state + MCU_STATE_LOG_FIRST, 2);
         at < next;) {
        const unsigned count = next - at < most ? next - at : most;
        if (master_log(master, at, count * stride, value) < 0)
            return -1;
        for (unsigned i = 0; i < count * stride; i += 4)
            printf("%" PRId64 "%c", (int64_t)mcu_words_get(value + i, 4),
                   (i + 4) % stride == 0 ? '\n' : ',');
        at += count;
    }
    return 0;
}

int main(int argc, char *argv[])
{
    uint16_t state[MCU_STATE_WORDS];
    struct master master;
    int err;

    if (argc != 2) {
        fputs("usage: log DEVICE\n", stderr);
        return 2;
    }
    err = master_open(&master, argv[1]);
    if (err == 0)
        err = master_read(&master, MCU_AT_STATE, MCU_STATE_WORDS, state);
    if (err == 0)
        err = log_print(&master, state);
    if (err == 0)
        printf("state %u silent %u\n", state[MCU_STATE_STATE],
               state[MCU_STATE_SILENT]);
    master_close(&master);
    return err < 0 ? 1 : 0;
}
