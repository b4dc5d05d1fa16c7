/* Range headers. */
#include "server/range.h"
#include "tests/harness/test.h"

static void check_part(const char *header, uint64_t total, uint64_t first, uint64_t count)
{
    uint64_t got_first = 99, got_count = 99;
    CHECK_EQ(range_read(&got_first, &got_count, header, total), RANGE_PART);
    CHECK_EQ(got_first, first);
    CHECK_EQ(got_count, count);
}

static enum range_kind kind(const char *header, uint64_t total)
{
    uint64_t first = 0, count = 0;
    return range_read(&first, &count, header, total);
}

TEST(a_range_is_cut_to_what_there_is)
{
    check_part("bytes=0-3", 10, 0, 4);
    check_part("bytes=9-9", 10, 9, 1);
    check_part("bytes=4-", 10, 4, 6);
    check_part("bytes=4-100", 10, 4, 6);
    check_part("bytes=4-99999999999999999999999", 10, 4, 6);
    check_part("bytes=-3", 10, 7, 3);
    check_part("bytes=-30", 10, 0, 10);
    check_part("Bytes= 0-0 ", 10, 0, 1);
}

TEST(what_is_no_single_range_means_the_whole)
{
    static const char *const headers[] = {"",          "bytes",      "bytes=",        "bytes=-",
                                          "bytes=3-1", "bytes=a-b",  "bytes=1-2,3-4", "bytes=1",
                                          "lines=1-2", "bytes=1-2x", "bytes=+1-2",    "bytes=--1"};
    for (size_t i = 0; i < sizeof headers / sizeof headers[0]; i++)
        CHECK_EQ(kind(headers[i], 10), RANGE_WHOLE);
    CHECK_EQ(kind(0, 10), RANGE_WHOLE);
}

TEST(a_range_beyond_the_end_cannot_be_had)
{
    CHECK_EQ(kind("bytes=10-", 10), RANGE_UNSATISFIABLE);
    CHECK_EQ(kind("bytes=99999999999999999999999-", 10), RANGE_UNSATISFIABLE);
    CHECK_EQ(kind("bytes=-0", 10), RANGE_UNSATISFIABLE);
    CHECK_EQ(kind("bytes=0-", 0), RANGE_UNSATISFIABLE);
    CHECK_EQ(kind("bytes=-1", 0), RANGE_UNSATISFIABLE);
}
