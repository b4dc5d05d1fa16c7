/* The wire: jobs, results, scenes and problems as structs, and their JSON.
 *
 * The protocol knows neither engine nor server: its enums are its own. One table of fields
 * (protocol/fields.c) drives reading, checking, echoing and documenting a job. Every function may
 * be called from any thread; texts that are returned are on the heap, to be given to free(), and
 * NULL means out of memory. */
#ifndef WIRE_H
#define WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define WIRE_NAME_BYTES       101 /* [A-Za-z0-9][A-Za-z0-9._-]{0,99} */
#define WIRE_ID_BYTES         65
#define WIRE_SHA256_BYTES     65 /* hex */
#define WIRE_CLIENT_REF_BYTES 257
#define WIRE_BODY_MAX         (1u << 20) /* bytes of a job's document */
#define WIRE_DEPTH_MAX        32
#define WIRE_VALUES_MAX       100000
#define WIRE_FACES            6
#define WIRE_CLASSES_MAX      8
#define WIRE_LEVELS_MAX       9
#define WIRE_WARNINGS_MAX     8
#define WIRE_IMAGES_MAX       8
#define WIRE_FIELD_ERRORS_MAX 32

/* ---- problems (RFC 9457) -----------------------------------------------------------------------
 */

/* name, slug of the type URI (/problems/<slug>), title. The server has the table of statuses. */
#define WIRE_PROBLEMS(X)                                                                           \
    X(NONE, "none", "No problem")                                                                  \
    X(BAD_REQUEST, "bad-request", "The request cannot be understood")                              \
    X(INVALID_JSON, "invalid-json", "The body is not JSON")                                        \
    X(INVALID_FIELD, "invalid-field", "A field is unknown, of the wrong type or out of range")     \
    X(FOREIGN_ORIGIN, "foreign-origin", "This host or origin may not use this service")            \
    X(UNKNOWN_ROUTE, "unknown-route", "There is nothing at this address")                          \
    X(UNKNOWN_SCENE, "unknown-scene", "There is no scene of this name")                            \
    X(UNKNOWN_JOB, "unknown-job", "There is no job of this id")                                    \
    X(UNKNOWN_IMAGE, "unknown-image", "This picture was not asked for")                            \
    X(METHOD_NOT_ALLOWED, "method-not-allowed", "This address does not know this method")          \
    X(NOT_ACCEPTABLE, "not-acceptable", "None of the accepted media types can be made")            \
    X(SCENE_NOT_READY, "scene-not-ready", "The scene cannot be rendered yet")                      \
    X(SCENE_FAILED, "scene-failed", "The scene's file is unusable")                                \
    X(CONFLICT, "conflict", "The job's state does not allow this")                                 \
    X(GONE, "gone", "The result has expired")                                                      \
    X(TOO_LARGE, "too-large", "The request is larger than this service takes")                     \
    X(OVER_LIMIT, "over-limit", "The job is larger than this service takes")                       \
    X(BUSY, "busy", "Too much is waiting already")                                                 \
    X(DRAINING, "draining", "The service is shutting down")                                        \
    X(DISK_FULL, "disk-full", "There is no space left for results")                                \
    X(INTERNAL, "internal", "The service failed")

enum wire_problem_code {
#define X(name, slug, title) WIRE_PROBLEM_##name,
    WIRE_PROBLEMS(X)
#undef X
};

struct wire_field_error {
    char pointer[160]; /* JSON pointer (RFC 6901) into the body; "" is the whole of it */
    char detail[224];  /* one sentence: what is wrong, and what would be right */
};

/* All zero: no problem. */
struct wire_problem {
    enum wire_problem_code code;
    char detail[384];
    uint32_t error_count; /* of `errors`; more offenders than fit are left out */
    struct wire_field_error errors[WIRE_FIELD_ERRORS_MAX];
};

/* Sets code and detail unless the problem is set already; returns `code`. */
enum wire_problem_code wire_problem_set(struct wire_problem *problem, enum wire_problem_code code,
                                        const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Adds an offender and makes the problem INVALID_FIELD with a detail that counts them. */
void wire_problem_field(struct wire_problem *problem, const char *pointer, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
const char *wire_problem_slug(enum wire_problem_code code);
const char *wire_problem_title(enum wire_problem_code code);
/* The application/problem+json document. `errors` only when there are some. */
char *wire_problem_write(const struct wire_problem *problem, int status, const char *request_id);

/* ---- a job -------------------------------------------------------------------------------------
 */

enum wire_kind { WIRE_KIND_RENDER };
enum wire_mode { WIRE_MODE_REFERENCE, WIRE_MODE_LOD };
enum wire_levels { WIRE_LEVELS_CONE, WIRE_LEVELS_FIXED };
enum wire_layout { WIRE_LAYOUT_STRIP };
enum wire_image { WIRE_IMAGE_PNG, WIRE_IMAGE_EXR, WIRE_IMAGE_KINDS };

/* One render of one probe, defaults filled. Faces in cubemap order +X -X +Y -Y +Z -Z: 0..5. */
struct wire_job {
    enum wire_kind kind;
    char scene[WIRE_NAME_BYTES];
    char lighting[WIRE_NAME_BYTES];
    double position_m[3]; /* the one probe of /v1/render */
    enum wire_mode mode;
    uint32_t face_px;
    uint32_t face_count;
    uint8_t faces[WIRE_FACES]; /* ascending, each once */
    enum wire_levels levels;
    uint32_t samples_per_axis;
    double environment_constant[3];
    uint64_t seed;
    bool images[WIRE_IMAGE_KINDS]; /* which formats to keep */
    enum wire_layout layout;
    uint32_t priority;
    char client_ref[WIRE_CLIENT_REF_BYTES];
};

/* Whether a name may name a scene, a lighting or an environment. */
bool wire_name_ok(const char *name);

/* Reads a job's document, strictly: RFC 8259 first (INVALID_JSON, with the place in the text), then
 * every field (INVALID_FIELD with a pointer to every offender; "not in this version" for values of
 * the contract that later versions bring). Returns WIRE_PROBLEM_NONE and fills `*job`, or the code
 * in `*problem`, `*job` untouched. `text` need not end in NUL. */
enum wire_problem_code wire_job_read(struct wire_job *job, struct wire_problem *problem,
                                     const char *text, size_t bytes);
/* The document that means the same job, all defaults written out. */
char *wire_job_write(const struct wire_job *job);

/* ---- a result ----------------------------------------------------------------------------------
 */

struct wire_class_count {
    uint32_t key; /* rays of the class, or the level */
    uint64_t pixels;
};

struct wire_counters {
    uint64_t rays, rays_hit, rays_discarded, traversal_steps, pixels, pixels_background;
    uint32_t ray_class_count, level_count;
    struct wire_class_count pixels_by_rays[WIRE_CLASSES_MAX]; /* written in this order */
    struct wire_class_count pixels_by_level[WIRE_LEVELS_MAX];
};

struct wire_image_ref {
    char href[256]; /* of the result's picture: a path on the server, or a file */
    char sha256[WIRE_SHA256_BYTES];
    uint64_t bytes;
};

struct wire_probe {
    uint32_t index;
    double position_m[3];
    uint32_t warning_count;
    char warnings[WIRE_WARNINGS_MAX][160];
    struct wire_counters counters;
    char film_sha256[WIRE_SHA256_BYTES];
    uint32_t image_count;
    struct wire_image_ref images[WIRE_IMAGES_MAX];
};

struct wire_result {
    char id[WIRE_ID_BYTES];
    char scene_sha256[WIRE_SHA256_BYTES];
    struct wire_job request;
    struct wire_probe probe;
    double queued_s, render_s, encode_s;
    char engine[32]; /* version */
    char kernel[32]; /* which traversal ran: "scalar" */
};

/* The result document of api.md: state "done", counters with the ratios rays_per_pixel and
 * rays_per_hit_pixel, totals, seconds, reproduce. Counters are integers, floats read back equal. */
char *wire_result_write(const struct wire_result *result);

/* The job document of GET /v1/jobs/{id}: id, kind, state, reason, progress. `state` and `reason`
 * are static words; `reason` may be NULL. */
struct wire_job_status {
    char id[WIRE_ID_BYTES];
    enum wire_kind kind;
    const char *state, *reason;
    uint64_t done, total, rays; /* probes, probes, rays */
};
char *wire_job_status_write(const struct wire_job_status *status);

/* ---- a scene -----------------------------------------------------------------------------------
 */

enum wire_scene_state {
    WIRE_SCENE_LOADING,
    WIRE_SCENE_IMPORTING,
    WIRE_SCENE_READY,
    WIRE_SCENE_FAILED
};

struct wire_channel {
    char name[WIRE_NAME_BYTES];
    char kind[16];     /* albedo, radiance, emission, normal */
    char encoding[16]; /* srgb8, rgb9e5, oct16 */
};

/* The fields of GET /v1/scenes/{name}. Below READY only name, state and reason are written. */
struct wire_scene {
    char name[WIRE_NAME_BYTES];
    enum wire_scene_state state;
    char reason[512]; /* FAILED: why; else why its file cannot be taken in just now; or empty */
    uint64_t voxels, nodes, bytes;
    uint32_t depth;
    char filter[16];
    double voxel_size_m;
    double bounds_min_m[3], bounds_max_m[3];
    uint32_t channel_count;
    const struct wire_channel *channels; /* lightings are those of kind albedo and radiance */
    char sha256[WIRE_SHA256_BYTES];
    uint64_t refs; /* jobs that hold the scene */
    double suggested_probe_m[3];
    double open_s; /* how long opening took; below 0: not written */
};

char *wire_scene_write(const struct wire_scene *scene);
/* {"scenes": [...]} */
char *wire_scenes_write(const struct wire_scene *scenes, size_t count);

/* ---- other documents ---------------------------------------------------------------------------
 */

/* A small JSON writer over cJSON's tree, for documents that only one place writes (statistics,
 * health): opaque nodes, numbers exact. A failed allocation anywhere makes wire_doc_end give NULL.
 */
struct wire_doc;
struct wire_doc *wire_doc_begin(void);
void wire_doc_open(struct wire_doc *doc, const char *name); /* an object inside; nesting <= 8 */
void wire_doc_close(struct wire_doc *doc);
void wire_doc_text(struct wire_doc *doc, const char *name, const char *value);
void wire_doc_u64(struct wire_doc *doc, const char *name, uint64_t value);
void wire_doc_f64(struct wire_doc *doc, const char *name, double value); /* not finite: null */
void wire_doc_bool(struct wire_doc *doc, const char *name, bool value);
char *wire_doc_end(struct wire_doc *doc); /* frees doc */

#endif
