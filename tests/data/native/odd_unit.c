/* A foreign FMU whose call fails in a way that the environment names: ODD = "call:mode", e.g. "step:signal 11";
   where the environment has ODD_UNIT, only the instance of that name fails.

   Variables of FMI 2.0 (Real): 0 is the input "in", 1 the output "out" = "in" + time. Those of FMI 3.0 (Float64) are the
   same, and 2 is the input "row" of three elements, 3 the output "sums": of the first, of two, of all three. Outputs of
   FMI 3.0 are those of the end of the last step. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <pthread.h>
#include <setjmp.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

typedef int Status;
typedef unsigned Ref;
typedef void (*Logger)(void *, const char *, Status, const char *, const char *, ...);
typedef struct {
    Logger log;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void *finished, *environment;
} Callbacks;
typedef void (*Logger3)(void *, Status, const char *, const char *);
struct unit {
    double in, time, row[3], outputs[4];
    const Callbacks *callbacks; /* of FMI 2.0 */
    Logger3 log; /* of FMI 3.0 */
    char name[64];
};
#define EXPORT __attribute__((visibility("default")))

static void *die_later(void *nothing) {
    usleep(20000);
    raise(SIGSEGV);
    return nothing;
}

static void overflow_stack(volatile char *above) {
    volatile char room[65536];
    room[0] = above ? above[0] : 0;
    overflow_stack(room);
    room[1] = room[0];
}

static void say(struct unit *one, const char *name, const char *category, const char *text) {
    if (one->callbacks == NULL) one->log(NULL, 3, category, text);
    else one->callbacks->log(NULL, name, 3, category, text);
}

/* What the environment asks of a unit; NULL for nothing. */
static const char *mode_of(const struct unit *one) {
    const char *name = getenv("ODD_UNIT");
    return name == NULL || strcmp(name, one->name) == 0 ? getenv("ODD") : NULL;
}

static bool asked(const struct unit *one, const char *mode) {
    const char *said = mode_of(one);
    return said != NULL && strcmp(said, mode) == 0;
}

/* Misbehave where the environment says so; returns the status of the call. */
static Status odd(struct unit *one, const char *call) {
    const char *said = mode_of(one);
    size_t n = strlen(call);
    if (said == NULL || strncmp(said, call, n) != 0 || said[n] != ':') return 0;
    if (strcmp(call, "step") == 0 && one->time < 0.45) return 0;
    const char *mode = said + n + 1;
    int number = 0;
    char text[] = "x";
    if (sscanf(mode, "status %d", &number) == 1) return number;
    if (sscanf(mode, "signal %d", &number) == 1) kill(getpid(), number);
    if (sscanf(mode, "exit %d", &number) == 1) exit(number);
    if (sscanf(mode, "_exit %d", &number) == 1) _exit(number);
    if (strcmp(mode, "abort") == 0) abort();
    if (strcmp(mode, "null") == 0) *(volatile int *)(uintptr_t)(one->time < 0.0) = 1;
    if (strcmp(mode, "divide") == 0) raise(SIGFPE);
    if (strcmp(mode, "stack") == 0) overflow_stack(NULL);
    if (strcmp(mode, "free twice") == 0) { void *p = malloc(8); free(p); free(p); abort(); }
    if (strcmp(mode, "hang") == 0) for (;;) usleep(1000);
    if (strcmp(mode, "spin") == 0) for (volatile int k = 0;; ++k) {}
    if (strcmp(mode, "stop") == 0) raise(SIGSTOP);
    if (strcmp(mode, "fork and crash") == 0) { if (fork() == 0) { sleep(30); _exit(0); } raise(SIGSEGV); }
    if (strcmp(mode, "fork and exit") == 0) { if (fork() == 0) { sleep(30); _exit(0); } _exit(5); }
    if (strcmp(mode, "thread crashes") == 0) { pthread_t t; pthread_create(&t, NULL, die_later, NULL); sleep(5); }
    if (strcmp(mode, "close files") == 0) { for (int k = 3; k < 256; ++k) close(k); for (;;) usleep(1000); }
    if (strcmp(mode, "close and exit") == 0) { for (int k = 0; k < 256; ++k) close(k); _exit(0); }
    if (strcmp(mode, "no memory") == 0) { struct rlimit none = {1, 1}; setrlimit(RLIMIT_AS, &none); return 3; }
    if (strcmp(mode, "no files") == 0) { struct rlimit none = {3, 3}; setrlimit(RLIMIT_NOFILE, &none); return 3; }
    if (strcmp(mode, "no room") == 0) {
        struct rlimit none = {0, 0};
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &none);
    }
    if (strcmp(mode, "elsewhere") == 0 && chdir("/") != 0) return 3;
    if (strcmp(mode, "print") == 0 && write(1, text, 1) < 0) return 3;
    if (strcmp(mode, "log nothing") == 0) { say(one, NULL, NULL, NULL); return 3; }
    if (strcmp(mode, "log bytes") == 0) { say(one, one->name, "x", "\xff\xfe\x1b[2J"); return 3; }
    if (strcmp(mode, "log long") == 0) {
        char *much = malloc(1 << 20);
        memset(much, 'x', (1 << 20) - 1);
        much[(1 << 20) - 1] = 0;
        say(one, one->name, "x", much);
        free(much);
        return 3;
    }
    if (strcmp(mode, "log much") == 0) {
        for (int k = 0; k < 20000; ++k) say(one, one->name, "x", "message");
        return 3;
    }
    return 0;
}

/* The first of the values that are read, where the environment says so; returns the status of the call. */
static Status odd_value(struct unit *own, double *values) {
    if (own->time <= 0.45) return 0;
    if (asked(own, "value:nan")) values[0] = 0.0 / 0.0 * (own->time + 1.0);
    if (asked(own, "value:inf")) values[0] = 1.0 / (own->time - own->time);
    if (asked(own, "value:huge")) values[0] = 1.7e308;
    return odd(own, "get");
}

/* ---------------------------------------------------------------- FMI 2.0 */

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *where, const Callbacks *callbacks,
                             int visible, int logging) {
    struct unit *one = calloc(1, sizeof *one);
    (void)kind, (void)guid, (void)where, (void)visible, (void)logging;
    one->callbacks = callbacks;
    strncpy(one->name, name, sizeof one->name - 1);
    if (odd(one, "instantiate") != 0) return NULL;
    return one;
}
EXPORT void fmi2FreeInstance(void *one) { odd(one, "free"); }
EXPORT Status fmi2SetDebugLogging(void *one, int on, size_t n, const char *const *names) {
    (void)one, (void)on, (void)n, (void)names;
    return 0;
}
EXPORT Status fmi2SetupExperiment(void *one, int t, double tolerance, double start, int e, double stop) {
    (void)t, (void)tolerance, (void)start, (void)e, (void)stop;
    return odd(one, "setup");
}
EXPORT Status fmi2EnterInitializationMode(void *one) { return odd(one, "enter"); }
EXPORT Status fmi2ExitInitializationMode(void *one) { return odd(one, "exit"); }
EXPORT Status fmi2Terminate(void *one) { return odd(one, "terminate"); }
EXPORT Status fmi2Reset(void *one) { return odd(one, "reset"); }
EXPORT Status fmi2SetReal(void *one, const Ref *refs, size_t n, const double *values) {
    for (size_t k = 0; k < n; ++k) if (refs[k] == 0) ((struct unit *)one)->in = values[k];
    return odd(one, "set");
}
EXPORT Status fmi2GetReal(void *one, const Ref *refs, size_t n, double *values) {
    struct unit *own = one;
    for (size_t k = 0; k < n; ++k) values[k] = refs[k] == 0 ? own->in : own->in + own->time;
    return odd_value(own, values);
}
EXPORT Status fmi2DoStep(void *one, double time, double size, int no_set) {
    (void)no_set;
    ((struct unit *)one)->time = time;
    Status status = odd(one, "step");
    ((struct unit *)one)->time = time + size;
    return status;
}
#define REST(name) EXPORT Status name(void *one) { (void)one; return 3; }
REST(fmi2GetInteger) REST(fmi2GetBoolean) REST(fmi2GetString) REST(fmi2SetInteger) REST(fmi2SetBoolean)
REST(fmi2SetString) REST(fmi2GetFMUstate) REST(fmi2SetFMUstate) REST(fmi2FreeFMUstate)
REST(fmi2SerializedFMUstateSize) REST(fmi2SerializeFMUstate) REST(fmi2DeSerializeFMUstate)
REST(fmi2GetDirectionalDerivative) REST(fmi2SetRealInputDerivatives) REST(fmi2GetRealOutputDerivatives)
REST(fmi2CancelStep) REST(fmi2GetStatus) REST(fmi2GetRealStatus) REST(fmi2GetIntegerStatus)
REST(fmi2GetBooleanStatus) REST(fmi2GetStringStatus)

/* ---------------------------------------------------------------- FMI 3.0 */

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }
EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *where, bool visible, bool logging,
                                         bool events, bool early, const Ref *refs, size_t n, void *environment, Logger3 log,
                                         void *update) {
    struct unit *one = calloc(1, sizeof *one);
    (void)token, (void)where, (void)visible, (void)logging, (void)events, (void)early, (void)refs, (void)n;
    (void)environment, (void)update;
    one->log = log;
    strncpy(one->name, name, sizeof one->name - 1);
    if (odd(one, "instantiate") != 0) return NULL;
    return one;
}
EXPORT void fmi3FreeInstance(void *one) { odd(one, "free"); }
EXPORT Status fmi3EnterInitializationMode(void *one, bool t, double tolerance, double start, bool s, double stop) {
    (void)t, (void)tolerance, (void)start, (void)s, (void)stop;
    Status status = odd(one, "setup");
    return status != 0 ? status : odd(one, "enter");
}
EXPORT Status fmi3ExitInitializationMode(void *one) { return odd(one, "exit"); }
EXPORT Status fmi3Terminate(void *one) { return odd(one, "terminate"); }
EXPORT Status fmi3SetFloat64(void *one, const Ref *refs, size_t n, const double *values, size_t m) {
    struct unit *own = one;
    const double *end = values + m;
    for (size_t k = 0; k < n; ++k) {
        if (refs[k] != 0 && refs[k] != 2) return 3;
        size_t size = refs[k] == 2 ? 3 : 1;
        if (values + size > end) return 3;
        memcpy(refs[k] == 2 ? own->row : &own->in, values, size * sizeof *values);
        values += size;
        if (refs[k] == 2 && own->time > 0.45 && asked(own, "row:refused")) return 3;
    }
    if (values != end) return 3;
    return own->time > 0.45 ? odd(own, "set") : 0;
}
EXPORT Status fmi3GetFloat64(void *one, const Ref *refs, size_t n, double *values, size_t m) {
    struct unit *own = one;
    double *next = values, *end = values + m;
    for (size_t k = 0; k < n; ++k) {
        if (refs[k] != 1 && refs[k] != 3) return 3;
        size_t size = refs[k] == 3 ? 3 : 1;
        if (next + size > end) return 3;
        memcpy(next, own->outputs + (refs[k] == 3), size * sizeof *next);
        next += size;
    }
    if (next != end) return 3;
    return odd_value(own, values);
}
EXPORT Status fmi3DoStep(void *one, double time, double size, bool no_set, bool *event, bool *ended, bool *early,
                         double *reached) {
    struct unit *own = one;
    (void)no_set;
    own->time = time;
    Status status = odd(own, "step");
    const bool now = time > 0.45;
    *event = now && asked(own, "step:event");
    *ended = now && asked(own, "step:ended");
    *early = now && (asked(own, "step:early") || asked(own, "step:early and status 3"));
    if (now && asked(own, "step:early and status 3")) status = 3;
    own->time = *reached = time + (*early ? 0.5 : 1.0) * size;
    own->outputs[0] = own->in + own->time;
    for (int k = 0; k < 3; ++k) own->outputs[1 + k] = own->row[k] + (k == 0 ? 0.0 : own->outputs[k]);
    return status;
}
#define VALUES(type) REST(fmi3Get##type) REST(fmi3Set##type)
VALUES(Float32) VALUES(Int8) VALUES(UInt8) VALUES(Int16) VALUES(UInt16) VALUES(Int32) VALUES(UInt32) VALUES(Int64)
VALUES(UInt64) VALUES(Boolean) VALUES(String) VALUES(Binary) VALUES(Clock) VALUES(FMUState) VALUES(IntervalDecimal)
VALUES(IntervalFraction) VALUES(ShiftDecimal) VALUES(ShiftFraction) VALUES(ContinuousStates)
REST(fmi3InstantiateModelExchange) REST(fmi3InstantiateScheduledExecution) REST(fmi3Reset) REST(fmi3SetDebugLogging)
REST(fmi3EnterEventMode) REST(fmi3EnterStepMode) REST(fmi3EnterConfigurationMode) REST(fmi3ExitConfigurationMode)
REST(fmi3FreeFMUState) REST(fmi3SerializedFMUStateSize) REST(fmi3SerializeFMUState) REST(fmi3DeserializeFMUState)
REST(fmi3GetNumberOfVariableDependencies) REST(fmi3GetVariableDependencies) REST(fmi3GetDirectionalDerivative)
REST(fmi3GetAdjointDerivative) REST(fmi3EvaluateDiscreteStates) REST(fmi3UpdateDiscreteStates)
REST(fmi3EnterContinuousTimeMode) REST(fmi3CompletedIntegratorStep) REST(fmi3SetTime)
REST(fmi3GetContinuousStateDerivatives) REST(fmi3GetEventIndicators) REST(fmi3GetNominalsOfContinuousStates)
REST(fmi3GetNumberOfEventIndicators) REST(fmi3GetNumberOfContinuousStates) REST(fmi3GetOutputDerivatives)
REST(fmi3ActivateModelPartition)
