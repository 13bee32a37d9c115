/* Variables in FMI 3.0: arrays are mapped to their elements, types to those of the model. */
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3_unit.h"

/* ---------------------------------------------------------------- arrays */

/* True if the ``count`` variables of the model from ``first`` on can be an array. */
static bool can_be_array(const struct unit *unit, unsigned long first, unsigned long count) {
    const struct ct_variable *variables = unit->model->file.variables;
    if (count == 0 || first >= unit->n || count > unit->n - first) return false;
    for (unsigned long k = first; k < first + count; ++k) {
        if (variables[k].type != CT_REAL || variables[k].causality != variables[first].causality) return false;
        if (unit->lengths[k] != 1) return false; /* variable k belongs to another array */
    }
    return true;
}

bool ct_find_arrays(struct unit *unit) {
    const char *text = ct_info_text(&unit->model->file, "arrays"); /* "FIRST*COUNT FIRST*COUNT" */
    for (uint32_t k = 0; k < unit->n; ++k) unit->lengths[k] = 1;
    while (text != NULL && *text != '\0') {
        char *behind, *end;
        const unsigned long first = strtoul(text, &behind, 10);
        const unsigned long count = strtoul(*behind == '*' ? behind + 1 : behind, &end, 10);
        if (*behind != '*' || (*end != ' ' && *end != '\0') || !can_be_array(unit, first, count)) {
            ct_refuse(&unit->model->host, "native.bin has %s that cannot be; unpack the FMU again",
                      "an array of variables");
            return false;
        }
        for (unsigned long k = first; k < first + count; ++k) unit->lengths[k] = 0;
        unit->lengths[first] = (uint32_t)count;
        text = *end == ' ' ? end + 1 : end;
    }
    return true;
}

/* ---------------------------------------------------------------- pressures that do not come */

bool ct_find_gas(struct unit *unit) {
    const char *text = ct_info_text(&unit->model->file, "gas"); /* "PRESSURES SOURCE", see archive.py */
    const struct ct_variable *variables = unit->model->file.variables;
    char *end;
    unit->gas = CT_NONE;
    if (text == NULL) return true;
    const unsigned long gas = strtoul(text, &end, 10), source = strtoul(end, &end, 10);
    if (*end != '\0' || gas >= unit->n || source >= unit->n || unit->lengths[gas] == 0 ||
        variables[source].type != CT_ENUMERATION) {
        ct_refuse(&unit->model->host, "native.bin has %s that cannot be; unpack the FMU again", "pressures");
        return false;
    }
    unit->gas = (uint32_t)gas;
    unit->source = (uint32_t)source;
    return true;
}

static void note_inputs(struct unit *unit, const fmi3ValueReference references[], size_t n) {
    const bool runs = (unit->model->now->phase & (CT_STEPPED | CT_EVENT)) != 0;
    for (size_t i = 0; i < n; ++i) {
        const bool input = unit->model->file.variables[references[i]].causality == CT_INPUT;
        unit->given |= references[i] == unit->gas;
        unit->driven |= runs && input && references[i] != unit->gas;
    }
}

void ct_warn_without_gas(struct unit *unit) {
    if (unit->gas == CT_NONE || unit->given || !unit->driven || unit->model->values[unit->source] != 0.0) return;
    unit->given = true; /* warn only once */
    ct_log(&unit->model->host, CT_WARNING,
           "no pressures are set, though other inputs are: the built-in gas goes on. Pressures are one array here, whose "
           "first of %u elements is '%s'; a table for FMI 2.0 has other columns. gas.source builtin says that it is meant",
           unit->lengths[unit->gas], ct_name_of(unit->model, unit->gas));
}

/* ---------------------------------------------------------------- elements of a call */

static const char TYPE_NAMES[][12] = {"Float64", "Int32", "Boolean", "String", "Enumeration"};

/* Put the elements of variables of one type into unit->list. Refused if their number differs from that of the values.
   ``orders``, if any, has one entry for each variable and goes to unit->integers. */
static ct_result expand(struct unit *unit, enum ct_type type, const fmi3ValueReference references[], size_t n,
                        size_t n_values, const fmi3Int32 *orders) {
    const struct ct_host *host = &unit->model->host;
    size_t found = 0;
    if (n > 0 && references == NULL) return ct_refuse(host, "%s values without their references", TYPE_NAMES[type]);
    for (size_t i = 0; i < n; ++i) {
        const fmi3ValueReference reference = references[i];
        if (reference >= unit->n || unit->lengths[reference] == 0) {
            return ct_refuse(host, "value reference %u is unknown, no %s; see modelDescription.xml", reference,
                             TYPE_NAMES[type]);
        }
        if (unit->model->file.variables[reference].type != type) {
            return ct_refuse(host, "value reference %u is '%s', no %s; see modelDescription.xml", reference,
                             ct_name_of(unit->model, reference), TYPE_NAMES[type]);
        }
        if (unit->lengths[reference] > unit->n - found) {
            return ct_refuse(host, "more than %u %s values at once; the FMU has no more", unit->n, TYPE_NAMES[type]);
        }
        for (uint32_t k = 0; k < unit->lengths[reference]; ++k, ++found) {
            unit->list[found] = reference + k;
            if (orders != NULL) unit->integers[found] = orders[i];
        }
    }
    if (found == n_values) return CT_OK;
    return ct_refuse(host, "%.9g values were given for variables of %.9g elements; see their Dimension in "
                     "modelDescription.xml", (double)n_values, (double)found);
}

/* The time, and the reals before and after it, each group in one call. */
static ct_result get_reals(struct unit *unit, const fmi3ValueReference references[], size_t n, double values[],
                           size_t n_values) {
    size_t first = 0, done = 0;
    if (n > (size_t)unit->n + 1) { /* checked before any value is read, because the count may be wrong */
        return ct_refuse(&unit->model->host, "more than %u Float64 values at once; the FMU has no more", unit->n + 1);
    }
    for (size_t i = 0; references != NULL && values != NULL && i < n; ++i) {
        if (references[i] != unit->n) continue;
        size_t elements = 0;
        for (size_t k = first; k < i; ++k) elements += references[k] < unit->n ? unit->lengths[references[k]] : 0;
        if (elements >= n_values - done) break; /* no space is left for the time; the call is refused below */
        if (expand(unit, CT_REAL, references + first, i - first, elements, NULL) != CT_OK) return CT_ERROR;
        if (ct_get_reals(unit->model, unit->list, elements, values + done) != CT_OK) return CT_ERROR;
        values[done + elements] = ct_time(unit->model);
        done += elements + 1;
        first = i + 1;
    }
    const fmi3ValueReference *rest = references == NULL ? NULL : references + first;
    if (expand(unit, CT_REAL, rest, n - first, n_values - done, NULL) != CT_OK) return CT_ERROR;
    return ct_get_reals(unit->model, unit->list, n_values - done, values == NULL ? NULL : values + done);
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference references[], size_t n, fmi3Float64 values[],
                          size_t n_values) {
    struct unit *unit = instance;
    return ct_unit_allowed(unit, GET) ? ct_status3(get_reals(unit, references, n, values, n_values)) : fmi3Error;
}

/* True if a call is allowed now and its variables have this type. Then unit->list contains their elements. */
static bool begun(struct unit *unit, enum unit_call call, enum ct_type type, const fmi3ValueReference references[],
                  size_t n, size_t n_values) {
    return ct_unit_allowed(unit, call) && expand(unit, type, references, n, n_values, NULL) == CT_OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference references[], size_t n,
                          const fmi3Float64 values[], size_t n_values) {
    struct unit *unit = instance;
    if (!begun(unit, SET, CT_REAL, references, n, n_values)) return fmi3Error;
    const ct_result result = ct_set_reals(unit->model, unit->list, n_values, values);
    if (result == CT_OK) note_inputs(unit, references, n);
    return ct_status3(result);
}

fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference references[], size_t n, fmi3String values[],
                         size_t n_values) {
    struct unit *unit = instance;
    if (!begun(unit, GET, CT_STRING, references, n, n_values)) return fmi3Error;
    return ct_status3(ct_get_strings(unit->model, unit->list, n_values, values));
}

fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference references[], size_t n,
                         const fmi3String values[], size_t n_values) {
    struct unit *unit = instance;
    if (!begun(unit, SET, CT_STRING, references, n, n_values)) return fmi3Error;
    return ct_status3(ct_set_strings(unit->model, unit->list, n_values, values));
}

/* ---------------------------------------------------------------- whole numbers */

static int within_int(int64_t value) { return value > INT_MAX ? INT_MAX : value < INT_MIN ? INT_MIN : (int)value; }

/* Get values of type Int32, Int64 (for enumerations) or Boolean, which the model stores as int. */
static fmi3Status get_whole(struct unit *unit, const fmi3ValueReference references[], size_t n, void *values,
                            size_t n_values, enum ct_type type) {
    if (!begun(unit, GET, type, references, n, n_values)) return fmi3Error;
    int *found = values == NULL ? NULL : unit->integers;
    const ct_result result =
        (type == CT_BOOLEAN ? ct_get_booleans : ct_get_integers)(unit->model, unit->list, n_values, found);
    for (size_t i = 0; i < n_values && result == CT_OK; ++i) {
        if (type == CT_INTEGER) ((fmi3Int32 *)values)[i] = found[i];
        if (type == CT_ENUMERATION) ((fmi3Int64 *)values)[i] = found[i];
        if (type == CT_BOOLEAN) ((fmi3Boolean *)values)[i] = found[i] != 0;
    }
    return ct_status3(result);
}

/* Set values of type Int32, Int64 or Boolean. Numbers beyond int become the largest int, which bounds refuse. */
static fmi3Status set_whole(struct unit *unit, const fmi3ValueReference references[], size_t n, const void *values,
                            size_t n_values, enum ct_type type) {
    if (!begun(unit, SET, type, references, n, n_values)) return fmi3Error;
    for (size_t i = 0; i < n_values && values != NULL; ++i) {
        unit->integers[i] = type == CT_INTEGER       ? ((const fmi3Int32 *)values)[i]
                            : type == CT_ENUMERATION ? within_int(((const fmi3Int64 *)values)[i])
                                                     : ((const fmi3Boolean *)values)[i];
    }
    const int *given = values == NULL ? NULL : unit->integers;
    return ct_status3(
        (type == CT_BOOLEAN ? ct_set_booleans : ct_set_integers)(unit->model, unit->list, n_values, given));
}

#define WHOLE_NUMBERS(TYPE, kind)                                                                                 \
    fmi3Status fmi3Get##TYPE(fmi3Instance instance, const fmi3ValueReference references[], size_t n,              \
                             fmi3##TYPE values[], size_t n_values) {                                              \
        return get_whole(instance, references, n, values, n_values, kind);                                        \
    }                                                                                                             \
    fmi3Status fmi3Set##TYPE(fmi3Instance instance, const fmi3ValueReference references[], size_t n,              \
                             const fmi3##TYPE values[], size_t n_values) {                                        \
        return set_whole(instance, references, n, values, n_values, kind);                                        \
    }
WHOLE_NUMBERS(Int32, CT_INTEGER)
WHOLE_NUMBERS(Int64, CT_ENUMERATION)
WHOLE_NUMBERS(Boolean, CT_BOOLEAN)

/* ---------------------------------------------------------------- derivatives */

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference references[], size_t n,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t n_values) {
    struct unit *unit = instance;
    if (!ct_unit_allowed(unit, GET_RATES)) return fmi3Error;
    if (expand(unit, CT_REAL, references, n, n_values, orders) != CT_OK) return fmi3Error;
    const int *expanded = orders == NULL ? NULL : unit->integers;
    return ct_status3(ct_get_rates(unit->model, unit->list, n_values, expanded, values));
}

/* References of all elements of the knowns, then of the unknowns. Return NULL if any are refused. */
static uint32_t *sides(struct unit *unit, const fmi3ValueReference knowns[], size_t n_knowns, size_t n_inputs,
                       const fmi3ValueReference unknowns[], size_t n_unknowns, size_t n_outputs) {
    if (expand(unit, CT_REAL, knowns, n_knowns, n_inputs, NULL) != CT_OK) return NULL;
    uint32_t *both = ct_allocate(&unit->model->host, (n_inputs + unit->n + 1) * sizeof *both);
    if (both == NULL) {
        ct_refuse(&unit->model->host, "no memory for derivatives");
        return NULL;
    }
    memcpy(both, unit->list, n_inputs * sizeof *both);
    if (expand(unit, CT_REAL, unknowns, n_unknowns, n_outputs, NULL) != CT_OK) {
        ct_release(&unit->model->host, both);
        return NULL;
    }
    memcpy(both + n_inputs, unit->list, n_outputs * sizeof *both);
    return both;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                        const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
    struct unit *unit = instance;
    if (!ct_unit_allowed(unit, GET_DERIVATIVES)) return fmi3Error;
    uint32_t *both = sides(unit, knowns, n_knowns, n_seed, unknowns, n_unknowns, n_sensitivity);
    if (both == NULL) return fmi3Error;
    const ct_result result =
        ct_get_derivatives(unit->model, both + n_seed, n_sensitivity, both, n_seed, seed, sensitivity);
    ct_release(&unit->model->host, both);
    return ct_status3(result);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                    const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                    size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
    struct unit *unit = instance;
    if (!ct_unit_allowed(unit, GET_DERIVATIVES)) return fmi3Error;
    uint32_t *both = sides(unit, knowns, n_knowns, n_sensitivity, unknowns, n_unknowns, n_seed);
    if (both == NULL) return fmi3Error;
    const ct_result result =
        ct_get_adjoints(unit->model, both + n_sensitivity, n_seed, both, n_sensitivity, seed, sensitivity);
    ct_release(&unit->model->host, both);
    return ct_status3(result);
}
