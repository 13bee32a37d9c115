/* Phases of an instance and its steps, common to all versions of FMI. */
#include <math.h>
#include <string.h>

#include "instance.h"

static const double LONGEST_STEP = 1.0; /* s: inputs cannot be held or extrapolated for longer */
static const double LATEST = 1e6;       /* s (eleven days): a Float64 of a later time cannot resolve a step */
static const double COARSE_STEP = 3.0;  /* degrees of crank angle; pressures change by bars over such a step */
static const double ROUNDING = 1e-6;    /* relative tolerance of the limit of a coarse step */
static const double DEGREE = 3.14159265358979323846 / 180.0;

/* ---------------------------------------------------------------- phases */

static const struct {
    enum ct_phase phase;
    char name[36];
} PHASES[] = {
    {CT_INSTANTIATED, "only instantiated"},
    {CT_INITIALIZING, "in initialization mode"},
    {CT_STEPPED, "initialized"},
    {CT_FAILED, "initialized and has failed a step"},
    {CT_TERMINATED, "terminated"},
    {CT_EVENT, "in event mode"},
};
enum { N_PHASES = sizeof PHASES / sizeof PHASES[0] };

bool ct_allowed(const struct ct_instance *one, const struct ct_call *call) {
    char phases[256] = "";
    const char *present = "";
    if (one == NULL) return false;
    if ((one->now->phase & call->phases) != 0) return true;
    for (int k = 0; k < N_PHASES; ++k) {
        if (PHASES[k].phase == (enum ct_phase)one->now->phase) present = PHASES[k].name;
        if ((PHASES[k].phase & call->phases) == 0 || PHASES[k].phase == CT_FAILED) continue;
        if (phases[0] != '\0') strcat(phases, " or ");
        strcat(phases, PHASES[k].name);
    }
    ct_refuse(&one->host, "%s on an instance that is %s; it must be %s", call->name, present, phases);
    return false;
}

ct_result ct_set_experiment(struct ct_instance *one, double start, bool stop_defined, double stop) {
    char text[CT_NUMBER];
    if (!(fabs(start) <= LATEST)) {
        return ct_refuse(&one->host, "the start time is %s; it must be a finite time in seconds, at most %g",
                         ct_number(text, start), LATEST);
    }
    if (stop_defined && !(stop >= start)) {
        return ct_refuse(&one->host, "the stop time is %s; it must not lie before the start", ct_number(text, stop));
    }
    one->now->start_time = start;
    one->now->stop_time = stop_defined ? stop : (double)INFINITY;
    return CT_OK;
}

void ct_initialize(struct ct_instance *one) {
    one->now->phase = CT_INITIALIZING;
    one->made = false;
}

ct_result ct_end_initialization(struct ct_instance *one) {
    if (!one->made) {
        ct_keep_origin(one);
        if (ct_make(one) != CT_OK) return CT_ERROR;
    }
    one->now->phase = CT_STEPPED;
    return CT_OK;
}

/* ---------------------------------------------------------------- steps */

double ct_degrees(const struct ct_instance *one, double step) {
    return one->speed == CT_NONE ? 0.0 : one->values[one->speed] * step / DEGREE;
}

static void warn_if_coarse(struct ct_instance *one, double step) {
    if (one->warned || one->speed == CT_NONE) return;
    const double speed = one->values[one->speed], degrees = ct_degrees(one, step);
    if (!(degrees > COARSE_STEP * (1.0 + ROUNDING))) return;
    one->warned = true;
    ct_log(&one->host, CT_WARNING,
           "a communication step of %.3g s is %.1f degrees of crank angle; the model sub-steps inside, but inputs and "
           "outputs are sampled that coarsely. For 1 degree use %.2g s (fmpy: --output-interval %.2g)",
           step, degrees, DEGREE / speed, DEGREE / speed);
}

/* Warn once of what a mark in the state says of a step: limited work, a charge that cannot burn. */
static void warn_if_limited(struct ct_instance *one, double time) {
    if (one->told_limit || one->limited >= one->now->n_point || one->state[one->limited] == 0.0) return;
    one->told_limit = true;
    const char *told = ct_info_text(&one->file, "told");
    if (told == NULL) return;
    ct_log(&one->host, CT_WARNING, "the step from %.9g s %s", time, told);
}

ct_result ct_check_step(struct ct_instance *one, double time, double step) {
    char first[CT_NUMBER], second[CT_NUMBER];
    if ((one->now->phase & (CT_INSTANTIATED | CT_INITIALIZING)) != 0) {
        return ct_refuse(&one->host, "doStep before the initialization is complete; call exitInitializationMode first");
    }
    if (one->now->phase == CT_TERMINATED) {
        return ct_refuse(&one->host, "doStep on an instance that is terminated; reset it, or set a state");
    }
    const double stands = one->state[0];
    /* Tolerance of the step's start time: the model may lag by tiny steps that it left to the next step. */
    const double tolerance = 2e-9 + 1e-6 * fabs(time) + 1e-3 * step;
    if (!(step > 0.0)) {
        return ct_refuse(&one->host, "communication step of %s s at time %s s; it must be positive, in seconds",
                         ct_number(first, step), ct_number(second, time));
    }
    if (!(fabs(time - stands) <= tolerance)) {
        return ct_refuse(&one->host,
                         "the master steps from %s s but the model stands at %s s; set a state of that time or step on "
                         "from there",
                         ct_number(first, time), ct_number(second, stands));
    }
    if (time + step - stands > LONGEST_STEP) {
        return ct_refuse(&one->host, "communication step of %g s at t = %g s is too long; at most %g s",
                         time + step - stands, stands, LONGEST_STEP);
    }
    if (time + step > LATEST + LONGEST_STEP) {
        return ct_refuse(&one->host, "a step to %s s; times beyond %g s are too large for steps as short as the model's",
                         ct_number(first, time + step), LATEST);
    }
    if (time + step > one->now->stop_time + tolerance) {
        return ct_refuse(&one->host, "a step to %s s leads beyond the stop time of %s s, which the experiment was given",
                         ct_number(first, time + step), ct_number(second, one->now->stop_time));
    }
    warn_if_coarse(one, step);
    return CT_OK;
}

/* Result of a step that the kernels did not take. */
static ct_result failed_step(struct ct_instance *one, int64_t code) {
    enum ct_status_kind kind;
    const char *text = ct_status_text(&one->file, code, &kind);
    if (kind == CT_STATUS_ERROR) return ct_refuse(&one->host, "%s at %.9g s", text, one->state[0]);
    ct_log(&one->host, CT_DISCARD, "step failed at t = %.6g s: %s", one->state[0], text);
    one->now->phase = CT_FAILED;
    return CT_DISCARD;
}

ct_result ct_step_to(struct ct_instance *one, double end) {
    const double time = one->state[0];
    if (ct_stages(one) > 0 && one->model.staged[CT_STAGES_GIVEN] == 0.0) {
        return ct_refuse(&one->host, "input.reconstruction is 'stages', whose inputs are not given; take a host of FMI 3.0 "
                                     "with intermediate updates and without event mode, or polytropic");
    }
    const int64_t code = ct_advance_model(one, end);
    if (code != 0) return failed_step(one, code);
    if (one->model.input_rates != NULL) { /* rates of inputs hold for one step only */
        for (uint32_t k = 0; k < one->n_inputs; ++k) one->rates[k] = NAN;
    }
    one->now->phase = CT_STEPPED;
    warn_if_limited(one, time);
    return CT_OK;
}
