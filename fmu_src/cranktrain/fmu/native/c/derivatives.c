/* Derivatives of inputs and outputs by time, and of outputs by inputs. */
#include <math.h>
#include <string.h>

#include "instance.h"

enum { REALS = 1 << CT_REAL };
static const double MOVE = 1e-4; /* change of an input over its nominal size; MOVE^2 is below the solvers' residual */

/* ---------------------------------------------------------------- by time */

static ct_result check_orders(const struct ct_instance *one, const uint32_t *references, size_t n, const int *orders,
                               enum ct_causality causality) {
    if (n > 0 && orders == NULL) return ct_refuse(&one->host, "derivatives without their orders");
    for (size_t i = 0; i < n; ++i) {
        if (orders[i] != 1) {
            return ct_refuse(&one->host, "derivative of order %d of '%s'; the first is the only one", orders[i],
                             ct_name_of(one, references[i]));
        }
        if (one->file.variables[references[i]].causality != causality) {
            return ct_refuse(&one->host, "'%s' is no %s and has no derivative by time", ct_name_of(one, references[i]),
                             causality == CT_INPUT ? "input" : "output");
        }
    }
    return CT_OK;
}

ct_result ct_set_rates(struct ct_instance *one, const uint32_t *references, size_t n, const int *orders,
                        const double *values) {
    char text[CT_NUMBER];
    if (one->file.members[CT_INPUT_RATES] == CT_NONE) {
        return ct_refuse(&one->host, "this model takes no derivatives of its inputs; hold them over a step");
    }
    if (ct_check_references(one, REALS, references, n, values) != CT_OK) return CT_ERROR;
    if (check_orders(one, references, n, orders, CT_INPUT) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n; ++i) {
        if (!isfinite(values[i])) {
            return ct_refuse(&one->host, "the derivative of '%s' is %s; it must be a finite number",
                             ct_name_of(one, references[i]), ct_number(text, values[i]));
        }
    }
    for (size_t i = 0; i < n; ++i) {
        uint32_t k = 0;
        while (one->inputs[k].reference != references[i]) ++k;
        one->rates[k] = values[i];
    }
    return CT_OK;
}

/* Values of the model's outputs at these references; 0 for references that are not its outputs. */
static void read_outputs(const struct ct_instance *one, const uint32_t *references, size_t n, double *values) {
    for (size_t i = 0; i < n; ++i) {
        const uint32_t place = one->file.variables[references[i]].index;
        values[i] = place == CT_NONE ? 0.0 : one->model.outputs[place];
    }
}

static size_t outputs_bytes(const struct ct_instance *one) {
    return (size_t)ct_member_array(&one->file, one->file.variants + one->now->variant, CT_OUTPUTS)->bytes;
}

static size_t point_bytes(const struct ct_instance *one) { return one->now->n_point * sizeof(double); }

/* Save present point and outputs before the model is moved to another point. Return NULL if there is no memory. */
static double *put_aside(struct ct_instance *one) {
    double *outputs = ct_allocate(&one->host, outputs_bytes(one) + 1);
    if (outputs == NULL) return NULL;
    memcpy(outputs, one->model.outputs, outputs_bytes(one));
    memcpy(one->before, one->state, point_bytes(one));
    return outputs;
}

static void take_back(struct ct_instance *one, double *outputs) {
    memcpy(one->state, one->before, point_bytes(one));
    memcpy(one->model.outputs, outputs, outputs_bytes(one));
    ct_release(&one->host, outputs);
}

/* Derivatives at the last of up to three points: second order in the distances, which may differ; first order between
   two points; zero at one. The (n,) values of the points are consecutive, from the last one backwards. */
static void backward_difference(const double *times, uint32_t n_points, const double *points, size_t n, double *rates) {
    const double last = n_points > 1 ? times[0] - times[1] : 1.0, before = n_points > 2 ? times[1] - times[2] : 1.0;
    for (size_t i = 0; i < n; ++i) {
        const double slope = n_points > 1 ? (points[i] - points[n + i]) / last : 0.0;
        const double earlier = n_points > 2 ? (points[n + i] - points[2 * n + i]) / before : slope;
        rates[i] = slope + (slope - earlier) * last / (last + before);
    }
}

ct_result ct_get_rates(struct ct_instance *one, const uint32_t *references, size_t n, const int *orders,
                        double *values) {
    double times[1 + CT_PAST];
    int64_t status = 0;
    if (ct_check_references(one, REALS, references, n, values) != CT_OK) return CT_ERROR;
    if (check_orders(one, references, n, orders, CT_OUTPUT) != CT_OK) return CT_ERROR;
    if (n == 0) return CT_OK;
    if (ct_observe_outputs(one, references, n) != CT_OK) return CT_ERROR;
    const uint32_t n_past = one->now->n_past;
    double *points = ct_allocate(&one->host, (1 + n_past) * n * sizeof *points), *outputs = put_aside(one);
    if (points != NULL && outputs != NULL) {
        times[0] = one->state[0];
        read_outputs(one, references, n, points);
        for (uint32_t k = 0; status == 0 && k < n_past; ++k) {
            memcpy(one->state, ct_past(one, k), point_bytes(one));
            times[1 + k] = one->state[0];
            status = one->file.kernels->observe(one->model.run, 0.0);
            read_outputs(one, references, n, points + (1 + k) * n);
        }
        if (status == 0) backward_difference(times, 1 + n_past, points, n, values);
    }
    const bool enough = points != NULL && outputs != NULL;
    if (outputs != NULL) take_back(one, outputs);
    ct_release(&one->host, points);
    if (!enough) return ct_refuse(&one->host, "no memory for derivatives");
    enum ct_status_kind kind;
    if (status != 0) return ct_refuse(&one->host, "no outputs: %s", ct_status_text(&one->file, status, &kind));
    return CT_OK;
}

/* ---------------------------------------------------------------- by inputs */

/* Direction of a derivative: changes of inputs, and the factor on these changes for one move. */
struct direction {
    const uint32_t *references;
    const double *changes;
    size_t n;
    double move;
};

/* Positions, in moves, at which outputs are evaluated, and their weights: both sides, or the side within bounds. */
static const struct rule {
    int n;
    double at[3], weights[3];
} RULES[] = {
    {2, {-1.0, 1.0}, {-0.5, 0.5}},
    {3, {0.0, 1.0, 2.0}, {-1.5, 2.0, -0.5}},
    {3, {0.0, -1.0, -2.0}, {1.5, -2.0, 0.5}},
};
enum { N_RULES = sizeof RULES / sizeof RULES[0] };

/* Value of an input in the last step, or in the start, which led to the present point. */
static double given(const struct ct_instance *one, uint32_t k) {
    return one->now->n_past > 0 ? one->before[(size_t)(one->model.inputs - one->state) + one->inputs[k].place]
                                : one->origin[k];
}

static uint32_t input_of(const struct ct_instance *one, uint32_t reference) {
    uint32_t k = 0;
    while (one->inputs[k].reference != reference) ++k;
    return k;
}

/* Size of an input: its nominal value, else its start value, else 1. The present value is unfit, as angles grow. */
static double size_of(const struct ct_instance *one, uint32_t reference) {
    const struct ct_variable *variable = one->file.variables + reference;
    const double start = fabs(variable->start);
    return variable->nominal > 0.0 ? variable->nominal : start > 0.0 ? start : 1.0;
}

static ct_result check_direction(const struct ct_instance *one, const struct direction *towards) {
    char text[CT_NUMBER];
    for (size_t i = 0; i < towards->n; ++i) {
        const uint32_t reference = towards->references[i];
        if (one->file.variables[reference].causality != CT_INPUT) {
            return ct_refuse(&one->host, "'%s' is no input; outputs have derivatives by inputs only",
                             ct_name_of(one, reference));
        }
        if (!isfinite(towards->changes[i])) {
            return ct_refuse(&one->host, "the change of '%s' is %s; it must be a finite number",
                             ct_name_of(one, reference), ct_number(text, towards->changes[i]));
        }
    }
    return CT_OK;
}

/* Factor on the direction with which the largest relative change of an input is MOVE; 0 if no input changes. */
static double move_of(const struct ct_instance *one, const struct direction *towards) {
    double most = 0.0;
    for (size_t i = 0; i < towards->n; ++i) {
        most = fmax(most, fabs(towards->changes[i]) / size_of(one, towards->references[i]));
    }
    return most > 0.0 ? MOVE / most : 0.0;
}

/* Write inputs moved by ``at`` moves, (n_inputs,). Return false if an input leaves its bounds. */
static bool moved(const struct ct_instance *one, const struct direction *towards, double at, double *inputs) {
    for (uint32_t k = 0; k < one->n_inputs; ++k) inputs[k] = given(one, k);
    for (size_t i = 0; i < towards->n; ++i) {
        const struct ct_variable *variable = one->file.variables + towards->references[i];
        double *input = inputs + input_of(one, towards->references[i]);
        *input += at * towards->move * towards->changes[i];
        if (!(variable->min <= *input && *input <= variable->max)) return false;
    }
    return true;
}

static int64_t restart(struct ct_instance *one, const double *inputs) {
    return ct_start_model(one, &one->model, one->file.variants + one->now->variant, inputs);
}

/* Repeat with moved inputs the last step, or the start, that led to the present point. */
static int64_t redo(struct ct_instance *one, const double *inputs) {
    const size_t n_state = (size_t)ct_member_array(&one->file, one->file.variants + one->now->variant, CT_STATE)->bytes;
    int64_t status;
    if (one->now->n_past == 0) {
        status = restart(one, inputs);
        return status == 0 ? one->file.kernels->observe(one->model.run, 0.0) : status;
    }
    memcpy(one->state, one->before, point_bytes(one));
    memcpy(one->state, ct_past(one, 0), n_state);
    if (one->each_point < one->now->n_point) one->state[one->each_point] = 1.0;
    for (uint32_t k = 0; k < one->n_inputs; ++k) one->model.inputs[one->inputs[k].place] = inputs[k];
    return one->file.kernels->advance(one->model.run, one->now->end_time);
}

/* Arrays for a difference quotient: inputs, outputs at the present point, outputs at a moved point, weighted sum. */
struct work { double *inputs, *present, *there, *sum; };

/* Apply a difference rule. Return the status of the kernels, or -1 if an input would leave its bounds. */
static int64_t difference(struct ct_instance *one, const struct rule *rule, const struct direction *towards,
                          const uint32_t *unknowns, size_t n, const struct work *work) {
    for (size_t i = 0; i < n; ++i) work->sum[i] = 0.0;
    for (int p = 0; p < rule->n; ++p) {
        /* Present outputs are computed again if they were interpolated, because outputs of moved inputs never are. */
        const bool interpolated = one->now->n_past > 0 && one->each_point != CT_NONE;
        const bool here = fabs(rule->at[p]) < 0.5 && !interpolated;
        if (!moved(one, towards, rule->at[p], work->inputs)) return -1;
        const int64_t status = here ? 0 : redo(one, work->inputs);
        if (status != 0) return status;
        if (!here) read_outputs(one, unknowns, n, work->there);
        for (size_t i = 0; i < n; ++i) work->sum[i] += rule->weights[p] * (here ? work->present : work->there)[i];
    }
    for (size_t i = 0; i < n; ++i) work->sum[i] /= towards->move;
    return 0;
}

static ct_result differentiate(struct ct_instance *one, const struct direction *towards, const uint32_t *unknowns,
                                size_t n, const struct work *work) {
    enum ct_status_kind kind;
    int64_t status = -1, failed = -1;
    read_outputs(one, unknowns, n, work->present);
    for (int k = 0; k < N_RULES && status != 0; ++k) {
        status = difference(one, RULES + k, towards, unknowns, n, work);
        if (status > 0) failed = status;
    }
    if (one->now->n_past == 0) restart(one, one->origin); /* undo the starts with moved inputs */
    if (status == 0) return CT_OK;
    ct_log(&one->host, CT_DISCARD, "no directional derivative at %.9g s: %s", one->before[0],
           failed > 0 ? ct_status_text(&one->file, failed, &kind) : "the inputs cannot be moved within their bounds");
    return CT_DISCARD;
}

ct_result ct_get_derivatives(struct ct_instance *one, const uint32_t *unknowns, size_t n_unknowns,
                              const uint32_t *knowns, size_t n_knowns, const double *changes, double *results) {
    struct direction towards = {knowns, changes, n_knowns, 0.0};
    if (ct_check_references(one, REALS, unknowns, n_unknowns, results) != CT_OK) return CT_ERROR;
    if (ct_check_references(one, REALS, knowns, n_knowns, changes) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n_unknowns; ++i) {
        if (one->file.variables[unknowns[i]].causality == CT_OUTPUT) continue;
        return ct_refuse(&one->host, "'%s' is no output; only outputs have derivatives by inputs",
                         ct_name_of(one, unknowns[i]));
    }
    if (check_direction(one, &towards) != CT_OK) return CT_ERROR;
    if (ct_stages(one) > 0) {
        return ct_refuse(&one->host, "no derivatives by inputs that are given at stages (input.reconstruction)");
    }
    if (n_unknowns == 0) return CT_OK;
    if (ct_observe_outputs(one, unknowns, n_unknowns) != CT_OK) return CT_ERROR;
    double *memory = ct_allocate(&one->host, (one->n_inputs + 3 * n_unknowns) * sizeof *memory);
    double *outputs = memory == NULL ? NULL : put_aside(one);
    if (outputs == NULL) {
        ct_release(&one->host, memory);
        return ct_refuse(&one->host, "no memory for derivatives");
    }
    double *present = memory + one->n_inputs;
    const struct work work = {memory, present, present + n_unknowns, present + 2 * n_unknowns};
    towards.move = move_of(one, &towards);
    const bool any = towards.move > 0.0;
    const ct_result status = any ? differentiate(one, &towards, unknowns, n_unknowns, &work) : CT_OK;
    take_back(one, outputs);
    for (size_t i = 0; i < n_unknowns && status == CT_OK; ++i) results[i] = any ? work.sum[i] : 0.0;
    ct_release(&one->host, memory);
    return status;
}

ct_result ct_get_adjoints(struct ct_instance *one, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns,
                          size_t n_knowns, const double *weights, double *results) {
    const double unit = 1.0;
    char text[CT_NUMBER];
    if (ct_check_references(one, REALS, unknowns, n_unknowns, weights) != CT_OK) return CT_ERROR;
    if (ct_check_references(one, REALS, knowns, n_knowns, results) != CT_OK) return CT_ERROR;
    for (size_t i = 0; i < n_unknowns; ++i) {
        if (isfinite(weights[i])) continue;
        return ct_refuse(&one->host, "the weight of '%s' is %s; it must be a finite number",
                         ct_name_of(one, unknowns[i]), ct_number(text, weights[i]));
    }
    double *column = ct_allocate(&one->host, (n_unknowns + n_knowns + 1) * sizeof *column), *sums = column + n_unknowns;
    if (column == NULL) return ct_refuse(&one->host, "no memory for derivatives");
    ct_result result = CT_OK;
    for (size_t k = 0; k < n_knowns && result == CT_OK; ++k) {
        result = ct_get_derivatives(one, unknowns, n_unknowns, knowns + k, 1, &unit, column);
        for (size_t i = 0; i < n_unknowns && result == CT_OK; ++i) sums[k] += weights[i] * column[i];
    }
    for (size_t k = 0; k < n_knowns && result == CT_OK; ++k) results[k] = sums[k];
    ct_release(&one->host, column);
    return result;
}
