/* Problems: what was wrong with a request, and its application/problem+json document. */
#include "protocol/tree.h"

#include "protocol/text.h"

#include <stdio.h>
#include <string.h>

struct problem_words {
    const char *slug, *title;
};

static const struct problem_words words[] = {
#define X(name, slug, title) {slug, title},
    WIRE_PROBLEMS(X)
#undef X
};

static const struct problem_words *words_of(enum wire_problem_code code)
{
    size_t index = (size_t)code;
    return &words[index < sizeof words / sizeof words[0] ? index : WIRE_PROBLEM_INTERNAL];
}

const char *wire_problem_slug(enum wire_problem_code code)
{
    return words_of(code)->slug;
}

const char *wire_problem_title(enum wire_problem_code code)
{
    return words_of(code)->title;
}

enum wire_problem_code wire_problem_set(struct wire_problem *problem, enum wire_problem_code code,
                                        const char *format, ...)
{
    if (problem->code != WIRE_PROBLEM_NONE)
        return code;
    problem->code = code;
    va_list args;
    va_start(args, format);
    wire_text_print(problem->detail, sizeof problem->detail, format, args);
    va_end(args);
    return code;
}

__attribute__((format(printf, 2, 3))) static void say(struct wire_problem *problem,
                                                      const char *format, ...)
{
    va_list args;
    va_start(args, format);
    wire_text_print(problem->detail, sizeof problem->detail, format, args);
    va_end(args);
}

void wire_problem_field(struct wire_problem *problem, const char *pointer, const char *format, ...)
{
    if (problem->code != WIRE_PROBLEM_NONE && problem->code != WIRE_PROBLEM_INVALID_FIELD)
        return;
    problem->code = WIRE_PROBLEM_INVALID_FIELD;
    for (uint32_t i = 0; i < problem->error_count; i++)
        if (strcmp(problem->errors[i].pointer, pointer) == 0 &&
            strlen(pointer) + 1 < sizeof problem->errors[i].pointer) /* a cut one may be another */
            return; /* one sentence for a place: the first */

    if (problem->error_count < WIRE_FIELD_ERRORS_MAX) {
        struct wire_field_error *error = &problem->errors[problem->error_count++];
        snprintf(error->pointer, sizeof error->pointer, "%s", pointer);
        va_list args;
        va_start(args, format);
        wire_text_print(error->detail, sizeof error->detail, format, args);
        va_end(args);
    }
    const struct wire_field_error *first = &problem->errors[0];
    const char *colon = first->pointer[0] == '\0' ? "" : ": ";
    if (problem->error_count == 1)
        say(problem, "%s%s%s", first->pointer, colon, first->detail);
    else
        say(problem, "%s%u fields are wrong; the first is %s%s%s",
            problem->error_count == WIRE_FIELD_ERRORS_MAX ? "at least " : "", problem->error_count,
            first->pointer, colon, first->detail);
}

char *wire_problem_write(const struct wire_problem *problem, int status, const char *request_id)
{
    char type[64];
    snprintf(type, sizeof type, "/problems/%s", wire_problem_slug(problem->code));
    struct wire_tree tree;
    wire_tree_begin(&tree);
    wire_tree_text(&tree, "type", type);
    wire_tree_text(&tree, "title", wire_problem_title(problem->code));
    wire_tree_u64(&tree, "status", status < 0 ? 0 : (uint64_t)status);
    wire_tree_text(&tree, "detail", problem->detail);
    if (problem->error_count) {
        wire_tree_open_list(&tree, "errors");
        for (uint32_t i = 0; i < problem->error_count && i < WIRE_FIELD_ERRORS_MAX; i++) {
            wire_tree_open(&tree, NULL);
            wire_tree_text(&tree, "pointer", problem->errors[i].pointer);
            wire_tree_text(&tree, "detail", problem->errors[i].detail);
            wire_tree_close(&tree);
        }
        wire_tree_close(&tree);
    }
    if (request_id && request_id[0])
        wire_tree_text(&tree, "request_id", request_id);
    return wire_tree_end(&tree);
}
