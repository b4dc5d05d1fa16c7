/* Server addresses: http://HOST:PORT and unix:PATH, taken apart and checked before use. */
#include "clients/c/lpc_private.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/un.h>

#define EXAMPLE "an address looks like http://127.0.0.1:8080 or unix:/run/lightprobed.sock"

static enum lpc_code unix_address(struct lpc_address *address, const char *server,
                                  struct lpc_error *err)
{
    const char *path = server + strlen("unix:");
    if (!*path)
        return lpc_fail(err, LPC_INVALID, "server \"%s\": the socket's path is missing; " EXAMPLE,
                        server);
    if (strlen(path) >= sizeof((struct sockaddr_un *)NULL)->sun_path)
        return lpc_fail(err, LPC_INVALID,
                        "server \"%s\": a socket's path has at most %zu characters", server,
                        sizeof((struct sockaddr_un *)NULL)->sun_path - 1);
    snprintf(address->unix_path, sizeof address->unix_path, "%s", path);
    snprintf(address->base, sizeof address->base, "http://localhost");
    address->loopback = true;
    return LPC_OK;
}

/* Length of the host at `text`: a name, an IPv4 address or [IPv6]; 0 when it is none. */
static size_t host_length(const char *text)
{
    if (*text == '[') {
        size_t inner = strspn(text + 1, "0123456789abcdefABCDEF:.");
        return inner > 1 && text[1 + inner] == ']' ? inner + 2 : 0;
    }
    size_t length = 0;
    while (isalnum((unsigned char)text[length]) || text[length] == '-' || text[length] == '.' ||
           text[length] == '_')
        length++;
    return text[0] == '.' || text[0] == '-' ? 0 : length;
}

static bool port_ok(const char *text, size_t length)
{
    if (length < 1 || length > 5)
        return false;
    unsigned port = 0;
    for (size_t i = 0; i < length; i++) {
        if (!isdigit((unsigned char)text[i]))
            return false;
        port = 10 * port + (unsigned)(text[i] - '0');
    }
    return port >= 1 && port <= 65535;
}

static bool is_loopback(const char *host, size_t length)
{
    return (length == strlen("localhost") && strncasecmp(host, "localhost", length) == 0) ||
           (length > 4 && strncmp(host, "127.", 4) == 0) ||
           (length == strlen("[::1]") && strncmp(host, "[::1]", length) == 0);
}

enum lpc_code lpc_address_read(struct lpc_address *address, const char *server,
                               struct lpc_error *err)
{
    if (!server || !*server)
        return lpc_fail(err, LPC_INVALID, "no server given; " EXAMPLE);
    if (strlen(server) >= LPC_SERVER_BYTES)
        return lpc_fail(err, LPC_INVALID,
                        "the server's address is longer than %d characters; " EXAMPLE,
                        LPC_SERVER_BYTES - 1);
    struct lpc_address read = {0};
    snprintf(read.shown, sizeof read.shown, "%s", server);
    if (strncmp(server, "unix:", 5) == 0) {
        enum lpc_code code = unix_address(&read, server, err);
        if (code == LPC_OK)
            *address = read;
        return code;
    }
    size_t scheme = strncasecmp(server, "http://", 7) == 0    ? 7
                    : strncasecmp(server, "https://", 8) == 0 ? 8
                                                              : 0;
    if (!scheme)
        return lpc_fail(err, LPC_INVALID,
                        "server \"%s\" does not begin with http:// or unix:; " EXAMPLE, server);
    const char *host = server + scheme;
    size_t length = host_length(host);
    if (!length)
        return lpc_fail(err, LPC_INVALID, "server \"%s\" has no usable host; " EXAMPLE, server);
    const char *rest = host + length;
    if (*rest == ':') {
        size_t digits = strcspn(rest + 1, "/");
        if (!port_ok(rest + 1, digits))
            return lpc_fail(err, LPC_INVALID, "server \"%s\": the port must be 1..65535; " EXAMPLE,
                            server);
        rest += 1 + digits;
    }
    if (*rest && strcmp(rest, "/") != 0)
        return lpc_fail(err, LPC_INVALID,
                        "server \"%s\": nothing may follow host and port, \"%s\" does; " EXAMPLE,
                        server, rest);
    snprintf(read.base, sizeof read.base, "%.*s", (int)(rest - server), server);
    snprintf(read.shown, sizeof read.shown, "%s", read.base);
    read.loopback = is_loopback(host, length);
    *address = read;
    return LPC_OK;
}
