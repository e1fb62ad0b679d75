/* firmware/linux/xml/xml.c - see xml.h. */
#include "firmware/linux/xml/xml.h"

#include <errno.h>
#include <expat.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/quote.h"

#define XML_BLANKS " \t\r\n"

struct plan_place xml_place(const struct xml_reader *self)
{
    return (struct plan_place){
        (uint32_t)XML_GetCurrentLineNumber(self->parser),
        (uint32_t)XML_GetCurrentColumnNumber(self->parser) + 1
    };
}

void xml_refuse(struct xml_reader *self, const char *format, ...)
{
    char text[YAML_MESSAGE_MAX];
    va_list arguments;

    if (self->is_refused)
        return;
    self->is_refused = true;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    (void)yaml_report_at(self->report, xml_place(self), "%s", text);
    (void)XML_StopParser(self->parser, XML_FALSE);
}

const char *xml_attribute(const char **attribute, const char *name)
{
    for (; *attribute != NULL; attribute += 2)
        if (strcmp(*attribute, name) == 0)
            return attribute[1];
    return NULL;
}

/* Its length; 0: it is no number. */
static size_t xml_number(const char *text, double *value)
{
    const size_t length = strcspn(text, XML_BLANKS);
    char *end;

    errno = 0;
    *value = strtod(text, &end);
    return length < XML_NUMBER_MAX && end == text + length &&
                   strspn(text, "+-.0123456789eE") >= length && isfinite(*value)
               ? length
               : 0;
}

bool xml_numbers(struct xml_reader *self, const char *text, unsigned count,
                 char number[][XML_NUMBER_MAX], double value[])
{
    const char *at = text;
    char quote[QUOTE_MAX];

    for (unsigned i = 0; i < count; i++) {
        double read = 0;
        at += strspn(at, XML_BLANKS);
        const size_t length = xml_number(at, &read);
        if (length == 0)
            break;
        if (number != NULL)
            snprintf(number[i], XML_NUMBER_MAX, "%.*s", (int)length, at);
        if (value != NULL)
            value[i] = read;
        at += length + strspn(at + length, XML_BLANKS);
        if (i + 1 == count && *at == 0)
            return true;
    }
    xml_refuse(self, "expected %s, and not %s%s",
               count == 1 ? "a number" : "three numbers",
               quote_text(quote, text, strlen(text)),
               strstr(text, "${") != NULL
                   ? "; what is a template for xacro is to be expanded by it"
                   : "");
    return false;
}

void xml_leave(const struct xml_reader *self, struct xml_unread *unread,
               const char *word)
{
    if (unread->count++ > 0)
        return;
    snprintf(unread->word, sizeof unread->word, "%s", word);
    unread->line = xml_place(self).line;
}

/* ---- the file ------------------------------------------------------------ */

static const char *xml_local(const XML_Char *name)
{
    const char *colon = strrchr(name, ':');

    return colon != NULL ? colon + 1 : name;
}

static void xml_start(void *data, const XML_Char *name,
                      const XML_Char **attribute)
{
    struct xml_reader *self = data;

    if (!self->is_refused)
        self->start(self, xml_local(name), attribute);
    self->depth++;
}

static void xml_end(void *data, const XML_Char *name)
{
    struct xml_reader *self = data;

    self->depth--;
    if (!self->is_refused)
        self->end(self, xml_local(name));
}

static int xml_parse(struct xml_reader *self, const char *data, int64_t length)
{
    self->parser = XML_ParserCreate(NULL);
    if (self->parser == NULL)
        return yaml_report_at(self->report, (struct plan_place){ 1, 1 },
                              "there is no memory for it");
    XML_SetUserData(self->parser, self);
    XML_SetElementHandler(self->parser, xml_start, xml_end);
    if (XML_Parse(self->parser, data, (int)length, XML_TRUE) != XML_STATUS_OK)
        xml_refuse(self, "%s", XML_ErrorString(XML_GetErrorCode(self->parser)));
    XML_ParserFree(self->parser);
    self->parser = NULL;
    return self->is_refused ? -1 : 0;
}

int xml_read(const struct files *files, const char *path,
             struct xml_reader *self)
{
    char *data;
    const int64_t length = files_load(files, path, XML_BYTES_MAX, &data);

    if (length < 0)
        return yaml_report_at(self->report, (struct plan_place){ 1, 1 },
                              "the file cannot be read (%s)",
                              strerror((int)-length));
    const int err = xml_parse(self, data, length);
    free(data);
    return err;
}
