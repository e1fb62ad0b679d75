/* firmware/linux/commands/otg/otg_lines.h - the lines of a table. */
#ifndef FIRMWARE_LINUX_COMMANDS_OTG_OTG_LINES_H
#define FIRMWARE_LINUX_COMMANDS_OTG_OTG_LINES_H

#include <stdbool.h>
#include <stdio.h>

#define OTG_LINE_MAX 16384

struct otg_lines {
    FILE *file; /* the caller's */
    char line[OTG_LINE_MAX];
    char separator;    /* as the first line has it; 0: not read yet */
    int number;        /* of the line, from 1 */
    const char *wrong; /* with the line itself, or NULL */
};

/* The next line that is neither empty nor a comment, without its end; false at
 * the end of the file.  Quotes are blanks, semicolons and tabs that part the names of
 * the first line are commas. */
bool otg_lines_next(struct otg_lines *lines);

#endif
