/* motion/plan/shaper/shaper.c - see shaper.h.
 *
 * All is computed for w = 1 and scaled: times go with 1/w, amplitudes do not
 * depend on it.  With q = z + j sqrt(1 - z^2), x = w / wm and tau = wm t,
 *     H(x) = sum A[i] exp(x (q tau[i] - z tau[n-1])),   V = |H|.
 * The unknowns of EI and EI2 and their equations are in one vector; the
 * Jacobian is taken by central differences, whose error of 1e-10 costs Newton's
 * method an iteration at most: what it converges to depends on the equations
 * alone. */
#include "motion/plan/shaper/shaper.h"

#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/double/double_math.h"
#include "motion/plan/plan_error.h"

#define SHAPER_UNKNOWNS   11
#define SHAPER_STEP       0.02 /* of damping */
#define SHAPER_STEP_LEAST 1e-4
#define SHAPER_CHANGE     0.15 /* of an unknown in one step: same solution */
#define SHAPER_ITERATIONS 20
#define SHAPER_CONVERGED  1e-12 /* last correction; it converges quadratically */

static const struct {
    const char *word;
    uint32_t impulses;
} shaper_kind[] = {
#define SHAPER_ROW(name, word, impulses) { word, impulses },
    PLAN_SHAPER_LIST(SHAPER_ROW)
#undef SHAPER_ROW
};

const char *plan_shaper_word(enum plan_shaper_kind kind)
{
    return shaper_kind[kind].word;
}

/* A complex number. */
struct shaper_value {
    double re, im;
};

/* H or, with `slope`, dH/dx. */
static struct shaper_value shaper_response(uint32_t count, const double a[],
                                           const double tau[], double damping,
                                           double x, bool slope)
{
    const double root = sqrt(1 - damping * damping);
    struct shaper_value sum = { 0, 0 };

    for (uint32_t i = 0; i < count; i++) {
        const double re = damping * (tau[i] - tau[count - 1]);
        const double im = root * tau[i];
        const double size = a[i] * double_exp(x * re);
        const struct shaper_value e = { size * double_cos(x * im),
                                        size * double_sin(x * im) };
        sum.re += slope ? re * e.re - im * e.im : e.re;
        sum.im += slope ? re * e.im + im * e.re : e.im;
    }
    return sum;
}

static double shaper_period(double damping)
{
    return 2 * DOUBLE_PI / sqrt(1 - damping * damping);
}

/* --- the equations of EI and EI2 ------------------------------------------ */

/* Unknowns: A[0 .. n-1]; t / Td of all impulses but the first (EI: t[2] = Td is
 * none); zeros; humps, the last two by the design frequency. */
struct shaper_system {
    enum plan_shaper_kind kind;
    double damping, residual;
    unsigned size;
};

static bool shaper_has_humps(const struct shaper_system *system)
{
    return system->kind == PLAN_SHAPER_EI2;
}

static void shaper_times(const struct shaper_system *system,
                         const double unknown[], double tau[])
{
    const double period = shaper_period(system->damping);
    const uint32_t count = shaper_kind[system->kind].impulses;

    tau[0] = 0;
    for (uint32_t i = 1; i < count; i++)
        tau[i] = period * unknown[count + i - 1];
    if (!shaper_has_humps(system))
        tau[2] = period;
}

static void shaper_equations(const struct shaper_system *system,
                             const double unknown[], double result[])
{
    const bool humps = shaper_has_humps(system);
    const uint32_t count = shaper_kind[system->kind].impulses;
    const double *const zero = &unknown[humps ? 7 : 4];
    const double at[] = { zero[0], humps ? 1 : zero[1], zero[1] };
    const double allowed = system->residual * system->residual;
    double tau[MOTION_SHAPER_IMPULSES_MAX], *next = result;

    shaper_times(system, unknown, tau);
    *next = -1;
    for (uint32_t i = 0; i < count; i++)
        *next += unknown[i];
    next++;
    for (unsigned i = 0; i < (humps ? 3 : 2); i++) {
        const struct shaper_value h =
            shaper_response(count, unknown, tau, system->damping, at[i], false);
        *next++ = h.re;
        *next++ = h.im;
    }
    for (unsigned i = 0; i < (humps ? 2 : 1); i++) {
        const double x = humps ? unknown[9 + i] : 1;
        const struct shaper_value h =
            shaper_response(count, unknown, tau, system->damping, x, false);
        const struct shaper_value d =
            shaper_response(count, unknown, tau, system->damping, x, true);
        *next++ = h.re * h.re + h.im * h.im - allowed;
        if (humps) /* half the slope of V^2 */
            *next++ = h.re * d.re + h.im * d.im;
    }
}

/* The solution without damping, in closed form. */
static void shaper_undamped(const struct shaper_system *system,
                            double unknown[])
{
    const double v = system->residual;

    if (!shaper_has_humps(system)) {
        const double x = double_acos(-(1 - v) / (1 + v)) / DOUBLE_PI;
        const double known[] = { (1 + v) / 4, (1 - v) / 2, (1 + v) / 4,
                                 0.5,         x,           2 - x };
        memcpy(unknown, known, sizeof known);
        return;
    }
    /* H is 2 A0 cos 3c + 2 A1 cos c with c = pi x / 2, about its middle */
    const double x = double_cbrt(v * v * (sqrt(1 - v * v) + 1));
    const double a = (3 * x * x + 2 * x + 3 * v * v) / (16 * x), b = 0.5 - a;
    const double zero = 2 / DOUBLE_PI * double_acos(sqrt((3 - b / a) / 4));
    const double hump =
        1 - 2 / DOUBLE_PI * double_acos(sqrt((3 + b / (3 * a)) / 4));
    const double known[] = { a,   b,    b,        a,    0.5,     1,
                             1.5, zero, 2 - zero, hump, 2 - hump };
    memcpy(unknown, known, sizeof known);
}

/* --- Newton's method ------------------------------------------------------ */

/* Solve m x = b by elimination with pivots, into b; false when singular. */
static bool shaper_solve(unsigned size, double m[][SHAPER_UNKNOWNS], double b[])
{
    for (unsigned k = 0; k < size; k++) {
        unsigned pivot = k;
        for (unsigned i = k + 1; i < size; i++)
            if (fabs(m[i][k]) > fabs(m[pivot][k]))
                pivot = i;
        if (!(fabs(m[pivot][k]) > 0))
            return false;
        for (unsigned j = 0; j < size; j++) {
            const double swapped = m[k][j];
            m[k][j] = m[pivot][j];
            m[pivot][j] = swapped;
        }
        const double swapped = b[k];
        b[k] = b[pivot];
        b[pivot] = swapped;
        for (unsigned i = k + 1; i < size; i++) {
            const double factor = m[i][k] / m[k][k];
            for (unsigned j = k; j < size; j++)
                m[i][j] -= factor * m[k][j];
            b[i] -= factor * b[k];
        }
    }
    for (unsigned k = size; k-- > 0;) {
        for (unsigned j = k + 1; j < size; j++)
            b[k] -= m[k][j] * b[j];
        b[k] /= m[k][k];
    }
    return true;
}

static void shaper_jacobian(const struct shaper_system *system,
                            const double unknown[], double m[][SHAPER_UNKNOWNS])
{
    const double step = 1e-5;

    for (unsigned j = 0; j < system->size; j++) {
        double moved[SHAPER_UNKNOWNS], up[SHAPER_UNKNOWNS],
            down[SHAPER_UNKNOWNS];
        memcpy(moved, unknown, system->size * sizeof *moved);
        moved[j] = unknown[j] + step;
        shaper_equations(system, moved, up);
        moved[j] = unknown[j] - step;
        shaper_equations(system, moved, down);
        for (unsigned i = 0; i < system->size; i++)
            m[i][j] = (up[i] - down[i]) / (2 * step);
    }
}

/* From `unknown` to the solution near it; false when it does not converge. */
static bool shaper_newton(const struct shaper_system *system, double unknown[])
{
    for (unsigned n = 0; n < SHAPER_ITERATIONS; n++) {
        double m[SHAPER_UNKNOWNS][SHAPER_UNKNOWNS], change[SHAPER_UNKNOWNS];
        double largest = 0;

        shaper_equations(system, unknown, change);
        shaper_jacobian(system, unknown, m);
        if (!shaper_solve(system->size, m, change))
            return false;
        for (unsigned i = 0; i < system->size; i++) {
            unknown[i] -= change[i];
            largest = fmax(largest, fabs(change[i]));
        }
        if (!isfinite(largest))
            return false;
        if (largest < SHAPER_CONVERGED)
            return true;
    }
    return false;
}

/* --- continuation in damping ---------------------------------------------- */

/* A shaper: positive amplitudes, ascending times, zeros and humps in order, and
 * the upper zero within an octave of the design frequency.  At high damping that
 * zero diverges (EI: 15 times the design frequency at z = 0.67), and the band
 * between the zeros is no longer one about the design frequency. */
static bool shaper_is_valid(const struct shaper_system *system,
                            const double unknown[])
{
    const bool humps = shaper_has_humps(system);
    const uint32_t count = shaper_kind[system->kind].impulses;
    const double *const zero = &unknown[humps ? 7 : 4];
    double tau[MOTION_SHAPER_IMPULSES_MAX];

    shaper_times(system, unknown, tau);
    for (uint32_t i = 0; i < count; i++)
        if (!(unknown[i] > 0) || (i > 0 && !(tau[i] > tau[i - 1])))
            return false;
    if (!(zero[0] > 0 && zero[0] < 1 && zero[1] > 1 && zero[1] < 2))
        return false;
    return !humps || (unknown[9] > zero[0] && unknown[9] < 1 &&
                      unknown[10] > 1 && unknown[10] < zero[1]);
}

/* One step of the continuation; false, and nothing changed, when it diverges or
 * converges to another solution. */
static bool shaper_advance(const struct shaper_system *system, double unknown[])
{
    double next[SHAPER_UNKNOWNS];

    memcpy(next, unknown, system->size * sizeof *next);
    if (!shaper_newton(system, next) || !shaper_is_valid(system, next))
        return false;
    for (unsigned i = 0; i < system->size; i++)
        if (!(fabs(next[i] - unknown[i]) <= SHAPER_CHANGE))
            return false;
    memcpy(unknown, next, system->size * sizeof *next);
    return true;
}

/* From no damping to system->damping; false: that is then the highest damping
 * which was reached. */
static bool shaper_continue(struct shaper_system *system, double unknown[])
{
    const double target = system->damping;
    double reached = 0, step = SHAPER_STEP;

    shaper_undamped(system, unknown);
    while (reached < target) {
        system->damping = fmin(reached + step, target);
        if (shaper_advance(system, unknown)) {
            reached = system->damping;
            continue;
        }
        step /= 2;
        if (step < SHAPER_STEP_LEAST) {
            system->damping = reached;
            return false;
        }
    }
    system->damping = target;
    return true;
}

/* --- design ---------------------------------------------------------------- */

/* In units of the design frequency: tau for times, zeros by it. */
static void shaper_design_zv(const struct plan_shaper_request *request,
                             struct plan_shaper *shaper)
{
    const double z = request->damping;
    const double k = double_exp(-z * DOUBLE_PI / sqrt(1 - z * z));
    const double half = shaper_period(z) / 2, sum = 1 + k;

    shaper->time_s[0] = 0;
    shaper->time_s[1] = half;
    shaper->time_s[2] = 2 * half;
    shaper->zeros = 1;
    shaper->zero_hz[0] = 1;
    if (request->kind == PLAN_SHAPER_ZV) {
        shaper->amplitude[0] = 1 / sum;
        shaper->amplitude[1] = k / sum;
        return;
    }
    shaper->amplitude[0] = 1 / (sum * sum);
    shaper->amplitude[1] = 2 * k / (sum * sum);
    shaper->amplitude[2] = k * k / (sum * sum);
}

static int shaper_design_ei(const struct plan_shaper_request *request,
                            struct plan_shaper *shaper,
                            struct plan_error *error)
{
    struct shaper_system system = {
        .kind = request->kind,
        .damping = request->damping,
        .residual = request->residual,
        .size = request->kind == PLAN_SHAPER_EI2 ? 11 : 6,
    };
    const bool humps = shaper_has_humps(&system);
    double unknown[SHAPER_UNKNOWNS];

    if (!shaper_continue(&system, unknown))
        return plan_error_set(
            error, MOTION_E_ARG, (struct plan_place){ 0, 0 },
            "no shaper %s exists for a damping of %.4g: with a residual of "
            "%.4g it exists up to %.2f, zvd exists for any damping",
            plan_shaper_word(request->kind), request->damping,
            request->residual, floor(100 * system.damping) / 100);
    memcpy(shaper->amplitude, unknown, shaper->count * sizeof *unknown);
    shaper_times(&system, unknown, shaper->time_s);
    shaper->zeros = humps ? 3 : 2;
    shaper->zero_hz[0] = unknown[humps ? 7 : 4];
    shaper->zero_hz[1] = humps ? 1 : unknown[5];
    shaper->zero_hz[2] = humps ? unknown[8] : 0;
    shaper->humps = humps ? 2 : 0;
    for (unsigned i = 0; i < shaper->humps; i++)
        shaper->hump_hz[i] = unknown[9 + i];
    return MOTION_OK;
}

static int shaper_refuse(struct plan_error *error, const char *what,
                         double value, double low, double high)
{
    return plan_error_set(error, MOTION_E_ARG, (struct plan_place){ 0, 0 },
                          "%s of a shaper is %.6g, expected %.4g .. %.4g", what,
                          value, low, high);
}

static int shaper_check(const struct plan_shaper_request *request,
                        struct plan_error *error)
{
    const bool robust =
        request->kind == PLAN_SHAPER_EI || request->kind == PLAN_SHAPER_EI2;

    if (!(request->frequency_hz >= PLAN_SHAPER_FREQUENCY_MIN_HZ &&
          request->frequency_hz <= PLAN_SHAPER_FREQUENCY_MAX_HZ))
        return shaper_refuse(error, "the frequency", request->frequency_hz,
                             PLAN_SHAPER_FREQUENCY_MIN_HZ,
                             PLAN_SHAPER_FREQUENCY_MAX_HZ);
    if (!(request->damping >= 0 && request->damping <= PLAN_SHAPER_DAMPING_MAX))
        return shaper_refuse(error, "the damping", request->damping, 0,
                             PLAN_SHAPER_DAMPING_MAX);
    if (robust && !(request->residual >= 0.001 && request->residual <= 0.3))
        return shaper_refuse(error, "the residual", request->residual, 0.001,
                             0.3);
    return MOTION_OK;
}

int plan_shaper_design(const struct plan_shaper_request *request,
                       struct plan_shaper *shaper, struct plan_error *error)
{
    int err = shaper_check(request, error);

    if (err < 0)
        return err;
    *shaper = (struct plan_shaper){
        .frequency_hz = request->frequency_hz,
        .damping = request->damping,
        .count = shaper_kind[request->kind].impulses,
    };
    if (request->kind == PLAN_SHAPER_ZV || request->kind == PLAN_SHAPER_ZVD)
        shaper_design_zv(request, shaper);
    else
        err = shaper_design_ei(request, shaper, error);
    for (uint32_t i = 0; i < shaper->count; i++)
        shaper->time_s[i] /= 2 * DOUBLE_PI * request->frequency_hz;
    for (uint32_t i = shaper->count; i < MOTION_SHAPER_IMPULSES_MAX; i++)
        shaper->amplitude[i] = shaper->time_s[i] = 0;
    for (unsigned i = 0; i < shaper->zeros; i++)
        shaper->zero_hz[i] *= request->frequency_hz;
    for (unsigned i = 0; i < shaper->humps; i++)
        shaper->hump_hz[i] *= request->frequency_hz;
    return err;
}

/* --- response --------------------------------------------------------------- */

double plan_shaper_residual(const struct plan_shaper *shaper,
                            double frequency_hz)
{
    const struct shaper_value h =
        shaper_response(shaper->count, shaper->amplitude, shaper->time_s,
                        shaper->damping, 2 * DOUBLE_PI * frequency_hz, false);

    return double_hypot(h.re, h.im);
}

double plan_shaper_delay(const struct plan_shaper *shaper)
{
    double sum = 0;

    for (uint32_t i = 0; i < shaper->count; i++)
        sum += shaper->amplitude[i] * shaper->time_s[i];
    return sum;
}

/* With F = sum A exp(-j W t), minus the derivative of arg F is
 * Re(sum A t exp(-j W t) / F). */
double plan_shaper_group_delay(const struct plan_shaper *shaper,
                               double frequency_hz)
{
    const double rate = 2 * DOUBLE_PI * frequency_hz;
    struct shaper_value f = { 0, 0 }, d = { 0, 0 };

    for (uint32_t i = 0; i < shaper->count; i++) {
        const double t = shaper->time_s[i];
        const double re = shaper->amplitude[i] * double_cos(rate * t);
        const double im = -shaper->amplitude[i] * double_sin(rate * t);
        f.re += re;
        f.im += im;
        d.re += t * re;
        d.im += t * im;
    }
    return (d.re * f.re + d.im * f.im) / (f.re * f.re + f.im * f.im);
}

int plan_shaper_to_tick(const struct plan_shaper *shaper, int64_t later_ns_q12,
                        struct motion_shaper *tick)
{
    uint64_t amplitude[MOTION_SHAPER_IMPULSES_MAX];
    int64_t delay[MOTION_SHAPER_IMPULSES_MAX];
    uint64_t left = MOTION_SHAPER_ONE_Q62;
    const double most = (double)MOTION_SHAPER_DELAY_MAX_NS_Q12 / 2;

    if (later_ns_q12 < 0 || (double)later_ns_q12 > most)
        return MOTION_E_ARG;
    for (uint32_t i = 0; i < shaper->count; i++) {
        const double t = shaper->time_s[i] * (double)MOTION_FIXED_S_Q12;
        if (!(t <= most))
            return MOTION_E_ARG;
        delay[i] = later_ns_q12 + (int64_t)llround(t);
        amplitude[i] = i + 1 == shaper->count
                           ? left
                           : (uint64_t)(shaper->amplitude[i] * 0x1p62);
        left -= amplitude[i];
    }
    return motion_shaper_init(tick, shaper->count, amplitude, delay);
}
