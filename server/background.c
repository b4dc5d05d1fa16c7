/* Small blocking work beside the loop, on libuv's pool: long bodies, and the unlinking of results.
 */
#include "server/background.h"

#include "server/http.h"

#include <stdlib.h>
#include <unistd.h>

void background_init(struct background *background, uv_loop_t *uv, struct results *results,
                     int wake_fd)
{
    *background = (struct background){.uv = uv, .results = results, .wake_fd = wake_fd};
}

/* ---- long bodies -------------------------------------------------------------------------------
 */

static void reading_free(struct reading *reading)
{
    free(reading->text);
    free(reading);
}

/* Thread: pool. */
static void reading_work(uv_work_t *work)
{
    struct reading *reading = work->data;
    reading->code = wire_job_read(&reading->job, &reading->problem, reading->text, reading->bytes);
}

static void reading_done(uv_work_t *work, int status)
{
    struct reading *reading = work->data;
    (void)status; /* nobody cancels them */
    reading->background->readings--;
    reading->done = true;
    if (!reading->request) {
        reading_free(reading);
        return;
    }
    http_resume(reading->request);
    /* Resuming alone makes no descriptor of the library readable: the loop has to look. */
    const uint64_t one = 1;
    (void)!write(reading->background->wake_fd, &one, sizeof one);
}

struct reading *background_read(struct background *background, struct http_request *request,
                                char *text, size_t bytes)
{
    if (background->readings >= BACKGROUND_READINGS_MAX)
        return NULL;
    struct reading *reading = calloc(1, sizeof *reading);
    if (!reading)
        return NULL;
    reading->work.data = reading;
    reading->background = background;
    reading->request = request;
    reading->bytes = bytes;
    reading->text = text;
    if (uv_queue_work(background->uv, &reading->work, reading_work, reading_done) != 0) {
        free(reading);
        return NULL;
    }
    background->readings++;
    return reading;
}

void background_release(struct reading **pointer)
{
    struct reading *reading = *pointer;
    if (!reading)
        return;
    reading->request = NULL;
    if (reading->done)
        reading_free(reading);
    *pointer = NULL;
}

/* ---- unlinking ---------------------------------------------------------------------------------
 */

/* Thread: pool. */
static void sweep_work(uv_work_t *work)
{
    results_sweep(((struct background *)work->data)->results);
}

static void sweep_done(uv_work_t *work, int status)
{
    struct background *background = work->data;
    (void)status;
    background->sweeping = false;
    if (background->sweep_again)
        background_sweep(background);
}

void background_sweep(struct background *background)
{
    background->sweep_again = background->sweeping;
    if (background->sweeping)
        return;
    background->sweep.data = background;
    background->sweeping =
        uv_queue_work(background->uv, &background->sweep, sweep_work, sweep_done) == 0;
}
