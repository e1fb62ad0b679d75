/* tests/firmware/control/stateful_play.c - a move that is loaded: gone to,
 * reversed, repeated.  The judge is told what begins by itself. */
#include <string.h>

#include "motion/core/err.h"
#include "tests/firmware/control/stateful.h"

static void load_axis(struct stateful *bench, unsigned i)
{
    struct motion_track *track = &bench->loaded_track[i];
    *track = bench->track[bench->spare][i];
    memcpy(bench->loaded[i], bench->storage[bench->spare][i],
           sizeof bench->loaded[i]);
    track->segment = bench->loaded[i];
}

/* The spare tracks, of the axes in this mask. */
void stateful_load(struct stateful *bench, uint32_t axes)
{
    const struct motion_track *track[STATEFUL_AXES] = { NULL };
    if (stateful_in_motion(bench->controller.state))
        return;
    for (unsigned i = 0; i < bench->axes; i++) {
        if ((axes >> i & 1) == 0)
            continue;
        load_axis(bench, i);
        track[i] = &bench->loaded_track[i];
    }
    assert_int_equal(playback_load(&bench->playback, track), MOTION_OK);
    for (unsigned i = 0; i < bench->axes; i++)
        if (track[i] != NULL && bench->axis_config[i].by_goals)
            playback_set_goals(&bench->playback, i, bench->loaded_goal[i],
                               controller_goals_of(track[i],
                                                   bench->loaded_goal[i],
                                                   STATEFUL_GOALS));
    stateful_note(bench, "load %#" PRIx32, axes);
}

/* What begins here is a motion from rest, forward but for a turn. */
static void play_begins(struct stateful *bench, enum controller_state was,
                        bool played)
{
    struct stateful_judge *judge = &bench->judge;
    const int64_t s_ns_q12 = bench->controller.rate.s_ns_q12;
    const bool turns = bench->playback.is_ping_pong && played &&
                       judge->s_ns_q12 > bench->playback.end_ns_q12 / 2;
    if (was != CONTROLLER_READY || !stateful_in_motion(bench->controller.state))
        return;
    stateful_motion_begins(bench, STATEFUL_MOVE, was);
    judge->is_reversed = turns;
    judge->s_ns_q12 = s_ns_q12;
    judge->late = judge->lost = false;
    judge->is_resumed = bench->playback.state != PLAYBACK_PLAYING ||
                        bench->playback.then != PLAYBACK_HOLD;
    judge->play_err = MOTION_OK;
    for (unsigned k = 0; k < STATEFUL_BOARDS; k++) {
        judge->late = judge->late || bench->board[k].late_ticks > 0;
        bench->board[k].was_refused = false;
    }
    stateful_shots_arm(bench);
    bench->tally.repeated += bench->playback.played > 0;
    bench->tally.cued += bench->controller.state == CONTROLLER_HOLDING;
}

int stateful_go(struct stateful *bench, int64_t at_ns_q12,
                enum playback_then then)
{
    const enum controller_state was = bench->controller.state;
    const int err = playback_go(&bench->playback, at_ns_q12, then);
    stateful_note(bench, "go%s to %.3f, %d", err < 0 ? "!" : "",
                  (double)at_ns_q12 / (double)MOTION_FIXED_S_Q12, (int)then);
    if (err == MOTION_OK && bench->controller.state == CONTROLLER_STOPPING)
        stateful_stop_requested(bench,
                                STATEFUL_STOP); /* what was held is left */
    if (err == MOTION_OK)
        play_begins(bench, was, false);
    return err;
}

int stateful_repeat(struct stateful *bench, int64_t times, bool is_ping_pong)
{
    const int err = playback_repeat(&bench->playback, times, is_ping_pong);
    stateful_note(bench, "%s%s %d", is_ping_pong ? "ping-pong" : "loop",
                  err < 0 ? "!" : "", (int)times);
    return err;
}

void stateful_play_step(struct stateful *bench)
{
    const enum controller_state was = bench->controller.state;
    const bool played = bench->playback.state == PLAYBACK_PLAYING;
    bench->judge.s_ns_q12 = bench->controller.rate.s_ns_q12;
    bench->judge.before_play = was;
    playback_step(&bench->playback);
    play_begins(bench, was, played);
}

static void draw_load(struct stateful *bench)
{
    uint32_t axes =
        (uint32_t)stateful_in(bench, 1, ((int64_t)1 << bench->axes) - 1);
    axes = stateful_coupled_axes(bench, axes);
    for (unsigned i = 0; i < bench->axes; i++)
        if ((axes >> i & 1) != 0 && !stateful_draw_track(bench, i))
            axes &= ~((uint32_t)1 << i);
    if (stateful_any_coupled(bench))
        axes = stateful_coupled_tracks(bench, axes);
    stateful_load(bench, axes);
}

void stateful_draw_play(struct stateful *bench)
{
    if (stateful_one_in(bench, 3))
        draw_load(bench);
    if (stateful_one_in(bench, 3))
        (void)stateful_repeat(bench, stateful_in(bench, -1, 4),
                              stateful_one_in(bench, 2));
    (void)stateful_go(
        bench,
        stateful_one_in(bench, 3)
            ? 0
            : stateful_in(bench, -1, bench->playback.end_ns_q12 + 1),
        (enum playback_then)stateful_in(bench, 0, 2));
}
