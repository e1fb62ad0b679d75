/* motion/core/err.c - see err.h. */
#include "motion/core/err.h"

#include <stddef.h>

static const struct {
    int err;
    const char *text;
} err_row[] = {
#define MOTION_ERR_ROW(name, value, text) { value, text },
    MOTION_ERR_LIST(MOTION_ERR_ROW)
#undef MOTION_ERR_ROW
};

const char *motion_err_text(int err)
{
    if (err >= 0)
        return "done";
    for (size_t i = 0; i < sizeof(err_row) / sizeof(err_row[0]); i++) {
        if (err_row[i].err == err)
            return err_row[i].text;
    }
    return "unknown error";
}
