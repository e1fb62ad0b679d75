/* firmware/linux/commands/options.c - see options.h. */
#include "firmware/linux/commands/options.h"

#include <getopt.h>
#include <math.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/number.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/command.h"
#include "motion/core/clock_warp.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define OPTIONS_MAX     32
#define OPTIONS_FIRST   256 /* getopt's value of the first row */
#define OPTIONS_MISSING ':'

#define OPTIONS_TIME_MAX_NS (19 * INT64_C(86400000000000)) /* of a track */

static const struct {
    const char *name;
    unsigned digits; /* 10^-9 s are 10^-digits of it */
    int64_t scale;   /* and times this */
} options_time_unit[] = {
    { "", 9, 1 },   { "s", 9, 1 },  { "ms", 6, 1 },
    { "us", 3, 1 }, { "ns", 0, 1 }, { "min", 9, 60 },
};

/* "2.5", "2.5 s", "250ms", "1 min". */
static int options_time(const char *text, int64_t *ns)
{
    const char *unit;
    int64_t ignored;
    int err = number_parse(text, 0, &ignored, &unit);
    if (err < 0)
        return err;
    while (*unit == ' ')
        unit++;
    for (size_t i = 0; i < ARRAY_LEN(options_time_unit); i++) {
        if (strcmp(unit, options_time_unit[i].name) != 0)
            continue;
        err = number_parse_decimal(text, options_time_unit[i].digits, ns, NULL);
        if (err < 0 || *ns < 0 || *ns > OPTIONS_TIME_MAX_NS)
            return MOTION_E_RANGE;
        *ns *= options_time_unit[i].scale;
        return *ns <= OPTIONS_TIME_MAX_NS ? MOTION_OK : MOTION_E_RANGE;
    }
    return MOTION_E_ARG;
}

static int options_rate(const char *text, int64_t *rate_uhz)
{
    const char *end;
    int err = number_parse_decimal(text, 6, rate_uhz, &end);
    if (err < 0)
        return err;
    if (strcmp(end, "") != 0 && strcmp(end, "Hz") != 0 &&
        strcmp(end, " Hz") != 0)
        return MOTION_E_ARG;
    if (*rate_uhz < 1000 || *rate_uhz > INT64_C(1000000000000))
        return MOTION_E_RANGE;
    return MOTION_OK;
}

static int options_percent(const char *text, int64_t *rate_q30)
{
    const char *end;
    int64_t millionth;
    int err = number_parse_decimal(text, 6, &millionth, &end);
    if (err < 0)
        return err;
    if (strcmp(end, "") != 0 && strcmp(end, "%") != 0 && strcmp(end, " %") != 0)
        return MOTION_E_ARG;
    if (millionth < 1000000 || millionth > 200000000)
        return MOTION_E_RANGE;
    return motion_fixed_muldiv(millionth, MOTION_CLOCK_WARP_ONE_Q30, 100000000,
                               rate_q30);
}

static int options_count(const char *text, int64_t *count)
{
    const char *end;
    int err = number_parse_decimal(text, 0, count, &end);
    if (err < 0)
        return err;
    return *end != 0 || *count < 0 || *count > 1000000000 ? MOTION_E_ARG
                                                          : MOTION_OK;
}

static const char *options_expected(enum option_kind kind)
{
    switch (kind) {
    case OPTION_RATE:
        return "a rate in Hz, 0.001 to 1000000, such as 1000";
    case OPTION_TIME:
        return "a time of 0 to 19 days, such as 2.5 or 250ms";
    case OPTION_PERCENT:
        return "a percentage from 1 to 200, such as 50";
    case OPTION_NUMBER:
        return "a number, 0 or from 1e-60 to 1e60, such as 12.5 or -3e-2";
    case OPTION_COUNT:
        return "a whole number from 0, such as 12";
    case OPTION_FLAG:
    case OPTION_TEXT:
        break;
    }
    return "a text that is not empty";
}

static int options_store(const struct option_row *row, const char *text,
                         struct options *options)
{
    char *field = (char *)options + row->offset;
    switch (row->kind) {
    case OPTION_FLAG:
        *(bool *)field = true;
        return MOTION_OK;
    case OPTION_TEXT:
        *(const char **)(void *)field = text;
        return text[0] != 0 ? MOTION_OK : MOTION_E_ARG;
    case OPTION_RATE:
        return options_rate(text, (int64_t *)(void *)field);
    case OPTION_TIME:
        return options_time(text, (int64_t *)(void *)field);
    case OPTION_PERCENT:
        return options_percent(text, (int64_t *)(void *)field);
    case OPTION_NUMBER:
        return otg_number(text, strlen(text), (double *)(void *)field)
                   ? MOTION_OK
                   : MOTION_E_ARG;
    case OPTION_COUNT:
        return options_count(text, (int64_t *)(void *)field);
    }
    return MOTION_E_ARG;
}

static int options_fail(const struct command *command, const char *what,
                        const char *which)
{
    error_say("slew %s: %s%s; see slew %s --help", command->name, what, which,
              command->name);
    return -1;
}

static void options_long(const struct command *command, struct option *list)
{
    for (size_t i = 0; i < command->option_count; i++)
        list[i] = (struct option){
            .name = command->option[i].name,
            .has_arg = command->option[i].value == NULL ? no_argument
                                                        : required_argument,
            .val = OPTIONS_FIRST + (int)i,
        };
    list[command->option_count] = (struct option){ .name = NULL };
}

static int options_take(const struct command *command, int code,
                        const char *word, struct options *options)
{
    if (code == 'h') {
        options->help = true;
        return 0;
    }
    if (code == OPTIONS_MISSING)
        return options_fail(command, "no value after ", word);
    if (code < OPTIONS_FIRST)
        return options_fail(command, "unknown option ", word);
    const struct option_row *row = &command->option[code - OPTIONS_FIRST];
    if (options_store(row, optarg, options) < 0) {
        error_say("slew %s: --%s %s: expected %s", command->name, row->name,
                  optarg[0] != 0 ? optarg : "''", options_expected(row->kind));
        return -1;
    }
    return 0;
}

static int options_paths(const struct command *command, int argc, char *argv[],
                         struct options *options)
{
    int most = command->path_max > 0 ? command->path_max : 2;
    for (int i = optind; i < argc; i++) {
        if (options->path_count == most)
            return options_fail(command, "one argument too many: ", argv[i]);
        if (argv[i][0] == 0)
            return options_fail(command, "an empty argument, expected ",
                                command->arguments);
        options->path[options->path_count++] = argv[i];
    }
    if (options->path_count == 0 && !options->help && !command->path_optional)
        return options_fail(command, "which files? expected ",
                            command->arguments);
    return 0;
}

/* -10mm is a value, not ten options: it is handed on with a blank in front. */
static void options_negative(int argc, char *argv[])
{
    static char text[OPTIONS_PATHS_MAX][64];
    int used = 0;
    for (int i = 1; i < argc && used < OPTIONS_PATHS_MAX; i++) {
        if (argv[i][0] != '-' || strchr(".0123456789", argv[i][1]) == NULL ||
            argv[i][1] == 0 || strlen(argv[i]) + 2 > sizeof text[0])
            continue;
        snprintf(text[used], sizeof text[0], " %s", argv[i]);
        argv[i] = text[used++];
    }
}

int options_parse(const struct command *command, int argc, char *argv[],
                  struct options *options)
{
    struct option list[OPTIONS_MAX + 1];
    options_long(command, list);
    *options = (struct options){
        .rate_uhz = -1,
        .to_ns = -1,
        .resume_after_ns = -1,
        .dead_man_ns = -1,
        .key_every_ns = -1,
        .override_q30 = MOTION_CLOCK_WARP_ONE_Q30,
        .row = -1,
        .loop = -1,
        .cpu = -1,
        .fmi = -1,
        .runs = -1,
        .seed = -1,
        .jobs = -1,
        .port = -1,
    };
    for (int i = 0; i < OTG_VALUES; i++)
        options->motion[i] = (double)NAN;
    if (command->negative)
        options_negative(argc, argv);
    optind = 0; /* glibc: start anew */
    for (;;) {
        int code = getopt_long(argc, argv, ":h", list, NULL);
        if (code == -1)
            return options_paths(command, argc, argv, options);
        if (options_take(command, code, argv[optind - 1], options) < 0)
            return -1;
    }
}

static void options_help_row(const struct option_row *row, FILE *file)
{
    char name[40];
    snprintf(name, sizeof name, "--%s%s%s", row->name,
             row->value != NULL ? " " : "",
             row->value != NULL ? row->value : "");
    fprintf(file, "  %-20s %s\n", name, row->help);
}

void options_help(const struct command *command, FILE *file)
{
    fprintf(file, "slew %s - %s\n\n", command->name, command->summary);
    fprintf(file, "usage: slew %s [OPTIONS] %s\n\n", command->name,
            command->arguments);
    fputs(command->text, file);
    if (command->more != NULL)
        command->more(file);
    fputs("\noptions:\n", file);
    for (size_t i = 0; i < command->option_count; i++)
        options_help_row(&command->option[i], file);
    fprintf(file, "\nexamples:\n%s\nexit status:\n", command->examples);
#define OPTIONS_STATUS(name, value, text)                                      \
    fprintf(file, "  %-4d %s\n", value, text);
    STATUS_LIST(OPTIONS_STATUS)
#undef OPTIONS_STATUS
}
