/* Small pieces of text that protocol's files share: UTF-8, numbers, quotes, JSON pointers.
 * Everything here may be called from any thread and allocates nothing. */
#ifndef WIRE_TEXT_H
#define WIRE_TEXT_H

#include "protocol/wire.h"

#include <stdarg.h>

#define WIRE_NUMBER_BYTES 32 /* "-1.7976931348623157e+308" and room */
#define WIRE_QUOTE_BYTES  56

/* Length (1..4) of the well-formed UTF-8 sequence (RFC 3629: no overlong forms, no surrogates,
 * nothing above U+10FFFF) that starts at `text`, of which `bytes` can be read; 0: there is none. */
size_t wire_utf8_sequence(const char *text, size_t bytes);

/* vsnprintf that never leaves half a character at the end of a text that was cut. */
void wire_text_print(char *out, size_t out_bytes, const char *format, va_list args)
    __attribute__((format(printf, 3, 0)));

/* The text in double quotes for a sentence, shortened with "..." where it is long. */
void wire_text_quote(char out[WIRE_QUOTE_BYTES], const char *text);

/* The shortest of 15, 16 or 17 digits that reads back equal, in JSON's grammar whatever the locale.
 * `value` must be finite. */
void wire_number_text(char out[WIRE_NUMBER_BYTES], double value);

/* A JSON pointer (RFC 6901) under construction; a value. One that is too long ends in "...". */
struct wire_pointer {
    char text[sizeof((struct wire_field_error *)0)->pointer];
    size_t bytes; /* of text, NUL not counted */
    bool cut;     /* nothing is added any more */
};

static inline struct wire_pointer wire_pointer_root(void)
{
    return (struct wire_pointer){.bytes = 0};
}

/* `parent` and one more step: a field (its name of `bytes` bytes, UTF-8, not escaped) ... */
struct wire_pointer wire_pointer_key(struct wire_pointer parent, const char *key, size_t bytes);
/* ... or an element. */
struct wire_pointer wire_pointer_index(struct wire_pointer parent, uint32_t index);

#endif
