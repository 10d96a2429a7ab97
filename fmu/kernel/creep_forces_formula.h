/* Creep forces of one contact: those of a force element with this ellipse and a radius of 1. */
#ifndef CREEP_FORCES_FORMULA_H
#define CREEP_FORCES_FORMULA_H

#include <string.h>

#include "creep_forces.h"
#include "lateral_spin_force.h"

/* Scales of an ellipse by Hermite's cubic polynomials, and shares of the sets by Lagrange's. */
static inline void set_shape(const creep_forces *bodies, double aspect, lateral_spin_shape *shape,
                             double value[ASPECT_SCALES]) {
    double position = logarithm(aspect) / LN_2 + 3.0; /* 0 to 6 */
    double at = position * (ASPECT_CELLS / 6.0);
    int cell = at < ASPECT_CELLS ? (int)at : ASPECT_CELLS - 1;
    double t = at - cell, u = 1.0 - t;
    const double *left = bodies->scales[cell], *right = bodies->scales[cell + 1];
    for (int k = 0; k < ASPECT_SCALES; k++)
        value[k] = u * u * ((1.0 + 2.0 * t) * left[k] + t * left[ASPECT_SCALES + k]) +
                   t * t * ((1.0 + 2.0 * u) * right[k] - u * right[ASPECT_SCALES + k]);
    int first = (int)position - 1;
    first = first < 0 ? 0 : first > LATERAL_SPIN_ASPECTS - 4 ? LATERAL_SPIN_ASPECTS - 4 : first;
    double p = position - first;
    *shape = (lateral_spin_shape){
        .stiffness_ratio = value[1] / value[0],
        .softening_y = value[3],
        .coefficients = bodies->coefficients + (size_t)first * LATERAL_SPIN_COEFFICIENTS,
        .share = {(p - 1.0) * (p - 2.0) * (p - 3.0) / -6.0, p * (p - 2.0) * (p - 3.0) / 2.0,
                  p * (p - 1.0) * (p - 3.0) / -2.0, p * (p - 1.0) * (p - 2.0) / 6.0},
        .sets = 4,
    };
}

/* Kalker's creepages are those of the wheel against the rail, so the force is against them: with
 * the other sign they are those of lateral_spin_force.h. Without force the scales are zero. */
ALWAYS_INLINE void creep_forces_begin(const creep_forces *bodies, const creep_forces_parameters *p,
                                      const creep_forces_input *in, lateral_spin_force *s,
                                      creep_forces_output *out) {
    const double minimum_speed =
        0.1; /* below it the heat that rolling carries off is regularised */
    double a = in->semi_axis_x, b = in->semi_axis_y, speed = in->speed;
    memset(out, 0, sizeof *out);
    s->scale[0] = s->start.point = s->start.k_hat = s->start.layer = 0.0;
    if (!(a >= MIN_SEMI_AXIS && b >= MIN_SEMI_AXIS)) return;
    double given = a / b, aspect = smaller(larger(given, 1.0 / 8.0), 8.0);
    double beyond = larger(given / aspect, aspect / given) - 1.0; /* rounding is not */
    out->aspect_limited = beyond > 1e-9 ? 1.0 : 0.0;
    const force_element_input rolling = {.omega = speed * (1.0 - in->creepage_x),
                                         .speed = speed,
                                         .normal_load = in->normal_load,
                                         .friction_scale = in->friction_scale};
    if (!(in->normal_load > MIN_LOAD) || !has_friction(&rolling)) return;
    double scales[ASPECT_SCALES];
    int softens = bodies->table->one_axis == 0; /* a curve holds as it is */
    lateral_spin_contact ellipse;
    set_shape(bodies, aspect, &ellipse.shape, scales);
    if (!softens) ellipse.shape.softening_y = 0.0;
    ellipse.axes_ratio = b / a;
    ellipse.spin_arm = 0.75 * PI * sqrt(b / a) * scales[4] / scales[0];
    const force_element_parameters wheel = {
        .radius = 1.0,
        .static_friction = p->static_friction,
        .kinetic_friction = p->kinetic_friction,
        .weakening_length = p->weakening_length,
        .slope_reduction = 1.0,
        .layer_compliance = p->layer_compliance,
        .semi_width = a,
        .peak_pressure = 1.5 * in->normal_load / (PI * a * b),               /* Eq. (20) */
        .contact_modulus = p->shear_modulus * scales[0] * (4.0 / (PI * PI)), /* of rolling */
        .softening = softens ? scales[2] : 0.0,
        .minimum_speed = minimum_speed,
        .slip_rate_residual = p->slip_rate_decay > 0.0 ? p->slip_rate_residual : 1.0,
        .slip_rate_decay = p->slip_rate_decay,
        .softening_temperature = p->softening_temperature,
        .thermal_effusivity = p->thermal_effusivity,
        .elliptic = 1.0,
    };
    double turning = speed * sqrt(0.2 * (a * a + b * b));
    slip_speeds slip =
        slip_of_parts(-speed * in->creepage_x, -speed * in->creepage_y, -turning * in->spin);
    lateral_spin_force_begin(bodies->table, &ellipse, &wheel, &rolling, slip, s);
    s->at.creepage = -in->creepage_x; /* given, at any speed */
    s->at.x = s->at.creepage * s->at.inverse_saturation;
    if (!(s->at.kinetic > MIN_FRICTION)) s->scale[0] = 0.0;
    else lateral_spin_force_set_point(bodies->table, -in->creepage_y, -in->spin, s);
}

/* Derivatives of the logarithm of friction by Kalker's creepages. */
ALWAYS_INLINE void fall_of_friction(const creep_forces_input *in, const lateral_spin_force *s,
                                    double fall[3]) {
    double a = in->semi_axis_x, b = in->semi_axis_y, square = in->speed * in->speed;
    double per_slip = s->slip.size > 0.0 ? s->fall.by_slip / s->slip.size * square : 0.0;
    fall[0] = per_slip * in->creepage_x - s->fall.by_rolling * in->speed;
    fall[1] = per_slip * in->creepage_y;
    fall[2] = per_slip * 0.2 * (a * a + b * b) * in->spin;
}

ALWAYS_INLINE void creep_forces_finish(const creep_table *table, const creep_forces_input *in,
                                       creep_value q, lateral_spin_force *s,
                                       creep_forces_output *out) {
    if (s->scale[0] == 0.0) return;
    double by[3][3], fall[3];
    lateral_spin_force_finish(table, q, s);
    fall_of_friction(in, s, fall);
    for (int i = 0; i < 3; i++) {
        double by_friction = change_with_friction(s, i);
        for (int j = 0; j < 3; j++)
            by[i][j] = s->scale[i] * (by_friction * fall[j] - s->law.by_creepage[i][j] * s->per[j]);
    }
    out->force_x = s->scale[0] * s->law.force[0];
    out->force_y = s->scale[1] * s->law.force[1];
    out->spin_moment = s->scale[2] * s->law.force[2];
    out->utilisation = smaller(s->size / s->limit, 1.0);
    memcpy(&out->force_x_by_creepage_x, by, sizeof by);
}

/* Up to MAX_POINTS contacts. */
ALWAYS_INLINE void creep_forces_at(const creep_forces *bodies, const creep_forces_parameters *p,
                                   size_t n, const creep_forces_input *in,
                                   creep_forces_output *out) {
    lateral_spin_force state[MAX_POINTS];
    double point[MAX_POINTS], k_hat[MAX_POINTS], layer[MAX_POINTS];
    double q[MAX_POINTS], slope[MAX_POINTS], by_log_k[MAX_POINTS], by_log_layer[MAX_POINTS];
    for (size_t i = 0; i < n; i++) {
        creep_forces_begin(bodies, p, &in[i], &state[i], &out[i]);
        point[i] = state[i].start.point;
        k_hat[i] = state[i].start.k_hat;
        layer[i] = state[i].start.layer;
    }
    evaluate_points(bodies->table, n, point, k_hat, layer, q, slope, by_log_k, by_log_layer);
    for (size_t i = 0; i < n; i++) {
        creep_value of_table = {q[i], slope[i], by_log_k[i], by_log_layer[i]};
        creep_forces_finish(bodies->table, &in[i], of_table, &state[i], &out[i]);
    }
}

#endif
