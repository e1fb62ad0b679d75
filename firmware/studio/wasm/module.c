/* firmware/studio/wasm/module.c - what the module has beside plan.h, for
 * planner.mjs alone. */
#include "firmware/host/base/memory.h"
#include "firmware/studio/wasm/plan.h"

#define MODULE(name) __attribute__((used, export_name(name)))

/* The page sees a trap, and that the planner is of no use any more. */
void memory_fail(void)
{
    __builtin_trap();
}

MODULE("alloc") void *module_alloc(uint32_t size)
{
    return memory_new(size > 0 ? size : 1, 1);
}

MODULE("release") void module_release(void *block)
{
    memory_free(block);
}

MODULE("store_new") struct store *module_store_new(void)
{
    return memory_new(1, sizeof(struct store));
}

MODULE("store_put")
int module_store_put(struct store *store, const char *name, const char *data,
                     uint32_t length)
{
    return store_put(store, name, data, length);
}

/* What kinds of violations there are: false after the last. */
MODULE("violation_kind")
bool module_violation_kind(uint32_t kind, const char *text[2], uint32_t *order)
{
    static const char *const words[] = { "position", "velocity", "acceleration",
                                         "jerk" };
    const enum job_violation_kind which = (enum job_violation_kind)kind;

    if (which > JOB_END_MOVING)
        return false;
    *order = job_violation_order(which);
    text[0] = which == JOB_ACC_STEP   ? "acceleration step"
              : which >= JOB_VEL_STEP ? "velocity step"
                                      : words[*order];
    text[1] = job_violation_text(which);
    return true;
}

/* Names of curves and of what bezier keys say, a line each. */
MODULE("curve_name") const char *module_curve_name(uint32_t curve)
{
    const struct plan_curve_rules *rules =
        plan_curve_rules((enum plan_curve)curve);

    return rules == NULL ? NULL : rules->name;
}
