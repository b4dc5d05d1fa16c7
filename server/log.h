/* The log: one key=value line an event, on standard error. */
#ifndef LOG_H
#define LOG_H

#include "engine/base.h"

#define LOG_LINE_BYTES 1024 /* longer lines are cut */
#define LOG_TEXT_BYTES 400

enum log_level { LOG_INFO, LOG_WARNING, LOG_ERROR };

/* A text from outside, made safe for a line: quoted, control characters escaped, cut. A value. */
struct log_text {
    char text[LOG_TEXT_BYTES];
};
struct log_text log_quote(const char *text);

/* Writes "time=... level=... event=EVENT " and the formatted pairs. Texts from outside go through
 * log_quote. A reader that does not read never stops the daemon: where the line would have to
 * wait, it is dropped. Thread: any. */
void log_event(enum log_level level, const char *event, const char *format, ...) LP_PRINTF(3, 4);

#endif
