/* firmware/linux/commands/service/page.c - see page.h. */
#include "firmware/linux/commands/service/page.h"

#include <fcntl.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/linux/base/error.h"

/* --- which files ------------------------------------------------------------- */

static bool page_is_directory(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

/* NAME, or NAME/file where NAME is a directory. */
static int page_path(char path[FILES_PATH_MAX], const char *command,
                     const char *name, const char *file)
{
    const size_t length = strlen(name);
    const int n =
        snprintf(path, FILES_PATH_MAX, "%s%s%s", name,
                 file[0] == '\0' || name[length - 1] == '/' ? "" : "/", file);
    if (n < FILES_PATH_MAX)
        return 0;
    error_say("slew %s: %s: the name is too long", command, name);
    return -1;
}

static int page_move(struct page *page, const char *command, const char *rig,
                     const char *move)
{
    page->config.move_path = page->move;
    if (move != NULL)
        return page_path(page->move, command, move, "");
    if (page_is_directory(rig)) {
        if (page_path(page->move, command, rig, "move.yaml") < 0)
            return -1;
        if (access(page->move, R_OK) == 0)
            return 0;
    }
    page->config.move_path = NULL;
    return 0;
}

int page_files(struct page *page, const char *command, const char *rig,
               const char *move)
{
    const bool directory = page_is_directory(rig);
    page->config.rig_path = page->rig;
    if (page_path(page->rig, command, rig, directory ? "rig.yaml" : "") < 0 ||
        page_move(page, command, rig, move) < 0)
        return -1;
    if (page->config.move_path == NULL || access(page->move, R_OK) == 0)
        return 0;
    error_say("slew %s: %s cannot be read, expected a move file", command,
              page->move);
    return -1;
}

/* --- where ------------------------------------------------------------------- */

/* What others can read is no secret. */
static int page_token_file(struct page *page, const char *command,
                           const char *path)
{
    FILE *file = fopen(path, "r");
    struct stat status;
    const bool read =
        file != NULL && fgets(page->token, sizeof page->token, file) != NULL;
    const bool is_open_to_others = file != NULL &&
                                   fstat(fileno(file), &status) == 0 &&
                                   (status.st_mode & 077) != 0;
    if (file != NULL)
        fclose(file);
    page->token[strcspn(page->token, "\r\n")] = '\0';
    if (!read || !guard_is_good_token(page->token))
        error_say("slew %s: --token-file %s: expected a line of %d to %d "
                  "letters, digits, - and _",
                  command, path, GUARD_TOKEN_MIN, GUARD_TOKEN_MAX);
    else if (is_open_to_others)
        error_say("slew %s: --token-file %s: others can read or write it, "
                  "expected chmod 600",
                  command, path);
    else
        return 0;
    return -1;
}

static int page_token(struct page *page, const char *command)
{
    unsigned char random[GUARD_TOKEN_NEW];
    if (getrandom(random, sizeof random, 0) == (ssize_t)sizeof random) {
        guard_token_of(random, page->token);
        return 0;
    }
    error_say("slew %s: no random bytes for a token", command);
    return -1;
}

int page_place(struct page *page, const char *command,
               const struct options *options)
{
    struct studio_config *config = &page->config;
    const int64_t port = options->port < 0 ? STUDIO_PORT : options->port;
    config->address = options->address;
    config->port = (unsigned)port;
    config->is_real = options->real;
    page->opens = !options->no_browser;
    if (port < 1 || port > 65535) {
        error_say("slew %s: --port: expected 1 to 65535", command);
        return -1;
    }
    config->edits_rig = options->edit_rig;
    config->token = page->token;
    if (options->token_file != NULL)
        return page_token_file(page, command, options->token_file);
    if (config->address == NULL || guard_is_loopback(config->address))
        return page_token(page, command);
    error_say("slew %s: --address %s can be reached by others, expected "
              "--token-file too",
              command, config->address);
    return -1;
}

/* A file of the user's alone that leads to the page, beside the socket: what
 * programs are started with, all users can see. */
static int page_link(struct page *page, const char *url, const char *socket)
{
    const char *slash = strrchr(socket, '/');
    const int n =
        snprintf(page->link, sizeof page->link, "%.*spage-%u-%ld.html",
                 slash == NULL ? 0 : (int)(slash - socket) + 1, socket,
                 page->config.port, (long)getpid());
    (void)unlink(page->link);
    const int file =
        n >= (int)sizeof page->link
            ? -1
            : open(page->link,
                   O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (file >= 0 &&
        dprintf(file,
                "<!doctype html><meta charset=\"utf-8\">"
                "<meta name=\"referrer\" content=\"no-referrer\">"
                "<meta http-equiv=\"refresh\" content=\"0;url=%s\">"
                "\n",
                url) > 0 &&
        close(file) == 0)
        return 0;
    page->link[0] = '\0';
    return -1;
}

/* Where somebody sits in front of a screen; that it fails is seen. */
static void page_open(struct page *page, const char *url, const char *socket)
{
    extern char **environ;
    char program[] = "xdg-open";
    char *const words[] = { program, page->link, NULL };
    pid_t child;
    if (page->opens && isatty(STDOUT_FILENO) &&
        (getenv("DISPLAY") != NULL || getenv("WAYLAND_DISPLAY") != NULL) &&
        page_link(page, url, socket) == 0)
        (void)posix_spawnp(&child, program, NULL, NULL, words, environ);
}

/* --- beside the service ------------------------------------------------------- */

static int page_start(void *context, const struct rig *rig, const char *socket,
                      struct service_frames *frames)
{
    struct page *page = context;
    const struct studio_config *config = &page->config;
    const char *address = config->address;
    page->server = studio_server_start(config, rig, socket, frames);
    if (page->server == NULL)
        return -1;
    if (address == NULL || strcmp(address, "0.0.0.0") == 0)
        address = "127.0.0.1";
    char url[512];
    snprintf(url, sizeof url, "http://%s%s%s:%u/?token=%s",
             strchr(address, ':') != NULL ? "[" : "", address,
             strchr(address, ':') != NULL ? "]" : "", config->port,
             config->token);
    puts(url);
    page_open(page, url, socket);
    return 0;
}

static void page_stop(void *context)
{
    struct page *page = context;
    studio_server_stop(page->server);
    page->server = NULL;
    if (page->link[0] != '\0')
        (void)unlink(page->link);
}

struct service_beside page_beside(struct page *page)
{
    return (struct service_beside){ page_start, page_stop, page };
}
