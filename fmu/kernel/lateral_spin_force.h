/* Creep force of a force element with lateral slip or spin. */
#ifndef LATERAL_SPIN_FORCE_H
#define LATERAL_SPIN_FORCE_H

#include "force_element_formula.h"
#include "lateral_spin_formula.h"

ALWAYS_INLINE int has_lateral_or_spin(const creep_table *table, const force_element_input *in) {
    return (table->lateral_spin != NULL) &
           ((in->lateral_velocity != 0.0) | (in->spin_velocity != 0.0));
}

/* Slip speeds along and across rolling and by spin, and their magnitude [m/s]. That by spin is the
 * root mean square, weighted by Hertz's pressure. */
typedef struct {
    double along, across, turning, size;
} slip_speeds;

ALWAYS_INLINE slip_speeds slip_of_parts(double along, double across, double turning) {
    slip_speeds w;
    w.along = along;
    w.across = across;
    w.turning = turning;
    w.size = sqrt(along * along + across * across + turning * turning);
    return w;
}

/* Lateral and spin force of a contact; creepages have the signs of the forces. */
typedef struct {
    force_state at; /* along rolling */
    slip_speeds slip;
    friction_fall fall;
    lateral_spin_shape shape;
    lateral_spin_start start; /* where the law is evaluated */
    double per[3];            /* normalized creepages per creepage along, across, and spin */
    double creepage[3];       /* normalized */
    double scale[3];          /* of forces and moment [N, N, N.m] */
    double k_hat, layer;      /* 0 for a law without it */
    double limit;             /* f_s/f_d */
    lateral_spin_value law;   /* the force, limited to f_s N */
    double size;              /* of the force without this limit [f_d N] */
} lateral_spin_force;

/* The parameters must be those at the load. */
ALWAYS_INLINE void lateral_spin_force_begin(const creep_table *table,
                                            const lateral_spin_contact *contact,
                                            const force_element_parameters *there,
                                            const force_element_input *in, slip_speeds slip,
                                            lateral_spin_force *s) {
    contact_scales scales = contact_scales_of(table, there);
    s->slip = slip;
    s->fall = falling_friction(table, there, scales, in, slip.size, decay_at(there, slip.size),
                               softens_with_heat(there));
    double along = slip.size > 0.0 ? slip.along / slip.size : 0.0;
    s->at = begin_force(table, there, scales, in, &s->fall, along);
    s->limit = there->static_friction / there->kinetic_friction;
    s->shape = contact->shape;
    s->shape.softening_x = there->softening;
    s->shape.static_ratio = s->limit;
    s->per[0] = s->at.inverse_saturation;
    s->per[1] = contact->shape.stiffness_ratio * s->per[0];
    s->per[2] = contact->spin_arm * there->semi_width * s->per[0];
    s->scale[0] = s->scale[1] = s->at.kinetic * in->normal_load;
    s->scale[2] = s->scale[0] * (there->semi_width * sqrt(contact->axes_ratio));
}

ALWAYS_INLINE void lateral_spin_force_set_point(const creep_table *table, double across,
                                                double spin, lateral_spin_force *s) {
    s->creepage[0] = s->at.x;
    s->creepage[1] = s->per[1] * across;
    s->creepage[2] = s->per[2] * spin;
    s->k_hat = table->one_axis ? 0.0 : s->at.k_hat;
    s->layer = table->layer_w > 0 ? s->at.scales.layer_ratio : 0.0;
    s->start = lateral_spin_begin(&s->shape, s->creepage, s->k_hat, s->layer);
}

ALWAYS_INLINE void lateral_spin_force_finish(const creep_table *table, creep_value q,
                                             lateral_spin_force *s) {
    lateral_spin_finish(&s->shape, s->creepage, s->k_hat, s->layer, s->start, q, &s->law);
    s->size = lateral_spin_hold(&s->law, s->limit);
    const double *by = s->law.by_creepage[0];
    s->at.by_others = by[1] * s->creepage[1] + by[2] * s->creepage[2];
    if (s->at.scales.k_hat > table->k_max)
        for (int i = 0; i < 3; i++) s->law.by_log_k[i] = 0.0; /* it is limited */
}

/* Derivative of a force over its scale by ln(g), where g is the factor on friction. */
ALWAYS_INLINE double change_with_friction(const lateral_spin_force *s, int i) {
    const double *by = s->law.by_creepage[i], *at = s->creepage;
    return s->law.force[i] - 0.5 * s->law.by_log_k[i] -
           (by[0] * at[0] + by[1] * at[1] + by[2] * at[2]);
}

ALWAYS_INLINE slip_speeds slip_speeds_of(const creep_table *table,
                                         const force_element_parameters *p,
                                         const force_element_input *in) {
    double width = 0.0; /* without load */
    if (is_loaded(p, in->normal_load)) width = force_element_at_load(p, in->normal_load).semi_width;
    return slip_of_parts(slip_of(p, in), -in->lateral_velocity,
                         table->lateral_spin->slip_spread * width * in->spin_velocity);
}

/* Fall of friction with all slip, without load or friction and so without heat. */
static inline friction_fall friction_without_grip(const creep_table *table,
                                                  const force_element_parameters *p,
                                                  const force_element_input *in) {
    double slip =
        has_lateral_or_spin(table, in) ? slip_speeds_of(table, p, in).size : fabs(slip_of(p, in));
    contact_scales none;
    memset(&none, 0, sizeof none);
    return falling_friction(table, p, none, in, slip, decay_at(p, slip), 0);
}

/* The force with load and friction; the parameters must be those at the load. */
void lateral_spin_force_evaluate(const creep_table *table, const force_element_parameters *there,
                                 const force_element_input *in, force_element_output *out);

#endif
