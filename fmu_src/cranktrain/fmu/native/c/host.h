/* The host's side of an instance: its memory, its log. */
#ifndef CT_HOST_H
#define CT_HOST_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* What became of a call; the values are those of fmi2Status and of fmi3Status. */
typedef enum { CT_OK, CT_WARNING, CT_DISCARD, CT_ERROR } ct_result;

struct ct_host {
    /* Gives a line to the host's logger, as the host's version of FMI wants it; NULL: to stderr. */
    void (*write)(const struct ct_host *host, ct_result result, const char *category, const char *line);
    void (*logger)(void); /* the host's own, of the type that ``write`` knows */
    void *environment;    /* that the logger is given */
    void *(*allocate)(size_t count, size_t size); /* both, or the C library's */
    void (*release)(void *memory);
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

enum { CT_LONGEST_LINE = 2048 };

/* One line in the log, "NAME: ..."; the category follows from the result, OK is an event. */
void ct_log(const struct ct_host *host, ct_result result, const char *format, ...) CT_FORMAT(3, 4);

/* Log an error; returns CT_ERROR. */
ct_result ct_refuse(const struct ct_host *host, const char *format, ...) CT_FORMAT(2, 3);

/* Choose the categories that are logged; CT_ERROR where one is unknown. */
ct_result ct_choose_categories(struct ct_host *host, size_t n, const char *const categories[]);

/* The shortest text that reads as this number, with a point or an exponent: 0.0, 1e-05, nan. */
enum { CT_NUMBER = 32 };
const char *ct_number(char text[CT_NUMBER], double value);

#endif
