/* The model "creep_forces": what a vehicle tool asks for, without states. */
#include <math.h>

#include "checked_file.h"
#include "creep_forces_formula.h"
#include "model_functions.h"

enum { PAIR_VERSION = 1, PAIR_NUMBERS = 1 + PLANE_ASPECTS * PLANE_COEFFICIENTS };

const char *creep_forces_open(creep_forces *pair, const creep_table *table, const void *bytes,
                              size_t size) {
    const char *error = checked_file_error(bytes, size, "CREEPAIR", PAIR_VERSION);
    if (error != NULL) return error;
    const double *number = (const double *)(const void *)((const char *)bytes + CHECKED_FILE_FRAME);
    if (size != CHECKED_FILE_FRAME + PAIR_NUMBERS * sizeof *number)
        return "the number of values is not that of a pair of bodies";
    for (size_t i = 0; i < PAIR_NUMBERS; i++)
        if (!(fabs(number[i]) <= 1e6)) return "a number is not finite or beyond 1e6";
    if (!(number[0] >= 0.0 && number[0] <= 0.5)) return "Poisson's ratio is out of range";
    creep_forces_parameters parameters = {.poisson_ratio = number[0]};
    creep_forces_prepare(pair, table, number + 1, &parameters);
    return NULL;
}

void creep_forces_of_one(const creep_forces *pair, const creep_forces_input *input,
                         creep_forces_output *output) {
    creep_forces_at(pair, 1, input, output);
}

static creep_forces pair_of(const creep_table *table, const creep_forces_parameters *parameters) {
    creep_forces pair = *table->pair;
    double poisson_ratio = pair.parameters.poisson_ratio;
    pair.parameters = *parameters;
    pair.parameters.poisson_ratio = poisson_ratio;
    return pair;
}

static void evaluate_at(const creep_table *table, const creep_forces_parameters *parameters,
                        const creep_forces_input *input, creep_forces_output *output) {
    creep_forces pair = pair_of(table, parameters);
    creep_forces_of_one(&pair, input, output);
}

void evaluate_pair(const creep_table *table, model_values *v) {
    evaluate_at(table, &v->pair, &v->ellipse, &v->forces);
}

/* Derivatives by creepages are exact. Those by everything else are central differences. */
void tangent_pair(const creep_table *table, const model_values *v, const model_values *direction,
                  model_values *change) {
    const creep_forces_input *in = &v->ellipse, *din = &direction->ellipse;
    const creep_forces_parameters *p = &v->pair, *dp = &direction->pair;
    const creep_forces_output *f = &v->forces;
    creep_forces_output *df = &change->forces;
    double load = fabs(in->normal_load) > LEAST_LOAD ? in->normal_load : 1.0;
    double scale = in->friction_scale > LEAST_FRICTION ? in->friction_scale : 1.0;
    double length = p->weakening_length > 0.0 ? p->weakening_length : 1.0;
    double decay = p->slip_rate_decay > 0.0 ? p->slip_rate_decay : 1.0;
    double speed = in->speed != 0.0 ? in->speed : 1.0;
    double top = p->softening_temperature > 0.0 ? p->softening_temperature : 1.0;
    double effusivity = p->thermal_effusivity > 0.0 ? p->thermal_effusivity : 1.0;
    double pace =
        fabs(din->semi_axis_x / in->semi_axis_x) + fabs(din->semi_axis_y / in->semi_axis_y) +
        fabs(din->normal_load / load) + fabs(din->friction_scale / scale) +
        fabs(dp->weakening_length / length) + fabs(dp->shear_modulus / p->shear_modulus) +
        fabs(dp->static_friction / p->static_friction) + fabs(dp->slip_rate_residual) +
        fabs(dp->slip_rate_decay / decay) + fabs(din->speed / speed) +
        fabs(dp->softening_temperature / top) + fabs(dp->thermal_effusivity / effusivity) +
        fabs(dp->kinetic_friction / p->kinetic_friction);
    *df = (creep_forces_output){
        .force_x = f->force_x_by_creepage_x * din->creepage_x +
                   f->force_x_by_creepage_y * din->creepage_y + f->force_x_by_spin * din->spin,
        .force_y = f->force_y_by_creepage_x * din->creepage_x +
                   f->force_y_by_creepage_y * din->creepage_y + f->force_y_by_spin * din->spin,
        .spin_moment = f->moment_by_creepage_x * din->creepage_x +
                       f->moment_by_creepage_y * din->creepage_y + f->moment_by_spin * din->spin};
    double size = sqrt(f->force_x * f->force_x + f->force_y * f->force_y);
    if (size > 0.0)
        df->utilisation =
            f->utilisation * (f->force_x * df->force_x + f->force_y * df->force_y) / (size * size);
    creep_forces pair = pair_of(table, p);
    creep_forces_state state;
    creep_forces_output unused;
    creep_forces_begin(&pair, in, &state, &unused); /* for the fall of the friction that is used */
    df->utilisation -=
        f->utilisation * (state.fall[0] * din->creepage_x + state.fall[1] * din->creepage_y +
                          state.fall[2] * din->spin);
    if (!(pace > 1e-300)) return;
    creep_forces_output found[2];
    double step = 1e-5 / pace;
    for (int i = 0; i < 2; i++) {
        double e = i == 0 ? step : -step;
        creep_forces_parameters q = {
            .shear_modulus = p->shear_modulus + e * dp->shear_modulus,
            .static_friction = p->static_friction + e * dp->static_friction,
            .kinetic_friction = p->kinetic_friction + e * dp->kinetic_friction,
            .weakening_length = fmax(0.0, p->weakening_length + e * dp->weakening_length),
            .slip_rate_residual = p->slip_rate_residual + e * dp->slip_rate_residual,
            .slip_rate_decay = p->slip_rate_decay + e * dp->slip_rate_decay,
            .softening_temperature = p->softening_temperature + e * dp->softening_temperature,
            .thermal_effusivity = p->thermal_effusivity + e * dp->thermal_effusivity};
        creep_forces_input at = {.semi_axis_x = in->semi_axis_x + e * din->semi_axis_x,
                                 .semi_axis_y = in->semi_axis_y + e * din->semi_axis_y,
                                 .normal_load = in->normal_load + e * din->normal_load,
                                 .friction_scale = in->friction_scale + e * din->friction_scale,
                                 .creepage_x = in->creepage_x,
                                 .creepage_y = in->creepage_y,
                                 .spin = in->spin,
                                 .speed = in->speed + e * din->speed};
        q.static_friction = fmax(q.static_friction, q.kinetic_friction);
        evaluate_at(table, &q, &at, &found[i]);
    }
    double per = 0.5 / step;
    df->force_x += per * (found[0].force_x - found[1].force_x);
    df->force_y += per * (found[0].force_y - found[1].force_y);
    df->spin_moment += per * (found[0].spin_moment - found[1].spin_moment);
    df->utilisation += per * (found[0].utilisation - found[1].utilisation);
}

const char *advance_pair(const creep_table *table, model_values *v, double step, double tolerance) {
    (void)table, (void)v, (void)step, (void)tolerance;
    return NULL;
}
