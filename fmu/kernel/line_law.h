/* The Carter-Griffith law of a line contact, without branches. */
#ifndef LINE_LAW_H
#define LINE_LAW_H

#include <math.h>

#include "simd_math.h"

/* A point of the law: x = m + y, y = k_hat t, s = 1 - m. Each has full relative accuracy, so no
 * formula below subtracts nearly equal numbers. */
typedef struct {
    double t, m, s, y;
} coordinate;

ALWAYS_INLINE coordinate coordinate_at(double t, double k) {
    double p = (t * t) * (t * t), s = 1.0 / (1.0 + p);
    coordinate c = {t, p * s, s, k * t};
    return c;
}

/* A starting value within a fifth of the root t; two steps from there reach it to rounding. */
ALWAYS_INLINE double coordinate_start(double x, double k) {
    double rest = 1.0 - x, inverse_k = 1.0 / k,
           linear = x * inverse_k; /* m and y alone give upper bounds of t, which are blended */
    double carter = rough_fourth_root(x / larger(rest, 1e-300));
    double smallest = smaller(carter, linear), ratio = smallest / larger(carter, linear);
    double below = smallest * (1.0 - 0.3 * ratio * ratio); /* 1/sqrt(1 + ratio^2), nearly */
    double square = k * k; /* corner approximates t at x = 1, where k t (1 + t^4) = 1 */
    double corner = rough_inverse_fifth_root(k * (1.0 + square * (2.1 + 0.7 * square)));
    double under = 1.0 / larger(rest + k * corner, 1e-300) - 1.0; /* t^4 = 1/s - 1 */
    under = rough_fourth_root(larger(under, 0.08));
    double sliding = -rest * inverse_k;
    double over = sqrt(corner * corner + sliding * (sliding + (0.5 * k - 0.3) * corner));
    double above = x < 1.0 ? under : over;
    return smaller(x <= smaller(0.4 + 0.5 * k, 0.95) ? below : above, linear);
}

/* One step of Householder's method of fourth order, in ln t. */
ALWAYS_INLINE double coordinate_step(double t, double x, double k) {
    double p = (t * t) * (t * t), d = 1.0 + p, y = k * t;
    double s = 1.0 / d, m = p * s;
    /* inverse is 1/((1 + p)^2 t dx/dt); its division does not wait for that of s. */
    double inverse = 1.0 / (y * d * d + 4.0 * p);
    /* Both forms are m + y - x; the second keeps the digits of a small s. */
    double near = (m - x) + y, far = (y - (x - 1.0)) - s, residual = t < 1.0 ? near : far;
    /* Newton's relative step, and the second and third derivatives over 2 and 6 times the first. */
    double newton = residual * d * d * inverse, part = 4.0 * p * inverse, lean = (1.0 - p) * s;
    double second = part * (2.0 * lean - 0.5);
    double third = part * (lean * (8.0 * lean - 6.0) - 16.0 * m * s + 1.0) * (1.0 / 3.0);
    double step =
        newton * (1.0 - second * newton) / (1.0 - newton * (2.0 * second - third * newton));
    return t - t * step;
}

/* Solve x = m + y for x >= 1e-280. For k_hat = 0 this is Carter's law: y is zero up to x = 1, and
 * the sliding x - 1 beyond. */
ALWAYS_INLINE coordinate solve_coordinate(double x, double k_hat) {
    double k = k_hat < 1e-60 ? 0.0 : k_hat;
    double t = coordinate_start(x, k);
    t = coordinate_step(t, x, k);
    t = coordinate_step(t, x, k);
    coordinate c = coordinate_at(t, k);
    int slides = (x >= 1.0) & (1e-20 * (x - 1.0) >= k); /* full slip: s is below 1e-80 */
    c.t = slides ? INFINITY : c.t;
    c.m = slides ? 1.0 : c.m;
    c.s = slides ? 0.0 : c.s;
    c.y = slides ? x - 1.0 : c.y;
    return c;
}

ALWAYS_INLINE double line_traction_ratio(coordinate c) {
    return c.m * (1.0 + c.s) + 2.0 * (c.y * c.s); /* Eq. (18) */
}

#endif
