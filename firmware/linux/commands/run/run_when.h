/* firmware/linux/commands/run/run_when.h - when a move of slew run starts, where it
 * begins and holds, how often and how fast it is played: options made numbers. */
#ifndef FIRMWARE_LINUX_COMMANDS_RUN_RUN_WHEN_H
#define FIRMWARE_LINUX_COMMANDS_RUN_RUN_WHEN_H

#include "firmware/host/job/job.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/player/run_follow.h"

struct run_when {
    const struct options *options;
    const struct job *job;
    int64_t rate_q30; /* at which it is judged, and played */
    int64_t play_q30;
    struct run_follow_config follow; /* NONE: it follows no clock */
    int64_t hold_at_ns;              /* -1: never */
    int64_t at_ns;                   /* of the wall clock; 0: at once */
    int start_line;                  /* of the rig; -1: none */
    int64_t from_ns_q12;
    int64_t times;     /* -1: until it is stopped */
    bool is_ping_pong; /* every second time in reverse */
};

/* Of a job that is open and of a command with run's options, which stay where
 * they are.  STATUS_INPUT with the sentence printed. */
enum status run_when_read(struct run_when *self, const struct options *options,
                          const struct job *job);

/* Real drives, or simulated ones in real time. */
bool run_when_is_on_clock(const struct options *options);

#endif
