/* firmware/linux/commands/batch/batch_out.h - what slew batch writes. */
#ifndef FIRMWARE_LINUX_COMMANDS_BATCH_BATCH_OUT_H
#define FIRMWARE_LINUX_COMMANDS_BATCH_BATCH_OUT_H

#include "firmware/host/base/status.h"
#include "firmware/host/plot/plot_page.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/batch/batch_table.h"
#include "firmware/linux/commands/options.h"

/* Can these files be written?  Said before anything is simulated. */
enum status batch_out_try(const struct options *options);
/* Sorts the runs and writes --out, --parquet and --plot, each whole or not at
 * all; then says on standard output how they ended.  STATUS_REFUSED: runs of a
 * --merge are missing; STATUS_INPUT: one is there twice. */
enum status batch_out(const struct options *options, struct batch_table *table,
                      const char *title);

#endif
