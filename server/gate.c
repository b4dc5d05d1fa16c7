/* The first look at a request's head: what smuggles, what is too large, what comes from elsewhere.
 */
#include "server/gate.h"

#include <string.h>
#include <strings.h>

static bool is_token(const char *name)
{
    if (!*name)
        return false;
    for (; *name; name++) {
        unsigned char c = (unsigned char)*name;
        if (!(c >= 'a' && c <= 'z') && !(c >= 'A' && c <= 'Z') && !(c >= '0' && c <= '9') &&
            !strchr("!#$%&'*+-.^_`|~", c))
            return false;
    }
    return true;
}

/* Decimal digits that fit; nothing else. */
static bool length_read(uint64_t *out, const char *text)
{
    uint64_t value = 0;
    if (!*text)
        return false;
    for (; *text; text++) {
        if (*text < '0' || *text > '9' || __builtin_mul_overflow(value, 10u, &value) ||
            __builtin_add_overflow(value, (unsigned)(*text - '0'), &value))
            return false;
    }
    *out = value;
    return true;
}

void gate_header(struct gate *gate, const char *name, const char *value)
{
    if (!is_token(name)) {
        gate->bad_name = true;
        return;
    }
    if (!value)
        value = "";
    if (strcasecmp(name, "Host") == 0) {
        if (gate->host_count++ == 0)
            gate->host = value;
    } else if (strcasecmp(name, "Origin") == 0) {
        if (gate->origin_count++ == 0)
            gate->origin = value;
    } else if (strcasecmp(name, "Content-Length") == 0) {
        uint64_t bytes = 0;
        if (!length_read(&bytes, value) ||
            (gate->length_count > 0 && bytes != gate->content_length))
            gate->lengths_differ = true;
        gate->content_length = bytes;
        gate->length_count++;
    } else if (strcasecmp(name, "Transfer-Encoding") == 0) {
        if (strcasecmp(value, "chunked") != 0)
            gate->encoding_foreign = true;
        gate->encoding_count++;
    }
}

bool gate_has_body(const struct gate *gate)
{
    return gate->content_length > 0 || gate->lengths_differ || gate->encoding_count > 0;
}

/* Requests that two readers could cut differently: the doors of smuggling. */
static const char *gate_ambiguity(const struct gate *gate)
{
    bool http_1_0 = strcmp(gate->version, "HTTP/1.0") == 0;
    if (gate->bad_name)
        return "a header's name has characters that a name cannot have, such as a space before "
               "the colon";
    if (gate->length_count > 0 && gate->encoding_count > 0)
        return "a request has Content-Length or Transfer-Encoding, not both";
    if (gate->lengths_differ)
        return "Content-Length must be one decimal number";
    if (gate->encoding_count > 1 || gate->encoding_foreign)
        return "the only transfer coding that this service reads is one \"chunked\"";
    if (gate->encoding_count > 0 && http_1_0)
        return "HTTP/1.0 has no Transfer-Encoding";
    if (gate->host_count > 1)
        return "a request has one Host header";
    if (gate->host_count == 0 && !http_1_0)
        return "an HTTP/1.1 request needs a Host header";
    if (gate->origin_count > 1)
        return "a request has one Origin header";
    if (gate->path[0] != '/')
        return "the request's target must be a path that begins with a slash";
    if (gate->target_is_odd)
        return "the request's target must not hold spaces or NUL";
    return NULL;
}

int gate_check(const struct gate *gate, const struct address *own, struct wire_problem *problem)
{
    const char *ambiguity = gate_ambiguity(gate);
    if (ambiguity) {
        wire_problem_set(problem, WIRE_PROBLEM_BAD_REQUEST, "%s", ambiguity);
        return 400;
    }
    if (gate->target_bytes > GATE_TARGET_BYTES_MAX) {
        wire_problem_set(problem, WIRE_PROBLEM_TOO_LARGE, "a request's target has at most %d bytes",
                         GATE_TARGET_BYTES_MAX);
        return 414;
    }
    if (gate->header_bytes > GATE_HEADER_BYTES_MAX) {
        wire_problem_set(problem, WIRE_PROBLEM_TOO_LARGE, "a request's head has at most %d bytes",
                         GATE_HEADER_BYTES_MAX);
        return 431;
    }
    if (gate->host && !address_is_own_host(own, gate->host)) {
        wire_problem_set(problem, WIRE_PROBLEM_FOREIGN_ORIGIN,
                         "this service answers to localhost, 127.0.0.1 and [::1] at its own port; "
                         "the Host header names somebody else");
        return 403;
    }
    if (gate->origin && !address_is_own_origin(own, gate->origin)) {
        wire_problem_set(problem, WIRE_PROBLEM_FOREIGN_ORIGIN,
                         "web pages of other origins may not drive this service");
        return 403;
    }
    if (gate->content_length > WIRE_BODY_MAX) {
        wire_problem_set(problem, WIRE_PROBLEM_TOO_LARGE,
                         "a body has at most %u bytes; this one would have %llu", WIRE_BODY_MAX,
                         (unsigned long long)gate->content_length);
        return 413;
    }
    return 0;
}
