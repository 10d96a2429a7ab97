/* The equations of motion of LANES wheelsets and of the memory of their contacts. */
#ifndef WHEEL_MOTION_H
#define WHEEL_MOTION_H

#include "contact_lanes.h"
#include "rosenbrock.h"
#include "wheelset_law.h"
#include "wheelset_step.h"

/* From this number of substeps on a coarser tolerance is held. */
enum { MANY_SUBSTEPS = 40000 };

/* The equations and everything that is held over a step. */
typedef struct {
    contacts contact;
    int prescribed; /* 1 if the velocities are, so that only the memory has equations */
    lanes body[FIELDS(wheelset_parameters)];
    lanes drive_torque, resistance_force, omega_rate;
    lanes saturation; /* creepage at the start of the substep */
} motion;

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
        double by_traction = OUTPUT_OF(force_by_traction)[l];
        m->saturation[l] = saturation > 0.0 ? saturation : 1.0;
        lanes(*j)[MAX_STATES] = *jacobian;
        j[0][0][l] = free * rates.jacobian[0][0];
        j[0][1][l] = free * rates.jacobian[0][1];
        j[1][0][l] = rates.jacobian[1][0];
        j[1][1][l] = rates.jacobian[1][1];
        j[0][2][l] = free * (-body.radius * by_traction / body.inertia);
        j[1][2][l] = by_traction * body.inverse_mass;
        j[0][3][l] = j[1][3][l] = j[0][4][l] = j[1][4][l] = 0.0;
    }
}

/* Rows of y: omega, speed, held_traction, held_lateral, unslipped. The last three are constant
 * without memory. */
static void motion_rates_of(void *model, rows y, rows f, matrix *jacobian) {
    motion *m = (motion *)model;
    lanes *in = m->contact.in, *out = m->contact.out;
    const int memory_rows = remembers(m->contact.given[0]) ? 3 : 0;
    memcpy(INPUT(omega), y[0], sizeof(lanes));
    memcpy(INPUT(speed), y[1], sizeof(lanes));
    for (int i = 0; i < memory_rows; i++)
        memcpy((&INPUT(held_traction))[i], y[2 + i], sizeof(lanes));
    if (jacobian) contacts_evaluate_motion(&m->contact);
    else contacts_evaluate_force(&m->contact);
    for (int i = 0; i < memory_rows; i++)
        memcpy(f[2 + i], (&OUTPUT_OF(traction_rate))[i], sizeof(lanes));
    if (!jacobian) {
        set_motion(m, y, f, NULL);
        return;
    }
    set_motion(m, y, f, jacobian);
    for (int i = 0; i < memory_rows; i++)
        memcpy((*jacobian)[2 + i], &OUTPUT_OF(traction_by_omega) + 5 * i, 5 * sizeof(lanes));
}

/* Of the memory alone. */
static void memory_error_size(void *model, rows y, rows error, lanes size) {
    const motion *m = (const motion *)model;
    for (int l = 0; l < LANES; l++) {
        double traction = traction_scale(m->contact.given[l], fabs(y[2][l]) + fabs(y[3][l]));
        size[l] = (fabs(error[2][l]) + fabs(error[3][l])) / traction + fabs(error[4][l]);
    }
}

static void motion_error_size(void *model, rows y, rows error, lanes size) {
    const motion *m = (const motion *)model;
    memset(size, 0, sizeof(lanes));
    if (remembers(m->contact.given[0])) memory_error_size(model, y, error, size);
    EACH_LANE (l) {
        double radius = m->body[PLACE(wheelset_parameters, radius)][l];
        double floor = m->body[PLACE(wheelset_parameters, minimum_speed)][l];
        double slip = fabs(radius * y[0][l] - y[1][l]), speed = fabs(y[1][l]) + floor;
        double of_slip = fabs(radius * error[0][l] - error[1][l]);
        size[l] += of_slip / (slip + m->saturation[l] * speed) + fabs(error[1][l]) / speed;
    }
}

static inline equations motion_equations(motion *m) {
    equations wheelset = {2, 2, {0, 1, 2, 3, 4}, m, motion_rates_of, motion_error_size};
    equations memory = {4, 4, {0, 2, 3, 4}, m, motion_rates_of, memory_error_size};
    if (remembers(m->contact.given[0])) wheelset.states = wheelset.rows = 5;
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
    m->omega_rate[l] = task->omega_rate;
    y[0][l] = task->input.omega;
    y[1][l] = task->input.speed;
    y[2][l] = task->input.held_traction;
    y[3][l] = task->input.held_lateral;
    y[4][l] = task->input.unslipped;
}

/* A step that is long against the distance of an end of slip may overshoot the part that is left.
 */
static inline void store_motion(rows y, int l, force_element_input *state) {
    state->omega = y[0][l];
    state->speed = y[1][l];
    state->held_traction = y[2][l];
    state->held_lateral = y[3][l];
    state->unslipped = smaller(larger(y[4][l], 0.0), 1.0);
}

#endif
