/* The reporter's thread: polls progress, draws it, and takes SIGINT and SIGTERM. */
#include "clients/cli/reporter.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#define POLL_MS     100
#define LINE_MS     2000 /* between two lines of one phase, where there is no terminal */
#define BAR_CELLS   30
#define EXIT_SIGNAL 130

/* What was printed last; the thread's own. */
struct shown {
    const char *phase;
    uint64_t line_ms;
};

static uint64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000 + (uint64_t)now.tv_nsec / 1000000;
}

static void draw_bar(const char *phase, uint64_t done, uint64_t total)
{
    if (total == 0) {
        fprintf(stderr, "\r\033[K%s", phase);
        return;
    }
    double fraction = done >= total ? 1.0 : (double)done / (double)total;
    int filled = (int)(fraction * BAR_CELLS);
    char bar[BAR_CELLS + 1];
    for (int i = 0; i < BAR_CELLS; i++)
        bar[i] = i < filled ? '#' : '.';
    bar[BAR_CELLS] = '\0';
    fprintf(stderr, "\r\033[K%-24s [%s] %3d %%", phase, bar, (int)(fraction * 100));
}

static void print_line(const char *phase, uint64_t done, uint64_t total)
{
    if (total)
        fprintf(stderr, "%s: %llu of %llu\n", phase, (unsigned long long)done,
                (unsigned long long)total);
    else
        fprintf(stderr, "%s\n", phase);
}

static void show(const struct reporter *reporter, struct shown *shown)
{
    const char *phase = atomic_load(&reporter->progress->phase);
    uint64_t done = atomic_load(&reporter->progress->done);
    uint64_t total = atomic_load(&reporter->progress->total);
    if (reporter->style == REPORTER_QUIET || !phase)
        return;
    if (reporter->terminal) {
        draw_bar(phase, done, total);
        fflush(stderr);
    } else if (phase != shown->phase || now_ms() - shown->line_ms >= LINE_MS) {
        print_line(phase, done, total);
        shown->line_ms = now_ms();
    }
    shown->phase = phase;
}

static void take_signal(struct reporter *reporter)
{
    struct signalfd_siginfo info;
    if (read(reporter->signals, &info, sizeof info) != (ssize_t)sizeof info)
        return;
    if (atomic_exchange(&reporter->progress->cancelled, true))
        _exit(EXIT_SIGNAL); /* asked twice: whoever asks does not want to wait */
    if (reporter->style != REPORTER_QUIET)
        fprintf(stderr, "%scancelling...\n", reporter->terminal ? "\r\033[K" : "");
}

static void *thread_main(void *user)
{
    struct reporter *reporter = user;
    struct shown shown = {0};
    struct pollfd watched[] = {{.fd = reporter->stop, .events = POLLIN},
                               {.fd = reporter->signals, .events = POLLIN}};
    for (;;) {
        int ready = poll(watched, 2, POLL_MS);
        if (ready < 0 && errno != EINTR)
            break;
        if (ready > 0 && watched[0].revents)
            break;
        if (ready > 0 && watched[1].revents)
            take_signal(reporter);
        show(reporter, &shown);
    }
    if (reporter->terminal && reporter->style != REPORTER_QUIET && shown.phase)
        fputs("\r\033[K", stderr);
    return NULL;
}

enum lp_code reporter_init(struct reporter *reporter, struct lp_progress *progress,
                           enum reporter_style style, struct lp_error *err)
{
    struct reporter made = {.progress = progress, .style = style, .signals = -1, .stop = -1};
    made.terminal = isatty(STDERR_FILENO) == 1;
    sigset_t ending;
    sigemptyset(&ending);
    sigaddset(&ending, SIGINT);
    sigaddset(&ending, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &ending, &made.mask_before);
    made.signals = signalfd(-1, &ending, SFD_CLOEXEC);
    made.stop = eventfd(0, EFD_CLOEXEC);
    int refused = made.signals < 0 || made.stop < 0 ? errno : 0;
    *reporter = made;
    if (!refused)
        refused = pthread_create(&reporter->thread, NULL, thread_main, reporter);
    if (!refused) {
        pthread_setname_np(reporter->thread, "reporter");
        return LP_OK;
    }
    if (made.signals >= 0)
        close(made.signals);
    if (made.stop >= 0)
        close(made.stop);
    pthread_sigmask(SIG_SETMASK, &made.mask_before, NULL);
    return lp_fail(err, LP_NO_MEMORY, "progress", "no thread for showing progress: %s",
                   strerror(refused));
}

void reporter_finish(struct reporter *reporter)
{
    uint64_t one = 1;
    if (write(reporter->stop, &one, sizeof one) == (ssize_t)sizeof one)
        pthread_join(reporter->thread, NULL);
    close(reporter->stop);
    close(reporter->signals);
    pthread_sigmask(SIG_SETMASK, &reporter->mask_before, NULL);
}
