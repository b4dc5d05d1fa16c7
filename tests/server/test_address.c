/* Listen addresses, and which Host and Origin headers are ours. */
#include "server/address.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

TEST(loopback_addresses_are_read)
{
    static const char *const right[][2] = {{"127.0.0.1:8080", "127.0.0.1"},
                                           {"localhost:1", "127.0.0.1"},
                                           {"LOCALHOST:1", "127.0.0.1"},
                                           {"[::1]:0", "[::1]"},
                                           {"127.9.9.9:65535", "127.9.9.9"}};
    for (size_t i = 0; i < sizeof right / sizeof right[0]; i++) {
        struct address address;
        CHECK_EQ(address_parse(&address, right[i][0], NULL), LP_OK);
        CHECK_STR(address.host, right[i][1]);
    }
}

TEST(other_addresses_are_refused_with_a_sentence)
{
    static const char *const wrong[] = {"",        "127.0.0.1",       "127.0.0.1:",    ":80",
                                        "x:80",    "127.0.0.1:65536", "127.0.0.1:-1",  "[::1:80",
                                        "[zz]:80", "0.0.0.0:80",      "10.0.0.1:80",   "[::]:80",
                                        "unix:",   "127.0.0.1:8 0",   "example.com:80"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        struct lp_error error = {0};
        struct address address;
        CHECK_EQ(address_parse(&address, wrong[i], &error), LP_INVALID);
        CHECK(error.text[0] != 0);
    }
}

TEST(only_own_hosts_are_own)
{
    struct address address;
    REQUIRE(address_parse(&address, "127.0.0.1:8080", NULL) == LP_OK);
    static const char *const own[] = {"127.0.0.1", "127.0.0.1:8080", "localhost", "LocalHost:8080",
                                      "[::1]:8080"};
    static const char *const foreign[] = {"",           "127.0.0.1:80",   "127.0.0.1:",
                                          "127.0.0.10", "localhost.evil", "localhost:8080.evil",
                                          "evil",       "127.0.0.1@evil", "localhost:08080x"};
    for (size_t i = 0; i < sizeof own / sizeof own[0]; i++)
        CHECK(address_is_own_host(&address, own[i]));
    for (size_t i = 0; i < sizeof foreign / sizeof foreign[0]; i++)
        CHECK(!address_is_own_host(&address, foreign[i]));
    CHECK(address_is_own_origin(&address, "http://localhost:8080"));
    CHECK(!address_is_own_origin(&address, "https://localhost:8080"));
    CHECK(!address_is_own_origin(&address, "null"));
    REQUIRE(address_parse(&address, "127.0.0.10:8080", NULL) == LP_OK);
    CHECK(address_is_own_host(&address, "127.0.0.10:8080"));
}

TEST(port_0_finds_a_free_one)
{
    struct address address;
    int fd = -1;
    REQUIRE(address_parse(&address, "127.0.0.1:0", NULL) == LP_OK);
    REQUIRE(address_listen(&address, &fd, NULL) == LP_OK);
    CHECK(address.port != 0);
    char url[64];
    snprintf(url, sizeof url, "http://127.0.0.1:%u", address.port);
    CHECK_STR(address.url, url);
    /* Taken now: the sentence names the port. */
    struct address again;
    struct lp_error error = {0};
    int other = -1;
    REQUIRE(address_parse(&again, url + 7, NULL) == LP_OK);
    CHECK_EQ(address_listen(&again, &other, &error), LP_IO);
    CHECK_HAS(error.text, url + 7);
    close(fd);
}

TEST(a_stale_socket_is_replaced_and_nothing_else)
{
    struct address address;
    struct stat about;
    int fd = -1, second = -1;
    REQUIRE(address_parse(&address, "unix:socket", NULL) == LP_OK);
    REQUIRE(address_listen(&address, &fd, NULL) == LP_OK);
    CHECK_STR(address.url, "unix:socket");
    CHECK(stat("socket", &about) == 0 && (about.st_mode & 0777) == 0600);
    CHECK_EQ(address_listen(&address, &second, NULL), LP_IO); /* somebody listens */
    close(fd);
    CHECK_EQ(address_listen(&address, &second, NULL), LP_OK); /* stale */
    close(second);
    address_forget(&address);
    CHECK(access("socket", F_OK) != 0);
    FILE *file = fopen("socket", "w");
    REQUIRE(file != NULL);
    fclose(file);
    CHECK_EQ(address_listen(&address, &second, NULL), LP_IO); /* a file is no socket */
    CHECK(access("socket", F_OK) == 0);
}
