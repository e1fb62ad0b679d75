/* firmware/linux/base/output.c - see output.h. */
#define _GNU_SOURCE /* fopencookie, realpath, flock */
#include "firmware/linux/base/output.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/host/base/array.h"
#include "firmware/linux/base/error.h"

static int output_fail(const char *path, const char *what)
{
    error_say("slew: %s: cannot %s: %s", path, what, strerror(errno));
    return -1;
}

/* Partial files that are there now; a name counts once its flag is set. */
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

/* --- the stream: its first error is kept, as stdio forgets which it was --- */

/* Whether it can be written on after what write() said. */
static int output_wait(const struct output *output, int reason)
{
    struct pollfd reader = { .fd = output->descriptor, .events = POLLOUT };
    if (reason == EINTR)
        return 0;
    if (reason != EAGAIN || !output->hasty)
        return reason;
    const int ready = poll(&reader, 1, OUTPUT_HASTE_MS);
    return ready > 0 || (ready < 0 && errno == EINTR) ? 0 : ETIMEDOUT;
}

static ssize_t output_put(void *cookie, const char *data, size_t size)
{
    struct output *output = cookie;
    size_t done = 0;
    while (done < size && output->error == 0) {
        const ssize_t put = write(output->descriptor, data + done, size - done);
        if (put < 0)
            output->error = output_wait(output, errno);
        done += put > 0 ? (size_t)put : 0;
    }
    if (output->error == 0) {
        output->length += (off_t)size;
        return (ssize_t)size;
    }
    if (output->partial[0] != 0) /* no row is cut */
        (void)!ftruncate(output->descriptor, output->length);
    return 0;
}

/* For ftell alone. */
static int output_where(void *cookie, off64_t *offset, int whence)
{
    const struct output *output = cookie;
    if (*offset != 0 || whence != SEEK_CUR)
        return -1;
    *offset = output->length;
    return 0;
}

static int output_stream(struct output *output)
{
    const cookie_io_functions_t functions = { .write = output_put,
                                              .seek = output_where };
    output->file = fopencookie(output, "wb", functions);
    if (output->file == NULL)
        return -1;
    return setvbuf(output->file, output->buffer, _IOFBF, sizeof output->buffer);
}

/* --- opening --- */

/* The name to rename to: what a link points at, not the link. */
static int output_resolve(struct output *output, const char *path)
{
    char *real = realpath(path, NULL);
    const char *name = real != NULL ? real : path;
    int length = snprintf(output->path, sizeof output->path, "%s", name);
    free(real);
    if (length < 0 ||
        (size_t)length + sizeof OUTPUT_PARTIAL > sizeof output->path) {
        errno = ENAMETOOLONG;
        return -1;
    }
    memcpy(output->partial, output->path, (size_t)length);
    memcpy(output->partial + length, OUTPUT_PARTIAL, sizeof OUTPUT_PARTIAL);
    return 0;
}

static bool output_is_special(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && !S_ISREG(status.st_mode);
}

/* Whoever had the file locked may have put it in place meanwhile. */
static bool output_is_partial(const struct output *output)
{
    struct stat open, named;
    return fstat(output->descriptor, &open) == 0 &&
           stat(output->partial, &named) == 0 && open.st_ino == named.st_ino &&
           open.st_dev == named.st_dev;
}

/* A file system without locks has one program at a time. */
static int output_lock(struct output *output)
{
    output->descriptor = open(
        output->partial, O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (output->descriptor < 0)
        return -1;
    return flock(output->descriptor, LOCK_EX | LOCK_NB) < 0 &&
                   errno == EWOULDBLOCK
               ? -1
               : 0;
}

static int output_open_partial(struct output *output)
{
    int err;
    while ((err = output_lock(output)) == 0 && !output_is_partial(output))
        close(output->descriptor);
    if (err == 0 && ftruncate(output->descriptor, 0) == 0) {
        output_remember(output->partial);
        return 0;
    }
    return -1;
}

static int output_fail_open(struct output *output, const char *path,
                            const char *what)
{
    const int reason = errno;
    output_abandon(output);
    errno = reason;
    if (reason != EWOULDBLOCK)
        return output_fail(path, what);
    error_say("slew: %s: another program is writing it, expected another name",
              path);
    return -1;
}

static void output_clear(struct output *output)
{
    output->file = NULL;
    output->keep = false;
    output->hasty = false;
    output->error = 0;
    output->length = 0;
    output->partial[0] = 0;
}

static int output_open_special(struct output *output, const char *path)
{
    snprintf(output->path, sizeof output->path, "%s", path);
    output->descriptor = open(path, O_WRONLY | O_CLOEXEC);
    return output->descriptor < 0 || output_stream(output) < 0
               ? output_fail_open(output, path, "open")
               : 0;
}

void output_make_hasty(struct output *output)
{
    const int flags = fcntl(output->descriptor, F_GETFL);
    output->hasty = flags >= 0 &&
                    fcntl(output->descriptor, F_SETFL, flags | O_NONBLOCK) == 0;
}

static bool output_has_content(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && status.st_size > 0;
}

/* The file that is written is the one to be kept: `partial` is its own name. */
int output_open_new(struct output *output, const char *path)
{
    output_clear(output);
    if (output_is_special(path))
        return output_open_special(output, path);
    if (output_has_content(path)) {
        error_say("slew: %s: is there already and a recording is never "
                  "replaced, expected another name",
                  path);
        return -1;
    }
    if (output_resolve(output, path) < 0)
        return output_fail(path, "create");
    memcpy(output->partial, output->path, strlen(output->path) + 1);
    if (output_lock(output) < 0) {
        output->partial[0] = 0; /* not ours */
        return output_fail_open(output, path, "create");
    }
    output->keep = true;
    return output_stream(output) < 0 ? output_fail_open(output, path, "create")
                                     : 0;
}

int output_open(struct output *output, const char *path)
{
    output_clear(output);
    if (output_is_special(path))
        return output_open_special(output, path);
    if (output_resolve(output, path) < 0)
        return output_fail(path, "create");
    if (output_open_partial(output) < 0) {
        output->partial[0] = 0; /* not ours */
        return output_fail_open(output, path, "create");
    }
    return output_stream(output) < 0 ? output_fail_open(output, path, "create")
                                     : 0;
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

/* Its descriptor, and so the lock, is the last. */
static int output_close(struct output *output)
{
    const bool flushed = fclose(output->file) == 0;
    output->file = NULL;
    if (output->error == 0 && !flushed)
        output->error = errno;
    if (output->error == 0 && output->partial[0] != 0 &&
        fsync(output->descriptor) < 0)
        output->error = errno;
    return output->error == 0 ? 0 : -1;
}

static int output_keep(struct output *output, const char *what)
{
    errno = output->error;
    if (!output->keep || output->partial[0] == 0) {
        output_fail(output->path, what);
        output_abandon(output);
        return -1;
    }
    error_say("slew: %s: cannot %s: %s; what was written is in %s",
              output->path, what, strerror(errno), output->partial);
    output_forget(output->partial);
    output->partial[0] = 0;
    output_abandon(output);
    return -1;
}

int output_commit(struct output *output)
{
    if (output_close(output) < 0)
        return output_keep(output, "write");
    const bool in_place = strcmp(output->partial, output->path) == 0;
    if (output->partial[0] != 0 && !in_place &&
        rename(output->partial, output->path) < 0) {
        output->error = errno;
        return output_keep(output, "put in place");
    }
    const bool renamed = output->partial[0] != 0;
    if (renamed)
        output_forget(output->partial);
    output->partial[0] = 0;
    output_abandon(output);
    if (renamed)
        output_sync_directory(output->path);
    return 0;
}

void output_abandon(struct output *output)
{
    if (output->file != NULL)
        fclose(output->file);
    if (output->partial[0] != 0) {
        unlink(output->partial);
        output_forget(output->partial);
    }
    if (output->descriptor > 0)
        close(output->descriptor);
    output->file = NULL;
    output->descriptor = 0;
    output->partial[0] = 0;
}
