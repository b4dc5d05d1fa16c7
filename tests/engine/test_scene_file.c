/* Scene files: what went in comes out, every damaged byte is noticed, nothing is half-written. */
#include "engine/scene_file.h"
#include "engine/trace.h"
#include "tests/engine/small_scene.h"
#include "tests/harness/test.h"

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
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

/* Memory whose end is followed by a page that cannot be read: looking past it crashes. */
struct guarded {
    uint8_t *pages;
    size_t bytes;
};

static struct guarded guarded_make(size_t room)
{
    size_t page = (size_t)sysconf(_SC_PAGESIZE), whole = (room + page - 1) / page * page;
    struct guarded g = {.bytes = whole};
    g.pages = mmap(NULL, whole + page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    REQUIRE(g.pages != MAP_FAILED && mprotect(g.pages + whole, page, PROT_NONE) == 0);
    return g;
}

TEST(every_truncation_is_refused)
{
    struct small_scene small;
    make(&small, 5);
    struct lp_error error;
    struct guarded g = guarded_make(small.byte_count);
    for (size_t count = 0; count < small.byte_count; count++) {
        /* Files are mapped at 64-byte borders at least; the slack is filled with what a reader
         * would not expect, and multiples of 64 end at the guard. */
        size_t room = (count + 63) / 64 * 64;
        uint8_t *cut = g.pages + g.bytes - room;
        memset(cut, 0xa5, room);
        memcpy(cut, small.bytes, count);
        CHECK_EQ(view(cut, count, &error), LP_CORRUPT);
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

/* A scene that was accepted: looking at every level of it must stay inside (the sanitizer
 * watches). */
static void walk_all(const struct lp_scene *scene)
{
    uint32_t side = 1u << scene->tree.depth, step = side > 64 ? side / 64 : 1;
    struct lp_level_cut cuts[] = {{0, 0}, {1, 0}, {0, 0.1f}};
    for (uint32_t x = 0; x < side; x += 3 * step)
        for (uint32_t z = 0; z < side; z += 3 * step) {
            for (uint8_t level = 0; level <= scene->tree.depth; level++) {
                lp_node node;
                float rgb[3];
                uint32_t cell[3] = {x, (x + z) % side, z};
                if (lp_octree_find(&node, &scene->tree, cell, level))
                    for (uint32_t c = 0; c < scene->channel_count; c++)
                        lp_channel_rgb(rgb, &scene->channels[c],
                                       lp_octree_attribute(&scene->tree, node));
            }
            struct lp_ray ray;
            struct lp_hit hit;
            uint64_t steps = 0;
            lp_ray_init(&ray, (double[]){x + 0.5, side + 1.0, z + 0.5}, (lp_vec3){0, -1, 0});
            if (lp_trace_closest(&hit, &steps, &scene->tree, &ray, &cuts[x % 3]))
                CHECK(hit.t_in >= 1 && hit.t_in <= (float)side + 1);
        }
}

static void craft_randomly(uint8_t depth)
{
    struct small_scene small;
    make(&small, depth);
    test_random r = test_random_begin();
    uint8_t *bytes = aligned_alloc(64, small.byte_count);
    uint32_t refused = 0, rounds = 10000;
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
        walk_all(&scene);
    }
    CHECK(refused > rounds / 2 && refused < rounds);
    free(bytes);
    small_scene_finish(&small);
}

TEST(crafted_files_with_true_checksums_never_lead_astray)
{
    craft_randomly(6);
    craft_randomly(5);
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

/* One field changed, checksums made true again: the check that stands for it alone must speak. */
static void check_crafted(const struct small_scene *small, size_t at, uint32_t value,
                          const char *where, const char *piece)
{
    uint8_t *bytes = aligned_alloc(64, small->byte_count);
    struct lp_error error;
    memcpy(bytes, small->bytes, small->byte_count);
    put_u32(bytes, at, value);
    reseal(bytes, small->byte_count);
    CHECK_EQ(view(bytes, small->byte_count, &error), LP_CORRUPT);
    CHECK_STR(error.where, where);
    CHECK_HAS(error.text, piece);
    free(bytes);
}

static uint32_t get_u32(const void *bytes, size_t at)
{
    uint32_t value;
    memcpy(&value, (const uint8_t *)bytes + at, sizeof value);
    return value;
}

TEST(every_check_of_a_crafted_file_stands_alone)
{
    struct small_scene small;
    make(&small, 5);
    const size_t table = 512, nodes = 512 + 4 * 160, levels = 128;
    const size_t first = (nodes + 63) / 64 * 64; /* wide level 0: mask, child_first, mid_first */
    REQUIRE(get_u32(small.bytes, 120) == 4 && small.scene.tree.wide_count[0] > 2);
    CHECK_EQ(get_u32(small.bytes, table + 16), first);
    check_crafted(&small, first + 16 + 8, 9999, "nodes", "points to children 9999");
    check_crafted(&small, first + 16 + 12, 9999, "nodes", "points to children");
    check_crafted(&small, first, get_u32(small.bytes, first) ^ 1, "nodes", "");
    check_crafted(&small, levels + 4, get_u32(small.bytes, levels + 4) + 1, "albedo", "one value");
    check_crafted(&small, levels + 8, get_u32(small.bytes, levels + 8) + 1, "section table",
                  "does not hold");
    check_crafted(&small, levels + 6 * 4, 1, "level_count", "level 6 of 5");
    check_crafted(&small, levels + 5 * 4, 2, "albedo", "one value");
    check_crafted(&small, 16, (uint32_t)small.byte_count - 64, "file_bytes", "cut");
    check_crafted(&small, 36, 7, "filter", "unknown");
    check_crafted(&small, 72, small.scene.bounds_min_vox[0] + 1, "bounds_vox", "axis 0");
    check_crafted(&small, 84 + 8, small.scene.bounds_max_vox[2] - 1, "bounds_vox", "axis 2");
    check_crafted(&small, 124, 1, "header", "zero");
    check_crafted(&small, 508, 1, "header", "zero");
    check_crafted(&small, 120, 3, "section_count", "does not fit depth 5");
    check_crafted(&small, table + 3 * 160 + 8, 2, "albedo", "unknown");
    check_crafted(&small, table + 3 * 160 + 24, 30, "albedo", "one value");
    check_crafted(&small, table + 3 * 160 + 144, 1, "section table", "must be zero");
    check_crafted(&small, table + 160, 2, "section table", "does not hold");
    check_crafted(&small, (size_t)small.byte_count - 4, 1, "channel albedo", "padding");
    small_scene_finish(&small);
}

/* Changes that keep all sums as they are, so that only the last check can speak. */
TEST(crafted_files_whose_sums_hold_are_refused_too)
{
    struct small_scene small;
    make(&small, 5);
    const size_t levels = 128;
    uint32_t level_1 = get_u32(small.bytes, levels + 4),
             level_3 = get_u32(small.bytes, levels + 12);
    put_u32(small.bytes, levels + 12, level_3 - 1);
    check_crafted(&small, levels + 4, level_1 + 1, "nodes", "the header counts");
    put_u32(small.bytes, levels + 12, level_3);
    /* Odd depth: all of the scene in octant 1 of the coarsest wide node, outside of the cube. */
    size_t coarsest =
        (size_t)((const uint8_t *)small.scene.tree.wide[2] - (const uint8_t *)small.bytes);
    uint32_t mask = get_u32(small.bytes, coarsest);
    REQUIRE(mask < 256);
    check_crafted(&small, coarsest, mask << 8, "nodes", "outside of the cube");
    /* 64 zeros more at the end, under the last section's checksum. */
    size_t longer = small.byte_count + 64;
    uint8_t *bytes = aligned_alloc(64, longer);
    struct lp_error error;
    memset(bytes, 0, longer);
    memcpy(bytes, small.bytes, small.byte_count);
    put_u32(bytes, 16, (uint32_t)longer);
    reseal(bytes, longer);
    CHECK_EQ(view(bytes, longer, &error), LP_CORRUPT);
    CHECK_STR(error.where, "file_bytes");
    free(bytes);
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
