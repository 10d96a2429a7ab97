/* Time integration of a few stiff differential equations, stable at any step, for LANES systems at
 * once. Define LANES before including this file.
 *
 * Rodas3: a linearly implicit Rosenbrock method of four stages and third order, L-stable and
 * stiffly accurate, with an embedded second-order solution that controls the substeps. It needs
 * the exact Jacobian and no iteration. Each lane has its own substeps and the same bits as alone.
 *
 * A. Sandu, J. G. Verwer, J. G. Blom, E. J. Spee, G. R. Carmichael & F. A. Potra, "Benchmarking
 * stiff ODE solvers for atmospheric chemistry problems II: Rosenbrock solvers", Atmospheric
 * Environment 31 (1997) 3459-3472. */
#ifndef ROSENBROCK_H
#define ROSENBROCK_H

#include <math.h>
#include <stddef.h>

#include "branch_free.h"

enum { MOST_STATES = 7, MOST_ROWS = 12, MOST_SUBSTEPS = 100000 };

typedef double lanes[LANES];
typedef lanes rows[MOST_ROWS];
typedef lanes matrix[MOST_ROWS][MOST_STATES];

/* A loop over the lanes; it tells the compiler that the lanes are independent. */
#if LANES == 1
#define EACH_LANE(l) for (int l = 0; l < LANES; l++)
#elif defined(__clang__)
#define EACH_LANE(l)                                                                               \
    _Pragma(                                                                                       \
        "clang loop vectorize(assume_safety) interleave_count(2) unroll(disable)") for (int l = 0; \
                                                                                        l < LANES; \
                                                                                        l++)
#elif defined(__GNUC__)
#define EACH_LANE(l) _Pragma("GCC ivdep") for (int l = 0; l < LANES; l++)
#else
#define EACH_LANE(l) for (int l = 0; l < LANES; l++)
#endif

/* Equations y' = f(y). The first rows are states; the others are integrals such as works, on which
 * no rate depends. */
typedef struct {
    int states, rows;
    int place[MOST_ROWS]; /* of each row in y, f and the Jacobian; below MOST_STATES for a state */
    void *model;
    /* Rates of all rows and, unless jacobian is NULL, their derivatives by the states. */
    void (*rates)(void *model, lanes *y, lanes *f, matrix *jacobian);
    /* Relative size of an error of y, to be compared with the tolerance. */
    void (*error_size)(void *model, lanes *y, lanes *error, lanes size);
} equations;

/* Factorize a = l u in place, with an inverted diagonal. Rows are not exchanged: the diagonal holds
 * 2/h, and if a growing mode cancels it, the error control takes a shorter substep. */
static inline void factorize(int n, lanes a[MOST_STATES][MOST_STATES]) {
    for (int k = 0; k < n; k++) {
        EACH_LANE (l) a[k][k][l] = 1.0 / a[k][k][l];
        for (int i = k + 1; i < n; i++) {
            EACH_LANE (l) a[i][k][l] *= a[k][k][l];
            for (int c = k + 1; c < n; c++)
                EACH_LANE (l) a[i][c][l] -= a[i][k][l] * a[k][c][l];
        }
    }
}

static inline void solve(int n, lanes lu[MOST_STATES][MOST_STATES], lanes b[MOST_ROWS],
                         lanes x[MOST_ROWS]) {
    for (int i = 0; i < n; i++) {
        EACH_LANE (l) x[i][l] = b[i][l];
        for (int c = 0; c < i; c++)
            EACH_LANE (l) x[i][l] -= lu[i][c][l] * x[c][l];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int c = i + 1; c < n; c++)
            EACH_LANE (l) x[i][l] -= lu[i][c][l] * x[c][l];
        EACH_LANE (l) x[i][l] *= lu[i][i][l];
    }
}

/* Jacobian, factors of 2/h - J and length of one substep. */
typedef struct {
    const equations *problem;
    matrix *j;
    lanes lu[MOST_STATES][MOST_STATES];
    lanes h, inverse; /* [s, 1/s] */
} factors;

/* Solve (2/h - J) k = b. J has no columns for the integrals, so their k follows from the states'.
 */
static inline void stage(factors *s, rows b, rows k) {
    const equations *p = s->problem;
    solve(p->states, s->lu, b, k);
    for (int i = p->states; i < p->rows; i++) {
        EACH_LANE (l) k[i][l] = b[i][l];
        for (int c = 0; c < p->states; c++)
            EACH_LANE (l) k[i][l] += (*s->j)[p->place[i]][p->place[c]][l] * k[c][l];
        EACH_LANE (l) k[i][l] *= 0.5 * s->h[l];
    }
}

/* One substep from y, with known rates f and Jacobian; sets the next y and its estimated error. */
static inline void rodas3(factors *s, rows y, rows f, rows next, rows error) {
    const equations *p = s->problem;
    int n = p->states;
    rows b = {{0.0}}, k1, k2, k3, k4, g; /* set, as compilers do not see that rows >= states */
    for (int i = 0; i < n; i++)
        for (int c = 0; c < n; c++)
            EACH_LANE (l)
                s->lu[i][c][l] = (i == c ? 2.0 * s->inverse[l] : 0.0) - /* gamma 1/2 */
                                 (*s->j)[p->place[i]][p->place[c]][l];
    factorize(n, s->lu);
    for (int i = 0; i < p->rows; i++)
        EACH_LANE (l) b[i][l] = f[p->place[i]][l];
    stage(s, b, k1);
    for (int i = 0; i < p->rows; i++)
        EACH_LANE (l) b[i][l] += 4.0 * s->inverse[l] * k1[i][l];
    stage(s, b, k2);
    for (int i = 0; i < MOST_ROWS; i++)
        EACH_LANE (l) next[i][l] = y[i][l];
    for (int i = 0; i < p->rows; i++)
        EACH_LANE (l) next[p->place[i]][l] += 2.0 * k1[i][l];
    p->rates(p->model, next, g, NULL);
    for (int i = 0; i < p->rows; i++)
        EACH_LANE (l) b[i][l] = g[p->place[i]][l] + (k1[i][l] - k2[i][l]) * s->inverse[l];
    stage(s, b, k3);
    for (int i = 0; i < p->rows; i++)
        EACH_LANE (l) next[p->place[i]][l] += k3[i][l];
    p->rates(p->model, next, g, NULL);
    for (int i = 0; i < p->rows; i++)
        EACH_LANE (l)
            b[i][l] =
                g[p->place[i]][l] + (k1[i][l] - k2[i][l] - (8.0 / 3.0) * k3[i][l]) * s->inverse[l];
    stage(s, b, k4);
    for (int i = 0; i < p->rows; i++)
        EACH_LANE (l) {
            next[p->place[i]][l] += k4[i][l];
            error[p->place[i]][l] = k4[i][l];
        }
}

/* Factor on the length of the next substep, from the last one's error over the tolerance. */
ALWAYS_INLINE double stretch_of_step(double ratio) {
    double held = smaller(larger(ratio, 1e-6), 1e6), root = rough_inverse_third_root(held);
    root = root * (4.0 - held * root * root * root) * (1.0 / 3.0); /* Newton: to 0.3 % */
    double factor = smaller(5.0, larger(0.1, 0.8 * root));
    return ratio <= 1e300 ? factor : 0.1; /* 0.1 for NaN too */
}

/* An integration under way. */
typedef struct {
    rows y;
    lanes left;  /* rest of the step [s]; a lane with no rest keeps its y */
    lanes h;     /* length to try next [s], above zero */
    lanes count; /* number of substeps */
    matrix j;    /* must start as zero: the rates set only elements that can differ from zero */
} integration;

/* Whether a lane will not finish: its rates are NaN, or it cannot meet the tolerance. */
static inline int is_hopeless(const integration *s, int l, double step) {
    return s->count[l] >= MOST_SUBSTEPS || !(s->h[l] > 1e-15 * step);
}

/* Try one substep in each lane and accept it if its error is within the tolerance. */
static inline void rosenbrock_substep(const equations *p, integration *s, double tolerance) {
    rows f, next, error;
    lanes pieces, ratio, taken;
    factors one;
    one.problem = p;
    one.j = &s->j;
    p->rates(p->model, s->y, f, &s->j);
    EACH_LANE (l) {
        int runs = s->left[l] > 0.0;
        double many = ceil(s->left[l] / s->h[l] * (1.0 - 1e-12));
        pieces[l] = runs ? many : 1.0;
        one.h[l] = runs ? s->left[l] / larger(pieces[l], 1.0) : 1.0;
        one.inverse[l] = 1.0 / one.h[l];
    }
    rodas3(&one, s->y, f, next, error);
    p->error_size(p->model, next, error, ratio);
    EACH_LANE (l) {
        double part = ratio[l] / tolerance, factor = stretch_of_step(part);
        int runs = s->left[l] > 0.0, taking = runs & (part <= 1.0);
        double longer = larger(s->h[l], one.h[l] * factor);
        double shorter = one.h[l] * smaller(factor, 0.8);
        double after = factor < 1.0 ? one.h[l] * factor : longer;
        double rest = pieces[l] > 1.0 ? s->left[l] - one.h[l] : 0.0;
        double wanted = taking ? after : shorter;
        s->h[l] = runs ? wanted : s->h[l];
        s->left[l] = taking ? rest : s->left[l];
        s->count[l] += 1.0;
        taken[l] = taking ? 1.0 : 0.0;
    }
    for (int i = 0; i < p->rows; i++) {
        double *to = s->y[p->place[i]];
        const double *from = next[p->place[i]];
        EACH_LANE (l) to[l] = taken[l] > 0.0 ? from[l] : to[l];
    }
}

#endif
