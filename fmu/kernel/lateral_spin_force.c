#include "lateral_spin_force.h"

#include <string.h>

/* Direction of rolling: -1 or 1 above the minimum speed. Rolling backwards is rolling forwards
 * after half a turn, which reverses slip and force but neither spin nor moment. */
static double direction_at(const force_element_input *in, const lateral_spin_force *s) {
    return in->speed * s->at.inverse_speed;
}

static lateral_spin_force lateral_spin_force_of(const creep_table *table,
                                                const force_element_parameters *there,
                                                const force_element_input *in) {
    lateral_spin_force s;
    creep_value q;
    lateral_spin_force_begin(table, table->lateral_spin, there, in,
                             slip_speeds_of(table, there, in), &s);
    double per = s.at.inverse_speed;
    lateral_spin_force_place(table, -in->lateral_velocity * per,
                             -in->spin_velocity * per * direction_at(in, &s), &s);
    creep_table_evaluate(table, s.start.place, s.start.k_hat, s.start.layer, &q);
    lateral_spin_force_finish(table, q, &s);
    return s;
}

/* Derivative of the normalized spin by the speed [s/m]. */
static double turn_with_speed(const force_element_input *in, const lateral_spin_force *s) {
    double slower = -s->at.speed_slope * s->at.inverse_speed;
    return s->creepage[2] * slower - s->per[2] * s->at.inverse_speed * in->spin_velocity *
                                         (s->at.inverse_speed + direction_at(in, s) * slower);
}

void lateral_spin_force_evaluate(const creep_table *table, const force_element_parameters *p,
                                 const force_element_input *in, force_element_output *out) {
    lateral_spin_force s = lateral_spin_force_of(table, p, in);
    force_state *at = &s.at;
    const double *by = s.law.by_creepage[0];
    creep_value q;
    q.traction_ratio = s.law.force[0];
    q.slope = by[0];
    q.log_k_derivative = s.law.by_log_k[0];
    q.log_layer_derivative = s.law.by_log_layer[0];
    at->place.x_by_x = 1.0; /* the law of lateral and spin force contains the softening */
    at->place.log_left_by_x = at->place.log_left_by_log_layer = 0.0;
    double growth = p->load_exponent, turning = s.slip.turning; /* it grows with the width */
    if (turning != 0.0)
        at->log_g_by_log_load += s.fall.by_slip * turning * turning * growth / s.slip.size;
    finish_force(table, p, in, at, q, out);
    out->force_margin = p->kinetic_friction * s.size - p->static_friction;
    out->force_limited = out->force_margin > 0.0 ? 1.0 : 0.0;
    out->lateral_force = s.scale[1] * s.law.force[1];
    out->spin_moment = s.scale[2] * direction_at(in, &s) * s.law.force[2];
    double slower = -at->speed_slope * at->inverse_speed;
    out->force_by_speed +=
        s.scale[0] * (by[1] * s.creepage[1] * slower + by[2] * turn_with_speed(in, &s));
    out->force_by_load -= at->kinetic * growth * by[1] * s.creepage[1];
    if (remembers(p)) memory_action(p, in, at, out);
}

#ifndef ONE_FILE_KERNEL
#include "checked_file.h"

enum { LATERAL_SPIN_VERSION = 1, LATERAL_SPIN_NUMBERS = 5 };

void lateral_spin_evaluate(const creep_table *table, const lateral_spin_shape *shape,
                           const double creepage[3], double k_hat, double layer_ratio,
                           lateral_spin_value *value) {
    creep_value q;
    lateral_spin_start at = lateral_spin_begin(shape, creepage, k_hat, layer_ratio);
    creep_table_evaluate(table, at.place, at.k_hat, at.layer, &q);
    lateral_spin_finish(shape, creepage, k_hat, layer_ratio, at, q, value);
}

/* After the frame come stiffness ratio, softening across rolling, b/a, spin arm, slip spread and,
 * for a contact with spin, one set of coefficients. */
const char *lateral_spin_contact_open(lateral_spin_contact *contact, const void *bytes,
                                      size_t size) {
    const double *number;
    size_t count;
    const char *error =
        checked_numbers(bytes, size, "PLANECON", LATERAL_SPIN_VERSION, &number, &count);
    if (error != NULL) return error;
    if (count != LATERAL_SPIN_NUMBERS && count != LATERAL_SPIN_NUMBERS + LATERAL_SPIN_COEFFICIENTS)
        return "the number of values is not that of a contact";
    if (!(number[0] >= 1e-3 && number[1] >= -0.5 && number[1] <= 0.5 && number[2] >= 0.0))
        return "the contact's shape is out of range";
    int spins = count > LATERAL_SPIN_NUMBERS;
    *contact = (lateral_spin_contact){
        .shape = {.stiffness_ratio = number[0],
                  .softening_y = number[1],
                  .coefficients = spins ? number + LATERAL_SPIN_NUMBERS : NULL,
                  .share = {1.0},
                  .sets = spins},
        .axes_ratio = number[2],
        .spin_arm = spins ? number[3] : 0.0,
        .slip_spread = spins ? number[4] : 0.0,
    };
    return NULL;
}

/* Tangent without load or friction: the force begins as that of full slip. */
static void begin_to_grip(const creep_table *table, const force_element_parameters *p,
                          const force_element_input *in, const force_element_input *din,
                          force_element_output *dout) {
    int loaded = is_loaded(p, in->normal_load);
    if (!loaded && (in->normal_load < 0.0 || !has_friction(in))) return;
    friction_fall fall = friction_without_grip(table, p, in);
    force_state at = begin_force(table, p, contact_scales_of(p), in, &fall, 0.0);
    double share[2], more = loaded ? in->normal_load * din->friction_scale : din->normal_load;
    sliding_shares(table, p, in, &at, share);
    dout->creep_force = share[0] * more;
    dout->lateral_force = share[1] * more;
    dout->traction_coefficient = loaded ? share[0] * din->friction_scale : 0.0;
}

void force_element_tangent(const creep_table *table, const force_element_parameters *p,
                           const force_element_input *in, const force_element_output *out,
                           const force_element_input *din, force_element_output *dout) {
    static const lateral_spin_contact NO_CONTACT = {.shape = {.stiffness_ratio = 1.0}};
    double drolling = p->radius * din->omega;
    dout->creep_force = dout->lateral_force = dout->spin_moment = dout->traction_coefficient = 0.0;
    dout->traction_rate = dout->unslipped_rate = 0.0;
    dout->creepage = out->creepage_by_omega * din->omega + out->creepage_by_speed * din->speed;
    if (can_grip(p, in)) {
        creep_table any = *table;
        if (table->lateral_spin == NULL) any.lateral_spin = &NO_CONTACT;
        force_element_parameters there = force_element_at_load(p, in->normal_load);
        lateral_spin_force s = lateral_spin_force_of(&any, &there, in);
        const friction_fall *g = &s.fall;
        const double *force = s.law.force, *scale = s.scale;
        double dlog_load = din->normal_load / in->normal_load, direction = direction_at(in, &s);
        double dlog_width = p->load_exponent * dlog_load;
        double dlog_friction = din->friction_scale / in->friction_scale;
        double spread = any.lateral_spin->slip_spread * there.semi_width, dslip = 0.0;
        if (s.slip.size > 0.0)
            dslip =
                (s.slip.along * (drolling - din->speed) - s.slip.across * din->lateral_velocity +
                 s.slip.turning * (s.slip.turning * dlog_width + spread * din->spin_velocity)) /
                s.slip.size;
        double by_log_friction = g->by_log_heating + g->by_log_zeta0 - 0.5 * g->by_log_k;
        double dlog_kinetic = dlog_friction * (1.0 + by_log_friction) + g->by_slip * dslip +
                              g->by_rolling * drolling + g->by_speed * din->speed +
                              s.at.log_g_by_log_load * dlog_load;
        double slower = -s.at.speed_slope * din->speed * s.at.inverse_speed;
        /* At constant friction: */
        double dl[3] = {dout->creepage * s.per[0] - s.creepage[0] * dlog_width,
                        s.creepage[1] * (slower - dlog_width) -
                            s.per[1] * s.at.inverse_speed * din->lateral_velocity,
                        turn_with_speed(in, &s) * din->speed -
                            s.per[2] * s.at.inverse_speed * din->spin_velocity * direction};
        double dforce[3];
        for (int i = 0; i < 3; i++) { /* over the scale */
            const double *by = s.law.by_creepage[i];
            dforce[i] = force[i] * dlog_load + change_with_friction(&s, i) * dlog_kinetic +
                        by[0] * dl[0] + by[1] * dl[1] + by[2] * dl[2] -
                        (s.law.by_log_k[i] + s.law.by_log_layer[i]) * dlog_width;
        }
        double turned = (din->speed + in->speed * slower) * s.at.inverse_speed;
        dout->traction_coefficient = s.at.kinetic * (dforce[0] - force[0] * dlog_load);
        dout->creep_force = scale[0] * dforce[0];
        dout->lateral_force = scale[1] * dforce[1];
        dout->spin_moment =
            scale[2] * (direction * dforce[2] + force[2] * (direction * dlog_width + turned));
        if (remembers(p)) {
            force_state *at = &s.at;
            memory_place m = memory_at(&there, in, at, at->kinetic * force[0]);
            double toward = at->x < 0.0 ? -1.0 : 1.0, change[MEMORY_ARGUMENTS], rate[2];
            double log_k = at->k_hat < at->scales.k_hat ? 0.0 : 1.0;
            change[BY_X] = toward * (dl[0] - at->x * dlog_kinetic);
            change[BY_RATIO] = m.sign * (dforce[0] - force[0] * (dlog_load + dlog_kinetic));
            change[BY_K] = -at->k_hat * log_k * (0.5 * dlog_kinetic + dlog_width);
            change[BY_WEAKENING] = -m.weakening * (dlog_kinetic + 2.0 * dlog_width);
            change[BY_TRACTION] = m.sign * din->held_traction / at->kinetic - m.q * dlog_kinetic;
            change[BY_UNSLIPPED] = din->unslipped;
            change[BY_PACE] =
                at->speed_slope * din->speed / there.relaxation_length - m.pace * dlog_width;
            memory_change(&m, at, change, dlog_kinetic, rate);
            dout->traction_rate = rate[0];
            dout->unslipped_rate = rate[1];
            dout->traction_coefficient = din->held_traction;
            dout->creep_force =
                in->held_traction * din->normal_load + in->normal_load * din->held_traction;
        }
    } else {
        begin_to_grip(table, p, in, din, dout);
        if (remembers(p)) {
            dout->creep_force = out->force_by_load * din->normal_load;
            dout->traction_coefficient = 0.0;
            dout->traction_rate = out->traction_by_omega * din->omega +
                                  out->traction_by_speed * din->speed +
                                  out->traction_by_traction * din->held_traction;
            dout->unslipped_rate = out->unslipped_by_omega * din->omega +
                                   out->unslipped_by_speed * din->speed +
                                   out->unslipped_by_unslipped * din->unslipped;
        }
    }
    dout->wheel_torque = -p->radius * dout->creep_force;
}
#endif /* ONE_FILE_KERNEL */
