/* firmware/fmu/kept.c - the states of an instance that an environment keeps; see
 * instance.h.
 *
 * struct kept_head, then the variables of every axis, then, once it has been
 * initialized, its model (fmu_state.h). */
#include <string.h>

#include "firmware/fmu/instance.h"
#include "firmware/host/base/memory.h"

struct kept_head {
    char token[FMU_TOKEN_MAX]; /* of the unit */
    uint64_t size, sum;        /* of all, and of what follows the head */
    double start_s;
    enum fmu_state state;
    bool warned, enable;
};

/* FNV-1a. */
static uint64_t kept_sum(const unsigned char *bytes, size_t size)
{
    uint64_t sum = UINT64_C(0xcbf29ce484222325);

    for (size_t i = 0; i < size; i++)
        sum = (sum ^ bytes[i]) * UINT64_C(0x100000001b3);
    return sum;
}

static size_t kept_variables(const struct fmu *self)
{
    return self->model.rig.axis_count * sizeof self->model.axis[0].value;
}

static struct kept_head kept_head(const struct fmu *self, size_t size)
{
    struct kept_head head;

    memset(&head, 0, sizeof head);
    memcpy(head.token, fmu_files_token(&self->files),
           strlen(fmu_files_token(&self->files)));
    head.size = size;
    head.start_s = self->start_s;
    head.state = self->state;
    head.warned = self->warned;
    head.enable = self->model.enable;
    return head;
}

static int kept_map(struct fmu *self)
{
    return self->map.words > 0
               ? 0
               : fmu_state_map_init(&self->map, &self->files.files,
                                    fmu_files_rig(&self->files),
                                    self->model.message);
}

enum fmu_status fmu_keep(struct fmu *self, struct fmu_kept **kept)
{
    const size_t variables = kept_variables(self);
    const size_t before = sizeof(struct kept_head) + variables;
    const bool is_running = self->model.is_running;
    const size_t size =
        before + (is_running ? fmu_state_size(&self->model) : 0);

    if (is_running && kept_map(self) < 0)
        return fmu_fail(self, self->model.message);
    struct fmu_kept *const to =
        memory_resize(*kept, sizeof(struct fmu_kept) + size, 1);
    unsigned char *at = to->bytes + sizeof(struct kept_head);
    struct kept_head head = kept_head(self, size);
    to->size = size;
    for (unsigned i = 0; i < self->model.rig.axis_count; i++) {
        memcpy(at, self->model.axis[i].value, sizeof self->model.axis[i].value);
        at += sizeof self->model.axis[i].value;
    }
    if (is_running)
        fmu_state_save(&self->map, &self->model, at);
    head.sum = kept_sum(to->bytes + sizeof head, size - sizeof head);
    memcpy(to->bytes, &head, sizeof head);
    *kept = to;
    return FMU_OK;
}

static bool kept_is_legal(const struct fmu *self, const void *bytes,
                          size_t size)
{
    struct kept_head head;

    if (size < sizeof head + kept_variables(self))
        return false;
    memcpy(&head, bytes, sizeof head);
    return head.size == size &&
           strncmp(head.token, fmu_files_token(&self->files),
                   sizeof head.token) == 0 &&
           head.state <= FMU_ENDED &&
           head.sum == kept_sum((const unsigned char *)bytes + sizeof head,
                                size - sizeof head);
}

/* As after an instantiation, with the variables that are kept. */
static enum fmu_status kept_begin(struct fmu *self, const unsigned char *value)
{
    if (fmu_reset(self) != FMU_OK)
        return FMU_ERROR;
    for (unsigned i = 0; i < self->model.rig.axis_count; i++)
        memcpy(self->model.axis[i].value,
               value + i * sizeof self->model.axis[i].value,
               sizeof self->model.axis[i].value);
    return FMU_OK;
}

/* A model that is running has all memory that another one's state needs. */
static enum fmu_status kept_run(struct fmu *self, const unsigned char *bytes,
                                size_t size)
{
    if (kept_map(self) < 0 ||
        (!self->model.is_running && fmu_model_start(&self->model) < 0))
        return fmu_fail(self, self->model.message);
    if (fmu_state_load(&self->map, &self->model, bytes, size) < 0)
        return fmu_fail(self, "the state is not of this unit");
    return FMU_OK;
}

enum fmu_status fmu_restore(struct fmu *self, const struct fmu_kept *kept)
{
    const size_t before = sizeof(struct kept_head) + kept_variables(self);
    struct kept_head head;
    enum fmu_status status = FMU_OK;

    if (kept == NULL || !kept_is_legal(self, kept->bytes, kept->size))
        return fmu_fail(self, "the state is not of this unit");
    const bool is_running = kept->size > before;
    memcpy(&head, kept->bytes, sizeof head);
    if (!is_running || !self->model.is_running)
        status = kept_begin(self, kept->bytes + sizeof head);
    if (status == FMU_OK && is_running)
        status = kept_run(self, kept->bytes + before, kept->size - before);
    if (status != FMU_OK)
        return status;
    self->model.enable = head.enable;
    self->state = head.state;
    self->start_s = head.start_s;
    self->warned = head.warned;
    return FMU_OK;
}

enum fmu_status fmu_kept_size(struct fmu *self, const struct fmu_kept *kept,
                              size_t *size)
{
    if (kept == NULL)
        return fmu_fail(self, "there is no state");
    *size = kept->size;
    return FMU_OK;
}

enum fmu_status fmu_kept_read(struct fmu *self, const void *bytes, size_t size,
                              struct fmu_kept **kept)
{
    if (!kept_is_legal(self, bytes, size))
        return fmu_fail(self, "the bytes are not a state of this unit");
    *kept = memory_resize(*kept, sizeof(struct fmu_kept) + size, 1);
    (*kept)->size = size;
    memcpy((*kept)->bytes, bytes, size);
    return FMU_OK;
}

enum fmu_status fmu_kept_write(struct fmu *self, const struct fmu_kept *kept,
                               void *bytes, size_t size)
{
    if (kept == NULL || size < kept->size)
        return fmu_fail(self, "a state does not fit where it is written to");
    memcpy(bytes, kept->bytes, kept->size);
    return FMU_OK;
}
