/* A C host that times a native FMU: one JSON object. See native_fmu.py.

   host LIBRARY GUID RESOURCES FIRST_INPUT LAST_INPUT FIRST_OUTPUT LAST_OUTPUT cold|calls|threads|steps|still STEP COUNT [SETTING ...]

   A setting is text:REFERENCE=TEXT or real:REFERENCE=NUMBER, set before the start; sweep:REFERENCE=LOW:HIGH:SECONDS, an
   input that goes from LOW to HIGH and back in that time of simulation; or read:REFERENCE, an output read after each
   step of mode steps. The host looks into instances, by the shim's own header, to call the kernels without the interface of FMI. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2.h"
#include "instance.h"

enum { SET = 20, GET = 40, MOST = 16 };
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
    int n_texts, n_reals, n_read, sweeps;
    unsigned texts[MOST], reals[MOST], read[MOST], swept;
    const char *text[MOST];
    double real[MOST], low, high, period;
} unit;

static double now(clockid_t clock) {
    struct timespec time;
    clock_gettime(clock, &time);
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

/* The swept input at a time, between low and high. */
static void sweep(fmi2Component one, double time) {
    if (!unit.sweeps) return;
    const double part = fmod(time / unit.period, 1.0);
    const double value = unit.low + (unit.high - unit.low) * (1.0 - fabs(1.0 - 2.0 * part));
    demand(f.fmi2SetReal(one, &unit.swept, 1, &value) == fmi2OK, "setReal");
}

static fmi2Component fresh(void) {
    fmi2Component one = f.fmi2Instantiate("timed", fmi2CoSimulation, unit.guid, unit.resources, &CALLBACKS, 0, 0);
    demand(one != NULL, "instantiate");
    for (int k = 0; k < unit.n_texts; ++k) {
        demand(f.fmi2SetString(one, unit.texts + k, 1, unit.text + k) == fmi2OK, "setString");
    }
    demand(f.fmi2SetReal(one, unit.reals, (size_t)unit.n_reals, unit.real) == fmi2OK, "setReal");
    sweep(one, 0.0);
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
        double time = one->state[0], began = now(CLOCK_MONOTONIC);
        demand(kernels->advance(one->model.run, time + unit.step) == 0, "the kernel");
        times[KERNEL][k] = now(CLOCK_MONOTONIC) - began;
        time = one->state[0];
        began = now(CLOCK_MONOTONIC);
        f.fmi2SetReal(one, set, SET, inputs);
        const double first = now(CLOCK_MONOTONIC);
        demand(f.fmi2DoStep(one, time, unit.step, 1) == fmi2OK, "doStep");
        const double second = now(CLOCK_MONOTONIC);
        f.fmi2GetReal(one, get, GET, outputs);
        const double end = now(CLOCK_MONOTONIC);
        times[STEP][k] = second - first;
        times[AROUND][k] = first - began + end - second;
        times[CLOCK][k] = now(CLOCK_MONOTONIC) - end;
    }
    unsigned *all = malloc(n_outputs * sizeof *all);
    double *values = malloc(n_outputs * sizeof *values);
    for (unsigned k = 0; k < n_outputs; ++k) all[k] = unit.first_output + k;
    f.fmi2GetReal(one, all, n_outputs, values);
    for (long k = 0; k < unit.count; ++k) {
        if (k % 10 == 0) steps(one, 1);
        f.fmi2GetReal(one, all, n_outputs, values);
        const double began = now(CLOCK_MONOTONIC);
        f.fmi2GetReal(one, all, n_outputs, values);
        times[ALL][k] = now(CLOCK_MONOTONIC) - began;
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
        double began = now(CLOCK_MONOTONIC);
        steps(first, unit.count);
        one[k] = now(CLOCK_MONOTONIC) - began;
        pthread_barrier_init(&barrier, NULL, 2);
        demand(pthread_create(&thread, NULL, run_thread, second) == 0, "a thread");
        pthread_barrier_wait(&barrier);
        began = now(CLOCK_MONOTONIC);
        steps(first, unit.count);
        pthread_join(thread, NULL);
        two[k] = now(CLOCK_MONOTONIC) - began;
        pthread_barrier_destroy(&barrier);
    }
    printf("{\"one\": %g, \"two\": %g}\n", quantile(one, TIMES, 0.5), quantile(two, TIMES, 0.5));
}

static void print_spread(const char *name, double *values, long n) {
    printf("\"%s\": {\"median\": %g, ", name, quantile(values, n, 0.5));
    printf("\"of_a_hundred\": %g, ", quantile(values, n, 0.99));
    printf("\"of_a_thousand\": %g, \"of_ten_thousand\": %g, ", quantile(values, n, 0.999), quantile(values, n, 0.9999));
    printf("\"largest\": %g}", values[n - 1]);
}

/* Wall and processor time of steps over their length, and the outputs that are read: median, 99 %, 99.9 %,
   99.99 %, largest;
   the first two hundred are left out. */
static void time_steps(void) {
    enum { WALL, OWN, READ };
    fmi2Component one = fresh();
    double *values[READ + MOST], sum = 0.0, outputs[MOST];
    for (int k = 0; k < READ + unit.n_read; ++k) values[k] = malloc((size_t)unit.count * sizeof **values);
    steps(one, 200);
    for (long k = 0; k < unit.count; ++k) {
        sweep(one, (double)k * unit.step);
        const double began = now(CLOCK_MONOTONIC), spent = now(CLOCK_THREAD_CPUTIME_ID);
        steps(one, 1);
        values[OWN][k] = (now(CLOCK_THREAD_CPUTIME_ID) - spent) / unit.step;
        values[WALL][k] = (now(CLOCK_MONOTONIC) - began) / unit.step;
        sum += values[WALL][k];
        f.fmi2GetReal(one, unit.read, (size_t)unit.n_read, outputs);
        for (int i = 0; i < unit.n_read; ++i) values[READ + i][k] = outputs[i];
    }
    printf("{\"mean\": %g, ", sum / (double)unit.count);
    print_spread("wall", values[WALL], unit.count);
    printf(", ");
    print_spread("processor", values[OWN], unit.count);
    for (int i = 0; i < unit.n_read; ++i) {
        char name[16];
        sprintf(name, "%u", unit.read[i]);
        printf(", ");
        double all = 0.0;
        for (long k = 0; k < unit.count; ++k) all += values[READ + i][k];
        print_spread(name, values[READ + i], unit.count);
        printf(", \"sum %u\": %g", unit.read[i], all);
    }
    printf("}\n");
    f.fmi2FreeInstance(one);
}

/* Longest pauses of an empty loop over the length of a step, during as many steps: what the machine itself takes. */
static void time_pauses(void) {
    const double begun = now(CLOCK_MONOTONIC), end = begun + unit.step * (double)unit.count;
    double before = begun, longest = 0.0;
    while (before < end) {
        const double time = now(CLOCK_MONOTONIC);
        longest = fmax(longest, time - before);
        before = time;
    }
    printf("{\"largest\": %g}\n", longest / unit.step);
}

/* Take a setting, see the head of the file. */
static void take(const char *setting) {
    const char *value = strchr(setting, '=');
    const unsigned reference = (unsigned)strtoul(strchr(setting, ':') + 1, NULL, 10);
    if (strncmp(setting, "text:", 5) == 0 && unit.n_texts < MOST) {
        unit.texts[unit.n_texts] = reference;
        unit.text[unit.n_texts++] = value + 1;
    } else if (strncmp(setting, "real:", 5) == 0 && unit.n_reals < MOST) {
        unit.reals[unit.n_reals] = reference;
        unit.real[unit.n_reals++] = strtod(value + 1, NULL);
    } else if (strncmp(setting, "sweep:", 6) == 0) {
        unit.swept = reference;
        unit.sweeps = sscanf(value, "=%lf:%lf:%lf", &unit.low, &unit.high, &unit.period) == 3;
    } else if (strncmp(setting, "read:", 5) == 0 && unit.n_read < MOST) {
        unit.read[unit.n_read++] = reference;
    } else {
        demand(0, setting);
    }
}

int main(int n, char **arguments) {
    demand(n >= 11, "reading of the arguments, see the head of the file,");
    const double began = now(CLOCK_MONOTONIC);
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
    for (int k = 11; k < n; ++k) take(arguments[k]);
    const char *mode = arguments[8];
    if (strcmp(mode, "cold") == 0) {
        fmi2Component one = fresh();
        steps(one, 1);
        printf("{\"seconds\": %g}\n", now(CLOCK_MONOTONIC) - began);
        f.fmi2FreeInstance(one);
    }
    if (strcmp(mode, "calls") == 0) time_calls(table(0));
    if (strcmp(mode, "threads") == 0) time_threads();
    if (strcmp(mode, "steps") == 0) time_steps();
    if (strcmp(mode, "still") == 0) time_pauses();
    return 0;
}
