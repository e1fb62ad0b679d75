/* firmware/host/move/move_load.h - what the readers of move.yaml share.
 *
 * move_load.c reads the move as a whole; one file each for its parts: _axis
 * (keyed axes), _key, _path, _law (speed), _tool, _camera, _orient, _blend (poses), _other (layers, fade,
 * warp), _event, _shoot.  Functions return 0, or -1 with the sentence written. */
#ifndef FIRMWARE_HOST_MOVE_MOVE_LOAD_H
#define FIRMWARE_HOST_MOVE_MOVE_LOAD_H

#include "firmware/host/rig/rig.h"
#include "firmware/host/yaml/yaml_fields.h"
#include "firmware/host/yaml/yaml_units.h"
#include "motion/plan/path/plan_path.h"
#include "motion/plan/shoot/plan_shoot.h"

/* A pose as it was written. */
struct move_pose_axis {
    bool has;
    int64_t pos_q32;
    uint32_t node; /* of the axis's name */
};
struct move_pose {
    char name[PLAN_NAME_MAX];
    struct move_pose_axis *axis; /* of the rig; from the reader's memory */
};
#define MOVE_POSES_MAX 64

struct move_reader {
    const struct files *files;
    const char *path; /* of the file */
    bool is_guest;    /* the move is part of another one */
    const struct rig *rig;
    struct plan_move *move;
    struct plan_axis *axis; /* being read */
    const struct plan_key *key;
    enum units_quantity quantity; /* of the positions of its keys: a position,
                                     a ratio or a time */
    struct units_context units;
    struct plan_part *part; /* of a speed law, being read */
    struct move_pose *pose;
    uint32_t poses;
    struct memory_pool memory;      /* given back when the move is read */
    uint32_t keys;                  /* that the axis will have */
    struct plan_bezier_key handles; /* what the axis says for all of its keys */
    bool handles_given;             /* by the key: their kinds */
    bool side_given[2];             /* by the key: where left, right is */
    bool is_untimed;                /* the keys give positions only */
};

/* As move_load (rig.h), of a guest too: a move that is part of another one. */
int move_load_as(const struct files *files, const char *path, bool is_guest,
                 const struct rig *rig, struct plan_move *move,
                 char message[YAML_MESSAGE_MAX]);
/* A guest drives axes, no more: of a field that goes with the whole. */
int move_refuse_guest(const struct move_reader *reader,
                      const struct yaml_value *value);
/* Of a field with shots, when the move says that it is played again and again. */
int move_refuse_repeat(const struct move_reader *reader,
                       const struct yaml_value *value);

/* --- move_load_camera.c --------------------------------------------------- */

/* What a camera looks at, of a map; and its keyed roll. */
int move_read_looks(struct move_reader *reader, const struct yaml_value *value,
                    struct plan_camera *camera);
int move_read_roll_of(struct move_reader *reader,
                      const struct yaml_value *value,
                      struct plan_camera *camera);

/* --- move_load_tool.c ----------------------------------------------------- */

/* The joints of the rig's arm are driven by the path. */
int move_take_arm(struct move_reader *reader, const struct yaml_value *value,
                  struct plan_path *path);
/* How its tool is turned: of a struct plan_path. */
int move_read_tool(void *reader, const struct yaml_value *value, void *out);
/* A path of a tool says so. */
int move_check_tool(const struct yaml_value *value,
                    const struct plan_path *path);

/* --- move_load_axis.c ----------------------------------------------------- */

/* Keyed axes into reader->move. */
int move_read_axes(void *reader, const struct yaml_value *value, void *out);

/* Index in the rig of the axis that a node names, or -1. */
int move_find_axis(const struct move_reader *reader,
                   const struct yaml_value *name);

/* One more axis of the move, named by a node, for a driver that is not its
 * keys: its index in the rig, and *index in the move.  -1 when there is no such
 * axis or something drives it already. */
int move_drive_axis(struct move_reader *reader, const struct yaml_value *name,
                    enum plan_driver driver, uint32_t *index);
/* The same of the axis `found` of the rig; sentences are about `value`. */
int move_drive_rig_axis(struct move_reader *reader,
                        const struct yaml_value *value, uint32_t found,
                        enum plan_driver driver, uint32_t *index);

/* A map with curve and keys, of whatever quantity, into *axis, whose keys
 * belong to the caller, also after a refusal. */
int move_read_keyed(struct move_reader *reader, const struct yaml_value *value,
                    enum units_quantity quantity, enum units_axis unit,
                    struct plan_axis *axis);

/* A kind of curve into enum plan_curve; a ratio from 0 to max. */
int move_read_curve(void *reader, const struct yaml_value *value, void *out);
int move_read_ratio(const struct move_reader *reader,
                    const struct yaml_value *value, int64_t max_q32,
                    int64_t *out);
/* [k1, k2], 0 <= k1 <= k2 <= 1 */
int move_read_ease_list(const struct move_reader *reader,
                        const struct yaml_value *value, int64_t *k1_q32,
                        int64_t *k2_q32);

/* A time, not negative; [tension, continuity, bias], -1 .. 1 each. */
int move_parse_blend(const struct move_reader *self,
                     const struct yaml_value *value, int64_t *out);
int move_parse_tcb(const struct move_reader *self,
                   const struct yaml_value *value,
                   struct motion_spline_kochanek *shape);

/* "is not used by curve ...". */
int move_refuse_use(const struct yaml_value *value,
                    const struct plan_curve_rules *rules);

extern const struct yaml_shape move_axis_shape, move_end_shape;

/* --- move_load_key.c ------------------------------------------------------ */

/* Into the struct plan_axis that is being read; on the heap, also after a
 * refusal. */
int move_read_keys(void *reader, const struct yaml_value *value, void *out);

/* The curves of the spans that end and start at the key being read. */
const struct plan_curve_rules *move_before(const struct move_reader *self);
const struct plan_curve_rules *move_after(const struct move_reader *self);

extern const struct yaml_shape move_key_shape;

/* --- move_load_path.c ----------------------------------------------------- */

int move_read_path(void *reader, const struct yaml_value *value, void *out);

/* A position, or a part of the path's length in %. */
int move_read_distance(const struct move_reader *reader,
                       const struct yaml_value *value,
                       struct plan_distance *distance);

/* The fields of a curve in space, into struct plan_points (curve: into its
 * curve, spacing: into its spacing), in this order. */
int move_read_path_curve(void *reader, const struct yaml_value *value,
                         void *out);
int move_read_spacing(void *reader, const struct yaml_value *value, void *out);
int move_read_closed(void *reader, const struct yaml_value *value, void *out);
int move_read_corner(void *reader, const struct yaml_value *value, void *out);
int move_read_path_points(void *reader, const struct yaml_value *value,
                          void *out);
/* So many positions; a quantity above zero. */
int move_read_vector(const struct move_reader *reader,
                     const struct yaml_value *value, uint32_t axes,
                     int64_t q32[PLAN_SPACE_AXES]);
int move_read_positive(const struct move_reader *reader,
                       const struct yaml_value *value,
                       enum units_quantity quantity, int64_t *out);

extern const struct yaml_shape move_path_shape;

/* How far from a curve is near enough, in an axis's unit. */
int64_t move_default_tolerance_q32(enum units_axis unit);

/* --- move_load_law.c ------------------------------------------------------ */

/* One part or a list of them, or fastest; what caps it then, and where it stops:
 * into a struct plan_path. */
int move_read_speed(void *reader, const struct yaml_value *value, void *out);
int move_read_caps(void *reader, const struct yaml_value *value, void *out);
int move_read_stops(void *reader, const struct yaml_value *value, void *out);
int move_read_start_speed(void *reader, const struct yaml_value *value,
                          void *out);
int move_read_last_speed(void *reader, const struct yaml_value *value,
                         void *out);

extern const struct yaml_shape move_part_shape, move_cap_shape, move_tool_shape;

/* --- move_load_timing.c --------------------------------------------------- */

/* fastest, for the axes that are read after it. */
int move_read_timing(void *reader, const struct yaml_value *value, void *out);
/* The axis being read, of the rig, has keys without times, of this curve. */
int move_join_timing(struct move_reader *reader, const struct yaml_value *value,
                     uint32_t rig_axis);
/* The next key of that axis: a position. */
int move_read_untimed(struct move_reader *reader,
                      const struct yaml_value *value, struct plan_key *key);

/* --- move_load_camera.c --------------------------------------------------- */

int move_read_camera(void *reader, const struct yaml_value *value, void *out);

extern const struct yaml_shape move_camera_shape, move_head_shape,
    move_look_shape, move_target_shape, move_dwell_shape;

/* --- move_load_follow.c --------------------------------------------------- */

/* Of look and camera; `out` is the camera. */
int move_read_subject(void *reader, const struct yaml_value *value, void *out);
int move_read_on_table(void *reader, const struct yaml_value *value, void *out);
int move_read_focus(void *reader, const struct yaml_value *value, void *out);
int move_read_zoom(void *reader, const struct yaml_value *value, void *out);
/* When all axes are read: the camera's rig gets those of the move. */
int move_check_rig(const struct move_reader *self,
                   const struct yaml_value *move);

extern const struct yaml_shape move_subject_shape, move_zoom_shape;

/* --- move_load_orient.c --------------------------------------------------- */

/* Keys of orientations, and their curve, into a struct plan_camera. */
int move_read_orients(void *reader, const struct yaml_value *value, void *out);
int move_read_orient_curve(void *reader, const struct yaml_value *value,
                           void *out);
/* Three plain numbers, not all zero, into a struct motion_dir. */
int move_read_direction(void *reader, const struct yaml_value *value,
                        void *out);

extern const struct yaml_shape move_orient_shape;

/* --- move_load_blend.c, move_load_other.c ---------------------------------- */

int move_read_poses(void *reader, const struct yaml_value *value, void *out);
int move_read_blended(void *reader, const struct yaml_value *value, void *out);
int move_read_layers(void *reader, const struct yaml_value *value, void *out);
int move_read_fade(void *reader, const struct yaml_value *value, void *out);
int move_read_warp(void *reader, const struct yaml_value *value, void *out);

extern const struct yaml_shape move_blend_shape, move_layer_shape,
    move_fade_shape;

/* --- move_load_couple.c --------------------------------------------------- */

/* Gears and cams into reader->move, whose other axes have been read. */
int move_read_couplings(void *reader, const struct yaml_value *value,
                        void *out);

extern const struct yaml_shape move_coupling_shape;

/* --- move_load_event.c ---------------------------------------------------- */

int move_read_events(void *reader, const struct yaml_value *value, void *out);
/* A line of kind trigger, into a uint32_t. */
int move_read_event_line(void *reader, const struct yaml_value *value,
                         void *out);

extern const struct yaml_shape move_event_shape;

/* --- move_load_shoot.c ---------------------------------------------------- */

/* After warp and events. */
int move_read_shoot(void *reader, const struct yaml_value *value, void *out);

extern const struct yaml_shape move_shoot_shape;
extern const char *const move_shoot_modes[PLAN_SHOOT_MODES];

#define MOVE_CURVES (PLAN_CURVE_BEZIER + 1)
#define MOVE_ENDS   (MOTION_SPLINE_PERIODIC + 1)
extern const char *const move_curves[MOVE_CURVES];
extern const char *const move_ends[MOVE_ENDS];
#define MOVE_ALONGS      3
#define MOVE_AHEAD_ENDS  3
#define MOVE_DWELL_EASES 2
extern const char *const move_alongs[MOVE_ALONGS];
extern const char *const move_ahead_ends[MOVE_AHEAD_ENDS];
extern const char *const move_dwell_eases[MOVE_DWELL_EASES];
#define MOVE_ORIENTS 3
extern const char *const move_orients[MOVE_ORIENTS];

#define MOVE_PATH_CURVES 8
#define MOVE_SPACINGS    3
#define MOVE_LAWS        (PLAN_SPEED_LAW_DRAWN + 1)
#define MOVE_RAMPS       (PLAN_RAMP_SCURVE + 1)
extern const char *const move_path_curves[MOVE_PATH_CURVES];
extern const char *const move_spacings[MOVE_SPACINGS];
extern const char *const move_laws[MOVE_LAWS];
extern const char *const move_ramps[MOVE_RAMPS];

/* --- move_load_bezier.c --------------------------------------------------- */

/* Words in the order of the enums of motion/curve/fcurve.h. */
#define MOVE_HANDLES        5
#define MOVE_INTERPOLATIONS 13
#define MOVE_EASINGS        4
#define MOVE_SMOOTHINGS     2
#define MOVE_EXTRAPOLATIONS 2
#define MOVE_CYCLES         4
extern const char *const move_handle_word[MOVE_HANDLES];
extern const char *const move_interpolation_word[MOVE_INTERPOLATIONS];
extern const char *const move_easing_word[MOVE_EASINGS];
extern const char *const move_smoothing_word[MOVE_SMOOTHINGS];
extern const char *const move_extrapolation_word[MOVE_EXTRAPOLATIONS];
extern const char *const move_cycle_word[MOVE_CYCLES];

/* Readers of fields, as struct yaml_field has them: of an axis with curve
 * bezier; `out` is the axis. */
int move_read_handles(void *reader, const struct yaml_value *value, void *out);
int move_read_interpolation(void *reader, const struct yaml_value *value,
                            void *out);
int move_read_easing(void *reader, const struct yaml_value *value, void *out);
int move_read_smoothing(void *reader, const struct yaml_value *value,
                        void *out);
int move_read_extrapolation(void *reader, const struct yaml_value *value,
                            void *out);
int move_read_cycles(void *reader, const struct yaml_value *value, void *out);
int move_read_until(void *reader, const struct yaml_value *value, void *out);
int move_read_grid(void *reader, const struct yaml_value *value, void *out);
extern const struct yaml_shape move_cycles_shape;

/* Of a key beside a bezier span; `out` is the key. */
int move_read_key_handles(void *reader, const struct yaml_value *value,
                          void *out);
int move_read_key_left(void *reader, const struct yaml_value *value, void *out);
int move_read_key_right(void *reader, const struct yaml_value *value,
                        void *out);
int move_read_key_interpolation(void *reader, const struct yaml_value *value,
                                void *out);
int move_read_key_easing(void *reader, const struct yaml_value *value,
                         void *out);
int move_read_key_back(void *reader, const struct yaml_value *value, void *out);
int move_read_key_amplitude(void *reader, const struct yaml_value *value,
                            void *out);
int move_read_key_period(void *reader, const struct yaml_value *value,
                         void *out);

/* Room for the handles of all keys, as the axis says; nothing where there is
 * room already. */
int move_bezier_capacity(struct move_reader *self,
                         const struct yaml_value *value);

/* Before and after the fields of a key. */
void move_bezier_open_key(struct move_reader *self);
int move_bezier_close_key(const struct move_reader *self,
                          const struct yaml_value *value);

#endif
