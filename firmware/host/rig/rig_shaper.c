/* firmware/host/rig/rig_shaper.c - the input shaper of an axis. */
#include "firmware/host/rig/rig_parts.h"

const char *const rig_shaper_kinds[PLAN_SHAPER_KINDS] = {
#define RIG_SHAPER_WORD(name, word, impulses) word,
    PLAN_SHAPER_LIST(RIG_SHAPER_WORD)
#undef RIG_SHAPER_WORD
};

/* Longer than any axis swings, shorter than any tick of a drive that answers. */
#define RIG_SHAPER_MIN_HZ 0.1
#define RIG_SHAPER_MAX_HZ 200.0

static int rig_read_shaper_kind(void *reader, const struct yaml_value *value,
                                void *out)
{
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, rig_shaper_kinds, PLAN_SHAPER_KINDS, &index) <
        0)
        return -1;
    *(enum plan_shaper_kind *)out = (enum plan_shaper_kind)index;
    return 0;
}

static int rig_read_shaper_frequency(void *reader,
                                     const struct yaml_value *value, void *out)
{
    return rig_read_frequency(reader, value, RIG_SHAPER_MIN_HZ,
                              RIG_SHAPER_MAX_HZ, out);
}

static int rig_read_shaper_damping(void *reader, const struct yaml_value *value,
                                   void *out)
{
    return rig_read_share(reader, value, 0, PLAN_SHAPER_DAMPING_MAX, out);
}

static int rig_read_shaper_residual(void *reader,
                                    const struct yaml_value *value, void *out)
{
    const struct rig_axis *axis = ((struct rig_reader *)reader)->axis;

    if (axis->shaper.kind != PLAN_SHAPER_EI &&
        axis->shaper.kind != PLAN_SHAPER_EI2)
        return yaml_value_refuse(value, "is not used by kind %s",
                                 plan_shaper_word(axis->shaper.kind));
    return rig_read_share(reader, value, 0.001, 0.3, out);
}

static const struct yaml_field rig_shaper_fields[] = {
    { "kind", YAML_REQUIRED, "zv, zvd, ei or ei2", rig_read_shaper_kind,
      offsetof(struct plan_shaper_request, kind) },
    { "frequency", YAML_REQUIRED, "0.1 Hz .. 200 Hz, of the vibration",
      rig_read_shaper_frequency,
      offsetof(struct plan_shaper_request, frequency_hz) },
    { "damping", YAML_OPTIONAL, "a ratio of 0 .. 0.99", rig_read_shaper_damping,
      offsetof(struct plan_shaper_request, damping) },
    { "residual", YAML_OPTIONAL, "0.1 % .. 30 %, with kind ei or ei2",
      rig_read_shaper_residual,
      offsetof(struct plan_shaper_request, residual) },
};
const struct yaml_shape rig_shaper_shape = { "shaper", rig_shaper_fields,
                                             ARRAY_LEN(rig_shaper_fields) };

/* `out` is the axis, whose drive is known: the fields' order says so. */
int rig_read_shaper(void *reader, const struct yaml_value *value, void *out)
{
    struct rig_axis *axis = out;
    struct plan_shaper shaper;
    struct plan_error error;

    axis->shaper.residual = PLAN_SHAPER_RESIDUAL;
    if (yaml_fields_read(value, &rig_shaper_shape, reader, &axis->shaper) < 0)
        return -1;
    axis->has_shaper = true;
    if (axis->point_to_point)
        return yaml_value_refuse(value, "is given, but its drive goes from key "
                                        "to key by its own profile");
    if (plan_shaper_design(&axis->shaper, &shaper, &error) < 0) {
        struct yaml_value impossible = *value;
        impossible.expected = "another kind or less damping";
        return yaml_value_refuse(&impossible, "cannot be made: %s", error.text);
    }
    return 0;
}
