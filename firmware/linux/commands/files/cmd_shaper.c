/* firmware/linux/commands/files/cmd_shaper.c - slew shaper: from a recorded
 * vibration to the shapers that take it out. */
#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>

#include "firmware/host/base/table.h"
#include "firmware/host/recording/response.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "motion/core/err.h"
#include "motion/plan/shaper/shaper.h"
#include "motion/plan/shaper/shaper_fit.h"

/* A shaper is said to hold where it leaves no more than this, 5 % to the nearest:
 * with damping the hump of ei peaks a little beside the design frequency, above
 * the 5 % that it has there. */
#define CMD_SHAPER_LEFT 0.052

/* How far a frequency may be off, as a ratio, upwards (by > 0) or downwards, at
 * most by half. */
static double cmd_shaper_holds(const struct plan_shaper *shaper, double by)
{
    double off = 0;

    while (off < 0.5 &&
           plan_shaper_residual(shaper, shaper->frequency_hz *
                                            (1 + by * (off + 1e-3))) <=
               CMD_SHAPER_LEFT * (1 + 1e-9))
        off += 1e-3;
    return off;
}

static double cmd_shaper_off(const struct plan_shaper *shaper, double ratio)
{
    return fmax(
        plan_shaper_residual(shaper, shaper->frequency_hz * (1 + ratio)),
        plan_shaper_residual(shaper, shaper->frequency_hz * (1 - ratio)));
}

/* The shaper of a kind for the vibration; false with the reason. */
static bool cmd_shaper_design(const struct plan_shaper_fit *fit, unsigned kind,
                              struct plan_shaper *shaper,
                              struct plan_error *error)
{
    const struct plan_shaper_request request = {
        .kind = (enum plan_shaper_kind)kind,
        .frequency_hz = fit->frequency_hz,
        .damping = fit->damping,
        .residual = PLAN_SHAPER_RESIDUAL,
    };
    return plan_shaper_design(&request, shaper, error) == MOTION_OK;
}

static void cmd_shaper_row(struct table *table, const char *word,
                           const struct plan_shaper *shaper, double second_hz)
{
    table_cell(table, "%s", word);
    table_cell(table, "%u", shaper->count);
    table_cell(table, "%.4f s", shaper->time_s[shaper->count - 1]);
    table_cell(table, "%.4f s", plan_shaper_delay(shaper));
    table_cell(table, "%.1f %%", 100 * cmd_shaper_off(shaper, 0.05));
    table_cell(table, "%.1f %%", 100 * cmd_shaper_off(shaper, 0.1));
    table_cell(table, "%.1f %%", 100 * cmd_shaper_off(shaper, 0.2));
    table_cell(table, "-%.1f %% .. +%.1f %%",
               100 * cmd_shaper_holds(shaper, -1),
               100 * cmd_shaper_holds(shaper, 1));
    if (second_hz > 0)
        table_cell(table, "%.1f %%",
                   100 * plan_shaper_residual(shaper, second_hz));
}

static void cmd_shaper_text(const struct plan_shaper_fit *fit)
{
    static const char *const head[] = {
        "<kind",     ">impulses",          ">longer by",
        ">lag",      ">5 % off",           ">10 % off",
        ">20 % off", ">leaves 5 % within", ">of the second",
    };
    struct table table;

    printf("%.6g Hz, damping %.4g (%.1f %% of the recording explained, from "
           "%.6g s on, %u rows)\n",
           fit->frequency_hz, fit->damping, 100 * fit->explained, fit->from_s,
           fit->rows);
    if (fit->second_hz > 0)
        printf("What is left swings as well: about %.4g Hz, damping %.2g, with "
               "%.0f %% of the amplitude;\nthe last column is how much of that "
               "a shaper leaves.\n",
               fit->second_hz, fit->second_damping,
               100 * fit->second_amplitude / fit->amplitude);
    puts("");
    table_init(&table, fit->second_hz > 0 ? 9 : 8, head);
    for (unsigned kind = 0; kind < PLAN_SHAPER_KINDS; kind++) {
        struct plan_shaper shaper;
        struct plan_error error;
        if (cmd_shaper_design(fit, kind, &shaper, &error))
            cmd_shaper_row(&table,
                           plan_shaper_word((enum plan_shaper_kind)kind),
                           &shaper, fit->second_hz);
    }
    table_print(&table, stdout);
    table_free(&table);
    printf("\nin the rig file, for the axis:\n"
           "    shaper: {kind: zvd, frequency: %.6g Hz, damping: %.4g}\n",
           fit->frequency_hz, fit->damping);
}

static void cmd_shaper_json_one(cJSON *list, const char *word,
                                const struct plan_shaper *shaper,
                                double second_hz)
{
    cJSON *item = cJSON_CreateObject();

    cJSON_AddItemToArray(list, item);
    cJSON_AddStringToObject(item, "kind", word);
    cJSON_AddNumberToObject(item, "longer_s",
                            shaper->time_s[shaper->count - 1]);
    cJSON_AddNumberToObject(item, "lag_s", plan_shaper_delay(shaper));
    cJSON_AddNumberToObject(item, "holds_below", cmd_shaper_holds(shaper, -1));
    cJSON_AddNumberToObject(item, "holds_above", cmd_shaper_holds(shaper, 1));
    if (second_hz > 0)
        cJSON_AddNumberToObject(item, "second_left",
                                plan_shaper_residual(shaper, second_hz));
    cJSON *impulses = cJSON_AddArrayToObject(item, "impulses");
    for (uint32_t i = 0; i < shaper->count; i++) {
        cJSON *impulse = cJSON_CreateObject();
        cJSON_AddItemToArray(impulses, impulse);
        cJSON_AddNumberToObject(impulse, "time_s", shaper->time_s[i]);
        cJSON_AddNumberToObject(impulse, "amplitude", shaper->amplitude[i]);
    }
}

static void cmd_shaper_json(const struct plan_shaper_fit *fit)
{
    cJSON *report = cJSON_CreateObject();

    cJSON_AddNumberToObject(report, "frequency_hz", fit->frequency_hz);
    cJSON_AddNumberToObject(report, "damping", fit->damping);
    cJSON_AddNumberToObject(report, "amplitude", fit->amplitude);
    cJSON_AddNumberToObject(report, "settled", fit->settled);
    cJSON_AddNumberToObject(report, "rms", fit->rms);
    cJSON_AddNumberToObject(report, "explained", fit->explained);
    cJSON_AddNumberToObject(report, "from_s", fit->from_s);
    cJSON_AddNumberToObject(report, "rows", fit->rows);
    if (fit->second_hz > 0) {
        cJSON *second = cJSON_AddObjectToObject(report, "second");
        cJSON_AddNumberToObject(second, "frequency_hz", fit->second_hz);
        cJSON_AddNumberToObject(second, "damping", fit->second_damping);
        cJSON_AddNumberToObject(second, "amplitude", fit->second_amplitude);
    }
    cJSON *list = cJSON_AddArrayToObject(report, "shapers");
    for (unsigned kind = 0; kind < PLAN_SHAPER_KINDS; kind++) {
        struct plan_shaper shaper;
        struct plan_error error;
        if (cmd_shaper_design(fit, kind, &shaper, &error))
            cmd_shaper_json_one(list,
                                plan_shaper_word((enum plan_shaper_kind)kind),
                                &shaper, fit->second_hz);
    }
    json_report(report, true);
}

static enum status cmd_shaper_file(const struct options *options,
                                   struct response *response)
{
    char message[RESPONSE_MESSAGE_MAX];
    struct plan_shaper_fit fit;
    struct plan_error error;

    if (response_read(&disk_files, options->path[0], options->axis, response,
                      message) < 0) {
        error_say("%s", message);
        return STATUS_INPUT;
    }
    if (plan_shaper_fit(response->t_s, response->x, response->rows, &fit,
                        &error) < 0) {
        error_say("%s: %s", options->path[0], error.text);
        return STATUS_INPUT;
    }
    if (options->json)
        cmd_shaper_json(&fit);
    else
        cmd_shaper_text(&fit);
    return STATUS_OK;
}

static enum status cmd_shaper_run(const struct options *options)
{
    struct response response = { .rows = 0 };
    enum status status;

    if (options->path_count != 1) {
        error_say("slew shaper: expected one recording, a CSV file");
        return STATUS_INPUT;
    }
    status = cmd_shaper_file(options, &response);
    response_free(&response);
    return status;
}

static const struct option_row cmd_shaper_option[] = {
    { "axis", "NAME", OPTION_TEXT, offsetof(struct options, axis),
      "the measured column, by its header; else the second one" },
    OPTIONS_COMMON,
};

const struct command cmd_shaper = {
    .name = "shaper",
    .arguments = "FILE.csv",
    .path_max = 1,
    .summary = "find the vibration of an axis in a recording",
    .text =
        "Reads a recorded step response, or what an axis did after a move had\n"
        "ended, and fits the frequency and the damping of its vibration.  "
        "Prints\n"
        "the input shapers for it: by how much they make a move longer, by "
        "how\n"
        "much it lags, and what vibration is left where the frequency is off.\n"
        "Where a second vibration is in the recording it is named, with what "
        "a\n"
        "shaper for the first leaves of it.\n"
        "\n"
        "The first column is the time in s (t_ms, t_us, t_ns by its header), "
        "the\n"
        "measured one the second or that of --axis.  An encoder of the load, "
        "an\n"
        "accelerometer or a camera will do; the motor's own encoder shows "
        "little.\n",
    .examples = "  slew shaper step.csv\n"
                "  slew shaper --axis tip_mm --json step.csv\n",
    COMMAND_OPTIONS(cmd_shaper_option),
    .run = cmd_shaper_run,
};
