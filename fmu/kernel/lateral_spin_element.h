/* Outputs of a force element with lateral slip or spin, before and after the evaluation of the
 * table. */
#ifndef LATERAL_SPIN_ELEMENT_H
#define LATERAL_SPIN_ELEMENT_H

#include <string.h>

#include "lateral_spin_force.h"

/* Direction of rolling: -1 or 1 above the minimum speed. Rolling backwards is rolling forwards
 * after half a turn, which reverses slip and force but neither spin nor moment. */
static inline double direction_at(const force_element_input *in, const lateral_spin_force *s) {
    return in->speed * s->at.inverse_speed;
}

/* The parameters must be those at the load. */
static inline void lateral_spin_element_begin(const creep_table *table,
                                              const force_element_parameters *there,
                                              const force_element_input *in,
                                              lateral_spin_force *s) {
    lateral_spin_force_begin(table, table->lateral_spin, there, in,
                             slip_speeds_of(table, there, in), s);
    double per = s->at.inverse_speed;
    lateral_spin_force_set_point(table, -in->lateral_velocity * per,
                                 -in->spin_velocity * per * direction_at(in, s), s);
}

/* Derivative of the normalized spin by the speed [s/m]. */
static inline double turn_with_speed(const force_element_input *in, const lateral_spin_force *s) {
    double slower = -s->at.speed_slope * s->at.inverse_speed;
    return s->creepage[2] * slower - s->per[2] * s->at.inverse_speed * in->spin_velocity *
                                         (s->at.inverse_speed + direction_at(in, s) * slower);
}

/* Changes of an input's forces over their scales, and of what else they depend on. */
typedef struct {
    double force[3], creepage[3]; /* creepages at constant friction */
    double log_load, log_width, log_kinetic, slower;
} lateral_spin_change;

static inline lateral_spin_change change_of_forces(const force_element_parameters *there,
                                                   double spread, const force_element_input *in,
                                                   const force_element_output *out,
                                                   const lateral_spin_force *s,
                                                   const force_element_input *din) {
    lateral_spin_change d;
    const friction_fall *g = &s->fall;
    const slip_speeds *w = &s->slip;
    const double *force = s->law.force;
    double drolling = there->radius * din->omega, dslip = 0.0;
    double dcreepage = out->creepage_by_omega * din->omega + out->creepage_by_speed * din->speed;
    double dlog_friction = din->friction_scale / in->friction_scale;
    d.log_load = din->normal_load / in->normal_load;
    d.log_width = there->load_exponent * d.log_load;
    if (w->size > 0.0)
        dslip = (w->along * (drolling - din->speed) - w->across * din->lateral_velocity +
                 w->turning *
                     (w->turning * d.log_width + spread * there->semi_width * din->spin_velocity)) /
                w->size;
    double by_log_friction = g->by_log_heating + g->by_log_zeta0 - 0.5 * g->by_log_k;
    d.log_kinetic = dlog_friction * (1.0 + by_log_friction) + g->by_slip * dslip +
                    g->by_rolling * drolling + g->by_speed * din->speed +
                    s->at.log_g_by_log_load * d.log_load;
    d.slower = -s->at.speed_slope * din->speed * s->at.inverse_speed;
    d.creepage[0] = dcreepage * s->per[0] - s->creepage[0] * d.log_width;
    d.creepage[1] = s->creepage[1] * (d.slower - d.log_width) -
                    s->per[1] * s->at.inverse_speed * din->lateral_velocity;
    d.creepage[2] = turn_with_speed(in, s) * din->speed -
                    s->per[2] * s->at.inverse_speed * din->spin_velocity * direction_at(in, s);
    for (int i = 0; i < 3; i++) {
        const double *by = s->law.by_creepage[i];
        d.force[i] = force[i] * d.log_load + change_with_friction(s, i) * d.log_kinetic +
                     by[0] * d.creepage[0] + by[1] * d.creepage[1] + by[2] * d.creepage[2] -
                     (s->law.by_log_k[i] + s->law.by_log_layer[i]) * d.log_width;
    }
    return d;
}

/* Change of what the memory depends on; the steady forces change by d. */
static inline memory_direction memory_direction_of(const lateral_spin_force *s,
                                                   const memory_point *m,
                                                   const lateral_spin_change *d,
                                                   const force_element_input *in,
                                                   const force_element_input *din) {
    const force_state *at = &s->at;
    memory_direction to;
    for (int i = 0; i < 2; i++) {
        to.creepage[i] = d->creepage[i] - s->creepage[i] * d->log_kinetic;
        to.force[i] = d->force[i] - s->law.force[i] * (d->log_load + d->log_kinetic);
    }
    double log_k = at->k_hat < at->scales.k_hat ? 0.0 : 1.0;
    to.k_hat = -at->k_hat * log_k * (0.5 * d->log_kinetic + d->log_width);
    to.weakening = -m->weakening * (d->log_kinetic + d->log_width);
    to.held[0] = din->memory.held_force;
    to.held[1] = din->lateral.held_lateral;
    to.outer[0] = din->memory.outer_force;
    to.outer[1] = din->lateral.outer_lateral;
    to.unslipped = din->memory.unslipped;
    to.pace = at->speed_slope * din->speed / at->scales.relaxation_length;
    to.log_scale = d->log_kinetic + d->log_load;
    to.log_limit = d->log_load + din->friction_scale / in->friction_scale;
    return to;
}

static inline memory_point memory_of(const force_element_parameters *there,
                                     const force_element_input *in, const lateral_spin_force *s) {
    return memory_at(2, there, in, &s->at, s->creepage[1], s->law.force);
}

/* All outputs from the table's value. */
static inline void lateral_spin_element_finish(const creep_table *table,
                                               const force_element_parameters *p,
                                               const force_element_input *in, creep_value of_table,
                                               lateral_spin_force *s, force_element_output *out) {
    lateral_spin_force_finish(table, of_table, s);
    force_state *at = &s->at;
    const double *by = s->law.by_creepage[0];
    creep_value q;
    q.traction_ratio = s->law.force[0];
    q.slope = by[0];
    q.log_k_derivative = s->law.by_log_k[0];
    q.log_layer_derivative = s->law.by_log_layer[0];
    at->point.x_by_x = 1.0; /* the law of lateral and spin force contains the softening */
    at->point.log_left_by_x = at->point.log_left_by_log_layer = 0.0;
    double growth = p->load_exponent, turning = s->slip.turning; /* it grows with the width */
    if (turning != 0.0)
        at->log_g_by_log_load += s->fall.by_slip * turning * turning * growth / s->slip.size;
    finish_force(table, p, in, at, q, out);
    out->force_margin = (p->kinetic_friction * s->size - p->static_friction) * s->fall.scale;
    out->force_limited = out->force_margin > 0.0 ? 1.0 : 0.0;
    out->lateral_force = s->scale[1] * s->law.force[1];
    out->spin_moment = s->scale[2] * direction_at(in, s) * s->law.force[2];
    set_by_force(p, in, out);
    double slower = -at->speed_slope * at->inverse_speed;
    out->force_by_speed +=
        s->scale[0] * (by[1] * s->creepage[1] * slower + by[2] * turn_with_speed(in, s));
    out->force_by_load -= at->kinetic * growth * by[1] * s->creepage[1];
    if (!remembers(p)) return;
    memory_point m = memory_of(p, in, s);
    force_element_output steady = *out;
    hold_forces(2, p, in, &m, out);
    memory_direction heavier;
    memset(&heavier, 0, sizeof heavier);
    heavier.log_limit = 1.0 / in->normal_load;
    held_change more = change_of_held(2, &m, &heavier);
    out->force_by_load = more.acting[0][0] + more.acting[1][0];
    out->force_by_omega = out->force_by_speed = 0.0;
    for (int i = 0; i < 2 + MEMORY_STATES; i++) {
        force_element_input din;
        double rate[MEMORY_STATES], *const state[] = {&din.omega,
                                                      &din.speed,
                                                      &din.memory.held_force,
                                                      &din.memory.unslipped,
                                                      &din.memory.outer_force,
                                                      &din.lateral.held_lateral,
                                                      &din.lateral.outer_lateral};
        memset(&din, 0, sizeof din);
        *state[i] = 1.0;
        lateral_spin_change d;
        memset(&d, 0, sizeof d);
        if (i < 2) d = change_of_forces(p, table->lateral_spin->slip_spread, in, &steady, s, &din);
        memory_direction to = memory_direction_of(s, &m, &d, in, &din);
        held_change h = change_of_held(2, &m, &to);
        memory_change(2, &m, i < 2 ? BY_X : FROM_STATES, &to, &h, rate);
        set_changes_by(2, i, &h, rate, out);
    }
}

#endif
