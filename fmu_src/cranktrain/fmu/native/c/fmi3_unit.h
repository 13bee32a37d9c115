/* An instance as FMI 3.0 sees it: its variables may be arrays, a host may be called inside a step, clocks may tick. */
#ifndef CT_FMI3_UNIT_H
#define CT_FMI3_UNIT_H

#include "fmi3.h"
#include "instance.h"

struct unit {
    struct ct_instance *model;
    fmi3IntermediateUpdateCallback update; /* NULL: steps are taken in one */
    void *environment;                     /* that it is given */
    bool may_return;                       /* whether a host may end a step at an intermediate update */
    bool updating;                         /* whether the host is being called */
    bool events;                           /* whether the host uses event mode */
    uint32_t n;                            /* variables of the model; the reference n is the time */
    uint32_t clocks;                       /* with the references behind it, one for each cylinder; 0: there are none */
    uint32_t angle, firing;                /* references of the crank's angle and of the first firing angle */
    double cycle;                          /* from tick to tick of a clock, rad */
    uint32_t gas, source;                  /* references of the array of pressures, CT_NONE: there is none, and of
                                              gas.source, whose first choice is auto */
    bool given, driven;                    /* whether pressures were set; whether another input was, after the start */
    uint32_t *lengths;                     /* elements of the variable that begins at each reference, 0: of none */
    uint32_t *list;                        /* (n,) references of the elements of a call */
    int *integers;                         /* (n,) values of a call, or orders of its elements */
};

enum unit_call {
    SET_EXPERIMENT, EXIT_INITIALIZATION, TERMINATE, RESET, DO_STEP, GET, SET, GET_RATES, GET_DERIVATIVES, STATES,
    SET_LOGGING,
    ENTER_EVENT_MODE, ENTER_STEP_MODE, UPDATE_DISCRETE_STATES, GET_CLOCK /* these with event mode only */
};

/* Whether a call is allowed now; false with the reason in the log, and where there is no instance. */
bool ct_unit_allowed(const struct unit *unit, enum unit_call call);

/* Read which variables are arrays; false where the data name ones that cannot be, with the reason in the log. */
bool ct_find_arrays(struct unit *unit);

/* Likewise which are its clocks. */
bool ct_find_clocks(struct unit *unit);

/* Read which array is its pressures; false where it cannot be. */
bool ct_find_gas(struct unit *unit);

/* Say once, before a step, that inputs drive the unit but pressures do not: what a host gives may have other names. */
void ct_warn_without_gas(struct unit *unit);

/* Step to a time that was checked or, where the host uses events and lets a step end early, to the first dead centre
   before it, whose time ``end`` is then. Clocks that tick are in the FMU state. */
ct_result ct_step_to_event(struct unit *unit, double *end);

/* Go out of event mode. */
static inline void ct_end_events(struct ct_snapshot *now) {
    now->phase = CT_STEPPED;
    now->ticks = 0;
}

static inline fmi3Status ct_status3(ct_result result) { return (fmi3Status)result; }

#endif
