/* Dead centres in FMI 3.0: output clocks that tick when cylinders reach their firing dead centres, and event mode.

   A cylinder passes its dead centre when floor((angle - its firing angle) / cycle) changes, in either direction of
   rotation. A step that passes a dead centre is undone and repeated to the time predicted by false position, until the
   crank is at the dead centre or less than NEAR behind it. The next step begins there. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3_unit.h"

static const double NEAR = 1e-6;     /* rad */
static const double SHORTEST = 4e-9; /* s: a step shorter than SHORTEST is added to the next step */
static const double TURN = 2.0 * 3.14159265358979323846;
enum { MOST_CLOCKS = 64, MOST_TURNS = 2, BISECTED = 8, MOST_TRIALS = 64 };

bool ct_find_clocks(struct unit *unit) {
    const char *text = ct_info_text(&unit->model->file, "clocks"); /* "ANGLE FIRING TURNS", see clocks.py */
    const struct ct_variable *variables = unit->model->file.variables;
    char *end;
    if (text == NULL) return true;
    const unsigned long angle = strtoul(text, &end, 10), firing = strtoul(end, &end, 10);
    const unsigned long turns = strtoul(end, &end, 10);
    if (*end != '\0' || angle >= unit->n || firing >= unit->n || turns - 1 >= MOST_TURNS ||
        variables[angle].type != CT_REAL || variables[firing].type != CT_REAL ||
        unit->lengths[firing] - 1 >= MOST_CLOCKS) {
        ct_refuse(&unit->model->host, "native.bin has %s that cannot be; unpack the FMU again", "clocks");
        return false;
    }
    unit->angle = (uint32_t)angle;
    unit->firing = (uint32_t)firing;
    unit->clocks = unit->lengths[firing];
    unit->cycle = TURN * (double)turns;
    return true;
}

/* ---------------------------------------------------------------- steps */

/* Result of a step to a time. */
struct trial {
    double angle;    /* crank angle at its end */
    uint64_t passed; /* bits of the cylinders that passed their dead centres */
    double first;    /* angle of the first of these dead centres */
};

static void look(const struct unit *unit, double from, struct trial *trial) {
    trial->passed = 0;
    for (uint32_t k = 0; k < unit->clocks; ++k) {
        const double firing = unit->model->values[unit->firing + k];
        const double begin = floor((from - firing) / unit->cycle), end = floor((trial->angle - firing) / unit->cycle);
        if (begin == end) continue;
        const double place = firing + unit->cycle * (begin < end ? begin + 1.0 : begin);
        if (trial->passed == 0 || fabs(place - from) < fabs(trial->first - from)) trial->first = place;
        trial->passed |= (uint64_t)1 << k;
    }
}

static ct_result try_step(struct unit *unit, double end, double from, struct trial *trial) {
    ct_result result = ct_step_to(unit->model, end);
    if (result == CT_OK) result = ct_get_reals(unit->model, &unit->angle, 1, &trial->angle);
    if (result == CT_OK) {
        look(unit, from, trial);
    } else {
        ct_forget_outputs(unit->model); /* outputs may belong to another trial */
    }
    return result;
}

/* Return to the beginning of the last step, at which the instance was as in ``before``. */
static void take_back(struct ct_instance *one, const struct ct_snapshot *before) {
    if (one->now->latest == before->latest) return; /* the time step was too short to move the model */
    memcpy(one->state, ct_past(one, 0), one->now->n_point * sizeof(double));
    one->now->latest = before->latest;
    one->now->n_past = before->n_past;
    one->now->end_time = before->end_time;
}

ct_result ct_step_to_event(struct unit *unit, double *end) {
    struct ct_instance *one = unit->model;
    const struct ct_snapshot before = *one->now;
    struct trial trial;
    double from;
    if (!unit->events) return ct_step_to(one, *end);
    if (ct_get_reals(one, &unit->angle, 1, &from) != CT_OK) return CT_ERROR;
    double low = ct_time(one), high = *end;
    ct_result result = try_step(unit, *end, from, &trial);
    if (result == CT_OK && trial.passed != 0 && unit->may_return) {
        const double place = trial.first;
        double ahead = from - place, behind = trial.angle - place;
        for (int k = 0; k < MOST_TRIALS && result == CT_OK; ++k) {
            const bool narrow = high - low <= SHORTEST;
            if (trial.passed != 0 && (narrow || fabs(behind) <= NEAR)) break;
            const double share = (copysign(0.5 * NEAR, behind) - ahead) / (behind - ahead);
            *end = narrow ? high : low + (high - low) * (k < BISECTED ? share : 0.5);
            take_back(one, &before);
            result = try_step(unit, *end, from, &trial);
            if (trial.passed != 0) {
                high = *end;
                behind = trial.angle - place;
            } else {
                low = *end;
                ahead = trial.angle - place;
            }
        }
    }
    if (result == CT_OK) one->now->ticks |= trial.passed;
    return result;
}

/* ---------------------------------------------------------------- event mode */

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    struct unit *unit = instance;
    if (!ct_unit_allowed(unit, ENTER_EVENT_MODE)) return fmi3Error;
    unit->model->now->phase = CT_EVENT;
    return fmi3OK;
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    struct unit *unit = instance;
    if (!ct_unit_allowed(unit, ENTER_STEP_MODE)) return fmi3Error;
    ct_end_events(unit->model->now);
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *states, fmi3Boolean *next,
                                    fmi3Float64 *next_time) {
    struct unit *unit = instance;
    if (!ct_unit_allowed(unit, UPDATE_DISCRETE_STATES)) return fmi3Error;
    if (again == NULL || terminate == NULL || nominals == NULL || states == NULL || next == NULL ||
        next_time == NULL) {
        return ct_status3(
            ct_refuse(&unit->model->host, "%s without a place for what it tells", "updateDiscreteStates"));
    }
    *again = *terminate = *nominals = *states = *next = false;
    unit->model->now->ticks = 0;
    return fmi3OK;
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference references[], size_t n, fmi3Clock values[]) {
    struct unit *unit = instance;
    if (!ct_unit_allowed(unit, GET_CLOCK)) return fmi3Error;
    const struct ct_host *host = &unit->model->host;
    if (n > 0 && (references == NULL || values == NULL)) {
        return ct_status3(ct_refuse(host, "%s values without their references", "Clock"));
    }
    for (size_t i = 0; i < n; ++i) {
        const uint32_t clock = references[i] - unit->n - 1;
        if (clock >= unit->clocks) {
            return ct_status3(ct_refuse(host, "value reference %u is unknown, no %s; see modelDescription.xml",
                                        references[i], "Clock"));
        }
        values[i] = (unit->model->now->ticks >> clock & 1) != 0;
    }
    return fmi3OK;
}
