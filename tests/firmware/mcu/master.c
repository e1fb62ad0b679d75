/* tests/firmware/mcu/master.c - see master.h. */
#include "tests/firmware/mcu/master.h"

#include <errno.h>
#include <stdio.h>
#include <time.h>

#define MASTER_TRIES      10
#define MASTER_TIMEOUT_US 999999
#define MASTER_BAUD       115200

/* An exception is an answer; anything else may be asked again. */
static bool master_is_answer(int done)
{
    return done >= 0 || (errno > MODBUS_ENOBASE &&
                         errno < MODBUS_ENOBASE + MODBUS_EXCEPTION_MAX);
}

static bool master_again(struct master *master, int done, unsigned tries)
{
    if (master_is_answer(done) || tries == MASTER_TRIES)
        return false;
    master->repeated++;
    modbus_flush(master->line);
    return true;
}

static int master_result(int done, const char *what)
{
    const int err = errno;

    if (done >= 0)
        return 0;
    fprintf(stderr, "%s: %s\n", what, modbus_strerror(err));
    errno = err;
    return -1;
}

int master_open(struct master *master, const char *device)
{
    uint16_t value[MCU_IDENTITY_WORDS];

    *master = (struct master){
        .line = modbus_new_rtu(device, MASTER_BAUD, 'N', 8, 1),
        .sequence = (uint16_t)(time(NULL) | 1),
    };
    if (master->line == NULL || modbus_set_slave(master->line, 1) < 0 ||
        modbus_connect(master->line) < 0)
        return master_result(-1, device);
    modbus_set_response_timeout(master->line, 0, MASTER_TIMEOUT_US);
    for (int i = 0; i < 3; i++)
        if (modbus_read_registers(master->line, MCU_AT_IDENTITY,
                                  MCU_IDENTITY_WORDS, value) > 0)
            break;
    if (master_read(master, MCU_AT_IDENTITY, MCU_IDENTITY_WORDS, value) < 0)
        return -1;
    if (value[0] == MCU_MAP_MAGIC && value[1] == MCU_MAP_VERSION)
        return 0;
    fprintf(stderr, "%s: this is no slew board with map %d\n", device,
            MCU_MAP_VERSION);
    return -1;
}

void master_close(struct master *master)
{
    if (master->line == NULL)
        return;
    modbus_close(master->line);
    modbus_free(master->line);
    master->line = NULL;
}

int master_read(struct master *master, unsigned address, unsigned count,
                uint16_t *value)
{
    int done;
    unsigned tries = 0;

    do
        done = modbus_read_registers(master->line, (int)address, (int)count,
                                     value);
    while (master_again(master, done, ++tries));
    return master_result(done, "reading registers");
}

static int master_write(struct master *master, unsigned address,
                        const uint16_t *value, unsigned count)
{
    int done;
    unsigned tries = 0;

    do
        done = modbus_write_registers(master->line, (int)address, (int)count,
                                      value);
    while (master_again(master, done, ++tries));
    return done;
}

static int master_order(struct master *master, enum mcu_command command,
                        uint32_t value, uint32_t at, unsigned words)
{
    uint16_t word[MCU_COMMAND_AT];

    master->sequence = (uint16_t)(master->sequence + 2); /* odd: never 0 */
    word[0] = master->sequence;
    word[1] = (uint16_t)command;
    mcu_words_put(word + 2, value, 2);
    mcu_words_put(word + 4, at, 2);
    if (master_write(master, MCU_AT_COMMAND, word, words) >= 0)
        return 0;
    if (master_read(master, MCU_AT_STATE + MCU_STATE_RESULT, 1, word) == 0)
        fprintf(stderr, "command %d was refused: %u\n", (int)command, word[0]);
    return -1;
}

int master_command(struct master *master, enum mcu_command command,
                   uint32_t value)
{
    return master_order(master, command, value, 0, MCU_COMMAND_WORDS);
}

int master_command_at(struct master *master, enum mcu_command command,
                      uint32_t value, uint32_t at)
{
    return master_order(master, command, value, at, MCU_COMMAND_AT);
}

int master_piece(struct master *master, const uint16_t piece[], unsigned count,
                 enum mcu_piece_result *result)
{
    uint16_t word = 0;

    *result = MCU_PIECE_TAKEN;
    if (master_write(master, MCU_AT_PIECE, piece, count) >= 0)
        return 0;
    if (errno < MODBUS_ENOBASE)
        return master_result(-1, "sending a piece");
    if (master_read(master, MCU_AT_STATE + MCU_STATE_PIECE, 1, &word) < 0)
        return -1;
    *result = (enum mcu_piece_result)word;
    return 0;
}

int master_log(struct master *master, uint32_t index, unsigned count,
               uint16_t *value)
{
    uint16_t word[2];
    int done;
    unsigned tries = 0;

    mcu_words_put(word, index, 2);
    do
        done = modbus_write_and_read_registers(master->line, MCU_AT_LOG_INDEX,
                                               2, word, MCU_AT_LOG, (int)count,
                                               value);
    while (master_again(master, done, ++tries));
    return master_result(done, "reading the log");
}
