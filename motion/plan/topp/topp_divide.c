/* motion/plan/topp/topp_divide.c - see topp_divide.h. */
#include "motion/plan/topp/topp_divide.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/double/double_interval.h"
#include "motion/plan/topp/topp_chain.h"
#include "motion/plan/topp/topp_poly.h"

/* Steps of q' and q'' that count as none: of the largest on the path, and of
 * q' over the length of a piece, which is where rounding comes from. */
#define DIVIDE_STEP     1e-6
#define DIVIDE_ROUNDING 1e-7

/* Ends of caps and borders that are nearer to each other than this part of the path
 * are the same.  What is 30 % of a path in one cap and a part of another is not 30 % to the last
 * digit, and no law goes through a piece that is nothing but rounding. */
#define DIVIDE_SAME 1e-6

/* Of an axis's coordinates and travel: what counts as standing. */
#define DIVIDE_STILL 1e-12

/* --- the copy ---------------------------------------------------------------- */

static int divide_order(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

/* The border that is nearest to a place. */
static double divide_nearest(const double border[], uint32_t pieces, double s)
{
    const uint32_t i = double_interval_find(border, sizeof *border, pieces, s);

    return s - border[i] < border[i + 1] - s ? border[i] : border[i + 1];
}

/* Borders of the path, and ends of caps that are not as near to one of these, or to
 * each other, as to be the same. */
static double *divide_places(const struct plan_topp_request *request,
                             struct plan_pool *pool, uint32_t *count)
{
    const struct plan_topp_path *path = &request->path;
    const double first = path->border[0], last = path->border[path->pieces];
    const double least = (last - first) * DIVIDE_SAME;
    const size_t borders = (size_t)path->pieces + 1;
    size_t n = borders;
    double *at = plan_pool_take(pool, borders + 2 * (size_t)request->cap_count,
                                sizeof *at);

    if (at == NULL)
        return NULL;
    for (uint32_t i = 0; i < 2 * request->cap_count; i++) {
        const struct plan_topp_cap *cap = &request->cap[i / 2];
        const double s = i % 2 ? cap->to : cap->from;
        if (fabs(s - divide_nearest(path->border, path->pieces, s)) > least &&
            s > first && s < last)
            at[n++] = s;
    }
    qsort(at + borders, n - borders, sizeof *at, divide_order);
    memcpy(at, path->border, borders * sizeof *at);
    *count = (uint32_t)borders;
    for (size_t i = borders; i < n; i++)
        if (i == borders || at[i] - at[*count - 1] > least)
            at[(*count)++] = at[i];
    qsort(at, *count, sizeof *at, divide_order);
    --*count;
    return at;
}

/* The pieces of the path between its borders and those of caps. */
static int divide_path(const struct plan_topp_path *from,
                       struct plan_pool *pool, struct plan_topp_path *path)
{
    const size_t size = from->degree + 1, row = from->axes * size;
    uint32_t piece = 0;

    path->coef = plan_pool_take(pool, path->pieces * row, sizeof *path->coef);
    if (path->coef == NULL)
        return MOTION_E_FULL;
    for (uint32_t i = 0; i < path->pieces; i++) {
        const double middle = (path->border[i] + path->border[i + 1]) / 2;
        double *coef = path->coef + i * row;
        while (piece + 1 < from->pieces && from->border[piece + 1] <= middle)
            piece++;
        memcpy(coef, from->coef + piece * row, row * sizeof *coef);
        for (unsigned k = 0; k < from->axes; k++)
            topp_poly_shift(from->degree, coef + k * size,
                            path->border[i] - from->border[piece]);
    }
    return MOTION_OK;
}

int topp_divide(const struct plan_topp_request *request, struct plan_pool *pool,
                struct plan_topp_request *divided)
{
    struct plan_topp_cap *cap =
        plan_pool_take(pool, (size_t)request->cap_count + 1, sizeof *cap);

    *divided = *request;
    divided->cap = cap;
    divided->path.border = divide_places(request, pool, &divided->path.pieces);
    if (cap == NULL || divided->path.border == NULL)
        return MOTION_E_FULL;
    for (uint32_t i = 0; i < request->cap_count; i++)
        cap[i] = (struct plan_topp_cap){
            divide_nearest(divided->path.border, divided->path.pieces,
                           request->cap[i].from),
            divide_nearest(divided->path.border, divided->path.pieces,
                           request->cap[i].to),
            request->cap[i].speed
        };
    return divide_path(&request->path, pool, &divided->path);
}

/* --- borders ----------------------------------------------------------------- */

bool topp_divide_is_still(const struct plan_topp_path *path, uint32_t piece)
{
    const double h = path->border[piece + 1] - path->border[piece];

    for (unsigned k = 0; k < path->axes; k++) {
        const double *coef =
            path->coef + ((size_t)piece * path->axes + k) * (path->degree + 1);
        double by = 1, sum = 0;
        for (unsigned n = 1; n <= path->degree; n++)
            sum += fabs(coef[n]) * (by *= h);
        if (sum > DIVIDE_STILL * (1 + fabs(coef[0])))
            return false;
    }
    return true;
}

/* q' and q'' of all axes in shares of their limits: the largest on both sides of
 * a border, and the largest steps there. */
struct divide_sizes {
    double size[3], step[3];
};

static void divide_sizes(const struct plan_topp_request *request,
                         const struct plan_topp_path *path, uint32_t border,
                         struct divide_sizes *sizes)
{
    const double h = path->border[border] - path->border[border - 1];

    *sizes = (struct divide_sizes){ 0 };
    for (unsigned k = 0; k < path->axes; k++) {
        const struct plan_topp_limit *limit = &request->limit[k];
        const double by[3] = { 1, fmin(limit->vel_max, -limit->vel_min),
                               fmin(limit->acc_max, -limit->acc_min) };
        double before[4], after[4];
        topp_chain_powers(path, border - 1, k, h, before);
        topp_chain_powers(path, border, k, 0, after);
        for (int i = 1; i < 3; i++) {
            sizes->size[i] = fmax(
                sizes->size[i], fmax(fabs(before[i]), fabs(after[i])) / by[i]);
            sizes->step[i] =
                fmax(sizes->step[i], fabs(before[i] - after[i]) / by[i]);
        }
    }
}

static bool divide_is_capped(const struct plan_topp_request *request, double s)
{
    for (uint32_t i = 0; i < request->cap_count; i++)
        if (request->cap[i].speed == 0 && request->cap[i].from <= s &&
            request->cap[i].to >= s)
            return true;
    return false;
}

static enum topp_border divide_kind(const struct plan_topp_request *request,
                                    const struct plan_topp_path *path,
                                    uint32_t border,
                                    const struct divide_sizes *most)
{
    const double h = fmin(path->border[border] - path->border[border - 1],
                          path->border[border + 1] - path->border[border]);
    struct divide_sizes at;

    divide_sizes(request, path, border, &at);
    if (divide_is_capped(request, path->border[border]) ||
        topp_divide_is_still(path, border - 1) ||
        topp_divide_is_still(path, border) ||
        at.step[1] > DIVIDE_STEP * at.size[1] + 1e-9 * most->size[1])
        return TOPP_BORDER_STOP;
    return at.step[2] > DIVIDE_STEP * most->size[2] +
                            DIVIDE_ROUNDING * at.size[1] / h
               ? TOPP_BORDER_BENDS
               : TOPP_BORDER_SMOOTH;
}

enum topp_border *topp_divide_borders(const struct plan_topp_request *request,
                                      struct plan_pool *pool)
{
    const struct plan_topp_path *path = &request->path;
    enum topp_border *border =
        plan_pool_take(pool, (size_t)path->pieces + 1, sizeof *border);
    struct divide_sizes most = { 0 };

    if (border == NULL)
        return NULL;
    border[0] = border[path->pieces] = TOPP_BORDER_STOP;
    for (uint32_t i = 1; i < path->pieces; i++) {
        struct divide_sizes at;
        divide_sizes(request, path, i, &at);
        for (int k = 1; k < 3; k++)
            most.size[k] = fmax(most.size[k], at.size[k]);
    }
    for (uint32_t i = 1; i < path->pieces; i++)
        border[i] = divide_kind(request, path, i, &most);
    return border;
}
