/* What `lightprobe render` was asked for, shared by its two ways: on a file, through a daemon. */
#ifndef RENDER_H
#define RENDER_H

#include "clients/cli/command.h"
#include "clients/cli/reporter.h"

struct render_options {
    const char *file; /* a scene file; NULL: through `server` */
    const char *server;
    const char *request; /* the job's document: a path, "-" for standard input, NULL: only flags */
    const char *folder;  /* for the pictures and result.json; made where absent */
    /* Fields of the job; NULL or given == false: as the document or its defaults say. */
    const char *scene, *lighting, *mode, *levels, *faces, *formats;
    uint64_t face_px, samples_per_axis, seed;
    double probe_m[3], environment[3];
    bool face_px_given, samples_given, seed_given, probe_given, environment_given;
    uint64_t threads; /* 0: all processors */
    bool json, quiet;
};

/* What came out, for the summary. */
struct render_outcome {
    char *document; /* owned: free() */
    size_t document_bytes;
    struct lpc_pictures pictures;
};

/* Both render, write pictures and result.json into options->folder, and fill `*outcome` (all zero
 * before). `progress` and its reporter are running. */
LP_MUST_CHECK enum lp_code render_local(struct render_outcome *outcome,
                                        const struct render_options *options,
                                        struct lp_progress *progress, struct lp_error *err);
LP_MUST_CHECK enum lp_code render_remote(struct render_outcome *outcome,
                                         const struct render_options *options,
                                         struct lp_progress *progress, struct lp_error *err);

/* Makes the folder for results unless it is there. */
LP_MUST_CHECK enum lp_code render_make_folder(const char *folder, struct lp_error *err);
/* Writes the document to FOLDER/result.json: the last file, so its presence means all are there. */
LP_MUST_CHECK enum lp_code render_write_document(const struct render_options *options,
                                                 const char *text, size_t bytes,
                                                 struct lp_error *err);
/* Prints the outcome for people. */
LP_MUST_CHECK enum lp_code render_print_summary(const struct render_outcome *outcome,
                                                const char *folder, struct lp_error *err);

#endif
