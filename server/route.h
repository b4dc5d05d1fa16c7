/* Which handler an address and a method mean: matching over a table of routes. */
#ifndef ROUTE_H
#define ROUTE_H

#include <stddef.h>

#define ROUTE_PARAMS_MAX  2
#define ROUTE_ALLOW_BYTES 64

struct http_request;

/* One row. A pattern is segments, `{word}` stands for any one. */
struct route {
    const char *method; /* GET (HEAD goes with it), POST, PUT, DELETE */
    const char *pattern;
    void (*handler)(struct http_request *request); /* NULL: a later version brings it */
    const char *produces; /* its media type for Accept; NULL: the handler negotiates */
    const char *doc;
};

enum route_verdict {
    ROUTE_FOUND,
    ROUTE_LATER,        /* in the contract, not in this version */
    ROUTE_WRONG_METHOD, /* `allow` says which would do */
    ROUTE_UNKNOWN
};

struct route_param {
    const char *text; /* into the path */
    size_t bytes;
};

struct route_match {
    enum route_verdict verdict;
    const struct route *route; /* FOUND, LATER */
    size_t param_count;
    struct route_param params[ROUTE_PARAMS_MAX];
    char allow[ROUTE_ALLOW_BYTES]; /* of the address, where it is known; else empty */
};

/* `path` is decoded and has no query. Thread: any. */
void route_find(struct route_match *out, const struct route *routes, size_t route_count,
                const char *method, const char *path);

#endif
