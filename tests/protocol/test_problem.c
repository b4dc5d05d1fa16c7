/* Problems: the first one is kept, offenders are counted, the document is RFC 9457's. */
#include "protocol/wire.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

TEST(problem_keeps_the_first)
{
    struct wire_problem problem = {.code = WIRE_PROBLEM_NONE};
    CHECK_EQ(wire_problem_set(&problem, WIRE_PROBLEM_BUSY, "%d jobs wait", 3), WIRE_PROBLEM_BUSY);
    CHECK_EQ(wire_problem_set(&problem, WIRE_PROBLEM_GONE, "no"), WIRE_PROBLEM_GONE);
    wire_problem_field(&problem, "/a", "no");
    CHECK_EQ(problem.code, WIRE_PROBLEM_BUSY);
    CHECK_STR(problem.detail, "3 jobs wait");
    CHECK_EQ(problem.error_count, 0);
}

TEST(problem_words_are_known_for_every_code)
{
    CHECK_STR(wire_problem_slug(WIRE_PROBLEM_INVALID_FIELD), "invalid-field");
    CHECK_STR(wire_problem_title(WIRE_PROBLEM_GONE), "The result has expired");
    CHECK_STR(wire_problem_slug(WIRE_PROBLEM_INTERNAL), "internal");
    CHECK_STR(wire_problem_slug((enum wire_problem_code)9999), "internal");
}

TEST(problem_counts_offenders)
{
    struct wire_problem problem = {.code = WIRE_PROBLEM_NONE};
    wire_problem_field(&problem, "/a", "it is %s", "wrong");
    CHECK_EQ(problem.code, WIRE_PROBLEM_INVALID_FIELD);
    CHECK_STR(problem.detail, "/a: it is wrong");
    wire_problem_field(&problem, "/a", "said already");
    CHECK_EQ(problem.error_count, 1);
    wire_problem_field(&problem, "/b", "too");
    CHECK_STR(problem.detail, "2 fields are wrong; the first is /a: it is wrong");
    CHECK_STR(problem.errors[1].pointer, "/b");
    CHECK_STR(problem.errors[1].detail, "too");
    for (int i = 0; i < 100; i++) {
        char pointer[16];
        snprintf(pointer, sizeof pointer, "/%d", i);
        wire_problem_field(&problem, pointer, "x");
    }
    CHECK_EQ(problem.error_count, WIRE_FIELD_ERRORS_MAX);
    CHECK_STR(problem.detail, "at least 32 fields are wrong; the first is /a: it is wrong");
}

TEST(problem_document)
{
    struct wire_problem problem = {.code = WIRE_PROBLEM_NONE};
    wire_problem_field(&problem, "/x~1y", "a \"quote\"");
    char *text = wire_problem_write(&problem, 422, "r-1");
    CHECK_STR(text, "{\"type\":\"/problems/invalid-field\",\"title\":\"A field is unknown, of the "
                    "wrong type or out of range\",\"status\":422,\"detail\":\"/x~1y: a "
                    "\\\"quote\\\"\",\"errors\":[{\"pointer\":\"/x~1y\",\"detail\":\"a "
                    "\\\"quote\\\"\"}],\"request_id\":\"r-1\"}");
    free(text);
    memset(&problem, 0, sizeof problem);
    wire_problem_set(&problem, WIRE_PROBLEM_UNKNOWN_SCENE, "there is no scene \"%s\"",
                     "a\xff\n\xc3");
    text = wire_problem_write(&problem, 404, NULL);
    CHECK_STR(text, "{\"type\":\"/problems/unknown-scene\",\"title\":\"There is no scene of this "
                    "name\",\"status\":404,\"detail\":\"there is no scene \\\"a?\\n?\\\"\"}");
    free(text);
}

TEST(problem_texts_are_cut_between_characters)
{
    struct wire_problem problem = {.code = WIRE_PROBLEM_NONE};
    char text[1025] = "";
    for (int i = 0; i < 512; i++)
        memcpy(text + 2 * i, "\xc3\xa9", 2);
    wire_problem_field(&problem, "/a", "%s", text);
    CHECK_EQ(strlen(problem.errors[0].detail), 222);
    char *document = wire_problem_write(&problem, 422, "");
    CHECK(!strchr(document, '?'));
    CHECK(!strstr(document, "request_id"));
    free(document);
}
