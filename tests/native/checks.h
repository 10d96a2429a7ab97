/* What the programs in this folder share: checks, which are counted, and random numbers. */
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

#endif
