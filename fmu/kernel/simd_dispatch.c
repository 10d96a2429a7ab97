#include "simd_dispatch.h"

#if defined(__x86_64__) && defined(__GNUC__)
#include <cpuid.h>

/* Registers that the operating system saves: bits 1 and 2 for AVX. */
static unsigned kept_state(void) {
    unsigned low, high;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return low;
}

/* Whether the processor has AVX2. AVX-512 would make runs of many wheelsets 10 % faster and forces
 * of many points 9 % slower. */
static int has_avx2(void) {
    unsigned a, b, c, d;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & (1u << 27))) return 0; /* no xgetbv */
    if ((kept_state() & 0x06u) != 0x06u) return 0;
    return __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b & (1u << 5)) != 0;
}

/* The processor is queried once: the instruction is slow, above all in a virtual machine. All
 * threads find the same, so it does not matter which of them writes. */
static int is_wide(void) {
    static int known = -1;
    int found = __atomic_load_n(&known, __ATOMIC_RELAXED);
    if (found < 0) {
        found = has_avx2();
        __atomic_store_n(&known, found, __ATOMIC_RELAXED);
    }
    return found;
}
#define CHOOSE(name) (is_wide() ? name##_avx2 : name##_portable)
#else
#define CHOOSE(name) name##_portable
#endif

enum { FEW = 4 }; /* up to this many drivetrains are quicker one after another */

void creep_table_evaluate_many(const creep_table *table, size_t n, const double *x,
                               const double *k_hat, size_t k_stride, const double *layer_ratio,
                               size_t layer_stride, double *ratio, double *slope) {
    CHOOSE(creep_table_evaluate_many)
    (table, n, x, k_hat, k_stride, layer_ratio, layer_stride, ratio, slope);
}

void force_element_evaluate_many(const creep_table *table,
                                 const force_element_parameters *parameters, size_t n,
                                 const force_element_input *input, force_element_output *output) {
    CHOOSE(force_element_evaluate_many)(table, parameters, n, input, output);
}

void force_element_forces(const creep_table *table, const force_element_parameters *parameters,
                          size_t n, const double *const input[4], const size_t stride[4],
                          double *force) {
    CHOOSE(force_element_forces)(table, parameters, n, input, stride, force);
}

void force_elements_evaluate_wide(const creep_table *table, const force_task *tasks, size_t n) {
    CHOOSE(force_elements_evaluate)(table, tasks, n);
}

const char *wheelsets_advance_wide(const creep_table *table, wheelset_task *tasks, size_t n,
                                   double step, size_t *failed) {
    return CHOOSE(wheelsets_advance)(table, tasks, n, step, failed);
}

void drivetrains_advance(const drivetrain_member *members, size_t n, size_t axles,
                         vehicle *vehicles, drivetrain_input *input, drivetrain_state *state,
                         double time, double step, double tolerance, double *substep,
                         unsigned char *failed) {
    int one_lane = n <= FEW && axles == 1; /* the axles of a vehicle need a lane each */
    (one_lane ? drivetrains_advance_one_lane : CHOOSE(drivetrains_advance))(
        members, n, axles, vehicles, input, state, time, step, tolerance, substep, failed);
}

void drivetrains_evaluate(const drivetrain_member *members, size_t n, size_t rows,
                          const drivetrain_input *input, const drivetrain_state *state,
                          drivetrain_output *output, force_element_output *contact) {
    (n <= FEW ? drivetrains_evaluate_one_lane : CHOOSE(drivetrains_evaluate))(
        members, n, rows, input, state, output, contact);
}

void creep_forces_evaluate(const creep_forces *bodies, size_t n, const creep_forces_input *input,
                           creep_forces_output *output) {
    if (n == 1) creep_forces_of_one(bodies, &bodies->parameters, input, output);
    else CHOOSE(creep_forces_evaluate)(bodies, n, input, output);
}
