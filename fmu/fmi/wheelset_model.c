/* The models "wheelset" and "wheelset_body", which has no contact of its own. */
#include "memory.h"
#include "model_functions.h"
#include "wheelset_law.h"
#include "wheelset_step.h"

static wheelset_parameters body_of(const model_values *v) {
    wheelset_parameters body = v->body;
    body.radius = v->contact.radius;
    body.minimum_speed = v->contact.minimum_speed;
    return body;
}

static braking braking_now(const model_values *v) {
    return braking_under(v->brake_torque, v->contact.radius, v->input.omega, v->pads);
}

void evaluate_body(const creep_table *table, model_values *values, size_t n) {
    (void)table;
    for (model_values *v = values; v < values + n; v++) {
        wheelset_parameters body = body_of(v);
        braking b = braking_now(v);
        double torque = v->drive_torque - v->brake_torque * b.part;
        wheelset_motion(&body, v->input.omega, v->input.speed, torque, v->resistance_force,
                        &v->output, &v->rates);
        v->pads_rate = b.pads_rate;
    }
}

void evaluate_wheelset(const creep_table *table, model_values *values, size_t n) {
    evaluate_contacts(table, values, n);
    evaluate_body(table, values, n);
}

/* Change of the rates, from that of the creep force. */
static void follow_motion(const model_values *v, const model_values *direction, double dforce,
                          model_values *change) {
    const force_element_input *din = &direction->input;
    braking b = braking_now(v);
    double dpart = b.by_omega * din->omega + b.by_pads * direction->pads;
    double dtorque =
        direction->drive_torque - direction->brake_torque * b.part - v->brake_torque * dpart;
    change->rates.omega_rate =
        (dtorque - v->contact.radius * dforce - v->body.damping * din->omega) / v->body.inertia;
    change->pads_rate = b.rate_by_omega * din->omega + b.rate_by_pads * direction->pads;
    change->rates.speed_rate =
        (dforce - v->rates.resistance_slope * din->speed - direction->resistance_force) *
        v->body.inverse_mass;
}

void tangent_wheelset(const creep_table *table, const model_values *v,
                      const model_values *direction, model_values *change) {
    force_element_tangent(table, &v->contact, &v->input, &v->output, &direction->input,
                          &change->output);
    follow_motion(v, direction, change->output.creep_force, change);
}

void tangent_body(const creep_table *table, const model_values *v, const model_values *direction,
                  model_values *change) {
    (void)table;
    follow_motion(v, direction, direction->output.creep_force, change); /* an input here */
}

static wheelset_task task_of(const model_values *v, const wheelset_parameters *body,
                             double tolerance) {
    return (wheelset_task){.contact = &v->contact,
                           .body = body,
                           .drive_torque = v->drive_torque,
                           .resistance_force = v->resistance_force,
                           .brake_torque = v->brake_torque,
                           .pads = v->pads,
                           .input = v->input,
                           .tolerance = tolerance,
                           .substep = v->substep,
                           .max_substeps = v->max_substeps};
}

static void take_state(model_values *v, const wheelset_task *task) {
    v->substep = task->substep;
    v->held_tolerance = task->tolerance;
    v->input.omega = task->input.omega;
    v->input.speed = task->input.speed;
    v->pads = task->pads;
    take_memory(&v->input, &task->input);
}

const char *advance_wheelset(const creep_table *table, model_values *values, size_t n, double step,
                             double tolerance, size_t *failed) {
    wheelset_task tasks[MAX_WHEELS];
    wheelset_parameters bodies[MAX_WHEELS];
    for (size_t i = 0; i < n; i++) {
        bodies[i] = body_of(&values[i]);
        tasks[i] = task_of(&values[i], &bodies[i], tolerance);
    }
    const char *error = wheelsets_advance(table, tasks, n, step, failed);
    if (error != NULL) values[*failed].substep = tasks[*failed].substep;
    for (size_t i = 0; i < n && error == NULL; i++) take_state(&values[i], &tasks[i]);
    return error;
}

/* The same equations with an unloaded contact; torque and resistance contain the held creep force.
 */
const char *advance_body(const creep_table *table, model_values *v, size_t n, double step,
                         double tolerance, size_t *failed) {
    (void)table, (void)n, (void)failed;
    static const creep_table none = {.k_max = 1.0};
    force_element_parameters contact = {.radius = v->contact.radius,
                                        .kinetic_friction = 1.0,
                                        .static_friction = 1.0,
                                        .slip_rate_residual = 1.0,
                                        .minimum_speed = v->contact.minimum_speed};
    wheelset_parameters body = body_of(v);
    wheelset_task task = task_of(v, &body, tolerance);
    task.contact = &contact;
    task.drive_torque -= contact.radius * v->output.creep_force;
    task.resistance_force -= v->output.creep_force;
    task.input.normal_load = 0.0;
    task.input.friction_scale = 1.0;
    const char *error = wheelset_advance(&none, &task, step);
    v->substep = task.substep;
    if (error == NULL) take_state(v, &task);
    return error;
}
