/* firmware/host/recording/telemetry.h - what happened at every tick, as CSV.
 *
 * The same rows give the same bytes.  Rows come from a recorder
 * (recorder.h), never from the loop itself, and are handed to the system once a
 * second: after a kill the file ends with a whole row.
 *
 * Columns: t_ns (from the start of the run), phase, state, path_ns (time on
 * the path of the present move), and per axis NAME of unit U
 *   NAME.demand_U  NAME.demand_U_s  NAME.demand_U_s2  NAME.demand_U_s3
 *   NAME.actual_U  NAME.actual_U_s  NAME.following_U  NAME.statusword
 * and per trigger line LINE.shot, the number (from 1) of the shot that this
 * tick fired, else 0, and LINE.shot_ns, when (as t_ns), else 0; of a run with a
 * fault script the last is faults: a bit per fault of the script that is in
 * force, the first one's is 1. */
#ifndef FIRMWARE_HOST_RECORDING_TELEMETRY_H
#define FIRMWARE_HOST_RECORDING_TELEMETRY_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/host/base/files.h"
#include "firmware/host/recording/rows.h"
#include "firmware/host/recording/warning.h"
#include "firmware/host/rig/rig.h"
#include "motion/core/clock_warp.h"
#include "motion/core/track.h"

/* X(name, spelling in the file, sentence for the progress line) */
#define TELEMETRY_PHASE_LIST(X)                                                \
    X(TELEMETRY_ENABLE, "enable", "enabling drives")                           \
    X(TELEMETRY_HOME, "home", "homing")                                        \
    X(TELEMETRY_APPROACH, "approach", "going to the start")                    \
    X(TELEMETRY_MOVE, "move", "moving")                                        \
    X(TELEMETRY_SETTLE, "settle", "settling")                                  \
    X(TELEMETRY_STOP, "stop", "stopping")

enum telemetry_phase {
#define TELEMETRY_PHASE_ENUM(name, spelling, text) name,
    TELEMETRY_PHASE_LIST(TELEMETRY_PHASE_ENUM)
#undef TELEMETRY_PHASE_ENUM
        TELEMETRY_PHASES
};
const char *telemetry_phase_spelling(enum telemetry_phase phase);
const char *telemetry_phase_text(enum telemetry_phase phase);

struct telemetry_axis {
    struct motion_state demand;
    int64_t actual_q32, actual_vel_q32;
    int64_t following_q32;
    uint16_t statusword;
    unsigned goals; /* reached since the start; not in the file */
    struct hal_drive_events events; /* so far; not in the file */
    struct warning warning;         /* the newest; not in the file */
};

/* The numbers of one axis, in the order of the file.  Twelve decimals are more
 * than 2^-32 has: a demanded position read back is the one that was sent, and
 * its third difference over a millisecond is still a jerk. */
struct telemetry_field {
    const char *name;
    const char *per; /* after the unit */
    size_t offset;   /* in struct telemetry_axis, of an int64_t */
    unsigned bits, digits;
};
#define TELEMETRY_FIELDS 7
extern const struct telemetry_field telemetry_field[TELEMETRY_FIELDS];
int64_t telemetry_get(const struct telemetry_axis *axis, size_t field);
void telemetry_set(struct telemetry_axis *axis, size_t field, int64_t value);

struct telemetry_shot {
    uint32_t number; /* 0: none */
    int64_t t_ns;
    struct motion_clock_rate aim; /* the path the line's lead after the tick */
};

struct telemetry_row {
    int64_t t_ns;    /* from the start of the run */
    int64_t late_ns; /* the wake-up after its time; not in the file */
    uint32_t number; /* of the row, lost ones too; not in the file */
    struct motion_clock_rate rate;
    enum telemetry_phase phase;
    int state;                   /* enum controller_state */
    bool is_fault, is_told;      /* one is latched, and its reason is whole; not
                                    in the file */
    struct telemetry_axis *axis; /* of the rig */
    uint32_t *bus_warnings; /* so far, of each of its buses; not in the file */
    struct telemetry_shot *shot; /* of its trigger lines, in order */
    unsigned shot_count;
    uint64_t faults; /* of a fault script, in force */
    /* times that the guardian of real drives was lost; another has taken its place, or
     * it is gone; not in the file */
    uint32_t guardian_lost;
    bool guardian_gone;
    uint32_t waits_for; /* this frame, from 1, until it is told to go on; 0: for
                           none; not in the file */
    /* of the move: how often it was played to its end, is to be played in all
     * (0: until a stop), and every second time in reverse; not in the file */
    int64_t played, times;
    bool is_ping_pong;
};

struct telemetry {
    struct rows rows;
    const struct rig *rig;
    bool has_faults; /* the column */
};

/* Writes the heading. */
void telemetry_init(struct telemetry *telemetry, FILE *file,
                    const struct rig *rig, bool has_faults);
/* Errors stay in the file's error flag. */
void telemetry_write(struct telemetry *telemetry,
                     const struct telemetry_row *row);

/* Read a file back, row by row, into `take`.  Axes are found by name in the
 * rig; those the file does not have stay zero, and so do the rate (but for the
 * path time) and the state.  -1 and a sentence with the line
 * number when the file is not telemetry of this rig. */
int telemetry_read(const struct files *files, const char *path,
                   const struct rig *rig,
                   void (*take)(void *context, const struct telemetry_row *row),
                   void *context, char message[YAML_MESSAGE_MAX]);

#endif
