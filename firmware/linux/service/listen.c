/* firmware/linux/service/listen.c - see listen.h. */
#define _DEFAULT_SOURCE /* flock */
#include "firmware/linux/service/listen.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "firmware/linux/base/error.h"

#define LISTEN_WAIT_MS 10
#define LISTEN_WAITS   300 /* for others in the folder, at most */

/* A file to be closed; -1, with errno. */
static int listen_lock_folder(const char *path)
{
    char folder[sizeof(struct sockaddr_un) + 2];
    const char *slash = strrchr(path, '/');
    const int length = slash == NULL ? 0 : (int)(slash - path) + 1;
    snprintf(folder, sizeof folder, "%.*s.", length, path);
    const int file = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    for (int i = 0; file >= 0 && flock(file, LOCK_EX | LOCK_NB) < 0; i++) {
        const int err = errno;
        if (i < LISTEN_WAITS && (err == EWOULDBLOCK || err == EINTR)) {
            (void)poll(NULL, 0, LISTEN_WAIT_MS);
            continue;
        }
        close(file);
        errno = err;
        return -1;
    }
    return file;
}

/* A socket that nobody listens on any more was left by one that was killed; one
 * with many who knock (EAGAIN) was not. */
static bool listen_is_served(const struct sockaddr_un *address)
{
    const int file =
        socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const bool served =
        file >= 0 && (connect(file, (const struct sockaddr *)address,
                              sizeof *address) == 0 ||
                      errno == EAGAIN);
    if (file >= 0)
        close(file);
    return served;
}

/* -1, and what is wrong. */
static int listen_make(const struct sockaddr_un *address, unsigned mode,
                       const char **wrong)
{
    const char *path = address->sun_path;
    struct stat status;
    *wrong = NULL;
    if (listen_is_served(address))
        *wrong = "a service listens there already, expected one per rig";
    else if (lstat(path, &status) == 0 && !S_ISSOCK(status.st_mode))
        *wrong = "is there and is no socket";
    if (*wrong != NULL)
        return -1;
    (void)unlink(path);
    const int file =
        socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const mode_t before = umask(0777 & ~mode);
    const int err = file < 0 ? -1
                             : bind(file, (const struct sockaddr *)address,
                                    sizeof *address);
    (void)umask(before);
    if (err == 0 && listen(file, SERVICE_KNOCKS) == 0)
        return file;
    *wrong = strerror(errno);
    if (file >= 0)
        close(file);
    return -1;
}

int service_listen(const char *path, unsigned mode)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const char *wrong = "the name of the socket is too long";
    int file = -1;
    if (strlen(path) < sizeof address.sun_path) {
        memcpy(address.sun_path, path, strlen(path));
        const int folder = listen_lock_folder(path);
        wrong = strerror(errno);
        if (folder >= 0) {
            file = listen_make(&address, mode, &wrong);
            close(folder);
        }
    }
    if (file < 0)
        error_say("%s: %s", path, wrong);
    return file;
}

void service_listen_end(int listener, const char *path)
{
    const int folder = listen_lock_folder(path);
    close(listener);
    (void)unlink(path);
    if (folder >= 0)
        close(folder);
}
