/* firmware/linux/commands/drive/lss.c - slew drive lss: node number and bit
 * rate of a device that has none, or the wrong one. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/drive/verbs.h"
#include "firmware/linux/tools/lss.h"
#include "hal/drive/cia402/drive.h"
#include "motion/core/err.h"

#define LSS_BOOT_NS INT64_C(500000000) /* until it answers with its number */

struct lss_job {
    struct canopen_client client;
    struct canopen_identity wanted, found;
    bool has_wanted, json;
    uint32_t number; /* node or bit rate */
    uint8_t old;     /* node number so far, 255: none */
    bool do_node, do_rate, do_store;
    bool answers; /* with its new number */
};

/* ---- what is to be done ---- */

static enum status lss_number(const char *text, struct lss_job *job)
{
    char *end;
    const unsigned long number = text == NULL ? 0 : strtoul(text, &end, 10);

    if (text == NULL || end == text || *end != '\0' || number > 1000000)
        return drive_complain("lss: expected a number after node or rate");
    job->number = (uint32_t)number;
    if (job->do_node && (number < 1 || number > 127))
        return drive_complain("lss: no node number, expected 1 .. 127");
    return STATUS_OK;
}

static enum status lss_read(const struct options *options, struct lss_job *job)
{
    const char *verb = options->path[2];
    const char *number = options->path_count > 3 ? options->path[3] : NULL;

    job->json = options->json;
    job->has_wanted = options->identity != NULL;
    if (job->has_wanted && !lss_identity(options->identity, &job->wanted))
        return drive_complain("--identity: expected four numbers such as "
                              "0x2E,402,0x10000,7");
    job->do_node = strcmp(verb, "node") == 0;
    job->do_rate = strcmp(verb, "rate") == 0;
    job->do_store = options->store || strcmp(verb, "store") == 0;
    if (job->do_node || job->do_rate)
        return lss_number(number, job);
    if (number != NULL ||
        (strcmp(verb, "scan") != 0 && strcmp(verb, "store") != 0))
        return drive_complain("lss: expected scan, node NUMBER, rate BIT/S or "
                              "store");
    return STATUS_OK;
}

/* ---- doing it ---- */

static enum status lss_fail(const struct lss_job *job, const char *what,
                            int err)
{
    if (err == MOTION_E_REFUSED)
        error_say("slew drive lss: %s: the device refused (error %u)", what,
                  job->client.lss.error);
    else if (err == MOTION_E_ARG)
        error_say("slew drive lss: %s: %" PRIu32 " is none, expected "
                  "10000, 20000, 50000, 125000, 250000, 500000, 800000 "
                  "or 1000000",
                  what, job->number);
    else
        error_say("slew drive lss: %s: %s", what, motion_err_text(err));
    return err == MOTION_E_ARG ? STATUS_INPUT : STATUS_REFUSED;
}

static enum status lss_change(struct lss_job *job)
{
    int err = MOTION_OK;

    if (job->do_node)
        err = lss_node(&job->client, (uint8_t)job->number);
    if (err < 0)
        return lss_fail(job, "node number", err);
    if (job->do_rate)
        err = lss_bit_rate(&job->client, job->number);
    if (err < 0)
        return lss_fail(job, "bit rate", err);
    if (job->do_store)
        err = lss_store(&job->client);
    return err < 0 ? lss_fail(job, "storing", err) : STATUS_OK;
}

/* One that had a number takes the new one when its communication begins anew.
 * That takes its torque off, so it must have none. */
static void lss_restart(struct lss_job *job)
{
    uint32_t word = 0;

    if (job->old < 1 || job->old > 127)
        return;
    (void)canopen_client_node(&job->client, job->old);
    if (canopen_client_read_number(&job->client, 0x6041, 0, &word, NULL) ==
            MOTION_OK &&
        cia402_state_of((uint16_t)word) == CIA402_OPERATION_ENABLED)
        return;
    (void)canopen_nmt(&job->client.master, CANOPEN_NMT_RESET_COMMUNICATION,
                      job->old);
}

static void lss_look(struct lss_job *job)
{
    uint32_t value;

    lss_restart(job);
    canopen_client_wait(&job->client, LSS_BOOT_NS);
    (void)canopen_client_node(&job->client, (uint8_t)job->number);
    job->answers = canopen_client_read_number(&job->client, 0x1000, 0, &value,
                                              NULL) == MOTION_OK;
}

static enum status lss_do(struct lss_job *job)
{
    const int err = lss_select(
        &job->client, job->has_wanted ? &job->wanted : NULL, &job->found);
    enum status status;

    if (err == MOTION_E_TIMEOUT && !job->has_wanted)
        error_say("slew drive lss: no device without node number answers "
                  "(--identity for one that has one)");
    else if (err == MOTION_E_TIMEOUT)
        error_say("slew drive lss: no device of that identity answers");
    if (err < 0) {
        lss_release(&job->client);
        return err == MOTION_E_TIMEOUT ? STATUS_REFUSED
                                       : lss_fail(job, "finding it", err);
    }
    (void)lss_request_node(&job->client, &job->old);
    status = lss_change(job);
    lss_release(&job->client);
    if (status == STATUS_OK && job->do_node)
        lss_look(job);
    return status;
}

static void lss_print(const struct lss_job *job)
{
    const struct canopen_identity *found = &job->found;

    printf("vendor 0x%08" PRIX32 ", product 0x%08" PRIX32
           ", revision 0x%08" PRIX32 ", serial %" PRIu32 "\n",
           found->vendor, found->product, found->revision, found->serial);
    if (job->do_node)
        printf("node %" PRIu32 " now%s\n", job->number,
               job->answers ? ", and it answers"
                            : "; it does not answer yet: switch it off and on");
    if (job->do_rate)
        printf("%" PRIu32 " bit/s from when it is switched on again\n",
               job->number);
    if (job->do_store)
        puts("stored");
}

static void lss_json(const struct lss_job *job)
{
    cJSON *report = cJSON_CreateObject();

    json_add_integer(report, "vendor", job->found.vendor);
    json_add_integer(report, "product", job->found.product);
    json_add_integer(report, "revision", job->found.revision);
    json_add_integer(report, "serial", job->found.serial);
    if (job->do_node) {
        json_add_integer(report, "node", job->number);
        cJSON_AddBoolToObject(report, "answers", job->answers);
    }
    if (job->do_rate)
        json_add_integer(report, "bit_rate", job->number);
    cJSON_AddBoolToObject(report, "stored", job->do_store);
    json_report(report, true);
}

static int lss_open(const struct options *options, struct bench *bench,
                    char message[YAML_MESSAGE_MAX])
{
    static struct rig rig;
    const struct bench_line line = { .baud = 0 };
    bool is_rig;
    int bus;

    if (bench_name(options->path[1], &line, &rig, &is_rig, message) < 0 ||
        (is_rig && options->interface != NULL &&
         rig_set_interfaces(&rig, options->interface, message) < 0))
        return -1;
    bus = session_bus(&rig, options->bus, true, message);
    if (bus < 0)
        return -1;
    if (rig.bus[bus].kind != RIG_CANOPEN) {
        snprintf(message, YAML_MESSAGE_MAX, "%s is no CAN bus, expected one",
                 rig.bus[bus].name);
        return -1;
    }
    return bench_open(bench, &rig, (unsigned)bus, options->real || !is_rig,
                      true, message);
}

static enum status lss_run(const struct options *options, struct bench *bench,
                           struct lss_job *job)
{
    char message[YAML_MESSAGE_MAX];
    enum status status;

    if (lss_open(options, bench, message) < 0) {
        error_say("%s", message);
        return STATUS_INPUT;
    }
    canopen_client_init(&job->client, bench->ports.can[0], bench->ports.clock,
                        0);
    if (!bench->is_real)
        canopen_client_wait(&job->client, BENCH_BOOT_NS);
    status = lss_do(job);
    bench_close(bench);
    return status;
}

enum status drive_lss(const struct options *options)
{
    static struct lss_job job;
    enum status status;

    job = (struct lss_job){ .number = 0 };
    status = lss_read(options, &job);
    if (status != STATUS_OK)
        return status;
    struct bench *bench = memory_new(1, sizeof *bench);
    status = lss_run(options, bench, &job);
    memory_free(bench);
    if (status != STATUS_OK)
        return status;
    if (job.json)
        lss_json(&job);
    else
        lss_print(&job);
    return STATUS_OK;
}
