/* sim/identify/servo_fit.c - see servo_fit.h. */
#include "sim/identify/servo_fit.h"

#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"
#include "sim/physics/matrix.h"
#include "sim/util.h"

#define FIT_ROUNDS       25
#define FIT_ROUNDS_SHORT 3
#define FIT_ENOUGH       1e-3 /* a round that gains less is the last */
#define FIT_WHITE        1.5  /* rows that say one thing: noise is left */
#define FIT_LAMBDA       1e-3
#define FIT_LAMBDA_MAX   1e8
#define FIT_WORTH        0.95 /* what is left, for a model with more to it */
#define FIT_STIFF_HZ     150.0
#define FIT_GRID         7
#define FIT_GRID_LOW_HZ  2.0
#define FIT_GRID_ROWS    12000 /* that the search of the grid looks at */
#define FIT_CANDIDATES   2
#define FIT_PLAYS        350.0 /* about, for the progress */
#define FIT_SMOOTH       16    /* rows between the differences of a speed */
#define FIT_CORRELATED   2000  /* rows */
#define FIT_DITHER       0.5   /* counts rms */
#define FIT_UNSEEN       0.25  /* counts */
#define BIT(parameter)   (1u << (parameter))

static const unsigned fit_rigid = BIT(SIM_MODEL_BANDWIDTH) |
                                  BIT(SIM_MODEL_LOOP_DAMPING) |
                                  BIT(SIM_MODEL_DELAY);
static const unsigned fit_stiff =
    BIT(SIM_MODEL_FRICTION) | BIT(SIM_MODEL_VISCOUS);
static const unsigned fit_resonance =
    BIT(SIM_MODEL_INERTIA) | BIT(SIM_MODEL_FREQUENCY);
static const unsigned fit_compliant =
    BIT(SIM_MODEL_INERTIA) | BIT(SIM_MODEL_FREQUENCY) |
    BIT(SIM_MODEL_LOAD_DAMPING) | BIT(SIM_MODEL_BACKLASH);

/* A parameter is searched as its logarithm, or in a unit of its own. */
struct fit_scale {
    bool is_log;
    double low, high;
    double step; /* of a difference, in what is searched */
};
static const struct fit_scale fit_scale[SIM_MODEL_PARAMETERS] = {
    [SIM_MODEL_BANDWIDTH] = { true, 0.1, 200, 0.01 },
    [SIM_MODEL_LOOP_DAMPING] = { true, 0.1, 2, 0.02 },
    [SIM_MODEL_DELAY] = { false, 0, SIM_MODEL_DELAY_MAX, 0.02 },
    [SIM_MODEL_INERTIA] = { true, 0.01, 1000, 0.02 },
    [SIM_MODEL_FREQUENCY] = { true, 0.1, 500, 0.005 },
    [SIM_MODEL_LOAD_DAMPING] = { false, 0, 1, 0.002 },
    [SIM_MODEL_FRICTION] = { false, 0, 1e12, 0.005 },
    [SIM_MODEL_VISCOUS] = { false, 0, 1000, 0.02 },
    [SIM_MODEL_BACKLASH] = { false, 0, 1e12, 0.1 },
};
static const struct fit_scale fit_scale_velocity_loop = { true, 1, 1000, 0.02 };

struct fit {
    struct sim_model_run run;
    struct fit_scale scale[SIM_MODEL_PARAMETERS];
    double unit[SIM_MODEL_PARAMETERS]; /* of those that are not logarithms */
    bool loaded;
    double value[SIM_MODEL_PARAMETERS];
    double cost; /* of it: sum of squares */
    double deviation[SIM_MODEL_PARAMETERS];
    double *model; /* rows; of the last play */
    double *rest;  /* rows: model less recording, at `value` */
    double *work;  /* rows */
    double *slope[SIM_MODEL_PARAMETERS];
    unsigned plays;
    bool ended;
    sim_fit_progress *progress;
    void *context;
};

/* ---- the model ---- */

/* Infinite where the model refuses. */
static double fit_play(struct fit *self, const double value[])
{
    double sum = 0;

    self->plays++;
    if (self->progress != NULL && !self->ended)
        self->ended =
            !self->progress(self->context, fmin(0.99, self->plays / FIT_PLAYS));
    if (self->ended || sim_model_play(&self->run, value, self->loaded,
                                      self->model, self->work) < 0)
        return INFINITY;
    for (uint32_t i = 0; i < self->run.rows; i++) {
        const double off = self->model[i] - self->run.actual[i];
        sum += off * off;
    }
    return isfinite(sum) ? sum : INFINITY;
}

/* What model[] is, as what is left at `value`. */
static void fit_keep(struct fit *self, const double value[], double cost)
{
    memcpy(self->value, value, sizeof self->value);
    self->cost = cost;
    for (uint32_t i = 0; i < self->run.rows; i++)
        self->rest[i] = self->model[i] - self->run.actual[i];
}

static double fit_moved(const struct fit *self, enum sim_model_parameter of,
                        double value, double by)
{
    const struct fit_scale *const scale = &self->scale[of];
    const double to =
        scale->is_log ? value * double_exp(by) : value + by * self->unit[of];

    return fmin(fmax(to, scale->low), scale->high);
}

/* Forward, at the upper end of its range backward. */
static double fit_step(const struct fit *self, enum sim_model_parameter of,
                       double *moved)
{
    const double value = self->value[of];
    double by = self->scale[of].step;

    *moved = fit_moved(self, of, value, by);
    if (*moved >= self->scale[of].high) {
        by = -by;
        *moved = fit_moved(self, of, value, by);
    }
    return by;
}

static bool fit_slopes(struct fit *self, unsigned free)
{
    for (unsigned p = 0; p < SIM_MODEL_PARAMETERS; p++) {
        double value[SIM_MODEL_PARAMETERS], by;
        if (!(free & BIT(p)))
            continue;
        memcpy(value, self->value, sizeof value);
        by = fit_step(self, p, &value[p]);
        if (!isfinite(fit_play(self, value)))
            return false;
        for (uint32_t i = 0; i < self->run.rows; i++)
            self->slope[p][i] =
                (self->model[i] - self->run.actual[i] - self->rest[i]) / by;
    }
    return true;
}

/* ---- Levenberg and Marquardt ---- */

struct fit_normal {
    int count;
    unsigned of[SIM_MODEL_PARAMETERS];
    double matrix[SIM_MODEL_PARAMETERS * SIM_MODEL_PARAMETERS];
    double gradient[SIM_MODEL_PARAMETERS];
};

static double fit_dot(const struct fit *self, const double *a, const double *b)
{
    double sum = 0;

    for (uint32_t i = 0; i < self->run.rows; i++)
        sum += a[i] * b[i];
    return sum;
}

static void fit_normal(const struct fit *self, unsigned free,
                       struct fit_normal *normal)
{
    normal->count = 0;
    for (unsigned p = 0; p < SIM_MODEL_PARAMETERS; p++)
        if (free & BIT(p))
            normal->of[normal->count++] = p;
    for (int i = 0; i < normal->count; i++) {
        const double *const row = self->slope[normal->of[i]];
        normal->gradient[i] = fit_dot(self, row, self->rest);
        for (int j = 0; j < normal->count; j++)
            normal->matrix[i * normal->count + j] =
                fit_dot(self, row, self->slope[normal->of[j]]);
    }
}

/* The values one step on; false when the matrix has no solution. */
static bool fit_solve(const struct fit *self, const struct fit_normal *normal,
                      double lambda, double value[])
{
    const int n = normal->count;
    double matrix[SIM_MODEL_PARAMETERS * SIM_MODEL_PARAMETERS];
    double step[SIM_MODEL_PARAMETERS];

    memcpy(matrix, normal->matrix, sizeof matrix);
    for (int i = 0; i < n; i++) {
        const double own = normal->matrix[i * n + i];
        matrix[i * n + i] = own > 0 ? own * (1 + lambda) : 1;
        step[i] = -normal->gradient[i];
    }
    if (!sim_cholesky(matrix, n))
        return false;
    sim_cholesky_solve(matrix, n, step);
    memcpy(value, self->value, sizeof self->value);
    for (int i = 0; i < n; i++) {
        const unsigned of = normal->of[i];
        /* a logarithm by 1 at most: what is far off is not linear */
        const double by =
            self->scale[of].is_log ? fmin(fmax(step[i], -1), 1) : step[i];
        value[of] = fit_moved(self, of, self->value[of], by);
    }
    return true;
}

/* One round: the part of the cost that it took away. */
static double fit_round(struct fit *self, unsigned free, double *lambda)
{
    struct fit_normal normal;
    double value[SIM_MODEL_PARAMETERS];
    const double before = self->cost;

    if (!fit_slopes(self, free))
        return 0;
    fit_normal(self, free, &normal);
    while (*lambda < FIT_LAMBDA_MAX && !self->ended) {
        const double cost = fit_solve(self, &normal, *lambda, value)
                                ? fit_play(self, value)
                                : INFINITY;
        if (cost < before) {
            fit_keep(self, value, cost);
            *lambda = fmax(*lambda / 10, 1e-9);
            return (before - cost) / before;
        }
        *lambda *= 8;
    }
    return 0;
}

static void fit_improve(struct fit *self, unsigned free, unsigned rounds)
{
    double lambda = FIT_LAMBDA;

    for (unsigned i = 0; i < rounds && !self->ended; i++)
        if (fit_round(self, free, &lambda) < FIT_ENOUGH)
            break;
}

/* ---- how sure it is ---- */

static double fit_rms(const struct fit *self, double cost)
{
    return sqrt(cost / self->run.rows);
}

/* How many rows in a row say one thing. */
static double fit_correlated(const struct fit *self)
{
    double sum = 1;

    for (uint32_t k = 1; k < FIT_CORRELATED && k < self->run.rows / 4; k++) {
        double product = 0;
        for (uint32_t i = k; i < self->run.rows; i++)
            product += self->rest[i] * self->rest[i - k];
        if (product < 0.05 * self->cost)
            break;
        sum += 2 * product / self->cost;
    }
    return sum;
}

/* Without noise of half a count a reading in whole counts is the target itself
 * while the lag is below a half: where all that a parameter does is less, a
 * quarter of a count of it may be missing, and in every row alike. */
static double fit_unseen(const struct fit *self, unsigned of)
{
    const double slope =
        sqrt(fit_dot(self, self->slope[of], self->slope[of]) / self->run.rows);
    const double all = self->scale[of].is_log
                           ? slope
                           : slope * self->value[of] / self->unit[of];

    return fit_rms(self, self->cost) < FIT_DITHER && all < FIT_DITHER
               ? FIT_UNSEEN / slope
               : 0;
}

static void fit_judge(struct fit *self, unsigned free)
{
    struct fit_normal normal;
    memset(self->deviation, 0, sizeof self->deviation);
    if (!fit_slopes(self, free))
        return;
    fit_normal(self, free, &normal);
    const double variance = self->cost / self->run.rows * fit_correlated(self);
    const int n = normal.count;
    for (int i = 0; i < n; i++)
        if (normal.matrix[i * n + i] <= 0)
            normal.matrix[i * n + i] = 1e-300;
    const bool solved = sim_cholesky(normal.matrix, n);
    for (int i = 0; i < n; i++) {
        double row[SIM_MODEL_PARAMETERS] = { 0 };
        const unsigned of = normal.of[i];
        row[i] = 1;
        if (solved)
            sim_cholesky_solve(normal.matrix, n, row);
        const double deviation =
            solved ? sqrt(variance * row[i]) + fit_unseen(self, of) : INFINITY;
        self->deviation[of] =
            deviation *
            (self->scale[of].is_log ? self->value[of] : self->unit[of]);
    }
}

/* ---- the three models ---- */

static void fit_begin(struct fit *self, const double value[])
{
    fit_keep(self, value, fit_play(self, value));
}

/* Like `best` when that is worse than this. */
static void fit_take_better(struct fit *best, const struct fit *self)
{
    if (self->cost < best->cost) {
        memcpy(best->value, self->value, sizeof best->value);
        best->cost = self->cost;
        best->loaded = self->loaded;
    }
}

static void fit_try(struct fit *self, struct fit *best, const double value[],
                    unsigned free, unsigned rounds)
{
    fit_begin(self, value);
    if (isfinite(self->cost))
        fit_improve(self, free, rounds);
    fit_take_better(best, self);
}

/* From several bandwidths: the valley is narrow. */
static void fit_find_rigid(struct fit *self, struct fit *best,
                           const double before[])
{
    static const double factor[] = { 1, 0.4, 2.5 };
    double value[SIM_MODEL_PARAMETERS];

    self->loaded = false;
    best->cost = INFINITY;
    for (unsigned i = 0; i < ARRAY_LEN(factor); i++) {
        memcpy(value, before, sizeof value);
        value[SIM_MODEL_BANDWIDTH] =
            fit_moved(self, SIM_MODEL_BANDWIDTH, value[SIM_MODEL_BANDWIDTH],
                      double_log(factor[i]));
        fit_try(self, best, value, fit_rigid, i == 0 ? FIT_ROUNDS : 6);
    }
}

static void fit_find_stiff(struct fit *self, struct fit *best,
                           const double rigid[], const double before[])
{
    double value[SIM_MODEL_PARAMETERS];
    const double half_rate = 0.5e9 / (double)self->run.period_ns;

    self->loaded = true;
    best->cost = INFINITY;
    memcpy(value, rigid, sizeof value);
    value[SIM_MODEL_INERTIA] = 1;
    value[SIM_MODEL_FREQUENCY] = fmin(FIT_STIFF_HZ, 0.5 * half_rate);
    value[SIM_MODEL_LOAD_DAMPING] = 0.02;
    value[SIM_MODEL_BACKLASH] = 0;
    if (before != NULL)
        memcpy(value + SIM_MODEL_RIGID, before + SIM_MODEL_RIGID,
               (SIM_MODEL_PARAMETERS - SIM_MODEL_RIGID) * sizeof *value);
    for (unsigned i = 0; i < 2; i++) {
        value[SIM_MODEL_VISCOUS] = 0;
        value[SIM_MODEL_FRICTION] = i * 0.2 * self->unit[SIM_MODEL_FRICTION];
        fit_try(self, best, value, fit_rigid | fit_stiff,
                i == 0 ? FIT_ROUNDS : 6);
    }
}

struct fit_candidate {
    double cost, value[SIM_MODEL_PARAMETERS];
};

static void fit_offer(struct fit_candidate list[FIT_CANDIDATES], double cost,
                      const double value[])
{
    for (unsigned i = 0; i < FIT_CANDIDATES; i++) {
        if (cost >= list[i].cost)
            continue;
        memmove(&list[i + 1], &list[i],
                (FIT_CANDIDATES - 1 - i) * sizeof list[0]);
        list[i].cost = cost;
        memcpy(list[i].value, value, sizeof list[i].value);
        return;
    }
}

static void fit_search_grid(struct fit *self,
                            struct fit_candidate list[FIT_CANDIDATES],
                            const double stiff[])
{
    static const double inertia[] = { 0.5, 3 };
    const double half_rate = 0.5e9 / (double)self->run.period_ns;
    const double high = fmin(120, 0.4 * half_rate);
    double value[SIM_MODEL_PARAMETERS];

    for (unsigned i = 0; i < FIT_CANDIDATES; i++)
        list[i].cost = INFINITY;
    memcpy(value, stiff, sizeof value);
    for (unsigned i = 0; i < FIT_GRID; i++)
        for (unsigned k = 0; k < ARRAY_LEN(inertia); k++) {
            value[SIM_MODEL_INERTIA] = inertia[k];
            value[SIM_MODEL_FREQUENCY] =
                FIT_GRID_LOW_HZ *
                double_exp(double_log(high / FIT_GRID_LOW_HZ) * i /
                           (FIT_GRID - 1.0));
            fit_begin(self, value);
            if (isfinite(self->cost))
                fit_improve(self, fit_resonance | BIT(SIM_MODEL_BANDWIDTH), 1);
            fit_offer(list, self->cost, self->value);
        }
}

/* A gap that is looked for from 0 is not found: its edges are. */
static void fit_find_compliant(struct fit *self, struct fit *best,
                               const double stiff[], const double before[])
{
    struct fit_candidate list[FIT_CANDIDATES];
    const unsigned free = fit_rigid | fit_stiff | fit_compliant;
    const uint32_t rows = self->run.rows;
    double value[SIM_MODEL_PARAMETERS];

    self->loaded = true;
    best->cost = INFINITY;
    self->run.rows = rows < FIT_GRID_ROWS ? rows : FIT_GRID_ROWS;
    fit_search_grid(self, list, stiff);
    self->run.rows = rows;
    if (before != NULL)
        fit_try(self, best, before, free, FIT_ROUNDS);
    for (unsigned i = 0; i < FIT_CANDIDATES && !self->ended; i++)
        if (isfinite(list[i].cost))
            fit_try(self, best, list[i].value, free, FIT_ROUNDS_SHORT);
    memcpy(value, best->value, sizeof value);
    fit_try(self, best, value, free, FIT_ROUNDS);
    memcpy(value, best->value, sizeof value);
    value[SIM_MODEL_BACKLASH] += 4 * self->unit[SIM_MODEL_BACKLASH];
    fit_try(self, best, value, free, FIT_ROUNDS);
}

/* What could as well be 0 is 0. */
static unsigned fit_prune(struct fit *self, unsigned free)
{
    static const unsigned may_be_none[] = { SIM_MODEL_FRICTION,
                                            SIM_MODEL_VISCOUS,
                                            SIM_MODEL_BACKLASH };

    fit_judge(self, free);
    for (unsigned i = 0; i < ARRAY_LEN(may_be_none); i++) {
        const unsigned of = may_be_none[i];
        double value[SIM_MODEL_PARAMETERS];
        if (!(free & BIT(of)) || self->value[of] > 3 * self->deviation[of])
            continue;
        memcpy(value, self->value, sizeof value);
        value[of] = 0;
        free &= ~BIT(of);
        fit_begin(self, value);
        fit_improve(self, free, FIT_ROUNDS_SHORT);
    }
    fit_judge(self, free);
    return free;
}

/* ---- all of it ---- */

/* The largest change of speed, per s2, over a few rows: targets are whole
 * counts. */
static double fit_acceleration(const struct sim_model_run *run)
{
    const double over_s = 1e-9 * (double)run->period_ns * FIT_SMOOTH;
    double most = 0;

    for (uint32_t i = 2 * FIT_SMOOTH; i < run->rows; i++) {
        const double bend = run->target[i] - 2 * run->target[i - FIT_SMOOTH] +
                            run->target[i - 2 * FIT_SMOOTH];
        most = fmax(most, fabs(bend) / (over_s * over_s));
    }
    return most;
}

static void fit_tell(const struct fit *self, unsigned free,
                     enum sim_fit_model model, struct sim_fit *fit)
{
    const unsigned has = model == SIM_FIT_RIGID ? fit_rigid
                         : model == SIM_FIT_STIFF
                             ? fit_rigid | fit_stiff
                             : (1u << SIM_MODEL_PARAMETERS) - 1;

    fit->model = model;
    fit->rms = fit_rms(self, self->cost);
    fit->plays = self->plays;
    for (unsigned p = 0; p < SIM_MODEL_PARAMETERS; p++) {
        const double value = self->value[p];
        const double deviation = self->deviation[p];
        fit->parameter[p] = (struct sim_fit_value){
            .value = value,
            .deviation = deviation,
            .known = (has & BIT(p)) != 0 &&
                     (!(free & BIT(p)) || deviation < 0.25 * value ||
                      p == SIM_MODEL_DELAY ||
                      (p == SIM_MODEL_LOAD_DAMPING && deviation < 0.02)),
        };
    }
}

static bool fit_shows_resonance(const struct fit *self)
{
    return self->deviation[SIM_MODEL_INERTIA] <
               0.25 * self->value[SIM_MODEL_INERTIA] &&
           self->deviation[SIM_MODEL_FREQUENCY] <
               0.25 * self->value[SIM_MODEL_FREQUENCY];
}

/* At a model that was found before; does it leave noise alone? */
static bool fit_return(struct fit *self, const struct fit *to)
{
    self->loaded = to->loaded;
    fit_begin(self, to->value);
    return isfinite(self->cost) && fit_correlated(self) < FIT_WHITE;
}

static bool fit_is_worth(const struct fit *self, const struct fit *simpler)
{
    return sqrt(self->cost) < FIT_WORTH * sqrt(simpler->cost);
}

/* The simplest model that leaves nothing, or as little as the next one; the
 * parameters that are free in it. */
static enum sim_fit_model fit_models(struct fit *self, const double before[],
                                     bool loaded, unsigned *free)
{
    struct fit rigid = *self, stiff = *self, compliant = *self;

    *free = fit_rigid;
    fit_find_rigid(self, &rigid, before);
    if ((fit_return(self, &rigid) && !loaded) || self->ended)
        return SIM_FIT_RIGID;
    self->unit[SIM_MODEL_BACKLASH] = fmax(1, 2 * fit_rms(self, rigid.cost));
    fit_find_stiff(self, &stiff, rigid.value, loaded ? before : NULL);
    const bool is_stiff = fit_return(self, &stiff);
    if (!is_stiff) {
        fit_find_compliant(self, &compliant, stiff.value,
                           loaded ? before : NULL);
        fit_return(self, &compliant);
        *free = fit_prune(self, fit_rigid | fit_stiff | fit_compliant);
        if (fit_is_worth(self, &stiff) && fit_is_worth(self, &rigid) &&
            fit_shows_resonance(self))
            return SIM_FIT_COMPLIANT;
    }
    const bool rubs = loaded || fit_is_worth(&stiff, &rigid);
    fit_return(self, rubs ? &stiff : &rigid);
    *free = rubs ? fit_rigid | fit_stiff : fit_rigid;
    return rubs ? SIM_FIT_STIFF : SIM_FIT_RIGID;
}

int sim_fit(const struct sim_model_run *run, const double before[], bool loaded,
            sim_fit_progress *progress, void *context, double *work,
            struct sim_fit *fit)
{
    const double acceleration = fit_acceleration(run);
    struct fit self = {
        .run = *run,
        .loaded = loaded,
        .model = work,
        .rest = work + run->rows,
        .work = work + (size_t)2 * run->rows,
        .progress = progress,
        .context = context,
    };

    unsigned free;

    if (run->rows < SIM_FIT_ROWS_MIN)
        return MOTION_E_ARG;
    if (!(acceleration > 0))
        return MOTION_E_RANGE;
    for (unsigned p = 0; p < SIM_MODEL_PARAMETERS; p++) {
        self.slope[p] = work + (size_t)(3 + p) * run->rows;
        self.unit[p] = 1;
    }
    memcpy(self.scale, fit_scale, sizeof self.scale);
    if (run->has_loops)
        self.scale[SIM_MODEL_LOOP_DAMPING] = fit_scale_velocity_loop;
    self.unit[SIM_MODEL_FRICTION] = acceleration;
    *fit = (struct sim_fit){ .rms_before = 0 };
    const double cost = fit_play(&self, before);
    if (!isfinite(cost))
        return MOTION_E_ARG;
    fit->rms_before = fit_rms(&self, cost);
    const enum sim_fit_model model = fit_models(&self, before, loaded, &free);
    if (!self.ended && isfinite(self.cost))
        free = fit_prune(&self, free);
    if (self.ended || !isfinite(self.cost))
        return self.ended ? MOTION_E_STATE : MOTION_E_RANGE;
    fit_tell(&self, free, model, fit);
    fit_begin(&self, self.value);
    return MOTION_OK;
}
