/* firmware/control/homing.c - see homing.h. */
#include <stddef.h>

#include "firmware/control/homing_parts.h"
#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

const char *homing_error_text(enum homing_error error)
{
    static const char *const text[] = {
#define HOMING_ERROR_TEXT(name, text) text,
        HOMING_ERROR_LIST(HOMING_ERROR_TEXT)
#undef HOMING_ERROR_TEXT
    };
    return (unsigned)error < sizeof text / sizeof text[0] ? text[error]
                                                          : "unknown";
}

const char *homing_state_text(enum homing_state state)
{
    static const char *const text[] = {
#define HOMING_STATE_TEXT(name, text, wait) text,
        HOMING_STATE_LIST(HOMING_STATE_TEXT)
#undef HOMING_STATE_TEXT
    };
    return (unsigned)state < HOMING_STATES ? text[state] : "unknown";
}

static const char *homing_wait_text(const struct homing *homing)
{
    static const char *const text[] = {
#define HOMING_WAIT_TEXT(name, text, wait) wait,
        HOMING_STATE_LIST(HOMING_WAIT_TEXT)
#undef HOMING_WAIT_TEXT
    };
    return homing->was_held ? "it was held" : text[homing->failed];
}

static void homing_put(char text[HOMING_TEXT_MAX], size_t *length,
                       const char *words)
{
    while (*words != 0 && *length + 1 < HOMING_TEXT_MAX)
        text[(*length)++] = *words++;
    text[*length] = 0;
}

static void homing_put_counts(char text[HOMING_TEXT_MAX], size_t *length,
                              int64_t counts)
{
    uint64_t left = motion_fixed_abs(counts);
    char digits[24];
    char *at = &digits[sizeof digits - 1];
    for (*at = 0; left > 0 || *at == 0; left /= 10)
        *--at = (char)('0' + left % 10);
    if (counts < 0)
        *--at = '-';
    homing_put(text, length, at);
}

/* ": it counts from -2147483648 to 2147483647, an end would be at 2147493000" */
static void homing_put_reach(char text[HOMING_TEXT_MAX], size_t *length,
                             const struct hal_drive_reach *reach)
{
    homing_put(text, length, ": it counts from ");
    homing_put_counts(text, length, reach->min_counts);
    homing_put(text, length, " to ");
    homing_put_counts(text, length, reach->max_counts);
    homing_put(text, length, ", an end would be at ");
    homing_put_counts(text, length, reach->counts);
}

const char *homing_failure(const struct homing *homing,
                           char text[HOMING_TEXT_MAX])
{
    size_t length = 0;
    homing_put(text, &length, homing_error_text(homing->error));
    if (homing->error == HOMING_TIMEOUT) {
        homing_put(text, &length, ": ");
        homing_put(text, &length, homing_wait_text(homing));
    } else if (homing->error == HOMING_COUNTER) {
        homing_put_reach(text, &length, &homing->reach);
    }
    return text;
}

/* --- shorthands --- */

const struct homing_config *homing_of(const struct homing *homing)
{
    return &homing->config[homing->axis];
}

struct controller_axis *homing_axis(const struct homing *homing)
{
    return &homing->controller->axis[homing->axis];
}

static enum hal_drive_mode homing_usual_mode(const struct homing *homing)
{
    return controller_usual_mode(homing->controller, homing->axis);
}

bool homing_at_rest(const struct homing *homing)
{
    return homing->controller->state == CONTROLLER_READY;
}

/* The axis in its turn, and of a gantry the other rail, which goes with it. */
static unsigned homing_rails(const struct homing *homing)
{
    return homing->gantry != NULL ? 2 : 1;
}

static unsigned homing_other(const struct homing *homing)
{
    return controller_gantry_other(homing->gantry, homing->axis);
}

static struct controller_axis *homing_rail(const struct homing *homing,
                                           unsigned rail)
{
    return rail == 0 ? homing_axis(homing)
                     : &homing->controller->axis[homing_other(homing)];
}

static bool homing_rail_limit(const struct homing *homing, unsigned rail,
                              int direction)
{
    const struct controller_axis *axis = homing_rail(homing, rail);
    return direction < 0 ? axis->feedback.limit_negative ||
                               controller_input(axis->switches.limit_negative)
                         : axis->feedback.limit_positive ||
                               controller_input(axis->switches.limit_positive);
}

/* Read the limit switches of either rail. */
static bool homing_limit(const struct homing *homing, int direction)
{
    for (unsigned rail = 0; rail < homing_rails(homing); rail++)
        if (homing_rail_limit(homing, rail, direction))
            return true;
    return false;
}

static struct hal_gpio *homing_line(const struct homing *homing, unsigned rail)
{
    const struct controller_switches *switches =
        &homing_rail(homing, rail)->switches;
    switch (homing_of(homing)->input) {
    case HOMING_INPUT_LIMIT_NEGATIVE:
        return switches->limit_negative;
    case HOMING_INPUT_LIMIT_POSITIVE:
        return switches->limit_positive;
    case HOMING_INPUT_HOME:
        break;
    }
    return switches->home;
}

static bool homing_rail_switch(const struct homing *homing, unsigned rail)
{
    switch (homing_of(homing)->input) {
    case HOMING_INPUT_LIMIT_NEGATIVE:
        return homing_rail_limit(homing, rail, -1);
    case HOMING_INPUT_LIMIT_POSITIVE:
        return homing_rail_limit(homing, rail, 1);
    case HOMING_INPUT_HOME:
        break;
    }
    return homing_rail(homing, rail)->feedback.home_switch ||
           controller_input(homing_line(homing, rail));
}

/* Read the switch of either rail. */
static bool homing_switch(const struct homing *homing)
{
    for (unsigned rail = 0; rail < homing_rails(homing); rail++)
        if (homing_rail_switch(homing, rail))
            return true;
    return false;
}

bool homing_bad_limit(const struct homing *homing, int direction)
{
    const enum homing_input own = direction < 0 ? HOMING_INPUT_LIMIT_NEGATIVE
                                                : HOMING_INPUT_LIMIT_POSITIVE;
    return homing_of(homing)->input != own && homing_limit(homing, direction);
}

/* --- ends --- */

#define HOMING_BRAKE_NS INT64_C(5000000000)
#define HOMING_EDGES    16 /* that a line keeps (hal/gpio.h) */

static void homing_seek(struct homing *homing, bool seeking)
{
    for (unsigned rail = 0; rail < homing_rails(homing); rail++)
        homing_rail(homing, rail)->seeking = seeking;
    if (homing->gantry != NULL)
        homing->gantry->is_alone = false;
}

void homing_fail(struct homing *homing, enum homing_error error)
{
    if (homing->error == HOMING_OK)
        homing->error = error;
    if (homing->state == HOMING_BRAKE)
        return;
    homing->failed = homing->state;
    homing->was_held = homing->controller->is_held;
    if (homing_axis(homing)->by_profile)
        (void)hal_drive_halt(homing_axis(homing)->drive);
    else
        controller_halt(homing->controller);
    homing->brake_ns = homing->controller->now_ns;
    homing->state = HOMING_BRAKE;
}

static void homing_end(struct homing *homing, enum homing_state state)
{
    homing_seek(homing, false);
    homing->controller->homing = false;
    /* after a fault the controller sees to it */
    homing->mode_requested = false;
    homing->state = state;
}

static int homing_leave_mode(struct homing *homing)
{
    const int err = hal_drive_set_mode(homing_axis(homing)->drive,
                                       homing_usual_mode(homing));
    if (err == MOTION_OK)
        homing->mode_requested = false;
    return err;
}

/* Back to set points, or goals; a drive that does not come back to them in time
 * is braked by its quick stop.  Feedback tells of a mode some ticks after it was
 * asked for, so the usual one counts only once it was asked for again. */
static bool homing_comes_back(struct homing *homing)
{
    const struct controller_axis *axis = homing_axis(homing);
    if (axis->feedback.mode == homing_usual_mode(homing) &&
        !homing->mode_requested)
        return true;
    (void)homing_leave_mode(homing); /* not while it still homes */
    return false;
}

static void homing_brake(struct homing *homing)
{
    const int64_t since_ns = homing->controller->now_ns - homing->brake_ns;
    if (!homing_at_rest(homing))
        return;
    if (homing_comes_back(homing))
        homing_end(homing, HOMING_FAILED);
    else if (since_ns > HOMING_BRAKE_NS)
        controller_raise(homing->controller, CONTROLLER_FAULT_REST,
                         (int)homing->axis, since_ns, HOMING_BRAKE_NS);
}

/* --- jogs --- */

void homing_run(struct homing *homing, enum homing_state state, int direction,
                int64_t vel_q32, int64_t distance_q32)
{
    const struct controller_axis *axis = homing_axis(homing);
    struct controller_jog_goal goal = { .axis = homing->axis,
                                        .vel_q32 = vel_q32 };
    int err = direction < 0 ? motion_fixed_sub(axis->target.pos_q32,
                                               distance_q32, &goal.pos_q32)
                            : motion_fixed_add(axis->target.pos_q32,
                                               distance_q32, &goal.pos_q32);
    if (err == MOTION_OK)
        err = controller_jog_run(homing->controller, homing->jog, &goal);
    if (err < 0) {
        homing_fail(homing, HOMING_JOG);
        return;
    }
    homing->state = state;
}

void homing_rest(struct homing *homing, enum homing_state state)
{
    controller_halt(homing->controller);
    homing->state = state;
}

/* --- by a switch --- */

/* Edges of before are of no interest. */
static void homing_forget_edges(const struct homing *homing)
{
    struct hal_gpio_event event;
    for (unsigned rail = 0; rail < homing_rails(homing); rail++) {
        struct hal_gpio *line = homing_line(homing, rail);
        for (unsigned i = 0; line != NULL && i < HOMING_EDGES; i++)
            if (hal_gpio_event(line, &event) != 1)
                break;
    }
}

/* An edge to active since the last look: *event, else .active is false. */
static bool homing_edge(const struct homing *homing, unsigned rail,
                        struct hal_gpio_event *event)
{
    struct hal_gpio *line = homing_line(homing, rail);
    *event = (struct hal_gpio_event){ .active = false };
    for (unsigned i = 0; line != NULL && i < HOMING_EDGES; i++) {
        if (hal_gpio_event(line, event) != 1)
            break;
        if (event->active)
            return true;
    }
    event->active = false;
    return false;
}

/* It is active, or was since the last look. */
static bool homing_met(const struct homing *homing)
{
    struct hal_gpio_event event;
    bool is_met = homing_switch(homing);
    for (unsigned rail = 0; rail < homing_rails(homing); rail++)
        is_met |= homing_edge(homing, rail, &event);
    return is_met;
}

static void homing_leave(struct homing *homing)
{
    const struct homing_config *config = homing_of(homing);
    const int64_t vel_q32 = config->slow_q32 < config->fast_q32 / 4
                                ? 4 * config->slow_q32
                                : config->fast_q32;
    homing_run(homing, HOMING_LEAVE, -config->direction, vel_q32,
               config->distance_q32);
}

static void homing_look(struct homing *homing, enum homing_state state,
                        int direction)
{
    const struct homing_config *config = homing_of(homing);
    homing_forget_edges(homing);
    homing_run(homing, state, direction, config->fast_q32,
               config->distance_q32);
}

/* Standing, a drive that can says that there is nothing to halt. */
static bool homing_cannot_halt(const struct homing *homing)
{
    return homing->controller->config.axis[homing->axis].by_goals &&
           hal_drive_halt(homing_axis(homing)->drive) == MOTION_E_EMPTY;
}

static void homing_begin_switch(struct homing *homing)
{
    const int direction = homing_of(homing)->direction;
    homing_seek(homing, true);
    if (homing_cannot_halt(homing))
        homing_fail(homing, HOMING_NO_HALT);
    else if (homing_switch(homing))
        homing_leave(homing);
    else if (homing_bad_limit(homing, direction))
        homing_look(homing, HOMING_RETURN, -direction);
    else
        homing_look(homing, HOMING_SEARCH, direction);
}

static void homing_slow(struct homing *homing, int direction)
{
    homing->met_direction = direction;
    homing->met_q32 = homing_axis(homing)->feedback.pos_q32;
    homing->far_q32 = homing->met_q32;
    homing->far_ns = homing->controller->now_ns;
    homing_rest(homing, HOMING_SLOW_DOWN);
}

/* The axis itself, which lags behind its set points, has gone no further for
 * some time: on which side of the switch it is does not change any more. */
#define HOMING_STAND_NS INT64_C(50000000)
static bool homing_stands(struct homing *homing)
{
    const int64_t pos_q32 = homing_axis(homing)->feedback.pos_q32;
    const int64_t now_ns = homing->controller->now_ns;
    if (homing->met_direction < 0 ? pos_q32 < homing->far_q32
                                  : pos_q32 > homing->far_q32) {
        homing->far_q32 = pos_q32;
        homing->far_ns = now_ns;
    }
    return homing_at_rest(homing) && now_ns - homing->far_ns >= HOMING_STAND_NS;
}

static void homing_search(struct homing *homing)
{
    const int direction = homing_of(homing)->direction;
    if (homing_met(homing))
        homing_slow(homing, direction);
    else if (homing_bad_limit(homing, direction))
        homing_rest(homing, HOMING_REVERSE);
    else if (homing_at_rest(homing))
        homing_fail(homing, HOMING_NOT_FOUND);
}

/* Over the place where the switch was met, and as far again: that was read up
 * to some ticks late.  The set point leads the feedback, so it is not
 * nothing. */
static int64_t homing_back_q32(const struct homing *homing)
{
    const int64_t most_q32 = homing_of(homing)->distance_q32;
    int64_t past_q32;
    if (motion_fixed_sub(homing_axis(homing)->target.pos_q32, homing->met_q32,
                         &past_q32) < 0 ||
        motion_fixed_abs(past_q32) >= (uint64_t)most_q32 / 2)
        return most_q32;
    return 2 * (int64_t)motion_fixed_abs(past_q32);
}

static void homing_slow_down(struct homing *homing)
{
    const struct homing_config *config = homing_of(homing);
    if (!homing_stands(homing))
        return;
    if (homing_switch(homing)) {
        homing_leave(homing);
    } else if (homing->met_direction != config->direction) {
        homing->state = HOMING_TURN;
    } else {
        homing_forget_edges(homing);
        homing_run(homing, HOMING_BACK, -config->direction, config->slow_q32,
                   homing_back_q32(homing));
    }
}

static void homing_back(struct homing *homing)
{
    if (homing_met(homing))
        homing_leave(homing);
    else if (homing_bad_limit(homing, -homing_of(homing)->direction))
        homing_fail(homing, HOMING_WRONG_LIMIT);
    else if (homing_at_rest(homing))
        homing_fail(homing, HOMING_OVERRUN);
}

static void homing_reverse(struct homing *homing)
{
    if (homing_at_rest(homing))
        homing_look(homing, HOMING_RETURN, -homing_of(homing)->direction);
}

static void homing_return(struct homing *homing)
{
    const int direction = -homing_of(homing)->direction;
    if (homing_met(homing))
        homing_slow(homing, direction);
    else if (homing_bad_limit(homing, direction))
        homing_fail(homing, HOMING_WRONG_LIMIT);
    else if (homing_at_rest(homing))
        homing_fail(homing, HOMING_NOT_FOUND);
}

static void homing_step_leave(struct homing *homing)
{
    if (!homing_switch(homing))
        homing_rest(homing, HOMING_TURN);
    else if (homing_bad_limit(homing, -homing_of(homing)->direction))
        homing_fail(homing, HOMING_WRONG_LIMIT);
    else if (homing_at_rest(homing))
        homing_fail(homing, HOMING_STUCK);
}

static void homing_turn(struct homing *homing)
{
    const struct homing_config *config = homing_of(homing);
    if (homing_bad_limit(homing, -config->direction)) {
        homing_fail(homing, HOMING_WRONG_LIMIT);
        return;
    }
    if (!homing_at_rest(homing))
        return;
    homing_forget_edges(homing);
    homing->found = 0;
    homing_run(homing, HOMING_APPROACH, config->direction, config->slow_q32,
               config->distance_q32);
}

/* From when the position was measured to when the edge was, at the speed it was
 * told to have: what is told from two positions is only as fine as a count in a
 * tick.  What is further apart than a tenth of a second is no edge of ours. */
#define HOMING_EDGE_NS INT64_C(100000000)
static void homing_take_edge(struct homing *homing, unsigned rail,
                             const struct hal_gpio_event *event)
{
    const struct controller_axis *axis = homing_rail(homing, rail);
    const struct hal_drive_feedback *feedback = &axis->feedback;
    int64_t travel_q32 = 0;
    homing->found |= 1u << rail;
    homing->edge_q32[rail] = feedback->pos_q32;
    homing->edge_ns = feedback->t_ns;
    if (!event->active)
        return;
    const int64_t since_ns = event->t_ns - feedback->t_ns;
    if (since_ns < -HOMING_EDGE_NS || since_ns > HOMING_EDGE_NS ||
        motion_fixed_muldiv(axis->target.vel_q32, since_ns, INT64_C(1000000000),
                            &travel_q32) < 0)
        return;
    homing->edge_q32[rail] += travel_q32;
    homing->edge_ns = event->t_ns;
}

/* The first rail that has met its switch goes on with the other. */
static void homing_take_edges(struct homing *homing)
{
    struct hal_gpio_event event;
    const unsigned before = homing->found;
    for (unsigned rail = 0; rail < homing_rails(homing); rail++)
        if ((homing->found >> rail & 1) == 0 &&
            (homing_edge(homing, rail, &event) ||
             homing_rail_switch(homing, rail)))
            homing_take_edge(homing, rail, &event);
    if (before == 0)
        homing->met_q32 = homing_axis(homing)->target.pos_q32;
}

/* How far one rail has gone on since it met its switch. */
static bool homing_is_racked(const struct homing *homing)
{
    int64_t further_q32;
    return homing->found != 0 && homing->gantry != NULL &&
           (motion_fixed_sub(homing_axis(homing)->target.pos_q32,
                             homing->met_q32, &further_q32) < 0 ||
            motion_fixed_abs(further_q32) >
                (uint64_t)homing->gantry->racking_q32);
}

static void homing_approach(struct homing *homing)
{
    homing_take_edges(homing);
    if (homing->found == (1u << homing_rails(homing)) - 1) {
        homing_rest(homing, HOMING_SETTLE);
    } else if (homing_is_racked(homing)) {
        homing_fail(homing, HOMING_RACKED);
    } else if (homing_bad_limit(homing, homing_of(homing)->direction)) {
        homing_fail(homing, HOMING_WRONG_LIMIT);
    } else if (homing_at_rest(homing)) {
        homing_fail(homing, HOMING_NOT_FOUND);
    }
}

/* --- afterwards --- */

/* Where it goes that was not told to: it stays, but not at a hard stop. */
static int64_t homing_beside_q32(const struct homing *homing)
{
    const struct homing_config *config = homing_of(homing);
    const int64_t clear_q32 =
        config->direction < 0 ? config->clear_q32 : -config->clear_q32;
    int64_t beside_q32 = homing_axis(homing)->target.pos_q32;
    if (config->by == HOMING_HARD_STOP &&
        motion_fixed_add(config->pos_q32, clear_q32, &beside_q32) < 0)
        beside_q32 = config->pos_q32;
    return beside_q32;
}

/* Where its range does not reach to, an axis must not stay. */
static int64_t homing_place_q32(const struct homing *homing)
{
    const struct homing_config *config = homing_of(homing);
    const struct controller_axis_config *range =
        &homing->controller->config.axis[homing->axis];
    const int64_t place_q32 =
        config->goes ? config->go_q32 : homing_beside_q32(homing);
    if (place_q32 < range->pos_min_q32)
        return range->pos_min_q32;
    return place_q32 > range->pos_max_q32 ? range->pos_max_q32 : place_q32;
}

static void homing_go(struct homing *homing)
{
    const struct controller_jog_goal goal = {
        .axis = homing->axis,
        .pos_q32 = homing_place_q32(homing),
        .vel_q32 = homing_of(homing)->fast_q32,
    };
    homing_seek(homing, false);
    homing->go_q32 = goal.pos_q32;
    if (controller_jog_run(homing->controller, homing->jog, &goal) < 0)
        homing_fail(homing, HOMING_JOG);
    else
        homing->state = HOMING_GO;
}

/* Set the position of each rail by its own switch. */
static int homing_know(struct homing *homing, const int64_t from_q32[2])
{
    int err =
        controller_set_position(homing->controller, homing->axis, from_q32[0],
                                homing_of(homing)->pos_q32, &homing->reach);
    if (err == MOTION_OK && homing->gantry != NULL)
        err = controller_set_position(
            homing->controller, homing_other(homing), from_q32[1],
            homing->config[homing_other(homing)].pos_q32, &homing->reach);
    return err;
}

static void homing_fail_to_know(struct homing *homing)
{
    homing_fail(homing, homing->reach.min_counts < homing->reach.max_counts
                            ? HOMING_COUNTER
                            : HOMING_JOG);
}

static void homing_begin_square(struct homing *homing)
{
    const struct controller_jog_goal goal = {
        .axis = homing_other(homing),
        .pos_q32 = homing_axis(homing)->target.pos_q32,
        .vel_q32 = homing_of(homing)->slow_q32,
    };
    homing->gantry->is_alone = true;
    if (controller_jog_run(homing->controller, homing->jog, &goal) < 0)
        homing_fail(homing, HOMING_JOG);
    else
        homing->state = HOMING_SQUARE;
}

static void homing_settle(struct homing *homing)
{
    if (homing_bad_limit(homing, homing_of(homing)->direction)) {
        homing_fail(homing, HOMING_WRONG_LIMIT);
        return;
    }
    if (!homing_at_rest(homing))
        return;
    if (homing_know(homing, homing->edge_q32) < 0)
        homing_fail_to_know(homing);
    else if (homing->gantry != NULL)
        homing_begin_square(homing);
    else
        homing_go(homing);
}

/* The bridge is square where both places are the same. */
static void homing_square(struct homing *homing)
{
    if (!homing_at_rest(homing))
        return;
    if (homing_rail(homing, 1)->target.pos_q32 !=
        homing_axis(homing)->target.pos_q32)
        homing_fail(homing, HOMING_STOPPED);
    else
        homing_go(homing);
}

static void homing_next(struct homing *homing);

/* Its position is known again: range and switches are the controller's. */
static void homing_step_go(struct homing *homing)
{
    if (!homing_at_rest(homing))
        return;
    if (homing_axis(homing)->target.pos_q32 != homing->go_q32)
        homing_fail(homing, HOMING_STOPPED);
    else
        homing_next(homing);
}

/* --- by the drive --- */

static void homing_request_mode(struct homing *homing)
{
    struct controller_axis *axis = homing_axis(homing);
    const int err = hal_drive_set_mode(axis->drive, HAL_DRIVE_HOMING);
    if (err == MOTION_OK)
        homing->mode_requested = true;
    else if (err != MOTION_E_STATE) /* not standing yet: the time-out ends it */
        homing_fail(homing, HOMING_NO_DRIVE);
}

static void homing_begin_drive(struct homing *homing)
{
    homing->state = HOMING_MODE;
    homing_request_mode(homing);
}

static void homing_mode(struct homing *homing)
{
    const struct homing_config *config = homing_of(homing);
    struct controller_axis *axis = homing_axis(homing);
    const struct hal_drive_home home = {
        .method = config->method,
        .fast_q32 = config->method == 0 ? 0 : config->fast_q32,
        .slow_q32 = config->method == 0 ? 0 : config->slow_q32,
        .pos_q32 = config->pos_q32,
        .timeout_ns = config->timeout_ns,
    };
    if (!axis->by_profile)
        homing_request_mode(homing);
    if (axis->feedback.mode != HAL_DRIVE_HOMING)
        return;
    int err = hal_drive_home(axis->drive, &home);
    if (err == MOTION_E_STATE || err == MOTION_E_AGAIN)
        return; /* not standing yet; the time-out ends it */
    if (err < 0) {
        homing_fail(homing, HOMING_NO_DRIVE);
        return;
    }
    axis->homed = false;
    homing->state = HOMING_RUN;
}

static void homing_step_run(struct homing *homing)
{
    struct controller_axis *axis = homing_axis(homing);
    if (axis->feedback.homing == HAL_DRIVE_HOMING_FAILED) {
        homing_fail(homing, HOMING_DRIVE_FAILED);
        return;
    }
    if (axis->feedback.homing != HAL_DRIVE_HOMING_DONE)
        return;
    int err = homing_leave_mode(homing);
    if (err == MOTION_OK)
        homing->state = HOMING_UNMODE;
    else if (err != MOTION_E_STATE)
        homing_fail(homing, HOMING_DRIVE_FAILED);
}

/* From here on the drive counts from its zero: our offset is none. */
static void homing_unmode(struct homing *homing)
{
    struct controller_axis *axis = homing_axis(homing);
    if (axis->feedback.mode != homing_usual_mode(homing))
        return;
    if (controller_set_position(homing->controller, homing->axis,
                                axis->offset_q32, 0, &homing->reach) < 0)
        homing_fail_to_know(homing);
    else
        homing_go(homing);
}

/* --- one axis after the other --- */

static int homing_pick(const struct homing *homing)
{
    int found = -1;
    for (unsigned i = 0; i < homing->controller->config.axis_count; i++)
        if ((homing->left >> i & 1) != 0 &&
            (found < 0 ||
             homing->config[i].order < homing->config[found].order))
            found = (int)i;
    return found;
}

static void homing_begin_here(struct homing *homing)
{
    int64_t at_q32[2] = { 0 };
    for (unsigned rail = 0; rail < homing_rails(homing); rail++)
        at_q32[rail] = homing_rail(homing, rail)->target.pos_q32;
    if (homing_know(homing, at_q32) < 0)
        homing_fail_to_know(homing);
    else
        homing_go(homing);
}

static void homing_next(struct homing *homing)
{
    const int axis = homing_pick(homing);
    if (axis < 0) {
        homing_end(homing, HOMING_DONE);
        return;
    }
    homing->axis = (unsigned)axis;
    homing->gantry = controller_gantry_of(homing->controller, homing->axis);
    homing->left &= ~((uint64_t)1 << axis);
    if (homing->gantry != NULL)
        homing->left &= ~((uint64_t)1 << homing_other(homing));
    homing->since_ns = homing->controller->now_ns;
    if (homing_of(homing)->by == HOMING_SWITCH)
        homing_begin_switch(homing);
    else if (homing_of(homing)->by == HOMING_DRIVE)
        homing_begin_drive(homing);
    else if (homing_of(homing)->by == HOMING_HARD_STOP)
        homing_begin_stop(homing);
    else
        homing_begin_here(homing);
}

static bool homing_config_ok(const struct homing_config *config)
{
    if (config->by == HOMING_NONE)
        return true;
    if (config->fast_q32 <= 0 || config->timeout_ns <= 0)
        return false;
    if (config->by == HOMING_HARD_STOP &&
        (config->push_permille <= 0 || config->clear_q32 <= 0))
        return false;
    if (config->by != HOMING_SWITCH && config->by != HOMING_HARD_STOP)
        return true;
    return config->slow_q32 > 0 && config->slow_q32 <= config->fast_q32 &&
           config->distance_q32 > 0 &&
           (config->direction == 1 || config->direction == -1);
}

/* Rails are homed as one: by what both can wait for, and in one direction. */
static bool homing_rails_ok(const struct homing_config *one,
                            const struct homing_config *two)
{
    return one->by == two->by && one->by != HOMING_DRIVE &&
           one->by != HOMING_HARD_STOP && one->input == two->input &&
           one->direction == two->direction;
}

int homing_init(struct homing *homing, struct controller *controller,
                struct controller_jog *jog, const struct homing_config config[])
{
    *homing = (struct homing){ .controller = controller,
                               .jog = jog,
                               .config = config };
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (!homing_config_ok(&config[i]))
            return MOTION_E_ARG;
    for (unsigned i = 0; i < controller->gantry_count; i++)
        if (!homing_rails_ok(&config[controller->gantry[i].axis[0]],
                             &config[controller->gantry[i].axis[1]]))
            return MOTION_E_ARG;
    return MOTION_OK;
}

uint64_t homing_wanted(const struct homing *homing)
{
    uint64_t axes = 0;
    for (unsigned i = 0; i < homing->controller->config.axis_count; i++)
        if (homing->config[i].by != HOMING_NONE &&
            !homing->controller->axis[i].homed)
            axes |= (uint64_t)1 << i;
    return axes;
}

/* Return both rails of every gantry of which one is to be homed. */
static uint64_t homing_other_rails(const struct homing *homing)
{
    uint64_t axes = 0;
    for (unsigned i = 0; i < homing->controller->gantry_count; i++) {
        const unsigned *const axis = homing->controller->gantry[i].axis;
        const uint64_t both = (uint64_t)1 << axis[0] | (uint64_t)1 << axis[1];
        if ((homing->left & both) != 0)
            axes |= both;
    }
    return axes;
}

int homing_start(struct homing *homing, uint64_t axes)
{
    if (!homing_at_rest(homing) || homing_is_running(homing) ||
        controller_any_coupled(homing->controller))
        return MOTION_E_STATE;
    homing->left = 0;
    homing->error = HOMING_OK;
    homing->stops = homing->controller->stops;
    homing->controller->homing = true;
    homing->controller->is_held = false;
    for (unsigned i = 0; i < homing->controller->config.axis_count; i++)
        if (homing->config[i].by != HOMING_NONE)
            homing->left |= axes & (uint64_t)1 << i;
    homing->left |= homing_other_rails(homing);
    homing_next(homing);
    return MOTION_OK;
}

bool homing_is_running(const struct homing *homing)
{
    return homing->state != HOMING_IDLE && homing->state != HOMING_DONE &&
           homing->state != HOMING_FAILED;
}

/* What ends a homing in every state.  True: it has. */
static bool homing_is_cut_short(struct homing *homing)
{
    const struct controller *controller = homing->controller;
    if (controller->fault.fault != CONTROLLER_FAULT_NONE ||
        controller->state == CONTROLLER_OFF) {
        const bool both = homing_limit(homing, -1) && homing_limit(homing, 1);
        if (homing->error == HOMING_OK)
            homing->error = both ? HOMING_BOTH_LIMITS : HOMING_FAULT;
        if (!controller_in_motion(controller)) /* it may be out of its range */
            homing_end(homing, HOMING_FAILED);
        return true;
    }
    if (controller->stops != homing->stops)
        homing_fail(homing, HOMING_STOPPED);
    if (controller->now_ns - homing->since_ns > homing_of(homing)->timeout_ns)
        homing_fail(homing, HOMING_TIMEOUT);
    return false;
}

void homing_step(struct homing *homing)
{
    static void (*const walk[HOMING_STATES])(struct homing *) = {
        [HOMING_SEARCH] = homing_search,
        [HOMING_SLOW_DOWN] = homing_slow_down,
        [HOMING_BACK] = homing_back,
        [HOMING_REVERSE] = homing_reverse,
        [HOMING_RETURN] = homing_return,
        [HOMING_LEAVE] = homing_step_leave,
        [HOMING_TURN] = homing_turn,
        [HOMING_APPROACH] = homing_approach,
        [HOMING_PRESS] = homing_press,
        [HOMING_PRESSED] = homing_pressed,
        [HOMING_CLEAR] = homing_clear,
        [HOMING_PRESS_AGAIN] = homing_press_again,
        [HOMING_SETTLE] = homing_settle,
        [HOMING_SQUARE] = homing_square,
        [HOMING_MODE] = homing_mode,
        [HOMING_RUN] = homing_step_run,
        [HOMING_UNMODE] = homing_unmode,
        [HOMING_GO] = homing_step_go,
        [HOMING_BRAKE] = homing_brake,
    };
    if (!homing_is_running(homing) || homing_is_cut_short(homing))
        return;
    if (homing->controller->is_held && homing_at_rest(homing) &&
        homing->state != HOMING_BRAKE)
        return; /* until it is resumed, stopped, or takes too long */
    walk[homing->state](homing);
}
