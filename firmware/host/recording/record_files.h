/* firmware/host/recording/record_files.h - the rig and the move of a recording,
 * as files: what was played, whatever has become of the files on the disk.
 *
 * All others, such as register maps, are those of `base`. */
#ifndef FIRMWARE_HOST_RECORDING_RECORD_FILES_H
#define FIRMWARE_HOST_RECORDING_RECORD_FILES_H

#include "firmware/host/recording/record_read.h"

struct record_files {
    struct files files; /* hand this on; must stay where it is */
    const struct files *base;
    struct {
        char path[FILES_PATH_MAX]; /* as it was when it was recorded */
        char *text;
        size_t length;
    } kept[2]; /* the rig, the move */
};

/* -1 with a sentence when the recording does not have both.
 * record_files_free in either case. */
int record_files_open(struct record_files *self, const struct files *base,
                      const char *recording, char message[YAML_MESSAGE_MAX]);
void record_files_free(struct record_files *self);

#endif
