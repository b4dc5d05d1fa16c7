/* The index of jobs: ids, expiry, room. */
#include "server/queue.h"
#include "server/records.h"
#include "tests/server/render_fixture.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#define SHA "cccccccccccccccccccccccccccccccccccccccccccccccccccccccccccccccc"

struct parts {
    int folder_fd;
    struct small_scene scene;
    struct results *results;
    struct records *records;
};

static void parts_make(struct parts *parts)
{
    REQUIRE(mkdir("results", 0700) == 0);
    parts->folder_fd = open("results", O_RDONLY | O_DIRECTORY);
    REQUIRE(results_create(&parts->results, parts->folder_fd, 1 << 20, NULL) == LP_OK);
    parts->records = records_create(parts->results, 900, 600); /* nanoseconds, here */
    REQUIRE(parts->records != NULL);
    fixture_scene(&parts->scene);
}

static void parts_finish(struct parts *parts)
{
    records_destroy(&parts->records);
    results_destroy(&parts->results);
    small_scene_finish(&parts->scene);
    close(parts->folder_fd);
}

static struct job *job_add(struct parts *parts)
{
    struct job *job = fixture_job(&parts->scene, 4, 5);
    records_name(parts->records, job);
    REQUIRE(records_add(parts->records, job));
    return job;
}

static enum record_verdict look(struct parts *parts, const char *id)
{
    struct record *record = NULL;
    return records_find(parts->records, id, &record);
}

TEST(ids_lead_to_records_and_nothing_else_does)
{
    struct parts parts;
    struct record *record = NULL;
    parts_make(&parts);
    struct job *first = job_add(&parts), *second = job_add(&parts);
    CHECK(!test_str_equal(first->id, second->id));
    REQUIRE(records_find(parts.records, second->id, &record) == RECORD_FOUND);
    CHECK(record->job == second);
    char id[WIRE_ID_BYTES + 8];
    static const char *const tails[] = {"-2", "-00", "- 0", "-+0", "-", "-18446744073709551616",
                                        "-0x"};
    for (size_t i = 0; i < sizeof tails / sizeof tails[0]; i++) {
        snprintf(id, sizeof id, "%.16s%s", first->id, tails[i]);
        CHECK_EQ(look(&parts, id), RECORD_UNKNOWN);
    }
    CHECK_EQ(look(&parts, ""), RECORD_UNKNOWN);
    CHECK_EQ(look(&parts, "0123456789abcdef-0"), RECORD_UNKNOWN); /* another run's */
    CHECK_EQ(records_live_count(parts.records), 2);
    records_remove(parts.records, second);
    CHECK_EQ(records_live_count(parts.records), 1);
    job_destroy(&first);
    job_destroy(&second);
    parts_finish(&parts);
}

/* A finished job with one file. */
static void finish(struct parts *parts, struct job *job, const char *extension, uint64_t now_ns)
{
    job->outcome = JOB_DONE;
    REQUIRE(results_put(parts->results, job->document.key, SHA, extension, "x", 1, NULL) == LP_OK);
    records_finished(parts->records, job, now_ns);
}

TEST(results_expire_and_are_remembered_as_expired)
{
    struct parts parts;
    parts_make(&parts);
    struct job *old = job_add(&parts), *young = job_add(&parts);
    finish(&parts, old, "a", 1000);
    finish(&parts, young, "b", 1500);
    CHECK_EQ(records_live_count(parts.records), 0);
    CHECK(!records_expire(parts.records, 1899));
    CHECK_EQ(look(&parts, old->id), RECORD_FOUND);
    CHECK(records_expire(parts.records, 1900)); /* a file became free */
    CHECK_EQ(look(&parts, old->id), RECORD_EXPIRED);
    CHECK_EQ(look(&parts, young->id), RECORD_FOUND);
    results_sweep(parts.results);
    CHECK_EQ(results_usage(parts.results).files, 1);
    job_destroy(&old);
    job_destroy(&young);
    parts_finish(&parts);
}

TEST(room_is_made_only_of_what_was_readable_long_enough)
{
    struct parts parts;
    parts_make(&parts);
    struct job *job = job_add(&parts);
    CHECK(!records_make_room(parts.records, 1 << 30)); /* it is at work */
    CHECK(records_room_ns(parts.records) == UINT64_MAX);
    finish(&parts, job, "a", 1000);
    CHECK_EQ(records_room_ns(parts.records), 1600);
    CHECK(!records_make_room(parts.records, 1599));
    CHECK(records_make_room(parts.records, 1600));
    CHECK(!records_make_room(parts.records, 1600));
    CHECK_EQ(look(&parts, job->id), RECORD_EXPIRED);
    job_destroy(&job);
    parts_finish(&parts);
}
