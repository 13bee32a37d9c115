/* What the machine code of a product offers. All else that makes an FMU is data, see file.h. */
#ifndef CT_KERNELS_H
#define CT_KERNELS_H

#include <stdint.h>

/* A kernel is given the address of the image of its Run; 0 is success, other results are in section STAT. */
typedef int64_t ct_entry(void *run, double x);

struct ct_kernels {
    const char *digest;            /* 16 hexadecimal digits of the run's kernels, must equal the file's; behind a space
                                      those of films, where they are in it */
    ct_entry *prepare;             /* x unused: apply run.numbers to the model; on a refusal the model is as before */
    ct_entry *start;               /* x: start time, s: from run.inputs to the state */
    ct_entry *advance;             /* x: end of the step, s; on failure the state is that of before */
    ct_entry *observe;             /* x unused: fill the wanted outputs from the state */
    const void *const *functions;  /* addresses for fixups: force laws, output families, integrators */
    uint32_t n_functions;
    const char *names;             /* of these functions, one a line: pointers to each would need relocations */
    const char *layout;            /* of Run in words, for Python, which loads the library as well */
};

/* Code for every processor, and where CT_FAST is defined that for one with 256-bit vectors; both give the same bits. */
extern const struct ct_kernels ct_kernels;
extern const struct ct_kernels ct_fast_kernels;

/* The fastest that this processor runs. */
const struct ct_kernels *ct_choose_kernels(void);

#endif
