/* Writing jobs back: all defaults are there, and reading gives the same job. */
#include "protocol/wire.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void random_name(test_random *random, char *out)
{
    static const char letters[] =
        "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz._-";
    uint32_t bytes = 1 + test_random_below(random, WIRE_NAME_BYTES - 1);
    for (uint32_t i = 0; i < bytes; i++)
        out[i] = letters[test_random_below(random, i ? 65 : 62)];
}

/* Pieces of UTF-8 that need escapes, and some that do not. */
static void random_text(test_random *random, char *out, size_t bytes)
{
    static const char *const pieces[] = {"a",
                                         "\"",
                                         "\\",
                                         "/",
                                         "\n",
                                         "\t",
                                         "\x01",
                                         "\x7f",
                                         "\xc3\xa9",
                                         "\xe2\x82\xac",
                                         "\xf0\x9f\x98\x80",
                                         " "};
    size_t used = 0;
    while (test_random_below(random, 40)) {
        const char *piece = pieces[test_random_below(random, 12)];
        if (used + strlen(piece) >= bytes)
            return;
        memcpy(out + used, piece, strlen(piece));
        used += strlen(piece);
    }
}

static double random_number(test_random *random, double low, double high)
{
    switch (test_random_below(random, 6)) {
    case 0:
        return low;
    case 1:
        return high;
    case 2:
        return floor(low + (high - low) * test_random_unit(random));
    case 3:
        return fmin(high, ldexp(test_random_unit(random), -(int)test_random_below(random, 1100)));
    default:
        return low + (high - low) * test_random_unit(random);
    }
}

static void random_job(test_random *random, struct wire_job *job)
{
    memset(job, 0, sizeof *job);
    random_name(random, job->scene);
    random_name(random, job->lighting);
    for (int i = 0; i < 3; i++) {
        job->position_m[i] = random_number(random, -1e9, 1e9);
        job->environment_constant[i] = random_number(random, 0, 65504);
    }
    job->mode = test_random_below(random, 2) ? WIRE_MODE_LOD : WIRE_MODE_REFERENCE;
    job->face_px = 1 + test_random_below(random, 4096);
    uint32_t faces = 1 + test_random_below(random, 63);
    for (uint8_t face = 0; face < 6; face++)
        if (faces >> face & 1)
            job->faces[job->face_count++] = face;
    job->levels = test_random_below(random, 2) ? WIRE_LEVELS_FIXED : WIRE_LEVELS_CONE;
    job->samples_per_axis = 1 + test_random_below(random, 32);
    job->seed = test_random_u64(random) >> (11 + test_random_below(random, 50));
    if (test_random_below(random, 20) == 0)
        job->seed = UINT64_C(1) << 53;
    job->images[0] = test_random_below(random, 2);
    job->images[1] = test_random_below(random, 2);
    job->priority = test_random_below(random, 10);
    random_text(random, job->client_ref, sizeof job->client_ref);
}

TEST(writing_and_reading_is_the_identity)
{
    test_random random = test_random_begin();
    for (int i = 0; i < 3000; i++) {
        struct wire_job job, back;
        struct wire_problem problem;
        random_job(&random, &job);
        char *text = wire_job_write(&job);
        REQUIRE(text);
        if (wire_job_read(&back, &problem, text, strlen(text)) != WIRE_PROBLEM_NONE)
            test_fail(__FILE__, __LINE__, "%s: %s", text, problem.detail);
        else if (memcmp(&job, &back, sizeof job) != 0)
            test_fail(__FILE__, __LINE__, "not the same: %s", text);
        char *again = wire_job_write(&back);
        CHECK_STR(again, text);
        free(again);
        free(text);
    }
}

static void check_written(const char *given, const char *wanted)
{
    struct wire_job job;
    struct wire_problem problem;
    REQUIRE(wire_job_read(&job, &problem, given, strlen(given)) == WIRE_PROBLEM_NONE);
    char *text = wire_job_write(&job);
    CHECK_STR(text, wanted);
    free(text);
}

TEST(all_fields_are_written)
{
    check_written(
        "{\"mode\":\"reference\",\"scene\":\"duned\",\"probes\":[[1,2.5,-0.1]]}",
        "{\"kind\":\"render\",\"scene\":\"duned\",\"lighting\":\"albedo\",\"probes\":[[1,2.5,-0.1]]"
        ","
        "\"mode\":\"reference\",\"face_px\":64,\"faces\":[\"+X\",\"-X\",\"+Y\",\"-Y\",\"+Z\","
        "\"-Z\"],\"levels\":\"cone\",\"samples_per_axis\":4,\"environment\":{\"constant\":[0,0,0]},"
        "\"seed\":0,"
        "\"images\":[\"png\"],\"layout\":\"strip\",\"aovs\":[\"radiance\"],\"priority\":5,"
        "\"client_ref\":\"\"}");
    check_written(
        "{\"mode\":\"lod\",\"scene\":\"duned\",\"probes\":[[0,0,0]],\"images\":[\"exr\",\"png\"],"
        "\"faces\":[\"-Z\",\"-X\"],\"seed\":9007199254740992}",
        "{\"kind\":\"render\",\"scene\":\"duned\",\"lighting\":\"albedo\",\"probes\":[[0,0,0]],"
        "\"mode\":\"lod\",\"face_px\":64,\"faces\":[\"-X\",\"-Z\"],\"levels\":\"cone\","
        "\"samples_per_axis\":4,\"environment\":{\"constant\":[0,0,0]},\"seed\":9007199254740992,"
        "\"images\":[\"png\","
        "\"exr\"],\"layout\":\"strip\",\"aovs\":[\"radiance\"],\"priority\":5,\"client_ref\":"
        "\"\"}");
}
