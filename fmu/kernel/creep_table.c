#include "creep_table.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "table_points.h"

void creep_table_evaluate(const creep_table *table, double normalized_creepage, double k_hat,
                          double layer_ratio, creep_value *value) {
    evaluate_points(table, 1, &normalized_creepage, &k_hat, &layer_ratio, &value->traction_ratio,
                    &value->slope, &value->log_k_derivative, &value->log_layer_derivative);
}

/* A spline at the first node, from its first three coefficients. */
static double at_first_node(const double c[3]) { return (c[0] + 4.0 * c[1] + c[2]) * (1.0 / 6.0); }

/* Of two axes t, m and s - 1 vanish at x = 0, and so does C. */
double creep_table_initial_slope(const creep_table *table, double k_hat, double layer_ratio) {
    if (table->one_axis) return table->steepest_slope;
    double none = 0.0, sum[4] = {0.0};
    if (layer_ratio >= MIN_LAYER && table->layer_w > 0) {
        size_t row_length = (size_t)table->layer_u + 3;
        size_t plane_length = row_length * ((size_t)table->layer_k + 3);
        double lam = smaller(layer_ratio, MAX_LAYER), g = sqrt(sqrt(lam)),
               w = g / (LAYER_MIDDLE + g);
        double fraction, by_w[4], by_k[4], slope[4];
        double position_k = sqrt(k_hat) * (table->layer_k / sqrt(table->k_max));
        const float *plane = table->layer_coefficients;
        plane += plane_length * locate(w * table->layer_w, table->layer_w, &fraction);
        basis(fraction, by_w, slope);
        plane += row_length * locate(position_k, table->layer_k, &fraction);
        basis(fraction, by_k, slope);
        for (int a = 0; a < 4; a++, plane += plane_length)
            for (int b = 0; b < 4; b++)
                for (int c = 0; c < 3; c++)
                    sum[c] += by_w[a] * by_k[b] * (double)plane[(size_t)b * row_length + c];
        layer_point at = layer_point_at(1, 0.0, k_hat, lam);
        return (2.0 + at_first_node(sum)) * layer_weight(&at);
    }
    if (table->cells_u == 0) return 2.0;
    uint32_t corner = table->twice_corner > 0 ? CORNER : 0;
    uint32_t row_length = corner + table->cells_u + 3;
    spline_cells cells;
    find_cells(table, 1, &k_hat, &none, row_length, &cells);
    add_rows(table->coefficients + corner + cells.first[0], row_length, cells.weight, 0, sum);
    return 2.0 + (table->root_k ? cells.root_k[0] : 1.0) * at_first_node(sum);
}

#ifndef ONE_FILE_KERNEL
#include "checked_file.h"

/* The frame is followed by the struct's members up to the coefficients, 104 characters that name
 * the law, and the coefficients. */
enum { TABLE_HEADER = 216 };
ASSERT_LAYOUT(header,
              CHECKED_FILE_FRAME + offsetof(creep_table, coefficients) + 104 == TABLE_HEADER);

/* Limit of a coefficient, so that sums and forces stay finite. */
static const double MAX_NUMBER = 1e9;

void creep_table_node(const creep_table *shape, double u, double k_hat, double layer_ratio,
                      creep_node *node) {
    if (layer_ratio > 0.0) {
        layer_point at = layer_point_at(1, u / (1.0 - u), k_hat, layer_ratio);
        double x = at.m + at.l + at.y;
        *node = (creep_node){x, layer_base(&at), x * layer_weight(&at)};
        return;
    }
    if (shape->one_axis) {
        *node = (creep_node){u / (1.0 - u), 0.0, u};
        return;
    }
    coordinate c = coordinate_at(u / (1.0 - u), k_hat);
    node->normalized_creepage = c.m + c.y; /* Eq. (19) */
    node->line = line_traction_ratio(c);
    node->weight = node->normalized_creepage * half_power(1.0 - u, shape->twice_decay);
    if (shape->root_k) node->weight *= sqrt(k_hat);
}

static int in_range(const creep_table *table, double x, double k_hat, double layer_ratio) {
    double max_layer = table->layer_w > 0 ? MAX_LAYER_RATIO : 0.0;
    return fabs(x) <= DBL_MAX && k_hat >= 0.0 && k_hat <= table->k_max && layer_ratio >= 0.0 &&
           layer_ratio <= max_layer;
}

/* Values at a point; not numbers outside the table's range. */
static creep_value value_at(const creep_table *table, double x, double k_hat, double layer_ratio) {
    creep_value value;
    value.traction_ratio = value.slope = NAN;
    if (in_range(table, x, k_hat, layer_ratio))
        creep_table_evaluate(table, x, k_hat, layer_ratio, &value);
    return value;
}

double creep_table_ratio(const creep_table *table, double normalized_creepage, double k_hat,
                         double layer_ratio) {
    return value_at(table, normalized_creepage, k_hat, layer_ratio).traction_ratio;
}

double creep_table_slope(const creep_table *table, double normalized_creepage, double k_hat,
                         double layer_ratio) {
    return value_at(table, normalized_creepage, k_hat, layer_ratio).slope;
}

double creep_table_coordinate(double normalized_creepage, double k_hat) {
    return solve_coordinate(normalized_creepage, k_hat).t;
}

/* Find the steepest place of a table of one axis: a measured curve may rise in an S. */
static void find_steepest(creep_table *table) {
    enum { PER_CELL = 8 };
    table->steepest_creepage = table->steepest_slope = 0.0;
    if (!table->one_axis) return;
    size_t n = (size_t)PER_CELL * table->cells_u;
    for (size_t i = 0; i < n; i++) {
        creep_value q;
        double u = (double)i / (double)n, x = u / (1.0 - u);
        creep_table_evaluate(table, x, 0.0, 0.0, &q);
        if (i == 0 || q.slope > table->steepest_slope * (1.0 + 1e-9)) {
            table->steepest_creepage = x;
            table->steepest_slope = q.slope;
        }
    }
}

const char *creep_table_open(creep_table *table, const void *bytes, size_t size) {
    const unsigned char *start = bytes;
    const char *error = checked_file_error(bytes, size, "CREEPTAB", TABLE_VERSION);
    if (error != NULL) return error;
    if (size < TABLE_HEADER) return "the table is shorter than its header";
    memcpy(table, start + CHECKED_FILE_FRAME, offsetof(creep_table, coefficients));
    table->lateral_spin = NULL;
    table->bodies = NULL;
    table->coefficients = (const double *)(const void *)(start + TABLE_HEADER);
    if (table->one_axis > 1 || table->twice_decay > 16 || table->twice_corner > 16 ||
        table->root_k > 1)
        return "the table's shape is not known";
    size_t count = 0, rows = table->one_axis ? 1 : (size_t)table->cells_k + 3;
    if (table->cells_u > 0 || table->cells_k > 0 || table->one_axis) {
        if (table->cells_u < 1 || table->cells_u > 4096 || table->cells_k < 1 ||
            table->cells_k > 4096)
            return "the table's number of cells is out of range (1 to 4096)";
        count = rows * ((table->twice_corner > 0 ? CORNER : 0) + (size_t)table->cells_u + 3);
    }
    if (table->one_axis && table->twice_corner > 0) return "a table of one axis has no corner";
    uint32_t u = table->layer_u, k = table->layer_k, w = table->layer_w;
    size_t layered = 0;
    if (u > 0 || k > 0 || w > 0) {
        if (u < 1 || u > 1024 || k < 1 || k > 1024 || w < 1 || w > 1024 || table->one_axis)
            return "the table's number of cells with a layer is out of range (1 to 1024)";
        layered = ((size_t)u + 3) * ((size_t)k + 3) * ((size_t)w + 3);
    }
    table->layer_coefficients = (const float *)(const void *)(table->coefficients + count);
    if (size != TABLE_HEADER + count * sizeof(double) + layered * sizeof(float))
        return "the table's length does not fit its number of cells";
    if (!(table->static_to_kinetic >= 0.0 && table->static_to_kinetic <= 1e3))
        return "the table's static_to_kinetic is out of range";
    if (!(table->k_max > 0.0 && table->k_max <= 1e3)) return "the table's k_max is out of range";
    for (size_t i = 0; i < count; i++)
        if (!(fabs(table->coefficients[i]) <= MAX_NUMBER))
            return "the table holds a number that is not finite or beyond 1e9";
    for (size_t i = 0; i < layered; i++)
        if (!(fabs((double)table->layer_coefficients[i]) <= MAX_NUMBER))
            return "the table holds a number that is not finite or beyond 1e9";
    find_steepest(table);
    table->clean_slope = creep_table_initial_slope(table, 0.0, 0.0);
    return NULL;
}
#endif /* ONE_FILE_KERNEL */
