/* Scene files: what went in comes out, every damaged byte is noticed, nothing is half-written. */
#include "engine/scene_file.h"
#include "tests/engine/small_scene.h"
#include "tests/harness/test.h"

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#define XXH_STATIC_LINKING_ONLY
#include <xxhash.h>

static void make(struct small_scene *small, uint8_t depth)
{
    test_random r = test_random_begin();
    small_scene_random(small, depth, 0, depth > 5 ? 32 : 1u << depth, 60, &r);
}

static enum lp_code view(const void *bytes, size_t count, struct lp_error *error)
{
    struct lp_scene scene;
    *error = (struct lp_error){0};
    return lp_scene_view(&scene, bytes, count, LP_TRUST_NOTHING, error);
}

TEST(a_file_gives_back_the_scene)
{
    for (uint8_t depth = 1; depth <= 18; depth++) {
        struct small_scene small;
        make(&small, depth);
        struct lp_error error = {0};
        struct lp_scene_file file = {0};
        REQUIRE(lp_scene_file_write("a.lps", small.bytes, small.byte_count, &error) == LP_OK);
        REQUIRE(lp_scene_file_open(&file, "a.lps", LP_TRUST_NOTHING, &error) == LP_OK);
        CHECK_EQ(file.bytes, small.byte_count);
        CHECK(memcmp(file.map, small.bytes, small.byte_count) == 0);
        CHECK_EQ(file.scene.tree.depth, depth);
        lp_scene_file_close(&file);
        REQUIRE(lp_scene_file_open(&file, "a.lps", LP_TRUST_CONTENT, &error) == LP_OK);
        lp_scene_file_close(&file);
        lp_scene_file_close(&file); /* closing twice is harmless */
        small_scene_finish(&small);
    }
}

TEST(every_flipped_bit_of_a_file_is_noticed)
{
    struct small_scene small;
    make(&small, 5);
    uint8_t *bytes = small.bytes;
    struct lp_error error;
    for (size_t i = 0; i < small.byte_count; i++)
        for (int bit = 0; bit < 8; bit += i < 4096 ? 1 : 7) {
            bytes[i] ^= (uint8_t)(1 << bit);
            enum lp_code code = view(bytes, small.byte_count, &error);
            CHECK(code == LP_CORRUPT || code == LP_UNSUPPORTED);
            CHECK(error.text[0] != 0);
            bytes[i] ^= (uint8_t)(1 << bit);
        }
    CHECK_EQ(view(bytes, small.byte_count, &error), LP_OK);
    small_scene_finish(&small);
}

TEST(every_truncation_is_refused)
{
    struct small_scene small;
    make(&small, 5);
    struct lp_error error;
    for (size_t count = 0; count < small.byte_count; count++) {
        void *cut =
            aligned_alloc(64, (count + 63) / 64 * 64 + 64); /* so that reading past it shows */
        memcpy(cut, small.bytes, count);
        CHECK_EQ(view(cut, count, &error), LP_CORRUPT);
        free(cut);
    }
    small_scene_finish(&small);
}

/* Makes header and sections agree again after a deliberate change, as an attacker would. */
static void reseal(uint8_t *bytes, size_t count)
{
    struct lp_scene_view_entry {
        uint32_t kind, index, channel_kind, encoding;
        uint64_t offset, bytes, checksum;
        char name[104];
        uint8_t zeros[16];
    } *table = (void *)(bytes + 512);
    uint32_t sections;
    memcpy(&sections, bytes + 120, 4);
    if (sections > 60 || 512 + sections * 160 > count)
        return;
    for (uint32_t i = 0; i < sections; i++) {
        uint64_t end = i + 1 < sections ? table[i + 1].offset : count;
        if (table[i].offset > end || end > count)
            return;
        table[i].checksum = XXH3_64bits(bytes + table[i].offset, end - table[i].offset);
    }
    uint64_t head = (512 + (uint64_t)sections * 160 + 63) / 64 * 64, sum;
    memset(bytes + 24, 0, 8);
    sum = XXH3_64bits(bytes, head);
    memcpy(bytes + 24, &sum, 8);
}

TEST(crafted_files_with_true_checksums_never_lead_astray)
{
    struct small_scene small;
    make(&small, 6);
    test_random r = test_random_begin();
    uint8_t *bytes = aligned_alloc(64, small.byte_count);
    uint32_t refused = 0, rounds = 20000;
    for (uint32_t i = 0; i < rounds; i++) {
        memcpy(bytes, small.bytes, small.byte_count);
        uint32_t changes = 1 + test_random_below(&r, 3);
        while (changes--) {
            /* mostly where structure is: header, table, nodes */
            uint32_t limit = test_random_below(&r, 4) ? 3000 : (uint32_t)small.byte_count;
            limit = limit < small.byte_count ? limit : (uint32_t)small.byte_count;
            bytes[test_random_below(&r, limit)] = (uint8_t)test_random_u64(&r);
        }
        reseal(bytes, small.byte_count);
        struct lp_error error = {0};
        struct lp_scene scene;
        enum lp_code code =
            lp_scene_view(&scene, bytes, small.byte_count, LP_TRUST_NOTHING, &error);
        if (code != LP_OK) {
            refused++;
            CHECK(error.text[0] != 0);
            continue;
        }
        /* Accepted: then walking all of it must stay inside (the sanitizer watches). */
        for (uint32_t x = 0; x < 64; x += 3)
            for (uint32_t z = 0; z < 64; z += 3) {
                lp_node node;
                float rgb[3];
                if (lp_octree_find(&node, &scene.tree,
                                   (uint32_t[]){x % (1u << scene.tree.depth),
                                                (x + z) % (1u << scene.tree.depth),
                                                z % (1u << scene.tree.depth)},
                                   0))
                    lp_channel_rgb(rgb, &scene.channels[0], lp_octree_attribute(&scene.tree, node));
            }
    }
    CHECK(refused > rounds / 2 && refused < rounds);
    free(bytes);
    small_scene_finish(&small);
}

static void put_u32(void *bytes, size_t at, uint32_t value)
{
    memcpy((uint8_t *)bytes + at, &value, sizeof value);
}

TEST(defects_are_named)
{
    struct small_scene small;
    make(&small, 5);
    struct lp_error error;
    uint8_t *bytes = small.bytes;
    CHECK_EQ(view("PNG", 3, &error), LP_CORRUPT);
    CHECK_HAS(error.text, "not a lightprobe scene");
    put_u32(bytes, 8, 7);
    CHECK_EQ(view(bytes, small.byte_count, &error), LP_UNSUPPORTED);
    CHECK_HAS(error.text, "format 7 is not in this version");
    put_u32(bytes, 8, 1);
    CHECK_EQ(view(bytes, small.byte_count - 64, &error), LP_CORRUPT);
    CHECK_HAS(error.text, "cut or is still being written");
    bytes[small.byte_count - 200] ^= 1;
    CHECK_EQ(view(bytes, small.byte_count, &error), LP_CORRUPT);
    CHECK_STR(error.where, "channel albedo");
    CHECK_HAS(error.text, "damaged");
    bytes[small.byte_count - 200] ^= 1;
    put_u32(bytes, 32, 19);
    reseal(bytes, small.byte_count);
    CHECK_EQ(view(bytes, small.byte_count, &error), LP_CORRUPT);
    CHECK_STR(error.where, "depth");
    small_scene_finish(&small);
}

TEST(files_that_are_none_are_refused)
{
    struct lp_error error = {0};
    struct lp_scene_file file = {0};
    CHECK_EQ(lp_scene_file_open(&file, "absent.lps", LP_TRUST_NOTHING, &error), LP_NOT_FOUND);
    CHECK_STR(error.where, "absent.lps");
    error = (struct lp_error){0};
    CHECK_EQ(lp_scene_file_open(&file, ".", LP_TRUST_NOTHING, &error), LP_IO);
    CHECK_HAS(error.text, "regular file");
    REQUIRE(mkfifo("pipe.lps", 0600) == 0);
    error = (struct lp_error){0};
    CHECK_EQ(lp_scene_file_open(&file, "pipe.lps", LP_TRUST_NOTHING, &error), LP_IO);
    close(open("empty.lps", O_CREAT | O_WRONLY, 0600));
    error = (struct lp_error){0};
    CHECK_EQ(lp_scene_file_open(&file, "empty.lps", LP_TRUST_NOTHING, &error), LP_CORRUPT);
    CHECK_HAS(error.text, "empty");
}

static int files_here(void)
{
    int count = 0;
    DIR *folder = opendir(".");
    for (struct dirent *entry; (entry = readdir(folder));)
        count += entry->d_name[0] != '.';
    closedir(folder);
    return count;
}

TEST(a_failed_write_leaves_the_old_file_and_nothing_else)
{
    struct small_scene small;
    make(&small, 5);
    struct lp_error error = {0};
    REQUIRE(lp_scene_file_write("a.lps", small.bytes, small.byte_count, &error) == LP_OK);
    CHECK_EQ(lp_scene_file_write("no/such/a.lps", small.bytes, small.byte_count, &error), LP_IO);
    CHECK_STR(error.where, "no/such/a.lps");
    /* A size limit makes the write fail in the middle, as a full disk does. */
    struct rlimit limit = {small.byte_count / 2, small.byte_count};
    REQUIRE(setrlimit(RLIMIT_FSIZE, &limit) == 0);
    signal(SIGXFSZ, SIG_IGN);
    error = (struct lp_error){0};
    CHECK(lp_scene_file_write("a.lps", small.bytes, small.byte_count, &error) != LP_OK);
    CHECK_EQ(files_here(), 1);
    struct lp_scene_file file = {0};
    error = (struct lp_error){0};
    CHECK_EQ(lp_scene_file_open(&file, "a.lps", LP_TRUST_NOTHING, &error), LP_OK);
    lp_scene_file_close(&file);
    small_scene_finish(&small);
}
