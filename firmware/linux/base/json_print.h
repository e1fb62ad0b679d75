/* firmware/linux/base/json_print.h - JSON as text. */
#ifndef FIRMWARE_LINUX_BASE_JSON_PRINT_H
#define FIRMWARE_LINUX_BASE_JSON_PRINT_H

#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stdio.h>

/* Print on one or more lines and free.  Out of memory ends the program. */
void json_print(cJSON *item, FILE *file);      /* indented, line end */
void json_print_line(cJSON *item, FILE *file); /* one line, no line end */

/* What a command answers with --json, to standard output: "ok" stands first, whether
 * what was asked for is done and what was judged is good. */
void json_report(cJSON *report, bool ok);
void json_report_to(cJSON *report, bool ok, FILE *file);

/* Has one been printed to standard output? */
bool json_is_printed(void);

#endif
