/* One instance: values of its variables, and from the initialization on a model laid out in memory. */
#ifndef CT_INSTANCE_H
#define CT_INSTANCE_H

#include "file.h"

/* Phases of an instance, bits of the table of allowed calls. */
enum ct_phase {
    CT_INSTANTIATED = 1, CT_INITIALIZING = 2, CT_STEPPED = 4, CT_FAILED = 8, CT_TERMINATED = 16, CT_EVENT = 32
};

/* An FMU state, and the part of an instance that one is a copy of. Behind it follow float64 numbers: values of the
   variables (options of Strings and Enumerations by their place), rates of the inputs, inputs at the start, and from
   the initialization on points: now, and the beginnings of the last steps in a ring. A point is the state vector, the
   inputs that led to it, and their rates. */
/* Points that are told of beside the present one, and places of points: one of them is for the step that is tried. */
enum { CT_PAST = 2, CT_PLACES = CT_PAST + 1 };

struct ct_snapshot {
    char magic[8];
    char guid[40];
    uint64_t sums[2]; /* of a serialized one */
    uint64_t bytes;   /* with all that follows */
    uint64_t capacity;
    uint64_t ticks; /* bits of the clocks that tick: from the step that led there until the event is handled */
    uint32_t version;
    uint32_t phase;
    uint32_t variant;
    uint32_t n_point;        /* float64 numbers of a point, 0: without points */
    uint32_t n_past, latest; /* how many past points are known, and which of both is the beginning of the last step */
    double start_time, stop_time, end_time; /* the last is where the last step was to end */
};

/* The image of Run and all arrays that it points to, in one block. */
struct ct_model {
    void *block;
    void *run;
    double *inputs, *outputs, *numbers, *input_rates, *staged; /* the last two NULL where Run has none */
    int64_t *families;
    uint64_t columns, staged_rows, staged_columns; /* the first of families */
    bool observed;    /* whether the wanted outputs are those of the state */
};

/* An input: its reference, and its place in run.inputs. */
struct ct_input { uint32_t reference, place; };

struct ct_instance {
    struct ct_host host;
    struct ct_file file;
    struct ct_snapshot *now;
    double *values, *rates, *origin, *state; /* in what follows ``now``; the present point begins with ``state`` */
    double *before;                          /* (n_point,) the present point while the model stands elsewhere */
    struct ct_input *inputs;                 /* (n_inputs,) */
    uint32_t n_inputs, n_variables;
    uint32_t speed;                          /* reference of the input that is the crank's speed, or CT_NONE */
    struct ct_model model;
    bool made;                               /* whether the model is that of the values */
    uint32_t limited;                        /* place in the state that is not 0 after a step cut short, or CT_NONE */
    uint32_t each_point;                     /* place in the state that, set to 1, lets no internal step go beyond the
                                                next communication step, or CT_NONE */
    bool warned, told_limit;                 /* of coarse steps, of one that was cut short */
    double **places;                         /* of each variable's value, (n_variables,) */
    unsigned char *ready;                    /* whether a Real can be read there right now, (n_variables,) */
};

/* The instance of a host; NULL where it is refused, with the reason in the log. */
struct ct_instance *ct_new_instance(const struct ct_host *host, const char *guid, const char *location);
void ct_free_instance(struct ct_instance *instance);

/* All variables at their starts, as after its instantiation. */
void ct_reset(struct ct_instance *instance);

/* Inputs of the variables are those that a start is under. */
void ct_keep_origin(struct ct_instance *instance);

/* Row of LEVL for the values: a variant, or CT_REFUSED and a text. */
uint32_t ct_level(const struct ct_instance *instance);

/* Choose the variant by the values, lay out its memory, prepare it and start it at ``start_time`` under ``origin``.
   On an error the model of before is kept, but not its state vector. */
ct_result ct_make(struct ct_instance *instance);

/* A call: its name, and the phases in which the standard allows it. */
struct ct_call {
    char name[28]; /* a pointer would need a relocation */
    uint32_t phases;
};

/* Whether a call is allowed now. False, with the reason in the log, where not, and where there is no instance. */
bool ct_allowed(const struct ct_instance *instance, const struct ct_call *call);

/* Times of the experiment; refused where they cannot be. */
ct_result ct_set_experiment(struct ct_instance *instance, double start, bool stop_defined, double stop);

/* Go into initialization mode, and out of it with a model that is started. */
void ct_initialize(struct ct_instance *instance);
ct_result ct_end_initialization(struct ct_instance *instance);

/* Refuse a step that cannot be taken from here; warn once of a coarse one. */
ct_result ct_check_step(struct ct_instance *instance, double time, double step);

/* Crank angle of a step, degrees; 0 where there is no speed. */
double ct_degrees(const struct ct_instance *instance, double step);

/* Step to a time that was checked. A step without a solution is discarded; the state is that of before. */
ct_result ct_step_to(struct ct_instance *instance, double end);

/* Outputs are no longer known: the state has changed. */
void ct_forget_outputs(struct ct_instance *instance);

/* Past point, 0 the beginning of the last step, 1 that of the step before. */
static inline double *ct_past(const struct ct_instance *instance, uint32_t k) {
    const uint32_t place = (instance->now->latest + CT_PLACES - k) % CT_PLACES;
    return instance->state + (1 + place) * (size_t)instance->now->n_point;
}

/* Bytes of an instance at most: more is no memory of any machine. */
#define CT_MOST_BYTES ((uint64_t)1 << 46)

static inline uint64_t ct_padded(uint64_t bytes) { return (bytes + CT_ALIGNMENT - 1) / CT_ALIGNMENT * CT_ALIGNMENT; }

/* Float64 numbers of a point of a variant. */
uint64_t ct_point(const struct ct_file *file, const struct ct_variant *variant);

/* Largest number of a point: pressures of films, in Pa, come to 1e10. */
#define CT_LARGEST 1e15

/* Whether a run can have the numbers of a point; NaN stands for a rate that is not given. */
bool ct_is_point(const struct ct_file *file, const struct ct_variant *variant, const double *numbers);

/* Fill an array's memory with what it holds at the start; ``records`` are the addresses for its fixups. */
void ct_fill(const struct ct_file *file, const struct ct_array *array, unsigned char *memory, const uint64_t *records);

/* Lay out a variant in memory; its present point is the instance's. False where there is no memory. */
bool ct_lay_out(struct ct_instance *instance, const struct ct_variant *variant, struct ct_model *model);

/* Prepare and start a model of a variant under inputs, (n_inputs,); status of the kernels. */
int64_t ct_start_model(struct ct_instance *instance, const struct ct_model *model, const struct ct_variant *variant,
                 const double *inputs);

/* Text and kind of a status of the kernels. */
const char *ct_status_text(const struct ct_file *file, int64_t code, enum ct_status_kind *kind);

static inline double ct_time(const struct ct_instance *instance) {
    return instance->made ? instance->state[0] : instance->now->start_time;
}

/* Step to a time under the inputs of the variables; status of the kernels. The point of before is the last past one
   then; on a failure nothing has changed. */
int64_t ct_advance_model(struct ct_instance *instance, double end);

/* Stages of the next step at which a host has to give the inputs; 0 of a model that reconstructs or holds them. */
static inline uint32_t ct_stages(const struct ct_instance *instance) {
    const struct ct_model *model = &instance->model;
    if (model->staged == NULL || !(model->staged[CT_STAGES_THERE] < (double)model->staged_rows)) return 0;
    return (uint32_t)model->staged[CT_STAGES_THERE];
}

/* Share of a step at which a stage lies. */
static inline double ct_stage_share(const struct ct_instance *instance, uint32_t stage) {
    return instance->model.staged[(1 + stage) * instance->model.staged_columns];
}

/* The inputs of the variables are those at a stage; with the last of them all are given. */
void ct_give_stage(struct ct_instance *instance, uint32_t stage);

/* FMU states: a copy of ``now``, and back. NULL is refused, but for what is to be freed. */
ct_result ct_get_state(struct ct_instance *instance, void **state);
ct_result ct_set_state(struct ct_instance *instance, const void *state);
ct_result ct_free_state(struct ct_instance *instance, void **state);
ct_result ct_state_size(struct ct_instance *instance, const void *state, size_t *size);
ct_result ct_serialize(struct ct_instance *instance, const void *state, void *bytes, size_t size);
ct_result ct_deserialize(struct ct_instance *instance, const void *bytes, size_t size, void **state);

/* Values of variables; a call that is refused changes none. */
ct_result ct_get_reals(struct ct_instance *instance, const uint32_t *references, size_t n, double *values);
ct_result ct_get_integers(struct ct_instance *instance, const uint32_t *references, size_t n, int *values);
ct_result ct_get_booleans(struct ct_instance *instance, const uint32_t *references, size_t n, int *values);
ct_result ct_get_strings(struct ct_instance *instance, const uint32_t *references, size_t n, const char **values);
ct_result ct_set_reals(struct ct_instance *instance, const uint32_t *references, size_t n, const double *values);
ct_result ct_set_integers(struct ct_instance *instance, const uint32_t *references, size_t n, const int *values);
ct_result ct_set_booleans(struct ct_instance *instance, const uint32_t *references, size_t n, const int *values);
ct_result ct_set_strings(struct ct_instance *instance, const uint32_t *references, size_t n, const char *const *values);

/* Refuse arrays that are not there, counts that cannot be, references of another type; ``types`` are bits. */
ct_result ct_check_references(const struct ct_instance *instance, unsigned types, const uint32_t *references, size_t n,
                               const void *values);

/* Have these outputs, checked Reals, observed now. */
ct_result ct_observe_outputs(struct ct_instance *instance, const uint32_t *references, size_t n);

static inline const char *ct_name_of(const struct ct_instance *instance, uint32_t reference) {
    return ct_text(&instance->file, instance->file.variables[reference].name);
}

/* First derivatives by time, 1/s: of Real inputs within the next step, of Real outputs now; and of Real outputs now in a
   direction of the Real inputs that led to them. */
ct_result ct_set_rates(struct ct_instance *instance, const uint32_t *references, size_t n, const int *orders,
                        const double *values);
ct_result ct_get_rates(struct ct_instance *instance, const uint32_t *references, size_t n, const int *orders,
                        double *values);
ct_result ct_get_derivatives(struct ct_instance *instance, const uint32_t *unknowns, size_t n_unknowns,
                              const uint32_t *knowns, size_t n_knowns, const double *changes, double *results);

/* Derivatives of the sum of ``weights`` times unknowns by each known input: one directional derivative each. */
ct_result ct_get_adjoints(struct ct_instance *instance, const uint32_t *unknowns, size_t n_unknowns,
                          const uint32_t *knowns, size_t n_knowns, const double *weights, double *results);

#endif
