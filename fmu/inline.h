/* Small functions without branches, for loops that a compiler turns into vector instructions: each
 * element of a vector goes the same way. Nothing here calls the system's mathematics. */
#ifndef INLINE_H
#define INLINE_H

#include <stdint.h>
#include <string.h>

#if defined(_MSC_VER)
#define ALWAYS_INLINE static __forceinline
#else
#define ALWAYS_INLINE static inline __attribute__((always_inline))
#endif

/* Of two numbers that are numbers: unlike fmin and fmax, one instruction. */
ALWAYS_INLINE double smaller(double a, double b) { return a < b ? a : b; }

ALWAYS_INLINE double larger(double a, double b) { return a < b ? b : a; }

ALWAYS_INLINE uint64_t bits_of(double v) {
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    return bits;
}

ALWAYS_INLINE double of_bits(uint64_t bits) {
    double v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

/* Powers to 3 or 4 %, enough to start from: the bits of an IEEE number are nearly a multiple of its
 * logarithm, so a part of them and a constant make a power. */
ALWAYS_INLINE double rough_fourth_root(double v) {
    return of_bits(0x2FF3666666666800u + (bits_of(v) >> 2));
}

/* A fifth of the upper half alone: a product of 32 bits is one instruction of any vector unit. */
ALWAYS_INLINE double rough_inverse_fifth_root(double v) {
    uint64_t fifth = ((bits_of(v) >> 32) * 0x33333333u) >> 32;
    return of_bits(0x4CB8A8C154C98400u - (fifth << 32));
}

ALWAYS_INLINE double rough_inverse_third_root(double v) {
    uint64_t third = ((bits_of(v) >> 32) * 0x55555555u) >> 32;
    return of_bits(0x553EF0FF289DD800u - (third << 32));
}

/* exp(-v) for v >= 0, to 3e-16 of itself; 0 beyond 700. It bears compilers that keep more digits.
 */
ALWAYS_INLINE double decaying_exponential(double v) {
    static const double LOG2E = 1.4426950408889634, LN2_HIGH = 6.93147180369123816490e-01,
                        LN2_LOW = 1.90821492927058770002e-10;
    double held = smaller(v, 700.0);
    int32_t whole = (int32_t)(held * LOG2E + 0.5);
    double n = -(double)whole, r = (-held - n * LN2_HIGH) - n * LN2_LOW; /* |r| <= ln(2)/2 */
    /* Taylor's series, whose rest is below 1e-17. */
    double even = r * r;
    double p = 1.0 / 6227020800.0;
    p = p * r + 1.0 / 479001600.0;
    p = p * r + 1.0 / 39916800.0;
    p = p * r + 1.0 / 3628800.0;
    p = p * r + 1.0 / 362880.0;
    p = p * r + 1.0 / 40320.0;
    p = p * r + 1.0 / 5040.0;
    p = p * r + 1.0 / 720.0;
    p = p * r + 1.0 / 120.0;
    p = p * r + 1.0 / 24.0;
    p = p * r + 1.0 / 6.0;
    p = 1.0 + (r + (0.5 * even + p * (even * r)));
    double power = of_bits((uint64_t)(1023 - whole) << 52);
    return v <= 700.0 ? p * power : (v > 700.0 ? 0.0 : v);
}

#endif
