/* The one table of a job's fields: it drives reading, checking, writing back and documenting. */
#ifndef WIRE_FIELDS_H
#define WIRE_FIELDS_H

#include "protocol/wire.h"

enum wire_field_type {
    WIRE_FIELD_NAME,        /* of a scene or lighting */
    WIRE_FIELD_TEXT,        /* at most `max` bytes */
    WIRE_FIELD_WORD,        /* one of `words` */
    WIRE_FIELD_WORDS,       /* a list of `words`, none twice, at least `min` */
    WIRE_FIELD_INTEGER,     /* a whole number min..max */
    WIRE_FIELD_NUMBER,      /* a number min..max */
    WIRE_FIELD_PROBES,      /* a list of places, [x, y, z], each coordinate min..max */
    WIRE_FIELD_ENVIRONMENT, /* an object with one of `words`; constant: 3 numbers min..max */
    WIRE_FIELD_OBJECT,      /* later versions only */
    WIRE_FIELD_LIST,        /* later versions only */
};

/* How a value lies in struct wire_job, at `offset`. */
enum wire_field_store {
    WIRE_STORE_NONE, /* only one value is possible in this version */
    WIRE_STORE_TEXT, /* char[] */
    WIRE_STORE_U32,  /* uint32_t, or an enum */
    WIRE_STORE_U64,
    WIRE_STORE_VEC3,  /* double[3] */
    WIRE_STORE_FACES, /* face_count and faces */
    WIRE_STORE_FLAGS, /* bool[], by the words' values */
};

/* A word of the contract; `value` is what stands for it in struct wire_job. */
struct wire_word {
    const char *text; /* NULL ends a list */
    int value;        /* WIRE_WORD_LATER: not in this version */
};
#define WIRE_WORD_LATER (-1)

struct wire_field {
    const char *name;
    enum wire_field_type type;
    enum wire_field_store store;
    size_t offset;     /* in struct wire_job */
    const char *unit;  /* NULL: none */
    double min, max;   /* what they bound depends on the type */
    const char *range; /* in words, where min..max does not say it; or NULL */
    const struct wire_word *words;
    const char *fallback; /* the default: as JSON where the field is in this version, else in words;
                             NULL: the field is required */
    const char *example;  /* of a required field */
    const char *later;    /* NULL: in this version; else what to do instead */
    uint32_t kinds;       /* bit i: kind i of wire_words_kind uses the field */
    uint32_t modes;       /* bit i: mode i of wire_words_mode uses it */
    const char *doc;      /* one sentence */
};

#define WIRE_ANY UINT32_MAX

extern const struct wire_field wire_fields[];
extern const size_t wire_field_count;

/* In the contract's order; the values of modes and kinds in this version are their places. */
extern const struct wire_word wire_words_kind[];
extern const struct wire_word wire_words_mode[];

/* NULL when there is none of this name (case matters). Thread: any. */
const struct wire_field *wire_field_find(const char *name);
/* The known name that is at most two slips away from an unknown one; NULL: none is. */
const char *wire_field_suggest(const char *unknown);
/* The same among words that are in this version. */
const char *wire_word_suggest(const struct wire_word *words, const char *unknown);

/* The text of a value; "" for one that is none of them. */
const char *wire_word_text(const struct wire_word *words, int value);

#define WIRE_RANGE_BYTES 128
/* What values the field may have, for people: "1..4096 px", "`cone`, `fixed`; later `x`". */
void wire_field_range(char out[WIRE_RANGE_BYTES], const struct wire_field *field);

/* "reference" or "lod": the words of this version, in double quotes, for a sentence. */
void wire_words_list(char out[WIRE_RANGE_BYTES], const struct wire_word *words);

#endif
