/* firmware/host/rig/sim/quirk_load.h - what a maker's CiA 402 drives do otherwise,
 * from YAML files (docs/QUIRKS.md describes them). */
#ifndef FIRMWARE_HOST_RIG_SIM_QUIRK_LOAD_H
#define FIRMWARE_HOST_RIG_SIM_QUIRK_LOAD_H

#include "firmware/host/base/files.h"
#include "hal/drive/cia402/drive.h"

#define QUIRK_TITLE_MAX 96
#define QUIRK_NOTE_MAX  192
#define QUIRK_NOTES_MAX 8

/* A file. */
struct quirk_file {
    struct drive_cia402_quirk quirk;
    char title[QUIRK_TITLE_MAX];
    char note[QUIRK_NOTES_MAX][QUIRK_NOTE_MAX]; /* what the user has to know */
    unsigned note_count;
};

/* 0, or -1 with one sentence in message (YAML_MESSAGE_MAX); *file is then not to
 * be used. */
int quirk_load(const struct files *files, const char *path,
               struct quirk_file *file, char *message);

/* Those that come with slew. */
struct quirk_set {
    struct drive_cia402_quirk quirk[FILES_NAMES_MAX];
    char name[FILES_NAMES_MAX][FILES_NAME_MAX];
    unsigned count;
};

/* Read once.  NULL: one of the files is wrong, and message says how. */
const struct quirk_set *quirk_own(const struct files *files, char *message);

#endif
