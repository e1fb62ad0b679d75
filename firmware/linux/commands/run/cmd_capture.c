/* firmware/linux/commands/run/cmd_capture.c - slew capture: axes that are moved
 * by hand, as a move. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/exchange/import.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/run/live.h"
#include "firmware/linux/commands/run/served.h"
#include "firmware/linux/machine/view.h"
#include "motion/core/fixed.h"
#include "motion/plan/keys/simplify.h"

#define CAPTURE_RATE_UHZ INT64_C(25000000)
#define CAPTURE_WAIT_NS  INT64_C(5000000000) /* for drives */
#define CAPTURE_SHARE    1000 /* of the range, where no tolerance is given */

struct cmd_capture {
    const struct options *options;
    struct live live; /* or, where a service has the rig, its rig alone */
    struct served served;
    bool is_served;
    struct machine_view view;
    int64_t now_ns, start_ns, every_ns;
    int64_t *tolerance_q32; /* of each axis */
    uint32_t *seen;         /* its keys before they were simplified */
    struct memory_pool memory;
    struct imported imported;
};

/* --- tolerances: "1 mm" or "1 mm, 0.1 deg", each for the axes it fits --- */

static bool capture_tolerance_item(struct cmd_capture *self, const char *item)
{
    const struct rig *rig = self->live.rig;
    char sentence[UNITS_SENTENCE_MAX] = "";
    bool found = false;
    for (uint32_t i = 0; i < rig->axis_count; i++) {
        const struct units_context context = { .unit = rig->axis[i].unit };
        int64_t q32;
        if (units_parse(item, UNITS_POSITION, &context, &q32, sentence) < 0)
            continue;
        found = true;
        self->tolerance_q32[i] = q32;
        if (q32 > 0)
            continue;
        error_say("slew capture: --tolerance '%s' is not above zero", item);
        return false;
    }
    if (!found)
        error_say("slew capture: --tolerance '%.40s' is no distance of an axis "
                  "of this rig, expected such as '1 mm' or '1 mm, 0.1 deg'",
                  item);
    return found;
}

static enum status capture_tolerance(struct cmd_capture *self)
{
    const struct rig *rig = self->live.rig;
    char list[256];
    char *rest = NULL;
    for (uint32_t i = 0; i < rig->axis_count; i++)
        self->tolerance_q32[i] =
            rig->axis[i].limit.pos_max_q32 / CAPTURE_SHARE -
            rig->axis[i].limit.pos_min_q32 / CAPTURE_SHARE;
    if (self->options->tolerance == NULL)
        return STATUS_OK;
    snprintf(list, sizeof list, "%s", self->options->tolerance);
    for (char *item = strtok_r(list, ",", &rest); item != NULL;
         item = strtok_r(NULL, ",", &rest)) {
        item += strspn(item, " ");
        if (!capture_tolerance_item(self, item))
            return STATUS_INPUT;
    }
    return STATUS_OK;
}

/* --- looking --- */

static enum status capture_ask(struct cmd_capture *self)
{
    const enum status status = served_look(&self->served);
    if (status != STATUS_OK)
        return status;
    machine_view_from(self->live.rig, self->served.status, &self->view);
    self->now_ns = llrint(1e9 * cJSON_GetNumberValue(cJSON_GetObjectItem(
                                    self->served.status, "t_s")));
    return STATUS_OK;
}

/* The next one, a period after the last. */
static enum status capture_look(struct cmd_capture *self,
                                const volatile sig_atomic_t *interrupts)
{
    const int64_t until_ns = self->now_ns + self->every_ns;
    if (self->is_served) {
        const struct timespec pause = { self->every_ns / 1000000000,
                                        self->every_ns % 1000000000 };
        (void)nanosleep(&pause, NULL); /* an interrupt cuts it short */
        return capture_ask(self);
    }
    while (self->live.now_ns < until_ns && *interrupts == 0)
        live_tick(&self->live);
    machine_view_axes(&self->live.machine, &self->view);
    self->now_ns = self->live.now_ns;
    return STATUS_OK;
}

/* Positions that mean something. */
static enum status capture_ready(struct cmd_capture *self,
                                 const volatile sig_atomic_t *interrupts)
{
    const struct rig *rig = self->live.rig;
    const int64_t end_ns = self->now_ns + CAPTURE_WAIT_NS;
    enum status status = STATUS_OK;
    for (uint32_t i = 0; i < rig->axis_count && status == STATUS_OK; i++) {
        const struct machine_view_axis *axis = &self->view.axis[i];
        while (status == STATUS_OK && *interrupts == 0 &&
               self->now_ns < end_ns &&
               (!axis->known || axis->drive == HAL_DRIVE_OFFLINE))
            status = capture_look(self, interrupts);
        if (!axis->known || axis->drive == HAL_DRIVE_OFFLINE) {
            error_say("slew capture: the drive of %s does not say where it is",
                      rig->axis[i].name);
            return STATUS_REFUSED;
        }
        if (!axis->homed) {
            error_say("slew capture: %s is not homed, expected a service of "
                      "the rig in which it was (slew home)",
                      rig->axis[i].name);
            return STATUS_REFUSED;
        }
    }
    return status;
}

/* --- keys --- */

static int capture_add(struct cmd_capture *self)
{
    const struct import_text text = { .report.message = NULL };
    const int64_t t_ns = self->now_ns - self->start_ns;
    for (uint32_t i = 0; i < self->live.rig->axis_count; i++) {
        struct plan_axis *axis = &self->imported.move.axis[i];
        if (axis->key_count == PLAN_KEYS_MAX)
            return -1;
        struct plan_key *key =
            import_add_key(&text, (struct plan_place){ 0, 0 }, axis);
        if (key == NULL)
            return -1;
        key->key.t_ns_q12 = t_ns * MOTION_FIXED_NS_Q12;
        key->key.pos_q32 = self->view.axis[i].pos_q32;
    }
    return 0;
}

static enum status capture_axes(struct cmd_capture *self)
{
    const struct rig *rig = self->live.rig;
    struct plan_move *move = &self->imported.move;
    if (plan_move_reserve(move, rig->axis_count) < 0)
        memory_fail();
    for (uint32_t i = 0; i < rig->axis_count; i++) {
        struct plan_axis *axis = &move->axis[move->axis_count++];
        *axis = (struct plan_axis){ .curve = PLAN_CURVE_QUINTIC };
        memcpy(axis->name, rig->axis[i].name, PLAN_NAME_MAX);
    }
    return STATUS_OK;
}

static enum status capture_run(struct cmd_capture *self,
                               const volatile sig_atomic_t *interrupts)
{
    enum status status = capture_ready(self, interrupts);
    if (status != STATUS_OK)
        return status;
    if (!self->options->json) {
        puts("capturing, Ctrl-C ends it");
        fflush(stdout);
    }
    self->start_ns = self->now_ns;
    while (status == STATUS_OK) {
        if (capture_add(self) < 0) {
            error_say("slew capture: no more than %d looks fit in a move, what "
                      "came after is left out",
                      PLAN_KEYS_MAX);
            break;
        }
        const int64_t t_ns = self->now_ns - self->start_ns;
        if (*interrupts > 0 ||
            (self->options->to_ns >= 0 && t_ns >= self->options->to_ns))
            break;
        const int64_t before_ns = self->now_ns;
        do
            status = capture_look(self, interrupts);
        while (status == STATUS_OK && *interrupts == 0 &&
               self->now_ns <= before_ns);
        if (self->now_ns <= before_ns)
            break; /* interrupted before anything new was seen */
    }
    return status;
}

/* --- what comes of it --- */

static bool capture_moved(const struct cmd_capture *self, uint32_t i)
{
    const struct plan_axis *axis = &self->imported.move.axis[i];
    for (uint32_t k = 1; k < axis->key_count; k++)
        if (motion_fixed_abs(axis->key[k].key.pos_q32 -
                             axis->key[0].key.pos_q32) >
            (uint64_t)self->tolerance_q32[i])
            return true;
    return false;
}

/* An axis that was pushed beyond the end of its range was at that end: no move goes
 * further. */
static void capture_keep_inside(struct cmd_capture *self, uint32_t i)
{
    const struct rig_axis *on = &self->live.rig->axis[i];
    struct plan_axis *axis = &self->imported.move.axis[i];
    const int64_t low = on->limit.pos_min_q32, high = on->limit.pos_max_q32;
    uint64_t beyond_q32 = 0;
    for (uint32_t k = 0; k < axis->key_count; k++) {
        int64_t *pos_q32 = &axis->key[k].key.pos_q32;
        const int64_t inside_q32 = *pos_q32 < low    ? low
                                   : *pos_q32 > high ? high
                                                     : *pos_q32;
        const uint64_t off_q32 = motion_fixed_abs(*pos_q32 - inside_q32);
        beyond_q32 = off_q32 > beyond_q32 ? off_q32 : beyond_q32;
        *pos_q32 = inside_q32;
    }
    if (beyond_q32 <= (uint64_t)self->tolerance_q32[i])
        return;
    char text[NUMBER_MAX];
    number_short(text, (int64_t)beyond_q32, 32);
    fprintf(stderr,
            "%s: it was up to %s %s beyond its range, and is kept at the end "
            "of it\n",
            on->name, text, units_axis_text(on->unit));
}

/* Axes that stood are none of the move's. */
static enum status capture_simplify(struct cmd_capture *self)
{
    struct plan_move *move = &self->imported.move;
    const uint32_t all = move->axis_count;
    uint32_t count = 0;
    for (uint32_t i = 0; i < all; i++) {
        struct plan_axis *axis = &move->axis[i];
        struct plan_error error;
        const int64_t tolerance_q32 = self->tolerance_q32[i];
        if (!capture_moved(self, i)) {
            free(axis->key);
            axis->key = NULL;
            continue;
        }
        capture_keep_inside(self, i);
        self->seen[count] = axis->key_count;
        self->tolerance_q32[count] = tolerance_q32;
        if (plan_simplify(axis, tolerance_q32, &self->live.rig->axis[i].limit,
                          &error) < 0) {
            error_say("slew capture: %s: %s", axis->name, error.text);
            return STATUS_REFUSED;
        }
        move->axis[count] = *axis;
        if (count != i)
            axis->key = NULL;
        count++;
    }
    move->axis_count = count;
    if (count > 0)
        return STATUS_OK;
    error_say("slew capture: no axis was moved by more than its tolerance, "
              "nothing was written");
    return STATUS_REFUSED;
}

/* Said before anybody has moved anything for nothing. */
static enum status capture_try(const struct cmd_capture *self)
{
    struct output output;
    if (output_open(&output, self->options->out) < 0)
        return STATUS_SYSTEM;
    output_abandon(&output);
    return STATUS_OK;
}

static enum status capture_write(const struct cmd_capture *self)
{
    char message[YAML_MESSAGE_MAX];
    struct output output;
    if (output_open(&output, self->options->out) < 0)
        return STATUS_SYSTEM;
    if (export_move(&self->imported, "Captured by slew capture.", output.file,
                    message) < 0) {
        output_abandon(&output);
        error_say("slew capture: %s", message);
        return STATUS_INPUT;
    }
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}

static void capture_report(const struct cmd_capture *self)
{
    const struct plan_move *move = &self->imported.move;
    cJSON *report = cJSON_CreateObject();
    cJSON *list = cJSON_AddArrayToObject(report, "axes");
    cJSON_AddStringToObject(report, "move", self->options->out);
    for (uint32_t i = 0; i < move->axis_count; i++) {
        const struct plan_axis *axis = &move->axis[i];
        const int rig = rig_axis_index(self->live.rig, axis->name);
        char text[NUMBER_MAX];
        number_short(text, self->tolerance_q32[i], 32);
        if (!self->options->json)
            printf("%s: %" PRIu32 " of %" PRIu32 " keys, within %s %s\n",
                   axis->name, axis->key_count, self->seen[i], text,
                   units_axis_text(self->live.rig->axis[rig].unit));
        cJSON *row = cJSON_CreateObject();
        cJSON_AddStringToObject(row, "axis", axis->name);
        cJSON_AddNumberToObject(row, "keys", axis->key_count);
        cJSON_AddNumberToObject(row, "looks", self->seen[i]);
        cJSON_AddNumberToObject(row, "tolerance",
                                number_double(self->tolerance_q32[i], 32));
        cJSON_AddItemToArray(list, row);
    }
    if (self->options->json) {
        json_report(report, true);
        return;
    }
    printf("move: %s\n", self->options->out);
    cJSON_Delete(report);
}

/* --- the command --- */

static void capture_reserve(struct cmd_capture *self)
{
    const unsigned axes = self->live.rig->axis_count;
    machine_view_init(&self->view, self->live.rig, &self->memory);
    self->tolerance_q32 =
        memory_pool_new(&self->memory, axes, sizeof *self->tolerance_q32);
    self->seen = memory_pool_new(&self->memory, axes, sizeof *self->seen);
}

static enum status capture_open(struct cmd_capture *self)
{
    const struct options *options = self->options;
    const bool is_plain = !options->pty && options->interface == NULL;
    enum status status = live_read(&self->live, options);
    if (status == STATUS_OK) {
        capture_reserve(self);
        status = capture_tolerance(self);
    }
    if (status != STATUS_OK)
        return status;
    self->is_served = served_find(&self->served, options, "capture", is_plain);
    if (self->is_served) {
        status = served_allow(&self->served, is_plain, "--interface");
        return status == STATUS_OK ? capture_ask(self) : status;
    }
    status = live_open(&self->live, options, true);
    if (status == STATUS_OK)
        machine_view_axes(&self->live.machine, &self->view);
    self->now_ns = self->live.now_ns;
    return status;
}

static enum status capture_all(struct cmd_capture *self)
{
    enum status status = capture_open(self);
    if (status == STATUS_OK)
        status = capture_try(self);
    if (status == STATUS_OK)
        status = capture_axes(self);
    if (status != STATUS_OK)
        return status;
    const volatile sig_atomic_t *interrupts = interrupt_listen();
    status = capture_run(self, interrupts);
    live_leave(&self->live, interrupts);
    interrupt_listen_no_more();
    if (status == STATUS_OK)
        status = capture_simplify(self);
    if (status == STATUS_OK)
        status = capture_write(self);
    if (status == STATUS_OK)
        capture_report(self);
    return status;
}

static enum status cmd_capture_run(const struct options *options)
{
    if (options->out == NULL) {
        error_say("slew capture: where to? expected --out MOVE.yaml");
        return STATUS_INPUT;
    }
    struct cmd_capture *self = memory_new(1, sizeof *self);
    self->options = options;
    self->every_ns =
        INT64_C(1000000000000000) /
        (options->rate_uhz < 0 ? CAPTURE_RATE_UHZ : options->rate_uhz);
    self->served.link.file = -1;
    const enum status status = capture_all(self);
    move_free(&self->imported.move);
    served_close(&self->served);
    live_close(&self->live);
    memory_pool_free(&self->memory);
    memory_free(self);
    return status;
}

static const struct option_row cmd_capture_option[] = {
    { "out", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "the move, .yaml" },
    { "tolerance", "LIST", OPTION_TEXT, offsetof(struct options, tolerance),
      "how far keys may be from what was read, such as '1 mm, 0.1 deg' (a "
      "thousandth of the range)" },
    { "rate", "HZ", OPTION_RATE, offsetof(struct options, rate_uhz),
      "how often to look (25)" },
    { "for", "TIME", OPTION_TIME, offsetof(struct options, to_ns),
      "end after so long (until Ctrl-C)" },
    OPTIONS_REAL("look at the real drives, on the interfaces of the rig"),
    OPTIONS_PORTS,
    OPTIONS_COMMON,
};

const struct command cmd_capture = {
    .name = "capture",
    .arguments = "RIG",
    .summary = "axes that are moved by hand, as a move",
    .text =
        "Reads where the axes are, without torque, until Ctrl-C, and writes a\n"
        "move file of it: as few keys of a quintic curve as keep within the\n"
        "tolerance of what was read.  Axes that were not moved are left out.\n"
        "slew check says whether the rig can follow; slew fit changes the\n"
        "times until it can.\n\n"
        "Where a service has the rig, its positions are read, undisturbed;\n"
        "axes that need homing are known there once they were homed, and can\n"
        "then be moved by hand with torque off.\n",
    .examples =
        "  slew capture --real --out taught.yaml rig.yaml\n"
        "  slew capture --real --tolerance '0.5 mm, 0.05 deg' --for 20s "
        "--out taught.yaml rig.yaml\n",
    .path_max = 1,
    COMMAND_OPTIONS(cmd_capture_option),
    .run = cmd_capture_run,
};
