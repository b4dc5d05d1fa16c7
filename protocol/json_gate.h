/* The strict look at a JSON text (RFC 8259) that comes before cJSON, which accepts more than JSON
 * and silently damages some of it. */
#ifndef WIRE_JSON_GATE_H
#define WIRE_JSON_GATE_H

#include "protocol/wire.h"

enum wire_gate {
    WIRE_GATE_OK,         /* JSON, and cJSON reads it as it was meant */
    WIRE_GATE_FINDINGS,   /* JSON, but some values would be damaged: `*problem` points at them */
    WIRE_GATE_UNREADABLE, /* the same, and cJSON's tree would not even have its shape */
    WIRE_GATE_REFUSED,    /* not JSON, or over a limit: `*problem` says where and why */
};

/* Checks `bytes` bytes at `text` (no NUL needed; NULL when bytes is 0). Refused are: anything
 * outside the grammar, bytes that are not UTF-8, lone surrogates in escapes, a byte order mark,
 * more than one value; more than WIRE_DEPTH_MAX levels of lists and objects or WIRE_VALUES_MAX
 * values (INVALID_JSON), more than WIRE_BODY_MAX bytes (TOO_LARGE). Lines and columns count from 1,
 * columns in characters.
 *
 * Findings (INVALID_FIELD): integers beyond 2^53, numbers of more than WIRE_NUMBER_CHARACTERS_MAX
 * characters or too large for a double, strings and names with \u0000.
 *
 * `*problem` must be all zero; it is written unless the answer is OK. Time linear in `bytes`;
 * recursion at most WIRE_DEPTH_MAX deep; allocates nothing. Thread: any. */
enum wire_gate wire_gate_check(struct wire_problem *problem, const char *text, size_t bytes);

#define WIRE_NUMBER_CHARACTERS_MAX 63 /* what cJSON's buffer takes */

#endif
