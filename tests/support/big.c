/* tests/support/big.c - see big.h. */
#include "tests/support/big.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

__extension__ typedef unsigned __int128 wide;

/* --- magnitudes ----------------------------------------------------------- */

static int trimmed(const uint64_t *limb, int count)
{
    while (count > 0 && limb[count - 1] == 0)
        count--;
    return count;
}

static void capacity_for(int count)
{
    if (count <= BIG_LIMBS)
        return;
    fputs("tests/support/big.c: a number is too large\n", stderr);
    abort();
}

static int compare(const struct big *a, const struct big *b)
{
    if (a->count != b->count)
        return a->count < b->count ? -1 : 1;
    for (int i = a->count - 1; i >= 0; i--)
        if (a->limb[i] != b->limb[i])
            return a->limb[i] < b->limb[i] ? -1 : 1;
    return 0;
}

/* |a| + |b|, with a not shorter. */
static void add(struct big *to, const struct big *a, const struct big *b)
{
    uint64_t carry = 0;
    int count = a->count;
    capacity_for(count + 1);
    for (int i = 0; i < count; i++) {
        wide sum = (wide)a->limb[i] + (i < b->count ? b->limb[i] : 0) + carry;
        to->limb[i] = (uint64_t)sum;
        carry = (uint64_t)(sum >> 64);
    }
    to->limb[count] = carry;
    to->count = count + (carry != 0);
}

/* |a| - |b|, with a not smaller. */
static void subtract(struct big *to, const struct big *a, const struct big *b)
{
    uint64_t borrow = 0;
    int count = a->count;
    for (int i = 0; i < count; i++) {
        wide less = (wide)(i < b->count ? b->limb[i] : 0) + borrow;
        borrow = a->limb[i] < less;
        to->limb[i] = a->limb[i] - (uint64_t)less;
    }
    to->count = trimmed(to->limb, count);
}

/* --- numbers -------------------------------------------------------------- */

void big_set(struct big *to, int64_t value)
{
    to->sign = (value > 0) - (value < 0);
    to->count = value != 0;
    to->limb[0] = value < 0 ? 0 - (uint64_t)value : (uint64_t)value;
}

void big_set_wide(struct big *to, uint64_t high, uint64_t low)
{
    bool negative = high >> 63;
    wide a = (wide)high << 64 | low;
    a = negative ? 0 - a : a;
    to->limb[0] = (uint64_t)a;
    to->limb[1] = (uint64_t)(a >> 64);
    to->count = trimmed(to->limb, 2);
    to->sign = to->count == 0 ? 0 : negative ? -1 : 1;
}

void big_copy(struct big *to, const struct big *a)
{
    if (to == a)
        return;
    to->sign = a->sign;
    to->count = a->count;
    memcpy(to->limb, a->limb, (size_t)a->count * sizeof a->limb[0]);
}

static void add_signed(struct big *to, const struct big *a, const struct big *b,
                       int sign_b)
{
    int order = compare(a, b), sign_a = a->sign;
    if (a->sign == 0 || sign_b == 0) {
        big_copy(to, sign_b == 0 ? a : b);
        to->sign = sign_b == 0 ? sign_a : sign_b;
    } else if (sign_a == sign_b) {
        add(to, order < 0 ? b : a, order < 0 ? a : b);
        to->sign = sign_a;
    } else {
        subtract(to, order < 0 ? b : a, order < 0 ? a : b);
        to->sign = order < 0 ? sign_b : order > 0 ? sign_a : 0;
    }
}

void big_add(struct big *to, const struct big *a, const struct big *b)
{
    add_signed(to, a, b, b->sign);
}

void big_sub(struct big *to, const struct big *a, const struct big *b)
{
    add_signed(to, a, b, -b->sign);
}

void big_mul(struct big *to, const struct big *a, const struct big *b)
{
    uint64_t product[BIG_LIMBS];
    int count = a->count + b->count;
    capacity_for(count);
    memset(product, 0, (size_t)count * sizeof product[0]);
    for (int i = 0; i < a->count; i++) {
        uint64_t carry = 0;
        for (int k = 0; k < b->count; k++) {
            wide sum = (wide)a->limb[i] * b->limb[k] + product[i + k] + carry;
            product[i + k] = (uint64_t)sum;
            carry = (uint64_t)(sum >> 64);
        }
        product[i + b->count] = carry;
    }
    to->sign = a->sign * b->sign;
    to->count = trimmed(product, count);
    memcpy(to->limb, product, (size_t)to->count * sizeof product[0]);
}

void big_mul_int(struct big *to, const struct big *a, int64_t b)
{
    uint64_t factor = b < 0 ? 0 - (uint64_t)b : (uint64_t)b, carry = 0;
    int count = a->count, sign = a->sign * ((b > 0) - (b < 0));
    capacity_for(count + 1);
    for (int i = 0; i < count; i++) {
        wide sum = (wide)a->limb[i] * factor + carry;
        to->limb[i] = (uint64_t)sum;
        carry = (uint64_t)(sum >> 64);
    }
    to->limb[count] = carry;
    to->count = trimmed(to->limb, count + 1);
    to->sign = sign;
}

void big_shl(struct big *to, const struct big *a, unsigned bits)
{
    int whole = (int)(bits / 64), count = a->count;
    unsigned part = bits % 64;
    if (a->sign == 0) {
        big_set(to, 0);
        return;
    }
    capacity_for(count + whole + 1);
    to->limb[count + whole] = 0;
    for (int i = count - 1; i >= 0; i--) {
        uint64_t limb = a->limb[i];
        if (part)
            to->limb[i + whole + 1] |= limb >> (64 - part);
        to->limb[i + whole] = limb << part;
    }
    memset(to->limb, 0, (size_t)whole * sizeof to->limb[0]);
    to->count = trimmed(to->limb, count + whole + 1);
    to->sign = a->sign;
}

int big_cmp(const struct big *a, const struct big *b)
{
    if (a->sign != b->sign)
        return a->sign < b->sign ? -1 : 1;
    return a->sign * compare(a, b);
}
