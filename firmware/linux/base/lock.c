/* firmware/linux/base/lock.c - see lock.h. */
#define _GNU_SOURCE /* struct ucred */
#include "firmware/linux/base/lock.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <pwd.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

/* Whoever asks stays in the line of those that listen() has waiting, until the
 * lock is released; after so many the holder is no longer named. */
#define LOCK_ASKED 4096

#define LOCK_COMMAND_MAX   160
#define LOCK_DIRECTORY_MAX 100

/* ---- in children too it would stay a lock ---- */

#define LOCK_FILES 1024
static bool lock_is_mine[LOCK_FILES];

static void lock_forked(void)
{
    for (int file = 0; file < LOCK_FILES; file++)
        if (lock_is_mine[file])
            lock_release(file);
}

static bool lock_note(int file)
{
    static bool is_asked;

    if (file >= LOCK_FILES ||
        (!is_asked && pthread_atfork(NULL, NULL, lock_forked) != 0))
        return false;
    is_asked = true;
    lock_is_mine[file] = true;
    return true;
}

void lock_release(int file)
{
    lock_is_mine[file] = false;
    close(file);
}

/* ---- taking ---- */

static socklen_t lock_address(struct sockaddr_un *address, const char *name)
{
    *address = (struct sockaddr_un){ .sun_family = AF_UNIX };
    const int length = snprintf(address->sun_path + 1,
                                sizeof address->sun_path - 1, "slew/%s", name);
    return (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1 +
                       (size_t)length);
}

static int lock_socket(void)
{
    return socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
}

int lock_take(const char *name)
{
    struct sockaddr_un address;
    const socklen_t size = lock_address(&address, name);
    const int file = lock_socket();

    if (file >= 0 && bind(file, (struct sockaddr *)&address, size) == 0 &&
        listen(file, LOCK_ASKED) == 0) {
        if (lock_note(file))
            return file;
        errno = EMFILE;
    }
    const int err = -errno;
    if (file >= 0)
        close(file);
    return err;
}

/* ---- who has it ---- */

/* A file below /proc of the process as one printable line; "" where it cannot
 * be read. */
static void lock_read(pid_t pid, const char *name, char *text, size_t capacity)
{
    char path[64];
    ssize_t length = 0;

    snprintf(path, sizeof path, "/proc/%ld/%s", (long)pid, name);
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file >= 0) {
        length = read(file, text, capacity - 1);
        close(file);
    }
    while (length > 0 && (text[length - 1] == '\0' || text[length - 1] == '\n'))
        length--;
    for (ssize_t i = 0; i < length; i++)
        if (text[i] < ' ' || text[i] > '~')
            text[i] = text[i] == '\0' ? ' ' : '?';
    text[length > 0 ? length : 0] = '\0';
}

static void lock_describe(struct lock_holder *holder, uid_t uid)
{
    char command[LOCK_COMMAND_MAX], directory[LOCK_DIRECTORY_MAX], path[64];
    const struct passwd *user = uid == getuid() ? NULL : getpwuid(uid);
    char *text = holder->text;
    size_t used;

    if (holder->pid == 0)
        return; /* of another container, or too many have asked */
    used = (size_t)snprintf(text, LOCK_HOLDER_MAX, "process %ld%s%.32s",
                            (long)holder->pid, user != NULL ? " of " : "",
                            user != NULL ? user->pw_name : "");
    lock_read(holder->pid, "cmdline", command, sizeof command);
    if (command[0] != '\0')
        used += (size_t)snprintf(text + used, LOCK_HOLDER_MAX - used,
                                 ", \"%s\"", command);
    snprintf(path, sizeof path, "/proc/%ld/cwd", (long)holder->pid);
    const ssize_t length = readlink(path, directory, sizeof directory - 1);
    if (length > 0)
        snprintf(text + used, LOCK_HOLDER_MAX - used, " in %.*s", (int)length,
                 directory);
}

/* A connection is made without the holder's doing, and says whose the socket
 * is that listens. */
bool lock_ask(const char *name, struct lock_holder *holder)
{
    struct sockaddr_un address;
    const socklen_t size = lock_address(&address, name);
    struct ucred peer = { .pid = 0 };
    socklen_t length = sizeof peer;
    const int file = lock_socket();
    const bool is_there =
        file >= 0 && connect(file, (struct sockaddr *)&address, size) == 0;
    const bool is_full = file >= 0 && !is_there && errno == EAGAIN;

    *holder = (struct lock_holder){ .text = "another process" };
    if (is_there &&
        getsockopt(file, SOL_SOCKET, SO_PEERCRED, &peer, &length) == 0)
        holder->pid = peer.pid;
    if (file >= 0)
        close(file);
    if (!is_there && !is_full)
        return false;
    lock_describe(holder, peer.uid);
    return true;
}
