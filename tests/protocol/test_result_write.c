/* Result and job documents: the contract's fields in its order, numbers exact. */
#include "protocol/wire.h"
#include "tests/harness/test.h"

#include <cjson/cJSON.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void example(struct wire_result *result)
{
    static const char job[] = "{\"scene\":\"room\",\"mode\":\"lod\",\"probes\":[[0.1,2,-3]],"
                              "\"images\":[\"png\"],\"seed\":7}";
    struct wire_problem problem;
    memset(result, 0, sizeof *result);
    REQUIRE(wire_job_read(&result->request, &problem, job, sizeof job - 1) == WIRE_PROBLEM_NONE);
    snprintf(result->id, sizeof result->id, "j1");
    snprintf(result->scene_sha256, sizeof result->scene_sha256, "abc");
    result->probe.position_m[0] = 0.1;
    result->probe.position_m[1] = 2;
    result->probe.position_m[2] = -3;
    result->probe.warning_count = 1;
    snprintf(result->probe.warnings[0], sizeof result->probe.warnings[0],
             "the probe is inside matter");
    result->probe.counters = (struct wire_counters){.rays = 24576,
                                                    .rays_hit = 20000,
                                                    .traversal_steps = 812345,
                                                    .pixels = 24576,
                                                    .pixels_background = 4576,
                                                    .ray_class_count = 1,
                                                    .level_count = 2,
                                                    .pixels_by_rays = {{1, 20000}},
                                                    .pixels_by_level = {{2, 15000}, {0, 5000}}};
    snprintf(result->probe.film_sha256, sizeof result->probe.film_sha256, "def");
    result->probe.image_count = 1;
    snprintf(result->probe.images[0].href, sizeof result->probe.images[0].href,
             "/v1/jobs/j1/probes/0.png");
    snprintf(result->probe.images[0].sha256, sizeof result->probe.images[0].sha256, "123");
    result->probe.images[0].bytes = 12345;
    result->queued_s = 0.001;
    result->render_s = 0.25;
    result->encode_s = 0.0020000000000000005;
    snprintf(result->engine, sizeof result->engine, "0.1.0");
    snprintf(result->kernel, sizeof result->kernel, "scalar");
}

TEST(result_document_is_the_contracts)
{
    struct wire_result result;
    example(&result);
    char *text = wire_result_write(&result);
    CHECK_STR(
        text,
        "{\"id\":\"j1\",\"kind\":\"render\",\"state\":\"done\",\"scene\":{\"name\":\"room\","
        "\"sha256\":\"abc\"},\"request\":{\"kind\":\"render\",\"scene\":\"room\",\"lighting\":"
        "\"albedo\",\"probes\":[[0.1,2,-3]],\"mode\":\"lod\",\"face_px\":64,\"faces\":[\"+X\","
        "\"-X\",\"+Y\",\"-Y\",\"+Z\",\"-Z\"],\"levels\":\"cone\",\"samples_per_axis\":4,"
        "\"environment\":{\"constant\":[0,"
        "0,0]},\"seed\":7,\"images\":[\"png\"],\"layout\":\"strip\",\"aovs\":[\"radiance\"],"
        "\"priority\":5,\"client_ref\":\"\"},\"probes\":[{\"index\":0,\"position\":[0.1,2,-3],"
        "\"warnings\":[\"the probe is inside matter\"],\"counters\":{\"rays\":24576,\"rays_hit\":"
        "20000,\"rays_discarded\":0,\"rays_per_pixel\":1,\"rays_per_hit_pixel\":1,"
        "\"traversal_steps\":812345,\"pixels\":24576,\"pixels_background\":4576,"
        "\"pixels_by_rays\":{\"1\":20000},\"pixels_by_level\":{\"2\":15000,\"0\":5000}},"
        "\"film_sha256\":\"def\",\"images\":[{\"href\":\"/v1/jobs/j1/probes/0.png\",\"sha256\":"
        "\"123\",\"bytes\":12345}]}],\"totals\":{\"rays\":24576,\"traversal_steps\":812345},"
        "\"seconds\":{\"queued\":0.001,\"render\":0.25,\"encode\":0.0020000000000000005},"
        "\"reproduce\":{\"engine\":\"0.1.0\",\"seed\":7,\"kernel\":\"scalar\"}}");
    free(text);
}

TEST(result_counters_are_exact)
{
    static const uint64_t values[] = {0, 1, 2147483648u, UINT64_C(9007199254740993),
                                      UINT64_C(18446744073709551615)};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        struct wire_result result;
        example(&result);
        result.probe.counters.rays = values[i];
        char *text = wire_result_write(&result);
        char wanted[64];
        snprintf(wanted, sizeof wanted, "\"rays\":%llu,", (unsigned long long)values[i]);
        CHECK_HAS(text, wanted);
        free(text);
    }
}

TEST(result_ratios_never_divide_by_nothing)
{
    struct wire_result result;
    example(&result);
    result.probe.counters = (struct wire_counters){.rays = 0};
    char *text = wire_result_write(&result);
    CHECK_HAS(text, "\"rays_per_pixel\":0,\"rays_per_hit_pixel\":0,");
    CHECK_HAS(text, "\"pixels_by_rays\":{},\"pixels_by_level\":{}");
    free(text);
    result.probe.counters =
        (struct wire_counters){.rays = 96, .rays_hit = 10, .pixels = 24, .pixels_background = 21};
    result.render_s = INFINITY;
    result.encode_s = NAN;
    text = wire_result_write(&result);
    CHECK_HAS(text, "\"rays_per_pixel\":4,\"rays_per_hit_pixel\":3.3333333333333335,");
    CHECK_HAS(text, "\"render\":null,\"encode\":null");
    free(text);
}

TEST(result_numbers_read_back_equal)
{
    test_random random = test_random_begin();
    for (int i = 0; i < 500; i++) {
        struct wire_result result;
        example(&result);
        for (int axis = 0; axis < 3; axis++)
            result.probe.position_m[axis] = (test_random_unit(&random) - 0.5) * 1e4;
        result.render_s = test_random_unit(&random);
        char *text = wire_result_write(&result);
        cJSON *root = cJSON_Parse(text);
        REQUIRE(root);
        const cJSON *probe =
            cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(root, "probes"), 0);
        const cJSON *position = cJSON_GetObjectItemCaseSensitive(probe, "position");
        for (int axis = 0; axis < 3; axis++)
            CHECK(cJSON_GetArrayItem(position, axis)->valuedouble == result.probe.position_m[axis]);
        const cJSON *seconds = cJSON_GetObjectItemCaseSensitive(root, "seconds");
        CHECK(cJSON_GetObjectItemCaseSensitive(seconds, "render")->valuedouble == result.render_s);
        cJSON_Delete(root);
        free(text);
    }
}

TEST(job_status_document)
{
    struct wire_job_status status = {
        .id = "j7", .state = "running", .total = 4, .done = 1, .rays = UINT64_C(9007199254740993)};
    char *text = wire_job_status_write(&status);
    CHECK_STR(text, "{\"id\":\"j7\",\"kind\":\"render\",\"state\":\"running\",\"progress\":{"
                    "\"done\":1,\"total\":4,\"fraction\":0.25,\"rays\":9007199254740993}}");
    free(text);
    status = (struct wire_job_status){.id = "j8", .state = "failed", .reason = "out of memory"};
    text = wire_job_status_write(&status);
    CHECK_STR(text, "{\"id\":\"j8\",\"kind\":\"render\",\"state\":\"failed\",\"reason\":\"out of "
                    "memory\",\"progress\":{\"done\":0,\"total\":0,\"fraction\":0,\"rays\":0}}");
    free(text);
}
