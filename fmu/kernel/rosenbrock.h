/* Time integration of a few stiff differential equations, stable at any step, for LANES systems at
 * once.
 *
 * Linearly implicit Rosenbrock methods, L-stable and stiffly accurate, whose embedded solution
 * controls the substeps. They need the exact Jacobian and no iteration. Each lane has its own
 * substeps and the same bits as alone.
 *
 * Rodas3, four stages of third order, where the tolerance is coarse: A. Sandu, J. G. Verwer, J. G.
 * Blom, E. J. Spee, G. R. Carmichael & F. A. Potra, "Benchmarking stiff ODE solvers for atmospheric
 * chemistry problems II: Rosenbrock solvers", Atmospheric Environment 31 (1997) 3459-3472.
 *
 * Rodas5P, eight stages of fifth order, where it is fine: G. Steinebach, "Construction of
 * Rosenbrock-Wanner method Rodas5P and numerical benchmarks within the Julia Differential Equations
 * package", BIT Numerical Mathematics 63 (2023) 27. */
#ifndef ROSENBROCK_H
#define ROSENBROCK_H

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "lanes.h"
#include "simd_math.h"

enum { MAX_STATES = 14, MAX_ROWS = 19, MAX_SUBSTEPS = 100000 };

typedef lanes rows[MAX_ROWS];
typedef lanes matrix[MAX_ROWS][MAX_STATES];

/* Equations y' = f(y). The first rows are states; the others are integrals such as works, on which
 * no rate depends. Neighbouring lanes may be parts of one system that share its last state: they
 * have the same value and rate of it, and the Jacobian's row of it is that of each part. */
typedef struct {
    int states, rows;
    int parts;           /* of one system, in as many lanes; 1 if each lane is a system */
    int place[MAX_ROWS]; /* of each row in y, f and the Jacobian; below MAX_STATES for a state */
    void *model;
    /* Rates of all rows and, unless jacobian is NULL, their derivatives by the states. */
    void (*rates)(void *model, lanes *y, lanes *f, matrix *jacobian);
    /* Relative size of an error of y, to be compared with the tolerance. */
    void (*error_size)(void *model, lanes *y, lanes *error, lanes size);
} equations;

/* Number of lanes with systems; others stay idle. */
static inline int lanes_used(const equations *p) { return LANES - LANES % p->parts; }

/* Whether a lane has the first part of a system. */
static inline int is_first(const equations *p, int l) {
    return l >= lanes_used(p) || l % p->parts == 0;
}

/* Give each part of a system the sum over its parts. */
static inline void add_parts(const equations *p, lanes x) {
    for (int first = 0; p->parts > 1 && first < lanes_used(p); first += p->parts) {
        double sum = 0.0;
        for (int i = 0; i < p->parts; i++) sum += x[first + i];
        for (int i = 0; i < p->parts; i++) x[first + i] = sum;
    }
}

/* Give each part of a system the largest of its numbers, or NaN. */
static inline void spread_largest(const equations *p, lanes x) {
    for (int first = 0; p->parts > 1 && first < lanes_used(p); first += p->parts) {
        double most = 0.0;
        for (int i = 0; i < p->parts; i++) most = x[first + i] <= most ? most : x[first + i];
        for (int i = 0; i < p->parts; i++) x[first + i] = most;
    }
}

/* Factorize a = l u in place, with an inverted diagonal. The last pivot of a system with parts is
 * the sum of theirs (a Schur complement), as no other state of a part depends on another part. Rows
 * are not exchanged: the diagonal holds 1/(gamma h), and if a growing mode cancels it, the error
 * control takes a shorter substep. */
static inline void factorize(const equations *p, lanes a[MAX_STATES][MAX_STATES]) {
    int n = p->states;
    for (int k = 0; k < n; k++) {
        if (k == n - 1) add_parts(p, a[k][k]);
        EACH_LANE (l) a[k][k][l] = 1.0 / a[k][k][l];
        for (int i = k + 1; i < n; i++) {
            EACH_LANE (l) a[i][k][l] *= a[k][k][l];
            for (int c = k + 1; c < n; c++)
                EACH_LANE (l) a[i][c][l] -= a[i][k][l] * a[k][c][l];
        }
    }
}

static inline void solve(const equations *p, lanes lu[MAX_STATES][MAX_STATES], lanes b[MAX_ROWS],
                         lanes x[MAX_ROWS]) {
    int n = p->states;
    for (int i = 0; i < n; i++) {
        EACH_LANE (l) x[i][l] = b[i][l];
        for (int l = 0; i == n - 1 && l < LANES; l++)
            if (!is_first(p, l)) x[i][l] = 0.0;
        for (int c = 0; c < i; c++)
            EACH_LANE (l) x[i][l] -= lu[i][c][l] * x[c][l];
    }
    add_parts(p, x[n - 1]);
    for (int i = n - 1; i >= 0; i--) {
        for (int c = i + 1; c < n; c++)
            EACH_LANE (l) x[i][l] -= lu[i][c][l] * x[c][l];
        EACH_LANE (l) x[i][l] *= lu[i][i][l];
    }
}

/* A method: stage s solves (1/(gamma h) - J) k_s = f(y + sum a_sj k_j) + sum c_sj k_j/h. The last
 * stage is the error, and completes the solution. */
enum { MAX_STAGES = 8 };
typedef struct {
    int stages;
    double gamma;
    double a[MAX_STAGES][MAX_STAGES], c[MAX_STAGES][MAX_STAGES];
} rosenbrock_method;

static const rosenbrock_method RODAS3 = {
    4,
    0.5,
    {{0.0}, {0.0}, {2.0}, {2.0, 0.0, 1.0}},
    {{0.0}, {4.0}, {1.0, -1.0}, {1.0, -1.0, -8.0 / 3.0}},
};
static const rosenbrock_method RODAS5P = {
    8,
    0.21193756319429014,
    {{0.0},
     {3.0},
     {2.849394379747939, 0.45842242204463923},
     {-6.954028509809101, 2.489845061869568, -10.358996098473584},
     {2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641},
     {-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256,
      0.030198172008377946},
     {-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256,
      0.030198172008377946, 1.0},
     {-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256,
      0.030198172008377946, 1.0, 1.0}},
    {{0.0},
     {-14.155112264123755},
     {-17.97296035885952, -2.859693295451294},
     {147.12150275711716, -1.41221402718213, 71.68940251302358},
     {165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306},
     {24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125,
      -0.6610691825249471},
     {30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783,
      -19.097331116725623, -28.087943162872662},
     {37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047,
      -40.06618937091002, -54.66780262877968, -9.48861652309627}},
};

/* Jacobian, factors of 1/(gamma h) - J and length of one substep. */
typedef struct {
    const equations *problem;
    matrix *j;
    lanes lu[MAX_STATES][MAX_STATES];
    lanes h, inverse; /* [s, 1/s] */
} factors;

/* Solve (1/(gamma h) - J) k = b. J has no columns for the integrals, so their k follows from the
 * states'. */
static void stage(factors *s, double gamma, rows b, rows k) {
    const equations *p = s->problem;
    solve(p, s->lu, b, k);
    for (int i = p->states; i < p->rows; i++) {
        EACH_LANE (l) k[i][l] = b[i][l];
        for (int c = 0; c < p->states; c++)
            EACH_LANE (l) k[i][l] += (*s->j)[p->place[i]][p->place[c]][l] * k[c][l];
        EACH_LANE (l) k[i][l] *= gamma * s->h[l];
    }
}

/* Weighted sum of the stages before one. Its number and the weights are constants where this is
 * called, so compilers remove the branches. */
ALWAYS_INLINE double stage_sum(int at, const double *w, rows *k, int i, int l) {
    double sum = 0.0;
    if (at > 0 && w[0] != 0.0) sum += w[0] * k[0][i][l];
    if (at > 1 && w[1] != 0.0) sum += w[1] * k[1][i][l];
    if (at > 2 && w[2] != 0.0) sum += w[2] * k[2][i][l];
    if (at > 3 && w[3] != 0.0) sum += w[3] * k[3][i][l];
    if (at > 4 && w[4] != 0.0) sum += w[4] * k[4][i][l];
    if (at > 5 && w[5] != 0.0) sum += w[5] * k[5][i][l];
    if (at > 6 && w[6] != 0.0) sum += w[6] * k[6][i][l];
    return sum;
}

/* One stage of a substep from y; `known` are the rates at the last stage's place. */
ALWAYS_INLINE void rosenbrock_stage(const rosenbrock_method *m, int at, factors *s, rows y,
                                    rows next, rows known, rows *k) {
    const equations *p = s->problem;
    rows b;
    if (m->a[at][0] != 0.0) {
        for (int i = 0; i < p->rows; i++) {
            int place = p->place[i];
            EACH_LANE (l) next[place][l] = y[place][l] + stage_sum(at, m->a[at], k, i, l);
        }
        p->rates(p->model, next, known, NULL);
    }
    for (int i = 0; i < p->rows; i++) {
        int place = p->place[i];
        EACH_LANE (l) b[i][l] = known[place][l] + stage_sum(at, m->c[at], k, i, l) * s->inverse[l];
    }
    stage(s, m->gamma, b, k[at]);
}

/* One substep from y, with rates f, which are overwritten, and Jacobian; sets the next y, its
 * estimated error and the stages k. */
ALWAYS_INLINE void rosenbrock_stages(const rosenbrock_method *m, factors *s, rows y, rows f,
                                     rows next, rows error, rows *k) {
    const equations *p = s->problem;
    for (int i = 0; i < p->states; i++)
        for (int c = 0; c < p->states; c++)
            EACH_LANE (l)
                s->lu[i][c][l] = (i == c ? 1.0 / m->gamma * s->inverse[l] : 0.0) -
                                 (*s->j)[p->place[i]][p->place[c]][l];
    lanes *last = &s->lu[p->states - 1][p->states - 1];
    for (int l = 0; l < LANES; l++)
        if (!is_first(p, l)) (*last)[l] -= 1.0 / m->gamma * s->inverse[l];
    factorize(p, s->lu);
    memcpy(next, y, sizeof(rows));
    rosenbrock_stage(m, 0, s, y, next, f, k);
    rosenbrock_stage(m, 1, s, y, next, f, k);
    rosenbrock_stage(m, 2, s, y, next, f, k);
    rosenbrock_stage(m, 3, s, y, next, f, k);
    if (m->stages > 4) {
        rosenbrock_stage(m, 4, s, y, next, f, k);
        rosenbrock_stage(m, 5, s, y, next, f, k);
        rosenbrock_stage(m, 6, s, y, next, f, k);
        rosenbrock_stage(m, 7, s, y, next, f, k);
    }
    for (int i = 0; i < p->rows; i++)
        EACH_LANE (l) {
            next[p->place[i]][l] += k[m->stages - 1][i][l];
            error[p->place[i]][l] = k[m->stages - 1][i][l];
        }
}

static void rodas3(factors *s, rows y, rows f, rows next, rows error, rows *k) {
    rosenbrock_stages(&RODAS3, s, y, f, next, error, k);
}

static void rodas5p(factors *s, rows y, rows f, rows next, rows error, rows *k) {
    rosenbrock_stages(&RODAS5P, s, y, f, next, error, k);
}

/* Factor on the length of the next substep, from the last one's error over the tolerance. */
ALWAYS_INLINE double stretch_of_step(double ratio, int fine) {
    double held = smaller(larger(ratio, 1e-6), 1e6), root;
    if (fine) { /* Newton's steps: to 0.3 % */
        root = rough_inverse_fifth_root(held);
        root = root * (6.0 - held * root * root * root * root * root) * 0.2;
    } else {
        root = rough_inverse_third_root(held);
        root = root * (4.0 - held * root * root * root) * (1.0 / 3.0);
    }
    double factor = smaller(5.0, larger(0.1, 0.8 * root));
    return ratio <= 1e300 ? factor : 0.1; /* 0.1 for NaN too */
}

/* Tolerance below which the method of fifth order is faster, also where nothing changes fast. */
#define FINE 3e-7

/* An integration under way. */
typedef struct {
    rows y;
    lanes left;  /* rest of the step [s]; a lane with no rest keeps its y */
    lanes h;     /* length to try next [s], above zero */
    lanes count; /* number of substeps */
    lanes error; /* relative size of the last one's, as the equations measure it */
    matrix j;    /* starts as zero where the rates do not set it */
} integration;

/* Whether a lane will not finish: its rates are NaN, or it cannot meet the tolerance. */
static inline int is_hopeless(const integration *s, int l, double step) {
    return s->count[l] >= MAX_SUBSTEPS || !(s->h[l] > 1e-15 * step);
}

/* Try one substep in each lane and accept it if its error is within the tolerance. */
static inline void rosenbrock_substep(const equations *p, integration *s, double tolerance) {
    rows f, next, error, k[MAX_STAGES];
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
    int fine = tolerance < FINE;
    if (fine) rodas5p(&one, s->y, f, next, error, k);
    else rodas3(&one, s->y, f, next, error, k);
    p->error_size(p->model, next, error, ratio);
    spread_largest(p, ratio);
    EACH_LANE (l) {
        double part = ratio[l] / tolerance, factor = stretch_of_step(part, fine);
        int runs = s->left[l] > 0.0, taking = runs & (part <= 1.0);
        double longer = larger(s->h[l], one.h[l] * factor);
        double shorter = one.h[l] * smaller(factor, 0.8);
        double after = factor < 1.0 ? one.h[l] * factor : longer;
        double rest = pieces[l] > 1.0 ? s->left[l] - one.h[l] : 0.0;
        double next_step = taking ? after : shorter;
        s->h[l] = runs ? next_step : s->h[l];
        s->left[l] = taking ? rest : s->left[l];
        s->count[l] += 1.0;
        s->error[l] = ratio[l];
        taken[l] = taking ? 1.0 : 0.0;
    }
    for (int i = 0; i < p->rows; i++) {
        double *to = s->y[p->place[i]];
        const double *from = next[p->place[i]];
        EACH_LANE (l) to[l] = taken[l] > 0.0 ? from[l] : to[l];
    }
}

#endif
