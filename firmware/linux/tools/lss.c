/* firmware/linux/tools/lss.c - see lss.h. */
#include "firmware/linux/tools/lss.h"

#include <stdlib.h>

#include "firmware/host/base/array.h"
#include "motion/core/err.h"

#define LSS_SETTLE_NS INT64_C(20000000) /* to switch over; nobody answers */

bool lss_identity(const char *text, struct canopen_identity *identity)
{
    uint32_t *part[] = { &identity->vendor, &identity->product,
                         &identity->revision, &identity->serial };

    for (unsigned i = 0; i < 4; i++) {
        char *end;
        const unsigned long long number = strtoull(text, &end, 0);

        if (end == text || number > UINT32_MAX || *end != (i == 3 ? '\0' : ','))
            return false;
        *part[i] = (uint32_t)number;
        text = end + 1;
    }
    return true;
}

static int64_t lss_now_ns(const struct ask_can *ask)
{
    return hal_clock_now_ns(ask->clock);
}

void lss_release(struct ask_can *ask)
{
    (void)canopen_lss_switch_all(&ask->lss, false);
    ask_can_wait(ask, LSS_SETTLE_NS);
}

int lss_select(struct ask_can *ask, const struct canopen_identity *wanted,
               struct canopen_identity *found)
{
    int err;

    lss_release(ask);
    err = wanted == NULL
              ? canopen_lss_scan(&ask->lss, lss_now_ns(ask))
              : canopen_lss_switch(&ask->lss, lss_now_ns(ask), wanted);
    if (err == MOTION_OK)
        err = ask_can_lss(ask);
    if (err == MOTION_OK)
        *found = wanted == NULL ? ask->lss.found : *wanted;
    return err;
}

int lss_ask_node(struct ask_can *ask, uint8_t *id)
{
    int err = canopen_lss_ask_node(&ask->lss, lss_now_ns(ask));

    if (err == MOTION_OK)
        err = ask_can_lss(ask);
    *id = err == MOTION_OK ? (uint8_t)ask->lss.value : 255;
    return err;
}

int lss_node(struct ask_can *ask, uint8_t id)
{
    const int err = canopen_lss_set_node(&ask->lss, lss_now_ns(ask), id);

    return err < 0 ? err : ask_can_lss(ask);
}

int lss_bit_rate(struct ask_can *ask, uint32_t bit_rate)
{
    static const struct {
        uint32_t bit_rate;
        enum canopen_lss_bit_rate code;
    } table[] = {
        { 1000000, CANOPEN_LSS_1000K }, { 800000, CANOPEN_LSS_800K },
        { 500000, CANOPEN_LSS_500K },   { 250000, CANOPEN_LSS_250K },
        { 125000, CANOPEN_LSS_125K },   { 50000, CANOPEN_LSS_50K },
        { 20000, CANOPEN_LSS_20K },     { 10000, CANOPEN_LSS_10K },
    };

    for (size_t i = 0; i < ARRAY_LEN(table); i++) {
        int err;

        if (table[i].bit_rate != bit_rate)
            continue;
        err =
            canopen_lss_set_bit_rate(&ask->lss, lss_now_ns(ask), table[i].code);
        return err < 0 ? err : ask_can_lss(ask);
    }
    return MOTION_E_ARG;
}

int lss_store(struct ask_can *ask)
{
    const int err = canopen_lss_store(&ask->lss, lss_now_ns(ask));

    return err < 0 ? err : ask_can_lss(ask);
}
