/* firmware/linux/fmu/fmu_state.h - the state of a model in bytes, to put into it
 * again or into another model of the same rig, in another process too.
 *
 * A model is the blocks of its memory: itself and those of its pools.  They are
 * copied as they are, but for what points into them or into the program: that is
 * kept as a block (or the program) and a place in it.  Which words these are is
 * not guessed.  Two models are started beside each other; where they differ,
 * there is a pointer, as what is simulated is the same, or the padding of a
 * number, which is kept with it: a pointer to elsewhere points to memory that is
 * there, in both.  Pointers are made by the start of a model: later a word may
 * point to something else, but none becomes a pointer that was none
 * (tests/firmware/linux/fmu/test_fmu_state.c). */
#ifndef FIRMWARE_LINUX_FMU_FMU_STATE_H
#define FIRMWARE_LINUX_FMU_FMU_STATE_H

#include "firmware/linux/fmu/fmu_model.h"

/* What a word of a model is. */
enum {
    FMU_STATE_DATA,
    FMU_STATE_PLACE, /* points into the model, or into the program */
    FMU_STATE_OWN    /* points elsewhere: to what belongs to this model alone */
};

/* Which words of a model are pointers.  All zero: not known yet. */
struct fmu_state_map {
    struct memory_pool memory;
    unsigned char *word; /* FMU_STATE_..., of every word of every block */
    size_t words, size;
};

/* Of the models of a rig.  0, or -1 with a message. */
int fmu_state_map_init(struct fmu_state_map *map, const struct files *files,
                       const char *path, char message[YAML_MESSAGE_MAX]);
/* The same, of two models of a rig that have been started and not moved. */
void fmu_state_map_of(struct fmu_state_map *map, struct fmu_model *one,
                      struct fmu_model *other);
void fmu_state_map_free(struct fmu_state_map *map);

/* Of a model that has been started. */
size_t fmu_state_size(struct fmu_model *model);
void fmu_state_save(const struct fmu_state_map *map, struct fmu_model *model,
                    unsigned char *bytes);
/* -1, and nothing has changed: they are no state of that model. */
int fmu_state_load(const struct fmu_state_map *map, struct fmu_model *model,
                   const unsigned char *bytes, size_t size);

#endif
