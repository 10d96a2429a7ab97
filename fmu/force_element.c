#include "force_element.h"

#include <math.h>

#include "force_law.h"
#include "relaxation.h"

void force_element_scales(const force_element_parameters *p, double normal_load,
                          double friction_scale, contact_scales *scales) {
    force_element_parameters there = force_element_at_load(p, normal_load);
    *scales = scaled(contact_scales_of(&there), friction_scale);
}

/* ---- force --------------------------------------------------------------------------------- */

/* One exponential that is not needed costs as much as the law. */
static double decay_at(const force_element_parameters *p, double slip) {
    return p->slip_rate_decay == 0.0 ? 1.0 : slip_decay(p, slip);
}

/* No contact: no force, and no scales to speak of. But the first load slides. */
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

/* ---- directional derivative ---------------------------------------------------------------- */

/* Change of slope and of k dq/dk along (dx, dlog_k). The table gives first derivatives only, so
 * these are its central differences. */
static void second_derivatives(const creep_table *table, double x, double k_hat, double dx,
                               double dlog_k, double *dslope, double *dlog_k_derivative) {
    double pace = fabs(dx) / (fabs(x) + 1e-2) + fabs(dlog_k);
    *dslope = *dlog_k_derivative = 0.0;
    if (!(pace > 1e-300)) return; /* nothing that shows, and e would overflow */
    double e = 1e-6 / pace, most = table->one_axis ? INFINITY : table->k_max;
    creep_value ahead, behind;
    creep_table_evaluate(table, x + e * dx, fmin(k_hat * exponential(e * dlog_k), most), &ahead);
    creep_table_evaluate(table, x - e * dx, fmin(k_hat * exponential(-e * dlog_k), most), &behind);
    *dslope = (ahead.slope - behind.slope) / (2.0 * e);
    *dlog_k_derivative = (ahead.log_k_derivative - behind.log_k_derivative) / (2.0 * e);
}

void force_element_tangent(const creep_table *table, const force_element_parameters *p,
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
    dout->creepage = (dslip - out->creepage * dreference) / reference;
    double acting = relaxed ? in->relaxed_creepage : out->creepage;
    double dacting = relaxed ? din->relaxed_creepage : dout->creepage;

    double passing, g = slip_rate_factor(p, decay_at(p, slip), &passing), w = fabs(slip);
    double dw = slip == 0.0 ? 0.0 : copysign(dslip, slip * dslip);
    double part = p->slip_rate_residual < 1.0 ? passing / (1.0 - p->slip_rate_residual)
                                              : decaying_exponential(p->slip_rate_decay * w);
    double dlog_g = (dp->slip_rate_residual * (1.0 - part) -
                     passing * (w * dp->slip_rate_decay + p->slip_rate_decay * dw)) /
                    g;
    double scale = g * in->friction_scale, kinetic = scale * p->kinetic_friction;
    double dlog_scale = dlog_g + din->friction_scale / in->friction_scale;
    double dlog_kinetic = dlog_scale + dp->kinetic_friction / p->kinetic_friction;

    double zeta0 = out->saturation_creepage, dlog_zeta0 = 0.0;
    if (is_loaded(p, in->normal_load)) {
        double drop = p->static_friction - p->kinetic_friction;
        double ddrop = dp->static_friction - dp->kinetic_friction;
        double dlog_drop = dlog_scale + (drop > 0.0 ? ddrop / drop : 0.0);
        double dlog_growth = p->load_exponent * (din->normal_load / in->normal_load -
                                                 dp->nominal_load / p->nominal_load) +
                             logarithm(in->normal_load / p->nominal_load) * dp->load_exponent;
        double dlog_width = dlog_growth + dp->semi_width / p->semi_width;
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
        contact_scales longer = {0.0, 0.0, 0.0};
        if (p->weakening_length == 0.0 && drop > 0.0) { /* the zone's length grows from nothing */
            force_element_parameters unit = *p;
            unit.weakening_length = 1.0;
            force_element_scales(&unit, in->normal_load, scale, &longer);
        }
        dout->saturation_creepage = zeta0 * dlog_zeta0;
        dout->k_hat = out->k_hat * dlog_k;
        dout->process_zone_ratio =
            out->process_zone_ratio *
                (dlog_modulus + dlog_length - dlog_drop - dlog_width - dlog_pressure) +
            longer.process_zone_ratio * dp->weakening_length;

        double x = out->normalized_creepage, dx = dacting / zeta0 - x * dlog_zeta0;
        dout->normalized_creepage = dx;
        creep_value q;
        double dslope = 0.0, dlog_k_derivative = 0.0;
        creep_table_evaluate(table, x, out->k_hat, &q);
        double dratio = q.slope * dx + q.log_k_derivative * dlog_k, side = copysign(1.0, x);
        double most = p->static_friction / p->kinetic_friction;
        double dmost = (dp->static_friction - most * dp->kinetic_friction) / p->kinetic_friction;
        dout->force_margin = p->kinetic_friction * side * dratio +
                             fabs(q.traction_ratio) * dp->kinetic_friction - dp->static_friction;
        if (out->force_limited > 0.0) {
            q = (creep_value){side * most, 0.0, 0.0};
            dratio = side * dmost;
        } else {
            second_derivatives(table, x, out->k_hat, dx, dlog_k, &dslope, &dlog_k_derivative);
        }
        dout->traction_coefficient = kinetic * (q.traction_ratio * dlog_kinetic + dratio);
        dout->creep_force = in->normal_load * dout->traction_coefficient +
                            kinetic * q.traction_ratio * din->normal_load;

        /* force_gradient = kinetic P (slope / (zeta0 reference) + through_g) */
        double b = p->slip_rate_decay, share = passing / g;
        double log_k_by_log_g = out->k_hat_limited > 0.0 ? 0.0 : -0.5;
        double by_log_g = q.traction_ratio - x * q.slope + log_k_by_log_g * q.log_k_derivative;
        double dby_log_g = dratio - dx * q.slope - x * dslope + log_k_by_log_g * dlog_k_derivative;
        /* d(passing)/passing - d(g)/g, with passing = (1 - A) exp(-B w) */
        double dpassing =
            -dp->slip_rate_residual * part - passing * (w * dp->slip_rate_decay + b * dw);
        double dshare = dpassing / g - share * dlog_g;
        double sign = copysign(1.0, slip);
        double elastic = q.slope / (zeta0 * reference);
        double delastic =
            dslope / (zeta0 * reference) - elastic * (dlog_zeta0 + dreference / reference);
        double through_g = -sign * b * share * by_log_g;
        double dthrough_g = -sign * (dp->slip_rate_decay * share * by_log_g +
                                     b * dshare * by_log_g + b * share * dby_log_g);
        double stretch = zeta0 * reference;
        dout->falling_margin = -dslope - dthrough_g * stretch -
                               through_g * stretch * (dlog_zeta0 + dreference / reference);
        double dsliding = kinetic * (in->normal_load * dlog_kinetic + din->normal_load);
        dout->force_gradient =
            dsliding * (elastic + through_g) + kinetic * in->normal_load * (delastic + dthrough_g);
    } else {
        dout->creep_force = out->force_by_load * din->normal_load;
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
