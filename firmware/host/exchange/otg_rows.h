/* firmware/host/exchange/otg_rows.h - planning problems from CSV, in any
 * units.
 *
 * One problem per line, columns by name: p0 v0 a0 pf vf af vmax vmin amax amin
 * jmax (position goal), the same with _1, _2 ... for several axes that arrive
 * together, or v0 a0 vf af amax amin jmax (velocity goal).  Other columns are
 * left alone; jdown, the jerk of slowing down, may be there.
 *
 * A row is measured in its own scale: lengths and times are multiplied by
 * powers of two so that its numbers fill the planner's formats, whatever unit
 * they came in.  The factors are 2^-length and 2^-time.
 * Positions are counted from p0; a velocity goal's velocities from v0, and its
 * positions by who moves so fast: a change may be small against either. */
#ifndef FIRMWARE_HOST_EXCHANGE_OTG_ROWS_H
#define FIRMWARE_HOST_EXCHANGE_OTG_ROWS_H

#include <stdbool.h>
#include <stdio.h>

#include "motion/otg/otg.h"
#include "motion/otg/sync.h"

enum otg_value {
    OTG_P0,
    OTG_V0,
    OTG_A0,
    OTG_PF,
    OTG_VF,
    OTG_AF,
    OTG_VMAX,
    OTG_VMIN,
    OTG_AMAX,
    OTG_AMIN,
    OTG_JMAX,
    OTG_JDOWN, /* may be missing, or 0: as jmax */
    OTG_VALUES,
};

#define OTG_COLUMNS_MAX 512

/* What the rows of a table are to each other. */
enum otg_table {
    OTG_TABLE_SEPARATE, /* a motion each */
    OTG_TABLE_THROUGH,  /* points of one motion */
    OTG_TABLE_REPLAN,   /* goals that replace each other, at times t */
};

/* Which column is what; from the header line. */
struct otg_header {
    enum otg_table table; /* the caller's */
    int axes;
    bool velocity, timed; /* timed: there is a column t */
    int columns;
    struct {
        short axis; /* -1: not ours; OTG_ROW_DURATION ... */
        short value;
    } column[OTG_COLUMNS_MAX];
    char wrong[256]; /* what otg_header_parse and otg_row_parse return */
};

/* All of `text`: finite, and 0 or from 1e-60 to 1e60. */
bool otg_number(const char *text, size_t length, double *number);

#define OTG_VALUE_DURATION OTG_VALUES
#define OTG_VALUE_CATEGORY (OTG_VALUES + 1)
#define OTG_VALUE_TIME     (OTG_VALUES + 2)

struct otg_row {
    double value[MOTION_SYNC_AXES][OTG_VALUES];
    double duration; /* NAN when there is no such column */
    double t;        /* of a goal that replaces another; else not used */
    double wanted_s; /* not from the file; 0: as short as can be */
    char category[32];
};

struct otg_scaled {
    struct motion_otg_move move[MOTION_SYNC_AXES];
    int length[MOTION_SYNC_AXES], time; /* exponents */
    int lost, lost_axis; /* the value of which the formats keep nothing;
                            OTG_VALUES: there is none */
};

/* NULL, or what is wrong with the header; it names the column. */
const char *otg_header_parse(const char *line, struct otg_header *header);
/* NULL, or what is wrong; *column is where, in bytes from 1. */
const char *otg_row_parse(struct otg_header *header, const char *line,
                          struct otg_row *row, int *column);
/* Of a table that is one motion, after otg_row_parse, which leaves an empty
 * field NAN: fill in what the row before says (NULL: this is the first).  What
 * stays NAN: the start of every row but the first, and of points the velocities
 * that are to be chosen.  NULL, or what is wrong, as there. */
const char *otg_row_follow(struct otg_header *header, const char *line,
                           const struct otg_row *before, struct otg_row *row,
                           int *column);
/* `count` rows in the same formats, positions from where the first starts. */
void otg_rows_scale(const struct otg_header *header, const struct otg_row *row,
                    int count, struct otg_scaled *scaled);

/* How long the fastest motion takes when its acceleration steps, which is what
 * jmax 0 says; the plan has steep ramps in the place of steps.  Each axis by
 * itself, until the last is there.  NAN where an axis has a limit of jerk, or
 * none of acceleration. */
double otg_steps_seconds(const struct otg_header *header,
                         const struct otg_row *row);

#define OTG_TICKS_PER_SECOND 4096e9L

#endif
