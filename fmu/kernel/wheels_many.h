/* Evaluating many contacts and stepping many wheelsets, LANES at a time. */
#include "contact_lanes.h"
#include "lateral_spin_element.h"
#include "simd_dispatch.h"
#include "wheel_motion.h"

/* Contacts that wait to be evaluated together: along rolling, and with lateral slip or spin. */
typedef struct {
    size_t n[2];
    force_task task[2][LANES];
} waiting;

/* Up to LANES contacts along rolling. */
static void evaluate_few(contacts *c, const force_task *tasks, size_t n) {
    for (size_t l = 0; l < LANES; l++) /* a lane without a contact repeats the first */
        contacts_load(c, (int)l, tasks[l < n ? l : 0].parameters, tasks[l < n ? l : 0].input);
    contacts_evaluate_all(c);
    for (size_t l = 0; l < n; l++) {
        double *out = (double *)tasks[l].output;
        if (c->remembering) {
            take(c->out, (int)l, FIELDS(force_element_output), out);
            continue;
        }
        take(c->out, (int)l, NO_MEMORY_FIELDS, out);
        memset(out + NO_MEMORY_FIELDS, 0,
               (FIELDS(force_element_output) - NO_MEMORY_FIELDS) * sizeof(double));
    }
}

/* Up to LANES contacts with lateral slip or spin. */
static void evaluate_lateral(const creep_table *table, const force_task *tasks, size_t n) {
    force_element_parameters there[LANES];
    lateral_spin_force s[LANES];
    double place[LANES], k_hat[LANES], layer[LANES];
    double q[LANES], slope[LANES], by_log_k[LANES], by_log_layer[LANES];
    for (size_t i = 0; i < n; i++) {
        there[i] = force_element_at_load(tasks[i].parameters, tasks[i].input->normal_load);
        lateral_spin_element_begin(table, &there[i], tasks[i].input, &s[i]);
        place[i] = s[i].start.place;
        k_hat[i] = s[i].start.k_hat;
        layer[i] = s[i].start.layer;
    }
    evaluate_points(table, n, place, k_hat, layer, q, slope, by_log_k, by_log_layer);
    for (size_t i = 0; i < n; i++) {
        creep_value of_table = {q[i], slope[i], by_log_k[i], by_log_layer[i]};
        lateral_spin_element_finish(table, &there[i], tasks[i].input, of_table, &s[i],
                                    tasks[i].output);
    }
}

/* Evaluate the contacts that wait. */
static void evaluate_waiting(contacts *c, waiting *w, int lateral) {
    size_t n = w->n[lateral];
    const force_task *tasks = w->task[lateral];
    if (n <= PAIR) {
        for (size_t i = 0; i < n; i++)
            force_element_evaluate(c->table, tasks[i].parameters, tasks[i].input, tasks[i].output);
    } else if (lateral) evaluate_lateral(c->table, tasks, n);
    else evaluate_few(c, tasks, n);
    w->n[lateral] = 0;
}

/* Let a contact wait, and evaluate as many as fit. */
static void wait_or_evaluate(contacts *c, waiting *w, const force_task *task) {
    const force_element_input *in = task->input;
    int lateral = has_lateral_or_spin(c->table, in);
    if (!can_grip(task->parameters, in) || (holds_lateral(in) && !lateral)) {
        force_element_evaluate(c->table, task->parameters, in, task->output);
        return;
    }
    w->task[lateral][w->n[lateral]++] = *task;
    if (w->n[lateral] == LANES) evaluate_waiting(c, w, lateral);
}

void WIDE(force_element_evaluate_each)(const creep_table *table, const force_task *tasks,
                                       size_t n) {
    contacts c;
    waiting w = {{0, 0}, {{{NULL, NULL, NULL}}}};
    contacts_begin(&c, table, tasks[0].parameters);
    for (size_t i = 0; i < n; i++) wait_or_evaluate(&c, &w, &tasks[i]);
    for (int lateral = 0; lateral < 2; lateral++) evaluate_waiting(&c, &w, lateral);
}

void WIDE(force_element_evaluate_many)(const creep_table *table,
                                       const force_element_parameters *parameters, size_t n,
                                       const force_element_input *input,
                                       force_element_output *output) {
    contacts c;
    waiting w = {{0, 0}, {{{NULL, NULL, NULL}}}};
    contacts_begin(&c, table, parameters);
    for (size_t i = 0; i < n; i++) {
        force_task task = {parameters, &input[i], &output[i]};
        wait_or_evaluate(&c, &w, &task);
    }
    for (int lateral = 0; lateral < 2; lateral++) evaluate_waiting(&c, &w, lateral);
}

void WIDE(force_element_forces)(const creep_table *table,
                                const force_element_parameters *parameters, size_t n,
                                const double *const input[4], const size_t stride[4],
                                double *force) {
    contacts c;
    contacts_begin(&c, table, parameters);
    for (size_t first = 0; first < n; first += LANES) {
        size_t count = n - first < LANES ? n - first : LANES;
        for (size_t l = 0; l < LANES; l++) {
            size_t i = first + (l < count ? l : 0);
            force_element_input in = {input[0][i * stride[0]],
                                      input[1][i * stride[1]],
                                      input[2][i * stride[2]],
                                      input[3][i * stride[3]],
                                      0.0,
                                      0.0,
                                      0.0,
                                      0.0,
                                      0.0,
                                      0.0,
                                      0.0};
            contacts_load(&c, (int)l, parameters, &in);
        }
        contacts_evaluate_force(&c);
        for (size_t l = 0; l < count; l++)
            force[first + l] = c.out[PLACE(force_element_output, creep_force)][l];
    }
}

/* Up to LANES wheelsets. One that needs very many or very short substeps begins again alone. */
static const char *advance_few(const creep_table *table, wheelset_task *tasks, size_t n,
                               double step, size_t *failed) {
    motion m;
    integration run;
    int late[LANES] = {0};
    const char *error = NULL;
    m.braked = 0;
    contacts_begin(&m.contact, table, tasks->contact);
    for (size_t l = 0; l < LANES; l++) {
        const wheelset_task *task = &tasks[l < n ? l : 0];
        contacts_load(&m.contact, (int)l, task->contact, &task->input);
        load_motion(&m, run.y, (int)l, task);
        run.left[l] = l < n ? step : 0.0;
        run.h[l] = task->substep > 0.0 ? task->substep : step;
        run.count[l] = 0.0;
    }
    equations problem = motion_equations(&m);
    for (int busy = 1; busy;) {
        rosenbrock_substep(&problem, &run, tasks->tolerance);
        busy = 0;
        for (size_t l = 0; l < n; l++) {
            int hopeless = run.count[l] >= MANY_SUBSTEPS || is_hopeless(&run, (int)l, step);
            late[l] |= run.left[l] > 0.0 && hopeless;
            run.left[l] = late[l] ? 0.0 : run.left[l];
            busy |= run.left[l] > 0.0;
        }
    }
    for (size_t l = n; l-- > 0;) {
        if (late[l]) {
            const char *found = wheelset_advance(table, &tasks[l], step);
            error = found != NULL ? found : error;
            *failed = found != NULL ? l : *failed;
        } else {
            store_motion(run.y, (int)l, &tasks[l]);
            tasks[l].substep = run.h[l];
        }
    }
    return error;
}

const char *WIDE(wheelset_advance_many)(const creep_table *table, wheelset_task *tasks, size_t n,
                                        double step, size_t *failed) {
    for (size_t first = 0; first < n; first += LANES) {
        size_t count = n - first < LANES ? n - first : LANES;
        const char *error = advance_few(table, &tasks[first], count, step, failed);
        *failed += error != NULL ? first : 0;
        if (error != NULL) return error;
    }
    return NULL;
}
