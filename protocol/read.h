/* Reading single fields of a JSON document, and setting a few at its top: for clients.
 *
 * This is the lenient side: it looks into answers that a daemon wrote. What a service accepts from
 * strangers goes through wire_job_read. Values are views, valid until the document is closed or
 * changed; every look-up accepts NULL, so look-ups can be chained. One thread at a time for each
 * document. */
#ifndef WIRE_READ_H
#define WIRE_READ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct wire_read;  /* an open document */
struct wire_value; /* any value inside of one */

/* Parses `bytes` of `text` (need not end in NUL). NULL: not JSON, or out of memory. */
struct wire_read *wire_read_open(const char *text, size_t bytes);
/* Accepts NULL and sets it. */
void wire_read_close(struct wire_read **read);
const struct wire_value *wire_read_root(const struct wire_read *read);

/* Member `name` of an object (letter case counts); NULL where there is none. */
const struct wire_value *wire_read_get(const struct wire_value *object, const char *name);
/* How many members or elements; 0 for anything else. */
size_t wire_read_count(const struct wire_value *value);
/* First member or element, and the one after `value`; NULL at the end. */
const struct wire_value *wire_read_first(const struct wire_value *value);
const struct wire_value *wire_read_next(const struct wire_value *value);
/* A member's name; NULL for elements. */
const char *wire_read_key(const struct wire_value *value);

bool wire_read_is_object(const struct wire_value *value);
bool wire_read_is_array(const struct wire_value *value);
/* The text of a string; NULL for anything else. */
const char *wire_read_text(const struct wire_value *value);
/* A finite number; false and `*out` untouched for anything else. */
bool wire_read_f64(double *out, const struct wire_value *value);
/* An integer 0..2^53; false and `*out` untouched for anything else. */
bool wire_read_u64(uint64_t *out, const struct wire_value *value);
bool wire_read_bool(bool *out, const struct wire_value *value);

/* Sets member `name` of the top object, replacing an older one: to a string, or to what the JSON
 * text `json` says. False when the top is no object, `json` is no JSON, or memory is out. */
bool wire_read_set_text(struct wire_read *read, const char *name, const char *value);
bool wire_read_set_json(struct wire_read *read, const char *name, const char *json);
/* A value as JSON text without white space; numbers read back equal. On the heap, for free();
 * NULL: out of memory. */
char *wire_read_print(const struct wire_value *value);

#endif
