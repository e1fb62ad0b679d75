/* firmware/host/job/compare.c - see compare.h. */
#include "firmware/host/job/compare.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/yaml/yaml_fields.h"
#include "motion/core/err.h"

const char *const compare_spelling[] = {
#define COMPARE_SPELLING(name, spelling, text) [name] = spelling,
    PLAN_CURVE_LIST(COMPARE_SPELLING)
#undef COMPARE_SPELLING
};
const unsigned compare_spellings = ARRAY_LEN(compare_spelling);

_Static_assert(ARRAY_LEN(compare_spelling) <= PLAN_AXES_MAX,
               "all curves fit one job");

static int compare_fail(struct job *job, const char *what, const char *which,
                        const char *expected)
{
    messages_add(&job->messages, MESSAGE_ERROR, "slew plot: %s%s%s", what,
                 which, expected);
    return -1;
}

/* --- which curves --- */

static int compare_find(const char *word, size_t length)
{
    for (unsigned i = 0; i < compare_spellings; i++)
        if (strlen(compare_spelling[i]) == length &&
            memcmp(compare_spelling[i], word, length) == 0)
            return (int)i;
    return -1;
}

static int compare_unknown(const char *option, const char *word, size_t length,
                           struct messages *messages)
{
    char text[PLAN_NAME_MAX], list[512] = "";
    snprintf(text, sizeof text, "%.*s", (int)(length < 31 ? length : 31), word);
    for (unsigned i = 0, used = 0; i < compare_spellings; i++)
        used += (unsigned)snprintf(list + used, sizeof list - used, "%s%s",
                                   i > 0 ? ", " : "", compare_spelling[i]);
    const char *near = yaml_nearest(text, compare_spelling, compare_spellings);
    messages_add(messages, MESSAGE_ERROR,
                 "%s: no curve '%s', expected %s%s%s%s", option, text, list,
                 near != NULL ? " (did you mean '" : "",
                 near != NULL ? near : "", near != NULL ? "'?)" : "");
    return -1;
}

static int compare_all(enum plan_curve **curve)
{
    *curve = memory_new(compare_spellings, sizeof **curve);
    for (unsigned i = 0; i < compare_spellings; i++)
        (*curve)[i] = (enum plan_curve)i;
    return (int)compare_spellings;
}

/* Into an array that has an entry for every comma and one more. */
static int compare_words(const char *option, const char *text,
                         enum plan_curve curve[], struct messages *messages)
{
    for (int count = 0;; text++) {
        size_t length = strcspn(text, ",");
        int found = compare_find(text, length);
        if (found < 0)
            return compare_unknown(option, text, length, messages);
        if (count == PLAN_AXES_MAX) {
            messages_add(messages, MESSAGE_ERROR,
                         "%s: too many curves, expected %u or fewer", option,
                         (unsigned)PLAN_AXES_MAX);
            return -1;
        }
        curve[count++] = (enum plan_curve)found;
        text += length;
        if (*text == 0)
            return count;
    }
}

int compare_parse(const char *option, const char *text, enum plan_curve **curve,
                  struct messages *messages)
{
    size_t most = 1;
    if (strcmp(text, "all") == 0)
        return compare_all(curve);
    for (const char *at = text; (at = strchr(at, ',')) != NULL; at++)
        most++;
    *curve = memory_new(most, sizeof **curve);
    const int count = compare_words(option, text, *curve, messages);
    if (count < 0) {
        memory_free(*curve);
        *curve = NULL;
    }
    return count;
}

/* --- planning --- */

/* What is left of the keys at each attempt: all, positions alone, and
 * velocities where there were none. */
enum compare_attempt { COMPARE_GIVEN, COMPARE_BARE, COMPARE_FILLED };

static void compare_prepare(struct plan_axis *axis,
                            enum compare_attempt attempt)
{
    for (uint32_t i = 0; i < axis->key_count; i++) {
        struct motion_key *key = &axis->key[i].key;
        axis->key[i].has_curve = axis->key[i].has_shape = false;
        if (attempt == COMPARE_GIVEN)
            continue;
        key->has_acc = false;
        key->acc = motion_real_zero();
        if (attempt == COMPARE_BARE)
            key->has_vel = false;
        if (!key->has_vel)
            key->vel = motion_real_zero();
        key->has_vel = attempt == COMPARE_FILLED;
    }
}

/* A copy of `size` bytes on the heap; NULL of nothing. */
static void *compare_duplicate(const void *from, size_t size)
{
    void *to = from != NULL && size > 0 ? malloc(size) : NULL;
    if (to == NULL && from != NULL && size > 0)
        memory_fail();
    return to != NULL ? memcpy(to, from, size) : NULL;
}

/* Handles and the like are of bezier alone.  Cycles go with every curve but
 * lagrange; those of bezier may end between two keys, which others cannot. */
static void compare_copy(struct plan_axis *to, const struct plan_axis *from,
                         enum plan_curve curve)
{
    *to = *from;
    to->curve = curve;
    to->profile = (struct plan_profile){ .vel_q32 = 0 };
    to->key = compare_duplicate(from->key, from->key_count * sizeof *from->key);
    to->bezier = (struct plan_bezier){ .key = NULL };
    if (curve != PLAN_CURVE_LAGRANGE && from->curve != PLAN_CURVE_BEZIER) {
        to->bezier.before = from->bezier.before;
        to->bezier.after = from->bezier.after;
        to->bezier.has_end = from->bezier.has_end;
        to->bezier.end_ns_q12 = from->bezier.end_ns_q12;
    }
    if (curve == PLAN_CURVE_BEZIER) {
        to->bezier = from->bezier;
        to->bezier.key = compare_duplicate(
            from->bezier.key, from->key_count * sizeof *from->bezier.key);
    }
    snprintf(to->name, sizeof to->name, "%s", compare_spelling[curve]);
}

int compare_plan(const struct plan_axis *axis, enum plan_curve curve,
                 struct plan_axis *planned, struct motion_track *track,
                 struct plan_error *error)
{
    int err = MOTION_E_EMPTY;
    *planned = (struct plan_axis){ .key = NULL };
    for (enum compare_attempt attempt = COMPARE_GIVEN;
         err < 0 && attempt <= COMPARE_FILLED && axis->key_count > 0;
         attempt++) {
        *error = (struct plan_error){ .code = MOTION_OK };
        plan_axis_free(planned);
        compare_copy(planned, axis, curve);
        compare_prepare(planned, attempt);
        err = plan_axis_track(planned, track, error);
        if (err != MOTION_E_ARG)
            break;
    }
    if (err < 0)
        plan_axis_free(planned);
    return err;
}

/* --- the job --- */

static int compare_axis(struct job *job, const char *name)
{
    int axis = 0;
    if (name != NULL)
        axis = job_axis_index(job, name);
    else if (job->move.axis_count != 1)
        return compare_fail(job, "--compare: which axis?", "",
                            " expected --axis NAME");
    if (axis < 0)
        return compare_fail(job, "the move has no axis \"", name,
                            "\", expected one of its axes");
    if (job->move.axis[axis].driver != PLAN_BY_KEYS)
        return compare_fail(job, "--compare: no keys drive the axis ",
                            job->move.axis[axis].name, "");
    return axis;
}

/* The job's move without its axes, with room for `count`; `from` keeps the one
 * that is compared, of that axis of the rig. */
static void compare_empty(struct job *job, int axis, uint32_t count,
                          struct plan_axis *from)
{
    const unsigned rig_axis = job->rig_axis[axis];
    *from = job->move.axis[axis];
    job->move.axis[axis] = (struct plan_axis){ .key = NULL };
    for (unsigned i = 0; i < job->planned; i++)
        plan_track_free(&job->track[i]);
    for (unsigned i = 0; i < job->move.axis_count; i++)
        plan_axis_free(&job->move.axis[i]);
    memory_free(job->move.axis);
    if (plan_move_reserve(&job->move, count) < 0)
        memory_fail();
    job_capacity(job, count);
    job->rig_axis[0] = rig_axis;
    plan_outcome_free(&job->outcome);
    job->move.axis_count = 0;
    job->planned = 0;
    job->end_ns_q12 = 0;
}

static enum status compare_add(struct job *job, const struct plan_axis *from,
                               enum plan_curve curve)
{
    unsigned i = job->move.axis_count;
    struct plan_error error = { .code = MOTION_OK };
    int err =
        compare_plan(from, curve, &job->move.axis[i], &job->track[i], &error);
    if (err < 0) {
        plan_progress_end(job->progress);
        messages_add(&job->messages, MESSAGE_ERROR, "%s:%u:%u: curve %s: %s",
                     job->move_path, error.place.line, error.place.column,
                     compare_spelling[curve],
                     error.text[0] != 0 ? error.text : motion_err_text(err));
        return STATUS_INPUT;
    }
    job->rig_axis[i] = job->rig_axis[0];
    job->move.axis_count++;
    job->planned++;
    if (job->track[i].end_ns_q12 > job->end_ns_q12)
        job->end_ns_q12 = job->track[i].end_ns_q12;
    return STATUS_OK;
}

enum status compare_job(struct job *job, const char *curves,
                        const char *axis_name)
{
    enum plan_curve *curve = NULL;
    struct plan_axis from;
    int count =
        compare_parse("slew plot: --compare", curves, &curve, &job->messages);
    int axis = count < 0 ? -1 : compare_axis(job, axis_name);
    if (axis < 0) {
        memory_free(curve);
        return STATUS_INPUT;
    }
    compare_empty(job, axis, (uint32_t)count, &from);
    job->compared = true;
    snprintf(job->move.title, sizeof job->move.title,
             "%s: the same %u keys, %d %s", from.name, from.key_count, count,
             number_word((uint64_t)count, "curve", "curves"));
    enum status status = STATUS_OK;
    for (int i = 0; i < count && status == STATUS_OK; i++) {
        plan_progress_tell(job->progress, "planning",
                           compare_spelling[curve[i]], i, count);
        status = compare_add(job, &from, curve[i]);
    }
    plan_progress_end(job->progress);
    plan_axis_free(&from);
    memory_free(curve);
    return status;
}

/* --- before and after --- */

struct compare_axis {
    struct plan_axis axis;
    struct motion_track track;
    unsigned rig_axis;
};

/* An axis as planned, out of a job that has none there then. */
static struct compare_axis compare_take(struct job *job, unsigned i,
                                        const char *when)
{
    struct compare_axis taken = { job->move.axis[i], job->track[i],
                                  job->rig_axis[i] };

    snprintf(taken.axis.name, sizeof taken.axis.name, "%.20s %s",
             job->move.axis[i].name, when);
    job->move.axis[i] = (struct plan_axis){ .key = NULL };
    job->track[i] = (struct motion_track){ .segment = NULL };
    return taken;
}

void compare_repaired(struct job *job, struct job *after)
{
    const unsigned axes = job->move.axis_count < PLAN_AXES_MAX / 2
                              ? job->move.axis_count
                              : PLAN_AXES_MAX / 2;
    const bool is_bent = job->outcome.is_bent || after->outcome.is_bent;
    struct compare_axis *pair = memory_new(2 * (size_t)axes, sizeof *pair);
    struct plan_axis none;

    for (size_t i = 0; i < axes; i++) {
        pair[2 * i] = compare_take(job, (unsigned)i, "before");
        pair[2 * i + 1] = compare_take(after, (unsigned)i, "after");
    }
    compare_empty(job, 0, 2 * axes, &none);
    job->outcome.is_bent = is_bent;
    job->compared = true;
    for (unsigned i = 0; i < 2 * axes; i++) {
        job->move.axis[i] = pair[i].axis;
        job->track[i] = pair[i].track;
        job->rig_axis[i] = pair[i].rig_axis;
        if (job->track[i].end_ns_q12 > job->end_ns_q12)
            job->end_ns_q12 = job->track[i].end_ns_q12;
    }
    job->move.axis_count = job->planned = 2 * axes;
    memory_free(pair);
}
