/* firmware/host/move/move_load.c - move.yaml to struct plan_move.  See rig.h.
 *
 * The fields of the whole; each is read in a file of its own. */
#include "firmware/host/move/move_load.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/yaml/yaml_again.h"
#include "firmware/host/yaml/yaml_shapes.h"
#include "motion/core/fixed.h"
#include "motion/plan/compose.h"

const struct yaml_words move_words[] = {
    { "axis.curve", move_curves, MOVE_CURVES },
    { "key.curve", move_curves, MOVE_CURVES },
    { "ends.first", move_ends, MOVE_ENDS },
    { "ends.last", move_ends, MOVE_ENDS },
    { "axis.interpolation", move_interpolation_word, MOVE_INTERPOLATIONS },
    { "axis.easing", move_easing_word, MOVE_EASINGS },
    { "axis.smoothing", move_smoothing_word, MOVE_SMOOTHINGS },
    { "axis.extrapolation", move_extrapolation_word, MOVE_EXTRAPOLATIONS },
    { "cycles.before", move_cycle_word, MOVE_CYCLES },
    { "cycles.after", move_cycle_word, MOVE_CYCLES },
    { "key.interpolation", move_interpolation_word, MOVE_INTERPOLATIONS },
    { "key.easing", move_easing_word, MOVE_EASINGS },
    { "path.curve", move_path_curves, MOVE_PATH_CURVES },
    { "path.spacing", move_spacings, MOVE_SPACINGS },
    { "part.law", move_laws, MOVE_LAWS },
    { "part.shape", move_ramps, MOVE_RAMPS },
    { "target.curve", move_path_curves, MOVE_PATH_CURVES },
    { "target.spacing", move_spacings, MOVE_SPACINGS },
    { "look.along", move_alongs, MOVE_ALONGS },
    { "look.end", move_ahead_ends, MOVE_AHEAD_ENDS },
    { "look.ease", move_dwell_eases, MOVE_DWELL_EASES },
    { "look.curve", move_orients, MOVE_ORIENTS },
    { "coupling.curve", move_curves, MOVE_CURVES },
    { "shoot.mode", move_shoot_modes, PLAN_SHOOT_MODES },
    { NULL, NULL, 0 },
};

static int move_read_title(void *reader, const struct yaml_value *value,
                           void *out)
{
    (void)reader;
    return yaml_value_copy(value, out, sizeof(((struct plan_move *)0)->title));
}

static int move_read_fps(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct units_fps *fps = &((struct move_reader *)reader)->units.fps;
    struct plan_move *move = out;
    if (yaml_units_read_fps(value, fps) < 0)
        return -1;
    move->fps_num = fps->num;
    move->fps_den = fps->den;
    return 0;
}

static int move_read_duration(void *reader, const struct yaml_value *value,
                              void *out)
{
    struct move_reader *self = reader;
    struct plan_move *move = out;

    if (move_refuse_guest(self, value) < 0 ||
        move_read_positive(self, value, UNITS_TIME, &move->duration_ns_q12) < 0)
        return -1;
    move->duration_place = yaml_tree_place(value->tree, value->node);
    return 0;
}

#define MOVE_ROLL_MAX (INT64_C(3600) * MOTION_FIXED_S_Q12)

static int move_read_roll(struct move_reader *self,
                          const struct yaml_value *value, int64_t *roll_ns_q12)
{
    char quote[YAML_QUOTE_MAX];

    if (move_refuse_guest(self, value) < 0 ||
        move_read_positive(self, value, UNITS_TIME, roll_ns_q12) < 0)
        return -1;
    if (*roll_ns_q12 < MOTION_FIXED_S_Q12 / 1000 ||
        *roll_ns_q12 > MOVE_ROLL_MAX)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    return 0;
}

static int move_read_pre_roll(void *reader, const struct yaml_value *value,
                              void *out)
{
    return move_read_roll(reader, value,
                          &((struct plan_move *)out)->pre_roll_ns_q12);
}

static int move_read_post_roll(void *reader, const struct yaml_value *value,
                               void *out)
{
    return move_read_roll(reader, value,
                          &((struct plan_move *)out)->post_roll_ns_q12);
}

#define MOVE_TIMES_MAX 1000000000

static int move_read_loop(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct plan_move *move = out;
    int64_t times = -1;

    if (move_refuse_guest(reader, value) < 0)
        return -1;
    const char *const text = yaml_value_text(value);
    if (text == NULL)
        return -1;
    if (strcmp(text, "forever") != 0 &&
        yaml_value_integer(value, 1, MOVE_TIMES_MAX, &times) < 0)
        return -1;
    move->times = (int32_t)times;
    return 0;
}

static int move_read_ping_pong(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct plan_move *move = out;

    if (move_refuse_guest(reader, value) < 0 ||
        yaml_value_bool(value, &move->is_ping_pong) < 0)
        return -1;
    if (move->is_ping_pong && move->times == 0)
        move->times = 2; /* there and back, where loop does not say more */
    return 0;
}

int move_refuse_repeat(const struct move_reader *reader,
                       const struct yaml_value *value)
{
    const struct plan_move *move = reader->move;

    if (move->times == 0 || (move->times == 1 && !move->is_ping_pong))
        return 0;
    return yaml_value_refuse(value,
                             "cannot stand beside loop or ping_pong: each shot "
                             "has the time of one play from the start");
}

int move_refuse_guest(const struct move_reader *reader,
                      const struct yaml_value *value)
{
    struct yaml_value whole = *value;

    if (!reader->is_guest)
        return 0;
    whole.expected = "it in the file that is played";
    return yaml_value_refuse(
        &whole, "is not for a move that is a layer or fade of another one");
}

static const struct yaml_field move_fields[] = {
    { "title", YAML_OPTIONAL, "a text of at most 127 bytes", move_read_title,
      offsetof(struct plan_move, title) },
    { "fps", YAML_OPTIONAL, "frames per second, such as 24 or 24000/1001",
      move_read_fps, 0 },
    { "duration", YAML_OPTIONAL, "the time that all of it takes, above zero",
      move_read_duration, 0 },
    { "pre_roll", YAML_OPTIONAL,
      "a time of 1 ms .. 1 h, in which axes that begin in motion come up to "
      "speed",
      move_read_pre_roll, 0 },
    { "post_roll", YAML_OPTIONAL,
      "a time of 1 ms .. 1 h, in which axes that end in motion come to rest",
      move_read_post_roll, 0 },
    { "loop", YAML_OPTIONAL,
      "how often it is played, 1 .. 1000000000, or forever", move_read_loop,
      0 },
    { "ping_pong", YAML_OPTIONAL, "true or false: every second time in reverse",
      move_read_ping_pong, 0 },
    { "timing", YAML_OPTIONAL, "fastest, for axes whose keys are positions",
      move_read_timing, 0 },
    { "axes", YAML_OPTIONAL, "a map of axes by name", move_read_axes, 0 },
    { "path", YAML_OPTIONAL, "a map with axes, points and speed",
      move_read_path, 0 },
    { "camera", YAML_OPTIONAL,
      "a map with axes and look: beside a path, with keys, or on the rig's "
      "kinematics",
      move_read_camera, 0 },
    { "poses", YAML_OPTIONAL, "a map of poses by name, beside a blend",
      move_read_poses, 0 },
    { "blend", YAML_OPTIONAL, "a map with base and weights", move_read_blended,
      0 },
    { "layers", YAML_OPTIONAL, "a list of 1 .. 16 maps with axes or move",
      move_read_layers, 0 },
    { "fade", YAML_OPTIONAL, "a map with axes or move, and weight",
      move_read_fade, 0 },
    { "warp", YAML_OPTIONAL,
      "a map with curve and keys such as [2 s, 1.5 s], times of the move",
      move_read_warp, 0 },
    { "couplings", YAML_OPTIONAL,
      "a map of axes by name that follow another one", move_read_couplings, 0 },
    { "events", YAML_OPTIONAL,
      "a list of 1 .. 1000 events such as {line: camera, at: 2 s}",
      move_read_events, 0 },
    { "shoot", YAML_OPTIONAL,
      "a map with mode, line, frames, exposure and move", move_read_shoot, 0 },
};
static const struct yaml_shape move_shape = { "move", move_fields,
                                              ARRAY_LEN(move_fields) };

const struct yaml_shape *const move_shapes[] = {
    &move_shape,          &move_axis_shape,   &move_end_shape,
    &move_key_shape,      &move_path_shape,   &move_part_shape,
    &move_tool_shape,     &move_cap_shape,    &move_camera_shape,
    &move_head_shape,     &move_look_shape,   &move_target_shape,
    &move_dwell_shape,    &move_orient_shape, &move_blend_shape,
    &move_layer_shape,    &move_fade_shape,   &move_cycles_shape,
    &move_coupling_shape, &move_event_shape,  &move_shoot_shape,
    &move_subject_shape,  &move_zoom_shape,   NULL,
};

static int move_read(const struct yaml_value *value, struct move_reader *reader)
{
    if (yaml_fields_read(value, &move_shape, reader, reader->move) < 0)
        return -1;
    if (reader->poses > 0 && reader->move->blend == NULL)
        return yaml_value_refuse(value, "has poses, but no blend of them");
    if (reader->move->axis_count == 0)
        return yaml_value_refuse(value, "moves nothing");
    return move_check_rig(reader, value);
}

static int move_read_tree(const struct yaml_tree *tree,
                          struct move_reader *reader)
{
    const struct yaml_value whole = { tree, 0, "the move",
                                      "axes, a path or a blend" };

    /* axes of the rig, each once */
    if (plan_move_reserve(reader->move, reader->rig->axis_count) < 0)
        memory_fail();
    reader->quantity = UNITS_POSITION;
    const int err = move_read(&whole, reader);
    memory_pool_free(&reader->memory);
    if (err < 0)
        move_free(reader->move);
    return err;
}

int move_load_as(const struct files *files, const char *path, bool is_guest,
                 const struct rig *rig, struct plan_move *move,
                 char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct move_reader reader = { .files = files,
                                  .path = path,
                                  .is_guest = is_guest,
                                  .rig = rig,
                                  .move = move };
    struct yaml_tree tree;

    *move = (struct plan_move){ .axis_count = 0 };
    if (yaml_tree_load(files, &tree, &report) < 0)
        return -1;
    const int err = move_read_tree(&tree, &reader);
    yaml_tree_free(&tree);
    return err;
}

int move_load(const struct files *files, const char *path,
              const struct rig *rig, struct plan_move *move,
              char message[YAML_MESSAGE_MAX])
{
    return move_load_as(files, path, false, rig, move, message);
}

int move_load_again(const struct files *files, const char *path,
                    const struct rig *rig, struct plan_move *move,
                    struct yaml_again *text, const struct yaml_again *former,
                    char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct move_reader reader = {
        .files = files, .path = path, .rig = rig, .move = move
    };

    *move = (struct plan_move){ .axis_count = 0 };
    return yaml_again_load(files, text, former, &report) < 0
               ? -1
               : move_read_tree(&text->tree, &reader);
}

void move_free(struct plan_move *move)
{
    plan_move_free(move);
}
