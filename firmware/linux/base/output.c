/* firmware/linux/base/output.c - see output.h. */
#define _XOPEN_SOURCE 700 /* realpath */
#include "firmware/linux/base/output.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/linux/base/array.h"

static int output_fail(const char *path, const char *what)
{
    fprintf(stderr, "slew: %s: cannot %s: %s\n", path, what, strerror(errno));
    return -1;
}

/* Temporary files that are there now; a name counts once its flag is set. */
static struct {
    char name[OUTPUT_PATH_MAX];
    volatile sig_atomic_t is_there;
} output_pending[OUTPUT_OPEN_MAX];

/* Only calls that a handler may make. */
static void output_on_signal(int number)
{
    for (int i = 0; i < OUTPUT_OPEN_MAX; i++)
        if (output_pending[i].is_there)
            unlink(output_pending[i].name);
    signal(number, SIG_DFL);
    raise(number);
}

static void output_listen(void)
{
    static const int ending[] = { SIGINT, SIGTERM, SIGHUP };
    for (size_t i = 0; i < ARRAY_LEN(ending); i++) {
        struct sigaction present;
        if (sigaction(ending[i], NULL, &present) == 0 &&
            present.sa_handler == SIG_DFL)
            signal(ending[i], output_on_signal);
    }
}

static void output_remember(const char *name)
{
    output_listen();
    for (int i = 0; i < OUTPUT_OPEN_MAX; i++) {
        if (output_pending[i].is_there)
            continue;
        memcpy(output_pending[i].name, name, strlen(name) + 1);
        output_pending[i].is_there = 1;
        return;
    }
}

static void output_forget(const char *name)
{
    for (int i = 0; i < OUTPUT_OPEN_MAX; i++)
        if (output_pending[i].is_there &&
            strcmp(output_pending[i].name, name) == 0)
            output_pending[i].is_there = 0;
}

/* The name to rename to: what a link points at, not the link. */
static int output_resolve(struct output *output, const char *path)
{
    char *real = realpath(path, NULL);
    const char *name = real != NULL ? real : path;
    int length = snprintf(output->path, sizeof output->path, "%s", name);
    free(real);
    if (length < 0 || (size_t)length + 8 > sizeof output->path) {
        errno = ENAMETOOLONG;
        return -1;
    }
    return 0;
}

static bool output_is_special(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && !S_ISREG(status.st_mode);
}

/* mkstemp makes the file private; give it the mode that open would have. */
static void output_set_mode(int descriptor)
{
    mode_t mask = umask(0);
    umask(mask);
    fchmod(descriptor, 0666 & ~mask);
}

static int output_open_temporary(struct output *output)
{
    memcpy(output->temporary, output->path, sizeof output->path);
    memcpy(output->temporary + strlen(output->path), ".XXXXXX", 8);
    int descriptor = mkstemp(output->temporary);
    if (descriptor < 0)
        return -1;
    output_remember(output->temporary);
    output_set_mode(descriptor);
    output->file = fdopen(descriptor, "wb");
    return output->file == NULL ? -1 : 0;
}

int output_open(struct output *output, const char *path)
{
    *output = (struct output){ .file = NULL };
    if (output_is_special(path)) {
        snprintf(output->path, sizeof output->path, "%s", path);
        output->file = fopen(path, "wb");
        return output->file == NULL ? output_fail(path, "open") : 0;
    }
    if (output_resolve(output, path) < 0 || output_open_temporary(output) < 0)
        return output_fail(path, "create");
    return 0;
}

/* So that the new name survives a power cut; best effort, as some file systems
 * cannot. */
static void output_sync_directory(const char *path)
{
    char directory[OUTPUT_PATH_MAX];
    const char *slash = strrchr(path, '/');
    int length = slash == NULL ? 1 : (int)(slash - path) + 1;
    snprintf(directory, sizeof directory, "%.*s", length,
             slash == NULL ? "." : path);
    int descriptor = open(directory, O_RDONLY);
    if (descriptor < 0)
        return;
    fsync(descriptor);
    close(descriptor);
}

static int output_close(struct output *output)
{
    FILE *file = output->file;
    bool whole = fflush(file) == 0 && !ferror(file);
    if (whole && output->temporary[0] != 0)
        whole = fsync(fileno(file)) == 0;
    output->file = NULL;
    return fclose(file) == 0 && whole ? 0 : -1;
}

int output_commit(struct output *output)
{
    if (output_close(output) < 0) {
        int err = output_fail(output->path, "write");
        output_abandon(output);
        return err;
    }
    if (output->temporary[0] == 0)
        return 0;
    if (rename(output->temporary, output->path) < 0) {
        int err = output_fail(output->path, "put in place");
        output_abandon(output);
        return err;
    }
    output_forget(output->temporary);
    output->temporary[0] = 0;
    output_sync_directory(output->path);
    return 0;
}

void output_abandon(struct output *output)
{
    if (output->file != NULL)
        fclose(output->file);
    if (output->temporary[0] != 0) {
        unlink(output->temporary);
        output_forget(output->temporary);
    }
    output->file = NULL;
    output->temporary[0] = 0;
}
