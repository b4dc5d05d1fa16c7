/* Content negotiation: which of the media types we can make a client's Accept headers want. */
#ifndef ACCEPT_H
#define ACCEPT_H

#include <stddef.h>

#define ACCEPT_OFFERS_MAX 8

/* Quality of each offer, as far as the headers seen so far say. All zero: no range yet. */
struct accept_choice {
    unsigned range_count;                    /* readable ones */
    int quality[ACCEPT_OFFERS_MAX];          /* thousandths */
    unsigned specificity[ACCEPT_OFFERS_MAX]; /* 0 none, 1 star, 2 type, 3 exact */
};

/* Takes one Accept header's value into account (RFC 9110, 12.5.1). Unreadable ranges are passed
 * over. `offers` are plain lower-case media types, at most ACCEPT_OFFERS_MAX, the same each time.
 */
void accept_header(struct accept_choice *choice, const char *value, const char *const *offers,
                   size_t offer_count);

/* Index of the offer with the highest quality, the first of equals; -1: none is acceptable.
 * Without any readable range (no header, an empty one, rubbish) anything is, and the first offer is
 * taken. */
int accept_best(const struct accept_choice *choice, size_t offer_count);

#endif
