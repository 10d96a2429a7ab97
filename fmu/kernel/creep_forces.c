/* Creep forces of any ellipse: preparing a pair of bodies, one contact, and the model
 * "creep_forces".
 */
#include <math.h>

#include "checked_file.h"
#include "creep_forces_formula.h"
#include "half_space.h"
#include "model_functions.h"

static void scales_of(double log_aspect, double nu, double value[ASPECT_SCALES]) {
    half_space_scales s;
    half_space_scales_of(exponential(log_aspect), nu, &s);
    value[0] = s.c11, value[1] = s.c22, value[2] = s.softening_x, value[3] = s.softening_y;
    value[4] = s.spin_scale;
}

void creep_forces_prepare(creep_forces *bodies, const creep_table *table,
                          const double *coefficients, const creep_forces_parameters *parameters) {
    static const double STEP = 1e-4;
    double cell = 6.0 * LN_2 / ASPECT_CELLS;
    bodies->parameters = *parameters;
    bodies->table = table;
    bodies->coefficients = coefficients;
    for (int i = 0; i <= ASPECT_CELLS; i++) {
        double at = cell * i - 3.0 * LN_2, nu = parameters->poisson_ratio, before[ASPECT_SCALES],
               after[ASPECT_SCALES];
        scales_of(at, nu, bodies->scales[i]);
        scales_of(at - STEP, nu, before);
        scales_of(at + STEP, nu, after);
        for (int k = 0; k < ASPECT_SCALES; k++)
            bodies->scales[i][ASPECT_SCALES + k] = (after[k] - before[k]) * (0.5 * cell / STEP);
    }
}

enum { BODIES_VERSION = 1, BODIES_NUMBERS = 1 + LATERAL_SPIN_ASPECTS * LATERAL_SPIN_COEFFICIENTS };

const char *creep_forces_open(creep_forces *bodies, const creep_table *table, const void *bytes,
                              size_t size) {
    const double *number;
    size_t count;
    const char *error =
        checked_numbers(bytes, size, "CREEPAIR", BODIES_VERSION, 1e6, &number, &count);
    if (error != NULL) return error;
    if (count != BODIES_NUMBERS) return "the number of values is not that of a pair of bodies";
    if (!(number[0] >= 0.0 && number[0] <= 0.5)) return "Poisson's ratio is out of range";
    creep_forces_parameters parameters = {.poisson_ratio = number[0]};
    creep_forces_prepare(bodies, table, number + 1, &parameters);
    return NULL;
}

void creep_forces_of_one(const creep_forces *bodies, const creep_forces_parameters *parameters,
                         const creep_forces_input *input, creep_forces_output *output) {
    creep_forces_at(bodies, parameters, 1, input, output);
}

void evaluate_creep_forces(const creep_table *table, model_values *v, size_t n) {
    for (size_t i = 0; i < n; i++)
        creep_forces_of_one(table->bodies, &v[i].bodies, &v[i].ellipse, &v[i].forces);
}

void tangent_creep_forces(const creep_table *table, const model_values *v,
                          const model_values *direction, model_values *change) {
    lateral_spin_force state;
    creep_forces_output unused;
    double fall[3] = {0.0};
    creep_forces_begin(table->bodies, &v->bodies, &v->ellipse, &state, &unused);
    if (state.scale[0] > 0.0) fall_of_friction(&v->ellipse, &state, fall);
    const double *by = &v->forces.force_x_by_creepage_x, *force = &v->forces.force_x;
    const double d[3] = {direction->ellipse.creepage_x, direction->ellipse.creepage_y,
                         direction->ellipse.spin};
    double *dforce = &change->forces.force_x, used = v->forces.utilisation;
    for (int i = 0; i < 3; i++)
        dforce[i] = by[3 * i] * d[0] + by[3 * i + 1] * d[1] + by[3 * i + 2] * d[2];
    double square = force[0] * force[0] + force[1] * force[1], dlog_used = 0.0;
    if (square > 0.0) dlog_used = (force[0] * dforce[0] + force[1] * dforce[1]) / square;
    for (int j = 0; j < 3; j++) dlog_used -= fall[j] * d[j];
    change->forces.utilisation = used * dlog_used;
}

const char *advance_creep_forces(const creep_table *table, model_values *v, size_t n, double step,
                                 double tolerance, size_t *failed) {
    (void)table, (void)v, (void)n, (void)step, (void)tolerance, (void)failed;
    return NULL;
}
