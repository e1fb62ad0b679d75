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

static int64_t lss_now_ns(const struct canopen_client *client)
{
    return hal_clock_now_ns(client->clock);
}

void lss_release(struct canopen_client *client)
{
    (void)canopen_lss_switch_all(&client->lss, false);
    canopen_client_wait(client, LSS_SETTLE_NS);
}

int lss_select(struct canopen_client *client,
               const struct canopen_identity *wanted,
               struct canopen_identity *found)
{
    int err;

    lss_release(client);
    err = wanted == NULL
              ? canopen_lss_scan(&client->lss, lss_now_ns(client))
              : canopen_lss_switch(&client->lss, lss_now_ns(client), wanted);
    if (err == MOTION_OK)
        err = canopen_client_lss(client);
    if (err == MOTION_OK)
        *found = wanted == NULL ? client->lss.found : *wanted;
    return err;
}

int lss_request_node(struct canopen_client *client, uint8_t *id)
{
    int err = canopen_lss_request_node(&client->lss, lss_now_ns(client));

    if (err == MOTION_OK)
        err = canopen_client_lss(client);
    *id = err == MOTION_OK ? (uint8_t)client->lss.value : 255;
    return err;
}

int lss_node(struct canopen_client *client, uint8_t id)
{
    const int err = canopen_lss_set_node(&client->lss, lss_now_ns(client), id);

    return err < 0 ? err : canopen_client_lss(client);
}

int lss_bit_rate(struct canopen_client *client, uint32_t bit_rate)
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
        err = canopen_lss_set_bit_rate(&client->lss, lss_now_ns(client),
                                       table[i].code);
        return err < 0 ? err : canopen_client_lss(client);
    }
    return MOTION_E_ARG;
}

int lss_store(struct canopen_client *client)
{
    const int err = canopen_lss_store(&client->lss, lss_now_ns(client));

    return err < 0 ? err : canopen_client_lss(client);
}
