/* Rolling that is not steady: a contact that remembers what it rolled over.
 *
 * The state is two numbers, from which the force follows (a third with lateral slip, see below):
 *
 *     q   creep force over f_d P [1]; f_d q is held_traction
 *     h   part of the contact that has not slipped since it entered, 0 to 1 [1]; unslipped
 *
 * It changes with
 *
 *     V       speed [m/s]                            R = f_s/f_d - 1
 *     a       semi-width [m]                         k_hat, by Eq. (17) [1]
 *     x       normalized creepage zeta/zeta0 [1]     D = Delta/(a zeta0), weakening length [1]
 *     Q(x)    steady law: force over f_d P [1]       sigma, relaxation length over a [1]
 *     S0      its initial slope Q'(0) [1]            kappa, stiffness at standstill over S0/sigma
 *
 * for x > 0; in braking x, Q and q change their signs. In this order:
 *
 * 1. Part m that sticks in steady rolling (exact for Carter's law), held within 0 and 1:
 *        m = 2 Q/(S0 x) - 1
 * 2. Force T at which a contact that stands still breaks loose; its friction is f_s if it weakens
 *    over a long zone, and less over a short one:
 *        E = (3/2) k_hat^(4/3),   T = min(1 + (9/4) E R/sqrt(E^2 + R^2), 1 + R)
 * 3. Force F of a contact that has not slipped: the parabola of Carter's law under this friction:
 *        z = min(S0 x/(2 T), 1),   F = T z (2 - z)
 * 4. Force G that q approaches. Only the unslipped part is stronger than in steady rolling:
 *        G = Q + max(h - m, 0) max(F - Q, 0)
 * 5. Length of the lag, sigma a L:
 *        r = q/G,   y = 1 - r,   s = min(G/(S0 x), 1),   m' = min(max(m, D/(sigma x), s/20), s)
 *        L = m' (1 + (1/kappa - 1) y^3) + (s - m') y^(2/3)/kappa     for 0 <= r < 1
 *        L = y s/(kappa + s |r| (1/2 + |r|)/y)                       for r < 0
 *        L = m'/(1 + 100 max(q - 1 - R, 0))                          for r >= 1
 * 6. Target h' of the unslipped part: m, and up to 1 while the force opposes the creepage, as the
 *    whole contact then sticks. It wears off over the weakening length D', at least sigma/(8 S0):
 *        h' = m + (1 - m) min(max(-r, 0), 1),   D' = max(D, sigma/(8 S0))
 * 7. Rates [1/s], with r from 0 to 1 in the second; 9/4 counts while h < h':
 *        dq/dt = V/(sigma a) (G - q)/L
 *        dh/dt = V/(sigma a) ((5/2) (sigma x/D') r^8 + 9/4) (h' - h)
 *
 * If friction does not weaken, G = Q and h' = m. In steady rolling q = Q and h = m, the law itself.
 * Small creepages lag by sigma a, and a sliding contact follows within the distance a D/x over
 * which its friction weakens. Without rolling (x -> infinity at a given displacement x V t/a = d) a
 * force that begins at zero is Mindlin's, 1 - (1 - 2 kappa S0 d/(3 sigma))^(3/2) with f_s = f_d.
 * Creepage does at least the work q x >= d(sigma q^2/(2 kappa S0))/d(V t/a), so no history yields
 * energy. kappa and sigma follow from the half-space; the other numbers and powers were fitted to
 * transient solutions.
 *
 * With lateral slip or spin q is a vector, x and Q are magnitudes, e is the direction of the steady
 * force, and the component q.e takes the place of q above:
 *
 *     dq/dt = V/(sigma a) [(G - q.e) e/L - (q - (q.e) e)/L'],   L' = s (m + (1 - m)/kappa)
 *
 * with the sigma of each component before the bracket. Across the force nothing slips faster when
 * more slips, so the compliance of the whole contact turns it. The spin moment is that of steady
 * rolling. */
#ifndef MEMORY_H
#define MEMORY_H

#include <math.h>
#include <string.h>

#include "force_element.h"
#include "simd_math.h"

/* The same as minimum_speed for a contact with memory [m/s]. */
static const double STANDSTILL = 1e-6;

ALWAYS_INLINE int remembers(const force_element_parameters *p) {
    return p->relaxation_length > 0.0;
}

/* Speed below which the reference speed of the creepage is regularised [m/s]. */
ALWAYS_INLINE double slowest_speed(const force_element_parameters *p) {
    return remembers(p) ? STANDSTILL : p->minimum_speed;
}

/* What errors of a held force over the load are relative to: beyond 1e3, far above any friction, a
 * substep has diverged, and an error relative to its end would be small. */
ALWAYS_INLINE double traction_scale(const force_element_parameters *p, double held) {
    return smaller(held, 1e3) + p->kinetic_friction;
}

/* What the flow depends on, and its changes by each. */
enum { BY_X, BY_RATIO, BY_K, BY_WEAKENING, BY_TRACTION, BY_UNSLIPPED, BY_PACE, MEMORY_ARGUMENTS };
typedef double memory_gradient[MEMORY_ARGUMENTS];

typedef struct {
    double strength; /* G */
    double fast;     /* V/(sigma a L) [1/s] */
    double turn;     /* the same across the steady force [1/s] */
    double rate;     /* dh/dt [1/s] */
    memory_gradient strength_by, fast_by, turn_by, rate_by;
    double per_length; /* 1/L */
    double sticking;   /* m [1] */
} memory_flow;

/* Flow at x > 0, where Q is the ratio; q is positive in the direction of the steady force, and pace
 * is the speed over sigma a. */
ALWAYS_INLINE memory_flow memory_flow_at(const force_element_parameters *p, double x, double ratio,
                                         double k, double weakening, double q, double h,
                                         double pace) {
    const double slope = p->initial_slope, kappa = p->standing_stiffness;
    double sigma = p->relaxation_length / p->semi_width;
    double excess = p->static_friction / p->kinetic_friction - 1.0, limit = 1.0 + excess; /* R */
    int weakens = (excess > 0.0) & (k > 0.0) & (weakening > 0.0);
    double per = 1.0 / (slope * x);

    double raw = 2.0 * ratio * per - 1.0, m = smaller(larger(raw, 0.0), 1.0);
    int open = (raw > 0.0) & (raw < 1.0);
    double m_ratio = open ? 2.0 * per : 0.0, m_x = open ? -2.0 * ratio * per / x : 0.0;

    /* Strength of the contact with its unslipped part. */
    double e = weakens ? 1.5 * k * cube_root(weakens ? k : 1.0) : 0.0; /* E */
    double root = sqrt(e * e + excess * excess), inverse = 1.0 / (root > 0.0 ? root : 1.0);
    double standing = 1.0 + 2.25 * e * excess * inverse, cube = excess * inverse;
    int limited = standing < limit;
    double top = limited ? standing : limit, /* T */
        z = smaller(0.5 * slope * x / top, 1.0);
    double above = top * z * (2.0 - z) - ratio, more = h - m;
    int stronger = weakens & (more > 0.0) & (above > 0.0);
    more = stronger ? more : 0.0;
    above = stronger ? above : 0.0;
    double strength = ratio + more * above; /* G */
    double strength_ratio = 1.0 - m_ratio * above - more;
    double strength_x = more * slope * (1.0 - z) - m_x * above;
    double top_k = limited ? 3.0 * cube * cube * cube * (e / (weakens ? k : 1.0)) : 0.0;
    double strength_k = more * z * z * top_k;

    /* Length of the lag, and its derivatives by m', s and r. */
    double whole_secant = strength * per, secant = smaller(whole_secant, 1.0); /* spin adds force */
    double minimum = 0.05 * secant, after = weakening / (x * sigma);
    int by_stick = (m >= after) & (m >= minimum), by_slip = !by_stick & (after > minimum);
    double part = by_stick ? m : by_slip ? after : minimum; /* of m' */
    int whole = part > secant;
    part = whole ? secant : part;
    double part_secant = whole ? 1.0 : (by_stick | by_slip) ? 0.0 : 0.05;
    double part_ratio = (by_stick & !whole) ? m_ratio : 0.0;
    double part_x = whole ? 0.0 : by_stick ? m_x : by_slip ? -after / x : 0.0;
    double part_weakening = (by_slip & !whole) ? 1.0 / (x * sigma) : 0.0;
    double r = q / strength, y = larger(1.0 - r, 1e-9);
    int against = r < 0.0, beyond = r >= 1.0;
    double third = cube_root(y), two_thirds = third * third, soft = 1.0 / kappa - 1.0;
    double over = larger(q - limit, 0.0), brake = 1.0 / (1.0 + 100.0 * over);
    double size = larger(-r, 0.0), per_size = 1.0 / (1.0 + size);
    double loss = size * (0.5 + size) * per_size;
    double loss_size = (0.5 + size * (2.0 + size)) * per_size * per_size;
    double per_base = 1.0 / (kappa + secant * loss);
    double square = y * y, rest = (secant - part) / kappa;
    double length = against  ? y * secant * per_base
                    : beyond ? part * brake
                             : part * (1.0 + soft * square * y) + rest * two_thirds;
    double l_part = against ? 0.0 : beyond ? brake : 1.0 + soft * square * y - two_thirds / kappa;
    double l_secant = against ? y * kappa * per_base * per_base : beyond ? 0.0 : two_thirds / kappa;
    double l_r = against  ? secant * per_base * (y * secant * loss_size * per_base - 1.0)
                 : beyond ? 0.0
                          : -3.0 * soft * part * square - rest * (2.0 / 3.0) / third;
    double l_q = (beyond & (over > 0.0)) ? -100.0 * length * brake : 0.0;
    l_secant = whole_secant < 1.0 ? l_secant + part_secant * l_part : 0.0;
    double by_strength = l_secant * per - l_r * r / strength; /* s and r are G per and q/G */

    memory_flow flow;
    memset(&flow, 0, sizeof flow);
    double fast = pace / length, bend = -fast / length;
    flow.per_length = 1.0 / length;
    flow.sticking = m;
    flow.strength = strength;
    flow.fast = fast;
    double *by = flow.strength_by;
    by[BY_X] = strength_x;
    by[BY_RATIO] = strength_ratio;
    by[BY_K] = strength_k;
    by[BY_UNSLIPPED] = above;
    by = flow.fast_by;
    for (int i = 0; i < MEMORY_ARGUMENTS; i++) by[i] = bend * by_strength * flow.strength_by[i];
    by[BY_X] += bend * (l_part * part_x - l_secant * secant / x);
    by[BY_RATIO] += bend * l_part * part_ratio;
    by[BY_WEAKENING] = bend * l_part * part_weakening;
    by[BY_TRACTION] = bend * (l_r / strength + l_q);
    by[BY_PACE] = flow.per_length;

    double across = 1.0 / kappa - soft * m, per_across = 1.0 / (secant * across);
    flow.turn = pace * per_across;
    bend = -flow.turn * per_across;
    by = flow.turn_by;
    double free = whole_secant < 1.0 ? 1.0 : 0.0;
    for (int i = 0; i < MEMORY_ARGUMENTS; i++)
        by[i] = bend * across * free * per * flow.strength_by[i];
    by[BY_X] -= bend * secant * (across * free / x + soft * m_x);
    by[BY_RATIO] -= bend * secant * soft * m_ratio;
    by[BY_PACE] = per_across;

    double back = against ? smaller(-r, 1.0) : 0.0, target = m + (1.0 - m) * back;
    target = weakens ? target : m;
    double pull = (!weakens | (h < target)) ? 2.25 : 0.0;
    int turning = weakens & against & (r > -1.0);
    double by_back = turning ? 1.0 - m : 0.0; /* of the target by -r */
    double target_m = 1.0 - (weakens ? back : 0.0);
    double inside = smaller(larger(r, 0.0), 1.0), second = inside * inside;
    /* A shorter distance would make h quicker than q. */
    double shortest = 0.125 * sigma / slope, weaken = larger(weakening, shortest);
    double wear = weakens ? 2.5 * sigma * x / weaken : 0.0, fourth = second * second;
    double worn = wear * fourth * fourth;
    double worn_r = ((r > 0.0) & (r < 1.0)) ? 8.0 * wear * fourth * second * inside : 0.0;
    double quick = pull + worn, apart = target - h, per_pace = quick * apart;
    double by_m = pace * quick * target_m, by_r = pace * (worn_r * apart - quick * by_back);
    double r_strength = -r / strength;
    by = flow.rate_by;
    flow.rate = pace * per_pace;
    by[BY_X] = by_m * m_x + by_r * r_strength * strength_x + pace * worn * apart / x;
    by[BY_RATIO] = by_m * m_ratio + by_r * r_strength * strength_ratio;
    by[BY_K] = by_r * r_strength * strength_k;
    by[BY_WEAKENING] = weakening < shortest ? 0.0 : -pace * worn * apart / weaken;
    by[BY_TRACTION] = by_r / strength;
    by[BY_UNSLIPPED] = by_r * r_strength * above - pace * quick;
    by[BY_PACE] = per_pace;
    return flow;
}

#endif
