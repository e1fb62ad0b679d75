/* firmware/linux/base/output.h - a file that is there whole or not at all.
 *
 * Written as NAME.partial in the same directory and renamed when it is complete
 * and on the disk.  What is not a regular file (a pipe, /dev/stdout) is written
 * directly.  A signal that ends the program (interrupt, terminate, hang-up,
 * where nothing else handles it) removes the partial files first; a kill leaves
 * them.  The next program that writes NAME takes the place of what was left;
 * one that is still being written is locked and never touched.
 *
 * A recording is another matter: it has its own name while it grows, and none
 * that is there is replaced. */
#ifndef FIRMWARE_LINUX_BASE_OUTPUT_H
#define FIRMWARE_LINUX_BASE_OUTPUT_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <sys/types.h>

#include "firmware/host/recording/rows.h"

#define OUTPUT_PATH_MAX 4096
#define OUTPUT_PARTIAL  ".partial"

struct output {
    FILE *file;
    bool keep;  /* the partial file stays when it cannot be completed */
    bool hasty; /* what takes nothing for OUTPUT_HASTE_MS has failed */
    int descriptor;
    int error;                     /* errno of the first write that failed; 0 */
    off_t length;                  /* written so far */
    char path[OUTPUT_PATH_MAX];    /* what a link points at */
    char partial[OUTPUT_PATH_MAX]; /* empty: written directly */
    char buffer[ROWS_BUFFER];      /* the file's */
};

#define OUTPUT_OPEN_MAX 4 /* at one time */

/* 0, or -1 with a line on stderr; nothing is left behind then.  The output must
 * stay where it is until it is committed or abandoned. */
int output_open(struct output *output, const char *path);
/* The same for a recording: a new file, or one that is empty, or what is not a
 * regular file.  Nothing but output_abandon removes it. */
int output_open_new(struct output *output, const char *path);

/* From now on a pipe that nobody reads is an error (ETIMEDOUT) after a while,
 * not something to wait for. */
#define OUTPUT_HASTE_MS 2000
void output_make_hasty(struct output *output);

/* Close and put in place.  As output_open, but for what `keep` keeps; also
 * fails when anything written before has failed. */
int output_commit(struct output *output);
/* Close and remove; does nothing when not open. */
void output_abandon(struct output *output);

#endif
