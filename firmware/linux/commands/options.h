/* firmware/linux/commands/options.h - command-line options from one table.
 *
 * Each command lists its options once; parsing and --help both read that
 * list. */
#ifndef FIRMWARE_LINUX_COMMANDS_OPTIONS_H
#define FIRMWARE_LINUX_COMMANDS_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/host/exchange/otg_rows.h"

#define OPTIONS_PATHS_MAX 256

enum option_kind {
    OPTION_FLAG,    /* bool */
    OPTION_TEXT,    /* const char * */
    OPTION_RATE,    /* int64_t, micro-hertz; 0.001 Hz .. 1 MHz */
    OPTION_TIME,    /* int64_t, nanoseconds; seconds unless a unit is given */
    OPTION_PERCENT, /* int64_t, Q30; 1 .. 200 */
    OPTION_NUMBER,  /* double, as a column of slew otg */
    OPTION_COUNT,   /* int64_t; 0 .. 10^9 */
};

struct option_row {
    const char *name;  /* without the dashes */
    const char *value; /* what stands for the value in the help, or NULL */
    enum option_kind kind;
    size_t offset; /* in struct options */
    const char *help;
};

/* All that any command takes.  Times and rates are -1 when not given. */
struct options {
    bool help, json, dry_run;
    bool all;                 /* check */
    bool segments, rules;     /* plan */
    bool quaternion, raw;     /* sample */
    bool space, film;         /* plot */
    bool realtime, real, pty; /* run, sim */
    bool take_over;           /* off */
    bool eds;                 /* sim */
    int64_t fmi;              /* sim; -1 when not given */
    const char *address;      /* sim */
    const char *out, *axis, *plot, *compare;
    const char *method, *tolerance;               /* fit */
    const char *telemetry, *can_log, *modbus_log; /* run */
    const char *record, *at, *on_edge, *hold_at, *from, *to, *faults;
    const char *pictures, *link;
    const char *follow, *follow_at;
    int64_t loop; /* times; -1 when not given, 0: until a stop */
    bool ping_pong;
    const char *rig, *fps, *columns, *curve, *interface;
    const char *scale, *offset, *decimal;          /* import */
    bool unwrap, frames;                           /* frames: fit */
    const char *root;                              /* doctor */
    const char *bus, *sheet, *map, *type, *parity; /* drive, scan */
    const char *endpoints, *kind;
    const char *identity, *units, *bauds;
    bool store, yes;
    bool home, once;                     /* jog, monitor */
    int64_t baud, timeout_ns, listen_ns; /* 0 when not given */
    int64_t rate_uhz;
    int64_t to_ns, resume_after_ns;
    const char *speed, *keys;           /* jog */
    int64_t dead_man_ns, key_every_ns;  /* jog */
    int64_t override_q30;               /* 100 % when not given */
    int64_t row;                        /* -1 when not given */
    double motion[OTG_VALUES];          /* NAN when not given */
    double wanted_s;                    /* otg; 0 when not given */
    const char *together;               /* otg */
    bool through, replan;               /* otg */
    const char *vary, *shard, *parquet; /* batch */
    int64_t runs, seed, jobs;           /* batch; -1 when not given */
    bool merge;                         /* batch */
    bool sim, group, records;           /* service */
    const char *recordings, *clock;     /* the same */
    const char *socket;                 /* service */
    int64_t cpu;                        /* service; -1 when not given */
    int64_t plan_ns, plan_mib;          /* service; 0 when not given */
    int64_t port;                       /* studio; -1 when not given */
    const char *token_file;             /* studio */
    bool edit_rig;                      /* studio */
    bool no_browser;                    /* studio */
    const char *path[OPTIONS_PATHS_MAX];
    int path_count;
};

/* Every command has these two, after its own. */
#define OPTIONS_COMMON                                                         \
    { "json", NULL, OPTION_FLAG, offsetof(struct options, json),               \
      "write JSON to standard output" },                                       \
    {                                                                          \
        "help", NULL, OPTION_FLAG, offsetof(struct options, help), "this text" \
    }

/* Rows that several commands have: what a machine is opened on, and what is
 * said before anything on it moves. */
#define OPTIONS_DRY_RUN(help)                                                  \
    {                                                                          \
        "dry-run", NULL, OPTION_FLAG, offsetof(struct options, dry_run), help  \
    }
#define OPTIONS_REAL(help)                                                     \
    {                                                                          \
        "real", NULL, OPTION_FLAG, offsetof(struct options, real), help        \
    }
#define OPTIONS_YES(help)                                                      \
    {                                                                          \
        "yes", NULL, OPTION_FLAG, offsetof(struct options, yes), help          \
    }
/* What planning a move of a client may take. */
#define OPTIONS_PLAN(prefix)                                                   \
    { "plan-time", "TIME", OPTION_TIME, offsetof(struct options, plan_ns),     \
      prefix "the longest that a move of a client is planned (60 s)" },        \
    {                                                                          \
        "plan-memory", "MIB", OPTION_COUNT,                                    \
            offsetof(struct options, plan_mib),                                \
            prefix "the most memory that this takes, MiB (512)"                \
    }
#define OPTIONS_INTERFACE                                                      \
    {                                                                          \
        "interface", "NAME", OPTION_TEXT, offsetof(struct options, interface), \
            "other interfaces than the rig's: can1, or BUS=can1,BUS=can2"      \
    }
#define OPTIONS_PORTS                                                          \
    OPTIONS_INTERFACE,                                                         \
        { "pty", NULL, OPTION_FLAG, offsetof(struct options, pty),             \
          "in real time, simulated Modbus drives behind real "                 \
          "pseudo-terminals and sockets" },                                    \
    {                                                                          \
        "realtime", NULL, OPTION_FLAG, offsetof(struct options, realtime),     \
            "run on the clock, not in virtual time"                            \
    }

struct command;

/* argv[0] is the command's name.  0, or -1 with one line on stderr. */
int options_parse(const struct command *command, int argc, char *argv[],
                  struct options *options);
void options_help(const struct command *command, FILE *file);

#endif
