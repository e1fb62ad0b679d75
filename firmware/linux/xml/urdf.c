/* firmware/linux/xml/urdf.c - see urdf.h. */
#include "firmware/linux/xml/urdf.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/quote.h"

#define URDF_JOINT 1 /* depths of elements: robot, joint, of a joint */
#define URDF_OF    2

struct urdf_reader {
    struct xml_reader xml;
    struct urdf *urdf;
    struct urdf_joint *joint; /* being read; NULL: none */
};

static void urdf_leave(struct urdf_reader *self, const char *word)
{
    struct urdf *urdf = self->urdf;
    uint32_t i = 0;

    while (i < urdf->unreads && strcmp(urdf->unread[i].word, word) != 0)
        i++;
    if (i == URDF_UNREAD_MAX)
        return;
    if (i == urdf->unreads)
        urdf->unread[urdf->unreads++] = (struct xml_unread){ .count = 0 };
    xml_leave(&self->xml, &urdf->unread[i], word);
}

/* ---- a joint ------------------------------------------------------------- */

static const struct {
    const char *type;
    bool moves, slides, is_free, is_loose;
} urdf_types[] = {
    { "revolute", .moves = true },
    { "continuous", .moves = true, .is_free = true },
    { "prismatic", .moves = true, .slides = true },
    { "fixed", .moves = false },
    { "floating", .is_loose = true },
    { "planar", .is_loose = true },
};

static void urdf_joint(struct urdf_reader *self, const char **attribute)
{
    const char *name = xml_attribute(attribute, "name"),
               *type = xml_attribute(attribute, "type");
    struct urdf *urdf = self->urdf;
    char quote[QUOTE_MAX];
    size_t i = 0;

    if (name == NULL || strlen(name) >= URDF_NAME_MAX) {
        xml_refuse(&self->xml, "the joint has no name of at most %d bytes",
                   URDF_NAME_MAX - 1);
        return;
    }
    (void)quote_text(quote, name, strlen(name));
    while (i < ARRAY_LEN(urdf_types) &&
           (type == NULL || strcmp(urdf_types[i].type, type) != 0))
        i++;
    if (i == ARRAY_LEN(urdf_types)) {
        xml_refuse(&self->xml,
                   "joint %s has an unknown type, expected revolute, "
                   "continuous, prismatic, fixed, floating or planar",
                   quote);
        return;
    }
    for (uint32_t k = 0; k < urdf->joints; k++)
        if (strcmp(urdf->joint[k].name, name) == 0) {
            xml_refuse(&self->xml, "there is a second joint %s", quote);
            return;
        }
    if (urdf->joints == URDF_JOINTS_MAX) {
        xml_refuse(&self->xml, "more than %d joints, from joint %s",
                   URDF_JOINTS_MAX, quote);
        return;
    }
    self->joint = &urdf->joint[urdf->joints++];
    *self->joint = (struct urdf_joint){
        .moves = urdf_types[i].moves,
        .slides = urdf_types[i].slides,
        .is_free = urdf_types[i].is_free,
        .is_loose = urdf_types[i].is_loose,
        .axis = { 1, 0, 0 },
        .place = xml_place(&self->xml),
    };
    snprintf(self->joint->name, URDF_NAME_MAX, "%s", name);
}

/* ---- what it has --------------------------------------------------------- */

/* Read limits; those of a fixed joint mean nothing. */
static void urdf_limit(struct urdf_reader *self, const char **attribute)
{
    struct urdf_joint *joint = self->joint;
    const struct {
        const char *name;
        char *to;
    } numbers[] = { { "lower", joint->lower },
                    { "upper", joint->upper },
                    { "velocity", joint->velocity } };

    for (; *attribute != NULL && joint->moves; attribute += 2) {
        size_t i = 0;
        while (i < ARRAY_LEN(numbers) &&
               strcmp(numbers[i].name, *attribute) != 0)
            i++;
        if (i < ARRAY_LEN(numbers))
            (void)xml_numbers(&self->xml, attribute[1], 1,
                              (char(*)[XML_NUMBER_MAX])numbers[i].to, NULL);
        else
            urdf_leave(self, *attribute);
    }
}

static void urdf_origin(struct urdf_reader *self, const char **attribute)
{
    const char *xyz = xml_attribute(attribute, "xyz"),
               *rpy = xml_attribute(attribute, "rpy");

    if (xyz != NULL)
        (void)xml_numbers(&self->xml, xyz, 3, NULL, self->joint->origin);
    if (rpy != NULL)
        (void)xml_numbers(&self->xml, rpy, 3, NULL, self->joint->rpy);
}

static void urdf_axis(struct urdf_reader *self, const char **attribute)
{
    const char *xyz = xml_attribute(attribute, "xyz");
    double *axis = self->joint->axis;

    if (xyz == NULL || !xml_numbers(&self->xml, xyz, 3, NULL, axis))
        return;
    if (!(hypot(hypot(axis[0], axis[1]), axis[2]) > 1e-9))
        xml_refuse(&self->xml, "the axis has no direction, expected three "
                               "numbers that are not all 0");
}

static void urdf_link(struct urdf_reader *self, const char **attribute,
                      char name[URDF_NAME_MAX])
{
    const char *link = xml_attribute(attribute, "link");

    if (link == NULL || strlen(link) >= URDF_NAME_MAX)
        xml_refuse(&self->xml, "expected link, a name of at most %d bytes",
                   URDF_NAME_MAX - 1);
    else
        snprintf(name, URDF_NAME_MAX, "%s", link);
}

static void urdf_of_joint(struct urdf_reader *self, const char *name,
                          const char **attribute)
{
    if (strcmp(name, "limit") == 0)
        urdf_limit(self, attribute);
    else if (strcmp(name, "origin") == 0)
        urdf_origin(self, attribute);
    else if (strcmp(name, "axis") == 0)
        urdf_axis(self, attribute);
    else if (strcmp(name, "parent") == 0)
        urdf_link(self, attribute, self->joint->parent);
    else if (strcmp(name, "child") == 0)
        urdf_link(self, attribute, self->joint->child);
    else {
        self->joint->follows |= strcmp(name, "mimic") == 0;
        urdf_leave(self, name);
    }
}

/* Of the robot only joints are read. */
static void urdf_start(struct xml_reader *xml, const char *name,
                       const char **attribute)
{
    struct urdf_reader *self = (struct urdf_reader *)xml;

    if (xml->depth == 0 && strcmp(name, "robot") != 0)
        xml_refuse(xml, "is no robot description, expected <robot> with "
                        "<joint> in it");
    else if (xml->depth == URDF_JOINT && strcmp(name, "joint") == 0)
        urdf_joint(self, attribute);
    else if (xml->depth == URDF_OF && self->joint != NULL)
        urdf_of_joint(self, name, attribute);
}

static void urdf_end(struct xml_reader *xml, const char *name)
{
    (void)name;
    if (xml->depth == URDF_JOINT)
        ((struct urdf_reader *)xml)->joint = NULL;
}

/* ---- the file ------------------------------------------------------------ */

int urdf_read(const struct files *files, const char *path, struct urdf *urdf,
              char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct urdf_reader self = {
        .xml = { .start = urdf_start, .end = urdf_end, .report = &report },
        .urdf = urdf
    };
    uint32_t moving = 0;

    urdf->joints = urdf->unreads = 0;
    if (xml_read(files, path, &self.xml) < 0)
        return -1;
    for (uint32_t i = 0; i < urdf->joints; i++)
        moving += urdf->joint[i].moves;
    return moving > 0 ? 0
                      : yaml_report_at(&report, (struct plan_place){ 1, 1 },
                                       "the robot has no joint that moves");
}
