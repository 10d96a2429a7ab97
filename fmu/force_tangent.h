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

/* Change of slope and of k dq/dk along (dx, dlog_k, dsoftening), by central differences of the
 * law's first derivatives. */
static inline void second_derivatives(const creep_table *table, double softening, double x,
                                      double k_hat, double dx, double dlog_k, double dsoftening,
                                      double *dslope, double *dlog_k_derivative) {
    double pace = fabs(dx) / (fabs(x) + 1e-2) + fabs(dlog_k) + fabs(dsoftening);
    *dslope = *dlog_k_derivative = 0.0;
    if (!(pace > 1e-300)) return; /* e would overflow */
    double e = 1e-6 / pace, most = table->one_axis ? INFINITY : table->k_max;
    creep_value ahead = law_value(table, softening + e * dsoftening, x + e * dx,
                                  fmin(k_hat * exponential(e * dlog_k), most));
    creep_value behind = law_value(table, softening - e * dsoftening, x - e * dx,
                                   fmin(k_hat * exponential(-e * dlog_k), most));
    *dslope = (ahead.slope - behind.slope) / (2.0 * e);
    *dlog_k_derivative = (ahead.log_k_derivative - behind.log_k_derivative) / (2.0 * e);
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
    double passing, g = slip_rate_factor(p, decay_at(p, w), &passing);
    double part = p->slip_rate_residual < 1.0 ? passing / (1.0 - p->slip_rate_residual)
                                              : decaying_exponential(p->slip_rate_decay * w);
    double dlog_g = (dp->slip_rate_residual * (1.0 - part) -
                     passing * (w * dp->slip_rate_decay + p->slip_rate_decay * dw)) /
                    g;
    double friction = has_friction(in) ? in->friction_scale : 1.0;
    double scale = g * friction, kinetic = scale * p->kinetic_friction;
    double dlog_scale = dlog_g + din->friction_scale / friction;
    double dlog_kinetic = dlog_scale + dp->kinetic_friction / p->kinetic_friction;

    force_state at = {.acting = acting, .inverse_speed = 1.0 / reference, .kinetic = kinetic};
    double share[2], zeta0 = out->saturation_creepage, dlog_zeta0 = 0.0;
    if (can_grip(p, in)) {
        double drop = p->static_friction - p->kinetic_friction;
        double ddrop = dp->static_friction - dp->kinetic_friction;
        double dlog_drop = dlog_scale + (drop > 0.0 ? ddrop / drop : 0.0);
        double dlog_pressure = dlog_growth + dp->peak_pressure / p->peak_pressure;
        double dlog_modulus = dp->contact_modulus / p->contact_modulus;
        double dlog_length =
            p->weakening_length > 0.0 ? dp->weakening_length / p->weakening_length : 0.0;
        /* Eqs. (15) and (17) are products of powers. */
        dlog_zeta0 =
            dlog_kinetic + dlog_pressure - dlog_modulus - dp->slope_reduction / p->slope_reduction;
        double dlog_k_free = 0.0;
        if (out->k_hat > 0.0)
            dlog_k_free =
                0.5 * (dlog_modulus + dlog_drop + dlog_length - dlog_width - dlog_pressure) -
                dlog_kinetic;
        double dlog_k = out->k_hat_limited > 0.0 ? 0.0 : dlog_k_free;
        if (!table->one_axis) dout->k_hat_margin = (table->k_max + out->k_hat_margin) * dlog_k_free;
        contact_scales longer = {0};
        if (p->weakening_length == 0.0 && drop > 0.0) { /* the zone's length grows from nothing */
            force_element_parameters unit = *p;
            unit.weakening_length = 1.0;
            unit = force_element_at_load(&unit, in->normal_load);
            longer = scaled(contact_scales_of(&unit), scale);
        }
        dout->saturation_creepage = zeta0 * dlog_zeta0;
        dout->k_hat = out->k_hat * dlog_k;
        dout->process_zone_ratio =
            out->process_zone_ratio *
                (dlog_modulus + dlog_length - dlog_drop - dlog_width - dlog_pressure) +
            longer.process_zone_ratio * dp->weakening_length;

        double x = out->normalized_creepage, dx = dacting / zeta0 - x * dlog_zeta0;
        dout->normalized_creepage = dx;
        if (is_in_plane(table, in) | is_in_plane(table, din)) {
            force_change change = {.acting = dacting,
                                   .reference = dreference,
                                   .slip = dw,
                                   .log_kinetic = dlog_kinetic,
                                   .log_zeta0 = dlog_zeta0,
                                   .log_k = dlog_k,
                                   .log_width = dlog_width};
            tangent_in_plane(table, p, in, out, dp, din, &change, dout);
        }
        if (!is_in_plane(table, in)) {
            creep_value q = law_value(table, p->softening, x, out->k_hat);
            double dratio = q.slope * dx + q.log_k_derivative * dlog_k, side = copysign(1.0, x);
            double dslope = 0.0, dlog_k_derivative = 0.0;
            if (dp->softening != 0.0)
                dratio += by_softening(table, p->softening, x, out->k_hat) * dp->softening;
            second_derivatives(table, p->softening, x, out->k_hat, dx, dlog_k, dp->softening,
                               &dslope, &dlog_k_derivative);
            double most = p->static_friction / p->kinetic_friction;
            double dmost =
                (dp->static_friction - most * dp->kinetic_friction) / p->kinetic_friction;
            dout->force_margin = p->kinetic_friction * side * dratio +
                                 fabs(q.traction_ratio) * dp->kinetic_friction -
                                 dp->static_friction;
            if (out->force_limited > 0.0) {
                q = (creep_value){.traction_ratio = side * most};
                dratio = side * dmost;
                dslope = dlog_k_derivative = 0.0;
            }
            dout->traction_coefficient = kinetic * (q.traction_ratio * dlog_kinetic + dratio);
            dout->creep_force = in->normal_load * dout->traction_coefficient +
                                kinetic * q.traction_ratio * din->normal_load;

            /* force_gradient = kinetic P (slope / (zeta0 reference) + through_g) */
            double b = p->slip_rate_decay, falling = passing / g;
            double log_k_by_log_g = out->k_hat_limited > 0.0 ? 0.0 : -0.5;
            double by_log_g = q.traction_ratio - x * q.slope + log_k_by_log_g * q.log_k_derivative;
            double dby_log_g =
                dratio - dx * q.slope - x * dslope + log_k_by_log_g * dlog_k_derivative;
            /* d(passing)/passing - d(g)/g, with passing = (1 - A) exp(-B w) */
            double dpassing =
                -dp->slip_rate_residual * part - passing * (w * dp->slip_rate_decay + b * dw);
            double dshare = dpassing / g - falling * dlog_g;
            double sign = copysign(1.0, slip);
            double elastic = q.slope / (zeta0 * reference);
            double delastic =
                dslope / (zeta0 * reference) - elastic * (dlog_zeta0 + dreference / reference);
            double through_g = -sign * b * falling * by_log_g;
            double dthrough_g = -sign * (dp->slip_rate_decay * falling * by_log_g +
                                         b * dshare * by_log_g + b * falling * dby_log_g);
            double stretch = zeta0 * reference;
            dout->falling_margin = -dslope - dthrough_g * stretch -
                                   through_g * stretch * (dlog_zeta0 + dreference / reference);
            double dsliding = kinetic * (in->normal_load * dlog_kinetic + din->normal_load);
            dout->force_gradient = dsliding * (elastic + through_g) +
                                   kinetic * in->normal_load * (delastic + dthrough_g);
        }
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
