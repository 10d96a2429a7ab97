#include "wheelset_step.h"

#include <math.h>

#include "rosenbrock.h"

/* The equations of motion with everything that is held over a step. */
typedef struct {
    const creep_table *table;
    const force_element_parameters *contact;
    const wheelset_parameters *body;
    const wheelset_input *input;
    double saturation_creepage; /* at the start of the substep */
} motion;

static void evaluate(void *model, const double *y, double *f, double (*j)[MOST_STATES]) {
    motion *m = model;
    const wheelset_input *held = m->input;
    int relaxed = m->contact->relaxation_length > 0.0;
    force_element_input in = {y[0], y[1], held->normal_load, held->friction_scale,
                              relaxed ? y[2] : 0.0};
    force_element_output out;
    wheelset_rates rates;
    force_element_evaluate(m->table, m->contact, &in, &out);
    wheelset_motion(m->body, y[0], y[1], held->drive_torque, held->resistance_force, &out, &rates);
    f[0] = rates.omega_rate;
    f[1] = rates.speed_rate;
    f[2] = out.relaxation_rate;
    if (!j) return;
    /* Without contact nothing is stiff, and a slip of any size is as good as another. */
    m->saturation_creepage = out.saturation_creepage > 0.0 ? out.saturation_creepage : 1.0;
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++) j[i][k] = rates.jacobian[i][k];
    j[0][2] = -m->body->radius * out.force_by_relaxed / m->body->inertia;
    j[1][2] = out.force_by_relaxed * m->body->inverse_mass;
    j[2][0] = out.rate_by_omega;
    j[2][1] = out.rate_by_speed;
    j[2][2] = out.rate_by_relaxed;
}

static double error_size(const void *model, const double *y, const double *error) {
    const motion *m = model;
    double radius = m->body->radius, floor = m->body->minimum_speed;
    double slip = fabs(radius * y[0] - y[1]), speed = fabs(y[1]) + floor;
    double size = fabs(radius * error[0] - error[1]) / (slip + m->saturation_creepage * speed) +
                  fabs(error[1]) / speed;
    if (m->contact->relaxation_length > 0.0)
        size += fabs(error[2]) / (fabs(y[2]) + m->saturation_creepage);
    return size;
}

const char *wheelset_advance(const creep_table *table, const force_element_parameters *contact,
                             const wheelset_parameters *body, const wheelset_input *input,
                             wheelset_state *state, double step, double tolerance,
                             double *substep) {
    motion m = {table, contact, body, input, 1.0};
    int states = contact->relaxation_length > 0.0 ? 3 : 2;
    equations problem = {states, states, &m, evaluate, error_size};
    double y[MOST_ROWS] = {state->omega, state->speed, state->relaxed_creepage};
    const char *error = rosenbrock_advance(&problem, y, step, tolerance, substep);
    if (!error) *state = (wheelset_state){y[0], y[1], y[2]};
    return error;
}
