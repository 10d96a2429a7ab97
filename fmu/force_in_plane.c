#include "force_in_plane.h"

#include <string.h>

#include "plane_formula.h"
#include "relaxation.h"

/* Force in the plane at an input, before it is put into outputs. */
typedef struct {
    force_state at;
    slip_speeds slip;
    friction_fall fall;
    double along;        /* slip along rolling over that in the plane */
    double direction;    /* of rolling: -1 or 1 above the minimum speed */
    double per_velocity; /* 1/(reference zeta0) [s/m] */
    double per_spin;     /* normalized spin per spin velocity and direction of rolling [s] */
    double creepage[3];  /* normalized, in the signs of the forces */
    double most;         /* f_s/f_d */
    int held;            /* 1 if the force is held at f_s N */
    plane_value law;     /* as the law has it */
    double size;         /* of the law's force [f_d N] */
    plane_value force;   /* as it acts */
} state_in_plane;

/* The law at the creepages of a state. */
static void law_of(const creep_table *table, const state_in_plane *s, double softening,
                   double static_ratio, plane_value *law) {
    plane_shape shape = table->plane->shape;
    shape.softening_x = softening;
    shape.static_ratio = static_ratio;
    plane_at(table, &shape, s->creepage, table->one_axis ? 0.0 : s->at.k_hat, law);
}

static state_in_plane state_in_plane_of(const creep_table *table,
                                        const force_element_parameters *there,
                                        const force_element_input *in) {
    const plane_contact *plane = table->plane;
    state_in_plane s;
    s.slip = slip_in_plane(table, there, in);
    contact_scales scales = contact_scales_of(there);
    s.fall = falling_friction(table, there, scales, in, s.slip.size, decay_at(there, s.slip.size),
                              is_hot(there));
    s.along = s.slip.size > 0.0 ? s.slip.along / s.slip.size : 0.0;
    s.at = begin_force(table, there, scales, in, &s.fall, s.along);
    s.direction = in->speed * s.at.inverse_speed;
    s.per_velocity = s.at.inverse_speed * s.at.inverse_saturation;
    s.per_spin = plane->spin_arm * there->semi_width * s.per_velocity;
    s.creepage[0] = s.at.x;
    s.creepage[1] = -plane->shape.stiffness_ratio * s.per_velocity * in->lateral_velocity;
    /* Rolling backwards turns the contact by half a turn, and its spin against it. */
    s.creepage[2] = -s.per_spin * in->spin_velocity * s.direction;
    s.most = there->static_friction / there->kinetic_friction;
    law_of(table, &s, there->softening, s.most, &s.law);
    s.force = s.law;
    s.size = plane_hold(&s.force, s.most);
    s.held = s.size > s.most;
    return s;
}

/* Change of a force with normalized creepages and ln(k_hat). */
static double follows(const plane_value *force, int i, const double change[3], double dlog_k) {
    const double *by = force->by_creepage[i];
    return by[0] * change[0] + by[1] * change[1] + by[2] * change[2] + force->by_log_k[i] * dlog_k;
}

void evaluate_in_plane(const creep_table *table, const force_element_parameters *p,
                       const force_element_input *in, force_element_output *out) {
    state_in_plane s = state_in_plane_of(table, p, in);
    const force_state *at = &s.at;
    const double *force = s.force.force, *l = s.creepage;
    int relaxed = p->relaxation_length > 0.0;
    double zeta0 = at->scales.saturation_creepage, sliding = at->kinetic * in->normal_load;
    double mean = p->semi_width * sqrt(table->plane->axes_ratio);
    set_kinematics(p, in, at, out);
    double k_margin = at->scales.k_hat - table->k_max;
    out->k_hat_margin = table->one_axis ? -1.0 : k_margin;
    int k_limited = out->k_hat_margin > 0.0;
    out->k_hat_limited = k_limited ? 1.0 : 0.0;
    out->force_margin = p->kinetic_friction * s.size - p->static_friction;
    out->force_limited = s.held ? 1.0 : 0.0;
    out->creep_force = sliding * force[0];
    out->wheel_torque = -p->radius * out->creep_force;
    out->lateral_force = sliding * force[1];
    out->spin_moment = sliding * mean * s.direction * force[2];
    out->normalized_creepage = at->x;
    out->traction_coefficient = at->kinetic * force[0];
    out->k_hat = at->k_hat;
    out->saturation_creepage = zeta0;
    out->process_zone_ratio = at->scales.process_zone_ratio;
    out->contact_temperature = at->temperature;

    /* The force along rolling by the acting creepage, by omega r through friction, by the speed
     * through the other creepages, and by the load. */
    double stretch[3] = {-l[0], -l[1], -l[2]}, k_by_g = k_limited ? 0.0 : -0.5;
    double by_log_g = force[0] + follows(&s.force, 0, stretch, k_by_g);
    double by_acting = sliding * s.force.by_creepage[0][0] * at->inverse_saturation;
    double through_g = sliding * by_log_g, by_rolling = through_g * at->log_g_by_rolling;
    double slower = -at->speed_slope * at->inverse_speed;     /* d(ln(1/reference))/d(speed) */
    double turned = at->inverse_speed + s.direction * slower; /* d(direction)/d(speed) */
    double at_speed[3] = {0.0, l[1] * slower,
                          l[2] * slower - s.per_spin * in->spin_velocity * turned};
    double growth = p->load_exponent / in->normal_load;
    double at_load[3] = {-l[0] * growth, -l[1] * growth, 0.0}; /* the width grows like zeta0 */
    double wider = s.slip.size > 0.0 ? s.slip.turning * s.slip.turning * growth / s.slip.size : 0.0;
    out->force_gradient = by_acting * at->inverse_speed + by_rolling;
    double slope = out->force_gradient * at->reference * zeta0 / sliding;
    out->falling_margin = slope == 0.0 ? -1.0 : -slope;
    out->falling_branch = slope < 0.0 ? 1.0 : 0.0;
    out->force_by_omega = p->radius * (relaxed ? by_rolling : out->force_gradient);
    out->force_by_speed = (relaxed ? 0.0 : by_acting * out->creepage_by_speed) +
                          through_g * at->log_g_by_speed +
                          sliding * follows(&s.force, 0, at_speed, 0.0);
    double log_g_by_load = at->log_g_by_log_load / in->normal_load + s.fall.by_slip * wider;
    out->force_by_load = at->kinetic * force[0] + through_g * log_g_by_load +
                         sliding * follows(&s.force, 0, at_load, k_limited ? 0.0 : -growth);
    out->force_by_relaxed = relaxed ? by_acting : 0.0;
    relaxation_rate(p, in, at->slip, zeta0, at->log_g_by_rolling, at->log_g_by_speed, out);
}

#ifndef ONE_FILE_KERNEL
#include "checked_file.h"

enum { PLANE_VERSION = 1, PLANE_NUMBERS = 5 };

/* The frame is followed by stiffness ratio, softening across, b/a, spin arm, slip spread and, if
 * the contact knows spin, one set of coefficients. */
const char *plane_contact_open(plane_contact *contact, const void *bytes, size_t size) {
    const char *error = checked_file_error(bytes, size, "PLANECON", PLANE_VERSION);
    if (error != NULL) return error;
    const double *number = (const double *)(const void *)((const char *)bytes + CHECKED_FILE_FRAME);
    size_t count = (size - CHECKED_FILE_FRAME) / sizeof *number;
    if (size % sizeof *number != 0 ||
        (count != PLANE_NUMBERS && count != PLANE_NUMBERS + PLANE_COEFFICIENTS))
        return "the number of values is not that of a contact";
    for (size_t i = 0; i < count; i++)
        if (!(fabs(number[i]) <= 1e6)) return "a number is not finite or beyond 1e6";
    if (!(number[0] >= 1e-3 && number[1] >= -0.5 && number[1] <= 0.5 && number[2] >= 0.0))
        return "the contact's shape is out of range";
    int spins = count > PLANE_NUMBERS;
    *contact = (plane_contact){
        .shape = {.stiffness_ratio = number[0],
                  .softening_y = number[1],
                  .coefficients = spins ? number + PLANE_NUMBERS : NULL,
                  .share = {1.0},
                  .sets = spins},
        .axes_ratio = number[2],
        .spin_arm = spins ? number[3] : 0.0,
        .slip_spread = spins ? number[4] : 0.0,
    };
    return NULL;
}

/* Without load or friction: the force that begins is that of a patch that slides all over. */
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

/* See relaxation.h; the saturation creepage changes along, too. */
static double relaxation_change(const force_element_parameters *p, const force_element_input *in,
                                const force_element_output *out, const force_element_input *din,
                                double dlog_zeta0) {
    double slip = slip_of(p, in), zeta = in->relaxed_creepage, length = p->relaxation_length;
    double dslip = p->radius * din->omega - din->speed, dzeta = din->relaxed_creepage;
    double zeta0 = out->saturation_creepage, limit = sliding_limit(zeta0), dlog_length = 0.0;
    double decay = fabs(in->speed), ddecay = direction_of(in->speed) * din->speed;
    if (fabs(zeta) > limit) {
        double dlog_limit = limit == zeta0 ? dlog_zeta0 : 0.0;
        decay = sliding_decay(slip, in->speed, limit);
        if (decay > fabs(in->speed)) ddecay = decay * (dslip / slip - dlog_limit);
        length *= limit / fabs(zeta);
        dlog_length = dlog_limit - dzeta / zeta;
    }
    return (dslip - ddecay * zeta - decay * dzeta) / length - out->relaxation_rate * dlog_length;
}

void force_element_tangent(const creep_table *table, const force_element_parameters *p,
                           const force_element_input *in, const force_element_output *out,
                           const force_element_input *din, force_element_output *dout) {
    static const plane_contact NO_CONTACT = {.shape = {.stiffness_ratio = 1.0}};
    int relaxed = p->relaxation_length > 0.0, grips = can_grip(p, in);
    double dlog_zeta0 = 0.0, drolling = p->radius * din->omega;
    dout->creep_force = dout->lateral_force = dout->spin_moment = dout->traction_coefficient = 0.0;
    dout->creepage = out->creepage_by_omega * din->omega + out->creepage_by_speed * din->speed;
    if (!grips) begin_to_grip(table, p, in, din, dout);
    if (grips) {
        creep_table along = *table;
        if (table->plane == NULL) along.plane = &NO_CONTACT;
        force_element_parameters there = force_element_at_load(p, in->normal_load);
        state_in_plane s = state_in_plane_of(&along, &there, in);
        const plane_contact *plane = along.plane;
        const friction_fall *g = &s.fall;
        const double *force = s.force.force, *l = s.creepage;
        double dlog_width = p->load_exponent * din->normal_load / in->normal_load;
        double dlog_friction = din->friction_scale / in->friction_scale;
        double spread = plane->slip_spread * there.semi_width;
        double dturning = s.slip.turning * dlog_width + spread * din->spin_velocity, dslip = 0.0;
        if (s.slip.size > 0.0)
            dslip = (s.slip.along * (drolling - din->speed) -
                     s.slip.across * din->lateral_velocity + s.slip.turning * dturning) /
                    s.slip.size;
        double by_log_friction = g->by_log_heating + g->by_log_zeta0 - 0.5 * g->by_log_k;
        double dlog_kinetic = dlog_friction * (1.0 + by_log_friction) + g->by_slip * dslip +
                              g->by_rolling * drolling + g->by_speed * din->speed +
                              s.at.log_g_by_log_load * din->normal_load / in->normal_load;
        dlog_zeta0 = dlog_kinetic + dlog_width;
        double dlog_k = out->k_hat_limited > 0.0 ? 0.0 : -0.5 * dlog_kinetic - dlog_width;
        double slower = -s.at.speed_slope * din->speed * s.at.inverse_speed;
        double turned = din->speed * s.at.inverse_speed + s.direction * slower;
        double dacting = relaxed ? din->relaxed_creepage : dout->creepage;
        double dl[3] = {
            dacting * s.at.inverse_saturation - l[0] * dlog_zeta0,
            l[1] * (slower - dlog_zeta0) -
                plane->shape.stiffness_ratio * s.per_velocity * din->lateral_velocity,
            l[2] * (slower - dlog_kinetic) -
                s.per_spin * (din->spin_velocity * s.direction + in->spin_velocity * turned)};
        double kinetic = s.at.kinetic, load = in->normal_load, dforce[3];
        for (int i = 0; i < 3; i++) /* over the sliding force */
            dforce[i] = force[i] * dlog_kinetic + follows(&s.force, i, dl, dlog_k);
        double mean = there.semi_width * sqrt(plane->axes_ratio), sliding = kinetic * load;
        double growing = din->normal_load * kinetic;
        dout->traction_coefficient = kinetic * dforce[0];
        dout->creep_force = sliding * dforce[0] + growing * force[0];
        dout->lateral_force = sliding * dforce[1] + growing * force[1];
        dout->spin_moment = mean * (s.direction * (sliding * dforce[2] + growing * force[2]) +
                                    sliding * force[2] * (s.direction * dlog_width + turned));
    }
    dout->wheel_torque = -p->radius * dout->creep_force;
    dout->relaxation_rate = relaxed ? relaxation_change(p, in, out, din, dlog_zeta0) : 0.0;
}
#endif /* ONE_FILE_KERNEL */
