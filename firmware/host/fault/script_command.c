/* firmware/host/fault/script_command.c - see script_command.h.  A command becomes
 * the text of a script with one entry, so that there is one reader of both. */
#include "firmware/host/fault/script_command.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/files.h"

#define COMMAND_NAME "command"
#define COMMAND_TEXT (3 * FAULT_COMMAND_MAX)

/* ---- the text as a file ---- */

struct command_file {
    struct files files;
    const char *text;
};

static int command_open(const struct files *files, const char *path)
{
    (void)files;
    return strcmp(path, COMMAND_NAME) == 0 ? 0 : -ENOENT;
}

static void command_close(const struct files *files, int file)
{
    (void)files;
    (void)file;
}

static int64_t command_size(const struct files *files, int file)
{
    (void)file;
    return (int64_t)strlen(((const struct command_file *)files)->text);
}

static int64_t command_read(const struct files *files, int file, void *to,
                            size_t size, uint64_t offset)
{
    const size_t length = (size_t)command_size(files, file);

    if (offset >= length)
        return 0;
    if (size > length - offset)
        size = length - (size_t)offset;
    memcpy(to, ((const struct command_file *)files)->text + offset, size);
    return (int64_t)size;
}

/* ---- the words ---- */

static const char *const command_keys[] = { "at",       "event", "of",
                                            "position", "for",   "code",
                                            "by",       "level", "rate",
                                            "delay",    "count", "direction" };

static bool command_is_key(const char *word, size_t length)
{
    for (unsigned i = 0; i < ARRAY_LEN(command_keys); i++)
        if (strlen(command_keys[i]) == length &&
            memcmp(command_keys[i], word, length) == 0)
            return true;
    return false;
}

static bool command_is(const char *name, const char *word, size_t length)
{
    return strlen(name) == length && memcmp(name, word, length) == 0;
}

/* "axis", "bus" or "line"; NULL: the rig has none of that name. */
static const char *command_target(const struct rig *rig, const char *word,
                                  size_t length)
{
    for (uint32_t i = 0; i < rig->axis_count; i++)
        if (command_is(rig->axis[i].name, word, length))
            return "axis";
    for (uint32_t i = 0; i < rig->bus_count; i++)
        if (command_is(rig->bus[i].name, word, length))
            return "bus";
    for (uint32_t i = 0; i < rig->line_count; i++)
        if (command_is(rig->line[i].name, word, length))
            return "line";
    return NULL;
}

/* The next word from *at on; its length, 0: there is none. */
static size_t command_word(const char **at)
{
    *at += strspn(*at, " \t");
    return strcspn(*at, " \t");
}

struct command_text {
    char text[COMMAND_TEXT];
    size_t length;
};

static void command_put(struct command_text *text, const char *before,
                        const char *word, size_t length)
{
    const int put =
        snprintf(text->text + text->length, sizeof text->text - text->length,
                 "%s%.*s", before, (int)length, word);

    if (put > 0 && text->length + (size_t)put < sizeof text->text)
        text->length += (size_t)put;
}

/* What YAML could take for something else is in no name of a rig file that is
 * written plainly, and in no value. */
static bool command_is_plain(const char *line)
{
    return line[strcspn(line, "{}[],:#\"'&*!|>@`\n\r")] == '\0';
}

static int command_refuse(char message[YAML_MESSAGE_MAX], const char *format,
                          int length, const char *word)
{
    snprintf(message, YAML_MESSAGE_MAX, format, length, word);
    return -1;
}

static int command_translate(const char *line, const struct rig *rig,
                             struct command_text *text,
                             char message[YAML_MESSAGE_MAX])
{
    const char *at = line, *target;
    bool timed = false;
    size_t length = command_word(&at);

    command_put(text, "faults: [{fault: ", at, length);
    at += length;
    length = command_word(&at);
    if (length == 0)
        return command_refuse(message,
                              "the command does not say what it happens to, "
                              "expected one such as reboot pan%.*s",
                              0, "");
    target = command_target(rig, at, length);
    if (target == NULL)
        return command_refuse(message,
                              "'%.*s' is no axis, bus or gpio line of the rig",
                              (int)length, at);
    command_put(text, ", ", target, strlen(target));
    command_put(text, ": ", at, length);
    for (at += length; (length = command_word(&at)) > 0; at += length) {
        const bool key = command_is_key(at, length);
        command_put(text, key ? ", " : " ", at, length);
        if (key)
            command_put(text, ":", "", 0);
        timed = timed || command_is("at", at, length) ||
                command_is("position", at, length);
    }
    command_put(text, timed ? "" : ", at: 0 s", "", 0);
    command_put(text, "}]\n", "", 0);
    return 0;
}

int fault_script_command(const char *line, const struct rig *rig,
                         struct fault_entry *entry,
                         char message[YAML_MESSAGE_MAX])
{
    static const char head[] = COMMAND_NAME ":";
    struct command_text text = { .length = 0 };
    const struct command_file file = {
        .files = { .open = command_open,
                   .close = command_close,
                   .read = command_read,
                   .size = command_size },
        .text = text.text,
    };
    struct fault_script script;
    const char *said;

    if (strlen(line) >= FAULT_COMMAND_MAX || !command_is_plain(line))
        return command_refuse(message,
                              "the command is too long or has brackets, quotes "
                              "or commas, expected one such as drive_fault pan "
                              "code 0x3210%.*s",
                              0, "");
    if (command_translate(line, rig, &text, message) < 0)
        return -1;
    if (fault_script_load(&file.files, COMMAND_NAME, rig, &script, message) <
        0) {
        /* line and column are those of a text that nobody has seen */
        said = strstr(message, ": ");
        if (strncmp(message, head, sizeof head - 1) == 0 && said != NULL)
            memmove(message, said + 2, strlen(said + 2) + 1);
        return -1;
    }
    *entry = script.entry[0];
    return 0;
}
