/* firmware/linux/commands/ports/sim_fit_edit.c - fitted values in the text of the
 * rig file; see sim_fit.h. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/yaml/yaml_edit.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/ports/sim_fit.h"

static struct yaml_value edit_under(const struct yaml_value *map,
                                    const char *name)
{
    return (struct yaml_value){ map->tree, yaml_fields_find(map, name), name,
                                "a map" };
}

/* Has the fit something to say of it, and what?  A gap, friction of 0 are none:
 * "". */
static bool edit_value(const struct sim_fit_axis *self,
                       enum sim_model_parameter of,
                       char text[SIM_FIT_VALUE_MAX])
{
    const struct sim_fit_value *const value = &self->fit.parameter[of];
    const struct sim_fit_parameter *const as = sim_fit_parameter(self, of);
    const bool load = as->in_load;
    /* a load has these two, whether the run shows them or not */
    const bool required = of == SIM_MODEL_INERTIA || of == SIM_MODEL_FREQUENCY;

    text[0] = 0;
    if (as->word == NULL || (load && self->fit.model == SIM_FIT_RIGID) ||
        (!value->known && !(required && !self->loaded)))
        return false;
    if (value->value > 0 || !load)
        sim_fit_value(text, self, of, value->value);
    return true;
}

static int edit_field(struct yaml_text *yaml, const struct yaml_value *map,
                      const char *name, const char *text)
{
    const struct yaml_value field = edit_under(map, name);

    if (text[0] == 0)
        return field.node == 0 ? 0 : yaml_edit_remove(yaml, map, name);
    return field.node == 0 ? yaml_edit_add(yaml, map, name, text)
                           : yaml_text_replace(yaml, &field, text);
}

static int edit_fields(struct yaml_text *yaml, const struct sim_fit_axis *self,
                       const struct yaml_value *map, bool load)
{
    char text[SIM_FIT_VALUE_MAX];
    int err = 0;

    for (unsigned p = 0; err == 0 && p < SIM_MODEL_PARAMETERS; p++)
        if (sim_fit_parameter(self, p)->in_load == load &&
            edit_value(self, p, text))
            err = edit_field(yaml, map, sim_fit_parameter(self, p)->word, text);
    return err;
}

/* All of one level as a map in brackets, the load's at its end. */
static void edit_whole(const struct sim_fit_axis *self, bool load,
                       const char *under, char map[YAML_TEXT_VALUE_MAX])
{
    char text[SIM_FIT_VALUE_MAX];
    size_t length = 0;

    map[length++] = '{';
    for (unsigned p = 0; p < SIM_MODEL_PARAMETERS; p++)
        if (sim_fit_parameter(self, p)->in_load == load &&
            edit_value(self, p, text) && text[0] != 0)
            length += (size_t)snprintf(
                map + length, YAML_TEXT_VALUE_MAX - length, "%s%s: %s",
                length > 1 ? ", " : "", sim_fit_parameter(self, p)->word, text);
    snprintf(map + length, YAML_TEXT_VALUE_MAX - length, "%s%s}",
             under != NULL ? ", load: " : "", under != NULL ? under : "");
}

static int edit_axis(struct yaml_text *yaml, const struct sim_fit_axis *self,
                     const struct yaml_value *axes)
{
    const struct yaml_value axis = edit_under(axes, self->axis->name);
    struct yaml_value sim = edit_under(&axis, "sim");
    char whole[YAML_TEXT_VALUE_MAX], load[YAML_TEXT_VALUE_MAX];
    const bool has_load = self->fit.model != SIM_FIT_RIGID;
    int err;

    edit_whole(self, true, NULL, load);
    if (sim.node == 0) {
        edit_whole(self, false, has_load ? load : NULL, whole);
        return yaml_edit_add(yaml, &axis, "sim", whole);
    }
    const struct yaml_value loops = edit_under(&sim, "loops");
    err = edit_fields(yaml, self, self->axis->sim.loops.given ? &loops : &sim,
                      false);
    if (err < 0 || !has_load)
        return err;
    const struct yaml_value under = edit_under(&sim, "load");
    return under.node == 0 ? yaml_edit_add(yaml, &sim, "load", load)
                           : edit_fields(yaml, self, &under, true);
}

enum status sim_fit_edit(struct sim_fit_all *all)
{
    char message[YAML_MESSAGE_MAX] = "";
    const struct yaml_report report = { all->rig_path, message,
                                        YAML_MESSAGE_MAX };
    struct yaml_text yaml;
    int err = yaml_text_open(&yaml, &disk_files, &report);

    if (err == 0) {
        const struct yaml_value root = { &yaml.tree, 0, "the rig", "a map" };
        const struct yaml_value axes = edit_under(&root, "axes");
        for (uint32_t i = 0; err == 0 && i < all->rig.axis_count; i++)
            if (all->axis[i].fit.plays > 0)
                err = edit_axis(&yaml, &all->axis[i], &axes);
    }
    if (err == 0) {
        all->edits = yaml.edits;
        all->text.data = yaml_text_make(&yaml, &all->text.length);
    } else {
        error_say("%s", message);
    }
    yaml_text_close(&yaml);
    return err == 0 ? STATUS_OK : STATUS_INPUT;
}
