/* Numbers of LANES systems side by side. Define LANES before including this file. A struct of
 * doubles becomes one row of LANES numbers for each field. */
#ifndef LANES_H
#define LANES_H

#include <stddef.h>

#include "simd_math.h"

#if LANES > 1 && defined(__GNUC__)
typedef double lanes[LANES] __attribute__((aligned(64))); /* else vectors lie across cache lines */
#else
typedef double lanes[LANES];
#endif

/* A loop over the lanes, which declares to the compiler that they are independent. */
#if LANES == 1
#define EACH_LANE(l) for (int l = 0; l < LANES; l++)
#elif defined(__clang__)
#define EACH_LANE(l)                                                                               \
    _Pragma(                                                                                       \
        "clang loop vectorize(assume_safety) interleave_count(2) unroll(disable)") for (int l = 0; \
                                                                                        l < LANES; \
                                                                                        l++)
#elif defined(__GNUC__)
#define EACH_LANE(l) _Pragma("GCC ivdep") for (int l = 0; l < LANES; l++)
#else
#define EACH_LANE(l) for (int l = 0; l < LANES; l++)
#endif

#define FIELDS(type) (sizeof(type) / sizeof(double))

/* A field's place in its struct is its row. */
#define PLACE(type, field) (offsetof(type, field) / sizeof(double))

/* Copy one lane's fields into a struct of doubles, and back. */
ALWAYS_INLINE void take(lanes *field, int l, size_t count, double *into) {
    UNROLLED for (size_t i = 0; i < count; i++) into[i] = field[i][l];
}

ALWAYS_INLINE void put(lanes *field, int l, size_t count, const double *from) {
    UNROLLED for (size_t i = 0; i < count; i++) field[i][l] = from[i];
}

#define TAKE(type, name, field) \
    type name;                  \
    take(field, l, FIELDS(type), (double *)&name)

#endif
