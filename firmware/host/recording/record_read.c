/* firmware/host/recording/record_read.c - see record_read.h. */
#include "firmware/host/recording/record_read.h"

#include <cjson/cJSON.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/control/controller.h"
#include "firmware/host/base/number.h"
#include "firmware/host/recording/mcap_reader.h"

#define RECORD_MESSAGE_MAX 1024
#define RECORD_TOPIC_MAX   96
#define RECORD_SCHEMAS     16

enum record_channel_kind {
    RECORD_CHANNEL_OTHER,
    RECORD_CHANNEL_RUN,
    RECORD_CHANNEL_LOG,
    RECORD_CHANNEL_AXIS,
    RECORD_CHANNEL_SHOT,
};

struct record_channel {
    enum record_channel_kind kind;
    int index; /* axis or line of `rig`; -1: of none */
    enum units_axis unit;
};

struct record_reader {
    struct mcap_reader mcap;
    struct record_file *file;
    const struct rig *rig; /* of the rows */
    const struct record_taker *taker;
    const char *path;
    char *message;
    int64_t epoch_ns;
    uint32_t next; /* number of the row to come */
    bool has_row;
    struct telemetry_row row; /* of `rig` */
    enum units_axis schema_unit[RECORD_SCHEMAS];
    struct record_channel channel[MCAP_WRITER_CHANNELS];
};

static int record_fail(struct record_reader *reader, const char *what)
{
    snprintf(reader->message, YAML_MESSAGE_MAX, "%.300s: %.150s", reader->path,
             what);
    return -1;
}

static int record_fail_other(struct record_reader *reader)
{
    return record_fail(reader, "not a recording, expected one of slew run "
                               "--record");
}

const char *record_value(const struct record_pair pair[], unsigned count,
                         const char *key)
{
    for (unsigned i = 0; i < count; i++)
        if (strcmp(pair[i].key, key) == 0)
            return pair[i].value;
    return "";
}

/* Of a clock since 1970, so of more digits than number_parse takes. */
int64_t record_integer(const struct record_pair pair[], unsigned count,
                       const char *key)
{
    return strtoll(record_value(pair, count, key), NULL, 10);
}

/* --- what there is --- */

/* "slew.axis.mm" */
static void record_take_schema(struct record_reader *reader,
                               struct mcap_part *part)
{
    static const char prefix[] = "slew.axis.";
    const uint64_t number = mcap_part_number(part, 2);
    char name[64];
    if (!mcap_part_text(part, name, sizeof name) || number >= RECORD_SCHEMAS ||
        strncmp(name, prefix, sizeof prefix - 1) != 0)
        return;
    for (unsigned u = 0; u < UNITS_AXIS_WORDS; u++)
        if (strcmp(name + sizeof prefix - 1,
                   units_axis_text((enum units_axis)u)) == 0)
            reader->schema_unit[number] = (enum units_axis)u;
}

/* What follows `prefix`; NULL: the topic is another. */
static const char *record_after(const char *topic, const char *prefix)
{
    const size_t length = strlen(prefix);
    return strncmp(topic, prefix, length) == 0 &&
                   strlen(topic + length) < PLAN_NAME_MAX
               ? topic + length
               : NULL;
}

static int record_take_axis(struct record_reader *reader,
                            struct record_channel *channel, const char *name)
{
    struct rig *own = &reader->file->rig;
    const int known = rig_axis_index(own, name);
    channel->kind = RECORD_CHANNEL_AXIS;
    if (known < 0 && own->axis_count == RIG_AXES_MAX)
        return record_fail(reader, "more axes than a rig may have");
    if (known < 0)
        own->axis = memory_pool_more(&reader->file->memory, own->axis,
                                     own->axis_count, sizeof *own->axis);
    const uint32_t at = known < 0 ? own->axis_count++ : (uint32_t)known;
    snprintf(own->axis[at].name, PLAN_NAME_MAX, "%s", name);
    own->axis[at].unit = channel->unit;
    channel->index =
        reader->rig == own ? (int)at : rig_axis_index(reader->rig, name);
    if (channel->index < 0 ||
        reader->rig->axis[channel->index].unit != channel->unit) {
        char what[120];
        snprintf(what, sizeof what, "axis '%.31s' in %s is not one of this rig",
                 name, units_axis_text(channel->unit));
        return record_fail(reader, what);
    }
    return 0;
}

static int record_line_index(const struct rig *rig, const char *name)
{
    int number = 0;
    for (uint32_t i = 0; i < rig->line_count; i++) {
        if (rig->line[i].kind != RIG_LINE_TRIGGER)
            continue;
        if (strcmp(rig->line[i].name, name) == 0)
            return number;
        number++;
    }
    return -1;
}

static void record_take_line(struct record_reader *reader,
                             struct record_channel *channel, const char *name)
{
    struct rig *own = &reader->file->rig;
    channel->kind = RECORD_CHANNEL_SHOT;
    if (record_line_index(own, name) < 0 &&
        own->line_count < RIG_TRIGGERS_MAX) {
        own->line[own->line_count].kind = RIG_LINE_TRIGGER;
        snprintf(own->line[own->line_count++].name, PLAN_NAME_MAX, "%s", name);
    }
    channel->index = record_line_index(reader->rig, name);
}

static int record_take_channel(struct record_reader *reader,
                               struct mcap_part *part)
{
    const uint64_t number = mcap_part_number(part, 2);
    const uint64_t schema = mcap_part_number(part, 2);
    char topic[RECORD_TOPIC_MAX];
    const char *name;
    if (number >= MCAP_WRITER_CHANNELS || schema >= RECORD_SCHEMAS ||
        !mcap_part_text(part, topic, sizeof topic))
        return record_fail_other(reader);
    struct record_channel *channel = &reader->channel[number];
    *channel = (struct record_channel){ .unit = reader->schema_unit[schema],
                                        .index = -1 };
    if (strcmp(topic, RECORD_TOPIC_RUN) == 0)
        channel->kind = RECORD_CHANNEL_RUN;
    else if (strcmp(topic, RECORD_TOPIC_LOG) == 0)
        channel->kind = RECORD_CHANNEL_LOG;
    else if ((name = record_after(topic, RECORD_TOPIC_AXIS)) != NULL)
        return record_take_axis(reader, channel, name);
    else if ((name = record_after(topic, RECORD_TOPIC_SHOTS)) != NULL)
        record_take_line(reader, channel, name);
    return 0;
}

static unsigned record_take_pairs(struct mcap_part part,
                                  struct record_pair pair[RECORD_PAIRS_MAX])
{
    struct mcap_part map = mcap_part_bytes(&part, mcap_part_number(&part, 4));
    unsigned count = 0;
    while (map.at < map.end && count < RECORD_PAIRS_MAX) {
        (void)mcap_part_text(&map, pair[count].key, sizeof pair[count].key);
        (void)mcap_part_text(&map, pair[count].value, sizeof pair[count].value);
        count++;
    }
    return count;
}

static void record_take_metadata(struct record_reader *reader,
                                 struct mcap_part *part)
{
    struct record_file *file = reader->file;
    char name[32];
    if (!mcap_part_text(part, name, sizeof name))
        return;
    if (strcmp(name, RECORD_PLAN) == 0) {
        file->plan_count = record_take_pairs(*part, file->plan);
        reader->epoch_ns =
            record_integer(file->plan, file->plan_count, "epoch_ns");
    } else if (strcmp(name, RECORD_END) == 0) {
        file->end_count = record_take_pairs(*part, file->end);
    }
}

/* --- messages --- */

/* The next member of a flat object at *at, cut out of it; NULL: no more, or
 * something else. */
static const char *record_member(char **at, char **value)
{
    char *from = *at;
    if (*from != '{' && *from != ',')
        return NULL;
    if (from[1] != '"')
        return NULL;
    char *key = from + 2, *end = strchr(key, '"');
    if (end == NULL || end[1] != ':')
        return NULL;
    *end = 0;
    *value = end + 2;
    const bool quoted = **value == '"';
    *value += quoted;
    end = *value + strcspn(*value, quoted ? "\"" : ",}");
    if (*end == 0)
        return NULL;
    if (quoted) {
        *end++ = 0;
        *at = end;
    } else {
        *at = end; /* a number ends there by itself */
    }
    return key;
}

static int record_number(struct record_reader *reader, const char *value,
                         unsigned bits, int64_t *number)
{
    const char *end;
    if (number_parse(value, bits, number, &end) == 0 &&
        (*end == ',' || *end == '}'))
        return 0;
    return record_fail(reader, "a message has no number where one belongs");
}

static int record_take_run_member(struct record_reader *reader, const char *key,
                                  const char *value)
{
    struct telemetry_row *row = &reader->row;
    if (strcmp(key, "phase") == 0) {
        for (int p = 0; p < TELEMETRY_PHASES; p++)
            if (strcmp(value,
                       telemetry_phase_spelling((enum telemetry_phase)p)) == 0)
                row->phase = (enum telemetry_phase)p;
    } else if (strcmp(key, "state") == 0) {
        for (int s = CONTROLLER_OFF; s <= CONTROLLER_FAULT; s++)
            if (strcmp(value,
                       controller_state_text((enum controller_state)s)) == 0)
                row->state = s;
    } else if (strcmp(key, "path_ns") == 0) {
        return record_number(reader, value, 12, &row->rate.s_ns_q12);
    } else if (strcmp(key, "rate") == 0) {
        int64_t rate_q30 = 0;
        const int err = record_number(reader, value, 30, &rate_q30);
        row->rate.rate_q30 = rate_q30;
        return err;
    } else if (strcmp(key, "late_ns") == 0) {
        return record_number(reader, value, 0, &row->late_ns);
    }
    return 0;
}

static bool record_is_field(const char *key, size_t f, enum units_axis unit)
{
    char expected[48];
    snprintf(expected, sizeof expected, "%s_%s%s", telemetry_field[f].name,
             units_axis_text(unit), telemetry_field[f].per);
    return strcmp(key, expected) == 0;
}

static int record_take_axis_member(struct record_reader *reader,
                                   const struct record_channel *channel,
                                   const char *key, const char *value)
{
    struct telemetry_axis *axis = &reader->row.axis[channel->index];
    int64_t number = 0;
    if (strcmp(key, "statusword") == 0) {
        const int err = record_number(reader, value, 0, &number);
        axis->statusword = (uint16_t)number;
        return err;
    }
    for (size_t f = 0; f < TELEMETRY_FIELDS; f++) {
        if (!record_is_field(key, f, channel->unit))
            continue;
        if (record_number(reader, value, telemetry_field[f].bits, &number) < 0)
            return -1;
        telemetry_set(axis, f, number);
    }
    return 0;
}

static int record_take_shot_member(struct record_reader *reader,
                                   const struct record_channel *channel,
                                   const char *key, const char *value)
{
    struct telemetry_shot *shot = &reader->row.shot[channel->index];
    int64_t number = 0;
    if (record_number(reader, value, 0, &number) < 0)
        return -1;
    if (strcmp(key, "shot") == 0)
        shot->number = (uint32_t)number;
    else if (strcmp(key, "shot_ns") == 0)
        shot->t_ns = number;
    return 0;
}

static int record_take_members(struct record_reader *reader,
                               const struct record_channel *channel, char *text)
{
    char *value;
    const char *key;
    int err = 0;
    while (err == 0 && (key = record_member(&text, &value)) != NULL)
        switch (channel->kind) {
        case RECORD_CHANNEL_RUN:
            err = record_take_run_member(reader, key, value);
            break;
        case RECORD_CHANNEL_AXIS:
            err = record_take_axis_member(reader, channel, key, value);
            break;
        case RECORD_CHANNEL_SHOT:
            err = record_take_shot_member(reader, channel, key, value);
            break;
        case RECORD_CHANNEL_LOG:
        case RECORD_CHANNEL_OTHER:
            return 0;
        }
    if (err == 0 && strcmp(text, "}") != 0)
        return record_fail(reader, "a message is not one of slew run");
    return err;
}

static void record_take_note(struct record_reader *reader, int64_t t_ns,
                             const char *text)
{
    cJSON *note = cJSON_Parse(text);
    const cJSON *level = cJSON_GetObjectItemCaseSensitive(note, "level");
    const char *said =
        cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(note, "message"));
    if (said != NULL && cJSON_IsNumber(level) && reader->taker->note != NULL)
        reader->taker->note(reader->taker->context, t_ns,
                            level->valuedouble >= RECORD_ERROR ? RECORD_ERROR
                            : level->valuedouble >= RECORD_WARNING
                                ? RECORD_WARNING
                                : RECORD_INFO,
                            said);
    cJSON_Delete(note);
}

static void record_hand_row(struct record_reader *reader)
{
    if (reader->has_row && reader->taker->row != NULL)
        reader->taker->row(reader->taker->context, &reader->row);
    reader->file->rows += reader->has_row;
    reader->has_row = false;
}

/* A row begins with its message of the run. */
static void record_begin_row(struct record_reader *reader, uint32_t number,
                             int64_t t_ns)
{
    struct telemetry_row *row = &reader->row;
    record_hand_row(reader);
    if (number > reader->next)
        reader->file->rows_missing += number - reader->next;
    reader->next = number + 1;
    row->number = number;
    row->t_ns = t_ns;
    if (row->axis == NULL) {
        struct memory_pool *memory = &reader->file->memory;
        row->axis =
            memory_pool_new(memory, reader->rig->axis_count, sizeof *row->axis);
        row->shot_count = rig_trigger_count(reader->rig);
        row->shot = memory_pool_new(memory, row->shot_count, sizeof *row->shot);
    }
    memset(row->shot, 0, row->shot_count * sizeof *row->shot);
    reader->has_row = true;
}

static int record_take_message(struct record_reader *reader,
                               struct mcap_part *part)
{
    const uint64_t number = mcap_part_number(part, 2);
    const uint32_t sequence = (uint32_t)mcap_part_number(part, 4);
    const int64_t t_ns =
        (int64_t)(mcap_part_number(part, 8) - (uint64_t)reader->epoch_ns);
    char text[RECORD_MESSAGE_MAX];
    (void)mcap_part_number(part, 8);
    if (part->bad || number >= MCAP_WRITER_CHANNELS)
        return record_fail(reader, "a message is not one of slew run");
    const struct record_channel *channel = &reader->channel[number];
    if (channel->kind == RECORD_CHANNEL_OTHER)
        return 0;
    if ((size_t)(part->end - part->at) >= sizeof text)
        return record_fail(reader, "a message is not one of slew run");
    memcpy(text, part->at, (size_t)(part->end - part->at));
    text[part->end - part->at] = 0;
    if (channel->kind == RECORD_CHANNEL_LOG)
        record_take_note(reader, t_ns, text);
    if (channel->kind == RECORD_CHANNEL_RUN)
        record_begin_row(reader, sequence, t_ns);
    else if (channel->index < 0 || !reader->has_row)
        return 0;
    return record_take_members(reader, channel, text);
}

/* --- the file --- */

static int record_take(struct record_reader *reader, struct mcap_record *record)
{
    switch (record->opcode) {
    case MCAP_SCHEMA:
        record_take_schema(reader, &record->content);
        return 0;
    case MCAP_CHANNEL: /* none comes after the first row */
        return reader->row.axis == NULL
                   ? record_take_channel(reader, &record->content)
                   : 0;
    case MCAP_METADATA:
        record_take_metadata(reader, &record->content);
        return 0;
    case MCAP_MESSAGE:
        return record_take_message(reader, &record->content);
    default:
        return 0;
    }
}

static int record_read_all(struct record_reader *reader)
{
    struct mcap_record record;
    int got;
    while ((got = mcap_reader_next(&reader->mcap, &record)) == 1)
        if (record_take(reader, &record) < 0)
            return -1;
    if (got < 0)
        return reader->mcap.wrong == mcap_reader_other
                   ? record_fail_other(reader)
                   : record_fail(reader, reader->mcap.wrong);
    record_hand_row(reader);
    reader->file->ended = reader->file->end_count > 0;
    reader->file->damaged = reader->mcap.damaged;
    return reader->file->rig.axis_count > 0 ? 0 : record_fail_other(reader);
}

int record_read(struct record_file *file, const struct files *files,
                const char *path, const struct rig *wanted,
                const struct record_taker *taker,
                char message[YAML_MESSAGE_MAX])
{
    static const struct record_taker nobody = { .row = NULL };
    memset(file, 0, sizeof *file);
    struct memory_pool *memory = &file->memory;
    file->rig.line =
        memory_pool_new(memory, RIG_TRIGGERS_MAX, sizeof *file->rig.line);
    struct record_reader *reader = memory_pool_new(memory, 1, sizeof *reader);
    reader->file = file;
    reader->rig = wanted != NULL ? wanted : &file->rig;
    reader->taker = taker != NULL ? taker : &nobody;
    reader->path = path;
    reader->message = message;
    int err = mcap_reader_open(&reader->mcap, files, path);
    err =
        err < 0 ? record_fail(reader, strerror(-err)) : record_read_all(reader);
    mcap_reader_close(&reader->mcap);
    return err;
}

void record_file_free(struct record_file *file)
{
    memory_pool_free(&file->memory);
}

static char *record_copy(struct mcap_part *part, size_t *length)
{
    char media_type[64];
    (void)mcap_part_text(part, media_type, sizeof media_type);
    const struct mcap_part data =
        mcap_part_bytes(part, mcap_part_number(part, 8));
    if (data.bad)
        return NULL;
    *length = (size_t)(data.end - data.at);
    char *copy = memory_new(*length + 1, 1);
    memcpy(copy, data.at, *length);
    return copy;
}

char *record_attachment(const struct files *files, const char *path,
                        const char *name, size_t *length)
{
    struct mcap_reader reader;
    struct mcap_record record;
    char *copy = NULL;
    if (mcap_reader_open(&reader, files, path) < 0)
        return NULL;
    while (copy == NULL && mcap_reader_next(&reader, &record) == 1) {
        char its[FILES_PATH_MAX];
        if (record.opcode == MCAP_MESSAGE)
            break; /* attachments come before */
        if (record.opcode != MCAP_ATTACHMENT)
            continue;
        (void)mcap_part_bytes(&record.content, 8 + 8); /* times */
        if (mcap_part_text(&record.content, its, sizeof its) &&
            strcmp(its, name) == 0)
            copy = record_copy(&record.content, length);
    }
    mcap_reader_close(&reader);
    return copy;
}
