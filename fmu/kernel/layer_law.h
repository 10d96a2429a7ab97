/* Coordinate and approximate law of a line contact with a layer, see creep_table.h. */
#ifndef LAYER_LAW_H
#define LAYER_LAW_H

#include <math.h>

#include "line_law.h"
#include "simd_math.h"

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
} layer_place;

/* With a k_hat of 0 that the compiler knows, what follows from it takes no time. */
ALWAYS_INLINE layer_place layer_place_at(double t, double k_hat, double lam) {
    layer_place at;
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
    if (k_hat == 0.0) return at;
    double square = 1.0 + at.a * (1.0 + p);
    at.r = sqrt(square);
    at.y = k_hat * (t * at.r);
    at.stretch = 2.0 * (at.a * p) / square;
    at.by_t += at.y * (1.0 + at.stretch);
    return at;
}

/* Solve x = m + l + y for 1e-280 <= x <= 1e60 by Halley's method inside a bracket. It starts from
 * the law without a layer, whose k_hat is (l + y)/t at a bound of t. */
ALWAYS_INLINE layer_place solve_layer_place(double x, double k_hat, double lam) {
    double high = sqrt(x / lam), low = 0.0, a = 1.5707963267948966 * lam;
    if (k_hat > 0.0) {
        high = smaller(high, x / (k_hat * sqrt(1.0 + a)));
        high = smaller(high, cube_root(x / (k_hat * sqrt(a))));
    }
    high *= 1.001; /* more than its rounding */
    layer_place at = layer_place_at(high, k_hat, lam);
    double t = smaller(high, coordinate_start(x, (at.l + at.y) / high));
    for (int i = 0; i < 100; i++) {
        at = layer_place_at(t, k_hat, lam);
        double near = (at.m - x) + (at.l + at.y), far = ((at.l + at.y) - (x - 1.0)) - at.s;
        double off = t < 1.0 ? near : far, inverse = 1.0 / at.by_t, more = 1.0 + at.stretch;
        double bend = 16.0 * at.m * at.s * (at.s - at.m) + 4.0 * at.l; /* d2x/d(ln t)2 */
        bend += at.y * (more * more + at.stretch * (4.0 - 2.0 * at.stretch));
        double newton = off * inverse;
        double next = t - t * (newton / (1.0 - 0.5 * newton * (bend * inverse - 1.0)));
        if (off > 0.0) high = t;
        else low = t;
        if (!(next >= low && next <= high)) next = low > 0.0 ? sqrt(low * high) : 0.25 * high;
        int done = fabs(next - t) <= 1e-5 * t; /* the next error is the cube of this step */
        t = next;
        if (done) break;
    }
    return layer_place_at(t, k_hat, lam);
}

/* q without H. sqrt(m) is t^2 sqrt(s) where t^4 is below any number, too. */
ALWAYS_INLINE double layer_base(const layer_place *at) {
    double share = at->a / (1.0 + at->a), s = at->s, root_m = at->t * at->t * sqrt(s);
    double clean = at->m * (1.0 + s), springs = root_m * (1.0 + s * (0.5 - LAYER_LIFT * s));
    return (1.0 - share) * clean + share * springs + 2.0 * at->k_hat * at->t * s / at->r;
}

/* Factor of x H. */
ALWAYS_INLINE double layer_weight(const layer_place *at) {
    double rest = 1.0 / (1.0 + at->t), square = rest * rest;
    return square * square / (1.0 + at->a);
}

typedef struct {
    double ratio, slope, log_k, log_layer;
} layer_value;

/* q and its derivatives from H and its derivatives by ln t, ln(k_hat) and ln(lam). */
ALWAYS_INLINE layer_value layer_law(const layer_place *at, double x, const double h[4]) {
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
