/* How an ellipse on a half-space grows softer as its stick area shrinks. */
#ifndef SOFTENING_H
#define SOFTENING_H

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
ALWAYS_INLINE stiffness_left stiffness_with_layer(double softening, double size, double lam) {
    const double middle = 0.14; /* layer that does half of that; fitted to half-spaces */
    lam = smaller(lam, MAX_LAYER);
    double end = 1.0 / (1.0 - softening);
    layer_place at = solve_layer_place(larger(size, 1e-280) / end, 0.0, lam / end);
    double per = 4.0 * at.m * at.s / at.by_t; /* dm/dx */
    double rest = 1.0 / (lam + middle), share = 0.5 * lam * rest, slips = end * at.m;
    double counted = share + (1.0 - share) * slips, by_slips = -softening * (1.0 - share);
    double by_share = -softening * (1.0 - slips) * (share * middle * rest);
    stiffness_left left = {1.0 - softening * counted, by_slips * per,
                           by_share - by_slips * (end * at.l * per),
                           by_slips * (end * end * at.m * (1.0 - per)) - counted};
    return left;
}

#endif
