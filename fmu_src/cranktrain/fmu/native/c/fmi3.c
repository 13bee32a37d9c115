/* The interface of FMI 3.0.2 for co-simulation: life, steps and states; fmi3_values.c has the variables.

   As in fmi2.c a refused call returns fmi3Error, logs the reason in one line and changes nothing, and a step without a
   solution returns fmi3Discard. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "fmi3_unit.h"

static const double UPDATE = 0.5;     /* crank angle between intermediate updates, degrees */
static const double DEGREE = 3.14159265358979323846 / 180.0;
static const double ROUNDING = 1e-6;  /* relative amount by which the last interval may be longer */

enum {
    AFTER_START = CT_STEPPED | CT_FAILED | CT_TERMINATED | CT_EVENT,
    ANY = CT_INSTANTIATED | CT_INITIALIZING | AFTER_START,
    STEPPABLE = CT_STEPPED | CT_FAILED /* more than the standard requires, see fmi2.c */
};

/* Phases in which each call is allowed (section 4.2.1 of the standard). */
static const struct ct_call CALLS[] = {
    [SET_EXPERIMENT] = {"enterInitializationMode", CT_INSTANTIATED},
    [EXIT_INITIALIZATION] = {"exitInitializationMode", CT_INITIALIZING},
    [TERMINATE] = {"terminate", STEPPABLE | CT_EVENT},
    [RESET] = {"reset", ANY},
    [DO_STEP] = {"doStep", ANY}, /* ct_check_step refuses steps in wrong phases */
    [GET] = {"getting values", CT_INITIALIZING | AFTER_START},
    [SET] = {"setting values", CT_INSTANTIATED | CT_INITIALIZING | STEPPABLE | CT_EVENT},
    [GET_RATES] = {"getOutputDerivatives", AFTER_START},
    [GET_DERIVATIVES] = {"derivatives by inputs", CT_INITIALIZING | AFTER_START},
    [STATES] = {"a call for an FMU state", ANY},
    [SET_LOGGING] = {"setDebugLogging", ANY},
    [ENTER_EVENT_MODE] = {"enterEventMode", STEPPABLE},
    [ENTER_STEP_MODE] = {"enterStepMode", CT_EVENT},
    [UPDATE_DISCRETE_STATES] = {"updateDiscreteStates", CT_EVENT},
    [GET_CLOCK] = {"getClock", CT_INITIALIZING | CT_EVENT},
};
/* Calls that a host may make inside its callback. */
enum { IN_UPDATE = 1 << GET | 1 << SET | 1 << GET_RATES | 1 << GET_DERIVATIVES | 1 << SET_LOGGING };

bool ct_unit_allowed(const struct unit *unit, enum unit_call call) {
    if (unit == NULL) return false;
    if (unit->updating && (IN_UPDATE >> call & 1) == 0) {
        ct_refuse(&unit->model->host, "%s inside an intermediate update; return from it first", CALLS[call].name);
        return false;
    }
    if (call >= ENTER_EVENT_MODE && !unit->events) {
        ct_refuse(&unit->model->host, "%s, but this FMU has no %s", CALLS[call].name,
                  "event mode, or was instantiated without");
        return false;
    }
    return ct_allowed(unit->model, CALLS + call);
}

/* ---------------------------------------------------------------- life */

const char *fmi3GetVersion(void) { return "3.0"; }

static void write_line(const struct ct_host *host, ct_result result, const char *category, const char *line) {
    ((fmi3LogMessageCallback)host->logger)(host->environment, ct_status3(result), category, line);
}

static struct ct_host host_of(fmi3String name, bool logging, void *environment, fmi3LogMessageCallback log) {
    const struct ct_host host = {
        .write = log == NULL ? NULL : write_line,
        .logger = (void (*)(void))log,
        .environment = environment,
        .name = name == NULL || name[0] == '\0' ? "cranktrain" : name,
        .logging = logging,
    };
    return host;
}

/* Release all memory of a unit. */
static void dissolve(struct unit *unit, const struct ct_host *host) {
    if (unit == NULL) return;
    ct_release(host, unit->lengths);
    ct_release(host, unit->list);
    ct_release(host, unit->integers);
    if (unit->model != NULL) ct_free_instance(unit->model);
    ct_release(host, unit);
}

static struct unit *made(const struct ct_host *host, fmi3String token, fmi3String resources) {
    struct unit *unit = ct_allocate(host, sizeof *unit);
    if (unit == NULL) {
        ct_refuse(host, "no memory for an instance");
        return NULL;
    }
    unit->model = ct_new_instance(host, token, resources);
    if (unit->model != NULL) {
        unit->n = unit->model->n_variables;
        unit->lengths = ct_allocate(host, (unit->n + 1) * sizeof *unit->lengths);
        unit->list = ct_allocate(host, (unit->n + 1) * sizeof *unit->list);
        unit->integers = ct_allocate(host, (unit->n + 1) * sizeof *unit->integers);
        if (unit->lengths != NULL && unit->list != NULL && unit->integers != NULL) {
            if (ct_find_arrays(unit) && ct_find_clocks(unit) && ct_find_gas(unit)) return unit;
        } else {
            ct_refuse(host, "no memory for an instance");
        }
    }
    dissolve(unit, host);
    return NULL;
}

/* Not split further, because the arguments are the standard's. */
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference required[], size_t n_required,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    const struct ct_host host = host_of(name, logging, environment, log);
    (void)visible;
    (void)required; /* all variables are known inside a step */
    (void)n_required;
    if (name == NULL || name[0] == '\0') {
        ct_refuse(&host, "an instance without a name; the host must give one");
    } else if (token == NULL) {
        ct_refuse(&host, "no instantiation token; the host must give that of modelDescription.xml");
    } else {
        struct unit *unit = made(&host, token, resources);
        if (unit == NULL) return NULL;
        if (event_mode && unit->clocks == 0) {
            ct_refuse(&host, "this FMU has no event mode; instantiate it without");
            dissolve(unit, &host);
            return NULL;
        }
        unit->events = event_mode;
        unit->update = update;
        unit->environment = environment;
        unit->may_return = early_return;
        return unit;
    }
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    const struct ct_host host = host_of(name, logging, environment, log);
    (void)token;
    (void)resources;
    (void)visible;
    ct_refuse(&host, "this FMU is for co-simulation, not for model exchange");
    return NULL;
}

/* Not split further, because the arguments are the standard's. */
fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock) {
    const struct ct_host host = host_of(name, logging, environment, log);
    (void)token;
    (void)resources;
    (void)visible;
    (void)update;
    (void)lock;
    (void)unlock;
    ct_refuse(&host, "this FMU is for co-simulation, not for scheduled execution");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance) {
    struct unit *unit = instance;
    if (unit == NULL) return;
    if (unit->updating) {
        ct_refuse(&unit->model->host, "freeInstance inside an intermediate update; return from it first");
        return;
    }
    const struct ct_host host = {.name = NULL}; /* memory functions of the C library, as FMI 3.0 has none */
    dissolve(unit, &host);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    struct unit *unit = instance;
    if (!ct_unit_allowed(unit, SET_LOGGING)) return fmi3Error;
    if (ct_choose_categories(&unit->model->host, n, categories) != CT_OK) return fmi3Error;
    unit->model->host.logging = on;
    return fmi3OK;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop) {
    struct unit *unit = instance;
    (void)tolerance_defined; /* the model's own step and integrator determine the accuracy */
    (void)tolerance;
    if (!ct_unit_allowed(unit, SET_EXPERIMENT)) return fmi3Error;
    if (ct_set_experiment(unit->model, start, stop_defined, stop) != CT_OK) return fmi3Error;
    ct_initialize(unit->model);
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    struct unit *unit = instance;
    if (!ct_unit_allowed(unit, EXIT_INITIALIZATION)) return fmi3Error;
    const ct_result result = ct_end_initialization(unit->model);
    if (result == CT_OK && unit->events) unit->model->now->phase = CT_EVENT;
    return ct_status3(result);
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    struct unit *unit = instance;
    if (!ct_unit_allowed(unit, TERMINATE)) return fmi3Error;
    unit->model->now->phase = CT_TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    struct unit *unit = instance;
    if (!ct_unit_allowed(unit, RESET)) return fmi3Error;
    ct_reset(unit->model);
    return fmi3OK;
}

/* ---------------------------------------------------------------- states */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state) {
    struct unit *unit = instance;
    return ct_unit_allowed(unit, STATES) ? ct_status3(ct_get_state(unit->model, state)) : fmi3Error;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state) {
    struct unit *unit = instance;
    if (!ct_unit_allowed(unit, STATES) || ct_set_state(unit->model, state) != CT_OK) return fmi3Error;
    struct ct_snapshot *now = unit->model->now;
    if (!unit->events && (now->phase == CT_EVENT || now->ticks != 0)) ct_end_events(now); /* saved with events on */
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state) {
    struct unit *unit = instance;
    return ct_unit_allowed(unit, STATES) ? ct_status3(ct_free_state(unit->model, state)) : fmi3Error;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size) {
    struct unit *unit = instance;
    return ct_unit_allowed(unit, STATES) ? ct_status3(ct_state_size(unit->model, state, size)) : fmi3Error;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    struct unit *unit = instance;
    return ct_unit_allowed(unit, STATES) ? ct_status3(ct_serialize(unit->model, state, bytes, size)) : fmi3Error;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    struct unit *unit = instance;
    return ct_unit_allowed(unit, STATES) ? ct_status3(ct_deserialize(unit->model, bytes, size, state)) : fmi3Error;
}

/* ---------------------------------------------------------------- steps */

/* Call the host at a time that the model may not have reached yet; returns the new end of the step, at most ``end``.
   At a time not reached yet inputs can be set, but there are no outputs. */
static double updated(struct unit *unit, double time, bool reached, double end) {
    const bool may_return = reached && unit->may_return;
    fmi3Boolean early = false;
    fmi3Float64 early_time = time;
    unit->updating = true;
    unit->update(unit->environment, time, true, reached, reached, may_return, &early, &early_time);
    unit->updating = false;
    if (!early || !may_return) return end;
    return early_time > time ? fmin(early_time, end) : time;
}

/* Step to a time. If the model takes inputs at the stages of its integrator, the host is called for each of them
   beforehand, in the order of their times; the inputs set before the step are those at its beginning. */
static ct_result step_part(struct unit *unit, double *end) {
    struct ct_instance *one = unit->model;
    const double begin = ct_time(one);
    const uint32_t stages = unit->events ? 0 : ct_stages(one);
    for (double last = -1.0;;) {
        uint32_t next = stages;
        for (uint32_t s = 0; s < stages; ++s) {
            const double share = ct_stage_share(one, s);
            if (share > last && (next == stages || share < ct_stage_share(one, next))) next = s;
        }
        if (next == stages) break;
        last = ct_stage_share(one, next);
        if (last > 0.0) updated(unit, begin + last * (*end - begin), false, *end);
        ct_give_stage(one, next);
    }
    return ct_step_to_event(unit, end);
}

/* Step to a time in parts, with calls of the host between them; ``end`` is where the host wants to end the step. Parts
   have the length UPDATE, or that of internal steps if inputs are given at their stages. */
static ct_result step_in_parts(struct unit *unit, double time, double step, double *end) {
    const double longest = ct_stages(unit->model) > 0 ? unit->model->model.staged[CT_STAGE_STEP] / DEGREE : UPDATE;
    const double share = ct_degrees(unit->model, step) / longest;
    const double parts = fmax(1.0, ceil(share * (1.0 - ROUNDING)));
    for (double k = 1.0; k < parts; k += 1.0) {
        double point = fmin(time + step * (k / parts), *end);
        const ct_result result = step_part(unit, &point);
        if (result != CT_OK || point >= *end) return result;
        if (unit->may_return && unit->model->now->ticks != 0) {
            *end = point;
            return CT_OK;
        }
        *end = updated(unit, ct_time(unit->model), true, *end);
        if (!(*end > ct_time(unit->model))) return CT_OK;
    }
    return step_part(unit, end);
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_state_before,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last_time) {
    struct unit *unit = instance;
    (void)no_state_before;
    if (!ct_unit_allowed(unit, DO_STEP)) return fmi3Error;
    if (event == NULL || terminate == NULL || early == NULL || last_time == NULL) {
        return ct_status3(ct_refuse(&unit->model->host, "%s without a place for what it tells", "doStep"));
    }
    *event = *terminate = *early = false;
    *last_time = ct_time(unit->model);
    if (unit->model->now->phase == CT_EVENT || unit->model->now->ticks != 0) {
        return ct_status3(ct_refuse(
            &unit->model->host, "doStep before an event was handled; call enterEventMode and enterStepMode first"));
    }
    if (ct_check_step(unit->model, time, step) != CT_OK) return fmi3Error;
    ct_warn_without_gas(unit);
    double end = time + step;
    const ct_result result =
        unit->update == NULL ? ct_step_to_event(unit, &end) : step_in_parts(unit, time, step, &end);
    if (result != CT_OK) unit->model->now->ticks = 0;
    *event = unit->model->now->ticks != 0;
    *early = result == CT_OK && end < time + step;
    /* The model may lag by a tiny time difference, which is not reported to the host. */
    *last_time = result == CT_OK ? end : ct_time(unit->model);
    return ct_status3(result);
}
