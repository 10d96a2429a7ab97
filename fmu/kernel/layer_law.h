/* Coordinate and approximate law of a line contact with a layer, see creep_table.h. */
#ifndef LAYER_LAW_H
#define LAYER_LAW_H

#include <math.h>
#include <stddef.h>

#include "line_law.h"
#include "simd_math.h"

enum { MAX_POINTS = 32 }; /* that are evaluated together */

static const double LAYER_MIDDLE = 0.6;               /* g where w is one half */
static const double MIN_LAYER = 1e-12;                /* a smaller lam counts as no layer */
static const double MAX_LAYER = 1e30;                 /* a larger one as this */
static const double MAX_LAYER_CREEPAGE = 1e60;        /* where q is 1 to the last digit */
static const double LAYER_LIFT = 0.22676045526483735; /* 3/2 - 4/pi: slope of springs at zero */

/* A state at the parameter t: x = m + l + y. */
typedef struct {
    double t, m, s, k_hat;
    double l, y;    /* lam t^2 and k_hat t r */
    double a, r;    /* (pi/2) lam, and r */
    double stretch; /* d(ln y)/d(ln t) - 1 */
    double by_t;    /* dx/d(ln t) */
} layer_point;

/* The same of bodies that weaken; else k_hat must be 0, and what follows from it takes no time. */
ALWAYS_INLINE layer_point layer_point_at(int weakens, double t, double k_hat, double lam) {
    layer_point at;
    at.t = t;
    at.k_hat = k_hat;
    at.r = 1.0;
    at.y = at.stretch = 0.0;
    double p = (t * t) * (t * t);
    at.s = 1.0 / (1.0 + p);
    at.m = p * at.s;
    at.a = 1.5707963267948966 * lam;
    at.l = lam * (t * t);
    at.by_t = 4.0 * at.m * at.s + 2.0 * at.l;
    if (!weakens) return at;
    double square = 1.0 + at.a * (1.0 + p);
    at.r = sqrt(square);
    at.y = k_hat * (t * at.r);
    at.stretch = 2.0 * (at.a * p) / square;
    at.by_t += at.y * (1.0 + at.stretch);
    return at;
}

/* Solve x = m + l + y for n points with 1e-280 <= x <= 1e60 by Halley's method inside a bracket. It
 * starts from the law without a layer, whose k_hat is (l + y)/t at a bound of t. No k_hat (NULL)
 * means 0. A point that is solved waits for the others. */
ALWAYS_INLINE void solve_layer_points(size_t n, const double *x, const double *k_hat,
                                      const double *lam, double *t) {
    double low[MAX_POINTS], high[MAX_POINTS], open[MAX_POINTS];
    const int weakens = k_hat != NULL;
    for (size_t i = 0; i < n; i++) {
        double top = sqrt(x[i] / lam[i]), k = weakens ? k_hat[i] : 0.0;
        double a = 1.5707963267948966 * lam[i];
        if (weakens) {
            top = smaller(top, x[i] / (k * sqrt(1.0 + a)));
            top = smaller(top, cube_root(x[i] / (k * sqrt(a))));
        }
        top *= 1.001; /* more than its rounding */
        layer_point at = layer_point_at(weakens, top, k, lam[i]);
        t[i] = smaller(top, coordinate_start(x[i], (at.l + at.y) / top));
        low[i] = 0.0;
        high[i] = top;
        open[i] = 1.0;
    }
    int busy = 1;
    for (int step = 0; step < 100 && busy; step++) {
        busy = 0;
        for (size_t i = 0; i < n; i++) {
            double now = t[i], least = low[i], most = high[i], left = open[i];
            layer_point at = layer_point_at(weakens, now, weakens ? k_hat[i] : 0.0, lam[i]);
            double near = (at.m - x[i]) + (at.l + at.y);
            double far = ((at.l + at.y) - (x[i] - 1.0)) - at.s, off = now < 1.0 ? near : far;
            double inverse = 1.0 / at.by_t, more = 1.0 + at.stretch;
            double bend = 16.0 * at.m * at.s * (at.s - at.m) + 4.0 * at.l; /* d2x/d(ln t)2 */
            bend += at.y * (more * more + at.stretch * (4.0 - 2.0 * at.stretch));
            double newton = off * inverse;
            double next = now - now * (newton / (1.0 - 0.5 * newton * (bend * inverse - 1.0)));
            most = off > 0.0 ? now : most;
            least = off > 0.0 ? least : now;
            double middle = least > 0.0 ? sqrt(least * most) : 0.25 * most;
            next = ((next >= least) & (next <= most)) ? next : middle;
            low[i] = least;
            high[i] = most;
            t[i] = left > 0.0 ? next : now;
            left = fabs(next - now) <= 1e-5 * now ? 0.0 : left; /* the next error is its cube */
            open[i] = left;
            busy |= left > 0.0;
        }
    }
}

/* q without H. sqrt(m) is t^2 sqrt(s) where t^4 is below any number, too. */
ALWAYS_INLINE double layer_base(const layer_point *at) {
    double share = at->a / (1.0 + at->a), s = at->s, root_m = at->t * at->t * sqrt(s);
    double clean = at->m * (1.0 + s), springs = root_m * (1.0 + s * (0.5 - LAYER_LIFT * s));
    return (1.0 - share) * clean + share * springs + 2.0 * at->k_hat * at->t * s / at->r;
}

/* Factor of x H. */
ALWAYS_INLINE double layer_weight(const layer_point *at) {
    double rest = 1.0 / (1.0 + at->t), square = rest * rest;
    return square * square / (1.0 + at->a);
}

typedef struct {
    double ratio, slope, log_k, log_layer;
} layer_value;

/* q and its derivatives from H and its derivatives by ln t, ln(k_hat) and ln(lam). */
ALWAYS_INLINE layer_value layer_law(const layer_point *at, double x, const double h[4]) {
    double m = at->m, s = at->s, per = 1.0 / (1.0 + at->a), share = at->a * per;
    double root_m = at->t * at->t * sqrt(s);
    double weakening = 2.0 * at->k_hat * at->t * s / at->r;
    double springs = 1.0 + s * (0.5 - LAYER_LIFT * s), clean = m * (1.0 + s);
    double weighed = x * layer_weight(at), u = at->t / (1.0 + at->t);
    /* Derivatives at fixed x. */
    double by_t = (1.0 - share) * 8.0 * m * s * s + weakening * (1.0 - 4.0 * m - at->stretch) +
                  share * root_m * s * (2.0 * springs - 4.0 * m * (0.5 - 2.0 * LAYER_LIFT * s)) +
                  weighed * (h[1] - 4.0 * u * h[0]);
    double by_k = weakening + weighed * h[2], grown = 1.0 - 1.0 / (at->r * at->r);
    double by_layer = share * per * (root_m * springs - clean) - 0.5 * weakening * grown +
                      weighed * (h[3] - share * h[0]);
    double turn = by_t / at->by_t; /* by x through t */
    layer_value q;
    q.ratio = layer_base(at) + weighed * h[0];
    q.slope = turn + layer_weight(at) * h[0];
    q.log_k = by_k - turn * at->y;
    q.log_layer = by_layer - turn * (at->l + 0.5 * at->y * grown);
    return q;
}

#endif
