/* Creep force of a contact with lateral slip or spin. */
#ifndef FORCE_IN_PLANE_H
#define FORCE_IN_PLANE_H

#include "force_law.h"
#include "plane_formula.h"

ALWAYS_INLINE int is_in_plane(const creep_table *table, const force_element_input *in) {
    return (table->plane != NULL) & ((in->lateral_velocity != 0.0) | (in->spin_velocity != 0.0));
}

/* Slip speeds along and across rolling and by spin, and their magnitude [m/s]. That of spin is the
 * root mean square over Hertz's pressure. */
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
    plane_shape shape;
    plane_start start;  /* where the law is read */
    double per[3];      /* normalized creepages per creepage along, across, and spin */
    double creepage[3]; /* normalized */
    double scale[3];    /* of forces and moment [N, N, N.m] */
    double k_hat;       /* 0 for a law without it */
    double most;        /* f_s/f_d */
    plane_value law;    /* the force, held at f_s N */
    double size;        /* of the law's force before [f_d N] */
} force_plane;

/* The parameters must be those at the load. */
ALWAYS_INLINE void begin_in_plane(const creep_table *table, const plane_contact *plane,
                                  const force_element_parameters *there,
                                  const force_element_input *in, slip_speeds slip, force_plane *s) {
    contact_scales scales = contact_scales_of(there);
    s->slip = slip;
    s->fall = falling_friction(table, there, scales, in, slip.size, decay_at(there, slip.size),
                               is_hot(there));
    double along = slip.size > 0.0 ? slip.along / slip.size : 0.0;
    s->at = begin_force(table, there, scales, in, &s->fall, along);
    s->most = there->static_friction / there->kinetic_friction;
    s->shape = plane->shape;
    s->shape.softening_x = there->softening;
    s->shape.static_ratio = s->most;
    s->per[0] = s->at.inverse_saturation;
    s->per[1] = plane->shape.stiffness_ratio * s->per[0];
    s->per[2] = plane->spin_arm * there->semi_width * s->per[0];
    s->scale[0] = s->scale[1] = s->at.kinetic * in->normal_load;
    s->scale[2] = s->scale[0] * (there->semi_width * sqrt(plane->axes_ratio));
}

ALWAYS_INLINE void place_in_plane(const creep_table *table, double across, double spin,
                                  force_plane *s) {
    s->creepage[0] = s->at.x;
    s->creepage[1] = s->per[1] * across;
    s->creepage[2] = s->per[2] * spin;
    s->k_hat = table->one_axis ? 0.0 : s->at.k_hat;
    s->start = plane_begin(&s->shape, s->creepage, s->k_hat);
}

ALWAYS_INLINE void finish_in_plane(const creep_table *table, double q, double slope,
                                   double q_by_log_k, force_plane *s) {
    plane_finish(&s->shape, s->creepage, s->k_hat, s->start, q, slope, q_by_log_k, &s->law);
    s->size = plane_hold(&s->law, s->most);
    const double *by = s->law.by_creepage[0];
    s->at.by_others = by[1] * s->creepage[1] + by[2] * s->creepage[2];
    if (s->at.scales.k_hat > table->k_max)
        for (int i = 0; i < 3; i++) s->law.by_log_k[i] = 0.0; /* it is held */
}

/* Change of a force over its scale with ln(g), g being the factor on friction. */
ALWAYS_INLINE double change_with_friction(const force_plane *s, int i) {
    const double *by = s->law.by_creepage[i], *at = s->creepage;
    return s->law.force[i] - 0.5 * s->law.by_log_k[i] -
           (by[0] * at[0] + by[1] * at[1] + by[2] * at[2]);
}

ALWAYS_INLINE slip_speeds slip_in_plane(const creep_table *table, const force_element_parameters *p,
                                        const force_element_input *in) {
    double width = 0.0; /* no load has no width */
    if (is_loaded(p, in->normal_load)) width = force_element_at_load(p, in->normal_load).semi_width;
    return slip_of_parts(slip_of(p, in), -in->lateral_velocity,
                         table->plane->slip_spread * width * in->spin_velocity);
}

/* Fall of friction without load or friction, and so without heat, at the slip speed of all slip. */
static inline friction_fall friction_without_grip(const creep_table *table,
                                                  const force_element_parameters *p,
                                                  const force_element_input *in) {
    double slip = is_in_plane(table, in) ? slip_in_plane(table, p, in).size : fabs(slip_of(p, in));
    contact_scales none;
    memset(&none, 0, sizeof none);
    return falling_friction(table, p, none, in, slip, decay_at(p, slip), 0);
}

/* The force under a load and with friction; parameters are those at the load. */
void evaluate_in_plane(const creep_table *table, const force_element_parameters *there,
                       const force_element_input *in, force_element_output *out);

#endif
