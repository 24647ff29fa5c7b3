/* Android's log, for Arm's samples: to standard error. */
#pragma once

#include <stdarg.h>
#include <stdio.h>

enum { ANDROID_LOG_DEBUG = 3, ANDROID_LOG_INFO = 4, ANDROID_LOG_ERROR = 6 };

__attribute__((format(printf, 3, 4))) static inline int __android_log_print(int priority, const char *tag, const char *format, ...) {
    va_list arguments;
    int written;
    (void)priority;
    fprintf(stderr, "%s: ", tag);
    va_start(arguments, format);
    written = vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    return written;
}
