#include "creep_forces.h"

#include "branch_free.h"
#include "half_space.h"

static void four_scales(double log_aspect, double nu, double value[4]) {
    half_space_scales s;
    half_space_scales_of(exponential(log_aspect), nu, &s);
    value[0] = s.c11, value[1] = s.c22, value[2] = s.softening_x, value[3] = s.softening_y;
}

void creep_forces_prepare(creep_forces *pair, const creep_table *table, const double *coefficients,
                          const creep_forces_parameters *parameters) {
    static const double STEP = 1e-4;
    double cell = 6.0 * LN_2 / ASPECT_CELLS;
    pair->parameters = *parameters;
    pair->table = table;
    pair->coefficients = coefficients;
    for (int i = 0; i <= ASPECT_CELLS; i++) {
        double at = cell * i - 3.0 * LN_2, nu = parameters->poisson_ratio, before[4], after[4];
        four_scales(at, nu, pair->scales[i]);
        four_scales(at - STEP, nu, before);
        four_scales(at + STEP, nu, after);
        for (int k = 0; k < 4; k++)
            pair->scales[i][4 + k] = (after[k] - before[k]) * (0.5 * cell / STEP);
    }
}
