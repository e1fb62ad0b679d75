/* firmware/linux/service/commands_follow.c - a start that keeps to another clock: what
 * of it is not the tick's; see follow.h. */
#define _XOPEN_SOURCE 700 /* realpath */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/timecode.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/service/command_line.h"

#define FOLLOW_ELSEWHERE                                                       \
    "it is neither below the folder of the rig nor the stream that the "       \
    "service was started with (--clock)"

static void follow_tell(struct service_control *control, const char *sentence)
{
    cJSON *object = service_event_object("follow", control->now_ns);
    cJSON_AddStringToObject(object, "text", sentence);
    snprintf(control->follow_text, sizeof control->follow_text, "%s", sentence);
    service_tell_all(control, object);
    cJSON_Delete(object);
}

static void follow_say(void *context, const char *sentence)
{
    follow_tell(context, sentence);
}

/* Why the move that is loaded cannot; NULL: it can. */
static const char *follow_not(const struct command_line *line,
                              const struct service_request *request)
{
    const struct service_control *control = line->control;
    const struct service_move_facts *facts = &control->move->facts;
    if (control->follow_opened)
        return "another start waits for a clock, or follows one";
    if (facts->fps.num == 0)
        return "the move has no frame rate, expected fps: in it";
    if (request->times != 1 || request->is_ping_pong)
        return "is for a move that is played once, expected \"times\": 1";
    if (control->state->override_q30 != FOLLOW_ONE_Q30)
        return "sets the speed, expected an override of 100 %";
    if (facts->steps.count > 0 || facts->has_events)
        return "is for a move without events, and without a wait before each "
               "frame";
    return facts->is_sampled
               ? "an axis is sampled by a board, which keeps to its own clock"
               : NULL;
}

/* "at": the timecode where the move is at its start. */
static const char *follow_at(const struct command_line *line,
                             struct run_follow_config *config)
{
    const cJSON *at = command_line_member(line, "at");
    const char *text = cJSON_GetStringValue(at);
    uint64_t frames = 0;
    if (at == NULL)
        return NULL;
    if (config->kind == RUN_FOLLOW_LINE)
        return "\"at\": pulses have no number, expected ltc:FILE or mtc:FILE";
    if (text == NULL || timecode_frames(text, config->fps, &frames) != NULL)
        return "\"at\": expected a timecode such as \"01:00:10:00\"";
    config->zero_frame = (int64_t)frames;
    return NULL;
}

/* A stream that whoever has begun the service has named, or a file or a pipe below
 * the rig's folder.  NULL: it is open. */
static const char *follow_open(const struct service_control *control,
                               struct run_follow_config *config)
{
    if (config->path == NULL)
        return NULL;
    char *real = realpath(config->path, NULL);
    const bool is_named = real != NULL && control->clock != NULL &&
                          strcmp(real, control->clock) == 0;
    free(real);
    config->file =
        is_named
            ? open(control->clock, O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY)
            : disk_open_below(control->planner.folder, config->path, true);
    config->is_open = config->file >= 0;
    if (config->is_open)
        return NULL;
    return is_named                        ? strerror(errno)
           : config->file == FILES_E_PLACE ? FOLLOW_ELSEWHERE
                                           : files_error(config->file);
}

static void follow_refuse(const struct command_line *line, const char *why)
{
    char text[SERVICE_FOLLOW_TEXT];
    snprintf(text, sizeof text, "\"follow\": %s", why);
    command_line_refuse(line, "ARG", text);
}

bool command_follow(const struct command_line *line,
                    struct service_request *request)
{
    struct service_control *control = line->control;
    const cJSON *clock = command_line_member(line, "follow");
    const char *text = cJSON_GetStringValue(clock);
    struct run_follow_config config = {
        .fps = control->move->facts.fps,
        .say = follow_say,
        .context = control,
    };
    if (clock == NULL && command_line_member(line, "at") == NULL)
        return true;
    const char *why =
        text == NULL ? "expected a text" : follow_not(line, request);
    if (why == NULL)
        why = run_follow_clock(&config, control->rig, control->is_real, text);
    if (why != NULL) {
        follow_refuse(line, why);
        return false;
    }
    why = follow_at(line, &config);
    if (why != NULL) {
        command_line_refuse(line, "ARG", why);
        return false;
    }
    why = follow_open(control, &config);
    if (why != NULL) {
        follow_refuse(line, why);
        return false;
    }
    struct machine *machine = control->loop->machine;
    const int err = run_follow_begin(
        &control->follow, &config, machine->ports.clock,
        config.line < 0 ? NULL : &machine->input[config.line].gpio);
    if (err != 0) {
        follow_refuse(line, strerror(err));
        return false;
    }
    control->follow.config.path = NULL; /* it was the request's, and is open */
    control->follow_opened = true;
    control->follow_text[0] = '\0';
    request->follow = &control->follow;
    return true;
}

bool command_is_steered(const struct command_line *line)
{
    if (!line->control->follow_opened)
        return false;
    command_line_refuse(line, "STATE", "the move keeps to another clock");
    return true;
}

/* At its own speed again, of which the tick has to hear first. */
static void follow_end(struct service_control *control, int turn)
{
    char text[RUN_FOLLOW_TEXT];
    if (control->follow.sent_q30 != FOLLOW_ONE_Q30) {
        if (mailbox_put(&control->loop->mailbox, MAILBOX_OVERRIDE,
                        FOLLOW_ONE_Q30) < 0)
            return;
        service_flies(control, MAILBOX_OVERRIDE);
    }
    if (turn == SERVICE_FOLLOW_MISSED)
        follow_tell(control, "the clock that is followed is past the start of "
                             "the move: nothing moves");
    else if (run_follow_report(&control->follow, text)[0] != '\0')
        follow_tell(control, text);
    service_follow_free(control);
}

void service_follow_free(struct service_control *control)
{
    if (!control->follow_opened)
        return;
    run_follow_end(&control->follow);
    control->follow_opened = false;
    atomic_store(&control->loop->follow.turn, SERVICE_FOLLOW_FREE);
}

void service_follow_control(struct service_control *control)
{
    const struct service_state *state = control->state;
    if (!control->follow_opened || control->flights > 0 ||
        control->loop->end != 0)
        return;
    const int turn = atomic_load(&control->loop->follow.turn);
    if (turn != SERVICE_FOLLOW_WAITS && turn != SERVICE_FOLLOW_PLAYS) {
        follow_end(control, turn);
        return;
    }
    run_follow_take(&control->follow,
                    turn == SERVICE_FOLLOW_PLAYS &&
                        state->state == CONTROLLER_MOVING &&
                        state->rate.rate_q30 > 0,
                    state->rate.s_ns_q12, state->now_ns);
    if (!run_follow_poll(&control->follow, &control->loop->mailbox))
        return;
    service_flies(control, MAILBOX_COMMANDS);
}
