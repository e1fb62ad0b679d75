/* motion/plan/topp/topp_chain.c - see topp_chain.h. */
#include "motion/plan/topp/topp_chain.h"

#include <math.h>
#include <string.h>

#include "motion/plan/topp/topp_poly.h"

/* Width of an end. */
#define CHAIN_WIDTH 0.5

/* Derivatives at an end that count as none, of the largest. */
#define CHAIN_NONE 1e-6

#define CHAIN_BISECTIONS 100

/* --- the ends ---------------------------------------------------------------- */

/* Up to share x of an end's width, with ds/dw = 1 after it and all derivatives
 * continuous there: the integral of ds/dw, 6 x^2 - 8 x^3 + 3 x^4 or
 * 1 - (1 - x)^3, and its derivatives by x. */
static void chain_end(unsigned order, double x, double s[4])
{
    const double y = 1 - x;

    if (order == 3) {
        s[0] = x * x * x * (2 + x * (-2 + x * 0.6));
        s[1] = x * x * (6 + x * (-8 + x * 3));
        s[2] = 12 * x * y * y;
        s[3] = 12 * y * (1 - 3 * x);
    } else {
        s[0] = x * x * (1.5 + x * (-1 + x / 4));
        s[1] = x * (3 + x * (-3 + x));
        s[2] = 3 * y * y;
        s[3] = -6 * y;
    }
}

/* s over an end's width, in widths. */
static double chain_whole(const struct topp_chain_end *end)
{
    double s[4];

    chain_end(end->order, 1, s);
    return s[0];
}

/* How the path's position begins at an end of a piece: with s,
 * s^2 or more; what makes s^3 of it, or keeps `speed`. */
static void chain_begin(const struct topp_chain *chain,
                        const struct plan_topp_request *request, uint32_t piece,
                        bool is_end, double speed, struct topp_chain_end *end)
{
    const double *border = chain->path.border;
    const double length = border[piece + 1] - border[piece];
    double size[4] = { 0 }, most;

    for (unsigned k = 0; k < chain->path.axes; k++) {
        double q[4], by = 1 / request->limit[k].vel_max;
        topp_chain_powers(&chain->path, piece, k, is_end ? length : 0, q);
        for (int i = 1; i < 4; i++) {
            by *= length;
            size[i] = fmax(size[i], fabs(q[i]) * by);
        }
    }
    most = CHAIN_NONE * fmax(size[1], fmax(size[2], size[3]));
    end->speed = size[1] > most ? speed : 0;
    end->order = end->speed > 0   ? 1
                 : size[1] > most ? 3
                 : size[2] > most ? 2
                                  : 1;
}

void topp_chain_init(struct topp_chain *chain,
                     const struct plan_topp_request *request, uint32_t first,
                     uint32_t last)
{
    const double *border = request->path.border;
    const double length = border[last + 1] - border[first];
    double all = 1;

    *chain = (struct topp_chain){
        .path = request->path, .first = first, .last = last, .s = border[first]
    };
    chain_begin(chain, request, first, false,
                first == 0 ? request->start_speed : 0, &chain->start);
    chain_begin(chain, request, last, true,
                last + 1 == request->path.pieces ? request->end_speed : 0,
                &chain->end);
    if (chain->start.order > 1) {
        chain->start.width = CHAIN_WIDTH;
        all -= CHAIN_WIDTH * (1 - chain_whole(&chain->start));
    }
    if (chain->end.order > 1) {
        chain->end.width = CHAIN_WIDTH;
        all -= CHAIN_WIDTH * (1 - chain_whole(&chain->end));
    }
    chain->scale = length / all;
}

/* --- s(w) -------------------------------------------------------------------- */

/* From an end, `w` away from it; what s is there without a scale. */
static void chain_from(const struct topp_chain_end *end, double w, double s[4])
{
    if (w < end->width) {
        double by = end->width;
        chain_end(end->order, w / end->width, s);
        for (int i = 0; i < 4; i++, by /= end->width)
            s[i] *= by;
    } else {
        s[0] = w - end->width;
        if (end->width > 0)
            s[0] += end->width * chain_whole(end);
        s[1] = 1;
        s[2] = s[3] = 0;
    }
}

void topp_chain_s(const struct topp_chain *chain, double w, double s[4])
{
    const double *border = chain->path.border;

    if (1 - w < chain->end.width) {
        chain_from(&chain->end, 1 - w, s);
        s[0] = border[chain->last + 1] - chain->scale * s[0];
        s[2] = -s[2];
    } else {
        chain_from(&chain->start, w, s);
        s[0] = chain->s + chain->scale * s[0];
    }
    for (int i = 1; i < 4; i++)
        s[i] *= chain->scale;
}

unsigned topp_chain_joins(const struct topp_chain *chain, double w[2])
{
    unsigned count = 0;

    if (chain->start.width > 0)
        w[count++] = chain->start.width;
    if (chain->end.width > 0 &&
        (count == 0 || 1 - chain->end.width > w[count - 1]))
        w[count++] = 1 - chain->end.width;
    return count;
}

/* s from an end as powers of w - `w`, in the direction away from it. */
static void chain_end_powers(const struct topp_chain_end *end, double w,
                             double power[TOPP_CHAIN_DEGREE + 1])
{
    static const double begins[2][TOPP_CHAIN_DEGREE + 1] = {
        { 0, 0, 1.5, -1, 0.25, 0 }, /* see chain_end */
        { 0, 0, 0, 2, -2, 0.6 },
    };
    double by = end->width;

    memcpy(power, begins[end->order == 3], sizeof begins[0]);
    topp_poly_shift(TOPP_CHAIN_DEGREE, power, w / end->width);
    for (unsigned n = 0; n <= TOPP_CHAIN_DEGREE; n++, by /= end->width)
        power[n] *= by;
}

void topp_chain_part(const struct topp_chain *chain, uint32_t piece,
                     double from, double h, double power[TOPP_CHAIN_DEGREE + 1])
{
    const double *border = chain->path.border;
    double s[4], by = chain->scale;

    memset(power, 0, (TOPP_CHAIN_DEGREE + 1) * sizeof *power);
    if (from + h / 2 < chain->start.width) {
        chain_end_powers(&chain->start, from, power);
    } else if (1 - from - h / 2 < chain->end.width) {
        chain_end_powers(&chain->end, 1 - from, power);
        for (unsigned n = 2; n <= TOPP_CHAIN_DEGREE; n += 2)
            power[n] = -power[n];
    } else {
        power[1] = 1;
    }
    for (unsigned n = 0; n <= TOPP_CHAIN_DEGREE; n++, by *= h)
        power[n] *= by;
    topp_chain_s(chain, from, s);
    power[0] = s[0] - border[piece];
}

double topp_chain_w(const struct topp_chain *chain, double s)
{
    double low = 0, high = 1;

    for (int i = 0; i < CHAIN_BISECTIONS; i++) {
        const double middle = low + (high - low) / 2;
        double at[4];
        if (middle <= low || middle >= high)
            break;
        topp_chain_s(chain, middle, at);
        if (at[0] <= s)
            low = middle;
        else
            high = middle;
    }
    return high;
}

/* --- r(w) -------------------------------------------------------------------- */

void topp_chain_powers(const struct plan_topp_path *path, uint32_t piece,
                       unsigned axis, double s, double q[4])
{
    const double *coef =
        path->coef + ((size_t)piece * path->axes + axis) * (path->degree + 1);

    q[0] = q[1] = q[2] = q[3] = 0;
    for (unsigned n = path->degree + 1; n-- > 0;) {
        q[3] = q[3] * s + 3 * q[2];
        q[2] = q[2] * s + 2 * q[1];
        q[1] = q[1] * s + q[0];
        q[0] = q[0] * s + coef[n];
    }
}

void topp_chain_axis(const struct topp_chain *chain, uint32_t piece,
                     unsigned axis, const double s[4], double r[4])
{
    double q[4];

    topp_chain_powers(&chain->path, piece, axis,
                      s[0] - chain->path.border[piece], q);
    r[0] = q[0];
    r[1] = q[1] * s[1];
    r[2] = q[2] * s[1] * s[1] + q[1] * s[2];
    r[3] = q[3] * s[1] * s[1] * s[1] + 3 * q[2] * s[1] * s[2] + q[1] * s[3];
}
