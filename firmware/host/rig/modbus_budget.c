/* firmware/host/rig/modbus_budget.c - see modbus_budget.h. */
#include "firmware/host/rig/modbus_budget.h"

#include "firmware/host/rig/modbus_stream.h"

static bool budget_has_map(const struct rig_axis *axis)
{
    return rig_kinds[axis->kind]->has_map;
}

struct modbus_rtu_line modbus_budget_line(const struct rig *rig, unsigned bus)
{
    struct modbus_rtu_line line = rig->bus[bus].modbus.line;
    struct modbus_rtu_time time = { 0 };

    if (line.gap_ns == 0 && modbus_rtu_time_init(&time, &line) == MOTION_OK)
        line.gap_ns = time.gap_ns;
    if (rig->bus[bus].kind == RIG_MODBUS_TCP)
        return line;
    for (unsigned i = 0; i < rig->axis_count; i++) {
        const struct rig_axis *axis = &rig->axis[i];

        if (axis->bus == bus && budget_has_map(axis) &&
            rig->map[axis->map].line.gap_ns > line.gap_ns)
            line.gap_ns = rig->map[axis->map].line.gap_ns;
    }
    return line;
}

/* `streamed`: as if it were. */
static int64_t budget_share_ns(const struct rig *rig, unsigned axis,
                               bool streamed, unsigned *transactions)
{
    const struct modbus_rtu_line line =
        modbus_budget_line(rig, rig->axis[axis].bus);
    const int64_t rts_ns =
        2 * rig->bus[rig->axis[axis].bus].modbus.rts_delay_ns;
    struct modbus_rtu_time time = { 0 };

    *transactions = 0;
    if (modbus_rtu_time_init(&time, &line) < 0)
        return 0;
    const int64_t turn_ns = rig_kinds[rig->axis[axis].kind]->turn_ns(
        rig, axis, &time, streamed, transactions);
    return turn_ns + *transactions * rts_ns;
}

int64_t modbus_budget_share_ns(const struct rig *rig, unsigned axis,
                               unsigned *transactions)
{
    return budget_share_ns(rig, axis, false, transactions);
}

static int64_t budget_sum_ns(const struct rig *rig, unsigned bus, unsigned *n)
{
    int64_t sum_ns = 0;

    *n = 0;
    for (unsigned i = 0; i < rig->axis_count; i++) {
        unsigned own = 0;

        if (rig->axis[i].bus != bus)
            continue;
        sum_ns += modbus_budget_share_ns(rig, i, &own);
        *n += own;
    }
    return sum_ns;
}

int64_t modbus_budget_cycle_ns(const struct rig *rig, unsigned bus)
{
    unsigned n;

    return budget_sum_ns(rig, bus, &n);
}

/* The one under way, then its own. */
int64_t modbus_budget_latency_ns(const struct rig *rig, unsigned bus)
{
    unsigned n;
    const int64_t sum_ns = budget_sum_ns(rig, bus, &n);

    return n == 0 ? 0 : 3 * sum_ns / (2 * (int64_t)n);
}

int64_t modbus_budget_timeout_ns(const struct rig *rig, unsigned bus)
{
    int64_t longest_ns = rig->bus[bus].modbus.timeout_ns;

    for (unsigned i = 0; i < rig->axis_count && longest_ns == 0; i++) {
        const struct rig_axis *axis = &rig->axis[i];
        const int64_t own_ns =
            axis->bus == bus ? rig_kinds[axis->kind]->answer_ns(rig, i) : 0;

        if (own_ns > longest_ns)
            longest_ns = own_ns;
    }
    return longest_ns;
}

/* A failure costs its time-out and a silence of twice that. */
int64_t modbus_budget_age_ns(const struct rig *rig, unsigned bus)
{
    return 3 * modbus_budget_cycle_ns(rig, bus) +
           INT64_C(6) * modbus_budget_timeout_ns(rig, bus);
}

/* What axis i would have from set point to set point if it were streamed beside
 * the others; 0: its map cannot. */
static int64_t modbus_budget_streamed_ns(const struct rig *rig, unsigned axis)
{
    const unsigned bus = rig->axis[axis].bus;
    unsigned n;

    if (rig->map[rig->axis[axis].map].stream.count == 0)
        return 0;
    return modbus_budget_cycle_ns(rig, bus) -
           budget_share_ns(rig, axis, false, &n) +
           budget_share_ns(rig, axis, true, &n);
}

/* The goal waits for its turn, and that the axis stands is believed after two
 * whole cycles. */
#define BUDGET_SETTLE_CYCLES 4
#define BUDGET_SETTLE_NS     INT64_C(100000000)
int64_t modbus_budget_settle_ns(const struct rig *rig, unsigned axis)
{
    const int64_t given_ns = rig->axis[axis].settle_ns;

    return given_ns > 0
               ? given_ns
               : BUDGET_SETTLE_NS +
                     BUDGET_SETTLE_CYCLES *
                         modbus_budget_cycle_ns(rig, rig->axis[axis].bus);
}

static void budget_print_profile(const struct rig *rig, unsigned axis,
                                 double cycle_ms, FILE *file)
{
    const double streamed_ms =
        (double)modbus_budget_streamed_ns(rig, axis) / 1e6;

    fprintf(file,
            "  %s: between keys the path is its drive's own; a position every "
            "%.1f ms; ",
            rig->axis[axis].name, cycle_ms);
    if (streamed_ms > 0)
        fprintf(file,
                "streamed it would get a set point every %.1f ms (%.1f per "
                "s)\n",
                streamed_ms, 1e3 / streamed_ms);
    else
        fputs("its map cannot stream\n", file);
}

void modbus_budget_print(const struct rig *rig, unsigned bus, FILE *file)
{
    const double cycle_ms = (double)modbus_budget_cycle_ns(rig, bus) / 1e6;

    for (unsigned i = 0; i < rig->axis_count; i++) {
        if (rig->axis[i].bus != bus)
            continue;
        if (rig_kinds[rig->axis[i].kind]->samples) {
            fprintf(file,
                    "  %s: sampled by its board, unit %u; its place is known "
                    "every %.1f ms\n",
                    rig->axis[i].name, rig->axis[i].node_id, cycle_ms);
            continue;
        }
        if (rig->axis[i].point_to_point) {
            budget_print_profile(rig, i, cycle_ms, file);
            continue;
        }
        fprintf(file, "  %s: a set point every %.1f ms (%.1f per s)\n",
                rig->axis[i].name, cycle_ms, 1e3 / cycle_ms);
        modbus_stream_print(rig, i, file);
    }
}

bool modbus_budget_check(const struct rig *rig, const char *path,
                         struct messages *messages)
{
    bool fits = true;

    for (unsigned i = 0; i < rig->axis_count; i++)
        if (budget_has_map(&rig->axis[i]) && !rig->axis[i].point_to_point &&
            !modbus_stream_check(rig, i, path, messages))
            fits = false;
    return fits;
}
