/* tests/firmware/linux/fmu/test_fmu_state.c - a model's state in another model of
 * the same rig goes on the same; what becomes of its pointers. */
#include "firmware/linux/fmu/fmu_state.h"

#include <string.h>

#include "firmware/linux/fmu/fmu_files.h"
#include "tests/support/check.h"

#define STEP_NS INT64_C(3000000)

struct unit {
    struct fmu_files files;
    struct fmu_model *model;
    const char *rig;
};

static void unit_start(struct unit *unit, const char *rig)
{
    *unit = (struct unit){ .rig = rig,
                           .model = memory_new(1, sizeof *unit->model) };
    fmu_files_record(&unit->files, rig);
    if (fmu_model_init(unit->model, &unit->files.files, rig) < 0 ||
        fmu_model_start(unit->model) < 0)
        fail_msg("%s", unit->model->message);
}

static void unit_end(struct unit *unit)
{
    fmu_model_free(unit->model);
    fmu_files_free(&unit->files);
    memory_free(unit->model);
}

/* So many steps on; from step `far` the set points are where no drive follows. */
static void unit_go(struct unit *unit, int steps, int far)
{
    struct fmu_model *const model = unit->model;

    for (int k = 0; k < steps; k++) {
        for (unsigned i = 0; i < model->rig.axis_count; i++)
            model->axis[i].value[FMU_DEMAND_POSITION] += k < far ? 0.01 : 20;
        fmu_model_step(model, model->now_ns + STEP_NS);
    }
}

static bool any_fault(const struct fmu_model *model)
{
    bool fault = false;
    for (unsigned i = 0; i < model->rig.axis_count; i++)
        fault = fault || model->axis[i].value[FMU_FAULT] != 0;
    return fault;
}

static void assert_same(const struct fmu_model *a, const struct fmu_model *b)
{
    for (unsigned i = 0; i < a->rig.axis_count; i++)
        assert_memory_equal(a->axis[i].value, b->axis[i].value,
                            sizeof a->axis[i].value);
    assert_true(a->now_ns == b->now_ns);
}

/* Each kind of drive and bus, and what axes carry. */
static const char *const rigs[] = { "tests/data/fmu/rig.yaml",
                                    "examples/dolly/rig.yaml",
                                    "examples/odrive/rig.yaml",
                                    "tests/data/fmu/carries.yaml" };

static void a_state_goes_on_in_another_model(void **state)
{
    (void)state;
    for (size_t r = 0; r < sizeof rigs / sizeof rigs[0]; r++) {
        char message[YAML_MESSAGE_MAX] = "";
        struct fmu_state_map map = { .words = 0 };
        struct unit unit, other;

        unit_start(&unit, rigs[r]);
        unit_start(&other, rigs[r]);
        assert_int_equal(
            fmu_state_map_init(&map, &unit.files.files, rigs[r], message), 0);
        unit_go(&unit, 50, 40);
        unit_go(&other, 20, 20);
        const size_t size = fmu_state_size(unit.model);
        unsigned char *const bytes = memory_new(size, 1);
        fmu_state_save(&map, unit.model, bytes);
        unit_go(&unit, 60, 0);
        assert_int_equal(fmu_state_load(&map, other.model, bytes, size), 0);
        unit_go(&other, 60, 0);
        assert_same(unit.model, other.model);
        /* and where it comes from */
        assert_int_equal(fmu_state_load(&map, unit.model, bytes, size), 0);
        unit_go(&unit, 60, 0);
        assert_same(unit.model, other.model);
        memory_free(bytes);
        fmu_state_map_free(&map);
        unit_end(&other);
        unit_end(&unit);
    }
}

/* From and to of this program; of the linker. */
/* NOLINTNEXTLINE(bugprone-reserved-identifier): its names */
extern const unsigned char __ehdr_start[], _end[];

#define BLOCKS_MAX 4096

struct blocks {
    struct {
        const unsigned char *at;
        size_t size;
    } block[BLOCKS_MAX];
    size_t count;
};

static void take(void *of, void *at, size_t size)
{
    struct blocks *const self = of;

    assert_true(self->count < BLOCKS_MAX);
    self->block[self->count].at = at;
    self->block[self->count++].size = size;
}

static bool points_inside(const struct blocks *blocks, uint64_t word)
{
    bool inside = word >= (uintptr_t)__ehdr_start && word < (uintptr_t)_end;

    for (size_t i = 0; i < blocks->count && !inside; i++)
        inside = word - (uintptr_t)blocks->block[i].at <= blocks->block[i].size;
    return inside;
}

/* How many words that the map does not have look like pointers. */
static size_t stray(const struct fmu_state_map *map, struct fmu_model *model)
{
    static struct blocks blocks;
    const unsigned char *kind = map->word;
    size_t count = 0;

    blocks.count = 0;
    take(&blocks, model, sizeof *model);
    memory_pool_each(&model->memory, take, &blocks);
    memory_pool_each(&model->rig.memory, take, &blocks);
    memory_pool_each(&model->sim.memory, take, &blocks);
    memory_pool_each(&model->machine.memory, take, &blocks);
    for (size_t i = 0; i < blocks.count; i++)
        for (size_t at = 0; at + 8 <= blocks.block[i].size; at += 8, kind++) {
            uint64_t word;
            memcpy(&word, blocks.block[i].at + at, sizeof word);
            count += *kind == FMU_STATE_OWN ||
                     (word != 0 && points_inside(&blocks, word) !=
                                       (*kind == FMU_STATE_PLACE));
        }
    return count;
}

static void no_word_becomes_a_pointer_while_it_runs(void **state)
{
    (void)state;
    for (size_t r = 0; r < sizeof rigs / sizeof rigs[0]; r++) {
        char message[YAML_MESSAGE_MAX] = "";
        struct fmu_state_map map = { .words = 0 };
        struct unit unit;

        unit_start(&unit, rigs[r]);
        assert_int_equal(
            fmu_state_map_init(&map, &unit.files.files, rigs[r], message), 0);
        assert_int_equal(stray(&map, unit.model), 0);
        for (int k = 0; k < 10; k++) {
            unit_go(&unit, 30, k < 2 ? 30 : 0);
            unit.model->enable = k != 6;
            assert_int_equal(stray(&map, unit.model), 0);
        }
        assert_true(r == 2 || any_fault(unit.model));
        fmu_state_map_free(&map);
        unit_end(&unit);
    }
}

/* A number of four bytes with padding that is by chance another one in each
 * model, and a pointer to what belongs to a model alone. */
static void a_number_with_padding_is_kept_and_a_pointer_is_not(void **state)
{
    struct fmu_state_map map = { .words = 0 };
    struct unit unit, other;
    (void)state;

    unit_start(&unit, rigs[0]);
    unit_start(&other, rigs[0]);
    uint64_t word[] = { UINT64_C(0x00007ffd0000002a),
                        UINT64_C(0x000055550000002a) };
    double *const at = unit.model->axis[0].value;
    double *const other_at = other.model->axis[0].value;
    memcpy(&at[0], &word[0], sizeof word[0]);
    memcpy(&other_at[0], &word[1], sizeof word[1]);
    const uint64_t own[] = { (uintptr_t)&unit, (uintptr_t)&other };
    memcpy(&at[1], &own[0], sizeof own[0]);
    memcpy(&other_at[1], &own[1], sizeof own[1]);
    fmu_state_map_of(&map, unit.model, other.model);
    assert_int_equal(stray(&map, unit.model), 1);
    word[0] += 7;
    memcpy(&at[0], &word[0], sizeof word[0]);
    const size_t size = fmu_state_size(unit.model);
    unsigned char *const bytes = memory_new(size, 1);
    fmu_state_save(&map, unit.model, bytes);
    assert_int_equal(fmu_state_load(&map, other.model, bytes, size), 0);
    assert_memory_equal(&other_at[0], &word[0], sizeof word[0]);
    assert_memory_equal(&other_at[1], &own[1], sizeof own[1]);
    memory_free(bytes);
    fmu_state_map_free(&map);
    unit_end(&other);
    unit_end(&unit);
}

static void bytes_of_another_rig_are_refused(void **state)
{
    char message[YAML_MESSAGE_MAX] = "";
    struct fmu_state_map map = { .words = 0 };
    struct unit unit;
    (void)state;

    unit_start(&unit, rigs[0]);
    assert_int_equal(
        fmu_state_map_init(&map, &unit.files.files, rigs[0], message), 0);
    const size_t size = fmu_state_size(unit.model);
    unsigned char *const bytes = memory_new(size, 1);
    fmu_state_save(&map, unit.model, bytes);
    const struct fmu_axis before = unit.model->axis[0];
    assert_int_equal(fmu_state_load(&map, unit.model, bytes, size - 1), -1);
    memset(bytes, 0xa5, size); /* places that there are not */
    assert_int_equal(fmu_state_load(&map, unit.model, bytes, size), -1);
    assert_memory_equal(&before, &unit.model->axis[0], sizeof before);
    memory_free(bytes);
    fmu_state_map_free(&map);
    unit_end(&unit);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_state_goes_on_in_another_model),
        cmocka_unit_test(no_word_becomes_a_pointer_while_it_runs),
        cmocka_unit_test(a_number_with_padding_is_kept_and_a_pointer_is_not),
        cmocka_unit_test(bytes_of_another_rig_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
