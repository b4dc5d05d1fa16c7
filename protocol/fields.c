/* The one table of a job's fields, and questions about it. */
#include "protocol/fields.h"

#include "protocol/text.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

#define LATER WIRE_WORD_LATER

const struct wire_word wire_words_kind[] = {
    {"render", WIRE_KIND_RENDER}, {"compare", LATER}, {"sweep", LATER}, {"tune", LATER}, {NULL, 0}};
const struct wire_word wire_words_mode[] = {{"reference", WIRE_MODE_REFERENCE},
                                            {"lod", WIRE_MODE_LOD},
                                            {"adaptive", LATER},
                                            {"error-aware", LATER},
                                            {"prefiltered", LATER},
                                            {NULL, 0}};
static const struct wire_word words_faces[] = {{"+X", 0}, {"-X", 1}, {"+Y", 2}, {"-Y", 3},
                                               {"+Z", 4}, {"-Z", 5}, {NULL, 0}};
static const struct wire_word words_levels[] = {
    {"cone", WIRE_LEVELS_CONE}, {"fixed", WIRE_LEVELS_FIXED}, {NULL, 0}};
static const struct wire_word words_table[] = {
    {"exact", LATER}, {"compact", LATER}, {"sh9", LATER}, {"raycast", LATER}, {NULL, 0}};
static const struct wire_word words_base_level[] = {{"finest", LATER}, {"cone", LATER}, {NULL, 0}};
static const struct wire_word words_sh[] = {
    {"raw", LATER},   {"irradiance", LATER}, {"filament", LATER},
    {"unity", LATER}, {"unreal", LATER},     {"godot", LATER},
    {NULL, 0}};
static const struct wire_word words_images[] = {{"png", WIRE_IMAGE_PNG}, {"exr", WIRE_IMAGE_EXR},
                                                {"hdr", LATER},          {"ktx2", LATER},
                                                {"dds", LATER},          {NULL, 0}};
static const struct wire_word words_layout[] = {
    {"strip", WIRE_LAYOUT_STRIP}, {"faces", LATER},      {"cross", LATER},
    {"equirect", LATER},          {"octahedral", LATER}, {NULL, 0}};
static const struct wire_word words_aovs[] = {{"radiance", 0}, {"depth", LATER}, {"level", LATER},
                                              {"rays", LATER}, {"steps", LATER}, {"error", LATER},
                                              {NULL, 0}};
static const struct wire_word words_environment[] = {
    {"constant", 0}, {"gradient", LATER}, {"hdri", LATER}, {NULL, 0}};

#define RENDER      (1u << 0)
#define COMPARE     (1u << 1)
#define SWEEP       (1u << 2)
#define TUNE        (1u << 3)
#define REFERENCE   (1u << 0)
#define LOD         (1u << 1)
#define ADAPTIVE    (1u << 2)
#define ERROR_AWARE (1u << 3)
#define PREFILTERED (1u << 4)

#define IN_JOB(member) .offset = offsetof(struct wire_job, member)
#define EVERYWHERE     .kinds = WIRE_ANY, .modes = WIRE_ANY

const struct wire_field wire_fields[] = {
    {.name = "kind",
     .type = WIRE_FIELD_WORD,
     .store = WIRE_STORE_U32,
     IN_JOB(kind),
     .words = wire_words_kind,
     .fallback = "\"render\"",
     EVERYWHERE,
     .doc = "what the job makes"},
    {.name = "scene",
     .type = WIRE_FIELD_NAME,
     .store = WIRE_STORE_TEXT,
     IN_JOB(scene),
     .example = "\"scene\": \"duned\"",
     EVERYWHERE,
     .doc = "the scene to render, by name"},
    {.name = "lighting",
     .type = WIRE_FIELD_NAME,
     .store = WIRE_STORE_TEXT,
     IN_JOB(lighting),
     .fallback = "\"albedo\"",
     EVERYWHERE,
     .doc = "the lighting of the scene that shades the hits"},
    {.name = "lightings",
     .type = WIRE_FIELD_LIST,
     .range = "a list of names",
     .fallback = "none",
     .later = "name one lighting in \"lighting\"",
     EVERYWHERE,
     .doc = "several lightings shaded from one traversal; in a sweep, a list to go through"},
    {.name = "probes",
     .type = WIRE_FIELD_PROBES,
     .store = WIRE_STORE_VEC3,
     IN_JOB(position_m),
     .unit = "m",
     .min = -1e9,
     .max = 1e9,
     .example = "\"probes\": [[0, 2, 0]]",
     EVERYWHERE,
     .range = "one place [x, y, z], each coordinate -1e9..1e9",
     .doc = "where to bake, in the world: exactly one place in this version"},
    {.name = "grid",
     .type = WIRE_FIELD_OBJECT,
     .unit = "m",
     .fallback = "none",
     .range = "`min`, `max` and `spacing_m` or `counts`",
     .later = "give one place in \"probes\"",
     EVERYWHERE,
     .doc = "a box full of places, in place of `probes`"},
    {.name = "mode",
     .type = WIRE_FIELD_WORD,
     .store = WIRE_STORE_U32,
     IN_JOB(mode),
     .words = wire_words_mode,
     .fallback = "\"error-aware\"",
     EVERYWHERE,
     .doc = "how many rays a pixel gets and where they stop; to be given in this version, because "
            "the default is not in it"},
    {.name = "face_px",
     .type = WIRE_FIELD_INTEGER,
     .store = WIRE_STORE_U32,
     IN_JOB(face_px),
     .unit = "px",
     .min = 1,
     .max = 4096,
     .fallback = "64",
     EVERYWHERE,
     .doc = "edge of a face"},
    {.name = "faces",
     .type = WIRE_FIELD_WORDS,
     .store = WIRE_STORE_FACES,
     IN_JOB(faces),
     .words = words_faces,
     .min = 1,
     .fallback = "[\"+X\", \"-X\", \"+Y\", \"-Y\", \"+Z\", \"-Z\"]",
     EVERYWHERE,
     .doc = "which faces; kept in this order, whatever order they are given in"},
    {.name = "levels",
     .type = WIRE_FIELD_WORD,
     .store = WIRE_STORE_U32,
     IN_JOB(levels),
     .words = words_levels,
     .fallback = "\"cone\"",
     .kinds = WIRE_ANY,
     .modes = LOD | ADAPTIVE | ERROR_AWARE | PREFILTERED,
     .doc = "where rays stop: `cone` at a node whose edge <= t * 2 / face_px at its entry distance "
            "t, `fixed` at the third finest level of the tree (lod)"},
    {.name = "samples_per_axis",
     .type = WIRE_FIELD_INTEGER,
     .store = WIRE_STORE_U32,
     IN_JOB(samples_per_axis),
     .min = 1,
     .max = 32,
     .fallback = "4",
     .kinds = WIRE_ANY,
     .modes = REFERENCE,
     .doc = "n: a pixel is the mean of n * n rays"},
    {.name = "threshold",
     .type = WIRE_FIELD_NUMBER,
     .range = "any finite number >= 0",
     .fallback = "to be measured",
     .later = "it belongs to mode error-aware; leave it out",
     .kinds = WIRE_ANY,
     .modes = ERROR_AWARE,
     .doc = "error above which a node is refined"},
    {.name = "decay",
     .type = WIRE_FIELD_NUMBER,
     .min = 0,
     .max = 1,
     .fallback = "0.2",
     .later = "it belongs to mode error-aware; leave it out",
     .kinds = WIRE_ANY,
     .modes = ERROR_AWARE,
     .doc = "how the threshold changes with refinement"},
    {.name = "table",
     .type = WIRE_FIELD_WORD,
     .words = words_table,
     .fallback = "`compact`",
     .later = "it belongs to mode error-aware; leave it out",
     .kinds = WIRE_ANY,
     .modes = ERROR_AWARE,
     .doc = "which error table is asked"},
    {.name = "max_refinement",
     .type = WIRE_FIELD_INTEGER,
     .min = 0,
     .max = 8,
     .fallback = "2",
     .later = "it belongs to modes adaptive and error-aware; leave it out",
     .kinds = WIRE_ANY,
     .modes = ADAPTIVE | ERROR_AWARE,
     .doc = "how often a pixel is refined"},
    {.name = "variance_low",
     .type = WIRE_FIELD_NUMBER,
     .range = "to be documented",
     .fallback = "0.25",
     .later = "it belongs to mode adaptive; leave it out",
     .kinds = WIRE_ANY,
     .modes = ADAPTIVE,
     .doc = "variance below which a pixel is left alone"},
    {.name = "variance_high",
     .type = WIRE_FIELD_NUMBER,
     .range = "to be documented",
     .fallback = "0.75",
     .later = "it belongs to mode adaptive; leave it out",
     .kinds = WIRE_ANY,
     .modes = ADAPTIVE,
     .doc = "variance above which a pixel gets the most rays"},
    {.name = "variance_scale",
     .type = WIRE_FIELD_NUMBER,
     .range = "to be documented",
     .fallback = "to be documented",
     .later = "it belongs to mode adaptive; leave it out",
     .kinds = WIRE_ANY,
     .modes = ADAPTIVE,
     .doc = "factor on the variance"},
    {.name = "iterations",
     .type = WIRE_FIELD_INTEGER,
     .range = "to be documented",
     .fallback = "1",
     .later = "it belongs to mode adaptive; leave it out",
     .kinds = WIRE_ANY,
     .modes = ADAPTIVE,
     .doc = "passes of refinement"},
    {.name = "base_level",
     .type = WIRE_FIELD_WORD,
     .words = words_base_level,
     .fallback = "`finest`",
     .later = "it belongs to mode adaptive; leave it out",
     .kinds = WIRE_ANY,
     .modes = ADAPTIVE,
     .doc = "level of the first pass"},
    {.name = "environment",
     .type = WIRE_FIELD_ENVIRONMENT,
     .store = WIRE_STORE_VEC3,
     IN_JOB(environment_constant),
     .words = words_environment,
     .min = 0,
     .max = 65504,
     .range = "`{\"constant\": [r, g, b]}`, linear, each 0..65504; later `gradient`, `hdri`",
     .fallback = "{\"constant\": [0, 0, 0]}",
     EVERYWHERE,
     .doc = "what a ray that leaves the scene sees"},
    {.name = "seed",
     .type = WIRE_FIELD_INTEGER,
     .store = WIRE_STORE_U64,
     IN_JOB(seed),
     .min = 0,
     .max = 9007199254740992.0,
     .fallback = "0",
     EVERYWHERE,
     .doc = "of random rays; reference and lod cast none, the seed changes nothing there"},
    {.name = "sh",
     .type = WIRE_FIELD_WORD,
     .words = words_sh,
     .fallback = "none",
     .later = "leave it out",
     EVERYWHERE,
     .doc = "spherical harmonics in this convention; needs all six faces"},
    {.name = "images",
     .type = WIRE_FIELD_WORDS,
     .store = WIRE_STORE_FLAGS,
     IN_JOB(images),
     .words = words_images,
     .min = 0,
     .fallback = "[\"png\"]",
     EVERYWHERE,
     .doc = "formats in which the picture is kept; may be an empty list"},
    {.name = "layout",
     .type = WIRE_FIELD_WORD,
     .store = WIRE_STORE_U32,
     IN_JOB(layout),
     .words = words_layout,
     .fallback = "\"strip\"",
     EVERYWHERE,
     .doc = "how the faces stand in a picture; a strip is face_px * number of faces wide"},
    {.name = "aovs",
     .type = WIRE_FIELD_WORDS,
     .store = WIRE_STORE_NONE,
     .words = words_aovs,
     .min = 1,
     .fallback = "[\"radiance\"]",
     EVERYWHERE,
     .doc = "layers of the film that are kept"},
    {.name = "priority",
     .type = WIRE_FIELD_INTEGER,
     .store = WIRE_STORE_U32,
     IN_JOB(priority),
     .min = 0,
     .max = 9,
     .fallback = "5",
     EVERYWHERE,
     .doc = "0 goes first"},
    {.name = "deadline_ms",
     .type = WIRE_FIELD_INTEGER,
     .unit = "ms",
     .range = "to be documented",
     .fallback = "none",
     .later = "leave it out and end the call when it takes too long",
     EVERYWHERE,
     .doc = "time after which the job is given up"},
    {.name = "client_ref",
     .type = WIRE_FIELD_TEXT,
     .store = WIRE_STORE_TEXT,
     IN_JOB(client_ref),
     .max = WIRE_CLIENT_REF_BYTES - 1,
     .fallback = "\"\"",
     EVERYWHERE,
     .doc = "the client's own words; comes back in the result's request"},
    {.name = "reference",
     .type = WIRE_FIELD_OBJECT,
     .range = "a mode and its fields",
     .fallback = "none",
     .later = "it belongs to kind compare; leave it out",
     .kinds = COMPARE,
     .modes = WIRE_ANY,
     .doc = "what candidates are compared with"},
    {.name = "candidates",
     .type = WIRE_FIELD_LIST,
     .range = "a list of modes and their fields",
     .fallback = "none",
     .later = "it belongs to kind compare; leave it out",
     .kinds = COMPARE,
     .modes = WIRE_ANY,
     .doc = "what is compared"},
    {.name = "thresholds",
     .type = WIRE_FIELD_LIST,
     .range = "a list of `threshold`",
     .fallback = "none",
     .later = "it belongs to kind sweep; leave it out",
     .kinds = SWEEP,
     .modes = WIRE_ANY,
     .doc = "to go through"},
    {.name = "decays",
     .type = WIRE_FIELD_LIST,
     .range = "a list of `decay`",
     .fallback = "none",
     .later = "it belongs to kind sweep; leave it out",
     .kinds = SWEEP,
     .modes = WIRE_ANY,
     .doc = "to go through"},
    {.name = "face_px_list",
     .type = WIRE_FIELD_LIST,
     .unit = "px",
     .range = "a list of `face_px`",
     .fallback = "none",
     .later = "it belongs to kind sweep; leave it out",
     .kinds = SWEEP,
     .modes = WIRE_ANY,
     .doc = "to go through"},
    {.name = "modes",
     .type = WIRE_FIELD_LIST,
     .range = "a list of `mode`",
     .fallback = "none",
     .later = "it belongs to kind sweep; leave it out",
     .kinds = SWEEP,
     .modes = WIRE_ANY,
     .doc = "to go through"},
    {.name = "target",
     .type = WIRE_FIELD_OBJECT,
     .range = "`rays`, `psnr_db` or `rmse`",
     .fallback = "none",
     .later = "it belongs to kind tune; leave it out",
     .kinds = TUNE,
     .modes = WIRE_ANY,
     .doc = "what the search is for"},
    {.name = "search",
     .type = WIRE_FIELD_WORD,
     .range = "`threshold`",
     .fallback = "none",
     .later = "it belongs to kind tune; leave it out",
     .kinds = TUNE,
     .modes = WIRE_ANY,
     .doc = "which field is searched"},
};
const size_t wire_field_count = sizeof wire_fields / sizeof wire_fields[0];
_Static_assert(sizeof wire_fields / sizeof wire_fields[0] <= 64, "fields seen fit 64 bits");

const struct wire_field *wire_field_find(const char *name)
{
    for (size_t i = 0; i < wire_field_count; i++)
        if (strcmp(wire_fields[i].name, name) == 0)
            return &wire_fields[i];
    return NULL;
}

/* ---- suggestions -------------------------------------------------------------------------------
 */

#define SLIPS_MAX     2
#define SUGGEST_BYTES 24 /* no known word is as long */

static unsigned least(unsigned a, unsigned b)
{
    return a < b ? a : b;
}

/* How many letters are left out, added, replaced or swapped with their neighbour between two words
 * of less than SUGGEST_BYTES letters; case is ignored. Optimal string alignment, three rows. */
static unsigned slips(const char *a, const char *b)
{
    unsigned rows[3][SUGGEST_BYTES + 1];
    size_t a_bytes = strlen(a), b_bytes = strlen(b);
    for (size_t j = 0; j <= b_bytes; j++)
        rows[0][j] = (unsigned)j;
    for (size_t i = 1; i <= a_bytes; i++) {
        unsigned *row = rows[i % 3];
        const unsigned *before = rows[(i + 2) % 3], *swapped = rows[(i + 1) % 3];
        row[0] = (unsigned)i;
        for (size_t j = 1; j <= b_bytes; j++) {
            int x = tolower((unsigned char)a[i - 1]), y = tolower((unsigned char)b[j - 1]);
            row[j] = least(before[j - 1] + (x != y), least(before[j], row[j - 1]) + 1);
            if (i > 1 && j > 1 && x == tolower((unsigned char)b[j - 2]) &&
                y == tolower((unsigned char)a[i - 2]))
                row[j] = least(row[j], swapped[j - 2] + 1);
        }
    }
    return rows[a_bytes % 3][b_bytes];
}

/* Keeps `known` if it is the closest so far. Words of which nothing would be left do not count. */
static void consider(const char **best, unsigned *best_slips, const char *known,
                     const char *unknown)
{
    if (strlen(unknown) >= SUGGEST_BYTES || strlen(known) >= SUGGEST_BYTES)
        return;
    unsigned count = slips(unknown, known);
    if (count < *best_slips && count < strlen(known)) {
        *best = known;
        *best_slips = count;
    }
}

const char *wire_field_suggest(const char *unknown)
{
    const char *best = NULL;
    unsigned best_slips = SLIPS_MAX + 1;
    for (size_t i = 0; i < wire_field_count; i++)
        consider(&best, &best_slips, wire_fields[i].name, unknown);
    return best;
}

const char *wire_word_suggest(const struct wire_word *words, const char *unknown)
{
    const char *best = NULL;
    unsigned best_slips = SLIPS_MAX + 1;
    for (const struct wire_word *word = words; word->text; word++)
        if (word->value != LATER)
            consider(&best, &best_slips, word->text, unknown);
    return best;
}

/* ---- words -------------------------------------------------------------------------------------
 */

const char *wire_word_text(const struct wire_word *words, int value)
{
    for (const struct wire_word *word = words; word->text; word++)
        if (word->value == value && value != LATER)
            return word->text;
    return "";
}

/* Adds to a text of WIRE_RANGE_BYTES; cut where it is full. */
__attribute__((format(printf, 2, 3))) static void append(char *out, const char *format, ...)
{
    size_t bytes = strlen(out);
    va_list args;
    va_start(args, format);
    wire_text_print(out + bytes, WIRE_RANGE_BYTES - bytes, format, args);
    va_end(args);
}

void wire_words_list(char out[WIRE_RANGE_BYTES], const struct wire_word *words)
{
    unsigned total = 0, done = 0;
    for (const struct wire_word *word = words; word->text; word++)
        total += word->value != LATER;
    out[0] = '\0';
    for (const struct wire_word *word = words; word->text; word++) {
        if (word->value == LATER)
            continue;
        append(out, "%s\"%s\"", done == 0 ? "" : done + 1 == total ? " or " : ", ", word->text);
        done++;
    }
}

static void words_range(char *out, const struct wire_field *field)
{
    const char *separator = "";
    bool available = false, later = false;
    for (const struct wire_word *word = field->words; word->text; word++) {
        if (word->value == LATER)
            continue;
        append(out, "%s`%s`", separator, word->text);
        separator = ", ";
        available = true;
    }
    for (const struct wire_word *word = field->words; word->text; word++) {
        if (word->value != LATER)
            continue;
        append(out, "%s`%s`", !later && available ? "; later " : separator, word->text);
        separator = ", ";
        later = true;
    }
}

void wire_field_range(char out[WIRE_RANGE_BYTES], const struct wire_field *field)
{
    char low[WIRE_NUMBER_BYTES], high[WIRE_NUMBER_BYTES];
    out[0] = '\0';
    if (field->range) {
        append(out, "%s", field->range);
    } else if (field->words) {
        words_range(out, field);
    } else if (field->type == WIRE_FIELD_NAME) {
        append(out, "`[A-Za-z0-9][A-Za-z0-9._-]{0,99}`");
    } else if (field->type == WIRE_FIELD_TEXT) {
        append(out, "up to %d bytes", (int)field->max);
    } else {
        wire_number_text(low, field->min);
        wire_number_text(high, field->max);
        append(out, "%s..%s", low, field->max == 0x1p53 ? "2^53" : high);
    }
}
