#include "wheelset_step.h"

#include <math.h>
#include <string.h>

#define LANES 1
#include "memory.h"
#include "rosenbrock.h"

/* The equations of motion and everything that is held over a step. */
typedef struct {
    const creep_table *table;
    const force_element_parameters *contact;
    const wheelset_parameters *body;
    const wheelset_input *input;
    double saturation_creepage; /* at the start of the substep */
    double omega_rate;          /* prescribed, if the velocities are [rad/s2] */
} motion;

static void evaluate(void *model, rows y, rows f, matrix *jacobian) {
    motion *m = (motion *)model;
    const wheelset_input *held = m->input;
    force_element_input in = {
        y[0][0], y[1][0], held->normal_load,      held->friction_scale, y[2][0],
        y[3][0], y[4][0], held->lateral_velocity, held->spin_velocity};
    force_element_output out;
    wheelset_rates rates;
    force_element_evaluate(m->table, m->contact, &in, &out);
    wheelset_motion(m->body, in.omega, in.speed, held->drive_torque, held->resistance_force, &out,
                    &rates);
    f[0][0] = rates.omega_rate;
    f[1][0] = rates.speed_rate;
    f[2][0] = out.traction_rate;
    f[3][0] = out.lateral_rate;
    f[4][0] = out.unslipped_rate;
    if (!jacobian) return;
    /* Without contact the equations are not stiff, and the slip's accuracy does not matter. */
    m->saturation_creepage = out.saturation_creepage > 0.0 ? out.saturation_creepage : 1.0;
    lanes(*j)[MAX_STATES] = *jacobian;
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++) j[i][k][0] = rates.jacobian[i][k];
    j[0][2][0] = -m->body->radius * out.force_by_traction / m->body->inertia;
    j[1][2][0] = out.force_by_traction * m->body->inverse_mass;
    j[0][3][0] = j[1][3][0] = j[0][4][0] = j[1][4][0] = 0.0;
    const double *by = &out.traction_by_omega;
    for (int i = 2; i < 5; i++)
        for (int k = 0; k < 5; k++) j[i][k][0] = *by++;
}

/* Of the memory alone. */
static void memory_error_size(void *model, rows y, rows error, lanes size) {
    const motion *m = (const motion *)model;
    double traction = traction_scale(m->contact, fabs(y[2][0]) + fabs(y[3][0]));
    size[0] = (fabs(error[2][0]) + fabs(error[3][0])) / traction + fabs(error[4][0]);
}

static void error_size(void *model, rows y, rows error, lanes size) {
    const motion *m = (const motion *)model;
    double radius = m->body->radius, floor = m->body->minimum_speed;
    double slip = fabs(radius * y[0][0] - y[1][0]), speed = fabs(y[1][0]) + floor;
    double found =
        fabs(radius * error[0][0] - error[1][0]) / (slip + m->saturation_creepage * speed) +
        fabs(error[1][0]) / speed;
    size[0] = 0.0;
    if (remembers(m->contact)) memory_error_size(model, y, error, size);
    size[0] += found;
}

/* The tolerance of the next substep. A wheel that remembers swings at almost zero speed on its
 * contact almost undamped, at some 100 Hz, and resolving these oscillations over a long step would
 * need any number of substeps. With a coarse tolerance the method damps the oscillations and
 * preserves their mean, which is sufficient for such long steps. */
static double held_tolerance(double required, double count) {
    return count < 0.4 * MAX_SUBSTEPS   ? required
           : count < 0.6 * MAX_SUBSTEPS ? fmax(required, 1e-4)
           : count < 0.8 * MAX_SUBSTEPS ? fmax(required, 1e-2)
                                        : fmax(required, 1e-1);
}

/* A step that is long against the distance of an end of slip may overshoot the part that is left.
 */
static double between_zero_and_one(double part) { return smaller(larger(part, 0.0), 1.0); }

/* Advance a run by a step; see wheelset_advance. */
static const char *advance(const equations *problem, integration *run, double step,
                           double *tolerance, double *substep) {
    double held = *tolerance;
    run->left[0] = step;
    run->h[0] = *substep > 0.0 ? *substep : step;
    while (run->left[0] > 0.0) {
        if (run->count[0] >= MAX_SUBSTEPS) {
            *substep = step - run->left[0];
            return "the tolerance is not met within 100000 substeps";
        }
        held = held_tolerance(*tolerance, run->count[0]);
        rosenbrock_substep(problem, run, held);
    }
    *tolerance = held;
    *substep = run->h[0];
    return NULL;
}

const char *wheelset_advance(const creep_table *table, const force_element_parameters *contact,
                             const wheelset_parameters *body, const wheelset_input *input,
                             wheelset_state *state, double step, double *tolerance,
                             double *substep) {
    motion m = {table, contact, body, input, 1.0, 0.0};
    int states = remembers(contact) ? 5 : 2;
    equations problem = {states, states, {0, 1, 2, 3, 4}, &m, evaluate, error_size};
    integration run;
    memset(&run, 0, sizeof run);
    run.y[0][0] = state->omega;
    run.y[1][0] = state->speed;
    run.y[2][0] = state->held_traction;
    run.y[3][0] = state->held_lateral;
    run.y[4][0] = state->unslipped;
    const char *error = advance(&problem, &run, step, tolerance, substep);
    if (error != NULL) return error;
    state->omega = run.y[0][0];
    state->speed = run.y[1][0];
    state->held_traction = run.y[2][0];
    state->held_lateral = run.y[3][0];
    state->unslipped = between_zero_and_one(run.y[4][0]);
    return NULL;
}

/* The memory alone, at a prescribed angular acceleration. */
static void evaluate_prescribed(void *model, rows y, rows f, matrix *jacobian) {
    motion *m = (motion *)model;
    evaluate(model, y, f, jacobian);
    f[0][0] = m->omega_rate;
    if (!jacobian) return;
    lanes(*j)[MAX_STATES] = *jacobian;
    for (int k = 0; k < 5; k++) j[0][k][0] = 0.0;
}

/* Advance the memory while omega changes evenly to its end. */
static const char *advance_memory(const creep_table *table, const force_element_parameters *contact,
                                  force_element_input *input, double end, double step,
                                  double tolerance) {
    wheelset_parameters body;
    memset(&body, 0, sizeof body); /* the velocities are prescribed */
    body.radius = contact->radius;
    body.inertia = 1.0;
    body.minimum_speed = contact->minimum_speed;
    wheelset_input given = {0.0,
                            0.0,
                            input->normal_load,
                            input->friction_scale,
                            input->lateral_velocity,
                            input->spin_velocity};
    motion m = {table, contact, &body, &given, 1.0, (end - input->omega) / step};
    equations problem = {4, 4, {0, 2, 3, 4}, &m, evaluate_prescribed, memory_error_size};
    integration run;
    double substep = 0.0;
    memset(&run, 0, sizeof run);
    run.y[0][0] = input->omega;
    run.y[1][0] = input->speed;
    run.y[2][0] = input->held_traction;
    run.y[3][0] = input->held_lateral;
    run.y[4][0] = input->unslipped;
    const char *error = advance(&problem, &run, step, &tolerance, &substep);
    if (error != NULL) return error;
    input->omega = end;
    input->held_traction = run.y[2][0];
    input->held_lateral = run.y[3][0];
    input->unslipped = between_zero_and_one(run.y[4][0]);
    return NULL;
}

const char *force_element_advance(const creep_table *table, const force_element_parameters *contact,
                                  force_element_input *input, double step, double tolerance) {
    return advance_memory(table, contact, input, input->omega, step, tolerance);
}

#ifndef ONE_FILE_KERNEL
const char *force_element_roll(const creep_table *table, const force_element_parameters *contact,
                               double speed, double normal_load, double friction_scale, size_t n,
                               const double *creepage, const double *distance, double tolerance,
                               double *force) {
    force_element_input in;
    force_element_output out;
    memset(&in, 0, sizeof in);
    in.speed = speed;
    in.normal_load = normal_load;
    in.friction_scale = friction_scale;
    for (size_t i = 0; i < n; i++) {
        double omega = (1.0 + creepage[i]) * speed / contact->radius;
        if (i == 0) {
            in.omega = omega;
            force_element_evaluate(table, contact, &in, &out);
            in.held_traction = out.steady_traction;
            in.unslipped = out.sticking;
        } else {
            double step = (distance[i] - distance[i - 1]) / speed;
            const char *error = advance_memory(table, contact, &in, omega, step, tolerance);
            if (error != NULL) return error;
        }
        force[i] = in.held_traction * in.normal_load;
    }
    return NULL;
}
#endif /* ONE_FILE_KERNEL */
