/* firmware/host/device/own_file.c - see own_file.h. */
#include "firmware/host/device/own_file.h"

#include <dirent.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static bool own_is_there(const char *path)
{
    return access(path, R_OK) == 0;
}

/* `directory` of a path, with its last slash. */
static size_t own_directory(const char *path)
{
    const char *slash = strrchr(path, '/');

    return slash == NULL ? 0 : (size_t)(slash - path) + 1;
}

/* PREFIX/share/slew where the program is in PREFIX/bin, the source tree where
 * it is in build/. */
static int own_find_under(const char *directory, const char *kind,
                          const char *file, char path[OWN_FILE_PATH_MAX])
{
    static const char *const place[] = { "/share/slew", "" };

    for (unsigned i = 0; i < 2; i++) {
        const int n = snprintf(path, OWN_FILE_PATH_MAX, "%s%s/%s/%s", directory,
                               place[i], kind, file);
        if (n > 0 && n < OWN_FILE_PATH_MAX && own_is_there(path))
            return 0;
    }
    return -1;
}

static int own_find(const char *kind, const char *file,
                    char path[OWN_FILE_PATH_MAX])
{
    char program[OWN_FILE_PATH_MAX];
    const ssize_t length =
        readlink("/proc/self/exe", program, sizeof program - 1);
    size_t end;

    if (length < 0)
        return -1;
    program[length] = '\0';
    for (end = own_directory(program); end > 1; end = own_directory(program)) {
        program[end - 1] = '\0';
        if (own_find_under(program, kind, file, path) == 0)
            return 0;
    }
    return -1;
}

int own_file_find(const char *kind, const char *name, const char *beside,
                  char path[OWN_FILE_PATH_MAX])
{
    const size_t length = strlen(name);
    const size_t directory = name[0] == '/' ? 0 : own_directory(beside);
    char file[OWN_FILE_NAME_MAX];
    int n;

    if (length < 6 || strcmp(name + length - 5, ".yaml") != 0) {
        n = snprintf(file, sizeof file, "%s.yaml", name);
        return n < OWN_FILE_NAME_MAX ? own_find(kind, file, path) : -1;
    }
    n = snprintf(path, OWN_FILE_PATH_MAX, "%.*s%s", (int)directory, beside,
                 name);
    return n > 0 && n < OWN_FILE_PATH_MAX && own_is_there(path) ? 0 : -1;
}

static int own_compare(const void *a, const void *b)
{
    return strcmp(a, b);
}

unsigned own_file_names(const char *kind,
                        char name[OWN_FILE_NAMES_MAX][OWN_FILE_NAME_MAX])
{
    char path[OWN_FILE_PATH_MAX];
    unsigned count = 0;
    DIR *handle = own_find(kind, "", path) < 0 ? NULL : opendir(path);

    if (handle == NULL)
        return 0;
    for (struct dirent *entry;
         (entry = readdir(handle)) != NULL && count < OWN_FILE_NAMES_MAX;) {
        const char *dot = strrchr(entry->d_name, '.');
        const size_t length = dot == NULL ? 0 : (size_t)(dot - entry->d_name);

        if (length == 0 || length >= OWN_FILE_NAME_MAX - 5 ||
            strcmp(dot, ".yaml") != 0)
            continue;
        memcpy(name[count], entry->d_name, length);
        name[count++][length] = '\0';
    }
    closedir(handle);
    qsort(name, count, OWN_FILE_NAME_MAX, own_compare);
    return count;
}
