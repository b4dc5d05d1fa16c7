/* A JSON document under construction: cJSON's tree with one sticky failure, numbers exact. */
#include "protocol/tree.h"

#include "protocol/text.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

void wire_tree_begin(struct wire_tree *tree)
{
    *tree = (struct wire_tree){.open = {cJSON_CreateObject()}};
    tree->failed = !tree->open[0];
}

char *wire_tree_end(struct wire_tree *tree)
{
    char *text = tree->failed ? NULL : cJSON_PrintUnformatted(tree->open[0]);
    cJSON_Delete(tree->open[0]);
    *tree = (struct wire_tree){.failed = true};
    return text;
}

/* Takes over `item`, which may be NULL (out of memory); returns it where it has its place now. */
static cJSON *add(struct wire_tree *tree, const char *name, cJSON *item)
{
    bool done = false;
    if (!tree->failed && item)
        done = name ? cJSON_AddItemToObject(tree->open[tree->depth], name, item)
                    : cJSON_AddItemToArray(tree->open[tree->depth], item);
    if (done)
        return item;
    cJSON_Delete(item);
    tree->failed = true;
    return NULL;
}

static void descend(struct wire_tree *tree, const char *name, cJSON *item)
{
    if (tree->depth == WIRE_TREE_NESTING_MAX)
        tree->failed = true;
    item = add(tree, name, item);
    if (item)
        tree->open[++tree->depth] = item;
}

void wire_tree_open(struct wire_tree *tree, const char *name)
{
    descend(tree, name, cJSON_CreateObject());
}

void wire_tree_open_list(struct wire_tree *tree, const char *name)
{
    descend(tree, name, cJSON_CreateArray());
}

void wire_tree_close(struct wire_tree *tree)
{
    if (tree->failed || tree->depth == 0)
        tree->failed = true;
    else
        tree->depth--;
}

void wire_tree_text(struct wire_tree *tree, const char *name, const char *value)
{
    cJSON *item = add(tree, name, value ? cJSON_CreateString(value) : cJSON_CreateNull());
    if (!item || !value)
        return;
    char *at = item->valuestring;
    for (size_t left = strlen(at); left > 0;) {
        size_t length = wire_utf8_sequence(at, left);
        if (length == 0) {
            *at = '?';
            length = 1;
        }
        at += length;
        left -= length;
    }
}

void wire_tree_u64(struct wire_tree *tree, const char *name, uint64_t value)
{
    char text[24];
    snprintf(text, sizeof text, "%" PRIu64, value);
    add(tree, name, cJSON_CreateRaw(text));
}

void wire_tree_f64(struct wire_tree *tree, const char *name, double value)
{
    char text[WIRE_NUMBER_BYTES] = "null";
    if (isfinite(value))
        wire_number_text(text, value);
    add(tree, name, cJSON_CreateRaw(text));
}

void wire_tree_bool(struct wire_tree *tree, const char *name, bool value)
{
    add(tree, name, cJSON_CreateBool(value));
}

void wire_tree_vec3(struct wire_tree *tree, const char *name, const double value[3])
{
    wire_tree_open_list(tree, name);
    for (int axis = 0; axis < 3; axis++)
        wire_tree_f64(tree, NULL, value[axis]);
    wire_tree_close(tree);
}
