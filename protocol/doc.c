/* The small JSON writer of wire.h: a tree on the heap. */
#include "protocol/tree.h"

/* Functions accept NULL, so that a failed begin shows only at the end. */
struct wire_doc {
    struct wire_tree tree;
};

struct wire_doc *wire_doc_begin(void)
{
    struct wire_doc *doc = cJSON_malloc(sizeof *doc);
    if (doc)
        wire_tree_begin(&doc->tree);
    return doc;
}

void wire_doc_open(struct wire_doc *doc, const char *name)
{
    if (doc)
        wire_tree_open(&doc->tree, name);
}

void wire_doc_close(struct wire_doc *doc)
{
    if (doc)
        wire_tree_close(&doc->tree);
}

void wire_doc_text(struct wire_doc *doc, const char *name, const char *value)
{
    if (doc)
        wire_tree_text(&doc->tree, name, value);
}

void wire_doc_u64(struct wire_doc *doc, const char *name, uint64_t value)
{
    if (doc)
        wire_tree_u64(&doc->tree, name, value);
}

void wire_doc_f64(struct wire_doc *doc, const char *name, double value)
{
    if (doc)
        wire_tree_f64(&doc->tree, name, value);
}

void wire_doc_bool(struct wire_doc *doc, const char *name, bool value)
{
    if (doc)
        wire_tree_bool(&doc->tree, name, value);
}

char *wire_doc_end(struct wire_doc *doc)
{
    if (!doc)
        return NULL;
    char *text = wire_tree_end(&doc->tree);
    cJSON_free(doc);
    return text;
}
