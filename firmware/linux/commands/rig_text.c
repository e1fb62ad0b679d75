/* firmware/linux/commands/rig_text.c - see rig_text.h. */
#include "firmware/linux/commands/rig_text.h"

#include <stdio.h>

#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/output.h"

enum status rig_text_write(const char *path, const struct move_text *text,
                           const char *out)
{
    char message[YAML_MESSAGE_MAX];
    struct rig rig = { .bus_count = 0 };
    struct move_text_files over;
    struct output output;

    move_text_over(&over, &disk_files, path, text);
    const int err = rig_load(&over.files, path, &rig, message);
    rig_free(&rig);
    if (err < 0) {
        error_say("%s", message);
        return STATUS_INPUT;
    }
    if (output_open(&output, out) < 0)
        return STATUS_SYSTEM;
    fwrite(text->data, 1, text->length, output.file);
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}
