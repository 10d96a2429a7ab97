/* The model "vehicle": the axles of one vehicle on its rails, each a wheelset of the values. */
#include <math.h>
#include <string.h>

#include "creep_curve.h"
#include "drivetrain.h"
#include "memory.h"
#include "model_functions.h"
#include "rails.h"
#include "vehicle_formula.h"
#include "wheelset_law.h"

/* What the kernel's functions of drivetrains take. */
typedef struct {
    drivetrain_member member[MAX_AXLES];
    drivetrain_parameters train[MAX_AXLES];
    track rails[MAX_AXLES];
    drivetrain_input input[MAX_AXLES];
    drivetrain_state state[MAX_AXLES];
    axle_state axle[MAX_AXLES];
    vehicle_parameters body;
    vehicle whole;
} drivetrains;

double inverse_mass_of_axle(const model_values *values) {
    return values->whole.body.axles / mass_of(&values->whole.body);
}

static void gather(const creep_table *table, const model_values *values, size_t n, drivetrains *d) {
    const whole_values *whole = &values->whole;
    double inverse_mass = inverse_mass_of_axle(values);
    double towed = whole->rear_coupler_force - whole->front_coupler_force;
    d->body = whole->body;
    d->whole = table->rails->cleaned;
    d->whole.body = &d->body;
    d->whole.axle = d->axle;
    for (size_t i = 0; i < n; i++) {
        const model_values *v = &values[i];
        const axle_values *axle = &v->axle;
        d->body.position[i] = axle->position;
        d->rails[i] = table->rails->factors;
        d->rails[i].scale = v->input.friction_scale;
        d->train[i] = (drivetrain_parameters){.body = v->body,
                                              .drive_share = 0.5,
                                              .motor_lag = axle->motor_lag,
                                              .brake_fill_time = axle->brake_fill_time,
                                              .brake_vent_time = axle->brake_vent_time};
        d->train[i].body.radius = v->contact.radius;
        d->train[i].body.minimum_speed = v->contact.minimum_speed;
        d->train[i].body.inverse_mass = inverse_mass;
        d->train[i].body = on_grade(&d->train[i].body, whole->grade);
        drivetrain_member *m = &d->member[i];
        *m = (drivetrain_member){.table = table,
                                 .contact = &v->contact,
                                 .drivetrain = &d->train[i],
                                 .rails = &d->rails[i]};
        double held = axle->torque_per_pressure * larger(axle->brake_pressure, 0.0);
        int by_pressure = axle->torque_per_pressure > 0.0;
        d->input[i] = (drivetrain_input){.commanded_torque = axle->motor_torque,
                                         .commanded_brake = by_pressure ? held : v->brake_torque,
                                         .resistance_force = towed / (double)n};
        d->state[i] = (drivetrain_state){
            .speed = v->input.speed,
            .omega_left = v->input.omega,
            .omega_right = v->input.omega,
            .left = v->input.memory,
            .right = axle->right,
            .drive_torque = axle->motor_lag > 0.0 ? axle->acting_motor : axle->motor_torque,
            .brake_torque = by_pressure ? held : axle->acting_brake,
            .pads_left = v->pads,
            .pads_right = v->pads,
            .distance = whole->distance - axle->position};
        d->axle[i] = v->past;
        d->axle[i].load = v->input.normal_load;
    }
    drivetrains_prepare(d->member, n);
}

static const char *move(drivetrains *d, model_values *values, size_t n, double step,
                        double tolerance) {
    double substep[MAX_AXLES];
    unsigned char failed[MAX_AXLES] = {0};
    for (size_t i = 0; i < n; i++) substep[i] = values[i].substep;
    drivetrains_advance(d->member, n, n, &d->whole, d->input, d->state, values->time, step,
                        tolerance, substep, failed);
    if (failed[0]) {
        values->substep = step;
        return "the tolerance is not met within the largest number of substeps";
    }
    for (size_t i = 0; i < n; i++) values[i].substep = substep[i];
    return NULL;
}

/* Take the axles with what rails and forces give at this instant. */
static void look(const creep_table *table, model_values *values, size_t n, drivetrains *d) {
    gather(table, values, n, d);
    move(d, values, n, 0.0, 1.0);
}

/* Take the axles with their forces at this instant, and as they would be after long under these. */
static void settle(const creep_table *table, model_values *values, size_t n, drivetrains *d,
                   drivetrain_output *out, force_element_output *contact) {
    look(table, values, n, d);
    drivetrains_evaluate(d->member, n, 1, d->input, d->state, out, contact);
    vehicles_settle(d->member, n, n, &d->whole, d->input, d->state, out);
}

void evaluate_vehicle(const creep_table *table, model_values *values, size_t n) {
    drivetrains d;
    drivetrain_output out[MAX_AXLES];
    force_element_output contact[2 * MAX_AXLES];
    double speed_rate = 0.0;
    settle(table, values, n, &d, out, contact);
    for (size_t i = 0; i < n; i++) {
        model_values *v = &values[i];
        const drivetrain_input *in = &d.input[i];
        const force_element_output *left = &contact[2 * i], *right = left + 1;
        double force = out[i].creep_force_left + out[i].creep_force_right;
        const wheelset_parameters *body = &d.train[i].body;
        v->output = *left;
        v->output.creep_force = force;
        v->output.creepage = 0.5 * (left->creepage + right->creepage);
        v->output.contact_temperature =
            0.5 * (left->contact_temperature + right->contact_temperature);
        v->output.falling_branch = larger(left->falling_branch, right->falling_branch);
        v->output.falling_margin = larger(left->falling_margin, right->falling_margin);
        v->rates.omega_rate =
            (out[i].drive_torque - body->radius * force - body->damping * v->input.omega) /
            body->inertia;
        speed_rate += out[i].speed_rate / (double)n;
        double missing = in->commanded_brake - d.state[i].brake_torque;
        double fill = missing > 0.0 ? v->axle.brake_fill_time : v->axle.brake_vent_time;
        int braked = v->axle.brake_fill_time > 0.0, lagging = v->axle.motor_lag > 0.0;
        double command = braked ? larger(in->commanded_torque, 0.0) : in->commanded_torque;
        v->pads_rate = braking_of(body->radius, v->input.omega, v->pads).pads_rate;
        v->of_axle = (axle_outputs){
            .distance_rate = v->input.speed,
            .drive_torque = out[i].drive_torque,
            .friction = 0.5 * (in->friction_left + in->friction_right),
            .motor_rate = lagging ? (command - v->axle.acting_motor) / v->axle.motor_lag : 0.0,
            .brake_rate = braked ? missing / fill : 0.0,
            .load_rate = (d.axle[i].load - v->input.normal_load) / d.body.load_lag,
            .right_rate = {right->held_rate, right->unslipped_rate, right->outer_rate},
            .slip_left = d.axle[i].own_left,
            .slip_right = d.axle[i].own_right};
    }
    for (size_t i = 0; i < n; i++) values[i].rates.speed_rate = speed_rate;
}

const char *advance_vehicle(const creep_table *table, model_values *values, size_t n, double step,
                            double tolerance, size_t *failed) {
    drivetrains d;
    *failed = 0;
    gather(table, values, n, &d);
    const char *error = move(&d, values, n, step, tolerance);
    for (size_t i = 0; i < n && error == NULL; i++) {
        model_values *v = &values[i];
        const drivetrain_state *now = &d.state[i];
        v->input.speed = now->speed;
        v->input.omega = now->omega_left;
        v->input.normal_load = d.axle[i].load;
        v->whole.distance = d.state[0].distance;
        v->past = d.axle[i];
        if (v->axle.motor_lag > 0.0) v->axle.acting_motor = now->drive_torque;
        if (v->axle.brake_fill_time > 0.0) {
            if (!(v->axle.torque_per_pressure > 0.0)) v->axle.acting_brake = now->brake_torque;
            v->pads = now->pads_left;
        }
        if (!remembers(&v->contact)) continue;
        v->input.memory = now->left;
        v->axle.right = now->right;
    }
    return error;
}

void begin_vehicle(const creep_table *table, model_values *values, size_t n) {
    drivetrains d;
    drivetrain_output out[MAX_AXLES];
    for (int k = 0; k < SETTLING; k++) {
        settle(table, values, n, &d, out, NULL);
        for (size_t i = 0; i < n; i++) {
            values[i].past = d.axle[i];
            values[i].input.normal_load = d.axle[i].load;
        }
    }
    for (size_t i = 0; i < n; i++) values[i].completed = values->whole.distance;
}

/* The slip work per length at the end of a step counts for all of it, and what an axle cleans for
 * itself is held over the next one. */
void complete_vehicle(const creep_table *table, model_values *values, size_t n) {
    drivetrains d;
    if (!(table->rails->cleaned.cleaning > 0.0)) return;
    look(table, values, n, &d);
    for (size_t i = 0; i < n; i++) {
        model_values *v = &values[i];
        const axle_outputs *made = &v->of_axle;
        double from = v->completed - v->axle.position, to = d.state[i].distance;
        double slip_work[2] = {fabs(to - from) * made->slip_left,
                               fabs(to - from) * made->slip_right};
        if (d.whole.range) slide(&d.whole, &d.axle[i], from, to, slip_work);
        v->past = d.axle[i];
        v->past.own_left = made->slip_left;
        v->past.own_right = made->slip_right;
        v->completed = v->whole.distance;
    }
}

void search_vehicle(const creep_table *table, model_values *values, size_t n) {
    static const double SLOWEST = 1e-6; /* at less the force is that of standstill [m/s] */
    drivetrains d;
    size_t which[MAX_AXLES];
    double speed[MAX_AXLES], force[MAX_AXLES];
    look(table, values, n, &d);
    for (size_t i = 0; i < n; i++) {
        int alike = i > 0 && memcmp(d.member[i].contact, d.member[i - 1].contact,
                                    sizeof *d.member[i].contact) == 0;
        which[i] = alike ? which[i - 1] : i; /* a search begins at the one before */
        speed[i] = larger(fabs(d.state[i].speed), SLOWEST);
    }
    drivetrains_peak(d.member, which, n, d.input, speed, force);
    for (size_t i = 0; i < n; i++) values[i].of_axle.available_force = force[i];
}
