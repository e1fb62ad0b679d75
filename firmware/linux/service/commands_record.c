/* firmware/linux/service/commands_record.c - recordings of a service, asked for by
 * clients; see command_line.h. */
#include "firmware/linux/base/error.h"
#include "firmware/linux/service/command_line.h"
#include "motion/core/err.h"

static int record_start(struct service_control *control, const char *name,
                        char text[SERVICE_RECORDING_TEXT_MAX])
{
    const struct service_move *move = control->move;
    const struct service_recording_about about = {
        .rig_path = control->rig_path,
        .rig_text = control->rig_text,
        .rig_length = control->rig_length,
        .move_title = move != NULL ? move->facts.title : NULL,
        .move_text = move != NULL ? move->file_text : NULL,
    };
    return service_recording_start(control->recording, name, &about, text);
}

void service_record_by_time(struct service_control *control)
{
    char name[SERVICE_RECORDING_NAME_MAX], text[SERVICE_RECORDING_TEXT_MAX];
    service_recording_name(name);
    if (record_start(control, name, text) < 0)
        error_say("slew service: %s", text);
}

void command_record(const struct command_line *line)
{
    const char *name = cJSON_GetStringValue(command_line_member(line, "file"));
    char own[SERVICE_RECORDING_NAME_MAX], text[SERVICE_RECORDING_TEXT_MAX];
    if (command_line_member(line, "file") == NULL) {
        service_recording_name(own);
        name = own;
    }
    const int err =
        line->control->recording == NULL
            ? MOTION_E_STATE
            : record_start(line->control, name != NULL ? name : "", text);
    if (err < 0) {
        command_line_refuse(
            line, command_line_error(err),
            line->control->recording == NULL ? motion_err_text(err) : text);
        return;
    }
    cJSON *object = command_line_object(line->id, true);
    cJSON_AddStringToObject(object, "file", name);
    command_line_answer(line, object);
}

void command_record_stop(const struct command_line *line)
{
    if (line->control->recording != NULL &&
        service_recording_stop(line->control->recording) == MOTION_OK)
        command_line_done(line);
    else
        command_line_refuse(line, "STATE", "nothing is being recorded");
}

void command_record_status(const struct service_control *control, cJSON *object)
{
    const struct service_recording *recording = control->recording;
    if (recording == NULL || recording->turn == SERVICE_RECORDING_OFF)
        return;
    cJSON *own = cJSON_AddObjectToObject(object, "recording");
    cJSON_AddStringToObject(own, "file", recording->name);
    cJSON_AddNumberToObject(own, "rows", (double)recording->rows);
}

void service_record_step(struct service_control *control)
{
    struct service_recording *recording = control->recording;
    if (recording == NULL || !service_recording_ended(recording))
        return;
    cJSON *object = service_event_object("record", control->now_ns);
    cJSON_AddStringToObject(object, "file", recording->name);
    cJSON_AddBoolToObject(object, "done", !recording->failed);
    cJSON_AddNumberToObject(object, "rows", (double)recording->rows);
    cJSON_AddNumberToObject(object, "rows_lost", (double)recording->rows_lost);
    service_tell_all(control, object);
    cJSON_Delete(object);
}

void service_record_fault(struct service_control *control, int64_t now_ns,
                          const char *text)
{
    if (control->recording != NULL)
        service_recording_note(control->recording, now_ns, RECORD_ERROR, text);
}
