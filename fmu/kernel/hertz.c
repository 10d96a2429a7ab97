#include "hertz.h"

#include <math.h>

#include "simd_math.h"

/* Bulirsch, "Numerical calculation of elliptic integrals and elliptic functions III", Numerische
 * Mathematik 13 (1969) 305-315, his cel(k, 1, a, b): arithmetic-geometric means of positive
 * numbers, so no digits are lost in a circle or a long ellipse. */
double elliptic_integral(double k, double a, double b) {
    enum { MAX_STEPS = 20 }; /* each doubles the digits; the loop ends for NaN too */
    double product = k, mean = 1.0, root = k, p = 1.0;
    for (int step = 0; step < MAX_STEPS; step++) {
        double previous_a = a, share = product / p, previous_mean = mean;
        a += b / p;
        b = 2.0 * (b + previous_a * share);
        p += share;
        mean += root;
        if (fabs(previous_mean - root) <= 1e-8 * previous_mean) break; /* squared: rounding */
        root = 2.0 * sqrt(product);
        product = root * mean;
    }
    return 0.5 * PI * (b + a * mean) / (mean * (mean + p));
}

#ifndef ONE_FILE_KERNEL
double hertz_integral(double along, double across) {
    return 3.0 * elliptic_integral(along / across, 1.0, 0.0) / (along * along * across);
}

void hertz_semi_axes(double radius_x, double radius_y, double compliance, double *semi_axes) {
    enum { HALVINGS = 60 };
    double log_radii = logarithm(radius_y) - logarithm(radius_x);
    /* ln(R_y/R_x) rises with ln(b/a), which is between 1/2 and 2/3 of it. */
    double root = 1.0, high = 0.7 * fabs(log_radii) + 1e-3, low = -high;
    for (int i = 0; i < HALVINGS; i++) {
        double middle = 0.5 * (low + high);
        root = exponential(0.5 * middle);
        double ratio = hertz_integral(1.0 / root, root) / hertz_integral(root, 1.0 / root);
        if (logarithm(ratio) < log_radii) low = middle;
        else high = middle;
    }
    double mean = cube_root(compliance * radius_x * hertz_integral(1.0 / root, root));
    semi_axes[0] = mean / root;
    semi_axes[1] = mean * root;
}
#endif /* ONE_FILE_KERNEL */
