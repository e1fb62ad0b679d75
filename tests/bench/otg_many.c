/* tests/bench/otg_many.c - the planner against a great many problems.
 *
 *   otg_many [-n COUNT] [-s SEED] [-f FIRST] [-j PROCESSES] [-m MISSED]
 *            [-b BAD] [-l LONG]
 *
 * Problems FIRST .. FIRST + COUNT - 1 of tests/motion/otg/otg_many.h, every
 * answer judged by the oracle.  Each that is missed or bad is printed with the
 * command that repeats it alone; progress goes to standard error.  Status 1
 * when more than MISSED (0) are missed or in doubt, more than BAD (0) are bad,
 * more than LONG (0) longer than the least, or a process died. */
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "tests/motion/otg/otg_many.h"

#define PROCESSES 64
#define SHOWN     20 /* bad ones, per process */

/* One per process, in shared memory. */
struct tally {
    uint64_t verdict[MANY_KINDS][MANY_VERDICTS];
    uint64_t at; /* the problem under way */
    double worst_ns;
    uint64_t worst_at;
};

struct run {
    uint64_t count, seed, first, missed, bad, late;
    int processes;
    struct tally *tally;
};

static double now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e9 + (double)now.tv_nsec;
}

static void work(const struct run *run, int process)
{
    struct tally *tally = &run->tally[process];
    uint64_t end = run->first + run->count;
    int shown = 0;
    for (tally->at = run->first + (uint64_t)process; tally->at < end;
         tally->at += (uint64_t)run->processes) {
        struct many_problem problem;
        char text[MANY_TEXT];
        many_draw(run->seed, tally->at, &problem);
        double start = now_ns();
        enum many_verdict verdict = many_run(&problem, text);
        double took = now_ns() - start;
        tally->verdict[problem.kind][verdict]++;
        if (took > tally->worst_ns) {
            tally->worst_ns = took;
            tally->worst_at = tally->at;
        }
        if ((verdict >= MANY_DOUBT && shown++ < SHOWN) ||
            (verdict == MANY_LATE && run->count == 1))
            printf("%s: %s: %s\n  again: otg_many -s %" PRIu64 " -f %" PRIu64
                   " -n 1\n",
                   verdict == MANY_BAD     ? "bad"
                   : verdict == MANY_LATE  ? "long"
                   : verdict == MANY_DOUBT ? "in doubt"
                                           : "missed",
                   many_kind_text(problem.kind), text, run->seed, tally->at);
    }
    fflush(stdout);
}

static uint64_t done(const struct run *run)
{
    uint64_t sum = 0;
    for (int i = 0; i < run->processes; i++)
        for (int k = 0; k < MANY_KINDS; k++)
            for (int v = 0; v < MANY_VERDICTS; v++)
                sum += run->tally[i].verdict[k][v];
    return sum;
}

/* Waits for all, and says every few seconds how far they are. */
static bool watch(const struct run *run, const pid_t pid[])
{
    bool fine = true;
    double start = now_ns(), said = start;
    for (int left = run->processes; left > 0;) {
        int status;
        pid_t ended = waitpid(-1, &status, WNOHANG);
        if (ended > 0) {
            left--;
            for (int i = 0; i < run->processes; i++)
                if (pid[i] == ended && status != 0) {
                    printf("died: problem %" PRIu64 " of seed %" PRIu64 "\n",
                           run->tally[i].at, run->seed);
                    fine = false;
                }
            continue;
        }
        nanosleep(&(struct timespec){ .tv_nsec = 20000000 }, NULL);
        if (now_ns() - said < 5e9)
            continue;
        said = now_ns();
        fprintf(stderr, "otg-many: %" PRIu64 " of %" PRIu64 ", %.0f s\n",
                done(run), run->count, (said - start) / 1e9);
    }
    return fine;
}

static bool report(const struct run *run, double seconds)
{
    uint64_t all[MANY_VERDICTS] = { 0 };
    double worst = 0;
    uint64_t worst_at = 0;
    printf("  %-28s %10s %10s %10s %5s %9s %7s %5s\n", "", "answered",
           "no motion", "too far", "long", "in doubt", "missed", "bad");
    for (int k = 0; k < MANY_KINDS; k++) {
        uint64_t sum[MANY_VERDICTS] = { 0 };
        for (int v = 0; v < MANY_VERDICTS; v++)
            for (int i = 0; i < run->processes; i++)
                sum[v] += run->tally[i].verdict[k][v];
        for (int v = 0; v < MANY_VERDICTS; v++)
            all[v] += sum[v];
        printf("  %-28s", many_kind_text((enum many_kind)k));
        for (int v = 0; v < MANY_VERDICTS; v++)
            printf(" %*" PRIu64,
                   v < MANY_LATE     ? 10
                   : v == MANY_LATE  ? 5
                   : v < MANY_MISSED ? 9
                   : v < MANY_BAD    ? 7
                                     : 5,
                   sum[v]);
        puts("");
    }
    for (int i = 0; i < run->processes; i++) {
        const struct tally *tally = &run->tally[i];
        worst_at = tally->worst_ns > worst ? tally->worst_at : worst_at;
        worst = tally->worst_ns > worst ? tally->worst_ns : worst;
    }
    printf("otg-many: %" PRIu64 " problems of seed %" PRIu64
           " in %.0f s; %" PRIu64 " answered, %" PRIu64
           " have no motion, %" PRIu64 " too far, %" PRIu64 " long, %" PRIu64
           " in doubt, %" PRIu64 " missed, %" PRIu64 " bad\n",
           run->count, run->seed, seconds, all[MANY_GOOD], all[MANY_REFUSED],
           all[MANY_RANGE], all[MANY_LATE], all[MANY_DOUBT], all[MANY_MISSED],
           all[MANY_BAD]);
    printf("otg-many: longest, with its judge, %.2f ms (problem %" PRIu64 ")\n",
           worst / 1e6, worst_at);
    return all[MANY_BAD] <= run->bad && all[MANY_LATE] <= run->late &&
           all[MANY_DOUBT] + all[MANY_MISSED] <= run->missed;
}

static int usage(void)
{
    fputs("usage: otg_many [-n COUNT] [-s SEED] [-f FIRST] [-j PROCESSES]"
          " [-m MISSED] [-b BAD] [-l LONG]\n",
          stderr);
    return 2;
}

static bool run_parse(int argc, char **argv, struct run *run)
{
    int option;
    while ((option = getopt(argc, argv, "n:s:f:j:m:b:l:")) != -1) {
        char *end;
        uint64_t value = option == '?' ? 0 : strtoull(optarg, &end, 0);
        if (option == '?' || *end != 0)
            return false;
        if (option == 'n')
            run->count = value;
        else if (option == 's')
            run->seed = value;
        else if (option == 'f')
            run->first = value;
        else if (option == 'm')
            run->missed = value;
        else if (option == 'b')
            run->bad = value;
        else if (option == 'l')
            run->late = value;
        else
            run->processes = (int)(value > PROCESSES ? PROCESSES : value);
    }
    return optind == argc && run->processes > 0;
}

/* Zeros that all processes see; NULL without. */
static void *shared(size_t size)
{
    FILE *file = tmpfile();
    if (file == NULL || ftruncate(fileno(file), (off_t)size) < 0)
        return NULL;
    void *storage =
        mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED, fileno(file), 0);
    return storage == MAP_FAILED ? NULL : storage;
}

int main(int argc, char **argv)
{
    struct run run = { .count = 200000, .seed = 1, .processes = 1 };
    pid_t pid[PROCESSES];
    if (!run_parse(argc, argv, &run))
        return usage();
    run.tally = shared(PROCESSES * sizeof *run.tally);
    if (run.tally == NULL) {
        perror("otg_many");
        return 2;
    }
    double start = now_ns();
    for (int i = 0; i < run.processes; i++) {
        pid[i] = fork();
        if (pid[i] == 0) {
            work(&run, i);
            _exit(0);
        }
        if (pid[i] < 0)
            return 2;
    }
    bool fine = watch(&run, pid);
    fine = report(&run, (now_ns() - start) / 1e9) && fine;
    return fine ? 0 : 1;
}
