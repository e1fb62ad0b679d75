/* firmware/linux/base/output.h - a file that is there whole or not at all.
 *
 * Written under a temporary name in the same directory and renamed when it is
 * complete and on the disk.  What is not a regular file (a pipe, /dev/stdout)
 * is written directly.  A signal that ends the program (interrupt, terminate,
 * hang-up, where nothing else handles it) removes the temporary files first. */
#ifndef FIRMWARE_LINUX_BASE_OUTPUT_H
#define FIRMWARE_LINUX_BASE_OUTPUT_H

#include <stdio.h>

#define OUTPUT_PATH_MAX 4096

struct output {
    FILE *file;
    char path[OUTPUT_PATH_MAX];
    char temporary[OUTPUT_PATH_MAX]; /* empty: written directly */
};

#define OUTPUT_OPEN_MAX 4 /* at one time */

/* 0, or -1 with a line on stderr; nothing is left behind then. */
int output_open(struct output *output, const char *path);
/* Close and put in place.  As output_open; also fails when anything written
 * before has failed. */
int output_commit(struct output *output);
/* Close and remove; does nothing when not open. */
void output_abandon(struct output *output);

#endif
