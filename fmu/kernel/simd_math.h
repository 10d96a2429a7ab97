/* Mathematics without branches, for loops that the compiler turns into vector instructions.
 * Nothing here calls the system's mathematical library, whose results differ between platforms. */
#ifndef BRANCH_FREE_H
#define BRANCH_FREE_H

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#if defined(_MSC_VER)
#define ALWAYS_INLINE static __forceinline
#else
#define ALWAYS_INLINE static inline __attribute__((always_inline))
#endif

/* A short loop inside one over lanes, which is vectorised only once this one is unrolled. */
#if defined(__clang__)
#define UNROLLED _Pragma("clang loop unroll(full)")
#elif defined(__GNUC__) && __GNUC__ >= 8
#define UNROLLED _Pragma("GCC unroll 8")
#else
#define UNROLLED
#endif

/* A loop over four neighbours, which an optimizing compiler turns into one vector. */
#if defined(__clang__)
#define IN_FOURS _Pragma("clang loop unroll(disable)")
#else
#define IN_FOURS
#endif

/* A loop whose body is vectorised, but not the loop itself. */
#if defined(__clang__)
#define NOT_VECTORIZED _Pragma("clang loop vectorize(disable)")
#else
#define NOT_VECTORIZED
#endif

#define PI 3.14159265358979324

/* Smaller and larger of two numbers, not NaN: one instruction each, unlike fmin and fmax. */
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

/* Powers to 3 or 4 %, as starting values. The bits of an IEEE number, read as an integer, are
 * nearly linear in its logarithm, so a fraction of them plus a constant is a power. */
ALWAYS_INLINE double rough_fourth_root(double v) {
    return of_bits(0x2FF3666666666800u + (bits_of(v) >> 2));
}

/* Only the upper half is divided: every vector unit multiplies 32 bits in one instruction. */
ALWAYS_INLINE double rough_inverse_fifth_root(double v) {
    uint64_t fifth = ((bits_of(v) >> 32) * 0x33333333u) >> 32;
    return of_bits(0x4CB8A8C154C98400u - (fifth << 32));
}

ALWAYS_INLINE double rough_inverse_third_root(double v) {
    uint64_t third = ((bits_of(v) >> 32) * 0x55555555u) >> 32;
    return of_bits(0x553EF0FF289DD800u - (third << 32));
}

/* Cube root of a normal v > 0, to 2e-16 relative; exactly 1 at v = 1. */
ALWAYS_INLINE double cube_root(double v) {
    double y = rough_inverse_third_root(v);
    for (int i = 0; i < 2; i++) { /* (1 - e)^(-1/3) by its series, e being at most 0.15 */
        double e = 1.0 - (v * y) * (y * y);
        y += y * e * (1.0 / 3.0 + e * (2.0 / 9.0 + e * (14.0 / 81.0)));
    }
    double square = y * y, root = v * square;
    root += (v - root * root * root) * square * (1.0 / 3.0); /* Newton's step mends the rounding */
    return v <= DBL_MAX ? root : v;
}

static const double LOG2E = 1.4426950408889634;
/* ln(2) in two parts: a multiple of the first by a whole number of up to 11 bits is exact. */
static const double LN2_HIGH = 6.93147180369123816490e-01, LN2_LOW = 1.90821492927058770002e-10;

/* exp(-v) for v >= 0, to 3e-16 relative, also with a compiler that keeps more digits; 0 beyond 700.
 */
ALWAYS_INLINE double decaying_exponential(double v) {
    double held = smaller(v, 700.0);
    int32_t whole = (int32_t)(held * LOG2E + 0.5);
    double n = -(double)whole, r = (-held - n * LN2_HIGH) - n * LN2_LOW; /* |r| <= ln(2)/2 */
    /* Taylor's series; the remainder is below 1e-17. */
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

/* exp(r) - 1 for |r| <= ln(2)/2, by Taylor's series with a remainder below 1e-17; the processor
 * can work on even and odd parts at the same time. */
ALWAYS_INLINE double exponential_less_one(double r) {
    double w = r * r, even = 1.0 / 479001600.0, odd = 1.0 / 6227020800.0;
    even = even * w + 1.0 / 3628800.0;
    odd = odd * w + 1.0 / 39916800.0;
    even = even * w + 1.0 / 40320.0;
    odd = odd * w + 1.0 / 362880.0;
    even = even * w + 1.0 / 720.0;
    odd = odd * w + 1.0 / 5040.0;
    even = even * w + 1.0 / 24.0;
    odd = odd * w + 1.0 / 120.0;
    odd = odd * w + 1.0 / 6.0;
    return r + (0.5 * w + w * (even * w + odd * r));
}

/* exp(v), to 3e-16 relative; 0 below -700 and infinite above 700. */
ALWAYS_INLINE double exponential(double v) {
    double held = larger(-700.0, smaller(v, 700.0));
    int32_t whole = (int32_t)(held * LOG2E + copysign(0.5, held));
    double n = (double)whole, r = (held - n * LN2_HIGH) - n * LN2_LOW;
    double p = 1.0 + exponential_less_one(r);
    double power = of_bits((uint64_t)(1023 + whole) << 52);
    double end = v > 700.0 ? INFINITY : (v < -700.0 ? 0.0 : v);
    return held == v ? p * power : end;
}

/* ln(v) of a normal v > 0, to 2.2e-16 relative; about -709 for zero and subnormal numbers. Infinity
 * and NaN are returned as they are. */
ALWAYS_INLINE double logarithm(double v) {
    const uint64_t lowest = 0x3FE6A09E00000000u; /* sqrt(1/2), nearly */
    /* v = m 2^n with sqrt(1/2) <= m < sqrt(2), nearly, so that no digit is lost near 1. */
    uint64_t shifted = bits_of(v) + (0x3FF0000000000000u - lowest);
    double n = (double)((int32_t)(shifted >> 52) - 1023);
    double m = of_bits((shifted & 0x000FFFFFFFFFFFFFu) + lowest), f = m - 1.0;
    /* ln(1 + f) = 2 artanh(s) = f - f^2/2 + s (f^2/2 + rest); the series' remainder is below 1e-18
     * relative. */
    double s = f / (2.0 + f), w = s * s, w2 = w * w, half = 0.5 * f * f;
    double odd =
        1.0 / 3.0 + w2 * (1.0 / 7.0 + w2 * (1.0 / 11.0 + w2 * (1.0 / 15.0 + w2 * (1.0 / 19.0))));
    double even =
        1.0 / 5.0 + w2 * (1.0 / 9.0 + w2 * (1.0 / 13.0 + w2 * (1.0 / 17.0 + w2 * (1.0 / 21.0))));
    double rest = 2.0 * w * (odd + w * even);
    double sum = n * LN2_HIGH - ((half - (s * (half + rest) + n * LN2_LOW)) - f);
    return v <= DBL_MAX ? sum : v;
}

/* A ratio > 0 to a power, to 3e-16 (1 + |exponent ln(ratio)|) relative; exactly 1 at ratio 1. */
ALWAYS_INLINE double power_of(double ratio, double exponent) {
    return exponential(exponent * logarithm(ratio));
}

/* Speed in a denominator: |v| above a minimum speed, below it an even polynomial (C2 overall) with
 * the value 3/8 minimum at v = 0. */
ALWAYS_INLINE void regularized_speed(double v, double minimum, double *value, double *slope) {
    double z = v / minimum, z2 = z * z;
    int slow = fabs(v) < minimum;
    *value = slow ? minimum * (3.0 + z2 * (6.0 - z2)) * 0.125 : fabs(v);
    *slope = slow ? z * (3.0 - z2) * 0.5 : copysign(1.0, v);
}

#endif
