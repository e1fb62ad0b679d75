/* firmware/linux/commands/service/page.c - see page.h. */
#include "firmware/linux/commands/service/page.h"

#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
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

static int page_token(struct page *page, const char *command, const char *path)
{
    FILE *file = fopen(path, "r");
    const bool read =
        file != NULL && fgets(page->token, sizeof page->token, file) != NULL;
    if (file != NULL)
        fclose(file);
    page->token[strcspn(page->token, "\r\n")] = '\0';
    if (read && guard_is_good_token(page->token)) {
        page->config.token = page->token;
        return 0;
    }
    error_say("slew %s: --token-file %s: expected a line of %d to %d "
              "letters, digits, - and _",
              command, path, GUARD_TOKEN_MIN, GUARD_TOKEN_MAX);
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
    if (options->token_file != NULL &&
        page_token(page, command, options->token_file) < 0)
        return -1;
    if (config->address == NULL || guard_is_loopback(config->address) ||
        config->token != NULL)
        return 0;
    error_say("slew %s: --address %s can be reached by others, expected "
              "--token-file too",
              command, config->address);
    return -1;
}

/* Where somebody sits in front of a screen; that it fails is seen. */
static void page_open(const struct page *page, char *url)
{
    extern char **environ;
    char program[] = "xdg-open";
    char *const words[] = { program, url, NULL };
    pid_t child;
    if (page->opens && isatty(STDOUT_FILENO) &&
        (getenv("DISPLAY") != NULL || getenv("WAYLAND_DISPLAY") != NULL))
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
    snprintf(url, sizeof url, "http://%s%s%s:%u/%s%s",
             strchr(address, ':') != NULL ? "[" : "", address,
             strchr(address, ':') != NULL ? "]" : "", config->port,
             config->token != NULL ? "?token=" : "",
             config->token != NULL ? config->token : "");
    puts(url);
    page_open(page, url);
    return 0;
}

static void page_stop(void *context)
{
    struct page *page = context;
    studio_server_stop(page->server);
    page->server = NULL;
}

struct service_beside page_beside(struct page *page)
{
    return (struct service_beside){ page_start, page_stop, page };
}
