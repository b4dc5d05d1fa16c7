/* Names: exactly the contract's pattern, and a reason for everything else. */
#include "protocol/name.h"
#include "tests/harness/test.h"

#include <string.h>

TEST(names_follow_the_pattern)
{
    char longest[WIRE_NAME_BYTES + 1];
    memset(longest, 'n', sizeof longest);
    longest[WIRE_NAME_BYTES - 1] = '\0';
    CHECK(wire_name_ok("a") && wire_name_ok("0") && wire_name_ok("Z9") && wire_name_ok("a.b_c-d"));
    CHECK(wire_name_ok("a..b") && wire_name_ok("a-") && wire_name_ok(longest));
    longest[WIRE_NAME_BYTES - 1] = 'n';
    longest[WIRE_NAME_BYTES] = '\0';
    CHECK(!wire_name_ok(longest));
    CHECK(!wire_name_ok("") && !wire_name_ok(".") && !wire_name_ok("..") && !wire_name_ok(".a"));
    CHECK(!wire_name_ok("_a") && !wire_name_ok("-a") && !wire_name_ok("a/b") && !wire_name_ok("/"));
    for (int c = 1; c < 256; c++) {
        char name[3] = {'a', (char)c, '\0'};
        bool good = strchr("._-0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz", c);
        CHECK_EQ(wire_name_ok(name), good);
    }
}

TEST(names_say_why_they_are_none)
{
    static const struct {
        const char *name, *why;
    } cases[] = {{"", "empty"},
                 {"../etc", "a name, not a path"},
                 {"a\\b", "slash"},
                 {".hidden", "it starts with \".\""},
                 {"-f", "it starts with \"-\""},
                 {"a b", "A-Z a-z 0-9 . _ -"},
                 {"\xc3\xa9t\xc3\xa9", "A-Z a-z 0-9 . _ -"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char why[WIRE_NAME_WHY_BYTES];
        CHECK(!wire_name_check(why, cases[i].name));
        CHECK_HAS(why, cases[i].why);
    }
    char why[WIRE_NAME_WHY_BYTES], name[200];
    memset(name, 'a', sizeof name);
    name[101] = '\0';
    CHECK(!wire_name_check(why, name));
    CHECK_HAS(why, "longer than 100");
}
