/* Time of every step of the kernel as one C file; see kernel_step.py.
 *
 * A wheel is driven over the peak and back by a torque that swings, under a load, a friction and
 * a lateral motion that change at each step. Prints the minimum, median, 99.9th percentile and
 * maximum time of a step in microseconds; and the maximum if each step counts with the minimum of
 * its times in all repetitions, which leaves out what the system did in between. Then, for a
 * limited number of substeps, the 99.9th percentile and maximum of the force's error over the
 * friction force, against a step without limit from the same state. */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "contactlib.h"

enum { STEPS = 1000000, REPETITIONS = 3 };
static double once[STEPS], smallest[STEPS], errors[STEPS];

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

/* From -1 to 1, by a linear congruential generator. */
static double random_number(unsigned *state) {
    *state = *state * 1664525u + 1013904223u;
    return 2.0 * (double)*state / 4294967296.0 - 1.0;
}

static void make_step(contactlib_element *wheel, double step) {
    const char *error = contactlib_step(wheel, step, CONTACTLIB_TOLERANCE);
    if (error == NULL) return;
    fprintf(stderr, "%s\n", error);
    exit(1);
}

static void run(double step, double implicit, double memory, double max_substeps) {
    contactlib_element wheel;
    contactlib_start(&wheel);
    wheel.implicit = implicit;
    wheel.max_substeps = max_substeps;
    wheel.contact.memory = memory;
    double radius = wheel.contact.radius, load = wheel.input.normal_load;
    double speed = wheel.input.speed, largest = wheel.contact.static_friction * load * radius;
    double inertia = radius * radius / wheel.effective_inverse_mass;
    unsigned state = 1;
    for (int i = 0; i < STEPS; i++) {
        double torque = largest * sin(0.7 * step * i) * (1.0 + 0.3 * random_number(&state));
        wheel.input.normal_load = load * (1.0 + 0.3 * random_number(&state));
        wheel.input.friction_scale = i / 3000 % 5 == 4 ? 0.2 : 1.0 + 0.1 * random_number(&state);
        wheel.input.lateral_velocity = 1e-3 * speed * random_number(&state);
        wheel.input.spin_velocity = 0.2 * speed * random_number(&state);
        contactlib_element free = wheel;
        double begin = now();
        make_step(&wheel, step);
        once[i] = now() - begin;
        if (max_substeps > 0.0) {
            free.max_substeps = 0.0;
            make_step(&free, step);
            errors[i] = fabs(wheel.output.creep_force - free.output.creep_force) /
                        (wheel.contact.static_friction * wheel.input.normal_load);
        }
        wheel.input.omega += step * (torque + wheel.output.wheel_torque) / inertia;
    }
}

static int compare(const void *a, const void *b) {
    double left = *(const double *)a, right = *(const double *)b;
    return (left > right) - (left < right);
}

int main(int count, char **argument) {
    if (count != 5) return 2;
    double step = atof(argument[1]), implicit = atof(argument[2]), memory = atof(argument[3]);
    for (int k = 0; k < REPETITIONS; k++) {
        run(step, implicit, memory, atof(argument[4]));
        for (int i = 0; i < STEPS; i++)
            smallest[i] = k == 0 || once[i] < smallest[i] ? once[i] : smallest[i];
    }
    qsort(once, STEPS, sizeof *once, compare);
    qsort(smallest, STEPS, sizeof *smallest, compare);
    qsort(errors, STEPS, sizeof *errors, compare);
    printf("%.3f %.3f %.3f %.3f %.3f %.2g %.2g\n", once[0], once[STEPS / 2],
           once[STEPS - STEPS / 1000], once[STEPS - 1], smallest[STEPS - 1],
           errors[STEPS - STEPS / 1000], errors[STEPS - 1]);
    return 0;
}
