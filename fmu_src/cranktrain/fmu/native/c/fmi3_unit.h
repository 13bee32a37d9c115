/* An instance in FMI 3.0: variables may be arrays, the host may be called inside a step, clocks may tick. */
#ifndef CT_FMI3_UNIT_H
#define CT_FMI3_UNIT_H

#include "fmi3.h"
#include "instance.h"

struct unit {
    struct ct_instance *model;
    fmi3IntermediateUpdateCallback update; /* NULL: a step is taken in one part */
    void *environment;                     /* argument of the callback */
    bool may_return;                       /* true if the host may end a step at an intermediate update */
    bool updating;                         /* true while the host is being called */
    bool events;                           /* true if the host uses event mode */
    uint32_t n;                            /* number of the model's variables; reference n is the time */
    uint32_t clocks;                       /* number of clocks, one per cylinder; references follow the time */
    uint32_t angle, firing;                /* references of the crank angle and of the first firing angle */
    double cycle;                          /* interval between ticks of a clock, rad */
    uint32_t gas, source;                  /* references of the array of pressures (CT_NONE if there is none) and of
                                              gas.source, whose first choice is auto */
    bool given, driven;                    /* true: pressures were set; another input was set after the start */
    uint32_t *lengths;                     /* number of elements of the variable that begins at a reference, or 0 */
    uint32_t *list;                        /* (n,) references of the elements of a call */
    int *integers;                         /* (n,) values of a call, or orders of its elements */
};

enum unit_call {
    SET_EXPERIMENT, EXIT_INITIALIZATION, TERMINATE, RESET, DO_STEP, GET, SET, GET_RATES, GET_DERIVATIVES, STATES,
    SET_LOGGING,
    ENTER_EVENT_MODE, ENTER_STEP_MODE, UPDATE_DISCRETE_STATES, GET_CLOCK /* these only with event mode */
};

/* True if a call is allowed now; otherwise, or without an instance, false with the reason in the log. */
bool ct_unit_allowed(const struct unit *unit, enum unit_call call);

/* Read which variables are arrays. Return false, with the reason in the log, if these cannot be arrays. */
bool ct_find_arrays(struct unit *unit);

/* Read which variables the clocks need. Return false, with the reason in the log, if the variables do not exist. */
bool ct_find_clocks(struct unit *unit);

/* Read which array contains the cylinder pressures. Return false if there is no such array. */
bool ct_find_gas(struct unit *unit);

/* Warn once, before a step, that inputs but no pressures are set, since the host may use other names. */
void ct_warn_without_gas(struct unit *unit);

/* Step to a checked time, or to the first dead centre before it if the host uses events and allows an early return;
   ``end`` is then the time of the dead centre. Ticking clocks are part of the FMU state. */
ct_result ct_step_to_event(struct unit *unit, double *end);

/* Leave event mode: no clock ticks any more. */
static inline void ct_end_events(struct ct_snapshot *now) {
    now->phase = CT_STEPPED;
    now->ticks = 0;
}

static inline fmi3Status ct_status3(ct_result result) { return (fmi3Status)result; }

#endif
