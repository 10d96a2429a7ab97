/* Speed in a denominator: |v| above a minimum speed, below it an even polynomial (C2 overall) with
 * the value 3/8 minimum at v = 0. */
#ifndef REGULARIZED_SPEED_H
#define REGULARIZED_SPEED_H

#include <math.h>

#include "branch_free.h"

ALWAYS_INLINE void regularized_speed(double v, double minimum, double *value, double *slope) {
    double z = v / minimum, z2 = z * z;
    int slow = fabs(v) < minimum;
    *value = slow ? minimum * (3.0 + z2 * (6.0 - z2)) * 0.125 : fabs(v);
    *slope = slow ? z * (3.0 - z2) * 0.5 : copysign(1.0, v);
}

#endif
