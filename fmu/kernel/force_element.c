#include "force_element.h"

#include <math.h>
#include <string.h>

#include "force_element_formula.h"
#include "lateral_spin_force.h"

/* Without load or friction there is no force. Its derivative by a load that begins is that of a
 * patch that slides all over. */
static void evaluate_without_grip(const creep_table *table, const force_element_parameters *p,
                                  const force_element_input *in, force_element_output *out) {
    friction_fall fall = friction_without_grip(table, p, in);
    force_state at =
        begin_force(table, p, contact_scales_of(table, p), in, &fall, direction_of(slip_of(p, in)));
    memset(out, 0, sizeof *out);
    out->falling_margin = out->k_hat_margin = out->force_margin = out->length_margin = -1.0;
    set_kinematics(p, in, &at, out);
    if (remembers(p)) {
        release_memory(in, out);
        return;
    }
    double share[2];
    if (in->normal_load >= 0.0 && has_friction(in)) {
        sliding_shares(table, p, in, &at, share);
        out->force_by_load = share[0];
    }
}

void force_element_evaluate(const creep_table *table, const force_element_parameters *parameters,
                            const force_element_input *in, force_element_output *out) {
    if (!can_grip(parameters, in)) {
        evaluate_without_grip(table, parameters, in, out);
        return;
    }
    creep_value q;
    force_element_parameters p = force_element_at_load(parameters, in->normal_load);
    if (has_lateral_or_spin(table, in)) {
        lateral_spin_force_evaluate(table, &p, in, out);
        return;
    }
    contact_scales scales = contact_scales_of(table, &p);
    double slip = slip_of(&p, in), size = fabs(slip);
    friction_fall fall =
        falling_friction(table, &p, scales, in, size, decay_at(&p, size), softens_with_heat(&p));
    force_state at = begin_force(table, &p, scales, in, &fall, direction_of(slip));
    if (has_layer(&p)) {
        stiffness_left left;
        stiffness_of_layers(1, &p.softening, &at.x, &at.scales.layer_ratio, &left);
        add_layer(&p, left, &at);
    }
    creep_table_evaluate(table, at.point.x, at.point.k_hat, at.point.layer_ratio, &q);
    finish_force(table, &p, in, &at, q, out);
    if (!remembers(&p)) return;
    if (holds_lateral(in)) memory_action(2, &p, in, &at, 1, 1, out);
    else memory_action(1, &p, in, &at, 1, 1, out);
}

void force_elements_evaluate(const creep_table *table, const force_task *tasks, size_t n) {
#ifndef ONE_FILE_KERNEL
    if (n > FEW_WHEELS) {
        force_elements_evaluate_wide(table, tasks, n);
        return;
    }
#endif /* ONE_FILE_KERNEL */
    for (size_t i = 0; i < n; i++)
        force_element_evaluate(table, tasks[i].parameters, tasks[i].input, tasks[i].output);
}

double force_element_steepest(const creep_table *table, const force_element_parameters *parameters,
                              const force_element_input *in, const force_element_output *out) {
    if (!table->one_axis || fabs(out->normalized_creepage) >= table->steepest_creepage ||
        !can_grip(parameters, in))
        return out->force_gradient;
    force_element_parameters p = force_element_at_load(parameters, in->normal_load);
    double reference, slope; /* friction multiplies force and zeta0 alike */
    regularized_speed(in->speed, slowest_speed(&p), &reference, &slope);
    double per_creepage =
        in->normal_load * p.kinetic_friction / contact_scales_of(table, &p).saturation_creepage;
    return larger(out->force_gradient, per_creepage * table->steepest_slope / reference);
}

#ifndef ONE_FILE_KERNEL
double process_zone_limit(void) { return PROCESS_ZONE_LIMIT; }

void force_element_scales(const creep_table *table, const force_element_parameters *p,
                          double normal_load, double friction_scale, contact_scales *scales) {
    force_element_parameters there = force_element_at_load(p, normal_load);
    *scales = scaled(contact_scales_of(table, &there), friction_scale, 1.0 / friction_scale);
}

void thermal_softening_many(int elliptic, size_t n, const double *x, const double *heat_number,
                            const double *k_hat, double *fraction) {
    heat_shape shape = elliptic ? HEAT_ELLIPSE : HEAT_LINE;
    for (size_t i = 0; i < n; i++) {
        double r = x[i] * heat_number[i];
        fraction[i] = thermal_softening_at(shape, x[i], r, heat_number[i], k_hat[i]).value;
    }
}

double force_element_force(const creep_table *table, const force_element_parameters *parameters,
                           const force_ranges *ranges, double omega, double speed,
                           double normal_load, double friction_scale) {
    double given[4] = {omega, speed, normal_load, friction_scale};
    for (int i = 0; i < 4; i++)
        if (!(given[i] >= ranges->minimum[i] && given[i] <= ranges->maximum[i])) return NAN;
    force_element_input in;
    force_element_output out;
    memset(&in, 0, sizeof in);
    in.omega = omega;
    in.speed = speed;
    in.normal_load = normal_load;
    in.friction_scale = friction_scale;
    force_element_evaluate(table, parameters, &in, &out);
    return out.creep_force;
}
#endif /* ONE_FILE_KERNEL */
