/* firmware/linux/move_reader.h - what the files that read move.yaml share. */
#ifndef FIRMWARE_LINUX_MOVE_READER_H
#define FIRMWARE_LINUX_MOVE_READER_H

#include "firmware/linux/rig.h"
#include "firmware/linux/units.h"
#include "firmware/linux/yaml_fields.h"

struct move_reader {
    const struct rig *rig;
    struct plan_move *move;
    struct plan_axis *axis; /* being read */
    const struct plan_key *key;
    struct units_context units;
    uint32_t keys;                  /* that the axis will have */
    struct plan_bezier_key handles; /* what the axis says for all of its keys */
    bool handles_given;             /* by the key: their kinds */
    bool side_given[2];             /* by the key: where left, right is */
};

/* The curves of the spans that end and start at the key being read. */
const struct plan_curve_rules *move_before(const struct move_reader *self);
const struct plan_curve_rules *move_after(const struct move_reader *self);

/* "is not used by curve ...". */
int move_refuse_use(const struct yaml_value *value,
                    const struct plan_curve_rules *rules);

/* --- move_load_bezier.c --------------------------------------------------- */

/* Words in the order of the enums of motion/fcurve.h. */
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
int move_bezier_room(struct move_reader *self, const struct yaml_value *value);

/* Before and after the fields of a key. */
void move_bezier_open_key(struct move_reader *self);
int move_bezier_close_key(const struct move_reader *self,
                          const struct yaml_value *value);

#endif
