/* What both plain hosts do with an FMU: one run with its states, runs in threads, and what is asked of the command.

   A host that includes this has before it: ``f``, the FMU's functions; ``unit`` with ``n_values``, how many values all
   outputs have; the types Instance, State, Byte and Update, which is a call inside of steps or nothing;
   ``struct place`` with ``name``, ``one`` and ``quiet``; CALL, the function of its version from the names in both;
   ``fresh``, ``start``, ``steps`` and ``read_outputs``. */
#ifndef HOST_RUNS_H
#define HOST_RUNS_H

static double *room(void) { return malloc(unit.n_values * sizeof(double)); }

static void compare(const double *values, const double *others, const char *what) {
    if (memcmp(values, others, unit.n_values * sizeof *values) != 0) fail(what);
}

/* Outputs after ``count`` steps, found in several ways. */
static void run(const char *name, long count, Update update, double *values) {
    double *again = room();
    State state = NULL, other = NULL;
    size_t size = 0;
    struct place here = {.name = name}, there = {.name = name, .quiet = true};
    fresh(&here, update);
    fresh(&there, update);
    Instance one = here.one, two = there.one;
    start(one);
    steps(one, 0, count / 2);
    demand(CALL(GetFMUstate, GetFMUState)(one, &state), "getFMUState");
    demand(CALL(SerializedFMUstateSize, SerializedFMUStateSize)(one, state, &size), "serializedFMUStateSize");
    Byte *bytes = malloc(size);
    demand(CALL(SerializeFMUstate, SerializeFMUState)(one, state, bytes, size), "serializeFMUState");
    steps(one, count / 2, count);
    read_outputs(one, values);
    demand(CALL(SetFMUstate, SetFMUState)(one, state), "setFMUState");
    steps(one, count / 2, count);
    read_outputs(one, again);
    compare(values, again, "a restored state does not go on as before");
    demand(CALL(DeSerializeFMUstate, DeserializeFMUState)(two, bytes, size, &other), "deserializeFMUState");
    demand(CALL(SetFMUstate, SetFMUState)(two, other), "setFMUState in another instance");
    steps(two, count / 2, count);
    read_outputs(two, again);
    compare(values, again, "another instance does not go on as the first");
    demand(CALL(Terminate, Terminate)(one), "terminate");
    demand(CALL(Reset, Reset)(one), "reset");
    start(one);
    steps(one, 0, count);
    read_outputs(one, again);
    compare(values, again, "a reset instance does not run as a fresh one");
    demand(CALL(FreeFMUstate, FreeFMUState)(one, &state), "freeFMUState");
    demand(CALL(FreeFMUstate, FreeFMUState)(two, &other), "freeFMUState");
    CALL(FreeInstance, FreeInstance)(one);
    CALL(FreeInstance, FreeInstance)(two);
    free(bytes);
    free(again);
}

struct job { long count; double *values; thread thread; };

static BEGIN run_job(void *given) {
    struct job *job = given;
    run("thread", job->count, NULL, job->values);
    return 0;
}

static void run_threads(long n, long count, double *values) {
    struct job *jobs = calloc((size_t)n, sizeof *jobs);
    for (long k = 0; k < n; ++k) {
        jobs[k] = (struct job){.count = count, .values = room()};
        if (begin(&jobs[k].thread, run_job, jobs + k) != 0) fail("no thread");
    }
    for (long k = 0; k < n; ++k) end(jobs[k].thread);
    memcpy(values, jobs[0].values, unit.n_values * sizeof *values);
    for (long k = 0; k < n; ++k) {
        compare(values, jobs[k].values, "threads differ");
        free(jobs[k].values);
    }
    free(jobs);
}

/* Do what is asked, "run|threads|fuzz COUNT SEED", and print the outputs' bits. */
static void answer(char **asked, void (*fuzz)(long count, uint64_t seed, double *values)) {
    const long count = strtol(asked[1], NULL, 10);
    const uint64_t seed = strtoull(asked[2], NULL, 10) + 88172645463325252u;
    double *values = room();
    if (strcmp(asked[0], "run") == 0) run("one", count, NULL, values);
    if (strcmp(asked[0], "threads") == 0) run_threads(count, 50, values);
    if (strcmp(asked[0], "fuzz") == 0) fuzz(count, seed, values);
    for (size_t k = 0; k < unit.n_values; ++k) printf("%a\n", values[k]);
    free(values);
}

/* What becomes of calls at random, by status. */
static void tell(long count, const long *by_status) {
    fprintf(stderr, "%ld calls: %ld ok, %ld discarded, %ld refused\n", count, by_status[0], by_status[2], by_status[3]);
}

#endif
