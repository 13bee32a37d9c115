/* One instance: values of its variables, and after the initialization a model laid out in memory. */
#ifndef CT_INSTANCE_H
#define CT_INSTANCE_H

#include "file.h"

/* Phases of an instance, as bits for the table of allowed calls. */
enum ct_phase {
    CT_INSTANTIATED = 1, CT_INITIALIZING = 2, CT_STEPPED = 4, CT_FAILED = 8, CT_TERMINATED = 16, CT_EVENT = 32
};

/* An FMU state, and the part of an instance that such a state is a copy of. Float64 numbers follow it: values of the
   variables (options of Strings and Enumerations by index), rates of the inputs, inputs at the start, and after the
   initialization points: the present one, and the beginnings of the last steps in a ring. A point is the state vector,
   the inputs that led to it, and their rates. */
/* CT_PAST: number of past points in use. CT_PLACES: number of stored points, one of them for the step being tried. */
enum { CT_PAST = 2, CT_PLACES = CT_PAST + 1 };

struct ct_snapshot {
    char magic[8];
    char guid[40];
    uint64_t sums[2]; /* sums of a serialized state */
    uint64_t bytes;   /* length of the state with all numbers that follow it */
    uint64_t capacity;
    uint64_t ticks; /* bits of ticking clocks, set at a dead centre until the event is handled */
    uint32_t version;
    uint32_t phase;
    uint32_t variant;
    uint32_t n_point;        /* number of Float64 values in a point; 0: the state has no points */
    uint32_t n_past, latest; /* number of known past points, and which of both is the beginning of the last step */
    double start_time, stop_time, end_time; /* end_time is where the last step was to end */
};

/* The image of Run and all arrays that it points to, in one block. */
struct ct_model {
    void *block;
    void *run;
    double *inputs, *outputs, *numbers, *input_rates, *staged; /* input_rates and staged may be NULL */
    int64_t *families;
    uint64_t columns, staged_rows, staged_columns; /* columns: number of columns of families */
    bool observed;    /* true if the wanted outputs belong to the state */
};

/* An input: its reference, and its index in run.inputs. */
struct ct_input { uint32_t reference, place; };

struct ct_instance {
    struct ct_host host;
    struct ct_file file;
    struct ct_snapshot *now;
    double *values, *rates, *origin, *state; /* in the numbers after ``now``; the present point begins with ``state`` */
    double *before;                          /* (n_point,) the present point while the model is at another one */
    struct ct_input *inputs;                 /* (n_inputs,) */
    uint32_t n_inputs, n_variables;
    uint32_t speed;                          /* reference of the input with the crank's speed, or CT_NONE */
    struct ct_model model;
    bool made;                               /* true if the model belongs to the values */
    uint32_t limited;                        /* state[limited] is not 0 after a step to warn of; may be CT_NONE */
    uint32_t each_point;                     /* index in the state that, set to 1, ends an internal step at the end of
                                                the next communication step, or CT_NONE */
    bool warned, told_limit;                 /* warned of coarse steps, and by state[limited] */
    double **places;                         /* (n_variables,) address of each variable's value */
    unsigned char *ready;                    /* (n_variables,) true if the value at ``places`` is up to date */
};

/* Make an instance for a host. Return NULL if this is refused, with the reason in the log. */
struct ct_instance *ct_new_instance(const struct ct_host *host, const char *guid, const char *location);
void ct_free_instance(struct ct_instance *instance);

/* Set all variables to their start values, as after the instantiation. */
void ct_reset(struct ct_instance *instance);

/* Store the present values of the inputs as the inputs of a start. */
void ct_keep_origin(struct ct_instance *instance);

/* Row of LEVL for the values of the level parameters: number of a variant, or CT_REFUSED with a text. */
uint32_t ct_level(const struct ct_instance *instance);

/* Choose the variant by the values, lay out its memory, prepare it and start it at ``start_time`` under ``origin``.
   On an error the previous model is kept, but not its state vector. */
ct_result ct_make(struct ct_instance *instance);

/* A call: its name, and the phases in which the standard allows it. */
struct ct_call {
    char name[28]; /* an array, because a pointer would need a relocation */
    uint32_t phases;
};

/* True if a call is allowed now; otherwise, or without an instance, false with the reason in the log. */
bool ct_allowed(const struct ct_instance *instance, const struct ct_call *call);

/* Set start and stop time of the experiment. Impossible times are refused. */
ct_result ct_set_experiment(struct ct_instance *instance, double start, bool stop_defined, double stop);

/* Enter initialization mode, and leave it with a started model. */
void ct_initialize(struct ct_instance *instance);
ct_result ct_end_initialization(struct ct_instance *instance);

/* Refuse a step that cannot be taken from the present time; warn once of a coarse step. */
ct_result ct_check_step(struct ct_instance *instance, double time, double step);

/* Crank angle of a step, degrees; 0 if there is no speed. */
double ct_degrees(const struct ct_instance *instance, double step);

/* Step to a checked time. A step without a solution is discarded, and the state is unchanged. */
ct_result ct_step_to(struct ct_instance *instance, double end);

/* Mark outputs as unknown after a change of the state. */
void ct_forget_outputs(struct ct_instance *instance);

/* Past point number k: 0 is the beginning of the last step, 1 the beginning of the step before. */
static inline double *ct_past(const struct ct_instance *instance, uint32_t k) {
    const uint32_t place = (instance->now->latest + CT_PLACES - k) % CT_PLACES;
    return instance->state + (1 + place) * (size_t)instance->now->n_point;
}

/* Largest size of an instance, bytes; no machine has more memory. */
#define CT_MOST_BYTES ((uint64_t)1 << 46)

static inline uint64_t ct_padded(uint64_t bytes) { return (bytes + CT_ALIGNMENT - 1) / CT_ALIGNMENT * CT_ALIGNMENT; }

/* Number of Float64 values in a point of a variant. */
uint64_t ct_point(const struct ct_file *file, const struct ct_variant *variant);

/* Largest number in a point; pressures of films, in Pa, reach 1e10. */
#define CT_LARGEST 1e15

/* True if a run can have the numbers of a point; NaN stands for a rate that is not given. */
bool ct_is_point(const struct ct_file *file, const struct ct_variant *variant, const double *numbers);

/* Fill an array's memory with its start contents; ``records`` are the addresses for its fixups. */
void ct_fill(const struct ct_file *file, const struct ct_array *array, unsigned char *memory, const uint64_t *records);

/* Lay out a variant in memory, with the instance's present point. Return false if there is no memory. */
bool ct_lay_out(struct ct_instance *instance, const struct ct_variant *variant, struct ct_model *model);

/* Prepare and start a model of a variant with inputs, (n_inputs,). Return the status of the kernels. */
int64_t ct_start_model(struct ct_instance *instance, const struct ct_model *model, const struct ct_variant *variant,
                 const double *inputs);

/* Text and kind of a status of the kernels. */
const char *ct_status_text(const struct ct_file *file, int64_t code, enum ct_status_kind *kind);

static inline double ct_time(const struct ct_instance *instance) {
    return instance->made ? instance->state[0] : instance->now->start_time;
}

/* Step to a time with the inputs of the variables; returns the status of the kernels. The previous point becomes the
   last past one; on a failure nothing has changed. */
int64_t ct_advance_model(struct ct_instance *instance, double end);

/* Number of stages of the next step for which the host must give inputs; 0 if the model finds inputs by itself. */
static inline uint32_t ct_stages(const struct ct_instance *instance) {
    const struct ct_model *model = &instance->model;
    if (model->staged == NULL || !(model->staged[CT_STAGES_THERE] < (double)model->staged_rows)) return 0;
    return (uint32_t)model->staged[CT_STAGES_THERE];
}

/* Time of a stage within its step, as a fraction of the step. */
static inline double ct_stage_share(const struct ct_instance *instance, uint32_t stage) {
    return instance->model.staged[(1 + stage) * instance->model.staged_columns];
}

/* Store the present values of the inputs as the inputs of a stage of the next step. */
void ct_give_stage(struct ct_instance *instance, uint32_t stage);

/* FMU states: copy ``now`` to a state, and back. A NULL state is refused, except by the function that frees. */
ct_result ct_get_state(struct ct_instance *instance, void **state);
ct_result ct_set_state(struct ct_instance *instance, const void *state);
ct_result ct_free_state(struct ct_instance *instance, void **state);
ct_result ct_state_size(struct ct_instance *instance, const void *state, size_t *size);
ct_result ct_serialize(struct ct_instance *instance, const void *state, void *bytes, size_t size);
ct_result ct_deserialize(struct ct_instance *instance, const void *bytes, size_t size, void **state);

/* Values of variables; a refused call changes none. */
ct_result ct_get_reals(struct ct_instance *instance, const uint32_t *references, size_t n, double *values);
ct_result ct_get_integers(struct ct_instance *instance, const uint32_t *references, size_t n, int *values);
ct_result ct_get_booleans(struct ct_instance *instance, const uint32_t *references, size_t n, int *values);
ct_result ct_get_strings(struct ct_instance *instance, const uint32_t *references, size_t n, const char **values);
ct_result ct_set_reals(struct ct_instance *instance, const uint32_t *references, size_t n, const double *values);
ct_result ct_set_integers(struct ct_instance *instance, const uint32_t *references, size_t n, const int *values);
ct_result ct_set_booleans(struct ct_instance *instance, const uint32_t *references, size_t n, const int *values);
ct_result ct_set_strings(struct ct_instance *instance, const uint32_t *references, size_t n, const char *const *values);

/* Refuse missing arrays, impossible counts, and references of another type; ``types`` are bits. */
ct_result ct_check_references(const struct ct_instance *instance, unsigned types, const uint32_t *references, size_t n,
                               const void *values);

/* Compute the referenced outputs, which are checked Reals, for the present state. */
ct_result ct_observe_outputs(struct ct_instance *instance, const uint32_t *references, size_t n);

static inline const char *ct_name_of(const struct ct_instance *instance, uint32_t reference) {
    return ct_text(&instance->file, instance->file.variables[reference].name);
}

/* First derivatives by time, 1/s: of Real inputs within the next step, and of Real outputs now. Also derivatives of
   Real outputs now in a direction of the Real inputs that led to them. */
ct_result ct_set_rates(struct ct_instance *instance, const uint32_t *references, size_t n, const int *orders,
                        const double *values);
ct_result ct_get_rates(struct ct_instance *instance, const uint32_t *references, size_t n, const int *orders,
                        double *values);
ct_result ct_get_derivatives(struct ct_instance *instance, const uint32_t *unknowns, size_t n_unknowns,
                              const uint32_t *knowns, size_t n_knowns, const double *changes, double *results);

/* Derivatives of the sum of ``weights`` times unknowns by each known input; each takes one directional derivative. */
ct_result ct_get_adjoints(struct ct_instance *instance, const uint32_t *unknowns, size_t n_unknowns,
                          const uint32_t *knowns, size_t n_knowns, const double *weights, double *results);

#endif
