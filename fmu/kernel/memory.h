/* Rolling that is not steady: a contact that remembers what it rolled over.
 *
 * The states are the force that the contact holds, the part of it that its outer zone carries,
 * which slips first, and the part of the contact that has not slipped:
 *
 *     q   creep force over f_d P [1]; f_d P q is held_force
 *     c   that of the outer zone [1]; f_d P c is outer_force, and the core carries q - c
 *     h   part of the contact that has not slipped since it entered, 0 to 1 [1]; unslipped
 *
 * They change with
 *
 *     V       speed [m/s]                            R = f_s/f_d - 1
 *     a       semi-width [m]                         k_hat, by Eq. (17) [1]
 *     x       normalized creepage zeta/zeta0 [1]     D = Delta/(a zeta0), weakening length [1]
 *     Q(x)    steady law: force over f_d P [1]       sigma, relaxation length over a [1]
 *     S0      its initial slope Q'(0) [1]            kappa, stiffness at standstill over S0/sigma
 *
 * for x > 0; in braking x, Q, q and c change their signs. All of these are of the present load,
 * friction and layer (set_memory_scales). In this order:
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
 * 5. Stiffness b that is left, of 1, as zones slip that carry their strength in the direction of
 *    change, + or -. Outer zone and core have the shares s1 and s2 of the strength g, and w1 and
 *    w2 of the stiffness; a zone begins to slip at 99 % of its strength:
 *        g = max(1 + h (T - 1), G),   s1 = 0.1567,   w1 = 0.3774,   s2 = 1 - s1,   w2 = 1 - w1
 *        p1 = clip((1 -+ c/(s1 g))/0.01),   p2 = clip((1 -+ (q - c)/(s2 g))/0.01) within 0 and 1,
 *        b = w1 p1 + w2 p2
 * 6. Length of the lag, sigma a L; b is that towards G:
 *        r = q/G,   y = 1 - r,   s = min(G/(S0 x), 1)
 *        m' = min(max(m, D/(sigma x) (1 + y/2)/(1 + x^2 y^2/64), s r^32/50), s)   for r < 1
 *        m' = min(max(m, D/(sigma x), s/50), s)                                  for r >= 1
 *        L = m' max(1 + (1/kappa - 1) y^3, y/(kappa b)) + (s - m') y/(kappa b)   for 0 <= r < 1
 *        L = y s/(kappa b + s |r| (1/2 + |r|)/y)                                 for r < 0
 *        L = m'                                                                  for r >= 1
 * 7. Target h' of the unslipped part: m, and up to 1 while the force opposes the creepage, as the
 *    whole contact then sticks. It wears off over the weakening length D', at least sigma/(8 S0):
 *        h' = m + (1 - m) min(max(-r, 0), 1),   D' = max(D, sigma/(8 S0))
 * 8. Rates [1/s], with r from 0 to 1 in the second; 9/4 counts there while h < h'. Zones share a
 *    change of the force by the stiffness that is left, and rolling lets them return to the shares
 *    of a contact that was loaded once:
 *        dq/dt = V/(sigma a) (G - q)/L
 *        dh/dt = V/(sigma a) ((5/2) (sigma x/D') r^8 + 9/4) (h' - h)
 *        dc/dt = w dq/dt + (9/4) V/(sigma a) (c' - c),   c' = q min(w1, s1 g/|q|)
 *        w = s1 + min(|G - q|/(G/100), 1) (w1 p1/b - s1): as they share their strength near G
 * 9. No zone acts with more than f_s allows: c up to s1 (1 + R), q - c up to s2 (1 + R). What is
 *    more than 5 % above, as the load falls, is lost at the rate of 10^4 1/s, and all without load.
 *
 * If friction does not weaken, G = Q and h' = m. In steady rolling q = Q, h = m and c = c', the law
 * itself. Small creepages lag by sigma a, and a sliding contact follows within the distance a D/x
 * over which its friction weakens. Without rolling (x -> infinity at a given displacement
 * x V t/a = d) the zones are two springs in parallel that slip at their strengths (Iwan),
 * so that loops close (Masing's rule) and none yields energy; a force that begins at zero grows
 * within 0.03 of Mindlin's, 1 - (1 - 2 kappa S0 d/(3 sigma))^(3/2) with f_s = f_d. The energy
 *
 *        sigma/(2 kappa S0) (c^2/w1 + (q - c)^2/w2)
 *
 * grows by at most the work q x of the creepage, so no history yields energy. kappa and sigma
 * follow from the half-space; the other numbers and powers were fitted to transient solutions.
 *
 * With lateral slip or spin q and c are vectors, x and Q are magnitudes, e is the direction of the
 * steady force, and the components along it take the places of q and c above:
 *
 *     dq/dt = V/(sigma a) [(G - q.e) e/L - (q - (q.e) e)/L'],   L' = s (m + (3/2) (1 - m)/kappa)
 *
 * with the sigma of each component before the bracket; c takes w of the first part and c'/q
 * of the second. Across the force nothing slips faster when more slips, so the compliance of the
 * whole contact turns it: that of Mindlin's contact, 1/kappa, times 3/2, by which the traction of
 * a contact that slides, a semi-ellipsoid, displaces the centre further than Mindlin's of the same
 * force (Johnson 1985, sections 3.5 and 7.2). The spin moment is that of steady rolling. */
#ifndef MEMORY_H
#define MEMORY_H

#include <math.h>
#include <string.h>

#include "force_element.h"
#include "simd_math.h"

/* The same as minimum_speed for a contact with memory [m/s]. */
static const double STANDSTILL = 1e-6;

/* Copy the states of the memory. */
ALWAYS_INLINE void take_memory(force_element_input *to, const force_element_input *from) {
    to->memory = from->memory;
    to->lateral = from->lateral;
}

/* Those of a contact that has rolled steadily, from its output. */
ALWAYS_INLINE rolling_memory settled(const force_element_output *out) {
    rolling_memory states = {out->steady_force, out->sticking, out->steady_outer};
    return states;
}

/* Those of a contact that holds no force. */
ALWAYS_INLINE void forget(force_element_input *in) {
    memset(&in->memory, 0, sizeof in->memory);
    memset(&in->lateral, 0, sizeof in->lateral);
    in->memory.unslipped = 1.0;
}

/* Share of the outer zone in stiffness and strength, and the part of a zone's strength over which
 * it begins to slip, and of that part over which its share is smooth. The shares make two zones
 * follow Mindlin's curve best. */
static const double OUTER_STIFFNESS = 0.3774, OUTER_STRENGTH = 0.1567, YIELDING = 0.01,
                    SMOOTHING = 0.01;

/* Rate at which a force beyond friction is lost [1/s], and over that force where this begins: a
 * contact that slides at its strength must not lie on the corner. */
static const double RELEASE = 1e4, SLACK = 1.05;

/* Rate at which the force follows at most [1/s]. A wheel that slips fast under hardly any load
 * would be up to 1e4 times faster, and its rate so curved that a substep ends as far from the
 * steady force as it began. */
static const double QUICKEST = 1e7;

/* Value of the parameter memory with which derivatives of the rates hold their paces constant. */
static const double FROZEN_PACES = 2.0;

ALWAYS_INLINE int remembers(const force_element_parameters *p) { return p->memory != 0.0; }

/* Speed below which the reference speed of the creepage is regularised [m/s]. */
ALWAYS_INLINE double slowest_speed(const force_element_parameters *p) {
    return remembers(p) ? STANDSTILL : p->minimum_speed;
}

/* Part of the nominal load below which errors of forces no longer shrink with the load. */
static const double SMALL_LOAD = 1e-3;

/* What errors of a held force are relative to [N]: beyond a thousand times the load, far above any
 * friction, a substep has diverged, and an error relative to its end would be small. */
ALWAYS_INLINE double force_scale(const force_element_parameters *p, double load, double held) {
    double weight = larger(load, SMALL_LOAD * p->nominal_load);
    return smaller(held, 1e3 * weight) + p->kinetic_friction * weight;
}

/* Part of kinetic friction by which the unslipped part changes the force: F - Q is hardly more. */
static const double PULL_OF_UNSLIPPED = 0.1;

/* Tolerance below which the method of fifth order is faster, also where nothing changes fast. */
ALWAYS_INLINE double fine_tolerance(int remembering) { return remembering ? 3e-6 : 3e-7; }

/* Part of that method's estimate, the error of the embedded solution of fourth order, which the
 * solution that is kept has at the kinks of the memory; where all is smooth it has much less. */
ALWAYS_INLINE double kept_error(int remembering) { return remembering ? 0.2 : 1.0; }

/* What the flow depends on, and its changes by each. */
enum {
    BY_X,
    BY_RATIO,
    BY_K,
    BY_WEAKENING,
    BY_PACE,
    BY_FORCE,
    BY_UNSLIPPED,
    BY_OUTER,
    BY_SIZE,
    MEMORY_ARGUMENTS,
    FROM_STATES = BY_FORCE /* these follow from the states of the memory */
};
typedef double memory_gradient[MEMORY_ARGUMENTS];

typedef struct {
    double strength;          /* G */
    double fast;              /* V/(sigma a L) [1/s] */
    double turn;              /* the same across the steady force [1/s] */
    double rate;              /* dh/dt [1/s] */
    double share;             /* w */
    double carried;           /* c'/q */
    double pull_by_unslipped; /* of dh/dt by h at a constant pace [1/s] */
    memory_gradient strength_by, fast_by, turn_by, rate_by, share_by, carried_by;
    double per_length;     /* 1/L */
    double sticking;       /* m [1] */
    double steady_carried; /* c'/q in steady rolling */
} memory_flow;

/* Stiffness that is left of a zone which carries part of its strength in the direction of change,
 * and its derivative. */
ALWAYS_INLINE double stiffness_of_zone(double carried, double *slope) {
    double left = (1.0 - carried) * (1.0 / YIELDING);
    int slipping = (left > 0.0) & (left < 1.0);
    *slope = slipping ? -1.0 / YIELDING : 0.0;
    return smaller(larger(left, 0.0), 1.0);
}

/* Stiffness b in one direction, the share of the outer zone in it, and their changes by q, c and
 * the strength g; outer and core are the parts of their strengths that the zones carry. */
typedef struct {
    double left, share;
    double left_by[3], share_by[3];
} zone_stiffness;

ALWAYS_INLINE zone_stiffness stiffness_of_zones(double direction, double outer, double core,
                                                double per_g) {
    const double w1 = OUTER_STIFFNESS, w2 = 1.0 - w1;
    double slope1, k1 = w1 * stiffness_of_zone(direction * outer, &slope1);
    double slope2, k2 = w2 * stiffness_of_zone(direction * core, &slope2);
    double by_outer = w1 * slope1 * direction * per_g, by_core = w2 * slope2 * direction * per_g;
    double per_outer = by_outer * (1.0 / OUTER_STRENGTH),
           per_core = by_core * (1.0 / (1.0 - OUTER_STRENGTH));
    zone_stiffness z;
    z.left = larger(k1 + k2, 1e-9);
    double inverse = 1.0 / z.left;
    z.share = k1 * inverse;
    double d1[3] = {0.0, per_outer, -by_outer * outer};
    double d2[3] = {per_core, -per_core, -by_core * core};
    for (int i = 0; i < 3; i++) {
        z.left_by[i] = d1[i] + d2[i];
        z.share_by[i] = (d1[i] - z.share * z.left_by[i]) * inverse;
    }
    return z;
}

/* Flow at x > 0, where Q is the ratio; q and c are the components in the direction of the steady
 * force, size the magnitude of the force, and pace is the speed over sigma a. */
ALWAYS_INLINE memory_flow memory_flow_at(const force_element_parameters *p,
                                         const contact_scales *scales, double x, double ratio,
                                         double k, double weakening, double q, double c,
                                         double size, double h, double pace) {
    const double slope = scales->initial_slope, kappa = scales->standing_stiffness;
    double sigma = scales->relaxation_length / p->semi_width;
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

    memory_flow flow;
    memset(&flow, 0, sizeof flow);
    flow.sticking = m;
    flow.strength = strength;
    double steady_g = larger(1.0 + m * (top - 1.0), ratio);
    flow.steady_carried = smaller(OUTER_STIFFNESS, OUTER_STRENGTH * steady_g / ratio);
    flow.strength_by[BY_X] = strength_x;
    flow.strength_by[BY_RATIO] = strength_ratio;
    flow.strength_by[BY_K] = strength_k;
    flow.strength_by[BY_UNSLIPPED] = above;

    /* Strength of both zones, and its changes. */
    double held = 1.0 + h * (top - 1.0);
    int by_top = held > strength;
    double g = by_top ? held : strength;
    memory_gradient g_by;
    for (int i = 0; i < MEMORY_ARGUMENTS; i++) g_by[i] = by_top ? 0.0 : flow.strength_by[i];
    g_by[BY_K] = by_top ? h * top_k : strength_k;
    g_by[BY_UNSLIPPED] = by_top ? top - 1.0 : above;
    double per_g = 1.0 / g, outer = c * per_g * (1.0 / OUTER_STRENGTH);
    double core = (q - c) * per_g * (1.0 / (1.0 - OUTER_STRENGTH));
    zone_stiffness towards = stiffness_of_zones(1.0, outer, core, per_g);
    int onward = q <= strength;
    zone_stiffness taken = onward ? towards : stiffness_of_zones(-1.0, outer, core, per_g);
    double stiffness = kappa * towards.left, soft_zones = 1.0 / stiffness;

    /* Length of the lag, and its derivatives by m', s, r and b. */
    double whole_secant = strength * per, secant = smaller(whole_secant, 1.0); /* spin adds force */
    double r = q / strength, y = larger(1.0 - r, 0.0);
    int against = r < 0.0, beyond = r >= 1.0;
    /* Towards G the zones alone delay a contact that hardly rolls. */
    double rising = smaller(larger(r, 0.0), 1.0), rising2 = rising * rising;
    double rising8 = rising2 * rising2 * rising2 * rising2, rising16 = rising8 * rising8;
    double least = 0.02 * rising16 * rising16;
    double least_r = (beyond | against) ? 0.0 : 32.0 * least / larger(rising, 1e-3);
    double part_of = x * x * y * y * (1.0 / 64.0), per_rolled = (1.0 + 0.5 * y) / (1.0 + part_of);
    double minimum = least * secant, after = weakening / (x * sigma) * per_rolled;
    double after_r = 2.0 * part_of / (larger(y, 1e-300) * (1.0 + part_of)) - 1.0 / (2.0 + y);
    int by_stick = (m >= after) & (m >= minimum), by_slip = !by_stick & (after > minimum);
    double part = by_stick ? m : by_slip ? after : minimum; /* of m' */
    int whole = part > secant;
    part = whole ? secant : part;
    int by_least = !(whole | by_stick | by_slip);
    double part_secant = whole ? 1.0 : by_least ? least : 0.0;
    int slips = by_slip & !whole & !beyond;
    double part_r = by_least ? least_r * secant : slips ? after * after_r : 0.0;
    double part_ratio = (by_stick & !whole) ? m_ratio : 0.0;
    double part_x = whole      ? 0.0
                    : by_stick ? m_x
                    : by_slip  ? -after * (1.0 + 2.0 * part_of / (1.0 + part_of)) / x
                               : 0.0;
    double part_weakening = (by_slip & !whole) ? per_rolled / (x * sigma) : 0.0;
    double soft = 1.0 / kappa - 1.0, square = y * y, lagging = 1.0 + soft * square * y;
    double spring = y * soft_zones; /* y/(kappa b) */
    int springs = spring > lagging;
    double sticking = springs ? spring : lagging, rest = secant - part;
    double back = larger(-r, 0.0), per_back = 1.0 / (1.0 + back);
    double loss = back * (0.5 + back) * per_back;
    double loss_back = (0.5 + back * (2.0 + back)) * per_back * per_back;
    double per_base = 1.0 / (stiffness + secant * loss);
    double length = against  ? y * secant * per_base
                    : beyond ? part
                             : part * sticking + rest * spring;
    double l_part = against ? 0.0 : beyond ? 1.0 : sticking - spring;
    double l_secant = against ? y * stiffness * per_base * per_base : beyond ? 0.0 : spring;
    double l_r = against ? secant * per_base * (y * secant * loss_back * per_base - 1.0)
                 : beyond
                     ? 0.0
                     : part * (springs ? -soft_zones : -3.0 * soft * square) - rest * soft_zones;
    double l_left = against  ? -kappa * y * secant * per_base * per_base
                    : beyond ? 0.0
                             : -(springs ? secant : rest) * spring / towards.left;
    l_r += part_r * l_part;
    l_secant = whole_secant < 1.0 ? l_secant + part_secant * l_part : 0.0;
    double by_strength = l_secant * per - l_r * r / strength; /* s and r are G per and q/G */
    double l_g = l_left * towards.left_by[2];

    double fast = pace / length, bend = -fast / length;
    int capped = fast > QUICKEST;
    flow.per_length = 1.0 / length;
    flow.fast = capped ? QUICKEST : fast;
    double *by = flow.fast_by;
    for (int i = 0; i < MEMORY_ARGUMENTS; i++)
        by[i] = bend * (by_strength * flow.strength_by[i] + l_g * g_by[i]);
    by[BY_X] += bend * (l_part * part_x - l_secant * secant / x);
    by[BY_RATIO] += bend * l_part * part_ratio;
    by[BY_WEAKENING] += bend * l_part * part_weakening;
    by[BY_FORCE] += bend * (l_r / strength + l_left * towards.left_by[0]);
    by[BY_OUTER] += bend * l_left * towards.left_by[1];
    by[BY_PACE] = flow.per_length;
    for (int i = 0; i < MEMORY_ARGUMENTS; i++) by[i] = capped ? 0.0 : by[i];

    double moved = 1.5 / kappa, across = moved - (moved - 1.0) * m;
    double per_across = 1.0 / (secant * across);
    flow.turn = pace * per_across;
    bend = -flow.turn * per_across;
    by = flow.turn_by;
    double free = whole_secant < 1.0 ? 1.0 : 0.0;
    for (int i = 0; i < MEMORY_ARGUMENTS; i++)
        by[i] = bend * across * free * per * flow.strength_by[i];
    by[BY_X] -= bend * secant * (across * free / x + (moved - 1.0) * m_x);
    by[BY_RATIO] -= bend * secant * (moved - 1.0) * m_ratio;
    by[BY_PACE] = per_across;

    /* On the corner itself w1 p1/b would jump with the sign of G - q. A contact that slides stays
     * close to it, where a kink would cost substeps. */
    double whole_gap = fabs(strength - q) * (1.0 / YIELDING) / strength,
           gap = smaller(whole_gap, 1.0), per_gap = 1.0 / (gap + SMOOTHING);
    double far = (1.0 + SMOOTHING) * gap * gap * per_gap;
    double by_gap = (1.0 + SMOOTHING) * gap * (gap + 2.0 * SMOOTHING) * per_gap * per_gap;
    double other = taken.share - OUTER_STRENGTH, near = gap < 1.0 ? by_gap * other : 0.0;
    double turned = (onward ? near : -near) * (1.0 / YIELDING) / strength;
    flow.share = OUTER_STRENGTH + far * other;
    by = flow.share_by;
    for (int i = 0; i < MEMORY_ARGUMENTS; i++)
        by[i] = far * taken.share_by[2] * g_by[i] + turned * q / strength * flow.strength_by[i];
    by[BY_FORCE] += far * taken.share_by[0] - turned;
    by[BY_OUTER] += far * taken.share_by[1];

    int slipping = OUTER_STIFFNESS * size > OUTER_STRENGTH * g;
    double per_size = slipping ? 1.0 / size : 0.0;
    flow.carried = slipping ? OUTER_STRENGTH * g * per_size : OUTER_STIFFNESS;
    by = flow.carried_by;
    for (int i = 0; i < MEMORY_ARGUMENTS; i++) by[i] = OUTER_STRENGTH * per_size * g_by[i];
    by[BY_SIZE] -= flow.carried * per_size;

    double opposed = against ? smaller(-r, 1.0) : 0.0, target = m + (1.0 - m) * opposed;
    target = weakens ? target : m;
    double pull = (!weakens | (h < target)) ? 2.25 : 0.0;
    int turning = weakens & against & (r > -1.0);
    double by_back = turning ? 1.0 - m : 0.0; /* of the target by -r */
    double target_m = 1.0 - (weakens ? opposed : 0.0);
    double inside = rising, second = inside * inside;
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
    flow.pull_by_unslipped = -pace * quick;
    by[BY_X] = by_m * m_x + by_r * r_strength * strength_x + pace * worn * apart / x;
    by[BY_RATIO] = by_m * m_ratio + by_r * r_strength * strength_ratio;
    by[BY_K] = by_r * r_strength * strength_k;
    by[BY_WEAKENING] = weakening < shortest ? 0.0 : -pace * worn * apart / weaken;
    by[BY_FORCE] = by_r / strength;
    by[BY_UNSLIPPED] = by_r * r_strength * above - pace * quick;
    by[BY_PACE] = per_pace;
    return flow;
}

#endif
