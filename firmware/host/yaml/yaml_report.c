/* firmware/host/yaml/yaml_report.c - see yaml_report.h. */
#include "firmware/host/yaml/yaml_report.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/quote.h"

/* Characters of a path that are shown before it is cut. */
#define REPORT_PATH_MAX     120
#define REPORT_SENTENCE_MAX 512

int yaml_report_at(const struct yaml_report *report, struct plan_place place,
                   const char *format, ...)
{
    /* the end of a long path says more than its start */
    const size_t length = strlen(report->path);
    const size_t skip = length > REPORT_PATH_MAX ? length - REPORT_PATH_MAX : 0;
    char path[REPORT_PATH_MAX + 1], sentence[REPORT_SENTENCE_MAX];
    va_list arguments;

    quote_escape(path, sizeof(path), report->path + skip, length - skip);
    va_start(arguments, format);
    vsnprintf(sentence, sizeof(sentence), format, arguments);
    va_end(arguments);
    snprintf(report->message, report->capacity, "%s%s:%lu:%lu: %s",
             skip > 0 ? "..." : "", path, (unsigned long)place.line,
             (unsigned long)place.column, sentence);
    return -1;
}
