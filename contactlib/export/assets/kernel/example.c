/* A wheel under a torque that grows until it slips away, with steps of 10 ms: build it by
 * cc -std=c99 -O2 -ffp-contract=off example.c contactlib.c -lm -o example */
#include <stdio.h>

#include "contactlib.h"

int main(void) {
    const double step = 0.01;
    contactlib_element wheel;
    contactlib_start(&wheel);
    double radius = wheel.contact.radius, load = wheel.input.normal_load;
    /* At a held speed these bodies have the same slip acceleration per force. */
    double inertia = radius * radius / wheel.effective_inverse_mass;
    double largest = 1.5 * wheel.contact.static_friction * load * radius;
    printf("time [s]  torque [N.m]  omega [rad/s]  creepage [1]  force [N]\n");
    for (int i = 0; i <= 200; i++) {
        double torque = largest * i / 200;
        const char *error = contactlib_step(&wheel, step, CONTACTLIB_TOLERANCE);
        if (error != NULL) {
            fprintf(stderr, "%s\n", error);
            return 1;
        }
        if (i % 10 == 0)
            printf("%8.2f %13.0f %14.3f %13.5f %10.0f\n", step * i, torque, wheel.input.omega,
                   wheel.output.creepage, wheel.output.creep_force);
        wheel.input.omega += step * (torque + wheel.output.wheel_torque) / inertia;
    }
    return 0;
}
