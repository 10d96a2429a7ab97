/* Values of the functions in fmu/inline.h and fmu/relaxation.c: for every line of the input, a
 * function's name and two arguments (the second for those that take one only is not read), the
 * value. Numbers are hexadecimal, so none is rounded on the way. */
#include <stdio.h>
#include <string.h>

#include "relaxation.c"

static double value_of(const char *name, double a, double b) {
    if (strcmp(name, "decaying_exponential") == 0) return decaying_exponential(a);
    if (strcmp(name, "exponential") == 0) return exponential(a);
    if (strcmp(name, "logarithm") == 0) return logarithm(a);
    if (strcmp(name, "cube_root") == 0) return cube_root(a);
    if (strcmp(name, "power_of") == 0) return power_of(a, b);
    if (strcmp(name, "mean_decay") == 0) return mean_decay(a);
    if (strcmp(name, "time_to_go") == 0) return time_to_go(a, 1.0, b);
    return NAN;
}

int main(void) {
    char name[32];
    double a, b;
    while (scanf("%31s %la %la", name, &a, &b) == 3) printf("%a\n", value_of(name, a, b));
    return 0;
}
