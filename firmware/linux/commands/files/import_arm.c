/* firmware/linux/commands/files/import_arm.c - see import_arm.h. */
#include "firmware/linux/commands/files/import_arm.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/commands/rig_text.h"
#include "motion/double/double_math.h"
#include "motion/plan/rig/plan_arm.h"

#define ARM_TEXT_MAX   4096
#define ARM_NUMBER_MAX 40
#define ARM_PLACES     200
/* Angles of few digits (3.1416) are off by up to 8e-6; what a table of right angles
 * may be off by grows with the arm. */
#define ARM_SNAP    2e-5 /* rad */
#define ARM_OFF     5e-5 /* of the reach */
#define ARM_OFF_MM  0.05 /* but this is always taken */
#define ARM_OFF_DEG 0.01
#define ARM_SLIDE   1000 /* mm, that a joint is tried to */

/* ---- text ---------------------------------------------------------------- */

struct arm_text {
    char text[ARM_TEXT_MAX];
    size_t used;
};

static void arm_put(struct arm_text *text, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void arm_put(struct arm_text *text, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    const int more = vsnprintf(text->text + text->used,
                               ARM_TEXT_MAX - text->used, format, arguments);
    va_end(arguments);
    if (more > 0 && text->used + (size_t)more < ARM_TEXT_MAX)
        text->used += (size_t)more;
}

/* Without zeros at its end, and no -0. */
static const char *arm_number(char out[ARM_NUMBER_MAX], double value,
                              int decimals)
{
    snprintf(out, ARM_NUMBER_MAX, "%.*f", decimals, value);
    size_t length = strlen(out);
    while (length > 0 && out[length - 1] == '0')
        out[--length] = 0;
    if (length > 0 && out[length - 1] == '.')
        out[--length] = 0;
    if (strcmp(out, "-0") == 0)
        memcpy(out, "0", 2);
    return out;
}

static void arm_put_value(struct arm_text *text, const char *name, double value,
                          int decimals, const char *unit)
{
    char number[ARM_NUMBER_MAX];

    if (strcmp(arm_number(number, value, decimals), "0") != 0)
        arm_put(text, ", %s: %s %s", name, number, unit);
}

static void arm_put_vector(struct arm_text *text, const char *name,
                           const double v[3], int decimals, const char *unit)
{
    char number[3][ARM_NUMBER_MAX];

    for (int i = 0; i < 3; i++)
        (void)arm_number(number[i], v[i], decimals);
    arm_put(text, "%s: [%s%s, %s%s, %s%s]", name, number[0], unit, number[1],
            unit, number[2], unit);
}

static void arm_put_rows(struct arm_text *text, const struct urdf_arm *arm,
                         const char *newline)
{
    arm_put(text, "    joints:%s", newline);
    for (uint32_t i = 0; i < arm->rows; i++) {
        const struct urdf_row *row = &arm->row[i];
        arm_put(text, "      - {axis: %s", row->joint->name);
        arm_put_value(text, "theta", row->theta / DOUBLE_RADIAN, 9, "deg");
        arm_put_value(text, "d", row->d, 6, "mm");
        arm_put_value(text, "a", row->a, 6, "mm");
        arm_put_value(text, "alpha", row->alpha / DOUBLE_RADIAN, 9, "deg");
        arm_put(text, "}%s", newline);
    }
}

static void arm_write(const struct urdf_arm *arm, const char *newline,
                      struct arm_text *text)
{
    text->used = 0;
    arm_put(text, "%skinematics:%s  arm:%s", newline, newline, newline);
    if (arm->has_base) {
        arm_put(text, "    base: {");
        arm_put_vector(text, "position", arm->base, 6, " mm");
        arm_put_vector(text, ", z", arm->z, 9, "");
        arm_put_vector(text, ", x", arm->x, 9, "");
        arm_put(text, "}%s", newline);
    }
    arm_put_rows(text, arm, newline);
    arm_put(text, "    tool: {");
    arm_put_vector(text, "position", arm->tool, 6, " mm");
    arm_put_vector(text, ", view", arm->view, 9, "");
    arm_put_vector(text, ", up", arm->up, 9, "");
    arm_put(text, "}%s", newline);
}

/* ---- proof --------------------------------------------------------------- */

static double arm_draw(uint64_t *state)
{
    *state =
        *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return ldexp((double)(*state >> 11), -52) - 1;
}

static double arm_between(const double a[3], const struct plan_jet_vec *b)
{
    double square = 0;

    for (int i = 0; i < 3; i++)
        square += (a[i] - b->x[i].p) * (a[i] - b->x[i].p);
    return sqrt(square);
}

/* The tool by the table that slew has read, against the description. */
static void arm_compare(const struct plan_arm *arm, struct import_arm *self)
{
    uint64_t state = 1;

    self->off_mm = self->off_deg = 0;
    for (int n = 0; n < ARM_PLACES; n++) {
        struct plan_jet jet[MOTION_ARM_JOINTS_MAX];
        double joint[MOTION_ARM_JOINTS_MAX];
        struct plan_rig_camera camera;
        struct urdf_tip tip;
        for (uint32_t i = 0; i < arm->arm.count; i++) {
            joint[i] = arm_draw(&state) *
                       (arm->arm.joint[i].is_prismatic ? ARM_SLIDE : DOUBLE_PI);
            jet[i] = plan_jet_of(joint[i]);
        }
        urdf_tip(&self->chain, joint, &tip);
        plan_arm_camera(arm, jet, &camera);
        self->off_mm = fmax(self->off_mm, arm_between(tip.at, &camera.pupil));
        self->off_deg = fmax(self->off_deg,
                             fmax(arm_between(tip.view, &camera.frame.forward),
                                  arm_between(tip.up, &camera.frame.up)) /
                                 DOUBLE_RADIAN);
    }
}

static double arm_may_be_off_mm(const struct urdf_chain *chain)
{
    double reach = 0;

    for (uint32_t i = 0; i < chain->joints; i++) {
        const double *at = chain->joint[i]->origin;
        reach += 1000 * sqrt(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]) +
                 (chain->joint[i]->slides ? ARM_SLIDE : 0);
    }
    return fmax(ARM_OFF_MM, ARM_OFF * reach);
}

/* Is the rig of this text read, with its tool where it should be? */
static bool arm_holds(struct import_arm *self, const char *path,
                      const struct move_text *text)
{
    char message[YAML_MESSAGE_MAX];
    struct move_text_files over;
    static struct rig rig;

    move_text_over(&over, &disk_files, path, text);
    if (rig_load(&over.files, path, &rig, message) < 0) {
        snprintf(self->why, sizeof self->why, "%.200s", message);
        return false;
    }
    arm_compare(&rig.kinematics->arm, self);
    rig_free(&rig);
    const double most_mm = arm_may_be_off_mm(&self->chain);
    const bool holds = self->off_mm <= most_mm && self->off_deg <= ARM_OFF_DEG;
    self->why[0] = 0;
    if (!holds)
        snprintf(self->why, sizeof self->why,
                 "its table would be off by %.2g mm and %.2g deg, at most "
                 "%.2g mm and %g deg are taken",
                 self->off_mm, self->off_deg, most_mm, ARM_OFF_DEG);
    return holds;
}

void import_arm(const struct urdf *urdf, const struct rig *rig,
                const struct options *options, struct move_text *text,
                struct import_arm *self)
{
    static const double snap[] = { ARM_SNAP, 0 };
    const char *const newline =
        strstr(text->data, "\r\n") != NULL ? "\r\n" : "\n";
    struct arm_text *more = memory_new(1, sizeof *more);
    bool holds = false;

    if (rig->kinematics != NULL)
        snprintf(self->why, sizeof self->why,
                 "the rig has its own, which stays as it is");
    else if (urdf_chain(urdf, rig, &self->chain, self->why) == 0)
        for (size_t i = 0; i < 2 && !holds; i++) {
            struct move_text with = { .length = text->length };
            if (urdf_arm(&self->chain, snap[i], &self->arm, self->why) < 0)
                continue;
            arm_write(&self->arm, newline, more);
            with.data = memory_new(text->length + more->used + 1, 1);
            memcpy(with.data, text->data, text->length);
            memcpy(with.data + text->length, more->text, more->used);
            with.length += more->used;
            holds = arm_holds(self, options->rig, &with);
            if (holds) {
                free(text->data);
                text->data = with.data;
                text->length = with.length;
            } else
                memory_free(with.data);
        }
    memory_free(more);
}

/* ---- what became of it --------------------------------------------------- */

void import_arm_print(const struct import_arm *self)
{
    static const char *const head[] = { "<joint", ">theta deg", ">d mm",
                                        ">a mm", ">alpha deg" };
    char number[ARM_NUMBER_MAX];
    struct table table;

    if (self->why[0] != 0) {
        printf("no kinematics: %s\n", self->why);
        return;
    }
    table_init(&table, 5, head);
    for (uint32_t i = 0; i < self->arm.rows; i++) {
        const struct urdf_row *row = &self->arm.row[i];
        table_cell(&table, "%s", row->joint->name);
        table_cell(&table, "%s",
                   arm_number(number, row->theta / DOUBLE_RADIAN, 9));
        table_cell(&table, "%s", arm_number(number, row->d, 6));
        table_cell(&table, "%s", arm_number(number, row->a, 6));
        table_cell(&table, "%s",
                   arm_number(number, row->alpha / DOUBLE_RADIAN, 9));
    }
    table_print(&table, stdout);
    table_free(&table);
    printf("kinematics: an arm of %u %s from %s to %s, whose z is the view; "
           "within %.2g mm and %.2g deg of the description\n",
           self->arm.rows, number_word(self->arm.rows, "joint", "joints"),
           self->chain.from, self->chain.to, self->off_mm, self->off_deg);
}

void import_arm_json(const struct import_arm *self, cJSON *report)
{
    cJSON *arm = cJSON_AddObjectToObject(report, "kinematics");

    if (self->why[0] != 0) {
        cJSON_AddStringToObject(arm, "none", self->why);
        return;
    }
    cJSON_AddStringToObject(arm, "from", self->chain.from);
    cJSON_AddStringToObject(arm, "to", self->chain.to);
    cJSON_AddNumberToObject(arm, "joints", self->arm.rows);
    cJSON_AddNumberToObject(arm, "off_mm", self->off_mm);
    cJSON_AddNumberToObject(arm, "off_deg", self->off_deg);
}
