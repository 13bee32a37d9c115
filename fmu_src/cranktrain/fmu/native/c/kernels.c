#include "kernels.h"

#ifdef CT_FAST
#include <cpuid.h>
#include <stdbool.h>

static const unsigned YMM = 0x6; /* bits of XCR0: the system saves registers of 128 and 256 bits */

/* True if the processor has all features that LLVM assumes for x86-64-v3. */
static bool is_v3(void) {
    const unsigned first = bit_FMA | bit_MOVBE | bit_OSXSAVE | bit_AVX | bit_F16C;
    const unsigned second = bit_AVX2 | bit_BMI | bit_BMI2;
    unsigned a, b, c, d;
    if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c & first) != first) return false;
    if (__get_cpuid_count(7, 0, &a, &b, &c, &d) == 0 || (b & second) != second) return false;
    if (__get_cpuid(0x80000001, &a, &b, &c, &d) == 0 || (c & bit_ABM) == 0) return false;
    __asm__("xgetbv" : "=a"(a), "=d"(d) : "c"(0));
    return (a & YMM) == YMM;
}

const struct ct_kernels *ct_choose_kernels(void) { return is_v3() ? &ct_fast_kernels : &ct_kernels; }
#else
const struct ct_kernels *ct_choose_kernels(void) { return &ct_kernels; }
#endif
