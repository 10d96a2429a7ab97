#include "creep_table.h"

#include <math.h>
#include <string.h>

#include "checked_file.h"

/* After the frame: cells_u, cells_k, k_max, max_error, max_slope_error, certificate_points,
 * static_to_kinetic, one_axis, twice_decay, twice_corner, root_k, then 104 characters that name the
 * law, then the coefficients. */
enum { TABLE_VERSION = 2, TABLE_HEADER = 192, CORNER = 7 };

/* Position on the law: x = m + y, with y = k_hat t. Every term is kept to full relative accuracy,
 * so nothing below subtracts nearly equal numbers. */
typedef struct {
    double t, m, s, y;
} coordinate;

static coordinate coordinate_at(double t, double k) {
    double p = (t * t) * (t * t), s = 1.0 / (1.0 + p);
    return (coordinate){t, p * s, s, k * t};
}

/* Of two numbers that are numbers: unlike fmin and fmax, one instruction. */
static double smaller(double a, double b) { return a < b ? a : b; }

static double larger(double a, double b) { return a < b ? b : a; }

static double fourth_root(double v) { return sqrt(sqrt(v)); }

/* m(t) + k t is convex below this t and concave above it. */
static const double INFLEXION_T = 0.88011173679339345; /* (3/5)^(1/4), where m = 3/8 */

/* Roots to 3 or 4 %, enough to start from and much cheaper than pow or sqrt: the bits of an IEEE
 * number are nearly a multiple of its logarithm, so a part of them and a constant make a power. */
static double rough_inverse_fifth_root(double v) {
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    bits = 0x4CB8A8C154C98400u - bits / 5u;
    memcpy(&v, &bits, sizeof v);
    return v;
}

static double rough_fourth_root(double v) {
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    bits = 0x2FF3666666666800u + bits / 4u;
    memcpy(&v, &bits, sizeof v);
    return v;
}

/* A start within some 10 % of the root, from which two steps reach it, rarely three. */
static double start_value(double x, double k) {
    if (x <= 0.375 + k * INFLEXION_T) { /* m or y alone gives an upper bound of t: blend them */
        double linear = x / k;
        if (x >= 1.0) return linear;
        double carter = rough_fourth_root(x / (1.0 - x));
        double least = smaller(carter, linear), ratio = least / larger(carter, linear);
        return least * (1.0 - 0.3 * ratio * ratio); /* 1/sqrt(1 + ratio^2), nearly */
    }
    double corner = rough_inverse_fifth_root(k); /* t at x = 1, where k t = s = t^-4 nearly */
    if (x < 1.0) return larger(INFLEXION_T, rough_fourth_root(1.0 / (1.0 - x + k * corner)));
    double sliding = (x - 1.0) / k;
    return sliding > 8.0 * corner ? sliding : sqrt(corner * corner + sliding * sliding);
}

/* Solve x = m + y for x > 0 by Householder's method of fourth order, kept inside a bracket. Without
 * k_hat this is Carter: y is zero until nothing sticks any more, then it is the sliding x - 1. */
static coordinate solve_coordinate(double x, double k) {
    if (x >= 1.0 && (1e-20 * (x - 1.0) >= k || k < 1e-60)) /* s is below 1e-80: nothing sticks */
        return (coordinate){INFINITY, 1.0, 0.0, x - 1.0};
    if (k < 1e-60) return (coordinate){fourth_root(x / (1.0 - x)), x, 1.0 - x, 0.0};
    double low = 0.0, high = x / k, t = start_value(x, k);
    for (int i = 0; i < 100; i++) {
        double p = (t * t) * (t * t), d = 1.0 + p, y = k * t;
        double s = 1.0 / d, m = p * s;
        /* (1 + p)^2 t dx/dt: two divisions that need not wait for each other. */
        double inverse = 1.0 / (y * d * d + 4.0 * p);
        /* Both forms are m + y - x; the second keeps the digits of a small s. */
        double residual = t < 1.0 ? (m - x) + y : (y - (x - 1.0)) - s;
        if (residual > 0.0) high = t;
        else low = t;
        /* Relative step of Newton, and the second and third derivatives over twice and six times
         * the first, all in ln t. */
        double newton = residual * d * d * inverse, part = 4.0 * p * inverse, lean = (1.0 - p) * s;
        double second = part * (2.0 * lean - 0.5);
        double third = part * (lean * (8.0 * lean - 6.0) - 16.0 * m * s + 1.0) * (1.0 / 3.0);
        double step =
            newton * (1.0 - second * newton) / (1.0 - newton * (2.0 * second - third * newton));
        double next = t - t * step;
        if (!(next >= low && next <= high)) next = 0.5 * (low + high);
        else if (fabs(step) <= 1e-4) { /* its fourth power is left: this was the last step */
            t = next;
            break;
        }
        if (next == t) break;
        t = next;
    }
    return coordinate_at(t, k);
}

static double line_traction_ratio(coordinate c) {
    return c.m * (1.0 + c.s) + 2.0 * (c.y * c.s); /* Eq. (18) */
}

/* Uniform cubic B-spline: weights of 4 neighbours and their derivatives at 0 <= f <= 1. */
static void basis(double f, double weight[4], double derivative[4]) {
    double g = 1.0 - f;
    weight[0] = g * g * g / 6.0;
    weight[1] = (4.0 - 6.0 * f * f + 3.0 * f * f * f) / 6.0;
    weight[2] = (4.0 - 6.0 * g * g + 3.0 * g * g * g) / 6.0;
    weight[3] = f * f * f / 6.0;
    derivative[0] = -0.5 * g * g;
    derivative[1] = (1.5 * f - 2.0) * f;
    derivative[2] = (2.0 - 1.5 * g) * g;
    derivative[3] = 0.5 * f * f;
}

/* Cell of a coordinate in [0, cells], and the place inside it. */
static uint32_t locate(double position, uint32_t cells, double *fraction) {
    uint32_t cell = position < (double)cells ? (uint32_t)position : cells - 1u;
    *fraction = position - (double)cell;
    return cell;
}

/* v to the power twice/2. */
static double half_power(double v, uint32_t twice) {
    double power = twice % 2u != 0 ? sqrt(v) : 1.0;
    for (uint32_t i = 0; i < twice / 2u; i++) power *= v;
    return power;
}

/* C and its derivatives to ln t and to sqrt(k_hat), from the row's c and its derivative. */
static void add_corner(const creep_table *table, double t, const double c[CORNER],
                       const double by_root_k[CORNER], double h[3]) {
    double y = t * c[0], z = 1.0 - y;
    if (!(z > 0.0 && y > 1e-60)) return; /* the fourth power of less is nothing */
    double part = (y * y) * (y * y) * half_power(z, table->twice_corner), logarithm = log(z);
    double constant = c[1] + z * (c[3] + z * c[5]), factor = c[2] + z * (c[4] + z * c[6]);
    double sum = constant + factor * logarithm;
    double by_z = c[3] + 2.0 * z * c[5] + (c[4] + 2.0 * z * c[6]) * logarithm;
    /* y dC/dy, without a division by y, which may be next to nothing. */
    double by_log_y =
        part * ((4.0 - 0.5 * table->twice_corner * y / z) * sum - y * (factor / z + by_z));
    const double *d = by_root_k;
    double varied = d[1] + z * (d[3] + z * d[5]) + (d[2] + z * (d[4] + z * d[6])) * logarithm;
    h[0] += part * sum;
    h[1] += by_log_y;
    h[2] += part * varied + by_root_k[0] / c[0] * by_log_y;
}

/* H + C and its derivatives to ln t and to sqrt(k_hat). */
static void correction(const creep_table *table, double t, double root_k, double h[3]) {
    double wu[4], du[4], wk[4], dk[4], fraction;
    double u = 1.0 / (1.0 + 1.0 / t);
    double scale_u = (double)table->cells_u;
    double scale_k = (double)table->cells_k / sqrt(table->k_max);
    uint32_t cell_u = locate(u * scale_u, table->cells_u, &fraction);
    basis(fraction, wu, du);
    uint32_t cell_k = locate(root_k * scale_k, table->cells_k, &fraction);
    basis(fraction, wk, dk);
    size_t corner = table->twice_corner > 0 ? CORNER : 0;
    size_t row_length = corner + (size_t)table->cells_u + 3;
    const double *first = table->coefficients + cell_k * row_length;
    double c[CORNER] = {0.0}, by_root_k[CORNER] = {0.0};
    h[0] = h[1] = h[2] = 0.0;
    for (int j = 0; j < 4; j++) {
        const double *start = first + (size_t)j * row_length, *row = start + corner + cell_u;
        double value = row[0] * wu[0] + row[1] * wu[1] + row[2] * wu[2] + row[3] * wu[3];
        double along = row[0] * du[0] + row[1] * du[1] + row[2] * du[2] + row[3] * du[3];
        h[0] += wk[j] * value;
        h[1] += wk[j] * along;
        h[2] += dk[j] * value;
        for (size_t i = 0; i < corner; i++) {
            c[i] += wk[j] * start[i];
            by_root_k[i] += scale_k * dk[j] * start[i];
        }
    }
    h[1] *= scale_u * u * (1.0 - u);
    h[2] *= scale_k;
    if (corner > 0) add_corner(table, t, c, by_root_k, h);
}

/* q = u H(u), u = x / (1 + x). */
static void evaluate_one_axis(const creep_table *table, double x, creep_value *value) {
    double w[4], d[4], fraction, u = x / (1.0 + x), rest = 1.0 / (1.0 + x);
    double scale = (double)table->cells_u;
    const double *row = table->coefficients + locate(u * scale, table->cells_u, &fraction);
    basis(fraction, w, d);
    double h = row[0] * w[0] + row[1] * w[1] + row[2] * w[2] + row[3] * w[3];
    double along = row[0] * d[0] + row[1] * d[1] + row[2] * d[2] + row[3] * d[3];
    value->traction_ratio = u * h;
    value->slope = (h + u * scale * along) * rest * rest;
    value->log_k_derivative = 0.0;
}

void creep_table_evaluate(const creep_table *table, double normalized_creepage, double k_hat,
                          creep_value *value) {
    double x = fabs(normalized_creepage), q = 0.0, slope = 2.0, log_k = 0.0;
    double stretch = 0.0, share = 0.0;
    coordinate c = {0.0, 0.0, 1.0, 0.0};
    if (table->one_axis) {
        evaluate_one_axis(table, x, value);
        value->traction_ratio = copysign(value->traction_ratio, normalized_creepage);
        return;
    }
    if (x > 0.0) {
        c = solve_coordinate(x, k_hat);
        stretch = c.y + 4.0 * c.m * c.s;          /* dx/d(ln t) */
        if (stretch > 0.0) share = c.y / stretch; /* -d(ln t)/d(ln k_hat) at fixed x */
        q = line_traction_ratio(c);
        slope = 2.0 * c.s * (1.0 - 4.0 * c.m * share);
        log_k = 8.0 * c.m * c.s * c.y * share;
    }
    if (table->cells_u > 0) { /* q = q_line + x w H, with w = (1 + t)^-d */
        double h[3], root_k = sqrt(k_hat), rest = 1.0 / (1.0 + c.t), u = 1.0 - rest;
        double w = half_power(rest, table->twice_decay), decay = 0.5 * table->twice_decay;
        correction(table, c.t, root_k, h);
        if (table->root_k) {
            h[2] = h[0] + root_k * h[2];
            h[0] *= root_k;
            h[1] *= root_k;
        }
        double by_log_t = w * (h[1] - decay * u * h[0]);
        q += x * w * h[0];
        slope += w * h[0];
        if (stretch > 0.0) slope += x * by_log_t / stretch;
        log_k += x * (w * 0.5 * root_k * h[2] - share * by_log_t);
    }
    value->traction_ratio = copysign(q, normalized_creepage);
    value->slope = slope;
    value->log_k_derivative = copysign(log_k, normalized_creepage);
}

void creep_table_evaluate_many(const creep_table *table, size_t n, const double *x,
                               const double *k_hat, size_t k_stride, double *ratio, double *slope) {
    for (size_t i = 0; i < n; i++) {
        creep_value value;
        creep_table_evaluate(table, x[i], k_hat[i * k_stride], &value);
        ratio[i] = value.traction_ratio;
        slope[i] = value.slope;
    }
}

void creep_table_node(const creep_table *shape, double u, double k_hat, creep_node *node) {
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

double creep_table_place(double normalized_creepage, double k_hat) {
    return solve_coordinate(normalized_creepage, k_hat).t;
}

const char *creep_table_open(creep_table *table, const void *bytes, size_t size) {
    const unsigned char *start = bytes;
    const char *error = checked_file_error(bytes, size, "CREEPTAB", TABLE_VERSION);
    if (error != NULL) return error;
    if (size < TABLE_HEADER) return "the table is shorter than its header";
    memcpy(&table->cells_u, start + 24, 4);
    memcpy(&table->cells_k, start + 28, 4);
    memcpy(&table->k_max, start + 32, 8);
    memcpy(&table->max_error, start + 40, 8);
    memcpy(&table->max_slope_error, start + 48, 8);
    memcpy(&table->certificate_points, start + 56, 8);
    memcpy(&table->static_to_kinetic, start + 64, 8);
    memcpy(&table->one_axis, start + 72, 4);
    memcpy(&table->twice_decay, start + 76, 4);
    memcpy(&table->twice_corner, start + 80, 4);
    memcpy(&table->root_k, start + 84, 4);
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
    if (size != TABLE_HEADER + count * sizeof(double))
        return "the table's length does not fit its number of cells";
    if (!(table->static_to_kinetic >= 0.0 && table->static_to_kinetic <= 1e3))
        return "the table's static_to_kinetic is out of range";
    if (!(table->k_max > 0.0 && table->k_max <= 1e3)) return "the table's k_max is out of range";
    for (size_t i = 0; i < count; i++)
        if (!isfinite(table->coefficients[i])) return "the table holds a number that is not finite";
    return NULL;
}
