/* The queue: order, helpers, cancelling, limits; and whole renders by workers. */
#include "server/queue.h"
#include "server/clock.h"
#include "server/worker.h"
#include "tests/server/render_fixture.h"

#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <unistd.h>

static struct queue *make(uint32_t limit, int *wake_fd)
{
    *wake_fd = eventfd(0, EFD_NONBLOCK);
    struct queue *queue = queue_create(limit, *wake_fd);
    REQUIRE(queue != NULL && *wake_fd >= 0);
    return queue;
}

static bool woken(int wake_fd)
{
    uint64_t count;
    return read(wake_fd, &count, sizeof count) == sizeof count;
}

TEST(priority_then_arrival_decides)
{
    struct small_scene scene;
    int wake_fd;
    unsigned epoch;
    struct queue *queue = make(8, &wake_fd);
    fixture_scene(&scene);
    struct job *late = fixture_job(&scene, 8, 5), *early = fixture_job(&scene, 8, 5),
               *urgent = fixture_job(&scene, 8, 0);
    REQUIRE(queue_push(queue, early) && queue_push(queue, late));
    CHECK_EQ(queue_state(queue).waiting, 2);
    CHECK(queue_begin(queue, &epoch) == early);
    CHECK(!queue_is_news(queue, epoch));
    REQUIRE(queue_push(queue, urgent));
    CHECK(queue_is_news(queue, epoch)); /* so that the worker looks again after its tile */
    CHECK(!queue_end(queue, early));    /* tiles are left: nobody finishes it */
    CHECK(queue_begin(queue, &epoch) == urgent);
    CHECK(queue_phase(queue, early) == JOB_RUNNING);
    CHECK(queue_phase(queue, late) == JOB_WAITING);
    CHECK_EQ(queue_state(queue).waiting, 1);
    CHECK_EQ(queue_state(queue).running, 2);
    CHECK_EQ(queue_state(queue).busy, 1);
    CHECK(!queue_end(queue, urgent));
    queue_destroy(&queue);
    small_scene_finish(&scene);
    close(wake_fd);
}

TEST(the_last_helper_finishes)
{
    struct small_scene scene;
    int wake_fd;
    unsigned epoch;
    struct queue *queue = make(8, &wake_fd);
    fixture_scene(&scene);
    struct job *job = fixture_job(&scene, 8, 5);
    REQUIRE(queue_push(queue, job));
    CHECK(queue_begin(queue, &epoch) == job);
    CHECK(queue_begin(queue, &epoch) == job); /* a second worker helps */
    atomic_store(&job->tile_next, job->plan.tile_count);
    CHECK(!queue_end(queue, job));
    CHECK(queue_end(queue, job));
    CHECK(!woken(wake_fd));
    queue_finish(queue, job);
    CHECK(woken(wake_fd));
    CHECK(queue_take_finished(queue) == job);
    CHECK(queue_take_finished(queue) == NULL);
    CHECK_EQ(queue_state(queue).running, 0);
    CHECK_EQ(queue_state(queue).busy, 0);
    job_destroy(&job);
    queue_destroy(&queue);
    small_scene_finish(&scene);
    close(wake_fd);
}

TEST(cancelling_comes_back)
{
    struct small_scene scene;
    int wake_fd;
    unsigned epoch;
    struct queue *queue = make(8, &wake_fd);
    fixture_scene(&scene);
    struct job *waiting = fixture_job(&scene, 8, 9), *running = fixture_job(&scene, 8, 0);
    REQUIRE(queue_push(queue, waiting) && queue_push(queue, running));
    CHECK(queue_begin(queue, &epoch) == running);
    queue_cancel(queue, waiting); /* nobody works on it: at once */
    CHECK(woken(wake_fd));
    CHECK(queue_take_finished(queue) == waiting);
    CHECK_EQ(waiting->outcome, JOB_CANCELLED);
    queue_cancel(queue, running); /* its worker sees the flag */
    CHECK(!woken(wake_fd));
    CHECK(atomic_load(&running->cancelled));
    CHECK(queue_end(queue, running));
    queue_finish(queue, running);
    CHECK(queue_take_finished(queue) == running);
    CHECK_EQ(queue_state(queue).waiting + queue_state(queue).running, 0);
    job_destroy(&waiting);
    job_destroy(&running);
    queue_destroy(&queue);
    small_scene_finish(&scene);
    close(wake_fd);
}

TEST(a_begun_job_that_is_cancelled_is_freed_by_a_worker)
{
    struct small_scene scene;
    int wake_fd;
    unsigned epoch;
    struct queue *queue = make(8, &wake_fd);
    fixture_scene(&scene);
    struct job *begun = fixture_job(&scene, 8, 5), *urgent = fixture_job(&scene, 8, 0);
    REQUIRE(queue_push(queue, begun));
    CHECK(queue_begin(queue, &epoch) == begun);
    REQUIRE(queue_push(queue, urgent));
    CHECK(!queue_end(queue, begun)); /* left for the better one, its film touched */
    CHECK(queue_begin(queue, &epoch) == urgent);
    queue_cancel(queue, begun);
    queue_cancel(queue, begun); /* once more changes nothing */
    CHECK(!woken(wake_fd));
    CHECK(queue_take_finished(queue) == NULL);
    CHECK(queue_is_news(queue, epoch)); /* so that a worker looks soon */
    CHECK(!queue_end(queue, urgent));
    CHECK(queue_begin(queue, &epoch) == begun); /* before the better one: it takes memory */
    CHECK(queue_end(queue, begun));
    worker_finish(begun, queue, NULL);
    queue_finish(queue, begun);
    CHECK(woken(wake_fd));
    CHECK(queue_take_finished(queue) == begun);
    CHECK_EQ(begun->outcome, JOB_CANCELLED);
    CHECK(begun->film_memory == NULL);
    CHECK(queue_begin(queue, &epoch) == urgent);
    CHECK(!queue_end(queue, urgent));
    queue_cancel(queue, urgent); /* nobody comes for it: it goes with the queue */
    job_destroy(&begun);
    queue_destroy(&queue);
    small_scene_finish(&scene);
    close(wake_fd);
}

TEST(jobs_leave_from_anywhere_and_the_rest_keeps_its_order)
{
    enum { COUNT = 6 };
    struct small_scene scene;
    int wake_fd;
    unsigned epoch;
    struct queue *queue = make(COUNT, &wake_fd);
    struct job *jobs[COUNT];
    fixture_scene(&scene);
    for (int i = 0; i < COUNT; i++) {
        jobs[i] = fixture_job(&scene, 4, i == 3 ? 9 : 5);
        REQUIRE(queue_push(queue, jobs[i]));
    }
    static const int leaving[] = {2, 0, 5}; /* the middle, the first, the last of priority 5 */
    for (int i = 0; i < 3; i++) {
        queue_cancel(queue, jobs[leaving[i]]);
        CHECK(queue_take_finished(queue) == jobs[leaving[i]]);
        job_destroy(&jobs[leaving[i]]);
    }
    jobs[0] = fixture_job(&scene, 4, 5);
    REQUIRE(queue_push(queue, jobs[0]));
    static const int order[] = {1, 4, 0, 3};
    for (int i = 0; i < 4; i++) {
        struct job *job = jobs[order[i]];
        CHECK(queue_begin(queue, &epoch) == job);
        atomic_store(&job->tile_next, job->plan.tile_count);
        CHECK(queue_end(queue, job));
        queue_finish(queue, job);
    }
    CHECK_EQ(queue_state(queue).waiting + queue_state(queue).running, 0);
    queue_destroy(&queue); /* with the finished ones inside */
    small_scene_finish(&scene);
    close(wake_fd);
}

TEST(a_full_queue_refuses)
{
    struct small_scene scene;
    int wake_fd;
    struct queue *queue = make(1, &wake_fd);
    fixture_scene(&scene);
    struct job *first = fixture_job(&scene, 8, 5), *second = fixture_job(&scene, 8, 0);
    CHECK(queue_push(queue, first));
    CHECK(!queue_push(queue, second));
    job_destroy(&second);
    queue_destroy(&queue); /* with a job inside */
    small_scene_finish(&scene);
    close(wake_fd);
}

/* Renders `job` with `count` workers and gives it back. */
static void render(struct job *job, uint32_t count, int folder_fd)
{
    int wake_fd;
    struct queue *queue = make(8, &wake_fd);
    struct results *results = NULL;
    struct workers *workers = NULL;
    job->accepted_ns = clock_ns();
    REQUIRE(results_create(&results, folder_fd, 64 << 20, NULL) == LP_OK);
    REQUIRE(workers_start(&workers, count, queue, results, NULL) == LP_OK);
    REQUIRE(queue_push(queue, job));
    struct pollfd wake = {.fd = wake_fd, .events = POLLIN};
    REQUIRE(poll(&wake, 1, 60000) == 1);
    CHECK(queue_take_finished(queue) == job);
    queue_stop(queue);
    CHECK(workers_join(&workers, clock_ns() + 60 * CLOCK_NS_PER_S));
    CHECK_EQ(queue_state(queue).rays, job->counters.rays);
    results_destroy(&results);
    queue_destroy(&queue);
    close(wake_fd);
}

TEST(workers_make_the_same_result_in_any_number)
{
    struct small_scene scene;
    fixture_scene(&scene);
    REQUIRE(mkdir("results", 0700) == 0);
    int folder_fd = open("results", O_RDONLY | O_DIRECTORY);
    struct job *one = fixture_job(&scene, 70, 5), *four = fixture_job(&scene, 70, 5);
    render(one, 1, folder_fd);
    render(four, 4, folder_fd);
    CHECK_EQ(one->outcome, JOB_DONE);
    CHECK_EQ(four->outcome, JOB_DONE);
    CHECK_EQ(one->counters.rays, 70 * 70 * 6);
    CHECK_EQ(one->counters.traversal_steps, four->counters.traversal_steps);
    for (int i = 0; i < WIRE_IMAGE_KINDS; i++) {
        CHECK(one->pictures[i].bytes > 0);
        CHECK_STR(one->pictures[i].sha256, four->pictures[i].sha256);
    }
    CHECK(one->film_memory == NULL); /* given back as soon as the pictures are made */
    CHECK_HAS(one->document_text, "\"film_sha256\"");
    job_destroy(&one);
    job_destroy(&four);
    small_scene_finish(&scene);
    close(folder_fd);
}

TEST(a_disk_that_fails_fails_the_job_and_keeps_nothing)
{
    struct small_scene scene;
    fixture_scene(&scene);
    REQUIRE(mkdir("results", 0700) == 0);
    int folder_fd = open("results", O_RDONLY | O_DIRECTORY);
    struct job *job = fixture_job(&scene, 8, 5);
    REQUIRE(rmdir("results") == 0);
    struct results *results = NULL;
    int wake_fd;
    struct queue *queue = make(8, &wake_fd);
    unsigned epoch;
    /* The folder's descriptor still reads, so the table can be made; writing cannot work. */
    REQUIRE(results_create(&results, folder_fd, 1 << 20, NULL) == LP_OK);
    REQUIRE(queue_push(queue, job) && queue_begin(queue, &epoch) == job);
    for (uint32_t tile = 0; tile < job->plan.tile_count; tile++)
        lp_render_tile(&job->film, &job->tile_counters[tile], &job->plan, tile);
    worker_finish(job, queue, results);
    CHECK_EQ(job->outcome, JOB_FAILED);
    CHECK_EQ(job->failure, WIRE_PROBLEM_INTERNAL);
    CHECK(job->failure_text[0] != 0);
    CHECK(job->document.key[0] == 0 && job->pictures[0].key[0] == 0);
    CHECK_EQ(results_usage(results).files, 0);
    queue_destroy(&queue);
    results_destroy(&results);
    small_scene_finish(&scene);
    close(folder_fd);
    close(wake_fd);
}
