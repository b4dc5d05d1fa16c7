/* The reader of single fields: a thin face over cJSON's tree. */
#include "protocol/read.h"

#include "protocol/text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#define INTEGER_MAX   9007199254740992.0 /* 2^53 */
#define PRINT_NESTING 64

struct wire_read {
    cJSON *root;
};

/* A wire_value is a cJSON node under another name: nothing of cJSON shows in the header. */
static const cJSON *node_of(const struct wire_value *value)
{
    return (const cJSON *)(const void *)value;
}

static const struct wire_value *value_of(const cJSON *node)
{
    return (const struct wire_value *)(const void *)node;
}

struct wire_read *wire_read_open(const char *text, size_t bytes)
{
    if (!text)
        return NULL;
    const char *end = NULL;
    cJSON *root = cJSON_ParseWithLengthOpts(text, bytes, &end, false);
    if (!root)
        return NULL;
    /* Only white space may follow. */
    for (const char *at = end; at < text + bytes; at++) {
        if (*at != ' ' && *at != '\t' && *at != '\n' && *at != '\r') {
            cJSON_Delete(root);
            return NULL;
        }
    }
    struct wire_read *read = malloc(sizeof *read);
    if (!read) {
        cJSON_Delete(root);
        return NULL;
    }
    read->root = root;
    return read;
}

void wire_read_close(struct wire_read **read)
{
    if (!read || !*read)
        return;
    cJSON_Delete((*read)->root);
    free(*read);
    *read = NULL;
}

const struct wire_value *wire_read_root(const struct wire_read *read)
{
    return read ? value_of(read->root) : NULL;
}

const struct wire_value *wire_read_get(const struct wire_value *object, const char *name)
{
    if (!wire_read_is_object(object))
        return NULL;
    return value_of(cJSON_GetObjectItemCaseSensitive(node_of(object), name));
}

size_t wire_read_count(const struct wire_value *value)
{
    size_t count = 0;
    for (const struct wire_value *at = wire_read_first(value); at; at = wire_read_next(at))
        count++;
    return count;
}

const struct wire_value *wire_read_first(const struct wire_value *value)
{
    return value ? value_of(node_of(value)->child) : NULL;
}

const struct wire_value *wire_read_next(const struct wire_value *value)
{
    return value ? value_of(node_of(value)->next) : NULL;
}

const char *wire_read_key(const struct wire_value *value)
{
    return value ? node_of(value)->string : NULL;
}

bool wire_read_is_object(const struct wire_value *value)
{
    return value && cJSON_IsObject(node_of(value));
}

bool wire_read_is_array(const struct wire_value *value)
{
    return value && cJSON_IsArray(node_of(value));
}

const char *wire_read_text(const struct wire_value *value)
{
    return value && cJSON_IsString(node_of(value)) ? node_of(value)->valuestring : NULL;
}

bool wire_read_f64(double *out, const struct wire_value *value)
{
    if (!value || !cJSON_IsNumber(node_of(value)) || !isfinite(node_of(value)->valuedouble))
        return false;
    *out = node_of(value)->valuedouble;
    return true;
}

bool wire_read_u64(uint64_t *out, const struct wire_value *value)
{
    double number;
    if (!wire_read_f64(&number, value) || !(number >= 0 && number <= INTEGER_MAX) ||
        floor(number) != number)
        return false;
    *out = (uint64_t)number;
    return true;
}

bool wire_read_bool(bool *out, const struct wire_value *value)
{
    if (!value || !cJSON_IsBool(node_of(value)))
        return false;
    *out = cJSON_IsTrue(node_of(value));
    return true;
}

/* Takes `item` over, whatever happens. */
static bool set_member(struct wire_read *read, const char *name, cJSON *item)
{
    if (!item || !read || !cJSON_IsObject(read->root)) {
        cJSON_Delete(item);
        return false;
    }
    cJSON_DeleteItemFromObjectCaseSensitive(read->root, name);
    if (cJSON_AddItemToObject(read->root, name, item))
        return true;
    cJSON_Delete(item);
    return false;
}

bool wire_read_set_text(struct wire_read *read, const char *name, const char *value)
{
    return set_member(read, name, cJSON_CreateString(value));
}

bool wire_read_set_json(struct wire_read *read, const char *name, const char *json)
{
    return set_member(read, name, cJSON_ParseWithOpts(json, NULL, true));
}

/* Makes every number below `node` raw text: cJSON's own printing loses bits. */
static bool numbers_to_raw(cJSON *node, unsigned depth)
{
    if (depth > PRINT_NESTING)
        return false;
    if (cJSON_IsNumber(node)) {
        char text[WIRE_NUMBER_BYTES];
        double number = node->valuedouble;
        if (isinf(number)) /* 1e999 in the source: stays out of range for whoever reads it next */
            snprintf(text, sizeof text, "%s1e999", number < 0 ? "-" : "");
        else
            wire_number_text(text, number);
        char *raw = cJSON_malloc(strlen(text) + 1);
        if (!raw)
            return false;
        memcpy(raw, text, strlen(text) + 1);
        node->valuestring = raw;
        node->type = (node->type & ~0xff) | cJSON_Raw;
    }
    for (cJSON *child = node->child; child; child = child->next)
        if (!numbers_to_raw(child, depth + 1))
            return false;
    return true;
}

char *wire_read_print(const struct wire_value *value)
{
    if (!value)
        return NULL;
    char *text = NULL;
    cJSON *copy = cJSON_Duplicate(node_of(value), true);
    if (copy && numbers_to_raw(copy, 0))
        text = cJSON_PrintUnformatted(copy);
    cJSON_Delete(copy);
    return text;
}
