/* firmware/linux/fmu/fmu_export.c - see fmu_export.h. */
#define _GNU_SOURCE /* dladdr */
#include "firmware/linux/fmu/fmu_export.h"

#include <cjson/cJSON.h>
#include <dlfcn.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zip.h>

#include "firmware/host/base/memory.h"
#include "firmware/library/version.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/fmu/fmu_description.h"
#include "hal/support/crc32.h"

#define FILE_MAX (64 << 20)   /* bytes of one */
#define DATE     (1 << 5 | 1) /* 1980-01-01, the first that zip has */

#if defined __x86_64__
#define PLATFORM_2 "linux64"
#define PLATFORM_3 "x86_64-linux"
#elif defined __aarch64__
#define PLATFORM_2 "aarch64-linux"
#define PLATFORM_3 "aarch64-linux"
#else
#define PLATFORM_2 "linux"
#define PLATFORM_3 "unknown-linux"
#endif

static const char export_licences[] =
    "The binary is slew's, MIT licence, Copyright (c) 2026 slew contributors.\n"
    "It contains libyaml, MIT licence, Copyright (c) 2017-2020 Ingy dot Net,\n"
    "Copyright (c) 2006-2016 Kirill Simonov; libcjson, MIT licence, Copyright\n"
    "(c) 2009-2017 Dave Gamble and cJSON contributors, is beside it.\n\n"
    "Permission is hereby granted, free of charge, to any person obtaining a "
    "copy\nof this software and associated documentation files, to deal in the "
    "Software\nwithout restriction, including without limitation the rights to "
    "use, copy,\nmodify, merge, publish, distribute, sublicense, and/or sell "
    "copies of the\nSoftware, and to permit persons to whom the Software is "
    "furnished to do so,\nsubject to the following conditions: the above "
    "copyright notices and this\npermission notice shall be included in all "
    "copies or substantial portions of\nthe Software.\n\nTHE SOFTWARE IS "
    "PROVIDED \"AS IS\", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR\nIMPLIED, "
    "INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,\nFITNESS "
    "FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE\n"
    "AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER\n"
    "LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING "
    "FROM,\nOUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER "
    "DEALINGS IN THE\nSOFTWARE.\n";

struct export
{
    zip_t *zip;
    char *message;
};

static int export_fail(struct export *self, const char *what, const char *why)
{
    snprintf(self->message, FMU_EXPORT_MESSAGE, "%s: %s", what, why);
    return -1;
}

/* --- the archive --- */

static int export_put(struct export *self, const char *name,
                      zip_source_t *source)
{
    if (source == NULL)
        return export_fail(self, name, zip_strerror(self->zip));
    const zip_int64_t at =
        zip_file_add(self->zip, name, source, ZIP_FL_ENC_UTF_8);
    if (at < 0) {
        zip_source_free(source);
        return export_fail(self, name, zip_strerror(self->zip));
    }
    return zip_file_set_dostime(self->zip, (zip_uint64_t)at, 0, DATE, 0) == 0
               ? 0
               : export_fail(self, name, zip_strerror(self->zip));
}

/* `bytes` come from malloc and go with the archive. */
static int export_add(struct export *self, const char *name, char *bytes,
                      size_t size)
{
    zip_source_t *const source = zip_source_buffer(self->zip, bytes, size, 1);
    if (source == NULL)
        free(bytes);
    return export_put(self, name, source);
}

static int export_add_file(struct export *self, const char *name,
                           const char *path)
{
    char *bytes;
    const int64_t size = files_load(&disk_files, path, FILE_MAX, &bytes);
    if (size < 0)
        return export_fail(self, path, strerror((int)-size));
    return export_add(self, name, bytes, (size_t)size);
}

/* --- where the binary is --- */

/* Beside the program, as in build/, or in PREFIX/lib/slew of PREFIX/bin; looked
 * for from the program's directory upwards. */
static int export_binary(struct export *self, char path[FILES_PATH_MAX])
{
    static const char *const place[] = { "", "lib/slew/" };
    char program[FILES_PATH_MAX];
    const ssize_t length =
        readlink("/proc/self/exe", program, sizeof program - 1);

    program[length > 0 ? length : 0] = '\0';
    for (char *end; (end = strrchr(program, '/')) != NULL;) {
        end[0] = '\0';
        for (unsigned i = 0; i < 2; i++)
            if (snprintf(path, FILES_PATH_MAX, "%s/%sslew-fmu.so", program,
                         place[i]) < FILES_PATH_MAX &&
                access(path, R_OK) == 0)
                return 0;
    }
    return export_fail(self, "slew-fmu.so",
                       "the unit's binary is not there, expected it beside "
                       "the program or in ../lib/slew");
}

/* The library that the binary needs is the one that this program has. */
static int export_library(struct export *self, const char **path)
{
    Dl_info info;
    union {
        cJSON *(*call)(const char *, size_t);
        void *address;
    } const function = { .call = cJSON_ParseWithLength };

    if (dladdr(function.address, &info) == 0 || info.dli_fname == NULL)
        return export_fail(self, "libcjson", "where it is cannot be found");
    *path = info.dli_fname;
    return 0;
}

static int export_binaries(struct export *self, int version)
{
    char binary[FILES_PATH_MAX], name[96];
    const char *const platform = version == 3 ? PLATFORM_3 : PLATFORM_2;
    const char *library;

    if (export_binary(self, binary) < 0 || export_library(self, &library) < 0)
        return -1;
    snprintf(name, sizeof name, "binaries/%s/" FMU_IDENTIFIER ".so", platform);
    if (export_add_file(self, name, binary) < 0)
        return -1;
    snprintf(name, sizeof name, "binaries/%s/libcjson.so.1", platform);
    return export_add_file(self, name, library);
}

/* --- the files of the rig, and the token made of them --- */

struct export_token {
    uint32_t sum[4]; /* of the same bytes, from four beginnings */
};

static void export_sum(struct export_token *token, const void *bytes,
                       size_t size)
{
    for (unsigned i = 0; i < 4; i++)
        token->sum[i] = crc32_of(token->sum[i], bytes, size);
}

static int export_resources(struct export *self, const struct fmu_files *files,
                            struct export_token *token)
{
    char name[FILES_PATH_MAX];
    for (unsigned i = 0; i < files->count; i++) {
        const struct fmu_line *const line = &files->line[i];
        if (!fmu_line_is_plain(line))
            return export_fail(self, line->word[1],
                               "expected a name without tabs and line ends");
        for (unsigned w = 0; w < FMU_WORDS; w++)
            export_sum(token, line->word[w], strlen(line->word[w]) + 1);
        if (strcmp(line->word[0], "open") != 0)
            continue;
        char *bytes;
        const char *const path = line->word[1];
        const int64_t size = files_load(&disk_files, path, FILE_MAX, &bytes);
        if (size < 0)
            return export_fail(self, path, strerror((int)-size));
        export_sum(token, bytes, (size_t)size);
        snprintf(name, sizeof name, "resources/%s", line->word[2]);
        if (export_add(self, name, bytes, (size_t)size) < 0)
            return -1;
    }
    return 0;
}

static int export_list(struct export *self, const struct fmu_files *files,
                       const char *token)
{
    char *text = NULL;
    size_t size = 0;
    FILE *const file = open_memstream(&text, &size);
    if (file == NULL)
        return export_fail(self, FMU_LIST, "memory has run out");
    fprintf(file, "token\t%s\n", token);
    for (unsigned i = 0; i < files->count; i++)
        for (unsigned w = 0; w < FMU_WORDS; w++)
            fprintf(file, "%s%c", files->line[i].word[w],
                    w + 1 < FMU_WORDS ? '\t' : '\n');
    fclose(file);
    return export_add(self, "resources/" FMU_LIST, text, size);
}

static int export_description(struct export *self, const struct rig *rig,
                              int version, const char *token)
{
    char *text = NULL;
    size_t size = 0;
    FILE *const file = open_memstream(&text, &size);
    if (file == NULL)
        return export_fail(self, "modelDescription.xml", "memory has run out");
    fmu_describe(file, rig, version, token);
    fclose(file);
    return export_add(self, "modelDescription.xml", text, size);
}

static int export_licence(struct export *self)
{
    return export_put(self, "documentation/licenses/license.txt",
                      zip_source_buffer(self->zip, export_licences,
                                        sizeof export_licences - 1, 0));
}

static int export_all(struct export *self, const struct rig *rig,
                      const struct fmu_files *files, int version)
{
    struct export_token sums = { { 0, 1, 2, 3 } };
    char token[FMU_TOKEN_MAX];

    export_sum(&sums, SLEW_VERSION, sizeof SLEW_VERSION);
    export_sum(&sums, &version, sizeof version);
    if (export_resources(self, files, &sums) < 0)
        return -1;
    snprintf(token, sizeof token,
             "{%08" PRIx32 "-%04" PRIx32 "-%04" PRIx32 "-%04" PRIx32
             "-%04" PRIx32 "%08" PRIx32 "}",
             sums.sum[0], sums.sum[1] >> 16, sums.sum[1] & 0xFFFF,
             sums.sum[2] >> 16, sums.sum[2] & 0xFFFF, sums.sum[3]);
    return export_list(self, files, token) < 0 ||
                   export_description(self, rig, version, token) < 0 ||
                   export_binaries(self, version) < 0 ||
                   export_licence(self) < 0
               ? -1
               : 0;
}

/* The archive is made in memory: it goes into the file in one piece. */
static int export_write(struct export *self, zip_source_t *archive, FILE *file)
{
    zip_stat_t stat;
    if (zip_source_stat(archive, &stat) < 0 || zip_source_open(archive) < 0)
        return export_fail(self, "archive",
                           zip_error_strerror(zip_source_error(archive)));
    char *const bytes = memory_new((size_t)stat.size, 1);
    const zip_int64_t got = zip_source_read(archive, bytes, stat.size);
    zip_source_close(archive);
    if (got == (zip_int64_t)stat.size)
        (void)fwrite(bytes, 1, (size_t)stat.size, file); /* errors stay in it */
    memory_free(bytes);
    return got == (zip_int64_t)stat.size
               ? 0
               : export_fail(self, "archive", "cannot be read back");
}

int fmu_export(const struct rig *rig, const struct fmu_files *files,
               int version, FILE *file, char message[FMU_EXPORT_MESSAGE])
{
    struct export self = { .message = message };
    zip_error_t error;
    int err = -1;

    zip_error_init(&error);
    zip_source_t *const archive = zip_source_buffer_create(NULL, 0, 0, &error);
    if (archive != NULL) {
        zip_source_keep(archive); /* closing the archive gives one up */
        self.zip = zip_open_from_source(archive, ZIP_TRUNCATE, &error);
    }
    if (self.zip == NULL)
        (void)export_fail(&self, "archive", zip_error_strerror(&error));
    else if (export_all(&self, rig, files, version) < 0)
        zip_discard(self.zip);
    else if (zip_close(self.zip) < 0) {
        (void)export_fail(&self, "archive", zip_strerror(self.zip));
        zip_discard(self.zip);
    } else {
        err = export_write(&self, archive, file);
    }
    if (archive != NULL)
        zip_source_free(archive);
    zip_error_fini(&error);
    return err;
}
