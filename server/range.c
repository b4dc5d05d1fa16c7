/* Reading `bytes=first-last`, `bytes=first-` and `bytes=-suffix`. */
#include "server/range.h"

#include <stdbool.h>
#include <string.h>
#include <strings.h>

/* Digits up to a sign that is none; numbers beyond 2^64 count as the largest. */
static bool number_read(uint64_t *out, const char **at)
{
    uint64_t value = 0;
    const char *begin = *at;
    for (; **at >= '0' && **at <= '9'; (*at)++) {
        uint64_t digit = (uint64_t)(**at - '0');
        value = value > (UINT64_MAX - digit) / 10 ? UINT64_MAX : value * 10 + digit;
    }
    *out = value;
    return *at != begin;
}

static const char *blanks_skip(const char *at)
{
    return at + strspn(at, " \t");
}

enum range_kind range_read(uint64_t *first, uint64_t *count, const char *header, uint64_t total)
{
    static const char unit[] = "bytes=";
    uint64_t from = 0, to = UINT64_MAX;
    if (!header || strncasecmp(header, unit, sizeof unit - 1) != 0)
        return RANGE_WHOLE;
    const char *at = blanks_skip(header + sizeof unit - 1);
    bool has_from = number_read(&from, &at);
    if (*at++ != '-')
        return RANGE_WHOLE;
    bool has_to = number_read(&to, &at);
    to = has_to ? to : UINT64_MAX;
    if (*blanks_skip(at) || (!has_from && !has_to) || (has_from && to < from))
        return RANGE_WHOLE;
    if (!has_from) { /* the last `to` bytes */
        if (to == 0 || total == 0)
            return RANGE_UNSATISFIABLE;
        *count = to < total ? to : total;
        *first = total - *count;
        return RANGE_PART;
    }
    if (from >= total)
        return RANGE_UNSATISFIABLE;
    *first = from;
    *count = (to < total ? to + 1 : total) - from;
    return RANGE_PART;
}
