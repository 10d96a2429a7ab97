/* Time integration of a few stiff differential equations to high accuracy, forward or backward.
 *
 * Radau IIA of three stages: collocation of fifth order, L-stable and stiffly accurate. A
 * simplified Newton iteration solves for all stages at once; the collocation polynomial is the
 * solution within a step. An embedded third-order solution controls the steps.
 *
 * E. Hairer & G. Wanner, "Solving Ordinary Differential Equations II", 2nd ed., Springer 1996,
 * sections IV.5 and IV.8. */
#ifndef RADAU_H
#define RADAU_H

#include <float.h>
#include <math.h>
#include <string.h>

enum { RADAU_STATES = 3, RADAU_ROWS = 8, STAGES = 3, MAX_ITERATIONS = 6 };

/* Equations dy/dt = f(t, y). The first rows are states; the others are integrals, on which no rate
 * depends. */
typedef struct {
    void *model;
    /* Rates of all rows and, unless jacobian is NULL, the states' derivatives by the states. */
    void (*rates)(void *model, double time, const double *y, double *f,
                  double (*jacobian)[RADAU_STATES]);
    double scale[RADAU_ROWS]; /* of each row, added to its size where errors are relative */
    double tolerance;         /* relative error of a step */
} radau_problem;

/* The last step, and what the next one needs to know of it. */
typedef struct {
    double time, h;                   /* start and length [s]; h < 0 backward, 0 before the first */
    double y[RADAU_ROWS];             /* at the start */
    double z[STAGES][RADAU_ROWS];     /* change of y up to each stage */
    double error, next;               /* error / tolerance; length to try next [s] */
    double end_time, end[RADAU_ROWS]; /* where the next step starts */
} radau;

#define ROOT_6 2.449489742783178
static const double STAGE[STAGES] = {(4.0 - ROOT_6) / 10.0, (4.0 + ROOT_6) / 10.0, 1.0};
static const double WEIGHT[STAGES][STAGES] = {
    {(88.0 - 7.0 * ROOT_6) / 360.0, (296.0 - 169.0 * ROOT_6) / 1800.0,
     (-2.0 + 3.0 * ROOT_6) / 225.0},
    {(296.0 + 169.0 * ROOT_6) / 1800.0, (88.0 + 7.0 * ROOT_6) / 360.0,
     (-2.0 - 3.0 * ROOT_6) / 225.0},
    {(16.0 - ROOT_6) / 36.0, (16.0 + ROOT_6) / 36.0, 1.0 / 9.0}};
/* Real eigenvalue of the inverse of WEIGHT, and weights of the stages in the error. */
static const double REAL_EIGENVALUE = 3.637834252744496;
static const double ERROR_WEIGHT[STAGES] = {(-13.0 - 7.0 * ROOT_6) / 3.0,
                                            (-13.0 + 7.0 * ROOT_6) / 3.0, -1.0 / 3.0};

/* Solve a x = b in place by elimination with row exchanges; a holds its factors if `again`. */
static void solve_dense(int n, double a[][STAGES * RADAU_STATES], int *exchanged, double *b,
                        int again) {
    for (int k = 0; k < n; k++) {
        if (!again) {
            int pivot = k;
            for (int i = k + 1; i < n; i++)
                if (fabs(a[i][k]) > fabs(a[pivot][k])) pivot = i;
            exchanged[k] = pivot;
            for (int c = 0; c < n; c++) {
                double kept = a[k][c];
                a[k][c] = a[pivot][c];
                a[pivot][c] = kept;
            }
            for (int i = k + 1; i < n; i++) {
                a[i][k] /= a[k][k];
                for (int c = k + 1; c < n; c++) a[i][c] -= a[i][k] * a[k][c];
            }
        }
    }
    for (int k = 0; k < n; k++) {
        double kept = b[k];
        b[k] = b[exchanged[k]];
        b[exchanged[k]] = kept;
    }
    for (int i = 0; i < n; i++)
        for (int c = 0; c < i; c++) b[i] -= a[i][c] * b[c];
    for (int i = n - 1; i >= 0; i--) {
        for (int c = i + 1; c < n; c++) b[i] -= a[i][c] * b[c];
        b[i] /= a[i][i];
    }
}

/* Root mean square of a change of the first n rows, relative to their tolerance. */
static double relative_size(const radau_problem *p, int n, const double *y, const double *change) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        double part = change[i] / (p->tolerance * (fabs(y[i]) + p->scale[i]));
        sum += part * part;
    }
    return sqrt(sum / n);
}

/* The solution at a part of the last step, also beyond its end. */
static void radau_at(const radau *s, double part, double *y) {
    double weight[STAGES];
    for (int i = 0; i < STAGES; i++) { /* Lagrange's polynomials through the start and the stages */
        weight[i] = part / STAGE[i];
        for (int k = 0; k < STAGES; k++)
            if (k != i) weight[i] *= (part - STAGE[k]) / (STAGE[i] - STAGE[k]);
    }
    for (int r = 0; r < RADAU_ROWS; r++)
        y[r] = s->y[r] + weight[0] * s->z[0][r] + weight[1] * s->z[1][r] + weight[2] * s->z[2][r];
}

/* Solve z = h WEIGHT f(y + z) for the stages z of a step from y; returns the number of iterations,
 * 0 if they do not converge. */
static int solve_stages(const radau_problem *p, double time, double h, const double *y,
                        double jacobian[RADAU_STATES][RADAU_STATES], double z[STAGES][RADAU_ROWS]) {
    enum { ALL = STAGES * RADAU_STATES };
    double matrix[ALL][ALL], residual[ALL], f[STAGES][RADAU_ROWS], last = 0.0;
    double enough = fmax(10.0 * DBL_EPSILON / p->tolerance, fmin(0.03, sqrt(p->tolerance)));
    int exchanged[ALL];
    for (int i = 0; i < ALL; i++)
        for (int c = 0; c < ALL; c++)
            matrix[i][c] = (i == c ? 1.0 : 0.0) - h * WEIGHT[i / RADAU_STATES][c / RADAU_STATES] *
                                                      jacobian[i % RADAU_STATES][c % RADAU_STATES];
    for (int k = 0;; k++) {
        for (int i = 0; i < STAGES; i++) {
            double stage[RADAU_ROWS];
            for (int r = 0; r < RADAU_ROWS; r++) stage[r] = y[r] + z[i][r];
            p->rates(p->model, time + h * STAGE[i], stage, f[i], NULL);
        }
        for (int i = 0; i < STAGES; i++)
            for (int r = 0; r < RADAU_ROWS; r++) {
                double to =
                    h * (WEIGHT[i][0] * f[0][r] + WEIGHT[i][1] * f[1][r] + WEIGHT[i][2] * f[2][r]);
                if (r < RADAU_STATES) residual[i * RADAU_STATES + r] = to - z[i][r];
                else z[i][r] = to;
            }
        solve_dense(ALL, matrix, exchanged, residual, k > 0);
        double sum = 0.0;
        for (int i = 0; i < STAGES; i++) {
            double part = relative_size(p, RADAU_STATES, y, &residual[i * RADAU_STATES]);
            sum += part * part / STAGES;
            for (int r = 0; r < RADAU_STATES; r++) z[i][r] += residual[i * RADAU_STATES + r];
        }
        double size = sqrt(sum), ratio = k > 0 ? size / last : 0.0;
        if (!(size <= DBL_MAX) || ratio >= 1.0) return 0;
        if (size == 0.0 || (k > 0 && ratio / (1.0 - ratio) * size < enough)) return k + 1;
        /* Where it has not converged by the last iteration, this is true. */
        if (k > 0 && pow(ratio, MAX_ITERATIONS - 1 - k) / (1.0 - ratio) * size > enough) return 0;
        last = size;
    }
}

/* Error of a step relative to the tolerance, from its stages. */
static double error_of(const radau_problem *p, double time, double h, const double *y,
                       const double *f, double jacobian[RADAU_STATES][RADAU_STATES],
                       double z[STAGES][RADAU_ROWS], int refined) {
    double matrix[RADAU_STATES][STAGES * RADAU_STATES];
    double stages[RADAU_ROWS], change[RADAU_ROWS], size[RADAU_ROWS];
    int exchanged[RADAU_STATES];
    for (int i = 0; i < RADAU_STATES; i++)
        for (int c = 0; c < RADAU_STATES; c++)
            matrix[i][c] = (i == c ? REAL_EIGENVALUE / h : 0.0) - jacobian[i][c];
    for (int r = 0; r < RADAU_ROWS; r++) {
        stages[r] =
            (ERROR_WEIGHT[0] * z[0][r] + ERROR_WEIGHT[1] * z[1][r] + ERROR_WEIGHT[2] * z[2][r]) / h;
        change[r] = f[r] + stages[r];
        if (r >= RADAU_STATES) change[r] *= h / REAL_EIGENVALUE;
        size[r] = fmax(fabs(y[r]), fabs(y[r] + z[2][r]));
    }
    solve_dense(RADAU_STATES, matrix, exchanged, change, 0);
    double found = relative_size(p, RADAU_ROWS, size, change);
    if (!refined || !(found > 1.0)) return found;
    /* After a rejection, and for a first step, the stiff part of the estimate is damped once more.
     */
    double moved[RADAU_ROWS], there[RADAU_ROWS];
    memcpy(moved, y, sizeof moved);
    for (int i = 0; i < RADAU_STATES; i++) moved[i] += change[i];
    p->rates(p->model, time, moved, there, NULL);
    for (int i = 0; i < RADAU_STATES; i++) change[i] = there[i] + stages[i];
    solve_dense(RADAU_STATES, matrix, exchanged, change, 1);
    return relative_size(p, RADAU_ROWS, size, change);
}

/* Length of a first step: the states move by a hundredth of their sizes [s]. */
static double first_step(const radau_problem *p, const double *y, const double *f, double span) {
    double moved = p->tolerance * relative_size(p, RADAU_STATES, y, f);
    return copysign(fmin(fabs(span) * 1e-3, 0.01 / fmax(moved, 1e-300)), span);
}

/* Take one step towards a time and not beyond; returns whether the tolerance is met. */
static int radau_step(const radau_problem *p, radau *s, double until) {
    double time = s->end_time, left = until - time, f[RADAU_ROWS];
    double y[RADAU_ROWS], z[STAGES][RADAU_ROWS], jacobian[RADAU_STATES][RADAU_STATES] = {{0.0}};
    memcpy(y, s->end, sizeof y);
    p->rates(p->model, time, y, f, jacobian);
    int rejected = s->h == 0.0; /* a first step is estimated as carefully as a repeated one */
    double h = s->h == 0.0 ? first_step(p, y, f, left) : s->next;
    for (;;) {
        if (!(fabs(h) > 10.0 * DBL_EPSILON * fabs(time))) return 0;
        int last = fabs(h) * (1.0 + 1e-9) >= fabs(left);
        if (last) h = left;
        for (int i = 0; i < STAGES; i++) {
            if (s->h == 0.0) {
                memset(z[i], 0, sizeof z[i]);
                continue;
            }
            radau_at(s, (time + h * STAGE[i] - s->time) / s->h, z[i]);
            for (int r = 0; r < RADAU_ROWS; r++) z[i][r] -= y[r];
        }
        int iterations = solve_stages(p, time, h, y, jacobian, z);
        if (!iterations) {
            h *= 0.5;
            rejected = 1;
            continue;
        }
        double error = error_of(p, time, h, y, f, jacobian, z, rejected);
        double safety = 0.9 * (2.0 * MAX_ITERATIONS + 1.0) / (2.0 * MAX_ITERATIONS + iterations);
        double factor = error > 0.0 ? pow(error, -0.25) : 10.0;
        if (!(error < 1.0)) {
            h *= fmax(0.2, safety * (error <= DBL_MAX ? factor : 0.0));
            rejected = 1;
            continue;
        }
        if (s->h != 0.0 && error > 0.0) /* as the error grew in the last step, it will again */
            factor *= fmin(1.0, h / s->h * pow(s->error / error, 0.25));
        s->next = h * fmin(10.0, safety * factor);
        s->time = time;
        s->h = h;
        s->error = fmax(error, 1e-10);
        memcpy(s->y, y, sizeof y);
        memcpy(s->z, z, sizeof z);
        for (int r = 0; r < RADAU_ROWS; r++) s->end[r] = y[r] + z[2][r];
        s->end_time = last ? until : time + h;
        return 1;
    }
}

#endif
