/* The commands as a user meets them: exit statuses, one-line sentences, files that appear or not.
 */
#include "tests/harness/test.h"

#include <dirent.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "clients/cli/command.h"
#include "protocol/read.h"

#define WORDS_MAX 24
#define OUT_BYTES 16384

struct run {
    int status;
    char out[OUT_BYTES], err[OUT_BYTES];
};

static void read_back(char out[OUT_BYTES], const char *path)
{
    out[0] = '\0';
    FILE *file = fopen(path, "rb");
    REQUIRE(file);
    out[fread(out, 1, OUT_BYTES - 1, file)] = '\0';
    fclose(file);
    unlink(path);
}

/* The program that was built with this test: build/CONFIG/lightprobe beside build/CONFIG/tests. */
static void program_path(char out[PATH_MAX])
{
    ssize_t length = readlink("/proc/self/exe", out, PATH_MAX - 1);
    REQUIRE(length > 0);
    out[length] = '\0';
    for (int up = 0; up < 3; up++) { /* test_commands, clients, tests */
        char *slash = strrchr(out, '/');
        REQUIRE(slash);
        *slash = '\0';
    }
    REQUIRE(strlen(out) + sizeof "/lightprobe" <= PATH_MAX);
    memcpy(out + strlen(out), "/lightprobe", sizeof "/lightprobe");
    if (access(out, X_OK) != 0)
        test_abort(__FILE__, __LINE__, "%s is not there: make the programs first", out);
}

/* Runs `lightprobe WORDS`; words are split at blanks. */
static struct run run(const char *line)
{
    struct run result = {.status = -1};
    char words[1024], program[PATH_MAX], name[] = "lightprobe";
    char *argv[WORDS_MAX + 2] = {name};
    int argc = 1;
    program_path(program);
    snprintf(words, sizeof words, "%s", line);
    char *rest = NULL;
    for (char *at = strtok_r(words, " ", &rest); at && argc < WORDS_MAX;
         at = strtok_r(NULL, " ", &rest))
        argv[argc++] = at;
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        unsetenv("LIGHTPROBE_SERVER");
        if (freopen(".out", "wb", stdout) && freopen(".err", "wb", stderr))
            execv(program, argv);
        _exit(99);
    }
    int status;
    REQUIRE(child > 0 && waitpid(child, &status, 0) == child);
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    read_back(result.out, ".out");
    read_back(result.err, ".err");
    return result;
}

static size_t lines(const char *text)
{
    size_t count = 0;
    for (; *text; text++)
        count += *text == '\n';
    return count;
}

static void expect(const char *line, int status, const char *says)
{
    struct run got = run(line);
    if (got.status != status)
        test_fail(__FILE__, __LINE__, "`%s` exits %d, not %d: %s", line, got.status, status,
                  got.err);
    if (lines(got.err) != 1 || strncmp(got.err, "lightprobe", 10) != 0)
        test_fail(__FILE__, __LINE__, "`%s` says not one line but \"%s\"", line, got.err);
    if (!strstr(got.err, says))
        test_fail(__FILE__, __LINE__, "`%s` says \"%s\", nothing of \"%s\"", line, got.err, says);
}

static size_t files_here(void)
{
    size_t count = 0;
    DIR *folder = opendir(".");
    REQUIRE(folder);
    for (struct dirent *entry = readdir(folder); entry; entry = readdir(folder))
        count += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    closedir(folder);
    return count;
}

TEST(wrong_usage_exits_2_with_one_line)
{
    expect("", 2, "--help");
    expect("rendr", 2, "did you mean `lightprobe render`");
    expect("errors", 2, "not in this version");
    expect("push x", 2, "not in this version");
    expect("build", 2, "argument is missing");
    expect("build x.png", 2, "-o SCENE.lps");
    expect("build x.png -o x.bin", 2, ".lps");
    expect("build x.png -o x.lps", 2, "--size-m");
    expect("build x.png -o x.lps --size-m 5", 2, "--height-m");
    expect("build x.png -o x.lps --size-m 5 --height-m 1 --depth 15", 2, "--depth");
    expect("build procedural:torus -o x.lps", 2, "procedural:room");
    expect("build procedural:room -o x.lps --filter nice", 2, "--filter");
    expect("build procedural:room -o x.lps --colour c.png", 2, "did you mean --color");
    expect("build procedural:room -o x.lps --color c.png", 2, "height maps");
    expect("info", 2, "argument is missing");
    expect("info a b", 2, "too many");
    expect("verify", 2, "argument is missing");
    expect("render", 2, "-o DIR");
    expect("render -o out", 2, "SCENE.lps, or --server URL");
    expect("render a.lps --server http://127.0.0.1:1 -o out", 2, "not both");
    expect("render a.lps -o out --face-px 4097", 2, "--face-px");
    expect("render a.lps -o out --probe 1,2", 2, "--probe");
    expect("scenes extra", 2, "too many");
    expect("stats --jsno", 2, "did you mean --json");
    CHECK_EQ(files_here(), 0);
}

TEST(failures_exit_1_with_one_line)
{
    expect("info nothing.lps", 1, "nothing.lps");
    expect("render nothing.lps -o out --quiet", 1, "nothing.lps");
    expect("build procedural:room --depth 4 -o no/such/x.lps", 1, "make the folder first");
    expect("build nothing.png --size-m 5 --height-m 1 -o x.lps --quiet", 1, "nothing.png");
    expect("scenes --server http://127.0.0.1:1", 1, "no daemon answers at http://127.0.0.1:1");
    expect("stats --server ftp://x", 1, "http://");
    expect("render --server http://127.0.0.1:1 -o out --quiet", 1, "make serve");
    CHECK_EQ(files_here(), 0);
}

TEST(help_and_version_exit_0)
{
    static const char *const asked[] = {"--help",        "build --help",  "info --help",
                                        "verify --help", "render --help", "scenes --help",
                                        "stats -h"};
    for (size_t i = 0; i < sizeof asked / sizeof asked[0]; i++) {
        struct run got = run(asked[i]);
        CHECK_EQ(got.status, 0);
        CHECK_HAS(got.out, "usage: lightprobe");
        CHECK_STR(got.err, "");
    }
    struct run got = run("--version");
    CHECK_EQ(got.status, 0);
    CHECK_STR(got.out, "lightprobe " LP_VERSION "\n");
}

TEST(build_info_verify_agree_about_a_scene)
{
    struct run got = run("build procedural:room --depth 5 -o room.lps --quiet --json");
    if (got.status != 0)
        test_abort(__FILE__, __LINE__, "build: %s", got.err);
    CHECK_STR(got.err, "");
    struct wire_read *built = wire_read_open(got.out, strlen(got.out));
    uint64_t voxels = 0, bytes = 0, more;
    CHECK(wire_read_u64(&voxels, wire_read_get(wire_read_root(built), "voxels")));
    CHECK(wire_read_u64(&bytes, wire_read_get(wire_read_root(built), "bytes")));
    CHECK_EQ(voxels, 32 * 32 * 32 - 30 * 30 * 30); /* walls one voxel thick */
    struct stat status;
    CHECK(stat("room.lps", &status) == 0 && (uint64_t)status.st_size == bytes);
    wire_read_close(&built);

    got = run("info room.lps --json");
    CHECK_EQ(got.status, 0);
    struct wire_read *info = wire_read_open(got.out, strlen(got.out));
    const struct wire_value *root = wire_read_root(info);
    CHECK_STR(wire_read_text(wire_read_get(root, "name")), "room");
    CHECK_STR(wire_read_text(wire_read_get(root, "state")), "ready");
    CHECK(wire_read_u64(&more, wire_read_get(root, "voxels")) && more == voxels);
    CHECK(wire_read_u64(&more, wire_read_get(root, "bytes")) && more == bytes);
    CHECK_EQ(wire_read_count(wire_read_get(root, "suggested_probe")), 3);
    wire_read_close(&info);
    got = run("info room.lps");
    CHECK_EQ(got.status, 0);
    CHECK_HAS(got.out, "sha256");

    got = run("verify room.lps");
    CHECK_EQ(got.status, 0);
    CHECK_HAS(got.out, "room.lps: ok, 5,768 voxels");
}

TEST(verify_names_the_defect_of_each_bad_file)
{
    REQUIRE(run("build procedural:room --depth 4 -o room.lps --quiet").status == 0);
    int file = open("room.lps", O_RDWR);
    char byte;
    REQUIRE(file >= 0 && pread(file, &byte, 1, 2000) == 1);
    byte = (char)(byte ^ 1);
    int copy = open("bad.lps", O_WRONLY | O_CREAT, 0666);
    char block[65536];
    ssize_t n = pread(file, block, sizeof block, 0);
    REQUIRE(copy >= 0 && n > 2000 && write(copy, block, (size_t)n) == n);
    REQUIRE(pwrite(copy, &byte, 1, 2000) == 1);
    close(copy);
    close(file);
    struct run got = run("verify bad.lps room.lps absent.lps");
    CHECK_EQ(got.status, 1);
    CHECK_EQ(lines(got.out), 3);
    CHECK_HAS(got.out, "room.lps: ok");
    CHECK_HAS(got.out, "bad.lps: ");
    CHECK_HAS(got.out, "absent.lps: ");
    got = run("verify --json bad.lps room.lps");
    CHECK_EQ(got.status, 1);
    CHECK_HAS(got.out, "\"ok\":false");
    CHECK_HAS(got.out, "\"ok\":true");
}

/* The film's hash in a document; "" where there is none. */
static void film_of(char out[65], const char *document)
{
    struct wire_read *read = wire_read_open(document, strlen(document));
    const struct wire_value *probe = wire_read_first(wire_read_get(wire_read_root(read), "probes"));
    const char *hash = wire_read_text(wire_read_get(probe, "film_sha256"));
    snprintf(out, 65, "%s", hash ? hash : "");
    wire_read_close(&read);
}

static void write_text(const char *path, const char *text)
{
    REQUIRE(lpc_file_write(path, text, strlen(text), NULL) == LPC_OK);
}

TEST(render_on_a_file_gives_pictures_and_one_film_at_any_width)
{
    REQUIRE(run("build procedural:room --depth 5 -o room.lps --quiet").status == 0);
    char first[65], again[65];
    struct run got = run("render room.lps --mode lod --face-px 16 --format png,exr -o out --json "
                         "--quiet --threads 1");
    if (got.status != 0)
        test_abort(__FILE__, __LINE__, "render: %s", got.err);
    film_of(first, got.out);
    CHECK_EQ(strlen(first), 64);
    CHECK(access("out/room.png", R_OK) == 0 && access("out/room.exr", R_OK) == 0);
    CHECK(access("out/result.json", R_OK) == 0);
    got = run("render room.lps --mode lod --face-px 16 -o out4 --json --quiet --threads 4");
    CHECK_EQ(got.status, 0);
    film_of(again, got.out);
    CHECK_STR(again, first);
    CHECK(access("out4/room.png", R_OK) == 0 && access("out4/room.exr", R_OK) != 0);

    /* The same job as a document; the probe is the suggested one in all of them. */
    write_text("job.json", "{\"scene\":\"room\",\"mode\":\"lod\",\"face_px\":99}");
    got = run("render room.lps --request job.json --face-px 16 -o out5 --json --quiet");
    CHECK_EQ(got.status, 0);
    film_of(again, got.out);
    CHECK_STR(again, first);
    got = run("render room.lps --request job.json --face-px 16 -o out5");
    CHECK_EQ(got.status, 0);
    CHECK_HAS(got.out, first);
    CHECK_HAS(got.out, "out5/room.png");
}

TEST(render_says_what_is_wrong_with_a_request)
{
    REQUIRE(run("build procedural:room --depth 4 -o room.lps --quiet").status == 0);
    write_text("broken.json", "{\"scene\":\"room\",}");
    write_text("nan.json", "{\"scene\":\"room\",\"face_px\":NaN}");
    write_text("zero.json", "{\"scene\":\"room\",\"mode\":\"lod\",\"face_px\":016}");
    write_text("other.json", "{\"scene\":\"hall\",\"mode\":\"lod\"}");
    write_text("field.json", "{\"scene\":\"room\",\"mode\":\"lod\",\"colour\":1}");
    write_text("later.json", "{\"scene\":\"room\",\"mode\":\"adaptive\"}");
    write_text("light.json", "{\"scene\":\"room\",\"mode\":\"lod\",\"lighting\":\"noon\"}");
    write_text("list.json", "[1]");
    expect("render room.lps --request broken.json -o out --quiet", 1, "broken.json");
    expect("render room.lps --request nan.json -o out --quiet", 1, "nan.json");
    expect("render room.lps --request zero.json --face-px 8 -o out --quiet", 1, "zero.json");
    expect("render room.lps --request other.json -o out --quiet", 1, "hall");
    expect("render room.lps --request field.json -o out --quiet", 1, "/colour");
    expect("render room.lps --request later.json -o out --quiet", 1, "not in this version");
    expect("render room.lps --request light.json -o out --quiet", 1, "lighting");
    expect("render room.lps --request list.json -o out --quiet", 1, "list.json");
    expect("render room.lps --request absent.json -o out --quiet", 1, "absent.json");
    expect("render room.lps --mode lod --faces +X;rm -o out --quiet", 1, "--faces");
    write_text("file", "");
    expect("render room.lps --mode lod -o file --quiet", 1, "is no folder");
    CHECK(access("out", F_OK) != 0);
}
