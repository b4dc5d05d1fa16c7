/* Texts: UTF-8, numbers that read back equal in any locale, quotes, pointers. */
#include "protocol/text.h"
#include "tests/harness/test.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Every code point through a straightforward encoder: surrogates alone are refused. */
TEST(utf8_accepts_exactly_the_scalar_values)
{
    for (uint32_t c = 1; c < 0x120000; c++) {
        unsigned char s[4];
        size_t bytes = c < 0x80 ? 1 : c < 0x800 ? 2 : c < 0x10000 ? 3 : 4;
        if (bytes == 1) {
            s[0] = (unsigned char)c;
        } else {
            for (size_t i = 0; i < bytes; i++)
                s[i] = (unsigned char)(0x80 | (c >> 6 * (bytes - 1 - i) & 0x3f));
            s[0] = (unsigned char)((0xf00u >> bytes & 0xff) | c >> 6 * (bytes - 1));
        }
        bool good = c < 0x110000 && !(c >= 0xd800 && c <= 0xdfff);
        size_t found = wire_utf8_sequence((const char *)s, bytes);
        if (found != (good ? bytes : 0)) {
            test_fail(__FILE__, __LINE__, "U+%04X: %zu", c, found);
            return;
        }
        CHECK(bytes == 1 || wire_utf8_sequence((const char *)s, bytes - 1) == 0);
    }
    CHECK_EQ(wire_utf8_sequence("", 0), 0);
}

__attribute__((format(printf, 3, 4))) static void print(char *out, size_t bytes, const char *format,
                                                        ...)
{
    va_list args;
    va_start(args, format);
    wire_text_print(out, bytes, format, args);
    va_end(args);
}

TEST(text_is_never_cut_inside_of_a_character)
{
    static const char text[] = "a\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80z";
    static const size_t whole[] = {0, 1, 1, 3, 3, 3, 6, 6, 6, 6, 10, 11};
    for (size_t room = 0; room <= 11; room++) {
        char out[16];
        print(out, room + 1, "%s", text);
        CHECK_EQ(strlen(out), whole[room]);
        CHECK(memcmp(out, text, whole[room]) == 0);
    }
}

TEST(quotes_are_short)
{
    char out[WIRE_QUOTE_BYTES];
    wire_text_quote(out, "ab");
    CHECK_STR(out, "\"ab\"");
    wire_text_quote(out, "");
    CHECK_STR(out, "\"\"");
    wire_text_quote(out, "01234567890123456789012345678901234567890123456789x");
    CHECK_STR(out, "\"01234567890123456789012345678901234567890123456789...\"");
    wire_text_quote(out, "0123456789012345678901234567890123456789012345678\xc3\xa9xxx");
    CHECK_STR(out, "\"0123456789012345678901234567890123456789012345678...\"");
}

static void check_number(double value)
{
    char text[WIRE_NUMBER_BYTES];
    wire_number_text(text, value);
    double back = strtod(text, NULL);
    if (memcmp(&back, &value, sizeof value) != 0)
        test_fail(__FILE__, __LINE__, "%s is not %.17g", text, value);
}

TEST(numbers_read_back_equal)
{
    static const struct {
        double value;
        const char *text;
    } cases[] = {{0, "0"},
                 {-0.0, "-0"},
                 {64, "64"},
                 {0.1, "0.1"},
                 {-2.5, "-2.5"},
                 {1e22, "1e+22"},
                 {0.1 + 0.2, "0.30000000000000004"},
                 {9007199254740992.0, "9007199254740992"},
                 {1.7976931348623157e308, "1.7976931348623157e+308"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[WIRE_NUMBER_BYTES];
        wire_number_text(text, cases[i].value);
        CHECK_STR(text, cases[i].text);
        check_number(cases[i].value);
    }
    check_number(5e-324);
    check_number(-2.2250738585072014e-308);
    test_random random = test_random_begin();
    for (int i = 0; i < 200000; i++) {
        uint64_t bits = test_random_u64(&random);
        double value;
        memcpy(&value, &bits, sizeof value);
        if (isfinite(value))
            check_number(value);
        check_number((test_random_unit(&random) - 0.5) * 2000);
    }
}

/* Debian's minimal systems have no locale with a decimal comma: then there is nothing to show. */
TEST(numbers_do_not_depend_on_the_locale)
{
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "de_DE"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (setlocale(LC_ALL, names[i]))
            break;
    char text[WIRE_NUMBER_BYTES];
    wire_number_text(text, -1234.5);
    CHECK_STR(text, "-1234.5");
    wire_number_text(text, 1.5e-300);
    CHECK_STR(text, "1.5e-300");
}

TEST(pointers_are_escaped)
{
    struct wire_pointer root = wire_pointer_root();
    CHECK_STR(root.text, "");
    struct wire_pointer a = wire_pointer_key(root, "a/b", 3);
    CHECK_STR(a.text, "/a~1b");
    CHECK_STR(wire_pointer_key(a, "~1", 2).text, "/a~1b/~01");
    CHECK_STR(wire_pointer_index(a, 4294967295u).text, "/a~1b/4294967295");
    CHECK_STR(wire_pointer_key(root, "", 0).text, "/");
    CHECK_STR(wire_pointer_key(root, "\"%d", 3).text, "/\"%d");
    CHECK_STR(wire_pointer_key(root, "a\0b", 3).text, "/a\xef\xbf\xbd"
                                                      "b");
    for (int i = 0; i < 100; i++)
        a = wire_pointer_key(a, "~/\xf0\x9f\x98\x80", 6);
    CHECK_EQ(strlen(a.text), a.bytes);
    CHECK(a.bytes < sizeof a.text);
    CHECK_STR(a.text + a.bytes - 3, "...");
    for (size_t at = 0; at < a.bytes;) {
        size_t length = wire_utf8_sequence(a.text + at, a.bytes - at);
        REQUIRE(length > 0);
        at += length;
    }
}
