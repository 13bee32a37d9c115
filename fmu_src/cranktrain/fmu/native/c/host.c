#include "host.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SIGNIFICANT = 17 };

static const char CATEGORIES[][20] = {"logEvents",      "logStatusWarning", "logStatusDiscard",
                                      "logStatusError", "logStatusFatal",   "logAll"};
enum { ALL = 5, N_CATEGORIES = 6 };

void *ct_allocate(const struct ct_host *host, size_t bytes) {
    if (host->allocate == NULL || host->release == NULL) return calloc(1, bytes);
    void *memory = host->allocate(1, bytes);
    if (memory != NULL) memset(memory, 0, bytes); /* the standard requires zeros, which not every host provides */
    return memory;
}

void ct_release(const struct ct_host *host, void *memory) {
    if (memory == NULL) return;
    if (host->allocate == NULL || host->release == NULL) {
        free(memory);
    } else {
        host->release(memory);
    }
}

static bool wanted(const struct ct_host *host, ct_result result) {
    if (result == CT_OK && !host->logging) return false;
    return !host->logging || host->categories == 0 || (host->categories & (1u << result | 1u << ALL)) != 0;
}

static void log_line(const struct ct_host *host, ct_result result, const char *format, va_list values) {
    char line[CT_LONGEST_LINE];
    if (!wanted(host, result)) return;
    const int head = snprintf(line, sizeof line, "%s: ", host->name);
    if (head > 0 && (size_t)head < sizeof line) vsnprintf(line + head, sizeof line - (size_t)head, format, values);
    for (char *c = line; *c != '\0'; ++c) {
        if ((unsigned char)*c < ' ') *c = ' '; /* keep the message on one line */
    }
    if (host->write == NULL) {
        fprintf(stderr, "cranktrain: %s\n", line);
    } else {
        host->write(host, result, CATEGORIES[result], line);
    }
}

void ct_log(const struct ct_host *host, ct_result result, const char *format, ...) {
    va_list values;
    va_start(values, format);
    log_line(host, result, format, values);
    va_end(values);
}

ct_result ct_refuse(const struct ct_host *host, const char *format, ...) {
    va_list values;
    va_start(values, format);
    log_line(host, CT_ERROR, format, values);
    va_end(values);
    return CT_ERROR;
}

ct_result ct_choose_categories(struct ct_host *host, size_t n, const char *const categories[]) {
    uint32_t chosen = 0;
    if (n > 0 && categories == NULL) return ct_refuse(host, "setDebugLogging without the names of its categories");
    for (size_t i = 0; i < n; ++i) {
        uint32_t k = 0;
        while (k < N_CATEGORIES && (categories[i] == NULL || strcmp(categories[i], CATEGORIES[k]) != 0)) ++k;
        if (k == N_CATEGORIES) {
            return ct_refuse(host,
                             "no log category '%s'; valid: logEvents, logStatusWarning, logStatusDiscard, "
                             "logStatusError, logStatusFatal, logAll",
                             categories[i] == NULL ? "" : categories[i]);
        }
        chosen |= 1u << k;
    }
    host->categories = chosen;
    return CT_OK;
}

const char *ct_number(char text[CT_NUMBER], double value) {
    const double size = fabs(value);
    if (isnan(value)) return "nan";
    if (isinf(value)) return value > 0.0 ? "inf" : "-inf";
    for (int digits = 1; digits <= SIGNIFICANT; ++digits) {
        snprintf(text, CT_NUMBER, "%.*g", digits, value);
        if (strtod(text, NULL) == value) break;
    }
    if (strchr(text, 'e') != NULL && size >= 1.0 && size < 1e16) snprintf(text, CT_NUMBER, "%.1f", value);
    for (char *c = text; *c != '\0'; ++c) {
        if (*c == ',') *c = '.'; /* comma of the host's locale */
    }
    if (strpbrk(text, ".e") == NULL) strcat(text, ".0");
    return text;
}
