/* firmware/host/move/move_load_shoot.c - `shoot` of move.yaml: the move frame by
 * frame.  See move_load.h. */
#include <stdlib.h>

#include "firmware/host/base/array.h"
#include "firmware/host/move/move_load.h"
#include "motion/core/fixed.h"
#include "motion/plan/shoot/plan_event.h"
#include "motion/plan/shoot/plan_shoot.h"

#define SHOOT_TIME_MAX   (INT64_C(86400) * MOTION_FIXED_S_Q12)
#define SHOOT_WAIT_TICKS 32
#define SHOOT_TIME_MIN   (MOTION_FIXED_S_Q12 / 1000)

const char *const move_shoot_modes[PLAN_SHOOT_MODES] = {
#define SHOOT_WORD(name, word) word,
    PLAN_SHOOT_LIST(SHOOT_WORD)
#undef SHOOT_WORD
};

static int shoot_read_mode(void *reader, const struct yaml_value *value,
                           void *out)
{
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, move_shoot_modes, PLAN_SHOOT_MODES, &index) <
        0)
        return -1;
    *(enum plan_shoot_mode *)out = (enum plan_shoot_mode)index;
    return 0;
}

static int shoot_read_frames(void *reader, const struct yaml_value *value,
                             void *out)
{
    const struct move_reader *self = reader;
    char quote[YAML_QUOTE_MAX];
    int64_t q32;

    if (yaml_units_read(value, UNITS_RATIO, &self->units, &q32) < 0)
        return -1;
    const int64_t frames = q32 / MOTION_FIXED_ONE_Q32;
    if (q32 % MOTION_FIXED_ONE_Q32 != 0 || frames < 2 ||
        frames > PLAN_SHOOT_FRAMES_MAX)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    *(uint32_t *)out = (uint32_t)frames;
    return 0;
}

static int shoot_time(const struct move_reader *self,
                      const struct yaml_value *value, int64_t least,
                      int64_t *out)
{
    char quote[YAML_QUOTE_MAX];

    if (yaml_units_read(value, UNITS_TIME, &self->units, out) < 0)
        return -1;
    if (*out < least || *out > SHOOT_TIME_MAX)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    return 0;
}

static int shoot_read_time(void *reader, const struct yaml_value *value,
                           void *out)
{
    return shoot_time(reader, value, SHOOT_TIME_MIN, out);
}

static int shoot_read_settle(void *reader, const struct yaml_value *value,
                             void *out)
{
    return shoot_time(reader, value, 0, out);
}

static int shoot_read_blur(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct plan_shoot *shoot = out;
    char quote[YAML_QUOTE_MAX];

    if (shoot->mode != PLAN_SHOOT_GO_MOTION)
        return yaml_value_refuse(value, "is not used by mode %s",
                                 move_shoot_modes[shoot->mode]);
    if (move_read_ratio(reader, value, MOTION_FIXED_ONE_Q32, &shoot->blur_q32) <
        0)
        return -1;
    if (shoot->blur_q32 < MOTION_FIXED_ONE_Q32 / 100 ||
        shoot->blur_q32 > MOTION_FIXED_ONE_Q32 / 100 * 99 + 99)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    return 0;
}

/* A line of kind start of the rig, or nobody but who runs it. */
static int shoot_read_step(void *reader, const struct yaml_value *value,
                           void *out)
{
    const struct rig *rig = ((struct move_reader *)reader)->rig;
    struct plan_shoot *shoot = out;
    const char *names[RIG_LINES_MAX + 1];
    uint32_t line[RIG_LINES_MAX];
    unsigned count = 0, index;

    for (uint32_t i = 0; i < rig->line_count; i++)
        if (rig->line[i].kind == RIG_LINE_START) {
            line[count] = i;
            names[count++] = rig->line[i].name;
        }
    names[count] = "operator";
    if (yaml_value_choice(value, names, count + 1, &index) < 0)
        return -1;
    shoot->steps = true;
    shoot->step_line = index < count ? line[index] : PLAN_SHOOT_NO_LINE;
    return 0;
}

/* What a hold and going on take: 32 ticks at 100 %, and what the shutter's line
 * is ahead of its events. */
static void shoot_wait(struct plan_shoot *shoot, const struct rig *rig)
{
    const int64_t lead_ns =
        shoot->line == PLAN_SHOOT_NO_LINE ? 0 : rig->line[shoot->line].lead_ns;

    if (shoot->steps)
        shoot->wait_ns_q12 = (SHOOT_WAIT_TICKS * rig->period_ns + 2 * lead_ns) *
                             MOTION_FIXED_NS_Q12;
}

static const struct yaml_field move_shoot_fields[] = {
    { "mode", YAML_REQUIRED, "stop, go-motion or continuous", shoot_read_mode,
      offsetof(struct plan_shoot, mode) },
    { "line", YAML_OPTIONAL, "a gpio line of kind trigger of the rig",
      move_read_event_line, offsetof(struct plan_shoot, line) },
    { "frames", YAML_REQUIRED, "2 .. 100000, whole", shoot_read_frames,
      offsetof(struct plan_shoot, frames) },
    { "exposure", YAML_REQUIRED, "a time of 1 ms .. 24 h", shoot_read_time,
      offsetof(struct plan_shoot, exposure_ns_q12) },
    { "move", YAML_REQUIRED,
      "a time of 1 ms .. 24 h, from one exposure to the next", shoot_read_time,
      offsetof(struct plan_shoot, move_ns_q12) },
    { "settle", YAML_OPTIONAL, "a time of 0 .. 24 h", shoot_read_settle,
      offsetof(struct plan_shoot, settle_ns_q12) },
    { "blur", YAML_OPTIONAL, "1 % .. 99 %, with mode go-motion",
      shoot_read_blur, 0 },
    { "step", YAML_OPTIONAL,
      "a gpio line of kind start of the rig, or operator", shoot_read_step, 0 },
};
const struct yaml_shape move_shoot_shape = { "shoot", move_shoot_fields,
                                             ARRAY_LEN(move_shoot_fields) };

/* The exposures are events like any others, after those of the file. */
static int shoot_add_event(struct plan_move *move,
                           const struct plan_shoot *shoot)
{
    struct plan_shoot_times times;

    if (shoot->line == PLAN_SHOOT_NO_LINE)
        return 0;
    struct plan_event *event =
        realloc(move->event, (move->events + 1) * sizeof *event);

    if (event == NULL)
        return -1;
    plan_shoot_times(shoot, &times);
    move->event = event;
    event[move->events++] = (struct plan_event){
        .line = shoot->line,
        .of = PLAN_EVENT_OF_TIME,
        .has_at = true,
        .has_to = true,
        .at = times.first_ns_q12,
        .every = times.period_ns_q12,
        .to = times.last_ns_q12,
        .place = shoot->place,
    };
    return 0;
}

int move_read_shoot(void *reader, const struct yaml_value *value, void *out)
{
    struct move_reader *self = reader;
    struct plan_move *move = self->move;
    struct plan_shoot *shoot = calloc(1, sizeof *shoot);

    (void)out;
    if (shoot == NULL)
        return yaml_value_refuse(value, "does not fit in memory");
    move->shoot = shoot;
    shoot->blur_q32 = MOTION_FIXED_ONE_Q32 / 2;
    shoot->line = shoot->step_line = PLAN_SHOOT_NO_LINE;
    shoot->place = yaml_tree_place(value->tree, value->node);
    if (move_refuse_guest(self, value) < 0)
        return -1;
    if (move->warp != NULL)
        return yaml_value_refuse(value, "is given beside a warp: both say when "
                                        "the move is played");
    if (move->duration_ns_q12 != 0)
        return yaml_value_refuse(value, "is given beside a duration: both say "
                                        "when the move is played");
    if (move->pre_roll_ns_q12 != 0 || move->post_roll_ns_q12 != 0)
        return yaml_value_refuse(value,
                                 "is given beside a pre_roll or post_roll: it "
                                 "has a run-up of its own");
    if (move_refuse_repeat(self, value) < 0 ||
        yaml_fields_read(value, &move_shoot_shape, self, shoot) < 0)
        return -1;
    if (shoot->line == PLAN_SHOOT_NO_LINE && !shoot->steps)
        return yaml_value_refuse(value,
                                 "has no line, which what steps it alone "
                                 "may lack");
    shoot_wait(shoot, self->rig);
    return shoot_add_event(move, shoot) < 0
               ? yaml_value_refuse(value, "does not fit in memory")
               : 0;
}
