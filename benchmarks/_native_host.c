/* A C host that times a native FMU: one JSON object. See native_fmu.py.

   host LIBRARY GUID RESOURCES FIRST_INPUT LAST_INPUT FIRST_OUTPUT LAST_OUTPUT cold|calls|threads|steps STEP COUNT [REFERENCE=TEXT ...]

   It looks into instances, by the shim's own header, to call the kernels without the interface of FMI. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "instance.h"

enum { SET = 20, GET = 40, MOST_TEXTS = 16 };
#define FUNCTIONS(X)                                                                                                \
    X(fmi2Instantiate) X(fmi2FreeInstance) X(fmi2SetupExperiment) X(fmi2EnterInitializationMode)                     \
    X(fmi2ExitInitializationMode) X(fmi2SetString) X(fmi2SetReal) X(fmi2GetReal) X(fmi2DoStep)
#define MEMBER(name) __typeof__(&name) name;
#define LOAD(name) *(void **)&f.name = dlsym(library, #name);

static struct { FUNCTIONS(MEMBER) } f;
static struct {
    const char *guid, *resources;
    unsigned first_input, last_input, first_output, last_output;
    double step;
    long count;
    int n_texts;
    unsigned references[MOST_TEXTS];
    const char *texts[MOST_TEXTS];
} unit;

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void demand(int good, const char *what) {
    if (good) return;
    fprintf(stderr, "native host: %s failed\n", what);
    exit(1);
}

static void logger(void *environment, const char *name, fmi2Status status, const char *category, const char *text, ...) {
    (void)environment;
    if (status > fmi2Warning) fprintf(stderr, "%s %s: %s\n", name, category, text);
}

static const fmi2CallbackFunctions CALLBACKS = {logger, calloc, free, NULL, NULL};

static fmi2Component fresh(void) {
    fmi2Component one = f.fmi2Instantiate("timed", fmi2CoSimulation, unit.guid, unit.resources, &CALLBACKS, 0, 0);
    demand(one != NULL, "instantiate");
    for (int k = 0; k < unit.n_texts; ++k) {
        demand(f.fmi2SetString(one, unit.references + k, 1, unit.texts + k) == fmi2OK, "setString");
    }
    demand(f.fmi2SetupExperiment(one, 0, 0.0, 0.0, 0, 0.0) == fmi2OK, "setupExperiment");
    demand(f.fmi2EnterInitializationMode(one) == fmi2OK, "enterInitializationMode");
    demand(f.fmi2ExitInitializationMode(one) == fmi2OK, "exitInitializationMode");
    return one;
}

static int order(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Value below which this part of n numbers lies; sorts them. */
static double quantile(double *values, long n, double part) {
    qsort(values, (size_t)n, sizeof *values, order);
    const long k = (long)(part * (double)(n - 1) + 0.5);
    return values[k];
}

static void steps(fmi2Component one, long n) {
    for (long k = 0; k < n; ++k) {
        demand(f.fmi2DoStep(one, ((const struct ct_instance *)one)->state[0], unit.step, 1) == fmi2OK, "doStep");
    }
}

/* Kernel, and set + doStep + get, in turn; then get of all outputs. Medians, seconds. What set and get take is measured
   as it is, less the clock: a difference of steps, a hundred times as long, would be lost in their scatter. */
static void time_calls(const struct ct_kernels *kernels) {
    enum { KERNEL, STEP, AROUND, ALL, CLOCK, KINDS };
    static unsigned set[SET], get[GET];
    static double inputs[SET], outputs[GET];
    const unsigned n_inputs = unit.last_input - unit.first_input + 1;
    const unsigned n_outputs = unit.last_output - unit.first_output + 1;
    fmi2Component component = fresh();
    struct ct_instance *one = component;
    for (unsigned k = 0; k < SET; ++k) set[k] = unit.first_input + k % n_inputs;
    for (unsigned k = 0; k < GET; ++k) get[k] = unit.first_output + k % n_outputs;
    demand(f.fmi2GetReal(one, set, SET, inputs) == fmi2OK, "getReal of inputs");
    demand(f.fmi2GetReal(one, get, GET, outputs) == fmi2OK, "getReal");
    steps(one, unit.count / 10);
    double *times[KINDS];
    for (int k = 0; k < KINDS; ++k) times[k] = malloc((size_t)unit.count * sizeof **times);
    for (long k = 0; k < unit.count; ++k) {
        double time = one->state[0], began = now();
        demand(kernels->advance(one->model.run, time + unit.step) == 0, "the kernel");
        times[KERNEL][k] = now() - began;
        time = one->state[0];
        began = now();
        f.fmi2SetReal(one, set, SET, inputs);
        const double first = now();
        demand(f.fmi2DoStep(one, time, unit.step, 1) == fmi2OK, "doStep");
        const double second = now();
        f.fmi2GetReal(one, get, GET, outputs);
        const double end = now();
        times[STEP][k] = second - first;
        times[AROUND][k] = first - began + end - second;
        times[CLOCK][k] = now() - end;
    }
    unsigned *all = malloc(n_outputs * sizeof *all);
    double *values = malloc(n_outputs * sizeof *values);
    for (unsigned k = 0; k < n_outputs; ++k) all[k] = unit.first_output + k;
    f.fmi2GetReal(one, all, n_outputs, values);
    for (long k = 0; k < unit.count; ++k) {
        if (k % 10 == 0) steps(one, 1);
        f.fmi2GetReal(one, all, n_outputs, values);
        const double began = now();
        f.fmi2GetReal(one, all, n_outputs, values);
        times[ALL][k] = now() - began;
    }
    double medians[KINDS];
    for (int k = 0; k < KINDS; ++k) medians[k] = quantile(times[k], unit.count, 0.5);
    printf("{\"kernel\": %g, \"step\": %g, \"set_get\": %g, \"get_all\": %g, \"outputs\": %u}\n", medians[KERNEL],
           medians[STEP], medians[AROUND] - 2.0 * medians[CLOCK], medians[ALL], n_outputs);
    f.fmi2FreeInstance(one);
}

static pthread_barrier_t barrier;

static void *run_thread(void *given) {
    pthread_barrier_wait(&barrier);
    steps(given, unit.count);
    return NULL;
}

/* Seconds that one and two instances take for as many steps each, medians of five, in turn. */
static void time_threads(void) {
    enum { TIMES = 5 };
    double one[TIMES], two[TIMES];
    fmi2Component first = fresh(), second = fresh();
    steps(first, unit.count / 10);
    steps(second, unit.count / 10);
    for (int k = 0; k < TIMES; ++k) {
        pthread_t thread;
        double began = now();
        steps(first, unit.count);
        one[k] = now() - began;
        pthread_barrier_init(&barrier, NULL, 2);
        demand(pthread_create(&thread, NULL, run_thread, second) == 0, "a thread");
        pthread_barrier_wait(&barrier);
        began = now();
        steps(first, unit.count);
        pthread_join(thread, NULL);
        two[k] = now() - began;
        pthread_barrier_destroy(&barrier);
    }
    printf("{\"one\": %g, \"two\": %g}\n", quantile(one, TIMES, 0.5), quantile(two, TIMES, 0.5));
}

/* Wall time of steps over their length: mean, median, 99.99 %, largest; the first two hundred are left out. */
static void time_steps(void) {
    fmi2Component one = fresh();
    double *times = malloc((size_t)unit.count * sizeof *times), sum = 0.0;
    steps(one, 200);
    for (long k = 0; k < unit.count; ++k) {
        const double began = now();
        steps(one, 1);
        times[k] = (now() - began) / unit.step;
        sum += times[k];
    }
    printf("{\"mean\": %g, \"median\": %g, ", sum / (double)unit.count, quantile(times, unit.count, 0.5));
    printf("\"of_ten_thousand\": %g, \"largest\": %g}\n", quantile(times, unit.count, 0.9999), times[unit.count - 1]);
    f.fmi2FreeInstance(one);
}

int main(int n, char **arguments) {
    demand(n >= 11, "reading of the arguments, see the head of the file,");
    const double began = now();
    void *library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
    demand(library != NULL, "loading of the library");
    FUNCTIONS(LOAD)
    const struct ct_kernels *(*table)(int);
    *(void **)&table = dlsym(library, "ct_kernels_table");
    unit.guid = arguments[2];
    unit.resources = arguments[3];
    unsigned *const places[] = {&unit.first_input, &unit.last_input, &unit.first_output, &unit.last_output};
    for (int k = 0; k < 4; ++k) *places[k] = (unsigned)strtoul(arguments[4 + k], NULL, 10);
    unit.step = strtod(arguments[9], NULL);
    unit.count = strtol(arguments[10], NULL, 10);
    for (int k = 11; k < n && unit.n_texts < MOST_TEXTS; ++k, ++unit.n_texts) {
        unit.references[unit.n_texts] = (unsigned)strtoul(arguments[k], NULL, 10);
        unit.texts[unit.n_texts] = strchr(arguments[k], '=') + 1;
    }
    const char *mode = arguments[8];
    if (strcmp(mode, "cold") == 0) {
        fmi2Component one = fresh();
        steps(one, 1);
        printf("{\"seconds\": %g}\n", now() - began);
        f.fmi2FreeInstance(one);
    }
    if (strcmp(mode, "calls") == 0) time_calls(table(0));
    if (strcmp(mode, "threads") == 0) time_threads();
    if (strcmp(mode, "steps") == 0) time_steps();
    return 0;
}
