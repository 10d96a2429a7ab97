/* What the programs in this folder share: checks, which are counted, random numbers, and the
 * contact and the body of a wheelset. */
#ifndef CHECKS_H
#define CHECKS_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>

static int failures;

#define CHECK(condition)                                           \
    do {                                                           \
        if (!(condition)) {                                        \
            printf("%s:%d: %s\n", __FILE__, __LINE__, #condition); \
            failures++;                                            \
        }                                                          \
    } while (0)

/* What main returns. */
static inline int verdict(void) {
    printf("%d failures\n", failures);
    return failures != 0;
}

static uint64_t random_state = 88172645463325252u;

static inline double random_unit(void) {
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

static inline double random_exponent(double low, double high) {
    return pow(10.0, low + (high - low) * random_unit());
}

#define SOME_CONTACT                    \
    {                                   \
        .radius = 0.5,                  \
        .static_friction = 0.45,        \
        .kinetic_friction = 0.21,       \
        .weakening_length = 1.3e-6,     \
        .slope_reduction = 0.14,        \
        .semi_width = 5e-3,             \
        .peak_pressure = 5.77e8,        \
        .contact_modulus = 1.154e11,    \
        .nominal_load = 2.2e5,          \
        .load_exponent = 0.5,           \
        .minimum_speed = 0.1,           \
        .slip_rate_residual = 1.0,      \
        .body_modulus = 1.154e11,       \
        .poisson_ratio = 0.28,          \
        .transverse_half_length = 3e-2, \
    }

#define SOME_BODY                      \
    {                                  \
        .radius = 0.5,                 \
        .inertia = 250.0,              \
        .inverse_mass = 1e-5,          \
        .damping = 50.0,               \
        .constant_resistance = 1800.0, \
        .linear_resistance = 66.0,     \
        .quadratic_resistance = 3.1,   \
        .minimum_speed = 0.1,          \
    }

#endif
