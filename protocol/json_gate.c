/* The strict look at a JSON text (RFC 8259) that comes before cJSON. */
#include "protocol/json_gate.h"

#include "protocol/text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* One list or object that is open at the moment: the way to the value being read. */
struct gate_frame {
    bool object;
    uint32_t index;   /* of the element, in a list */
    size_t key;       /* where the field's name starts, escapes and all, in an object */
    size_t key_bytes; /* its length in the text */
};

struct gate {
    struct wire_problem *problem;  /* what refuses the text */
    struct wire_problem *findings; /* what would be damaged; counts only if nothing refuses */
    bool readable;
    const char *text;
    size_t bytes, at; /* at <= bytes */
    uint32_t values, depth;
    struct gate_frame frames[WIRE_DEPTH_MAX];
};

/* ---- sentences ---------------------------------------------------------------------------------
 */

/* "line 2, column 5: <sentence>". Always false, to be returned. */
__attribute__((format(printf, 3, 4))) static bool refuse(struct gate *gate, size_t at,
                                                         const char *format, ...)
{
    size_t line = 1, column = 1;
    for (size_t i = 0; i < at; i++) {
        if (gate->text[i] == '\n') {
            line++;
            column = 1;
        } else if (((unsigned char)gate->text[i] & 0xc0) != 0x80) {
            column++;
        }
    }
    char sentence[256];
    va_list args;
    va_start(args, format);
    wire_text_print(sentence, sizeof sentence, format, args);
    va_end(args);
    wire_problem_set(gate->problem, WIRE_PROBLEM_INVALID_JSON, "line %zu, column %zu: %s", line,
                     column, sentence);
    return false;
}

/* What stands at the place that was read to. */
static void describe(char out[32], const struct gate *gate)
{
    if (gate->at >= gate->bytes) {
        snprintf(out, 32, "the end of the text");
        return;
    }
    unsigned char c = (unsigned char)gate->text[gate->at];
    size_t length = wire_utf8_sequence(gate->text + gate->at, gate->bytes - gate->at);
    if (length == 0)
        snprintf(out, 32, "the byte 0x%02x", c);
    else if (c < 0x20 || c == 0x7f)
        snprintf(out, 32, "the control character U+%04X", c);
    else
        snprintf(out, 32, "%s%.*s%s", c == '"' ? "" : "\"", (int)length, gate->text + gate->at,
                 c == '"' ? "" : "\"");
}

static bool expected(struct gate *gate, const char *what)
{
    char found[32];
    describe(found, gate);
    return refuse(gate, gate->at, "expected %s, found %s", what, found);
}

/* The pointer to the value that is being read, or with `levels` one less to the object around. */
static struct wire_pointer path(const struct gate *gate, uint32_t levels);

/* ---- characters --------------------------------------------------------------------------------
 */

static char peek(const struct gate *gate)
{
    return gate->at < gate->bytes ? gate->text[gate->at] : '\0';
}

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static void skip_space(struct gate *gate)
{
    while (gate->at < gate->bytes) {
        char c = gate->text[gate->at];
        if (c != ' ' && c != '\t' && c != '\n' && c != '\r')
            return;
        gate->at++;
    }
}

/* The value of four hexadecimal digits, or -1. */
static int hex4(const char *text, size_t bytes)
{
    int value = 0;
    if (bytes < 4)
        return -1;
    for (int i = 0; i < 4; i++) {
        char c = text[i];
        int digit = is_digit(c)              ? c - '0'
                    : (c >= 'a' && c <= 'f') ? c - 'a' + 10
                    : (c >= 'A' && c <= 'F') ? c - 'A' + 10
                                             : -1;
        if (digit < 0)
            return -1;
        value = value * 16 + digit;
    }
    return value;
}

/* ---- strings -----------------------------------------------------------------------------------
 */

/* A \u escape, `at` on its 'u'. */
static bool check_unicode_escape(struct gate *gate, bool *has_nul)
{
    size_t start = gate->at - 1;
    int unit = hex4(gate->text + gate->at + 1, gate->bytes - gate->at - 1);
    if (unit < 0)
        return refuse(gate, start, "expected four hexadecimal digits after \\u");
    gate->at += 5;
    if (unit >= 0xdc00 && unit <= 0xdfff)
        return refuse(gate, start, "\\u%04x is the second half of a character without the first",
                      (unsigned)unit);
    if (unit >= 0xd800 && unit <= 0xdbff) {
        int second = -1;
        if (gate->bytes - gate->at >= 6 && gate->text[gate->at] == '\\' &&
            gate->text[gate->at + 1] == 'u')
            second = hex4(gate->text + gate->at + 2, 4);
        if (second < 0xdc00 || second > 0xdfff)
            return refuse(gate, start,
                          "\\u%04x is the first half of a character without the second",
                          (unsigned)unit);
        gate->at += 6;
    }
    *has_nul |= unit == 0;
    return true;
}

/* A string, `at` on its opening quote. */
static bool check_string(struct gate *gate, bool *has_nul)
{
    size_t start = gate->at++;
    *has_nul = false;
    while (gate->at < gate->bytes) {
        unsigned char c = (unsigned char)gate->text[gate->at];
        if (c == '"') {
            gate->at++;
            return true;
        }
        if (c < 0x20)
            return refuse(gate, gate->at,
                          "a control character (U+%04X) inside a string; write it as \\u%04x", c,
                          c);
        if (c == '\\') {
            gate->at++;
            char escape = peek(gate);
            if (escape == 'u') {
                if (!check_unicode_escape(gate, has_nul))
                    return false;
            } else if (escape != '\0' && strchr("\"\\/bfnrt", escape)) {
                gate->at++;
            } else {
                return expected(gate, "one of \" \\ / b f n r t u after the backslash");
            }
            continue;
        }
        size_t length = wire_utf8_sequence(gate->text + gate->at, gate->bytes - gate->at);
        if (length == 0)
            return refuse(gate, gate->at, "the byte 0x%02x is not UTF-8", c);
        gate->at += length;
    }
    return refuse(gate, start, "this string is not closed: expected \" before the end of the text");
}

/* One character of a string that was checked, as UTF-8 into `out`; returns bytes used up. */
static size_t decode_character(char out[4], size_t *out_bytes, const char *text, size_t bytes)
{
    static const char letters[] = "\"\\/bfnrt", meant[] = "\"\\/\b\f\n\r\t";
    if (text[0] != '\\') {
        *out_bytes = wire_utf8_sequence(text, bytes);
        memcpy(out, text, *out_bytes);
        return *out_bytes;
    }
    if (text[1] != 'u') {
        out[0] = meant[strchr(letters, text[1]) - letters];
        *out_bytes = 1;
        return 2;
    }
    unsigned value = (unsigned)hex4(text + 2, 4);
    size_t used = 6;
    if (value >= 0xd800 && value <= 0xdbff) {
        value = 0x10000 + ((value - 0xd800) << 10) + ((unsigned)hex4(text + 8, 4) - 0xdc00);
        used = 12;
    }
    *out_bytes = value < 0x80 ? 1 : value < 0x800 ? 2 : value < 0x10000 ? 3 : 4;
    for (size_t i = *out_bytes; i-- > 1; value >>= 6)
        out[i] = (char)(0x80 | (value & 0x3f));
    static const unsigned char lead[5] = {0, 0, 0xc0, 0xe0, 0xf0};
    out[0] = (char)(lead[*out_bytes] | value);
    return used;
}

static struct wire_pointer path(const struct gate *gate, uint32_t levels)
{
    struct wire_pointer pointer = wire_pointer_root();
    for (uint32_t i = 0; i < levels; i++) {
        const struct gate_frame *frame = &gate->frames[i];
        if (!frame->object) {
            pointer = wire_pointer_index(pointer, frame->index);
            continue;
        }
        /* A pointer holds no more than its own size of a name. */
        char name[sizeof pointer.text + 4];
        size_t name_bytes = 0, at = 0;
        while (at < frame->key_bytes && name_bytes < sizeof pointer.text) {
            size_t bytes;
            at += decode_character(name + name_bytes, &bytes, gate->text + frame->key + at,
                                   frame->key_bytes - at);
            name_bytes += bytes;
        }
        pointer = wire_pointer_key(pointer, name, name_bytes);
    }
    return pointer;
}

/* ---- numbers -----------------------------------------------------------------------------------
 */

/* Whether a number of the grammar, at most WIRE_NUMBER_CHARACTERS_MAX long, rounds to infinity.
 * The point is taken out first: strtod would look for the locale's. */
static bool number_overflows(const char *text, size_t bytes)
{
    char digits[WIRE_NUMBER_CHARACTERS_MAX + 16];
    size_t count = 0, i = text[0] == '-' ? 1 : 0;
    long exponent = 0;
    bool fraction = false;
    for (; i < bytes && text[i] != 'e' && text[i] != 'E'; i++) {
        if (text[i] == '.') {
            fraction = true;
            continue;
        }
        digits[count++] = text[i];
        exponent -= fraction;
    }
    if (i < bytes) {
        bool negative = text[++i] == '-';
        i += text[i] == '-' || text[i] == '+';
        long given = 0;
        for (; i < bytes; i++)
            given = given > 99999 ? given : given * 10 + (text[i] - '0');
        exponent += negative ? -given : given;
    }
    snprintf(digits + count, sizeof digits - count, "e%ld", exponent);
    return isinf(strtod(digits, NULL));
}

/* A literal of digits whose size is above 2^53, the largest to which all integers are doubles. */
static bool integer_inexact(const char *text, size_t bytes)
{
    static const char largest[] = "9007199254740992";
    size_t sign = text[0] == '-' ? 1 : 0, digits = bytes - sign, limit = sizeof largest - 1;
    return digits > limit || (digits == limit && memcmp(text + sign, largest, limit) > 0);
}

static void judge_number(struct gate *gate, const char *text, size_t bytes, bool integer)
{
    struct wire_pointer at = path(gate, gate->depth);
    if (bytes > WIRE_NUMBER_CHARACTERS_MAX) {
        gate->readable = false;
        wire_problem_field(gate->findings, at.text,
                           "a number of %zu characters; write it with at most %d", bytes,
                           WIRE_NUMBER_CHARACTERS_MAX);
    } else if (integer && integer_inexact(text, bytes)) {
        wire_problem_field(gate->findings, at.text,
                           "%.*s is out of range: whole numbers are exact up to 2^53 only",
                           (int)bytes, text);
    } else {
        wire_problem_field(gate->findings, at.text, "%.*s is out of range: no double is that large",
                           (int)bytes, text);
    }
}

static bool check_digits(struct gate *gate, const char *what)
{
    if (!is_digit(peek(gate)))
        return expected(gate, what);
    while (is_digit(peek(gate)))
        gate->at++;
    return true;
}

static bool check_number(struct gate *gate)
{
    size_t start = gate->at;
    bool integer = true;
    if (peek(gate) == '-')
        gate->at++;
    if (peek(gate) == '0') {
        gate->at++;
        if (is_digit(peek(gate)))
            return refuse(gate, start, "a number must not start with zeros");
    } else if (!check_digits(gate, "a digit after \"-\"")) {
        return false;
    }
    if (peek(gate) == '.') {
        integer = false;
        gate->at++;
        if (!check_digits(gate, "a digit after the decimal point"))
            return false;
    }
    if (peek(gate) == 'e' || peek(gate) == 'E') {
        integer = false;
        gate->at++;
        if (peek(gate) == '+' || peek(gate) == '-')
            gate->at++;
        if (!check_digits(gate, "a digit in the exponent"))
            return false;
    }
    const char *text = gate->text + start;
    size_t bytes = gate->at - start;
    if (bytes > WIRE_NUMBER_CHARACTERS_MAX || (integer && integer_inexact(text, bytes)) ||
        number_overflows(text, bytes))
        judge_number(gate, text, bytes, integer);
    return true;
}

/* ---- values ------------------------------------------------------------------------------------
 */

static bool check_value(struct gate *gate);

static bool check_word(struct gate *gate, const char *word)
{
    size_t length = strlen(word);
    if (gate->bytes - gate->at < length || memcmp(gate->text + gate->at, word, length) != 0)
        return refuse(gate, gate->at, "expected a value; words are true, false and null only");
    gate->at += length;
    return true;
}

/* A list or an object begins: one level deeper. */
static struct gate_frame *enter(struct gate *gate, bool object)
{
    if (gate->depth == WIRE_DEPTH_MAX) {
        refuse(gate, gate->at, "lists and objects are nested deeper than the limit of %d levels",
               WIRE_DEPTH_MAX);
        return NULL;
    }
    gate->at++;
    struct gate_frame *frame = &gate->frames[gate->depth++];
    *frame = (struct gate_frame){.object = object};
    return frame;
}

static bool check_list(struct gate *gate)
{
    struct gate_frame *frame = enter(gate, false);
    if (!frame)
        return false;
    skip_space(gate);
    if (peek(gate) != ']') {
        for (;; frame->index++) {
            if (!check_value(gate))
                return false;
            skip_space(gate);
            if (peek(gate) != ',')
                break;
            gate->at++;
            skip_space(gate);
            if (peek(gate) == ']')
                return refuse(gate, gate->at,
                              "expected a value after \",\"; the last element of a "
                              "list has no comma");
        }
        if (peek(gate) != ']')
            return expected(gate, "\",\" or \"]\"");
    }
    gate->at++;
    gate->depth--;
    return true;
}

/* The name of a field and its colon. */
static bool check_name(struct gate *gate, struct gate_frame *frame)
{
    bool has_nul;
    if (peek(gate) != '"')
        return expected(gate, "a field's name in double quotes");
    size_t start = gate->at + 1;
    if (!check_string(gate, &has_nul))
        return false;
    frame->key = start;
    frame->key_bytes = gate->at - 1 - start;
    if (has_nul) {
        struct wire_pointer around = path(gate, gate->depth - 1);
        gate->readable = false;
        wire_problem_field(gate->findings, around.text, "the name of a field contains \\u0000");
    }
    skip_space(gate);
    if (peek(gate) != ':')
        return expected(gate, "\":\" after the field's name");
    gate->at++;
    return true;
}

static bool check_object(struct gate *gate)
{
    struct gate_frame *frame = enter(gate, true);
    if (!frame)
        return false;
    skip_space(gate);
    if (peek(gate) != '}') {
        for (;;) {
            if (!check_name(gate, frame) || !check_value(gate))
                return false;
            skip_space(gate);
            if (peek(gate) != ',')
                break;
            gate->at++;
            skip_space(gate);
            if (peek(gate) == '}')
                return refuse(gate, gate->at,
                              "expected a field's name after \",\"; the last field "
                              "of an object has no comma");
        }
        if (peek(gate) != '}')
            return expected(gate, "\",\" or \"}\"");
    }
    gate->at++;
    gate->depth--;
    return true;
}

/* The sentence for something that starts no value. */
static bool refuse_value(struct gate *gate)
{
    switch (peek(gate)) {
    case '\'':
        return refuse(gate, gate->at, "expected a value; strings are written in double quotes");
    case 'N':
    case 'I':
        return refuse(gate, gate->at, "expected a value; NaN and Infinity are not JSON");
    case '+':
    case '.':
        return refuse(gate, gate->at, "expected a value; a number starts with a digit or \"-\"");
    case '/':
    case '#':
        return refuse(gate, gate->at, "expected a value; JSON has no comments");
    default:
        return expected(gate, "a value");
    }
}

static bool check_value(struct gate *gate)
{
    skip_space(gate);
    if (gate->values == WIRE_VALUES_MAX)
        return refuse(gate, gate->at, "the text has more values than the limit of %d",
                      WIRE_VALUES_MAX);
    gate->values++;
    char c = peek(gate);
    if (c == '{')
        return check_object(gate);
    if (c == '[')
        return check_list(gate);
    if (c == '-' || is_digit(c))
        return check_number(gate);
    if (c == 't' || c == 'f' || c == 'n')
        return check_word(gate, c == 't' ? "true" : c == 'f' ? "false" : "null");
    if (c != '"')
        return refuse_value(gate);
    bool has_nul;
    if (!check_string(gate, &has_nul))
        return false;
    if (has_nul) {
        struct wire_pointer at = path(gate, gate->depth);
        wire_problem_field(gate->findings, at.text, "a text must not contain \\u0000");
    }
    return true;
}

static bool check_text(struct gate *gate)
{
    if (gate->bytes >= 3 && memcmp(gate->text, "\xef\xbb\xbf", 3) == 0)
        return refuse(gate, 0, "the text starts with a byte order mark; send it without");
    skip_space(gate);
    if (gate->at == gate->bytes)
        return refuse(gate, gate->at, "the body is empty: expected a JSON object");
    if (!check_value(gate))
        return false;
    skip_space(gate);
    if (gate->at != gate->bytes)
        return expected(gate, "the end of the text after the value");
    return true;
}

enum wire_gate wire_gate_check(struct wire_problem *problem, const char *text, size_t bytes)
{
    if (bytes > WIRE_BODY_MAX) {
        wire_problem_set(problem, WIRE_PROBLEM_TOO_LARGE,
                         "a job's document has at most %u bytes; this one has %zu", WIRE_BODY_MAX,
                         bytes);
        return WIRE_GATE_REFUSED;
    }
    struct wire_problem findings = {.code = WIRE_PROBLEM_NONE};
    struct gate gate = {.problem = problem,
                        .findings = &findings,
                        .readable = true,
                        .text = bytes ? text : "",
                        .bytes = bytes};
    if (!check_text(&gate))
        return WIRE_GATE_REFUSED;
    if (findings.code == WIRE_PROBLEM_NONE)
        return WIRE_GATE_OK;
    *problem = findings;
    return gate.readable ? WIRE_GATE_FINDINGS : WIRE_GATE_UNREADABLE;
}
