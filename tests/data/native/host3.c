/* A plain host of a native FMU by FMI 3.0, as host.c is by FMI 2.0.

   host3 LIBRARY TOKEN RESOURCES REFERENCES OUTPUTS STEP run|threads|fuzz COUNT SEED [REFERENCE=ITEM ...]

   REFERENCES is one above the highest, which is the time's, OUTPUTS are references of Float64 outputs and their sizes ("3*6,9*1"), STEP is
   in s, an ITEM is the number of an enumeration's item. What the host does is told in host.c; calls at random are made
   inside of steps, too. */
#include "fmi3.h"
#include "host_parts.h"

#define FUNCTIONS(X)                                                                                                  \
    X(fmi3GetVersion) X(fmi3InstantiateCoSimulation) X(fmi3FreeInstance) X(fmi3SetDebugLogging)                        \
    X(fmi3EnterInitializationMode) X(fmi3ExitInitializationMode) X(fmi3Terminate) X(fmi3Reset)                         \
    X(fmi3GetFloat64) X(fmi3GetInt32) X(fmi3GetInt64) X(fmi3GetBoolean) X(fmi3GetString)                               \
    X(fmi3SetFloat64) X(fmi3SetInt32) X(fmi3SetInt64) X(fmi3SetBoolean) X(fmi3SetString)                               \
    X(fmi3GetFMUState) X(fmi3SetFMUState) X(fmi3FreeFMUState) X(fmi3SerializedFMUStateSize) X(fmi3SerializeFMUState)   \
    X(fmi3DeserializeFMUState) X(fmi3GetDirectionalDerivative) X(fmi3GetAdjointDerivative)                             \
    X(fmi3GetOutputDerivatives) X(fmi3DoStep) X(fmi3GetFloat32) X(fmi3SetUInt8) X(fmi3GetClock)                        \
    X(fmi3GetNumberOfVariableDependencies) X(fmi3EnterEventMode) X(fmi3EnterStepMode) X(fmi3EnterConfigurationMode)    \
    X(fmi3GetNumberOfContinuousStates) X(fmi3ActivateModelPartition)

static struct { FUNCTIONS(MEMBER) } f; /* the FMU's functions, found before any thread begins */
static struct {
    const char *token, *resources;
    size_t references, n_outputs, n_values;
    fmi3ValueReference outputs[1024];
    size_t sizes[1024];
    double step;
    int n_items;
    fmi3ValueReference chosen[16];
    fmi3Int64 items[16];
} unit;

typedef fmi3Instance Instance;
typedef fmi3FMUState State;
typedef fmi3Byte Byte;
typedef fmi3IntermediateUpdateCallback Update;
#define CALL(two, three) f.fmi3##three

struct arguments {
    fmi3ValueReference *references, *others;
    fmi3Float64 *reals, *results;
    fmi3Int32 *integers;
    fmi3Int64 *longs;
    fmi3Boolean *flags;
    fmi3String *texts;
    fmi3Byte *bytes;
    size_t n, m, n_others, n_results, n_bytes;
};
/* What an instance gives back to the host. ``wild`` is where calls are made inside of steps. */
struct place {
    const char *name;
    fmi3Instance one;
    bool quiet;
    struct arguments *wild;
    uint64_t seed;
};

static void logger(fmi3InstanceEnvironment given, fmi3Status status, fmi3String category, fmi3String text) {
    const struct place *place = given;
    if (strncmp(text, place->name, strlen(place->name)) != 0 || strchr(text, '\n') != NULL) {
        fail("a line in the log is not one of ours");
    }
    if (!place->quiet) fprintf(stderr, "%s %d: %s\n", category, status, text);
}

static void demand(fmi3Status status, const char *what) {
    if (status != fmi3OK) fail(what);
}

static void fresh(struct place *place, Update update) {
    place->one = f.fmi3InstantiateCoSimulation(place->name, unit.token, unit.resources, false, false, false,
                                               update != NULL, NULL, 0, place, logger, update);
    if (place->one == NULL) fail("no instance");
}

static void start(fmi3Instance one) {
    for (int k = 0; k < unit.n_items; ++k) demand(f.fmi3SetInt64(one, unit.chosen + k, 1, unit.items + k, 1), "an item");
    demand(f.fmi3EnterInitializationMode(one, false, 0.0, 0.0, false, 0.0), "enterInitializationMode");
    demand(f.fmi3ExitInitializationMode(one), "exitInitializationMode");
}

static void steps(fmi3Instance one, long first, long end) {
    bool event, terminate, early;
    double last;
    for (long k = first; k < end; ++k) {
        demand(f.fmi3DoStep(one, (double)k * unit.step, unit.step, true, &event, &terminate, &early, &last), "doStep");
        if (event || terminate || early || last < (double)k * unit.step) fail("doStep says what was not");
    }
}

/* All outputs into ``values``, array by array; all at once is the same. */
static void read_outputs(fmi3Instance one, double *values) {
    double *next = values, *again = malloc(unit.n_values * sizeof *again);
    for (size_t k = 0; k < unit.n_outputs; next += unit.sizes[k++]) {
        demand(f.fmi3GetFloat64(one, unit.outputs + k, 1, next, unit.sizes[k]), "getFloat64");
    }
    demand(f.fmi3GetFloat64(one, unit.outputs, unit.n_outputs, again, unit.n_values), "getFloat64 of all");
    if (memcmp(values, again, unit.n_values * sizeof *again) != 0) fail("all at once are others");
    free(again);
}

#include "host_runs.h"

/* ---------------------------------------------------------------- calls at random */

static size_t counted(uint64_t *seed, size_t most) {
    static const size_t HUGE_COUNTS[] = {SIZE_MAX, SIZE_MAX / 2, (size_t)1 << 40, (size_t)1 << 32};
    const size_t few = draw(seed, 4), many = draw(seed, most + 1), huge = HUGE_COUNTS[draw(seed, 4)];
    return draw(seed, 4) != 0 ? few : draw(seed, 4) != 0 ? many : huge;
}

/* Arguments of a call: as many as there are variables at most, or far too many, or none, or nowhere. Where the first
   reference is of an array of outputs, there are often as many values as it has. */
static struct arguments drawn(uint64_t *seed, struct arguments from) {
    static const char *const TEXTS[] = {"", "auto", "%s%n%d", "soft", "stiff", "linear", "\xc3\xa4", "ground"};
    for (size_t k = 0; k < unit.references; ++k) {
        from.references[k] = (fmi3ValueReference)draw(seed, unit.references + 1 + draw(seed, 3));
        from.others[k] = (fmi3ValueReference)draw(seed, unit.references + 1);
        from.reals[k] = number(seed);
        from.integers[k] = (fmi3Int32)draw(seed, 9) - 3;
        from.longs[k] = draw(seed, 30) == 0 ? INT64_MIN : (fmi3Int64)draw(seed, 9) - 3;
        from.flags[k] = draw(seed, 2) != 0;
        from.texts[k] = draw(seed, 20) == 0 ? NULL : TEXTS[draw(seed, sizeof TEXTS / sizeof TEXTS[0])];
    }
    if (draw(seed, 50) == 0) from.references[0] = UINT32_MAX;
    from.n = counted(seed, unit.references);
    from.m = draw(seed, 2) != 0 ? from.n : counted(seed, unit.references);
    from.n_others = counted(seed, unit.references);
    from.n_results = draw(seed, 2) != 0 ? from.n : counted(seed, unit.references);
    if (draw(seed, 4) == 0) {
        const size_t k = draw(seed, unit.n_outputs);
        from.references[0] = unit.outputs[k];
        from.n = 1;
        from.m = from.n_results = unit.sizes[k];
        from.n_others = 1;
    }
    if (draw(seed, 40) == 0) from.references = NULL;
    if (draw(seed, 40) == 0) from.others = NULL;
    if (draw(seed, 40) == 0) from.reals = NULL;
    if (draw(seed, 40) == 0) from.results = NULL;
    if (draw(seed, 40) == 0) from.integers = NULL;
    if (draw(seed, 40) == 0) from.longs = NULL;
    if (draw(seed, 40) == 0) from.flags = NULL;
    if (draw(seed, 40) == 0) from.texts = NULL;
    return from;
}

static fmi3Status value_call(fmi3Instance one, uint64_t *seed, const struct arguments *from) {
    const struct arguments a = drawn(seed, *from);
    switch (draw(seed, 16)) {
        case 0: return f.fmi3GetFloat64(one, a.references, a.n, a.results, a.m);
        case 1: return f.fmi3GetInt32(one, a.references, a.n, a.integers, a.m);
        case 2: return f.fmi3GetInt64(one, a.references, a.n, a.longs, a.m);
        case 3: return f.fmi3GetBoolean(one, a.references, a.n, a.flags, a.m);
        case 4: return f.fmi3GetString(one, a.references, a.n, a.texts, a.m);
        case 5:
        case 6: return f.fmi3SetFloat64(one, a.references, a.n, a.reals, a.m);
        case 7: return f.fmi3SetInt32(one, a.references, a.n, a.integers, a.m);
        case 8: return f.fmi3SetInt64(one, a.references, a.n, a.longs, a.m);
        case 9: return f.fmi3SetBoolean(one, a.references, a.n, a.flags, a.m);
        case 10: return f.fmi3SetString(one, a.references, a.n, a.texts, a.m);
        case 11: return f.fmi3GetOutputDerivatives(one, a.references, a.n, a.integers, a.results, a.m);
        case 12: return f.fmi3SetDebugLogging(one, draw(seed, 2) != 0, a.n > 3 ? 3 : a.n, a.texts);
        case 13:
            return f.fmi3GetAdjointDerivative(one, a.references, a.n, a.others, a.n_others, a.reals, a.m, a.results,
                                              a.n_results);
        default:
            return f.fmi3GetDirectionalDerivative(one, a.references, a.n, a.others, a.n_others, a.reals, a.n_others,
                                                  a.results, a.n_results);
    }
}

/* Functions that the unit has for hosts that ask for them. */
static fmi3Status absent_call(fmi3Instance one, uint64_t *seed, const struct arguments *from) {
    const struct arguments a = drawn(seed, *from);
    size_t n;
    switch (draw(seed, 9)) {
        case 0: return f.fmi3GetFloat32(one, a.references, a.n, NULL, a.m);
        case 1: return f.fmi3SetUInt8(one, a.references, a.n, NULL, a.m);
        case 2: return f.fmi3GetClock(one, a.references, a.n, a.flags);
        case 3: return f.fmi3GetNumberOfVariableDependencies(one, from->references[0], draw(seed, 2) == 0 ? NULL : &n);
        case 4: return f.fmi3EnterEventMode(one);
        case 5: return f.fmi3EnterStepMode(one);
        case 6: return f.fmi3EnterConfigurationMode(one);
        case 7: return f.fmi3GetNumberOfContinuousStates(one, draw(seed, 2) == 0 ? NULL : &n);
        default: return f.fmi3ActivateModelPartition(one, from->references[0], number(seed));
    }
}

static fmi3Status state_call(fmi3Instance one, uint64_t *seed, fmi3FMUState *state, struct arguments *a) {
    size_t size = 0;
    switch (draw(seed, 8)) {
        case 0: return f.fmi3GetFMUState(one, draw(seed, 20) == 0 ? NULL : state);
        case 1: return f.fmi3SetFMUState(one, *state);
        case 2: return f.fmi3FreeFMUState(one, draw(seed, 20) == 0 ? NULL : state);
        case 3: return f.fmi3SerializedFMUStateSize(one, *state, draw(seed, 20) == 0 ? NULL : &size);
        case 4:
            if (*state == NULL || f.fmi3SerializedFMUStateSize(one, *state, &size) != fmi3OK) return fmi3Error;
            a->bytes = realloc(a->bytes, size);
            memset(a->bytes, 0, size);
            a->n_bytes = size;
            return f.fmi3SerializeFMUState(one, *state, a->bytes, draw(seed, 4) == 0 ? size - 1 : size);
        case 5:
            if (a->n_bytes > 0 && draw(seed, 2) == 0) {
                a->bytes[draw(seed, a->n_bytes)] ^= (fmi3Byte)(1 << draw(seed, 8));
            }
            return fmi3Error;
        case 6: return f.fmi3SerializeFMUState(one, *state, NULL, SIZE_MAX);
        default:
            if (f.fmi3FreeFMUState(one, state) != fmi3OK) return fmi3Error;
            return f.fmi3DeserializeFMUState(one, a->bytes, draw(seed, 4) == 0 ? a->n_bytes / 2 : a->n_bytes, state);
    }
}

/* A step whose results the host wants, or not; ``time`` is then the last at which it was successful. */
static fmi3Status step_call(fmi3Instance one, uint64_t *seed, double *time, double from, double step) {
    bool event, terminate, early;
    double last = *time;
    const bool nowhere = draw(seed, 60) == 0;
    const fmi3Status status = f.fmi3DoStep(one, from, step, draw(seed, 2) != 0, nowhere ? NULL : &event,
                                           nowhere ? NULL : &terminate, nowhere ? NULL : &early, nowhere ? NULL : &last);
    if (status == fmi3OK && !nowhere && isfinite(last)) *time = last;
    return status;
}

static fmi3Status life_call(fmi3Instance one, uint64_t *seed, double *time) {
    const double odd = number(seed);
    const fmi3ValueReference reference = (fmi3ValueReference)(unit.references - 1);
    if (draw(seed, 8) != 0) f.fmi3GetFloat64(one, &reference, 1, time, 1); /* as it stands, where it can be read */
    switch (draw(seed, 24)) {
        case 0: return f.fmi3EnterInitializationMode(one, true, odd, draw(seed, 2) != 0 ? 0.0 : number(seed),
                                                 draw(seed, 4) == 0, number(seed));
        case 1:
        case 2: return f.fmi3ExitInitializationMode(one);
        case 3: return draw(seed, 40) == 0 ? f.fmi3Terminate(one) : fmi3OK;
        case 4: return draw(seed, 40) == 0 ? f.fmi3Reset(one) : fmi3OK;
        case 5: return step_call(one, seed, time, odd, number(seed));
        case 6: return step_call(one, seed, time, *time, odd);
        case 7:
        case 8: return step_call(one, seed, time, *time, unit.step * 1e-9); /* slivers */
        case 9: return step_call(NULL, seed, time, *time, unit.step);
        case 10: return step_call(one, seed, time, *time, unit.step * 4.0); /* with calls inside */
        default: return step_call(one, seed, time, *time, unit.step);
    }
}

/* Inside of a step: values, calls that are not allowed there, and a step's early end, at any time. */
static void update(fmi3InstanceEnvironment given, fmi3Float64 time, fmi3Boolean may_set, fmi3Boolean may_get,
                   fmi3Boolean finished, fmi3Boolean may_return, fmi3Boolean *return_early, fmi3Float64 *return_time) {
    struct place *place = given;
    (void)may_set, (void)may_get, (void)finished, (void)may_return;
    if (place->wild == NULL) return;
    fmi3FMUState state = NULL;
    double odd = number(&place->seed);
    switch (draw(&place->seed, 24)) {
        case 0: value_call(place->one, &place->seed, place->wild); break;
        case 1: f.fmi3FreeInstance(place->one); break;
        case 2: f.fmi3Reset(place->one); break;
        case 3: f.fmi3GetFMUState(place->one, &state); break;
        case 4: step_call(place->one, &place->seed, &odd, time, unit.step); break;
        case 5:
            *return_early = true;
            *return_time = draw(&place->seed, 2) == 0 ? time : odd;
            break;
        default: break;
    }
    if (state != NULL) fail("a state inside of a step");
}

static struct arguments buffers(void) {
    const size_t n = unit.references + unit.n_values + 4;
    return (struct arguments){
        .references = calloc(n, sizeof(fmi3ValueReference)), .others = calloc(n, sizeof(fmi3ValueReference)),
        .reals = calloc(n, sizeof(fmi3Float64)), .results = calloc(n, sizeof(fmi3Float64)),
        .integers = calloc(n, sizeof(fmi3Int32)), .longs = calloc(n, sizeof(fmi3Int64)),
        .flags = calloc(n, sizeof(fmi3Boolean)), .texts = calloc(n, sizeof(fmi3String)),
    };
}

static void discard(struct arguments *a) {
    free(a->references), free(a->others), free(a->reals), free(a->results), free(a->integers), free(a->longs);
    free(a->flags), free(a->texts), free(a->bytes);
}

static void fuzz(long count, uint64_t seed, double *values) {
    struct arguments a = buffers(), inside = buffers();
    struct place place = {.name = "fuzz 100%", .quiet = true, .seed = seed ^ 0x9e3779b97f4a7c15u};
    long by_status[6] = {0};
    double time = 0.0;
    bool updated = true;
    fmi3FMUState state = NULL;
    fresh(&place, update);
    for (long k = 0; k < count; ++k) {
        const uint64_t kind = draw(&seed, 40);
        place.wild = &inside;
        const fmi3Status status = kind < 19   ? value_call(place.one, &seed, &a)
                                  : kind < 20 ? absent_call(place.one, &seed, &a)
                                  : kind < 24 ? state_call(place.one, &seed, &state, &a)
                                              : life_call(place.one, &seed, &time);
        place.wild = NULL;
        if (status > fmi3Error) fail("a status that no call may have");
        by_status[status]++;
        if (draw(&seed, 2000) == 0) { /* not for ever in one phase */
            demand(f.fmi3Reset(place.one), "reset");
            time = 0.0;
        }
        if (draw(&seed, 20000) == 0) {
            f.fmi3FreeFMUState(place.one, &state);
            f.fmi3FreeInstance(place.one);
            updated = draw(&seed, 4) != 0;
            fresh(&place, updated ? update : NULL);
            time = 0.0;
        }
    }
    demand(f.fmi3FreeFMUState(place.one, &state), "freeFMUState");
    demand(f.fmi3Reset(place.one), "reset");
    start(place.one);
    steps(place.one, 0, 10);
    double *reset = room(), *again = room();
    read_outputs(place.one, reset);
    f.fmi3FreeInstance(place.one);
    run("after", 10, updated ? update : NULL, again);
    compare(again, reset, "after all these calls an instance runs otherwise than a fresh one");
    run("after", 10, NULL, values);
    tell(count, by_status);
    free(again);
    free(reset);
    discard(&a);
    discard(&inside);
}

static void read_arguments(int n, char **arguments) {
    unit.token = arguments[2];
    unit.resources = arguments[3];
    unit.references = strtoul(arguments[4], NULL, 10);
    for (char *text = arguments[5]; *text != '\0'; text += *text == ',') {
        if (unit.n_outputs == 1024) fail("too many outputs");
        unit.outputs[unit.n_outputs] = (fmi3ValueReference)strtoul(text, &text, 10);
        unit.sizes[unit.n_outputs] = strtoul(text + 1, &text, 10);
        unit.n_values += unit.sizes[unit.n_outputs++];
    }
    unit.step = strtod(arguments[6], NULL);
    for (int k = 10; k < n && unit.n_items < 16; ++k, ++unit.n_items) {
        unit.chosen[unit.n_items] = (fmi3ValueReference)strtoul(arguments[k], NULL, 10);
        unit.items[unit.n_items] = strtoll(strchr(arguments[k], '=') + 1, NULL, 10);
    }
}

int main(int n, char **arguments) {
    if (n < 10) fail("host3 LIBRARY TOKEN RESOURCES REFERENCES OUTPUTS STEP run|threads|fuzz COUNT SEED [REFERENCE=ITEM]");
    void *library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) fail(dlerror());
    FUNCTIONS(LOAD)
    read_arguments(n, arguments);
    answer(arguments + 7, fuzz);
    dlclose(library);
    return 0;
}
