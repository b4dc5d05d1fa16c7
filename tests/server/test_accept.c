/* Content negotiation. */
#include "server/accept.h"
#include "tests/harness/test.h"

static const char *const offers[] = {"application/json", "image/png", "image/x-exr"};

static int choose(const char *first, const char *second)
{
    struct accept_choice choice = {0};
    if (first)
        accept_header(&choice, first, offers, 3);
    if (second)
        accept_header(&choice, second, offers, 3);
    return accept_best(&choice, 3);
}

TEST(no_header_means_the_first_offer)
{
    CHECK_EQ(choose(NULL, NULL), 0);
    CHECK_EQ(choose("*/*", NULL), 0);
}

TEST(no_readable_range_means_the_first_offer)
{
    CHECK_EQ(choose("", NULL), 0);
    CHECK_EQ(choose(" ,\t, ;q=0", NULL), 0);
    CHECK_EQ(choose("json", NULL), 0);
    CHECK_EQ(choose("/, image/, /png", NULL), 0);
    CHECK_EQ(choose("", "image/png"), 1); /* the other header has one */
}

TEST(quality_decides)
{
    CHECK_EQ(choose("image/png", NULL), 1);
    CHECK_EQ(choose("image/png;q=0.5, image/x-exr;q=0.6", NULL), 2);
    CHECK_EQ(choose("application/json;q=0.2,image/*;q=0.9", NULL), 1);
    CHECK_EQ(choose("*/*;q=0.1, image/x-exr", NULL), 2);
    CHECK_EQ(choose("IMAGE/PNG", NULL), 1);
    CHECK_EQ(choose("image/gif", "image/png"), 1); /* two headers are one list */
    CHECK_EQ(choose("image/png;q=0.001", NULL), 1);
}

TEST(the_most_specific_range_decides_about_a_type)
{
    CHECK_EQ(choose("*/*, application/json;q=0", NULL), 1);
    CHECK_EQ(choose("image/*, image/png;q=0", NULL), 2);
    CHECK_EQ(choose("image/png;q=0, image/png", NULL), 1); /* of equals the kindest */
}

TEST(nothing_acceptable)
{
    CHECK_EQ(choose("text/html", NULL), -1);
    CHECK_EQ(choose("image/png;q=0", NULL), -1);
    CHECK_EQ(choose("image/png;q=0.000", NULL), -1);
    CHECK_EQ(choose("image/pngx, application/jsonx, image", NULL), -1);
}

TEST(rubbish_is_passed_over)
{
    CHECK_EQ(choose(";;;,,,=;q, ,image/png", NULL), 1);
    CHECK_EQ(choose("image/png;", NULL), 1);
    CHECK_EQ(choose("image/png ; q=1 ; x", NULL), 1);
    CHECK_EQ(choose("image/png;q=2", NULL), -1);
    CHECK_EQ(choose("image/png;q=", NULL), -1);
    CHECK_EQ(choose("json, text/html", NULL), -1);
}
