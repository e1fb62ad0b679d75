/* tests/hal/linux/modbus_bank.h - a Modbus device that is nothing but
 * registers: 0x0000 .. 0x00FF holding, input registers that are their inverse,
 * as many coils. */
#ifndef TESTS_HAL_LINUX_MODBUS_BANK_H
#define TESTS_HAL_LINUX_MODBUS_BANK_H

#include <string.h>

#include "hal/modbus/slave.h"

#define BANK_SIZE 256

struct modbus_bank {
    struct modbus_slave slave;
    uint16_t reg[BANK_SIZE];
    uint16_t coil[BANK_SIZE / 16];
    unsigned reads, writes;
};

/* Discrete inputs are the inverse of the coils. */
static inline void modbus_bank_get_bits(const struct modbus_bank *bank,
                                        bool inverse, unsigned at,
                                        unsigned count, uint16_t *value)
{
    memset(value, 0, (count + 15u) / 16 * sizeof *value);
    for (unsigned i = 0; i < count; i++)
        if ((bank->coil[(at + i) / 16] >> (at + i) % 16 & 1) != inverse)
            value[i / 16] = (uint16_t)(value[i / 16] | 1u << i % 16);
}

static inline uint8_t modbus_bank_get(struct modbus_slave *slave,
                                      enum modbus_space space, uint16_t address,
                                      uint16_t count, uint16_t *value)
{
    struct modbus_bank *bank = (struct modbus_bank *)(void *)slave;

    if (address + count > BANK_SIZE)
        return 2;
    if (space == MODBUS_COILS || space == MODBUS_DISCRETE) {
        modbus_bank_get_bits(bank, space == MODBUS_DISCRETE, address, count,
                             value);
        return 0;
    }
    for (unsigned i = 0; i < count; i++)
        value[i] = space == MODBUS_INPUT ? (uint16_t)~bank->reg[address + i]
                                         : bank->reg[address + i];
    bank->reads++;
    return 0;
}

static inline void modbus_bank_set_coil(struct modbus_bank *bank, unsigned at,
                                        bool on)
{
    const uint16_t bit = (uint16_t)(1u << at % 16);
    uint16_t *word = &bank->coil[at / 16];

    *word = (uint16_t)(on ? *word | bit : *word & ~bit);
}

static inline uint8_t modbus_bank_set(struct modbus_slave *slave,
                                      enum modbus_space space, uint16_t address,
                                      uint16_t count, const uint16_t *value)
{
    struct modbus_bank *bank = (struct modbus_bank *)(void *)slave;

    if (address + count > BANK_SIZE)
        return 2;
    for (unsigned i = 0; i < count; i++)
        if (space == MODBUS_COILS)
            modbus_bank_set_coil(bank, address + i,
                                 (value[i / 16] >> i % 16 & 1) != 0);
        else
            bank->reg[address + i] = value[i];
    bank->writes++;
    return 0;
}

static const struct modbus_slave_ops modbus_bank_ops = {
    .get = modbus_bank_get,
    .set = modbus_bank_set,
};

static inline void modbus_bank_init(struct modbus_bank *bank)
{
    memset(bank, 0, sizeof *bank);
    bank->slave.ops = &modbus_bank_ops;
    for (unsigned i = 0; i < BANK_SIZE; i++)
        bank->reg[i] = (uint16_t)(0x1000 + 3 * i);
}

#endif
