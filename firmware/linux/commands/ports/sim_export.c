/* firmware/linux/commands/ports/sim_export.c - see sim_export.h. */
#include "firmware/linux/commands/ports/sim_export.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/fmu/fmu_export.h"
#include "firmware/linux/fmu/fmu_model.h"

static enum status export_options(const struct options *options)
{
    const size_t length = options->out != NULL ? strlen(options->out) : 0;
    if (strcmp(options->path[0], "export") != 0)
        error_say("slew sim: '%s' is not a verb, expected export RIG, fit "
                  "RIG RECORDING, or a rig alone",
                  options->path[0]);
    else if (length < 5 || strcmp(options->out + length - 4, ".fmu") != 0)
        error_say("slew sim export: expected --out FILE, a name that ends in "
                  ".fmu");
    else if (options->fmi >= 0 && options->fmi != 2 && options->fmi != 3)
        error_say("slew sim export: --fmi: %lld is not a version, expected 2 "
                  "or 3",
                  (long long)options->fmi);
    else
        return STATUS_OK;
    return STATUS_INPUT;
}

/* A file, or a directory with rig.yaml. */
static const char *export_rig_path(const char *path, char rig[FILES_PATH_MAX])
{
    struct stat status;
    if (stat(path, &status) < 0 || !S_ISDIR(status.st_mode))
        return path;
    return snprintf(rig, FILES_PATH_MAX, "%s/rig.yaml", path) < FILES_PATH_MAX
               ? rig
               : path;
}

static void export_say(const struct options *options,
                       const struct fmu_model *model)
{
    const int version = options->fmi == 2 ? 2 : 3;
    if (!options->json) {
        printf("%s: FMI %d.0 co-simulation, %u %s, step %.9g s or any "
               "other\n",
               options->out, version, model->rig.axis_count,
               number_word(model->rig.axis_count, "axis", "axes"),
               1e-9 * (double)model->rig.period_ns);
        return;
    }
    cJSON *const report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "file", options->out);
    cJSON_AddNumberToObject(report, "fmi", version);
    cJSON_AddNumberToObject(report, "axes", model->rig.axis_count);
    json_report(report, true);
}

/* Every drive of the rig is enabled once: what cannot be simulated here cannot
 * be elsewhere. */
static enum status export_rig(const struct options *options,
                              struct fmu_files *files, struct fmu_model *model,
                              struct output *output)
{
    char message[FMU_EXPORT_MESSAGE];
    if (fmu_model_init(model, &files->files, fmu_files_rig(files)) < 0) {
        error_say("%s", model->message);
        return STATUS_INPUT;
    }
    if (fmu_model_start(model) < 0) {
        error_say("slew sim export: %s", model->message);
        return STATUS_INPUT;
    }
    if (output_open(output, options->out) < 0)
        return STATUS_SYSTEM;
    if (fmu_export(&model->rig, files, options->fmi == 2 ? 2 : 3, output->file,
                   message) < 0) {
        error_say("slew sim export: %s", message);
        return STATUS_SYSTEM;
    }
    if (output_commit(output) < 0)
        return STATUS_SYSTEM;
    export_say(options, model);
    return STATUS_OK;
}

enum status sim_export(const struct options *options)
{
    char rig[FILES_PATH_MAX];
    struct fmu_files files = { 0 };
    enum status status = export_options(options);
    if (status != STATUS_OK)
        return status;
    struct fmu_model *const model = memory_new(1, sizeof *model);
    fmu_files_record(&files, export_rig_path(options->path[1], rig));
    struct output *const output = memory_new(1, sizeof *output);
    status = export_rig(options, &files, model, output);
    output_abandon(output);
    memory_free(output);
    fmu_model_free(model);
    memory_free(model);
    fmu_files_free(&files);
    return status;
}
