/* Creep force of a contact that slips across rolling or spins, too. */
#ifndef FORCE_IN_PLANE_H
#define FORCE_IN_PLANE_H

#include "force_law.h"
#include "plane_contact.h"

ALWAYS_INLINE int is_in_plane(const creep_table *table, const force_element_input *in) {
    return (table->plane != NULL) & ((in->lateral_velocity != 0.0) | (in->spin_velocity != 0.0));
}

/* Slip speeds along and across rolling and by spin, and their magnitude [m/s]. That of spin is the
 * root mean square over Hertz's pressure. */
typedef struct {
    double along, across, turning, size;
} slip_speeds;

ALWAYS_INLINE slip_speeds slip_in_plane(const creep_table *table, const force_element_parameters *p,
                                        const force_element_input *in) {
    double width = 0.0; /* no load has no width */
    if (is_loaded(p, in->normal_load)) width = force_element_at_load(p, in->normal_load).semi_width;
    slip_speeds w;
    w.along = slip_of(p, in);
    w.across = -in->lateral_velocity;
    w.turning = table->plane->slip_spread * width * in->spin_velocity;
    w.size = sqrt(w.along * w.along + w.across * w.across + w.turning * w.turning);
    return w;
}

/* Fall of friction without load or friction, and so without heat; in the plane if it slips there.
 */
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
