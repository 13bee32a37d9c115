/* Getting and setting variables: allowed variables, phases and bounds. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "instance.h"

enum { REALS = 1 << CT_REAL, INTEGERS = 1 << CT_INTEGER | 1 << CT_ENUMERATION, BOOLEANS = 1 << CT_BOOLEAN,
       STRINGS = 1 << CT_STRING, LONGEST_LIST = 512 };

static const char *type_name(unsigned types) {
    return types == REALS ? "Real" : types == INTEGERS ? "Integer" : types == BOOLEANS ? "Boolean" : "String";
}

ct_result ct_check_references(const struct ct_instance *one, unsigned types, const uint32_t *references, size_t n,
                               const void *values) {
    if (n == 0) return CT_OK;
    if (references == NULL || values == NULL) {
        return ct_refuse(&one->host, "%s values without an array of them, or of their references", type_name(types));
    }
    if (n > one->n_variables) {
        return ct_refuse(&one->host, "%.9g %s values at once; the FMU has %u variables", (double)n, type_name(types),
                         one->n_variables);
    }
    for (size_t i = 0; i < n; ++i) {
        const uint32_t reference = references[i];
        if (reference >= one->n_variables) {
            return ct_refuse(&one->host, "value reference %u is unknown, no %s; see modelDescription.xml", reference,
                             type_name(types));
        }
        if ((types >> one->file.variables[reference].type & 1u) == 0) {
            return ct_refuse(&one->host, "value reference %u is '%s', no %s; see modelDescription.xml", reference,
                             ct_name_of(one, reference), type_name(types));
        }
    }
    return CT_OK;
}

/* ---------------------------------------------------------------- getting */

static bool is_output(const struct ct_variable *variable) {
    return variable->causality == CT_OUTPUT && variable->index != CT_NONE;
}

/* Have the families of these outputs computed from now on. Return true if a family was not computed before. */
static bool want_families(struct ct_instance *one, const uint32_t *references, size_t n) {
    bool more = false;
    for (size_t i = 0; i < n; ++i) {
        const struct ct_variable *variable = one->file.variables + references[i];
        if (!is_output(variable)) continue;
        for (uint32_t k = 0; k < variable->n_families; ++k) {
            const uint32_t family = one->file.families[variable->first_family + k];
            int64_t *wanted = one->model.families + family * one->model.columns + CT_WANTED;
            more = more || *wanted == 0;
            *wanted = 1;
        }
    }
    return more;
}

ct_result ct_observe_outputs(struct ct_instance *one, const uint32_t *references, size_t n) {
    bool outputs = false;
    enum ct_status_kind kind;
    for (size_t i = 0; i < n; ++i) outputs = outputs || is_output(one->file.variables + references[i]);
    if (!outputs) return CT_OK;
    if (!one->made) {
        ct_keep_origin(one);
        if (ct_make(one) != CT_OK) return CT_ERROR;
    }
    if (want_families(one, references, n) || !one->model.observed) {
        const int64_t status = one->file.kernels->observe(one->model.run, 0.0);
        if (status != 0) return ct_refuse(&one->host, "no outputs: %s", ct_status_text(&one->file, status, &kind));
        one->model.observed = true;
    }
    return CT_OK;
}

/* Make variables readable at their addresses; outputs are computed by the model, after a start if necessary. */
static ct_result make_ready(struct ct_instance *one, unsigned types, const uint32_t *references, size_t n,
                             const void *values) {
    if (ct_check_references(one, types, references, n, values) != CT_OK) return CT_ERROR;
    if (ct_observe_outputs(one, references, n) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n && types == REALS; ++i) one->ready[references[i]] = 1;
    return CT_OK;
}

ct_result ct_get_reals(struct ct_instance *one, const uint32_t *references, size_t n, double *values) {
    bool ready = references != NULL && values != NULL && n <= one->n_variables;
    for (size_t i = 0; ready && i < n; ++i) {
        ready = references[i] < one->n_variables && one->ready[references[i]] != 0;
        if (ready) values[i] = *one->places[references[i]];
    }
    if (ready) return CT_OK;
    if (make_ready(one, REALS, references, n, values) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n; ++i) values[i] = *one->places[references[i]];
    return CT_OK;
}

ct_result ct_get_integers(struct ct_instance *one, const uint32_t *references, size_t n, int *values) {
    if (make_ready(one, INTEGERS, references, n, values) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n; ++i) {
        const double value = nearbyint(*one->places[references[i]]);
        const bool option = one->file.variables[references[i]].type == CT_ENUMERATION;
        values[i] = fabs(value) <= 2147483647.0 ? (int)value + option : 0;
    }
    return CT_OK;
}

ct_result ct_get_booleans(struct ct_instance *one, const uint32_t *references, size_t n, int *values) {
    if (make_ready(one, BOOLEANS, references, n, values) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n; ++i) values[i] = *one->places[references[i]] != 0.0;
    return CT_OK;
}

/* Options of a String or Enumeration parameter. */
static const struct ct_option *options_of(const struct ct_instance *one, uint32_t reference, uint32_t *n) {
    const struct ct_variable *variable = one->file.variables + reference;
    *n = 0;
    if (variable->index == CT_NONE) return NULL;
    *n = one->file.choices[variable->index].n_options;
    return one->file.options + one->file.choices[variable->index].first_option;
}

ct_result ct_get_strings(struct ct_instance *one, const uint32_t *references, size_t n, const char **values) {
    uint32_t n_options;
    if (make_ready(one, STRINGS, references, n, values) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n; ++i) {
        const struct ct_option *options = options_of(one, references[i], &n_options);
        const uint32_t text = options == NULL ? one->file.variables[references[i]].start_text
                                              : options[(uint32_t)one->values[references[i]]].text;
        values[i] = ct_text(&one->file, text);
    }
    return CT_OK;
}

/* ---------------------------------------------------------------- setting */

/* Refuse to set outputs, and parameters after the initialization. Inputs may be set at any time. */
static ct_result check_settable(const struct ct_instance *one, unsigned types, const uint32_t *references, size_t n,
                                 const void *values) {
    if (ct_check_references(one, types, references, n, values) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n; ++i) {
        const uint8_t causality = one->file.variables[references[i]].causality;
        if (causality == CT_PARAMETER && one->now->phase >= CT_STEPPED) {
            return ct_refuse(&one->host, "parameter '%s' is fixed after initialization; reset the instance, then set it",
                             ct_name_of(one, references[i]));
        }
        if (causality != CT_PARAMETER && causality != CT_INPUT) {
            return ct_refuse(&one->host, "'%s' is an output and cannot be set", ct_name_of(one, references[i]));
        }
    }
    return CT_OK;
}

static ct_result check_number(const struct ct_instance *one, uint32_t reference, double value) {
    const struct ct_variable *variable = one->file.variables + reference;
    const bool bounded = variable->max < DBL_MAX, based = variable->min > -DBL_MAX;
    char text[CT_NUMBER], span[LONGEST_LIST] = "";
    if (isfinite(value) && variable->min <= value && value <= variable->max) return CT_OK;
    if (bounded && based) snprintf(span, sizeof span, ", between %g and %g", variable->min, variable->max);
    if (based && !bounded) snprintf(span, sizeof span, ", at least %g", variable->min);
    if (bounded && !based) snprintf(span, sizeof span, ", at most %g", variable->max);
    return ct_refuse(&one->host, "'%s' is %s at time %.9g s; it must be a finite number%s", ct_name_of(one, reference),
                     ct_number(text, value), ct_time(one), span);
}

/* Note that values were set. In initialization mode the start must then be computed again. */
static ct_result have_set(struct ct_instance *one) {
    if (one->now->phase == CT_INITIALIZING && one->made) {
        one->made = false;
        ct_forget_outputs(one);
    }
    return CT_OK;
}

/* True if all references are Real inputs with values within their bounds, as in most calls of a master. */
static bool are_sound_inputs(const struct ct_instance *one, const uint32_t *references, size_t n, const double *values) {
    bool sound = references != NULL && values != NULL && n <= one->n_variables;
    for (size_t i = 0; sound && i < n; ++i) {
        if (references[i] >= one->n_variables) return false;
        const struct ct_variable *variable = one->file.variables + references[i];
        sound = variable->type == CT_REAL && variable->causality == CT_INPUT && variable->min <= values[i] &&
                values[i] <= variable->max;
    }
    return sound;
}

ct_result ct_set_reals(struct ct_instance *one, const uint32_t *references, size_t n, const double *values) {
    const bool sound = are_sound_inputs(one, references, n, values);
    if (!sound && check_settable(one, REALS, references, n, values) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n && !sound; ++i) {
        if (check_number(one, references[i], values[i]) != CT_OK) return CT_ERROR;
    }
    for (size_t i = 0; i < n; ++i) one->values[references[i]] = values[i];
    return have_set(one);
}

/* Write the valid values of a String or Enumeration as a list "a, b, c". */
static const char *list_options(const struct ct_instance *one, uint32_t reference, char list[LONGEST_LIST]) {
    uint32_t n;
    size_t used = 0;
    const struct ct_option *options = options_of(one, reference, &n);
    list[0] = '\0';
    if (options == NULL) return ct_text(&one->file, one->file.variables[reference].start_text);
    for (uint32_t k = 0; k < n && used < LONGEST_LIST; ++k) {
        const char *text = ct_text(&one->file, options[k].text);
        const int more = snprintf(list + used, LONGEST_LIST - used, "%s%s", k == 0 ? "" : ", ", text);
        used += more > 0 ? (size_t)more : 0;
    }
    return list;
}

ct_result ct_set_integers(struct ct_instance *one, const uint32_t *references, size_t n, const int *values) {
    char list[LONGEST_LIST];
    uint32_t n_options;
    if (check_settable(one, INTEGERS, references, n, values) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n; ++i) {
        if (one->file.variables[references[i]].type == CT_INTEGER) {
            if (check_number(one, references[i], values[i]) != CT_OK) return CT_ERROR;
            continue;
        }
        options_of(one, references[i], &n_options);
        if (values[i] < 1 || (uint32_t)values[i] > n_options) {
            return ct_refuse(&one->host, "'%s' is %d; valid: 1 to %u for %s", ct_name_of(one, references[i]), values[i],
                             n_options, list_options(one, references[i], list));
        }
    }
    for (size_t i = 0; i < n; ++i) {
        const bool option = one->file.variables[references[i]].type == CT_ENUMERATION;
        one->values[references[i]] = option ? values[i] - 1 : values[i];
    }
    return have_set(one);
}

ct_result ct_set_booleans(struct ct_instance *one, const uint32_t *references, size_t n, const int *values) {
    if (check_settable(one, BOOLEANS, references, n, values) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n; ++i) one->values[references[i]] = values[i] != 0;
    return have_set(one);
}

/* Index of a text among a String's options; CT_NONE if the text is no option. */
static uint32_t find_option(const struct ct_instance *one, uint32_t reference, const char *text) {
    uint32_t n, k = 0;
    const struct ct_option *options = options_of(one, reference, &n);
    if (options == NULL) {
        const char *start = ct_text(&one->file, one->file.variables[reference].start_text);
        return strcmp(text, start) == 0 ? 0 : CT_NONE;
    }
    while (k < n && strcmp(text, ct_text(&one->file, options[k].text)) != 0) ++k;
    return k < n ? k : CT_NONE;
}

ct_result ct_set_strings(struct ct_instance *one, const uint32_t *references, size_t n, const char *const *values) {
    char list[LONGEST_LIST];
    if (check_settable(one, STRINGS, references, n, values) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n; ++i) {
        if (values[i] == NULL || find_option(one, references[i], values[i]) == CT_NONE) {
            return ct_refuse(&one->host, "'%s' is '%.100s'; valid: %s", ct_name_of(one, references[i]),
                             values[i] == NULL ? "" : values[i], list_options(one, references[i], list));
        }
    }
    for (size_t i = 0; i < n; ++i) one->values[references[i]] = find_option(one, references[i], values[i]);
    return have_set(one);
}
