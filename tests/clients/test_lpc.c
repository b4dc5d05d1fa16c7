/* The client library without a daemon: addresses, sentences, and canned answers over real HTTP. */
#include "tests/harness/test.h"

#include <arpa/inet.h>
#include <dirent.h>
#include <netinet/in.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "clients/c/lpc_private.h"

TEST(address_takes_the_known_forms)
{
    static const struct {
        const char *server, *base, *unix_path;
        bool loopback;
    } good[] = {
        {"http://127.0.0.1:8080", "http://127.0.0.1:8080", "", true},
        {"http://127.0.0.1:8080/", "http://127.0.0.1:8080", "", true},
        {"http://localhost", "http://localhost", "", true},
        {"http://LOCALHOST:1", "http://LOCALHOST:1", "", true},
        {"http://[::1]:8080", "http://[::1]:8080", "", true},
        {"https://bake.example.org:65535", "https://bake.example.org:65535", "", false},
        {"unix:/run/lightprobed.sock", "http://localhost", "/run/lightprobed.sock", true},
        {"unix:here.sock", "http://localhost", "here.sock", true},
    };
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        struct lpc_address address;
        struct lpc_error err = {0};
        if (lpc_address_read(&address, good[i].server, &err) != LPC_OK)
            test_abort(__FILE__, __LINE__, "%s: %s", good[i].server, err.text);
        CHECK_STR(address.base, good[i].base);
        CHECK_STR(address.unix_path, good[i].unix_path);
        CHECK_EQ(address.loopback, good[i].loopback);
    }
}

TEST(address_refuses_the_rest_and_shows_a_right_one)
{
    static const char *const bad[] = {
        "",
        "127.0.0.1:8080",
        "ftp://host",
        "http://",
        "http://:8080",
        "http://host:",
        "http://host:0",
        "http://host:65536",
        "http://host:80x",
        "http://host:000080",
        "http://user@host",
        "http://host/path",
        "http://host?query",
        "http://ho st",
        "http://[::1",
        "http://[]:80",
        "http://.host",
        "unix:",
        "file:///etc/passwd",
    };
    struct lpc_address address = {.base = "untouched"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct lpc_error err = {0};
        if (lpc_address_read(&address, bad[i], &err) != LPC_INVALID)
            test_fail(__FILE__, __LINE__, "\"%s\" was taken", bad[i]);
        CHECK_HAS(err.text, "http://127.0.0.1:8080");
    }
    CHECK_STR(address.base, "untouched");
    char long_path[256] = "unix:/";
    memset(long_path + 6, 'x', sizeof long_path - 7);
    struct lpc_error err = {0};
    CHECK(lpc_address_read(&address, long_path, &err) == LPC_INVALID);
    CHECK(lpc_address_read(&address, NULL, NULL) == LPC_INVALID);
}

/* ---- a server of one canned answer --------------------------------------------------------------
 */

struct canned {
    pid_t child;
    char server[64];
};

static int listen_anywhere(unsigned *port)
{
    int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof at;
    if (listener < 0 || bind(listener, (struct sockaddr *)&at, sizeof at) != 0 ||
        listen(listener, 4) != 0 || getsockname(listener, (struct sockaddr *)&at, &size) != 0)
        test_abort(__FILE__, __LINE__, "no loopback socket");
    *port = ntohs(at.sin_port);
    return listener;
}

static bool ends_headers(const char *text, size_t length)
{
    return length >= 4 && memcmp(text + length - 4, "\r\n\r\n", 4) == 0;
}

/* Answers `count` connections with `answer`, one request each, and ends. The child is waited for by
 * nobody: it goes with its parent, or after the last answer. */
static void serve(struct canned *canned, const char *answer, size_t bytes, int count)
{
    unsigned port;
    int listener = listen_anywhere(&port);
    snprintf(canned->server, sizeof canned->server, "http://127.0.0.1:%u", port);
    fflush(NULL);
    canned->child = fork();
    if (canned->child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        alarm(60); /* should the parent have gone already */
        for (int i = 0; i < count; i++) {
            int connection = accept(listener, NULL, NULL);
            char request[4096];
            size_t used = 0;
            while (used < sizeof request && !ends_headers(request, used) &&
                   read(connection, request + used, 1) == 1)
                used++;
            for (size_t sent = 0; sent < bytes;) {
                ssize_t n = send(connection, answer + sent, bytes - sent, MSG_NOSIGNAL);
                if (n <= 0)
                    break;
                sent += (size_t)n;
            }
            shutdown(connection, SHUT_WR);
            while (read(connection, request, sizeof request) > 0)
                ;
            close(connection);
        }
        _exit(0);
    }
    close(listener);
}

static struct lpc_client *client_of(const char *server, const struct lpc_options *with)
{
    struct lpc_options options = with ? *with : (struct lpc_options){0};
    struct lpc_client *client = NULL;
    struct lpc_error err = {0};
    options.server = server;
    if (lpc_client_create(&client, &options, &err) != LPC_OK)
        test_abort(__FILE__, __LINE__, "%s", err.text);
    return client;
}

static size_t files_here(void)
{
    size_t count = 0;
    DIR *folder = opendir(".");
    REQUIRE(folder);
    for (struct dirent *entry = readdir(folder); entry; entry = readdir(folder))
        count += entry->d_name[0] != '.';
    closedir(folder);
    return count;
}

TEST(nobody_there_is_said_with_the_way_out)
{
    unsigned port;
    int listener = listen_anywhere(&port);
    close(listener); /* now nobody listens on this port */
    char server[64];
    snprintf(server, sizeof server, "http://127.0.0.1:%u", port);
    struct lpc_client *client = client_of(server, NULL);
    struct lpc_answer answer = {.status = 77};
    struct lpc_error err = {0};
    CHECK(lpc_stats(client, &answer, &err) == LPC_UNREACHABLE);
    CHECK_HAS(err.text, "no daemon answers at");
    CHECK_HAS(err.text, server);
    CHECK_HAS(err.text, "make serve");
    CHECK_EQ(answer.status, 77);
    lpc_client_destroy(&client);

    client = client_of("unix:nobody.sock", NULL);
    err = (struct lpc_error){0};
    CHECK(lpc_scenes(client, &answer, &err) == LPC_UNREACHABLE);
    CHECK_HAS(err.text, "unix:nobody.sock");
    lpc_client_destroy(&client);
    lpc_client_destroy(&client);
}

TEST(an_answer_comes_with_the_wanted_headers)
{
    static const char answer[] =
        "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nETAG: \"abc\"\r\n"
        "x-request-id:  r-1 \r\nRetry-After: 7\r\nLocation: /v1/jobs/9\r\nContent-Length: 2\r\n"
        "Connection: close\r\n\r\n{}";
    struct canned canned;
    serve(&canned, answer, sizeof answer - 1, 1);
    struct lpc_client *client = client_of(canned.server, NULL);
    struct lpc_answer got = {0};
    struct lpc_error err = {0};
    REQUIRE(lpc_send(client, &got, &(struct lpc_request){.path = "/x"}, &err) == LPC_OK);
    CHECK_EQ(got.status, 200);
    CHECK_STR(got.body, "{}");
    CHECK_EQ(got.bytes, 2);
    CHECK_STR(got.content_type, "application/json");
    CHECK_STR(got.etag, "\"abc\"");
    CHECK_STR(got.request_id, "r-1");
    CHECK_STR(got.location, "/v1/jobs/9");
    CHECK_EQ(got.retry_after_s, 7);
    lpc_answer_finish(&got);
    lpc_client_destroy(&client);
}

TEST(a_refusal_becomes_one_sentence)
{
    static const char answer[] =
        "HTTP/1.1 422 Unprocessable\r\nContent-Type: application/problem+json\r\n"
        "Connection: close\r\n\r\n"
        "{\"type\":\"/problems/invalid-field\",\"title\":\"T\",\"status\":422,\"detail\":\"2 "
        "fields "
        "are wrong\",\"errors\":[{\"pointer\":\"/mode\",\"detail\":\"is lod or reference\"},"
        "{\"pointer\":\"\",\"detail\":\"scene is missing\"}]}";
    struct canned canned;
    serve(&canned, answer, sizeof answer - 1, 1);
    struct lpc_client *client = client_of(canned.server, NULL);
    struct lpc_answer got = {0};
    struct lpc_error err = {0};
    CHECK(lpc_render(client, &got, "{}", 2, NULL, &err) == LPC_REFUSED);
    CHECK_EQ(err.status, 422);
    CHECK_STR(err.problem, "invalid-field");
    CHECK_HAS(err.text, "422 invalid-field: /mode: is lod or reference; "
                        "the document: scene is missing");
    CHECK(!got.body);
    lpc_client_destroy(&client);
}

TEST(a_stranger_on_the_port_is_recognised)
{
    static const char html[] = "HTTP/1.1 404 Not Found\r\nConnection: close\r\n\r\n<html></html>";
    static const char noise[] = "SSH-2.0-OpenSSH_9.2\r\n";
    struct canned canned;
    struct lpc_answer got = {0};
    serve(&canned, html, sizeof html - 1, 1);
    struct lpc_client *client = client_of(canned.server, NULL);
    struct lpc_error err = {0};
    CHECK(lpc_stats(client, &got, &err) == LPC_REFUSED);
    CHECK_HAS(err.text, "does a lightprobe daemon listen there?");
    lpc_client_destroy(&client);

    serve(&canned, noise, sizeof noise - 1, 1);
    client = client_of(canned.server, NULL);
    err = (struct lpc_error){0};
    enum lpc_code code = lpc_stats(client, &got, &err);
    CHECK(code == LPC_PROTOCOL || code == LPC_UNREACHABLE);
    CHECK_HAS(err.text, canned.server);
    lpc_client_destroy(&client);
}

TEST(an_answer_over_the_limit_is_refused)
{
    static const char answer[] = "HTTP/1.1 200 OK\r\nConnection: close\r\n\r\n0123456789";
    struct canned canned;
    struct lpc_answer got = {0};
    struct lpc_error err = {0};
    serve(&canned, answer, sizeof answer - 1, 2);
    struct lpc_client *client =
        client_of(canned.server, &(struct lpc_options){.body_max_bytes = 9});
    CHECK(lpc_stats(client, &got, &err) == LPC_LIMIT);
    CHECK_HAS(err.text, "9 bytes");
    lpc_client_destroy(&client);
    client = client_of(canned.server, &(struct lpc_options){.body_max_bytes = 10});
    CHECK(lpc_stats(client, &got, NULL) == LPC_OK);
    CHECK_EQ(got.bytes, 10);
    lpc_answer_finish(&got);
    lpc_client_destroy(&client);
}

TEST(a_broken_off_answer_is_a_failure)
{
    static const char answer[] = "HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\n0123456789";
    struct canned canned;
    struct lpc_answer got = {0};
    struct lpc_error err = {0};
    serve(&canned, answer, sizeof answer - 1, 1);
    struct lpc_client *client = client_of(canned.server, NULL);
    CHECK(lpc_stats(client, &got, &err) == LPC_UNREACHABLE);
    CHECK_HAS(err.text, "broke");
    CHECK(!got.body);
    lpc_client_destroy(&client);
}

TEST(a_cancelled_client_asks_nobody_for_long)
{
    unsigned port;
    int listener = listen_anywhere(&port); /* takes the connection, never answers */
    char server[64];
    snprintf(server, sizeof server, "http://127.0.0.1:%u", port);
    atomic_bool cancelled = true;
    struct lpc_client *client = client_of(server, &(struct lpc_options){.cancelled = &cancelled});
    struct lpc_answer got = {0};
    CHECK(lpc_stats(client, &got, NULL) == LPC_CANCELLED);
    lpc_client_destroy(&client);
    client = client_of(server, &(struct lpc_options){.timeout_ms = 50});
    struct lpc_error err = {0};
    CHECK(lpc_stats(client, &got, &err) == LPC_TIMEOUT);
    CHECK_HAS(err.text, "50 ms");
    lpc_client_destroy(&client);
    close(listener);
}

/* SHA-256 of "hello" (any calculator). */
#define HELLO_SHA256 "2cf24dba5fb0a30e26e83b2ac5b9e29e1b161e5c1fa7425e73043362938b9824"

TEST(a_download_is_whole_and_checked_or_absent)
{
    static const char answer[] = "HTTP/1.1 200 OK\r\nConnection: close\r\n\r\nhello";
    struct canned canned;
    struct lpc_error err = {0};
    serve(&canned, answer, sizeof answer - 1, 4);
    struct lpc_client *client = client_of(canned.server, NULL);
    CHECK(lpc_download(client, "/a", "a.png", HELLO_SHA256, 6, &err) == LPC_PROTOCOL);
    CHECK_HAS(err.text, "5 bytes");
    err = (struct lpc_error){0};
    char wrong[] = HELLO_SHA256;
    wrong[0] = '3';
    CHECK(lpc_download(client, "/a", "a.png", wrong, 5, &err) == LPC_PROTOCOL);
    CHECK_HAS(err.text, "SHA-256");
    CHECK_EQ(files_here(), 0);
    CHECK(lpc_download(client, "/a", "no/folder/a.png", HELLO_SHA256, 5, NULL) == LPC_IO);
    REQUIRE(lpc_download(client, "/a", "a.png", HELLO_SHA256, 5, NULL) == LPC_OK);
    CHECK_EQ(files_here(), 1);
    struct stat status;
    CHECK(stat("a.png", &status) == 0 && status.st_size == 5);
    lpc_client_destroy(&client);

    static const char gone[] =
        "HTTP/1.1 410 Gone\r\nConnection: close\r\n\r\n"
        "{\"type\":\"/problems/gone\",\"detail\":\"the result has expired\"}";
    serve(&canned, gone, sizeof gone - 1, 1);
    client = client_of(canned.server, NULL);
    err = (struct lpc_error){0};
    CHECK(lpc_download(client, "/b", "b.png", NULL, UINT64_MAX, &err) == LPC_REFUSED);
    CHECK_HAS(err.text, "the result has expired");
    CHECK_EQ(files_here(), 1);
    lpc_client_destroy(&client);
}

TEST(pictures_are_named_after_stem_and_index)
{
    static const char answer[] = "HTTP/1.1 200 OK\r\nConnection: close\r\n\r\nhello";
    static const char one[] = "{\"probes\":[{\"index\":0,\"images\":["
                              "{\"href\":\"/v1/jobs/7/probes/0.png\",\"bytes\":5,"
                              "\"sha256\":\"" HELLO_SHA256 "\"},"
                              "{\"href\":\"/v1/jobs/7/probes/0.exr?layout=strip\",\"bytes\":5}]}]}";
    static const char two[] = "{\"probes\":[{\"index\":0,\"images\":[{\"href\":\"/a/0.png\"}]},"
                              "{\"index\":1,\"images\":[{\"href\":\"/a/1.png\"}]}]}";
    struct canned canned;
    struct lpc_pictures *pictures = calloc(1, sizeof *pictures);
    REQUIRE(pictures);
    serve(&canned, answer, sizeof answer - 1, 4);
    struct lpc_client *client = client_of(canned.server, NULL);
    REQUIRE(lpc_save_pictures(client, pictures, one, sizeof one - 1, ".", "room", NULL) == LPC_OK);
    REQUIRE(lpc_save_pictures(client, pictures, two, sizeof two - 1, ".", "room", NULL) == LPC_OK);
    CHECK_EQ(pictures->count, 4);
    CHECK(access("room.png", R_OK) == 0 && access("room.exr", R_OK) == 0);
    CHECK(access("room-0.png", R_OK) == 0 && access("room-1.png", R_OK) == 0);

    /* Addresses that would lead elsewhere, or names that are no extension, are not followed. */
    static const char *const bad[] = {
        "{\"probes\":[{\"images\":[{\"href\":\"http://elsewhere/a.png\"}]}]}",
        "{\"probes\":[{\"images\":[{\"href\":\"/a/b\"}]}]}",
        "{\"probes\":[{\"images\":[{\"href\":\"/a.p/../..\"}]}]}",
        "{\"probes\":[{\"images\":[{\"href\":7}]}]}",
        "{}",
        "<html>",
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        CHECK(lpc_save_pictures(client, pictures, bad[i], strlen(bad[i]), ".", "bad", NULL) ==
              LPC_PROTOCOL);
    CHECK_EQ(files_here(), 4);
    free(pictures);
    lpc_client_destroy(&client);
}

TEST(scene_names_are_checked_before_anything_is_sent)
{
    struct lpc_client *client = client_of("http://127.0.0.1:1", NULL);
    struct lpc_answer got = {0};
    struct lpc_error err = {0};
    CHECK(lpc_scene(client, &got, "../secret", &err) == LPC_INVALID);
    CHECK_HAS(err.text, "cannot be a scene's name");
    err = (struct lpc_error){0};
    CHECK(lpc_send(client, &got, &(struct lpc_request){.path = "no-slash"}, &err) == LPC_INVALID);
    lpc_client_destroy(&client);
}

TEST(a_written_file_replaces_the_old_one_and_leaves_nothing_beside)
{
    REQUIRE(lpc_file_write("a.json", "old and longer", 14, NULL) == LPC_OK);
    REQUIRE(lpc_file_write("a.json", "new", 3, NULL) == LPC_OK);
    char text[32] = "";
    FILE *file = fopen("a.json", "rb");
    REQUIRE(file);
    CHECK_EQ(fread(text, 1, sizeof text - 1, file), 3);
    fclose(file);
    CHECK_STR(text, "new");
    CHECK_EQ(files_here(), 1);
    struct lpc_error err = {0};
    CHECK(lpc_file_write("missing/a.json", "x", 1, &err) == LPC_IO);
    CHECK_HAS(err.text, "missing/a.json");
}
