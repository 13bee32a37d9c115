/* A plain FMI 2.0 master: adds up times, and ends each output interval at a time that it has added up as well.
   Rounding leaves slivers of time, which it takes as steps. */
#include <dlfcn.h>
#include <stdlib.h>

typedef void *unit;
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void *finished;
    void *environment;
} callbacks;

static void quiet(void *environment, const char *name, int status, const char *category, const char *text, ...) {}

#define CALL(result, name, ...) ((result(*)(__VA_ARGS__))dlsym(library, name))
#define CHECK(call) if ((status = (call)) != 0) return status

/* Status of the run, 0 where all went well; how many steps, and slivers below 1e-12 s; time and a value at the end. */
int run(const char *path, const char *guid, const char *resources, unsigned level, const char *crank, unsigned shown,
        double stop, double step, long *steps, long *slivers, double *end, double *value) {
    static callbacks functions = {quiet, calloc, free, NULL, NULL};
    int status = 0;
    double now = 0.0, next = 0.0;
    void *library = dlopen(path, RTLD_NOW);
    if (library == NULL) return -1;
    unit one = CALL(unit, "fmi2Instantiate", const char *, int, const char *, const char *, const callbacks *, int, int)(
        "plain", 1, guid, resources, &functions, 0, 0);
    if (one == NULL) return -2;
    CHECK(CALL(int, "fmi2SetString", unit, const unsigned *, size_t, const char *const *)(one, &level, 1, &crank));
    CHECK(CALL(int, "fmi2SetupExperiment", unit, int, double, double, int, double)(one, 0, 0.0, 0.0, 0, 0.0));
    CHECK(CALL(int, "fmi2EnterInitializationMode", unit)(one));
    CHECK(CALL(int, "fmi2ExitInitializationMode", unit)(one));
    int (*advance)(unit, double, double, int) = CALL(int, "fmi2DoStep", unit, double, double, int);
    for (*steps = *slivers = 0; now < stop;) {
        for (next += 7.0 * step; now < next; ++*steps) {
            double h = now + step < next ? step : next - now;
            CHECK(advance(one, now, h, 1));
            if (h < 1e-12) ++*slivers;
            now += h;
        }
    }
    *end = now;
    CHECK(CALL(int, "fmi2GetReal", unit, const unsigned *, size_t, double *)(one, &shown, 1, value));
    CHECK(CALL(int, "fmi2Terminate", unit)(one));
    CALL(void, "fmi2FreeInstance", unit)(one);
    return 0;
}
