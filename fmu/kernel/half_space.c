#include "half_space.h"

#include <math.h>

#include "creep_coefficients.h"
#include "simd_math.h"

static const double PI = 3.14159265358979324;

/* Chebyshev's polynomials from T_0 on at -1 <= x <= 1. */
static void chebyshev(int n, double x, double value[]) {
    value[0] = 1.0;
    value[1] = x;
    for (int i = 2; i < n; i++) value[i] = 2.0 * x * value[i - 1] - value[i - 2];
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
static double softening(double stiffness, double saturation) {
    double at = stiffness * saturation;
    return (1.0 - 1.0 / at) / at;
}

static double held(double a_over_b) { return smaller(larger(a_over_b, MIN_ASPECT), MAX_ASPECT); }

/* Values whose logarithms are polynomials of g = a/b, which is within its range, and nu. */
static void values(int n, const double logarithms[][ASPECT_TERMS][POISSON_TERMS], double g,
                   double nu, double value[]) {
    double along[ASPECT_TERMS], across[POISSON_TERMS];
    chebyshev(ASPECT_TERMS, logarithm(g) / 3.0, along);
    chebyshev(POISSON_TERMS, 4.0 * nu - 1.0, across);
    for (int k = 0; k < n; k++) {
        double log_of = 0.0;
        for (int i = 0; i < ASPECT_TERMS; i++)
            for (int j = 0; j < POISSON_TERMS; j++)
                log_of += logarithms[k][i][j] * along[i] * across[j];
        value[k] = exponential(log_of);
    }
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
    scales->softening_x = softening(scales->stiffness_x, x);
    scales->softening_y = softening(scales->stiffness_y, y);
}

void relaxation_lengths_of(double a_over_b, double poisson_ratio, relaxation_lengths *lengths) {
    double length[3];
    values(3, RELAXATION_LENGTHS, held(a_over_b), poisson_ratio, length);
    lengths->longitudinal = length[0];
    lengths->lateral = length[1];
    lengths->spin = length[2];
}
