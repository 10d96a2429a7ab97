/* How an ellipse on a half-space grows softer as its stick area shrinks. */
#ifndef STIFFNESS_H
#define STIFFNESS_H

#include "layer_law.h"
#include "simd_math.h"

/* Normalized creepage up to saturation, which lies half a unit beyond where it begins to be held,
 * and its derivatives by the creepage's size and by the softening. */
typedef struct {
    double value, by_size, by_softening;
} held_creepage;

ALWAYS_INLINE held_creepage held_up_to_saturation(double softening, double size) {
    double end = 1.0 / (1.0 - softening), begin = end - 0.5;
    double t = smaller(larger(size - begin, 0.0), 1.0), by_size = 1.0 - t * t * (3.0 - 2.0 * t);
    double value = smaller(size, begin) + t * (1.0 + t * t * (0.5 * t - 1.0));
    held_creepage held = {value, by_size, end * end * (1.0 - by_size)};
    return held;
}

/* Stiffness of an ellipse with a layer over that of clean bodies, and its derivatives by the
 * creepage's size, the logarithm of the layer's ratio and the softening. */
typedef struct {
    double value, by_size, by_log_layer, by_softening;
} stiffness_left;

/* The part m of a strip that slips counts, for Coulomb friction and springs alone, up to the end e
 * of the range: x = m + lam v with m = e v^2/(1 + v^2). In full stick on springs traction falls
 * linearly from the trailing edge, half way between that of Carter and that of full slip. So a
 * layer takes half of the softening, whatever slips. */
ALWAYS_INLINE stiffness_left stiffness_at(double softening, double layer_ratio, double t) {
    const double middle = 0.14; /* layer that does half of that; fitted to half-spaces */
    double end = 1.0 / (1.0 - softening), lam = smaller(layer_ratio, MAX_LAYER);
    layer_point at = layer_point_at(0, t, 0.0, lam / end);
    double per = 4.0 * at.m * at.s / at.by_t; /* dm/dx */
    double rest = 1.0 / (lam + middle), share = 0.5 * lam * rest, slips = end * at.m;
    double counted = share + (1.0 - share) * slips, by_slips = -softening * (1.0 - share);
    double by_share = -softening * (1.0 - slips) * (share * middle * rest);
    stiffness_left left = {1.0 - softening * counted, by_slips * per,
                           by_share - by_slips * (end * at.l * per),
                           by_slips * (end * end * at.m * (1.0 - per)) - counted};
    return left;
}

/* The same of n points. */
ALWAYS_INLINE void stiffness_with_layer(size_t n, const double *softening, const double *size,
                                        const double *layer_ratio, stiffness_left *left) {
    double x[MAX_POINTS], lam[MAX_POINTS], t[MAX_POINTS];
    for (size_t i = 0; i < n; i++) {
        double end = 1.0 / (1.0 - softening[i]);
        x[i] = larger(size[i], 1e-280) / end;
        lam[i] = smaller(layer_ratio[i], MAX_LAYER) / end;
    }
    solve_layer_points(n, x, NULL, lam, t);
    for (size_t i = 0; i < n; i++) left[i] = stiffness_at(softening[i], layer_ratio[i], t[i]);
}

#endif
