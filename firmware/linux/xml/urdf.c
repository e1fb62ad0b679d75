/* firmware/linux/xml/urdf.c - see urdf.h. */
#include "firmware/linux/xml/urdf.h"

#include <errno.h>
#include <expat.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/quote.h"

#define URDF_BYTES_MAX (16u << 20)
#define URDF_DEPTH     2 /* of a joint's elements: robot, joint */

struct urdf_reader {
    struct urdf *urdf;
    const struct yaml_report *report;
    XML_Parser parser;
    struct urdf_joint *joint; /* being read; NULL: none that counts */
    unsigned depth;
    bool is_robot, is_refused;
};

static void urdf_refuse(struct urdf_reader *self, const char *what,
                        const char *name)
{
    char quote[QUOTE_MAX];

    if (self->is_refused)
        return;
    self->is_refused = true;
    (void)yaml_report_at(
        self->report,
        (struct plan_place){
            (uint32_t)XML_GetCurrentLineNumber(self->parser),
            (uint32_t)XML_GetCurrentColumnNumber(self->parser) + 1 },
        "%s%s%s", what, name != NULL ? " " : "",
        name != NULL ? quote_text(quote, name, strlen(name)) : "");
    (void)XML_StopParser(self->parser, XML_FALSE);
}

static const char *urdf_attribute(const XML_Char **attribute, const char *name)
{
    for (; *attribute != NULL; attribute += 2)
        if (strcmp(*attribute, name) == 0)
            return attribute[1];
    return NULL;
}

/* ---- elements ------------------------------------------------------------ */

/* The last row is of those that are no axis. */
static const struct {
    const char *type;
    bool is_axis, slides, is_free;
} urdf_types[] = {
    { "revolute", true, false, false },  { "continuous", true, false, true },
    { "prismatic", true, true, false },  { "fixed", false, false, false },
    { "floating", false, false, false }, { "planar", false, false, false },
};

static void urdf_joint(struct urdf_reader *self, const XML_Char **attribute)
{
    const char *name = urdf_attribute(attribute, "name"),
               *type = urdf_attribute(attribute, "type");
    struct urdf *urdf = self->urdf;
    size_t i = 0;

    if (name == NULL || strlen(name) >= URDF_NAME_MAX) {
        urdf_refuse(self, "joint has no name of at most 63 bytes", name);
        return;
    }
    while (i < ARRAY_LEN(urdf_types) &&
           (type == NULL || strcmp(urdf_types[i].type, type) != 0))
        i++;
    if (i == ARRAY_LEN(urdf_types)) {
        urdf_refuse(self,
                    "joint has an unknown type, expected revolute, continuous, "
                    "prismatic, fixed, floating or planar, of joint",
                    name);
        return;
    }
    if (!urdf_types[i].is_axis)
        return;
    for (uint32_t k = 0; k < urdf->joints; k++)
        if (strcmp(urdf->joint[k].name, name) == 0) {
            urdf_refuse(self, "there is a second joint", name);
            return;
        }
    if (urdf->joints == URDF_JOINTS_MAX) {
        urdf_refuse(self, "more than 256 joints, from joint", name);
        return;
    }
    self->joint = &urdf->joint[urdf->joints++];
    *self->joint = (struct urdf_joint){
        .slides = urdf_types[i].slides,
        .is_free = urdf_types[i].is_free,
        .place = { (uint32_t)XML_GetCurrentLineNumber(self->parser),
                   (uint32_t)XML_GetCurrentColumnNumber(self->parser) + 1 },
    };
    memcpy(self->joint->name, name, strlen(name) + 1);
}

static void urdf_number(struct urdf_reader *self, const XML_Char **attribute,
                        const char *name, char out[URDF_NUMBER_MAX])
{
    const char *text = urdf_attribute(attribute, name);
    char *end;

    if (text == NULL)
        return;
    text += strspn(text, " \t\r\n");
    size_t length = strcspn(text, " \t\r\n");
    errno = 0;
    const double number = strtod(text, &end);
    if (length == 0 || length >= URDF_NUMBER_MAX || end != text + length ||
        text[length + strspn(text + length, " \t\r\n")] != 0 ||
        strspn(text, "+-.0123456789eE") < length || !isfinite(number)) {
        urdf_refuse(self, "expected a number, in rad or m, and not", text);
        return;
    }
    memcpy(out, text, length);
    out[length] = 0;
}

static void urdf_limit(struct urdf_reader *self, const XML_Char **attribute)
{
    struct urdf_joint *joint = self->joint;

    urdf_number(self, attribute, "lower", joint->lower);
    urdf_number(self, attribute, "upper", joint->upper);
    urdf_number(self, attribute, "velocity", joint->velocity);
}

static void urdf_start(void *data, const XML_Char *name,
                       const XML_Char **attribute)
{
    struct urdf_reader *self = data;

    if (self->depth == 0)
        self->is_robot = strcmp(name, "robot") == 0;
    if (self->is_robot && self->depth == 1 && strcmp(name, "joint") == 0)
        urdf_joint(self, attribute);
    if (self->depth == URDF_DEPTH && self->joint != NULL &&
        strcmp(name, "limit") == 0)
        urdf_limit(self, attribute);
    self->depth++;
}

static void urdf_end(void *data, const XML_Char *name)
{
    struct urdf_reader *self = data;

    (void)name;
    self->depth--;
    if (self->depth < URDF_DEPTH)
        self->joint = NULL;
}

/* ---- the file ------------------------------------------------------------ */

static int urdf_parse(struct urdf_reader *self, const char *data, size_t length)
{
    const struct plan_place top = { 1, 1 };

    XML_SetUserData(self->parser, self);
    XML_SetElementHandler(self->parser, urdf_start, urdf_end);
    if (XML_Parse(self->parser, data, (int)length, XML_TRUE) != XML_STATUS_OK &&
        !self->is_refused)
        urdf_refuse(self, XML_ErrorString(XML_GetErrorCode(self->parser)),
                    NULL);
    if (self->is_refused)
        return -1;
    return self->is_robot && self->urdf->joints > 0
               ? 0
               : yaml_report_at(self->report, top,
                                self->is_robot
                                    ? "the robot has no joint that moves"
                                    : "is no robot description, expected "
                                      "<robot> with <joint> in it");
}

int urdf_read(const struct files *files, const char *path, struct urdf *urdf,
              char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct urdf_reader self = { .urdf = urdf, .report = &report };
    char *data;
    const int64_t length = files_load(files, path, URDF_BYTES_MAX, &data);
    int err;

    urdf->joints = 0;
    if (length < 0)
        return yaml_report_at(&report, (struct plan_place){ 1, 1 },
                              "the file cannot be read (%s)",
                              strerror((int)-length));
    self.parser = XML_ParserCreate(NULL);
    err = self.parser == NULL
              ? yaml_report_at(&report, (struct plan_place){ 1, 1 },
                               "there is no memory for it")
              : urdf_parse(&self, data, (size_t)length);
    if (self.parser != NULL)
        XML_ParserFree(self.parser);
    free(data);
    return err;
}
