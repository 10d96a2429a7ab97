/* The Carter-Griffith law of a line contact, without branches. */
#ifndef LINE_LAW_H
#define LINE_LAW_H

#include <math.h>

#include "inline.h"

/* Position on the law: x = m + y, with y = k_hat t. Every term is kept to full relative accuracy,
 * so nothing below subtracts nearly equal numbers. */
typedef struct {
    double t, m, s, y;
} coordinate;

ALWAYS_INLINE coordinate coordinate_at(double t, double k) {
    double p = (t * t) * (t * t), s = 1.0 / (1.0 + p);
    return (coordinate){t, p * s, s, k * t};
}

/* A start within a fifth of the root t, from which two steps below reach it to the last digit. */
ALWAYS_INLINE double coordinate_start(double x, double k) {
    double rest = 1.0 - x, inverse_k = 1.0 / k,
           linear = x * inverse_k; /* m or y alone give upper bounds of t: blend them */
    double carter = rough_fourth_root(x / larger(rest, 1e-300));
    double least = smaller(carter, linear), ratio = least / larger(carter, linear);
    double below = least * (1.0 - 0.3 * ratio * ratio); /* 1/sqrt(1 + ratio^2), nearly */
    double square = k * k; /* t at x = 1, where k t (1 + t^4) = 1, nearly */
    double corner = rough_inverse_fifth_root(k * (1.0 + square * (2.1 + 0.7 * square)));
    double under = 1.0 / larger(rest + k * corner, 1e-300) - 1.0; /* t^4 = 1/s - 1 */
    under = rough_fourth_root(larger(under, 0.08));
    double sliding = -rest * inverse_k;
    double over = sqrt(corner * corner + sliding * (sliding + (0.5 * k - 0.3) * corner));
    double above = x < 1.0 ? under : over;
    return smaller(x <= smaller(0.4 + 0.5 * k, 0.95) ? below : above, linear);
}

/* A step of Householder's method of fourth order, in ln t. */
ALWAYS_INLINE double coordinate_step(double t, double x, double k) {
    double p = (t * t) * (t * t), d = 1.0 + p, y = k * t;
    double s = 1.0 / d, m = p * s;
    /* (1 + p)^2 t dx/dt: two divisions that need not wait for each other. */
    double inverse = 1.0 / (y * d * d + 4.0 * p);
    /* Both forms are m + y - x; the second keeps the digits of a small s. */
    double near = (m - x) + y, far = (y - (x - 1.0)) - s, residual = t < 1.0 ? near : far;
    /* Relative step of Newton, and the second and third derivatives over twice and six times the
     * first. */
    double newton = residual * d * d * inverse, part = 4.0 * p * inverse, lean = (1.0 - p) * s;
    double second = part * (2.0 * lean - 0.5);
    double third = part * (lean * (8.0 * lean - 6.0) - 16.0 * m * s + 1.0) * (1.0 / 3.0);
    double step =
        newton * (1.0 - second * newton) / (1.0 - newton * (2.0 * second - third * newton));
    return t - t * step;
}

/* Solve x = m + y for x >= 1e-280. Without k_hat this is Carter: y is zero until nothing sticks any
 * more, then it is the sliding x - 1. */
ALWAYS_INLINE coordinate solve_coordinate(double x, double k_hat) {
    double k = k_hat < 1e-60 ? 0.0 : k_hat;
    double t = coordinate_start(x, k);
    t = coordinate_step(t, x, k);
    t = coordinate_step(t, x, k);
    coordinate c = coordinate_at(t, k);
    int slides = (x >= 1.0) & (1e-20 * (x - 1.0) >= k); /* s is below 1e-80: nothing sticks */
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
