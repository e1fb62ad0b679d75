/* tests/qemu/golden_wide.c - 128 and 192 bits: the same on every machine,
 * whichever instructions it makes them of.
 *
 * Like golden.c.  And on the machine itself what motion/core/fixed.h chooses is
 * compared with fixed_halves.h, which every machine has; the status is 1 where
 * the two differ. */
#include <stddef.h>

#include "motion/core/fixed.h"
#include "motion/number/wide.h"
#include "tests/qemu/golden_tools.h"

#define ROUNDS 20000

static uint32_t wrong;

/* Every length, and words of zeros and ones, where carries run through. */
static uint64_t golden_word(void)
{
    uint64_t r = golden_random(), word = golden_random() >> (r & 63);
    if (r >> 60 == 0)
        word = 0;
    if (r >> 59 & 1)
        word = ~word;
    return word;
}

static struct motion_u128 golden_u128(void)
{
    struct motion_u128 a;
    a.hi = golden_word();
    a.lo = golden_word();
    return a;
}

static struct wider golden_wider(void)
{
    struct wider a;
    a.hi = golden_word();
    a.mid = golden_word();
    a.lo = golden_word();
    return a;
}

static void golden_add_u128(struct motion_u128 a)
{
    golden_add((int64_t)a.hi);
    golden_add((int64_t)a.lo);
}

static void golden_add_wider(struct wider a)
{
    golden_add((int64_t)a.hi);
    golden_add((int64_t)a.mid);
    golden_add((int64_t)a.lo);
}

static void same(struct motion_u128 got, struct motion_u128 want)
{
    wrong += got.hi != want.hi || got.lo != want.lo;
    golden_add_u128(got);
}

static void same_bool(bool got, bool want)
{
    wrong += got != want;
    golden_add(got);
}

/* --- two words ------------------------------------------------------------ */

static void golden_pair(struct motion_u128 a, struct motion_u128 b)
{
    same(FIXED_BY(mul)(a.lo, b.lo), fixed_halves_mul(a.lo, b.lo));
    same(FIXED_BY(mul_add)(a.lo, b.lo, a.hi, b.hi),
         fixed_halves_mul_add(a.lo, b.lo, a.hi, b.hi));
    same(FIXED_BY(add)(a, b), fixed_halves_add(a, b));
    same(FIXED_BY(sub)(a, b), fixed_halves_sub(a, b));
    same_bool(FIXED_BY(is_less)(a, b), fixed_halves_is_less(a, b));
    same_bool(FIXED_BY(is_less_i128)(a, b), fixed_halves_is_less_i128(a, b));
}

static void golden_two(void)
{
    for (int i = 0; i < ROUNDS; i++) {
        struct motion_u128 a = golden_u128(), b = a;
        uint64_t r = golden_random();
        if (r % 4 != 0) /* else next to each other */
            b = golden_u128();
        golden_pair(a, b);
        b.lo += r >> 62;
        golden_pair(b, a);
        golden_pair(a, (struct motion_u128){ b.hi, a.lo });
    }
}

/* --- three words ---------------------------------------------------------- */

static void golden_three(void)
{
    for (int i = 0; i < ROUNDS / 4; i++) {
        struct wider a = golden_wider(), b = golden_wider();
        struct motion_u128 x = golden_u128();
        int64_t n = (int64_t)golden_word();
        unsigned bits = (unsigned)golden_below(128);
        golden_add_wider(wider_add(a, b));
        golden_add_wider(wider_sub(a, b));
        golden_add_wider(wider_abs(a));
        golden_add(wider_is_less(a, b));
        golden_add_wider(wider_mul(x, n & INT64_MAX));
        golden_add_wider(wider_shl(a, bits));
        golden_add_wider(wider_shr(a, bits));
        golden_add(wider_clz(wider_abs(a)));
        wider_add_mul(&a, n, &x);
        golden_add_wider(a);
        golden_add_u128(wide_shr(x, bits));
        golden_add_u128(wide_abs(x));
        wide_add_mul(&x, n, (int64_t)(b.lo >> 1));
        golden_add_u128(x);
    }
}

int main(void)
{
    golden_start(1);
    golden_two();
    golden_add(wrong);
    golden_report("wide", 0);
    golden_start(2);
    golden_three();
    golden_report("wider", 0);
    return wrong != 0;
}
