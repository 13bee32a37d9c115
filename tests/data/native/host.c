/* A plain host of a native FMU: no Python anywhere. It runs one, runs many in threads, or calls it at random.

   host LIBRARY GUID RESOURCES VARIABLES FIRST LAST STEP run|threads|fuzz COUNT SEED [REFERENCE=TEXT ...]

   VARIABLES is how many there are, FIRST to LAST are references of Real outputs, STEP is in s. ``run`` takes COUNT steps
   and prints the outputs' bits, after it has saved, restored, serialized, reset and run again to the same bits;
   ``threads`` does so in COUNT threads at once; ``fuzz`` makes COUNT calls, most of them wrong, and then runs. */
#include "fmi2.h"
#include "host_parts.h"

#define FUNCTIONS(X)                                                                                                  \
    X(fmi2GetTypesPlatform) X(fmi2GetVersion) X(fmi2Instantiate) X(fmi2FreeInstance) X(fmi2SetDebugLogging)            \
    X(fmi2SetupExperiment) X(fmi2EnterInitializationMode) X(fmi2ExitInitializationMode) X(fmi2Terminate) X(fmi2Reset)  \
    X(fmi2GetReal) X(fmi2GetInteger) X(fmi2GetBoolean) X(fmi2GetString)                                                \
    X(fmi2SetReal) X(fmi2SetInteger) X(fmi2SetBoolean) X(fmi2SetString)                                                \
    X(fmi2GetFMUstate) X(fmi2SetFMUstate) X(fmi2FreeFMUstate) X(fmi2SerializedFMUstateSize) X(fmi2SerializeFMUstate)   \
    X(fmi2DeSerializeFMUstate) X(fmi2GetDirectionalDerivative) X(fmi2SetRealInputDerivatives)                          \
    X(fmi2GetRealOutputDerivatives) X(fmi2DoStep) X(fmi2CancelStep) X(fmi2GetStatus) X(fmi2GetRealStatus)              \
    X(fmi2GetIntegerStatus) X(fmi2GetBooleanStatus) X(fmi2GetStringStatus)

static struct { FUNCTIONS(MEMBER) } f; /* the FMU's functions, found before any thread begins */
static struct {
    const char *guid, *resources;
    size_t variables;
    unsigned first, last;
    size_t n_values;
    double step;
    int n_texts;
    unsigned references[16];
    const char *texts[16];
} unit;

typedef fmi2Component Instance;
typedef fmi2FMUstate State;
typedef fmi2Byte Byte;
typedef void *Update;
#define CALL(two, three) f.fmi2##two

/* An instance and what it may say. */
struct place {
    const char *name;
    fmi2Component one;
    bool quiet;
};

static void logger(void *quiet, const char *name, fmi2Status status, const char *category, const char *format, ...) {
    char line[8192];
    va_list values;
    va_start(values, format);
    vsnprintf(line, sizeof line, format, values);
    va_end(values);
    if (strncmp(line, name, strlen(name)) != 0 || strchr(line, '\n') != NULL) fail("a line in the log is not one of ours");
    if (quiet == NULL) fprintf(stderr, "%s %d: %s\n", category, status, line);
}

static const fmi2CallbackFunctions SPEAKING = {logger, calloc, free, NULL, NULL};
static const fmi2CallbackFunctions QUIET = {logger, NULL, NULL, NULL, &unit};

static void demand(fmi2Status status, const char *what) {
    if (status != fmi2OK) fail(what);
}

static void fresh(struct place *place, Update none) {
    (void)none;
    place->one = f.fmi2Instantiate(place->name, fmi2CoSimulation, unit.guid, unit.resources,
                                   place->quiet ? &QUIET : &SPEAKING, 0, 0);
    if (place->one == NULL) fail("no instance");
}

static void start(fmi2Component one) {
    for (int k = 0; k < unit.n_texts; ++k) demand(f.fmi2SetString(one, unit.references + k, 1, unit.texts + k), "a text");
    demand(f.fmi2SetupExperiment(one, 0, 0.0, 0.0, 0, 0.0), "setupExperiment");
    demand(f.fmi2EnterInitializationMode(one), "enterInitializationMode");
    demand(f.fmi2ExitInitializationMode(one), "exitInitializationMode");
}

static void steps(fmi2Component one, long first, long end) {
    for (long k = first; k < end; ++k) demand(f.fmi2DoStep(one, (double)k * unit.step, unit.step, 1), "doStep");
}

/* All outputs into ``values``. */
static void read_outputs(fmi2Component one, double *values) {
    for (unsigned reference = unit.first; reference <= unit.last; ++reference) {
        demand(f.fmi2GetReal(one, &reference, 1, values + (reference - unit.first)), "getReal");
    }
}

#include "host_runs.h"

/* ---------------------------------------------------------------- calls at random */

struct arguments {
    unsigned *references;
    double *reals;
    int *integers;
    const char **texts;
    size_t n, n_bytes;
    char *bytes;
};

/* Arguments of a call: as many as there are variables at most, or far too many, or none, or nowhere. */
static struct arguments drawn(uint64_t *seed, struct arguments from) {
    static const char *const TEXTS[] = {"", "auto", "%s%n%d", "soft", "stiff", "linear", "\xc3\xa4", "ground"};
    static const size_t HUGE_COUNTS[] = {SIZE_MAX, SIZE_MAX / 2, (size_t)1 << 40, (size_t)1 << 32};
    const size_t few = 1 + draw(seed, 3), most = draw(seed, unit.variables + 1);
    for (size_t k = 0; k < unit.variables; ++k) {
        from.references[k] = (unsigned)draw(seed, unit.variables + 1 + draw(seed, 3));
        from.reals[k] = number(seed);
        from.integers[k] = (int)draw(seed, 9) - 3;
        from.texts[k] = draw(seed, 20) == 0 ? NULL : TEXTS[draw(seed, sizeof TEXTS / sizeof TEXTS[0])];
    }
    if (draw(seed, 50) == 0) from.references[0] = UINT32_MAX;
    from.n = draw(seed, 4) != 0 ? few : draw(seed, 4) != 0 ? most : HUGE_COUNTS[draw(seed, 4)];
    if (from.n > unit.variables && from.n < 4) from.n = unit.variables;
    if (draw(seed, 40) == 0) from.references = NULL;
    if (draw(seed, 40) == 0) from.reals = NULL;
    if (draw(seed, 40) == 0) from.integers = NULL;
    if (draw(seed, 40) == 0) from.texts = NULL;
    return from;
}

static fmi2Status value_call(fmi2Component one, uint64_t *seed, struct arguments a) {
    const struct arguments b = drawn(seed, a);
    a = b;
    switch (draw(seed, 12)) {
        case 0: return f.fmi2GetReal(one, a.references, a.n, a.reals);
        case 1: return f.fmi2GetInteger(one, a.references, a.n, a.integers);
        case 2: return f.fmi2GetBoolean(one, a.references, a.n, a.integers);
        case 3: return f.fmi2GetString(one, a.references, a.n, a.texts);
        case 4: return f.fmi2SetReal(one, a.references, a.n, a.reals);
        case 5: return f.fmi2SetInteger(one, a.references, a.n, a.integers);
        case 6: return f.fmi2SetBoolean(one, a.references, a.n, a.integers);
        case 7: return f.fmi2SetString(one, a.references, a.n, a.texts);
        case 8: return f.fmi2SetRealInputDerivatives(one, a.references, a.n, a.integers, a.reals);
        case 9: return f.fmi2GetRealOutputDerivatives(one, a.references, a.n, a.integers, a.reals);
        case 10: return f.fmi2SetDebugLogging(one, (int)draw(seed, 2), a.n > 3 ? 3 : a.n, a.texts);
        default:
            return f.fmi2GetDirectionalDerivative(one, a.references, a.n, a.references, 1, a.reals, a.reals);
    }
}

static fmi2Status status_call(fmi2Component one, uint64_t *seed) {
    const fmi2StatusKind kind = (fmi2StatusKind)draw(seed, 6);
    const int nowhere = draw(seed, 10) == 0;
    fmi2Status status;
    double real;
    int integer;
    const char *text;
    switch (draw(seed, 6)) {
        case 0: return f.fmi2GetStatus(one, kind, nowhere ? NULL : &status);
        case 1: return f.fmi2GetRealStatus(one, kind, nowhere ? NULL : &real);
        case 2: return f.fmi2GetIntegerStatus(one, kind, nowhere ? NULL : &integer);
        case 3: return f.fmi2GetBooleanStatus(one, kind, nowhere ? NULL : &integer);
        case 4: return f.fmi2GetStringStatus(one, kind, nowhere ? NULL : &text);
        default: return f.fmi2CancelStep(one);
    }
}

static fmi2Status state_call(fmi2Component one, uint64_t *seed, fmi2FMUstate *state, struct arguments *a) {
    size_t size = 0;
    switch (draw(seed, 8)) {
        case 0: return f.fmi2GetFMUstate(one, draw(seed, 20) == 0 ? NULL : state);
        case 1: return f.fmi2SetFMUstate(one, *state);
        case 2: return f.fmi2FreeFMUstate(one, draw(seed, 20) == 0 ? NULL : state);
        case 3: return f.fmi2SerializedFMUstateSize(one, *state, draw(seed, 20) == 0 ? NULL : &size);
        case 4:
            if (*state == NULL || f.fmi2SerializedFMUstateSize(one, *state, &size) != fmi2OK) return fmi2Error;
            a->bytes = realloc(a->bytes, size);
            memset(a->bytes, 0, size);
            a->n_bytes = size;
            return f.fmi2SerializeFMUstate(one, *state, a->bytes, draw(seed, 4) == 0 ? size - 1 : size);
        case 5:
            if (a->n_bytes > 0 && draw(seed, 2) == 0) a->bytes[draw(seed, a->n_bytes)] ^= (char)(1 << draw(seed, 8));
            return fmi2Error;
        case 6: return f.fmi2SerializeFMUstate(one, *state, NULL, SIZE_MAX);
        default:
            if (f.fmi2FreeFMUstate(one, state) != fmi2OK) return fmi2Error;
            return f.fmi2DeSerializeFMUstate(one, a->bytes, draw(seed, 4) == 0 ? a->n_bytes / 2 : a->n_bytes, state);
    }
}

static fmi2Status life_call(fmi2Component one, uint64_t *seed, double *time) {
    const double odd = number(seed);
    double stands = *time;
    switch (draw(seed, 24)) {
        case 0: return f.fmi2SetupExperiment(one, 1, odd, number(seed), (int)draw(seed, 2), number(seed));
        case 1: return f.fmi2EnterInitializationMode(one);
        case 2: return f.fmi2ExitInitializationMode(one);
        case 3: return draw(seed, 40) == 0 ? f.fmi2Terminate(one) : fmi2OK;
        case 4: return draw(seed, 40) == 0 ? f.fmi2Reset(one) : fmi2OK;
        case 5: return f.fmi2DoStep(one, odd, number(seed), 1);
        case 6: return f.fmi2DoStep(one, stands, odd, 0);
        case 7:
        case 8: return f.fmi2DoStep(one, stands, unit.step * 1e-9, 1); /* slivers */
        case 9: return f.fmi2DoStep(NULL, stands, unit.step, 1);
        default: break;
    }
    if (f.fmi2GetRealStatus(one, fmi2LastSuccessfulTime, &stands) != fmi2OK) return fmi2Error;
    *time = stands;
    return f.fmi2DoStep(one, stands, unit.step, 1);
}

static void fuzz(long count, uint64_t seed, double *values) {
    const size_t n = unit.variables + 4;
    struct arguments a = {calloc(n, sizeof *a.references), calloc(n, sizeof *a.reals), calloc(n, sizeof *a.integers),
                          calloc(n, sizeof *a.texts), 0, 0, NULL};
    long by_status[6] = {0};
    double time = 0.0;
    fmi2FMUstate state = NULL;
    struct place place = {.name = "fuzz 100%", .quiet = true};
    fresh(&place, NULL);
    for (long k = 0; k < count; ++k) {
        const uint64_t kind = draw(&seed, 10);
        const fmi2Status status = kind < 5   ? value_call(place.one, &seed, a)
                                  : kind < 6 ? status_call(place.one, &seed)
                                  : kind < 7 ? state_call(place.one, &seed, &state, &a)
                                             : life_call(place.one, &seed, &time);
        if (status > fmi2Error) fail("a status that no call may have");
        by_status[status]++;
        if (draw(&seed, 2000) == 0) demand(f.fmi2Reset(place.one), "reset"); /* not for ever in one phase */
        if (draw(&seed, 20000) == 0) {
            f.fmi2FreeFMUstate(place.one, &state);
            f.fmi2FreeInstance(place.one);
            fresh(&place, NULL);
        }
    }
    demand(f.fmi2FreeFMUstate(place.one, &state), "freeFMUstate");
    demand(f.fmi2Reset(place.one), "reset");
    start(place.one);
    steps(place.one, 0, 10);
    read_outputs(place.one, values);
    f.fmi2FreeInstance(place.one);
    double *again = room();
    run("after", 10, NULL, again);
    compare(values, again, "after all these calls an instance runs otherwise than a fresh one");
    tell(count, by_status);
    free(again);
    free(a.references);
    free(a.reals);
    free(a.integers);
    free(a.texts);
    free(a.bytes);
}

int main(int n, char **arguments) {
    if (n < 11) fail("host LIBRARY GUID RESOURCES VARIABLES FIRST LAST STEP run|threads|fuzz COUNT SEED [REFERENCE=TEXT]");
    void *library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) fail(dlerror());
    FUNCTIONS(LOAD)
    unit.guid = arguments[2];
    unit.resources = arguments[3];
    unit.variables = strtoul(arguments[4], NULL, 10);
    unit.first = (unsigned)strtoul(arguments[5], NULL, 10);
    unit.last = (unsigned)strtoul(arguments[6], NULL, 10);
    unit.step = strtod(arguments[7], NULL);
    for (int k = 11; k < n && unit.n_texts < 16; ++k, ++unit.n_texts) {
        unit.references[unit.n_texts] = (unsigned)strtoul(arguments[k], NULL, 10);
        unit.texts[unit.n_texts] = strchr(arguments[k], '=') + 1;
    }
    unit.n_values = unit.last - unit.first + 1;
    answer(arguments + 8, fuzz);
    dlclose(library);
    return 0;
}
