/* firmware/studio/wasm/edit.c - edits of the move's text, from and to JSON; see
 * plan.h.  docs/STUDIO.md describes the operations. */
#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/job/repair.h"
#include "firmware/host/move/move_edit.h"
#include "firmware/host/move/move_load.h"
#include "firmware/studio/wasm/plan.h"

#define EDIT_OPERATIONS_MAX 100000

/* Texts that are made of numbers live as long as the operations. */
struct edit_reader {
    struct memory_pool pool;
    const char *wrong; /* NULL: nothing so far */
};

/* --- operations -------------------------------------------------------------- */

static const char *edit_print(struct edit_reader *reader, double value)
{
    char *text = memory_pool_new(&reader->pool, 1, 32);

    snprintf(text, 32, "%.12g", value);
    if (strchr(text, 'e') != NULL)
        snprintf(text, 32, "%.9f", value);
    return text;
}

/* A number or a text; a text may not end its line. */
static const char *edit_text(struct edit_reader *reader, const cJSON *value)
{
    if (cJSON_IsNumber(value) && fabs(value->valuedouble) < 1e12)
        return edit_print(reader, value->valuedouble);
    if (cJSON_IsString(value) && value->valuestring[0] != 0 &&
        strpbrk(value->valuestring, "\r\n") == NULL)
        return value->valuestring;
    reader->wrong = "a value is neither a number nor a text of one line";
    return "";
}

static void edit_put(struct move_edit *edit, const char *name,
                     const char *value)
{
    if (edit->fields < MOVE_EDIT_FIELDS)
        edit->field[edit->fields++] = (struct move_edit_field){ name, value };
}

static const char *edit_pair(struct edit_reader *reader, const cJSON *side)
{
    const char *dt =
        edit_text(reader, cJSON_GetObjectItemCaseSensitive(side, "dt"));
    const char *dp =
        edit_text(reader, cJSON_GetObjectItemCaseSensitive(side, "dp"));
    const size_t size = strlen(dt) + strlen(dp) + 8;
    char *text = memory_pool_new(&reader->pool, 1, size);

    snprintf(text, size, "[%s%s, %s]", dt,
             cJSON_IsNumber(cJSON_GetObjectItemCaseSensitive(side, "dt")) ? " s"
                                                                          : "",
             dp);
    return text;
}

/* The kind that a handle has without the edit. */
static const char *edit_kind_now(const struct studio_plan *plan,
                                 const struct move_edit *edit, bool left)
{
    const int index = job_axis_index(&plan->job, edit->axis);
    const struct plan_axis *axis =
        index < 0 ? NULL : &plan->job.move.axis[index];

    if (axis == NULL || axis->bezier.key == NULL ||
        edit->key >= axis->key_count)
        return move_handle_word[MOTION_FCURVE_CLAMPED];
    const struct plan_bezier_key *key = &axis->bezier.key[edit->key];
    return move_handle_word[left ? key->left.kind : key->right.kind];
}

static bool edit_is_placed(const char *kind)
{
    return strcmp(kind, move_handle_word[MOTION_FCURVE_FREE]) == 0 ||
           strcmp(kind, move_handle_word[MOTION_FCURVE_ALIGNED]) == 0;
}

/* Both kinds in one field; a handle that is computed has no place. */
static void edit_handles(struct edit_reader *reader,
                         const struct studio_plan *plan, const cJSON *operation,
                         struct move_edit *edit)
{
    static const char *const names[] = { "left", "right" };
    const char *kind[2];
    bool any = false;

    for (unsigned i = 0; i < 2; i++) {
        const cJSON *side =
            cJSON_GetObjectItemCaseSensitive(operation, names[i]);
        const cJSON *word = cJSON_GetObjectItemCaseSensitive(side, "kind");
        kind[i] = cJSON_IsString(word) ? word->valuestring
                                       : edit_kind_now(plan, edit, i == 0);
        any = any || side != NULL;
        if (side == NULL)
            continue;
        if (!edit_is_placed(kind[i]))
            edit_put(edit, names[i], NULL);
        else if (cJSON_HasObjectItem(side, "dt"))
            edit_put(edit, names[i], edit_pair(reader, side));
    }
    if (!any)
        return;
    const size_t size = strlen(kind[0]) + strlen(kind[1]) + 8;
    char *text = memory_pool_new(&reader->pool, 1, size);
    if (strcmp(kind[0], kind[1]) == 0)
        snprintf(text, size, "%s", kind[0]);
    else
        snprintf(text, size, "[%s, %s]", kind[0], kind[1]);
    edit_put(edit, "handles", text);
}

static void edit_fields(struct edit_reader *reader, const cJSON *operation,
                        struct move_edit *edit)
{
    static const char *const names[] = {
        "t", "p", "v", "a", "curve", "interpolation", "easing", "fixed",
    };

    for (unsigned i = 0; i < ARRAY_LEN(names); i++) {
        const cJSON *value =
            cJSON_GetObjectItemCaseSensitive(operation, names[i]);
        if (value == NULL)
            continue;
        edit_put(edit, names[i],
                 cJSON_IsNull(value) ? NULL : edit_text(reader, value));
        if (i == 0)
            edit->t_s = cJSON_IsNumber(value) ? value->valuedouble : NAN;
    }
}

static void edit_path(struct edit_reader *reader, const cJSON *operation,
                      struct move_edit *edit)
{
    const cJSON *path = cJSON_GetObjectItemCaseSensitive(operation, "path");
    const cJSON *value = cJSON_GetObjectItemCaseSensitive(operation, "value");
    const cJSON *item;

    edit->kind = MOVE_EDIT_SET;
    cJSON_ArrayForEach(item, path)
    {
        if (edit->paths == MOVE_EDIT_PATH) {
            reader->wrong = "a path has more than 8 names";
            return;
        }
        edit->path[edit->paths++] = edit_text(reader, item);
    }
    edit_put(edit, "value",
             value == NULL || cJSON_IsNull(value) ? NULL
                                                  : edit_text(reader, value));
    edit->unit = cJSON_GetStringValue(
        cJSON_GetObjectItemCaseSensitive(operation, "unit"));
}

/* What is no axis, but called as curves beside them are. */
static void edit_other(const struct studio_plan *plan, struct move_edit *edit)
{
    struct studio_other other;

    if (job_axis_index(&plan->job, edit->axis) >= 0 ||
        !studio_other_named(plan, edit->axis, &other))
        return;
    edit->curve = other.curve;
    edit->unit = other.unit;
    edit->paths = other.paths;
    memcpy(edit->path, other.path, sizeof other.path);
}

static bool edit_is(const cJSON *operation, const char *name)
{
    const cJSON *op = cJSON_GetObjectItemCaseSensitive(operation, "op");

    return cJSON_IsString(op) && strcmp(op->valuestring, name) == 0;
}

static void edit_operation(struct edit_reader *reader,
                           const struct studio_plan *plan,
                           const cJSON *operation, struct move_edit *edit)
{
    const cJSON *axis = cJSON_GetObjectItemCaseSensitive(operation, "axis");
    const cJSON *key = cJSON_GetObjectItemCaseSensitive(operation, "key");

    *edit = (struct move_edit){ .t_s = NAN };
    if (edit_is(operation, "set")) {
        edit_path(reader, operation, edit);
        return;
    }
    if (!cJSON_IsString(axis)) {
        reader->wrong = "an operation names no axis";
        return;
    }
    edit->axis = axis->valuestring;
    edit_other(plan, edit);
    if (edit_is(operation, "curve")) {
        edit->kind = MOVE_EDIT_SET;
        if (edit->curve == NULL) {
            edit->path[0] = "axes";
            edit->path[1] = edit->axis;
            edit->paths = 2;
        }
        edit->path[edit->paths++] = "curve";
        edit_put(edit, "value",
                 edit_text(reader, cJSON_GetObjectItemCaseSensitive(operation,
                                                                    "curve")));
        return;
    }
    if (edit_is(operation, "add")) {
        edit->kind = MOVE_EDIT_ADD;
        edit->key = UINT32_MAX; /* none: its handles are not those of a key */
        edit_fields(reader, operation, edit);
        edit_handles(reader, plan, operation, edit);
        if (isnan(edit->t_s))
            reader->wrong = "a new key needs a time in s";
        return;
    }
    if (!cJSON_IsNumber(key) || !(key->valuedouble >= 0) ||
        key->valuedouble > PLAN_KEYS_MAX ||
        (!edit_is(operation, "key") && !edit_is(operation, "remove"))) {
        reader->wrong = "an operation is none of key, add, remove, curve, set, "
                        "or has no key";
        return;
    }
    edit->key = (uint32_t)key->valuedouble;
    edit->kind = edit_is(operation, "key") ? MOVE_EDIT_KEY : MOVE_EDIT_REMOVE;
    if (edit->kind == MOVE_EDIT_KEY) {
        edit_fields(reader, operation, edit);
        edit_handles(reader, plan, operation, edit);
    }
}

/* --- answers ----------------------------------------------------------------- */

static const char *edit_answer(struct studio_plan *plan, cJSON *answer)
{
    cJSON_free(plan->answer);
    plan->answer = cJSON_PrintUnformatted(answer);
    cJSON_Delete(answer);
    if (plan->answer == NULL)
        memory_fail();
    return plan->answer;
}

static cJSON *edit_refusal(const char *why)
{
    cJSON *answer = cJSON_CreateObject();

    cJSON_AddBoolToObject(answer, "ok", false);
    cJSON_AddStringToObject(answer, "error", why);
    return answer;
}

static void edit_add(cJSON *list, size_t from, size_t to, const char *insert)
{
    cJSON *item = cJSON_CreateObject();

    cJSON_AddNumberToObject(item, "from", (double)from);
    cJSON_AddNumberToObject(item, "to", (double)to);
    cJSON_AddStringToObject(item, "insert", insert);
    cJSON_AddItemToArray(list, item);
}

/* UTF-8 is not cut in a character. */
static size_t edit_whole(const char *text, size_t at)
{
    while (at > 0 && ((unsigned char)text[at] >> 6) == 2)
        at--;
    return at;
}

/* All that differs as one edit. */
static void edit_add_difference(cJSON *list, const char *was, size_t length,
                                const struct move_text *text)
{
    size_t from = 0, end = 0;

    while (from < length && from < text->length &&
           was[from] == text->data[from])
        from++;
    from = edit_whole(was, from);
    while (end < length - from && end < text->length - from &&
           was[length - 1 - end] == text->data[text->length - 1 - end])
        end++;
    while (end > 0 && ((unsigned char)was[length - end] >> 6) == 2)
        end--;
    char *insert = memory_new(text->length - from - end + 1, 1);
    memcpy(insert, text->data + from, text->length - from - end);
    edit_add(list, from, length - end, insert);
    memory_free(insert);
}

static cJSON *edit_made(const struct studio_plan *plan,
                        const struct move_text *text)
{
    cJSON *answer = cJSON_CreateObject();
    size_t length = 0;
    const char *was = store_look(&plan->files, plan->job.move_path, &length);

    cJSON_AddBoolToObject(answer, "ok", true);
    cJSON *list = cJSON_AddArrayToObject(answer, "edits");
    if (text->moved)
        edit_add_difference(list, was, length, text);
    for (uint32_t i = 0; !text->moved && i < text->changed; i++)
        edit_add(list, text->edit[i].at,
                 text->edit[i].at + text->edit[i].length, text->edit[i].is);
    return answer;
}

/* --- what is asked for ------------------------------------------------------- */

/* Once: all drags of a page edit one plan. */
static int edit_read(struct studio_plan *plan, char *message)
{
    const struct yaml_report report = { plan->job.move_path, message,
                                        YAML_MESSAGE_MAX };

    if (!plan->is_text_read &&
        yaml_text_open(&plan->text, &plan->files.files, &report) < 0) {
        yaml_text_close(&plan->text);
        return -1;
    }
    plan->is_text_read = true;
    return 0;
}

static cJSON *edit_apply(struct studio_plan *plan, const cJSON *list,
                         struct edit_reader *reader)
{
    const int count = cJSON_GetArraySize(list);
    struct move_edit *edit = memory_new((size_t)count + 1, sizeof *edit);
    char message[YAML_MESSAGE_MAX] = "";
    const struct move_text_source source = {
        .files = &plan->files.files,
        .path = plan->job.move_path,
        .rig = &plan->job.rig,
        .was = &plan->job.move,
        .message = message,
        .text = &plan->text,
    };
    struct move_text text = { .data = NULL };
    const cJSON *operation;
    cJSON *answer;
    int i = 0;

    cJSON_ArrayForEach(operation, list)
    {
        edit_operation(reader, plan, operation, &edit[i++]);
    }
    if (reader->wrong != NULL)
        answer = edit_refusal(reader->wrong);
    else if (edit_read(plan, message) < 0 ||
             move_edit_apply(&source, edit, (uint32_t)count, &text) < 0)
        answer = edit_refusal(message);
    else
        answer = edit_made(plan, &text);
    move_text_free(&text);
    memory_free(edit);
    return answer;
}

STUDIO_EXPORT const char *studio_plan_edit(struct studio_plan *plan,
                                           const char *operations)
{
    struct edit_reader reader = { .wrong = NULL };
    cJSON *list = cJSON_Parse(operations);
    cJSON *answer;

    if (plan->status != STATUS_OK)
        answer = edit_refusal("the move has to be readable first");
    else if (!cJSON_IsArray(list) ||
             cJSON_GetArraySize(list) > EDIT_OPERATIONS_MAX)
        answer = edit_refusal("no list of at most 100,000 operations");
    else
        answer = edit_apply(plan, list, &reader);
    cJSON_Delete(list);
    memory_pool_free(&reader.pool);
    return edit_answer(plan, answer);
}

/* The last error of the job, which repair has left there. */
static cJSON *edit_job_refusal(const struct job *job)
{
    enum message_kind kind;
    const char *text, *last = "the move cannot be brought inside its limits";

    for (size_t at = 0;
         (text = messages_next(&job->messages, &at, &kind)) != NULL;)
        if (kind == MESSAGE_ERROR)
            last = text;
    return edit_refusal(last);
}

STUDIO_EXPORT const char *studio_plan_fit(struct studio_plan *plan,
                                          const char *method,
                                          const char *tolerance)
{
    struct repair repair = { .before = &plan->job };
    unsigned which = 0;
    enum status status;
    cJSON *answer;

    while (which < REPAIR_METHODS && strcmp(method, repair_words[which]) != 0)
        which++;
    if (plan->status != STATUS_OK)
        return edit_answer(plan,
                           edit_refusal("the move has to be readable first"));
    if (which == REPAIR_METHODS)
        return edit_answer(
            plan, edit_refusal("no such method, expected stretch, local, "
                               "smooth or speed"));
    repair.method = (enum repair_method)which;
    status = repair_tolerance(&repair, tolerance[0] == 0 ? NULL : tolerance);
    if (status == STATUS_OK)
        status = repair_solve(&repair, &plan->files.files);
    answer = status == STATUS_OK ? edit_made(plan, &repair.text)
                                 : edit_job_refusal(&plan->job);
    repair_free(&repair);
    return edit_answer(plan, answer);
}
