/* Functions of many points or drivetrains, compiled for several vector widths.
 *
 * All versions come from one source (simd_functions.inc) without contraction, so they give the same
 * bits. simd_dispatch.c calls the widest version that the processor has, or the one for a few
 * drivetrains.
 */
#ifndef SIMD_DISPATCH_H
#define SIMD_DISPATCH_H

#include "creep_forces.h"
#include "creep_table.h"
#include "drivetrain.h"
#include "force_element.h"
#include "wheelset_step.h"

/* A function's name in the version that the including file has chosen. */
#define JOINED(name, suffix) name##_##suffix
#define NAMED(name, suffix) JOINED(name, suffix)
#define WIDE(name) NAMED(name, WIDE_SUFFIX)

#define WIDE_FUNCTIONS(suffix)                                                                     \
    void creep_table_evaluate_many_##suffix(const creep_table *, size_t, const double *,           \
                                            const double *, size_t, const double *, size_t,        \
                                            double *, double *);                                   \
    void force_element_evaluate_many_##suffix(                                                     \
        const creep_table *, const force_element_parameters *, size_t,                             \
        const force_element_input *, force_element_output *);                                      \
    void force_element_forces_##suffix(const creep_table *, const force_element_parameters *,      \
                                       size_t, const double *const[4], const size_t[4], double *); \
    void force_elements_evaluate_##suffix(const creep_table *, const force_task *, size_t);        \
    const char *wheelsets_advance_##suffix(const creep_table *, wheelset_task *, size_t, double,   \
                                           size_t *);                                              \
    void drivetrains_advance_##suffix(const drivetrain_member *, size_t, size_t, vehicle *,        \
                                      drivetrain_input *, drivetrain_state *, double, double,      \
                                      double, double *, unsigned char *);                          \
    void drivetrains_evaluate_##suffix(const drivetrain_member *, size_t, size_t,                  \
                                       const drivetrain_input *, const drivetrain_state *,         \
                                       drivetrain_output *, force_element_output *);               \
    void creep_forces_evaluate_##suffix(const creep_forces *, size_t, const creep_forces_input *,  \
                                        creep_forces_output *);

WIDE_FUNCTIONS(portable)
WIDE_FUNCTIONS(avx2)

/* The versions for a few drivetrains. */
void drivetrains_advance_one_lane(const drivetrain_member *members, size_t n, size_t axles,
                                  vehicle *vehicles, drivetrain_input *input,
                                  drivetrain_state *state, double time, double step,
                                  double tolerance, double *substep, unsigned char *failed);
void drivetrains_evaluate_one_lane(const drivetrain_member *members, size_t n, size_t rows,
                                   const drivetrain_input *input, const drivetrain_state *state,
                                   drivetrain_output *output, force_element_output *contact);

#endif
