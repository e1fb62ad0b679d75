/* motion/core/err.c - see err.h. */
#include "motion/core/err.h"

static const char *const err_text[] = { "done",
#define MOTION_ERR_TEXT(name, value, text) [-(value)] = (text),
                                        MOTION_ERR_LIST(MOTION_ERR_TEXT)
#undef MOTION_ERR_TEXT
};

const char *motion_err_text(int err)
{
    const unsigned index = err < 0 ? 0u - (unsigned)err : 0;
    return index < sizeof err_text / sizeof err_text[0] ? err_text[index]
                                                        : "unknown error";
}
