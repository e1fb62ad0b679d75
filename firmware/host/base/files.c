/* firmware/host/base/files.c - see files.h. */
#include "firmware/host/base/files.h"

#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"

const char *files_error(int err)
{
    return err == FILES_E_KIND    ? "it is not a regular file"
           : err == FILES_E_PLACE ? "it is not below the folder of the rig"
                                  : strerror(-err);
}

/* --- all of it --- */

/* Twice the room, for the 0 too. */
static int files_grow(char **data, size_t *storage)
{
    char *larger = realloc(*data, 2 * *storage + 1);

    if (larger == NULL)
        return -ENOMEM;
    *data = larger;
    *storage *= 2;
    return 0;
}

static int64_t files_read_all(const struct files *files, int file, size_t max,
                              char **data)
{
    size_t length = 0, storage = FILES_PIECE / 2;
    int64_t got;

    do {
        if ((*data == NULL || length == storage) &&
            files_grow(data, &storage) < 0)
            return -ENOMEM;
        got =
            files->read(files, file, *data + length, storage - length, length);
        length += got > 0 ? (size_t)got : 0;
    } while (got > 0 && length <= max);
    if (got >= 0)
        (*data)[length] = 0;
    return got < 0 ? got : length > max ? -EFBIG : (int64_t)length;
}

int64_t files_load(const struct files *files, const char *path, size_t max,
                   char **data)
{
    const int file = files->open(files, path);

    *data = NULL;
    if (file < 0)
        return file;
    const int64_t length = files_read_all(files, file, max, data);
    files->close(files, file);
    if (length < 0) {
        free(*data);
        *data = NULL;
    }
    return length;
}

/* --- byte order marks --- */

static unsigned files_utf16_at(const unsigned char *from, bool is_big)
{
    return is_big ? (unsigned)from[0] << 8 | from[1]
                  : (unsigned)from[1] << 8 | from[0];
}

static size_t files_put_utf8(char *to, uint32_t character)
{
    static const unsigned char first[] = { 0, 0, 0xC0, 0xE0, 0xF0 };
    const unsigned count = character < 0x80      ? 1
                           : character < 0x800   ? 2
                           : character < 0x10000 ? 3
                                                 : 4;

    for (unsigned i = count; i-- > 1; character >>= 6)
        to[i] = (char)(0x80 | (character & 0x3F));
    to[0] = (char)(first[count] | character);
    return count;
}

/* Half of a pair without the other becomes U+FFFD. */
static int64_t files_from_utf16(char **data, size_t length, bool is_big)
{
    const unsigned char *from = (const unsigned char *)*data;
    char *text = malloc(length / 2 * 3 + 1);
    size_t used = 0;

    for (size_t i = 2; text != NULL && i + 1 < length; i += 2) {
        uint32_t unit = files_utf16_at(from + i, is_big);
        if (unit >= 0xD800 && unit < 0xE000) {
            const uint32_t low =
                i + 3 < length ? files_utf16_at(from + i + 2, is_big) : 0;
            const bool is_pair = unit < 0xDC00 && low >= 0xDC00 && low < 0xE000;
            unit = is_pair ? 0x10000 + ((unit - 0xD800) << 10) + low - 0xDC00
                           : 0xFFFD;
            i += is_pair ? 2 : 0;
        }
        used += files_put_utf8(text + used, unit);
    }
    free(*data);
    *data = text;
    if (text == NULL)
        return -ENOMEM;
    text[used] = 0;
    return (int64_t)used;
}

int64_t files_load_text(const struct files *files, const char *path, size_t max,
                        char **data)
{
    const int64_t length = files_load(files, path, max, data);
    const unsigned char *begin = (const unsigned char *)*data;

    if (length >= 3 && memcmp(begin, "\xEF\xBB\xBF", 3) == 0) {
        memmove(*data, *data + 3, (size_t)length - 2);
        return length - 3;
    }
    if (length >= 2 && ((begin[0] == 0xFF && begin[1] == 0xFE) ||
                        (begin[0] == 0xFE && begin[1] == 0xFF)))
        return files_from_utf16(data, (size_t)length, begin[0] == 0xFE);
    return length;
}

/* --- line by line --- */

int files_lines_open(struct files_lines *lines, const struct files *files,
                     const char *path)
{
    lines->files = files;
    lines->error = 0;
    lines->offset = 0;
    lines->at = lines->got = lines->capacity = 0;
    lines->line = NULL;
    lines->file = files->open(files, path);
    return lines->file < 0 ? lines->file : 0;
}

void files_lines_close(struct files_lines *lines)
{
    if (lines->file >= 0)
        lines->files->close(lines->files, lines->file);
    memory_free(lines->line);
}

/* The next piece of the file; false at its end. */
static bool files_lines_fill(struct files_lines *lines)
{
    const int64_t got = lines->files->read(
        lines->files, lines->file, lines->piece, FILES_PIECE, lines->offset);

    lines->at = 0;
    lines->got = got > 0 ? (size_t)got : 0;
    lines->offset += lines->got;
    lines->error = got < 0 ? (int)got : 0;
    return got > 0;
}

static void files_lines_append(struct files_lines *lines, size_t length,
                               const char *from, size_t size)
{
    if (length + size + 1 > lines->capacity) {
        lines->capacity = 2 * (length + size + 1);
        lines->line = memory_resize(lines->line, lines->capacity, 1);
    }
    memcpy(lines->line + length, from, size);
    lines->line[length + size] = 0;
}

int64_t files_lines_next(struct files_lines *lines)
{
    size_t length = 0;

    for (bool any = false;; any = true) {
        if (lines->at == lines->got && !files_lines_fill(lines))
            return any && lines->error == 0 ? (int64_t)length : -1;
        const char *from = lines->piece + lines->at;
        const size_t left = lines->got - lines->at;
        const char *end = memchr(from, '\n', left);
        const size_t size = end == NULL ? left : (size_t)(end - from);
        files_lines_append(lines, length, from, size);
        length += size;
        lines->at += size + (end != NULL);
        if (end != NULL)
            return (int64_t)length;
        if (length > FILES_LINE_MAX) {
            lines->error = -EFBIG;
            return -1;
        }
    }
}
