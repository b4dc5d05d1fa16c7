/* The table of routes and the matching of addresses. */
#include "server/api.h"
#include "tests/harness/test.h"

#include <string.h>

static struct route_match match;

static enum route_verdict find(const char *method, const char *path)
{
    route_find(&match, api_routes, api_route_count, method, path);
    return match.verdict;
}

TEST(routes_of_this_version_are_found)
{
    CHECK_EQ(find("GET", "/"), ROUTE_FOUND);
    CHECK_EQ(find("POST", "/v1/render"), ROUTE_FOUND);
    CHECK(match.route->handler == api_render);
    CHECK_EQ(find("HEAD", "/v1/stats"), ROUTE_FOUND);
    CHECK_EQ(find("GET", "/v1/jobs/abc/probes/0.png"), ROUTE_FOUND);
    CHECK_EQ(match.param_count, 2);
    CHECK_EQ(match.params[0].bytes, 3);
    CHECK(strncmp(match.params[0].text, "abc", 3) == 0);
    CHECK(strncmp(match.params[1].text, "0.png", 5) == 0);
}

TEST(wrong_methods_know_the_right_ones)
{
    CHECK_EQ(find("GET", "/v1/render"), ROUTE_WRONG_METHOD);
    CHECK_STR(match.allow, "POST");
    CHECK_EQ(find("PATCH", "/v1/scenes"), ROUTE_WRONG_METHOD);
    CHECK_STR(match.allow, "GET, HEAD");
    CHECK_EQ(find("get", "/v1/scenes"), ROUTE_WRONG_METHOD); /* methods are case-sensitive */
}

TEST(later_routes_say_so)
{
    CHECK_EQ(find("POST", "/v1/jobs"), ROUTE_LATER);
    CHECK_STR(match.allow, "");
    CHECK_EQ(find("PUT", "/v1/scenes/x"), ROUTE_LATER);
    CHECK_STR(match.allow, "GET, HEAD");
    CHECK_EQ(find("GET", "/metrics"), ROUTE_LATER);
}

TEST(everything_else_is_unknown)
{
    static const char *const paths[] = {"",
                                        "v1/stats",
                                        "//v1/stats",
                                        "/v1",
                                        "/v1/",
                                        "/v1/stats/",
                                        "/v1/scenes/",
                                        "/v1/scenes/a/b",
                                        "/V1/stats",
                                        "/v1/jobs//probes/0.png",
                                        "/v1/render/x",
                                        "/x",
                                        "*"};
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++)
        CHECK_EQ(find("GET", paths[i]), ROUTE_UNKNOWN);
}
