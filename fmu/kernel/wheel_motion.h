/* The equations of motion of LANES wheelsets and of the memory of their contacts. */
#ifndef WHEEL_MOTION_H
#define WHEEL_MOTION_H

#include "contact_lanes.h"
#include "rosenbrock.h"
#include "wheelset_law.h"
#include "wheelset_step.h"

/* From this number of substeps on a coarser tolerance is held. */
enum { MANY_SUBSTEPS = 40000 };

/* Row of the brake's pads, behind omega, speed and memory. */
enum { PADS = 2 + MEMORY_STATES };

/* The equations and everything that is held over a step. */
typedef struct {
    contacts contact;
    int prescribed; /* 1 if the velocities are, so that only the memory has equations */
    lanes body[FIELDS(wheelset_parameters)];
    int braked; /* 1 if a brake is on in any lane */
    lanes drive_torque, resistance_force, brake_torque, omega_rate;
    lanes saturation; /* creepage at the start of the substep */
} motion;

/* Number of states of the memory that change. */
static inline int memory_states_of(const motion *m) {
    if (!remembers(m->contact.given[0])) return 0;
    return m->contact.table->lateral_spin != NULL ? MEMORY_STATES : LATERAL;
}

/* Set the rates of the velocities and their rows of the Jacobian. */
ALWAYS_INLINE void set_motion(motion *m, rows y, rows f, matrix *jacobian) {
    lanes *out = m->contact.out;
    const double free = m->prescribed ? 0.0 : 1.0;
    EACH_LANE (l) {
        TAKE(wheelset_parameters, body, m->body);
        contact_action action = {OUTPUT_OF(creep_force)[l], OUTPUT_OF(force_by_omega)[l],
                                 OUTPUT_OF(force_by_speed)[l]};
        wheelset_rates rates = motion_rates(&body, y[0][l], y[1][l], m->drive_torque[l],
                                            m->resistance_force[l], action);
        f[0][l] = free > 0.0 ? rates.omega_rate : m->omega_rate[l];
        f[1][l] = rates.speed_rate;
        if (!jacobian) continue;
        /* Without contact the equations are not stiff, and the slip's accuracy does not matter. */
        double saturation = OUTPUT_OF(saturation_creepage)[l];
        m->saturation[l] = saturation > 0.0 ? saturation : 1.0;
        lanes(*j)[MAX_STATES] = *jacobian;
        j[0][0][l] = free * rates.jacobian[0][0];
        j[0][1][l] = free * rates.jacobian[0][1];
        j[1][0][l] = rates.jacobian[1][0];
        j[1][1][l] = rates.jacobian[1][1];
        for (int i = 0; i < MEMORY_STATES; i++) {
            double by = (&OUTPUT_OF(force_by_memory))[i][l];
            j[0][2 + i][l] = free * (-body.radius * by / body.inertia);
            j[1][2 + i][l] = by * body.inverse_mass;
        }
    }
}

/* Add the brake's torque and its pads. */
static void set_brake(motion *m, rows y, rows f, matrix *jacobian) {
    for (int l = 0; l < LANES; l++) {
        TAKE(wheelset_parameters, body, m->body);
        double torque = m->brake_torque[l], pull = torque / body.inertia;
        braking b = braking_under(torque, body.radius, y[0][l], y[PADS][l]);
        f[0][l] -= pull * b.part;
        f[PADS][l] = b.pads_rate;
        if (!jacobian) continue;
        lanes(*j)[MAX_STATES] = *jacobian;
        for (int i = 0; i < PADS; i++) j[i][PADS][l] = j[PADS][i][l] = 0.0;
        j[0][0][l] -= pull * b.by_omega;
        j[0][PADS][l] = -pull * b.by_pads;
        j[PADS][0][l] = b.rate_by_omega;
        j[PADS][PADS][l] = b.rate_by_pads;
    }
}

/* Rows of y: omega, speed, the states of the memory, which are constant without it, those of a
 * lateral force behind the others, and the brake's pads. */
static void motion_rates_of(void *model, rows y, rows f, matrix *jacobian) {
    motion *m = (motion *)model;
    lanes *in = m->contact.in, *out = m->contact.out;
    const int memory_rows = memory_states_of(m);
    memcpy(INPUT(omega), y[0], sizeof(lanes));
    memcpy(INPUT(speed), y[1], sizeof(lanes));
    for (int i = 0; i < memory_rows; i++) memcpy((&INPUT(held_force))[i], y[2 + i], sizeof(lanes));
    if (jacobian) contacts_evaluate_motion(&m->contact);
    else contacts_evaluate_force(&m->contact);
    for (int i = 0; i < memory_rows; i++)
        memcpy(f[2 + i], (&OUTPUT_OF(held_rate))[i], sizeof(lanes));
    if (jacobian) set_motion(m, y, f, jacobian);
    else set_motion(m, y, f, NULL);
    for (int i = 0; jacobian && i < memory_rows; i++)
        memcpy((*jacobian)[2 + i], &OUTPUT_OF(memory_by) + (2 + MEMORY_STATES) * i,
               (2 + MEMORY_STATES) * sizeof(lanes));
    if (m->braked) set_brake(m, y, f, jacobian);
}

/* Of the memory alone. */
static void memory_error_size(void *model, rows y, rows error, lanes size) {
    const motion *m = (const motion *)model;
    for (int l = 0; l < LANES; l++) {
        double load = m->contact.in[PLACE(force_element_input, normal_load)][l];
        double held = fabs(y[2 + HELD][l]),
               wrong = fabs(error[2 + HELD][l]) + fabs(error[2 + OUTER][l]);
        if (memory_states_of(m) == MEMORY_STATES) {
            held += fabs(y[2 + HELD_LATERAL][l]);
            wrong += fabs(error[2 + HELD_LATERAL][l]) + fabs(error[2 + OUTER_LATERAL][l]);
        }
        size[l] =
            wrong / force_scale(m->contact.given[l], load, held) + fabs(error[2 + UNSLIPPED][l]);
    }
}

static void motion_error_size(void *model, rows y, rows error, lanes size) {
    motion *m = (motion *)model;
    memset(size, 0, sizeof(lanes));
    if (remembers(m->contact.given[0])) memory_error_size(model, y, error, size);
    EACH_LANE (l) {
        double radius = m->body[PLACE(wheelset_parameters, radius)][l];
        double floor = m->body[PLACE(wheelset_parameters, minimum_speed)][l];
        double slip = fabs(radius * y[0][l] - y[1][l]), speed = fabs(y[1][l]) + floor;
        double of_slip = fabs(radius * error[0][l] - error[1][l]);
        size[l] += of_slip / (slip + m->saturation[l] * speed) + fabs(error[1][l]) / speed;
    }
    for (int l = 0; m->braked && l < LANES; l++) {
        TAKE(force_element_parameters, contact, m->contact.there);
        double sliding = contact.radius * contact.kinetic_friction * contact.nominal_load;
        double torque = m->brake_torque[l];
        size[l] += torque * fabs(error[PADS][l]) / (torque + sliding);
    }
}

static inline equations motion_equations(motion *m) {
    int count = memory_states_of(m);
    equations wheelset = {2 + count,       2 + count,        1, {0, 1, 2, 3, 4, 5, 6}, m,
                          motion_rates_of, motion_error_size};
    if (m->braked) {
        wheelset.place[wheelset.states++] = PADS;
        wheelset.rows++;
    }
    equations memory = {1 + count,       1 + count,        1, {0, 2, 3, 4, 5, 6}, m,
                        motion_rates_of, memory_error_size};
    return m->prescribed ? memory : wheelset;
}

/* Load body, torque, resistance and state into a lane. */
static inline void load_motion(motion *m, rows y, int l, const wheelset_task *task) {
    wheelset_parameters body;
    memset(&body, 0, sizeof body);
    body.radius = task->contact->radius;
    body.inertia = 1.0;
    body.minimum_speed = task->contact->minimum_speed;
    m->prescribed = task->body == NULL;
    put(m->body, l, FIELDS(wheelset_parameters),
        (const double *)(m->prescribed ? &body : task->body));
    m->drive_torque[l] = task->drive_torque;
    m->resistance_force[l] = task->resistance_force;
    m->brake_torque[l] = task->brake_torque;
    m->braked |= task->brake_torque > 0.0;
    m->omega_rate[l] = task->omega_rate;
    y[0][l] = task->input.omega;
    y[1][l] = task->input.speed;
    force_element_input held = task->input;
    if (remembers(task->contact)) lose_excess(task->contact, &held);
    for (int i = 0; i < MEMORY_STATES; i++) y[2 + i][l] = (&held.held_force)[i];
    y[PADS][l] = task->pads;
}

/* A step that is long against the distance of an end of slip, or against the way that pads give,
 * may overshoot the part that is left. */
static inline void store_motion(rows y, int l, wheelset_task *task) {
    force_element_input *state = &task->input;
    state->omega = y[0][l];
    state->speed = y[1][l];
    for (int i = 0; i < MEMORY_STATES; i++) (&state->held_force)[i] = y[2 + i][l];
    state->unslipped = smaller(larger(state->unslipped, 0.0), 1.0);
    task->pads = smaller(larger(y[PADS][l], -1.0), 1.0);
}

#endif
