/* firmware/host/exchange/import.h - moves of other programs, read and written.
 *
 * docs/FORMATS.md has the facts of every format and where they come from.  A
 * reader fills a plan_move for a rig; export_move writes it as move.yaml.  A
 * writer gets a planned job and writes the format. */
#ifndef FIRMWARE_HOST_EXCHANGE_IMPORT_H
#define FIRMWARE_HOST_EXCHANGE_IMPORT_H

#include <stdio.h>

#include "firmware/host/base/units.h"
#include "firmware/host/exchange/import_text.h"
#include "firmware/host/job/job.h"
#include "firmware/host/rig/rig.h"

#define IMPORT_COLUMNS_MAX 64
#define IMPORT_NAME_MAX    64
#define IMPORT_UNIT_MAX    24
#define IMPORT_NOTE_MAX    1024
#define IMPORT_NAMES_MAX   ((size_t)RIG_AXES_MAX * PLAN_NAME_MAX)

/* What the user said. */
struct import_settings {
    const struct rig *rig;
    struct units_fps fps; /* den 0: not said */
    /* What each column (curve, joint) is, in the file's order, with that of times;
     * "-" is no axis.  column_count 0: by the names in the file. */
    char column[IMPORT_COLUMNS_MAX][IMPORT_NAME_MAX];
    unsigned column_count;
    bool has_comma; /* 0,5 is a half */
    bool unwrap;    /* a jump of nearly a turn is one of the other way round */
    /* "10" for all axes, or "pan=-1, slide=25.4"; NULL: 1, 0 */
    const char *scale, *offset;
    enum plan_curve curve; /* through samples */
    bool has_curve;        /* the user said it: nothing else is taken */
    const struct plan_progress *progress; /* is told of reading; may be NULL */
};

enum import_part {
    IMPORT_LEFT_OUT,
    IMPORT_POSITION,
    IMPORT_VELOCITY,
    IMPORT_ACCELERATION,
    IMPORT_FRAMES,
    IMPORT_TIMES,
    IMPORT_TIMECODES,
    IMPORT_NAMELESS, /* empty, from the name on */
};

/* What became of a column, a curve or a joint. */
struct import_column {
    char name[IMPORT_NAME_MAX];   /* in the file; "": it has none */
    char called[IMPORT_NAME_MAX]; /* what of that finds its axis */
    struct plan_place place;
    enum import_part part;
    int axis;                   /* of the rig; -1: none */
    char unit[IMPORT_UNIT_MAX]; /* of its numbers; "": the axis's own */
    unsigned wraps;             /* whole turns that were taken out */
};

/* number = text x num / den + offset. */
struct import_adjust {
    int64_t num, den, offset_q32;
};

struct imported {
    struct plan_move move;      /* keys on the heap: move_free */
    struct units_fps fps;       /* of the file, or as said */
    char note[IMPORT_NOTE_MAX]; /* what was lost; empty: nothing */
    struct import_column column[IMPORT_COLUMNS_MAX]; /* in the file's order */
    unsigned columns;
    const char *column_word; /* "column", "curve", "joint" */
    char
        first[IMPORT_NAME_MAX]; /* the time of its first row or key; "": none */
};

struct import_format {
    const char *name;
    const char *summary;
    bool named;   /* the file says which axis a column is */
    bool timed;   /* and how many frames a second has */
    bool sampled; /* positions at frames, no tangents that somebody drew */
    /* 0, or -1 with the sentence written; nothing is on the heap then.  NULL:
     * cannot be read. */
    int (*read)(const struct files *files, const char *path,
                const struct import_settings *settings,
                struct imported *imported, char message[YAML_MESSAGE_MAX]);
    /* Writes to a file that is kept only when this returns 0; otherwise -1 and
     * the sentence. */
    int (*write)(const struct job *job, const struct units_fps *fps, FILE *file,
                 char message[YAML_MESSAGE_MAX]);
};

/* Ends with a row whose name is NULL. */
extern const struct import_format import_format[];
const struct import_format *import_format_find(const char *name);
/* "no format foo, expected kuper, ... or blender"; written into `message`.
 * `also` has what the command has besides; ends with NULL. */
#define IMPORT_ALSO_MAX 4
void import_format_unknown(const char *name, const char *const also[],
                           char message[YAML_MESSAGE_MAX]);

/* "frame,pan,-,tilt".  0, or -1 with the sentence written. */
int import_settings_columns(struct import_settings *settings, const char *text,
                            char message[YAML_MESSAGE_MAX]);

/* One more column of the file, not yet known what it is. */
int import_add_column(const struct import_text *text, struct plan_place place,
                      struct imported *imported, const char *name,
                      const char *called);
/* Say of all that were added what they are: by --columns, which names every one of
 * them or is refused, or by their own names.  Of a table ("column") they may be
 * times, velocities and accelerations too, of curves and joints they are axes. */
int import_name_columns(const struct import_text *text,
                        const struct import_settings *settings,
                        struct imported *imported);

/* Adjust an axis: unwrapped, scaled and moved as the settings say, and times that are
 * frames but for rounding are frames.  0, or -1 with the sentence written. */
int import_adjust(const struct import_settings *settings,
                  struct imported *imported, char message[YAML_MESSAGE_MAX]);
/* What the settings say of an axis of the rig. */
int import_adjust_of(const struct import_settings *settings, unsigned axis,
                     struct import_adjust *adjust,
                     char message[YAML_MESSAGE_MAX]);
/* A turn of an axis that turns, Q32; 0: it does not. */
int64_t import_turn_q32(enum units_axis unit);

/* Start the axis of the move that a column is; NULL with the sentence when it is
 * there already. */
struct plan_axis *import_add_axis(const struct import_text *text,
                                  const struct import_settings *settings,
                                  struct imported *imported,
                                  const struct import_column *column);
/* One more key, zeroed; NULL with the sentence at PLAN_KEYS_MAX. */
struct plan_key *import_add_key(const struct import_text *text,
                                struct plan_place place,
                                struct plan_axis *axis);

/* The readers and writers of the table. */
int import_kuper(const struct files *files, const char *path,
                 const struct import_settings *settings,
                 struct imported *imported, char message[YAML_MESSAGE_MAX]);
int import_flair(const struct files *files, const char *path,
                 const struct import_settings *settings,
                 struct imported *imported, char message[YAML_MESSAGE_MAX]);
int import_raw(const struct files *files, const char *path,
               const struct import_settings *settings,
               struct imported *imported, char message[YAML_MESSAGE_MAX]);
int import_csv(const struct files *files, const char *path,
               const struct import_settings *settings,
               struct imported *imported, char message[YAML_MESSAGE_MAX]);
int import_anim(const struct files *files, const char *path,
                const struct import_settings *settings,
                struct imported *imported, char message[YAML_MESSAGE_MAX]);
int import_blender(const struct files *files, const char *path,
                   const struct import_settings *settings,
                   struct imported *imported, char message[YAML_MESSAGE_MAX]);
int import_ros(const struct files *files, const char *path,
               const struct import_settings *settings,
               struct imported *imported, char message[YAML_MESSAGE_MAX]);
int export_kuper(const struct job *job, const struct units_fps *fps, FILE *file,
                 char message[YAML_MESSAGE_MAX]);
int export_flair(const struct job *job, const struct units_fps *fps, FILE *file,
                 char message[YAML_MESSAGE_MAX]);
int export_raw(const struct job *job, const struct units_fps *fps, FILE *file,
               char message[YAML_MESSAGE_MAX]);
int export_csv(const struct job *job, const struct units_fps *fps, FILE *file,
               char message[YAML_MESSAGE_MAX]);
int export_anim(const struct job *job, const struct units_fps *fps, FILE *file,
                char message[YAML_MESSAGE_MAX]);

int export_blender(const struct job *job, const struct units_fps *fps,
                   FILE *file, char message[YAML_MESSAGE_MAX]);
int export_ros_yaml(const struct job *job, const struct units_fps *fps,
                    FILE *file, char message[YAML_MESSAGE_MAX]);
int export_ros_json(const struct job *job, const struct units_fps *fps,
                    FILE *file, char message[YAML_MESSAGE_MAX]);

/* "dolly,pan,tilt": the axes in the rig's order, as --columns takes them. */
void import_axis_names(const struct rig *rig, char text[IMPORT_NAMES_MAX]);

/* A column of this name has times: frame, t, time, t_ns, "time (ms)", timecode. */
bool import_is_time(const char *name);

/* The frame nearest to a time; -1 beyond the range. */
int64_t import_frame_near(const struct units_fps *fps, int64_t t_ns_q12);
/* The time of the frame of six decimals that is nearest, and that frame in
 * millionths; INT64_MIN beyond the range. */
int64_t import_frame_at(const struct units_fps *fps, int64_t t_ns_q12,
                        int64_t *micro);
/* The time of frame k to the nearest 2^-12 ns, as "frame k @ fps" is read; -1
 * beyond the range. */
int64_t import_frame_ns_q12(const struct units_fps *fps, int64_t frame);

/* move.yaml, with `origin` as its first line, a comment.  Positions, velocities and accelerations have the digits that give
 * the same integers when read (up to 10^8 units), times are frames where they
 * are whole ones.  -1 with the sentence when the file would be larger than
 * slew reads. */
int export_move(const struct imported *imported, const char *origin, FILE *file,
                char message[YAML_MESSAGE_MAX]);

#endif
