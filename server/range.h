/* The Range header of a GET: which bytes of a representation are wanted (RFC 9110, section 14). */
#ifndef RANGE_H
#define RANGE_H

#include <stdint.h>

enum range_kind {
    RANGE_WHOLE, /* no range, one that is malformed, or several: the whole, as the RFC allows */
    RANGE_PART,  /* these bytes */
    RANGE_UNSATISFIABLE /* well-formed, but beyond the end: 416 */
};

/* Reads a header's value for a representation of `total` bytes. `*first` and `*count` are set for
 * RANGE_PART only: 1 <= *count, *first + *count <= total. Thread: any. */
enum range_kind range_read(uint64_t *first, uint64_t *count, const char *header, uint64_t total);

#endif
