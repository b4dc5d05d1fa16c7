/* Where the daemon listens: reading the address, making the socket, naming it. */
#include "server/address.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#define WHERE "--listen"

static enum lp_code address_parse_unix(struct address *out, const char *path, struct lp_error *err)
{
    struct sockaddr_un unix_address = {.sun_family = AF_UNIX};
    size_t n = strlen(path);
    if (n == 0 || n >= sizeof unix_address.sun_path)
        return lp_fail(err, LP_INVALID, WHERE, "the path of a unix socket has 1 to %zu characters",
                       sizeof unix_address.sun_path - 1);
    memcpy(unix_address.sun_path, path, n + 1);
    out->kind = ADDRESS_UNIX;
    memcpy(&out->socket, &unix_address, sizeof unix_address);
    out->socket_bytes = sizeof unix_address;
    memcpy(out->path, path, n + 1);
    snprintf(out->url, sizeof out->url, "unix:%s", path);
    return LP_OK;
}

/* "0".."65535", digits only. */
static bool port_read(uint16_t *out, const char *text)
{
    size_t n = strlen(text);
    if (n == 0 || n > 5 || strspn(text, "0123456789") != n)
        return false;
    long port = strtol(text, NULL, 10);
    if (port > 65535)
        return false;
    *out = (uint16_t)port;
    return true;
}

static void address_name(struct address *address)
{
    snprintf(address->url, sizeof address->url, "http://%s:%u", address->host, address->port);
}

enum lp_code address_parse(struct address *out, const char *text, struct lp_error *err)
{
    struct address address = {.kind = ADDRESS_TCP};
    if (strncmp(text, "unix:", 5) == 0) {
        enum lp_code code = address_parse_unix(&address, text + 5, err);
        if (!code)
            *out = address;
        return code;
    }
    const char *colon = strrchr(text, ':');
    if (!colon || !port_read(&address.port, colon + 1))
        return lp_fail(err, LP_INVALID, WHERE,
                       "\"%.80s\" is not HOST:PORT with a port from 0 to 65535, nor unix:PATH",
                       text);
    char host[64];
    size_t n = (size_t)(colon - text);
    if (n == 0 || n >= sizeof host)
        return lp_fail(err, LP_INVALID, WHERE, "\"%.80s\" has no usable host before the port",
                       text);
    memcpy(host, text, n);
    host[n] = 0;
    struct sockaddr_in v4 = {.sin_family = AF_INET, .sin_port = htons(address.port)};
    struct sockaddr_in6 v6 = {.sin6_family = AF_INET6, .sin6_port = htons(address.port)};
    bool loopback;
    if (strcasecmp(host, "localhost") == 0)
        memcpy(host, "127.0.0.1", sizeof "127.0.0.1");
    if (host[0] == '[' && host[n - 1] == ']') {
        host[n - 1] = 0;
        if (inet_pton(AF_INET6, host + 1, &v6.sin6_addr) != 1)
            return lp_fail(err, LP_INVALID, WHERE, "\"%s]\" is not an IPv6 address", host);
        loopback = IN6_IS_ADDR_LOOPBACK(&v6.sin6_addr);
        memcpy(&address.socket, &v6, sizeof v6);
        address.socket_bytes = sizeof v6;
        snprintf(address.host, sizeof address.host, "[::1]");
    } else {
        if (inet_pton(AF_INET, host, &v4.sin_addr) != 1)
            return lp_fail(err, LP_INVALID, WHERE,
                           "\"%s\" is not an address: use 127.0.0.1, [::1] or localhost", host);
        loopback = (ntohl(v4.sin_addr.s_addr) >> 24) == 127;
        memcpy(&address.socket, &v4, sizeof v4);
        address.socket_bytes = sizeof v4;
        inet_ntop(AF_INET, &v4.sin_addr, address.host, sizeof address.host);
    }
    if (!loopback)
        return lp_fail(err, LP_INVALID, WHERE,
                       "%.*s is not a loopback address, and this version has no tokens to guard "
                       "others: use 127.0.0.1, [::1] or a unix socket",
                       (int)n, text);
    address_name(&address);
    *out = address;
    return LP_OK;
}

/* Makes room for a unix socket without harming anybody who listens there. */
static enum lp_code address_clear_path(const struct address *address, struct lp_error *err)
{
    struct stat there;
    if (lstat(address->path, &there) < 0)
        return LP_OK; /* bind says what is wrong with the folder */
    if (!S_ISSOCK(there.st_mode))
        return lp_fail(err, LP_IO, address->path,
                       "something that is no socket is in the way; choose another path");
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0)
        return lp_fail(err, LP_IO, address->path, "no socket: %s", strerror(errno));
    int got = connect(fd, (const struct sockaddr *)&address->socket, address->socket_bytes);
    int why = errno;
    close(fd);
    if (got == 0 || why != ECONNREFUSED)
        return lp_fail(err, LP_IO, address->path, "somebody listens there already");
    if (unlink(address->path) < 0)
        return lp_fail(err, LP_IO, address->path, "the stale socket cannot be removed: %s",
                       strerror(errno));
    return LP_OK;
}

enum lp_code address_listen(struct address *address, int *out, struct lp_error *err)
{
    enum lp_code code = LP_OK;
    if (address->kind == ADDRESS_UNIX)
        code = address_clear_path(address, err);
    if (code)
        return code;
    int fd = socket(address->socket.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0)
        return lp_fail(err, LP_IO, WHERE, "no socket: %s", strerror(errno));
    int yes = 1;
    if (address->kind == ADDRESS_TCP)
        (void)setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    /* Whoever may open the socket's file may drive the daemon: only its own user. */
    mode_t old_mask = umask(0177);
    int got = bind(fd, (const struct sockaddr *)&address->socket, address->socket_bytes);
    umask(old_mask);
    if (got < 0 || listen(fd, ADDRESS_BACKLOG) < 0) {
        code = lp_fail(err, LP_IO, WHERE, "cannot listen on %s: %s", address->url, strerror(errno));
        goto out;
    }
    if (address->kind == ADDRESS_TCP) {
        struct sockaddr_storage bound;
        socklen_t bound_bytes = sizeof bound;
        if (getsockname(fd, (struct sockaddr *)&bound, &bound_bytes) < 0) {
            code = lp_fail(err, LP_IO, WHERE, "the port is not known: %s", strerror(errno));
            goto out;
        }
        struct sockaddr_in v4;
        struct sockaddr_in6 v6;
        memcpy(&v4, &bound, sizeof v4);
        memcpy(&v6, &bound, sizeof v6);
        address->port = ntohs(bound.ss_family == AF_INET6 ? v6.sin6_port : v4.sin_port);
        address_name(address);
    }
    *out = fd;
    fd = -1;
out:
    if (fd >= 0)
        close(fd);
    return code;
}

void address_forget(const struct address *address)
{
    if (address->kind == ADDRESS_UNIX)
        (void)unlink(address->path);
}

/* Whether `host` is `name`, alone or with our port. */
static bool host_is(const struct address *address, const char *host, const char *name)
{
    size_t n = strlen(name);
    uint16_t port;
    if (n == 0 || strncasecmp(host, name, n) != 0)
        return false;
    if (host[n] == 0)
        return true;
    if (host[n] != ':' || !port_read(&port, host + n + 1))
        return false;
    return address->kind == ADDRESS_UNIX || port == address->port;
}

bool address_is_own_host(const struct address *address, const char *host)
{
    return host_is(address, host, "localhost") || host_is(address, host, "127.0.0.1") ||
           host_is(address, host, "[::1]") || host_is(address, host, address->host);
}

bool address_is_own_origin(const struct address *address, const char *origin)
{
    return strncasecmp(origin, "http://", 7) == 0 && address_is_own_host(address, origin + 7);
}
