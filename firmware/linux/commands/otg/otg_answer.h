/* firmware/linux/commands/otg/otg_answer.h - what slew otg says about a planned
 * motion. */
#ifndef FIRMWARE_LINUX_COMMANDS_OTG_OTG_ANSWER_H
#define FIRMWARE_LINUX_COMMANDS_OTG_OTG_ANSWER_H

#include <cjson/cJSON.h>
#include <stdio.h>

#include "firmware/host/exchange/otg_motion.h"

/* A motion and which row it is. */
struct otg_answer {
    long number; /* of the row, from 0; -1: not of a file, or of all rows */
    struct otg_motion motion;
};

/* Plan it, several axes as motion.kind says. */
void otg_answer_make(struct otg_answer *answer);
/* Is any row refused? */
bool otg_answer_is_refused(const struct otg_answer *answer);

/* row,status,duration; of a motion of several rows, row,status,t */
void otg_answer_line(const struct otg_answer *answer, FILE *file);
/* row,axis,t,p,v,a,j per phase, and the end; nothing when refused. */
void otg_answer_segments(const struct otg_answer *answer, FILE *file);
/* For people: how long, and a table of the phases. */
void otg_answer_text(const struct otg_answer *answer, FILE *file);
/* What the tables do not say, a line each: refusals where `refusals`, and what
 * axes miss of their goals (motion/otg/otg.h). */
void otg_answer_notes(const struct otg_answer *answer, bool refusals);
cJSON *otg_answer_json(const struct otg_answer *answer, bool segments);
/* 0, or -1 with a line on stderr. */
int otg_answer_plot(const struct otg_answer *answer, const char *path);

#endif
