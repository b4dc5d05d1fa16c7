/* The daemon's long-lived things, as the handlers see them. main.c owns them; the loop uses them.
 */
#ifndef SERVER_H
#define SERVER_H

#include "server/address.h"
#include "server/background.h"
#include "server/config.h"
#include "server/http.h"
#include "server/queue.h"
#include "server/records.h"
#include "server/results.h"
#include "server/scenes.h"

#define SERVER_STATS_EVERY_NS (100 * CLOCK_NS_PER_MS) /* how often the statistics are made */
#define SERVER_STALLED_NS     (60 * CLOCK_NS_PER_S)   /* without a tile while jobs wait */

enum server_phase {
    SERVER_RUNNING,
    SERVER_DRAINING,   /* running work may finish */
    SERVER_CANCELLING, /* it had its time */
    SERVER_CLOSING     /* the last answers go out */
};

/* Pointers to modules, and the few numbers that only the loop thread keeps. */
struct server {
    const struct config *config;
    const struct address *address;
    struct scenes *scenes;
    struct queue *queue;
    struct results *results;
    struct records *records;
    struct http *http;
    struct background *background;

    /* Loop only. */
    enum server_phase phase;
    uint64_t begin_ns;
    uint64_t memory_limit_bytes, memory_used_bytes; /* of admitted jobs */
    struct {
        uint64_t done, failed, cancelled, refused;
    } renders;
    uint64_t progress, progress_ns; /* when the queue last moved */
    char *stats_text;               /* owned; made at stats_ns */
    uint64_t stats_ns;
};

#endif
