/* The log: one key=value line an event, on standard error. */
#include "server/log.h"

#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

struct log_text log_quote(const char *text)
{
    static const char hex[] = "0123456789abcdef";
    struct log_text out;
    size_t n = 0;
    out.text[n++] = '"';
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        if (n + 6 > sizeof out.text)
            break;
        if (c == '"' || c == '\\') {
            out.text[n++] = '\\';
            out.text[n++] = (char)c;
        } else if (c < 0x20 || c == 0x7f) {
            out.text[n++] = '\\';
            out.text[n++] = 'x';
            out.text[n++] = hex[c >> 4];
            out.text[n++] = hex[c & 15];
        } else {
            out.text[n++] = (char)c;
        }
    }
    out.text[n++] = '"';
    out.text[n] = 0;
    return out;
}

void log_event(enum log_level level, const char *event, const char *format, ...)
{
    static const char *const words[] = {"info", "warning", "error"};
    char line[LOG_LINE_BYTES];
    struct timespec now;
    struct tm utc;
    clock_gettime(CLOCK_REALTIME, &now);
    gmtime_r(&now.tv_sec, &utc);
    size_t n = strftime(line, sizeof line, "time=%Y-%m-%dT%H:%M:%S", &utc);
    int got = snprintf(line + n, sizeof line - n, ".%03ldZ level=%s event=%s ",
                       now.tv_nsec / 1000000, words[level], event);
    n += got > 0 ? (size_t)got : 0;
    if (n > sizeof line - 2)
        n = sizeof line - 2;
    va_list list;
    va_start(list, format);
    got = vsnprintf(line + n, sizeof line - n, format, list);
    va_end(list);
    n += got > 0 ? (size_t)got : 0;
    if (n > sizeof line - 2)
        n = sizeof line - 2;
    line[n++] = '\n';
    /* A pipe that polls as writable takes PIPE_BUF bytes without waiting, and a line is shorter. */
    struct pollfd ready = {.fd = STDERR_FILENO, .events = POLLOUT};
    if (poll(&ready, 1, 0) == 1 && (ready.revents & POLLOUT))
        (void)!write(STDERR_FILENO, line, n);
}
