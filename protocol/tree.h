/* A JSON document under construction: cJSON's tree with one sticky failure, numbers exact. */
#ifndef WIRE_TREE_H
#define WIRE_TREE_H

#include "protocol/wire.h"

#include <cjson/cJSON.h>

#define WIRE_TREE_NESTING_MAX 8 /* lists and objects inside of the document itself */

/* Owns `open[0]` and all below it until wire_tree_end. Once something failed (memory, nesting,
 * more closes than opens) every call is without effect and the end gives NULL. */
struct wire_tree {
    cJSON *open[WIRE_TREE_NESTING_MAX + 1]; /* [0] the document, [depth] where values go */
    uint32_t depth;
    bool failed;
};

/* Starts an object. */
void wire_tree_begin(struct wire_tree *tree);
/* The compact text, on the heap, for free(); NULL when anything failed. The tree is gone. */
char *wire_tree_end(struct wire_tree *tree);

/* In what follows `name` is the field's name in an object and NULL in a list. */
void wire_tree_open(struct wire_tree *tree, const char *name);      /* an object */
void wire_tree_open_list(struct wire_tree *tree, const char *name); /* a list */
void wire_tree_close(struct wire_tree *tree);
/* Bytes of `value` that are not UTF-8 are written as "?"; NULL is written as null. */
void wire_tree_text(struct wire_tree *tree, const char *name, const char *value);
void wire_tree_u64(struct wire_tree *tree, const char *name, uint64_t value);
void wire_tree_f64(struct wire_tree *tree, const char *name, double value); /* not finite: null */
void wire_tree_bool(struct wire_tree *tree, const char *name, bool value);
void wire_tree_vec3(struct wire_tree *tree, const char *name, const double value[3]);

/* The fields of a job into the object that is open (job_write.c). */
void wire_tree_job(struct wire_tree *tree, const struct wire_job *job);
/* The word of a kind of job (job_write.c). */
const char *wire_kind_text(enum wire_kind kind);

#endif
