/* tests/firmware/control/test_stateful.c - random commands, mishaps and
 * machines, every tick judged (tests/firmware/control/stateful.h).
 *
 *   TICKS=1000000   as many ticks; TIME=3600 for so many seconds
 *   SEED=12         that episode alone, with what led to the violation
 *   FIRST=1000      begin with that one */
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "tests/firmware/control/stateful.h"

#define EPISODE 4000
#define TICKS   200000
#define LONG    1000000 /* long enough to have been everywhere */
#define SHOWN   (getenv("ALL") ? 1000000 : 2) /* of each kind */

static uint64_t from_environment(const char *name, uint64_t otherwise)
{
    const char *given = getenv(name);
    return given ? strtoull(given, NULL, 0) : otherwise;
}

/* The run has been everywhere: every state, every leg of homing, every
 * fault. */
static void print_tally(const struct stateful_tally *tally)
{
    for (int k = 0; k <= CONTROLLER_FAULT; k++)
        printf("  %8" PRIu64 " ticks %s\n", tally->state[k],
               controller_state_text((enum controller_state)k));
    for (int k = 0; k < HOMING_STATES; k++)
        printf("  %8" PRIu64 " times homing %s\n", tally->homing[k],
               homing_state_text((enum homing_state)k));
    for (int k = 1; k <= CONTROLLER_FAULT_RUNAWAY; k++)
        printf("  %8" PRIu64 " times: %s\n", tally->fault[k],
               controller_fault_text((enum controller_fault)k));
    printf("  %8" PRIu64 " times torque off, as an axis ran away\n",
           tally->away);
    printf("  %8" PRIu64 " goals sent\n", tally->goals);
    printf("  %8" PRIu64 " ticks of coupled axes; moves with one: %" PRIu64
           " by its track, %" PRIu64 " without\n",
           tally->coupled, tally->led, tally->along);
    printf("  %8" PRIu64 " ticks of boards that move\n", tally->on_board);
    printf("  %8" PRIu64 " commands that came with a stop\n", tally->beside);
    printf("  %8" PRIu64 " pulses\n", tally->shots);
    printf("  %8" PRIu64 " ticks in reverse\n", tally->reversed);
    printf("  %8" PRIu64 " times played again\n", tally->repeated);
    printf("  %8" PRIu64 " times held at a time of the move\n", tally->cued);
    printf("  %8" PRIu64 " fault stops by the drives themselves, of them\n",
           tally->by_drives);
    for (int k = 0; k < STATEFUL_EXCUSES; k++)
        printf("  %8" PRIu64 "   as %s\n", tally->excuse[k],
               stateful_excuse_text((enum stateful_excuse)k));
}

/* Expect all that a long run has been at least once; two rails of one bridge are
 * test_gantry's. */
static void expect_everywhere(const struct stateful_tally *tally)
{
    for (int k = 0; k <= CONTROLLER_FAULT; k++)
        assert_true(tally->state[k] > 0);
    for (int k = HOMING_SEARCH; k < HOMING_STATES; k++)
        assert_true(tally->homing[k] > 0 || k == HOMING_SQUARE);
    assert_true(tally->goals > 0);
    assert_true(tally->coupled > 0 && tally->led > 0 && tally->along > 0);
    assert_true(tally->on_board > 0 && tally->beside > 0 && tally->shots > 0);
    assert_true(tally->reversed > 0 && tally->repeated > 0 && tally->cued > 0);
    for (int k = 1; k < CONTROLLER_FAULT_RUNAWAY; k++)
        if (k != CONTROLLER_FAULT_GATE) /* nothing comes so far */
            assert_true(tally->fault[k] > 0);
    assert_true(tally->away > 0); /* its following error comes before */
}

static void nothing_happens_that_must_not(void **state)
{
    static struct stateful bench;
    const uint64_t seed = from_environment("SEED", 0);
    const uint64_t ticks = from_environment("TICKS", TICKS);
    const time_t end = time(NULL) + (time_t)from_environment("TIME", 0);
    const uint64_t first = from_environment("FIRST", 1);
    unsigned bad[STATEFUL_VIOLATIONS] = { 0 }, all = 0;
    uint64_t done = 0, episodes = 0;
    (void)state;
    while (done < ticks || time(NULL) < end) {
        stateful_episode(&bench, seed ? seed : first + episodes, EPISODE);
        done += bench.ticks;
        episodes++;
        if (bench.violation != STATEFUL_NONE) {
            if (bad[bench.violation]++ < SHOWN)
                stateful_print(&bench);
            all++;
        }
        if (seed)
            break;
    }
    printf("%" PRIu64 " ticks, seeds %" PRIu64 " to %" PRIu64 "\n", done,
           seed ? seed : first, seed ? seed : first + episodes - 1);
    for (int k = 1; k < STATEFUL_VIOLATIONS; k++)
        if (bad[k] > 0)
            printf("%6u episodes: %s\n", bad[k],
                   stateful_violation_text((enum stateful_violation)k));
    if (seed == 0)
        print_tally(&bench.tally);
    if (all > 0)
        fail_msg("%u of %" PRIu64 " episodes", all, episodes);
    if (done >= LONG)
        expect_everywhere(&bench.tally);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_happens_that_must_not),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
