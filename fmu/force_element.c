#include "force_element.h"

#include <math.h>

#include "regularized_speed.h"

#define AT(group, member) offsetof(force_element, group.member)
#define LARGE 1e300

static const double PI = 3.14159265358979323846;

static const model_variable VARIABLES[] = {
    {"radius", "m", "rolling radius of the wheel", 1e-6, 1e6, AT(parameters, radius),
     FIXED_PARAMETER},
    {"static_friction", "1", "friction coefficient before slip, not below the kinetic one", 1e-6,
     1e3, AT(parameters, static_friction), TUNABLE_PARAMETER},
    {"kinetic_friction", "1", "friction coefficient after much slip", 1e-6, 1e3,
     AT(parameters, kinetic_friction), TUNABLE_PARAMETER},
    {"weakening_length", "m", "slip over which friction weakens", 0.0, 1.0,
     AT(parameters, weakening_length), TUNABLE_PARAMETER},
    {"slope_reduction", "1", "third-body layer: initial slope over the elastic one", 1e-6, 1.0,
     AT(parameters, slope_reduction), TUNABLE_PARAMETER},
    {"semi_width", "m", "contact semi-width at nominal load", 1e-9, 1e3, AT(parameters, semi_width),
     FIXED_PARAMETER},
    {"peak_pressure", "Pa", "peak contact pressure at nominal load", 1e-3, 1e15,
     AT(parameters, peak_pressure), FIXED_PARAMETER},
    {"contact_modulus", "Pa", "composite contact modulus", 1e-3, 1e15,
     AT(parameters, contact_modulus), FIXED_PARAMETER},
    {"nominal_load", "N", "load of the given semi-width and peak pressure", 1e-6, 1e12,
     AT(parameters, nominal_load), FIXED_PARAMETER},
    {"load_exponent", "1", "semi-width and pressure grow like load to this power", 0.0, 1.0,
     AT(parameters, load_exponent), FIXED_PARAMETER},
    {"minimum_speed", "m/s", "speed below which the creepage is regularised", 1e-9, 1e3,
     AT(parameters, minimum_speed), FIXED_PARAMETER},
    {"slip_rate_residual", "1", "part of friction that high slip speed leaves", 1e-6, 1.0,
     AT(parameters, slip_rate_residual), TUNABLE_PARAMETER},
    {"slip_rate_decay", "s/m", "rate at which friction falls with slip speed", 0.0, 1e6,
     AT(parameters, slip_rate_decay), TUNABLE_PARAMETER},
    {"omega", "rad/s", "angular velocity of the wheel, positive when rolling forward", -1e9, 1e9,
     AT(input, omega), INPUT},
    {"speed", "m/s", "forward velocity of the wheel's centre", -1e9, 1e9, AT(input, speed), INPUT},
    {"normal_load", "N", "normal load", 0.0, 1e12, AT(input, normal_load), INPUT},
    {"friction_scale", "1", "multiplies both friction coefficients", 1e-6, 1e3,
     AT(input, friction_scale), INPUT},
    {"creep_force", "N", "force on the wheel, positive forward", -LARGE, LARGE,
     AT(output, creep_force), OUTPUT},
    {"wheel_torque", "N.m", "torque of the creep force on the wheel: -radius * creep_force", -LARGE,
     LARGE, AT(output, wheel_torque), OUTPUT},
    {"creepage", "1", "slip velocity over speed, positive in traction", -LARGE, LARGE,
     AT(output, creepage), OUTPUT},
    {"normalized_creepage", "1", "creepage over saturation creepage", -LARGE, LARGE,
     AT(output, normalized_creepage), OUTPUT},
    {"traction_coefficient", "1", "creep force over normal load", -LARGE, LARGE,
     AT(output, traction_coefficient), OUTPUT},
    {"force_gradient", "N.s/m", "change of creep force with slip velocity at fixed speed", -LARGE,
     LARGE, AT(output, force_gradient), OUTPUT},
    {"k_hat", "1", "normalized stress-intensity factor at this load, friction and slip speed", 0.0,
     LARGE, AT(output, k_hat), OUTPUT},
    {"saturation_creepage", "1",
     "creepage where Carter's stick zone vanishes, at this load, friction and slip speed", 0.0,
     LARGE, AT(output, saturation_creepage), OUTPUT},
    {"process_zone_ratio", "1", "length of the weakening zone over semi-width; valid below 0.5",
     0.0, LARGE, AT(output, process_zone_ratio), OUTPUT},
    {"falling_branch", "Boolean", "the force falls with creepage at fixed speed", 0.0, 1.0,
     AT(output, falling_branch), OUTPUT},
    {"speed_regularized", "Boolean", "speed is below minimum_speed", 0.0, 1.0,
     AT(output, speed_regularized), OUTPUT},
    {"k_hat_limited", "Boolean", "k_hat is held at the largest value of the table", 0.0, 1.0,
     AT(output, k_hat_limited), OUTPUT},
    {"force_limited", "Boolean", "the force is held at static friction times load", 0.0, 1.0,
     AT(output, force_limited), OUTPUT},
};

enum { VARIABLE_COUNT = sizeof VARIABLES / sizeof VARIABLES[0] };

const model_variable *force_element_variables(size_t *count) {
    *count = VARIABLE_COUNT;
    return VARIABLES;
}

const model_variable *force_element_invalid(const force_element *element, variable_role role) {
    for (size_t i = 0; i < VARIABLE_COUNT; i++) {
        const model_variable *v = &VARIABLES[i];
        if (v->role != role) continue;
        double value = *(const double *)(const void *)((const char *)element + v->offset);
        if (!(value >= v->minimum && value <= v->maximum)) return v; /* catches NaN too */
        if (v->offset == AT(parameters, static_friction) &&
            value < element->parameters.kinetic_friction)
            return v;
    }
    return NULL;
}

void force_element_scales(const force_element_parameters *p, double normal_load,
                          double friction_scale, contact_scales *scales) {
    double kinetic = friction_scale * p->kinetic_friction;
    double drop = friction_scale * (p->static_friction - p->kinetic_friction);
    double growth = pow(normal_load / p->nominal_load, p->load_exponent);
    double semi_width = p->semi_width * growth, pressure = p->peak_pressure * growth;
    double modulus = p->contact_modulus, width_load = semi_width * pressure;
    scales->saturation_creepage =
        2.0 * kinetic * pressure / (modulus * p->slope_reduction); /* Eq. (15) */
    scales->k_hat = sqrt(modulus * drop * p->weakening_length /
                         (PI * kinetic * kinetic * width_load)); /* Eq. (17) */
    /* 2 pi k_hat^2 (f_d / (f_s - f_d))^2, with Eq. (17) put in */
    scales->process_zone_ratio =
        drop > 0.0 ? 2.0 * modulus * p->weakening_length / (drop * width_load) : 0.0;
}

void force_element_evaluate(const creep_table *table, const force_element_parameters *p,
                            const force_element_input *in, force_element_output *out) {
    double reference, reference_slope;
    regularized_speed(in->speed, p->minimum_speed, &reference, &reference_slope);
    double slip = p->radius * in->omega - in->speed;
    double zeta = slip / reference;

    *out = (force_element_output){0};
    out->creepage = zeta;
    out->creepage_by_omega = p->radius / reference;
    out->creepage_by_speed = -(1.0 + zeta * reference_slope) / reference;
    out->speed_regularized = fabs(in->speed) < p->minimum_speed;
    if (in->normal_load == 0.0) return; /* no contact: no force, and no scales to speak of */

    /* Friction falls with slip speed by the factor g; the force has no kink where g has, at 0. */
    double passing = (1.0 - p->slip_rate_residual) * exp(-p->slip_rate_decay * fabs(slip));
    double g = passing + p->slip_rate_residual;
    double log_g_by_slip = -copysign(p->slip_rate_decay * passing / g, slip);
    double friction_scale = g * in->friction_scale;

    contact_scales scales;
    force_element_scales(p, in->normal_load, friction_scale, &scales);
    double k_hat = table->one_axis ? scales.k_hat : fmin(scales.k_hat, table->k_max);
    int k_hat_limited = k_hat < scales.k_hat;
    double log_k_by_log_load = k_hat_limited ? 0.0 : -p->load_exponent;
    double log_k_by_log_g = k_hat_limited ? 0.0 : -0.5;
    double x = zeta / scales.saturation_creepage;
    creep_value q;
    creep_table_evaluate(table, x, k_hat, &q);

    double most = p->static_friction / p->kinetic_friction;
    int limited = fabs(q.traction_ratio) > most; /* the law does not know f_s; friction does */
    if (limited) q = (creep_value){copysign(most, q.traction_ratio), 0.0, 0.0};

    double kinetic = friction_scale * p->kinetic_friction, sliding = kinetic * in->normal_load;
    double by_log_g = q.traction_ratio - x * q.slope + log_k_by_log_g * q.log_k_derivative;
    double through_g = by_log_g * log_g_by_slip; /* dq/dw by way of the slip speed w alone */
    double slope = q.slope + through_g * reference * scales.saturation_creepage; /* at this speed */
    double by_creepage = sliding * slope / scales.saturation_creepage;
    out->creep_force = sliding * q.traction_ratio;
    out->wheel_torque = -p->radius * out->creep_force;
    out->normalized_creepage = x;
    out->traction_coefficient = kinetic * q.traction_ratio;
    out->force_gradient = by_creepage / reference;
    out->k_hat = k_hat;
    out->saturation_creepage = scales.saturation_creepage;
    out->process_zone_ratio = scales.process_zone_ratio;
    out->falling_branch = slope < 0.0;
    out->k_hat_limited = k_hat_limited;
    out->force_limited = limited;
    out->force_by_omega = by_creepage * out->creepage_by_omega;
    out->force_by_speed = sliding * q.slope / scales.saturation_creepage * out->creepage_by_speed -
                          sliding * through_g;
    out->force_by_load = kinetic * (q.traction_ratio - p->load_exponent * x * q.slope +
                                    log_k_by_log_load * q.log_k_derivative);
}

void force_element_evaluate_many(const creep_table *table,
                                 const force_element_parameters *parameters, size_t n,
                                 const force_element_input *input, force_element_output *output) {
    for (size_t i = 0; i < n; i++) force_element_evaluate(table, parameters, &input[i], &output[i]);
}
