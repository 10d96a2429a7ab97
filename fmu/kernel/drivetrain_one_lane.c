/* Stepping and evaluating drivetrains one after another. For a few of them this is quicker, as a
 * lane that stays idle costs as much as any other. */
#define LANES 1
#define WIDE_SUFFIX one_lane
#include "drivetrains.inc"

void drivetrains_prepare(drivetrain_member *members, size_t n) {
    for (size_t i = 0; i < n; i++) {
        drivetrain_member *m = &members[i];
        const force_element_parameters *p = m->contact;
        if (i > 0 && m->table == m[-1].table && memcmp(p, m[-1].contact, sizeof *p) == 0) {
            m->scales = m[-1].scales;
            m->shape = m[-1].shape;
            continue;
        }
        m->scales = contact_scales_of(m->table, p);
        if (remembers(p)) m->shape = shape_of(p);
    }
}

void drivetrains_settle(const drivetrain_member *members, size_t n, const drivetrain_input *input,
                        drivetrain_state *state) {
    for (size_t i = 0; i < n; i++) {
        drivetrain_output output;
        force_element_output contact[2];
        drivetrains_evaluate_one_lane(&members[i], 1, 1, &input[i], &state[i], &output, contact);
        state[i].left = settled(&contact[0]);
        state[i].right = settled(&contact[1]);
    }
}

void vehicles_settle(const drivetrain_member *members, size_t n, size_t axles, vehicle *vehicles,
                     const drivetrain_input *input, const drivetrain_state *state,
                     const drivetrain_output *output) {
    for (size_t k = 0; k < n; k += axles) {
        vehicle *v = &vehicles[k / axles];
        vehicle_forces forces = {.towed_force = 0.0};
        double load[MAX_AXLES];
        for (size_t i = 0; i < axles; i++) {
            const drivetrain_input *in = &input[k + i];
            const drivetrain_state *now = &state[k + i];
            const drivetrain_output *out = &output[k + i];
            wheelset_parameters body = on_grade(&members[k + i].drivetrain->body, in->grade);
            double force = out->creep_force_left + out->creep_force_right;
            double omega = 0.5 * (now->omega_left + now->omega_right);
            forces.creep_force[i] = force;
            forces.radius[i] = body.radius;
            forces.towed_force += in->resistance_force;
            double torque = out->drive_torque;
            if (members[k + i].drivetrain->shaft_stiffness > 0.0)
                torque += out->shaft_torque - now->drive_torque;
            forces.omega_rate[i] =
                (torque - body.radius * force - body.damping * omega) / body.inertia;
            forces.acceleration += (out->speed_rate + body.grade_acceleration) / (double)axles;
            double per_way = 1.0 / larger(fabs(now->speed), body.minimum_speed);
            axle_state fresh = {.load = in->load_left + in->load_right,
                                .commanded_torque = in->commanded_torque,
                                .interval = interval_at(v, now->distance)};
            double slip[2] = {body.radius * now->omega_left - now->speed,
                              body.radius * now->omega_right - now->speed};
            fresh.own_left = larger(out->creep_force_left * slip[0], 0.0) * per_way;
            fresh.own_right = larger(out->creep_force_right * slip[1], 0.0) * per_way;
            v->axle[i] = fresh;
        }
        if (v->body) loads_by_statics(v->body, &forces, load);
        for (size_t i = 0; v->body && i < axles; i++) v->axle[i].load = v->axle[i].target = load[i];
    }
}

void vehicle_loads(const vehicle_parameters *body, size_t n, const vehicle_forces *forces,
                   double (*load)[MAX_AXLES]) {
    for (size_t i = 0; i < n; i++) loads_by_statics(body, &forces[i], load[i]);
}
