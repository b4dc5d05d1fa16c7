/* The strict JSON check: what it accepts, refuses and points at, on cases, truncations and noise.
 */
#include "protocol/json_gate.h"
#include "tests/harness/test.h"

#include <cjson/cJSON.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define OK     WIRE_GATE_OK
#define FIND   WIRE_GATE_FINDINGS
#define UNREAD WIRE_GATE_UNREADABLE
#define NO     WIRE_GATE_REFUSED

struct gate_case {
    enum wire_gate verdict;
    const char *text;
    size_t bytes;
};
#define T(text) text, sizeof(text) - 1 /* NULs inside count */

static const struct gate_case corpus[] = {
    /* values of every kind at the top */
    {OK, T("{}")},
    {OK, T("[]")},
    {OK, T("0")},
    {OK, T("\"\"")},
    {OK, T("true")},
    {OK, T("false")},
    {OK, T("null")},
    {OK, T(" \t\r\n{} \t\r\n")},
    {OK, T("{\"a\":1}")},
    {OK, T("{\"a\":1,\"b\":[1,2,{\"c\":null}]}")},
    {OK, T("{ \"a\" : 1 , \"b\" : [ 1 , 2 ] }")},
    {OK, T("{\"a\":1,\"a\":2}")}, /* grammar; the reader of jobs refuses it */
    {OK, T("{\"\":0}")},
    {OK, T("[[],[[]],{}]")},
    {OK, T("[true,false,null]")},
    {NO, T("")},
    {NO, T(" ")},
    {NO, T("\n\n")},
    {NO, T("\0")},
    {NO, T("{}\0")},
    {NO, T("\0{}")},
    {NO, T("{\0}")},
    {NO, T("{} {}")},
    {NO, T("{}[]")},
    {NO, T("{},")},
    {NO, T("{}x")},
    {NO, T("1 2")},
    {NO, T("[]]")},
    {NO, T("{}}")},
    /* structure */
    {NO, T("{")},
    {NO, T("[")},
    {NO, T("}")},
    {NO, T("]")},
    {NO, T(":")},
    {NO, T(",")},
    {NO, T("[1")},
    {NO, T("[1,")},
    {NO, T("[1,]")},
    {NO, T("[,1]")},
    {NO, T("[1,,2]")},
    {NO, T("[1 2]")},
    {NO, T("[1;2]")},
    {NO, T("[1}")},
    {NO, T("[\"a\":1]")},
    {NO, T("[:]")},
    {NO, T("{\"a\"}")},
    {NO, T("{\"a\":}")},
    {NO, T("{\"a\" 1}")},
    {NO, T("{\"a\",1}")},
    {NO, T("{\"a\"=1}")},
    {NO, T("{\"a\"::1}")},
    {NO, T("{\"a\":1,}")},
    {NO, T("{,\"a\":1}")},
    {NO, T("{\"a\":1,,\"b\":2}")},
    {NO, T("{\"a\":1 \"b\":2}")},
    {NO, T("{\"a\":1]")},
    {NO, T("{a:1}")},
    {NO, T("{'a':1}")},
    {NO, T("{1:1}")},
    {NO, T("{null:1}")},
    {NO, T("{[]:1}")},
    {NO, T("{\"a\":1")},
    {NO, T("{\"a\":")},
    {NO, T("{\"a")},
    {NO, T("(1)")},
    {NO, T("[1]/**/")},
    {NO, T("//\n1")},
    {NO, T("# x\n1")},
    {NO, T("/* */1")},
    {NO, T("[1\f]")},
    {NO, T("[\v1]")},
    {NO, T("\xc2\xa0[]")},     /* no-break space */
    {NO, T("\xe2\x80\xa8[]")}, /* line separator */
    {NO, T("\xef\xbb\xbf{}")}, /* byte order mark */
    {NO, T("{}\xef\xbb\xbf")},
    {NO, T("\xff\xfe{\0}\0")}, /* UTF-16 */
    /* words */
    {NO, T("True")},
    {NO, T("TRUE")},
    {NO, T("tru")},
    {NO, T("truee")},
    {NO, T("[true1]")},
    {NO, T("nul")},
    {NO, T("nulll")},
    {NO, T("none")},
    {NO, T("undefined")},
    {NO, T("fals")},
    {NO, T("nan")},
    {NO, T("NaN")},
    {NO, T("Infinity")},
    {NO, T("-Infinity")},
    {NO, T("-NaN")},
    {NO, T("inf")},
    {NO, T("yes")},
    {NO, T("[truefalse]")},
    /* numbers */
    {OK, T("-0")},
    {OK, T("-1")},
    {OK, T("10")},
    {OK, T("0.0")},
    {OK, T("0.10")},
    {OK, T("1.5e3")},
    {OK, T("1E3")},
    {OK, T("1e+3")},
    {OK, T("1e-3")},
    {OK, T("0e0")},
    {OK, T("0e999999999999999")},
    {OK, T("-0.0e-0")},
    {OK, T("1e308")},
    {OK, T("1.7976931348623157e308")},
    {OK, T("1.7976931348623158e308")}, /* rounds down to the largest double */
    {OK, T("-1.7976931348623157e308")},
    {OK, T("17976931348623157e292")},
    {OK, T("0.000017976931348623157e313")},
    {OK, T("5e-324")},
    {OK, T("1e-999")}, /* rounds to 0, as everywhere */
    {OK, T("1e-99999999999999999999")},
    {OK, T("9007199254740991")},
    {OK, T("9007199254740992")},
    {OK, T("-9007199254740992")},
    {OK, T("9007199254740993.0")},
    {OK, T("0.3000000000000000444089209850062616169452667236328125000000000")}, /* 63 */
    {NO, T("00")},
    {NO, T("01")},
    {NO, T("-01")},
    {NO, T("007")},
    {NO, T("+1")},
    {NO, T(".5")},
    {NO, T("-.5")},
    {NO, T("1.")},
    {NO, T("1.e3")},
    {NO, T("[1.]")},
    {NO, T("-")},
    {NO, T("--1")},
    {NO, T("-+1")},
    {NO, T("- 1")},
    {NO, T("1e")},
    {NO, T("1e+")},
    {NO, T("1e-")},
    {NO, T("1e1.5")},
    {NO, T("1ee1")},
    {NO, T("1.2.3")},
    {NO, T("1,5")},
    {NO, T("1_000")},
    {NO, T("0x10")},
    {NO, T("0b1")},
    {NO, T("0o7")},
    {NO, T("1f")},
    {NO, T("1d")},
    {NO, T("1L")},
    {NO, T("1-")},
    {NO, T("1 e3")},
    {NO, T("\xd9\xa1")}, /* ARABIC-INDIC DIGIT ONE */
    {FIND, T("9007199254740993")},
    {FIND, T("-9007199254740993")},
    {FIND, T("9223372036854775807")},
    {FIND, T("18446744073709551616")},
    {FIND, T("100000000000000000000000000000000000000000000000000000000000000")}, /* 63 */
    {FIND, T("1e309")},
    {FIND, T("1e999")},
    {FIND, T("-1e999")},
    {FIND, T("1E+999")},
    {FIND, T("1e99999999999999999999")},
    {FIND, T("1.7976931348623159e308")},
    {FIND, T("0.00017976931348623159e312")},
    {FIND, T("17976931348623159e292")},
    {UNREAD, T("1000000000000000000000000000000000000000000000000000000000000000")}, /* 64 */
    {UNREAD, T("0.30000000000000004440892098500626161694526672363281250000000000")}, /* 64 */
    /* strings */
    {OK, T("\"abc\"")},
    {OK, T("\" \"")},
    {OK, T("\"'\"")},
    {OK, T("\"\\\"\\\\\\/\\b\\f\\n\\r\\t\"")},
    {OK, T("\"\\u0001\"")},
    {OK, T("\"\\u00e9\\u00E9\"")},
    {OK, T("\"\\uD83D\\uDE00\"")},
    {OK, T("\"\\ud800\\udc00\"")},
    {OK, T("\"\\udbff\\udfff\"")},
    {OK, T("\"\\uffff\"")},
    {OK, T("\"\x7f\"")},
    {OK, T("\"\xc3\xa9\"")},
    {OK, T("\"\xc2\x80\"")},
    {OK, T("\"\xdf\xbf\"")},
    {OK, T("\"\xe0\xa0\x80\"")},
    {OK, T("\"\xed\x9f\xbf\"")},
    {OK, T("\"\xee\x80\x80\"")},
    {OK, T("\"\xef\xbf\xbf\"")},
    {OK, T("\"\xef\xbb\xbf\"")}, /* inside of a string it is a character */
    {OK, T("\"\xe2\x80\xa8\"")},
    {OK, T("\"\xf0\x90\x80\x80\"")},
    {OK, T("\"\xf4\x8f\xbf\xbf\"")},
    {OK, T("{\"\xc3\xa9\":1}")},
    {NO, T("\"")},
    {NO, T("\"abc")},
    {NO, T("\"abc\\\"")},
    {NO, T("'abc'")},
    {NO, T("`abc`")},
    {NO, T("abc")},
    {NO, T("\"\t\"")},
    {NO, T("\"\n\"")},
    {NO, T("\"\r\"")},
    {NO, T("\"\x01\"")},
    {NO, T("\"\x1f\"")},
    {NO, T("\"\0\"")},
    {NO, T("\"a\0b\"")},
    {NO, T("{\"a\0\":1}")},
    {NO, T("\"\\\"")},
    {NO, T("\"\\x41\"")},
    {NO, T("\"\\a\"")},
    {NO, T("\"\\'\"")},
    {NO, T("\"\\0\"")},
    {NO, T("\"\\ \"")},
    {NO, T("\"\\\0\"")},
    {NO, T("\"\\U0041\"")},
    {NO, T("\"\\u\"")},
    {NO, T("\"\\u1\"")},
    {NO, T("\"\\u123\"")},
    {NO, T("\"\\u123g\"")},
    {NO, T("\"\\u-123\"")},
    {NO, T("\"\\u 123\"")},
    {NO, T("\"\\u00")},
    {NO, T("\"\\ud800\"")},
    {NO, T("\"\\ud800x\"")},
    {NO, T("\"\\ud800\\n\"")},
    {NO, T("\"\\ud800\\ud800\"")},
    {NO, T("\"\\ud800\\u0041\"")},
    {NO, T("\"\\ud800\\udbff\"")},
    {NO, T("\"\\ud800\\u")},
    {NO, T("\"\\udc00\"")},
    {NO, T("\"\\udfff\\ud800\"")},
    {NO, T("\"\\udc00\\ud800\"")},
    {NO, T("{\"\\udead\":1}")},
    {FIND, T("\"\\u0000\"")},
    {FIND, T("[\"a\\u0000b\"]")},
    {UNREAD, T("{\"a\\u0000\":1}")},
    /* not UTF-8 */
    {NO, T("\"\x80\"")},
    {NO, T("\"\xbf\"")},
    {NO, T("\"\xc0\x80\"")},
    {NO, T("\"\xc0\xaf\"")},
    {NO, T("\"\xc1\xbf\"")},
    {NO, T("\"\xc3\"")},
    {NO, T("\"\xc3(\"")},
    {NO, T("\"\xc3\xc3\"")},
    {NO, T("\"\xe0\x80\x80\"")},
    {NO, T("\"\xe0\x9f\xbf\"")},
    {NO, T("\"\xe2\x82\"")},
    {NO, T("\"\xe2(\xa1\"")},
    {NO, T("\"\xe2\x82(\"")},
    {NO, T("\"\xed\xa0\x80\"")}, /* U+D800 */
    {NO, T("\"\xed\xbf\xbf\"")}, /* U+DFFF */
    {NO, T("\"\xf0\x80\x80\x80\"")},
    {NO, T("\"\xf0\x8f\xbf\xbf\"")},
    {NO, T("\"\xf0\x9f\x98\"")},
    {NO, T("\"\xf4\x90\x80\x80\"")}, /* U+110000 */
    {NO, T("\"\xf5\x80\x80\x80\"")},
    {NO, T("\"\xf8\x88\x80\x80\x80\"")},
    {NO, T("\"\xfe\"")},
    {NO, T("\"\xff\"")},
    {NO, T("\"\xe9\"")}, /* Latin-1 */
    {NO, T("{\"\xe9\":1}")},
    {NO, T("\xff")},
    {NO, T("\"abc\xf0")},
};

static enum wire_gate check(struct wire_problem *problem, const char *text, size_t bytes)
{
    memset(problem, 0, sizeof *problem);
    /* A block of its own size: reading beyond the end is seen by the sanitizer. */
    char *copy = malloc(bytes ? bytes : 1);
    REQUIRE(copy);
    if (bytes)
        memcpy(copy, text, bytes);
    enum wire_gate verdict = wire_gate_check(problem, copy, bytes);
    if (verdict == OK || verdict == FIND) {
        const char *end = NULL;
        cJSON *root = cJSON_ParseWithLengthOpts(copy, bytes, &end, false);
        if (!root)
            test_fail(__FILE__, __LINE__, "cJSON cannot read what the gate let through");
        cJSON_Delete(root);
    }
    free(copy);
    return verdict;
}

TEST(gate_judges_the_corpus)
{
    REQUIRE(sizeof corpus / sizeof corpus[0] >= 150);
    for (size_t i = 0; i < sizeof corpus / sizeof corpus[0]; i++) {
        struct wire_problem problem;
        enum wire_gate verdict = check(&problem, corpus[i].text, corpus[i].bytes);
        if (verdict != corpus[i].verdict)
            test_fail(__FILE__, __LINE__, "case %zu, %s: %d, not %d (%s)", i, corpus[i].text,
                      (int)verdict, (int)corpus[i].verdict, problem.detail);
        enum wire_problem_code wanted = corpus[i].verdict == OK   ? WIRE_PROBLEM_NONE
                                        : corpus[i].verdict == NO ? WIRE_PROBLEM_INVALID_JSON
                                                                  : WIRE_PROBLEM_INVALID_FIELD;
        CHECK_EQ(problem.code, wanted);
        CHECK_EQ(problem.detail[0] == '\0', wanted == WIRE_PROBLEM_NONE);
        CHECK_EQ(problem.error_count != 0, wanted == WIRE_PROBLEM_INVALID_FIELD);
    }
}

TEST(gate_says_where_and_what_was_expected)
{
    static const struct {
        const char *text, *where, *what;
    } cases[] = {
        {"", "line 1, column 1:", "the body is empty: expected a JSON object"},
        {"{\"a\":1,}", "line 1, column 8:", "the last field of an object has no comma"},
        {"[1,\n 2,\n ]", "line 3, column 2:", "the last element of a list has no comma"},
        {"{\"a\":1\n\"b\":2}", "line 2, column 1:", "expected \",\" or \"}\", found \""},
        {"[1 2]", "line 1, column 4:", "expected \",\" or \"]\", found \"2\""},
        {"{a:1}", "line 1, column 2:", "expected a field's name in double quotes, found \"a\""},
        {"{\"a\" 1}", "line 1, column 6:", "expected \":\" after the field's name"},
        {"[\"\xc3\xa9\xc3\xa9\", x]", "line 1, column 8:", "expected a value, found \"x\""},
        {"{\"a\":'b'}", "line 1, column 6:", "double quotes"},
        {"[NaN]", "line 1, column 2:", "NaN and Infinity are not JSON"},
        {"[nan]", "line 1, column 2:", "words are true, false and null only"},
        {"[01]", "line 1, column 2:", "must not start with zeros"},
        {"[1.]", "line 1, column 4:", "expected a digit after the decimal point, found \"]\""},
        {"[1e]", "line 1, column 4:", "expected a digit in the exponent"},
        {"[-]", "line 1, column 3:", "expected a digit after \"-\""},
        {"[+1]", "line 1, column 2:", "starts with a digit"},
        {"[1] x", "line 1, column 5:", "expected the end of the text after the value"},
        {"[1", "line 1, column 3:", "found the end of the text"},
        {"[\"a", "line 1, column 2:", "not closed"},
        {"[\"a\tb\"]", "line 1, column 4:", "control character (U+0009) inside a string"},
        {"[\"\\x\"]", "line 1, column 4:", "after the backslash, found \"x\""},
        {"[\"\\u12g4\"]", "line 1, column 3:", "four hexadecimal digits"},
        {"[\"\\ud800\"]", "line 1, column 3:", "\\ud800 is the first half"},
        {"[\"\\udc00\"]", "line 1, column 3:", "\\udc00 is the second half"},
        {"[\"\xff\"]", "line 1, column 3:", "the byte 0xff is not UTF-8"},
        {"[\xff]", "line 1, column 2:", "found the byte 0xff"},
        {"[\x01]", "line 1, column 2:", "found the control character U+0001"},
        {"\xef\xbb\xbf{}", "line 1, column 1:", "byte order mark"},
        {"[1 // x\n]", "line 1, column 4:", "found \"/\""},
        {"[/* x */ 1]", "line 1, column 2:", "no comments"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct wire_problem problem;
        CHECK_EQ(check(&problem, cases[i].text, strlen(cases[i].text)), NO);
        CHECK_HAS(problem.detail, cases[i].where);
        CHECK_HAS(problem.detail, cases[i].what);
    }
}

TEST(gate_points_at_values_that_would_be_damaged)
{
    static const struct {
        const char *text, *pointer, *what;
    } cases[] = {
        {"{\"seed\":9007199254740993}", "/seed", "9007199254740993 is out of range"},
        {"{\"probes\":[[0,1,2],[3,1e999,5]]}", "/probes/1/1", "1e999 is out of range"},
        {"[0,{\"a\":[],\"b\":[true,{\"c\":\"x\\u0000\"}]}]", "/1/b/1/c", "\\u0000"},
        {"{\"a/b~c\":1e999}", "/a~1b~0c", "out of range"},
        {"{\"\\u002f\\u007e\":1e999}", "/~1~0", "out of range"},
        {"{\"\\u00e9\\n\\ud83d\\ude00\":1e999}", "/\xc3\xa9\n\xf0\x9f\x98\x80", "out of range"},
        {"{\"\":{\"\":1e999}}", "//", "out of range"},
        {"1e999", "", "out of range"},
        {"{\"a\":{\"b\\u0000\":1}}", "/a", "the name of a field contains \\u0000"},
        {"{\"a\":1.0000000000000000000000000000000000000000000000000000000000000000}", "/a",
         "a number of 66 characters; write it with at most 63"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct wire_problem problem;
        enum wire_gate verdict = check(&problem, cases[i].text, strlen(cases[i].text));
        CHECK(verdict == FIND || verdict == UNREAD);
        CHECK_EQ(problem.error_count, 1);
        CHECK_STR(problem.errors[0].pointer, cases[i].pointer);
        CHECK_HAS(problem.errors[0].detail, cases[i].what);
    }
}

TEST(gate_collects_findings_but_broken_json_comes_first)
{
    struct wire_problem problem;
    static const char three[] = "{\"a\":1e999,\"b\":[9007199254740993],\"c\":\"\\u0000\"}";
    CHECK_EQ(check(&problem, three, sizeof three - 1), FIND);
    CHECK_EQ(problem.error_count, 3);
    CHECK_STR(problem.errors[1].pointer, "/b/0");
    CHECK_EQ(check(&problem, three, sizeof three - 2), NO);
    CHECK_EQ(problem.code, WIRE_PROBLEM_INVALID_JSON);
    CHECK_EQ(problem.error_count, 0);
}

TEST(gate_cuts_long_pointers_visibly)
{
    char text[512] = "{\"";
    memset(text + 2, 'k', 300);
    snprintf(text + 302, sizeof text - 302, "\":1e999}");
    struct wire_problem problem;
    CHECK_EQ(check(&problem, text, strlen(text)), FIND);
    size_t length = strlen(problem.errors[0].pointer);
    CHECK(length < sizeof problem.errors[0].pointer);
    CHECK_STR(problem.errors[0].pointer + length - 4, "k...");
}

/* `depth` lists inside of each other. */
static size_t nested(char *text, size_t depth, char open, char close)
{
    memset(text, open, depth);
    memset(text + depth, close, depth);
    return 2 * depth;
}

TEST(gate_limits_nesting)
{
    static char text[400000];
    struct wire_problem problem;
    CHECK_EQ(check(&problem, text, nested(text, WIRE_DEPTH_MAX, '[', ']')), OK);
    CHECK_EQ(check(&problem, text, nested(text, WIRE_DEPTH_MAX + 1, '[', ']')), NO);
    CHECK_HAS(problem.detail, "nested deeper than the limit of 32");
    CHECK_EQ(problem.code, WIRE_PROBLEM_INVALID_JSON);
    CHECK_EQ(check(&problem, text, nested(text, 200000, '[', ']')), NO);
    CHECK_HAS(problem.detail, "column 33");
    size_t bytes = 0;
    for (int i = 0; i < 33; i++)
        bytes += (size_t)snprintf(text + bytes, sizeof text - bytes, "{\"a\":");
    CHECK_EQ(check(&problem, text, bytes), NO);
    CHECK_HAS(problem.detail, "nested deeper");
}

TEST(gate_limits_values)
{
    size_t bytes = 2 * WIRE_VALUES_MAX;
    char *text = malloc(bytes + 2);
    REQUIRE(text);
    /* The list is a value too: 99,999 elements fit. */
    for (size_t i = 0; i < WIRE_VALUES_MAX; i++)
        memcpy(text + 2 * i, i ? ",1" : "[1", 2);
    struct wire_problem problem;
    text[2 * (WIRE_VALUES_MAX - 1)] = ']';
    CHECK_EQ(check(&problem, text, 2 * (WIRE_VALUES_MAX - 1) + 1), OK);
    text[2 * (WIRE_VALUES_MAX - 1)] = ',';
    text[bytes] = ']';
    CHECK_EQ(check(&problem, text, bytes + 1), NO);
    CHECK_HAS(problem.detail, "more values than the limit of 100000");
    free(text);
}

TEST(gate_limits_bytes)
{
    char *text = malloc(WIRE_BODY_MAX + 1);
    REQUIRE(text);
    memset(text, ' ', WIRE_BODY_MAX + 1);
    text[0] = '1';
    struct wire_problem problem;
    CHECK_EQ(check(&problem, text, WIRE_BODY_MAX), OK);
    CHECK_EQ(check(&problem, text, WIRE_BODY_MAX + 1), NO);
    CHECK_EQ(problem.code, WIRE_PROBLEM_TOO_LARGE);
    CHECK_HAS(problem.detail, "1048576");
    free(text);
    memset(&problem, 0, sizeof problem);
    CHECK_EQ(wire_gate_check(&problem, NULL, 0), NO);
}

static const char *const documents[] = {
    "{\"scene\":\"duned\",\"mode\":\"reference\",\"face_px\":64,\"probes\":[[1.5,-2e1,3]]}",
    "{\"a\":[null,-0.5e+3,\"\\u00e9\\ud83d\\ude00\\n\xc3\xa9\xf0\x9f\x98\x80\"],\"b\":{\"c\":{}}}",
    "[[[[\"\xe2\x82\xac\",1e-5,[],{}]]],\"x\\\\\",12345678901234]",
    "{\"environment\":{\"constant\":[0,0.25,1]},\"faces\":[\"+X\",\"-Z\"],\"client_ref\":\"\\t\"}",
};

TEST(gate_refuses_every_truncation)
{
    for (size_t d = 0; d < sizeof documents / sizeof documents[0]; d++) {
        size_t bytes = strlen(documents[d]);
        struct wire_problem problem;
        CHECK_EQ(check(&problem, documents[d], bytes), OK);
        for (size_t cut = 0; cut < bytes; cut++) {
            CHECK_EQ(check(&problem, documents[d], cut), NO);
            CHECK_HAS(problem.detail, "line 1, column ");
        }
    }
}

/* Flips, replaces, removes and doubles bytes; returns the new length. */
static size_t mutate(test_random *random, char *text, size_t bytes)
{
    static const char likely[] = "{}[]\",:\\0123456789.eE+-untrfal \t\n\xc3\xa9\xed\xf4\xff";
    uint32_t changes = 1 + test_random_below(random, 3);
    for (uint32_t i = 0; i < changes && bytes > 1; i++) {
        size_t at = test_random_below(random, (uint32_t)bytes);
        switch (test_random_below(random, 5)) {
        case 0:
            text[at] = (char)test_random_u64(random);
            break;
        case 1:
            text[at] = likely[test_random_below(random, sizeof likely)];
            break;
        case 2:
            text[at] = (char)(text[at] ^ 1 << test_random_below(random, 8));
            break;
        case 3:
            memmove(text + at, text + at + 1, bytes - at - 1);
            bytes--;
            break;
        default:
            memmove(text + at + 1, text + at, bytes - at);
            bytes++;
            break;
        }
    }
    return bytes;
}

TEST(gate_survives_mutations_and_agrees_with_the_parser)
{
    test_random random = test_random_begin();
    unsigned verdicts[4] = {0};
    for (int i = 0; i < 20000; i++) {
        const char *document = documents[test_random_below(&random, 4)];
        char text[512];
        size_t bytes = strlen(document);
        memcpy(text, document, bytes);
        bytes = mutate(&random, text, bytes);
        struct wire_problem problem; /* check() also gives what passes to cJSON */
        verdicts[check(&problem, text, bytes)]++;
        CHECK(problem.detail[sizeof problem.detail - 1] == '\0');
    }
    CHECK(verdicts[OK] > 1000); /* the noise is neither too loud nor too quiet */
    CHECK(verdicts[NO] > 1000);
}
