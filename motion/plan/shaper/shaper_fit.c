/* motion/plan/shaper/shaper_fit.c - see shaper_fit.h. */
#include "motion/plan/shaper/shaper_fit.h"

#include <math.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"
#include "motion/plan/plan_error.h"

#define FIT_GRID        4096 /* even samples for the periodogram */
#define FIT_STEPS       400  /* of the simplex, at most */
#define FIT_CONVERGED   1e-11
#define FIT_DAMPING_MAX 0.95
#define FIT_DRIVEN      0.95 /* of the largest distance: still driven */
#define FIT_OTHER_SIDE  0.25 /* of it: it swings */
#define FIT_EXPLAINED   0.5
#define FIT_SECOND      0.05 /* of the amplitude: less is none */

struct fit_rows {
    const double *t_s, *x; /* from the first one that is used */
    uint32_t count;
    double span_s;
};

static int fit_refuse(struct plan_error *error, const char *what)
{
    (void)plan_error_set(error, MOTION_E_ARG, (struct plan_place){ 0, 0 }, "%s",
                         what);
    return MOTION_E_ARG;
}

/* --- which rows ------------------------------------------------------------- */

static double fit_mean(const double x[], uint32_t from, uint32_t to)
{
    double sum = 0;

    for (uint32_t i = from; i < to; i++)
        sum += x[i];
    return sum / (to - from);
}

/* The last row that is about as far from the settled value as any before the
 * first swing to the other side: later ones may be as far where it swings for
 * long. */
static uint32_t fit_first(const double x[], uint32_t count)
{
    const double settled = fit_mean(x, count - count / 8 - 1, count);
    double most = 0;
    uint32_t first = 0, i = 0;

    for (uint32_t k = 0; k < count; k++)
        most = fmax(most, fabs(x[k] - settled));
    while (i + 1 < count && fabs(x[i] - settled) < FIT_DRIVEN * most)
        i++;
    const double side = x[i] < settled ? -1 : 1;
    for (; i < count && side * (x[i] - settled) > -FIT_OTHER_SIDE * most; i++)
        if (fabs(x[i] - settled) >= FIT_DRIVEN * most)
            first = i;
    return first;
}

/* --- c, a, b for given w and z -------------------------------------------------- */

struct fit_model {
    double c, a, b;
    double squares; /* of what is left */
};

/* m x = y by elimination with pivots; zeros where there is no solution. */
static void fit_solve(double m[3][4], double solution[3])
{
    for (int i = 0; i < 3; i++) {
        int pivot = i;
        for (int k = i + 1; k < 3; k++)
            if (fabs(m[k][i]) > fabs(m[pivot][i]))
                pivot = k;
        for (int j = 0; j < 4; j++) {
            const double swap = m[i][j];
            m[i][j] = m[pivot][j];
            m[pivot][j] = swap;
        }
        for (int k = i + 1; k < 3 && m[i][i] != 0; k++) {
            const double by = m[k][i] / m[i][i];
            for (int j = i; j < 4; j++)
                m[k][j] -= by * m[i][j];
        }
    }
    for (int i = 2; i >= 0; i--) {
        double sum = m[i][3];
        for (int j = i + 1; j < 3; j++)
            sum -= m[i][j] * solution[j];
        solution[i] = m[i][i] != 0 ? sum / m[i][i] : 0;
    }
}

static void fit_basis(const struct fit_rows *rows, uint32_t i, double w,
                      double z, double basis[3])
{
    const double t = rows->t_s[i] - rows->t_s[0];
    const double size = double_exp(-z * w * t), phase = w * sqrt(1 - z * z) * t;

    basis[0] = 1;
    basis[1] = size * double_cos(phase);
    basis[2] = size * double_sin(phase);
}

static struct fit_model fit_linear(const struct fit_rows *rows, double w,
                                   double z)
{
    double m[3][4] = { { 0 } }, basis[3], solution[3] = { 0 };
    struct fit_model model = { .squares = 0 };

    for (uint32_t i = 0; i < rows->count; i++) {
        fit_basis(rows, i, w, z, basis);
        for (int k = 0; k < 3; k++) {
            for (int j = 0; j < 3; j++)
                m[k][j] += basis[k] * basis[j];
            m[k][3] += basis[k] * rows->x[i];
        }
    }
    fit_solve(m, solution);
    model.c = solution[0];
    model.a = solution[1];
    model.b = solution[2];
    for (uint32_t i = 0; i < rows->count; i++) {
        fit_basis(rows, i, w, z, basis);
        const double left =
            rows->x[i] - model.c - model.a * basis[1] - model.b * basis[2];
        model.squares += left * left;
    }
    return model;
}

/* --- where to begin --------------------------------------------------------------- */

/* Even samples of x without its settled value. */
static void fit_even(const struct fit_rows *rows, double settled,
                     double even[FIT_GRID])
{
    uint32_t i = 0;

    for (int k = 0; k < FIT_GRID; k++) {
        const double t = rows->t_s[0] + rows->span_s * k / (FIT_GRID - 1);
        while (i + 2 < rows->count && rows->t_s[i + 1] < t)
            i++;
        const double part =
            (t - rows->t_s[i]) / (rows->t_s[i + 1] - rows->t_s[i]);
        even[k] = rows->x[i] + (rows->x[i + 1] - rows->x[i]) * part - settled;
    }
}

/* The peak of the periodogram, Hz, up to `most_hz`; by Goertzel's recurrence. */
static double fit_peak(const double even[FIT_GRID], double span_s,
                       double most_hz)
{
    double best = -1, best_hz = 0;

    for (int i = 3; i <= most_hz * 4 * span_s; i++) {
        const double hz = i / (4 * span_s);
        const double turn = 2 * DOUBLE_PI * hz * span_s / (FIT_GRID - 1);
        const double twice = 2 * double_cos(turn);
        double s1 = 0, s2 = 0;
        for (int k = 0; k < FIT_GRID; k++) {
            const double s = even[k] + twice * s1 - s2;
            s2 = s1;
            s1 = s;
        }
        const double power = s1 * s1 + s2 * s2 - twice * s1 * s2;
        if (power > best) {
            best = power;
            best_hz = hz;
        }
    }
    return best_hz;
}

/* --- the search --------------------------------------------------------------------- */

struct fit_point {
    double log_w, z, squares;
};

static struct fit_point fit_at(const struct fit_rows *rows, double log_w,
                               double z)
{
    struct fit_point point = { log_w, fmin(fmax(z, 0), FIT_DAMPING_MAX), 0 };

    point.squares = fit_linear(rows, double_exp(log_w), point.z).squares;
    return point;
}

static void fit_sort(struct fit_point p[3])
{
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2 - i; k++)
            if (p[k + 1].squares < p[k].squares) {
                const struct fit_point swap = p[k];
                p[k] = p[k + 1];
                p[k + 1] = swap;
            }
}

/* The worst one, `by` times as far from the middle of the two others. */
static struct fit_point fit_moved(const struct fit_rows *rows,
                                  const struct fit_point p[3], double by)
{
    const double log_w = (p[0].log_w + p[1].log_w) / 2;
    const double z = (p[0].z + p[1].z) / 2;

    return fit_at(rows, log_w + by * (p[2].log_w - log_w),
                  z + by * (p[2].z - z));
}

static void fit_shrink(const struct fit_rows *rows, struct fit_point p[3])
{
    for (int i = 1; i < 3; i++)
        p[i] =
            fit_at(rows, (p[0].log_w + p[i].log_w) / 2, (p[0].z + p[i].z) / 2);
}

static struct fit_point fit_simplex(const struct fit_rows *rows,
                                    struct fit_point from)
{
    struct fit_point p[3] = { from, fit_at(rows, from.log_w + 0.05, from.z),
                              fit_at(rows, from.log_w, from.z * 1.5 + 0.005) };

    for (int n = 0; n < FIT_STEPS; n++) {
        fit_sort(p);
        if (fabs(p[2].log_w - p[0].log_w) + fabs(p[2].z - p[0].z) <
            FIT_CONVERGED)
            break;
        const struct fit_point over = fit_moved(rows, p, -1);
        if (over.squares < p[0].squares) {
            const struct fit_point far = fit_moved(rows, p, -2);
            p[2] = far.squares < over.squares ? far : over;
        } else if (over.squares < p[1].squares) {
            p[2] = over;
        } else {
            const struct fit_point near = fit_moved(rows, p, 0.5);
            if (near.squares < p[2].squares)
                p[2] = near;
            else
                fit_shrink(rows, p);
        }
    }
    fit_sort(p);
    return p[0];
}

/* From the peak with the damping that fits it best. */
static struct fit_point fit_search(const struct fit_rows *rows, double peak_hz)
{
    static const double damping[] = { 0.005, 0.02, 0.07, 0.2, 0.5 };
    struct fit_point best = { .squares = HUGE_VAL };

    for (unsigned i = 0; i < sizeof damping / sizeof *damping; i++) {
        const double z = damping[i];
        const double log_w =
            double_log(2 * DOUBLE_PI * peak_hz / sqrt(1 - z * z));
        const struct fit_point point = fit_at(rows, log_w, z);
        if (point.squares < best.squares)
            best = point;
    }
    return fit_simplex(rows, best);
}

/* From the peak of the periodogram on. */
static struct fit_point fit_vibration(const struct fit_rows *rows,
                                      double even[FIT_GRID])
{
    const double most_hz = fmin(FIT_GRID, rows->count) / (4 * rows->span_s);

    fit_even(rows,
             fit_mean(rows->x, rows->count - rows->count / 8 - 1, rows->count),
             even);
    return fit_search(rows, fit_peak(even, rows->span_s, most_hz));
}

/* Share of the squares about c that the model explains. */
static double fit_explained(const struct fit_rows *rows,
                            const struct fit_model *model)
{
    double plain = 0;

    for (uint32_t i = 0; i < rows->count; i++)
        plain += (rows->x[i] - model->c) * (rows->x[i] - model->c);
    return plain > 0 ? 1 - model->squares / plain : 0;
}

/* --- all of it --------------------------------------------------------------------------- */

static int fit_judge(const struct fit_rows *rows, struct plan_shaper_fit *fit,
                     struct plan_error *error)
{
    const double periods = rows->span_s * fit->frequency_hz;

    if (!(fit->explained >= FIT_EXPLAINED))
        return fit_refuse(error,
                          "no vibration stands out in the recording, expected "
                          "one that swings freely after a step");
    if (fit->damping >= FIT_DAMPING_MAX)
        return fit_refuse(error,
                          "what is recorded comes to rest without swinging, "
                          "expected a vibration: such an axis needs no shaper");
    if (!(periods >= 1.5))
        return fit_refuse(error,
                          "the recording has less than one and a half periods "
                          "of the vibration, expected a longer one");
    if (!(rows->count >= 4 * periods))
        return fit_refuse(error,
                          "the recording has less than four rows in a period "
                          "of the vibration, expected a higher rate");
    return MOTION_OK;
}

static int fit_rows_of(const double t_s[], const double x[], uint32_t count,
                       struct fit_rows *rows, struct plan_error *error)
{
    if (count < PLAN_SHAPER_FIT_ROWS_MIN || count > PLAN_SHAPER_FIT_ROWS_MAX) {
        (void)plan_error_set(error, MOTION_E_ARG, (struct plan_place){ 0, 0 },
                             "there are %u rows, expected 16 .. 200000", count);
        return MOTION_E_ARG;
    }
    for (uint32_t i = 0; i < count; i++)
        if (!isfinite(t_s[i]) || !isfinite(x[i]) || fabs(x[i]) > 1e100 ||
            fabs(t_s[i]) > 1e12 || (i > 0 && !(t_s[i] > t_s[i - 1])))
            return fit_refuse(error, "the times do not rise from row to row, "
                                     "or a number is not finite");
    const uint32_t first = fit_first(x, count);
    *rows = (struct fit_rows){ t_s + first, x + first, count - first,
                               t_s[count - 1] - t_s[first] };
    return rows->count < PLAN_SHAPER_FIT_ROWS_MIN
               ? fit_refuse(error, "the recording ends where the axis begins "
                                   "to swing, expected a longer one")
               : MOTION_OK;
}

/* The same of what a vibration leaves, which `left` has room for. */
static void fit_second(const struct fit_rows *rows,
                       const struct fit_point *point,
                       const struct fit_model *model, double left[],
                       double even[FIT_GRID], struct plan_shaper_fit *fit)
{
    struct fit_rows rest = *rows;
    double basis[3];

    for (uint32_t i = 0; i < rows->count; i++) {
        fit_basis(rows, i, double_exp(point->log_w), point->z, basis);
        left[i] =
            rows->x[i] - model->c - model->a * basis[1] - model->b * basis[2];
    }
    rest.x = left;
    const struct fit_point other = fit_vibration(&rest, even);
    const struct fit_model swing =
        fit_linear(&rest, double_exp(other.log_w), other.z);
    const double amplitude = double_hypot(swing.a, swing.b);
    if (fit_explained(&rest, &swing) < FIT_EXPLAINED ||
        other.z >= FIT_DAMPING_MAX || amplitude < FIT_SECOND * fit->amplitude)
        return;
    fit->second_hz = double_exp(other.log_w) / (2 * DOUBLE_PI);
    fit->second_damping = other.z;
    fit->second_amplitude = amplitude;
}

int plan_shaper_fit(const double t_s[], const double x[], uint32_t count,
                    struct plan_shaper_fit *fit, struct plan_error *error)
{
    struct fit_rows rows = { .count = 0 };
    double *even;
    int err = fit_rows_of(t_s, x, count, &rows, error);

    if (err < 0)
        return err;
    even = malloc((FIT_GRID + (size_t)rows.count) * sizeof *even);
    if (even == NULL)
        return plan_error_set(error, MOTION_E_FULL, (struct plan_place){ 0, 0 },
                              "no memory for the fit");
    const struct fit_point point = fit_vibration(&rows, even);
    const struct fit_model model =
        fit_linear(&rows, double_exp(point.log_w), point.z);
    *fit = (struct plan_shaper_fit){
        .frequency_hz = double_exp(point.log_w) / (2 * DOUBLE_PI),
        .damping = point.z,
        .amplitude = double_hypot(model.a, model.b),
        .settled = model.c,
        .rms = sqrt(model.squares / rows.count),
        .explained = fit_explained(&rows, &model),
        .from_s = rows.t_s[0],
        .rows = rows.count,
    };
    err = fit_judge(&rows, fit, error);
    if (err == MOTION_OK)
        fit_second(&rows, &point, &model, even + FIT_GRID, even, fit);
    free(even);
    return err;
}
