#include "rosenbrock.h"

#include <math.h>
#include <stddef.h>

enum { MOST_SUBSTEPS = 100000 };

typedef double matrix[MOST_ROWS][MOST_STATES];

/* a = l u in place, rows exchanged as order says. */
static void factorize(int n, matrix a, int order[MOST_STATES]) {
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

static void solve(int n, matrix lu, const int order[MOST_STATES], const double *b, double *x) {
    for (int i = 0; i < n; i++) {
        x[i] = b[order[i]];
        for (int c = 0; c < i; c++) x[i] -= lu[order[i]][c] * x[c];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int c = i + 1; c < n; c++) x[i] -= lu[order[i]][c] * x[c];
        x[i] /= lu[order[i]][i];
    }
}

/* (2/h - J) k = b. The integrals' own part of J is zero, so the states' part of k gives theirs. */
static void stage(const equations *p, double h, matrix lu, const int order[MOST_STATES], matrix j,
                  const double *b, double *k) {
    solve(p->states, lu, order, b, k);
    for (int i = p->states; i < p->rows; i++) {
        double sum = b[i];
        for (int c = 0; c < p->states; c++) sum += j[i][c] * k[c];
        k[i] = 0.5 * h * sum;
    }
}

/* One substep of length h from y, where rates and Jacobian are known; the estimated error beside.
 */
static void rodas3(const equations *p, double h, const double *y, const double *f, matrix j,
                   double *next, double *error) {
    int n = p->states, rows = p->rows, order[MOST_STATES];
    matrix e;
    double b[MOST_ROWS], k1[MOST_ROWS], k2[MOST_ROWS], k3[MOST_ROWS], g[MOST_ROWS];
    for (int i = 0; i < n; i++)
        for (int c = 0; c < n; c++) e[i][c] = (i == c ? 2.0 / h : 0.0) - j[i][c]; /* gamma 1/2 */
    factorize(n, e, order);
    stage(p, h, e, order, j, f, k1);
    for (int i = 0; i < rows; i++) b[i] = f[i] + 4.0 / h * k1[i];
    stage(p, h, e, order, j, b, k2);
    for (int i = 0; i < rows; i++) next[i] = y[i] + 2.0 * k1[i];
    p->rates(p->model, next, g, NULL);
    for (int i = 0; i < rows; i++) b[i] = g[i] + (k1[i] - k2[i]) / h;
    stage(p, h, e, order, j, b, k3);
    for (int i = 0; i < rows; i++) next[i] += k3[i];
    p->rates(p->model, next, g, NULL);
    for (int i = 0; i < rows; i++) b[i] = g[i] + (k1[i] - k2[i] - 8.0 / 3.0 * k3[i]) / h;
    stage(p, h, e, order, j, b, error);
    for (int i = 0; i < rows; i++) next[i] += error[i];
}

const char *rosenbrock_advance(const equations *p, double *state, double step, double tolerance,
                               double *substep) {
    double y[MOST_ROWS], f[MOST_ROWS], next[MOST_ROWS], error[MOST_ROWS];
    matrix j;
    double h = *substep > 0.0 ? *substep : step, left = step;
    for (int i = 0; i < p->rows; i++) y[i] = state[i];
    p->rates(p->model, y, f, j);
    for (int i = 0; i < MOST_SUBSTEPS; i++) {
        double pieces = ceil(left / h * (1.0 - 1e-12)),
               length = pieces > 1.0 ? left / pieces : left;
        rodas3(p, length, y, f, j, next, error);
        double ratio = p->error_size(p->model, next, error) / tolerance;
        double factor = 0.1; /* if the ratio is not a number */
        if (isfinite(ratio)) factor = fmin(5.0, fmax(0.1, 0.8 / cbrt(fmax(ratio, 1e-6))));
        if (!(ratio <= 1.0)) {
            h = length * fmin(factor, 0.8);
            continue;
        }
        for (int s = 0; s < p->rows; s++) y[s] = next[s];
        left = pieces > 1.0 ? left - length : 0.0;
        h = factor < 1.0 ? length * factor : fmax(h, length * factor);
        if (left == 0.0) {
            for (int s = 0; s < p->rows; s++) state[s] = y[s];
            *substep = h;
            return NULL;
        }
        p->rates(p->model, y, f, j);
    }
    return "the tolerance is not met within 100000 substeps";
}
