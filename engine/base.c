/* Error records and the words for codes. */
#include "engine/base.h"

#include <stdarg.h>
#include <stdio.h>

static const char *const code_texts[] = {
#define X(name, text) [LP_##name] = text,
    LP_CODES(X)
#undef X
};

const char *lp_code_text(enum lp_code code)
{
    size_t i = (size_t)code;
    return i < sizeof code_texts / sizeof code_texts[0] ? code_texts[i] : "unknown code";
}

enum lp_code lp_fail(struct lp_error *err, enum lp_code code, const char *where, const char *format,
                     ...)
{
    if (!err || err->code != LP_OK)
        return code;
    err->code = code;
    snprintf(err->where, sizeof err->where, "%s", where ? where : "");
    va_list args;
    va_start(args, format);
    vsnprintf(err->text, sizeof err->text, format, args);
    va_end(args);
    return code;
}
