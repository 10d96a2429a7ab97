/* The formulas of force in the plane, with exact derivatives. */
#ifndef PLANE_FORMULA_H
#define PLANE_FORMULA_H

#include <math.h>

#include "branch_free.h"
#include "plane_law.h"
#include "softening.h"
#include "table_points.h"

/* A number with its derivatives by the three creepages and by ln(k_hat). */
enum { DIRECTIONS = 4 };
typedef struct {
    double v, d[DIRECTIONS];
} dual;

ALWAYS_INLINE dual constant(double v) { return (dual){.v = v}; }

/* A function of a dual, from its value and its derivative. */
ALWAYS_INLINE dual chain(dual a, double v, double slope) {
    for (int i = 0; i < DIRECTIONS; i++) a.d[i] *= slope;
    a.v = v;
    return a;
}

ALWAYS_INLINE dual add(dual a, dual b) {
    for (int i = 0; i < DIRECTIONS; i++) a.d[i] += b.d[i];
    a.v += b.v;
    return a;
}

ALWAYS_INLINE dual times(dual a, dual b) {
    for (int i = 0; i < DIRECTIONS; i++) a.d[i] = a.d[i] * b.v + a.v * b.d[i];
    a.v *= b.v;
    return a;
}

ALWAYS_INLINE dual scale(dual a, double factor) { return chain(a, a.v * factor, factor); }
ALWAYS_INLINE dual inverse(dual a) { return chain(a, 1.0 / a.v, -1.0 / (a.v * a.v)); }
ALWAYS_INLINE dual square(dual a) { return chain(a, a.v * a.v, 2.0 * a.v); }

ALWAYS_INLINE dual root(dual a) {
    double r = sqrt(a.v);
    return chain(a, r, 0.5 / r);
}

/* q of the law in strips at a creepage and k_hat above zero. */
static inline dual law_ratio(const creep_table *table, dual x, dual k_hat) {
    creep_value q;
    evaluate_points(table, 1, &x.v, &k_hat.v, &q.traction_ratio, &q.slope, &q.log_k_derivative);
    double by_k = k_hat.v > 0.0 ? q.log_k_derivative / k_hat.v : 0.0;
    for (int i = 0; i < DIRECTIONS; i++) x.d[i] = q.slope * x.d[i] + by_k * k_hat.d[i];
    x.v = q.traction_ratio;
    return x;
}

ALWAYS_INLINE dual held_of(dual softening, dual size) {
    held_creepage held = held_up_to_saturation(softening.v, size.v);
    return add(chain(size, held.value, held.by_size), chain(softening, 0.0, held.by_softening));
}

/* 12 coefficients of a row, from all sets. */
ALWAYS_INLINE void blended(const plane_shape *shape, size_t first, double row[12]) {
    const double *from = shape->coefficients + first;
    for (int k = 0; k < 12; k++) row[k] = shape->share[0] * from[k];
    for (int i = 1; i < shape->sets; i++)
        for (int k = 0; k < 12; k++)
            row[k] += shape->share[i] * from[(size_t)i * PLANE_COEFFICIENTS + (size_t)k];
}

/* Values of the spline at u, of which the first and last are not negative. */
static inline void spline(const plane_shape *shape, const double u[3], double value[3],
                          double by_u[3][3]) {
    enum { N = PLANE_CELLS, HALF = PLANE_CELLS / 2 };
    double w[3][4], d[3][4];
    uint32_t cell[3];
    for (int i = 0; i < 3; i++) {
        double fraction, position = i == 1 ? (1.0 + u[i]) * HALF : u[i] * HALF;
        cell[i] = locate(position, i == 1 ? N : HALF, &fraction);
        basis(fraction, w[i], d[i]);
        for (int j = 0; j < 4; j++) d[i][j] *= HALF;
    }
    double sum[3] = {0.0}, by[3][3] = {{0.0}};
    for (uint32_t i = 0; i < 4; i++) {
        double plane[3] = {0.0}, plane_y[3] = {0.0}, plane_z[3] = {0.0};
        for (uint32_t j = 0; j < 4; j++) {
            double row[12];
            blended(shape, (((cell[0] + i) * (N + 3) + cell[1] + j) * (HALF + 3) + cell[2]) * 3,
                    row);
            for (int k = 0; k < 3; k++) {
                double at = row[k] * w[2][0] + row[3 + k] * w[2][1] + row[6 + k] * w[2][2] +
                            row[9 + k] * w[2][3];
                double along = row[k] * d[2][0] + row[3 + k] * d[2][1] + row[6 + k] * d[2][2] +
                               row[9 + k] * d[2][3];
                plane[k] += w[1][j] * at;
                plane_y[k] += d[1][j] * at;
                plane_z[k] += w[1][j] * along;
            }
        }
        for (int k = 0; k < 3; k++) {
            sum[k] += w[0][i] * plane[k];
            by[k][0] += d[0][i] * plane[k];
            by[k][1] += w[0][i] * plane_y[k];
            by[k][2] += w[0][i] * plane_z[k];
        }
    }
    for (int k = 0; k < 3; k++) {
        value[k] = sum[k];
        for (int i = 0; i < 3; i++) by_u[k][i] = by[k][i];
    }
}

/* What spin adds, and the moment: a spline over u = l/(1/2 + sqrt(l^2 + 1/4)). Mirror images give
 * the other halves. */
static inline void add_spin(const plane_shape *shape, dual l[3], dual friction, dual force[3]) {
    dual less = inverse(friction), size = constant(0.25), u[3];
    for (int i = 0; i < 3; i++) {
        l[i] = times(l[i], less);
        size = add(size, square(l[i]));
    }
    dual shrink = inverse(add(constant(0.5), root(size)));
    for (int i = 0; i < 3; i++) u[i] = times(l[i], shrink);
    int turned = u[2].v < 0.0 || (u[2].v == 0.0 && u[1].v < 0.0);
    double along = u[0].v < 0.0 ? -1.0 : 1.0, turn = turned ? -1.0 : 1.0;
    double place[3] = {along * u[0].v, turn * u[1].v, turn * u[2].v}, value[3], by_u[3][3];
    spline(shape, place, value, by_u);
    double mirror[3] = {along, turn, turn}, sign[3] = {along, turn, turn};
    for (int k = 0; k < 3; k++) {
        dual part = constant(sign[k] * value[k]);
        for (int i = 0; i < 3; i++)
            for (int m = 0; m < DIRECTIONS; m++)
                part.d[m] += sign[k] * by_u[k][i] * mirror[i] * u[i].d[m];
        force[k] = add(force[k], times(friction, part));
    }
}

ALWAYS_INLINE void plane_at(const creep_table *table, const plane_shape *shape,
                            const double creepage[3], double k_hat, plane_value *value) {
    static const double TINY = 1e-60; /* so that nothing is divided by zero */
    dual l[3], k = constant(k_hat);
    for (int i = 0; i < 3; i++) {
        l[i] = constant(creepage[i]);
        l[i].d[i] = 1.0;
    }
    k.d[3] = k_hat;
    double ratio = shape->stiffness_ratio;
    dual xx = square(l[0]), yy = square(l[1]), ss = square(l[2]);
    dual total = add(add(xx, yy), add(ss, constant(TINY))), per = inverse(total);
    dual size = root(total);

    /* Stiffness and softening are those of the directions, by their shares. */
    dual share_y = times(add(yy, scale(ss, 0.5)), per);
    dual softening =
        add(constant(shape->softening_x), scale(share_y, shape->softening_y - shape->softening_x));
    dual left = add(constant(1.0), scale(times(softening, held_of(softening, size)), -1.0));
    dual stiffness = add(constant(1.0), scale(share_y, ratio - 1.0));
    dual k_there = k_hat > 0.0 ? times(k, root(times(stiffness, left))) : constant(0.0);
    dual x = times(size, left), q = law_ratio(table, x, k_there);

    /* The direction turns from that of stick to that of the creepage. */
    dual weak = times(size, inverse(add(constant(1.0), scale(k, 1.8)))),
         cube = times(weak, square(weak));
    dual turned = times(cube, inverse(add(add(cube, scale(square(weak), 0.092)), constant(0.821))));
    dual force[3] = {l[0], times(l[1], add(constant(1.0), scale(turned, 1.0 / ratio - 1.0))),
                     constant(0.0)};
    dual length = root(add(add(square(force[0]), square(force[1])), add(ss, constant(TINY))));
    dual per_length = times(q, inverse(length));
    for (int i = 0; i < 2; i++) force[i] = times(force[i], per_length);

    if (shape->coefficients != NULL) {
        dual friction = constant(1.0);
        if (k_hat > 0.0 && q.v > 0.0)
            friction = times(q, inverse(law_ratio(table, x, constant(0.0))));
        dual of_spin[3] = {constant(0.0), constant(0.0), constant(0.0)};
        add_spin(shape, l, friction, of_spin);
        /* What is zero by symmetry is so to the last bit. */
        for (int i = 0; i < 2 && creepage[2] == 0.0; i++)
            of_spin[i] = (dual){.d = {0.0, 0.0, of_spin[i].d[2], 0.0}};
        if (creepage[1] == 0.0 && creepage[2] == 0.0)
            of_spin[2] = (dual){.d = {0.0, of_spin[2].d[1], of_spin[2].d[2], 0.0}};
        for (int i = 0; i < 3; i++) force[i] = add(force[i], of_spin[i]);
    }
    for (int i = 0; i < 3; i++) {
        value->force[i] = force[i].v;
        for (int j = 0; j < 3; j++) value->by_creepage[i][j] = force[i].d[j];
        value->by_log_k[i] = force[i].d[3];
    }
}

#endif
