/* The force element's formulas before and after the evaluation of the table, without branches, and
 * their derivatives. */
#ifndef FORCE_ELEMENT_FORMULA_H
#define FORCE_ELEMENT_FORMULA_H

#include <math.h>

#include "force_element.h"
#include "half_space.h"
#include "heat.h"
#include "memory.h"
#include "simd_math.h"
#include "stiffness.h"

/* A tiny load counts as zero: the scales of its contact would overflow, and the states of its
 * memory would change over a distance that no step resolves. */
ALWAYS_INLINE int is_loaded(const force_element_parameters *p, double load) {
    double least = (remembers(p) ? 1e-9 : 1e-100) * p->nominal_load;
    return !(load <= least); /* true for NaN, so that it shows in the output */
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
    there.transverse_half_length *= p->elliptic != 0.0 ? growth : 1.0;
    there.nominal_load = load;
    return there;
}

/* Whether there is a layer between the bodies. */
ALWAYS_INLINE int has_layer(const force_element_parameters *p) { return p->layer_compliance > 0.0; }

/* Whether friction falls with temperature. */
ALWAYS_INLINE int softens_with_heat(const force_element_parameters *p) {
    return p->softening_temperature > 0.0;
}

/* What the shape at the nominal load gives to the memory. */
static inline shape_memory shape_of(const force_element_parameters *p) {
    shape_memory shape;
    shape_memory_of(p->elliptic != 0.0, p->semi_width / p->transverse_half_length, p->poisson_ratio,
                    &shape);
    return shape;
}

/* What the memory needs of the contact at the nominal load; the scales are those without memory. In
 * full stick the law does not depend on k_hat, which changes with friction; its table does, in its
 * last digits. */
static inline void set_memory_scales(const creep_table *table, const force_element_parameters *p,
                                     const shape_memory *shape, contact_scales *s) {
    contact_memory memory;
    double clean = table->clean_slope, layered = clean;
    if (has_layer(p)) layered = creep_table_initial_slope(table, 0.0, s->layer_ratio);
    /* Hertz: a line grows with the root of the load, an ellipse keeps its shape. */
    double to_strips = p->body_modulus / p->contact_modulus, softer = clean / layered;
    int elliptic = p->elliptic != 0.0;
    double ideal = elliptic ? 2.35619449019234493 : 2.0; /* initial slope of Carter's law */
    memory_with_layer(elliptic, shape, s->layer_ratio * to_strips, softer - 1.0, &memory);
    s->relaxation_length = memory.relaxation_length * p->semi_width;
    s->lateral_relaxation_length = memory.lateral_relaxation_length * p->semi_width;
    s->initial_slope = layered;
    s->standing_stiffness =
        memory.standing_stiffness * to_strips * softer / ideal * memory.relaxation_length;
}

/* Scales at the nominal load, with the friction coefficients as given; without a table those of the
 * memory are 0. NULL for the shape of an ellipse that is not known. */
ALWAYS_INLINE contact_scales contact_scales_with(const creep_table *table,
                                                 const force_element_parameters *p,
                                                 const shape_memory *ellipse) {
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
        0.0,
        0.0,
        0.0,
        0.0,
    };
    if (remembers(p) && table != NULL) {
        shape_memory shape = ellipse && p->elliptic != 0.0 ? *ellipse : shape_of(p);
        set_memory_scales(table, p, &shape, &s);
    }
    return s;
}

ALWAYS_INLINE contact_scales contact_scales_of(const creep_table *table,
                                               const force_element_parameters *p) {
    return contact_scales_with(table, p, NULL);
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
} softened_point;

ALWAYS_INLINE softened_point softened_at(double softening, double x, double k_hat) {
    double size = fabs(x);
    held_creepage held = held_up_to_saturation(softening, size);
    double left = 1.0 - softening * held.value, loss = softening * held.by_size;
    softened_point point = {
        x * left, k_hat * sqrt(left), 0.0, left - loss * size, -copysign(1.0, x) * (loss / left),
        0.0};
    return point;
}

/* The same with a layer, which scales like x. */
ALWAYS_INLINE softened_point softened_with_layer(stiffness_left rest, double x, double k_hat,
                                                 double layer_ratio) {
    double left = rest.value, by_size = rest.by_size;
    softened_point point = {x * left,
                            k_hat * sqrt(left),
                            layer_ratio * left,
                            left + by_size * fabs(x),
                            copysign(1.0, x) * (by_size / left),
                            rest.by_log_layer / left};
    return point;
}

/* The table's value at a softened point, with its slope by the creepage itself. */
ALWAYS_INLINE creep_value at_softened_point(softened_point point, creep_value q) {
    double by_x = q.slope, by_left = 0.5 * q.log_k_derivative + q.log_layer_derivative;
    q.slope = by_x * point.x_by_x + by_left * point.log_left_by_x;
    q.log_layer_derivative += (by_x * point.x + by_left) * point.log_left_by_log_layer;
    return q;
}

ALWAYS_INLINE creep_value law_value(const creep_table *table, double softening, double x,
                                    double k_hat) {
    creep_value q;
    softened_point point = softened_at(softening, x, k_hat);
    creep_table_evaluate(table, point.x, point.k_hat, 0.0, &q);
    return at_softened_point(point, q);
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
    softened_point point;
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
    at.point = softened_at(p->softening, at.x, at.k_hat);
    return at;
}

/* Stiffness of n contacts with a layer. */
ALWAYS_INLINE void stiffness_of_layers(size_t n, const double *softening, const double *x,
                                       const double *layer_ratio, stiffness_left *left) {
    static const stiffness_left WHOLE = {1.0, 0.0, 0.0, 0.0};
    double size[MAX_POINTS];
    int soft = 0;
    for (size_t i = 0; i < n; i++) {
        size[i] = fabs(x[i]);
        left[i] = WHOLE;
        soft |= softening[i] != 0.0;
    }
    if (soft) stiffness_with_layer(n, softening, size, layer_ratio, left);
}

/* Put the layer into a state, if there is one. */
ALWAYS_INLINE void add_layer(const force_element_parameters *p, stiffness_left left,
                             force_state *at) {
    if (has_layer(p))
        at->point = softened_with_layer(left, at->x, at->k_hat, at->scales.layer_ratio);
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

/* Whether a line contact is too short for its memory. */
ALWAYS_INLINE void set_length(const force_element_parameters *p, force_element_output *out) {
    int line = remembers(p) & (p->elliptic == 0.0);
    double beyond = p->semi_width / p->transverse_half_length - (1.0 + 1e-9) * MAX_LINE_ASPECT;
    out->length_margin = line ? beyond : -1.0;
    out->length_limited = out->length_margin > 0.0 ? 1.0 : 0.0;
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
    q = at_softened_point(at->point, q);
    double k_margin = at->scales.k_hat - table->k_max;
    out->k_hat_margin = table->one_axis ? -1.0 : k_margin;
    int k_limited = out->k_hat_margin > 0.0;
    out->k_hat_limited = k_limited ? 1.0 : 0.0;

    /* The Carter-Griffith law does not contain f_s: limit the force to f_s P. */
    double fall = at->kinetic / p->kinetic_friction;
    out->force_margin = (p->kinetic_friction * fabs(q.traction_ratio) - p->static_friction) * fall;
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
    set_length(p, out);
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
    out->steady_force = out->creep_force;
    out->sticking = out->steady_outer = 0.0;
    memset(&out->held_rate, 0, 5 * sizeof(double));
    memset(out->force_by_memory, 0, sizeof out->force_by_memory);
    memset(out->memory_by, 0, sizeof out->memory_by);
}

/* Vectors have components along rolling and, if there are two parts, across it. */
ALWAYS_INLINE double magnitude_of(int parts, const double *v) {
    return parts == 1 || v[1] == 0.0 ? fabs(v[0]) : sqrt(v[0] * v[0] + v[1] * v[1]);
}

ALWAYS_INLINE double inner(int parts, const double *v, const double *w) {
    return parts == 1 ? v[0] * w[0] : v[0] * w[0] + v[1] * w[1];
}

/* How a limit holds a vector back: the part that is left, and one over its squared magnitude. */
typedef struct {
    int beyond;
    double part, per_square;
} bound;

/* Hold a vector within a magnitude. */
ALWAYS_INLINE bound hold_within(int parts, double limit, const double *v, double *held) {
    double size = magnitude_of(parts, v);
    bound b;
    b.beyond = size > limit;
    b.part = b.beyond ? limit / size : 1.0;
    b.per_square = 1.0 / (size * size);
    for (int i = 0; i < parts; i++) held[i] = b.part * v[i];
    return b;
}

/* Its change, also with the limit. */
ALWAYS_INLINE void change_within(int parts, const bound *b, double log_limit, const double *v,
                                 const double *dv, double *dheld) {
    double by = b->beyond ? inner(parts, v, dv) * b->per_square - log_limit : 0.0;
    for (int i = 0; i < parts; i++) dheld[i] = b->part * (dv[i] - by * v[i]);
}

/* Flow of the memory at a steady state, and what its arguments are. Vectors have components along
 * and across rolling. */
typedef struct {
    memory_flow flow;
    double creepage[2], size; /* normalized creepages without spin, and their magnitude */
    double force[2], ratio;   /* steady forces over f_d P, and their magnitude */
    double direction[2];      /* of the steady force */
    double limit[2];          /* what static friction allows outer zone and core to hold [N] */
    double held[2][2];        /* forces of outer zone and core, as the states are [N], */
    double acting[2][2];      /* up to those limits [N], */
    double counted[2][2];     /* and up to a little more, for the rates [N] */
    double c[2], q[2];        /* the last over f_d P: of the outer zone, and both */
    double along, magnitude;  /* of q: in the direction of the steady force, and its magnitude */
    double length_ratio[2];   /* sigma over the relaxation length of each component */
    double rate[2];           /* of q by rolling and creepage, for one sigma [1/s] */
    double outer_rate[2];     /* the same of c */
    double weakening, pace;
    double scale, per_scale; /* f_d P [N], and one over it */
    bound act[2], count[2];  /* how the limits hold the zones back */
    int slow, weak;          /* creepage or force are too small to have a direction */
    int frozen;              /* the derivatives hold the paces constant */
} memory_point;

/* Lose what friction cannot hold at once, as a step of any length may. */
static inline void lose_excess(const force_element_parameters *p, force_element_input *in) {
    double load = larger(in->normal_load, 0.0), scale = has_friction(in) ? in->friction_scale : 0.0;
    double strength = p->static_friction * scale * load;
    double outer[2] = {in->memory.outer_force, in->lateral.outer_lateral};
    double core[2] = {in->memory.held_force - outer[0], in->lateral.held_lateral - outer[1]};
    hold_within(2, OUTER_STRENGTH * strength, outer, outer);
    hold_within(2, (1.0 - OUTER_STRENGTH) * strength, core, core);
    in->memory.outer_force = outer[0];
    in->lateral.outer_lateral = outer[1];
    in->memory.held_force = outer[0] + core[0];
    in->lateral.held_lateral = outer[1] + core[1];
    in->memory.unslipped = strength > 0.0 ? smaller(larger(in->memory.unslipped, 0.0), 1.0) : 1.0;
}

/* Forces of the zones as the states are, and as far as friction holds them. */
ALWAYS_INLINE void set_held(int parts, const force_element_parameters *p,
                            const force_element_input *in, double scale, memory_point *m) {
    double strength = p->static_friction * in->friction_scale * in->normal_load;
    m->scale = scale;
    m->per_scale = 1.0 / scale;
    m->limit[0] = OUTER_STRENGTH * strength;
    m->limit[1] = (1.0 - OUTER_STRENGTH) * strength;
    m->held[0][0] = in->memory.outer_force;
    m->held[0][1] = in->lateral.outer_lateral;
    m->held[1][0] = in->memory.held_force - in->memory.outer_force;
    m->held[1][1] = in->lateral.held_lateral - in->lateral.outer_lateral;
    for (int zone = 0; zone < 2; zone++) {
        double limit = m->limit[zone], *held = m->held[zone];
        m->act[zone] = hold_within(parts, limit, held, m->acting[zone]);
        m->count[zone] = hold_within(parts, SLACK * limit, held, m->counted[zone]);
    }
    for (int i = 0; i < parts; i++) {
        m->c[i] = m->counted[0][i] * m->per_scale;
        m->q[i] = m->c[i] + m->counted[1][i] * m->per_scale;
    }
}

ALWAYS_INLINE memory_point memory_at(int parts, const force_element_parameters *p,
                                     const force_element_input *in, const force_state *at,
                                     double across, const double force[2]) {
    const double tiny = 1e-6; /* normalized creepage below which the flow has its limit at zero */
    const contact_scales *scales = &at->scales;
    double least = scales->initial_slope * tiny;
    memory_point m;
    m.creepage[0] = at->x;
    m.creepage[1] = across;
    m.size = magnitude_of(parts, m.creepage);
    m.ratio = magnitude_of(parts, force);
    m.slow = m.size < tiny;
    m.frozen = p->memory == FROZEN_PACES;
    m.weak = m.ratio < least;
    m.direction[0] = m.ratio > 0.0 ? force[0] / m.ratio : at->x < 0.0 ? -1.0 : 1.0;
    m.direction[1] = m.ratio > 0.0 ? force[1] / m.ratio : 0.0;
    set_held(parts, p, in, at->kinetic * in->normal_load, &m);
    m.along = inner(parts, m.q, m.direction);
    m.magnitude = magnitude_of(parts, m.q);
    m.length_ratio[0] = 1.0;
    m.length_ratio[1] = scales->relaxation_length / scales->lateral_relaxation_length;
    m.weakening = p->weakening_length / (p->semi_width * scales->saturation_creepage);
    m.pace = at->reference / scales->relaxation_length; /* at rest the slip alone loads it */
    m.flow = memory_flow_at(p, scales, larger(m.size, tiny), larger(m.ratio, least), at->k_hat,
                            m.weakening, m.along, inner(parts, m.c, m.direction), m.magnitude,
                            in->memory.unslipped, m.pace);
    const memory_flow *f = &m.flow;
    double forward = f->fast * (f->strength - m.along);
    for (int i = 0; i < parts; i++) {
        double e = m.direction[i], ahead = forward * e, aside = 0.0;
        if (parts > 1) aside = f->turn * (m.along * e - m.q[i]);
        m.force[i] = force[i];
        if (m.weak) ahead = f->fast * (force[i] - m.q[i]), aside = 0.0;
        m.rate[i] = ahead + aside;
        m.outer_rate[i] =
            f->share * ahead + f->carried * aside + 2.25 * m.pace * (f->carried * m.q[i] - m.c[i]);
    }
    return m;
}

/* A direction in which the memory's arguments change; log_scale and log_limit are the changes of
 * ln(f_d P) and of the logarithm of static friction times load. */
typedef struct {
    double creepage[2], force[2], held[2], outer[2], unslipped, k_hat, weakening, pace, log_scale,
        log_limit;
} memory_direction;

/* Change as the arguments from one on change. */
ALWAYS_INLINE double change_along(int first, const memory_gradient by,
                                  const memory_gradient change) {
    double sum = 0.0;
    for (int k = first; k < MEMORY_ARGUMENTS; k++) sum += by[k] * change[k];
    return sum;
}

/* Changes of the forces of the zones: as the states are, as they act and as they count [N]; and of
 * c and q. */
typedef struct {
    double held[2][2], acting[2][2], counted[2][2], c[2], q[2];
} held_change;

ALWAYS_INLINE held_change change_of_held(int parts, const memory_point *m,
                                         const memory_direction *d) {
    held_change h;
    for (int i = 0; i < parts; i++) {
        h.held[0][i] = d->outer[i];
        h.held[1][i] = d->held[i] - d->outer[i];
    }
    for (int zone = 0; zone < 2; zone++) {
        const double *held = m->held[zone], *change = h.held[zone];
        change_within(parts, &m->act[zone], d->log_limit, held, change, h.acting[zone]);
        change_within(parts, &m->count[zone], d->log_limit, held, change, h.counted[zone]);
    }
    for (int i = 0; i < parts; i++) {
        h.c[i] = h.counted[0][i] * m->per_scale - m->c[i] * d->log_scale;
        h.q[i] = (h.counted[0][i] + h.counted[1][i]) * m->per_scale - m->q[i] * d->log_scale;
    }
    return h;
}

/* Rows of the memory: states, their rates and changes; those of a lateral force come last. */
enum {
    HELD,
    UNSLIPPED,
    OUTER,
    ROLLING_STATES,
    HELD_LATERAL = ROLLING_STATES,
    OUTER_LATERAL,
    MEMORY_STATES
};

/* Rates of the memory. */
ALWAYS_INLINE void memory_rates(int parts, const memory_point *m, double *rate) {
    const int held[2] = {HELD, HELD_LATERAL}, outer[2] = {OUTER, OUTER_LATERAL};
    for (int i = 0; i < parts; i++) {
        double scale = m->length_ratio[i] * m->scale, lost = m->held[0][i] - m->counted[0][i];
        double by_core = m->held[1][i] - m->counted[1][i];
        rate[held[i]] = scale * m->rate[i] - RELEASE * (lost + by_core);
        rate[outer[i]] = scale * m->outer_rate[i] - RELEASE * lost;
    }
    rate[UNSLIPPED] = m->flow.rate;
}

/* Their changes. In a direction of the states alone (FROM_STATES) neither the steady force nor what
 * it depends on changes. */
ALWAYS_INLINE void memory_change(int parts, const memory_point *m, int first,
                                 const memory_direction *d, const held_change *h, double *rate) {
    const int held[2] = {HELD, HELD_LATERAL}, outer[2] = {OUTER, OUTER_LATERAL};
    double turn[2] = {0.0, 0.0}, per_magnitude = m->magnitude > 0.0 ? 1.0 / m->magnitude : 0.0;
    memory_gradient change;
    change[BY_FORCE] = change[BY_OUTER] = change[BY_SIZE] = 0.0;
    change[BY_UNSLIPPED] = d->unslipped;
    if (first < FROM_STATES) {
        double per_size = m->slow ? 0.0 : 1.0 / m->size, per_ratio = m->weak ? 0.0 : 1.0 / m->ratio;
        double dratio = inner(parts, m->direction, d->force);
        change[BY_X] = inner(parts, m->creepage, d->creepage) * per_size;
        change[BY_RATIO] = m->weak ? 0.0 : dratio;
        change[BY_K] = d->k_hat;
        change[BY_WEAKENING] = d->weakening;
        change[BY_PACE] = d->pace;
        for (int i = 0; i < parts && parts > 1; i++) { /* else it has no other direction */
            turn[i] = (d->force[i] - m->direction[i] * dratio) * per_ratio;
            change[BY_FORCE] += m->q[i] * turn[i];
            change[BY_OUTER] += m->c[i] * turn[i];
        }
    }
    for (int i = 0; i < parts; i++) {
        change[BY_FORCE] += m->direction[i] * h->q[i];
        change[BY_OUTER] += m->direction[i] * h->c[i];
        change[BY_SIZE] += m->q[i] * per_magnitude * h->q[i];
    }
    const memory_flow *f = &m->flow;
    double dfast = change_along(first, f->fast_by, change);
    double dturn = change_along(first, f->turn_by, change);
    double dshare = change_along(first, f->share_by, change);
    double dcarried = change_along(first, f->carried_by, change);
    double dquick = change_along(first, f->rate_by, change);
    if (m->frozen) {
        dfast = dturn = dshare = dcarried = 0.0;
        dquick = f->pull_by_unslipped * d->unslipped;
    }
    double gap = f->strength - m->along, along = change[BY_FORCE];
    double dgap = change_along(first, f->strength_by, change) - along;
    for (int i = 0; i < parts; i++) {
        double e = m->direction[i], ahead = f->fast * gap * e, aside = 0.0, daside = 0.0;
        double dahead = (dfast * gap + f->fast * dgap) * e + f->fast * gap * turn[i];
        if (parts > 1) {
            double across = m->along * e - m->q[i];
            aside = f->turn * across;
            daside = dturn * across + f->turn * (along * e + m->along * turn[i] - h->q[i]);
        }
        if (m->weak) {
            ahead = f->fast * (m->force[i] - m->q[i]);
            dahead = dfast * (m->force[i] - m->q[i]) + f->fast * (d->force[i] - h->q[i]);
            aside = daside = 0.0;
        }
        double apart = f->carried * m->q[i] - m->c[i];
        double dapart = dcarried * m->q[i] + f->carried * h->q[i] - h->c[i];
        double outer_change = dshare * ahead + f->share * dahead + dcarried * aside +
                              f->carried * daside + 2.25 * (d->pace * apart + m->pace * dapart);
        double scale = m->length_ratio[i] * m->scale, lost = h->held[0][i] - h->counted[0][i];
        double by_core = h->held[1][i] - h->counted[1][i];
        rate[held[i]] =
            scale * (dahead + daside + m->rate[i] * d->log_scale) - RELEASE * (lost + by_core);
        rate[outer[i]] = scale * (outer_change + m->outer_rate[i] * d->log_scale) - RELEASE * lost;
    }
    rate[UNSLIPPED] = dquick;
}

/* Replace the steady forces by those of a contact with memory. */
ALWAYS_INLINE void hold_forces(int parts, const force_element_parameters *p,
                               const force_element_input *in, const memory_point *m,
                               force_element_output *out) {
    out->sticking = m->flow.sticking;
    out->steady_outer = m->scale * m->force[0] * m->flow.steady_carried;
    memory_rates(parts, m, &out->held_rate);
    out->creep_force = m->acting[0][0] + m->acting[1][0];
    if (parts > 1) out->lateral_force = m->acting[0][1] + m->acting[1][1];
    out->traction_coefficient = out->creep_force / in->normal_load;
    /* A zone that slips lies on its limit, where rounding must not raise the flag. */
    double strength = p->static_friction * in->friction_scale;
    for (int zone = 0; zone < 2; zone++) {
        double above = magnitude_of(parts, m->held[zone]) / m->limit[zone] - (1.0 + YIELDING);
        out->force_margin = larger(out->force_margin, strength * above);
    }
    out->force_limited = out->force_margin > 0.0 ? 1.0 : 0.0;
    set_by_force(p, in, out);
}

/* Set the changes of the force and of the rates by one of the states omega, speed and those of the
 * memory. */
ALWAYS_INLINE void set_changes_by(int parts, int state, const held_change *h, const double *rate,
                                  force_element_output *out) {
    if (state >= 2) out->force_by_memory[state - 2] = h->acting[0][0] + h->acting[1][0];
    for (int i = 0; i < (parts == 1 ? ROLLING_STATES : MEMORY_STATES); i++)
        out->memory_by[i][state] = rate[i];
}

/* Whether a lateral force is held. */
ALWAYS_INLINE int holds_lateral(const force_element_input *in) {
    return (in->lateral.held_lateral != 0.0) | (in->lateral.outer_lateral != 0.0);
}

/* Changes of the rates by a lateral force that is zero: it would turn into the steady force. */
ALWAYS_INLINE void set_changes_by_lateral(const memory_point *m, force_element_output *out) {
    const memory_flow *f = &m->flow;
    double turn = m->weak ? f->fast : f->turn, share = m->weak ? f->share : f->carried;
    for (int i = HELD_LATERAL; i <= OUTER_LATERAL; i++) {
        double core = i == HELD_LATERAL ? 1.0 : -1.0, outer = i == HELD_LATERAL ? 0.0 : 1.0;
        double counted_core = core * m->count[1].part, counted_outer = outer * m->count[0].part;
        double q = counted_outer + counted_core, lost = outer - counted_outer;
        out->memory_by[HELD_LATERAL][2 + i] =
            -m->length_ratio[1] * (turn * q) - RELEASE * (lost + (core - counted_core));
        out->memory_by[OUTER_LATERAL][2 + i] =
            m->length_ratio[1] *
                (2.25 * m->pace * (f->carried * q - counted_outer) - share * turn * q) -
            RELEASE * lost;
    }
}

/* The memory without lateral slip and spin, with or without the derivatives of its rates; those by
 * a lateral force too, which is held if there are two parts. Parameters are those at the load. */
ALWAYS_INLINE void memory_action(int parts, const force_element_parameters *p,
                                 const force_element_input *in, const force_state *at,
                                 int derivatives, int lateral, force_element_output *out) {
    double per_force = 1.0 / (at->kinetic * in->normal_load);
    double log_k = at->k_hat < at->scales.k_hat ? 0.0 : -0.5;
    double steady[2] = {out->steady_force * per_force, 0.0};
    double log_g[2] = {at->log_g_by_rolling * p->radius, at->log_g_by_speed};
    double creepage[2] = {out->creepage_by_omega, out->creepage_by_speed};
    double force[2] = {out->force_by_omega, out->force_by_speed};
    memory_point m = memory_at(parts, p, in, at, 0.0, steady);
    hold_forces(parts, p, in, &m, out);
    if (!derivatives) return;
    memory_direction d;
    memset(&d, 0, sizeof d);
    d.log_limit = 1.0 / in->normal_load;
    held_change h = change_of_held(parts, &m, &d);
    out->force_by_load = h.acting[0][0] + h.acting[1][0];
    out->force_by_omega = out->force_by_speed = 0.0; /* static friction at no slip limits it */
    double rate[MEMORY_STATES];
    UNROLLED for (int i = 0; i < 2; i++) { /* by omega and speed */
        memset(&d, 0, sizeof d);
        d.log_scale = log_g[i];
        d.creepage[0] = creepage[i] * at->inverse_saturation - at->x * log_g[i];
        d.force[0] = force[i] * per_force - steady[0] * log_g[i];
        d.k_hat = at->k_hat * log_k * log_g[i];
        d.weakening = -m.weakening * log_g[i];
        if (i == 1) d.pace = at->speed_slope / at->scales.relaxation_length;
        h = change_of_held(parts, &m, &d);
        memory_change(parts, &m, BY_X, &d, &h, rate);
        set_changes_by(parts, i, &h, rate, out);
    }
    UNROLLED for (int i = 0; i < MEMORY_STATES; i++) {
        if (parts == 1 && i >= ROLLING_STATES) continue;
        memset(&d, 0, sizeof d);
        if (i == HELD) d.held[0] = 1.0;
        if (i == UNSLIPPED) d.unslipped = 1.0;
        if (i == OUTER) d.outer[0] = 1.0;
        if (i == HELD_LATERAL) d.held[1] = 1.0;
        if (i == OUTER_LATERAL) d.outer[1] = 1.0;
        h = change_of_held(parts, &m, &d);
        memory_change(parts, &m, FROM_STATES, &d, &h, rate);
        set_changes_by(parts, 2 + i, &h, rate, out);
    }
    if (parts == 1 && lateral) set_changes_by_lateral(&m, out);
}

/* Without load or friction nothing is held, and the contact that begins has not slipped. */
ALWAYS_INLINE void release_memory(const force_element_input *in, force_element_output *out) {
    const double *state = &in->memory.held_force;
    double *rate = &out->held_rate;
    for (int i = 0; i < MEMORY_STATES; i++) {
        rate[i] = RELEASE * ((i == UNSLIPPED ? 1.0 : 0.0) - state[i]);
        for (int j = 0; j < 2 + MEMORY_STATES; j++)
            out->memory_by[i][j] = j == 2 + i ? -RELEASE : 0.0;
    }
}

/* g has a kink at zero slip; the force has none, as it is zero there. */
ALWAYS_INLINE double direction_of(double slip) { return slip == 0.0 ? 0.0 : copysign(1.0, slip); }

#endif
