/* firmware/host/yaml/yaml_edit.h - entries and items put into the text of a YAML
 * file, and taken out of it (yaml_text.h).
 *
 * What is put beside others is written as they are: in the line where they stand
 * in brackets, else on a line of its own with their indentation.  Comments stay,
 * but for one behind what is taken out.  Functions return 0, or -1 with the
 * sentence written. */
#ifndef FIRMWARE_HOST_YAML_YAML_EDIT_H
#define FIRMWARE_HOST_YAML_YAML_EDIT_H

#include "firmware/host/yaml/yaml_text.h"

/* Where a node begins, and where it ends: behind its last character. */
int yaml_edit_span(const struct yaml_text *self, const struct yaml_value *value,
                   size_t *from, size_t *to);
/* Is a list or a map written in brackets? */
bool yaml_edit_is_flow(const struct yaml_text *self,
                       const struct yaml_value *value);

/* `name: by` as the last entry of a map. */
int yaml_edit_add(struct yaml_text *self, const struct yaml_value *map,
                  const char *name, const char *by);
/* An entry of a map that is there. */
int yaml_edit_remove(struct yaml_text *self, const struct yaml_value *map,
                     const char *name);

/* `by` as an item of a list that has one at least, before the item `before`
 * (0: as the last). */
int yaml_edit_add_item(struct yaml_text *self, const struct yaml_value *list,
                       uint32_t before, const char *by);
int yaml_edit_remove_item(struct yaml_text *self, const struct yaml_value *list,
                          uint32_t item);

/* A list of values in brackets as a map, whose names they get in their order. */
int yaml_edit_name_items(struct yaml_text *self, const struct yaml_value *list,
                         const char *const name[], uint32_t names);

#endif
