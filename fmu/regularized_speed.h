/* Speed in a denominator: |v| down to a minimum speed, below it an even C2 polynomial that ends
 * at 3/8 of that minimum. */
#ifndef REGULARIZED_SPEED_H
#define REGULARIZED_SPEED_H

#include <math.h>

static inline void regularized_speed(double v, double minimum, double *value, double *slope) {
    if (fabs(v) >= minimum) {
        *value = fabs(v);
        *slope = copysign(1.0, v);
    } else {
        double z = v / minimum, z2 = z * z;
        *value = minimum * (3.0 + z2 * (6.0 - z2)) / 8.0;
        *slope = z * (3.0 - z2) / 2.0;
    }
}

#endif
