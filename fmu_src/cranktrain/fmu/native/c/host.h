/* Host of an instance: its memory functions and its log. */
#ifndef CT_HOST_H
#define CT_HOST_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Result of a call; the values are those of fmi2Status and of fmi3Status. */
typedef enum { CT_OK, CT_WARNING, CT_DISCARD, CT_ERROR } ct_result;

struct ct_host {
    /* Passes a line to the host's logger in the form of the host's version of FMI; NULL: to stderr. */
    void (*write)(const struct ct_host *host, ct_result result, const char *category, const char *line);
    void (*logger)(void); /* logger function of the host, cast by ``write`` to its type */
    void *environment;    /* argument of the logger */
    void *(*allocate)(size_t count, size_t size); /* allocate and release: of the host or of the C library */
    void (*release)(void *memory);
    const char *name;     /* name of the instance */
    bool logging;         /* true if events are logged as well; errors and warnings always are */
    uint32_t categories;  /* bits of the log categories chosen by the host; 0: all */
};

#ifdef __GNUC__
#define CT_FORMAT(text, values) __attribute__((format(printf, text, values)))
#else
#define CT_FORMAT(text, values)
#endif

/* Allocate zeroed memory. Return NULL if there is no memory. */
void *ct_allocate(const struct ct_host *host, size_t bytes);
void ct_release(const struct ct_host *host, void *memory);

enum { CT_LONGEST_LINE = 2048 };

/* Write one line to the log, "NAME: ..."; the result determines the category, OK is an event. */
void ct_log(const struct ct_host *host, ct_result result, const char *format, ...) CT_FORMAT(3, 4);

/* Log an error. Always return CT_ERROR. */
ct_result ct_refuse(const struct ct_host *host, const char *format, ...) CT_FORMAT(2, 3);

/* Choose the categories that are logged. Return CT_ERROR if a category is unknown. */
ct_result ct_choose_categories(struct ct_host *host, size_t n, const char *const categories[]);

/* Shortest text that reads as the same number, with a point or an exponent: 0.0, 1e-05, nan. */
enum { CT_NUMBER = 32 };
const char *ct_number(char text[CT_NUMBER], double value);

#endif
