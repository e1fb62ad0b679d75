/* motion/plan/topp/topp_grid.c - see topp_grid.h. */
#include "motion/plan/topp/topp_grid.h"

#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/double/double_interval.h"
#include "motion/plan/topp/topp_time.h"

/* Of the intervals, which are placed by time, the others by w. */
#define GRID_BY_TIME 0.7

static int grid_allocate(struct topp_grid *grid, struct plan_pool *pool,
                         uint32_t intervals)
{
    grid->intervals = intervals;
    grid->piece = plan_pool_take(pool, intervals, sizeof *grid->piece);
    grid->w = plan_pool_take(pool, (size_t)intervals + 1, sizeof *grid->w);
    return grid->piece && grid->w ? MOTION_OK : MOTION_E_FULL;
}

/* Where intervals go: how many of `all` up to each point of a grid. */
struct grid_measure {
    uint32_t points;
    double *w, *m;
};

double topp_grid_time(const struct topp_barrier *barrier, uint32_t i)
{
    double z[3];

    topp_barrier_z(barrier, i, z);
    return topp_time(z, barrier->w[i + 1] - barrier->w[i]);
}

/* By the time of a law. */
static int grid_measure_time(const struct topp_barrier *barrier,
                             struct plan_pool *pool,
                             struct grid_measure *measure)
{
    const uint32_t n = barrier->intervals;
    double all = 0;

    *measure = (struct grid_measure){ .points = n + 1 };
    measure->w = plan_pool_take(pool, (size_t)n + 1, sizeof *measure->w);
    measure->m = plan_pool_take(pool, (size_t)n + 1, sizeof *measure->m);
    if (measure->w == NULL || measure->m == NULL)
        return MOTION_E_FULL;
    for (uint32_t i = 0; i < n; i++)
        all += topp_grid_time(barrier, i);
    for (uint32_t i = 0; i < n; i++) {
        const double h = barrier->w[i + 1] - barrier->w[i];
        measure->w[i + 1] = barrier->w[i + 1];
        measure->m[i + 1] = measure->m[i] + (1 - GRID_BY_TIME) * h +
                            GRID_BY_TIME * topp_grid_time(barrier, i) / all;
    }
    return MOTION_OK;
}

/* By w, with all borders of pieces. */
static int grid_measure_even(const struct topp_chain *chain,
                             struct plan_pool *pool,
                             struct grid_measure *measure)
{
    const uint32_t pieces = chain->last - chain->first + 1;

    *measure = (struct grid_measure){ .points = pieces + 1 };
    measure->w = plan_pool_take(pool, (size_t)pieces + 1, sizeof *measure->w);
    measure->m = plan_pool_take(pool, (size_t)pieces + 1, sizeof *measure->m);
    if (measure->w == NULL || measure->m == NULL)
        return MOTION_E_FULL;
    for (uint32_t i = 1; i < pieces; i++)
        measure->w[i] =
            topp_chain_w(chain, chain->path.border[chain->first + i]);
    measure->w[pieces] = 1;
    memcpy(measure->m, measure->w, ((size_t)pieces + 1) * sizeof *measure->m);
    return MOTION_OK;
}

static double grid_interpolate(const double x[], const double y[],
                               uint32_t points, double at)
{
    const uint32_t low = double_interval_find(x, sizeof *x, points - 1, at);
    const uint32_t high = low + 1;

    return x[high] > x[low] ? y[low] + (y[high] - y[low]) * (at - x[low]) /
                                           (x[high] - x[low])
                            : y[low];
}

/* A new grid of about so many intervals. */
static int grid_place(const struct topp_chain *chain, double intervals,
                      double per_piece, const struct grid_measure *measure,
                      struct plan_pool *pool, struct topp_grid *grid)
{
    const uint32_t pieces = chain->last - chain->first + 1, n = measure->points;
    uint32_t *count = plan_pool_take(pool, pieces, sizeof *count), at = 0,
             all = 0;
    double *w = plan_pool_take(pool, (size_t)pieces + 1, sizeof *w);
    int err = count && w ? MOTION_OK : MOTION_E_FULL;

    for (uint32_t i = 0; err == MOTION_OK && i < pieces; i++) {
        double from, to;
        w[i + 1] =
            i + 1 == pieces
                ? 1
                : topp_chain_w(chain, chain->path.border[chain->first + i + 1]);
        from = grid_interpolate(measure->w, measure->m, n, w[i]);
        to = grid_interpolate(measure->w, measure->m, n, w[i + 1]);
        count[i] = (uint32_t)fmax(ceil(intervals * (to - from)), per_piece);
        all += count[i];
    }
    if (err == MOTION_OK)
        err = grid_allocate(grid, pool, all);
    for (uint32_t i = 0; err == MOTION_OK && i < pieces; i++) {
        const double from = grid_interpolate(measure->w, measure->m, n, w[i]);
        const double to = grid_interpolate(measure->w, measure->m, n, w[i + 1]);
        for (uint32_t k = 0; k < count[i]; k++, at++) {
            grid->piece[at] = chain->first + i;
            grid->w[at] =
                k == 0 ? w[i]
                       : grid_interpolate(measure->m, measure->w, n,
                                          from + (to - from) * k / count[i]);
        }
    }
    if (err == MOTION_OK)
        grid->w[at] = 1;
    return err;
}

int topp_grid_even(const struct topp_chain *chain, double intervals,
                   double per_piece, struct plan_pool *pool,
                   struct topp_grid *grid)
{
    struct grid_measure measure;
    const int err = grid_measure_even(chain, pool, &measure);

    return err < 0
               ? err
               : grid_place(chain, intervals, per_piece, &measure, pool, grid);
}

int topp_grid_by_time(const struct topp_barrier *barrier, double intervals,
                      double per_piece, struct plan_pool *pool,
                      struct topp_grid *grid)
{
    struct grid_measure measure;
    const int err = grid_measure_time(barrier, pool, &measure);

    return err < 0 ? err
                   : grid_place(barrier->chain, intervals, per_piece, &measure,
                                pool, grid);
}
