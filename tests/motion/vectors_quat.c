/* tests/motion/vectors_quat.c - quaternions.json; see vectors.h. */
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/number/quat.h"
#include "motion/path/rotspline.h"
#include "tests/motion/path/rotspline_at.h"
#include "tests/motion/vectors_json.h"

#define KEYS_MAX 64

static int64_t q62(double a)
{
    return (int64_t)llrint(ldexp(a, 62));
}

/* Read at the edge: rounded to Q2.62 and made a unit quaternion again. */
static bool read_quat(const double a[4], struct motion_quat *q)
{
    return motion_quat_unit(
               (const int64_t[]){ q62(a[0]), q62(a[1]), q62(a[2]), q62(a[3]) },
               q) == MOTION_OK;
}

static int read_quats(const cJSON *list, struct motion_quat *q)
{
    const cJSON *item;
    double a[4];
    int n = 0;

    cJSON_ArrayForEach(item, list)
    {
        if (n == KEYS_MAX || !vectors_numbers(item, 4, a) ||
            !read_quat(a, &q[n++]))
            return -1;
    }
    return n;
}

/* Largest component of the difference, whichever sign is nearer. */
static double quat_error(struct motion_quat got, const double want[4])
{
    const double g[4] = { ldexp((double)got.w, -62), ldexp((double)got.x, -62),
                          ldexp((double)got.y, -62),
                          ldexp((double)got.z, -62) };
    double same = 0, other = 0;

    for (int i = 0; i < 4; i++) {
        same = fmax(same, fabs(g[i] - want[i]));
        other = fmax(other, fabs(g[i] + want[i]));
    }
    return fmin(same, other);
}

static bool slerp_case(const cJSON *item, struct vectors_row *row)
{
    const cJSON *const x = cJSON_GetObjectItemCaseSensitive(item, "x");
    const cJSON *const want = cJSON_GetObjectItemCaseSensitive(item, "q");
    struct motion_quat key[2], q;
    double a[4], b[4];

    if (!vectors_numbers(cJSON_GetObjectItemCaseSensitive(item, "q0"), 4, a) ||
        !vectors_numbers(cJSON_GetObjectItemCaseSensitive(item, "q1"), 4, b) ||
        !read_quat(a, &key[0]) || !read_quat(b, &key[1]) ||
        cJSON_GetArraySize(x) != cJSON_GetArraySize(want))
        return false;
    for (int i = 0; i < cJSON_GetArraySize(x); i++) {
        const double at = cJSON_GetNumberValue(cJSON_GetArrayItem(x, i));
        if (!vectors_numbers(cJSON_GetArrayItem(want, i), 4, a) ||
            motion_quat_slerp(key[0], key[1], q62(at), &q) < 0)
            return false;
        vectors_worst(&row->worst_p, quat_error(q, a));
    }
    return true;
}

static bool squad_case(const cJSON *item, struct vectors_row *row)
{
    const cJSON *const rows = cJSON_GetObjectItemCaseSensitive(item, "rows");
    struct motion_quat key[KEYS_MAX], inner[KEYS_MAX], want[KEYS_MAX], q;
    const cJSON *line;
    double a[5];
    const int n =
        read_quats(cJSON_GetObjectItemCaseSensitive(item, "keys"), key);

    if (n < 2 ||
        read_quats(cJSON_GetObjectItemCaseSensitive(item, "inner"), want) != n)
        return false;
    for (int i = 1; i < n; i++)
        if (motion_quat_dot_q62(key[i - 1], key[i]) < 0)
            key[i] = motion_quat_neg(key[i]);
    if (motion_quat_squad_inner(key, (uint32_t)n, inner) < 0)
        return false;
    for (int i = 0; i < n; i++) {
        const double w[4] = { ldexp((double)want[i].w, -62),
                              ldexp((double)want[i].x, -62),
                              ldexp((double)want[i].y, -62),
                              ldexp((double)want[i].z, -62) };
        vectors_worst(&row->worst_p, quat_error(inner[i], w));
    }
    cJSON_ArrayForEach(line, rows)
    {
        if (!vectors_numbers(line, 5, a))
            return false;
        int i = (int)floor(a[0]);
        i = i > n - 2 ? n - 2 : i;
        if (motion_quat_squad(&key[i], &inner[i], q62(a[0] - i), &q) < 0)
            return false;
        vectors_worst(&row->worst_p, quat_error(q, a + 1));
    }
    return true;
}

/* Largest of a list of vectors, at least 1. */
static double largest(const cJSON *list)
{
    const cJSON *item;
    double most = 1, a[3];

    cJSON_ArrayForEach(item, list)
    {
        if (vectors_numbers(item, 3, a))
            most = fmax(most, fmax(fabs(a[0]), fmax(fabs(a[1]), fabs(a[2]))));
    }
    return most;
}

static double vec_error(struct motion_vec got, const double want[3])
{
    double error = 0;

    for (int i = 0; i < 3; i++)
        vectors_worst(&error, fabs(vectors_double(got.x[i]) - want[i]));
    return error;
}

static bool read_rotation_keys(const cJSON *item, struct motion_rotkey *key,
                               int *count)
{
    const cJSON *const t = cJSON_GetObjectItemCaseSensitive(item, "t");
    struct motion_quat q[KEYS_MAX];

    *count = read_quats(cJSON_GetObjectItemCaseSensitive(item, "keys"), q);
    if (*count < 1 || cJSON_GetArraySize(t) != *count)
        return false;
    for (int i = 0; i < *count; i++) {
        const double at = cJSON_GetNumberValue(cJSON_GetArrayItem(t, i));
        key[i] =
            (struct motion_rotkey){ .t_ns_q12 = (int64_t)llrint(at * 4096e9),
                                    .q = q[i] };
    }
    return true;
}

/* The generator stops after 10 rounds, settled or not. */
static bool rotation_spline_case(const cJSON *item, struct vectors_row *row)
{
    const cJSON *const x = cJSON_GetObjectItemCaseSensitive(item, "x");
    const cJSON *const want = cJSON_GetObjectItemCaseSensitive(item, "q");
    const cJSON *const omega =
        cJSON_GetObjectItemCaseSensitive(item, "omega_body");
    const cJSON *const alpha =
        cJSON_GetObjectItemCaseSensitive(item, "alpha_body");
    struct motion_rotkey key[KEYS_MAX];
    struct motion_rotspline spline;
    int count;

    if (!read_rotation_keys(item, key, &count) ||
        motion_rotspline_plan(&spline, key, (uint32_t)count,
                              MOTION_ROTSPLINE_CHORD, MOTION_ROTSPLINE_CHORD,
                              10) < 0)
        return false;
    for (int i = 0; i < cJSON_GetArraySize(x); i++) {
        const double at = cJSON_GetNumberValue(cJSON_GetArrayItem(x, i));
        struct motion_vec rate, acc;
        struct motion_quat q;
        double a[4], v[3], w[3];

        if (!vectors_numbers(cJSON_GetArrayItem(want, i), 4, a) ||
            !vectors_numbers(cJSON_GetArrayItem(omega, i), 3, v) ||
            !vectors_numbers(cJSON_GetArrayItem(alpha, i), 3, w))
            return false;
        rotspline_at(&spline, (int64_t)llrint(at * 4096e9), &q, &rate, &acc);
        vectors_worst(&row->worst_p, quat_error(q, a));
        vectors_worst(&row->worst_v, vec_error(rate, v) / largest(omega));
        vectors_worst(&row->worst_a, vec_error(acc, w) / largest(alpha));
    }
    return true;
}

static const struct {
    const char *kind;
    bool (*run)(const cJSON *item, struct vectors_row *row);
} methods[] = {
    { "slerp", slerp_case },
    { "squad", squad_case },
    { "rotation_spline_c2", rotation_spline_case },
};

int vectors_quaternions(const cJSON *file, struct vectors_row *rows,
                        int capacity)
{
    const cJSON *item;
    int count = 0;

    cJSON_ArrayForEach(item, cJSON_GetObjectItemCaseSensitive(file, "cases"))
    {
        const char *const kind = vectors_text(item, "kind");
        struct vectors_row *row = NULL;

        for (size_t i = 0; i < sizeof methods / sizeof *methods; i++) {
            if (strcmp(kind, methods[i].kind) != 0)
                continue;
            row = vectors_row_of(rows, capacity, &count, kind, 1e-8);
            if (row == NULL || !methods[i].run(item, row))
                return -1;
            row->cases++;
        }
        if (row == NULL)
            return -1;
    }
    vectors_judge(rows, count);
    return count;
}
