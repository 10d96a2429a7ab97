#include "force_element.h"

#include <math.h>

#include "force_law.h"
#include "relaxation.h"

double process_zone_limit(void) { return PROCESS_ZONE_LIMIT; }

void force_element_scales(const force_element_parameters *p, double normal_load,
                          double friction_scale, contact_scales *scales) {
    force_element_parameters there = force_element_at_load(p, normal_load);
    *scales = scaled(contact_scales_of(&there), friction_scale);
}

/* Without contact there is no force. Its derivative by the load is that of a fully sliding patch.
 */
static void evaluate_unloaded(const creep_table *table, const force_element_parameters *p,
                              const force_element_input *in, force_element_output *out) {
    creep_value q;
    force_state at = begin_force(table, p, contact_scales_of(p), in, decay_at(p, slip_of(p, in)));
    *out =
        (force_element_output){.falling_margin = -1.0, .k_hat_margin = -1.0, .force_margin = -1.0};
    set_kinematics(p, in, &at, out);
    relaxation_rate(p, in, at.slip, 0.0, 0.0, out);
    creep_table_evaluate(table, copysign(1e30, at.acting), table->one_axis ? 1.0 : table->k_max,
                         &q);
    out->force_by_load = at.acting == 0.0 ? 0.0 : at.kinetic * q.traction_ratio;
}

void force_element_evaluate(const creep_table *table, const force_element_parameters *parameters,
                            const force_element_input *in, force_element_output *out) {
    if (!is_loaded(parameters, in->normal_load)) {
        evaluate_unloaded(table, parameters, in, out);
        return;
    }
    creep_value q;
    force_element_parameters p = force_element_at_load(parameters, in->normal_load);
    force_state at =
        begin_force(table, &p, contact_scales_of(&p), in, decay_at(&p, slip_of(&p, in)));
    creep_table_evaluate(table, at.x, at.k_hat, &q);
    finish_force(table, &p, in, &at, q, out);
    if (p.relaxation_length > 0.0)
        relaxation_rate(&p, in, at.slip, at.scales.saturation_creepage, at.log_g_by_slip, out);
    else
        out->relaxation_rate = out->rate_by_omega = out->rate_by_speed = out->rate_by_relaxed = 0.0;
}

void force_element_tangent(const creep_table *table, const force_element_parameters *parameters,
                           const force_element_input *input, const force_element_output *output,
                           const force_element_parameters *parameters_direction,
                           const force_element_input *input_direction,
                           force_element_output *change) {
    force_tangent(table, parameters, input, output, parameters_direction, input_direction, change);
}
