/* Which handler an address and a method mean: matching over a table of routes. */
#include "server/route.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

static size_t segment_bytes(const char *at)
{
    return strcspn(at, "/");
}

static bool pattern_fits(struct route_match *out, const char *pattern, const char *path)
{
    size_t count = 0;
    while (*pattern == '/' && *path == '/') {
        pattern++;
        path++;
        size_t p = segment_bytes(pattern), n = segment_bytes(path);
        if (*pattern == '{') {
            if (n == 0 || count == ROUTE_PARAMS_MAX)
                return false;
            out->params[count++] = (struct route_param){.text = path, .bytes = n};
        } else if (p != n || memcmp(pattern, path, n) != 0) {
            return false;
        }
        pattern += p;
        path += n;
    }
    out->param_count = count;
    return *pattern == 0 && *path == 0;
}

static void allow_add(struct route_match *out, const char *method)
{
    size_t n = strlen(out->allow);
    const char *both = strcmp(method, "GET") == 0 ? "GET, HEAD" : method;
    snprintf(out->allow + n, sizeof out->allow - n, "%s%s", n ? ", " : "", both);
}

void route_find(struct route_match *out, const struct route *routes, size_t route_count,
                const char *method, const char *path)
{
    const char *wanted = strcmp(method, "HEAD") == 0 ? "GET" : method;
    struct route_match match = {.verdict = ROUTE_UNKNOWN}, found = match;
    for (size_t i = 0; i < route_count; i++) {
        if (!pattern_fits(&match, routes[i].pattern, path))
            continue;
        if (routes[i].handler)
            allow_add(&match, routes[i].method);
        if (found.route || strcmp(routes[i].method, wanted) != 0)
            continue;
        found = match;
        found.route = &routes[i];
    }
    *out = found;
    memcpy(out->allow, match.allow, sizeof out->allow);
    if (found.route)
        out->verdict = found.route->handler ? ROUTE_FOUND : ROUTE_LATER;
    else
        out->verdict = match.allow[0] ? ROUTE_WRONG_METHOD : ROUTE_UNKNOWN;
}
