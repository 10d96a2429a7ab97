/* The force element's formulas before and after the evaluation of the table, without branches, and
 * their derivatives. */
#ifndef FORCE_ELEMENT_FORMULA_H
#define FORCE_ELEMENT_FORMULA_H

#include <math.h>

#include "force_element.h"
#include "heat.h"
#include "memory.h"
#include "simd_math.h"
#include "softening.h"

/* A tiny load counts as zero: the scales of its contact would overflow. */
ALWAYS_INLINE int is_loaded(const force_element_parameters *p, double load) {
    return !(load <= 1e-100 * p->nominal_load); /* true for NaN, so that it shows in the output */
}

ALWAYS_INLINE int has_friction(const force_element_input *in) {
    return !(in->friction_scale < MIN_FRICTION_SCALE);
}

/* Whether there can be a force. */
ALWAYS_INLINE int can_grip(const force_element_parameters *p, const force_element_input *in) {
    return is_loaded(p, in->normal_load) & has_friction(in);
}

/* Growth of semi-width and peak pressure with a ratio of loads; Hertz's powers for a line contact
 * and an ellipse need no logarithm. */
ALWAYS_INLINE double growth_with_load(double ratio, double exponent) {
    if (exponent == 0.5) return sqrt(ratio);
    if (exponent == 1.0 / 3.0) return cube_root(ratio);
    return power_of(ratio, exponent);
}

/* Parameters of the same bodies with a load above zero as the nominal load. */
ALWAYS_INLINE force_element_parameters force_element_at_load(const force_element_parameters *p,
                                                             double load) {
    force_element_parameters there = *p;
    if (load == p->nominal_load) return there;
    double growth = growth_with_load(load / p->nominal_load, p->load_exponent);
    there.semi_width *= growth;
    there.peak_pressure *= growth;
    there.relaxation_length *= growth;
    there.lateral_relaxation_length *= growth;
    there.nominal_load = load;
    return there;
}

/* Whether there is a layer between the bodies. */
ALWAYS_INLINE int has_layer(const force_element_parameters *p) { return p->layer_compliance > 0.0; }

/* Whether friction falls with temperature. */
ALWAYS_INLINE int softens_with_heat(const force_element_parameters *p) {
    return p->softening_temperature > 0.0;
}

/* Scales at the nominal load, with the friction coefficients as given. */
ALWAYS_INLINE contact_scales contact_scales_of(const force_element_parameters *p) {
    const double inverse_pi = 0.31830988618379067;
    double drop = p->static_friction - p->kinetic_friction, kinetic = p->kinetic_friction;
    double modulus = p->contact_modulus;
    double weakening = modulus * p->weakening_length / (p->semi_width * p->peak_pressure);
    double zone = 2.0 * weakening / drop; /* 2 pi k_hat^2 (f_d / (f_s - f_d))^2, with Eq. (17) */
    double heating = 0.0;
    if (softens_with_heat(p)) {
        double mean = p->elliptic != 0.0 ? HEAT_ELLIPSE.mean : HEAT_LINE.mean;
        double per_flow = mean * kinetic / (p->softening_temperature * p->thermal_effusivity);
        heating = per_flow * p->peak_pressure * sqrt(p->semi_width * inverse_pi);
    }
    contact_scales s = {
        2.0 * kinetic * p->peak_pressure / (modulus * p->slope_reduction), /* Eq. (15) */
        sqrt(weakening * drop * inverse_pi) / kinetic,                     /* Eq. (17) */
        drop > 0.0 ? zone : 0.0,
        heating,
        p->layer_compliance * modulus / (2.0 * p->semi_width),
    };
    return s;
}

/* Scales with both friction coefficients multiplied by a factor, whose inverse is given too. */
ALWAYS_INLINE contact_scales scaled(contact_scales s, double friction, double inverse) {
    s.saturation_creepage *= friction;
    s.k_hat *= sqrt(inverse);
    s.process_zone_ratio *= inverse;
    s.heating *= friction;
    return s;
}

/* Arguments of the table for an ellipse on a half-space: its stiffness decreases as the stick area
 * shrinks, by the softening times the creepage, up to saturation. zeta0 and k_hat contain the
 * modulus as in Eqs. (15) and (17). Without softening the arguments are x and k_hat. */
typedef struct {
    double x, k_hat, layer_ratio; /* arguments of the table */
    double x_by_x;                /* derivatives by the creepage */
    double log_left_by_x;         /* of the logarithm of the stiffness that is left; half of it is
                                     that of ln(k_hat) */
    double log_left_by_log_layer;
} softened_place;

ALWAYS_INLINE softened_place softened_at(double softening, double x, double k_hat) {
    double size = fabs(x);
    held_creepage held = held_up_to_saturation(softening, size);
    double left = 1.0 - softening * held.value, loss = softening * held.by_size;
    softened_place place = {
        x * left, k_hat * sqrt(left), 0.0, left - loss * size, -copysign(1.0, x) * (loss / left),
        0.0};
    return place;
}

/* The same with a layer, which scales like x. */
ALWAYS_INLINE softened_place softened_with_layer(double softening, double x, double k_hat,
                                                 double layer_ratio) {
    stiffness_left rest = {1.0, 0.0, 0.0, 0.0};
    if (softening != 0.0) rest = stiffness_with_layer(softening, fabs(x), layer_ratio);
    double left = rest.value, by_size = rest.by_size;
    softened_place place = {x * left,
                            k_hat * sqrt(left),
                            layer_ratio * left,
                            left + by_size * fabs(x),
                            copysign(1.0, x) * (by_size / left),
                            rest.by_log_layer / left};
    return place;
}

/* The table's value at a softened place, with its slope by the creepage itself. */
ALWAYS_INLINE creep_value at_softened_place(softened_place place, creep_value q) {
    double by_x = q.slope, by_left = 0.5 * q.log_k_derivative + q.log_layer_derivative;
    q.slope = by_x * place.x_by_x + by_left * place.log_left_by_x;
    q.log_layer_derivative += (by_x * place.x + by_left) * place.log_left_by_log_layer;
    return q;
}

ALWAYS_INLINE creep_value law_value(const creep_table *table, double softening, double x,
                                    double k_hat) {
    creep_value q;
    softened_place place = softened_at(softening, x, k_hat);
    creep_table_evaluate(table, place.x, place.k_hat, 0.0, &q);
    return at_softened_place(place, q);
}

ALWAYS_INLINE double slip_of(const force_element_parameters *p, const force_element_input *in) {
    return p->radius * in->omega - in->speed;
}

/* exp(-B w) at the slip speed w. */
ALWAYS_INLINE double slip_decay(const force_element_parameters *p, double slip) {
    return decaying_exponential(p->slip_rate_decay * fabs(slip));
}

/* The branch saves time: an exponential costs as much as the law. */
static inline double decay_at(const force_element_parameters *p, double slip) {
    return p->slip_rate_decay == 0.0 ? 1.0 : slip_decay(p, slip);
}

/* Factor g on both friction coefficients, and derivatives of ln(g). */
typedef struct {
    double scale;           /* g times the friction scale */
    double inverse;         /* one over it */
    double passing;         /* part of the factor by slip speed that vanishes at high slip speed */
    double temperature;     /* [K] */
    double by_slip;         /* by the magnitude w of the slip velocity [s/m] */
    double thermal_by_slip; /* the part of it by thermal softening */
    double by_rolling;      /* by omega r, as it carries heat, [s/m] */
    double by_speed;        /* and by the speed, both at fixed w [s/m] */
    double by_log_heating;  /* by ln(1/w_T) [1] */
    double by_log_zeta0;    /* by the logarithms of the scales without heat [1] */
    double by_log_k;        /* [1] */
} friction_fall;

/* g at the magnitude of the slip velocity; scales are those of friction scale 1, and thermal is
 * whether friction falls with temperature. Rail and wheel move through the contact at the speeds V
 * and omega r, and the heat that they absorb is proportional to sqrt(V) + sqrt(omega r). */
ALWAYS_INLINE friction_fall falling_friction(const creep_table *table,
                                             const force_element_parameters *p,
                                             contact_scales scales, const force_element_input *in,
                                             double slip, double decay, int thermal) {
    friction_fall fall;
    memset(&fall, 0, sizeof fall);
    fall.passing = (1.0 - p->slip_rate_residual) * decay;
    double by_speed = fall.passing + p->slip_rate_residual;
    double friction = has_friction(in) ? in->friction_scale : 1.0;
    fall.scale = by_speed * friction;
    fall.inverse = 1.0 / fall.scale;
    fall.by_slip = -(p->slip_rate_decay * fall.passing) * (fall.inverse * friction);
    if (!thermal) return fall;
    double rail, rail_slope, wheel, wheel_slope;
    regularized_speed(in->speed, p->minimum_speed, &rail, &rail_slope);
    regularized_speed(p->radius * in->omega, p->minimum_speed, &wheel, &wheel_slope);
    double per_friction = fall.inverse * by_speed;
    double per_rail = 1.0 / rail, root_rail = sqrt(rail), root_wheel = sqrt(wheel);
    double roots = root_rail + root_wheel, inverse = 1.0 / (roots * root_wheel);
    double per_roots = inverse * root_wheel;
    double heating = scales.heating * friction * per_roots; /* 1/w_T */
    double zeta0 = scales.saturation_creepage * friction;
    double per_full =
        per_rail * (1.0 / scales.saturation_creepage) * per_friction; /* slip at x = 1 */
    double x = slip * per_full, r = slip * heating, n = rail * zeta0 * heating;
    double k_hat = table->one_axis ? 0.0 : scales.k_hat;
    if (friction != 1.0) k_hat *= sqrt(per_friction);
    thermal_softening g =
        thermal_softening_at(p->elliptic != 0.0 ? HEAT_ELLIPSE : HEAT_LINE, x, r, n, k_hat);
    fall.scale *= g.value;
    fall.inverse *= g.inverse;
    fall.temperature = p->softening_temperature * (1.0 - g.value);
    fall.thermal_by_slip = g.by_x * per_full + g.by_r * heating;
    fall.by_slip += fall.thermal_by_slip;
    fall.by_log_heating = r * g.by_r + g.by_log_n;
    fall.by_log_zeta0 = g.by_log_n - x * g.by_x;
    fall.by_log_k = g.by_log_k;
    fall.by_rolling = -0.5 * fall.by_log_heating * wheel_slope * inverse;
    fall.by_speed = (fall.by_log_zeta0 - 0.5 * fall.by_log_heating * root_rail * per_roots) *
                    (per_rail * rail_slope);
    return fall;
}

/* Results of the formulas before the table is evaluated. */
typedef struct {
    double slip;              /* slip velocity [m/s] */
    double creepage;          /* [1] */
    double speed_slope;       /* d(reference)/d(speed) [1] */
    double inverse_speed;     /* 1/reference [s/m] */
    double reference;         /* reference speed of the creepage [m/s] */
    double kinetic;           /* f_d at this friction scale and slip speed [1] */
    double log_g_by_rolling;  /* derivatives of ln(g), g being the factor on friction: by omega r */
    double log_g_by_speed;    /* at fixed speed, by the speed at fixed omega [s/m], */
    double log_g_by_log_load; /* and by the logarithm of the load [1] */
    double temperature;       /* [K] */
    double inverse_saturation; /* one over zeta0 [1] */
    contact_scales scales;
    double x, k_hat;  /* normalized creepage, and k_hat up to the table's maximum */
    double by_others; /* change of the traction ratio as other creepages grow in proportion [1] */
    softened_place place;
} force_state;

/* The nominal load of the parameters must be the input's load, scales must belong to the
 * parameters, and along is the slip velocity along rolling over its magnitude. Without friction the
 * state is that of friction scale 1. */
ALWAYS_INLINE force_state begin_force(const creep_table *table, const force_element_parameters *p,
                                      contact_scales scales, const force_element_input *in,
                                      const friction_fall *fall, double along) {
    force_state at;
    double k_max = table->one_axis ? INFINITY : table->k_max;
    at.slip = slip_of(p, in);
    regularized_speed(in->speed, slowest_speed(p), &at.reference, &at.speed_slope);
    at.inverse_speed = 1.0 / at.reference;
    at.creepage = at.slip * at.inverse_speed;
    at.log_g_by_rolling = fall->by_slip * along + fall->by_rolling;
    at.log_g_by_speed = fall->by_speed - fall->by_slip * along;
    at.log_g_by_log_load =
        p->load_exponent * (1.5 * fall->by_log_heating + fall->by_log_zeta0 - fall->by_log_k);
    at.temperature = fall->temperature;
    at.kinetic = fall->scale * p->kinetic_friction;
    at.scales = scaled(scales, fall->scale, fall->inverse);
    at.inverse_saturation = 1.0 / scales.saturation_creepage * fall->inverse;
    at.x = at.creepage * at.inverse_saturation;
    at.k_hat = smaller(at.scales.k_hat, k_max);
    at.by_others = 0.0;
    at.place = softened_at(p->softening, at.x, at.k_hat);
    return at;
}

/* Put the layer into a state, if there is one. */
ALWAYS_INLINE void add_layer(const force_element_parameters *p, force_state *at) {
    if (!has_layer(p)) return;
    at->place = softened_with_layer(p->softening, at->x, at->k_hat, at->scales.layer_ratio);
}

/* Outputs that follow from the forces, be they the steady ones, those of a contact with memory or
 * the mean creep force of an implicit step. There is load and friction, and parameters are those at
 * the load. */
ALWAYS_INLINE void set_by_force(const force_element_parameters *p, const force_element_input *in,
                                force_element_output *out) {
    (void)in; /* for outputs that also depend on velocities or load */
    out->wheel_torque = -p->radius * out->creep_force;
}

/* Outputs that depend only on the velocities or the load. */
ALWAYS_INLINE void set_kinematics(const force_element_parameters *p, const force_element_input *in,
                                  const force_state *at, force_element_output *out) {
    double below = p->minimum_speed - fabs(in->speed);
    out->creepage = at->creepage;
    out->creepage_by_omega = p->radius * at->inverse_speed;
    out->creepage_by_speed = -(1.0 + at->creepage * at->speed_slope) * at->inverse_speed;
    /* A contact with memory needs no regularised speed. */
    out->speed_margin = remembers(p) ? -1.0 : below;
    out->speed_regularized = out->speed_margin > 0.0 ? 1.0 : 0.0;
    out->load_margin = 1e-100 - in->normal_load; /* an indicator must not stay at zero */
    out->unloaded = out->load_margin > 0.0 ? 1.0 : 0.0;
}

/* Traction coefficient in full slip. */
static inline double sliding_coefficient(const creep_table *table,
                                         const force_element_parameters *p, double kinetic) {
    double k_hat = table->one_axis ? 1.0 : table->k_max;
    return kinetic * law_value(table, p->softening, 1e30, k_hat).traction_ratio;
}

/* Its components along and across rolling: the force has the direction of the creepages. */
static inline void sliding_shares(const creep_table *table, const force_element_parameters *p,
                                  const force_element_input *in, const force_state *at,
                                  double share[2]) {
    double across = table->lateral_spin != NULL ? -in->lateral_velocity * at->inverse_speed : 0.0;
    double size =
        across == 0.0 ? fabs(at->creepage) : sqrt(at->creepage * at->creepage + across * across);
    double coefficient = size > 0.0 ? sliding_coefficient(table, p, at->kinetic) : 0.0;
    share[0] = size > 0.0 ? coefficient * (at->creepage / size) : 0.0;
    share[1] = size > 0.0 ? coefficient * (across / size) : 0.0;
}

/* All outputs from the table's value, those of steady rolling; memory_action adds the rest. */
ALWAYS_INLINE void finish_force(const creep_table *table, const force_element_parameters *p,
                                const force_element_input *in, const force_state *at, creep_value q,
                                force_element_output *out) {
    double zeta0 = at->scales.saturation_creepage, x = at->x;
    q = at_softened_place(at->place, q);
    double k_margin = at->scales.k_hat - table->k_max;
    out->k_hat_margin = table->one_axis ? -1.0 : k_margin;
    int k_limited = out->k_hat_margin > 0.0;
    out->k_hat_limited = k_limited ? 1.0 : 0.0;

    /* The Carter-Griffith law does not contain f_s: limit the force to f_s P. */
    out->force_margin = p->kinetic_friction * fabs(q.traction_ratio) - p->static_friction;
    int force_limited = out->force_margin > 0.0;
    double largest = copysign(p->static_friction / p->kinetic_friction, q.traction_ratio);
    out->force_limited = force_limited ? 1.0 : 0.0;
    q.traction_ratio = force_limited ? largest : q.traction_ratio;
    q.slope = force_limited ? 0.0 : q.slope;
    q.log_k_derivative = force_limited ? 0.0 : q.log_k_derivative;
    q.log_layer_derivative = force_limited ? 0.0 : q.log_layer_derivative;

    double sliding = at->kinetic * in->normal_load, per_creepage = sliding * at->inverse_saturation;
    double log_k_by_log_load = k_limited ? 0.0 : -p->load_exponent;
    double log_k_by_log_g = k_limited ? 0.0 : -0.5;
    /* The part of dq/d(omega r) that is due to the fall of friction. */
    double by_log_g = q.traction_ratio - x * q.slope + log_k_by_log_g * q.log_k_derivative;
    by_log_g -= at->by_others;
    double through_g = by_log_g * at->log_g_by_rolling;
    double slope = q.slope + through_g * zeta0 * at->reference; /* at this speed */
    double by_creepage = per_creepage * slope;
    set_kinematics(p, in, at, out);
    out->creep_force = sliding * q.traction_ratio;
    out->lateral_force = out->spin_moment = 0.0;
    set_by_force(p, in, out);
    out->normalized_creepage = x;
    out->traction_coefficient = at->kinetic * q.traction_ratio;
    out->force_gradient = by_creepage * at->inverse_speed;
    out->k_hat = at->k_hat;
    out->saturation_creepage = zeta0;
    out->process_zone_ratio = at->scales.process_zone_ratio;
    /* An event indicator must not stay at zero; the slope does where the force is limited. */
    out->falling_margin = slope == 0.0 ? -1.0 : -slope;
    out->falling_branch = slope < 0.0 ? 1.0 : 0.0;
    out->contact_temperature = at->temperature;
    out->force_by_load =
        at->kinetic * (q.traction_ratio - p->load_exponent * x * q.slope -
                       p->load_exponent * q.log_layer_derivative +
                       log_k_by_log_load * q.log_k_derivative + by_log_g * at->log_g_by_log_load);
    out->force_by_omega = by_creepage * out->creepage_by_omega;
    out->force_by_speed =
        per_creepage * q.slope * out->creepage_by_speed + sliding * (by_log_g * at->log_g_by_speed);
    out->steady_traction = out->traction_coefficient;
    out->sticking = out->force_by_traction = 0.0;
    out->traction_rate = out->lateral_rate = out->unslipped_rate = 0.0;
    memset(&out->traction_by_omega, 0, 15 * sizeof(double));
}

/* Flow of the memory at a steady state, and what its arguments are. Vectors have components along
 * and across rolling. */
typedef struct {
    memory_flow flow;
    double creepage[2], size; /* normalized creepages without spin, and their magnitude */
    double force[2], ratio;   /* steady forces over f_d P, and their magnitude */
    double direction[2];      /* of the steady force */
    double q[2], along;       /* held forces over f_d, and in that direction */
    double length_ratio[2];   /* sigma over the relaxation length of each component */
    double rate[2];           /* of q, for one sigma [1/s] */
    double weakening, pace;
    int slow, weak; /* creepage or force are too small to have a direction */
} memory_place;

ALWAYS_INLINE double magnitude_of(const double v[2]) {
    return v[1] == 0.0 ? fabs(v[0]) : sqrt(v[0] * v[0] + v[1] * v[1]);
}

ALWAYS_INLINE memory_place memory_at(const force_element_parameters *p,
                                     const force_element_input *in, const force_state *at,
                                     double across, const double force[2]) {
    const double tiny = 1e-6; /* normalized creepage below which the flow has its limit at zero */
    double least = p->initial_slope * tiny;
    memory_place m;
    m.creepage[0] = at->x;
    m.creepage[1] = across;
    m.size = magnitude_of(m.creepage);
    m.ratio = magnitude_of(force);
    m.slow = m.size < tiny;
    m.weak = m.ratio < least;
    m.direction[0] = m.ratio > 0.0 ? force[0] / m.ratio : at->x < 0.0 ? -1.0 : 1.0;
    m.direction[1] = m.ratio > 0.0 ? force[1] / m.ratio : 0.0;
    m.q[0] = in->held_traction / at->kinetic;
    m.q[1] = in->held_lateral / at->kinetic;
    m.along = m.q[0] * m.direction[0] + m.q[1] * m.direction[1];
    m.length_ratio[0] = 1.0;
    m.length_ratio[1] = p->relaxation_length / p->lateral_relaxation_length;
    m.weakening = p->weakening_length / (p->semi_width * at->scales.saturation_creepage);
    m.pace = at->reference / p->relaxation_length; /* at rest the slip alone loads the contact */
    m.flow = memory_flow_at(p, larger(m.size, tiny), larger(m.ratio, least), at->k_hat, m.weakening,
                            m.along, in->unslipped, m.pace);
    double forward = m.flow.fast * (m.flow.strength - m.along);
    for (int i = 0; i < 2; i++) {
        double e = m.direction[i];
        m.force[i] = force[i];
        m.rate[i] = m.weak ? m.flow.fast * (force[i] - m.q[i])
                           : forward * e + m.flow.turn * (m.along * e - m.q[i]);
    }
    return m;
}

/* A direction in which the memory's arguments change; log_g is the change of ln(f_d). */
typedef struct {
    double creepage[2], force[2], held[2], unslipped, k_hat, weakening, pace, log_g;
} memory_direction;

ALWAYS_INLINE double change_along(const memory_gradient by, const memory_gradient change) {
    double sum = 0.0;
    for (int k = 0; k < MEMORY_ARGUMENTS; k++) sum += by[k] * change[k];
    return sum;
}

/* Changes of the rates of both held forces and of the unslipped part. */
ALWAYS_INLINE void memory_change(const memory_place *m, const force_state *at,
                                 const memory_direction *d, double rate[3]) {
    double turn[2], dq[2], per_size = m->slow ? 0.0 : 1.0 / m->size;
    double dratio = m->direction[0] * d->force[0] + m->direction[1] * d->force[1];
    memory_gradient change;
    change[BY_X] = (m->creepage[0] * d->creepage[0] + m->creepage[1] * d->creepage[1]) * per_size;
    change[BY_RATIO] = m->weak ? 0.0 : dratio;
    change[BY_K] = d->k_hat;
    change[BY_WEAKENING] = d->weakening;
    change[BY_TRACTION] = 0.0;
    change[BY_UNSLIPPED] = d->unslipped;
    change[BY_PACE] = d->pace;
    for (int i = 0; i < 2; i++) {
        dq[i] = d->held[i] / at->kinetic - m->q[i] * d->log_g;
        turn[i] = m->weak ? 0.0 : (d->force[i] - m->direction[i] * dratio) / m->ratio;
        change[BY_TRACTION] += m->direction[i] * dq[i] + m->q[i] * turn[i];
    }
    const memory_flow *f = &m->flow;
    double dfast = change_along(f->fast_by, change), dturn = change_along(f->turn_by, change);
    double gap = f->strength - m->along, along = change[BY_TRACTION];
    double dgap = change_along(f->strength_by, change) - along;
    for (int i = 0; i < 2; i++) {
        double e = m->direction[i], drate;
        if (m->weak) drate = dfast * (m->force[i] - m->q[i]) + f->fast * (d->force[i] - dq[i]);
        else
            drate = (dfast * gap + f->fast * dgap) * e + f->fast * gap * turn[i] +
                    dturn * (m->along * e - m->q[i]) +
                    f->turn * (along * e + m->along * turn[i] - dq[i]);
        rate[i] = at->kinetic * m->length_ratio[i] * (drate + m->rate[i] * d->log_g);
    }
    rate[2] = change_along(m->flow.rate_by, change);
}

/* Replace the steady forces by those of a contact with memory. */
ALWAYS_INLINE void hold_forces(const force_element_parameters *p, const force_element_input *in,
                               const force_state *at, const memory_place *m,
                               force_element_output *out) {
    double load = in->normal_load;
    out->sticking = m->flow.sticking;
    out->traction_rate = at->kinetic * m->length_ratio[0] * m->rate[0];
    out->lateral_rate = at->kinetic * m->length_ratio[1] * m->rate[1];
    out->unslipped_rate = m->flow.rate;
    out->traction_coefficient = in->held_traction;
    out->creep_force = load * in->held_traction;
    out->lateral_force = load * in->held_lateral;
    set_by_force(p, in, out);
    out->force_by_load = in->held_traction;
    out->force_by_traction = load;
    out->force_by_omega = out->force_by_speed = 0.0;
}

/* Set the changes of the rates by one of the states omega, speed, held_traction, held_lateral and
 * unslipped. */
ALWAYS_INLINE void set_rates_by(int state, const double rate[3], force_element_output *out) {
    double *by = &out->traction_by_omega;
    for (int i = 0; i < 3; i++) by[5 * i + state] = rate[i];
}

/* The memory without lateral slip and spin, with or without the derivatives of its rates;
 * parameters are those at the load. */
ALWAYS_INLINE void memory_action(const force_element_parameters *p, const force_element_input *in,
                                 const force_state *at, int derivatives,
                                 force_element_output *out) {
    double per_force = 1.0 / (at->kinetic * in->normal_load);
    double log_k = at->k_hat < at->scales.k_hat ? 0.0 : -0.5;
    double steady[2] = {out->steady_traction / at->kinetic, 0.0};
    double log_g[2] = {at->log_g_by_rolling * p->radius, at->log_g_by_speed};
    double creepage[2] = {out->creepage_by_omega, out->creepage_by_speed};
    double force[2] = {out->force_by_omega, out->force_by_speed};
    memory_place m = memory_at(p, in, at, 0.0, steady);
    hold_forces(p, in, at, &m, out);
    if (!derivatives) return;
    UNROLLED for (int i = 0; i < 5; i++) {
        memory_direction d;
        double rate[3];
        memset(&d, 0, sizeof d);
        if (i < 2) {
            d.log_g = log_g[i];
            d.creepage[0] = creepage[i] * at->inverse_saturation - at->x * d.log_g;
            d.force[0] = force[i] * per_force - steady[0] * d.log_g;
            d.k_hat = at->k_hat * log_k * d.log_g;
            d.weakening = -m.weakening * d.log_g;
        }
        if (i == 1) d.pace = at->speed_slope / p->relaxation_length;
        if (i == 2 || i == 3) d.held[i - 2] = 1.0;
        if (i == 4) d.unslipped = 1.0;
        memory_change(&m, at, &d, rate);
        set_rates_by(i, rate, out);
    }
}

/* Without load or friction the memory fades with the distance that the surfaces move. */
ALWAYS_INLINE void fade_memory(const force_element_parameters *p, const force_element_input *in,
                               const force_state *at, force_element_output *out) {
    double per = 1.0 / p->relaxation_length, turn = copysign(per, at->slip);
    double pace = (fabs(at->slip) + at->reference) * per;
    double by_omega = p->radius * turn, by_speed = at->speed_slope * per - turn;
    double left[3] = {-in->held_traction, -in->held_lateral, 1.0 - in->unslipped};
    double *rate = &out->traction_rate, *by = &out->traction_by_omega;
    memset(by, 0, 15 * sizeof(double));
    for (int i = 0; i < 3; i++, by += 5) {
        rate[i] = pace * left[i];
        by[0] = by_omega * left[i];
        by[1] = by_speed * left[i];
        by[2 + i] = -pace;
    }
}

/* g has a kink at zero slip; the force has none, as it is zero there. */
ALWAYS_INLINE double direction_of(double slip) { return slip == 0.0 ? 0.0 : copysign(1.0, slip); }

#endif
