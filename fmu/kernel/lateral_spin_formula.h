/* The formulas of lateral_spin_law.h, with exact derivatives. */
#ifndef LATERAL_SPIN_FORMULA_H
#define LATERAL_SPIN_FORMULA_H

#include <math.h>
#include <string.h>

#include "lateral_spin_law.h"
#include "simd_math.h"
#include "stiffness.h"
#include "table_points.h"

/* Where the splines are evaluated: cell and weights in each direction, also of derivatives by u. */
typedef struct {
    size_t cell[3];
    double weight[3][4], slope[3][4];
    int without_spin, one_set;
} lateral_spin_cell;

/* Splines of both forces and the moment, then of a second term, and their derivatives by u. */
typedef struct {
    double value[6], by_u[3][6];
} spline_values;

ALWAYS_INLINE void find_cell(double u, int cells, lateral_spin_cell *at, int direction) {
    double fraction, *slope = at->slope[direction], per_u = 0.5 * LATERAL_SPIN_CELLS;
    at->cell[direction] = locate(u * per_u, (uint32_t)cells, &fraction);
    basis(fraction, at->weight[direction], slope);
    for (int j = 0; j < 4; j++) slope[j] *= per_u;
}

/* Weighted sum of one coefficient over the sets. */
ALWAYS_INLINE double blended(const lateral_spin_shape *shape, int one_set, const double *from) {
    double number = shape->share[0] * from[0];
    for (int i = 1; i < 4 && !one_set; i++)
        number += shape->share[i] * from[i * LATERAL_SPIN_COEFFICIENTS];
    return number;
}

/* Weighted sum of four numbers. */
ALWAYS_INLINE double weighted(const double weight[4], double a, double b, double c, double d) {
    return weight[0] * a + weight[1] * b + weight[2] * c + weight[3] * d;
}

/* Sums over 4 x 4 rows of coefficients, weighted by the splines along u[0] and u[1], and their
 * derivatives. */
ALWAYS_INLINE void sum_rows(const lateral_spin_shape *shape, const lateral_spin_cell *at,
                            const double *first, size_t row_length, int width, double sum[3][24]) {
    double value[4][24], across[4][24];
    first += (at->cell[0] * (LATERAL_SPIN_CELLS + 3) + at->cell[1]) * row_length;
    for (size_t i = 0; i < 4; i++, first += (LATERAL_SPIN_CELLS + 3) * row_length)
        for (int c = 0; c < width; c++) {
            const double *from = first + c;
            double row_0 = blended(shape, at->one_set, from),
                   row_1 = blended(shape, at->one_set, from + row_length),
                   row_2 = blended(shape, at->one_set, from + 2 * row_length),
                   row_3 = blended(shape, at->one_set, from + 3 * row_length);
            value[i][c] = weighted(at->weight[1], row_0, row_1, row_2, row_3);
            across[i][c] = weighted(at->slope[1], row_0, row_1, row_2, row_3);
        }
    const double *w = at->weight[0], *d = at->slope[0];
    for (int c = 0; c < width; c++) {
        sum[0][c] = weighted(w, value[0][c], value[1][c], value[2][c], value[3][c]);
        sum[1][c] = weighted(d, value[0][c], value[1][c], value[2][c], value[3][c]);
        sum[2][c] = weighted(w, across[0][c], across[1][c], across[2][c], across[3][c]);
    }
}

/* One or two terms, from the coefficients of all places (whole) or those without spin (flat). */
ALWAYS_INLINE void evaluate_splines(const lateral_spin_shape *shape, const lateral_spin_cell *at,
                                    int terms, const double *whole, const double *flat,
                                    spline_values *found) {
    double sum[3][24];
    if (at->without_spin) {
        sum_rows(shape, at, flat, 4 * (size_t)terms, 4 * terms, sum);
        memset(found, 0, sizeof *found);
        for (int k = 0; k < terms; k++) {
            found->value[3 * k + 2] = sum[0][4 * k];
            for (int i = 0; i < 2; i++) found->by_u[i][3 * k + 2] = sum[1 + i][4 * k];
            for (int i = 0; i < 3; i++) found->by_u[2][3 * k + i] = sum[0][4 * k + 1 + i];
        }
        return;
    }
    size_t parts = 3 * (size_t)terms;
    sum_rows(shape, at, whole + at->cell[2] * parts, (LATERAL_SPIN_CELLS / 2 + 3) * parts,
             12 * terms, sum);
    const double *w = at->weight[2], *d = at->slope[2];
    for (size_t k = 0; k < parts; k++) {
        size_t l = k + parts, m = l + parts, n = m + parts;
        found->value[k] = weighted(w, sum[0][k], sum[0][l], sum[0][m], sum[0][n]);
        found->by_u[0][k] = weighted(w, sum[1][k], sum[1][l], sum[1][m], sum[1][n]);
        found->by_u[1][k] = weighted(w, sum[2][k], sum[2][l], sum[2][m], sum[2][n]);
        found->by_u[2][k] = weighted(d, sum[0][k], sum[0][l], sum[0][m], sum[0][n]);
    }
}

/* k_hat above which the terms of weakening no longer change, and f_s/f_d - 1 at which they are half
 * of their limit. */
static const double WEAKENING_K = 0.8, WEAKENING_EXCESS = 0.157;

/* Add the contribution of spin to the forces, and the moment: splines over
 * u = l/(1/2 + sqrt(l^2 + 1/4)). Mirror images give the other halves. */
ALWAYS_INLINE void add_spin(const lateral_spin_shape *shape, int one_set, const double l[3],
                            double k_hat, lateral_spin_value *value) {
    double total = 0.25;
    for (int i = 0; i < 3; i++) total += l[i] * l[i];
    double r = sqrt(total), shrink = 1.0 / (0.5 + r), bend = shrink * shrink / r;
    double along = l[0] < 0.0 ? -1.0 : 1.0;
    double turn = l[2] < 0.0 || (l[2] == 0.0 && l[1] < 0.0) ? -1.0 : 1.0;
    double mirror[3] = {along, turn, turn}, by_log_k[3] = {0.0};
    const double *set = shape->coefficients;
    lateral_spin_cell there;
    there.without_spin = l[2] == 0.0;
    there.one_set = one_set;
    find_cell(along * (l[0] * shrink), LATERAL_SPIN_CELLS / 2, &there, 0);
    find_cell(1.0 + turn * (l[1] * shrink), LATERAL_SPIN_CELLS, &there, 1);
    find_cell(turn * (l[2] * shrink), LATERAL_SPIN_CELLS / 2, &there, 2);
    spline_values at;
    evaluate_splines(shape, &there, 1, set, set + LATERAL_SPIN_FLAT, &at);
    double excess = larger(shape->static_ratio - 1.0, 0.0);
    if (k_hat > 0.0 && excess > 0.0) {
        /* Each part of the contact weakens differently: a term with w and one with w^2. */
        double kk = k_hat < WEAKENING_K ? k_hat * k_hat : WEAKENING_K * WEAKENING_K;
        double rest = 0.2 / (kk + 0.2), w = 1.0 - rest;
        double factor = excess / (excess + WEAKENING_EXCESS) * w;
        double log_slope = k_hat < WEAKENING_K ? 2.0 * rest : 0.0;
        spline_values more;
        evaluate_splines(shape, &there, 2, set + LATERAL_SPIN_WEAKENING,
                         set + LATERAL_SPIN_WEAKENING_FLAT, &more);
        for (int k = 0; k < 3; k++) {
            double both = more.value[k] + w * more.value[3 + k];
            at.value[k] += factor * both;
            by_log_k[k] = factor * log_slope * (both + w * more.value[3 + k]);
            for (int i = 0; i < 3; i++)
                at.by_u[i][k] += factor * (more.by_u[i][k] + w * more.by_u[i][3 + k]);
        }
    }
    /* Values that are zero by symmetry are exactly zero. */
    if (l[1] == 0.0 && l[2] == 0.0) at.value[2] = at.by_u[0][2] = by_log_k[2] = 0.0;
    for (int k = 0; k < 3; k++) {
        double by_u[3], stretch = 0.0;
        for (int i = 0; i < 3; i++) {
            by_u[i] = mirror[k] * mirror[i] * at.by_u[i][k];
            stretch += by_u[i] * l[i];
        }
        value->force[k] += mirror[k] * at.value[k];
        value->by_log_k[k] += mirror[k] * by_log_k[k];
        for (int i = 0; i < 3; i++)
            value->by_creepage[k][i] += shrink * by_u[i] - stretch * bend * l[i];
    }
}

/* Compliance of a layer against spin over that against creepage, both in full stick. */
static const double SPIN_SOFTER = 1.3;
static const double TINY = 1e-60; /* prevents division by zero */

/* State before the evaluation of the table, whose arguments are point and k_hat. */
typedef struct {
    double point, k_hat, layer, size, per, share, left, left_by_size, left_by_share, stiffness;
    double left_by_log_layer;
} lateral_spin_start;

ALWAYS_INLINE lateral_spin_start lateral_spin_begin(const lateral_spin_shape *shape,
                                                    const double creepage[3], double k_hat,
                                                    double layer) {
    double x = creepage[0], y = creepage[1], s = creepage[2];
    double xx = x * x, yy = y * y, ss = s * s, total = xx + yy + (ss + TINY);
    lateral_spin_start at;
    at.size = sqrt(total);
    at.per = 1.0 / total;
    /* Stiffness and softening are those of the directions, weighted by their shares. */
    double more = shape->softening_y - shape->softening_x;
    at.share = (yy + 0.5 * ss) * at.per;
    double softening = shape->softening_x + at.share * more;
    at.stiffness = 1.0 + at.share * (shape->stiffness_ratio - 1.0);
    at.layer = at.left_by_log_layer = 0.0;
    if (layer > 0.0) {
        stiffness_left rest;
        double there = layer * at.stiffness;
        stiffness_with_layer(1, &softening, &at.size, &there, &rest);
        at.left = rest.value;
        at.left_by_size = rest.by_size;
        at.left_by_log_layer = rest.by_log_layer;
        at.left_by_share = more * rest.by_softening +
                           rest.by_log_layer * (shape->stiffness_ratio - 1.0) / at.stiffness;
        at.layer = layer * (at.stiffness * at.left);
    } else {
        held_creepage held = held_up_to_saturation(softening, at.size);
        at.left = 1.0 - softening * held.value;
        at.left_by_size = -softening * held.by_size;
        at.left_by_share = -more * (held.value + softening * held.by_softening);
    }
    at.point = at.size * at.left;
    at.k_hat = k_hat * sqrt(at.stiffness * at.left);
    return at;
}

/* Forces and moment from the table's traction ratio and its derivatives. */
ALWAYS_INLINE void lateral_spin_finish(const lateral_spin_shape *shape, const double creepage[3],
                                       double k_hat, double layer, lateral_spin_start at,
                                       creep_value of_table, lateral_spin_value *value) {
    double x = creepage[0], y = creepage[1], s = creepage[2], ratio = shape->stiffness_ratio;
    double ss = s * s, size = at.size, per_size = 1.0 / size, inverse_left = 1.0 / at.left;
    double q = of_table.traction_ratio, slope = of_table.slope;
    double q_by_log_k = of_table.log_k_derivative;
    double q_by_left = 0.5 * q_by_log_k + of_table.log_layer_derivative;
    double q_by_size =
        slope * (at.left + size * at.left_by_size) + q_by_left * at.left_by_size * inverse_left;
    double q_by_share =
        slope * size * at.left_by_share +
        q_by_left * (at.left_by_share * inverse_left + (ratio - 1.0) / at.stiffness);
    double q_by_log_layer = of_table.log_layer_derivative +
                            (slope * at.point + q_by_left) * at.left_by_log_layer * inverse_left;
    /* Stiffness left by the layer in full stick: along rolling, across, and against spin. */
    double soft = 1.85 * layer, whole = 1.0 / (1.0 + soft), other = 1.0 / (1.0 + ratio * soft);
    double turning = 1.0 / (1.0 + SPIN_SOFTER * soft), cross = (1.0 + soft) * other;
    double cross_by_log_layer = soft * (1.0 - ratio) * other * other;

    /* The direction turns from that in full stick to that of the creepage. */
    double shrunk = 1.0 / (1.0 + layer), less = shrunk / (1.0 + 1.8 * k_hat), weak = size * less,
           square = weak * weak;
    double cube = weak * square, inverse = 1.0 / (cube + 0.092 * square + 0.821);
    double turned = cube * inverse, change = 1.0 / ratio - cross;
    double across = cross + turned * change;
    double turned_by_weak = (3.0 * square - turned * (3.0 * square + 0.184 * weak)) * inverse;
    double turn = y * change * turned_by_weak; /* change of g[1] by weak */
    double g[2] = {x, y * across};
    double per_length = 1.0 / sqrt(g[0] * g[0] + g[1] * g[1] + (ss + TINY));
    double pull = q * per_length, per_square = per_length * per_length;
    double by_g1[2], by_size[2], by_share[2];
    for (int i = 0; i < 2; i++) {
        double force = g[i] * pull, unit = g[i] * per_length, lever = force * per_square;
        by_g1[i] = (i == 1 ? pull : 0.0) - lever * g[1];
        by_size[i] = unit * q_by_size + by_g1[i] * turn * less;
        by_share[i] = unit * q_by_share;
        value->force[i] = force;
        value->by_log_k[i] = unit * q_by_log_k - by_g1[i] * turn * weak * (1.0 - less / shrunk);
        value->by_log_layer[i] =
            unit * q_by_log_layer +
            by_g1[i] * (y * cross_by_log_layer * (1.0 - turned) - turn * weak * (layer * shrunk));
        value->by_creepage[i][0] = (i == 0 ? pull : 0.0) - lever * g[0];
        value->by_creepage[i][1] = by_g1[i] * across;
        value->by_creepage[i][2] = -lever * s;
        const double of_share[3] = {-at.share, 1.0 - at.share, 0.5 - at.share};
        for (int j = 0; j < 3; j++)
            value->by_creepage[i][j] +=
                creepage[j] * (by_size[i] * per_size + by_share[i] * 2.0 * of_share[j] * at.per);
    }
    value->force[2] = value->by_log_k[2] = value->by_log_layer[2] = 0.0;
    for (int j = 0; j < 3; j++) value->by_creepage[2][j] = 0.0;
    if (shape->coefficients == NULL) return;
    const double scale[3] = {whole, other, turning}, l[3] = {x * whole, y * other, s * turning};
    lateral_spin_value spun;
    memset(&spun, 0, sizeof spun);
    if (shape->sets == 1) add_spin(shape, 1, l, k_hat, &spun);
    else add_spin(shape, 0, l, k_hat, &spun);
    for (int i = 0; i < 3; i++) {
        const double *by = spun.by_creepage[i];
        value->force[i] += spun.force[i];
        value->by_log_k[i] += spun.by_log_k[i];
        value->by_log_layer[i] -= soft * (whole * by[0] * l[0] + ratio * other * by[1] * l[1] +
                                          SPIN_SOFTER * turning * by[2] * l[2]);
        for (int j = 0; j < 3; j++) value->by_creepage[i][j] += scale[j] * by[j];
    }
}

/* Limit the force to limit times f_d N without turning it, and return its unlimited size: the law
 * of a short weakening zone does not contain f_s, and splines have errors. */
ALWAYS_INLINE double lateral_spin_hold(lateral_spin_value *value, double limit) {
    double *force = value->force;
    double size = sqrt(force[0] * force[0] + force[1] * force[1]), less = limit / size;
    if (!(size > limit)) return size;
    double unit[2] = {force[0] / size, force[1] / size};
    for (int j = 0; j < 5; j++) {
        double *by[2];
        for (int i = 0; i < 2; i++)
            by[i] = j < 3    ? &value->by_creepage[i][j]
                    : j == 3 ? &value->by_log_k[i]
                             : &value->by_log_layer[i];
        double along = unit[0] * *by[0] + unit[1] * *by[1];
        for (int i = 0; i < 2; i++) *by[i] = less * (*by[i] - unit[i] * along);
    }
    for (int i = 0; i < 2; i++) force[i] = limit * unit[i];
    return size;
}

#endif
