#include "instance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double CLOSE = 1e-9; /* relative tolerance for values that were written as text */

/* ---------------------------------------------------------------- life */

/* Number of Float64 values in the longest point of any variant. */
static uint64_t longest_point(const struct ct_file *file) {
    uint64_t most = 0;
    for (const struct ct_variant *variant = file->variants; variant < file->variants + file->n_variants; ++variant) {
        const uint64_t n = ct_point(file, variant);
        if (n > most) most = n;
    }
    return most;
}

static uint64_t count_inputs(const struct ct_file *file) {
    uint64_t n = 0;
    for (uint64_t k = 0; k < file->n_variables; ++k) n += file->variables[k].causality == CT_INPUT;
    return n;
}

/* Allocate memory for the values of variables. Return false if there is no memory. */
static bool take_memory(struct ct_instance *one) {
    const uint64_t n = one->n_variables, n_point = longest_point(&one->file);
    const uint64_t snapshot = sizeof(struct ct_snapshot) + (n + 2 * one->n_inputs) * sizeof(double);
    const uint64_t before = ct_padded(snapshot), capacity = before + (1 + CT_PLACES) * n_point * sizeof(double);
    if (capacity > CT_MOST_BYTES) return false;
    one->now = ct_allocate(&one->host, capacity);
    one->before = ct_allocate(&one->host, n_point * sizeof *one->before);
    one->places = ct_allocate(&one->host, (n + 1) * sizeof *one->places);
    one->inputs = ct_allocate(&one->host, (one->n_inputs + 1) * sizeof *one->inputs);
    one->ready = ct_allocate(&one->host, n + 1);
    if (one->now == NULL || one->before == NULL || one->places == NULL || one->inputs == NULL || one->ready == NULL) {
        return false;
    }
    one->now->capacity = capacity;
    one->values = (double *)(void *)(one->now + 1);
    one->rates = one->values + n;
    one->origin = one->rates + one->n_inputs;
    one->state = (double *)(void *)((char *)one->now + before);
    return true;
}

/* Index in the state vector, from the entry of INFO with this name; CT_NONE if there is no such entry. */
static uint32_t place_of(const struct ct_instance *one, const char *name) {
    const char *text = ct_info_text(&one->file, name);
    const double place = text != NULL ? strtod(text, NULL) : -1.0;
    return place >= 0.0 && place < (double)CT_NONE ? (uint32_t)place : CT_NONE;
}

static void find_variables(struct ct_instance *one) {
    const char *speed = ct_info_text(&one->file, "speed");
    uint32_t n = 0;
    one->speed = CT_NONE;
    one->limited = place_of(one, "limited");
    one->each_point = place_of(one, "each_point");
    for (uint32_t k = 0; k < one->n_variables; ++k) {
        const struct ct_variable *variable = one->file.variables + k;
        if (variable->causality != CT_INPUT) continue;
        one->inputs[n++] = (struct ct_input){k, variable->index};
        if (speed != NULL && strcmp(ct_text(&one->file, variable->name), speed) == 0) one->speed = k;
    }
}

struct ct_instance *ct_new_instance(const struct ct_host *host, const char *guid, const char *location) {
    struct ct_instance *one = ct_allocate(host, sizeof *one);
    char *name = ct_allocate(host, strlen(host->name) + 1);
    if (one == NULL || name == NULL) {
        ct_refuse(host, "no memory for an instance");
        ct_release(host, name);
        ct_release(host, one);
        return NULL;
    }
    strcpy(name, host->name);
    one->host = *host;
    one->host.name = name;
    if (!ct_open_file(&one->host, location, guid, &one->file)) {
        ct_free_instance(one);
        return NULL;
    }
    one->n_variables = (uint32_t)one->file.n_variables;
    one->n_inputs = (uint32_t)count_inputs(&one->file);
    if (!take_memory(one)) {
        ct_refuse(&one->host, "no memory for an instance");
        ct_free_instance(one);
        return NULL;
    }
    find_variables(one);
    ct_reset(one);
    return one;
}

void ct_free_instance(struct ct_instance *one) {
    const struct ct_host host = one->host;
    ct_release(&host, one->model.block);
    ct_release(&host, one->now);
    ct_release(&host, one->before);
    ct_release(&host, one->places);
    ct_release(&host, one->inputs);
    ct_release(&host, one->ready);
    ct_close_file(&one->file);
    ct_release(&host, one);
    ct_release(&host, (void *)(uintptr_t)host.name);
}

/* Index, among its options, of the start value of a String or Enumeration. */
static double start_option(const struct ct_file *file, const struct ct_variable *variable) {
    if (variable->index == CT_NONE) return 0.0;
    const struct ct_choice *choice = file->choices + variable->index;
    uint32_t k = 0;
    while (strcmp(ct_text(file, file->options[choice->first_option + k].text),
                  ct_text(file, variable->start_text)) != 0) {
        ++k;
    }
    return k;
}

void ct_reset(struct ct_instance *one) {
    struct ct_snapshot *now = one->now;
    const uint64_t capacity = now->capacity;
    memset(now, 0, sizeof *now);
    memcpy(now->magic, "CRNKNST", sizeof now->magic);
    memcpy(now->guid, one->file.guid, sizeof now->guid);
    now->capacity = capacity;
    now->version = 3;
    now->phase = CT_INSTANTIATED;
    now->bytes = (uint64_t)((char *)one->state - (char *)now);
    now->stop_time = INFINITY;
    one->made = one->warned = one->told_limit = false;
    for (uint32_t k = 0; k < one->n_variables; ++k) {
        const struct ct_variable *variable = one->file.variables + k;
        const bool textual = variable->type == CT_STRING || variable->type == CT_ENUMERATION;
        one->values[k] = textual ? start_option(&one->file, variable) : variable->start;
    }
    for (uint32_t k = 0; k < one->n_inputs; ++k) {
        one->rates[k] = NAN;
        one->origin[k] = 0.0;
    }
    ct_forget_outputs(one);
}

void ct_forget_outputs(struct ct_instance *one) {
    one->model.observed = false;
    for (uint32_t k = 0; k < one->n_variables; ++k) {
        const struct ct_variable *variable = one->file.variables + k;
        const bool output = variable->causality == CT_OUTPUT && variable->index != CT_NONE;
        one->ready[k] = !output && variable->type == CT_REAL;
        one->places[k] = output && one->made ? one->model.outputs + variable->index : one->values + k;
    }
}

/* ---------------------------------------------------------------- the model of the values */

/* Reference of the variable that sets a choice; CT_NONE if no variable does, and the first option applies. */
static uint32_t variable_of(const struct ct_instance *one, uint64_t choice) {
    for (uint32_t k = 0; k < one->n_variables; ++k) {
        const struct ct_variable *variable = one->file.variables + k;
        const bool textual = variable->type == CT_STRING || variable->type == CT_ENUMERATION;
        if (textual && variable->causality == CT_PARAMETER && variable->index == choice) return k;
    }
    return CT_NONE;
}

static const struct ct_option *chosen(const struct ct_instance *one, uint64_t choice) {
    const uint32_t k = variable_of(one, choice);
    return one->file.options + one->file.choices[choice].first_option + (k == CT_NONE ? 0 : (uint32_t)one->values[k]);
}

uint32_t ct_level(const struct ct_instance *one) {
    uint64_t row = 0;
    for (uint64_t c = 0; c < one->file.n_choices; ++c) {
        const struct ct_choice *choice = one->file.choices + c;
        if (choice->kind == CT_LEVEL) row = row * choice->n_options + chosen(one, c)->value;
    }
    return one->file.levels[row];
}

/* Refuse values of parameters that differ from the values for which the FMU's data were made. */
static ct_result check_fixed(const struct ct_instance *one) {
    for (uint32_t k = 0; k < one->n_variables; ++k) {
        const struct ct_variable *variable = one->file.variables + k;
        if (variable->causality != CT_PARAMETER || variable->index != CT_NONE || variable->type == CT_STRING) continue;
        const double value = one->values[k], start = variable->start;
        if (fabs(value - start) > CLOSE * fmax(1.0, fmax(fabs(value), fabs(start)))) {
            const char *made = ct_info_text(&one->file, "made");
            return ct_refuse(&one->host,
                             "'%s' is %.9g, but %s made for %.9g; keep that value, or build the FMU of an engine file "
                             "with the new one, with build_fmu.py",
                             ct_text(&one->file, variable->name), value,
                             made == NULL ? "the data of this FMU were" : made, start);
        }
    }
    return CT_OK;
}

/* Write run.numbers: numbers of the variant, then those set by parameters and choices. */
static void set_numbers(const struct ct_instance *one, const struct ct_variant *variant, double *numbers) {
    for (uint32_t k = 0; k < variant->n_numbers; ++k) {
        const struct ct_slot_number *number = one->file.numbers + variant->first_number + k;
        numbers[number->slot] = number->value;
    }
    for (uint32_t k = 0; k < one->n_variables; ++k) {
        const struct ct_variable *variable = one->file.variables + k;
        if (variable->causality != CT_PARAMETER || variable->index == CT_NONE) continue;
        if (variable->type != CT_STRING && variable->type != CT_ENUMERATION) numbers[variable->index] = one->values[k];
    }
    for (uint64_t c = 0; c < one->file.n_choices; ++c) {
        const struct ct_choice *choice = one->file.choices + c;
        if (choice->kind == CT_NUMBER_CHOICE) numbers[choice->index] = chosen(one, c)->number;
    }
}

const char *ct_status_text(const struct ct_file *file, int64_t code, enum ct_status_kind *kind) {
    *kind = CT_STATUS_DISCARD;
    for (uint64_t k = 0; k < file->n_statuses; ++k) {
        if (file->statuses[k].code != code) continue;
        *kind = (enum ct_status_kind)file->statuses[k].kind;
        return ct_text(file, file->statuses[k].text);
    }
    return "the model has no solution here";
}

void ct_keep_origin(struct ct_instance *one) {
    for (uint32_t k = 0; k < one->n_inputs; ++k) one->origin[k] = one->values[one->inputs[k].reference];
}

int64_t ct_start_model(struct ct_instance *one, const struct ct_model *model, const struct ct_variant *variant,
                 const double *inputs) {
    const double time = one->now->start_time;
    ct_fill(&one->file, ct_member_array(&one->file, variant, CT_STATE), (unsigned char *)one->state, NULL);
    for (uint32_t k = 0; k < one->n_inputs; ++k) {
        model->inputs[one->inputs[k].place] = inputs[k];
        if (model->input_rates != NULL) model->input_rates[one->inputs[k].place] = NAN;
    }
    const int64_t status = one->file.kernels->prepare(model->run, time);
    return status == 0 ? one->file.kernels->start(model->run, time) : status;
}

ct_result ct_make(struct ct_instance *one) {
    const uint32_t level = ct_level(one);
    const double time = one->now->start_time;
    enum ct_status_kind kind;
    if ((level & CT_REFUSED) != 0) return ct_refuse(&one->host, "%s", ct_text(&one->file, level & ~CT_REFUSED));
    if (check_fixed(one) != CT_OK) return CT_ERROR;
    const struct ct_variant *variant = one->file.variants + level;
    const uint64_t n_point = ct_point(&one->file, variant);
    struct ct_model model = {.block = NULL};
    memset(one->state, 0, (size_t)((1 + CT_PLACES) * n_point * sizeof(double)));
    if (!ct_lay_out(one, variant, &model)) return ct_refuse(&one->host, "no memory for the model");
    set_numbers(one, variant, model.numbers);
    const int64_t status = ct_start_model(one, &model, variant, one->origin);
    if (status != 0) {
        ct_release(&one->host, model.block);
        return ct_refuse(&one->host, "%s", ct_status_text(&one->file, status, &kind));
    }
    ct_release(&one->host, one->model.block);
    one->model = model;
    one->made = true;
    one->now->variant = level;
    one->now->n_point = (uint32_t)n_point;
    one->now->n_past = one->now->latest = 0;
    one->now->end_time = time;
    ct_forget_outputs(one);
    ct_log(&one->host, CT_OK, "initialized at %.9g s", time);
    return CT_OK;
}

static void pass_inputs(struct ct_instance *one) {
    const struct ct_model *model = &one->model;
    for (uint32_t k = 0; k < one->n_inputs; ++k) {
        model->inputs[one->inputs[k].place] = one->values[one->inputs[k].reference];
    }
    for (uint32_t k = 0; k < one->n_inputs && model->input_rates != NULL; ++k) {
        model->input_rates[one->inputs[k].place] = one->rates[k];
    }
}

void ct_give_stage(struct ct_instance *one, uint32_t stage) {
    double *inputs = one->model.staged + (1 + stage) * one->model.staged_columns + 1;
    for (uint32_t k = 0; k < one->n_inputs; ++k) inputs[one->inputs[k].place] = one->values[one->inputs[k].reference];
    one->model.staged[CT_STAGES_GIVEN] = one->model.staged[CT_STAGES_THERE];
}

int64_t ct_advance_model(struct ct_instance *one, double end) {
    struct ct_snapshot *now = one->now;
    const size_t bytes = now->n_point * sizeof(double);
    if (!(end > one->state[0])) return 0; /* the step is zero within the master's rounding of time */
    const uint32_t next = (now->latest + 1) % CT_PLACES;
    double *before = one->state + (1 + next) * (size_t)now->n_point;
    memcpy(before, one->state, bytes);
    pass_inputs(one);
    const int64_t status = one->file.kernels->advance(one->model.run, end);
    if (status == 0) one->model.observed = true;
    if (status != 0 || !(one->state[0] > before[0])) { /* failed, or too short: left to the next step */
        memcpy(one->state, before, bytes);
        memset(before, 0, bytes);
        return status;
    }
    now->latest = next;
    if (now->n_past < CT_PAST) now->n_past++;
    now->end_time = end;
    return 0;
}
