/* firmware/host/recording/record.c - see record.h. */
#include "firmware/host/recording/record.h"

#include <inttypes.h>
#include <string.h>

#include "firmware/control/controller.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"

#define RECORD_HAND_NS     INT64_C(1000000000)
#define RECORD_MESSAGE_MAX 1024 /* a message's data, at most */

_Static_assert(RIG_AXES_MAX + RIG_TRIGGERS_MAX + 2 <= MCAP_WRITER_CHANNELS,
               "a channel for each");
/* Its messages, and notes: a phase, of each axis its events and a warning, and of
 * each bus. */
#define RECORD_ROW_MESSAGES                                                    \
    (3 * RIG_AXES_MAX + RIG_BUSES_MAX + RIG_TRIGGERS_MAX + 2)
_Static_assert(RECORD_ROW_MESSAGES *(RECORD_MESSAGE_MAX + MCAP_MESSAGE_HEAD) <=
                   MCAP_CHUNK_BYTES,
               "a row fits a chunk");

/* --- what the messages are --- */

static const char record_run_schema[] =
    "{\"title\":\"slew.run\",\"type\":\"object\",\"properties\":{"
    "\"phase\":{\"type\":\"string\"},\"state\":{\"type\":\"string\"},"
    "\"path_ns\":{\"type\":\"number\"},\"rate\":{\"type\":\"number\"},"
    "\"late_ns\":{\"type\":\"integer\"}}}";

static const char record_shot_schema[] =
    "{\"title\":\"slew.shot\",\"type\":\"object\",\"properties\":{"
    "\"shot\":{\"type\":\"integer\"},\"shot_ns\":{\"type\":\"integer\"}}}";

/* Source: foxglove-sdk, schemas/jsonschema/Log.json. */
static const char record_log_schema[] =
    "{\"title\":\"foxglove.Log\",\"type\":\"object\",\"properties\":{"
    "\"timestamp\":{\"type\":\"object\",\"title\":\"time\",\"properties\":{"
    "\"sec\":{\"type\":\"integer\",\"minimum\":0},"
    "\"nsec\":{\"type\":\"integer\",\"minimum\":0,\"maximum\":999999999}}},"
    "\"level\":{\"type\":\"integer\"},\"message\":{\"type\":\"string\"},"
    "\"name\":{\"type\":\"string\"},\"file\":{\"type\":\"string\"},"
    "\"line\":{\"type\":\"integer\",\"minimum\":0}}}";

static uint16_t record_axis_schema(struct record *record, const char *unit)
{
    char name[32], text[RECORD_MESSAGE_MAX];
    int at = snprintf(text, sizeof text,
                      "{\"title\":\"slew.axis.%s\",\"type\":\"object\","
                      "\"properties\":{",
                      unit);
    for (size_t f = 0; f < TELEMETRY_FIELDS; f++)
        at += snprintf(text + at, sizeof text - (size_t)at,
                       "\"%s_%s%s\":{\"type\":\"number\"},",
                       telemetry_field[f].name, unit, telemetry_field[f].per);
    snprintf(text + at, sizeof text - (size_t)at,
             "\"statusword\":{\"type\":\"integer\"}}}");
    snprintf(name, sizeof name, "slew.axis.%s", unit);
    return mcap_writer_schema(&record->writer, name, text);
}

static void record_axes(struct record *record)
{
    uint16_t schema[UNITS_AXIS_WORDS] = { 0 };
    char topic[sizeof RECORD_TOPIC_AXIS + PLAN_NAME_MAX];
    record->first_axis = record->writer.channel_count;
    for (uint32_t i = 0; i < record->rig->axis_count; i++) {
        const struct rig_axis *axis = &record->rig->axis[i];
        if (schema[axis->unit] == 0)
            schema[axis->unit] =
                record_axis_schema(record, units_axis_text(axis->unit));
        snprintf(topic, sizeof topic, RECORD_TOPIC_AXIS "%s", axis->name);
        mcap_writer_channel(&record->writer, schema[axis->unit], topic);
    }
}

static void record_lines(struct record *record)
{
    const uint16_t schema =
        mcap_writer_schema(&record->writer, "slew.shot", record_shot_schema);
    char topic[sizeof RECORD_TOPIC_SHOTS + PLAN_NAME_MAX];
    record->first_shot = record->writer.channel_count;
    for (uint32_t i = 0; i < record->rig->line_count; i++) {
        if (record->rig->line[i].kind != RIG_LINE_TRIGGER)
            continue;
        snprintf(topic, sizeof topic, RECORD_TOPIC_SHOTS "%s",
                 record->rig->line[i].name);
        mcap_writer_channel(&record->writer, schema, topic);
    }
}

void record_init(struct record *record, FILE *file, const struct rig *rig,
                 int64_t epoch_ns, const char *library)
{
    struct mcap_writer *writer = &record->writer;
    *record = (struct record){
        .rig = rig,
        .epoch_ns = epoch_ns,
    };
    row_notes_init(&record->notes, rig, 0);
    mcap_writer_begin(writer, file, library);
    record->run = mcap_writer_channel(
        writer, mcap_writer_schema(writer, "slew.run", record_run_schema),
        RECORD_TOPIC_RUN);
    record->log = mcap_writer_channel(
        writer, mcap_writer_schema(writer, "foxglove.Log", record_log_schema),
        RECORD_TOPIC_LOG);
    record_axes(record);
    record_lines(record);
}

void record_free(struct record *record)
{
    mcap_writer_free(&record->writer);
    row_notes_free(&record->notes);
}

void record_attach(struct record *record, const char *name, const void *data,
                   size_t size)
{
    mcap_writer_attach(&record->writer, (uint64_t)record->epoch_ns, name,
                       "application/octet-stream", data, size);
}

void record_plan(struct record *record, const char *const pair[][2],
                 size_t count)
{
    mcap_writer_metadata(&record->writer, RECORD_PLAN, pair, count);
    mcap_writer_chunk(&record->writer);
}

/* --- handing over --- */

static void record_hand(struct record *record)
{
    if (!mcap_writer_chunk(&record->writer))
        record->rows_lost += record->rows_waiting;
    record->rows_waiting = 0;
}

static void record_put(struct record *record, uint16_t channel,
                       uint32_t sequence, int64_t t_ns, const char *text,
                       const char *end)
{
    mcap_writer_message(&record->writer, channel, sequence,
                        (uint64_t)(record->epoch_ns + t_ns), text,
                        (size_t)(end - text));
}

/* --- notes --- */

/* As a string of JSON, what does not fit left out. */
static void record_quote(char *to, size_t size, const char *text)
{
    size_t at = 0;
    for (; *text != 0 && at + 7 < size; text++) {
        if (*text == '"' || *text == '\\')
            to[at++] = '\\';
        if ((unsigned char)*text >= 0x20)
            to[at++] = *text;
    }
    to[at] = 0;
}

void record_note(struct record *record, int64_t t_ns, enum record_level level,
                 const char *text)
{
    const int64_t wall_ns = record->epoch_ns + t_ns;
    char quoted[RECORD_TEXT_MAX], message[RECORD_MESSAGE_MAX];
    record_quote(quoted, sizeof quoted, text);
    const int length = snprintf(
        message, sizeof message,
        "{\"timestamp\":{\"sec\":%" PRId64 ",\"nsec\":%" PRId64 "},"
        "\"level\":%d,\"message\":\"%s\",\"name\":\"slew\",\"file\":\"\","
        "\"line\":0}",
        wall_ns / INT64_C(1000000000), wall_ns % INT64_C(1000000000),
        (int)level, quoted);
    if (!mcap_writer_fits(&record->writer, 1, (size_t)length))
        record_hand(record);
    if (!record->writer.failed)
        record_put(record, record->log, 0, t_ns, message, message + length);
}

static void record_warn(void *context, const struct telemetry_row *row,
                        const char *text)
{
    record_note(context, row->t_ns, RECORD_WARNING, text);
}

static void record_notes(struct record *record, const struct telemetry_row *row)
{
    row_notes_take(&record->notes, row, record_warn, record);
    if (!record->begun || row->phase != record->phase)
        record_note(record, row->t_ns, RECORD_INFO,
                    telemetry_phase_text(row->phase));
    record->begun = true;
    record->phase = row->phase;
}

/* --- rows --- */

static char *record_text(char *at, const char *text)
{
    const size_t length = strlen(text);
    memcpy(at, text, length);
    return at + length;
}

static char *record_key(char *at, const char *key)
{
    at = record_text(at, ",\"");
    at = record_text(at, key);
    return record_text(at, "\":");
}

static void record_run(struct record *record, const struct telemetry_row *row)
{
    char text[RECORD_MESSAGE_MAX];
    char *at = record_text(text, "{\"phase\":\"");
    at = record_text(at, telemetry_phase_spelling(row->phase));
    at = record_text(at, "\",\"state\":\"");
    at = record_text(at,
                     controller_state_text((enum controller_state)row->state));
    at = record_key(record_text(at, "\""), "path_ns");
    at += number_exact(at, row->rate.s_ns_q12, 12);
    at = record_key(at, "rate");
    at += number_fixed(at, row->rate.rate_q30, 30, 9);
    at = record_key(at, "late_ns");
    at += number_integer(at, row->late_ns);
    *at++ = '}';
    record_put(record, record->run, row->number, row->t_ns, text, at);
}

static void record_axis(struct record *record, const struct telemetry_row *row,
                        uint32_t i)
{
    const char *unit = units_axis_text(record->rig->axis[i].unit);
    char text[RECORD_MESSAGE_MAX], *at = text;
    for (size_t f = 0; f < TELEMETRY_FIELDS; f++) {
        const struct telemetry_field *field = &telemetry_field[f];
        at = record_text(at, f == 0 ? "{\"" : ",\"");
        at = record_text(at, field->name);
        *at++ = '_';
        at = record_text(at, unit);
        at = record_text(at, field->per);
        at = record_text(at, "\":");
        at += number_fixed(at, telemetry_get(&row->axis[i], f), field->bits,
                           field->digits);
    }
    at = record_key(at, "statusword");
    at += number_integer(at, row->axis[i].statusword);
    *at++ = '}';
    record_put(record, (uint16_t)(record->first_axis + i), row->number,
               row->t_ns, text, at);
}

static void record_shot(struct record *record, const struct telemetry_row *row,
                        unsigned i)
{
    char text[RECORD_MESSAGE_MAX];
    if (row->shot[i].number == 0)
        return;
    char *at = record_text(text, "{\"shot\":");
    at += number_integer(at, row->shot[i].number);
    at = record_key(at, "shot_ns");
    at += number_integer(at, row->shot[i].t_ns);
    *at++ = '}';
    record_put(record, (uint16_t)(record->first_shot + i), row->number,
               row->t_ns, text, at);
}

void record_write(struct record *record, const struct telemetry_row *row)
{
    if (!record->writer.failed &&
        (row->t_ns - record->handed_ns >= RECORD_HAND_NS ||
         !mcap_writer_fits(&record->writer, RECORD_ROW_MESSAGES,
                           (size_t)RECORD_ROW_MESSAGES * RECORD_MESSAGE_MAX))) {
        record_hand(record);
        record->handed_ns = row->t_ns;
    }
    if (record->writer.failed) {
        record->rows_lost++;
        return;
    }
    record->rows_waiting++;
    record_run(record, row);
    for (uint32_t i = 0; i < record->rig->axis_count; i++)
        record_axis(record, row, i);
    for (unsigned i = 0; i < row->shot_count; i++)
        record_shot(record, row, i);
    record_notes(record, row);
}

bool record_end(struct record *record, const char *const pair[][2],
                size_t count)
{
    record_hand(record);
    mcap_writer_metadata(&record->writer, RECORD_END, pair, count);
    return mcap_writer_end(&record->writer);
}
