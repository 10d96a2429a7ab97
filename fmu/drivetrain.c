#include "drivetrain.h"

#include <math.h>

#include "rosenbrock.h"

/* Where a state stands in the equations; -1 if it is none of this drivetrain's. */
typedef struct {
    int speed, left, right, twist, relaxed_left, relaxed_right, torque;
    int distance, drive, creep, resistance, loss;
} places;

typedef struct {
    const creep_table *table;
    const force_element_parameters *contact;
    const drivetrain_parameters *drivetrain;
    const drivetrain_input *input;
    places at;
    double saturation_left, saturation_right; /* creepages at the start of the substep */
} motion;

static equations arrange(motion *m) {
    int elastic = m->drivetrain->axle_stiffness > 0.0, n = 2;
    places *at = &m->at;
    at->speed = 0;
    at->left = 1;
    at->right = elastic ? n++ : 1;
    at->twist = elastic ? n++ : -1;
    int relaxed = m->contact->relaxation_length > 0.0;
    at->relaxed_left = relaxed ? n++ : -1;
    at->relaxed_right = relaxed ? n++ : -1;
    at->torque = m->drivetrain->motor_lag > 0.0 ? n++ : -1;
    equations problem = {.states = n};
    at->distance = n++;
    at->drive = n++;
    at->creep = n++;
    at->resistance = n++;
    at->loss = n++;
    problem.rows = n;
    problem.model = m;
    return problem;
}

static double pick(const double *y, int place, double otherwise) {
    return place < 0 ? otherwise : y[place];
}

static drivetrain_state unpack(const motion *m, const double *y) {
    const places *at = &m->at;
    return (drivetrain_state){
        .speed = y[at->speed],
        .omega_left = y[at->left],
        .omega_right = y[at->right],
        .twist = pick(y, at->twist, 0.0),
        .relaxed_left = pick(y, at->relaxed_left, 0.0),
        .relaxed_right = pick(y, at->relaxed_right, 0.0),
        .drive_torque = pick(y, at->torque, m->input->commanded_torque),
        .distance = y[at->distance],
        .drive_work = y[at->drive],
        .creep_work = y[at->creep],
        .resistance_work = y[at->resistance],
        .loss_work = y[at->loss],
    };
}

static void pack(const motion *m, const drivetrain_state *s, double *y) {
    const places *at = &m->at;
    y[at->speed] = s->speed;
    y[at->right] = s->omega_right;
    y[at->left] = s->omega_left;
    if (at->twist >= 0) y[at->twist] = s->twist;
    if (at->relaxed_left >= 0) y[at->relaxed_left] = s->relaxed_left;
    if (at->relaxed_right >= 0) y[at->relaxed_right] = s->relaxed_right;
    if (at->torque >= 0) y[at->torque] = s->drive_torque;
    y[at->distance] = s->distance;
    y[at->drive] = s->drive_work;
    y[at->creep] = s->creep_work;
    y[at->resistance] = s->resistance_work;
    y[at->loss] = s->loss_work;
}

/* One wheel: half of what the wheelset's contact gives under twice the wheel's load. */
static void wheel(const motion *m, double omega, double speed, double load, double friction,
                  double relaxed, force_element_output *out) {
    force_element_input in = {omega, speed, 2.0 * load, friction, relaxed};
    force_element_evaluate(m->table, m->contact, &in, out);
    out->creep_force *= 0.5;
    out->force_by_omega *= 0.5;
    out->force_by_speed *= 0.5;
    out->force_by_relaxed *= 0.5;
}

static void wheels(const motion *m, const drivetrain_state *s, force_element_output out[2]) {
    const drivetrain_input *in = m->input;
    wheel(m, s->omega_left, s->speed, in->load_left, in->friction_left, s->relaxed_left, &out[0]);
    if (s->omega_left == s->omega_right && s->relaxed_left == s->relaxed_right &&
        in->load_left == in->load_right && in->friction_left == in->friction_right) {
        out[1] = out[0];
        return;
    }
    wheel(m, s->omega_right, s->speed, in->load_right, in->friction_right, s->relaxed_right,
          &out[1]);
}

/* What both wheels together do to a rigid wheelset. */
static force_element_output together(const force_element_output out[2]) {
    return (force_element_output){
        .creep_force = out[0].creep_force + out[1].creep_force,
        .force_by_omega = out[0].force_by_omega + out[1].force_by_omega,
        .force_by_speed = out[0].force_by_speed + out[1].force_by_speed,
    };
}

/* J/2 d(omega)/dt = share T - r Q - b/2 omega -+ (k twist + d d(twist)/dt) */
static void elastic_axle(const motion *m, const drivetrain_state *s,
                         const force_element_output out[2], double *f, double (*j)[MOST_STATES]) {
    const drivetrain_parameters *p = m->drivetrain;
    const places *at = &m->at;
    double r = p->body.radius, half = 0.5 * p->body.inertia, b = 0.5 * p->body.damping;
    double omega[2] = {s->omega_left, s->omega_right}, difference = omega[0] - omega[1];
    double axle = p->axle_stiffness * s->twist + p->axle_damping * difference;
    int place[2] = {at->left, at->right}, relaxed[2] = {at->relaxed_left, at->relaxed_right};
    f[at->twist] = difference;
    for (int i = 0; i < 2; i++) {
        double sign = i == 0 ? 1.0 : -1.0, share = i == 0 ? p->drive_share : 1.0 - p->drive_share;
        f[place[i]] =
            (share * s->drive_torque - r * out[i].creep_force - b * omega[i] - sign * axle) / half;
        if (!j) continue;
        double *row = j[place[i]];
        row[at->speed] = -r * out[i].force_by_speed / half;
        row[place[i]] = -(r * out[i].force_by_omega + b + p->axle_damping) / half;
        row[place[1 - i]] = p->axle_damping / half;
        row[at->twist] = -sign * p->axle_stiffness / half;
        if (relaxed[i] >= 0) row[relaxed[i]] = -r * out[i].force_by_relaxed / half;
        if (at->torque >= 0) row[at->torque] = share / half;
        j[at->twist][place[i]] = sign;
    }
}

/* Powers of drive, creep, resistance and damping. */
static void powers(const motion *m, const drivetrain_state *s, const force_element_output out[2],
                   const wheelset_rates *rates, double *f, double (*j)[MOST_STATES]) {
    const drivetrain_parameters *p = m->drivetrain;
    const places *at = &m->at;
    double r = p->body.radius, b = 0.5 * p->body.damping, v = s->speed;
    double omega[2] = {s->omega_left, s->omega_right}, difference = omega[0] - omega[1];
    double share[2] = {p->drive_share, 1.0 - p->drive_share};
    int place[2] = {at->left, at->right}, relaxed[2] = {at->relaxed_left, at->relaxed_right};
    double force = out[0].creep_force + out[1].creep_force;
    double by_speed = out[0].force_by_speed + out[1].force_by_speed;
    int held = p->body.inverse_mass == 0.0;
    double resisting = held ? force : rates->resistance + m->input->resistance_force;
    double rolling = share[0] * omega[0] + share[1] * omega[1];
    f[at->distance] = v;
    f[at->drive] = s->drive_torque * rolling;
    f[at->creep] =
        out[0].creep_force * (r * omega[0] - v) + out[1].creep_force * (r * omega[1] - v);
    f[at->resistance] = resisting * v;
    f[at->loss] =
        b * (omega[0] * omega[0] + omega[1] * omega[1]) + p->axle_damping * difference * difference;
    if (!j) return;
    j[at->distance][at->speed] = 1.0;
    j[at->creep][at->speed] = -force;
    if (at->torque >= 0) j[at->drive][at->torque] = rolling;
    double steepness = held ? by_speed : rates->resistance_slope;
    j[at->resistance][at->speed] = resisting + v * steepness;
    for (int i = 0; i < 2; i++) {
        double slip = r * omega[i] - v, sign = i == 0 ? 1.0 : -1.0;
        j[at->drive][place[i]] += s->drive_torque * share[i];
        j[at->creep][at->speed] += slip * out[i].force_by_speed;
        j[at->creep][place[i]] += slip * out[i].force_by_omega + r * out[i].creep_force;
        j[at->loss][place[i]] += 2.0 * b * omega[i] + 2.0 * sign * p->axle_damping * difference;
        if (held) j[at->resistance][place[i]] += v * out[i].force_by_omega;
        if (relaxed[i] < 0) continue;
        j[at->creep][relaxed[i]] = slip * out[i].force_by_relaxed;
        if (held) j[at->resistance][relaxed[i]] = v * out[i].force_by_relaxed;
    }
}

static void evaluate(void *model, const double *y, double *f, double (*j)[MOST_STATES]) {
    motion *m = model;
    const drivetrain_parameters *p = m->drivetrain;
    const places *at = &m->at;
    drivetrain_state s = unpack(m, y);
    force_element_output out[2];
    wheelset_rates rates;
    wheels(m, &s, out);
    force_element_output sum = together(out);
    wheelset_motion(&p->body, s.omega_left, s.speed, s.drive_torque, m->input->resistance_force,
                    &sum, &rates);
    if (j)
        for (int i = 0; i < MOST_ROWS; i++)
            for (int k = 0; k < MOST_STATES; k++) j[i][k] = 0.0;
    f[at->speed] = p->body.inverse_mass > 0.0 ? rates.speed_rate : m->input->acceleration;
    int relaxed[2] = {at->relaxed_left, at->relaxed_right}, place[2] = {at->left, at->right};
    if (at->twist >= 0) {
        elastic_axle(m, &s, out, f, j);
    } else {
        f[at->left] = rates.omega_rate;
    }
    if (at->torque >= 0)
        f[at->torque] = (m->input->commanded_torque - s.drive_torque) / p->motor_lag;
    for (int i = 0; i < 2; i++)
        if (relaxed[i] >= 0) f[relaxed[i]] = out[i].relaxation_rate;
    powers(m, &s, out, &rates, f, j);
    if (!j) return;

    m->saturation_left = out[0].saturation_creepage > 0.0 ? out[0].saturation_creepage : 1.0;
    m->saturation_right = out[1].saturation_creepage > 0.0 ? out[1].saturation_creepage : 1.0;
    j[at->speed][at->speed] = rates.jacobian[1][1];
    if (at->twist < 0) {
        j[at->left][at->left] = rates.jacobian[0][0];
        j[at->left][at->speed] = rates.jacobian[0][1];
        if (at->torque >= 0) j[at->left][at->torque] = 1.0 / p->body.inertia;
    }
    for (int i = 0; i < 2; i++) {
        j[at->speed][place[i]] += out[i].force_by_omega * p->body.inverse_mass;
        if (relaxed[i] < 0) continue;
        j[at->speed][relaxed[i]] = out[i].force_by_relaxed * p->body.inverse_mass;
        if (at->twist < 0)
            j[at->left][relaxed[i]] = -p->body.radius * out[i].force_by_relaxed / p->body.inertia;
        j[relaxed[i]][place[i]] = out[i].rate_by_omega;
        j[relaxed[i]][at->speed] = out[i].rate_by_speed;
        j[relaxed[i]][relaxed[i]] = out[i].rate_by_relaxed;
    }
    if (at->torque >= 0) j[at->torque][at->torque] = -1.0 / p->motor_lag;
}

/* Slips relative to themselves plus that of saturation, speed to itself plus the minimum speed,
 * torques to themselves plus that of kinetic friction. */
static double error_size(const void *model, const double *y, const double *error) {
    const motion *m = model;
    const drivetrain_parameters *p = m->drivetrain;
    const places *at = &m->at;
    double r = p->body.radius, speed = fabs(y[at->speed]) + p->body.minimum_speed;
    double saturation[2] = {m->saturation_left, m->saturation_right};
    int place[2] = {at->left, at->right}, relaxed[2] = {at->relaxed_left, at->relaxed_right};
    double size = fabs(error[at->speed]) / speed;
    for (int i = 0; i < 2; i++) {
        double slip = fabs(r * y[place[i]] - y[at->speed]);
        size += fabs(r * error[place[i]] - error[at->speed]) / (slip + saturation[i] * speed);
        if (relaxed[i] >= 0)
            size += fabs(error[relaxed[i]]) / (fabs(y[relaxed[i]]) + saturation[i]);
    }
    double torque = r * m->contact->kinetic_friction * m->contact->nominal_load;
    if (at->twist >= 0)
        size += fabs(error[at->twist]) / (fabs(y[at->twist]) + torque / p->axle_stiffness);
    if (at->torque >= 0) size += fabs(error[at->torque]) / (fabs(y[at->torque]) + torque);
    return size;
}

/* Step one on, from one corner of friction to the next. Returns NULL, or why it failed. */
static const char *advance(const drivetrain_member *member, drivetrain_input *input,
                           drivetrain_state *state, double time, double step, double tolerance,
                           double *substep) {
    drivetrain_input held = *input;
    drivetrain_state now = *state;
    motion m = {.table = member->table,
                .contact = member->contact,
                .drivetrain = member->drivetrain,
                .input = &held};
    equations problem = arrange(&m);
    problem.rates = evaluate;
    problem.error_size = error_size;
    for (double left = step; left > 0.0;) {
        double part = left;
        if (member->rails) {
            double until = track_until_change(member->rails, now.distance, now.speed, time);
            if (until < left * (1.0 - 1e-9)) part = until;
            double friction[2];
            track_friction(member->rails, now.distance + 0.5 * part * now.speed, time + 0.5 * part,
                           friction);
            held.friction_left = friction[0];
            held.friction_right = friction[1];
        }
        double y[MOST_ROWS];
        pack(&m, &now, y);
        const char *error = rosenbrock_advance(&problem, y, part, tolerance, substep);
        if (error) return error;
        now = unpack(&m, y);
        time += part;
        left = part < left ? left - part : 0.0;
    }
    *state = now;
    return NULL;
}

void drivetrain_advance_many(const drivetrain_member *members, size_t n, drivetrain_input *input,
                             drivetrain_state *state, double time, double step, double tolerance,
                             double *substep, unsigned char *failed) {
    for (size_t i = 0; i < n; i++) {
        if (members[i].rails) {
            double friction[2];
            track_friction(members[i].rails, state[i].distance, time, friction);
            input[i].friction_left = friction[0];
            input[i].friction_right = friction[1];
        }
        if (!failed[i])
            failed[i] = advance(&members[i], &input[i], &state[i], time, step, tolerance,
                                &substep[i]) != NULL;
    }
}

void drivetrain_evaluate_many(const drivetrain_member *members, size_t n, size_t rows,
                              const drivetrain_input *input, const drivetrain_state *state,
                              drivetrain_output *output) {
    for (size_t i = 0; i < n * rows; i++) {
        const drivetrain_member *member = &members[i % n];
        const drivetrain_parameters *p = member->drivetrain;
        const wheelset_parameters *body = &p->body;
        motion m = {.table = member->table,
                    .contact = member->contact,
                    .drivetrain = p,
                    .input = &input[i]};
        const drivetrain_state *s = &state[i];
        force_element_output out[2];
        wheelset_rates rates;
        wheels(&m, s, out);
        force_element_output sum = together(out);
        double torque = p->motor_lag > 0.0 ? s->drive_torque : input[i].commanded_torque;
        wheelset_motion(body, s->omega_left, s->speed, torque, input[i].resistance_force, &sum,
                        &rates);
        double difference = s->omega_left - s->omega_right;
        double kinetic = 0.25 * body->inertia *
                         (s->omega_left * s->omega_left + s->omega_right * s->omega_right);
        int held = body->inverse_mass == 0.0;
        if (!held) kinetic += 0.5 * s->speed * s->speed / body->inverse_mass;
        output[i] = (drivetrain_output){
            .creep_force_left = out[0].creep_force,
            .creep_force_right = out[1].creep_force,
            .creepage_left = out[0].creepage,
            .creepage_right = out[1].creepage,
            .falling_left = out[0].falling_branch,
            .falling_right = out[1].falling_branch,
            .drive_torque = torque,
            .axle_torque = p->axle_stiffness * s->twist + p->axle_damping * difference,
            .speed_rate = held ? input[i].acceleration : rates.speed_rate,
            .stored_energy = kinetic + 0.5 * p->axle_stiffness * s->twist * s->twist,
        };
    }
}
