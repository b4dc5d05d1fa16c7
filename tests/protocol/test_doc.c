/* The small JSON writer: nesting, exact numbers, and misuse that ends in NULL. */
#include "protocol/wire.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>

TEST(doc_writes_what_it_is_told)
{
    struct wire_doc *doc = wire_doc_begin();
    wire_doc_text(doc, "a", "x\"\n\x01\xff");
    wire_doc_u64(doc, "max", UINT64_MAX);
    wire_doc_open(doc, "in");
    wire_doc_f64(doc, "pi", 3.141592653589793);
    wire_doc_f64(doc, "nan", NAN);
    wire_doc_f64(doc, "inf", -INFINITY);
    wire_doc_open(doc, "deep");
    wire_doc_close(doc);
    wire_doc_close(doc);
    wire_doc_bool(doc, "yes", true);
    wire_doc_bool(doc, "no", false);
    wire_doc_text(doc, "none", NULL);
    char *text = wire_doc_end(doc);
    CHECK_STR(text, "{\"a\":\"x\\\"\\n\\u0001?\",\"max\":18446744073709551615,\"in\":{\"pi\":"
                    "3.141592653589793,\"nan\":null,\"inf\":null,\"deep\":{}},\"yes\":true,\"no\":"
                    "false,\"none\":null}");
    free(text);
    text = wire_doc_end(wire_doc_begin());
    CHECK_STR(text, "{}");
    free(text);
}

TEST(doc_nesting_is_limited)
{
    for (int depth = 8; depth <= 9; depth++) {
        struct wire_doc *doc = wire_doc_begin();
        for (int i = 0; i < depth; i++)
            wire_doc_open(doc, "o");
        wire_doc_u64(doc, "n", 1);
        for (int i = 0; i < depth; i++)
            wire_doc_close(doc);
        char *text = wire_doc_end(doc);
        CHECK_EQ(text != NULL, depth == 8);
        free(text);
    }
}

TEST(doc_misuse_is_harmless)
{
    struct wire_doc *doc = wire_doc_begin();
    wire_doc_close(doc);
    wire_doc_u64(doc, "n", 1);
    CHECK(wire_doc_end(doc) == NULL);
    wire_doc_open(NULL, "a");
    wire_doc_u64(NULL, "a", 1);
    CHECK(wire_doc_end(NULL) == NULL);
    doc = wire_doc_begin();
    wire_doc_open(doc, "left open");
    char *text = wire_doc_end(doc);
    CHECK_STR(text, "{\"left open\":{}}");
    free(text);
}
