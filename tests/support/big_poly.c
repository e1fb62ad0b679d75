/* tests/support/big_poly.c - signs of polynomials; see big.h. */
#include <string.h>

#include "tests/support/big.h"

#define HALVINGS 40
#define DEGREE   5

long big_poly_counted;

/* --- Bernstein coefficients ----------------------------------------------- */

static int64_t choose(int n, int k)
{
    int64_t c = 1;
    for (int i = 1; i <= k; i++)
        c = c * (n - k + i) / i;
    return c;
}

/* 60 is a multiple of every C(n, i) up to n = 5 but C(5, 2) = 10, of which it
 * is one too: 60 b_k = sum of 60 C(k, i) / C(n, i) c_i. */
static void bernstein(const struct big_poly *f, struct big b[])
{
    struct big term;
    for (int k = 0; k <= f->degree; k++) {
        big_set(&b[k], 0);
        for (int i = 0; i <= k; i++) {
            big_mul_int(&term, &f->c[i],
                        60 * choose(k, i) / choose(f->degree, i));
            big_add(&b[k], &b[k], &term);
        }
    }
}

/* de Casteljau at 1/2 of `b`, which becomes the right half; both times 2^n. */
static void halve(struct big b[], int n, struct big left[])
{
    for (int row = 0; row <= n; row++) {
        big_shl(&left[row], &b[0], (unsigned)(n - row));
        for (int i = 0; i < n - row; i++)
            big_add(&b[i], &b[i], &b[i + 1]);
        big_shl(&b[n - row], &b[n - row], (unsigned)(n - row));
    }
}

enum verdict { NEGATIVE, NOT_NEGATIVE, CLOSE };

/* Of one part of the interval. */
static enum verdict look(const struct big b[], int n)
{
    if (b[0].sign < 0 || b[n].sign < 0)
        return NEGATIVE;
    for (int i = 1; i < n; i++)
        if (b[i].sign < 0)
            return CLOSE;
    return NOT_NEGATIVE;
}

/* The parts still to be looked at, the leftmost on top; the root is in the
 * first. */
static struct part {
    struct big b[DEGREE + 1];
    int halvings;
} part[HALVINGS + 1];

static enum verdict judge(int n)
{
    enum verdict verdict = NOT_NEGATIVE;
    unsigned left = 1;
    part[0].halvings = 0;
    while (left > 0) {
        struct part *at = &part[left - 1];
        enum verdict here = look(at->b, n);
        if (here == NEGATIVE)
            return NEGATIVE;
        if (here == NOT_NEGATIVE || at->halvings == HALVINGS) {
            verdict = here == CLOSE ? CLOSE : verdict;
            left--;
            continue;
        }
        halve(at->b, n, part[left].b);
        part[left].halvings = ++at->halvings;
        left++;
    }
    return verdict;
}

/* --- Sturm sequences ------------------------------------------------------ */

static void poly_copy(struct big_poly *to, const struct big_poly *a)
{
    to->degree = a->degree;
    for (int i = 0; i <= a->degree; i++)
        big_copy(&to->c[i], &a->c[i]);
}

static void poly_trim(struct big_poly *a)
{
    while (a->degree > 0 && a->c[a->degree].sign == 0)
        a->degree--;
}

static bool poly_is_zero(const struct big_poly *a)
{
    return a->degree == 0 && a->c[0].sign == 0;
}

static void poly_slope(struct big_poly *to, const struct big_poly *a)
{
    to->degree = a->degree > 0 ? a->degree - 1 : 0;
    big_set(&to->c[0], 0);
    for (int i = 1; i <= a->degree; i++)
        big_mul_int(&to->c[i - 1], &a->c[i], i);
    poly_trim(to);
}

static void poly_mul(struct big_poly *to, const struct big_poly *a,
                     const struct big_poly *b)
{
    static struct big term;
    to->degree = a->degree + b->degree;
    for (int i = 0; i <= to->degree; i++)
        big_set(&to->c[i], 0);
    for (int i = 0; i <= a->degree; i++)
        for (int k = 0; k <= b->degree; k++) {
            big_mul(&term, &a->c[i], &b->c[k]);
            big_add(&to->c[i + k], &to->c[i + k], &term);
        }
    poly_trim(to);
}

/* a mod b, times a positive number. */
static void poly_remainder(struct big_poly *a, const struct big_poly *b)
{
    static struct big lead, term;
    while (!poly_is_zero(a) && a->degree >= b->degree) {
        int up = a->degree - b->degree, sign = b->c[b->degree].sign;
        big_copy(&lead, &a->c[a->degree]);
        lead.sign *= sign;
        for (int i = 0; i < a->degree; i++) {
            big_mul(&a->c[i], &a->c[i], &b->c[b->degree]);
            a->c[i].sign *= sign;
            if (i < up)
                continue;
            big_mul(&term, &b->c[i - up], &lead);
            big_sub(&a->c[i], &a->c[i], &term);
        }
        big_set(&a->c[a->degree], 0);
        if (a->degree > 0)
            a->degree--;
        poly_trim(a);
    }
}

static int sign_at_1(const struct big_poly *a)
{
    static struct big sum;
    big_set(&sum, 0);
    for (int i = 0; i <= a->degree; i++)
        big_add(&sum, &sum, &a->c[i]);
    return sum.sign;
}

static void count_change(int sign, int *last, int *changes)
{
    if (sign == 0)
        return;
    *changes += sign == -*last;
    *last = sign;
}

/* Roots of p inside (0, 1) where q > 0, less those where q < 0; p is not zero
 * at 0 and 1. */
static int query(const struct big_poly *p, const struct big_poly *q)
{
    static struct big_poly sequence[3], slope;
    int last[2] = { 0, 0 }, changes[2] = { 0, 0 };
    struct big_poly *a = &sequence[0], *b = &sequence[1], *next = &sequence[2];
    poly_copy(a, p);
    poly_slope(&slope, p);
    poly_mul(b, &slope, q);
    poly_remainder(b, p);
    for (;;) {
        count_change(a->c[0].sign, &last[0], &changes[0]);
        count_change(sign_at_1(a), &last[1], &changes[1]);
        if (poly_is_zero(b))
            return changes[0] - changes[1];
        poly_copy(next, a);
        poly_remainder(next, b);
        for (int i = 0; i <= next->degree; i++)
            next->c[i].sign = -next->c[i].sign;
        struct big_poly *free = a;
        a = b;
        b = next;
        next = free;
    }
}

/* Divide by x while that goes, then by x - 1. */
static void without_ends(struct big_poly *p)
{
    while (p->degree > 0 && p->c[0].sign == 0) {
        for (int i = 0; i < p->degree; i++)
            big_copy(&p->c[i], &p->c[i + 1]);
        p->degree--;
    }
    while (p->degree > 0 && sign_at_1(p) == 0) {
        for (int i = p->degree - 1; i > 0; i--)
            big_add(&p->c[i], &p->c[i], &p->c[i + 1]);
        for (int i = 0; i < p->degree; i++)
            big_copy(&p->c[i], &p->c[i + 1]);
        p->degree--;
    }
}

/* f(0), f(1) >= 0 are known: does f at a root of f' inside tell otherwise? */
static bool count_negative(const struct big_poly *f)
{
    static struct big_poly p, q, square;
    big_poly_counted++;
    poly_slope(&p, f);
    without_ends(&p);
    if (p.degree == 0)
        return false;
    poly_copy(&q, f);
    poly_remainder(&q, &p);
    poly_mul(&square, &q, &q);
    poly_remainder(&square, &p);
    return query(&p, &square) != query(&p, &q);
}

bool big_poly_is_not_negative(const struct big_poly *f)
{
    bernstein(f, part[0].b);
    enum verdict verdict = judge(f->degree);
    return verdict == CLOSE ? !count_negative(f) : verdict == NOT_NEGATIVE;
}
