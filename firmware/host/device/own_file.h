/* firmware/host/device/own_file.h - files about drives that come with slew, or
 * that a user has written: register maps, quirks. */
#ifndef FIRMWARE_HOST_DEVICE_OWN_FILE_H
#define FIRMWARE_HOST_DEVICE_OWN_FILE_H

#define OWN_FILE_PATH_MAX  512
#define OWN_FILE_NAME_MAX  40
#define OWN_FILE_NAMES_MAX 64

/* Where slew's own are, in PREFIX/share/slew or in the source tree. */
#define OWN_FILE_MAPS   "hal/maps"
#define OWN_FILE_QUIRKS "hal/quirks"

/* The file `name` of a kind: a path when it ends in .yaml, else NAME.yaml of
 * slew's own; relative paths count from the directory of the file `beside`.  0,
 * or -1: no such file. */
int own_file_find(const char *kind, const char *name, const char *beside,
                  char path[OWN_FILE_PATH_MAX]);

/* Those that come with slew, by name, sorted.  How many: none where the
 * directory is not there. */
unsigned own_file_names(const char *kind,
                        char name[OWN_FILE_NAMES_MAX][OWN_FILE_NAME_MAX]);

#endif
