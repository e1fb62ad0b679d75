/* firmware/linux/commands/drive/reset.c - slew drive reset: why is it in fault,
 * and clear that. */
#include <stdio.h>

#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/drive/verbs.h"
#include "firmware/linux/tools/reset.h"
#include "motion/core/err.h"

static void reset_json(const struct session *session, const struct reset *reset)
{
    cJSON *report = cJSON_CreateObject();

    cJSON_AddStringToObject(report, "drive", session->label);
    cJSON_AddBoolToObject(report, "was_fault", reset->was_fault);
    cJSON_AddStringToObject(report, "reason", reset->reason);
    cJSON_AddStringToObject(report, "state", reset->state);
    json_report(report, !reset->is_fault);
}

static void reset_print(const struct session *session,
                        const struct reset *reset)
{
    if (!reset->was_fault)
        printf("%s: no fault, %s; nothing was written\n", session->label,
               reset->state);
    else if (reset->is_fault)
        printf("%s: %s; it stays in fault: the cause is still there\n",
               session->label, reset->reason);
    else
        printf("%s: was in fault, %s; now %s\n", session->label, reset->reason,
               reset->state);
}

static enum status reset_run(struct session *session,
                             const struct options *options)
{
    struct reset reset;
    int err;

    err = reset_drive(session, &reset);
    if (err == MOTION_E_EMPTY)
        return drive_complain(
            session->map == NULL
                ? "expected --map: it says how the drive is reset"
                : "the map does not say how a fault shows");
    if (err < 0)
        return drive_failed(session, reset.reason, err);
    if (options->json)
        reset_json(session, &reset);
    else
        reset_print(session, &reset);
    return reset.is_fault ? STATUS_REFUSED : STATUS_OK;
}

enum status drive_reset(const struct options *options)
{
    struct session *session;
    enum status status = drive_open(options, &session);

    if (status != STATUS_OK)
        return status;
    status = reset_run(session, options);
    drive_close(session);
    return status;
}
