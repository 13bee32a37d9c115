/* Functions of FMI 3.0.2 that this FMU for co-simulation does not support; each logs this and is refused. */
#include "fmi3_unit.h"

static fmi3Status refused(fmi3Instance instance, const char *call, const char *lacking) {
    const struct unit *unit = instance;
    if (unit == NULL) return fmi3Error;
    return ct_status3(ct_refuse(&unit->model->host, "%s, but this FMU has no %s", call, lacking));
}

/* Get and set functions for a type that no variable has. */
#define ABSENT(TYPE)                                                                                                 \
    fmi3Status fmi3Get##TYPE(fmi3Instance instance, const fmi3ValueReference a[], size_t b, fmi3##TYPE c[],          \
                             size_t d) {                                                                             \
        (void)a, (void)b, (void)c, (void)d;                                                                          \
        return refused(instance, "get" #TYPE, "variables of type " #TYPE);                                           \
    }                                                                                                                \
    fmi3Status fmi3Set##TYPE(fmi3Instance instance, const fmi3ValueReference a[], size_t b, const fmi3##TYPE c[],    \
                             size_t d) {                                                                             \
        (void)a, (void)b, (void)c, (void)d;                                                                          \
        return refused(instance, "set" #TYPE, "variables of type " #TYPE);                                           \
    }
ABSENT(Float32)
ABSENT(Int8)
ABSENT(UInt8)
ABSENT(Int16)
ABSENT(UInt16)
ABSENT(UInt32)
ABSENT(UInt64)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference a[], size_t b, size_t c[], fmi3Binary d[],
                         size_t e) {
    (void)a, (void)b, (void)c, (void)d, (void)e;
    return refused(instance, "getBinary", "variables of type Binary");
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference a[], size_t b, const size_t c[],
                         const fmi3Binary d[], size_t e) {
    (void)a, (void)b, (void)c, (void)d, (void)e;
    return refused(instance, "setBinary", "variables of type Binary");
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference a[], size_t b, const fmi3Clock c[]) {
    (void)a, (void)b, (void)c;
    return refused(instance, "setClock", "input clocks");
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference a, size_t *b) {
    (void)a, (void)b;
    return refused(instance, "getNumberOfVariableDependencies", "dependencies by element");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference a, size_t b[], fmi3ValueReference c[],
                                       size_t d[], fmi3DependencyKind e[], size_t f) {
    (void)a, (void)b, (void)c, (void)d, (void)e, (void)f;
    return refused(instance, "getVariableDependencies", "dependencies by element");
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) {
    return refused(instance, "enterConfigurationMode", "structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) {
    return refused(instance, "exitConfigurationMode", "structural parameters");
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference a[], size_t b, fmi3Float64 c[],
                                  fmi3IntervalQualifier d[]) {
    (void)a, (void)b, (void)c, (void)d;
    return refused(instance, "getIntervalDecimal", "input clocks");
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference a[], size_t b, fmi3UInt64 c[],
                                   fmi3UInt64 d[], fmi3IntervalQualifier e[]) {
    (void)a, (void)b, (void)c, (void)d, (void)e;
    return refused(instance, "getIntervalFraction", "input clocks");
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference a[], size_t b, fmi3Float64 c[]) {
    (void)a, (void)b, (void)c;
    return refused(instance, "getShiftDecimal", "input clocks");
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference a[], size_t b, fmi3UInt64 c[],
                                fmi3UInt64 d[]) {
    (void)a, (void)b, (void)c, (void)d;
    return refused(instance, "getShiftFraction", "input clocks");
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference a[], size_t b,
                                  const fmi3Float64 c[]) {
    (void)a, (void)b, (void)c;
    return refused(instance, "setIntervalDecimal", "input clocks");
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference a[], size_t b, const fmi3UInt64 c[],
                                   const fmi3UInt64 d[]) {
    (void)a, (void)b, (void)c, (void)d;
    return refused(instance, "setIntervalFraction", "input clocks");
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference a[], size_t b, const fmi3Float64 c[]) {
    (void)a, (void)b, (void)c;
    return refused(instance, "setShiftDecimal", "input clocks");
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference a[], size_t b, const fmi3UInt64 c[],
                                const fmi3UInt64 d[]) {
    (void)a, (void)b, (void)c, (void)d;
    return refused(instance, "setShiftFraction", "input clocks");
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    return refused(instance, "evaluateDiscreteStates", "discrete states");
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    return refused(instance, "enterContinuousTimeMode", "model exchange");
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean a, fmi3Boolean *b, fmi3Boolean *c) {
    (void)a, (void)b, (void)c;
    return refused(instance, "completedIntegratorStep", "model exchange");
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 a) {
    (void)a;
    return refused(instance, "setTime", "model exchange");
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 a[], size_t b) {
    (void)a, (void)b;
    return refused(instance, "setContinuousStates", "model exchange");
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 a[], size_t b) {
    (void)a, (void)b;
    return refused(instance, "getContinuousStateDerivatives", "model exchange");
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 a[], size_t b) {
    (void)a, (void)b;
    return refused(instance, "getEventIndicators", "model exchange");
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 a[], size_t b) {
    (void)a, (void)b;
    return refused(instance, "getContinuousStates", "model exchange");
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 a[], size_t b) {
    (void)a, (void)b;
    return refused(instance, "getNominalsOfContinuousStates", "model exchange");
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *a) {
    (void)a;
    return refused(instance, "getNumberOfEventIndicators", "model exchange");
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *a) {
    (void)a;
    return refused(instance, "getNumberOfContinuousStates", "model exchange");
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference a, fmi3Float64 b) {
    (void)a, (void)b;
    return refused(instance, "activateModelPartition", "input clocks");
}
