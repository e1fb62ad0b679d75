/* tests/firmware/studio/test_again.c - a move that is planned again after an
 * edit: what is taken over changes no bit (motion/plan/plan_memo.h, job.h). */
#include <stdio.h>
#include <string.h>

#include "firmware/studio/wasm/plan.h"
#include "motion/core/clock_warp.h"
#include "tests/support/check.h"

#define KEYS   12
#define ROUNDS 40
#define MOST   160 /* keys */

static const char rig[] =
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n"
    "  x:\n"
    "    unit: mm\n"
    "    limits: {position: [-900, 900], velocity: 100, acceleration: 500}\n"
    "    following_error: {floor: 1 mm, time: 20 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 1, counts: 100 per mm}\n"
    "  y:\n"
    "    unit: mm\n"
    "    limits: {position: [-900, 900], velocity: 100, acceleration: 500}\n"
    "    following_error: {floor: 1 mm, time: 20 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 2, counts: 100 per mm}\n";

struct key {
    uint32_t t_ms, kind;
    int p, dp;
};

/* How an axis of a curve begins, and what a key of it has beside its point; 0: a
 * bezier axis, whose keys have handles. */
static const struct {
    const char *curve, *velocity;
} curves[] = {
    { "bezier", "" },
    { "linear", "" },
    { "rounded\n    blend: 0.2 s", "" },
    { "smoothed\n    blend: 0.2 s", "" },
    { "parabolic", "" },
    { "sine\n    ease: [0.3, 0.7]", "" },
    { "s-curve", "" },
    { "hermite", ", v: 3" },
    { "catmull-rom", "" },
    { "cardinal\n    mu: 0.8", "" },
    { "kochanek-bartels\n    tcb: [0.2, 0, 0.1]", "" },
    { "monotone", "" },
    { "akima", "" },
    { "akima-monotone", "" },
    { "c2", "" },
    { "quintic", "" },
    { "c4", "" },
    { "constraints", "" },
    { "b-spline", "" },
    { "lagrange", "" },
};
#define CURVES (sizeof curves / sizeof curves[0])

struct sketch {
    struct key key[MOST];
    unsigned count, curve;
    bool mixed, warped;
};

static struct key any_key(uint32_t t_ms)
{
    return (struct key){ t_ms, draw_below(4), (int)draw_below(800) - 400,
                         (int)draw_below(100) - 50 };
}

static void sketch_new(struct sketch *sketch, unsigned curve, unsigned count)
{
    *sketch = (struct sketch){ .count = count,
                               .curve = curve,
                               .mixed = curve == 0 && draw_below(2) != 0 };
    for (unsigned i = 0; i < count; i++)
        sketch->key[i] = any_key(i * 1000 + draw_below(500));
}

/* A key moves, comes, goes; or something else changes. */
static void sketch_change(struct sketch *sketch)
{
    const unsigned at = 1 + draw_below(sketch->count - 2);
    struct key *key = &sketch->key[at];

    switch (draw_below(6)) {
    case 0:
        if (key->t_ms < key[-1].t_ms + 2)
            break;
        memmove(key + 1, key, (sketch->count - at) * sizeof *key);
        *key = any_key((key[-1].t_ms + key[1].t_ms) / 2);
        sketch->count++;
        break;
    case 1:
        if (sketch->count <= 4)
            break;
        memmove(key, key + 1, (sketch->count - at - 1) * sizeof *key);
        sketch->count--;
        break;
    case 2:
        key->kind = draw_below(4);
        break;
    case 3:
        sketch->warped = !sketch->warped;
        break;
    default:
        key->p = (int)draw_below(800) - 400;
    }
}

static void sketch_text(const struct sketch *sketch, char *text, size_t size)
{
    static const char *const kinds[] = { "auto", "vector", "aligned",
                                         "auto-clamped" };
    size_t n = (size_t)snprintf(
        text, size,
        "%saxes:\n  y: {curve: c2, keys: [[0, 0], [3, 9], [9, 0]]}\n"
        "  x:\n    curve: %s\n    keys:\n",
        sketch->warped ? "warp: {keys: [[0 s, 0 s], [20 s, 15 s]]}\n" : "",
        curves[sketch->curve].curve);

    for (unsigned i = 0; i < sketch->count; i++) {
        const struct key *key = &sketch->key[i];
        n += (size_t)snprintf(text + n, size - n, "      - {t: %u.%03u, p: %d",
                              key->t_ms / 1000, key->t_ms % 1000, key->p);
        if (sketch->curve != 0)
            n += (size_t)snprintf(text + n, size - n, "%s}\n",
                                  curves[sketch->curve].velocity);
        else if (sketch->mixed && i == 5)
            n += (size_t)snprintf(text + n, size - n, ", curve: s-curve}\n");
        else if (key->kind == 2)
            n += (size_t)snprintf(text + n, size - n,
                                  ", handles: aligned, left: [-0.1, %d], "
                                  "right: [0.2, %d]}\n",
                                  -key->dp, 2 * key->dp);
        else
            n += (size_t)snprintf(text + n, size - n, ", handles: %s}\n",
                                  kinds[key->kind]);
    }
}

/* As the page has it: one store, in which only the text of the move changes. */
static struct store store;

static struct studio_plan *planned(const char *text,
                                   const struct studio_plan *former)
{
    if (store.count == 0)
        store_put(&store, "rig.yaml", rig, strlen(rig));
    store_put(&store, "move.yaml", text, strlen(text));
    return studio_plan_new(&store, "rig.yaml", "move.yaml", former);
}

static struct studio_plan *planned_sketch(const struct sketch *sketch,
                                          const struct studio_plan *former)
{
    static char text[16384];
    sketch_text(sketch, text, sizeof text);
    return planned(text, former);
}

static void same(const char *text, const struct studio_plan *again)
{
    static struct job job;
    struct store fresh = { .count = 0 }, files;

    store_put(&fresh, "rig.yaml", rig, strlen(rig));
    store_put(&fresh, "move.yaml", text, strlen(text));
    store_snapshot(&fresh, &files);
    const enum status status =
        job_open(&job, &files.files, "rig.yaml", "move.yaml", false, NULL);
    assert_int_equal(status, again->status);
    if (status == STATUS_OK)
        job_check(&job, MOTION_CLOCK_WARP_ONE_Q30);
    assert_int_equal(job.violation_count, again->job.violation_count);
    for (uint32_t i = 0; i < job.violation_count; i++)
        if (job.violation[i].value != again->job.violation[i].value ||
            job.violation[i].t_ns_q12 != again->job.violation[i].t_ns_q12 ||
            job.violation[i].kind != again->job.violation[i].kind)
            fail_msg("violation %u differs after\n%s", i, text);
    for (unsigned i = 0; i < job.planned; i++) {
        const struct motion_track *a = &job.track[i], *b = &again->job.track[i];
        assert_int_equal(a->count, b->count);
        assert_int_equal(a->end.pos_q32, b->end.pos_q32);
        assert_int_equal(a->end_frac, b->end_frac);
        for (uint32_t k = 0; k < a->count; k++)
            if (a->segment[k].start_ns_q12 != b->segment[k].start_ns_q12 ||
                a->segment[k].pos_q32 != b->segment[k].pos_q32 ||
                a->segment[k].remainder != b->segment[k].remainder ||
                memcmp(a->segment[k].coef, b->segment[k].coef,
                       sizeof a->segment[k].coef) != 0)
                fail_msg("segment %u differs after\n%s", k, text);
    }
    job_free(&job);
    store_free(&files);
    store_free(&fresh);
}

#define COLUMNS 300

/* What is not between the two times of studio_plan_changed was sampled before. */
static void same_samples(const char *text, const struct studio_plan *before,
                         const struct studio_plan *now)
{
    static double was[COLUMNS * STUDIO_COLUMN], is[COLUMNS * STUDIO_COLUMN];
    const double from = -1, to = 21, part = (to - from) / COLUMNS;
    double changed[2];

    for (uint32_t axis = 0; axis < now->job.planned; axis++) {
        if (!studio_plan_changed(now, before, axis, changed))
            return;
        studio_plan_samples(before, axis, from, to, COLUMNS, 0, COLUMNS, was);
        studio_plan_samples(now, axis, from, to, COLUMNS, 0, COLUMNS, is);
        for (uint32_t i = 0; i < COLUMNS * STUDIO_COLUMN; i++) {
            const uint32_t column = i / STUDIO_COLUMN;
            if ((from + part * (column + 1) < changed[0] - 1e-6 ||
                 from + part * column > changed[1] + 1e-6) &&
                was[i] != is[i])
                fail_msg("column %u of axis %u, not in %.9g .. %.9g s, is "
                         "another after\n%s",
                         column, axis, changed[0], changed[1], text);
        }
    }
}

/* Planned with what is left of `former`, or NULL: it is that of a fresh plan. */
static struct studio_plan *planned_again(const struct sketch *sketch,
                                         const struct studio_plan *former)
{
    static char text[16384];
    sketch_text(sketch, text, sizeof text);
    struct studio_plan *plan = planned(text, former);
    same(text, plan);
    if (former != NULL)
        same_samples(text, former, plan);
    return plan;
}

static void random_edits_leave_the_bits_of_a_fresh_plan(void **state)
{
    static struct sketch sketch;
    uint32_t reused = 0, spans = 0;

    (void)state;
    seed_from("random edits");
    for (unsigned move = 0; move < 4; move++) {
        struct studio_plan *plan = NULL;
        sketch_new(&sketch, 0, KEYS);
        for (unsigned i = 0; i < ROUNDS / 4; i++) {
            struct studio_plan *next = planned_again(&sketch, plan);
            if (plan != NULL && next->status == STATUS_OK) {
                reused += next->job.memo->reused;
                spans += next->job.memo->planned;
            }
            studio_plan_delete(plan);
            plan = next;
            sketch_change(&sketch);
        }
        studio_plan_delete(plan);
    }
    if (2 * reused < spans)
        fail_msg("%u of %u spans were taken over", reused, spans);
}

static void a_key_that_moves_costs_the_spans_beside_it(void **state)
{
    static struct sketch sketch;

    (void)state;
    sketch_new(&sketch, 0, KEYS);
    sketch.mixed = false;
    for (unsigned i = 0; i < KEYS; i++) {
        sketch.key[i].kind = 3;
        sketch.key[i].p = i == 0 ? -400 : i == 1 ? 400 : (int)i;
    }
    struct studio_plan *plan = planned_sketch(&sketch, NULL);
    assert_int_equal(plan->job.memo->reused, 0);
    sketch.key[7].p = 99;
    struct studio_plan *next = planned_sketch(&sketch, plan);
    /* Of y two, of x those between its keys and one before the first.  The
     * handles of both neighbours turn, too. */
    assert_int_equal(next->job.memo->planned, 2 + KEYS - 1 + 1);
    assert_int_equal(next->job.memo->reused, 2 + KEYS - 4);
    studio_plan_delete(next);
    studio_plan_delete(plan);
}

/* Spans are baked to a part of the range, which a key at its end makes larger. */
static void a_key_that_is_the_highest_costs_no_more(void **state)
{
    static struct sketch sketch;

    (void)state;
    sketch_new(&sketch, 0, KEYS);
    sketch.mixed = false;
    for (unsigned i = 0; i < KEYS; i++) {
        sketch.key[i].kind = 3;
        sketch.key[i].p = i == 6 ? 300 : (int)(i * 7 % 40);
    }
    struct studio_plan *plan = planned_sketch(&sketch, NULL);
    sketch.key[6].p = 310;
    struct studio_plan *next = planned_again(&sketch, plan);
    assert_int_equal(next->job.memo->reused, 2 + KEYS - 2);
    studio_plan_delete(next);
    studio_plan_delete(plan);
}

/* What is known of segments stands in blocks, one of every edit, until there are too
 * many. */
static void a_hundred_edits_leave_the_bits_of_a_fresh_plan(void **state)
{
    static char text[16384];
    static struct sketch sketch;
    struct studio_plan *plan = NULL;
    uint16_t most = 0;

    (void)state;
    sketch_new(&sketch, 15, 120); /* quintic */
    for (unsigned i = 0; i < 100; i++) {
        sketch_text(&sketch, text, sizeof text);
        struct studio_plan *next = planned(text, plan);
        assert_int_equal(next->status, STATUS_OK);
        same(text, next);
        if (next->job.facts[1].blocks > most)
            most = next->job.facts[1].blocks;
        studio_plan_delete(plan);
        plan = next;
        sketch.key[1 + i].p += 50;
    }
    assert_in_range(most, 30, 64);
    assert_true(plan->job.facts[1].blocks < most);
    studio_plan_delete(plan);
}

/* Where a key leaves a straight line, the velocity steps at its neighbours too: at
 * the border of a span that did not change itself. */
static void a_border_is_judged_with_the_span_before_it(void **state)
{
    static char text[16384];
    static struct sketch sketch;

    (void)state;
    sketch_new(&sketch, 1, KEYS); /* linear */
    for (unsigned i = 0; i < KEYS; i++)
        sketch.key[i].p = 0;
    sketch_text(&sketch, text, sizeof text);
    struct studio_plan *plan = planned(text, NULL);
    const uint32_t before = plan->job.violation_count; /* of the other axis */
    sketch.key[6].p = 20;
    sketch_text(&sketch, text, sizeof text);
    struct studio_plan *next = planned(text, plan);
    same(text, next);
    assert_int_equal(next->job.violation_count, before + 3);
    studio_plan_delete(next);
    studio_plan_delete(plan);
}

/* Of every kind: random edits of a move, one after the other. */
static void every_curve_is_planned_again_to_the_bit(void **state)
{
    static struct sketch sketch;

    (void)state;
    for (unsigned curve = 1; curve < CURVES; curve++) {
        struct studio_plan *plan = NULL;
        unsigned planned_well = 0;
        sketch_new(&sketch, curve, KEYS);
        for (unsigned i = 0; i < 6; i++) {
            struct studio_plan *next = planned_again(&sketch, plan);
            planned_well += next->status == STATUS_OK;
            studio_plan_delete(plan);
            plan = next;
            sketch_change(&sketch);
        }
        studio_plan_delete(plan);
        if (planned_well == 0)
            fail_msg("no move of %s could be planned", curves[curve].curve);
    }
}

static void a_key_in_the_middle_changes_what_is_beside_it(void **state)
{
    static struct sketch sketch;
    double changed[2];

    (void)state;
    sketch_new(&sketch, 15, KEYS); /* quintic */
    struct studio_plan *plan = planned_sketch(&sketch, NULL);
    struct studio_plan *same_again = planned_sketch(&sketch, plan);
    assert_true(studio_plan_changed(same_again, plan, 1, changed));
    assert_true(changed[0] > changed[1]);
    sketch.key[6].p += 7;
    struct studio_plan *next = planned_sketch(&sketch, plan);
    assert_true(studio_plan_changed(next, plan, 0, changed));
    assert_true(changed[0] > changed[1]); /* y is as it was */
    assert_true(studio_plan_changed(next, plan, 1, changed));
    assert_true(changed[0] > sketch.key[2].t_ms / 1000.0);
    assert_true(changed[1] < sketch.key[10].t_ms / 1000.0);
    studio_plan_delete(next);
    studio_plan_delete(same_again);
    studio_plan_delete(plan);
}

/* The rig is read once, until one of its files is another. */
static void a_rig_is_read_again_once_it_changed(void **state)
{
    static const char text[] =
        "axes: {x: {curve: s-curve, keys: [[0, 0], [9, 99]]}}\n";
    static char slower[sizeof rig];

    (void)state;
    struct studio_plan *plan = planned(text, NULL);
    struct studio_plan *next = planned(text, plan);
    assert_ptr_equal(next->rig, plan->rig);
    studio_plan_delete(plan);
    assert_int_equal(next->job.rig.axis[0].limit.vel_q32, INT64_C(100) << 32);
    memcpy(slower, rig, sizeof rig);
    strstr(slower, "velocity: 1")[10] = '2';
    store_put(&store, "rig.yaml", slower, strlen(slower));
    struct studio_plan *other = planned(text, next);
    assert_ptr_not_equal(other->rig, next->rig);
    assert_int_equal(other->job.rig.axis[0].limit.vel_q32, INT64_C(200) << 32);
    store_put(&store, "rig.yaml", rig, strlen(rig));
    studio_plan_delete(other);
    studio_plan_delete(next);
}

/* Every edit of a plan is one of its text as it was, whatever was asked before. */
static void a_plan_is_edited_again_and_again(void **state)
{
    static const char text[] =
        "axes: {x: {curve: s-curve, keys: [[0, 0], [9, 99]]}}\n";
    static const char seven[] =
        "[{\"op\":\"key\",\"axis\":\"x\",\"key\":1,\"p\":7}]";
    char first[512];

    (void)state;
    struct studio_plan *plan = planned(text, NULL);
    snprintf(first, sizeof first, "%s", studio_plan_edit(plan, seven));
    assert_non_null(strstr(first, "\"insert\":\"7\""));
    assert_non_null(strstr(
        studio_plan_edit(
            plan, "[{\"op\":\"key\",\"axis\":\"x\",\"key\":1,\"t\":1e99}]"),
        "\"ok\":false"));
    assert_string_equal(studio_plan_edit(plan, seven), first);
    studio_plan_delete(plan);
}

/* How many spans of `count` are taken over once a key in the middle moves. */
static unsigned left_alone(unsigned curve, unsigned count)
{
    static struct sketch sketch;

    sketch_new(&sketch, curve, count);
    struct studio_plan *plan = planned_sketch(&sketch, NULL);
    assert_int_equal(plan->status, STATUS_OK);
    sketch.key[count / 2].p += 7;
    struct studio_plan *next = planned_sketch(&sketch, plan);
    const unsigned reused = next->job.memo->reused - 2; /* of y */
    studio_plan_delete(next);
    studio_plan_delete(plan);
    return reused;
}

/* Two spans at least depend on a key, and seven at most. */
static void a_key_of_most_curves_costs_seven_spans_at_most(void **state)
{
    (void)state;
    for (unsigned curve = 1; curve < CURVES; curve++) {
        const char *name = curves[curve].curve;
        const bool by_run = strncmp(name, "rounded", 7) == 0 ||
                            strncmp(name, "smoothed", 8) == 0 ||
                            strncmp(name, "kochanek", 8) == 0 ||
                            strcmp(name, "b-spline") == 0 ||
                            strcmp(name, "lagrange") == 0;
        const bool by_all = strcmp(name, "c2") == 0 || strcmp(name, "c4") == 0;
        if (by_run)
            assert_int_equal(left_alone(curve, KEYS), 0);
        else if (by_all)
            assert_in_range(left_alone(curve, MOST), 20, MOST - 3);
        else
            assert_in_range(left_alone(curve, KEYS), KEYS - 1 - 7,
                            KEYS - 1 - 2);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_edits_leave_the_bits_of_a_fresh_plan),
        cmocka_unit_test(a_key_that_moves_costs_the_spans_beside_it),
        cmocka_unit_test(a_key_that_is_the_highest_costs_no_more),
        cmocka_unit_test(a_border_is_judged_with_the_span_before_it),
        cmocka_unit_test(every_curve_is_planned_again_to_the_bit),
        cmocka_unit_test(a_hundred_edits_leave_the_bits_of_a_fresh_plan),
        cmocka_unit_test(a_key_in_the_middle_changes_what_is_beside_it),
        cmocka_unit_test(a_rig_is_read_again_once_it_changed),
        cmocka_unit_test(a_plan_is_edited_again_and_again),
        cmocka_unit_test(a_key_of_most_curves_costs_seven_spans_at_most),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
