/* motion/core/err.h - every error code of slew, with its sentence, in one list.
 *
 * Functions return zero or more for an answer and one of these, negative, for
 * a refusal.  Codes say what kind of thing is wrong; where a person must know
 * which key, axis or field it was, the caller that has it adds that. */
#ifndef MOTION_CORE_ERR_H
#define MOTION_CORE_ERR_H

/* Around what a public header declares: C++ finds it by the names of C. */
#ifdef __cplusplus
#define MOTION_C_BEGIN extern "C" {
#define MOTION_C_END   }
#else
#define MOTION_C_BEGIN
#define MOTION_C_END
#endif

MOTION_C_BEGIN

/* X(name, value, sentence).  Values are stable within one build only. */
#define MOTION_ERR_LIST(X)                                                     \
    X(MOTION_E_RANGE, -1, "a value does not fit the range of its format")      \
    X(MOTION_E_ARG, -2, "an argument is not one of the allowed ones")          \
    X(MOTION_E_FULL, -3, "the buffer for the answer is full")                  \
    X(MOTION_E_ORDER, -4, "times do not increase")                             \
    X(MOTION_E_LIMIT, -5, "a limit would be broken")                           \
    X(MOTION_E_STATE, -6, "not possible in the present state")                 \
    X(MOTION_E_AGAIN, -7, "nothing there yet, try again later")                \
    X(MOTION_E_TIMEOUT, -8, "no answer in time")                               \
    X(MOTION_E_IO, -9, "the bus or device failed")                             \
    X(MOTION_E_PROTOCOL, -10, "the other side broke the protocol")             \
    X(MOTION_E_REFUSED, -11, "the other side refused")                         \
    X(MOTION_E_EMPTY, -12, "there is nothing to work on")                      \
    X(MOTION_E_WORK, -13, "it would take more work than is allowed")           \
    X(MOTION_E_AWAY, -14, "an axis is not where the motion begins")            \
    X(MOTION_E_UNHOMED, -15, "an axis has not been homed")                     \
    X(MOTION_E_UNREACHABLE, -16, "no position of the axes does this")          \
    X(MOTION_E_SINGULAR, -17, "a direction or rate is not determined there")   \
    X(MOTION_E_TOLERANCE, -18, "the tolerance cannot be met")                  \
    X(MOTION_E_DISCONTINUITY, -19, "position or velocity would jump")          \
    X(MOTION_E_DIVERGED, -20, "an iteration does not converge")

enum motion_err {
    MOTION_OK = 0,
#define MOTION_ERR_ENUM(name, value, text) name = value,
    MOTION_ERR_LIST(MOTION_ERR_ENUM)
#undef MOTION_ERR_ENUM
};

/* The sentence for a code; "done" for zero and above, "unknown error" for a
 * negative number that is not in the list.  Never NULL. */
const char *motion_err_text(int err);

MOTION_C_END

#endif
