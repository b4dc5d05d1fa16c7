/* The reader of single fields: look-ups, strict kinds, changes, numbers that survive. */
#include "tests/harness/test.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/read.h"

static struct wire_read *open_text(const char *text)
{
    return wire_read_open(text, strlen(text));
}

TEST(read_finds_members_and_elements)
{
    struct wire_read *read = open_text("{\"a\":{\"b\":[1,2.5,\"x\",true]},\"A\":7}");
    const struct wire_value *root = wire_read_root(read);
    REQUIRE(root);
    const struct wire_value *list = wire_read_get(wire_read_get(root, "a"), "b");
    CHECK(wire_read_is_array(list) && !wire_read_is_object(list));
    CHECK_EQ(wire_read_count(list), 4);
    uint64_t u64 = 0;
    double f64 = 0;
    bool truth = false;
    const struct wire_value *at = wire_read_first(list);
    CHECK(wire_read_u64(&u64, at) && u64 == 1);
    at = wire_read_next(at);
    CHECK(wire_read_f64(&f64, at) && f64 == 2.5);
    CHECK(!wire_read_u64(&u64, at));
    at = wire_read_next(at);
    CHECK_STR(wire_read_text(at), "x");
    CHECK(!wire_read_f64(&f64, at));
    at = wire_read_next(at);
    CHECK(wire_read_bool(&truth, at) && truth);
    CHECK(!wire_read_next(at));
    CHECK(wire_read_u64(&u64, wire_read_get(root, "A")) && u64 == 7);
    CHECK_STR(wire_read_key(wire_read_first(root)), "a");
    wire_read_close(&read);
    CHECK(!read);
}

TEST(read_accepts_null_everywhere)
{
    uint64_t u64;
    CHECK(!wire_read_get(wire_read_get(NULL, "a"), "b"));
    CHECK(!wire_read_first(NULL) && !wire_read_next(NULL) && !wire_read_text(NULL));
    CHECK(!wire_read_u64(&u64, NULL) && !wire_read_root(NULL) && !wire_read_print(NULL));
    CHECK_EQ(wire_read_count(NULL), 0);
    wire_read_close(NULL);
}

TEST(read_refuses_every_truncation)
{
    const char *text = "{\"a\":[1,{\"b\":\"c\"}],\"d\":-1.5e3,\"e\":null}";
    for (size_t length = 0; length < strlen(text); length++) {
        /* A block of exactly this size, so that a sanitizer sees a read beyond it. */
        char *exact = malloc(length + !length);
        REQUIRE(exact);
        memcpy(exact, text, length);
        struct wire_read *read = wire_read_open(exact, length);
        CHECK(!read);
        wire_read_close(&read);
        free(exact);
    }
    struct wire_read *read = open_text(text);
    CHECK(read);
    wire_read_close(&read);
    CHECK(!(read = open_text("{} x")));
    CHECK((read = open_text("{} \n")));
    wire_read_close(&read);
}

TEST(read_integers_end_at_two_to_the_53)
{
    struct wire_read *read = open_text("[9007199254740992,9007199254740994,-1,1e999,1.5]");
    uint64_t u64 = 42;
    const struct wire_value *at = wire_read_first(wire_read_root(read));
    CHECK(wire_read_u64(&u64, at) && u64 == UINT64_C(9007199254740992));
    for (at = wire_read_next(at); at; at = wire_read_next(at))
        CHECK(!wire_read_u64(&u64, at));
    wire_read_close(&read);
}

TEST(read_sets_and_replaces_members)
{
    struct wire_read *read = open_text("{\"a\":1,\"b\":{\"c\":0.1}}");
    CHECK(wire_read_set_text(read, "a", "say \"hi\""));
    CHECK(wire_read_set_json(read, "p", "[[1,2.5,-3]]"));
    CHECK(!wire_read_set_json(read, "q", "[1,"));
    char *text = wire_read_print(wire_read_root(read));
    CHECK_STR(text, "{\"b\":{\"c\":0.1},\"a\":\"say \\\"hi\\\"\","
                    "\"p\":[[1,2.5,-3]]}");
    free(text);
    wire_read_close(&read);
    read = open_text("[1]");
    CHECK(!wire_read_set_text(read, "a", "b"));
    wire_read_close(&read);
}

TEST(read_prints_numbers_that_read_back_equal)
{
    test_random random = test_random_begin();
    for (int i = 0; i < 5000; i++) {
        double value =
            ldexp(test_random_unit(&random) - 0.5, (int)test_random_below(&random, 200) - 100);
        char text[64];
        snprintf(text, sizeof text, "[%.17g]", value);
        struct wire_read *read = open_text(text);
        char *printed = wire_read_print(wire_read_root(read));
        REQUIRE(printed);
        CHECK(strtod(printed + 1, NULL) == value);
        free(printed);
        wire_read_close(&read);
    }
    struct wire_read *read = open_text("[1e999]");
    char *printed = wire_read_print(wire_read_root(read));
    CHECK_STR(printed, "[1e999]");
    free(printed);
    wire_read_close(&read);
}
