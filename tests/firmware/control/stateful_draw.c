/* tests/firmware/control/stateful_draw.c - which commands and mishaps come
 * when: what the state calls for, often a stop some ticks after something
 * began, now and then anything at all. */
#include "motion/core/err.h"
#include "tests/firmware/control/stateful.h"

#define MS INT64_C(1000000)

/* --- commands ------------------------------------------------------------ */

static uint32_t draw_axes(struct stateful *bench)
{
    return (uint32_t)stateful_in(bench, 1, ((int64_t)1 << bench->axes) - 1);
}

static void draw_start(struct stateful *bench)
{
    uint32_t axes = stateful_coupled_axes(bench, draw_axes(bench));
    for (unsigned i = 0; i < bench->axes; i++)
        if ((axes >> i & 1) != 0 &&
            (bench->axis[i].board != NULL || !stateful_draw_track(bench, i)))
            axes &= ~((uint32_t)1 << i);
    if (stateful_any_coupled(bench))
        axes = stateful_coupled_tracks(bench, axes);
    stateful_draw_reader(bench);
    (void)stateful_start(bench, axes);
}

static int64_t draw_goal_q32(struct stateful *bench, unsigned i)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    const int64_t length_q32 = config->pos_max_q32 - config->pos_min_q32;
    const int64_t here_q32 = bench->controller.axis[i].target.pos_q32;
    if (stateful_one_in(bench, 3))
        return stateful_one_in(bench, 2) ? config->pos_min_q32
                                         : config->pos_max_q32;
    if (!bench->controller.axis[i].homed || stateful_one_in(bench, 8))
        return here_q32 + stateful_in(bench, -length_q32, length_q32);
    return stateful_in(bench, config->pos_min_q32, config->pos_max_q32);
}

static void draw_jog(struct stateful *bench)
{
    const bool again =
        bench->judge.motion == STATEFUL_JOG && !stateful_one_in(bench, 8);
    const unsigned i = again ? bench->judge.jog_axis
                             : (unsigned)stateful_in(bench, 0, bench->axes - 1);
    const double share =
        stateful_one_in(bench, 2) ? 1 : stateful_between(bench, 0.02, 1.2);
    const int64_t vel_q32 =
        (int64_t)((double)bench->axis_config[i].limit.vel_q32 * share);
    (void)stateful_jog(
        bench, i, draw_goal_q32(bench, i), vel_q32,
        stateful_one_in(bench, 2) ? 0 : stateful_in(bench, 1, 600) * MS);
}

static void draw_override(struct stateful *bench)
{
    static const int64_t percent[] = { 0, 1, 10, 50, 90, 100, 100, 120, 200 };
    const int64_t p =
        stateful_one_in(bench, 2)
            ? percent[stateful_in(bench, 0, ARRAY_LEN(percent) - 1)]
            : stateful_in(bench, 0, 200);
    (void)stateful_override(bench, p * MOTION_CLOCK_WARP_ONE_Q30 / 100);
}

static void draw_stop(struct stateful *bench)
{
    const int64_t which = stateful_in(bench, 0, 9);
    if (which < 3)
        stateful_stop(bench);
    else if (which < 6)
        (void)stateful_hold(bench);
    else
        stateful_jog_stop(bench, which > 7);
}

static void draw_home(struct stateful *bench)
{
    (void)stateful_homing(bench, draw_axes(bench));
}

static void draw_place(struct stateful *bench)
{
    const unsigned i = (unsigned)stateful_in(bench, 0, bench->axes - 1);
    const struct controller_axis_config *config = &bench->axis_config[i];
    if (!homing_is_running(&bench->homing) && !stateful_any_coupled(bench) &&
        bench->axis[i].board == NULL)
        (void)stateful_set_position(
            bench, i,
            stateful_in(bench, config->pos_min_q32, config->pos_max_q32) +
                (stateful_one_in(bench, 4)
                     ? stateful_q32(bench->axis[i].scale / 100)
                     : 0));
}

static void draw_reset(struct stateful *bench)
{
    if (stateful_one_in(bench, 2))
        stateful_heal(bench);
    if (bench->judge.pressed.is_unproved && stateful_one_in(bench, 2))
        stateful_press(bench);
    (void)stateful_reset(bench);
}

static void draw_motion(struct stateful *bench)
{
    /* a board goes by what is loaded alone */
    const bool plays = bench->kind.has_boards && stateful_one_in(bench, 2);
    const int64_t which = plays ? 20 : stateful_in(bench, 0, 99);
    if (homing_is_running(&bench->homing))
        return;
    /* as fast as the move allows, to the last bit of a rate */
    if (bench->kind.has_units && stateful_one_in(bench, 3))
        (void)stateful_override(bench, MOTION_CLOCK_WARP_ONE_Q30 / 100 *
                                           stateful_in(bench, 100, 200));
    if (bench->kind.has_cams && stateful_one_in(bench, 2)) {
        stateful_draw_couple(bench);
        if (!stateful_any_coupled(bench) || stateful_one_in(bench, 2))
            return;
    }
    if (which < 20)
        draw_start(bench);
    else if (which < 50)
        stateful_draw_play(bench);
    else if (which < 75)
        draw_jog(bench);
    else
        draw_home(bench);
}

static void draw_anything(struct stateful *bench)
{
    switch (stateful_in(bench, 0, 14)) {
    case 0:
        (void)stateful_enable(bench);
        break;
    case 1:
        (void)stateful_off(bench);
        break;
    case 2:
        draw_motion(bench);
        break;
    case 3:
        (void)stateful_resume(bench);
        break;
    case 4:
        draw_override(bench);
        break;
    case 5:
        draw_reset(bench);
        break;
    case 6:
        draw_place(bench);
        break;
    case 7:
        (void)stateful_hold(bench);
        break;
    case 9:
        (void)stateful_repeat(bench, stateful_in(bench, -1, 4),
                              stateful_one_in(bench, 2));
        break;
    case 10:
        stateful_draw_play(bench);
        break;
    case 8:
        (void)stateful_reverse(bench, stateful_one_in(bench, 2));
        break;
    default:
        draw_stop(bench);
        break;
    }
}

static void draw_in_ready(struct stateful *bench)
{
    const int64_t which = stateful_in(bench, 0, 99);
    if (which < 85)
        draw_motion(bench);
    else if (which < 90)
        draw_override(bench);
    else if (which < 95)
        draw_place(bench);
    else
        (void)stateful_off(bench);
}

static void draw_in_motion(struct stateful *bench)
{
    const int64_t which = stateful_in(bench, 0, 99);
    if (which < 40)
        draw_stop(bench);
    else if (which < 70)
        draw_override(bench);
    else if (bench->kind.has_cams && stateful_one_in(bench, 2))
        stateful_draw_couple(bench);
    else if (bench->judge.motion == STATEFUL_JOG &&
             !homing_is_running(&bench->homing))
        draw_jog(bench);
}

/* Which way, once it stands. */
static void draw_direction(struct stateful *bench)
{
    if (stateful_one_in(bench, 2))
        (void)stateful_reverse(bench, !bench->judge.is_reversed);
}

static void draw_in_hold(struct stateful *bench)
{
    const int64_t which = stateful_in(bench, 0, 99);
    if (bench->controller.rate.rate_q30 == 0 && stateful_one_in(bench, 6))
        stateful_draw_play(bench);
    else if (bench->controller.rate.rate_q30 == 0)
        draw_direction(bench);
    else if (stateful_one_in(bench, 2))
        return;
    if (which < 60)
        (void)stateful_resume(bench);
    else if (which < 80)
        draw_override(bench);
    else
        draw_stop(bench);
}

/* Homing takes long: two axes of three are left alone with it for the most
 * part, so that every leg is reached; so is a move that is to be repeated. */
static bool is_calm(const struct stateful *bench)
{
    const struct playback *playback = &bench->playback;
    if (playback->state == PLAYBACK_PLAYING && playback->times != 1)
        return bench->first_seed % 2 == 0;
    return homing_is_running(&bench->homing) && bench->homing.axis % 3 != 2 &&
           bench->first_seed % 2 == 0;
}

/* One command on the mean every so many ticks. */
static void draw_command(struct stateful *bench)
{
    switch (bench->controller.state) {
    case CONTROLLER_OFF:
        if (stateful_one_in(bench, 4) && !bench->controller.enabling)
            (void)stateful_enable(bench);
        break;
    case CONTROLLER_READY:
        if (stateful_one_in(bench, 15))
            draw_in_ready(bench);
        break;
    case CONTROLLER_MOVING:
        if (stateful_one_in(bench, is_calm(bench) ? 1500 : 90))
            draw_in_motion(bench);
        break;
    case CONTROLLER_HOLDING:
        if (stateful_one_in(bench, 60))
            draw_in_hold(bench);
        break;
    case CONTROLLER_STOPPING:
        break;
    case CONTROLLER_FAULT:
        if (stateful_one_in(bench, 25))
            draw_reset(bench);
        break;
    }
    if (stateful_one_in(bench, is_calm(bench) ? 1500 : 150))
        draw_anything(bench);
}

/* --- together -------------------------------------------------------------- */

/* Something began: a stop within three ticks, often. */
static bool has_begun(const struct stateful *bench, enum homing_state homing)
{
    return bench->judge.is_fresh ||
           (bench->homing.state != homing && homing_is_running(&bench->homing));
}

static void draw_burst(struct stateful *bench)
{
    static const int64_t in_the_same_tick = 0;
    if (bench->burst > 0)
        bench->burst--;
    if (bench->burst != in_the_same_tick)
        return;
    bench->burst = -1;
    draw_stop(bench);
    if (stateful_one_in(bench, 3))
        draw_anything(bench);
}

void stateful_draw_commands(struct stateful *bench)
{
    const enum homing_state homing = bench->judge.homing.state;
    stateful_draw_mishaps(bench);
    if (bench->kind.has_clients)
        stateful_draw_clients(bench);
    draw_burst(bench);
    const bool leg = has_begun(bench, homing);
    draw_command(bench);
    if (stateful_one_in(bench, 4) && bench->judge.is_fresh)
        draw_anything(bench);
    if (bench->burst < 0 && (leg || has_begun(bench, bench->homing.state)) &&
        stateful_one_in(bench, is_calm(bench) ? 12 : 2)) {
        bench->burst = (int)stateful_in(bench, 0, 3);
        draw_burst(bench);
    }
}
