/* The host's side of an instance: its memory, its log. */
#ifndef CT_HOST_H
#define CT_HOST_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "fmi2.h"

struct ct_host {
    fmi2CallbackFunctions functions;
    const char *name;     /* of the instance */
    bool logging;         /* whether events are logged as well; what goes wrong always is */
    uint32_t categories;  /* bits of those that the host has chosen; 0: all */
};

#ifdef __GNUC__
#define CT_FORMAT(text, values) __attribute__((format(printf, text, values)))
#else
#define CT_FORMAT(text, values)
#endif

/* Zeroed memory, NULL where there is none. */
void *ct_allocate(const struct ct_host *host, size_t bytes);
void ct_release(const struct ct_host *host, void *memory);

/* One line in the log, "NAME: ..."; the category follows from the status, OK is an event. */
void ct_log(const struct ct_host *host, fmi2Status status, const char *format, ...) CT_FORMAT(3, 4);

/* Log an error; returns fmi2Error. */
fmi2Status ct_refuse(const struct ct_host *host, const char *format, ...) CT_FORMAT(2, 3);

/* Choose the categories that are logged; fmi2Error where one is unknown. */
fmi2Status ct_choose_categories(struct ct_host *host, size_t n, const fmi2String categories[]);

/* The shortest text that reads as this number, with a point or an exponent: 0.0, 1e-05, nan. */
enum { CT_NUMBER = 32 };
const char *ct_number(char text[CT_NUMBER], double value);

#endif
