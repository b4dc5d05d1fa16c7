/* A job's document made of a request file and flags. */
#ifndef REQUEST_H
#define REQUEST_H

#include "clients/cli/render.h"
#include "protocol/read.h"

/* All zero before request_open; request_finish afterwards. */
struct request {
    char *text; /* the document as it was read; owned */
    size_t bytes;
    struct wire_read *read; /* the same, open for changes */
    bool changed;
};

/* Reads the request file (at most WIRE_BODY_MAX bytes), or begins with an empty document, and sets
 * the fields that the flags give. Broken JSON is LP_INVALID with its place. */
LP_MUST_CHECK enum lp_code request_open(struct request *request,
                                        const struct render_options *options, struct lp_error *err);
void request_finish(struct request *request);

/* The document's scene; NULL where it names none (or no text). */
const char *request_scene(const struct request *request);
bool request_has_probe(const struct request *request);
/* Fill what is missing. */
LP_MUST_CHECK enum lp_code request_set_scene(struct request *request, const char *name,
                                             struct lp_error *err);
LP_MUST_CHECK enum lp_code request_set_probe(struct request *request, const double point_m[3],
                                             struct lp_error *err);

/* The finished document, on the heap; an unchanged one byte for byte. */
LP_MUST_CHECK enum lp_code request_write(char **text, size_t *bytes, const struct request *request,
                                         struct lp_error *err);

#endif
