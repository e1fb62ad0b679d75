/* firmware/host/base/messages.c - see messages.h. */
#include "firmware/host/base/messages.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"

void messages_add(struct messages *messages, enum message_kind kind,
                  const char *format, ...)
{
    char line[MESSAGE_MAX];
    va_list args;

    va_start(args, format);
    (void)vsnprintf(line, sizeof line, format, args);
    va_end(args);
    const size_t size = strlen(line) + 1;
    messages->text =
        memory_resize(messages->text, messages->length + 1 + size, 1);
    messages->text[messages->length] = (char)kind;
    memcpy(messages->text + messages->length + 1, line, size);
    messages->length += 1 + size;
}

const char *messages_next(const struct messages *messages, size_t *at,
                          enum message_kind *kind)
{
    if (*at == messages->length)
        return NULL;
    const char *text = messages->text + *at + 1;
    *kind = (enum message_kind)messages->text[*at];
    *at += strlen(text) + 2;
    return text;
}

void messages_move(struct messages *messages, struct messages *from)
{
    enum message_kind kind;
    size_t at = 0;

    for (const char *text; (text = messages_next(from, &at, &kind)) != NULL;)
        messages_add(messages, kind, "%s", text);
    messages_free(from);
}

void messages_free(struct messages *messages)
{
    memory_free(messages->text);
    *messages = (struct messages){ .text = NULL };
}
