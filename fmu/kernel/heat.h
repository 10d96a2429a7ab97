/* Thermal softening: friction that falls with flash temperature, f0 (1 - T/T_m), in closed form.
 *
 * If friction stayed f0, a slip speed w_T would warm the contact by T_m. At r = w/w_T the
 * mean-field balance gives the fraction g = 1/(1 + r) of f0. The local solution
 * (tools/thermal_strips.py) is lower, because the contact is hottest where pressure is high; and
 * higher, because elastic strain accounts for part of the slip at first, and static friction
 * dissipates part of the power where the surface is cold. With x = w/(V zeta0), the heat number n =
 * V zeta0/w_T and k_hat of cold friction
 *
 *     g = C/(1 - n late (1 + 2 k_hat) m C^3),    m = s^8 (9 - 8 s),
 *     C = (1 + flatness r)/(1 + (1 + flatness) r + (bend + flatness) r^2),
 *     s = x (1 + r/2)/(reach (1 + 1.5 k_hat)), up to 1. */
#ifndef HEAT_H
#define HEAT_H

#include "simd_math.h"

/* Pressure-weighted mean of Blok's flash temperature; slip speed that is lacking to first order in
 * full slip, in units of zeta0 V; and numbers fitted to the local solution. */
typedef struct {
    double mean, late, reach, bend, flatness;
} heat_shape;

static const heat_shape HEAT_LINE = {1.5720233570985864, 0.1754, 1.0609, 0.1282, 0.9335};
static const heat_shape HEAT_ELLIPSE = {1.3184531038587535, 0.1603, 0.9326, 0.1176, 2.544};

/* g and 1/g, and derivatives of ln(g) by x, r, ln(n) and ln(k_hat), each at fixed others. */
typedef struct {
    double value, inverse, by_x, by_r, by_log_n, by_log_k;
} thermal_softening;

ALWAYS_INLINE thermal_softening thermal_softening_at(heat_shape shape, double x, double r, double n,
                                                     double k_hat) {
    double k = smaller(k_hat, 1.0); /* fitted up to 0.5 */
    double pace = 1.0 / (shape.reach * (1.0 + 1.5 * k)), warming = 1.0 + 0.5 * r;
    double above = 1.0 + shape.flatness * r, curve = shape.bend + shape.flatness;
    double below = 1.0 + r * (1.0 + shape.flatness + curve * r);
    double per_above = 1.0 / above, per_below = 1.0 / below, c = above * per_below;
    double log_c_by_r =
        shape.flatness * per_above - (1.0 + shape.flatness + 2.0 * curve * r) * per_below;
    double s = smaller(x * warming * pace, 1.0), s2 = s * s, s4 = s2 * s2;
    double m = s4 * s4 * (9.0 - 8.0 * s), m_by_s = 72.0 * s4 * s2 * s * (1.0 - s);
    double alone = n * shape.late * c * c * c, lack = alone * (1.0 + 2.0 * k);
    double left = 1.0 / (1.0 - lack * m), by_s = lack * m_by_s * left;
    double by_k = 2.0 * alone * m * left - 1.5 * by_s * s * (pace * shape.reach);
    thermal_softening found;
    found.value = c * left;
    found.inverse = (1.0 - lack * m) * (below * per_above);
    found.by_x = by_s * warming * pace;
    found.by_r = log_c_by_r * (1.0 + 3.0 * lack * m * left) + by_s * 0.5 * x * pace;
    found.by_log_n = lack * m * left;
    found.by_log_k = k_hat < 1.0 ? by_k * k : 0.0;
    return found;
}

#endif
