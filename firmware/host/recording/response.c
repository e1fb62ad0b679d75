/* firmware/host/recording/response.c - see response.h. */
#include "firmware/host/recording/response.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/quote.h"
#include "motion/plan/shaper/shaper_fit.h"

#define RESPONSE_SEPARATORS ",; \t\r"
#define RESPONSE_WORD_MAX   48

struct response_read {
    struct response *response;
    const char *path, *column; /* column: NULL, or by name */
    char *message;
    unsigned line;  /* from 1 */
    unsigned index; /* of the measured column */
    double scale;   /* of times, to s */
    bool begun;     /* the header, or a row, has been read */
};

static int response_fail(const struct response_read *self, const char *what)
{
    snprintf(self->message, RESPONSE_MESSAGE_MAX, "%.200s:%u: %s", self->path,
             self->line, what);
    return -1;
}

/* The cell that begins at or behind *at, cut short where it is long; *at goes
 * behind it.  false: there is none. */
static bool response_cell(const char **at, char cell[RESPONSE_WORD_MAX])
{
    const char *from = *at + strspn(*at, " \t\r");
    const bool is_quoted = *from == '"';
    from += is_quoted;
    const size_t length = strcspn(from, is_quoted ? "\"" : RESPONSE_SEPARATORS);
    const size_t kept =
        length < RESPONSE_WORD_MAX - 1 ? length : RESPONSE_WORD_MAX - 1;

    if (*from == 0 && !is_quoted)
        return false;
    memcpy(cell, from, kept);
    cell[kept] = 0;
    from += length;
    from += is_quoted && *from == '"';
    from += strspn(from, " \t\r");
    if (*from == ',' || *from == ';')
        from++;
    *at = from;
    return true;
}

static bool response_number(const char *cell, double *value)
{
    char *end;

    if (cell[0] == 0 || strlen(cell) == RESPONSE_WORD_MAX - 1)
        return false;
    *value = strtod(cell, &end);
    return *end == 0 && isfinite(*value);
}

static bool response_ends(const char *name, const char *end)
{
    const size_t length = strlen(name), tail = strlen(end);

    return length >= tail && strcmp(name + length - tail, end) == 0;
}

static int response_header(struct response_read *self, const char *line)
{
    const char *const header = line;
    char cell[RESPONSE_WORD_MAX];

    self->index = self->column == NULL ? 1 : 0;
    for (unsigned i = 0; i < RESPONSE_COLUMNS_MAX && response_cell(&line, cell);
         i++) {
        if (i == 0)
            self->scale = response_ends(cell, "_ns")   ? 1e-9
                          : response_ends(cell, "_us") ? 1e-6
                          : response_ends(cell, "_ms") ? 1e-3
                                                       : 1;
        else if (self->column != NULL && strcmp(cell, self->column) == 0)
            self->index = i;
    }
    if (self->index > 0)
        return 0;
    char column[QUOTE_MAX], names[QUOTE_MAX], what[3 * QUOTE_MAX];
    snprintf(what, sizeof what, "--axis: no column %s behind the time in %s",
             quote_text(column, self->column, strlen(self->column)),
             quote_text(names, header, strlen(header)));
    return response_fail(self, what);
}

static int response_row(struct response_read *self, const char *line)
{
    struct response *response = self->response;
    char cell[RESPONSE_WORD_MAX];
    double value[2] = { 0, 0 };
    bool has[2] = { false, false };

    for (unsigned i = 0; i <= self->index && response_cell(&line, cell); i++)
        if (i == 0 || i == self->index)
            has[i != 0] = response_number(cell, &value[i != 0]);
    if (!has[0] || !has[1])
        return response_fail(self, "expected a time and a number in the "
                                   "measured column");
    if (response->rows == PLAN_SHAPER_FIT_ROWS_MAX)
        return response_fail(self, "there are more than 200000 rows");
    value[0] *= self->scale;
    if (response->rows > 0 && !(value[0] > response->t_s[response->rows - 1]))
        return response_fail(self, "the time is not later than that of the "
                                   "row before");
    response->t_s[response->rows] = value[0];
    response->x[response->rows++] = value[1];
    return 0;
}

static int response_line(struct response_read *self, const char *line)
{
    const char *at = line;
    char cell[RESPONSE_WORD_MAX];
    double time;

    self->line++;
    if (!response_cell(&at, cell) || cell[0] == '#')
        return 0;
    if (self->begun)
        return response_row(self, line);
    self->begun = true;
    if (!response_number(cell, &time))
        return response_header(self, line);
    if (self->column != NULL)
        return response_fail(self, "there is no header that --axis could name "
                                   "a column of");
    return response_row(self, line);
}

/* Lines end with LF, or CR LF. */
static int response_lines(struct response_read *self, char *data)
{
    int err = 0;

    while (err == 0 && *data != 0) {
        char *end = data + strcspn(data, "\n");
        const bool last = *end == 0;
        *end = 0;
        err = response_line(self, data);
        data = last ? end : end + 1;
    }
    return err;
}

int response_read(const struct files *files, const char *path,
                  const char *column, struct response *response,
                  char message[RESPONSE_MESSAGE_MAX])
{
    struct response_read self = { .response = response,
                                  .path = path,
                                  .column = column,
                                  .message = message,
                                  .index = 1,
                                  .scale = 1 };
    char *data = NULL;
    const int64_t length =
        files_load_text(files, path, RESPONSE_BYTES_MAX, &data);
    int err;

    *response = (struct response){ .rows = 0 };
    if (length < 0) {
        snprintf(message, RESPONSE_MESSAGE_MAX, "%.200s: %s", path,
                 strerror((int)-length));
        return -1;
    }
    response->t_s = memory_new(PLAN_SHAPER_FIT_ROWS_MAX, sizeof *response->t_s);
    response->x = memory_new(PLAN_SHAPER_FIT_ROWS_MAX, sizeof *response->x);
    if (strlen(data) != (size_t)length) {
        snprintf(message, RESPONSE_MESSAGE_MAX,
                 "%.200s: has a NUL in it, expected CSV", path);
        err = -1;
    } else {
        err = response_lines(&self, data);
    }
    memory_free(data);
    return err;
}

void response_free(struct response *response)
{
    memory_free(response->t_s);
    memory_free(response->x);
    *response = (struct response){ .rows = 0 };
}
