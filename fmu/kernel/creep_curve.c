#include "creep_curve.h"

#include <math.h>
#include <string.h>

#include "force_element_formula.h"
#include "wheelset_law.h"

enum { INTERVALS = 24, HALVINGS = 5, ITERATIONS = 200 }; /* intervals of a decade, at first */
static const double ROUNDING =
    1e-9; /* of the torque, by which a turn stands out: below the table's */
static const double FASTEST = 1e3;  /* of balanced speeds [m/s] */
static const double FARTHEST = 1e8; /* last creepage over the saturation creepage [1] */

typedef struct {
    const creep_table *table;
    force_element_parameters contact; /* without memory: the force is the steady one */
    const wheelset_parameters *body;  /* NULL: the curve is that of the force */
    creep_conditions at;
    int wheels;         /* that differ: 1 or 2 */
    double first, last; /* creepages between which the curve bends [1] */
} curve;

/* ---- One point ---- */

typedef struct {
    double force, by_creepage, by_speed; /* derivatives with the other one fixed */
    double by_omega, speed;              /* partial derivatives of the force */
} traction;

/* The same number as Python's (1 + creepage) speed / radius, so that both agree at a corner. */
static double omega_at(double creepage, double speed, double reference, double radius) {
    return (1.0 + creepage) * reference / radius + (speed - reference) / radius;
}

static traction traction_at(const curve *c, double creepage, double speed) {
    traction sum = {0};
    double reference, reference_slope, radius = c->contact.radius;
    regularized_speed(speed, c->contact.minimum_speed, &reference, &reference_slope);
    double omega = omega_at(creepage, speed, reference, radius);
    for (int i = 0; i < c->wheels; i++) {
        force_element_output out;
        force_element_input in;
        memset(&in, 0, sizeof in);
        in.omega = omega;
        in.speed = speed;
        in.normal_load = c->at.normal_load[i];
        in.friction_scale = c->at.friction_scale[i];
        force_element_evaluate(c->table, &c->contact, &in, &out);
        double part = 1.0 / c->wheels;
        sum.force += part * out.creep_force;
        sum.by_creepage += part * out.force_gradient * reference;
        sum.by_omega += part * out.force_by_omega;
        sum.speed += part * out.force_by_speed;
    }
    sum.by_speed = sum.speed + sum.by_omega * (1.0 + creepage * reference_slope) / radius;
    return sum;
}

static wheelset_rates rates_at(const curve *c, double creepage, double speed, const traction *q) {
    contact_action action = {q->force, q->by_omega, q->speed};
    double reference, reference_slope;
    regularized_speed(speed, c->contact.minimum_speed, &reference, &reference_slope);
    double omega = omega_at(creepage, speed, reference, c->contact.radius);
    wheelset_rates rates = motion_rates(c->body, omega, speed, 0.0, c->at.resistance_force, action);
    if (c->body->inverse_mass == 0.0) rates.speed_rate = c->at.acceleration;
    return rates;
}

/* Speed at which the resistance equals the force; NaN if there is no such speed. */
static double balanced_speed(const curve *c, double creepage) {
    double low = c->body->minimum_speed, high = FASTEST, end[2];
    for (int i = 0; i < 2; i++) {
        double speed = i ? high : low;
        traction q = traction_at(c, creepage, speed);
        end[i] = rates_at(c, creepage, speed, &q).speed_rate;
    }
    if (end[0] * end[1] > 0.0) return NAN;
    double sign = end[0] > end[1] ? 1.0 : -1.0, speed = 0.5 * (low + high);
    for (int i = 0; i < ITERATIONS && high - low > 1e-15 * high; i++) {
        traction q = traction_at(c, creepage, speed);
        wheelset_rates rates = rates_at(c, creepage, speed, &q);
        double slope = (q.by_speed - rates.resistance_slope) * c->body->inverse_mass;
        *(sign * rates.speed_rate > 0.0 ? &low : &high) = speed;
        double next = speed - rates.speed_rate / slope;
        int inside = next > low && next < high;
        if (inside && fabs(next - speed) <= 4e-16 * speed) return next;
        speed = inside ? next : 0.5 * (low + high);
    }
    return speed;
}

/* Largest eigenvalue of the two if it is positive, else the one farther from zero; the products of
 * Q' with Q' in the determinant cancel and are omitted. */
static double pole_of(const curve *c, const traction *q, const wheelset_rates *rates) {
    const wheelset_parameters *b = c->body;
    double turning = -(b->damping + b->radius * q->by_omega) / b->inertia;
    if (b->inverse_mass == 0.0) return turning;
    double growth = rates->resistance_slope;
    double trace = turning + (q->speed - growth) * b->inverse_mass;
    double determinant = (b->damping * (growth - q->speed) + b->radius * q->by_omega * growth) *
                         b->inverse_mass / b->inertia;
    double square = trace * trace - 4.0 * determinant;
    if (square < 0.0) return 0.5 * trace;
    double larger = 0.5 * (trace + (trace < 0.0 ? -sqrt(square) : sqrt(square)));
    double smaller = larger != 0.0 ? determinant / larger : 0.0;
    double first = fmax(larger, smaller), last = fmin(larger, smaller);
    return first > 0.0 ? first : last;
}

/* The larger of the bounds from the determinant and from the trace of the closed loop. */
static double minimum_gain(const curve *c, double creepage, double speed, const traction *q,
                           const wheelset_rates *rates) {
    const wheelset_parameters *b = c->body;
    double r = b->radius, fall = r * -q->by_creepage, square = r * r;
    if (b->inverse_mass == 0.0) return fall - b->damping * speed / r;
    const force_element_parameters *friction = &c->contact;
    int falls = softens_with_heat(friction) ||
                (friction->slip_rate_decay > 0.0 && friction->slip_rate_residual < 1.0);
    double slope = rates->resistance_slope, growth = slope;
    if (falls) growth -= q->by_speed; /* which otherwise is rounding */
    double stretch = 1.0 + creepage, mass_ratio = b->inertia * b->inverse_mass;
    double trace = fall * (1.0 + mass_ratio * stretch / square) -
                   speed / r * (b->damping + mass_ratio * growth);
    double loss = fall * (slope + b->damping * stretch / square) - b->damping * speed / r * growth;
    if (growth > 0.0) return fmax(loss / growth, trace);
    return growth * trace >= loss ? trace : INFINITY;
}

static creep_point point_at(const curve *c, double creepage) {
    double speed = c->at.speed;
    creep_point p = {creepage, NAN, NAN, NAN, NAN, NAN, NAN, NAN};
    if (c->body && c->at.balanced != 0.0) {
        speed = balanced_speed(c, creepage);
        if (isnan(speed)) return p;
    }
    traction q = traction_at(c, creepage, speed);
    p.force = p.torque = q.force;
    p.slope = q.by_creepage;
    p.speed = speed;
    p.acceleration = p.pole = p.minimum_gain = 0.0;
    if (!c->body) return p;
    const wheelset_parameters *b = c->body;
    wheelset_rates rates = rates_at(c, creepage, speed, &q);
    double reference, reference_slope;
    regularized_speed(speed, c->contact.minimum_speed, &reference, &reference_slope);
    double omega_by = reference / b->radius, turning = b->inertia / b->radius;
    p.pole = pole_of(c, &q, &rates);
    p.minimum_gain = minimum_gain(c, creepage, speed, &q, &rates);
    p.acceleration = rates.speed_rate;
    p.torque = -b->inertia * rates.omega_rate;
    p.slope = b->radius * q.by_creepage + b->damping * omega_by;
    if (c->at.balanced != 0.0) { /* the speed follows the creepage, and dV/dt stays zero */
        double by = -q.by_creepage / (q.by_speed - rates.resistance_slope);
        double along = (1.0 + creepage * reference_slope) / b->radius;
        p.slope += (b->radius * q.by_speed + b->damping * along) * by;
        return p;
    }
    p.torque += turning * (1.0 + creepage) * rates.speed_rate;
    p.slope += turning * (rates.speed_rate + (1.0 + creepage) * q.by_creepage * b->inverse_mass);
    return p;
}

/* ---- The search ---- */

typedef struct search search;

struct search {
    const curve *c;
    double level; /* torque to cross; NaN to find the turns, infinite for the pole */
    void (*turned)(search *, creep_point);
    size_t room, count;
    creep_point *points;
    creep_point low, high;    /* that bracket the worst pole */
    creep_point base, turn;   /* the last turn, and the next one if it stands out */
    int begun, turning, flat; /* whether there is a base, a next turn, and whether a plateau is */
    creep_point last;         /* end of the search */
    double reach;             /* creepage up to which the largest torque is kept */
    double until;             /* creepage beyond which nothing is searched; 0: none */
    int full;
};

static void keep(search *s, creep_point p) {
    if (s->count && s->count <= s->room && s->points[s->count - 1].creepage == p.creepage) return;
    if (s->count < s->room) s->points[s->count] = p;
    s->count++;
    s->full = !isnan(s->level) && s->count >= s->room;
}

/* How far the torque goes on in the direction of the next turn: 0 if by no more than rounding. */
static double onward(const search *s, creep_point p) {
    double from = s->turning ? s->turn.torque : s->base.torque, change = p.torque - from;
    double size = fmax(fabs(s->base.torque), fmax(fabs(from), fabs(p.torque)));
    if (fabs(change) <= ROUNDING * size) return 0.0;
    return s->turning && s->turn.torque < s->base.torque ? -change : change;
}

/* A place where the slope changes its sign, or a plateau begins. It is a turn once the torque has
 * turned back by more than rounding, which on a plateau changes the sign at any place. */
static void slope_ends(search *s, creep_point p, int flat) {
    double further = onward(s, p);
    if (further == 0.0) return;
    if (s->turning && further < 0.0) {
        s->turned(s, s->turn);
        s->base = s->turn;
    }
    s->turn = p;
    s->turning = 1;
    s->flat = flat;
}

/* Root between two points of the slope, or of the torque less a level: by Newton's or the secant
 * method where these stay inside the bracket and at least halve it in two steps, else by halving.
 */
static creep_point root_between(const curve *c, double level, creep_point a, creep_point b) {
    int of_slope = isnan(level);
    double fa = of_slope ? a.slope : a.torque - level, fb = of_slope ? b.slope : b.torque - level;
    creep_point best = fabs(fa) < fabs(fb) ? a : b;
    double width = fabs(b.creepage - a.creepage);
    for (int i = 0; i < ITERATIONS; i++) {
        double za = a.creepage, zb = b.creepage, size = fmax(fabs(za), fabs(zb));
        if (fa == 0.0 || fb == 0.0 || fabs(zb - za) <= 4e-16 * size) break;
        double z = za - fa * (zb - za) / (fb - fa);
        if (!of_slope) {
            double from = best.creepage, newton = from - (best.torque - level) / best.slope;
            if ((newton - za) * (newton - zb) < 0.0) z = newton;
        }
        double smallest = 2e-16 * size; /* a step beside the root closes the bracket */
        if (fabs(z - za) < smallest) z = za + copysign(smallest, zb - za);
        if (fabs(z - zb) < smallest) z = zb + copysign(smallest, za - zb);
        if (i % 3 == 2 && fabs(zb - za) > 0.5 * width) z = 0.5 * (za + zb);
        if (i % 3 == 2) width = fabs(zb - za);
        if (!((z - za) * (z - zb) < 0.0)) z = 0.5 * (za + zb);
        if (z == za || z == zb) break;
        creep_point p = point_at(c, z);
        double f = of_slope ? p.slope : p.torque - level;
        best = p;
        if (f == 0.0) return p;
        if ((f > 0.0) == (fa > 0.0)) a = p, fa = f;
        else b = p, fb = f;
    }
    return fabs(fa) < fabs(fb) ? a : b;
}

/* First point of a plateau, which begins between a slope and none. */
static creep_point plateau_between(const curve *c, creep_point rising, creep_point level) {
    for (int i = 0; i < ITERATIONS; i++) {
        double z = 0.5 * (rising.creepage + level.creepage);
        if (z == rising.creepage || z == level.creepage) break;
        creep_point p = point_at(c, z);
        if (p.slope == 0.0) level = p;
        else rising = p;
    }
    return level;
}

static int is_between(double level, double a, double b) { return (a - level) * (b - level) < 0.0; }

/* A piece on which the torque rises or falls all along. */
static void piece(search *s, creep_point a, creep_point b) {
    if (s->full) return;
    if (a.torque == s->level) keep(s, a);
    else if (is_between(s->level, a.torque, b.torque)) keep(s, root_between(s->c, s->level, a, b));
}

static void leaf(search *s, creep_point a, creep_point b) {
    if (isinf(s->level)) { /* the worst pole */
        if (b.pole > s->points->pole || isnan(s->points->pole)) {
            *s->points = b;
            s->low = a;
            s->high = b;
        } else if (s->high.creepage == s->points->creepage) {
            s->high = b;
        }
        return;
    }
    creep_point turn = b;
    int turns = 0;
    if (a.slope * b.slope < 0.0) {
        turn = root_between(s->c, NAN, a, b);
        if (turn.slope == 0.0) turn = plateau_between(s->c, a, turn);
        turns = 1;
    } else if (a.slope != 0.0 && b.slope == 0.0) {
        turn = plateau_between(s->c, a, b);
        turns = 1;
    }
    if (isnan(s->level)) {
        if (!s->begun) s->base = a;
        s->begun = 1;
        if (turns) slope_ends(s, turn, a.slope != 0.0 && turn.slope == 0.0);
        return;
    }
    piece(s, a, turn);
    if (turns) piece(s, turn, b);
}

/* Halve an interval until the slope is known to keep its sign, or is resolved. */
static void refine(search *s, creep_point a, creep_point b, int halvings) {
    if (s->full) return;
    creep_point middle;
    int open = halvings > 0 && !(a.slope == 0.0 && b.slope == 0.0);
    if (open) {
        middle = point_at(s->c, sqrt(a.creepage / b.creepage) * b.creepage);
        double smallest = fmin(fmin(fabs(a.slope), fabs(b.slope)), fabs(middle.slope));
        double mean = 0.5 * (a.slope + b.slope);
        open = !(a.slope * b.slope > 0.0 && fabs(middle.slope - mean) < 0.25 * smallest);
        if (!open) {
            leaf(s, a, middle);
            leaf(s, middle, b);
            return;
        }
        refine(s, a, middle, halvings - 1);
        refine(s, middle, b, halvings - 1);
        return;
    }
    leaf(s, a, b);
}

/* Last point with a balanced speed between such a point and a creepage without one. */
static creep_point edge_between(const curve *c, creep_point inside, double outside) {
    for (int i = 0; i < ITERATIONS; i++) {
        double z = 0.5 * (inside.creepage + outside);
        if (z == inside.creepage || z == outside) break;
        creep_point p = point_at(c, z);
        if (isnan(p.torque)) outside = z;
        else inside = p;
    }
    return inside;
}

/* Ratio of the creepages between which one side of the curve is searched, and their number. */
static double ratio_of_intervals(const curve *c, int *n) {
    double whole = logarithm(c->last / c->first);
    *n = (int)ceil(INTERVALS * whole / 2.302585092994046);
    return exponential(whole / *n);
}

/* Search one side of the curve from zero creepage outward. */
static void walk(search *s, double side) {
    const curve *c = s->c;
    creep_point at = point_at(c, 0.0);
    int n;
    double ratio = ratio_of_intervals(c, &n), creepage = c->first;
    double until = s->until > 0.0 ? s->until : INFINITY;
    for (int i = 0; i <= n && !s->full && fabs(at.creepage) <= until; i++, creepage *= ratio) {
        creep_point next = point_at(c, side * creepage), a = at, b = next;
        if (isnan(at.torque) && !isnan(next.torque)) a = edge_between(c, next, at.creepage);
        if (isnan(next.torque) && !isnan(at.torque)) b = edge_between(c, at, next.creepage);
        if (a.creepage == 0.0) leaf(s, a, b);
        else refine(s, a, b, HALVINGS);
        at = next;
    }
    s->last = at;
}

static curve curve_of(const creep_table *table, const force_element_parameters *contact,
                      const wheelset_parameters *body, const creep_conditions *at) {
    curve c = {.table = table, .contact = *contact, .body = body, .at = *at};
    c.contact.memory = 0.0;
    c.wheels =
        at->normal_load[0] == at->normal_load[1] && at->friction_scale[0] == at->friction_scale[1]
            ? 1
            : 2;
    c.first = INFINITY;
    c.last = 0.0;
    for (int i = 0; i < c.wheels; i++) {
        if (!(at->normal_load[i] > 0.0) || at->friction_scale[i] < MIN_FRICTION_SCALE) continue;
        contact_scales scales;
        force_element_scales(NULL, &c.contact, at->normal_load[i], at->friction_scale[i], &scales);
        /* If friction falls with slip speed, the peak moves at most to the saturation creepage of
         * the remaining friction; with thermal softening it is at zeta0/sqrt(V zeta0/w_T), and
         * V zeta0 is below 400 w_T for any steel. */
        double left =
            softens_with_heat(&c.contact) ? 0.05 : fmax(c.contact.slip_rate_residual, 1e-6);
        double fall = c.contact.slip_rate_decay * at->speed * scales.saturation_creepage;
        double farthest = fall > 0.0 ? fmax(FARTHEST, 40.0 / fall) : FARTHEST;
        c.first = fmin(c.first, 0.01 * left * scales.saturation_creepage);
        c.last = fmax(c.last, farthest * scales.saturation_creepage);
    }
    if (c.last == 0.0) { /* without a force, any range will do */
        c.first = 1e-6;
        c.last = 1e6;
    }
    c.first = fmax(c.first, 1e-200); /* so that their ratio is a number */
    c.last = fmax(fmin(c.last, 1e100), 10.0 * c.first);
    return c;
}

void creep_curve_points(const creep_table *table, const force_element_parameters *contact,
                        const wheelset_parameters *body, const creep_conditions *at, size_t n,
                        const double *creepage, creep_point *points) {
    curve c = curve_of(table, contact, body, at);
    for (size_t i = 0; i < n; i++) points[i] = point_at(&c, creepage[i]);
}

/* Find the turns of one side, and then the end of the search. */
static void find_turns(search *s, double side) {
    s->level = NAN;
    walk(s, side);
    double further = s->turning ? onward(s, s->last) : 1.0;
    if (!(further > 0.0) && (further != 0.0 || s->flat)) s->turned(s, s->turn);
    s->turned(s, s->last);
}

static size_t turns_of(const curve *c, double side, size_t room, creep_point *points) {
    search s = {.c = c, .turned = keep, .room = room, .points = points};
    find_turns(&s, side);
    return s.count;
}

size_t creep_curve_turns(const creep_table *table, const force_element_parameters *contact,
                         const wheelset_parameters *body, const creep_conditions *at, double side,
                         size_t room, creep_point *points) {
    curve c = curve_of(table, contact, body, at);
    return turns_of(&c, side, room, points);
}

static size_t steady_of(const curve *c, double torque, double side, size_t room,
                        creep_point *points) {
    if (isnan(torque)) return 0; /* no creepage balances it; as a level it would mean the turns */
    search s = {.c = c, .turned = NULL, .level = torque, .room = room, .points = points};
    walk(&s, side);
    if (!s.full && s.last.torque == torque) keep(&s, s.last);
    if (s.count && points[0].creepage == 0.0 && side < 0.0)
        memmove(points, points + 1, --s.count * sizeof *points);
    return s.count;
}

size_t creep_curve_steady(const creep_table *table, const force_element_parameters *contact,
                          const wheelset_parameters *body, const creep_conditions *at,
                          double torque, double side, size_t room, creep_point *points) {
    curve c = curve_of(table, contact, body, at);
    return steady_of(&c, torque, side, room, points);
}

/* Keep the first turn, the one before the present one, and that, up to the first above the first.
 */
static void keep_landing(search *s, creep_point p) {
    if (s->full) return;
    if (s->count++ == 0) s->points[0] = p;
    s->points[1] = s->points[2];
    s->points[2] = p;
    s->full = p.torque > s->points[0].torque;
}

size_t creep_curve_fold(const creep_table *table, const force_element_parameters *contact,
                        const wheelset_parameters *body, const creep_conditions *at,
                        creep_point points[2]) {
    creep_point turns[3] = {{0}};
    curve c = curve_of(table, contact, body, at);
    search s = {.c = &c, .turned = keep_landing, .points = turns};
    find_turns(&s, 1.0);
    if (s.count == 1) return 0;
    /* The slip-away ends where the torque reaches the fold's again; a falling torque then follows
     * this branch to its minimum. */
    points[0] = turns[0];
    points[1] = turns[1];
    if (s.count > 2 && turns[2].torque > turns[1].torque) return 2;
    points[1] = s.last;
    points[1].creepage = INFINITY;
    points[1].torque = fmax(0.0, s.last.torque);
    return 2;
}

void creep_curve_worst(const creep_table *table, const force_element_parameters *contact,
                       const wheelset_parameters *body, const creep_conditions *at,
                       creep_point *point) {
    const double golden = 0.61803398874989485;
    curve c = curve_of(table, contact, body, at);
    search s = {.c = &c, .level = INFINITY, .room = 1, .points = point};
    point->pole = NAN;
    walk(&s, 1.0);
    double low = fmax(s.low.creepage, 0.1 * c.first), high = s.high.creepage;
    while (high - low > 1e-10 * high) { /* golden section of the creepage */
        creep_point left = point_at(&c, high - golden * (high - low));
        creep_point right = point_at(&c, low + golden * (high - low));
        if (left.pole > point->pole) *point = left;
        if (right.pole > point->pole) *point = right;
        if (left.pole >= right.pole) high = right.creepage;
        else low = left.creepage;
    }
}

/* ---- Branches ---- */

/* Of so many neighbouring curves one is searched from end to end, and so many turns are followed,
 * each over so many intervals of the search. */
enum { SEARCHED = 64, MAX_TURNS = 64, UPHILL = 12 };

static void keep_first(search *s, creep_point p) {
    if (!s->full) keep(s, p);
    s->full = 1;
}

/* Keep the largest torque up to a creepage, of one point. */
static void keep_limit(search *s, creep_point p) {
    double side = s->reach < 0.0 ? -1.0 : 1.0;
    if (side * (s->reach - p.creepage) >= 0.0 && side * (p.torque - s->points->torque) > 0.0)
        *s->points = p;
}

double creep_curve_grip(const creep_table *table, const force_element_parameters *contact,
                        const wheelset_parameters *body, const creep_conditions *at, double torque,
                        double *limit) {
    creep_point found;
    curve c = curve_of(table, contact, body, at);
    double side = point_at(&c, 0.0).torque <= torque ? 1.0 : -1.0, reach = 0.0;
    int balances = steady_of(&c, torque, side, 1, &found) > 0;
    double creepage = balances ? found.creepage : NAN, held = balances ? fabs(creepage) : 0.0;
    if (balances && held == 0.0) return creepage;
    for (int wheel = 0; wheel < c.wheels; wheel++) {
        curve one = c;
        one.wheels = 1;
        one.at.normal_load[0] = c.at.normal_load[wheel];
        one.at.friction_scale[0] = c.at.friction_scale[wheel];
        search s = {.c = &one, .turned = keep_first, .room = 1, .points = &found, .until = held};
        find_turns(&s, side);
        reach = fmax(reach, fabs(found.creepage));
    }
    if (balances && held <= reach) return creepage;
    found = point_at(&c, side * reach);
    search s = {.c = &c, .turned = keep_limit, .points = &found, .reach = side * reach};
    find_turns(&s, side);
    *limit = found.torque;
    return NAN;
}

/* Keep the first turns, and behind them the smallest creepage with the largest force. */
static void keep_largest(search *s, creep_point p) {
    creep_point *largest = &s->points[s->room];
    if (s->count < s->room) s->points[s->count] = p;
    s->count++;
    if (p.force > largest->force) *largest = p;
}

/* Largest force of a curve; its first turns are stored in front of it, and counted. */
static double largest_force(const curve *c, creep_point *turns, size_t room, size_t *count) {
    search s = {.c = c, .turned = keep_largest, .room = room, .points = turns};
    turns[room].force = 0.0;
    turns[room].creepage = NAN;
    find_turns(&s, 1.0);
    *count = s.count;
    if (turns[room].creepage == s.last.creepage) turns[room].creepage = INFINITY;
    return turns[room].force;
}

double creep_curve_peak(const creep_table *table, const force_element_parameters *contact,
                        const creep_conditions *at, double *creepage) {
    creep_point largest;
    size_t count;
    curve c = curve_of(table, contact, NULL, at);
    double force = largest_force(&c, &largest, 0, &count);
    *creepage = largest.creepage;
    return force;
}

/* Find a maximum of a curve, with the bits of the whole search, uphill from the creepage of that of
 * a similar curve. */
static int maximum_near(const curve *c, creep_point *turn) {
    int n, number = 1;
    double ratio = ratio_of_intervals(c, &n), low = c->first;
    for (; number < n && low * ratio <= turn->creepage; number++) low *= ratio;
    creep_point a = point_at(c, low), b = point_at(c, low * ratio);
    for (int i = 0; i < UPHILL && number > 1 && a.slope < 0.0; i++) {
        low = c->first;
        number--;
        for (int k = 1; k < number; k++) low *= ratio; /* as the search does */
        b = a;
        a = point_at(c, low);
    }
    for (int i = 0; i < UPHILL && number < n && b.slope > 0.0; i++) {
        low *= ratio;
        number++;
        a = b;
        b = point_at(c, low * ratio);
    }
    if (!(a.slope > 0.0 && b.slope < 0.0 && b.creepage < c->last)) return 0;
    search s = {.c = c, .turned = keep, .level = NAN};
    refine(&s, a, b, HALVINGS);
    *turn = s.turn;
    return s.count == 0 && s.turning && onward(&s, b) < 0.0;
}

/* The largest force at maxima that are found so, which alternate with minima, and at the end of the
 * search; NaN if one is not found. */
static double largest_force_near(const curve *c, creep_point *turns, size_t count) {
    int n;
    double ratio = ratio_of_intervals(c, &n), last = c->first, force = 0.0;
    for (size_t k = 0; k + 1 < count; k += 2) {
        if (!maximum_near(c, &turns[k])) return NAN;
        force = fmax(force, turns[k].force);
    }
    for (int i = 0; i < n; i++) last *= ratio;
    return fmax(force, point_at(c, last).force);
}

static creep_conditions conditions_of(const drivetrain_input *in, double speed) {
    return (creep_conditions){.speed = fabs(speed),
                              .normal_load = {2.0 * in->load_left, 2.0 * in->load_right},
                              .friction_scale = {in->friction_left, in->friction_right},
                              .resistance_force = in->resistance_force,
                              .acceleration = in->acceleration};
}

void drivetrains_grip(const drivetrain_member *members, size_t n, const drivetrain_input *input,
                      const double *speed, const double *torque, double *creepage, double *limit) {
    for (size_t i = 0; i < n; i++) {
        force_element_parameters contact = *members[i].contact;
        contact.slope_reduction *= input[i].slope;
        creep_conditions at = conditions_of(&input[i], speed[i]);
        wheelset_parameters body = on_grade(&members[i].drivetrain->body, input[i].grade);
        body.inertia += members[i].drivetrain->motor_inertia; /* in steady creep all turn alike */
        creepage[i] =
            creep_curve_grip(members[i].table, &contact, &body, &at, torque[i], &limit[i]);
    }
}

void drivetrains_peak(const drivetrain_member *members, const size_t *which, size_t n,
                      const drivetrain_input *input, const double *speed, double *force) {
    creep_point turns[MAX_TURNS + 1]; /* of the last curve */
    size_t count = 0;
    for (size_t i = 0; i < n; i++) {
        const drivetrain_member *m = &members[which[i]];
        int alike = i % SEARCHED != 0 && which[i] == which[i - 1];
        force_element_parameters contact = *m->contact;
        contact.slope_reduction *= input[i].slope;
        creep_conditions at = conditions_of(&input[i], speed[i]);
        curve c = curve_of(m->table, &contact, NULL, &at);
        int followed = alike && count > 1 && count <= MAX_TURNS;
        force[i] = followed ? largest_force_near(&c, turns, count) : NAN;
        if (isnan(force[i])) force[i] = largest_force(&c, turns, MAX_TURNS, &count);
    }
}
