/* firmware/linux/commands/otg_answer.h - what slew otg says about a planned
 * motion. */
#ifndef FIRMWARE_LINUX_COMMANDS_OTG_ANSWER_H
#define FIRMWARE_LINUX_COMMANDS_OTG_ANSWER_H

#include <cjson/cJSON.h>
#include <stdio.h>

#include "firmware/host/exchange/otg_rows.h"

/* A problem and what came of it. */
struct otg_answer {
    long number; /* of the row, from 0; -1: not of a file */
    const struct otg_header *header;
    const struct otg_row *row;
    struct otg_scaled scaled;
    struct motion_otg_plan plan[MOTION_SYNC_AXES];
    enum motion_sync_kind kind;
    int err;   /* MOTION_OK, or below zero with the fault */
    bool bent; /* PHASE, but the states allow no straight line: as TIME */
    struct motion_sync_fault fault;
};

/* Plan the row, several axes as `kind` says. */
void otg_answer_make(struct otg_answer *answer, long number,
                     const struct otg_header *header, const struct otg_row *row,
                     enum motion_sync_kind kind);

/* "ok", or "vmax_2: has to be above 0": the column and one sentence, without a
 * comma. */
#define OTG_ANSWER_TEXT 128
const char *otg_answer_status(const struct otg_answer *answer,
                              char text[OTG_ANSWER_TEXT]);

/* row,status,duration */
void otg_answer_line(const struct otg_answer *answer, FILE *file);
/* row,axis,t,p,v,a,j per phase, and the end; nothing when refused. */
void otg_answer_segments(const struct otg_answer *answer, FILE *file);
/* For people: how long, and a table of the phases. */
void otg_answer_text(const struct otg_answer *answer, FILE *file);
/* A line per axis that misses its goal by a residual (motion/otg/otg.h). */
void otg_answer_residuals(const struct otg_answer *answer, FILE *file);
cJSON *otg_answer_json(const struct otg_answer *answer, bool segments);
/* 0, or -1 with a line on stderr. */
int otg_answer_plot(const struct otg_answer *answer, const char *path);

#endif
