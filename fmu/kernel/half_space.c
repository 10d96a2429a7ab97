#include "half_space.h"

#include <math.h>

#include "creep_coefficients.h"
#include "hertz.h"
#include "simd_math.h"

/* Four or more of Chebyshev's polynomials from T_0 on at -1 <= x <= 1. Those of even and of odd
 * order do not wait for each other. */
static void chebyshev(int n, double x, double value[]) {
    double twice = 4.0 * x * x - 2.0; /* 2 T_2 */
    value[0] = 1.0;
    value[1] = x;
    value[2] = 0.5 * twice;
    value[3] = x * (twice - 1.0);
    for (int i = 4; i < n; i++) value[i] = twice * value[i - 2] - value[i - 4];
}

static double held(double a_over_b) { return smaller(larger(a_over_b, MIN_ASPECT), MAX_ASPECT); }

/* Values whose logarithms are polynomials of g = a/b, which is within its range, and nu. */
static void values(int n, const double logarithms[][ASPECT_TERMS][POISSON_TERMS], double g,
                   double nu, double value[]) {
    double along[ASPECT_TERMS], across[POISSON_TERMS];
    chebyshev(ASPECT_TERMS, logarithm(g) / 3.0, along);
    chebyshev(POISSON_TERMS, 4.0 * nu - 1.0, across);
    for (int k = 0; k < n; k++) {
        double log_of = 0.0, at_g[POISSON_TERMS] = {0.0}; /* sums over neighbours in the memory */
        for (int i = 0; i < ASPECT_TERMS; i++)
            for (int j = 0; j < POISSON_TERMS; j++) at_g[j] += logarithms[k][i][j] * along[i];
        for (int j = 0; j < POISSON_TERMS; j++) log_of += at_g[j] * across[j];
        value[k] = exponential(log_of);
    }
}

/* Of bodies of one shape with a layer between them. */
typedef struct {
    double length;    /* relaxation length of the layer between rigid bodies, over a: traction grows
                         in proportion to the distance from the leading edge */
    double stiffness; /* at standstill of the same, times the layer ratio */
    double edge;      /* see standing_compliance */
    double later;     /* see length_with_layer; fitted */
} layer_memory;

static const layer_memory LAYER_ELLIPSE = {0.1875 * PI, 1.5, 0.25, 0.13};
static const layer_memory LAYER_LINE = {2.0 / 3.0, 4.0 / PI, 2.0 / (PI * PI), 0.03};

/* Displacement per force at standstill. A stiff layer rounds the singularity of the traction at the
 * edge, a soft one makes the traction uniform, under which the bodies yield more by `rise`. Both
 * limits are exact. */
static double standing_compliance(const layer_memory *shape, double bodies, double rise,
                                  double layer_ratio) {
    if (layer_ratio == 0.0) return bodies;
    double layer = larger(layer_ratio / shape->stiffness, 1e-300), edge = shape->edge;
    return bodies + layer * (1.0 + edge * logarithm(1.0 + rise / (edge * layer)));
}

/* Relaxation length over a, where the layer softens rolling by the ratio `softer`: the mean
 * weighted by compliance, and a little more. */
static double length_with_layer(const layer_memory *shape, double bodies, double softer) {
    double part = 1.0 / (1.0 + softer), more = 1.0 + shape->later * (1.0 - part);
    return shape->length + (bodies - shape->length) * part * more;
}

/* Relaxation length of a line contact with one state along its length, which is in semi-widths. The
 * mean over its length of Cerruti's displacement by a line of tractions at the distance d is that
 * of ln(2 length/(e d)), which gives `lag`, and of d/length. */
static double length_of_line(double lag, double c, double length) {
    return lag + 8.0 * c / (PI * PI * length) * (lag + 5.0 / 3.0);
}

void shape_memory_of(int elliptic, double a_over_b, double poisson_ratio, shape_memory *shape) {
    double g = elliptic ? held(a_over_b) : smaller(a_over_b, MAX_LINE_ASPECT), nu = poisson_ratio;
    shape->lateral = 1.0 - nu;
    if (elliptic) {
        values(2, RELAXATION_LENGTHS, g, nu, shape->length);
        shape->lateral = 1.0 - nu * (1.0 - 0.345 * g) / (1.0 + 0.5 * g); /* c22/c11, steel: 2 % */
        /* Mindlin's problem: tractions like one over the root of 1 - X^2 - Y^2 displace the centre
         * by the integrals of cos^2 and (1 - nu) sin^2 over sqrt(cos^2 + g^2 sin^2). */
        shape->compliance = elliptic_integral(g, 1.0, 1.0 - nu) / (3.0 * (1.0 - nu));
        shape->rise = (32.0 / (3.0 * PI * PI) - 1.0) * shape->compliance;
    } else {
        double lines = 2.0 / g, lag = logarithm(4.0 * lines) - 1.5, e = nu / (1.0 - nu);
        shape->length[0] = length_of_line(lag + e, (1.0 - 2.0 * nu) / (1.0 - nu), lines);
        shape->length[1] = length_of_line(lag - nu, 1.0 + nu, lines);
        shape->compliance = 0.5 * (lag + 0.5 + e);
        shape->rise = 0.75 - 0.69314718055994531; /* ln(2) */
    }
}

void memory_with_layer(int elliptic, const shape_memory *shape, double layer_ratio, double softer,
                       contact_memory *memory) {
    const layer_memory *layer = elliptic ? &LAYER_ELLIPSE : &LAYER_LINE;
    memory->relaxation_length = length_with_layer(layer, shape->length[0], softer);
    memory->lateral_relaxation_length =
        length_with_layer(layer, shape->length[1], softer * shape->lateral);
    memory->standing_stiffness =
        1.0 / standing_compliance(layer, shape->compliance, shape->rise, layer_ratio);
}

#ifndef ONE_FILE_KERNEL
void contact_memory_of(int elliptic, double a_over_b, double poisson_ratio, double layer_ratio,
                       double softer, contact_memory *memory) {
    shape_memory shape;
    shape_memory_of(elliptic, a_over_b, poisson_ratio, &shape);
    memory_with_layer(elliptic, &shape, layer_ratio, softer, memory);
}

/* Creepages along and across rolling at which the stick area vanishes, over zeta0 of strips. They
 * are the largest strains under Hertz's traction in full slip, with g = a/b:
 *
 *     x = g^2/(2 (1 - nu)) int (1 - nu sin^2) sin^2 / (cos^2 + g^2 sin^2)^(3/2)
 *     y = g^2/2 int (1 - nu cos^2) sin^2 / (cos^2 + g^2 sin^2)^(3/2)
 *
 * over half a turn of t. With tan(phi) = sqrt(g) tan(t) the integrands are smooth for any g, and
 * the trapezoidal rule over phi converges geometrically. */
static void saturation(double g, double nu, double *x, double *y) {
    enum { HALVINGS = 6, POINTS = 1 << HALVINGS };
    double c1 = -1.0, c = 1.0, s = 0.0, whole = 0.0, along = 0.0;
    for (int i = 0; i < HALVINGS; i++) c1 = sqrt(0.5 * (1.0 + c1));
    double s1 = sqrt(1.0 - c1 * c1);
    for (int i = 0; i < POINTS; i++) {
        double circle = g * c * c + s * s, ellipse = c * c + g * s * s;
        double part = 0.5 * g * s * s / (sqrt(circle * ellipse) * ellipse);
        whole += part;
        along += part * s * s / circle; /* sin(t)^2 is sin(phi)^2/circle */
        double next = c * c1 - s * s1;
        s = s * c1 + c * s1;
        c = next;
    }
    *x = (whole - nu * along) * (PI / POINTS) / (1.0 - nu);
    *y = (whole - nu * (whole - along)) * (PI / POINTS);
}

/* Softening that makes a stiffness vanish where the stick area does. */
static double softening_of(double stiffness, double saturation) {
    double at = stiffness * saturation;
    return (1.0 - 1.0 / at) / at;
}

void half_space_scales_of(double a_over_b, double poisson_ratio, half_space_scales *scales) {
    double g = held(a_over_b), nu = poisson_ratio, c[4];
    values(4, CREEP_COEFFICIENTS, g, nu, c);
    scales->c11 = c[0];
    scales->c22 = c[1];
    scales->c23 = c[2];
    scales->c33 = c[3];
    scales->stiffness_x = scales->c11 * (1.0 - nu) * 4.0 / (PI * PI);
    scales->stiffness_y = scales->c22 * 4.0 / (PI * PI);
    scales->spin_scale =
        sqrt(0.5 * (scales->c11 * scales->c11 / g + scales->c22 * scales->c22 * g)) / (1.5 * PI);
    double x, y;
    saturation(g, nu, &x, &y);
    scales->softening_x = softening_of(scales->stiffness_x, x);
    scales->softening_y = softening_of(scales->stiffness_y, y);
}

void relaxation_lengths_of(double a_over_b, double poisson_ratio, relaxation_lengths *lengths) {
    double length[3];
    values(3, RELAXATION_LENGTHS, held(a_over_b), poisson_ratio, length);
    lengths->longitudinal = length[0];
    lengths->lateral = length[1];
    lengths->spin = length[2];
}
#endif /* ONE_FILE_KERNEL */
