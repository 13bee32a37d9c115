/* Kernels of a small model for tests of the C side: a mass on a spring, as numba would have compiled them.
   m x'' = f - c x' - law(x) with friction that the start takes from the speed. Statuses: 7 failed, 8 refused,
   9 no start, 10 parameters refused, 11 no outputs. tests/native/mock_unit.py makes the data. */
#include <math.h>
#include <stddef.h>

#include "kernels.h"

/* Arrays as numba lays them out, of one and two dimensions. */
struct vector { void *meminfo, *parent; int64_t items, itemsize; double *data; int64_t shape[1], strides[1]; };
struct matrix { void *meminfo, *parent; int64_t items, itemsize; double *data; int64_t shape[2], strides[2]; };
struct addresses { void *meminfo, *parent; int64_t items, itemsize; int64_t *data; int64_t shape[1], strides[1]; };
struct families { void *meminfo, *parent; int64_t items, itemsize; int64_t *data; int64_t shape[2], strides[2]; };

struct spring { struct vector stiffness; double scale; };
struct run {
    struct vector state, inputs;
    struct families families;
    struct vector values, numbers, model;
    struct addresses laws; /* the law, its record */
    struct matrix shared;
    int64_t free;     /* whether the mount moves as well */
    int64_t observer; /* address of what observes the first family again, for the moving flag */
    struct vector work, input_rates;
};
enum { TIME, X, V, MOUNT };                        /* state */
enum { SPEED, FORCE };                             /* inputs */
enum { DAMPING, METHOD, MASS, REPEATS, REVERSED, SCHEME }; /* numbers */
enum { INVERSE_MASS, FRICTION };                   /* model */
enum { ADDRESS, FIRST, END, MEMBERS, WANTED };     /* columns of families */
enum { POSITION, VELOCITY, ENERGY, OBSERVED, MOVING };

typedef double law(const struct spring *, double x);
typedef void observer(const struct run *, double *values);

static double linear(const struct spring *spring, double x) { return spring->scale * spring->stiffness.data[0] * x; }

static double cubic(const struct spring *spring, double x) {
    return spring->scale * spring->stiffness.data[0] * (x + spring->stiffness.data[1] * x * x * x);
}

static double spring_force(const struct run *run, double x) {
    law *force = (law *)(uintptr_t)run->laws.data[0];
    return force((const struct spring *)(uintptr_t)run->laws.data[1], x);
}

static void motion(const struct run *run, double *values) {
    values[POSITION] = run->state.data[X];
    values[VELOCITY] = run->state.data[V];
}

static void rest(const struct run *run, double *values) {
    const double v = run->state.data[V];
    const char *shared = (const char *)run->shared.data + run->shared.strides[0] + 2 * run->shared.strides[1];
    run->work.data[0] += 1.0;
    values[ENERGY - ENERGY] = 0.5 * run->numbers.data[MASS] * v * v + *(const double *)(const void *)shared;
    values[OBSERVED - ENERGY] = run->work.data[0];
    values[MOVING - ENERGY] = fabs(v) > 0.0;
}

static int64_t prepare(void *image, double unused) {
    struct run *run = image;
    (void)unused;
    if (run->numbers.data[DAMPING] > 90.0) return 10;
    run->model.data[INVERSE_MASS] = 1.0 / run->numbers.data[MASS];
    return 0;
}

static int64_t start(void *image, double time) {
    struct run *run = image;
    const double force = run->inputs.data[FORCE];
    if (force > 500.0) return 9;
    run->model.data[FRICTION] = 0.01 * run->inputs.data[SPEED];
    run->state.data[TIME] = time;
    run->state.data[X] = 1.1 * force / spring_force(run, 1.0);
    run->state.data[V] = 0.0;
    if (run->free) run->state.data[MOUNT] = 1.0;
    return 0;
}

static int64_t observe(void *image, double unused) {
    struct run *run = image;
    (void)unused;
    if (run->state.data[X] > 1e6) return 11;
    for (int64_t k = 0; k < run->families.shape[0]; ++k) {
        const int64_t *row = run->families.data + k * run->families.shape[1];
        if (row[WANTED] != 0) ((observer *)(uintptr_t)row[ADDRESS])(run, run->values.data + row[FIRST]);
    }
    if (run->families.data[WANTED] != 0) ((observer *)(uintptr_t)run->observer)(run, run->values.data);
    return 0;
}

static int64_t advance(void *image, double end) {
    struct run *run = image;
    const double time = run->state.data[TIME], rate = run->input_rates.data[FORCE], force = run->inputs.data[FORCE];
    const double c = run->numbers.data[DAMPING] + run->model.data[FRICTION];
    const int n = (int)ceil((end - time) / 1e-4 * run->numbers.data[METHOD] * run->numbers.data[REPEATS]);
    const double h = (end - time) / n, sign = run->numbers.data[REVERSED] != 0.0 ? -1.0 : 1.0;
    double x = run->state.data[X], v = run->state.data[V];
    if (force > 1000.0) return 7;
    if (force < -1000.0) return 8;
    if (force == 666.0) return 99;
    for (int i = 0; i < n; ++i) {
        const double now = isnan(rate) ? force : force + rate * h * i;
        v += h * run->model.data[INVERSE_MASS] * (sign * now - c * v - spring_force(run, x));
        x += h * v;
    }
    if (run->free) run->state.data[MOUNT] *= 0.5;
    run->state.data[TIME] = end;
    run->state.data[X] = x;
    run->state.data[V] = v;
    return observe(run, 0.0);
}

static const void *const FUNCTIONS[] = {(const void *)linear, (const void *)cubic, (const void *)motion,
                                        (const void *)rest};
static const char NAMES[] = "mock:linear\nmock:cubic\nmock:motion\nmock:rest\n";
const struct ct_kernels ct_kernels = {"0123456789abcdef", prepare, start, advance, observe, FUNCTIONS, 4, NAMES,
                                      "mock"};
