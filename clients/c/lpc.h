/* The C client of lightprobed: requests, answers and downloads over HTTP.
 *
 *     struct lpc_options options = {.server = "http://127.0.0.1:8080"};
 *     struct lpc_client *client = NULL;
 *     struct lpc_error error = {0};
 *     struct lpc_answer answer = {0};
 *     if (lpc_client_create(&client, &options, &error) == LPC_OK &&
 *         lpc_render(client, &answer, job, strlen(job), NULL, &error) == LPC_OK)
 *         fwrite(answer.body, 1, answer.bytes, stdout);
 *     else
 *         fprintf(stderr, "%s\n", error.text);
 *     lpc_answer_finish(&answer);
 *     lpc_client_destroy(&client);
 *
 * A client is used by one thread at a time; several clients may be used at once. */
#ifndef LPC_H
#define LPC_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LPC_CODES(X)                                                                               \
    X(OK, "ok")                                                                                    \
    X(INVALID, "invalid argument")                                                                 \
    X(UNREACHABLE, "no server")                                                                    \
    X(TIMEOUT, "too slow")                                                                         \
    X(REFUSED, "refused by the server")                                                            \
    X(PROTOCOL, "not an answer of this service")                                                   \
    X(LIMIT, "over a limit")                                                                       \
    X(IO, "input or output failed")                                                                \
    X(NO_MEMORY, "out of memory")                                                                  \
    X(CANCELLED, "cancelled")

enum lpc_code {
#define X(name, text) LPC_##name,
    LPC_CODES(X)
#undef X
};

#define LPC_MUST_CHECK __attribute__((warn_unused_result))

#define LPC_ERROR_TEXT_BYTES 1024
#define LPC_PROBLEM_BYTES    64

/* The detail of a failure, owned by the caller; all zero means "no failure yet". */
struct lpc_error {
    enum lpc_code code;
    int status;                      /* HTTP status where the server answered, else 0 */
    char problem[LPC_PROBLEM_BYTES]; /* slug of the problem, "unknown-scene"; may be empty */
    char text[LPC_ERROR_TEXT_BYTES]; /* one sentence: what, where, and the way out */
};

/* Zero is the default everywhere but in `server`. */
struct lpc_options {
    const char *server;            /* "http://HOST:PORT", "https://...", or "unix:PATH" */
    uint32_t connect_timeout_ms;   /* 0: 5 s */
    uint32_t timeout_ms;           /* of a whole request; 0: 10 minutes */
    size_t body_max_bytes;         /* of an answer that is kept in memory; 0: 64 MiB */
    uint64_t file_max_bytes;       /* of a download; 0: 4 GiB */
    const atomic_bool *cancelled;  /* set by any thread to stop requests within a second, or NULL */
    _Atomic uint64_t *bytes_moved; /* counts bytes of downloads as they arrive, or NULL */
};

struct lpc_client;

/* Heap. LPC_INVALID: the server's address cannot be used; no connection is made yet. */
LPC_MUST_CHECK enum lpc_code lpc_client_create(struct lpc_client **out,
                                               const struct lpc_options *options,
                                               struct lpc_error *err);
/* Accepts NULL and sets it. */
void lpc_client_destroy(struct lpc_client **client);

struct lpc_request {
    const char *method;        /* NULL: GET, or POST where there is a body */
    const char *path;          /* starts with "/" */
    const char *accept;        /* NULL: application/json */
    const char *if_none_match; /* NULL: none */
    const char *body;          /* NULL: none */
    size_t body_bytes;
};

/* All zero to begin with; lpc_answer_finish afterwards. */
struct lpc_answer {
    int status;
    char *body; /* owned; ends in NUL beyond `bytes` */
    size_t bytes;
    char content_type[128];
    char etag[128];        /* with its quotes; empty where absent */
    char request_id[65];   /* what to name when asking the operator */
    char location[256];    /* empty where absent */
    int64_t retry_after_s; /* -1 where absent */
};
void lpc_answer_finish(struct lpc_answer *answer);

/* One request, whatever status comes back. LPC_UNREACHABLE, LPC_TIMEOUT, LPC_LIMIT (the answer is
 * larger than body_max_bytes), LPC_CANCELLED. `*answer` is untouched on failure. */
LPC_MUST_CHECK enum lpc_code lpc_send(struct lpc_client *client, struct lpc_answer *answer,
                                      const struct lpc_request *request, struct lpc_error *err);

/* The same, and any status but 200, 201 or 202 is LPC_REFUSED with the sentence of the server's
 * problem document in err->text. */
LPC_MUST_CHECK enum lpc_code lpc_ask(struct lpc_client *client, struct lpc_answer *answer,
                                     const struct lpc_request *request, struct lpc_error *err);

/* POST /v1/render. `accept`: NULL or "application/json" for the document, "image/png", ... */
LPC_MUST_CHECK enum lpc_code lpc_render(struct lpc_client *client, struct lpc_answer *answer,
                                        const char *job, size_t job_bytes, const char *accept,
                                        struct lpc_error *err);
/* GET /v1/scenes, /v1/scenes/{name}, /v1/stats. LPC_INVALID: `name` cannot be a scene's. */
LPC_MUST_CHECK enum lpc_code lpc_scenes(struct lpc_client *client, struct lpc_answer *answer,
                                        struct lpc_error *err);
LPC_MUST_CHECK enum lpc_code lpc_scene(struct lpc_client *client, struct lpc_answer *answer,
                                       const char *name, struct lpc_error *err);
LPC_MUST_CHECK enum lpc_code lpc_stats(struct lpc_client *client, struct lpc_answer *answer,
                                       struct lpc_error *err);

/* Gets `path` into file `to` through a temporary file beside it: `to` is whole or untouched.
 * `sha256_hex` (NULL: not checked) and `bytes` (UINT64_MAX: not checked) are what the document
 * promised; LPC_PROTOCOL where the file differs. */
LPC_MUST_CHECK enum lpc_code lpc_download(struct lpc_client *client, const char *path,
                                          const char *to, const char *sha256_hex, uint64_t bytes,
                                          struct lpc_error *err);

#define LPC_PICTURES_MAX 256
#define LPC_PATH_BYTES   1024

struct lpc_picture {
    char path[LPC_PATH_BYTES]; /* of the file that was written */
    uint64_t bytes;
};
struct lpc_pictures {
    uint32_t count;
    struct lpc_picture list[LPC_PICTURES_MAX];
};

/* Downloads every picture that a result document names into `folder` (which is there), as
 * STEM.EXTENSION, or STEM-INDEX.EXTENSION where there are several probes. Each is checked against
 * the document's sha256 and bytes. `*pictures` grows as files are written, also on failure. */
LPC_MUST_CHECK enum lpc_code lpc_save_pictures(struct lpc_client *client,
                                               struct lpc_pictures *pictures, const char *document,
                                               size_t document_bytes, const char *folder,
                                               const char *stem, struct lpc_error *err);

/* Writes a file that is whole or absent: a temporary file beside it, then rename. LPC_IO says why.
 * Thread: any. */
LPC_MUST_CHECK enum lpc_code lpc_file_write(const char *path, const void *data, size_t bytes,
                                            struct lpc_error *err);

#endif
