#include "wheelset_step.h"

#include <math.h>
#include <string.h>

#define LANES 1
#include "wheel_motion.inc"

/* The tolerance of the next substep. A wheel that remembers swings at almost zero speed on its
 * contact almost undamped, at some 100 Hz, and resolving these oscillations over a long step would
 * need any number of substeps. With a coarse tolerance the method damps the oscillations and
 * preserves their mean, which is sufficient for such long steps. */
static double held_tolerance(double required, double count) {
    return count < MANY_SUBSTEPS        ? required
           : count < 0.6 * MAX_SUBSTEPS ? fmax(required, 1e-4)
           : count < 0.8 * MAX_SUBSTEPS ? fmax(required, 1e-2)
                                        : fmax(required, 1e-1);
}

/* One substep of a contact with memory by Euler's implicit method, in which the paces of its rates
 * are those at the start: a force approaches its strength and does not pass it, however long the
 * substep is. The error is that of the change of the rates. */
static void euler_substep(const equations *problem, integration *run) {
    motion *m = (motion *)problem->model;
    rows f, after, change;
    factors s;
    s.problem = problem;
    s.j = &run->j;
    const int n = problem->states;
    problem->rates(m, run->y, f, &run->j);
    s.h[0] = run->h[0];
    s.inverse[0] = 1.0 / s.h[0];
    for (int i = 0; i < n; i++)
        for (int c = 0; c < n; c++)
            s.lu[i][c][0] =
                (i == c ? s.inverse[0] : 0.0) - run->j[problem->index[i]][problem->index[c]][0];
    factorize(problem, s.lu);
    for (int i = 0; i < n; i++) after[i][0] = f[problem->index[i]][0];
    solve(problem, s.lu, after, change);
    for (int i = 0; i < n; i++) run->y[problem->index[i]][0] += change[i][0];
    force_element_input held;
    take(m->contact.in, 0, FIELDS(force_element_input), (double *)&held);
    for (int i = 0; i < MEMORY_STATES; i++) (&held.memory.held_force)[i] = run->y[2 + i][0];
    lose_excess(m->contact.given[0], &held);
    for (int i = 0; i < MEMORY_STATES; i++) run->y[2 + i][0] = (&held.memory.held_force)[i];
    problem->rates(m, run->y, after, NULL);
    for (int i = 0; i < n; i++)
        after[i][0] = 0.5 * (after[problem->index[i]][0] - f[problem->index[i]][0]);
    solve(problem, s.lu, after, change);
    memset(f, 0, sizeof f);
    for (int i = 0; i < n; i++) f[problem->index[i]][0] = change[i][0];
    problem->error_size(m, run->y, f, run->error);
}

/* Finish a step in a number of equal substeps, whose errors are not controlled. */
static const char *advance_evenly(const equations *problem, integration *run, double number,
                                  double *tolerance) {
    motion *m = (motion *)problem->model;
    force_element_parameters frozen = *m->contact.given[0];
    int remembering = remembers(&frozen);
    double length = run->left[0] / number;
    if (remembering) {
        m->contact.there[ROW_OF(force_element_parameters, memory)][0] = frozen.memory =
            FROZEN_PACES;
        m->contact.given[0] = &frozen;
    }
    for (; number > 0.0; number -= 1.0) {
        run->h[0] = length;
        if (remembering) euler_substep(problem, run);
        else rosenbrock_substep(problem, run, INFINITY);
        *tolerance = larger(*tolerance, run->error[0]);
    }
    if (remembering) run->left[0] = run->error[0] <= 1e300 ? 0.0 : 1.0;
    return run->left[0] > 0.0 ? "a state is not finite" : NULL;
}

/* Advance a run by a step; see wheelset_advance. */
static const char *advance(const equations *problem, integration *run, double step,
                           double *tolerance, double *substep, double limit) {
    double held = *tolerance, last = INFINITY;
    equations rough = *problem;
    rough.fine = fine_tolerance(0);
    limit = ceil(limit);
    run->left[0] = step;
    run->h[0] = *substep > 0.0 ? *substep : step;
    run->count[0] = run->first[0] = 0.0;
    while (run->left[0] > 0.0) {
        if (run->count[0] >= MAX_SUBSTEPS) {
            *substep = step - run->left[0];
            return "the tolerance is not met within 100000 substeps";
        }
        double more = limit - run->count[0], last_ones = run->left[0] == last ? 2.0 : 1.0;
        if (limit > 0.0 && (more <= last_ones || run->h[0] * more < run->left[0])) {
            *substep = step; /* the next one may be easier */
            return advance_evenly(problem, run, more, tolerance);
        }
        last = run->left[0];
        held = held_tolerance(*tolerance, run->count[0]);
        rosenbrock_substep(run->count[0] < SMOOTH_SUBSTEPS ? problem : &rough, run, held);
    }
    *tolerance = held;
    *substep = run->first[0];
    return NULL;
}

const char *wheelset_advance(const creep_table *table, wheelset_task *task, double step) {
    motion m;
    integration run;
    m.braked = 0;
    contacts_begin(&m.contact, table, task->contact);
    contacts_put_input(&m.contact, 0, task->contact, &task->input);
    put_motion(&m, run.y, 0, task);
    equations problem = motion_equations(&m);
    const char *error =
        advance(&problem, &run, step, &task->tolerance, &task->substep, task->max_substeps);
    if (error == NULL) take_motion(run.y, 0, task);
    return error;
}

const char *wheelsets_advance(const creep_table *table, wheelset_task *tasks, size_t n, double step,
                              size_t *failed) {
#ifndef ONE_FILE_KERNEL
    int limited = 0;
    for (size_t i = 0; i < n; i++) limited |= tasks[i].max_substeps != 0.0;
    if (n > FEW_WHEELS && !limited) return wheelsets_advance_wide(table, tasks, n, step, failed);
#endif /* ONE_FILE_KERNEL */
    for (*failed = 0; *failed < n; ++*failed) {
        const char *error = wheelset_advance(table, &tasks[*failed], step);
        if (error != NULL) return error;
    }
    return NULL;
}

#ifndef ONE_FILE_KERNEL
const char *force_element_roll(const creep_table *table, const force_element_parameters *contact,
                               double speed, double normal_load, double friction_scale, size_t n,
                               const double *creepage, const double *distance, double tolerance,
                               double *force) {
    force_element_output out;
    wheelset_task task = {
        .contact = contact,
        .input = {.speed = speed, .normal_load = normal_load, .friction_scale = friction_scale}};
    force_element_input *in = &task.input;
    for (size_t i = 0; i < n; i++) {
        double omega = (1.0 + creepage[i]) * speed / contact->radius;
        if (i == 0) {
            in->omega = omega;
            force_element_evaluate(table, contact, in, &out);
            in->memory = settled(&out);
        } else {
            double step = (distance[i] - distance[i - 1]) / speed;
            task.omega_rate = (omega - in->omega) / step;
            task.tolerance = tolerance;
            task.substep = 0.0;
            const char *error = wheelset_advance(table, &task, step);
            if (error != NULL) return error;
            in->omega = omega; /* without the rounding */
        }
        force_element_evaluate(table, contact, in, &out);
        force[i] = out.creep_force; /* as far as friction holds it */
    }
    return NULL;
}
#endif /* ONE_FILE_KERNEL */
