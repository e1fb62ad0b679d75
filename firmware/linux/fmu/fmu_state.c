/* firmware/linux/fmu/fmu_state.c - see fmu_state.h. */
#define _DEFAULT_SOURCE /* mincore */
#include "firmware/linux/fmu/fmu_state.h"

#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "sim/util.h"

/* From and to of this program or library; of the linker. */
/* NOLINTNEXTLINE(bugprone-reserved-identifier): its names */
extern const unsigned char __ehdr_start[], _end[];

/* A place as it is kept: the block counted from 1 above, the bytes below. */
#define STATE_SHIFT   48
#define STATE_OFFSET  ((UINT64_C(1) << STATE_SHIFT) - 1)
#define STATE_PROGRAM UINT64_C(0xfffe)
#define STATE_NOWHERE                                                          \
    UINT64_MAX /* the place is gone: the model's own is left */

struct state_block {
    unsigned char *at;
    size_t size;
};

struct state_blocks {
    struct memory_pool memory;
    struct state_block *block;
    unsigned count;
    size_t size;
};

static void state_take(void *of, void *at, size_t size)
{
    struct state_blocks *const self = of;

    self->block = memory_pool_more(&self->memory, self->block, self->count,
                                   sizeof *self->block);
    self->block[self->count++] = (struct state_block){ at, size };
    self->size += size;
}

static void state_find(struct state_blocks *self, struct fmu_model *model)
{
    *self = (struct state_blocks){ .count = 0 };
    state_take(self, model, sizeof *model);
    memory_pool_each(&model->memory, state_take, self);
    memory_pool_each(&model->rig.memory, state_take, self);
    memory_pool_each(&model->sim.memory, state_take, self);
    memory_pool_each(&model->machine.memory, state_take, self);
}

static void state_leave(struct state_blocks *self)
{
    memory_pool_free(&self->memory);
}

/* STATE_NOWHERE: it points to none of them; an end is still inside. */
static uint64_t state_place(const struct state_blocks *self, uint64_t word)
{
    const uint64_t program = (uintptr_t)__ehdr_start;

    if (word == 0)
        return 0;
    if (word >= program && word < (uintptr_t)_end)
        return STATE_PROGRAM << STATE_SHIFT | (word - program);
    for (unsigned i = 0; i < self->count; i++) {
        const uint64_t offset = word - (uintptr_t)self->block[i].at;
        if (offset <= self->block[i].size)
            return (i + UINT64_C(1)) << STATE_SHIFT | offset;
    }
    return STATE_NOWHERE;
}

/* The other way; false: there is no such place. */
static bool state_address(const struct state_blocks *self, uint64_t place,
                          uint64_t *word)
{
    const uint64_t block = place >> STATE_SHIFT, offset = place & STATE_OFFSET;

    if (block == 0) {
        *word = 0;
        return offset == 0;
    }
    if (block == STATE_PROGRAM) {
        *word = (uintptr_t)__ehdr_start + offset;
        return *word < (uintptr_t)_end;
    }
    if (block > self->count || offset > self->block[block - 1].size)
        return false;
    *word = (uintptr_t)self->block[block - 1].at + offset;
    return true;
}

static uint64_t state_word(const unsigned char *at)
{
    uint64_t word;

    memcpy(&word, at, sizeof word);
    return word;
}

/* --- which words are pointers --- */

/* Is there memory at this address? */
static bool state_is_mapped(uint64_t word)
{
    const uint64_t page = (uint64_t)sysconf(_SC_PAGESIZE);
    const uint64_t start = word / page * page;
    unsigned char resident, *at;

    memcpy(&at, &start, sizeof at);
    return word >= page && word >> 47 == 0 && mincore(at, page, &resident) == 0;
}

static unsigned char state_kind(const struct state_blocks *blocks, uint64_t a,
                                uint64_t b)
{
    const uint64_t place = state_place(&blocks[0], a);

    if (a == b)
        return place >> STATE_SHIFT == STATE_PROGRAM ? FMU_STATE_PLACE
                                                     : FMU_STATE_DATA;
    if (place != STATE_NOWHERE && place == state_place(&blocks[1], b))
        return FMU_STATE_PLACE;
    return state_is_mapped(a) && state_is_mapped(b) ? FMU_STATE_OWN
                                                    : FMU_STATE_DATA;
}

static void state_compare(struct fmu_state_map *map,
                          const struct state_blocks *blocks)
{
    size_t word = 0;

    map->size = blocks->size;
    for (unsigned i = 0; i < blocks->count; i++)
        map->words += blocks->block[i].size / 8;
    map->word = memory_pool_new(&map->memory, map->words, 1);
    for (unsigned i = 0; i < blocks->count; i++) {
        const unsigned char *const a = blocks[0].block[i].at;
        const unsigned char *const b = blocks[1].block[i].at;
        for (size_t at = 0; at + 8 <= blocks->block[i].size; at += 8)
            map->word[word++] =
                state_kind(blocks, state_word(a + at), state_word(b + at));
    }
}

void fmu_state_map_of(struct fmu_state_map *map, struct fmu_model *one,
                      struct fmu_model *other)
{
    struct state_blocks blocks[2];

    state_find(&blocks[0], one);
    state_find(&blocks[1], other);
    state_compare(map, blocks);
    state_leave(&blocks[0]);
    state_leave(&blocks[1]);
}

int fmu_state_map_init(struct fmu_state_map *map, const struct files *files,
                       const char *path, char message[YAML_MESSAGE_MAX])
{
    struct fmu_model *const model = memory_new(2, sizeof *model);
    int err = 0;

    for (unsigned i = 0; i < 2 && err == 0; i++) {
        err = fmu_model_init(&model[i], files, path);
        if (err == 0)
            err = fmu_model_start(&model[i]);
        if (err < 0)
            memcpy(message, model[i].message, YAML_MESSAGE_MAX);
    }
    if (err == 0)
        fmu_state_map_of(map, &model[0], &model[1]);
    for (unsigned i = 0; i < 2; i++)
        fmu_model_free(&model[i]);
    memory_free(model);
    return err;
}

void fmu_state_map_free(struct fmu_state_map *map)
{
    memory_pool_free(&map->memory);
    memset(map, 0, sizeof *map);
}

/* --- save and load --- */

size_t fmu_state_size(struct fmu_model *model)
{
    struct state_blocks blocks;

    state_find(&blocks, model);
    state_leave(&blocks);
    return blocks.size;
}

void fmu_state_save(const struct fmu_state_map *map, struct fmu_model *model,
                    unsigned char *bytes)
{
    struct state_blocks blocks;
    const unsigned char *kind = map->word;

    state_find(&blocks, model);
    for (unsigned i = 0; i < blocks.count; i++) {
        const struct state_block *const block = &blocks.block[i];
        memcpy(bytes, block->at, block->size);
        for (size_t at = 0; at + 8 <= block->size; at += 8) {
            if (*kind++ == FMU_STATE_DATA)
                continue;
            const uint64_t place =
                state_place(&blocks, state_word(block->at + at));
            memcpy(bytes + at, &place, sizeof place);
        }
        bytes += block->size;
    }
    state_leave(&blocks);
}

/* Of one word: what it is in this model.  false: there is no such place. */
static bool state_read(const struct state_blocks *blocks, unsigned char kind,
                       const unsigned char *own, const unsigned char *bytes,
                       uint64_t *word)
{
    *word = state_word(bytes);
    if (kind == FMU_STATE_DATA)
        return true;
    if (kind == FMU_STATE_PLACE && *word != STATE_NOWHERE)
        return state_address(blocks, *word, word);
    *word = state_word(own);
    return true;
}

static bool state_copy(const struct fmu_state_map *map,
                       const struct state_blocks *blocks,
                       const unsigned char *bytes, bool writes)
{
    const unsigned char *kind = map->word;
    uint64_t word;

    for (unsigned i = 0; i < blocks->count; i++) {
        unsigned char *const to = blocks->block[i].at;
        const size_t size = blocks->block[i].size, whole = size / 8 * 8;
        for (size_t at = 0; at < whole; at += 8) {
            if (!state_read(blocks, *kind++, to + at, bytes + at, &word))
                return false;
            if (writes)
                memcpy(to + at, &word, sizeof word);
        }
        if (writes)
            memcpy(to + whole, bytes + whole, size - whole);
        bytes += size;
    }
    return true;
}

int fmu_state_load(const struct fmu_state_map *map, struct fmu_model *model,
                   const unsigned char *bytes, size_t size)
{
    struct state_blocks blocks;

    state_find(&blocks, model);
    const bool fits = size == blocks.size && size == map->size &&
                      state_copy(map, &blocks, bytes, false);
    if (fits)
        (void)state_copy(map, &blocks, bytes, true);
    state_leave(&blocks);
    return fits ? 0 : -1;
}
