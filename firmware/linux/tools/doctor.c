/* firmware/linux/tools/doctor.c - files, lines, the order of things; see
 * doctor.h. */
#include "firmware/linux/tools/doctor_parts.h"

#include <dirent.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *doctor_verdict_text(enum doctor_verdict verdict)
{
    static const char *const text[] = {
#define DOCTOR_VERDICT_TEXT(name, word) [name] = word,
        DOCTOR_VERDICT_LIST(DOCTOR_VERDICT_TEXT)
#undef DOCTOR_VERDICT_TEXT
    };
    return text[verdict];
}

/* ---- lines ---- */

void doctor_say(struct doctor *doctor, enum doctor_verdict verdict,
                const char *topic, const char *format, ...)
{
    struct doctor_line *line = &doctor->line[doctor->count];
    va_list arguments;

    if (doctor->count == DOCTOR_LINES_MAX) {
        line--;
        line->verdict = DOCTOR_NOTE;
        snprintf(line->what, sizeof line->what, "more is not shown");
        line->advice[0] = '\0';
        return;
    }
    doctor->count++;
    line->verdict = verdict;
    line->advice[0] = '\0';
    snprintf(line->topic, sizeof line->topic, "%s", topic);
    va_start(arguments, format);
    vsnprintf(line->what, sizeof line->what, format, arguments);
    va_end(arguments);
}

void doctor_advise(struct doctor *doctor, const char *format, ...)
{
    struct doctor_line *line = &doctor->line[doctor->count - 1];
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(line->advice, sizeof line->advice, format, arguments);
    va_end(arguments);
}

/* ---- files ---- */

static void doctor_path_v(const struct doctor *doctor,
                          char path[DOCTOR_PATH_MAX], const char *format,
                          va_list arguments)
{
    const int used = snprintf(path, DOCTOR_PATH_MAX, "%s", doctor->config.root);

    if (used >= 0 && used < DOCTOR_PATH_MAX)
        vsnprintf(path + used, (size_t)(DOCTOR_PATH_MAX - used), format,
                  arguments);
}

void doctor_path(const struct doctor *doctor, char path[DOCTOR_PATH_MAX],
                 const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    doctor_path_v(doctor, path, format, arguments);
    va_end(arguments);
}

static bool doctor_read_path(const char *path, char *text, size_t size)
{
    FILE *file = fopen(path, "rb");
    size_t length;

    if (file == NULL)
        return false;
    length = fread(text, 1, size - 1, file);
    const bool bad = ferror(file) != 0;
    fclose(file);
    while (length > 0 && strchr(" \t\r\n", text[length - 1]) != NULL)
        length--;
    text[length] = '\0';
    return !bad;
}

bool doctor_read(const struct doctor *doctor, char *text, size_t size,
                 const char *format, ...)
{
    char path[DOCTOR_PATH_MAX];
    va_list arguments;

    va_start(arguments, format);
    doctor_path_v(doctor, path, format, arguments);
    va_end(arguments);
    return doctor_read_path(path, text, size);
}

bool doctor_read_number(const struct doctor *doctor, int64_t *number,
                        const char *format, ...)
{
    char path[DOCTOR_PATH_MAX], text[32], *end;
    va_list arguments;

    va_start(arguments, format);
    doctor_path_v(doctor, path, format, arguments);
    va_end(arguments);
    if (!doctor_read_path(path, text, sizeof text))
        return false;
    errno = 0;
    *number = strtoll(text, &end, 0);
    return end != text && *end == '\0' && errno == 0;
}

static int doctor_compare(const void *a, const void *b)
{
    return strcmp(a, b);
}

unsigned doctor_list(const struct doctor *doctor, const char *directory,
                     const char *prefix,
                     char name[DOCTOR_NAMES][DOCTOR_NAME_MAX])
{
    char path[DOCTOR_PATH_MAX];
    unsigned count = 0;
    DIR *handle;

    doctor_path(doctor, path, "%s", directory);
    handle = opendir(path);
    if (handle == NULL)
        return 0;
    for (struct dirent *entry;
         (entry = readdir(handle)) != NULL && count < DOCTOR_NAMES;) {
        if (entry->d_name[0] == '.' ||
            strncmp(entry->d_name, prefix, strlen(prefix)) != 0 ||
            strlen(entry->d_name) >= DOCTOR_NAME_MAX)
            continue;
        memcpy(name[count++], entry->d_name, strlen(entry->d_name) + 1);
    }
    closedir(handle);
    qsort(name, count, DOCTOR_NAME_MAX, doctor_compare);
    return count;
}

/* ---- everything ---- */

void doctor_examine(struct doctor *doctor, const struct doctor_config *config)
{
    *doctor = (struct doctor){ .config = *config };
    doctor_rights(doctor);
    doctor_can(doctor);
    doctor_lines(doctor);
    doctor_cpu(doctor);
    doctor_kernel(doctor);
    doctor_libraries(doctor);
    doctor_jitter(doctor);
}

enum doctor_verdict doctor_worst(const struct doctor *doctor)
{
    enum doctor_verdict worst = DOCTOR_OK;

    for (unsigned i = 0; i < doctor->count; i++)
        if (doctor->line[i].verdict > worst)
            worst = doctor->line[i].verdict;
    return worst;
}
