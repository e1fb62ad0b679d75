/* firmware/host/kind/cia402/quirks.c - the quirks of a rig's CiA 402 drives: of the
 * file that an axis names, or of slew's own by the drive's identity. */
#include <string.h>

#include "firmware/host/kind/cia402/parts.h"

/* Every file once. */
static int rig_load_quirks(const struct rig_reader *self,
                           const struct yaml_value *value, const char *path,
                           uint32_t *index)
{
    struct rig *rig = self->rig;
    struct quirk_file file;

    for (*index = 0; *index < rig->quirk_count; ++*index)
        if (strcmp(rig->quirk_path[*index], path) == 0)
            return 0;
    if (strlen(path) >= RIG_PATH_MAX)
        return yaml_value_refuse(value, "has too long a path");
    if (quirk_load(files_regular(self->files), path, &file,
                   value->tree->report.message) < 0)
        return -1;
    rig->quirk = memory_pool_more(&rig->memory, rig->quirk, rig->quirk_count,
                                  sizeof *rig->quirk);
    rig->quirk_path =
        memory_pool_more(&rig->memory, rig->quirk_path, rig->quirk_count,
                         sizeof *rig->quirk_path);
    memcpy(rig->quirk_path[*index], path, strlen(path) + 1);
    rig->quirk[rig->quirk_count++] = file.quirk;
    return 0;
}

int rig_read_quirks(void *reader, const struct yaml_value *value, void *out)
{
    const struct rig_reader *self = reader;
    const struct files *files = self->files;
    struct rig_cia402 *cia402 = out;
    const char *name = yaml_value_text(value);
    char path[FILES_PATH_MAX], quote[YAML_QUOTE_MAX];

    if (name == NULL)
        return -1;
    if (!files->find(files, FILES_QUIRKS, name, value->tree->report.path, path))
        return yaml_value_refuse(value, "%s is no file of quirks",
                                 yaml_value_quote(quote, value));
    cia402->quirk_given = true;
    return rig_load_quirks(self, value, path, &cia402->quirk);
}

int rig_know_quirks(struct rig_reader *reader, const struct yaml_value *value)
{
    reader->rig->quirks = quirk_own(reader->files, value->tree->report.message);
    return reader->rig->quirks == NULL ? -1 : 0;
}

const struct drive_cia402_quirk *rig_quirks(const struct rig *rig,
                                            const struct rig_cia402 *cia402,
                                            unsigned *count)
{
    if (cia402->quirk_given) {
        *count = 1;
        return &rig->quirk[cia402->quirk];
    }
    *count = rig->quirks == NULL ? 0 : rig->quirks->count;
    return rig->quirks == NULL ? NULL : rig->quirks->quirk;
}

const struct drive_cia402_quirk *rig_quirk(const struct rig *rig,
                                           const struct rig_cia402 *cia402,
                                           uint32_t vendor, uint32_t product)
{
    unsigned count;
    const struct drive_cia402_quirk *quirk = rig_quirks(rig, cia402, &count);

    return cia402->quirk_given
               ? quirk
               : drive_cia402_quirk_find(quirk, count, vendor, product);
}

enum drive_cia402_stream rig_stream(const struct rig_cia402 *cia402,
                                    const struct drive_cia402_quirk *quirk)
{
    return !cia402->stream_given && quirk != NULL && quirk->interpolates
               ? DRIVE_CIA402_IP
               : cia402->stream;
}

int64_t rig_guard_ns(const struct rig *rig, const struct rig_cia402 *cia402)
{
    if (cia402->guard_period_ns > 0 || !cia402->quirk_given ||
        !rig->quirk[cia402->quirk].guarding)
        return cia402->guard_period_ns;
    return rig->watchdog_ns / 2 / RIG_MS * RIG_MS;
}
