/* Content negotiation: which of the media types we can make a client's Accept headers want. */
#include "server/accept.h"

#include <stdbool.h>
#include <string.h>
#include <strings.h>

static const char *skip_space(const char *at)
{
    while (*at == ' ' || *at == '\t')
        at++;
    return at;
}

/* Whether a parameter list (";level=1;q=0.5") has a q; thousandths into *quality, 0 if unreadable
 * (a client that cannot say how much it likes a type does not get it). */
static int quality_read(const char *at, const char *end)
{
    while (at < end) {
        at = skip_space(at + 1); /* past the semicolon */
        const char *stop = memchr(at, ';', (size_t)(end - at));
        if (!stop)
            stop = end;
        if (stop - at >= 2 && (at[0] == 'q' || at[0] == 'Q') && at[1] == '=') {
            at += 2;
            int quality = *at == '1' ? 1000 : 0;
            if (at == stop || (*at != '0' && *at != '1'))
                return 0;
            at++;
            if (at < stop && *at == '.') {
                int unit = 100;
                for (at++; at < stop && *at >= '0' && *at <= '9'; at++, unit /= 10)
                    quality += unit * (*at - '0');
            }
            return quality > 1000 ? 1000 : quality;
        }
        at = stop;
    }
    return 1000;
}

/* 3 exact, 2 "type/" + star, 1 star/star, 0 no match. `range` is `n` long. */
static unsigned range_matches(const char *range, size_t n, const char *offer)
{
    const char *slash = strchr(offer, '/');
    size_t type = slash ? (size_t)(slash - offer) + 1 : 0;
    if (n == 3 && memcmp(range, "*/*", 3) == 0)
        return 1;
    if (n == type + 1 && range[n - 1] == '*' && strncasecmp(range, offer, type) == 0)
        return 2;
    return n == strlen(offer) && strncasecmp(range, offer, n) == 0 ? 3 : 0;
}

/* Something, a slash, something. */
static bool range_is_readable(const char *range, size_t n)
{
    const char *slash = n ? memchr(range, '/', n) : NULL;
    return slash && slash > range && slash + 1 < range + n;
}

void accept_header(struct accept_choice *choice, const char *value, const char *const *offers,
                   size_t offer_count)
{
    for (const char *at = value; *at;) {
        at = skip_space(at);
        const char *end = at + strcspn(at, ",");
        const char *parameters = memchr(at, ';', (size_t)(end - at));
        const char *stop = parameters ? parameters : end;
        size_t n = (size_t)(stop - at);
        while (n > 0 && (at[n - 1] == ' ' || at[n - 1] == '\t'))
            n--;
        choice->range_count += range_is_readable(at, n);
        int quality = parameters ? quality_read(parameters, end) : 1000;
        for (size_t i = 0; i < offer_count && i < ACCEPT_OFFERS_MAX; i++) {
            unsigned match = n ? range_matches(at, n, offers[i]) : 0;
            /* The most specific range decides; of equal ones the kindest. */
            if (match == 0 || match < choice->specificity[i] ||
                (match == choice->specificity[i] && quality <= choice->quality[i]))
                continue;
            choice->specificity[i] = match;
            choice->quality[i] = quality;
        }
        at = *end ? end + 1 : end;
    }
}

int accept_best(const struct accept_choice *choice, size_t offer_count)
{
    int best = -1, quality = 0;
    if (choice->range_count == 0)
        return offer_count > 0 ? 0 : -1;
    for (size_t i = 0; i < offer_count && i < ACCEPT_OFFERS_MAX; i++) {
        if (choice->quality[i] > quality) {
            best = (int)i;
            quality = choice->quality[i];
        }
    }
    return best;
}
