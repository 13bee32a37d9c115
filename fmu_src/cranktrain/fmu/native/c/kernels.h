/* Contents of a product's machine code. Everything else in an FMU is data, see file.h. */
#ifndef CT_KERNELS_H
#define CT_KERNELS_H

#include <stdint.h>

/* A kernel takes the address of the image of its Run; it returns 0 on success, other results are in section STAT. */
typedef int64_t ct_entry(void *run, double x);

struct ct_kernels {
    const char *digest;            /* 16 hexadecimal digits of the run's kernels, must equal the file's; then,
                                      after a space, those of films if the library has them */
    ct_entry *prepare;             /* x unused: apply run.numbers to the model; if refused, the model is unchanged */
    ct_entry *start;               /* x: start time, s: from run.inputs to the state */
    ct_entry *advance;             /* x: end of the step, s; on failure the state is unchanged */
    ct_entry *observe;             /* x unused: fill the wanted outputs from the state */
    const void *const *functions;  /* addresses for fixups: force laws, output families, integrators */
    uint32_t n_functions;
    const char *names;             /* names of these functions, one per line, since pointers would need relocations */
    const char *layout;            /* layout of Run in words, for Python, which also loads the library */
};

/* Code for every processor, and with CT_FAST for processors with 256-bit vectors; both give the same bits. */
extern const struct ct_kernels ct_kernels;
extern const struct ct_kernels ct_fast_kernels;

/* Choose the fastest code that this processor can run. */
const struct ct_kernels *ct_choose_kernels(void);

#endif
