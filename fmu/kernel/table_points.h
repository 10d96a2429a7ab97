/* Evaluation of a creep table at up to MAX_POINTS points.
 *
 * The loops over points have no branches, so that the compiler turns them into vector instructions,
 * and are short enough for intermediate results to stay in the cache. */
#ifndef TABLE_POINTS_H
#define TABLE_POINTS_H

#include <stddef.h>

#include "creep_table.h"
#include "layer_law.h"
#include "line_law.h"

enum { CORNER = 7 };

static const double MIN_CREEPAGE = 1e-280; /* below it the law is linear to the last digit */

/* Uniform cubic B-spline: weights of 4 neighbours and their derivatives at 0 <= f <= 1. */
ALWAYS_INLINE void basis(double f, double weight[4], double derivative[4]) {
    double g = 1.0 - f;
    weight[0] = g * g * g * (1.0 / 6.0);
    weight[1] = 2.0 / 3.0 + f * f * (0.5 * f - 1.0);
    weight[2] = 2.0 / 3.0 + g * g * (0.5 * g - 1.0);
    weight[3] = f * f * f * (1.0 / 6.0);
    derivative[0] = -0.5 * g * g;
    derivative[1] = (1.5 * f - 2.0) * f;
    derivative[2] = (2.0 - 1.5 * g) * g;
    derivative[3] = 0.5 * f * f;
}

/* Cell of a coordinate in [0, cells], and the fraction of the cell up to it. */
ALWAYS_INLINE uint32_t locate(double position, uint32_t cells, double *fraction) {
    uint32_t cell = position < (double)cells ? (uint32_t)position : cells - 1u;
    *fraction = position - (double)cell;
    return cell;
}

/* v to the power twice / 2. */
ALWAYS_INLINE double half_power(double v, uint32_t twice) {
    double power = twice % 2u != 0 ? sqrt(v) : 1.0;
    for (uint32_t i = 0; i < twice / 2u; i++) power *= v;
    return power;
}

ALWAYS_INLINE void half_powers(size_t n, const double *v, uint32_t twice, double *power) {
    for (size_t i = 0; i < n; i++) power[i] = twice % 2u != 0 ? sqrt(v[i]) : 1.0;
    for (uint32_t k = 0; k < twice / 2u; k++)
        for (size_t i = 0; i < n; i++) power[i] *= v[i];
}

/* q = u H(u), u = x / (1 + x). */
ALWAYS_INLINE void evaluate_one_axis(const creep_table *table, double x, double *ratio,
                                     double *slope) {
    double w[4], d[4], fraction, u = x / (1.0 + x), rest = 1.0 / (1.0 + x);
    double scale = (double)table->cells_u;
    const double *row = table->coefficients + locate(u * scale, table->cells_u, &fraction);
    basis(fraction, w, d);
    double h = row[0] * w[0] + row[1] * w[1] + row[2] * w[2] + row[3] * w[3];
    double along = row[0] * d[0] + row[1] * d[1] + row[2] * d[2] + row[3] * d[3];
    *ratio = u * h;
    *slope = (h + u * scale * along) * rest * rest;
}

/* Cells of the points, and the spline's weights along sqrt(k_hat). */
typedef struct {
    double root_k[MAX_POINTS], rest[MAX_POINTS], fraction_u[MAX_POINTS];
    double weight[4][MAX_POINTS], by_k[4][MAX_POINTS]; /* of 4 rows, and their derivatives */
    uint32_t first[MAX_POINTS];                        /* index of the first coefficient */
} spline_cells;

ALWAYS_INLINE void find_cells(const creep_table *table, size_t n, const double *k_hat,
                              const double *t, uint32_t row_length, spline_cells *cells) {
    double cells_u = (double)table->cells_u, cells_k = (double)table->cells_k;
    double scale_k = cells_k / sqrt(table->k_max);
    for (size_t i = 0; i < n; i++) {
        double weight[4], derivative[4], rest = 1.0 / (1.0 + t[i]), root_k = sqrt(k_hat[i]);
        double position_u = (1.0 - rest) * cells_u, position_k = root_k * scale_k;
        int32_t cell_u = (int32_t)larger(0.0, smaller(position_u, cells_u - 1.0));
        int32_t cell_k = (int32_t)larger(0.0, smaller(position_k, cells_k - 1.0));
        basis(position_k - (double)cell_k, weight, derivative);
        for (int j = 0; j < 4; j++) {
            cells->weight[j][i] = weight[j];
            cells->by_k[j][i] = scale_k * derivative[j];
        }
        cells->root_k[i] = root_k;
        cells->rest[i] = rest;
        cells->fraction_u[i] = position_u - (double)cell_u;
        cells->first[i] = (uint32_t)cell_k * row_length + (uint32_t)cell_u;
    }
}

/* Sums over 4 rows with a point's weights, for each of 4 neighbours along u. */
ALWAYS_INLINE void add_rows(const double *row, uint32_t row_length, double weight[4][MAX_POINTS],
                            size_t i, double sum[4]) {
    double s[4] = {0.0, 0.0, 0.0, 0.0};
    for (int j = 0; j < 4; j++, row += row_length)
        for (int c = 0; c < 4; c++) s[c] += weight[j][i] * row[c];
    for (int c = 0; c < 4; c++) sum[c] = s[c];
}

/* 1/T and c0 to c5 of every point, and their derivatives by sqrt(k_hat). */
typedef struct {
    double c[CORNER][MAX_POINTS], by_root_k[CORNER][MAX_POINTS];
} corner_numbers;

ALWAYS_INLINE void find_corners(const creep_table *table, size_t n, const spline_cells *cells,
                                uint32_t row_length, corner_numbers *at) {
    for (size_t i = 0; i < n; i++) {
        const double *row = table->coefficients + cells->first[i] / row_length * row_length;
        double c[CORNER] = {0.0}, by_root_k[CORNER] = {0.0};
        for (int j = 0; j < 4; j++, row += row_length)
            for (int m = 0; m < CORNER; m++) {
                c[m] += cells->weight[j][i] * row[m];
                by_root_k[m] += cells->by_k[j][i] * row[m];
            }
        for (int m = 0; m < CORNER; m++) {
            at->c[m][i] = c[m];
            at->by_root_k[m][i] = by_root_k[m];
        }
    }
}

/* Add C of every point to h, which holds H and its derivatives by ln t and by sqrt(k_hat). */
ALWAYS_INLINE void add_corners(const creep_table *table, size_t n, const double *t,
                               const corner_numbers *at, int by_k, double h[][3]) {
    double y[MAX_POINTS], z[MAX_POINTS], power[MAX_POINTS];
    int any = 0;
    for (size_t i = 0; i < n; i++) {
        double given = t[i] * at->c[0][i];
        int inside = (given < 1.0) & (given > 1e-60); /* below, y^4 is negligible */
        y[i] = inside ? given : 0.0;
        z[i] = 1.0 - y[i];
        any |= inside;
    }
    if (!any) return;
    half_powers(n, z, table->twice_corner, power);
    for (size_t i = 0; i < n; i++) {
        double c[CORNER], d[CORNER];
        for (int m = 0; m < CORNER; m++) {
            c[m] = at->c[m][i];
            d[m] = at->by_root_k[m][i];
        }
        double part = (y[i] * y[i]) * (y[i] * y[i]) * power[i], log_z = logarithm(z[i]);
        double constant = c[1] + z[i] * (c[3] + z[i] * c[5]);
        double factor = c[2] + z[i] * (c[4] + z[i] * c[6]);
        double sum = constant + factor * log_z;
        double by_z = c[3] + 2.0 * z[i] * c[5] + (c[4] + 2.0 * z[i] * c[6]) * log_z;
        /* y dC/dy, without a division by y, which may be next to nothing. */
        double by_log_y = part * ((4.0 - 0.5 * table->twice_corner * y[i] / z[i]) * sum -
                                  y[i] * (factor / z[i] + by_z));
        double varied =
            d[1] + z[i] * (d[3] + z[i] * d[5]) + (d[2] + z[i] * (d[4] + z[i] * d[6])) * log_z;
        double by_root_k = part * varied + d[0] / c[0] * by_log_y;
        h[i][0] += part * sum;
        h[i][1] += by_log_y;
        if (by_k) h[i][2] += y[i] > 0.0 ? by_root_k : 0.0;
    }
}

/* Spline part of q = q_line + x w (H + C), with w = (1 + t)^-d, and of its derivatives, at
 * points of the line contact's law. */
ALWAYS_INLINE void add_corrections(const creep_table *table, size_t n, const double *x,
                                   const double *k_hat, const double *t, const double *stretch,
                                   const double *share, double *ratio, double *slope,
                                   double *log_k) {
    uint32_t corner = table->twice_corner > 0 ? CORNER : 0;
    uint32_t row_length = corner + table->cells_u + 3;
    spline_cells cells;
    double sum[MAX_POINTS][4], by_k[MAX_POINTS][4], h[MAX_POINTS][3], w[MAX_POINTS];
    find_cells(table, n, k_hat, t, row_length, &cells);
    NOT_VECTORIZED for (size_t i = 0; i < n; i++) { /* gathering takes longer */
        const double *row = table->coefficients + corner + cells.first[i];
        add_rows(row, row_length, cells.weight, i, sum[i]);
        if (log_k != NULL) add_rows(row, row_length, cells.by_k, i, by_k[i]);
    }
    double cells_u = (double)table->cells_u;
    for (size_t i = 0; i < n; i++) {
        double weight[4], derivative[4], *s = sum[i], *d = by_k[i], u = 1.0 - cells.rest[i];
        basis(cells.fraction_u[i], weight, derivative);
        h[i][0] = s[0] * weight[0] + s[1] * weight[1] + s[2] * weight[2] + s[3] * weight[3];
        h[i][1] = s[0] * derivative[0] + s[1] * derivative[1] + s[2] * derivative[2] +
                  s[3] * derivative[3];
        h[i][1] *= cells_u * u * cells.rest[i];
        if (log_k != NULL)
            h[i][2] = d[0] * weight[0] + d[1] * weight[1] + d[2] * weight[2] + d[3] * weight[3];
    }
    if (corner > 0) {
        corner_numbers numbers;
        find_corners(table, n, &cells, row_length, &numbers);
        add_corners(table, n, t, &numbers, log_k != NULL, h);
    }
    half_powers(n, cells.rest, table->twice_decay, w);
    double decay = 0.5 * table->twice_decay;
    for (size_t i = 0; i < n; i++) {
        double root_k = cells.root_k[i], factor = table->root_k ? root_k : 1.0;
        double value = factor * h[i][0], by_log_t = factor * h[i][1];
        if (slope == NULL) {
            ratio[i] += fabs(x[i]) * w[i] * value;
            continue;
        }
        double by_log_k = 0.5 * root_k * (factor * h[i][2] + (table->root_k ? h[i][0] : 0.0));
        double size = fabs(x[i]), moved = by_log_t - decay * (1.0 - cells.rest[i]) * value;
        double by_stretch = size * w[i] * moved / stretch[i];
        ratio[i] += size * w[i] * value;
        slope[i] += w[i] * value + (stretch[i] > 0.0 ? by_stretch : 0.0);
        if (log_k != NULL) log_k[i] += size * w[i] * (by_log_k - share[i] * moved);
    }
}

/* q, dq/dx, k_hat dq/dk_hat without a layer. */
ALWAYS_INLINE void evaluate_without_layer(const creep_table *table, size_t n, const double *x,
                                          const double *k_hat, double *ratio, double *slope,
                                          double *log_k) {
    if (table->one_axis) {
        for (size_t i = 0; i < n; i++) {
            double one_slope;
            evaluate_one_axis(table, fabs(x[i]), &ratio[i], &one_slope);
            ratio[i] = copysign(ratio[i], x[i]);
            if (slope != NULL) slope[i] = one_slope;
            if (log_k != NULL) log_k[i] = 0.0;
        }
        return;
    }
    double t[MAX_POINTS], stretch[MAX_POINTS], share[MAX_POINTS];
    for (size_t i = 0; i < n; i++) {
        double given = fabs(x[i]), tiny = given * (1.0 / MIN_CREEPAGE);
        coordinate c = solve_coordinate(larger(given, MIN_CREEPAGE), k_hat[i]);
        double part = given < MIN_CREEPAGE ? tiny : 1.0;
        t[i] = c.t;
        ratio[i] = part * line_traction_ratio(c);
        if (slope == NULL) continue;
        stretch[i] = c.y + 4.0 * c.m * c.s; /* dx/d(ln t) */
        double quotient = c.y / stretch[i]; /* -d(ln t)/d(ln k_hat) at fixed x */
        share[i] = stretch[i] > 0.0 ? quotient : 0.0;
        slope[i] = 2.0 * c.s * (1.0 - 4.0 * c.m * share[i]);
        if (log_k != NULL) log_k[i] = part * (8.0 * c.m * c.s * c.y * share[i]);
    }
    if (table->cells_u > 0)
        add_corrections(table, n, x, k_hat, t, stretch, share, ratio, slope, log_k);
    for (size_t i = 0; i < n; i++) {
        ratio[i] = copysign(ratio[i], x[i]);
        if (log_k != NULL) log_k[i] = copysign(log_k[i], x[i]);
    }
}

/* Cells of points with a layer, and the spline's weights along u, sqrt(k_hat) and w. */
typedef struct {
    double weight[3][4][MAX_POINTS], slope[3][4][MAX_POINTS];
    double u[MAX_POINTS], root_k[MAX_POINTS], w[MAX_POINTS];
    uint32_t first[MAX_POINTS]; /* index of the first coefficient */
} layer_cell;

/* Cell along one direction, with its weights. */
ALWAYS_INLINE uint32_t find_layer_cell(double position, uint32_t cells, int direction, size_t i,
                                       layer_cell *cell) {
    double weight[4], slope[4];
    int32_t at = (int32_t)smaller(position, (double)cells - 1.0);
    basis(position - (double)at, weight, slope);
    for (int j = 0; j < 4; j++) {
        cell->weight[direction][j][i] = weight[j];
        cell->slope[direction][j][i] = slope[j];
    }
    return (uint32_t)at;
}

/* Sums of a point over w and sqrt(k_hat), and their derivatives by sqrt(k_hat) and w, for each of 4
 * neighbours along u. */
ALWAYS_INLINE void add_layer_rows(const float *plane, size_t plane_length, size_t row_length,
                                  const layer_cell *cell, size_t i, double sum[3][4][MAX_POINTS]) {
    double s[3][4] = {{0.0}};
    for (size_t a = 0; a < 4; a++)
        for (size_t b = 0; b < 4; b++) {
            const float *from = plane + a * plane_length + b * row_length;
            double w = cell->weight[2][a][i], k = cell->weight[1][b][i];
            double both = w * k, by_k = w * cell->slope[1][b][i], by_w = cell->slope[2][a][i] * k;
            IN_FOURS for (int c = 0; c < 4; c++) {
                double number = (double)from[c];
                s[0][c] += both * number;
                s[1][c] += by_k * number;
                s[2][c] += by_w * number;
            }
        }
    for (int m = 0; m < 3; m++)
        for (int c = 0; c < 4; c++) sum[m][c][i] = s[m][c];
}

/* Replace what the law is without a layer at the points that have one. */
ALWAYS_INLINE void add_layers(const creep_table *table, size_t n, const double *x,
                              const double *k_hat, const double *layer, double *ratio,
                              double *slope, double *log_k, double *log_layer) {
    size_t row_length = (size_t)table->layer_u + 3;
    size_t plane_length = row_length * ((size_t)table->layer_k + 3);
    double scale_k = table->layer_k / sqrt(table->k_max), cells_u = (double)table->layer_u;
    double held[MAX_POINTS], lam[MAX_POINTS], t[MAX_POINTS], sum[3][4][MAX_POINTS];
    layer_cell cell;
    for (size_t i = 0; i < n; i++) { /* a point without a layer has a thin one */
        held[i] = smaller(larger(fabs(x[i]), MIN_CREEPAGE), MAX_LAYER_CREEPAGE);
        lam[i] = smaller(larger(layer[i], MIN_LAYER), MAX_LAYER);
    }
    solve_layer_points(n, held, k_hat, lam, t);
    for (size_t i = 0; i < n; i++) {
        double g = sqrt(sqrt(lam[i])), w = g / (LAYER_MIDDLE + g), u = t[i] / (1.0 + t[i]);
        double root_k = sqrt(k_hat[i]);
        cell.u[i] = u;
        cell.root_k[i] = root_k;
        cell.w[i] = w;
        uint32_t plane = find_layer_cell(w * table->layer_w, table->layer_w, 2, i, &cell);
        uint32_t row = find_layer_cell(root_k * scale_k, table->layer_k, 1, i, &cell);
        cell.first[i] = plane * (uint32_t)plane_length + row * (uint32_t)row_length +
                        find_layer_cell(u * cells_u, table->layer_u, 0, i, &cell);
    }
    NOT_VECTORIZED for (size_t i = 0; i < n; i++) add_layer_rows(
        table->layer_coefficients + cell.first[i], plane_length, row_length, &cell, i, sum);
    for (size_t i = 0; i < n; i++) {
        layer_point at = layer_point_at(1, t[i], k_hat[i], lam[i]);
        double h[4] = {0.0}; /* H and its derivatives by ln t, ln(k_hat), ln(lam) */
        for (int c = 0; c < 4; c++) {
            double along = cell.weight[0][c][i];
            h[0] += along * sum[0][c][i];
            h[1] += cell.slope[0][c][i] * sum[0][c][i];
            h[2] += along * sum[1][c][i];
            h[3] += along * sum[2][c][i];
        }
        double u = cell.u[i], w = cell.w[i];
        h[1] *= cells_u * u * (1.0 - u);
        h[2] *= 0.5 * cell.root_k[i] * scale_k;
        h[3] *= 0.25 * w * (1.0 - w) * table->layer_w;
        layer_value q = layer_law(&at, held[i], h);
        double size = fabs(x[i]), tiny = size * (1.0 / MIN_CREEPAGE);
        double part = copysign(size < MIN_CREEPAGE ? tiny : 1.0, x[i]);
        int has_layer = layer[i] >= MIN_LAYER;
        double flat = size > MAX_LAYER_CREEPAGE ? 0.0 : q.slope;
        ratio[i] = has_layer ? part * q.ratio : ratio[i];
        if (slope != NULL) slope[i] = has_layer ? flat : slope[i];
        if (log_k == NULL) continue;
        log_k[i] = has_layer ? part * q.log_k : log_k[i];
        log_layer[i] = has_layer ? part * q.log_layer : log_layer[i];
    }
}

/* q and its derivatives of n <= MAX_POINTS points. Arrays of derivatives may be NULL: those by
 * k_hat and the layer, or all three. */
ALWAYS_INLINE void evaluate_points(const creep_table *table, size_t n, const double *x,
                                   const double *k_hat, const double *layer, double *ratio,
                                   double *slope, double *log_k, double *log_layer) {
    size_t layered = 0;
    for (size_t i = 0; i < n; i++) layered += layer[i] >= MIN_LAYER;
    if (table->layer_w == 0) layered = 0;
    if (layered < n) evaluate_without_layer(table, n, x, k_hat, ratio, slope, log_k);
    for (size_t i = 0; log_k != NULL && i < n; i++) log_layer[i] = 0.0;
    if (layered > 0) add_layers(table, n, x, k_hat, layer, ratio, slope, log_k, log_layer);
}

#endif
