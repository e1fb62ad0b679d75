/* firmware/linux/machine/guardian_watch.c - what the guardian and the tick tell of each
 * other, by the page that they share; see guardian.h. */
#include "firmware/linux/machine/guardian.h"

#define GUARDIAN_MOST_NS (2 * GUARDIAN_LOOK_NS) /* that a look counts for */

void guardian_watch_init(struct guardian_watch *watch, int64_t now_ns)
{
    *watch = (struct guardian_watch){ .look_ns = now_ns };
}

int64_t guardian_watch_still_ns(struct guardian_watch *watch, uint64_t count,
                                int64_t now_ns)
{
    int64_t passed_ns = now_ns - watch->look_ns;
    if (passed_ns > GUARDIAN_MOST_NS) /* we were not run either */
        passed_ns = GUARDIAN_MOST_NS;
    watch->still_ns = count == watch->count ? watch->still_ns + passed_ns : 0;
    watch->count = count;
    watch->look_ns = now_ns;
    return watch->still_ns;
}

bool guardian_sees_hang(struct guardian_watch *watch,
                        const struct guardian_page *page, int64_t period_ns,
                        int64_t now_ns)
{
    const uint64_t ticks = atomic_load(&page->ticks);
    const int end = atomic_load(&page->end);
    int64_t hung_ns = GUARDIAN_HUNG_TICKS * period_ns;
    if (hung_ns < GUARDIAN_HUNG_NS)
        hung_ns = GUARDIAN_HUNG_NS;
    if (end == GUARDIAN_LEFT)
        hung_ns = GUARDIAN_LEFT_NS;
    if (ticks == 0 || end == GUARDIAN_DONE)
        guardian_watch_init(watch, now_ns);
    return guardian_watch_still_ns(watch, ticks, now_ns) > hung_ns;
}

bool guardian_sight_step(struct guardian_sight *sight,
                         const struct guardian_page *page, int64_t now_ns)
{
    if (page == NULL)
        return false;
    if (!sight->is_begun)
        guardian_watch_init(&sight->watch, now_ns);
    sight->is_begun = true;
    const uint64_t looks =
        atomic_load_explicit(&page->looks, memory_order_relaxed);
    const uint32_t replaced =
        atomic_load_explicit(&page->lost, memory_order_relaxed);
    const bool is_gone = guardian_watch_still_ns(&sight->watch, looks, now_ns) >
                         GUARDIAN_GONE_NS;
    const bool is_lost =
        replaced != sight->replaced || (is_gone && !sight->is_gone);
    sight->is_gone = is_gone;
    sight->replaced = replaced;
    sight->lost += is_lost;
    return is_lost;
}
