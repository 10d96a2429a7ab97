/* How an ellipse on a half-space grows softer as its stick area shrinks. */
#ifndef SOFTENING_H
#define SOFTENING_H

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

#endif
