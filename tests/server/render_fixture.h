/* A small job over a small scene, for tests of queue, records and workers. */
#ifndef LP_TEST_RENDER_FIXTURE_H
#define LP_TEST_RENDER_FIXTURE_H

#include "server/job.h"
#include "tests/engine/small_scene.h"

#include <string.h>

static inline void fixture_scene(struct small_scene *scene)
{
    test_random random = test_random_begin();
    small_scene_random(scene, 5, 0, 32, 2000, &random);
}

static inline struct job *fixture_job(const struct small_scene *scene, uint32_t face_px,
                                      uint32_t priority)
{
    struct wire_problem problem = {0};
    struct lp_render_plan plan;
    struct wire_job request = {.scene = "small",
                               .lighting = "albedo",
                               .position_m = {16.5, 16.5, 16.5},
                               .mode = WIRE_MODE_REFERENCE,
                               .face_px = face_px,
                               .face_count = 6,
                               .faces = {0, 1, 2, 3, 4, 5},
                               .samples_per_axis = 1,
                               .images = {true, true},
                               .priority = priority};
    if (bake_plan(&plan, &problem, &scene->scene, &request))
        test_abort(__FILE__, __LINE__, "no plan: %s", problem.detail);
    struct job *job = job_create(&request, &plan);
    REQUIRE(job != NULL);
    memcpy(job->wanted, request.images, sizeof job->wanted);
    return job;
}

#endif
