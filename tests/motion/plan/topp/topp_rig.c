/* tests/motion/plan/topp/topp_rig.c - see topp_rig.h. */
#include "tests/motion/plan/topp/topp_rig.h"

#include <math.h>

void topp_rig_init(struct topp_rig *rig, unsigned axes, uint32_t pieces)
{
    *rig = (struct topp_rig){ 0 };
    rig->request = (struct plan_topp_request){
        .path = { axes, 3, pieces, rig->border, rig->coef },
        .limit = rig->limit,
        .cap = rig->cap,
    };
    for (uint32_t i = 0; i <= pieces; i++)
        rig->border[i] = i;
    for (unsigned k = 0; k < axes; k++) {
        rig->limit[k] = (struct plan_topp_limit){ -1, 1, -1, 1 };
        rig->jerk[k] = 1;
    }
}

double *topp_rig_powers(struct topp_rig *rig, uint32_t piece, unsigned axis)
{
    return rig->coef + (piece * rig->request.path.axes + axis) * 4;
}

void topp_rig_straight(struct topp_rig *rig, double distance, uint32_t pieces)
{
    topp_rig_init(rig, 1, pieces);
    for (uint32_t i = 0; i < pieces; i++) {
        topp_rig_powers(rig, i, 0)[0] = distance * i / pieces;
        topp_rig_powers(rig, i, 0)[1] = distance / pieces;
    }
}

/* --- random paths --------------------------------------------------------------- */

static uint64_t seed;

static double random_unit(void) /* -1 .. 1 */
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(int32_t)(seed >> 32) / 2147483648.;
}

static void random_begin(uint64_t from)
{
    seed = from;
    for (int k = 0; k < 4; k++)
        (void)random_unit();
}

static double random_log(double low, double high)
{
    return low * pow(high / low, (random_unit() + 1) / 2);
}

static void hermite(double p0, double v0, double p1, double v1, double h,
                    double coef[4])
{
    const double chord = (p1 - p0) / h;

    coef[0] = p0;
    coef[1] = v0;
    coef[2] = (3 * chord - 2 * v0 - v1) / h;
    coef[3] = (v0 + v1 - 2 * chord) / (h * h);
}

/* What a key does to all axes at once. */
enum { KEY_SMOOTH, KEY_CUSP, KEY_REPEATED, KEY_STRAIGHT };

void topp_rig_random(struct topp_rig *rig, uint64_t from)
{
    random_begin(from);
    const unsigned axes =
        1 + (unsigned)(fabs(random_unit()) * TOPP_RIG_AXES_MAX) % 12;
    const uint32_t pieces = 1 + (uint32_t)(fabs(random_unit()) * 11) % 12;
    int kind[TOPP_RIG_PIECES_MAX + 1];

    topp_rig_init(rig, axes, pieces);
    for (uint32_t i = 0; i < pieces; i++)
        rig->border[i + 1] = rig->border[i] + random_log(0.05, 20);
    for (uint32_t i = 0; i <= pieces; i++) {
        const double draw = fabs(random_unit());
        kind[i] = draw < 0.7    ? KEY_SMOOTH
                  : draw < 0.8  ? KEY_CUSP
                  : draw < 0.87 ? KEY_REPEATED
                                : KEY_STRAIGHT;
    }
    for (unsigned k = 0; k < axes; k++) {
        const double size =
            fabs(random_unit()) < 0.15 ? 1e-7 : random_log(0.1, 100);
        double p = random_unit() * size, v = random_unit() * size;
        rig->limit[k] =
            (struct plan_topp_limit){ -random_log(0.1, 10), random_log(0.1, 10),
                                      -random_log(0.1, 10),
                                      random_log(0.1, 10) };
        for (uint32_t i = 0; i < pieces; i++) {
            const double h = rig->border[i + 1] - rig->border[i];
            double to = random_unit() * size, w = random_unit() * size / h;
            if (kind[i + 1] == KEY_STRAIGHT) {
                to = p + v * h;
                w = v;
            } else if (kind[i + 1] == KEY_CUSP) {
                w = 0;
            } else if (kind[i + 1] == KEY_REPEATED && (i == 0 || v == 0)) {
                to = p;
                v = w = 0;
            } else if (kind[i + 1] == KEY_REPEATED) {
                w = 0;
            }
            hermite(p, v, to, w, h, topp_rig_powers(rig, i, k));
            p = to;
            v = w;
        }
    }
    for (unsigned k = 0; k < axes; k++)
        rig->jerk[k] = random_log(0.1, 1000);
}

/* Second derivatives m of the natural spline through p at the borders. */
static void natural(const double border[], const double p[], uint32_t pieces,
                    double m[])
{
    double pivot[TOPP_RIG_PIECES_MAX + 1] = { 0 };

    m[0] = m[pieces] = 0;
    for (uint32_t i = 1; i < pieces; i++) {
        const double h0 = border[i] - border[i - 1];
        const double h1 = border[i + 1] - border[i];
        const double by = 2 * (h0 + h1) - h0 * pivot[i - 1];
        pivot[i] = h1 / by;
        m[i] = (6 * ((p[i + 1] - p[i]) / h1 - (p[i] - p[i - 1]) / h0) -
                h0 * m[i - 1]) /
               by;
    }
    for (uint32_t i = pieces; i-- > 1;)
        m[i] -= pivot[i] * m[i + 1];
}

void topp_rig_random_smooth(struct topp_rig *rig, uint64_t from)
{
    topp_rig_random(rig, from);
    const uint32_t pieces = rig->request.path.pieces;

    for (unsigned k = 0; k < rig->request.path.axes; k++) {
        double p[TOPP_RIG_PIECES_MAX + 1], m[TOPP_RIG_PIECES_MAX + 1];
        for (uint32_t i = 0; i <= pieces; i++)
            p[i] = random_unit();
        natural(rig->border, p, pieces, m);
        for (uint32_t i = 0; i < pieces; i++) {
            const double h = rig->border[i + 1] - rig->border[i];
            double *coef = topp_rig_powers(rig, i, k);
            coef[0] = p[i];
            coef[1] = (p[i + 1] - p[i]) / h - h * (2 * m[i] + m[i + 1]) / 6;
            coef[2] = m[i] / 2;
            coef[3] = (m[i + 1] - m[i]) / (6 * h);
        }
    }
}
