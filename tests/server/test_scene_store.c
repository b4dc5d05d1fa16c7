/* Scene files: copied, verified, remembered, swept. */
#include "server/scene_store.h"
#include "tests/engine/small_scene.h"

#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

static struct data_dir dir;
static atomic_bool stop;

static struct scene_store *open_store(void)
{
    struct lp_error error = {0};
    if (!dir.path[0] && data_dir_open(&dir, "data", &error) != LP_OK)
        test_abort(__FILE__, __LINE__, "no folder: %s", error.text);
    struct scene_store *store = scene_store_create(&dir, &stop);
    REQUIRE(store != NULL);
    return store;
}

static void write_file(const char *path, const void *data, size_t bytes)
{
    FILE *file = fopen(path, "w");
    REQUIRE(file != NULL && fwrite(data, 1, bytes, file) == bytes && fclose(file) == 0);
}

static void write_scene(const char *path)
{
    struct small_scene scene;
    test_random random = test_random_begin();
    small_scene_random(&scene, 4, 0, 16, 300, &random);
    write_file(path, scene.bytes, scene.byte_count);
    small_scene_finish(&scene);
}

static enum lp_code adopt(struct scene_store *store, const char *name, struct lp_scene_file *file,
                          char *sha256, struct lp_error *err)
{
    struct scene_identity identity;
    int fd = -1;
    enum lp_code code = scene_store_source(store, &fd, &identity, name, err);
    if (code)
        return code;
    code = scene_store_adopt(store, file, sha256, fd, &identity, err);
    close(fd);
    return code;
}

TEST(a_good_file_is_adopted_and_known_at_the_next_start)
{
    struct scene_store *store = open_store();
    struct lp_scene_file file = {0};
    char sha256[WIRE_SHA256_BYTES], path[256];
    write_scene("data/scenes/a.lps");
    REQUIRE(adopt(store, "a.lps", &file, sha256, NULL) == LP_OK);
    CHECK(file.scene.tree.node_count > 0);
    struct stat about;
    snprintf(path, sizeof path, "data/resident/%s.lps", sha256);
    CHECK(stat(path, &about) == 0 && (about.st_mode & 0777) == 0444);
    /* The operator's file may be destroyed: the map is of our copy. */
    uint64_t nodes = file.scene.tree.node_count;
    REQUIRE(scene_store_save(store, NULL) == LP_OK);
    scene_store_destroy(&store);
    store = open_store();
    struct scene_identity identity;
    int fd = -1;
    REQUIRE(scene_store_source(store, &fd, &identity, "a.lps", NULL) == LP_OK);
    close(fd);
    CHECK_STR(scene_store_known(store, &identity), sha256);
    REQUIRE(truncate("data/scenes/a.lps", 100) == 0);
    struct lp_error error = {0};
    CHECK_EQ(lp_octree_check(&file.scene.tree, &error), LP_OK);
    CHECK_EQ(file.scene.tree.node_count, nodes);
    REQUIRE(scene_store_source(store, &fd, &identity, "a.lps", NULL) == LP_OK);
    close(fd);
    CHECK(scene_store_known(store, &identity) == NULL); /* another file now */
    struct lp_scene_file again = {0};
    CHECK_EQ(scene_store_open(store, &again, sha256, NULL), LP_OK);
    lp_scene_file_close(&again);
    lp_scene_file_close(&file);
    scene_store_destroy(&store);
}

TEST(a_copy_that_is_not_what_it_was_is_not_trusted)
{
    struct scene_store *store = open_store();
    struct lp_scene_file file = {0};
    char sha256[WIRE_SHA256_BYTES], path[256];
    struct scene_identity identity;
    int fd = -1;
    write_scene("data/scenes/a.lps");
    REQUIRE(adopt(store, "a.lps", &file, sha256, NULL) == LP_OK);
    lp_scene_file_close(&file);
    REQUIRE(scene_store_source(store, &fd, &identity, "a.lps", NULL) == LP_OK);
    close(fd);
    REQUIRE(scene_store_known(store, &identity) != NULL);
    snprintf(path, sizeof path, "data/resident/%s.lps", sha256);
    REQUIRE(unlink(path) == 0);
    write_scene(path); /* the same bytes even, but not the file that was verified */
    CHECK(scene_store_known(store, &identity) == NULL);
    scene_store_destroy(&store);
}

TEST(bad_files_leave_nothing_behind)
{
    struct scene_store *store = open_store();
    struct lp_scene_file file = {0};
    struct lp_error error = {0};
    char sha256[WIRE_SHA256_BYTES];
    write_scene("data/scenes/a.lps");
    REQUIRE(truncate("data/scenes/a.lps", 700) == 0);
    CHECK(adopt(store, "a.lps", &file, sha256, &error) != LP_OK);
    CHECK(error.text[0] != 0);
    write_file("data/scenes/b.lps", "", 0);
    CHECK(adopt(store, "b.lps", &file, sha256, NULL) != LP_OK);
    REQUIRE(symlink("a.lps", "data/scenes/link.lps") == 0);
    CHECK_EQ(adopt(store, "link.lps", &file, sha256, NULL), LP_INVALID);
    REQUIRE(mkfifo("data/scenes/pipe.lps", 0600) == 0);
    CHECK_EQ(adopt(store, "pipe.lps", &file, sha256, NULL), LP_INVALID); /* and does not hang */
    CHECK_EQ(adopt(store, "none.lps", &file, sha256, NULL), LP_NOT_FOUND);
    CHECK(file.map == NULL);
    CHECK(rmdir("data/resident") == 0); /* it is empty */
    scene_store_destroy(&store);
}

TEST(a_file_that_grows_is_not_copied_beyond_its_size)
{
    struct scene_store *store = open_store();
    struct lp_scene_file file = {0};
    struct lp_error error = {0};
    struct scene_identity identity;
    char sha256[WIRE_SHA256_BYTES];
    int fd = -1;
    write_scene("data/scenes/a.lps");
    REQUIRE(scene_store_source(store, &fd, &identity, "a.lps", NULL) == LP_OK);
    REQUIRE(truncate("data/scenes/a.lps", (off_t)identity.bytes + (8 << 20)) == 0);
    /* Room for what the file was: writing more fails otherwise than it should. */
    struct rlimit before, room;
    REQUIRE(getrlimit(RLIMIT_FSIZE, &before) == 0);
    room = before;
    room.rlim_cur = (rlim_t)identity.bytes;
    void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
    REQUIRE(setrlimit(RLIMIT_FSIZE, &room) == 0);
    enum lp_code code = scene_store_adopt(store, &file, sha256, fd, &identity, &error);
    REQUIRE(setrlimit(RLIMIT_FSIZE, &before) == 0);
    (void)signal(SIGXFSZ, handler);
    CHECK_EQ(code, LP_CORRUPT);
    CHECK_HAS(error.text, "changed while it was read");
    close(fd);
    scene_store_destroy(&store);
}

TEST(stopping_ends_a_copy)
{
    struct scene_store *store = open_store();
    struct lp_scene_file file = {0};
    char sha256[WIRE_SHA256_BYTES];
    write_scene("data/scenes/a.lps");
    atomic_store(&stop, true);
    CHECK_EQ(adopt(store, "a.lps", &file, sha256, NULL), LP_CANCELLED);
    scene_store_destroy(&store);
}

TEST(sweeping_keeps_what_is_listed)
{
    struct scene_store *store = open_store();
    struct lp_scene_file file = {0};
    char kept[1][WIRE_SHA256_BYTES], path[256];
    write_scene("data/scenes/a.lps");
    REQUIRE(adopt(store, "a.lps", &file, kept[0], NULL) == LP_OK);
    lp_scene_file_close(&file);
    write_file("data/resident/.tmp-1234", "x", 1);
    scene_store_sweep(store, (const char(*)[WIRE_SHA256_BYTES])kept, 1);
    CHECK(access("data/resident/.tmp-1234", F_OK) != 0);
    snprintf(path, sizeof path, "data/resident/%s.lps", kept[0]);
    CHECK(access(path, F_OK) == 0);
    scene_store_sweep(store, NULL, 0);
    CHECK(access(path, F_OK) != 0);
    scene_store_destroy(&store);
}

TEST(a_damaged_memory_is_passed_over)
{
    struct scene_store *store = open_store();
    scene_store_destroy(&store);
    static const char *const texts[] = {"", "rubbish", "lightprobe verified 1\nx y z\n",
                                        "lightprobe verified 1\n0123 1 2 3 4 5 6 7 8 9 10\n",
                                        "lightprobe verified 1\ncut off"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        write_file("data/resident/verified", texts[i], strlen(texts[i]));
        store = open_store();
        struct scene_identity identity = {1, 2, 3, 4, 5};
        CHECK(scene_store_known(store, &identity) == NULL);
        scene_store_destroy(&store);
    }
}

TEST(a_second_lock_is_refused)
{
    struct data_dir first, second;
    struct lp_error error = {0};
    REQUIRE(data_dir_open(&first, "d/e/f", NULL) == LP_OK);
    CHECK_EQ(data_dir_open(&second, "d/e/f", &error), LP_INVALID);
    CHECK_HAS(error.text, "another lightprobed");
    CHECK_STR(error.where, "d/e/f");
    data_dir_close(&first);
    REQUIRE(data_dir_open(&second, "d/e/f", NULL) == LP_OK);
    data_dir_close(&second);
}
