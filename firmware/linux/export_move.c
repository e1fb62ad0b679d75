/* firmware/linux/export_move.c - move.yaml from a plan_move; see import.h. */
#include <inttypes.h>
#include <string.h>

#include "firmware/linux/import.h"
#include "firmware/linux/number.h"
#include "motion/fixed.h"

/* Of docs/FILES.md, Which YAML. */
#define EXPORT_BYTES_MAX  (16l << 20)
#define EXPORT_VALUES_MAX 4194304

/* Ten decimals are nearer to a Q32 than half its step, five to a Q16, thirteen
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
    int64_t frame = -1;
    if (fps->den != 0 && fps->num < 1000000)
        motion_fixed_muldiv(t_ns_q12, (int64_t)fps->num,
                            (int64_t)fps->den * MOTION_FIXED_S_Q12, &frame);
    if (frame >= 0 && import_frame_ns_q12(fps, frame) == t_ns_q12)
        fprintf(file, "frame %" PRId64, frame);
    else
        export_seconds(file, t_ns_q12);
}

static void export_real(FILE *file, struct motion_real value, unsigned bits,
                        unsigned digits)
{
    int64_t fixed = 0;
    (void)motion_real_round(value, (int32_t)bits, &fixed);
    export_number(file, fixed, bits, digits);
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
        export_real(file, key->acc, 16, 5);
    }
    fputs("]\n", file);
}

static const char *const export_curve[] = {
#define EXPORT_SPELLING(name, spelling, text) [name] = spelling,
    PLAN_CURVE_LIST(EXPORT_SPELLING)
#undef EXPORT_SPELLING
};

static int export_refuse(char message[RIG_MESSAGE_MAX], uint64_t keys)
{
    snprintf(message, RIG_MESSAGE_MAX,
             "%" PRIu64 " keys make a larger move file than slew reads (16 "
             "MiB, %d values); expected fewer columns or frames",
             keys, EXPORT_VALUES_MAX);
    return -1;
}

int export_move(const struct imported *imported, const char *origin, FILE *file,
                char message[RIG_MESSAGE_MAX])
{
    const struct plan_move *move = &imported->move;
    uint64_t keys = 0;
    for (uint32_t i = 0; i < move->axis_count; i++)
        keys += move->axis[i].key_count;
    if (keys * 5 > EXPORT_VALUES_MAX)
        return export_refuse(message, keys);
    fprintf(file, "# Imported from %s by slew import.\n\n", origin);
    if (imported->fps.den == 1)
        fprintf(file, "fps: %" PRIu64 "\n", imported->fps.num);
    else if (imported->fps.den != 0)
        fprintf(file, "fps: %" PRIu64 "/%" PRIu64 "\n", imported->fps.num,
                imported->fps.den);
    fputs("axes:\n", file);
    for (uint32_t i = 0; i < move->axis_count; i++) {
        const struct plan_axis *axis = &move->axis[i];
        fprintf(file, "  %s:\n    curve: %s\n    keys:\n", axis->name,
                export_curve[axis->curve]);
        for (uint32_t k = 0; k < axis->key_count; k++)
            export_key(file, &imported->fps, &axis->key[k].key);
    }
    if (ftell(file) > EXPORT_BYTES_MAX)
        return export_refuse(message, keys);
    return 0;
}
