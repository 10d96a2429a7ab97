/* Creep forces of one contact. */
#ifndef CREEP_FORCES_FORMULA_H
#define CREEP_FORCES_FORMULA_H

#include <string.h>

#include "creep_forces.h"
#include "force_law.h"
#include "plane_formula.h"

static const double PI = 3.14159265358979324;

/* Scales of an ellipse by Hermite's cubic polynomials, and shares of the sets by Lagrange's. */
static inline void set_shape(const creep_forces *pair, double aspect, plane_shape *shape,
                             double value[ASPECT_SCALES]) {
    double place = logarithm(aspect) / LN_2 + 3.0; /* 0 to 6 */
    double at = place * (ASPECT_CELLS / 6.0);
    int cell = at < ASPECT_CELLS ? (int)at : ASPECT_CELLS - 1;
    double t = at - cell, u = 1.0 - t;
    const double *left = pair->scales[cell], *right = pair->scales[cell + 1];
    for (int k = 0; k < ASPECT_SCALES; k++)
        value[k] = u * u * ((1.0 + 2.0 * t) * left[k] + t * left[ASPECT_SCALES + k]) +
                   t * t * ((1.0 + 2.0 * u) * right[k] - u * right[ASPECT_SCALES + k]);
    int first = (int)place - 1;
    first = first < 0 ? 0 : first > PLANE_ASPECTS - 4 ? PLANE_ASPECTS - 4 : first;
    double p = place - first;
    int softens = pair->table->one_axis == 0; /* a curve holds as it is */
    *shape = (plane_shape){
        .stiffness_ratio = value[1] / value[0],
        .softening_x = softens ? value[2] : 0.0,
        .softening_y = softens ? value[3] : 0.0,
        .static_ratio = pair->parameters.static_friction / pair->parameters.kinetic_friction,
        .coefficients = pair->coefficients + (size_t)first * PLANE_COEFFICIENTS,
        .share = {(p - 1.0) * (p - 2.0) * (p - 3.0) / -6.0, p * (p - 2.0) * (p - 3.0) / 2.0,
                  p * (p - 1.0) * (p - 3.0) / -2.0, p * (p - 1.0) * (p - 2.0) / 6.0},
        .sets = 4,
    };
}

/* A contact before the law is read: without force if `by` is zero. */
typedef struct {
    plane_shape shape;
    plane_start at;
    double creepage[3], k_hat, by[3], scale[3]; /* by: normalized creepages per Kalker's */
    double fall[3];        /* derivatives of ln(friction) by Kalker's creepages */
    double k_per_friction; /* derivative of ln(k_hat) by ln(friction) */
} creep_forces_state;

/* Factor on both friction coefficients at the slip speed, with that of spin as its root mean square
 * over Hertz's pressure: that of a force element of this ellipse, rolling with a radius of 1. */
static inline double friction_left(const creep_forces *pair, const creep_forces_input *in,
                                   double modulus, double fall[3]) {
    const double minimum_speed =
        0.1; /* below it the heat that rolling carries off is regularised */
    const creep_forces_parameters *p = &pair->parameters;
    double a = in->semi_axis_x, b = in->semi_axis_y, square = in->speed * in->speed;
    double part[3] = {square * in->creepage_x, square * in->creepage_y,
                      square * 0.2 * (a * a + b * b) * in->spin};
    double slip = sqrt(part[0] * in->creepage_x + part[1] * in->creepage_y + part[2] * in->spin);
    const force_element_parameters wheel = {
        .static_friction = p->static_friction,
        .kinetic_friction = p->kinetic_friction,
        .weakening_length = p->weakening_length,
        .slip_rate_residual = p->slip_rate_residual,
        .slip_rate_decay = p->slip_rate_decay,
        .softening_temperature = p->softening_temperature,
        .thermal_effusivity = p->thermal_effusivity,
        .semi_width = a,
        .peak_pressure = 1.5 * in->normal_load / (PI * a * b), /* Eq. (20) */
        .contact_modulus = modulus,
        .slope_reduction = 1.0,
        .radius = 1.0,
        .minimum_speed = minimum_speed,
        .elliptic = 1.0,
    };
    const force_element_input rolling = {.omega = in->speed * (1.0 - in->creepage_x),
                                         .speed = in->speed,
                                         .friction_scale = in->friction_scale};
    friction_fall found = falling_friction(pair->table, &wheel, contact_scales_of(&wheel), &rolling,
                                           slip, decay_at(&wheel, slip), is_hot(&wheel));
    double per_slip = slip > 0.0 ? found.by_slip / slip : 0.0;
    for (int i = 0; i < 3; i++) fall[i] = per_slip * part[i];
    fall[0] -= found.by_rolling * in->speed;
    return found.scale;
}

ALWAYS_INLINE void creep_forces_begin(const creep_forces *pair, const creep_forces_input *in,
                                      creep_forces_state *state, creep_forces_output *out) {
    const creep_forces_parameters *p = &pair->parameters;
    double a = in->semi_axis_x, b = in->semi_axis_y, scale = in->friction_scale;
    double given = a / b, aspect = smaller(larger(given, 1.0 / 8.0), 8.0);
    double beyond = larger(given / aspect, aspect / given) - 1.0; /* rounding is not */
    *out = (creep_forces_output){.aspect_limited = beyond > 1e-9 ? 1.0 : 0.0};
    *state = (creep_forces_state){.by = {0.0}};
    if (!(in->normal_load > LEAST_LOAD && p->kinetic_friction * scale > LEAST_FRICTION)) return;
    double scales[ASPECT_SCALES];
    set_shape(pair, aspect, &state->shape, scales);
    double modulus = p->shear_modulus * scales[0] * (4.0 / (PI * PI)); /* of the rolling ellipse */
    if (p->slip_rate_decay > 0.0 || p->softening_temperature > 0.0)
        scale = friction_left(pair, in, modulus, state->fall);
    double f_d = p->kinetic_friction * scale;
    if (!(f_d > LEAST_FRICTION)) return;
    double sliding = f_d * in->normal_load, mean = sqrt(a * b);

    /* Creepages of the law are those of the force, so of the other sign; see plane_law.h. */
    double rate = p->shear_modulus * a * b / (sliding * 0.75 * PI);
    state->by[0] = -rate * scales[0];
    state->by[1] = -rate * scales[1];
    state->by[2] = -rate * 0.75 * PI * mean * scales[4];
    state->creepage[0] = state->by[0] * in->creepage_x;
    state->creepage[1] = state->by[1] * in->creepage_y;
    state->creepage[2] = state->by[2] * in->spin;
    state->scale[0] = state->scale[1] = sliding;
    state->scale[2] = sliding * mean;

    /* Eq. (17) with a p0 = 3 N/(2 pi b). */
    double drop = (p->static_friction - p->kinetic_friction) * scale;
    double k_hat =
        sqrt(2.0 * modulus * drop * p->weakening_length * b / (3.0 * f_d * f_d * in->normal_load));
    state->k_hat = smaller(k_hat, pair->table->k_max);
    state->k_per_friction = k_hat < pair->table->k_max ? -0.5 : 0.0;
    state->at = plane_begin(&state->shape, state->creepage, state->k_hat);
}

ALWAYS_INLINE void creep_forces_finish(const creep_forces_state *state, double q, double q_slope,
                                       double q_by_log_k, creep_forces_output *out) {
    if (state->by[0] == 0.0) return;
    plane_value found;
    plane_finish(&state->shape, state->creepage, state->k_hat, state->at, q, q_slope, q_by_log_k,
                 &found);

    double most = state->shape.static_ratio, size = plane_hold(&found, most);
    double slope[3][3];
    const double *scale = state->scale;
    for (int i = 0; i < 3; i++) {
        const double *by = found.by_creepage[i], *at = state->creepage;
        double by_friction = found.force[i] + state->k_per_friction * found.by_log_k[i] -
                             (by[0] * at[0] + by[1] * at[1] + by[2] * at[2]);
        for (int j = 0; j < 3; j++)
            slope[i][j] = scale[i] * (by[j] * state->by[j] + by_friction * state->fall[j]);
    }
    out->force_x = scale[0] * found.force[0];
    out->force_y = scale[1] * found.force[1];
    out->spin_moment = scale[2] * found.force[2];
    out->utilisation = smaller(size / most, 1.0);
    memcpy(&out->force_x_by_creepage_x, slope, sizeof slope);
}

/* Up to MOST_POINTS contacts. */
ALWAYS_INLINE void creep_forces_at(const creep_forces *pair, size_t n, const creep_forces_input *in,
                                   creep_forces_output *out) {
    creep_forces_state state[MOST_POINTS];
    double place[MOST_POINTS], k_hat[MOST_POINTS];
    double q[MOST_POINTS], slope[MOST_POINTS], by_log_k[MOST_POINTS];
    for (size_t i = 0; i < n; i++) {
        creep_forces_begin(pair, &in[i], &state[i], &out[i]);
        place[i] = state[i].at.place;
        k_hat[i] = state[i].at.k_hat;
    }
    evaluate_points(pair->table, n, place, k_hat, q, slope, by_log_k);
    for (size_t i = 0; i < n; i++)
        creep_forces_finish(&state[i], q[i], slope[i], by_log_k[i], &out[i]);
}

#endif
