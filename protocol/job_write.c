/* Writing a job back: every field of the table that is in this version, defaults too. */
#include "protocol/fields.h"
#include "protocol/tree.h"

#include <string.h>

const char *wire_kind_text(enum wire_kind kind)
{
    return wire_word_text(wire_words_kind, (int)kind);
}

static uint32_t word_mask(const struct wire_field *field, const struct wire_job *job)
{
    uint32_t mask = 0;
    if (field->store == WIRE_STORE_FACES) {
        for (uint32_t i = 0; i < job->face_count && i < WIRE_FACES; i++)
            mask |= 1u << (job->faces[i] & 7u);
    } else if (field->store == WIRE_STORE_FLAGS) {
        const bool *flags = (const bool *)((const char *)job + field->offset);
        for (const struct wire_word *word = field->words; word->text; word++)
            if (word->value != WIRE_WORD_LATER && flags[word->value])
                mask |= 1u << word->value;
    } else {
        mask = 1; /* the only word of this version */
    }
    return mask;
}

static void write_words(struct wire_tree *tree, const struct wire_field *field,
                        const struct wire_job *job)
{
    uint32_t mask = word_mask(field, job);
    wire_tree_open_list(tree, field->name);
    for (const struct wire_word *word = field->words; word->text; word++)
        if (word->value != WIRE_WORD_LATER && mask >> word->value & 1u)
            wire_tree_text(tree, NULL, word->text);
    wire_tree_close(tree);
}

static void write_field(struct wire_tree *tree, const struct wire_field *field,
                        const struct wire_job *job)
{
    const char *at = (const char *)job + field->offset;
    uint32_t u32 = 0;
    if (field->store == WIRE_STORE_U32)
        memcpy(&u32, at, sizeof u32);
    switch (field->type) {
    case WIRE_FIELD_NAME:
    case WIRE_FIELD_TEXT:
        wire_tree_text(tree, field->name, at);
        break;
    case WIRE_FIELD_WORD:
        wire_tree_text(tree, field->name, wire_word_text(field->words, (int)u32));
        break;
    case WIRE_FIELD_WORDS:
        write_words(tree, field, job);
        break;
    case WIRE_FIELD_INTEGER:
        if (field->store == WIRE_STORE_U64)
            wire_tree_u64(tree, field->name, *(const uint64_t *)(const void *)at);
        else
            wire_tree_u64(tree, field->name, u32);
        break;
    case WIRE_FIELD_PROBES:
        wire_tree_open_list(tree, field->name);
        wire_tree_vec3(tree, NULL, (const double *)(const void *)at);
        wire_tree_close(tree);
        break;
    case WIRE_FIELD_ENVIRONMENT:
        wire_tree_open(tree, field->name);
        wire_tree_vec3(tree, "constant", (const double *)(const void *)at);
        wire_tree_close(tree);
        break;
    case WIRE_FIELD_NUMBER: /* of later versions only, so far */
    case WIRE_FIELD_OBJECT:
    case WIRE_FIELD_LIST:
        break;
    }
}

void wire_tree_job(struct wire_tree *tree, const struct wire_job *job)
{
    for (size_t i = 0; i < wire_field_count; i++) {
        const struct wire_field *field = &wire_fields[i];
        if (!field->later)
            write_field(tree, field, job);
    }
}

char *wire_job_write(const struct wire_job *job)
{
    struct wire_tree tree;
    wire_tree_begin(&tree);
    wire_tree_job(&tree, job);
    return wire_tree_end(&tree);
}
