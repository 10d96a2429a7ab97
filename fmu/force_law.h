/* The force element's formulas before and after those of the table, without branches. */
#ifndef FORCE_LAW_H
#define FORCE_LAW_H

#include <math.h>

#include "force_element.h"
#include "inline.h"
#include "regularized_speed.h"

/* What is next to no load is none: the scales of its contact would leave the range of numbers. */
ALWAYS_INLINE int is_loaded(const force_element_parameters *p, double load) {
    return !(load <= 1e-100 * p->nominal_load); /* what is not a number shows */
}

/* Of semi-width and peak pressure, by a ratio of loads: Hertz's powers of a line contact and of an
 * ellipse need no logarithm. */
static inline double growth_with_load(double ratio, double exponent) {
    if (exponent == 0.5) return sqrt(ratio);
    if (exponent == 1.0 / 3.0) return cube_root(ratio);
    return power_of(ratio, exponent);
}

/* The same bodies under a load above zero: the contact of which it is the nominal load. */
ALWAYS_INLINE force_element_parameters force_element_at_load(const force_element_parameters *p,
                                                             double load) {
    force_element_parameters there = *p;
    if (load == p->nominal_load) return there;
    double growth = growth_with_load(load / p->nominal_load, p->load_exponent);
    there.semi_width *= growth;
    there.peak_pressure *= growth;
    there.nominal_load = load;
    return there;
}

/* Scales at the nominal load, of the friction as given. */
ALWAYS_INLINE contact_scales contact_scales_of(const force_element_parameters *p) {
    const double inverse_pi = 0.31830988618379067;
    double drop = p->static_friction - p->kinetic_friction, kinetic = p->kinetic_friction;
    double modulus = p->contact_modulus;
    double weakening = modulus * p->weakening_length / (p->semi_width * p->peak_pressure);
    double zone = 2.0 * weakening / drop; /* 2 pi k_hat^2 (f_d / (f_s - f_d))^2, with Eq. (17) */
    return (contact_scales){
        .saturation_creepage =
            2.0 * kinetic * p->peak_pressure / (modulus * p->slope_reduction), /* Eq. (15) */
        .k_hat = sqrt(weakening * drop * inverse_pi) / kinetic,                /* Eq. (17) */
        .process_zone_ratio = drop > 0.0 ? zone : 0.0,
    };
}

/* The same with both coefficients times a factor. */
ALWAYS_INLINE contact_scales scaled(contact_scales s, double friction) {
    double inverse = 1.0 / friction;
    return (contact_scales){s.saturation_creepage * friction, s.k_hat * sqrt(inverse),
                            s.process_zone_ratio * inverse};
}

ALWAYS_INLINE double slip_of(const force_element_parameters *p, const force_element_input *in) {
    return p->radius * in->omega - in->speed;
}

/* exp(-B w) of friction that falls with slip speed w. */
ALWAYS_INLINE double slip_decay(const force_element_parameters *p, double slip) {
    return decaying_exponential(p->slip_rate_decay * fabs(slip));
}

/* Factor on friction, and its part that passes. */
ALWAYS_INLINE double slip_rate_factor(const force_element_parameters *p, double decay,
                                      double *passing) {
    *passing = (1.0 - p->slip_rate_residual) * decay;
    return *passing + p->slip_rate_residual;
}

/* Everything that is known before the table is read. */
typedef struct {
    double slip;               /* slip velocity [m/s] */
    double creepage;           /* [1] */
    double speed_slope;        /* of the creepage's reference speed by the speed [1] */
    double inverse_speed;      /* one over that reference speed [s/m] */
    double reference;          /* that speed [m/s] */
    double acting;             /* creepage that the force follows [1] */
    double kinetic;            /* f_d here [1] */
    double log_g_by_slip;      /* of the factor g on friction [s/m] */
    double inverse_saturation; /* one over zeta0 [1] */
    contact_scales scales;
    double x, k_hat; /* where the table is read */
} force_state;

/* The parameters' nominal load is to be the input's, the scales are those of the parameters, and
 * decay is that of the slip. */
ALWAYS_INLINE force_state begin_force(const creep_table *table, const force_element_parameters *p,
                                      contact_scales scales, const force_element_input *in,
                                      double decay) {
    force_state at;
    double passing, k_max = table->one_axis ? INFINITY : table->k_max;
    at.slip = slip_of(p, in);
    regularized_speed(in->speed, p->minimum_speed, &at.reference, &at.speed_slope);
    at.inverse_speed = 1.0 / at.reference;
    at.creepage = at.slip * at.inverse_speed;
    at.acting = p->relaxation_length > 0.0 ? in->relaxed_creepage : at.creepage;
    /* Friction falls with slip speed by the factor g; the force has no kink where g has, at 0. */
    double g = slip_rate_factor(p, decay, &passing), friction_scale = g * in->friction_scale;
    double log_g = p->slip_rate_decay * passing / g; /* g has a kink where nothing slips */
    at.log_g_by_slip = at.slip == 0.0 ? 0.0 : -copysign(log_g, at.slip);
    at.kinetic = friction_scale * p->kinetic_friction;
    at.scales = scaled(scales, friction_scale);
    at.inverse_saturation = 1.0 / at.scales.saturation_creepage;
    at.x = at.acting * at.inverse_saturation;
    at.k_hat = smaller(at.scales.k_hat, k_max);
    return at;
}

/* What depends on the velocities alone. */
ALWAYS_INLINE void set_kinematics(const force_element_parameters *p, const force_element_input *in,
                                  const force_state *at, force_element_output *out) {
    double below = p->minimum_speed - fabs(in->speed);
    out->creepage = at->creepage;
    out->creepage_by_omega = p->radius * at->inverse_speed;
    out->creepage_by_speed = -(1.0 + at->creepage * at->speed_slope) * at->inverse_speed;
    /* With relaxation nothing is regularised. */
    out->speed_margin = p->relaxation_length > 0.0 ? -1.0 : below;
    out->speed_regularized = out->speed_margin > 0.0 ? 1.0 : 0.0;
}

/* Outputs but for those of the relaxation, from the table's value. */
ALWAYS_INLINE void finish_force(const creep_table *table, const force_element_parameters *p,
                                const force_element_input *in, const force_state *at, creep_value q,
                                force_element_output *out) {
    double zeta0 = at->scales.saturation_creepage, x = at->x;
    int relaxed = p->relaxation_length > 0.0;
    double k_margin = at->scales.k_hat - table->k_max;
    out->k_hat_margin = table->one_axis ? -1.0 : k_margin;
    int k_limited = out->k_hat_margin > 0.0;
    out->k_hat_limited = k_limited ? 1.0 : 0.0;

    /* The law does not know f_s; friction does. */
    out->force_margin = p->kinetic_friction * fabs(q.traction_ratio) - p->static_friction;
    int force_limited = out->force_margin > 0.0;
    double most = copysign(p->static_friction / p->kinetic_friction, q.traction_ratio);
    out->force_limited = force_limited ? 1.0 : 0.0;
    q.traction_ratio = force_limited ? most : q.traction_ratio;
    q.slope = force_limited ? 0.0 : q.slope;
    q.log_k_derivative = force_limited ? 0.0 : q.log_k_derivative;

    double sliding = at->kinetic * in->normal_load, per_creepage = sliding * at->inverse_saturation;
    double log_k_by_log_load = k_limited ? 0.0 : -p->load_exponent;
    double log_k_by_log_g = k_limited ? 0.0 : -0.5;
    /* dq/dw by way of the slip speed w alone */
    double by_log_g = q.traction_ratio - x * q.slope + log_k_by_log_g * q.log_k_derivative;
    double through_g = by_log_g * at->log_g_by_slip;
    double slope = q.slope + through_g * zeta0 * at->reference; /* at this speed */
    double by_creepage = per_creepage * slope;
    set_kinematics(p, in, at, out);
    out->creep_force = sliding * q.traction_ratio;
    out->wheel_torque = -p->radius * out->creep_force;
    out->normalized_creepage = x;
    out->traction_coefficient = at->kinetic * q.traction_ratio;
    out->force_gradient = by_creepage * at->inverse_speed;
    out->k_hat = at->k_hat;
    out->saturation_creepage = zeta0;
    out->process_zone_ratio = at->scales.process_zone_ratio;
    /* An indicator must not stay at zero, as the slope does where the force is held. */
    out->falling_margin = slope == 0.0 ? -1.0 : -slope;
    out->falling_branch = slope < 0.0 ? 1.0 : 0.0;
    out->force_by_load = at->kinetic * (q.traction_ratio - p->load_exponent * x * q.slope +
                                        log_k_by_log_load * q.log_k_derivative);
    double straight = by_creepage * out->creepage_by_omega;
    double by_speed = per_creepage * q.slope * out->creepage_by_speed - sliding * through_g;
    out->force_by_omega = relaxed ? sliding * through_g * p->radius : straight;
    out->force_by_speed = relaxed ? -sliding * through_g : by_speed;
    out->force_by_relaxed = relaxed ? per_creepage * q.slope : 0.0;
}

#endif
