/* Values of the functions in fmu/kernel/simd_math.h: for every line of the input, a function's
 * name and two arguments (of those that take one, the second is not used), the value. Numbers are
 * hexadecimal, so none is rounded on the way.
 *
 * With any argument it reads nothing, and for every function writes a sum of the bits of its
 * values at many arguments. */
#include <stdio.h>
#include <string.h>

#include "simd_math.h"

static double value_of(const char *name, double a, double b) {
    if (strcmp(name, "decaying_exponential") == 0) return decaying_exponential(a);
    if (strcmp(name, "exponential") == 0) return exponential(a);
    if (strcmp(name, "logarithm") == 0) return logarithm(a);
    if (strcmp(name, "cube_root") == 0) return cube_root(a);
    if (strcmp(name, "power_of") == 0) return power_of(a, b);
    return NAN;
}

static uint64_t random_state = 88172645463325252u;

/* In [1, 2): exact, and made without a function that a system might have in its own way. */
static double random_number(void) {
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return of_bits(bits_of(1.0) | (random_state >> 12));
}

static uint64_t sum_of_bits(const char *name) {
    uint64_t sum = 0;
    for (int i = 0; i < 100000; i++) {
        double a = random_number(), b = random_number();
        sum = sum * 6364136223846793005u + bits_of(value_of(name, 16.0 * (a - 1.0), b - 1.0));
    }
    return sum;
}

int main(int count, char **arguments) {
    static const char *const names[] = {"decaying_exponential", "exponential", "logarithm",
                                        "cube_root", "power_of"};
    char name[32];
    double a, b;
    (void)arguments;
    for (size_t i = 0; count > 1 && i < sizeof names / sizeof *names; i++) {
        uint64_t sum = sum_of_bits(names[i]);
        printf("%s %08lx%08lx\n", names[i], (unsigned long)(sum >> 32),
               (unsigned long)(sum & 0xFFFFFFFFu));
    }
    while (count == 1 && scanf("%31s %la %la", name, &a, &b) == 3)
        printf("%a\n", value_of(name, a, b));
    return 0;
}
