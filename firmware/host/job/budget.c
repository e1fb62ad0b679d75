/* firmware/host/job/budget.c - see budget.h. */
#include "firmware/host/job/budget.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <string.h>

#include "firmware/host/base/number.h"
#include "firmware/host/rig/modbus_budget.h"
#include "hal/can/bits.h"
#include "motion/core/fixed.h"

/* Of a move that lasts longer, so many instants are looked at. */
#define BUDGET_SAMPLES 4000

#define BUDGET_SYNC      0x080u
#define BUDGET_TPDO1     0x180u
#define BUDGET_PDO3      0x200u /* further than PDO 1 */
#define BUDGET_RPDO1     0x200u
#define BUDGET_HEARTBEAT 0x700u

/* What a drive that follows its set points is told and says (CiA 402-2 8.4):
 * operation enabled, voltage, remote, follows the command value. */
#define BUDGET_CONTROLWORD 0x000Fu
#define BUDGET_STATUSWORD  0x1237u
#define BUDGET_OPERATIONAL 0x05u /* CiA 301 7.2.8.3.2.2 */

/* Longest base frame with `bytes` of data: 47 fixed bits, intermission
 * included, and a stuff bit for every four of the 34 + 8 n that are stuffed,
 * after the first. */
static unsigned budget_most_bits(unsigned bytes)
{
    return 47 + 8 * bytes + (34 + 8 * bytes - 1) / 4;
}

static unsigned budget_bits(uint32_t id, const uint8_t *data, unsigned bytes)
{
    struct hal_can_frame frame = { .id = id, .len = (uint8_t)bytes };
    memcpy(frame.data, data, bytes);
    return can_bits_of(&frame).slow;
}

static void budget_put(struct budget *budget, const struct budget_item *item)
{
    budget->item = memory_pool_more(&budget->memory, budget->item,
                                    budget->count, sizeof *budget->item);
    budget->item[budget->count++] = *item;
}

static void budget_add(struct budget *budget, const char *what,
                       const char *axis, int64_t period_ns, unsigned bytes,
                       double expected_bits)
{
    budget_put(budget, &(struct budget_item){
                           .what = what,
                           .axis = axis,
                           .period_ns = period_ns,
                           .most_bits = budget_most_bits(bytes),
                           .expected_bits = expected_bits,
                       });
}

/* --- the frames of a move --- */

/* Where an axis of the rig is at `t`: on its track, or where it stands. */
static struct motion_state budget_state(const struct job *job, unsigned axis,
                                        int64_t t)
{
    struct motion_state state = { .pos_q32 =
                                      job->rig.axis[axis].sim.start_q32 };
    for (unsigned i = 0; i < job->move.axis_count; i++)
        if (job->rig_axis[i] == axis)
            motion_track_state(&job->track[i], t, &state);
    return state;
}

static uint32_t budget_counts(const struct rig_axis *axis, int64_t pos_q32)
{
    int64_t counts = 0;
    if (axis->counts_den <= INT64_MAX >> 32)
        (void)motion_fixed_muldiv(pos_q32, axis->counts_num,
                                  axis->counts_den << 32, &counts);
    return (uint32_t)counts;
}

static unsigned budget_pdo_bits(uint32_t id, unsigned word, uint32_t counts,
                                unsigned bytes)
{
    const uint8_t data[8] = {
        (uint8_t)word,           (uint8_t)(word >> 8),
        (uint8_t)counts,         (uint8_t)(counts >> 8),
        (uint8_t)(counts >> 16), (uint8_t)(counts >> 24),
    };
    return budget_bits(id, data, bytes);
}

/* With torque, 2 more; taken for 0 where bits are expected. */
static unsigned budget_pdo_bytes(const struct rig_axis *axis)
{
    return axis->cia402.torque ? 8 : 6;
}

/* Mean bits of an axis's PDO over the move. */
static double budget_pdo_expected(const struct job *job, unsigned axis,
                                  uint32_t id, unsigned word)
{
    if (job == NULL)
        return 0;
    uint64_t sum = 0;
    for (int64_t i = 0; i < BUDGET_SAMPLES; i++) {
        int64_t t = job->end_ns_q12 / BUDGET_SAMPLES * i;
        int64_t pos_q32 = budget_state(job, axis, t).pos_q32;
        sum += budget_pdo_bits(id, word,
                               budget_counts(&job->rig.axis[axis], pos_q32),
                               budget_pdo_bytes(&job->rig.axis[axis]));
    }
    return (double)sum / BUDGET_SAMPLES;
}

/* Which one an axis without a predefined one has is seen in the drive alone:
 * one of the node's that are not in use stands for it. */
static uint32_t budget_pdo_id(const struct rig_axis *axis, uint16_t given,
                              uint32_t predefined)
{
    if (given != 0)
        return given;
    return predefined + axis->node_id + (axis->node_axis > 0 ? BUDGET_PDO3 : 0);
}

/* An SDO in each direction. */
static void budget_add_reading(struct budget *budget,
                               const struct rig_axis *axis,
                               enum hal_reading reading)
{
    if ((axis->monitor.wanted >> (unsigned)reading & 1) == 0)
        return;
    budget_add(budget, "question", axis->name, HAL_READING_NS, 8,
               budget_most_bits(8));
    budget_add(budget, hal_reading_text(reading), axis->name, HAL_READING_NS, 8,
               budget_most_bits(8));
}

static void budget_add_axis(struct budget *budget, const struct job *job,
                            unsigned i)
{
    const struct rig *rig = budget->rig;
    const struct rig_axis *axis = &rig->axis[i];
    const uint8_t operational = BUDGET_OPERATIONAL;
    const uint32_t node = axis->node_id;
    const unsigned bytes = budget_pdo_bytes(axis);
    const int64_t guard_ns = rig_guard_ns(rig, &axis->cia402);
    budget_add(
        budget, "set point", axis->name, rig->period_ns, bytes,
        budget_pdo_expected(
            job, i,
            budget_pdo_id(axis, axis->cia402.pdo.rpdo_id[0], BUDGET_RPDO1),
            BUDGET_CONTROLWORD));
    budget_add(
        budget, "feedback", axis->name, rig->period_ns, bytes,
        budget_pdo_expected(
            job, i,
            budget_pdo_id(axis, axis->cia402.pdo.tpdo_id[0], BUDGET_TPDO1),
            BUDGET_STATUSWORD));
    if (axis->cia402.stream == DRIVE_CIA402_CSV)
        budget_add(budget, "speed", axis->name, rig->period_ns, 4,
                   budget_most_bits(4));
    for (unsigned k = 0; k < HAL_READINGS; k++)
        budget_add_reading(budget, axis, (enum hal_reading)k);
    if (!rig_is_first_of_node(rig, axis))
        return;
    if (guard_ns > 0)
        budget_add(budget, "guard", axis->name, guard_ns, 0,
                   budget_most_bits(0));
    budget_add(budget, guard_ns > 0 ? "answer" : "heartbeat", axis->name,
               guard_ns > 0 ? guard_ns : rig->heartbeat_ns, 1,
               budget_bits(BUDGET_HEARTBEAT + node, &operational, 1));
}

/* Of a Modbus axis: set point and polls once per cycle of the line, always of
 * the same length. */
static void budget_add_modbus(struct budget *budget, unsigned i)
{
    const struct rig *rig = budget->rig;
    unsigned transactions;
    const int64_t share_ns = modbus_budget_share_ns(rig, i, &transactions);
    const double bits = (double)share_ns * rig->bus[budget->bus].bit_rate / 1e9;

    budget_put(budget,
               &(struct budget_item){
                   .what = "cycle",
                   .axis = rig->axis[i].name,
                   .period_ns = modbus_budget_cycle_ns(rig, budget->bus),
                   .most_bits = (unsigned)bits,
               });
}

static void budget_sum_up(struct budget *budget, bool expects)
{
    const double bit_ns = 1e9 / budget->rig->bus[budget->bus].bit_rate;
    for (unsigned i = 0; i < budget->count; i++) {
        const struct budget_item *item = &budget->item[i];
        double share_ns = bit_ns / (double)item->period_ns;
        budget->most += item->most_bits * share_ns;
        budget->expected += expects ? item->expected_bits * share_ns : 0;
    }
}

static void budget_of_modbus(struct budget *budget)
{
    for (unsigned i = 0; i < budget->rig->axis_count; i++)
        if (budget->rig->axis[i].bus == budget->bus)
            budget_add_modbus(budget, i);
    budget_sum_up(budget, false);
}

/* Mean bits of the frames of an axis on a bus without CANopen. */
static void budget_expect_frames(const struct job *job, unsigned axis,
                                 double mean[RIG_FRAMES_MAX])
{
    double bits[RIG_FRAMES_MAX] = { 0 };
    for (int64_t i = 0; job != NULL && i < BUDGET_SAMPLES; i++) {
        const struct motion_state state =
            budget_state(job, axis, job->end_ns_q12 / BUDGET_SAMPLES * i);
        rig_kinds[job->rig.axis[axis].kind]->expect(&job->rig, axis, &state,
                                                    bits);
        for (unsigned k = 0; k < RIG_FRAMES_MAX; k++)
            mean[k] += bits[k] / BUDGET_SAMPLES;
    }
}

static void budget_add_frames(struct budget *budget, const struct job *job,
                              unsigned i)
{
    const struct rig *rig = budget->rig;
    struct rig_frame frame[RIG_FRAMES_MAX];
    double expected[RIG_FRAMES_MAX] = { 0 };
    const unsigned count = rig_kinds[rig->axis[i].kind]->frames(rig, i, frame);
    budget_expect_frames(job, i, expected);
    for (unsigned k = 0; k < count; k++)
        budget_put(budget, &(struct budget_item){
                               .what = frame[k].what,
                               .axis = rig->axis[i].name,
                               .period_ns = frame[k].period_ns,
                               .most_bits = (unsigned)ceil(frame[k].bits),
                               .expected_bits = expected[k],
                           });
}

static void budget_of_frames(struct budget *budget, const struct job *job)
{
    for (unsigned i = 0; i < budget->rig->axis_count; i++)
        if (budget->rig->axis[i].bus == budget->bus)
            budget_add_frames(budget, job, i);
    budget_sum_up(budget, job != NULL);
}

void budget_of(const struct rig *rig, unsigned bus, const struct job *job,
               struct budget *budget)
{
    const uint8_t operational = BUDGET_OPERATIONAL;
    const uint32_t own = BUDGET_HEARTBEAT + rig->bus[bus].node_id;
    const unsigned counted = rig->bus[bus].sync_counter > 0 ? 1 : 0;
    *budget = (struct budget){ .rig = rig, .bus = bus };
    if (rig->bus[bus].kind == RIG_CAN) {
        budget_of_frames(budget, job);
        return;
    }
    if (!rig_bus_is_can(&rig->bus[bus])) {
        budget_of_modbus(budget);
        return;
    }
    budget_add(budget, "SYNC", NULL, rig->period_ns, counted,
               budget_bits(BUDGET_SYNC, &operational, counted));
    budget_add(budget, "heartbeat", NULL, rig->watchdog_ns / 3, 1,
               budget_bits(own, &operational, 1));
    for (unsigned i = 0; i < rig->axis_count; i++)
        if (rig->axis[i].bus == bus)
            budget_add_axis(budget, job, i);
    budget_sum_up(budget, job != NULL);
}

void budget_free(struct budget *budget)
{
    memory_pool_free(&budget->memory);
    *budget = (struct budget){ .rig = NULL };
}

bool budget_fits(const struct budget *budget)
{
    return budget->most <= 1;
}

/* --- what would fit --- */

/* Bits per tick, and bits per second whatever the tick is: of all, and of the
 * drives alone. */
struct budget_sums {
    double per_tick, per_second, drives_per_tick, drives_per_second;
    unsigned drives;
};

static void budget_sum(const struct budget *budget, struct budget_sums *sums)
{
    const struct rig *rig = budget->rig;
    memset(sums, 0, sizeof *sums);
    for (unsigned i = 0; i < budget->count; i++) {
        const struct budget_item *item = &budget->item[i];
        const bool ticks = item->period_ns == rig->period_ns;
        const double bits =
            ticks ? item->most_bits
                  : item->most_bits * 1e9 / (double)item->period_ns;
        *(ticks ? &sums->per_tick : &sums->per_second) += bits;
        if (item->axis != NULL)
            *(ticks ? &sums->drives_per_tick : &sums->drives_per_second) +=
                bits;
    }
    for (unsigned i = 0; i < rig->axis_count; i++)
        sums->drives += rig->axis[i].bus == budget->bus;
}

/* As many as are there, in the mean. */
static unsigned budget_drives(const struct budget *budget,
                              const struct budget_sums *sums)
{
    const double rate = budget->rig->bus[budget->bus].bit_rate;
    const double ticks = 1e9 / (double)budget->rig->period_ns;
    const double all = sums->per_tick * ticks + sums->per_second;
    const double drives =
        sums->drives_per_tick * ticks + sums->drives_per_second;
    const double storage = rate - (all - drives);
    return storage < 0 ? 0 : (unsigned)(storage / drives * sums->drives);
}

void budget_advice(const struct budget *budget, char text[BUDGET_ADVICE_MAX])
{
    struct budget_sums sums;
    budget_sum(budget, &sums);
    const double rate = budget->rig->bus[budget->bus].bit_rate;
    const double tick_ms =
        ceil(1e5 * sums.per_tick / (rate - sums.per_second)) / 100;
    const unsigned drives = budget_drives(budget, &sums);
    int length = 0;
    text[0] = '\0';
    if (drives > 0)
        length = snprintf(text, BUDGET_ADVICE_MAX, "%u %s on this bus", drives,
                          number_word(drives, "drive", "drives"));
    if (rate > sums.per_second && tick_ms <= 20)
        length +=
            snprintf(text + length, BUDGET_ADVICE_MAX - (size_t)length,
                     "%sa tick of %.2f ms", length > 0 ? ", " : "", tick_ms);
    for (unsigned i = 0; i < RIG_BIT_RATES; i++)
        if (budget->rig->bus[budget->bus].data_bit_rate == 0 &&
            rig_bit_rates[i] > rate &&
            budget->most * rate <= rig_bit_rates[i]) {
            snprintf(text + length, BUDGET_ADVICE_MAX - (size_t)length,
                     "%s%u kbit/s", length > 0 ? ", or " : "",
                     rig_bit_rates[i] / 1000);
            return;
        }
    snprintf(text + length, BUDGET_ADVICE_MAX - (size_t)length, "%sanother bus",
             length > 0 ? ", or " : "");
}

/* --- telling it --- */

static double budget_share(const struct budget *budget,
                           const struct budget_item *item, double bits)
{
    return bits * 1e9 / (double)item->period_ns /
           budget->rig->bus[budget->bus].bit_rate;
}

void budget_print(const struct budget *budget, FILE *file)
{
    const struct rig_bus *bus = &budget->rig->bus[budget->bus];
    fprintf(file, "%s, %u bit/s:\n", bus->name, bus->bit_rate);
    for (unsigned i = 0; i < budget->count; i++) {
        const struct budget_item *item = &budget->item[i];
        fprintf(file, "  %-9s %-16s %3u bits every %7.3f ms  %6.2f %%",
                item->what, item->axis == NULL ? "slew" : item->axis,
                item->most_bits, (double)item->period_ns / 1e6,
                100 * budget_share(budget, item, item->most_bits));
        if (budget->expected > 0)
            fprintf(file, ", %6.2f bits expected", item->expected_bits);
        fputc('\n', file);
    }
    fprintf(file, "  together at most %.2f %%", 100 * budget->most);
    if (budget->expected > 0)
        fprintf(file, ", %.2f %% expected", 100 * budget->expected);
    fputc('\n', file);
    if (!rig_bus_is_can(bus))
        modbus_budget_print(budget->rig, budget->bus, file);
}

static cJSON *budget_json_bus(const struct budget *budget)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "name", budget->rig->bus[budget->bus].name);
    cJSON_AddBoolToObject(object, "fits", budget_fits(budget));
    cJSON_AddNumberToObject(object, "load_at_most", budget->most);
    if (budget->expected > 0)
        cJSON_AddNumberToObject(object, "load_expected", budget->expected);
    cJSON *items = cJSON_AddArrayToObject(object, "items");
    for (unsigned i = 0; i < budget->count; i++) {
        const struct budget_item *item = &budget->item[i];
        cJSON *row = cJSON_CreateObject();
        cJSON_AddStringToObject(row, "what", item->what);
        if (item->axis != NULL)
            cJSON_AddStringToObject(row, "axis", item->axis);
        cJSON_AddNumberToObject(row, "bits_at_most", item->most_bits);
        if (budget->expected > 0)
            cJSON_AddNumberToObject(row, "bits_expected", item->expected_bits);
        cJSON_AddNumberToObject(row, "period_s", (double)item->period_ns / 1e9);
        cJSON_AddItemToArray(items, row);
    }
    return object;
}

void budget_json(const struct rig *rig, const struct job *job, cJSON *report)
{
    cJSON *buses = cJSON_AddArrayToObject(report, "buses");

    for (unsigned i = 0; i < rig->bus_count; i++) {
        struct budget budget;

        budget_of(rig, i, job, &budget);
        cJSON_AddItemToArray(buses, budget_json_bus(&budget));
        budget_free(&budget);
    }
}

bool budget_check(const struct rig *rig, const char *rig_path,
                  struct messages *messages)
{
    bool fits = modbus_budget_check(rig, rig_path, messages);
    for (unsigned i = 0; i < rig->bus_count; i++) {
        struct budget budget;
        char advice[BUDGET_ADVICE_MAX];
        budget_of(rig, i, NULL, &budget);
        if (!budget_fits(&budget)) {
            fits = false;
            budget_advice(&budget, advice);
            messages_add(
                messages, MESSAGE_ERROR,
                "%s:%u:%u: bus %s would need %.1f %% of its time, expected at "
                "most 100 %%: %s would fit",
                rig_path, rig->bus[i].place.line, rig->bus[i].place.column,
                rig->bus[i].name, 100 * budget.most, advice);
        }
        budget_free(&budget);
    }
    return fits;
}
