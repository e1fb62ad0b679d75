/* firmware/linux/tools/doctor_jitter.c - how late a program that sleeps until
 * its next tick wakes up; see doctor.h. */
#include "firmware/linux/tools/doctor_parts.h"

#include <inttypes.h>
#include <pthread.h>
#include <sched.h>

#include "hal/linux/clock.h"

#define JITTER_PRIORITY 40 /* as player.c */
#define JITTER_BINS     10001
#define JITTER_BIN_NS   INT64_C(1000)

struct jitter {
    unsigned bin[JITTER_BINS]; /* of one microsecond; the last: beyond */
    unsigned count;
    int64_t worst_ns, sum_ns;
};

static void jitter_take(struct jitter *jitter, int64_t late_ns)
{
    int64_t bin = late_ns / JITTER_BIN_NS;

    if (bin < 0)
        bin = 0;
    if (bin >= JITTER_BINS)
        bin = JITTER_BINS - 1;
    jitter->bin[bin]++;
    jitter->count++;
    jitter->sum_ns += late_ns;
    if (late_ns > jitter->worst_ns)
        jitter->worst_ns = late_ns;
}

/* So late, in us, at most 1 in 1000 was later. */
static unsigned jitter_usual_us(const struct jitter *jitter)
{
    unsigned beyond = 0, bin = JITTER_BINS - 1;

    while (bin > 0 && (beyond + jitter->bin[bin]) * 1000 <= jitter->count)
        beyond += jitter->bin[bin--];
    return bin;
}

static void jitter_measure(const struct doctor_config *config,
                           struct jitter *jitter)
{
    struct clock_linux real;
    struct hal_clock *clock = clock_linux_init(&real);
    const int64_t start_ns = hal_clock_now_ns(clock);

    for (int64_t due_ns = start_ns + config->period_ns;
         due_ns <= start_ns + config->measure_ns;) {
        if (hal_clock_wait_until(clock, due_ns) < 0)
            return; /* a signal */
        const int64_t now_ns = hal_clock_now_ns(clock);

        jitter_take(jitter, now_ns - due_ns);
        do /* ticks that were slept over are gone */
            due_ns += config->period_ns;
        while (due_ns <= now_ns);
    }
}

void doctor_jitter(struct doctor *doctor)
{
    const struct doctor_config *config = &doctor->config;
    const struct sched_param first = { .sched_priority = JITTER_PRIORITY };
    const struct sched_param normal = { .sched_priority = 0 };
    static struct jitter jitter;

    if (config->measure_ns < config->period_ns || config->period_ns <= 0)
        return;
    jitter = (struct jitter){ .count = 0 };
    const bool is_first =
        pthread_setschedparam(pthread_self(), SCHED_FIFO, &first) == 0;
    jitter_measure(config, &jitter);
    (void)pthread_setschedparam(pthread_self(), SCHED_OTHER, &normal);
    if (jitter.count == 0)
        return;
    const bool good = jitter.worst_ns <= config->period_ns / 4;

    doctor_say(doctor, good ? DOCTOR_OK : DOCTOR_ADVICE, "wake-ups",
               "%u of every %" PRId64 " us%s: in the mean %" PRId64
               " us late, all but 1 in 1000 at most %u us, the worst %" PRId64
               " us",
               jitter.count, config->period_ns / 1000,
               is_first ? "" : ", without priority",
               jitter.sum_ns / jitter.count / 1000,
               jitter_usual_us(&jitter) + 1, jitter.worst_ns / 1000);
    if (!good)
        doctor_advise(doctor, "more than a quarter of the tick: see priority, "
                              "processor and scheduler above; a longer tick in "
                              "rig.yaml would do too");
}
