/* The table-driven flags: forms, strict numbers, ranges, suggestions. */
#include "tests/harness/test.h"

#include <math.h>
#include <string.h>

#include "clients/cli/flags.h"

struct fixture {
    bool json;
    const char *out;
    uint64_t depth;
    double size_m, probe[3];
    struct flag flags[5];
    struct flag_set set;
    struct lp_error err;
    int count;
};

static void set_up(struct fixture *f)
{
    *f = (struct fixture){.depth = 77, .size_m = -1};
    f->flags[0] = (struct flag){.name = "json", .kind = FLAG_SWITCH, .to.on = &f->json, .help = ""};
    f->flags[1] = (struct flag){.name = "output",
                                .letter = 'o',
                                .value = "DIR",
                                .help = "",
                                .kind = FLAG_TEXT,
                                .to.text = &f->out};
    f->flags[2] = (struct flag){.name = "depth",
                                .value = "D",
                                .kind = FLAG_U64,
                                .help = "",
                                .to.u64 = &f->depth,
                                .min = 1,
                                .max = 14};
    f->flags[3] = (struct flag){.name = "size-m",
                                .value = "X",
                                .kind = FLAG_F64,
                                .help = "",
                                .to.f64 = &f->size_m,
                                .min = 0.5,
                                .max = 1000};
    f->flags[4] = (struct flag){
        .name = "probe", .value = "x,y,z", .kind = FLAG_TRIPLE, .help = "", .to.triple = f->probe};
    f->set = (struct flag_set){.usage = "test",
                               .summary = "",
                               .flags = f->flags,
                               .flag_count = 5,
                               .arguments_min = 0,
                               .arguments_max = 2};
}

/* Reads NULL-ended words; the fixture has to be set up. */
static enum flags_answer read_words(struct fixture *f, char **words)
{
    int argc = 0;
    while (words[argc])
        argc++;
    return flags_read(&f->set, argc, words, &f->count, &f->err);
}
#define READ(f, ...) read_words((f), (char *[]){"test", __VA_ARGS__, NULL})

TEST(flags_take_both_forms_and_keep_arguments_in_order)
{
    struct fixture f;
    set_up(&f);
    char *words[] = {"test",   "first", "--depth", "5",       "--size-m=2.5", "-",
                     "--json", "-o",    "here",    "--probe", "1,-2.5,3e2",   NULL};
    REQUIRE(read_words(&f, words) == FLAGS_READY);
    CHECK_EQ(f.count, 2);
    CHECK_STR(words[0], "first");
    CHECK_STR(words[1], "-");
    CHECK_EQ(f.depth, 5);
    CHECK(f.size_m == 2.5);
    CHECK(f.json);
    CHECK_STR(f.out, "here");
    CHECK(f.probe[0] == 1 && f.probe[1] == -2.5 && f.probe[2] == 300);
    CHECK(f.flags[2].given);
}

TEST(flags_leave_what_is_not_given_untouched)
{
    struct fixture f;
    set_up(&f);
    REQUIRE(READ(&f, "--json") == FLAGS_READY);
    CHECK_EQ(f.depth, 77);
    CHECK(f.size_m == -1);
    CHECK(!f.out);
    CHECK(!f.flags[2].given);
}

TEST(flags_end_at_two_dashes)
{
    struct fixture f;
    set_up(&f);
    char *words[] = {"test", "--", "--json", "--help", NULL};
    REQUIRE(read_words(&f, words) == FLAGS_READY);
    CHECK_EQ(f.count, 2);
    CHECK_STR(words[0], "--json");
    CHECK(!f.json);
}

TEST(flags_suggest_the_nearest_name)
{
    struct fixture f;
    set_up(&f);
    CHECK(READ(&f, "--dpeth=3") == FLAGS_WRONG);
    CHECK_HAS(f.err.text, "did you mean --depth?");
    CHECK_HAS(f.err.where, "--dpeth");
    set_up(&f);
    CHECK(READ(&f, "--entirely-else") == FLAGS_WRONG);
    CHECK_HAS(f.err.text, "unknown flag; see --help");
    set_up(&f);
    CHECK(READ(&f, "-x") == FLAGS_WRONG);
    CHECK_HAS(f.err.text, "unknown flag");
}

TEST(flags_refuse_wrong_numbers_with_the_flags_name)
{
    static const char *const wrong[] = {
        "--depth=0",
        "--depth=15",
        "--depth=-1",
        "--depth=+3",
        "--depth=3x",
        "--depth= 3",
        "--depth=",
        "--depth=0x3",
        "--depth=3.0",
        "--depth=1e1",
        "--depth=99999999999999999999",
        "--size-m=0.49",
        "--size-m=1001",
        "--size-m=nan",
        "--size-m=inf",
        "--size-m=1e999",
        "--size-m=0x1p3",
        "--size-m= 2",
        "--size-m=2m",
        "--size-m=",
        "--size-m=-",
        "--size-m=1,5",
        "--probe=1,2",
        "--probe=1,2,3,4",
        "--probe=1,2,",
        "--probe=,,",
        "--probe=1,2,nan",
        "--probe",
        "--json=yes",
        "--output=",
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        struct fixture f;
        set_up(&f);
        char word[64];
        snprintf(word, sizeof word, "%s", wrong[i]);
        if (READ(&f, word) != FLAGS_WRONG)
            test_fail(__FILE__, __LINE__, "%s was taken", wrong[i]);
        size_t name = strcspn(wrong[i], "=");
        if (strncmp(f.err.where, wrong[i], name) != 0 || !f.err.text[0])
            test_fail(__FILE__, __LINE__, "%s: where \"%s\", text \"%s\"", wrong[i], f.err.where,
                      f.err.text);
        CHECK_EQ(f.depth, 77);
        CHECK(f.size_m == -1);
    }
}

TEST(flags_refuse_twice_and_too_many_and_too_few)
{
    struct fixture f;
    set_up(&f);
    CHECK(READ(&f, "--depth=3", "--depth", "4") == FLAGS_WRONG);
    CHECK_HAS(f.err.text, "twice");
    set_up(&f);
    CHECK(READ(&f, "a", "b", "c") == FLAGS_WRONG);
    CHECK_STR(f.err.where, "c");
    set_up(&f);
    f.set.arguments_min = 1;
    CHECK(READ(&f, "--json") == FLAGS_WRONG);
    CHECK_HAS(f.err.text, "missing");
}

TEST(flags_distance_counts_edits)
{
    CHECK_EQ(flags_distance("depth", "depth"), 0);
    CHECK_EQ(flags_distance("dpeth", "depth"), 1);
    CHECK_EQ(flags_distance("dept", "depth"), 1);
    CHECK_EQ(flags_distance("deepth", "depth"), 1);
    CHECK_EQ(flags_distance("render", "build"), 6);
    CHECK_EQ(flags_distance("", "abc"), 3);
    CHECK(flags_distance("0123456789012345678901234567890123456789", "a") > 1000);
}

TEST(flags_numbers_read_back_equal)
{
    test_random random = test_random_begin();
    for (int i = 0; i < 10000; i++) {
        char text[64];
        double value,
            expected = ldexp(test_random_unit(&random), (int)test_random_below(&random, 60));
        snprintf(text, sizeof text, "%.17g", expected);
        REQUIRE(flags_parse_f64(&value, text));
        CHECK(value == expected);
        uint64_t u64, big = test_random_u64(&random);
        snprintf(text, sizeof text, "%llu", (unsigned long long)big);
        REQUIRE(flags_parse_u64(&u64, text));
        CHECK(u64 == big);
    }
}
