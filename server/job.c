/* One job in the making: what was asked, what was admitted for it, and what came out. */
#include "server/job.h"

#include "engine/image.h"

#include <stdlib.h>
#include <string.h>

#define JOB_FILM_ALIGN     64
#define JOB_DOCUMENT_BYTES (32u << 10) /* bound of a result document */
#define JOB_PICTURE_EXTRA  (64u << 10) /* headers, and what compression may add */

struct job *job_create(const struct wire_job *request, const struct lp_render_plan *plan)
{
    size_t film_bytes;
    struct job *job = calloc(1, sizeof *job);
    if (!job)
        return NULL;
    job->request = *request;
    job->plan = *plan;
    job->plan.params.lighting = job->request.lighting; /* ours lives as long as the plan */
    if (!lp_size_add(plan->film_bytes, JOB_FILM_ALIGN - 1, &film_bytes))
        goto fail;
    film_bytes &= ~(size_t)(JOB_FILM_ALIGN - 1);
    job->film_memory = aligned_alloc(JOB_FILM_ALIGN, film_bytes);
    job->tile_counters = calloc(plan->tile_count, sizeof *job->tile_counters);
    if (!job->film_memory || !job->tile_counters)
        goto fail;
    lp_film_init(&job->film, &job->plan, job->film_memory);
    return job;
fail:
    job_destroy(&job);
    return NULL;
}

void job_film_release(struct job *job)
{
    free(job->film_memory);
    free(job->tile_counters);
    job->film_memory = NULL;
    job->tile_counters = NULL;
}

void job_destroy(struct job **pointer)
{
    struct job *job = *pointer;
    if (!job)
        return;
    job_film_release(job);
    free(job->document_text);
    free(job);
    *pointer = NULL;
}

uint64_t job_results_bytes_max(const struct lp_render_plan *plan,
                               const bool wanted[WIRE_IMAGE_KINDS])
{
    /* At most 6 * 4096^2 texels: nothing here can overflow 64 bits. */
    uint64_t texels =
        (uint64_t)plan->params.face_count * plan->params.face_px * plan->params.face_px;
    uint64_t bytes = JOB_DOCUMENT_BYTES;
    if (wanted[WIRE_IMAGE_PNG])
        bytes += 3 * texels + texels / 8 + JOB_PICTURE_EXTRA;
    if (wanted[WIRE_IMAGE_EXR])
        bytes += 12 * texels + texels / 8 + JOB_PICTURE_EXTRA;
    return bytes;
}

static enum lp_image_format format_of(enum wire_image image)
{
    return image == WIRE_IMAGE_EXR ? LP_IMAGE_EXR : LP_IMAGE_PNG;
}

const char *job_image_extension(enum wire_image image)
{
    return lp_image_extension(format_of(image));
}

const char *job_image_media_type(enum wire_image image)
{
    return lp_image_media_type(format_of(image));
}
