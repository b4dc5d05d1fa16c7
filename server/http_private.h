/* What the files of the HTTP module share. */
#ifndef HTTP_PRIVATE_H
#define HTTP_PRIVATE_H

#include "server/http.h"

#include <microhttpd.h>

#define HTTP_HEAD_DEADLINE_S   10           /* from the request line to the end of the headers */
#define HTTP_IDLE_DEADLINE_S   20           /* keep-alive, and the libraries' inactivity */
#define HTTP_BODY_GRACE_S      10           /* then at least ... */
#define HTTP_BODY_RATE         1024         /* ... bytes a second on the average */
#define HTTP_BODIES_BYTES_MAX  (256u << 20) /* of all that are being collected */
#define HTTP_CONNECTIONS_EXTRA 64           /* beyond the limit: to be told so */
#define HTTP_LINGERS_MAX       256
#define HTTP_LINGER_BYTES_MAX  (8u << 20)
#define HTTP_LINGER_S          2

/* An open connection. */
struct http_connection {
    struct http_connection *next, *previous;
    int fd;            /* libmicrohttpd's: valid until it says that the connection is closed */
    bool overflow;     /* beyond the limit: told 503 */
    bool cut;          /* shut down by http_tick */
    bool ended;        /* http_tick found its sending side closed */
    uint64_t since_ns; /* when it became idle */
    struct http_request *request; /* NULL: idle */
};

/* A socket that is read away for a moment after its connection was closed, so that an answer that
 * was sent before the body had been read is not lost to a reset. */
struct http_linger {
    struct http_linger *next;
    int fd; /* a duplicate, owned */
    uint64_t until_ns;
    size_t bytes;
};

struct http {
    struct MHD_Daemon *daemon;
    struct http_params params;
    int watch_fd; /* an epoll of waiting clients and lingering sockets */
    bool closing; /* every answer closes its connection */
    bool quiesced;
    bool stopping; /* no handler runs any more: it could wait */
    struct http_connection *connections;
    struct http_linger *lingers;
    size_t linger_count, pending;
    uint64_t ticks;
    uint64_t bodies_bytes;
    uint64_t request_number, run; /* of made-up request ids */
    struct http_totals totals;
};

/* http_request.c: callbacks of libmicrohttpd. */
void *http_on_target(void *http, const char *target, struct MHD_Connection *connection);
enum MHD_Result http_on_request(void *http, struct MHD_Connection *connection, const char *url,
                                const char *method, const char *version, const char *upload,
                                size_t *upload_bytes, void **request);
void http_on_completed(void *http, struct MHD_Connection *connection, void **request,
                       enum MHD_RequestTerminationCode why);
void http_on_connection(void *http, struct MHD_Connection *connection, void **context,
                        enum MHD_ConnectionNotificationCode what);

/* http_watch.c */
void http_watch_begin(struct http_request *request);
void http_watch_end(struct http_request *request);
/* Keeps a connection's socket open for reading a moment longer than the connection. */
void http_linger(struct http *http, const struct http_connection *connection);
void http_linger_tick(struct http *http, uint64_t now_ns);
void http_linger_finish(struct http *http);

/* http_reply.c: the answer to a body that grew too large in the middle, written past the library,
 * which takes no answer then. */
void http_send_too_large(struct http_request *request);

#endif
