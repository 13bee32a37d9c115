/* One instance: values of its variables, and from the initialization on a model laid out in memory. */
#ifndef CT_INSTANCE_H
#define CT_INSTANCE_H

#include "file.h"

/* Phases of an instance, bits of the table of allowed calls. */
enum ct_phase { CT_INSTANTIATED = 1, CT_INITIALIZING = 2, CT_STEPPED = 4, CT_FAILED = 8, CT_TERMINATED = 16 };

/* An FMU state, and the part of an instance that one is a copy of. Behind it follow float64 numbers: values of the
   variables (options of Strings and Enumerations by their place), rates of the inputs, inputs at the start, and from
   the initialization on the state vector. */
struct ct_snapshot {
    char magic[8];
    char guid[40];
    uint64_t sums[2]; /* of a serialized one */
    uint64_t bytes;   /* with all that follows */
    uint64_t capacity;
    uint32_t version;
    uint32_t phase;
    uint32_t variant;
    uint32_t n_state; /* 0: without a state vector */
    double start_time, stop_time;
};

/* The image of Run and all arrays that it points to, in one block. */
struct ct_model {
    void *block;
    void *run;
    double *inputs, *outputs, *numbers, *input_rates, *output_rates; /* the last two NULL where Run has none */
    int64_t *families;
    uint64_t columns; /* of families */
    bool observed;    /* whether the wanted outputs are those of the state */
};

/* An input: its reference, and its place in run.inputs. */
struct ct_input { uint32_t reference, place; };

struct ct_instance {
    struct ct_host host;
    struct ct_file file;
    struct ct_snapshot *now;
    double *values, *rates, *origin, *state; /* in what follows ``now`` */
    struct ct_input *inputs;                 /* (n_inputs,) */
    uint32_t n_inputs, n_variables;
    uint32_t speed;                          /* reference of the input that is the crank's speed, or CT_NONE */
    struct ct_model model;
    bool made;                               /* whether the model is that of the values */
    bool warned;                             /* of coarse steps */
    double **places;                         /* of each variable's value, (n_variables,) */
    unsigned char *ready;                    /* whether a Real can be read there right now, (n_variables,) */
};

/* The instance of a host; NULL where it is refused, with the reason in the log. */
struct ct_instance *ct_new_instance(const struct ct_host *host, const char *guid, const char *location);
void ct_free_instance(struct ct_instance *instance);

/* All variables at their starts, as after fmi2Instantiate. */
void ct_reset(struct ct_instance *instance);

/* Inputs of the variables are those that a start is under. */
void ct_keep_origin(struct ct_instance *instance);

/* Row of LEVL for the values: a variant, or CT_REFUSED and a text. */
uint32_t ct_level(const struct ct_instance *instance);

/* Choose the variant by the values, lay out its memory, prepare it and start it at ``start_time`` under ``origin``.
   On an error the model of before is kept, but not its state vector. */
fmi2Status ct_make(struct ct_instance *instance);

/* Outputs are no longer known: the state has changed. */
void ct_forget_outputs(struct ct_instance *instance);

/* Text and kind of a status of the kernels. */
const char *ct_status_text(const struct ct_file *file, int64_t code, enum ct_status_kind *kind);

static inline double ct_time(const struct ct_instance *instance) {
    return instance->made ? instance->state[0] : instance->now->start_time;
}

/* Inputs of the variables into Run. */
void ct_pass_inputs(struct ct_instance *instance);

/* FMU states: a copy of ``now``, and back. */
fmi2Status ct_get_state(struct ct_instance *instance, struct ct_snapshot **state);
fmi2Status ct_set_state(struct ct_instance *instance, const struct ct_snapshot *state);
fmi2Status ct_serialize(struct ct_instance *instance, const struct ct_snapshot *state, char *bytes, size_t size);
fmi2Status ct_deserialize(struct ct_instance *instance, const char *bytes, size_t size, struct ct_snapshot **state);
bool ct_is_state(const struct ct_snapshot *state);

/* Values of variables; a call that is refused changes none. */
fmi2Status ct_get_reals(struct ct_instance *instance, const uint32_t *references, size_t n, double *values);
fmi2Status ct_get_integers(struct ct_instance *instance, const uint32_t *references, size_t n, int *values);
fmi2Status ct_get_booleans(struct ct_instance *instance, const uint32_t *references, size_t n, int *values);
fmi2Status ct_get_strings(struct ct_instance *instance, const uint32_t *references, size_t n, const char **values);
fmi2Status ct_set_reals(struct ct_instance *instance, const uint32_t *references, size_t n, const double *values);
fmi2Status ct_set_integers(struct ct_instance *instance, const uint32_t *references, size_t n, const int *values);
fmi2Status ct_set_booleans(struct ct_instance *instance, const uint32_t *references, size_t n, const int *values);
fmi2Status ct_set_strings(struct ct_instance *instance, const uint32_t *references, size_t n, const char *const *values);

/* First derivatives by time, 1/s: of Real inputs within the next step, of Real outputs now. */
fmi2Status ct_set_rates(struct ct_instance *instance, const uint32_t *references, size_t n, const int *orders,
                        const double *values);
fmi2Status ct_get_rates(struct ct_instance *instance, const uint32_t *references, size_t n, const int *orders,
                        double *values);
fmi2Status ct_get_derivatives(struct ct_instance *instance, const uint32_t *unknowns, size_t n_unknowns,
                              const uint32_t *knowns, size_t n_knowns, const double *changes, double *results);

#endif
