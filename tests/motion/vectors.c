/* tests/motion/vectors.c - build/tests/vectors FILE: reference values against
 * the integer core and the plants of the simulator.
 *
 * Prints `method cases worst_p worst_v worst_a tolerance PASS|FAIL` per method,
 * for physics `family/case quantity worst tolerance PASS|FAIL` per case.
 * Status 1 when one fails or the file holds something that is not known, 2 when
 * it cannot be read. */
#include "tests/motion/vectors.h"

#include <stdio.h>
#include <stdlib.h>

#include "tests/sim/vectors_physics.h"

#define ROWS_MAX 2048

/* What tells the kinds of file apart: a member of the first case. */
static const struct {
    const char *list, *member;
    int (*run)(const cJSON *file, struct vectors_row *rows, int capacity);
} kinds[] = {
    { "cases", "method", vectors_splines },
    { "curves", "keys", vectors_blender },
    { "cases", "inv_fraction", vectors_arclength },
    { "cases", "group_delay", vectors_shapers },
    { "cases", "stretch", vectors_fit },
    { "cases", "v", vectors_ease },
    { "cases", "frenet", vectors_frames },
    { "cases", "rig", vectors_kinematics },
    { "cases", "jmax", vectors_jerk_paths },
    { "cases", "kind", vectors_quaternions },
    { "cases", "family", vectors_physics },
};

static char *read_all(const char *path)
{
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    long size = -1;

    if (file == NULL)
        return NULL;
    if (fseek(file, 0, SEEK_END) == 0 && (size = ftell(file)) >= 0 &&
        fseek(file, 0, SEEK_SET) == 0)
        text = calloc(1, (size_t)size + 1);
    if (text != NULL && fread(text, 1, (size_t)size, file) != (size_t)size) {
        free(text);
        text = NULL;
    }
    fclose(file);
    return text;
}

static int run(const cJSON *file, const char *path, struct vectors_row *rows)
{
    if (cJSON_HasObjectItem(file, "waypoint_file"))
        return vectors_topp(file, path, rows);
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        const cJSON *list =
            cJSON_GetObjectItemCaseSensitive(file, kinds[i].list);
        if (cJSON_HasObjectItem(cJSON_GetArrayItem(list, 0), kinds[i].member))
            return kinds[i].run(file, rows, ROWS_MAX);
    }
    fprintf(stderr, "no kind of file that is known\n");
    return -1;
}

static int report(const struct vectors_row *rows, int count)
{
    int status = count > 0 ? 0 : 1;

    for (int i = 0; i < count; i++) {
        const char *verdict = rows[i].pass ? "PASS" : "FAIL";
        if (rows[i].text[0] != '\0')
            printf("%s %s %s\n", rows[i].method, rows[i].text, verdict);
        else
            printf("%s %u %.3g %.3g %.3g %.3g %s\n", rows[i].method,
                   rows[i].cases, rows[i].worst_p, rows[i].worst_v,
                   rows[i].worst_a, rows[i].tolerance, verdict);
        if (!rows[i].pass)
            status = 1;
    }
    return status;
}

int main(int argc, char **argv)
{
    static struct vectors_row rows[ROWS_MAX];
    char *text = argc == 2 ? read_all(argv[1]) : NULL;
    cJSON *file = text ? cJSON_Parse(text) : NULL;
    int status = 2;

    if (argc != 2)
        fprintf(stderr, "usage: vectors FILE\n");
    else if (file == NULL)
        fprintf(stderr, "%s: cannot be read\n", argv[1]);
    else
        status = report(rows, run(file, argv[1], rows));
    cJSON_Delete(file);
    free(text);
    return status;
}
