/* The model "force_element", whose force is held, remembers or is implicit. */
#include <math.h>
#include <string.h>

#include "force_element_formula.h"
#include "model_functions.h"
#include "simd_math.h"
#include "wheelset_step.h"

/* The hint where the coupling does not limit the step [s]. */
static const double LONG_STEP = 1000.0;

/* Half of the maximum step over which the force may be held. Stability needs h lambda < 2 with the
 * slip pole lambda, or h lambda < 1 if both sides step at once. A contact with memory is a spring,
 * never stiffer than while it sticks: h < 2/omega is enough too, with the frequency omega of the
 * wheel on that spring. */
static double stable_step(const creep_table *table, const model_values *v) {
    double gradient = fabs(force_element_steepest(table, &v->contact, &v->input, &v->output));
    double pole = gradient * v->effective_inverse_mass;
    double hint = v->parallel_exchange != 0.0 ? 0.5 / pole : 1.0 / pole;
    if (remembers(&v->contact) && v->parallel_exchange == 0.0) {
        double load = is_loaded(&v->contact, v->input.normal_load) ? v->input.normal_load : 0.0;
        force_element_parameters p =
            load > 0.0 ? force_element_at_load(&v->contact, load) : v->contact;
        contact_scales s = contact_scales_of(table, &p);
        double compliance = 2.0 * p.peak_pressure * s.relaxation_length /
                            (p.contact_modulus * p.slope_reduction * s.initial_slope);
        double stiffness = fmax(s.standing_stiffness, 1.0) * load / compliance;
        hint = fmax(hint, 1.0 / sqrt(stiffness * v->effective_inverse_mass));
    }
    return v->implicit == 0.0 && hint < LONG_STEP ? hint : LONG_STEP; /* false for NaN */
}

void evaluate_contacts(const creep_table *table, model_values *values, size_t n) {
    force_task tasks[MAX_WHEELS];
    if (n == 1) {
        force_element_evaluate(table, &values->contact, &values->input, &values->output);
        return;
    }
    for (size_t i = 0; i < n; i++) {
        tasks[i].parameters = &values[i].contact;
        tasks[i].input = &values[i].input;
        tasks[i].output = &values[i].output;
    }
    force_elements_evaluate(table, tasks, n);
}

/* Whether the last step set the outputs. */
static int is_stepped(const model_values *v) {
    return v->implicit != 0.0 && v->memory.known != 0.0;
}

void evaluate_force(const creep_table *table, model_values *values, size_t n) {
    if (is_stepped(values)) return; /* wheels are stepped together */
    evaluate_contacts(table, values, n);
    for (size_t i = 0; i < n; i++) values[i].step_size_hint = stable_step(table, &values[i]);
}

#ifndef ONE_FILE_KERNEL
void tangent_force(const creep_table *table, const model_values *v, const model_values *direction,
                   model_values *change) {
    if (is_stepped(v)) return;
    force_element_tangent(table, &v->contact, &v->input, &v->output, &direction->input,
                          &change->output);
}
#endif /* ONE_FILE_KERNEL */

/* A step of the implicit mode. */
typedef struct {
    slip_memory memory;
    double acceleration; /* a [m/s2] */
    double slip, begin;  /* slip velocity as the tool gave it, and where the step begins [m/s] */
    wheelset_parameters body;
} slip_step;

/* The implicit mode. During a step the slip velocity w obeys dw/dt = a - m Q(w), where m is the
 * effective inverse mass and a the slip acceleration by everything except the creep force. The
 * value of a in the step before follows from the slip at its ends and the force that acted; it is
 * assumed to continue. The element solves the equation and gives the mean force, so the tool's body
 * moves as in a solution of the coupled equations. A wheel of inertia r^2 / m at held speed, driven
 * by a torque a r / m, has the same equation of slip. */
static void begin_slip_step(const model_values *v, double step, double tolerance, slip_step *s,
                            wheelset_task *task) {
    double m = v->effective_inverse_mass, radius = v->contact.radius, a;
    slip_memory memory = v->memory;
    s->slip = radius * v->input.omega - v->input.speed;
    if (memory.known == 0.0) { /* assume a steady slip */
        memory.force = v->output.creep_force;
        a = m * memory.force;
    } else {
        a = (s->slip - memory.slip) / memory.step + m * memory.applied;
    }
    double start = s->slip;
    if (v->parallel_exchange != 0.0) { /* the last force acts in this step, the new one after it */
        start += step * (a - m * memory.force);
        memory.applied = memory.force;
    }
    memset(&s->body, 0, sizeof s->body);
    s->body.radius = radius;
    s->body.inertia = radius * radius / m;
    s->body.minimum_speed = v->contact.minimum_speed;
    memset(task, 0, sizeof *task);
    task->contact = &v->contact;
    task->body = &s->body;
    task->drive_torque = a * radius / m;
    task->input = v->input;
    task->input.omega = (start + v->input.speed) / radius;
    task->tolerance = tolerance;
    task->substep = v->substep;
    task->max_substeps = v->max_substeps;
    s->begin = radius * task->input.omega - v->input.speed;
    s->acceleration = a;
    s->memory = memory;
}

/* Set force and memory after the step; the outputs are those at its end. */
static void end_slip_step(model_values *v, double step, const slip_step *s,
                          const wheelset_task *task) {
    double m = v->effective_inverse_mass, radius = v->contact.radius;
    slip_memory memory = s->memory;
    double end = radius * task->input.omega - task->input.speed;
    /* Under a small load the rounding of this difference may exceed the force. */
    double load = fmax(0.0, v->input.normal_load);
    double largest = v->contact.static_friction * v->input.friction_scale * load;
    double mean = (s->acceleration - (end - s->begin) / step) / m;
    memory.force = fmin(largest, fmax(-largest, mean));
    memory.known = 1.0;
    memory.slip = s->slip;
    memory.step = step;
    if (v->parallel_exchange == 0.0) memory.applied = memory.force;
    v->memory = memory;
    v->held_tolerance = task->tolerance;
    v->substep = task->substep;
    take_memory(&v->input, &task->input);
    if (!can_grip(&v->contact, &v->input)) return;
    force_element_parameters there = force_element_at_load(&v->contact, load);
    v->output.creep_force = memory.force;
    v->output.traction_coefficient = memory.force / load;
    set_by_force(&there, &task->input, &v->output);
}

static const char *step_slips(const creep_table *table, model_values *values, size_t n, double step,
                              double tolerance, size_t *failed) {
    slip_step steps[MAX_WHEELS];
    wheelset_task tasks[MAX_WHEELS];
    force_task ends[MAX_WHEELS];
    for (size_t i = 0; i < n; i++) {
        begin_slip_step(&values[i], step, tolerance, &steps[i], &tasks[i]);
        ends[i].parameters = &values[i].contact;
        ends[i].input = &tasks[i].input;
        ends[i].output = &values[i].output;
    }
    const char *error = wheelsets_advance(table, tasks, n, step, failed);
    if (error != NULL) values[*failed].substep = tasks[*failed].substep;
    if (error != NULL) return error;
    force_elements_evaluate(table, ends, n);
    for (size_t i = 0; i < n; i++) end_slip_step(&values[i], step, &steps[i], &tasks[i]);
    return NULL;
}

/* Count the turns of a held force that swings from step to step and makes the slip swing: at each
 * large change the slip's acceleration then changes the other way, with the same inverse mass. A
 * force that its surroundings excite, as in a replay of measured velocities, lacks this effect. */
static void count_turns(slip_memory *memory, const model_values *v) {
    static const double MIN_SWING = 0.05, MAX_CHANGE = 0.2, MAX_SIZE = 1e100;
    double slip = v->contact.radius * v->input.omega - v->input.speed;
    double rate = (slip - memory->slip) / memory->step, rise = memory->applied - memory->acting;
    double friction = v->contact.static_friction * v->input.friction_scale * v->input.normal_load;
    if (!(fabs(rate) < MAX_SIZE)) rate = 0.0;
    if (fabs(rise) > MIN_SWING * friction) {
        double inverse_mass = (memory->rate - rate) / rise;
        if (!(fabs(inverse_mass) < MAX_SIZE)) inverse_mass = 0.0;
        int follows = fabs(inverse_mass - memory->inverse_mass) < MAX_CHANGE * inverse_mass;
        memory->turns = follows ? memory->turns + (rise * memory->rise < 0.0) : 0.0;
        memory->inverse_mass = inverse_mass;
        memory->rise = rise;
    }
    memory->acting = memory->applied;
    memory->rate = rate;
}

/* The largest stable step if the slip follows the force as it did, or as declared; the pole is
 * largest where there is no slip. */
static double stable_without_slip(const creep_table *table, const model_values *v) {
    model_values rolling = *v;
    rolling.effective_inverse_mass = fmin(v->effective_inverse_mass, v->memory.inverse_mass);
    rolling.input.omega = v->input.speed / v->contact.radius;
    forget(&rolling.input);
    evaluate_force(table, &rolling, 1);
    return 2.0 * rolling.step_size_hint;
}

/* A force that is held or remembers needs no solution: store the step, to see the force swing. */
static void remember(const creep_table *table, model_values *v, double step) {
    static const double MIN_TURNS = 12.0; /* beyond chance */
    slip_memory *memory = &v->memory;
    double force = v->output.creep_force;
    if (memory->known != 0.0) count_turns(memory, v);
    if (memory->turns >= MIN_TURNS) {
        double longest = stable_without_slip(table, v);
        if (memory->step > longest) memory->too_long = longest;
    }
    int late = v->parallel_exchange != 0.0 && memory->known != 0.0;
    memory->applied = late ? memory->force : force;
    memory->force = force;
    memory->known = 1.0;
    memory->slip = v->contact.radius * v->input.omega - v->input.speed;
    memory->step = step;
}

/* Advance the memory of the contacts at held velocities. */
static const char *advance_memories(const creep_table *table, model_values *values, size_t n,
                                    double step, double tolerance, size_t *failed) {
    wheelset_task tasks[MAX_WHEELS];
    for (size_t i = 0; i < n; i++) {
        memset(&tasks[i], 0, sizeof tasks[i]);
        tasks[i].contact = &values[i].contact;
        tasks[i].input = values[i].input;
        tasks[i].tolerance = tolerance;
        tasks[i].max_substeps = values[i].max_substeps;
    }
    const char *error = wheelsets_advance(table, tasks, n, step, failed);
    for (size_t i = 0; i < n && error == NULL; i++) values[i].input = tasks[i].input;
    return error;
}

const char *advance_force(const creep_table *table, model_values *values, size_t n, double step,
                          double tolerance, size_t *failed) {
    if (values->implicit != 0.0) return step_slips(table, values, n, step, tolerance, failed);
    if (remembers(&values->contact)) {
        const char *error = advance_memories(table, values, n, step, tolerance, failed);
        if (error != NULL) return error;
        evaluate_force(table, values, n); /* the tool applies the force at the step's end */
    }
    for (size_t i = 0; i < n; i++) remember(table, &values[i], step);
    return NULL;
}
