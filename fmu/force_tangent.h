/* Directional derivatives of the force element's outputs. */
#ifndef FORCE_TANGENT_H
#define FORCE_TANGENT_H

#include "force_in_plane.h"
#include "force_law.h"

/* dq/d(softening). */
static inline double by_softening(const creep_table *table, double softening, double x,
                                  double k_hat) {
    softened_place place = softened_at(softening, x, k_hat);
    double left = 1.0 - softening * place.held.value;
    double left_by = -place.held.value - softening * place.held.by_softening;
    creep_value q;
    creep_table_evaluate(table, place.x, place.k_hat, &q);
    return left_by * (q.slope * x + 0.5 * q.log_k_derivative / left);
}

/* A struct of doubles, moved along a direction. */
static inline void move(void *to, const void *direction, double distance, size_t size) {
    double *number = (double *)to;
    const double *along = (const double *)direction;
    for (size_t i = 0; i < size / sizeof(double); i++) number[i] += distance * along[i];
}

/* Change of the gradient, by central differences of first derivatives. The pace is that of relative
 * changes; a tool may give any seed, and one that changes nothing has no pace. */
static inline void follow_gradient(const creep_table *table, const force_element_parameters *p,
                                   const force_element_input *in, const force_element_output *out,
                                   const force_element_parameters *dp,
                                   const force_element_input *din, double pace,
                                   force_element_output *dout) {
    if (!(pace > 1e-300 && pace < 1e290)) return;
    force_element_output found[2];
    double step = 1e-5 / pace;
    for (int i = 0; i < 2; i++) {
        double distance = i == 0 ? step : -step;
        force_element_parameters moved = *p;
        force_element_input given = *in;
        move(&moved, dp, distance, sizeof moved);
        move(&given, din, distance, sizeof given);
        if (!(out->k_hat > 0.0)) moved.weakening_length = 0.0;
        force_element_evaluate(table, &moved, &given, &found[i]);
    }
    dout->force_gradient = (found[0].force_gradient - found[1].force_gradient) / (2.0 * step);
    dout->falling_margin = (found[0].falling_margin - found[1].falling_margin) / (2.0 * step);
}

/* d(ln g) of the part of friction's fall that heat makes; cold scales and speeds change as given.
 */
typedef struct {
    double log_kinetic, log_pressure, log_width, log_zeta0, log_k, reference, rolling, slip;
} cold_change;

static inline double log_hot_change(const force_element_parameters *p,
                                    const force_element_input *in, const friction_fall *fall,
                                    const force_element_parameters *dp, const cold_change *d) {
    double rail, rail_slope, wheel, wheel_slope;
    regularized_speed(in->speed, p->minimum_speed, &rail, &rail_slope);
    double rolling = p->radius * in->omega;
    regularized_speed(rolling, p->minimum_speed, &wheel, &wheel_slope);
    double dwheel = wheel_slope * d->rolling +
                    (wheel - wheel_slope * rolling) * dp->minimum_speed / p->minimum_speed;
    double root_rail = sqrt(rail), root_wheel = sqrt(wheel);
    double dlog_roots =
        0.5 * (d->reference / root_rail + dwheel / root_wheel) / (root_rail + root_wheel);
    double dlog_heating = d->log_kinetic + d->log_pressure + 0.5 * d->log_width - dlog_roots -
                          dp->softening_temperature / p->softening_temperature -
                          dp->thermal_effusivity / p->thermal_effusivity;
    return fall->hot_by_slip * d->slip + fall->by_log_heating * dlog_heating +
           fall->by_log_zeta0 * (d->log_zeta0 + d->reference / rail) + fall->by_log_k * d->log_k;
}

/* See force_element_tangent. Each formula above needs its differential here. */
static inline void force_tangent(const creep_table *table, const force_element_parameters *p,
                                 const force_element_input *in, const force_element_output *out,
                                 const force_element_parameters *dp, const force_element_input *din,
                                 force_element_output *dout) {
    double reference, reference_slope;
    regularized_speed(in->speed, p->minimum_speed, &reference, &reference_slope);
    /* The regularised speed is homogeneous of degree one in speed and minimum speed. */
    double dreference = reference_slope * din->speed + (reference - reference_slope * in->speed) *
                                                           dp->minimum_speed / p->minimum_speed;
    double slip = p->radius * in->omega - in->speed;
    double dslip = p->radius * din->omega + in->omega * dp->radius - din->speed;
    int relaxed = p->relaxation_length > 0.0;

    *dout = (force_element_output){0};
    double dmagnitude = in->speed == 0.0 ? 0.0 : copysign(1.0, in->speed) * din->speed;
    if (!relaxed) dout->speed_margin = dp->minimum_speed - dmagnitude;
    dout->load_margin = -din->normal_load;
    dout->creepage = (dslip - out->creepage * dreference) / reference;
    double acting = relaxed ? in->relaxed_creepage : out->creepage;
    double dacting = relaxed ? din->relaxed_creepage : dout->creepage;

    double dlog_growth = 0.0;
    if (is_loaded(p, in->normal_load))
        dlog_growth = p->load_exponent * (din->normal_load / in->normal_load -
                                          dp->nominal_load / p->nominal_load) +
                      logarithm(in->normal_load / p->nominal_load) * dp->load_exponent;
    double dlog_width = dlog_growth + dp->semi_width / p->semi_width;
    double w = fabs(slip), dw = slip == 0.0 ? 0.0 : copysign(dslip, slip * dslip);
    if (is_in_plane(table, in)) {
        slip_speeds all = slip_in_plane(table, p, in);
        double spin = in->spin_velocity, spread = spin != 0.0 ? all.turning / spin : 0.0;
        double dturning = all.turning * dlog_width + spread * din->spin_velocity;
        w = all.size;
        dw = (slip * dslip - all.across * din->lateral_velocity + all.turning * dturning) / w;
    }
    double friction = has_friction(in) ? in->friction_scale : 1.0;
    double dlog_friction = din->friction_scale / friction;
    double dlog_cold = dlog_friction + dp->kinetic_friction / p->kinetic_friction;
    double dlog_pressure = dlog_growth + dp->peak_pressure / p->peak_pressure;
    double dlog_modulus = dp->contact_modulus / p->contact_modulus;
    double dlog_length =
        p->weakening_length > 0.0 ? dp->weakening_length / p->weakening_length : 0.0;
    double drop = p->static_friction - p->kinetic_friction;
    double ddrop = dp->static_friction - dp->kinetic_friction;
    double dlog_drop = dlog_friction + (drop > 0.0 ? ddrop / drop : 0.0);
    /* Eqs. (15) and (17) are products of powers. */
    cold_change cold = {
        .log_kinetic = dlog_cold,
        .log_pressure = dlog_pressure,
        .log_width = dlog_width,
        .log_zeta0 =
            dlog_cold + dlog_pressure - dlog_modulus - dp->slope_reduction / p->slope_reduction,
        .log_k =
            0.5 * (dlog_modulus + dlog_drop + dlog_length - dlog_width - dlog_pressure) - dlog_cold,
        .reference = dreference,
        .rolling = p->radius * din->omega + in->omega * dp->radius,
        .slip = dw,
    };
    contact_scales none = {0};
    friction_fall fall = falling_friction(table, p, none, in, w, decay_at(p, w), 0);
    double by_speed = fall.scale / friction; /* the factor by slip speed alone */
    double part = p->slip_rate_residual < 1.0 ? fall.passing / (1.0 - p->slip_rate_residual)
                                              : decaying_exponential(p->slip_rate_decay * w);
    double dlog_g = (dp->slip_rate_residual * (1.0 - part) -
                     fall.passing * (w * dp->slip_rate_decay + p->slip_rate_decay * dw)) /
                    by_speed;
    if (is_hot(p) & can_grip(p, in)) {
        force_element_parameters there = force_element_at_load(p, in->normal_load);
        contact_scales scales = contact_scales_of(&there);
        fall = falling_friction(table, &there, scales, in, w, decay_at(p, w), 1);
        double dlog_hot = log_hot_change(p, in, &fall, dp, &cold);
        double left = 1.0 - fall.temperature / p->softening_temperature;
        dout->contact_temperature =
            dp->softening_temperature * (1.0 - left) - p->softening_temperature * left * dlog_hot;
        dlog_g += dlog_hot;
    }
    double kinetic = fall.scale * p->kinetic_friction;
    double dlog_kinetic = dlog_g + dlog_cold;

    force_state at = {.acting = acting, .inverse_speed = 1.0 / reference, .kinetic = kinetic};
    double share[2], zeta0 = out->saturation_creepage, dlog_zeta0 = 0.0;
    if (can_grip(p, in)) {
        dlog_zeta0 = dlog_g + cold.log_zeta0;
        double dlog_k_free = out->k_hat > 0.0 ? cold.log_k - 0.5 * dlog_g : 0.0;
        double dlog_k = out->k_hat_limited > 0.0 ? 0.0 : dlog_k_free;
        if (!table->one_axis) dout->k_hat_margin = (table->k_max + out->k_hat_margin) * dlog_k_free;
        contact_scales longer = {0};
        if (p->weakening_length == 0.0 && drop > 0.0) { /* the zone's length grows from nothing */
            force_element_parameters unit = *p;
            unit.weakening_length = 1.0;
            unit = force_element_at_load(&unit, in->normal_load);
            longer = scaled(contact_scales_of(&unit), fall.scale, fall.inverse);
        }
        dout->saturation_creepage = zeta0 * dlog_zeta0;
        dout->k_hat = out->k_hat * dlog_k;
        dout->process_zone_ratio =
            out->process_zone_ratio *
                (dlog_modulus + dlog_length - dlog_drop - dlog_g - dlog_width - dlog_pressure) +
            longer.process_zone_ratio * dp->weakening_length;

        double x = out->normalized_creepage, dx = dacting / zeta0 - x * dlog_zeta0;
        dout->normalized_creepage = dx;
        double pace = fabs(dx) / (fabs(x) + 1e-2) + fabs(dlog_k) + fabs(dlog_zeta0) +
                      fabs(dlog_kinetic) + fabs(dlog_width) + fabs(dreference) / reference +
                      fabs(din->normal_load) / in->normal_load + fabs(dp->softening) +
                      fabs(dp->slip_rate_residual) + fabs(dp->slip_rate_decay) * w +
                      fabs(dw) / (w + zeta0 * reference);
        if (is_hot(p))
            pace += fabs(dp->softening_temperature) / p->softening_temperature +
                    fabs(dp->thermal_effusivity) / p->thermal_effusivity;
        force_element_input along = *din;
        if (is_in_plane(table, in) | is_in_plane(table, din)) {
            force_change change = {.acting = dacting,
                                   .reference = dreference,
                                   .log_kinetic = dlog_kinetic,
                                   .log_zeta0 = dlog_zeta0,
                                   .log_k = dlog_k,
                                   .log_width = dlog_width};
            pace += tangent_in_plane(table, p, in, dp, din, &change, dout);
        }
        if (!is_in_plane(table, in)) {
            creep_value q = law_value(table, p->softening, x, out->k_hat);
            double dratio = q.slope * dx + q.log_k_derivative * dlog_k, side = copysign(1.0, x);
            if (dp->softening != 0.0)
                dratio += by_softening(table, p->softening, x, out->k_hat) * dp->softening;
            double most = p->static_friction / p->kinetic_friction;
            double dmost =
                (dp->static_friction - most * dp->kinetic_friction) / p->kinetic_friction;
            dout->force_margin = p->kinetic_friction * side * dratio +
                                 fabs(q.traction_ratio) * dp->kinetic_friction -
                                 dp->static_friction;
            if (out->force_limited > 0.0) {
                q = (creep_value){.traction_ratio = side * most};
                dratio = side * dmost;
            }
            dout->traction_coefficient = kinetic * (q.traction_ratio * dlog_kinetic + dratio);
            dout->creep_force = in->normal_load * dout->traction_coefficient +
                                kinetic * q.traction_ratio * din->normal_load;
            /* The force is even in what slips across. */
            along.lateral_velocity = along.spin_velocity = 0.0;
        }
        follow_gradient(table, p, in, out, dp, &along, pace, dout);
    } else if (is_loaded(p, in->normal_load)) { /* as soon as there is friction, all slides */
        sliding_shares(table, p, in, &at, share);
        dout->traction_coefficient = share[0] * din->friction_scale;
        dout->creep_force = in->normal_load * dout->traction_coefficient;
        dout->lateral_force = in->normal_load * share[1] * din->friction_scale;
    } else if (in->normal_load >= 0.0 && has_friction(in)) {
        sliding_shares(table, p, in, &at, share);
        dout->creep_force = share[0] * din->normal_load;
        dout->lateral_force = share[1] * din->normal_load;
    }
    dout->wheel_torque = -p->radius * dout->creep_force - out->creep_force * dp->radius;
    if (relaxed) {
        double length = p->relaxation_length, dlog_length = dp->relaxation_length / length;
        double decay = fabs(in->speed), ddecay = dmagnitude;
        double limit = sliding_limit(zeta0);
        if (fabs(acting) > limit) {
            double dlog_limit = limit == zeta0 ? dlog_zeta0 : 0.0;
            decay = sliding_decay(slip, in->speed, limit);
            if (decay > fabs(in->speed)) ddecay = decay * (dslip / slip - dlog_limit);
            length *= limit / fabs(acting);
            dlog_length += dlog_limit - dacting / acting;
        }
        dout->relaxation_rate = (dslip - ddecay * acting - decay * dacting) / length -
                                out->relaxation_rate * dlog_length;
    }
}

#endif
