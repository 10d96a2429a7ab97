/* What a C program would take instead of the table: Polach's formulas, a cubic Hermite table,
 * FASTSIM, and a table of forces over three creepages and a/b as USETAB is. And loops that call a
 * function of one point through a pointer, as the user of a library does.
 *
 * Sources: O. Polach, "Creep forces in simulations of traction vehicles running on adhesion
 * limit", Wear 258 (2005) 992-1000; O. Polach, "A fast wheel-rail forces calculation computer
 * code", Vehicle System Dynamics 33 supplement (1999) 728-739; J.J. Kalker, "A fast algorithm for
 * the simplified theory of rolling contact", Vehicle System Dynamics 11 (1982) 1-13. */
#include <math.h>
#include <stddef.h>

#include "creep_forces.h"
#include "creep_table.h"

/* What Python reads, down to the line. */

/* An odd function of x. */
typedef struct {
    size_t cells;
    double per_length;   /* cells per unit of x */
    const double *nodes; /* cells + 1 pairs of value and slope times the cell's length */
} hermite;

/* Stiffness: Kalker's c11, c22 and c23 times G a b/(mu P). Creepages in Kalker's signs, spin times
 * sqrt(a b). */
typedef struct {
    double a_over_b;
    double stiffness[3];
    double creepage[3];
} polach_contact;

/* Multilinear in a place of a/b, up to 1, and in v/(1 + |v|) of three normalized creepages. */
typedef struct {
    size_t nodes[4];
    double start[4]; /* where each axis begins: 0 or -1 */
    const double *values;
} usetab;

typedef void (*table_function)(const creep_table *, double, double, double, creep_value *);
typedef void (*forces_function)(const creep_forces *, size_t, const creep_forces_input *,
                                creep_forces_output *);

/* Polach's traction ratio; the factors are his reductions times the gradient. */
void polach_each(double stick_factor, double slip_factor, size_t n, const double *x, double *ratio);
/* Forces along and across over mu P; n times 2. */
void polach_with_spin_each(size_t n, const polach_contact *contact, double *force);
void hermite_each(const hermite *h, size_t n, const double *x, double *value, double *slope);
/* Rates of the longitudinal and lateral creepage, and of spin along and across: n times 4. */
void fastsim_each(size_t n, size_t strips, size_t elements, const double *rate, double *force);
/* Forces along and across and moment over mu P; n times 4 places, n times 3 forces. */
void usetab_each(const usetab *table, size_t n, const double *at, double *force);
void table_each(table_function evaluate, const creep_table *table, size_t n, const double *x,
                const double *k_hat, double *ratio, double *slope);
void forces_each(forces_function evaluate, const creep_forces *bodies, size_t n,
                 const creep_forces_input *input, creep_forces_output *output);
/* ---------------------------------------------------------------------------------------------- */

static const double PI = 3.14159265358979323846;

/* Not inlined: the price of one evaluation, not of one in a loop. */
#define ONE_BY_ONE static __attribute__((noinline))

ONE_BY_ONE double polach_ratio(double stick_factor, double slip_factor, double x) {
    double stick = stick_factor * x;
    return 2.0 / PI * (stick / (1.0 + stick * stick) + atan(slip_factor * x));
}

void polach_each(double stick_factor, double slip_factor, size_t n, const double *x,
                 double *ratio) {
    for (size_t i = 0; i < n; i++) ratio[i] = polach_ratio(stick_factor, slip_factor, x[i]);
}

ONE_BY_ONE void polach_with_spin(const polach_contact *c, double force[2]) {
    double sx = c->creepage[0], sy = c->creepage[1], turn = sqrt(c->a_over_b) * c->creepage[2];
    double led = fabs(sy + turn) > fabs(sy) ? sy + turn : sy; /* spin counts at the leading edge */
    double slip = sqrt(sx * sx + sy * sy), size = sqrt(sx * sx + led * led);
    force[0] = force[1] = 0.0;
    if (size == 0.0) return;
    if (slip > 0.0) {
        double kx = c->stiffness[0] * sx / slip, ky = c->stiffness[1] * sy / slip;
        double eps = 0.25 * PI * sqrt(kx * kx + ky * ky) * size;
        double total = -2.0 / PI * (eps / (1.0 + eps * eps) + atan(eps));
        force[0] = total * sx / size;
        force[1] = total * sy / size;
    }
    double wide = 1.0 + 6.3 * (1.0 - exp(-c->a_over_b));
    double eps = 8.0 / 3.0 * c->stiffness[2] / sqrt(c->a_over_b) * fabs(led) / wide;
    double d = (eps * eps - 1.0) / (eps * eps + 1.0), rest = 1.0 - d * d;
    double km = eps * (d * d * d / 3.0 - 0.5 * d * d + 1.0 / 6.0) - rest * sqrt(rest) / 3.0;
    force[1] += 9.0 / 16.0 * km * wide * turn / size;
}

void polach_with_spin_each(size_t n, const polach_contact *contact, double *force) {
    for (size_t i = 0; i < n; i++) polach_with_spin(&contact[i], force + 2 * i);
}

ONE_BY_ONE void hermite_evaluate(const hermite *h, double x, double *value, double *slope) {
    double place = fabs(x) * h->per_length;
    size_t cell = place < (double)h->cells ? (size_t)place : h->cells - 1;
    const double *a = h->nodes + 2 * cell; /* value and slope times the cell's length */
    double f = place - (double)cell, rise = a[2] - a[0];
    double c = 3.0 * rise - 2.0 * a[1] - a[3], d = a[1] + a[3] - 2.0 * rise;
    *value = copysign(a[0] + f * (a[1] + f * (c + f * d)), x);
    *slope = (a[1] + f * (2.0 * c + 3.0 * f * d)) * h->per_length;
}

void hermite_each(const hermite *h, size_t n, const double *x, double *value, double *slope) {
    for (size_t i = 0; i < n; i++) hermite_evaluate(h, x[i], &value[i], &slope[i]);
}

/* Strips along the rolling direction, each stepped from its leading edge: the traction grows as if
 * the surface stuck, and is cut back to what friction allows. Tractions are in units of mu p0 with
 * the theory's parabolic pressure p0 (1 - xi^2 - eta^2), lengths in semi-axes, and the rates are
 * what a traction would grow by over one semi-axis. */
static void fastsim(size_t strips, size_t elements, const double rate[4], double force[2]) {
    double sum[2] = {0.0, 0.0};
    for (size_t j = 0; j < strips; j++) {
        double eta = (2.0 * (double)j + 1.0) / (double)strips - 1.0;
        double half = sqrt(1.0 - eta * eta), length = 2.0 * half / (double)elements;
        double along = rate[0] - rate[2] * eta, px = 0.0, py = 0.0;
        double strip[2] = {0.0, 0.0};
        for (size_t i = 0; i < elements; i++) {
            double xi = half - ((double)i + 0.5) * length;
            double grown = i == 0 ? 0.5 * length : length;
            px += along * grown;
            py += (rate[1] + rate[3] * (xi + 0.5 * grown)) * grown;
            double bound = half * half - xi * xi, size = sqrt(px * px + py * py);
            if (size > bound) {
                px *= bound / size;
                py *= bound / size;
            }
            strip[0] += px;
            strip[1] += py;
        }
        sum[0] += strip[0] * length;
        sum[1] += strip[1] * length;
    }
    /* Q/(mu P) with P = (pi/2) a b p0; a strip is 2/strips wide. */
    for (int i = 0; i < 2; i++) force[i] = 2.0 / PI * 2.0 / (double)strips * sum[i];
}

void fastsim_each(size_t n, size_t strips, size_t elements, const double *rate, double *force) {
    for (size_t i = 0; i < n; i++) fastsim(strips, elements, rate + 4 * i, force + 2 * i);
}

ONE_BY_ONE void usetab_force(const usetab *table, const double at[4], double force[3]) {
    double along = at[1] < 0.0 ? -1.0 : 1.0, turn = at[3] < 0.0 ? -1.0 : 1.0;
    double sign[4] = {1.0, along, turn, turn}, rest[4], sum[3] = {0.0, 0.0, 0.0};
    size_t first = 0;
    for (int i = 0; i < 4; i++) {
        double v = sign[i] * at[i], cells = (double)(table->nodes[i] - 1);
        double u = i == 0 ? v : v / (1.0 + fabs(v));
        double place = (u - table->start[i]) / (1.0 - table->start[i]) * cells;
        double cell = fmin(floor(place), cells - 1.0);
        rest[i] = place - cell;
        first = first * table->nodes[i] + (size_t)cell;
    }
    for (unsigned corner = 0; corner < 16; corner++) {
        double share = 1.0;
        size_t step = 0;
        for (int i = 0; i < 4; i++) {
            unsigned upper = corner >> i & 1u;
            share *= upper ? rest[i] : 1.0 - rest[i];
            step = step * table->nodes[i] + upper;
        }
        const double *value = table->values + 3 * (first + step);
        for (int k = 0; k < 3; k++) sum[k] += share * value[k];
    }
    for (int k = 0; k < 3; k++) force[k] = sign[1 + k] * sum[k];
}

void usetab_each(const usetab *table, size_t n, const double *at, double *force) {
    for (size_t i = 0; i < n; i++) usetab_force(table, at + 4 * i, force + 3 * i);
}

void table_each(table_function evaluate, const creep_table *table, size_t n, const double *x,
                const double *k_hat, double *ratio, double *slope) {
    for (size_t i = 0; i < n; i++) {
        creep_value value;
        evaluate(table, x[i], *k_hat, 0.0, &value);
        ratio[i] = value.traction_ratio;
        slope[i] = value.slope;
    }
}

void forces_each(forces_function evaluate, const creep_forces *bodies, size_t n,
                 const creep_forces_input *input, creep_forces_output *output) {
    for (size_t i = 0; i < n; i++) evaluate(bodies, 1, &input[i], &output[i]);
}
