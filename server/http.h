/* HTTP: connections and requests over libmicrohttpd, driven by the loop.
 *
 * The one face of libmicrohttpd. Everything here belongs to the loop thread.
 *
 *     HEAD --gate, route--> BODY --whole--> READY --handler--> ANSWERED
 *       '------------------ refused early ----------------------^  ^
 *                                     handler: WAITING --resume--> RESUMED --handler again */
#ifndef HTTP_H
#define HTTP_H

#include "protocol/wire.h"
#include "server/accept.h"
#include "server/address.h"
#include "server/route.h"

struct MHD_Connection;
struct server;
struct job;
struct reading;

struct http;            /* owns all connections and requests */
struct http_connection; /* http_private.h */

enum http_phase {
    HTTP_HEAD,    /* headers are coming in */
    HTTP_BODY,    /* collecting */
    HTTP_READY,   /* whole; its handler runs */
    HTTP_WAITING, /* suspended until http_resume */
    HTTP_RESUMED, /* its handler runs again */
    HTTP_ANSWERED
};

struct http_request {
    struct http *http;
    struct server *server;
    struct http_connection *peer;
    struct MHD_Connection *connection;
    enum http_phase phase;
    const char *method, *path; /* valid in handlers */
    struct route_match match;  /* likewise */
    char id[65];               /* X-Request-Id */
    uint64_t begin_ns;
    const char *target; /* as sent; good in the first call of the handler */
    size_t target_bytes;
    bool target_is_odd; /* a NUL or a space, plain or in disguise */
    bool has_body;      /* one was announced */
    bool left;          /* the client went away while waiting */
    bool queued;        /* libmicrohttpd took the answer */
    char *body;         /* as far as it came; owned */
    size_t body_bytes, body_room;
    bool body_refused; /* too much is being uploaded already */

    bool watched; /* http_watch.c */

    /* The render's own (api_render.c), between waiting and answering. */
    struct reading *reading; /* its body, being read elsewhere */
    struct job *job;         /* being rendered, or finished */
    int offer;               /* of its Accept */
};

struct http_params {
    int listen_fd; /* taken over when http_start succeeds */
    const struct address *own;
    uint64_t connection_limit;
    struct server *server;
    const struct route *routes;
    size_t route_count;
    /* Called when a waiting request's client has left, or the request ends while it waits: the
     * work is to be given up, and the request not to be touched afterwards. */
    void (*abandon)(struct http_request *request);
};

LP_MUST_CHECK enum lp_code http_start(struct http **out, const struct http_params *params,
                                      struct lp_error *err);
/* Closes everything; requests that wait are resumed first. Accepts NULL and sets it. */
void http_stop(struct http **http);

/* For the loop: descriptors that become readable, what to call then, and after how many
 * milliseconds at the latest (-1: none). */
int http_epoll_fd(const struct http *http);
int http_watch_fd(const struct http *http);
void http_run(struct http *http);
void http_run_watches(struct http *http);
int64_t http_timeout_ms(const struct http *http);
/* A few times a second: cuts clients that are too slow, or gone. */
void http_tick(struct http *http);

/* From now on every answer closes its connection. */
void http_close_after_answers(struct http *http);
/* No new connections from now on: they are refused by the system. */
void http_quiesce(struct http *http);
/* Requests whose answer has not gone out. */
size_t http_pending(const struct http *http);

struct http_totals {
    uint64_t connections, accepted, by_class[6], cut;
};
struct http_totals http_totals(const struct http *http);

/* ---- for handlers ------------------------------------------------------------------------------
 */

/* An answer. All zero but `status` is an empty one. */
struct http_reply {
    int status;
    const char *media_type;
    char *text; /* owned by http_reply from the call on; or */
    int fd;     /* ... a file, when from_fd; likewise owned */
    bool from_fd;
    bool is_file; /* set by http_answer: from_fd at first */
    uint64_t bytes;
    const char *etag_sha256;      /* strong ETag; If-None-Match is heeded */
    const char *content_location; /* NULL: none; the same for the next ones */
    const char *allow;
    const char *job_id;
    const char *server_timing;
    unsigned retry_after_s; /* 0: none */
};

/* Answers; exactly once per request, from within its handler. */
void http_answer(struct http_request *request, struct http_reply *reply);
/* Answers with a problem; the status comes from the table. */
void http_problem(struct http_request *request, const struct wire_problem *problem);
/* The same with a status or an Allow of its own (reply->status, reply->allow; 0, NULL: none). */
void http_problem_with(struct http_request *request, const struct wire_problem *problem,
                       const struct http_reply *reply);
/* Text (owned; NULL means out of memory and answers so) of a media type. */
void http_text(struct http_request *request, int status, const char *media_type, char *text);

/* Suspends; from within the handler. The client is watched meanwhile. */
void http_wait(struct http_request *request);
/* Lets the handler run again. */
void http_resume(struct http_request *request);

/* A path parameter as text; false when it is longer than `room` allows. */
bool http_param(const struct http_request *request, size_t index, char *out, size_t room);
/* A query parameter; NULL: absent. */
const char *http_query(const struct http_request *request, const char *name);
/* What the Accept headers make of the offers; -1: nothing fits. */
int http_accept(const struct http_request *request, const char *const *offers, size_t count);

/* The status of a problem, and the seconds after which to try again (0: none). */
int http_problem_status(enum wire_problem_code code);

#endif
