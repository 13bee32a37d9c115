/* The interface of FMI 2.0.4 for co-simulation: allowed calls in each phase, and their actions.

   A refused call returns fmi2Error, logs the reason in one line and changes nothing: the instance continues from its
   present state. A step without a solution returns fmi2Discard, with the state before the step. Nothing is fatal. */
#include "fmi2.h"

#include "instance.h"

enum call {
    SETUP_EXPERIMENT, ENTER_INITIALIZATION, EXIT_INITIALIZATION, TERMINATE, RESET, CANCEL_STEP, GET, SET,
    SET_RATES, GET_RATES, GET_DERIVATIVES, STATES, GET_STATUS, SET_LOGGING
};
enum {
    AFTER_START = CT_STEPPED | CT_FAILED | CT_TERMINATED,
    ANY = CT_INSTANTIATED | CT_INITIALIZING | AFTER_START,
    /* More than the standard requires: a failed step changes nothing, so inputs may be set and another step be tried
       from the same state without saving it before. */
    STEPPABLE = CT_STEPPED | CT_FAILED
};

/* Phases in which each call is allowed (section 4.2.4 of the standard). No step is ever pending. */
static const struct ct_call CALLS[] = {
    [SETUP_EXPERIMENT] = {"setupExperiment", CT_INSTANTIATED},
    [ENTER_INITIALIZATION] = {"enterInitializationMode", CT_INSTANTIATED},
    [EXIT_INITIALIZATION] = {"exitInitializationMode", CT_INITIALIZING},
    [TERMINATE] = {"terminate", STEPPABLE},
    [RESET] = {"reset", ANY},
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
static bool allowed(const struct ct_instance *one, enum call call) { return ct_allowed(one, CALLS + call); }

/* Convert a result to FMI's status; both enumerations have the same values. */
static fmi2Status of(ct_result result) { return (fmi2Status)result; }

typedef void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);

/* Pass a line to the host's logger, which interprets it as a format of printf. */
static void write_line(const struct ct_host *host, ct_result result, const char *category, const char *line) {
    char escaped[2 * CT_LONGEST_LINE];
    size_t n = 0;
    for (const char *c = line; *c != '\0'; ++c) {
        escaped[n++] = *c;
        if (*c == '%') escaped[n++] = '%';
    }
    escaped[n] = '\0';
    ((logger)host->logger)(host->environment, host->name, of(result), category, escaped);
}

/* ---------------------------------------------------------------- life */

const char *fmi2GetTypesPlatform(void) { return "default"; }

const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    struct ct_host host = {.name = name == NULL || name[0] == '\0' ? "cranktrain" : name, .logging = logging != 0};
    (void)visible;
    if (functions != NULL) {
        host.write = functions->logger == NULL ? NULL : write_line;
        host.logger = (void (*)(void))functions->logger;
        host.environment = functions->componentEnvironment;
        host.allocate = functions->allocateMemory;
        host.release = functions->freeMemory;
    }
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
    if (ct_choose_categories(&one->host, n, categories) != CT_OK) return fmi2Error;
    one->host.logging = on != 0;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean tolerance_defined, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean stop_defined, fmi2Real stop) {
    struct ct_instance *one = component;
    (void)tolerance_defined; /* the model's own step and integrator determine the accuracy */
    (void)tolerance;
    return allowed(one, SETUP_EXPERIMENT) ? of(ct_set_experiment(one, start, stop_defined != 0, stop)) : fmi2Error;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component component) {
    struct ct_instance *one = component;
    if (!allowed(one, ENTER_INITIALIZATION)) return fmi2Error;
    ct_initialize(one);
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
    struct ct_instance *one = component;
    return allowed(one, EXIT_INITIALIZATION) ? of(ct_end_initialization(one)) : fmi2Error;
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
        return allowed(one, CALL) ? of(work(one, references, n, values)) : fmi2Error;                               \
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
    return allowed(one, SET_RATES) ? of(ct_set_rates(one, references, n, orders, values)) : fmi2Error;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component, const fmi2ValueReference references[], size_t n,
                                        const fmi2Integer orders[], fmi2Real values[]) {
    struct ct_instance *one = component;
    return allowed(one, GET_RATES) ? of(ct_get_rates(one, references, n, orders, values)) : fmi2Error;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference unknowns[], size_t n_unknowns,
                                        const fmi2ValueReference knowns[], size_t n_knowns, const fmi2Real changes[],
                                        fmi2Real results[]) {
    struct ct_instance *one = component;
    if (!allowed(one, GET_DERIVATIVES)) return fmi2Error;
    return of(ct_get_derivatives(one, unknowns, n_unknowns, knowns, n_knowns, changes, results));
}

/* ---------------------------------------------------------------- states */

fmi2Status fmi2GetFMUstate(fmi2Component one, fmi2FMUstate *state) {
    return allowed(one, STATES) ? of(ct_get_state(one, state)) : fmi2Error;
}

fmi2Status fmi2SetFMUstate(fmi2Component one, fmi2FMUstate state) {
    return allowed(one, STATES) ? of(ct_set_state(one, state)) : fmi2Error;
}

fmi2Status fmi2FreeFMUstate(fmi2Component one, fmi2FMUstate *state) {
    return allowed(one, STATES) ? of(ct_free_state(one, state)) : fmi2Error;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component one, fmi2FMUstate state, size_t *size) {
    return allowed(one, STATES) ? of(ct_state_size(one, state, size)) : fmi2Error;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component one, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    return allowed(one, STATES) ? of(ct_serialize(one, state, bytes, size)) : fmi2Error;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component one, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    return allowed(one, STATES) ? of(ct_deserialize(one, bytes, size, state)) : fmi2Error;
}

/* ---------------------------------------------------------------- steps */

fmi2Status fmi2DoStep(fmi2Component component, fmi2Real time, fmi2Real step, fmi2Boolean no_state_before) {
    struct ct_instance *one = component;
    (void)no_state_before;
    if (one == NULL || ct_check_step(one, time, step) != CT_OK) return fmi2Error;
    return of(ct_step_to(one, time + step));
}

fmi2Status fmi2CancelStep(fmi2Component component) {
    const struct ct_instance *one = component;
    if (!allowed(one, CANCEL_STEP)) return fmi2Error;
    return of(ct_refuse(&one->host, "cancelStep, but no step is in progress: doStep returns when it is done"));
}

/* ---------------------------------------------------------------- status */

/* True if a status can be queried; a status that is not available is discarded, as the standard requires. */
static fmi2Status tell(fmi2Component component, const void *value, bool known) {
    const struct ct_instance *one = component;
    if (!allowed(one, GET_STATUS)) return fmi2Error;
    if (value == NULL) return of(ct_refuse(&one->host, "getStatus without a place for the status"));
    if (known) return fmi2OK;
    ct_log(&one->host, CT_DISCARD, "a status was asked for that this FMU does not have");
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
    (void)kind; /* kind of a pending step; no step is ever pending */
    return tell(component, value, false);
}
