/* firmware/host/exchange/export_move.c - move.yaml from a plan_move; see
 * import.h. */
#include <inttypes.h>
#include <string.h>

#include "firmware/host/base/number.h"
#include "firmware/host/exchange/import.h"
#include "firmware/host/move/move_load.h"
#include "motion/core/fixed.h"

/* Of docs/FILES.md, Which YAML. */
#define EXPORT_BYTES_MAX  (16l << 20)
#define EXPORT_VALUES_MAX 4194304

/* Ten decimals are nearer to a Q32 than half its step, thirteen
 * of a second to 2^-12 ns; at most 18 digits are read. */
static void export_number(FILE *file, int64_t value, unsigned bits,
                          unsigned digits)
{
    char text[NUMBER_MAX];
    unsigned whole = 1;
    for (uint64_t n = motion_fixed_abs(value) >> bits; n >= 10; n /= 10)
        whole++;
    if (whole + digits > 18)
        digits = 18 - whole;
    unsigned n = number_fixed(text, value, bits, digits);
    if (digits > 0) {
        while (text[n - 1] == '0')
            n--;
        if (text[n - 1] == '.')
            n--;
        text[n] = 0;
    }
    fputs(text, file);
}

/* In picoseconds and tenths of them: 10^13 / (10^9 2^12) of a unit. */
static void export_seconds(FILE *file, int64_t t_ns_q12)
{
    const int64_t second = INT64_C(10000000000000);
    int64_t whole = t_ns_q12 / MOTION_FIXED_S_Q12, part = 0;
    char text[32];
    if (t_ns_q12 < 0) {
        fputc('-', file);
        whole = -whole;
        t_ns_q12 = -t_ns_q12;
    }
    motion_fixed_muldiv(t_ns_q12 % MOTION_FIXED_S_Q12, second,
                        MOTION_FIXED_S_Q12, &part);
    if (part == second) {
        whole++;
        part = 0;
    }
    /* whole has at most 7 digits; with more than 5 there are 18 in all */
    int n = snprintf(text, sizeof text, "%" PRId64 ".%013" PRId64, whole, part);
    if (n > 19)
        text[n = 19] = 0;
    while (text[n - 1] == '0')
        text[--n] = 0;
    if (text[n - 1] == '.')
        text[--n] = 0;
    fprintf(file, "%s s", text);
}

static void export_time(FILE *file, const struct units_fps *fps,
                        int64_t t_ns_q12)
{
    int64_t micro;
    if (import_frame_at(fps, t_ns_q12, &micro) != t_ns_q12) {
        export_seconds(file, t_ns_q12);
        return;
    }
    const uint64_t size = motion_fixed_abs(micro);
    char text[32];
    int n = snprintf(text, sizeof text, "%s%" PRIu64 ".%06" PRIu64,
                     micro < 0 ? "-" : "", size / 1000000, size % 1000000);
    while (text[n - 1] == '0')
        text[--n] = 0;
    if (text[n - 1] == '.')
        text[--n] = 0;
    fprintf(file, "frame %s", text);
}

static void export_real(FILE *file, struct motion_real value, unsigned bits,
                        unsigned digits)
{
    int64_t fixed = 0;
    (void)motion_real_round(value, (int32_t)bits, &fixed);
    export_number(file, fixed, bits, digits);
}

/* "name: [dt, dp]" */
static void export_pair(FILE *file, const char *name, int64_t dt_ns_q12,
                        int64_t dp_q32)
{
    fprintf(file, "%s: [", name);
    export_seconds(file, dt_ns_q12);
    fputs(", ", file);
    export_number(file, dp_q32, 32, 10);
    fputc(']', file);
}

/* Where a handle is follows from its kind, or is written. */
static void export_handle(FILE *file, const char *name,
                          const struct plan_handle *handle)
{
    if (handle->kind == MOTION_FCURVE_FREE ||
        handle->kind == MOTION_FCURVE_ALIGNED)
        export_pair(file, name, handle->dt_ns_q12, handle->dp_q32);
}

static void export_easing(FILE *file, const struct plan_bezier_key *key)
{
    if (key->interpolation == MOTION_FCURVE_BEZIER)
        return;
    fprintf(file, ", interpolation: %s",
            move_interpolation_word[key->interpolation]);
    if (key->interpolation >= MOTION_FCURVE_SINE &&
        key->easing != MOTION_FCURVE_BY_KIND)
        fprintf(file, ", easing: %s", move_easing_word[key->easing]);
    if (key->interpolation == MOTION_FCURVE_BACK) {
        fputs(", back: ", file);
        export_number(file, key->back_q32, 32, 10);
    }
    if (key->interpolation == MOTION_FCURVE_ELASTIC) {
        fputs(", amplitude: ", file);
        export_number(file, key->amplitude_q32, 32, 10);
        fputs(", period: ", file);
        export_seconds(file, key->period_ns_q12);
    }
}

static void export_bezier_key(FILE *file, const struct units_fps *fps,
                              const struct motion_key *at,
                              const struct plan_bezier_key *key)
{
    fputs("      - {t: ", file);
    export_time(file, fps, at->t_ns_q12);
    fputs(", p: ", file);
    export_number(file, at->pos_q32, 32, 10);
    if (key->left.kind != key->right.kind)
        fprintf(file, ", handles: [%s, %s]", move_handle_word[key->left.kind],
                move_handle_word[key->right.kind]);
    else if (key->left.kind != MOTION_FCURVE_CLAMPED)
        fprintf(file, ", handles: %s", move_handle_word[key->left.kind]);
    export_handle(file, ", left", &key->left);
    export_handle(file, ", right", &key->right);
    export_easing(file, key);
    fputs("}\n", file);
}

static void export_cycles(FILE *file, const struct plan_bezier *bezier)
{
    if (bezier->before.mode == MOTION_FCURVE_ONCE &&
        bezier->after.mode == MOTION_FCURVE_ONCE)
        return;
    fprintf(file,
            "    cycles: {before: %s, before_count: %" PRIu32 ", after: %s, "
            "after_count: %" PRIu32 "}\n",
            move_cycle_word[bezier->before.mode], bezier->before.count,
            move_cycle_word[bezier->after.mode], bezier->after.count);
}

/* What is not the default, so that the file says what matters. */
static void export_bezier(FILE *file, const struct plan_bezier *bezier)
{
    if (bezier->smoothing != MOTION_FCURVE_SMOOTH_NONE)
        fprintf(file, "    smoothing: %s\n",
                move_smoothing_word[bezier->smoothing]);
    if (bezier->extrapolation != MOTION_FCURVE_HOLD)
        fprintf(file, "    extrapolation: %s\n",
                move_extrapolation_word[bezier->extrapolation]);
    export_cycles(file, bezier);
    if (bezier->has_end) {
        fputs("    until: ", file);
        export_seconds(file, bezier->end_ns_q12);
        fputc('\n', file);
    }
    if (bezier->frame_ns_q12 > 0 && bezier->value_q32 > 0) {
        export_pair(file, "    grid", bezier->frame_ns_q12, bezier->value_q32);
        fputc('\n', file);
    }
}

static void export_key(FILE *file, const struct units_fps *fps,
                       const struct motion_key *key)
{
    fputs("      - [", file);
    export_time(file, fps, key->t_ns_q12);
    fputs(", ", file);
    export_number(file, key->pos_q32, 32, 10);
    if (key->has_vel) {
        fputs(", ", file);
        export_real(file, key->vel, 32, 10);
    }
    if (key->has_acc) {
        fputs(", ", file);
        export_real(file, key->acc, 32, 10);
    }
    fputs("]\n", file);
}

static const char *const export_curve[] = {
#define EXPORT_SPELLING(name, spelling, text) [name] = spelling,
    PLAN_CURVE_LIST(EXPORT_SPELLING)
#undef EXPORT_SPELLING
};

static int export_refuse(char message[YAML_MESSAGE_MAX], uint64_t keys)
{
    snprintf(message, YAML_MESSAGE_MAX,
             "%" PRIu64 " keys make a larger move file than slew reads (16 "
             "MiB, %d values); expected fewer columns or frames",
             keys, EXPORT_VALUES_MAX);
    return -1;
}

/* A value and the list or map around it; with handles about twice three. */
static uint64_t export_values(const struct plan_axis *axis)
{
    return axis->key_count * (axis->bezier.key != NULL ? UINT64_C(28) : 5);
}

static void export_axis(FILE *file, const struct units_fps *fps,
                        const struct plan_axis *axis)
{
    const struct plan_bezier_key *handles = axis->bezier.key;
    fprintf(file, "  %s:\n    curve: %s\n", axis->name,
            export_curve[axis->curve]);
    if (axis->curve == PLAN_CURVE_BEZIER)
        export_bezier(file, &axis->bezier);
    fputs("    keys:\n", file);
    for (uint32_t k = 0; k < axis->key_count; k++)
        if (handles != NULL)
            export_bezier_key(file, fps, &axis->key[k].key, &handles[k]);
        else
            export_key(file, fps, &axis->key[k].key);
}

int export_move(const struct imported *imported, const char *origin, FILE *file,
                char message[YAML_MESSAGE_MAX])
{
    const struct plan_move *move = &imported->move;
    uint64_t keys = 0, values = 0;
    for (uint32_t i = 0; i < move->axis_count; i++) {
        keys += move->axis[i].key_count;
        values += export_values(&move->axis[i]);
    }
    if (values > EXPORT_VALUES_MAX)
        return export_refuse(message, keys);
    fprintf(file, "# %s\n\n", origin);
    if (imported->fps.den == 1)
        fprintf(file, "fps: %" PRIu64 "\n", imported->fps.num);
    else if (imported->fps.den != 0)
        fprintf(file, "fps: %" PRIu64 "/%" PRIu64 "\n", imported->fps.num,
                imported->fps.den);
    fputs("axes:\n", file);
    for (uint32_t i = 0; i < move->axis_count; i++)
        export_axis(file, &imported->fps, &move->axis[i]);
    if (ftell(file) > EXPORT_BYTES_MAX)
        return export_refuse(message, keys);
    return 0;
}
