/* firmware/linux/batch/batch_run.h - a move under many variations, on all cores.
 *
 * Every run is simulated in virtual time by a process of its own machine; so many
 * processes as there are cores take the next run from a shared count.  A run's
 * line is appended to a journal in one write, so that after a kill the next
 * batch goes on where this one was. */
#ifndef FIRMWARE_LINUX_BATCH_BATCH_RUN_H
#define FIRMWARE_LINUX_BATCH_BATCH_RUN_H

#include <signal.h>
#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/job/job.h"
#include "firmware/linux/batch/batch_vary.h"
#include "motion/plan/plan_progress.h"

struct batch_run {
    struct job *job; /* planned, within its limits */
    const struct batch_vary *vary;
    char id[16];   /* of the batch, the first cell of every line */
    uint64_t runs; /* of the batch; those of this shard are at shard, shard +
                      shards ... */
    uint64_t shard, shards;
    const bool *is_done; /* of each run of the batch */
    unsigned processes;
    int journal; /* open for appending */
    const struct plan_progress *progress;
};

/* The heading of the table, to be freed by memory_free. */
char *batch_run_head(const struct batch_run *self);

/* All that are not done.  0; 1: interrupted; -1 with a line on stderr: a process
 * has ended before its time, or the journal cannot be written. */
int batch_run_all(const struct batch_run *self,
                  const volatile sig_atomic_t *interrupts);

#endif
