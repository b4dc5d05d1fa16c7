/* The table of fields: it is sound, and PROTOCOL.md shows exactly this table.
 *
 * LP_WRITE_PROTOCOL=1 build/debug/tests/protocol/test_fields writes the table into PROTOCOL.md. */
#include "protocol/fields.h"
#include "protocol/json_gate.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TEXT_BYTES 65536
#define BEGIN      "<!-- fields: written by tests/protocol/test_fields -->\n"
#define END        "<!-- end of fields -->\n"

static const char *type_text(enum wire_field_type type)
{
    static const char *const texts[] = {"name",    "text",   "word",           "list of words",
                                        "integer", "number", "list of places", "object",
                                        "object",  "list"};
    return texts[type];
}

/* "lod, adaptive" or "all". */
static void uses_text(char *out, size_t bytes, uint32_t mask, const struct wire_word *words)
{
    size_t used = 0;
    if (mask == WIRE_ANY) {
        snprintf(out, bytes, "all");
        return;
    }
    for (uint32_t i = 0; words[i].text; i++)
        if (mask >> i & 1u)
            used +=
                (size_t)snprintf(out + used, bytes - used, "%s%s", used ? ", " : "", words[i].text);
}

static size_t write_row(char *out, size_t bytes, const struct wire_field *field)
{
    char range[WIRE_RANGE_BYTES], kinds[64], modes[64], fallback[96];
    wire_field_range(range, field);
    uses_text(kinds, sizeof kinds, field->kinds, wire_words_kind);
    uses_text(modes, sizeof modes, field->modes, wire_words_mode);
    const char *tick = field->later ? "" : "`";
    if (field->fallback)
        snprintf(fallback, sizeof fallback, "%s%s%s", tick, field->fallback, tick);
    else
        snprintf(fallback, sizeof fallback, "required");
    return (size_t)snprintf(out, bytes, "| `%s` | %s | %s | %s | %s | %s | %s | %s | %s |\n",
                            field->name, field->later ? "later" : "yes", type_text(field->type),
                            field->unit ? field->unit : "", range, fallback, kinds, modes,
                            field->doc);
}

static void write_table(char *out, size_t bytes)
{
    size_t used = (size_t)snprintf(
        out, bytes,
        BEGIN "\n| field | in this version | type | unit | range | default | kinds | modes | "
              "meaning |\n|---|---|---|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < wire_field_count && used < bytes; i++)
        used += write_row(out + used, bytes - used, &wire_fields[i]);
    REQUIRE(used < bytes);
    snprintf(out + used, bytes - used, "\n" END);
}

static char *read_file(const char *path)
{
    char *text = calloc(1, TEXT_BYTES);
    FILE *file = fopen(path, "rb");
    if (!file || !text)
        test_abort(__FILE__, __LINE__, "cannot read %s", path);
    size_t bytes = fread(text, 1, TEXT_BYTES - 1, file);
    REQUIRE(bytes < TEXT_BYTES - 1);
    fclose(file);
    return text;
}

TEST(fields_are_sound)
{
    CHECK(wire_field_count <= 64); /* job_read.c notes them in 64 bits */
    for (size_t i = 0; i < wire_field_count; i++) {
        const struct wire_field *field = &wire_fields[i];
        CHECK(wire_field_find(field->name) == field);
        CHECK(field->doc && field->kinds && field->modes);
        CHECK(field->fallback || (field->example && !field->later));
        char range[WIRE_RANGE_BYTES];
        wire_field_range(range, field);
        CHECK(range[0] != '\0' && strlen(range) < sizeof range - 1);
        if (field->later)
            continue;
        CHECK(field->offset < sizeof(struct wire_job));
        CHECK(field->fallback == NULL || field->fallback[0] != '\0');
        if (field->type == WIRE_FIELD_INTEGER)
            CHECK(field->max >= field->min && field->max <= 0x1p53);
        if (field->fallback) {
            struct wire_problem problem = {.code = WIRE_PROBLEM_NONE};
            CHECK_EQ(wire_gate_check(&problem, field->fallback, strlen(field->fallback)),
                     WIRE_GATE_OK);
        }
    }
    CHECK(wire_field_find("Scene") == NULL && wire_field_find("") == NULL);
}

TEST(fields_are_all_of_the_contract)
{
    static const char *const names[] = {"kind",
                                        "scene",
                                        "lighting",
                                        "lightings",
                                        "probes",
                                        "grid",
                                        "mode",
                                        "face_px",
                                        "faces",
                                        "levels",
                                        "threshold",
                                        "decay",
                                        "table",
                                        "samples_per_axis",
                                        "max_refinement",
                                        "variance_low",
                                        "variance_high",
                                        "iterations",
                                        "variance_scale",
                                        "base_level",
                                        "environment",
                                        "seed",
                                        "sh",
                                        "images",
                                        "layout",
                                        "aovs",
                                        "priority",
                                        "deadline_ms",
                                        "client_ref",
                                        "reference",
                                        "candidates",
                                        "thresholds",
                                        "decays",
                                        "face_px_list",
                                        "modes",
                                        "target",
                                        "search"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (!wire_field_find(names[i]))
            test_fail(__FILE__, __LINE__, "%s is missing", names[i]);
    CHECK_EQ(wire_field_count, sizeof names / sizeof names[0]);
}

TEST(suggestions_are_close)
{
    static const struct {
        const char *unknown, *known;
    } cases[] = {{"scen", "scene"},
                 {"sceen", "scene"},
                 {"secne", "scene"},
                 {"scenes", "scene"},
                 {"Mode", "mode"},
                 {"mdoe", "mode"},
                 {"csnee", "scene"},
                 {"probe", "probes"},
                 {"seeed", "seed"},
                 {"tresholds", "thresholds"},
                 {"client-ref", "client_ref"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        CHECK_STR(wire_field_suggest(cases[i].unknown), cases[i].known);
    static const char *const far[] = {"",
                                      "x",
                                      "xy",
                                      "position",
                                      "resolution",
                                      "s_c_e_n_e_",
                                      "a name that is much longer than every known field"};
    for (size_t i = 0; i < sizeof far / sizeof far[0]; i++)
        if (wire_field_suggest(far[i]))
            test_fail(__FILE__, __LINE__, "%s gives %s", far[i], wire_field_suggest(far[i]));
    CHECK(wire_word_suggest(wire_words_mode, "adaptiv") == NULL); /* not in this version */
    CHECK_STR(wire_word_suggest(wire_words_mode, "lood"), "lod");
}

TEST(words_are_listed_for_people)
{
    char text[WIRE_RANGE_BYTES];
    wire_words_list(text, wire_words_mode);
    CHECK_STR(text, "\"reference\" or \"lod\"");
    wire_words_list(text, wire_words_kind);
    CHECK_STR(text, "\"render\"");
    wire_field_range(text, wire_field_find("mode"));
    CHECK_STR(text, "`reference`, `lod`; later `adaptive`, `error-aware`, `prefiltered`");
    wire_field_range(text, wire_field_find("face_px"));
    CHECK_STR(text, "1..4096");
    wire_field_range(text, wire_field_find("seed"));
    CHECK_STR(text, "0..2^53");
    CHECK_STR(wire_word_text(wire_words_mode, WIRE_MODE_LOD), "lod");
    CHECK_STR(wire_word_text(wire_words_mode, 77), "");
    CHECK_STR(wire_word_text(wire_words_mode, WIRE_WORD_LATER), "");
}

/* The texts of problems' statuses and types are by hand; that none is forgotten is checked. */
TEST(protocol_document_names_every_problem)
{
    char path[4200];
    snprintf(path, sizeof path, "%s/protocol/PROTOCOL.md", test_root());
    char *text = read_file(path);
    for (unsigned code = WIRE_PROBLEM_NONE + 1; code <= WIRE_PROBLEM_INTERNAL; code++) {
        char cell[64];
        snprintf(cell, sizeof cell, "| `%s` |", wire_problem_slug((enum wire_problem_code)code));
        CHECK_HAS(text, cell);
        CHECK_HAS(text, wire_problem_title((enum wire_problem_code)code));
    }
    free(text);
}

TEST(protocol_document_shows_the_table_of_fields)
{
    static char table[TEXT_BYTES];
    char path[4200];
    snprintf(path, sizeof path, "%s/protocol/PROTOCOL.md", test_root());
    write_table(table, sizeof table);
    char *text = read_file(path);
    char *begin = strstr(text, BEGIN), *end = strstr(text, END);
    REQUIRE(begin && end && begin < end);
    end += strlen(END);
    bool same = strlen(table) == (size_t)(end - begin) && memcmp(table, begin, strlen(table)) == 0;
    if (!same && getenv("LP_WRITE_PROTOCOL")) {
        FILE *file = fopen(path, "wb");
        REQUIRE(file);
        fprintf(file, "%.*s%s%s", (int)(begin - text), text, table, end);
        REQUIRE(fclose(file) == 0);
        same = true;
    }
    CHECK(same); /* run with LP_WRITE_PROTOCOL=1 to renew it */
    free(text);
}
