/* firmware/linux/commands/run/run_when.c - see run_when.h. */
#include "firmware/linux/commands/run/run_when.h"

#include <string.h>
#include <time.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/timecode.h"
#include "firmware/host/base/wall_time.h"
#include "firmware/host/job/job_shots.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/planning.h"
#include "motion/core/fixed.h"

/* Read a time of the move before its end. */
static enum status run_when_time(const struct run_when *self,
                                 const char *option, const char *text,
                                 int64_t *t_ns_q12)
{
    char end[NUMBER_MAX];
    const enum status status =
        planning_time(self->job, "run", option, text, t_ns_q12);
    if (status != STATUS_OK)
        return status;
    if (*t_ns_q12 >= 0 && *t_ns_q12 < self->job->end_ns_q12)
        return STATUS_OK;
    number_seconds(end, self->job->end_ns_q12);
    error_say("slew run: %s: '%s' is not within the move, expected a "
              "move time from 0 s to before its end at %s s",
              option, text, end);
    return STATUS_INPUT;
}

/* Nowhere but within the move is there anything to hold. */
static enum status run_when_hold(struct run_when *self)
{
    const struct options *options = self->options;
    int64_t t_ns_q12;
    self->hold_at_ns = -1;
    if (options->hold_at == NULL && options->resume_after_ns < 0)
        return STATUS_OK;
    if (options->hold_at == NULL) {
        error_say("slew run: --resume-after is for a hold, expected --hold-at "
                  "TIME with it");
        return STATUS_INPUT;
    }
    const enum status status =
        run_when_time(self, "--hold-at", options->hold_at, &t_ns_q12);
    if (status != STATUS_OK)
        return status;
    if (t_ns_q12 < self->from_ns_q12) {
        error_say("slew run: --hold-at %s is before --from %s, expected a time "
                  "after it",
                  options->hold_at, options->from);
        return STATUS_INPUT;
    }
    self->hold_at_ns = t_ns_q12 / MOTION_FIXED_NS_Q12;
    return STATUS_OK;
}

/* Why the move cannot be played but once and from its start; NULL: it can. */
static const char *run_when_only_whole(const struct run_when *self)
{
    const struct job *job = self->job;
    if (job->compiled != NULL)
        return "a compiled move is read from its start to its end, expected "
               "the move file itself";
    return job_has_shots(job)
               ? "the move has events, whose times are those of one play from "
                 "its start, expected a move without them"
               : NULL;
}

bool run_when_is_on_clock(const struct options *options)
{
    return options->realtime || options->real || options->pty;
}

static enum status run_when_refuse(const char *option, const char *why)
{
    error_say("slew run: %s: %s", option, why);
    return STATUS_INPUT;
}

/* A time of the wall clock that is to come; it is no time where the clock is
 * virtual. */
static enum status run_when_at(struct run_when *self)
{
    const struct options *options = self->options;
    struct timespec now;
    if (options->at == NULL)
        return STATUS_OK;
    const char *wrong = wall_time_parse(options->at, &self->at_ns);
    if (wrong != NULL) {
        error_say("slew run: --at: '%s' %s, expected a time such as "
                  "2026-11-23T21:00:00.5Z or 2026-11-23T22:00:00+01:00",
                  options->at, wrong);
        return STATUS_INPUT;
    }
    if (!run_when_is_on_clock(options)) {
        error_say("slew run: --at is a time of the wall clock, expected --real "
                  "or --realtime with it");
        return STATUS_INPUT;
    }
    clock_gettime(CLOCK_REALTIME, &now); /* cannot fail for this clock */
    if (self->at_ns / INT64_C(1000000000) > now.tv_sec)
        return STATUS_OK;
    error_say("slew run: --at: %s is over, expected a time to come",
              options->at);
    return STATUS_INPUT;
}

/* A line of kind start; where it is simulated, one with pulses. */
static enum status run_when_on_edge(struct run_when *self)
{
    const struct options *options = self->options;
    const struct rig *rig = &self->job->rig;
    self->start_line = -1;
    if (options->on_edge == NULL)
        return STATUS_OK;
    if (options->at != NULL) {
        error_say("slew run: --on-edge and --at are two starts, expected one "
                  "of them");
        return STATUS_INPUT;
    }
    for (uint32_t i = 0; i < rig->line_count; i++)
        if (rig->line[i].kind == RIG_LINE_START &&
            strcmp(rig->line[i].name, options->on_edge) == 0)
            self->start_line = (int)i;
    if (self->start_line < 0)
        error_say("slew run: --on-edge: '%.40s' is not a line of this rig of "
                  "kind start, expected the name of one",
                  options->on_edge);
    else if (!options->real && rig->line[self->start_line].sim_every_ns == 0)
        error_say("slew run: --on-edge: the simulated line %s has no pulses, "
                  "expected sim: TIME in the rig, or --real",
                  options->on_edge);
    else
        return STATUS_OK;
    return STATUS_INPUT;
}

/* How often, by the options, or else by the move itself. */
static bool run_when_repeats(struct run_when *self)
{
    const struct options *options = self->options;
    const struct plan_move *move = &self->job->move;
    const bool by_option = options->loop >= 0 || options->ping_pong;
    self->is_ping_pong = by_option ? options->ping_pong : move->is_ping_pong;
    if (!by_option)
        self->times = move->times == 0 ? 1 : move->times;
    else
        self->times = options->loop == 0   ? -1
                      : options->loop > 0  ? options->loop
                      : options->ping_pong ? 2
                                           : 1;
    return self->times != 1 || self->is_ping_pong;
}

/* What it is that repeats it, for a sentence. */
static const char *run_when_repeat_name(const struct run_when *self)
{
    if (self->options->ping_pong)
        return "--ping-pong";
    if (self->options->loop >= 0)
        return "--loop";
    return self->is_ping_pong ? "ping_pong of the move" : "loop of the move";
}

/* Where it begins, and how often. */
static enum status run_when_plays(struct run_when *self)
{
    const struct options *options = self->options;
    const bool repeats = run_when_repeats(self);
    const char *why = run_when_only_whole(self);
    if (options->from != NULL && why != NULL)
        return run_when_refuse("--from", why);
    if (repeats && why != NULL)
        return run_when_refuse(run_when_repeat_name(self), why);
    if (self->times < 0 && !run_when_is_on_clock(options))
        return run_when_refuse(options->loop == 0 ? "--loop 0"
                                                  : "loop: forever",
                               "in virtual time it would not end, expected "
                               "--realtime or --real with it");
    for (unsigned i = 0; self->is_ping_pong && i < self->job->move.axis_count;
         i++)
        if (job_runs_by_drive_profile(self->job, i))
            return run_when_refuse(
                run_when_repeat_name(self),
                "an axis goes by its drive's profile, which is not the same in "
                "reverse, expected --loop");
    return options->from == NULL ? STATUS_OK
                                 : run_when_time(self, "--from", options->from,
                                                 &self->from_ns_q12);
}

/* What would not go together with a clock that is followed; NULL: nothing. */
static const char *run_when_not_following(const struct run_when *self)
{
    const struct options *options = self->options;
    if (!run_when_is_on_clock(options))
        return "is for the clock, expected --realtime or --real with it";
    if (self->job->move.fps_num == 0)
        return "the move has no frame rate, expected fps: in it";
    if (options->at != NULL || options->on_edge != NULL)
        return "is a start of its own, expected no --at and no --on-edge";
    if (options->hold_at != NULL || self->times != 1 || self->is_ping_pong)
        return "is for a move that is played once, expected no --hold-at, "
               "--loop or --ping-pong, and --loop 1 where the move has loop";
    if (self->play_q30 != MOTION_CLOCK_WARP_ONE_Q30)
        return "sets the speed, expected no --override";
    return NULL;
}

/* It is judged at the speed that it may be played at. */
static enum status run_when_follow(struct run_when *self)
{
    const struct options *options = self->options;
    struct run_follow_config *follow = &self->follow;
    uint64_t frames = 0;
    follow->line = -1;
    if (options->follow == NULL && options->follow_at == NULL)
        return STATUS_OK;
    if (options->follow == NULL)
        return run_when_refuse("--follow-at", "is for a clock that is "
                                              "followed, expected --follow "
                                              "CLOCK with it");
    const char *why = run_when_not_following(self);
    if (why != NULL)
        return run_when_refuse("--follow", why);
    why = run_follow_clock(follow, &self->job->rig, options->real,
                           options->follow);
    if (why != NULL) {
        error_say("slew run: --follow: '%.40s' %s", options->follow, why);
        return STATUS_INPUT;
    }
    follow->fps =
        (struct units_fps){ self->job->move.fps_num, self->job->move.fps_den };
    follow->from_ns = self->from_ns_q12 / MOTION_FIXED_NS_Q12;
    self->rate_q30 += RUN_FOLLOW_SPAN_Q30;
    if (options->follow_at == NULL)
        return STATUS_OK;
    if (follow->kind == RUN_FOLLOW_LINE)
        return run_when_refuse("--follow-at", "pulses have no number, expected "
                                              "ltc:FILE or mtc:FILE");
    why = timecode_frames(options->follow_at, follow->fps, &frames);
    follow->zero_frame = (int64_t)frames;
    if (why == NULL)
        return STATUS_OK;
    error_say("slew run: --follow-at: '%.40s' %s, expected a timecode such as "
              "01:00:10:00",
              options->follow_at, why);
    return STATUS_INPUT;
}

/* Somebody or something must say that a frame may be taken. */
static enum status run_when_steps(const struct run_when *self)
{
    const struct options *options = self->options;
    const struct rig_line *line = self->job->step_line;
    if (self->job->steps.count == 0)
        return STATUS_OK;
    if (options->follow != NULL)
        return run_when_refuse("--follow", "is for a move that goes on, and "
                                           "this one waits before every frame");
    if (line == NULL && !run_when_is_on_clock(options)) {
        error_say("slew run: the shoot waits for the operator before every "
                  "frame, expected --realtime or --real");
        return STATUS_INPUT;
    }
    if (line != NULL && !options->real && line->sim_every_ns == 0 &&
        !run_when_is_on_clock(options)) {
        error_say("slew run: the shoot waits for %s, and the simulated line "
                  "has no pulses, expected sim: TIME in the rig, --realtime, "
                  "or --real",
                  line->name);
        return STATUS_INPUT;
    }
    return STATUS_OK;
}

/* A board begins when it has been loaded. */
static enum status run_when_sampled(const struct run_when *self)
{
    const struct options *options = self->options;
    const struct {
        const char *option;
        bool is_given;
    } rows[] = {
        { "--from", options->from != NULL },
        { run_when_repeat_name(self), self->is_ping_pong },
        { "--at", options->at != NULL },
        { "--on-edge", options->on_edge != NULL },
        { "--follow", options->follow != NULL },
    };
    const char *name = job_sampled(self->job);
    for (size_t i = 0; i < ARRAY_LEN(rows) && name != NULL; i++)
        if (rows[i].is_given) {
            error_say("slew run: %s: %s is sampled by a board, which begins "
                      "when it has been loaded and plays a move from its start "
                      "to its end, expected a run without it",
                      rows[i].option, name);
            return STATUS_INPUT;
        }
    return STATUS_OK;
}

enum status run_when_read(struct run_when *self, const struct options *options,
                          const struct job *job)
{
    self->options = options;
    self->job = job;
    self->rate_q30 = self->play_q30 = options->override_q30;
    enum status status = run_when_plays(self);
    if (status == STATUS_OK)
        status = run_when_sampled(self);
    if (status == STATUS_OK)
        status = run_when_hold(self);
    if (status == STATUS_OK)
        status = run_when_at(self);
    if (status == STATUS_OK)
        status = run_when_on_edge(self);
    if (status == STATUS_OK)
        status = run_when_follow(self);
    if (status == STATUS_OK)
        status = run_when_steps(self);
    return status;
}
