/* Where the daemon listens: reading the address, making the socket, naming it. */
#ifndef ADDRESS_H
#define ADDRESS_H

#include "engine/base.h"

#include <sys/socket.h>
#include <sys/un.h>

#define ADDRESS_TEXT_BYTES 192
#define ADDRESS_BACKLOG    1024

enum address_kind { ADDRESS_TCP, ADDRESS_UNIX };

struct address {
    enum address_kind kind;
    struct sockaddr_storage socket; /* as bind takes it */
    socklen_t socket_bytes;
    uint16_t port; /* TCP: the real one after address_listen */
    char host[64]; /* TCP: as in a URL: 127.0.0.1, [::1] */
    char path[sizeof((struct sockaddr_un *)0)->sun_path]; /* UNIX */
    char url[ADDRESS_TEXT_BYTES];                         /* http://127.0.0.1:8080 or unix:PATH */
};

/* Reads HOST:PORT, [IPv6]:PORT, localhost:PORT or unix:PATH. Only loopback: this version has no
 * tokens. LP_INVALID. Thread: any. */
LP_MUST_CHECK enum lp_code address_parse(struct address *out, const char *text,
                                         struct lp_error *err);

/* Binds and listens; `*fd` is a non-blocking socket; port and url are filled. A socket file that
 * nobody listens on is replaced, anything else in its place is refused. LP_IO. Thread: main. */
LP_MUST_CHECK enum lp_code address_listen(struct address *address, int *fd, struct lp_error *err);

/* Removes the socket's file. */
void address_forget(const struct address *address);

/* Whether the value of a Host header names this service: a loopback name, our port or none. */
bool address_is_own_host(const struct address *address, const char *host);
/* The same for an Origin header: http://HOST[:PORT]. */
bool address_is_own_origin(const struct address *address, const char *origin);

#endif
