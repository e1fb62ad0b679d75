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

/* Which column is what; from the header line. */
struct otg_header {
    int axes;
    bool velocity;
    int columns;
    struct {
        short axis; /* -1: not ours; OTG_ROW_DURATION ... */
        short value;
    } column[OTG_COLUMNS_MAX];
    char wrong[256]; /* what otg_header_parse and otg_row_parse return */
};

/* "p0", "v0" ... */
const char *otg_name(int value);
/* All of `text`: finite, and 0 or from 1e-60 to 1e60. */
bool otg_number(const char *text, size_t length, double *number);

#define OTG_VALUE_DURATION OTG_VALUES
#define OTG_VALUE_CATEGORY (OTG_VALUES + 1)

struct otg_row {
    double value[MOTION_SYNC_AXES][OTG_VALUES];
    double duration; /* NAN when there is no such column */
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
void otg_row_scale(const struct otg_header *header, const struct otg_row *row,
                   struct otg_scaled *scaled);

/* How long the fastest motion takes when its acceleration steps, which is what
 * jmax 0 says; the plan has steep ramps in the place of steps.  Each axis by
 * itself, until the last is there.  NAN where an axis has a limit of jerk, or
 * none of acceleration. */
double otg_steps_seconds(const struct otg_header *header,
                         const struct otg_row *row);

/* State of a plan at the start of phase i, or at its end for i = count, in the
 * row's units, p and v counted like that; j is the phase's mean. */
struct otg_point {
    double t, p, v, a, j;
};
struct otg_point otg_plan_point(const struct motion_otg_plan *plan, int i,
                                int length, int time);

#define OTG_TICKS_PER_SECOND 4096e9L

double otg_plan_seconds(const struct motion_otg_plan *plan, int time);

#endif
