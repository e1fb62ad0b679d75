/* firmware/linux/commands/batch/cmd_batch.c - slew batch: a move under many
 * variations of its machine. */
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/library/version.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/batch/batch_run.h"
#include "firmware/linux/batch/batch_table.h"
#include "firmware/linux/commands/batch/batch_out.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/planning.h"
#include "hal/support/crc32.h"

#define CMD_BATCH_RUNS      1000 /* when not given */
#define CMD_BATCH_RUNS_MAX  10000000
#define CMD_BATCH_SHARDS    100000
#define CMD_BATCH_PROCESSES 1024
#define CMD_BATCH_FILE_MAX  (256 << 20)
#define CMD_BATCH_JOURNAL   ".runs"

struct cmd_batch {
    const struct options *options;
    struct job job;
    struct fault_script script;
    struct batch_vary vary;
    struct batch_run run;
    struct batch_table table;
    bool *is_done; /* of each run */
    char journal[OUTPUT_PATH_MAX + 8];
};

/* --- options --- */

static enum status cmd_batch_wrong(const char *what, const char *text)
{
    error_say("slew batch: %s: %s", what, text);
    return STATUS_INPUT;
}

/* 1 .. CMD_BATCH_SHARDS, and what stands behind it; 0: no such number. */
static unsigned long cmd_batch_count(const char *text, char **rest)
{
    *rest = NULL;
    if (text[0] < '0' || text[0] > '9')
        return 0;
    const unsigned long value = strtoul(text, rest, 10);
    return value <= CMD_BATCH_SHARDS ? value : 0;
}

/* "3/8": the third of eight. */
static enum status cmd_batch_shard(const char *text, struct batch_run *run)
{
    unsigned long k = 1, n = 1;
    char *rest = NULL;

    if (text != NULL) {
        k = cmd_batch_count(text, &rest);
        n = k > 0 && *rest == '/' ? cmd_batch_count(rest + 1, &rest) : 0;
        if (n < k || n == 0 || *rest != '\0')
            return cmd_batch_wrong("--shard", "expected k/n with 1 <= k <= n, "
                                              "such as 3/8");
    }
    run->shard = k - 1;
    run->shards = n;
    return STATUS_OK;
}

static enum status cmd_batch_numbers(struct cmd_batch *self)
{
    const struct options *const options = self->options;
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);

    self->run.runs =
        options->runs < 0 ? CMD_BATCH_RUNS : (uint64_t)options->runs;
    if (self->run.runs < 1 || self->run.runs > CMD_BATCH_RUNS_MAX)
        return cmd_batch_wrong("--runs", "expected 1 .. 10000000");
    if (options->jobs == 0 || options->jobs > CMD_BATCH_PROCESSES)
        return cmd_batch_wrong("--jobs", "expected 1 .. 1024");
    self->run.processes = options->jobs > 0 ? (unsigned)options->jobs
                          : cores > 0       ? (unsigned)cores
                                            : 1;
    return cmd_batch_shard(options->shard, &self->run);
}

/* --- which batch it is --- */

static int cmd_batch_sum(const char *path, uint32_t *sum)
{
    char *bytes;
    const int64_t size =
        files_load(&disk_files, path, CMD_BATCH_FILE_MAX, &bytes);
    if (size < 0) {
        error_say("slew batch: %s: %s", path, strerror((int)-size));
        return -1;
    }
    *sum = crc32_of(*sum, bytes, (size_t)size);
    free(bytes);
    return 0;
}

/* Of everything that the results depend on, but the maps and quirk files that a
 * rig names. */
static enum status cmd_batch_id(struct cmd_batch *self)
{
    const struct options *const options = self->options;
    uint32_t sum = crc32_of(0, SLEW_VERSION, sizeof SLEW_VERSION);
    uint32_t other;

    if (cmd_batch_sum(self->job.rig_path, &sum) < 0 ||
        cmd_batch_sum(self->job.move_path, &sum) < 0 ||
        (options->faults != NULL && cmd_batch_sum(options->faults, &sum) < 0))
        return STATUS_INPUT;
    sum = crc32_of(sum, options->vary, strlen(options->vary) + 1);
    sum = crc32_of(sum, &self->vary.seed, sizeof self->vary.seed);
    sum = crc32_of(sum, &self->run.runs, sizeof self->run.runs);
    sum = crc32_of(sum, &self->job.rate_q30, sizeof self->job.rate_q30);
    other = crc32_of(1, &sum, sizeof sum);
    snprintf(self->run.id, sizeof self->run.id, "b%08" PRIx32 "%04" PRIx32, sum,
             other & 0xFFFF);
    return STATUS_OK;
}

static enum status cmd_batch_read(struct cmd_batch *self)
{
    const struct options *const options = self->options;
    char message[BATCH_MESSAGE_MAX > YAML_MESSAGE_MAX ? BATCH_MESSAGE_MAX
                                                      : YAML_MESSAGE_MAX];
    enum status status =
        planning_open(&self->job, options->path, options->path_count, false);
    if (status != STATUS_OK)
        return status;
    job_check(&self->job, options->override_q30);
    if (self->job.violation_count > 0) {
        job_print_violations(&self->job, false, stderr);
        error_say("slew batch: %u limit violation%s, nothing was run",
                  self->job.violation_count,
                  number_word(self->job.violation_count, "", "s"));
        return STATUS_REFUSED;
    }
    job_summarise(&self->job);
    if (options->faults != NULL &&
        fault_script_load(&disk_files, options->faults, &self->job.rig,
                          &self->script, message) < 0) {
        error_say("%s", message);
        return STATUS_INPUT;
    }
    if (batch_vary_init(&self->vary, &self->job.rig, options->vary,
                        options->faults != NULL ? &self->script : NULL,
                        options->seed < 0 ? 1 : (uint64_t)options->seed,
                        message) < 0) {
        error_say("slew batch: %s", message);
        return STATUS_INPUT;
    }
    return cmd_batch_id(self);
}

/* --- the journal --- */

/* What a run before this one has left is taken over, up to its last whole line;
 * nobody else may be writing it. */
static enum status cmd_batch_resume(struct cmd_batch *self)
{
    char message[BATCH_TABLE_MESSAGE];
    uint64_t whole = 0;
    const off_t size = lseek(self->run.journal, 0, SEEK_END);

    if (size > 0 && batch_table_read(&self->table, &disk_files, self->journal,
                                     &whole, message) < 0) {
        error_say("%s; remove it, or use another --out", message);
        return STATUS_INPUT;
    }
    if (self->table.rows > 0 &&
        strcmp(self->table.row[0].cell[0], self->run.id) != 0) {
        error_say("%s: is of another batch: another seed, move, rig, number of "
                  "runs or variation; remove it, or use another --out",
                  self->journal);
        return STATUS_INPUT;
    }
    if (ftruncate(self->run.journal, (off_t)whole) < 0 ||
        (whole == 0 &&
         dprintf(self->run.journal, "%s\n", self->table.head) < 0)) {
        error_say("slew batch: %s: cannot be written", self->journal);
        return STATUS_SYSTEM;
    }
    for (size_t i = 0; i < self->table.rows; i++)
        if (self->table.row[i].run < self->run.runs)
            self->is_done[self->table.row[i].run] = true;
    if (self->table.rows > 0 && !self->options->json)
        printf("%s: %zu runs are done, going on\n", self->journal,
               self->table.rows);
    fflush(stdout);
    return STATUS_OK;
}

static enum status cmd_batch_journal(struct cmd_batch *self)
{
    snprintf(self->journal, sizeof self->journal, "%s" CMD_BATCH_JOURNAL,
             self->options->out);
    self->run.journal =
        open(self->journal, O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (self->run.journal < 0) {
        error_say("slew batch: %s: cannot be created", self->journal);
        return STATUS_SYSTEM;
    }
    if (flock(self->run.journal, LOCK_EX | LOCK_NB) < 0) {
        error_say("slew batch: %s: another slew is writing it", self->journal);
        return STATUS_SYSTEM;
    }
    char *const head = batch_run_head(&self->run);
    batch_table_init(&self->table, head);
    free(head);
    self->is_done = memory_new(self->run.runs, sizeof *self->is_done);
    self->run.is_done = self->is_done;
    return cmd_batch_resume(self);
}

/* --- running --- */

static enum status cmd_batch_again(struct cmd_batch *self)
{
    char message[BATCH_TABLE_MESSAGE];
    uint64_t whole;

    batch_table_free(&self->table);
    if (batch_table_read(&self->table, &disk_files, self->journal, &whole,
                         message) == 0)
        return STATUS_OK;
    error_say("%s", message);
    return STATUS_SYSTEM;
}

static enum status cmd_batch_work(struct cmd_batch *self)
{
    const int err = batch_run_all(&self->run, interrupt_listen());
    interrupt_listen_no_more();
    if (err < 0)
        return STATUS_SYSTEM;
    const enum status status = cmd_batch_again(self);
    if (status == STATUS_OK && err > 0) {
        error_say("slew batch: interrupted with %zu runs done: the same "
                  "command goes on from there",
                  self->table.rows);
        return STATUS_INTERRUPTED;
    }
    return status;
}

static enum status cmd_batch_do(struct cmd_batch *self)
{
    enum status status = cmd_batch_numbers(self);
    if (status == STATUS_OK)
        status = cmd_batch_read(self);
    if (status == STATUS_OK)
        status = batch_out_try(self->options);
    if (status == STATUS_OK)
        status = cmd_batch_journal(self);
    if (status == STATUS_OK)
        status = cmd_batch_work(self);
    if (status == STATUS_OK)
        status = batch_out(self->options, &self->table, self->job.rig.title);
    if (status == STATUS_OK)
        unlink(self->journal);
    return status;
}

static enum status cmd_batch_simulate(const struct options *options)
{
    struct cmd_batch *const self = memory_new(1, sizeof *self);
    self->options = options;
    self->run.journal = -1;
    self->run.job = &self->job;
    self->run.vary = &self->vary;
    self->run.progress = &planning_progress;
    const enum status status = cmd_batch_do(self);
    if (self->run.journal >= 0)
        close(self->run.journal);
    batch_table_free(&self->table);
    batch_vary_free(&self->vary);
    job_free(&self->job);
    memory_free(self->is_done);
    memory_free(self);
    return status;
}

/* --- joining --- */

static enum status cmd_batch_merge(const struct options *options)
{
    char message[BATCH_TABLE_MESSAGE];
    struct batch_table table = { 0 };
    enum status status = STATUS_OK;
    uint64_t whole;

    if (options->path_count == 0)
        return cmd_batch_wrong("--merge", "which files? expected the results "
                                          "of shards");
    for (int i = 0; i < options->path_count && status == STATUS_OK; i++)
        if (batch_table_read(&table, &disk_files, options->path[i], &whole,
                             message) < 0) {
            error_say("slew batch: --merge: %s", message);
            status = STATUS_INPUT;
        }
    if (status == STATUS_OK)
        status = batch_out(options, &table, "");
    batch_table_free(&table);
    return status;
}

static enum status cmd_batch_run(const struct options *options)
{
    if (options->out == NULL)
        return cmd_batch_wrong("--out", "is missing, expected a name for the "
                                        "results such as results.csv");
    if (options->plot != NULL && plot_format_of(options->plot) < 0)
        return cmd_batch_wrong("--plot", "expected a name that ends in .svg or "
                                         ".png");
    if (options->merge)
        return cmd_batch_merge(options);
    if (options->path_count > 2)
        return cmd_batch_wrong(options->path[2],
                               "one argument too many; see slew batch --help");
    if (options->vary == NULL)
        return cmd_batch_wrong("--vary", "is missing, expected what is varied "
                                         "such as '*.mass=0.5..2'");
    return cmd_batch_simulate(options);
}

static const struct option_row cmd_batch_option[] = {
    { "vary", "LIST", OPTION_TEXT, offsetof(struct options, vary),
      "AXIS.WHAT=LOW..HIGH or =MEAN+-DEVIATION, ..., of *: every axis" },
    { "runs", "N", OPTION_COUNT, offsetof(struct options, runs),
      "how many variations (1000)" },
    { "seed", "N", OPTION_COUNT, offsetof(struct options, seed),
      "of what is drawn (1)" },
    { "faults", "FILE", OPTION_TEXT, offsetof(struct options, faults),
      "a fault script; --vary faults=20% lets each of its faults happen by "
      "chance" },
    { "override", "PERCENT", OPTION_PERCENT,
      offsetof(struct options, override_q30), "speed of the move, 1 .. 200" },
    { "out", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "the results as CSV" },
    { "parquet", "FILE", OPTION_TEXT, offsetof(struct options, parquet),
      "the results as Apache Parquet too" },
    { "plot", "FILE", OPTION_TEXT, offsetof(struct options, plot),
      "a picture of their spread, .svg or .png" },
    { "jobs", "N", OPTION_COUNT, offsetof(struct options, jobs),
      "processes (as many as there are cores)" },
    { "shard", "K/N", OPTION_TEXT, offsetof(struct options, shard),
      "only every Nth run, the Kth of them, for one of N machines" },
    { "merge", NULL, OPTION_FLAG, offsetof(struct options, merge),
      "join the results FILE ... of shards into --out" },
    OPTIONS_COMMON,
};

const struct command cmd_batch = {
    .name = "batch",
    .arguments = "RIG MOVE | DIRECTORY | --merge FILE...",
    .summary = "run a move under thousands of variations of its machine",
    .text =
        "Every run is slew run in virtual time, with servos drawn evenly from\n"
        "the ranges of --vary, or normally about MEAN+-DEVIATION, by seed and\n"
        "number of the run:\n\n"
        "  mass       moved inertia beside the rig's, such as 0.5..2\n"
        "  bandwidth  of the position loop, x the rig's\n"
        "  damping    of the position loop, x the rig's\n"
        "  friction   deceleration, such as '0..20 deg/s2'\n"
        "  delay      of each message of the drive, such as '0..2 ms'\n\n"
        "A row for every run says what was drawn, how the run ended, the "
        "largest\n"
        "following error and the end error of every axis.  The same seed "
        "gives\n"
        "the same bytes, on however many cores and machines.\n\n"
        "Runs that are done are in FILE.runs until all are: after a kill or\n"
        "Ctrl-C the same command goes on from there.  Examples of job scripts\n"
        "for GNU parallel and Slurm are in examples/batch.\n",
    .examples =
        "  slew batch --vary '*.mass=0.5..2' --out r.csv examples/dolly\n"
        "  slew batch --vary 'pan.mass=1..3,pan.friction=0..5' --runs 5000 \\\n"
        "      --out r.csv --parquet r.parquet --plot r.png examples/dolly\n"
        "  slew batch --shard 2/8 --vary '*.mass=0.5..2' --out 2.csv "
        "examples/dolly\n"
        "  slew batch --merge --out all.csv 1.csv 2.csv\n",
    .path_max = OPTIONS_PATHS_MAX,
    COMMAND_OPTIONS(cmd_batch_option),
    .run = cmd_batch_run,
};
