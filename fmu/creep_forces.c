#include "creep_forces.h"

#include "branch_free.h"
#include "half_space.h"

static void scales_of(double log_aspect, double nu, double value[ASPECT_SCALES]) {
    half_space_scales s;
    half_space_scales_of(exponential(log_aspect), nu, &s);
    value[0] = s.c11, value[1] = s.c22, value[2] = s.softening_x, value[3] = s.softening_y;
    value[4] = s.spin_scale;
}

void creep_forces_prepare(creep_forces *pair, const creep_table *table, const double *coefficients,
                          const creep_forces_parameters *parameters) {
    static const double STEP = 1e-4;
    double cell = 6.0 * LN_2 / ASPECT_CELLS;
    pair->parameters = *parameters;
    pair->table = table;
    pair->coefficients = coefficients;
    for (int i = 0; i <= ASPECT_CELLS; i++) {
        double at = cell * i - 3.0 * LN_2, nu = parameters->poisson_ratio, before[ASPECT_SCALES],
               after[ASPECT_SCALES];
        scales_of(at, nu, pair->scales[i]);
        scales_of(at - STEP, nu, before);
        scales_of(at + STEP, nu, after);
        for (int k = 0; k < ASPECT_SCALES; k++)
            pair->scales[i][ASPECT_SCALES + k] = (after[k] - before[k]) * (0.5 * cell / STEP);
    }
}
