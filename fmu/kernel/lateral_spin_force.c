#include "lateral_spin_element.h"

/* Changes of the rates as the semi-width and the lengths and stiffness of the memory change with
 * the load, by central differences. */
static void change_with_lengths(const creep_table *table, const force_element_parameters *there,
                                const force_element_input *in, const lateral_spin_force *s,
                                double log_load, double *change) {
    const double small = 1e-5;
    double rate[2][MEMORY_STATES];
    for (int i = 0; i < 2; i++) {
        force_element_parameters near = force_element_at_load(
            there, there->nominal_load * (i == 0 ? 1.0 + small : 1.0 - small));
        contact_scales scales = contact_scales_of(table, &near);
        force_state at = s->at;
        at.scales.relaxation_length = scales.relaxation_length;
        at.scales.lateral_relaxation_length = scales.lateral_relaxation_length;
        at.scales.standing_stiffness = scales.standing_stiffness;
        at.scales.initial_slope = scales.initial_slope;
        memory_point m = memory_at(2, &near, in, &at, s->creepage[1], s->law.force);
        memory_rates(2, &m, rate[i]);
    }
    double per = log_load / (2.0 * small);
    for (int i = 0; i < MEMORY_STATES; i++) change[i] += per * (rate[0][i] - rate[1][i]);
}

static creep_value table_at(const creep_table *table, const lateral_spin_start *start) {
    creep_value q;
    creep_table_evaluate(table, start->point, start->k_hat, start->layer, &q);
    return q;
}

void lateral_spin_force_evaluate(const creep_table *table, const force_element_parameters *p,
                                 const force_element_input *in, force_element_output *out) {
    lateral_spin_force s;
    lateral_spin_element_begin(table, p, in, &s);
    lateral_spin_element_finish(table, p, in, table_at(table, &s.start), &s, out);
}

#ifndef ONE_FILE_KERNEL
#include "checked_file.h"

enum { LATERAL_SPIN_VERSION = 1, LATERAL_SPIN_NUMBERS = 5 };

void lateral_spin_evaluate(const creep_table *table, const lateral_spin_shape *shape,
                           const double creepage[3], double k_hat, double layer_ratio,
                           lateral_spin_value *value) {
    lateral_spin_start at = lateral_spin_begin(shape, creepage, k_hat, layer_ratio);
    lateral_spin_finish(shape, creepage, k_hat, layer_ratio, at, table_at(table, &at), value);
}

/* After the frame come stiffness ratio, softening across rolling, b/a, spin arm, slip spread and,
 * for a contact with spin, one set of coefficients. */
const char *lateral_spin_contact_open(lateral_spin_contact *contact, const void *bytes,
                                      size_t size) {
    const double *number;
    size_t count;
    const char *error =
        checked_numbers(bytes, size, "PLANECON", LATERAL_SPIN_VERSION, 1e6, &number, &count);
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
    force_state at = begin_force(table, p, contact_scales_of(table, p), in, &fall, 0.0);
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
    dout->creep_force = dout->lateral_force = dout->spin_moment = dout->traction_coefficient = 0.0;
    memset(&dout->held_rate, 0, MEMORY_STATES * sizeof(double));
    dout->creepage = out->creepage_by_omega * din->omega + out->creepage_by_speed * din->speed;
    if (can_grip(p, in)) {
        creep_table any = *table;
        if (table->lateral_spin == NULL) any.lateral_spin = &NO_CONTACT;
        force_element_parameters there = force_element_at_load(p, in->normal_load);
        lateral_spin_force s;
        lateral_spin_element_begin(&any, &there, in, &s);
        lateral_spin_force_finish(&any, table_at(&any, &s.start), &s);
        const double *force = s.law.force, *scale = s.scale;
        lateral_spin_change d =
            change_of_forces(&there, any.lateral_spin->slip_spread, in, out, &s, din);
        double direction = direction_at(in, &s);
        double turned = (din->speed + in->speed * d.slower) * s.at.inverse_speed;
        dout->traction_coefficient = s.at.kinetic * (d.force[0] - force[0] * d.log_load);
        dout->creep_force = scale[0] * d.force[0];
        dout->lateral_force = scale[1] * d.force[1];
        dout->spin_moment =
            scale[2] * (direction * d.force[2] + force[2] * (direction * d.log_width + turned));
        if (remembers(p)) {
            memory_point m = memory_of(&there, in, &s);
            memory_direction to = memory_direction_of(&s, &m, &d, in, din);
            held_change h = change_of_held(2, &m, &to);
            memory_change(2, &m, BY_X, &to, &h, &dout->held_rate);
            if (d.log_load != 0.0)
                change_with_lengths(&any, &there, in, &s, d.log_load, &dout->held_rate);
            dout->creep_force = h.acting[0][0] + h.acting[1][0];
            dout->lateral_force = h.acting[0][1] + h.acting[1][1];
            dout->traction_coefficient =
                (dout->creep_force - (m.acting[0][0] + m.acting[1][0]) * d.log_load) /
                in->normal_load;
        }
    } else {
        if (!remembers(p)) begin_to_grip(table, p, in, din, dout);
        for (int i = 0; remembers(p) && i < MEMORY_STATES; i++)
            (&dout->held_rate)[i] = -RELEASE * (&din->memory.held_force)[i];
    }
    dout->wheel_torque = -p->radius * dout->creep_force;
}
#endif /* ONE_FILE_KERNEL */
