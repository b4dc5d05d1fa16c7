/* The first look at a request's head. */
#include "server/gate.h"
#include "tests/harness/test.h"

static struct address own;
static struct wire_problem problem;

static struct gate head(void)
{
    REQUIRE(address_parse(&own, "127.0.0.1:8080", NULL) == LP_OK);
    struct gate gate = {.target_bytes = 2, .path = "/x", .version = "HTTP/1.1", .header_bytes = 99};
    return gate;
}

static int check(const struct gate *gate)
{
    problem = (struct wire_problem){0};
    return gate_check(gate, &own, &problem);
}

TEST(an_ordinary_request_passes)
{
    struct gate gate = head();
    gate_header(&gate, "Host", "localhost:8080");
    gate_header(&gate, "Content-Length", "12");
    gate_header(&gate, "Origin", "http://127.0.0.1:8080");
    CHECK_EQ(check(&gate), 0);
    CHECK(gate_has_body(&gate));
    CHECK_EQ(gate.content_length, 12);
}

/* One extra header beside a good Host. */
static int with(const char *name, const char *value, const char *name2, const char *value2)
{
    struct gate gate = head();
    gate_header(&gate, "Host", "localhost");
    gate_header(&gate, name, value);
    if (name2)
        gate_header(&gate, name2, value2);
    return check(&gate);
}

TEST(smuggling_is_refused)
{
    CHECK_EQ(with("Content-Length", "5", "Transfer-Encoding", "chunked"), 400);
    CHECK_EQ(with("Content-Length", "5", "content-length", "6"), 400);
    CHECK_EQ(with("Content-Length", "5", "content-length", "5"), 0);
    CHECK_EQ(with("Transfer-Encoding ", "chunked", NULL, NULL), 400);
    CHECK_EQ(with("Transfer-Encoding", "chunked", "Transfer-Encoding", "chunked"), 400);
    CHECK_EQ(with("Transfer-Encoding", "gzip, chunked", NULL, NULL), 400);
    CHECK_EQ(with("Transfer-Encoding", "CHUNKED", NULL, NULL), 0);
    CHECK_EQ(with("host", "localhost", NULL, NULL), 400);
    CHECK_EQ(with("", "x", NULL, NULL), 400);
    CHECK_EQ(with("X\tY", "x", NULL, NULL), 400);
    static const char *const lengths[] = {
        "", "-1", "+1", "1 ", "0x1", "1,1", "18446744073709551616"};
    for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; i++)
        CHECK_EQ(with("Content-Length", lengths[i], NULL, NULL), 400);
}

TEST(hosts_and_origins)
{
    struct gate gate = head();
    CHECK_EQ(check(&gate), 400); /* HTTP/1.1 without Host */
    gate.version = "HTTP/1.0";
    CHECK_EQ(check(&gate), 0);
    gate_header(&gate, "Transfer-Encoding", "chunked");
    CHECK_EQ(check(&gate), 400); /* not in 1.0 */
    CHECK_EQ(with("Origin", "http://evil.example", NULL, NULL), 403);
    CHECK_EQ(with("Origin", "null", NULL, NULL), 403);
    gate = head();
    gate_header(&gate, "Host", "evil.example");
    CHECK_EQ(check(&gate), 403);
    CHECK_EQ(problem.code, WIRE_PROBLEM_FOREIGN_ORIGIN);
}

TEST(sizes)
{
    CHECK_EQ(with("Content-Length", "1048576", NULL, NULL), 0);
    CHECK_EQ(with("Content-Length", "1048577", NULL, NULL), 413);
    struct gate gate = head();
    gate_header(&gate, "Host", "localhost");
    gate.target_bytes = GATE_TARGET_BYTES_MAX + 1;
    CHECK_EQ(check(&gate), 414);
    gate.target_bytes = GATE_TARGET_BYTES_MAX;
    gate.header_bytes = GATE_HEADER_BYTES_MAX + 1;
    CHECK_EQ(check(&gate), 431);
}

TEST(odd_targets)
{
    struct gate gate = head();
    gate_header(&gate, "Host", "localhost");
    gate.path = "http://localhost/";
    CHECK_EQ(check(&gate), 400);
    gate.path = "/x";
    gate.target_is_odd = true;
    CHECK_EQ(check(&gate), 400);
}
