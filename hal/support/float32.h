/* hal/support/float32.h - IEEE 754 single numbers on a wire, without floating
 * point.
 *
 * Some drives speak in floats; a microcontroller without them, and the tick,
 * have fixed point.  Both ways round once, to nearest; no division. */
#ifndef HAL_SUPPORT_FLOAT32_H
#define HAL_SUPPORT_FLOAT32_H

#include <stdbool.h>
#include <stdint.h>

#define HAL_FLOAT32_NAN UINT32_C(0x7FC00000)

/* Neither infinite nor NaN. */
bool hal_float32_is_finite(uint32_t bits);

/* value / 2^fraction_bits, fraction_bits 0..63; ties to even, as a processor
 * does. */
uint32_t hal_float32_from_fixed(int64_t value, unsigned fraction_bits);

/* Times 2^fraction_bits, 0..63; ties away from zero, held at the ends of int64.
 * Infinity is such an end, NaN is 0. */
int64_t hal_float32_to_fixed(uint32_t bits, unsigned fraction_bits);

/* Little endian, as all who use it here send it. */
void hal_float32_put(uint8_t at[4], uint32_t bits);
uint32_t hal_float32_get(const uint8_t at[4]);

#endif
