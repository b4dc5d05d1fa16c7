/* Codes, errors, small vectors and checked sizes: what every file of the engine shares. */
#ifndef LP_BASE_H
#define LP_BASE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LP_VERSION "0.1.0"

/* What went wrong, coarsely: the caller decides on it; the sentence for people is in lp_error. */
#define LP_CODES(X)                                                                                \
    X(OK, "ok")                                                                                    \
    X(INVALID, "invalid input")                                                                    \
    X(CORRUPT, "damaged file")                                                                     \
    X(UNSUPPORTED, "not in this version")                                                          \
    X(LIMIT, "over a limit")                                                                       \
    X(NOT_FOUND, "not found")                                                                      \
    X(IO, "input or output failed")                                                                \
    X(NO_SPACE, "disk full")                                                                       \
    X(NO_MEMORY, "out of memory")                                                                  \
    X(CANCELLED, "cancelled")

enum lp_code {
#define X(name, text) LP_##name,
    LP_CODES(X)
#undef X
};

#define LP_MUST_CHECK __attribute__((warn_unused_result))
#define LP_PRINTF(format_index, first_index)                                                       \
    __attribute__((format(printf, format_index, first_index)))

#define LP_ERROR_WHERE_BYTES 160
#define LP_ERROR_TEXT_BYTES  384

/* The detail of a failure, owned by the caller; all zero means "no failure yet". */
struct lp_error {
    enum lp_code code;                /* LP_OK while nothing failed */
    char where[LP_ERROR_WHERE_BYTES]; /* file, section, field or flag; may be empty */
    char text[LP_ERROR_TEXT_BYTES];   /* one sentence: what, and the way out */
};

/* Records a failure and returns its code, so that `return lp_fail(...)` reads well. The first
 * failure is kept; `err` may be NULL. Thread: any. */
enum lp_code lp_fail(struct lp_error *err, enum lp_code code, const char *where, const char *format,
                     ...) LP_PRINTF(4, 5);

/* The few words of LP_CODES for a code. Thread: any. */
const char *lp_code_text(enum lp_code code);

/* A point or direction in octree space (unit: voxels, `_os`) or in the world (metres, `_ws`). */
typedef struct lp_vec3 {
    float x, y, z;
} lp_vec3;

/* Size arithmetic that says when it does not fit; `*out` is untouched then. */
static inline LP_MUST_CHECK bool lp_size_mul(size_t a, size_t b, size_t *out)
{
    size_t r;
    if (__builtin_mul_overflow(a, b, &r))
        return false;
    *out = r;
    return true;
}

static inline LP_MUST_CHECK bool lp_size_add(size_t a, size_t b, size_t *out)
{
    size_t r;
    if (__builtin_add_overflow(a, b, &r))
        return false;
    *out = r;
    return true;
}

#endif
