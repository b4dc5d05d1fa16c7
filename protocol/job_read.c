/* Reading a job's document: the gate first, then every field by the table. */
#include "protocol/fields.h"
#include "protocol/json_gate.h"
#include "protocol/name.h"
#include "protocol/text.h"

#include <cjson/cJSON.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

_Static_assert(sizeof(enum wire_kind) == sizeof(uint32_t) &&
                   sizeof(enum wire_mode) == sizeof(uint32_t) &&
                   sizeof(enum wire_levels) == sizeof(uint32_t) &&
                   sizeof(enum wire_layout) == sizeof(uint32_t),
               "WIRE_STORE_U32 holds enums");

struct reader {
    struct wire_job *job;
    struct wire_problem *problem;
    bool fallback; /* what is being read is the table's default, not the client's value */
};

/* More offenders than fit are left out, so there is no use in looking for them. */
static bool is_full(const struct reader *reader)
{
    return reader->problem->error_count == WIRE_FIELD_ERRORS_MAX;
}

static const char *type_text(const cJSON *item)
{
    switch (item->type & 0xff) {
    case cJSON_False:
    case cJSON_True:
        return "a boolean";
    case cJSON_Number:
        return "a number";
    case cJSON_String:
        return "a text";
    case cJSON_Array:
        return "a list";
    case cJSON_Object:
        return "an object";
    default:
        return "null";
    }
}

static void wrong_type(struct reader *reader, struct wire_pointer at, const char *expected,
                       const cJSON *item)
{
    wire_problem_field(reader->problem, at.text, "expected %s, found %s", expected,
                       type_text(item));
}

static void *place(const struct reader *reader, const struct wire_field *field)
{
    return (char *)reader->job + field->offset;
}

/* The pointer to a field of the document itself. */
static struct wire_pointer pointer_to(const char *name)
{
    return wire_pointer_key(wire_pointer_root(), name, strlen(name));
}

/* ---- single values -----------------------------------------------------------------------------
 */

static void read_name(struct reader *reader, const struct wire_field *field, struct wire_pointer at,
                      const cJSON *item)
{
    char why[WIRE_NAME_WHY_BYTES], quote[WIRE_QUOTE_BYTES];
    if (!cJSON_IsString(item)) {
        wrong_type(reader, at, "a name in double quotes", item);
        return;
    }
    if (!wire_name_check(why, item->valuestring)) {
        wire_text_quote(quote, item->valuestring);
        wire_problem_field(reader->problem, at.text, "%s is not a name: %s", quote, why);
        return;
    }
    memcpy(place(reader, field), item->valuestring, strlen(item->valuestring) + 1);
}

static void read_text(struct reader *reader, const struct wire_field *field, struct wire_pointer at,
                      const cJSON *item)
{
    if (!cJSON_IsString(item)) {
        wrong_type(reader, at, "a text in double quotes", item);
        return;
    }
    size_t bytes = strlen(item->valuestring);
    if (bytes > (size_t)field->max) {
        wire_problem_field(reader->problem, at.text, "a text of %zu bytes is too long; at most %d",
                           bytes, (int)field->max);
        return;
    }
    memcpy(place(reader, field), item->valuestring, bytes + 1);
}

/* A number of min..max into `*out`; 0 and false when it is none. */
static bool read_number(double *out, struct reader *reader, const struct wire_field *field,
                        struct wire_pointer at, const cJSON *item)
{
    bool whole = field->type == WIRE_FIELD_INTEGER;
    char text[WIRE_NUMBER_BYTES], low[WIRE_NUMBER_BYTES], high[WIRE_NUMBER_BYTES];
    if (!cJSON_IsNumber(item)) {
        wrong_type(reader, at, whole ? "a whole number" : "a number", item);
        return false;
    }
    double value = item->valuedouble;
    if (!isfinite(value)) {
        wire_problem_field(reader->problem, at.text, "the number is out of range");
        return false;
    }
    wire_number_text(text, value);
    if (!(value >= field->min && value <= field->max)) {
        wire_number_text(low, field->min);
        wire_number_text(high, field->max);
        wire_problem_field(reader->problem, at.text, "%s is out of range: expected %s, %s..%s%s%s",
                           text, whole ? "a whole number" : "a number", low, high,
                           field->unit ? " " : "", field->unit ? field->unit : "");
        return false;
    }
    if (whole && value != floor(value)) {
        wire_problem_field(reader->problem, at.text, "%s is not a whole number", text);
        return false;
    }
    *out = value;
    return true;
}

static void read_integer(struct reader *reader, const struct wire_field *field,
                         struct wire_pointer at, const cJSON *item)
{
    double value;
    if (!read_number(&value, reader, field, at, item))
        return;
    if (field->store == WIRE_STORE_U64)
        *(uint64_t *)place(reader, field) = (uint64_t)value;
    else
        *(uint32_t *)place(reader, field) = (uint32_t)value;
}

/* ---- words -------------------------------------------------------------------------------------
 */

static void refuse_later_word(struct reader *reader, struct wire_pointer at,
                              const struct wire_field *field, const char *word)
{
    char known[WIRE_RANGE_BYTES];
    wire_words_list(known, field->words);
    if (reader->fallback)
        wire_problem_field(reader->problem, at.text,
                           "the default %s %s is not in this version; ask for %s", field->name,
                           word, known);
    else
        wire_problem_field(reader->problem, at.text,
                           "\"%s\" is not in this version; what works is %s", word, known);
}

/* The word's value into `*out`; false when it is none of this version. */
static bool read_one_word(uint32_t *out, struct reader *reader, const struct wire_field *field,
                          struct wire_pointer at, const cJSON *item)
{
    if (!cJSON_IsString(item)) {
        wrong_type(reader, at, "a word in double quotes", item);
        return false;
    }
    for (const struct wire_word *word = field->words; word->text; word++) {
        if (strcmp(word->text, item->valuestring) != 0)
            continue;
        if (word->value == WIRE_WORD_LATER) {
            refuse_later_word(reader, at, field, word->text);
            return false;
        }
        *out = (uint32_t)word->value;
        return true;
    }
    char quote[WIRE_QUOTE_BYTES], known[WIRE_RANGE_BYTES];
    const char *close = wire_word_suggest(field->words, item->valuestring);
    wire_text_quote(quote, item->valuestring);
    wire_words_list(known, field->words);
    wire_problem_field(reader->problem, at.text, "%s is not known here; expected %s%s%s%s", quote,
                       known, close ? "; did you mean \"" : "", close ? close : "",
                       close ? "\"?" : "");
    return false;
}

static void read_word(struct reader *reader, const struct wire_field *field, struct wire_pointer at,
                      const cJSON *item)
{
    uint32_t value;
    if (!read_one_word(&value, reader, field, at, item))
        return;
    *(uint32_t *)place(reader, field) = value;
}

static void store_words(struct reader *reader, const struct wire_field *field, uint32_t mask)
{
    if (field->store == WIRE_STORE_FACES) {
        reader->job->face_count = 0;
        for (uint8_t face = 0; face < WIRE_FACES; face++)
            if (mask >> face & 1u)
                reader->job->faces[reader->job->face_count++] = face;
    } else if (field->store == WIRE_STORE_FLAGS) {
        bool *flags = place(reader, field);
        for (const struct wire_word *word = field->words; word->text; word++)
            if (word->value != WIRE_WORD_LATER)
                flags[word->value] = mask >> word->value & 1u;
    }
}

static void read_words(struct reader *reader, const struct wire_field *field,
                       struct wire_pointer at, const cJSON *item)
{
    if (!cJSON_IsArray(item)) {
        wrong_type(reader, at, "a list of words", item);
        return;
    }
    uint32_t mask = 0, index = 0;
    bool good = true;
    const cJSON *element;
    cJSON_ArrayForEach(element, item)
    {
        struct wire_pointer inner = wire_pointer_index(at, index++);
        uint32_t value;
        if (!read_one_word(&value, reader, field, inner, element)) {
            good = false;
        } else if (mask >> value & 1u) {
            good = false;
            wire_problem_field(reader->problem, inner.text, "\"%s\" is in the list twice",
                               element->valuestring);
        } else {
            mask |= 1u << value;
        }
        if (is_full(reader))
            return;
    }
    if (index < field->min)
        wire_problem_field(reader->problem, at.text, "the list must not be empty");
    else if (good)
        store_words(reader, field, mask);
}

/* ---- places and colours ------------------------------------------------------------------------
 */

/* Three numbers, each min..max of the field. */
static void read_vec3(struct reader *reader, const struct wire_field *field, struct wire_pointer at,
                      const cJSON *item, const char *expected)
{
    double values[3];
    uint32_t good = 0, index = 0;
    if (!cJSON_IsArray(item)) {
        wrong_type(reader, at, expected, item);
        return;
    }
    int count = cJSON_GetArraySize(item);
    if (count != 3) {
        wire_problem_field(reader->problem, at.text, "expected %s, found a list of %d", expected,
                           count);
        return;
    }
    const cJSON *element;
    cJSON_ArrayForEach(element, item)
    {
        good += read_number(&values[index], reader, field, wire_pointer_index(at, index), element);
        index++;
    }
    if (good == 3)
        memcpy(place(reader, field), values, sizeof values);
}

static void read_probes(struct reader *reader, const struct wire_field *field,
                        struct wire_pointer at, const cJSON *item)
{
    if (!cJSON_IsArray(item)) {
        wrong_type(reader, at, "a list with one place, such as [[0, 2, 0]]", item);
        return;
    }
    if (cJSON_IsNumber(item->child)) {
        wire_problem_field(reader->problem, at.text,
                           "expected a list of places, found a list of numbers: write [[x, y, z]]");
        return;
    }
    int count = cJSON_GetArraySize(item);
    if (count != 1)
        wire_problem_field(reader->problem, at.text,
                           "expected exactly one place, such as [[0, 2, 0]], found %d; send one "
                           "request for each",
                           count);
    uint32_t index = 0;
    const cJSON *element;
    cJSON_ArrayForEach(element, item)
    {
        struct wire_pointer inner = wire_pointer_index(at, index++);
        if (cJSON_IsObject(element))
            wire_problem_field(reader->problem, inner.text,
                               "places above the ground are not in this version; give [x, y, z] in "
                               "metres");
        else
            read_vec3(reader, field, inner, element, "three numbers [x, y, z] in metres");
        if (is_full(reader))
            return;
    }
}

static void refuse_unknown(struct reader *reader, struct wire_pointer at, const char *name,
                           const char *suggestion)
{
    char quote[WIRE_QUOTE_BYTES];
    wire_text_quote(quote, name);
    if (suggestion)
        wire_problem_field(reader->problem, at.text, "there is no field %s; did you mean \"%s\"?",
                           quote, suggestion);
    else
        wire_problem_field(reader->problem, at.text, "there is no field %s", quote);
}

static void read_environment(struct reader *reader, const struct wire_field *field,
                             struct wire_pointer at, const cJSON *item)
{
    if (!cJSON_IsObject(item)) {
        wrong_type(reader, at, "an object such as {\"constant\": [0, 0, 0]}", item);
        return;
    }
    uint32_t constants = 0, others = 0;
    const cJSON *element;
    cJSON_ArrayForEach(element, item)
    {
        const struct wire_word *word = field->words;
        struct wire_pointer inner = wire_pointer_key(at, element->string, strlen(element->string));
        while (word->text && strcmp(word->text, element->string) != 0)
            word++;
        if (!word->text)
            refuse_unknown(reader, inner, element->string,
                           wire_word_suggest(field->words, element->string));
        else if (word->value == WIRE_WORD_LATER)
            refuse_later_word(reader, inner, field, word->text);
        else if (constants++)
            wire_problem_field(reader->problem, inner.text, "the field is given twice");
        else
            read_vec3(reader, field, inner, element, "three numbers [r, g, b]");
        others += !word->text || word->value == WIRE_WORD_LATER;
        if (is_full(reader))
            return;
    }
    if (constants == 0 && others == 0)
        wire_problem_field(reader->problem, at.text,
                           "the object is empty: write {\"constant\": [r, g, b]}");
}

/* ---- the document ------------------------------------------------------------------------------
 */

static void read_field(struct reader *reader, const struct wire_field *field, const cJSON *item)
{
    struct wire_pointer at = pointer_to(field->name);
    switch (field->type) {
    case WIRE_FIELD_NAME:
        read_name(reader, field, at, item);
        break;
    case WIRE_FIELD_TEXT:
        read_text(reader, field, at, item);
        break;
    case WIRE_FIELD_WORD:
        read_word(reader, field, at, item);
        break;
    case WIRE_FIELD_WORDS:
        read_words(reader, field, at, item);
        break;
    case WIRE_FIELD_INTEGER:
        read_integer(reader, field, at, item);
        break;
    case WIRE_FIELD_PROBES:
        read_probes(reader, field, at, item);
        break;
    case WIRE_FIELD_ENVIRONMENT:
        read_environment(reader, field, at, item);
        break;
    case WIRE_FIELD_NUMBER: /* of later versions only, so far */
    case WIRE_FIELD_OBJECT:
    case WIRE_FIELD_LIST:
        break;
    }
}

static void read_given(struct reader *reader, uint64_t *seen, const cJSON *root)
{
    const cJSON *item;
    cJSON_ArrayForEach(item, root)
    {
        const struct wire_field *field = wire_field_find(item->string);
        struct wire_pointer at = pointer_to(item->string);
        uint64_t bit = field ? UINT64_C(1) << (field - wire_fields) : 0;
        if (!field)
            refuse_unknown(reader, at, item->string, wire_field_suggest(item->string));
        else if (*seen & bit)
            wire_problem_field(reader->problem, at.text, "the field is given twice");
        else if (field->later)
            wire_problem_field(reader->problem, at.text, "\"%s\" is not in this version: %s",
                               field->name, field->later);
        else
            read_field(reader, field, item);
        *seen |= bit;
        if (is_full(reader))
            return;
    }
}

/* The table's default as if it were given. False: out of memory. */
static bool read_fallback(struct reader *reader, const struct wire_field *field)
{
    cJSON *item = cJSON_Parse(field->fallback);
    if (!item)
        return false;
    reader->fallback = true;
    read_field(reader, field, item);
    reader->fallback = false;
    cJSON_Delete(item);
    return true;
}

/* Fields that were not given. False: out of memory. */
static bool read_missing(struct reader *reader, uint64_t seen)
{
    for (size_t i = 0; i < wire_field_count; i++) {
        const struct wire_field *field = &wire_fields[i];
        if (seen >> i & 1u || field->later)
            continue;
        if (!field->fallback)
            wire_problem_field(reader->problem, pointer_to(field->name).text,
                               "the field is missing; write it like %s", field->example);
        else if (!read_fallback(reader, field))
            return false;
    }
    return true;
}

static void read_root(struct reader *reader, const cJSON *root, bool *out_of_memory)
{
    if (!cJSON_IsObject(root)) {
        wrong_type(reader, wire_pointer_root(), "a job, which is an object", root);
        return;
    }
    uint64_t seen = 0;
    read_given(reader, &seen, root);
    if (is_full(reader))
        return;
    *out_of_memory = !read_missing(reader, seen);
}

enum wire_problem_code wire_job_read(struct wire_job *job, struct wire_problem *problem,
                                     const char *text, size_t bytes)
{
    struct wire_job draft;
    memset(&draft, 0, sizeof draft); /* padding too: jobs can be compared as bytes */
    memset(problem, 0, sizeof *problem);
    enum wire_gate gate = wire_gate_check(problem, text, bytes);
    if (gate == WIRE_GATE_REFUSED || gate == WIRE_GATE_UNREADABLE)
        return problem->code;

    /* With findings the rest is read all the same, so that all offenders are named at once. */
    cJSON *root = cJSON_ParseWithLength(text, bytes);
    bool out_of_memory = !root;
    struct reader reader = {.job = &draft, .problem = problem};
    if (root)
        read_root(&reader, root, &out_of_memory);
    cJSON_Delete(root);
    if (out_of_memory) {
        memset(problem, 0, sizeof *problem);
        return wire_problem_set(problem, WIRE_PROBLEM_INTERNAL,
                                "there is no memory left to read the job; try again later");
    }
    if (problem->code == WIRE_PROBLEM_NONE)
        memcpy(job, &draft, sizeof draft); /* padding too */
    return problem->code;
}
