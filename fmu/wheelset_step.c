#include "wheelset_step.h"

#include <math.h>

enum { MOST_SUBSTEPS = 100000, STATES = 3 };

/* The equations of motion with everything that is held over a step. */
typedef struct {
    const creep_table *table;
    const force_element_parameters *contact;
    const wheelset_parameters *body;
    const wheelset_input *input;
    int states; /* two, or three with the relaxation */
} motion;

static void evaluate(const motion *m, const double y[STATES], force_element_output *out,
                     wheelset_rates *rates, double f[STATES]) {
    force_element_input in = {y[0], y[1], m->input->normal_load, m->input->friction_scale, y[2]};
    force_element_evaluate(m->table, m->contact, &in, out);
    wheelset_motion(m->body, y[0], y[1], m->input->drive_torque, m->input->resistance_force, out,
                    rates);
    f[0] = rates->omega_rate;
    f[1] = rates->speed_rate;
    f[2] = out->relaxation_rate;
}

static void jacobian(const motion *m, const force_element_output *out, const wheelset_rates *rates,
                     double j[STATES][STATES]) {
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++) j[i][k] = rates->jacobian[i][k];
    j[0][2] = -m->body->radius * out->force_by_relaxed / m->body->inertia;
    j[1][2] = out->force_by_relaxed * m->body->inverse_mass;
    j[2][0] = out->rate_by_omega;
    j[2][1] = out->rate_by_speed;
    j[2][2] = out->rate_by_relaxed;
}

/* a = l u in place, rows exchanged as order says. */
static void factorize(int n, double a[STATES][STATES], int order[STATES]) {
    for (int i = 0; i < n; i++) order[i] = i;
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(a[order[i]][k]) > fabs(a[order[pivot]][k])) pivot = i;
        int row = order[pivot];
        order[pivot] = order[k];
        order[k] = row;
        for (int i = k + 1; i < n; i++) {
            double *below = a[order[i]], factor = below[k] /= a[row][k];
            for (int c = k + 1; c < n; c++) below[c] -= factor * a[row][c];
        }
    }
}

static void solve(int n, double lu[STATES][STATES], const int order[STATES], const double b[STATES],
                  double x[STATES]) {
    for (int i = 0; i < n; i++) {
        x[i] = b[order[i]];
        for (int c = 0; c < i; c++) x[i] -= lu[order[i]][c] * x[c];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int c = i + 1; c < n; c++) x[i] -= lu[order[i]][c] * x[c];
        x[i] /= lu[order[i]][i];
    }
}

/* One substep of length h from y, where rates and Jacobian are known; the estimated error beside.
 */
static void rodas3(const motion *m, double h, const double y[STATES], const double f[STATES],
                   double j[STATES][STATES], double next[STATES], double error[STATES]) {
    int n = m->states, order[STATES];
    double e[STATES][STATES], b[STATES], k1[STATES], k2[STATES], k3[STATES], g[STATES];
    force_element_output out;
    wheelset_rates rates;
    for (int i = 0; i < n; i++)
        for (int c = 0; c < n; c++) e[i][c] = (i == c ? 2.0 / h : 0.0) - j[i][c]; /* gamma 1/2 */
    factorize(n, e, order);
    solve(n, e, order, f, k1);
    for (int i = 0; i < n; i++) b[i] = f[i] + 4.0 / h * k1[i];
    solve(n, e, order, b, k2);
    for (int i = 0; i < STATES; i++) next[i] = i < n ? y[i] + 2.0 * k1[i] : y[i];
    evaluate(m, next, &out, &rates, g);
    for (int i = 0; i < n; i++) b[i] = g[i] + (k1[i] - k2[i]) / h;
    solve(n, e, order, b, k3);
    for (int i = 0; i < n; i++) next[i] += k3[i];
    evaluate(m, next, &out, &rates, g);
    for (int i = 0; i < n; i++) b[i] = g[i] + (k1[i] - k2[i] - 8.0 / 3.0 * k3[i]) / h;
    solve(n, e, order, b, error);
    for (int i = 0; i < n; i++) next[i] += error[i];
}

/* Largest error over what is allowed; NaN if any is. */
static double error_ratio(const motion *m, const double y[STATES], const double error[STATES],
                          double saturation_creepage, double tolerance) {
    double radius = m->body->radius, floor = m->body->minimum_speed;
    double slip = fabs(radius * y[0] - y[1]), speed = fabs(y[1]) + floor;
    double ratio = fabs(radius * error[0] - error[1]) / (slip + saturation_creepage * speed) +
                   fabs(error[1]) / speed;
    if (m->states > 2) ratio += fabs(error[2]) / (fabs(y[2]) + saturation_creepage);
    return ratio / tolerance;
}

const char *wheelset_advance(const creep_table *table, const force_element_parameters *contact,
                             const wheelset_parameters *body, const wheelset_input *input,
                             wheelset_state *state, double step, double tolerance,
                             double *substep) {
    motion m = {table, contact, body, input, contact->relaxation_length > 0.0 ? 3 : 2};
    double y[STATES] = {state->omega, state->speed, state->relaxed_creepage};
    double f[STATES], j[STATES][STATES], next[STATES], error[STATES];
    double h = *substep > 0.0 ? *substep : step, left = step;
    force_element_output out;
    wheelset_rates rates;
    evaluate(&m, y, &out, &rates, f);
    jacobian(&m, &out, &rates, j);
    for (int i = 0; i < MOST_SUBSTEPS; i++) {
        double pieces = ceil(left / h * (1.0 - 1e-12)),
               length = pieces > 1.0 ? left / pieces : left;
        /* Without contact nothing is stiff, and a slip of any size is as good as another. */
        double saturation = out.saturation_creepage > 0.0 ? out.saturation_creepage : 1.0;
        rodas3(&m, length, y, f, j, next, error);
        double ratio = error_ratio(&m, next, error, saturation, tolerance);
        double factor = 0.1; /* if the ratio is not a number */
        if (isfinite(ratio)) factor = fmin(5.0, fmax(0.1, 0.8 / cbrt(fmax(ratio, 1e-6))));
        if (!(ratio <= 1.0)) {
            h = length * fmin(factor, 0.8);
            continue;
        }
        for (int s = 0; s < STATES; s++) y[s] = next[s];
        left = pieces > 1.0 ? left - length : 0.0;
        h = factor < 1.0 ? length * factor : fmax(h, length * factor);
        if (left == 0.0) {
            *state = (wheelset_state){y[0], y[1], y[2]};
            *substep = h;
            return NULL;
        }
        evaluate(&m, y, &out, &rates, f);
        jacobian(&m, &out, &rates, j);
    }
    return "the tolerance is not met within 100000 substeps";
}
