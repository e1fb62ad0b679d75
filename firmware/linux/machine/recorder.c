/* firmware/linux/machine/recorder.c - see recorder.h. */
#include "firmware/linux/machine/recorder.h"

void recorder_init(struct recorder *recorder)
{
    atomic_init(&recorder->put, 0);
    atomic_init(&recorder->taken, 0);
    recorder->dropped = 0;
}

uint64_t recorder_waiting(const struct recorder *recorder)
{
    /* `taken` first: it never passes the `put` read after it. */
    uint64_t taken =
        atomic_load_explicit(&recorder->taken, memory_order_acquire);
    return atomic_load_explicit(&recorder->put, memory_order_acquire) - taken;
}

/* Release after writing a row, acquire before reading it: the reader sees whole
 * rows, and the writer reuses a slot only after it was read. */
bool recorder_put(struct recorder *recorder, const struct telemetry_row *row)
{
    uint64_t put = atomic_load_explicit(&recorder->put, memory_order_relaxed);
    if (recorder_waiting(recorder) == RECORDER_ROWS) {
        recorder->dropped++;
        return false;
    }
    recorder->row[put % RECORDER_ROWS] = *row;
    atomic_store_explicit(&recorder->put, put + 1, memory_order_release);
    return true;
}

void recorder_drain(struct recorder *recorder,
                    void (*take)(void *context, struct telemetry_row *row),
                    void *context)
{
    uint64_t put = atomic_load_explicit(&recorder->put, memory_order_acquire);
    uint64_t taken =
        atomic_load_explicit(&recorder->taken, memory_order_relaxed);
    for (; taken < put; taken++) {
        take(context, &recorder->row[taken % RECORDER_ROWS]);
        atomic_store_explicit(&recorder->taken, taken + 1,
                              memory_order_release);
    }
}
