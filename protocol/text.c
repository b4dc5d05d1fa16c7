/* Small pieces of text that protocol's files share: UTF-8, numbers, quotes, JSON pointers. */
#include "protocol/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

size_t wire_utf8_sequence(const char *text, size_t bytes)
{
    const unsigned char *s = (const unsigned char *)text;
    if (bytes == 0)
        return 0;
    if (s[0] < 0x80)
        return 1;
    /* The second byte's range is where overlong forms, surrogates and too large values show. */
    unsigned char low = 0x80, high = 0xbf;
    size_t length;
    if (s[0] >= 0xc2 && s[0] <= 0xdf) {
        length = 2;
    } else if (s[0] >= 0xe0 && s[0] <= 0xef) {
        length = 3;
        low = s[0] == 0xe0 ? 0xa0 : low;
        high = s[0] == 0xed ? 0x9f : high;
    } else if (s[0] >= 0xf0 && s[0] <= 0xf4) {
        length = 4;
        low = s[0] == 0xf0 ? 0x90 : low;
        high = s[0] == 0xf4 ? 0x8f : high;
    } else {
        return 0;
    }
    if (bytes < length || s[1] < low || s[1] > high)
        return 0;
    for (size_t i = 2; i < length; i++)
        if (s[i] < 0x80 || s[i] > 0xbf)
            return 0;
    return length;
}

/* Where the last character that is whole within `bytes` ends. */
static size_t whole_characters(const char *text, size_t bytes)
{
    size_t start = bytes;
    while (start > 0 && bytes - start < 3 && ((unsigned char)text[start - 1] & 0xc0) == 0x80)
        start--;
    if (start == 0 || (unsigned char)text[start - 1] < 0xc0)
        return bytes; /* ASCII at the end, or no UTF-8 at all */
    start--;
    return wire_utf8_sequence(text + start, bytes - start) == bytes - start ? bytes : start;
}

void wire_text_print(char *out, size_t out_bytes, const char *format, va_list args)
{
    int wanted = vsnprintf(out, out_bytes, format, args);
    if (wanted < 0)
        out[0] = '\0';
    else if ((size_t)wanted >= out_bytes)
        out[whole_characters(out, out_bytes - 1)] = '\0';
}

void wire_text_quote(char out[WIRE_QUOTE_BYTES], const char *text)
{
    const size_t room = WIRE_QUOTE_BYTES - sizeof "\"...\"";
    size_t bytes = strlen(text);
    bool cut = bytes > room;
    if (cut)
        bytes = whole_characters(text, room);
    out[0] = '"';
    memcpy(out + 1, text, bytes);
    memcpy(out + 1 + bytes, cut ? "...\"" : "\"", cut ? sizeof "...\"" : sizeof "\"");
}

void wire_number_text(char out[WIRE_NUMBER_BYTES], double value)
{
    char text[WIRE_NUMBER_BYTES] = "0";
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    /* The locale decides about the decimal point, and only about that. */
    size_t to = 0;
    for (const char *from = text; *from; from++) {
        if (strchr("0123456789+-e", *from))
            out[to++] = *from;
        else if (to == 0 || out[to - 1] != '.')
            out[to++] = '.';
    }
    out[to] = '\0';
}

/* Adds `bytes` bytes that must stay together. */
static void pointer_add(struct wire_pointer *pointer, const char *piece, size_t bytes)
{
    if (pointer->cut)
        return;
    if (bytes > sizeof pointer->text - sizeof "..." - pointer->bytes) {
        piece = "...";
        bytes = 3;
        pointer->cut = true;
    }
    memcpy(pointer->text + pointer->bytes, piece, bytes);
    pointer->bytes += bytes;
    pointer->text[pointer->bytes] = '\0';
}

struct wire_pointer wire_pointer_key(struct wire_pointer parent, const char *key, size_t bytes)
{
    pointer_add(&parent, "/", 1);
    while (bytes > 0 && !parent.cut) {
        size_t length = wire_utf8_sequence(key, bytes);
        if (key[0] == '~')
            pointer_add(&parent, "~0", 2);
        else if (key[0] == '/')
            pointer_add(&parent, "~1", 2);
        else if (length == 0 || key[0] == '\0')
            pointer_add(&parent, "\xef\xbf\xbd", 3); /* U+FFFD: this text cannot hold it */
        else
            pointer_add(&parent, key, length);
        length = length == 0 ? 1 : length;
        key += length;
        bytes -= length;
    }
    return parent;
}

struct wire_pointer wire_pointer_index(struct wire_pointer parent, uint32_t index)
{
    char text[16];
    int bytes = snprintf(text, sizeof text, "/%u", index);
    pointer_add(&parent, text, (size_t)bytes);
    return parent;
}
