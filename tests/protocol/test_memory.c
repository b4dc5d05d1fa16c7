/* Every allocation of readers and writers fails once: NULL or a problem, no leak, no crash. */
#include "protocol/wire.h"
#include "tests/harness/test.h"

#include <cjson/cJSON.h>

#include <stdlib.h>
#include <string.h>

/* The allocator of this process's cJSON (a test runs in a process of its own). */
static long left;  /* allocations that still succeed */
static long alive; /* blocks that are not freed yet */

static void *limited_malloc(size_t bytes)
{
    if (left == 0)
        return NULL;
    left--;
    void *block = malloc(bytes);
    alive += block != NULL;
    return block;
}

static void counted_free(void *block)
{
    alive -= block != NULL;
    free(block);
}

static const char job_text[] =
    "{\"scene\":\"room\",\"mode\":\"lod\",\"probes\":[[0.1,2,-3]],\"faces\":[\"-Z\",\"+X\"],"
    "\"environment\":{\"constant\":[1,2,3]},\"client_ref\":\"x\"}";

static struct wire_result result;
static struct wire_scene scene;
static struct wire_problem problem;
static const struct wire_channel channels[] = {{"albedo", "albedo", "srgb8"},
                                               {"noon", "radiance", "rgb9e5"}};

static void prepare(void)
{
    REQUIRE(wire_job_read(&result.request, &problem, job_text, sizeof job_text - 1) ==
            WIRE_PROBLEM_NONE);
    result.probe.warning_count = 2;
    result.probe.image_count = 2;
    result.probe.counters.ray_class_count = result.probe.counters.level_count = 3;
    scene = (struct wire_scene){
        .name = "room", .state = WIRE_SCENE_READY, .channel_count = 2, .channels = channels};
    wire_problem_field(&problem, "/a", "x");
    wire_problem_field(&problem, "/b", "y");
    cJSON_InitHooks(&(cJSON_Hooks){limited_malloc, counted_free});
}

static char *write_job(void)
{
    return wire_job_write(&result.request);
}

static char *write_result(void)
{
    return wire_result_write(&result);
}

static char *write_status(void)
{
    return wire_job_status_write(
        &(struct wire_job_status){.id = "j", .state = "failed", .reason = "why", .total = 1});
}

static char *write_scene(void)
{
    return wire_scene_write(&scene);
}

static char *write_scenes(void)
{
    struct wire_scene scenes[2] = {scene, scene};
    return wire_scenes_write(scenes, 2);
}

static char *write_problem(void)
{
    return wire_problem_write(&problem, 422, "r");
}

static char *write_doc(void)
{
    struct wire_doc *doc = wire_doc_begin();
    wire_doc_open(doc, "in");
    wire_doc_text(doc, "a", "b\xff");
    wire_doc_f64(doc, "c", 0.5);
    wire_doc_close(doc);
    wire_doc_u64(doc, "d", 1);
    wire_doc_bool(doc, "e", true);
    return wire_doc_end(doc);
}

static void fail_each(char *(*write)(void))
{
    for (long n = 0; n < 100000; n++) {
        left = n;
        alive = 0;
        char *text = write();
        if (text) {
            CHECK_EQ(alive, 1); /* the text itself */
            CHECK(n > 5);       /* it did fail some times before */
            left = 100000;
            cJSON *root = cJSON_Parse(text);
            CHECK(root != NULL);
            cJSON_Delete(root);
            free(text);
            return;
        }
        CHECK_EQ(alive, 0);
    }
    test_fail(__FILE__, __LINE__, "it never succeeded");
}

TEST(writers_survive_the_nth_allocation_failing)
{
    prepare();
    fail_each(write_job);
    fail_each(write_result);
    fail_each(write_status);
    fail_each(write_scene);
    fail_each(write_scenes);
    fail_each(write_problem);
    fail_each(write_doc);
}

TEST(job_read_survives_the_nth_allocation_failing)
{
    struct wire_job wanted;
    prepare();
    left = 100000;
    REQUIRE(wire_job_read(&wanted, &problem, job_text, sizeof job_text - 1) == WIRE_PROBLEM_NONE);
    for (long n = 0; n < 100000; n++) {
        struct wire_job job, untouched;
        memset(&job, 0x5a, sizeof job);
        untouched = job;
        left = n;
        alive = 0;
        enum wire_problem_code code = wire_job_read(&job, &problem, job_text, sizeof job_text - 1);
        CHECK_EQ(alive, 0);
        if (code == WIRE_PROBLEM_NONE) {
            CHECK(memcmp(&job, &wanted, sizeof job) == 0);
            CHECK(n > 20);
            return;
        }
        CHECK_EQ(code, WIRE_PROBLEM_INTERNAL);
        CHECK_HAS(problem.detail, "no memory");
        CHECK(memcmp(&job, &untouched, sizeof job) == 0);
    }
    test_fail(__FILE__, __LINE__, "it never succeeded");
}
