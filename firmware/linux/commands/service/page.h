/* firmware/linux/commands/service/page.h - the studio's page beside a service: what
 * its options say, and the server for as long as the service runs. */
#ifndef FIRMWARE_LINUX_COMMANDS_SERVICE_PAGE_H
#define FIRMWARE_LINUX_COMMANDS_SERVICE_PAGE_H

#include "firmware/host/base/files.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/service/service.h"
#include "firmware/studio/server/guard.h"
#include "firmware/studio/server/server.h"

/* Zeroed.  `config` points into it. */
struct page {
    struct studio_config config;
    bool opens; /* a browser */
    struct studio_server *server;
    char rig[FILES_PATH_MAX], move[FILES_PATH_MAX];
    char token[GUARD_TOKEN_MAX + 2];
    char link[FILES_PATH_MAX]; /* a file that leads to the page; "": none */
};

/* The rig and the move by what the command line names: a rig, or a directory with
 * rig.yaml and perhaps move.yaml; `move` NULL: not named.  0, or -1 with a line
 * on stderr that begins with "slew COMMAND". */
int page_files(struct page *page, const char *command, const char *rig,
               const char *move);
/* Port, address and token by the options; the same. */
int page_place(struct page *page, const char *command,
               const struct options *options);
/* For service_config; `page` stays where it is while the service runs. */
struct service_beside page_beside(struct page *page);

#define PAGE_OPTIONS(prefix)                                                   \
    { "address", "ADDRESS", OPTION_TEXT, offsetof(struct options, address),    \
      prefix                                                                   \
      "of the page (127.0.0.1); others than loopback with --token-file" },     \
        { "token-file", "FILE", OPTION_TEXT,                                   \
          offsetof(struct options, token_file),                                \
          prefix                                                               \
          "its first line is what a browser must bring, instead of a new "     \
          "one" },                                                             \
    {                                                                          \
        "edit-rig", NULL, OPTION_FLAG, offsetof(struct options, edit_rig),     \
            prefix "the page may write the file of the rig, too"               \
    }

#endif
