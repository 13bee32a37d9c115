/* The interface of FMI 2.0.4 for co-simulation: which call is allowed when, and what it does.

   A call that is refused returns fmi2Error, says why in one line and changes nothing: the instance goes on from where
   it stands. A step without a solution returns fmi2Discard, with the state of before the step. Nothing is fatal. */
#include "fmi2.h"

#include <math.h>
#include <string.h>

#include "instance.h"

static const double LONGEST_STEP = 1.0; /* s: beyond it inputs held or extrapolated have no meaning */
static const double LATEST = 1e6;       /* s, eleven days: beyond it a time has no room for the digits of a step */
static const double COARSE_STEP = 3.0;  /* degrees of crank angle: pressures change by bars within it */
static const double ROUNDING = 1e-6;    /* relative, of a step that a master calls just so coarse */
static const double DEGREE = 3.14159265358979323846 / 180.0;

enum call {
    SETUP_EXPERIMENT, ENTER_INITIALIZATION, EXIT_INITIALIZATION, TERMINATE, RESET, DO_STEP, CANCEL_STEP, GET, SET,
    SET_RATES, GET_RATES, GET_DERIVATIVES, STATES, GET_STATUS, SET_LOGGING
};
enum {
    AFTER_START = CT_STEPPED | CT_FAILED | CT_TERMINATED,
    ANY = CT_INSTANTIATED | CT_INITIALIZING | AFTER_START,
    /* More than the standard asks: nothing of a failed step is kept, so inputs may be set and a step be tried again
       from there without a state that was saved before. */
    STEPPABLE = CT_STEPPED | CT_FAILED
};

/* Table of section 4.2.4 of the standard; steps are never left pending, so stepInProgress does not exist. */
static const struct {
    const char *name;
    unsigned phases;
} CALLS[] = {
    [SETUP_EXPERIMENT] = {"setupExperiment", CT_INSTANTIATED},
    [ENTER_INITIALIZATION] = {"enterInitializationMode", CT_INSTANTIATED},
    [EXIT_INITIALIZATION] = {"exitInitializationMode", CT_INITIALIZING},
    [TERMINATE] = {"terminate", STEPPABLE},
    [RESET] = {"reset", ANY},
    [DO_STEP] = {"doStep", STEPPABLE},
    [CANCEL_STEP] = {"cancelStep", ANY},
    [GET] = {"getting values", CT_INITIALIZING | AFTER_START},
    [SET] = {"setting values", CT_INSTANTIATED | CT_INITIALIZING | STEPPABLE},
    [SET_RATES] = {"setRealInputDerivatives", CT_INSTANTIATED | CT_INITIALIZING | STEPPABLE},
    [GET_RATES] = {"getRealOutputDerivatives", AFTER_START},
    [GET_DERIVATIVES] = {"getDirectionalDerivative", CT_INITIALIZING | AFTER_START},
    [STATES] = {"a call for an FMU state", ANY},
    [GET_STATUS] = {"getStatus", AFTER_START},
    [SET_LOGGING] = {"setDebugLogging", ANY},
};
static const struct {
    enum ct_phase phase;
    const char *name;
} PHASES[] = {
    {CT_INSTANTIATED, "only instantiated"},
    {CT_INITIALIZING, "in initialization mode"},
    {CT_STEPPED, "initialized"},
    {CT_FAILED, "initialized and has failed a step"},
    {CT_TERMINATED, "terminated"},
};
enum { N_PHASES = sizeof PHASES / sizeof PHASES[0] };

/* Refuse a call that is not allowed in this phase; false then, and where there is no instance. */
static bool allowed(const struct ct_instance *one, enum call call) {
    char phases[256] = "";
    const char *present = "";
    if (one == NULL) return false;
    if ((one->now->phase & CALLS[call].phases) != 0) return true;
    for (int k = 0; k < N_PHASES; ++k) {
        if (PHASES[k].phase == (enum ct_phase)one->now->phase) present = PHASES[k].name;
        if ((PHASES[k].phase & CALLS[call].phases) == 0 || PHASES[k].phase == CT_FAILED) continue;
        if (phases[0] != '\0') strcat(phases, " or ");
        strcat(phases, PHASES[k].name);
    }
    ct_refuse(&one->host, "%s on an instance that is %s; it must be %s", CALLS[call].name, present, phases);
    return false;
}

/* ---------------------------------------------------------------- life */

const char *fmi2GetTypesPlatform(void) { return "default"; }

const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    struct ct_host host = {.name = name == NULL || name[0] == '\0' ? "cranktrain" : name, .logging = logging != 0};
    (void)visible;
    if (functions != NULL) host.functions = *functions;
    if (functions == NULL) {
        ct_refuse(&host, "no callback functions; the host must give a logger at least");
    } else if (name == NULL || name[0] == '\0') {
        ct_refuse(&host, "an instance without a name; the host must give one");
    } else if (type != fmi2CoSimulation) {
        ct_refuse(&host, "this FMU is for co-simulation, not for model exchange");
    } else if (guid == NULL) {
        ct_refuse(&host, "no GUID; the host must give that of modelDescription.xml");
    } else {
        return ct_new_instance(&host, guid, resources);
    }
    return NULL;
}

void fmi2FreeInstance(fmi2Component component) {
    if (component != NULL) ct_free_instance(component);
}

fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    struct ct_instance *one = component;
    if (!allowed(one, SET_LOGGING)) return fmi2Error;
    if (ct_choose_categories(&one->host, n, categories) != fmi2OK) return fmi2Error;
    one->host.logging = on != 0;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean tolerance_defined, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean stop_defined, fmi2Real stop) {
    struct ct_instance *one = component;
    char text[CT_NUMBER];
    (void)tolerance_defined; /* the model's own step and integrator decide */
    (void)tolerance;
    if (!allowed(one, SETUP_EXPERIMENT)) return fmi2Error;
    if (!(fabs(start) <= LATEST)) {
        return ct_refuse(&one->host, "the start time is %s; it must be a finite time in seconds, at most %g",
                         ct_number(text, start), LATEST);
    }
    if (stop_defined != 0 && !(stop >= start)) {
        return ct_refuse(&one->host, "the stop time is %s; it must not lie before the start", ct_number(text, stop));
    }
    one->now->start_time = start;
    one->now->stop_time = stop_defined != 0 ? stop : (double)INFINITY;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component component) {
    struct ct_instance *one = component;
    if (!allowed(one, ENTER_INITIALIZATION)) return fmi2Error;
    one->now->phase = CT_INITIALIZING;
    one->made = false;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
    struct ct_instance *one = component;
    if (!allowed(one, EXIT_INITIALIZATION)) return fmi2Error;
    if (!one->made) {
        ct_keep_origin(one);
        if (ct_make(one) != fmi2OK) return fmi2Error;
    }
    one->now->phase = CT_STEPPED;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component component) {
    struct ct_instance *one = component;
    if (!allowed(one, TERMINATE)) return fmi2Error;
    one->now->phase = CT_TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component component) {
    struct ct_instance *one = component;
    if (!allowed(one, RESET)) return fmi2Error;
    ct_reset(one);
    return fmi2OK;
}

/* ---------------------------------------------------------------- values */

#define VALUES(NAME, CALL, type, work)                                                                          \
    fmi2Status NAME(fmi2Component component, const fmi2ValueReference references[], size_t n, type values[]) { \
        struct ct_instance *one = component;                                                                    \
        return allowed(one, CALL) ? work(one, references, n, values) : fmi2Error;                               \
    }
VALUES(fmi2GetReal, GET, fmi2Real, ct_get_reals)
VALUES(fmi2GetInteger, GET, fmi2Integer, ct_get_integers)
VALUES(fmi2GetBoolean, GET, fmi2Boolean, ct_get_booleans)
VALUES(fmi2GetString, GET, fmi2String, ct_get_strings)
VALUES(fmi2SetReal, SET, const fmi2Real, ct_set_reals)
VALUES(fmi2SetInteger, SET, const fmi2Integer, ct_set_integers)
VALUES(fmi2SetBoolean, SET, const fmi2Boolean, ct_set_booleans)
VALUES(fmi2SetString, SET, const fmi2String, ct_set_strings)

fmi2Status fmi2SetRealInputDerivatives(fmi2Component component, const fmi2ValueReference references[], size_t n,
                                       const fmi2Integer orders[], const fmi2Real values[]) {
    struct ct_instance *one = component;
    return allowed(one, SET_RATES) ? ct_set_rates(one, references, n, orders, values) : fmi2Error;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component, const fmi2ValueReference references[], size_t n,
                                        const fmi2Integer orders[], fmi2Real values[]) {
    struct ct_instance *one = component;
    return allowed(one, GET_RATES) ? ct_get_rates(one, references, n, orders, values) : fmi2Error;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference unknowns[], size_t n_unknowns,
                                        const fmi2ValueReference knowns[], size_t n_knowns, const fmi2Real changes[],
                                        fmi2Real results[]) {
    struct ct_instance *one = component;
    if (!allowed(one, GET_DERIVATIVES)) return fmi2Error;
    return ct_get_derivatives(one, unknowns, n_unknowns, knowns, n_knowns, changes, results);
}

/* ---------------------------------------------------------------- states */

static fmi2Status no_state(const struct ct_instance *one) {
    return ct_refuse(&one->host, "no FMU state, or no place for one, was given");
}

fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *state) {
    struct ct_instance *one = component;
    if (!allowed(one, STATES)) return fmi2Error;
    if (state == NULL) return no_state(one);
    struct ct_snapshot *snapshot = *state;
    const fmi2Status status = ct_get_state(one, &snapshot);
    *state = snapshot;
    return status;
}

fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate state) {
    struct ct_instance *one = component;
    if (!allowed(one, STATES)) return fmi2Error;
    return state == NULL ? no_state(one) : ct_set_state(one, state);
}

fmi2Status fmi2FreeFMUstate(fmi2Component component, fmi2FMUstate *state) {
    struct ct_instance *one = component;
    if (!allowed(one, STATES)) return fmi2Error;
    if (state != NULL) {
        ct_release(&one->host, *state);
        *state = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate state, size_t *size) {
    struct ct_instance *one = component;
    if (!allowed(one, STATES)) return fmi2Error;
    if (state == NULL || size == NULL || !ct_is_state(state)) return no_state(one);
    *size = (size_t)((const struct ct_snapshot *)state)->bytes;
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    struct ct_instance *one = component;
    if (!allowed(one, STATES)) return fmi2Error;
    return state == NULL || bytes == NULL ? no_state(one) : ct_serialize(one, state, bytes, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    struct ct_instance *one = component;
    if (!allowed(one, STATES)) return fmi2Error;
    if (bytes == NULL || state == NULL) return no_state(one);
    struct ct_snapshot *snapshot = NULL;
    const fmi2Status status = ct_deserialize(one, bytes, size, &snapshot);
    if (status == fmi2OK) *state = snapshot;
    return status;
}

/* ---------------------------------------------------------------- steps */

static void warn_if_coarse(struct ct_instance *one, double step) {
    if (one->warned || one->speed == CT_NONE) return;
    const double speed = one->values[one->speed], degrees = speed * step / DEGREE;
    if (!(degrees > COARSE_STEP * (1.0 + ROUNDING))) return;
    one->warned = true;
    ct_log(&one->host, fmi2Warning,
           "a communication step of %.3g s is %.1f degrees of crank angle; the model sub-steps inside, but inputs and "
           "outputs are sampled that coarsely. For 1 degree use %.2g s (fmpy: --output-interval %.2g)",
           step, degrees, DEGREE / speed, DEGREE / speed);
}

/* Say once that a step took all the work that it may. */
static void warn_if_limited(struct ct_instance *one, double time) {
    if (one->told_limit || one->limited >= one->now->n_point || one->state[one->limited] == 0.0) return;
    one->told_limit = true;
    ct_log(&one->host, fmi2Warning,
           "the step from %.9g s took the work that is allowed and went on at less accuracy; solver.limited tells of "
           "others",
           time);
}

/* Refuse a step that cannot be taken from here. */
static fmi2Status check_step(const struct ct_instance *one, double time, double step) {
    char first[CT_NUMBER], second[CT_NUMBER];
    const double stands = one->state[0];
    /* The model lags by what slivers of time it has left to the next step. */
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
        return ct_refuse(&one->host, "a step to %s s leads beyond the stop time of %s s, which setupExperiment was given",
                         ct_number(first, time + step), ct_number(second, one->now->stop_time));
    }
    return fmi2OK;
}

/* What became of a step that the kernels did not take. */
static fmi2Status failed_step(struct ct_instance *one, int64_t code) {
    enum ct_status_kind kind;
    const char *text = ct_status_text(&one->file, code, &kind);
    if (kind == CT_STATUS_ERROR) return ct_refuse(&one->host, "%s at %.9g s", text, one->state[0]);
    ct_log(&one->host, fmi2Discard, "step failed at t = %.6g s: %s", one->state[0], text);
    one->now->phase = CT_FAILED;
    return fmi2Discard;
}

fmi2Status fmi2DoStep(fmi2Component component, fmi2Real time, fmi2Real step, fmi2Boolean no_state_before) {
    struct ct_instance *one = component;
    (void)no_state_before;
    if (one != NULL && (one->now->phase & (CT_INSTANTIATED | CT_INITIALIZING)) != 0) {
        return ct_refuse(&one->host, "doStep before the initialization is complete; call exitInitializationMode first");
    }
    if (one != NULL && one->now->phase == CT_TERMINATED) {
        return ct_refuse(&one->host, "doStep on an instance that is terminated; reset it, or set a state");
    }
    if (!allowed(one, DO_STEP) || check_step(one, time, step) != fmi2OK) return fmi2Error;
    warn_if_coarse(one, step);
    const int64_t code = ct_advance_model(one, time + step);
    if (code != 0) return failed_step(one, code);
    if (one->model.input_rates != NULL) { /* they held for this step */
        for (uint32_t k = 0; k < one->n_inputs; ++k) one->rates[k] = NAN;
    }
    one->now->phase = CT_STEPPED;
    warn_if_limited(one, time);
    return fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component component) {
    const struct ct_instance *one = component;
    if (!allowed(one, CANCEL_STEP)) return fmi2Error;
    return ct_refuse(&one->host, "cancelStep, but no step is in progress: doStep returns when it is done");
}

/* ---------------------------------------------------------------- status */

/* Whether a status can be asked for; what cannot be told is discarded, as the standard says. */
static fmi2Status tell(fmi2Component component, const void *value, bool known) {
    const struct ct_instance *one = component;
    if (!allowed(one, GET_STATUS)) return fmi2Error;
    if (value == NULL) return ct_refuse(&one->host, "getStatus without a place for the status");
    if (known) return fmi2OK;
    ct_log(&one->host, fmi2Discard, "a status was asked for that this FMU does not have");
    return fmi2Discard;
}

fmi2Status fmi2GetStatus(fmi2Component component, fmi2StatusKind kind, fmi2Status *value) {
    const fmi2Status status = tell(component, value, kind == fmi2DoStepStatus);
    if (status == fmi2OK) {
        *value = ((const struct ct_instance *)component)->now->phase == CT_FAILED ? fmi2Discard : fmi2OK;
    }
    return status;
}

fmi2Status fmi2GetRealStatus(fmi2Component component, fmi2StatusKind kind, fmi2Real *value) {
    const fmi2Status status = tell(component, value, kind == fmi2LastSuccessfulTime);
    if (status == fmi2OK) *value = ct_time(component);
    return status;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component component, fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind;
    return tell(component, value, false);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component component, fmi2StatusKind kind, fmi2Boolean *value) {
    const fmi2Status status = tell(component, value, kind == fmi2Terminated);
    if (status == fmi2OK) *value = fmi2False;
    return status;
}

fmi2Status fmi2GetStringStatus(fmi2Component component, fmi2StatusKind kind, fmi2String *value) {
    (void)kind; /* of a step that is pending; none ever is */
    return tell(component, value, false);
}
