/* firmware/linux/machine/run_keys.c - see run_keys.h. */
#include "firmware/linux/machine/run_keys.h"

#include <stdio.h>
#include <unistd.h>

#include "firmware/control/controller.h"
#include "firmware/linux/machine/progress.h"
#include "firmware/linux/machine/shots.h"
#include "motion/core/err.h"

#define RUN_KEYS_STEP  10 /* % */
#define RUN_KEYS_LEAST 10
#define RUN_KEYS_MOST  200

bool run_keys_begin(struct run_keys *keys, const struct job *job,
                    int64_t override_q30)
{
    *keys = (struct run_keys){ .job = job,
                               .override_q30 = override_q30,
                               .wanted_q30 = override_q30 };
    mailbox_init(&keys->mailbox);
    if (!isatty(STDERR_FILENO) || terminal_open(&keys->terminal) < 0)
        return false;
    fputs("keys: space holds and resumes, + and - change the speed, 0 is "
          "100 %, q stops\n",
          stderr);
    return true;
}

void run_keys_end(struct run_keys *keys)
{
    terminal_close(&keys->terminal);
}

void run_keys_take(struct run_keys *keys, const struct telemetry_row *row)
{
    keys->phase = row->phase;
    keys->is_holding = row->state == CONTROLLER_HOLDING;
}

/* On a line of its own, above the one that is redrawn. */
static void run_keys_say(const char *sentence)
{
    fprintf(stderr, "\r\033[K%s\n", sentence);
}

static bool run_keys_put(struct run_keys *keys, enum mailbox_command command,
                         int64_t value)
{
    if (mailbox_put(&keys->mailbox, command, value) == MOTION_OK)
        return true;
    run_keys_say("too many keys at once, this one is left out");
    return false;
}

static void run_keys_override(struct run_keys *keys, int percent)
{
    const int64_t rate_q30 =
        ((int64_t)percent * MOTION_CLOCK_WARP_ONE_Q30 + 50) / 100;
    if (percent < RUN_KEYS_LEAST || percent > RUN_KEYS_MOST)
        return;
    if (keys->phase != TELEMETRY_MOVE) {
        run_keys_say("the speed can be changed once the move has begun");
        return;
    }
    /* Camera triggers need their time between two shots. */
    if (rate_q30 > keys->override_q30 && !shots_check(keys->job, rate_q30))
        return;
    if (run_keys_put(keys, MAILBOX_OVERRIDE, rate_q30))
        keys->wanted_q30 = rate_q30;
}

static void run_keys_press(struct run_keys *keys, int key)
{
    const int percent = progress_percent(keys->wanted_q30);
    if (key == ' ')
        (void)run_keys_put(keys,
                           keys->is_holding ? MAILBOX_RESUME : MAILBOX_HOLD, 0);
    else if (key == '+' || key == '=')
        run_keys_override(keys, percent + RUN_KEYS_STEP);
    else if (key == '-')
        run_keys_override(keys, percent - RUN_KEYS_STEP);
    else if (key == '0')
        run_keys_override(keys, 100);
    else if (key == 'q')
        mailbox_stop(&keys->mailbox);
}

static void run_keys_refused(const struct run_keys *keys,
                             const struct mailbox_entry *answer)
{
    char sentence[120];
    if (answer->command == MAILBOX_OVERRIDE)
        snprintf(sentence, sizeof sentence,
                 "the speed stays at %d %%: at %d %% the move would break a "
                 "limit",
                 progress_percent(keys->override_q30),
                 progress_percent(answer->value));
    else
        snprintf(sentence, sizeof sentence, "there is nothing to %s now",
                 answer->command == MAILBOX_HOLD ? "hold" : "resume");
    run_keys_say(sentence);
}

static void run_keys_answer(struct run_keys *keys,
                            const struct mailbox_entry *answer)
{
    if (answer->err < 0)
        run_keys_refused(keys, answer);
    if (answer->command != MAILBOX_OVERRIDE)
        return;
    if (answer->err == MOTION_OK)
        keys->override_q30 = answer->value;
    else if (keys->wanted_q30 == answer->value)
        keys->wanted_q30 = keys->override_q30;
}

void run_keys_poll(struct run_keys *keys)
{
    struct mailbox_entry answer;
    if (!keys->terminal.is_open)
        return;
    while (mailbox_answer(&keys->mailbox, &answer))
        run_keys_answer(keys, &answer);
    for (int i = 0; i < MAILBOX_CAPACITY; i++) {
        const int key = terminal_key(&keys->terminal);
        if (key == TERMINAL_NONE || key == TERMINAL_END)
            return;
        run_keys_press(keys, key);
    }
}
