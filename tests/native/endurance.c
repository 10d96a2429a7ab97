/* What long runs of an FMU leave behind; see endurance.py.
 *
 *     endurance cycles 2|3 LIBRARY RESOURCES TOKEN CYCLES
 *     endurance trips  2   LIBRARY RESOURCES TOKEN TRIPS added|counted TORQUE REFERENCES
 *
 * A cycle is an instance that is initialized, stepped, saved, restored and freed, and two that
 * fail: of another token and of another folder. Prints bytes allocated, pages in memory and files
 * open, after the first cycles and at the end.
 *
 * Trips are those of a locomotive, one after the other, in an FMU of kind wheelset. Communication
 * points are sums of the steps so far, as tools without care make them, or multiples of the step.
 * REFERENCES, with commas between, are those of drive_torque, omega, speed, creep_force, radius,
 * minimum_speed, inertia, inverse_mass, damping, and constant_, linear_ and quadratic_resistance.
 * Prints a line for each trip: digest of every value on the way, angular velocity and speed at its
 * end, largest speeds forward and backward, works of drive, creep, resistance and damping, drive
 * work both ways together, energy stored, pages in memory; and then the tool's time and the
 * FMU's. */
#define _GNU_SOURCE
#include <dirent.h>
#include <malloc.h>
#include <stdint.h>

#define OPENED
#include "fmi.h"

enum { WARM_UP = 100, STEPS_PER_TRIP = 600000 };
enum { TORQUE, OMEGA, SPEED, FORCE, FIRST_PARAMETER, REFERENCES = 12 };

static const double STEP = 1e-3;

static long pages(void) {
    long whole, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file == NULL || fscanf(file, "%ld %ld", &whole, &resident) != 2)
        fail("/proc/self/statm", "cannot be read");
    fclose(file);
    return resident;
}

/* ---- cycles -------------------------------------------------------------------------------- */

static void report(void) {
    long resident = pages();
    int files = 0;
    DIR *folder = opendir("/proc/self/fd");
    while (readdir(folder) != NULL) files++;
    closedir(folder);
    struct mallinfo2 info = mallinfo2(); /* last: malloc counts what it keeps for reuse */
    printf("%zu %ld %d\n", info.uordblks + info.hblkhd, resident, files);
}

static void run_cycles(const fmi *v, const char *resources, const char *token, long cycles) {
    static char buffer[4096]; /* what reports need stays allocated too */
    static int messages;
    const char *nowhere = v->version == 2 ? "file:///no/folder" : "/no/folder";
    must_say = " "; /* which every message has */
    setvbuf(stdout, buffer, _IOFBF, sizeof buffer);
    for (long i = 0; i < cycles; i++) {
        if (i == WARM_UP) report();
        void *saved = NULL;
        if (v->open(0, "?", resources, 1, &messages) || v->open(0, token, nowhere, 1, &messages))
            fail("another token or folder", "is taken");
        void *c = v->open(0, token, resources, 1, &messages);
        FINE(start(v, c, 0.0));
        FINE(v->step(c, 0.0, STEP));
        if (v->step(c, 1.0, STEP) != 3) fail("a step from another point", "is taken");
        FINE(v->save(c, &saved));
        FINE(v->restore(c, saved));
        FINE(v->forget(c, &saved));
        v->close(c);
    }
    report();
    if (messages != 3 * cycles) fail("a message", "is missing");
}

/* ---- trips --------------------------------------------------------------------------------- */

typedef struct {
    double radius, minimum_speed, inertia, inverse_mass, damping, constant, linear, quadratic;
} body;

typedef struct {
    double omega, speed, force;
} motion;

typedef struct {
    double drive, creep, resistance, damping, throughput;
} works;

/* A start, a long pull next to the limit of friction, coasting, braking to rest, standstill; the
 * same backward with less. A brake holds what has come to rest. */
static double torque_at(double time, double speed, double highest) {
    double brake = -0.55 * highest * fmax(-1.0, fmin(1.0, speed / 0.5));
    if (time < 10.0) return highest * time / 10.0;
    if (time < 70.0) return highest;
    if (time < 200.0) return 0.0;
    if (time < 420.0) return brake;
    if (time < 425.0) return -0.3 * highest * (time - 420.0) / 5.0;
    if (time < 450.0) return -0.3 * highest;
    return brake;
}

/* W. J. Davis's resistance, whose constant part fades out at the lowest speeds. */
static double resistance(const body *b, double v) {
    double z = v / b->minimum_speed,
           slow = b->minimum_speed * (3.0 + 6.0 * z * z - pow(z, 4)) / 8.0;
    double reference = fabs(z) < 1.0 ? slow : fabs(v);
    return b->constant * v / reference + b->linear * v + b->quadratic * v * fabs(v);
}

static double stored(const body *b, const motion *m) {
    return 0.5 * b->inertia * m->omega * m->omega + 0.5 * m->speed * m->speed / b->inverse_mass;
}

static works powers(const body *b, const motion *m, double torque) {
    double drive = torque * m->omega;
    return (works){drive, m->force * (b->radius * m->omega - m->speed),
                   resistance(b, m->speed) * m->speed, b->damping * m->omega * m->omega,
                   fabs(drive)};
}

/* Trapezoidal rule. */
static void add(works *sum, const works *from, const works *to) {
    double *s = (double *)sum;
    const double *a = (const double *)from, *z = (const double *)to;
    for (size_t i = 0; i < sizeof *sum / sizeof *s; i++) s[i] += 0.5 * STEP * (a[i] + z[i]);
}

static uint64_t digested(uint64_t digest, const motion *m) {
    uint64_t bits[3];
    memcpy(bits, m, sizeof bits);
    for (int i = 0; i < 3; i++) {
        digest = (digest ^ bits[i]) * UINT64_C(0x9E3779B97F4A7C15);
        digest ^= digest >> 29;
    }
    return digest;
}

static void run_trips(const fmi *v, void *c, long trips, int counted, double highest, char *at) {
    unsigned references[REFERENCES];
    double now = 0.0, rest[2] = {0.0, 0.0};
    const experiment whole = {.stop = (double)trips * STEPS_PER_TRIP * STEP, .has_stop = 1};
    body b;
    motion m;
    for (int i = 0; i < REFERENCES; i++, at++) references[i] = (unsigned)strtoul(at, &at, 10);
    FINE(v->set_up(c, &whole));
    FINE(v->enter(c, &whole));
    FINE(v->set(c, references + OMEGA, 2, rest));
    FINE(v->leave(c));
    FINE(v->get(c, references + FIRST_PARAMETER, 8, (double *)&b));
    FINE(v->get(c, references + OMEGA, 3, (double *)&m));
    for (long trip = 0, step = 0; trip < trips; trip++) {
        works sum = {0.0, 0.0, 0.0, 0.0, 0.0};
        double smallest = 0.0, largest = 0.0;
        uint64_t digest = 0;
        for (long i = 0; i < STEPS_PER_TRIP; i++, step++) {
            double torque = torque_at((double)i * STEP, m.speed, highest);
            works from = powers(&b, &m, torque), to;
            double point = counted ? (double)step * STEP : now;
            FINE(v->set(c, references + TORQUE, 1, &torque));
            FINE(v->step(c, point, STEP));
            FINE(v->get(c, references + OMEGA, 3, (double *)&m));
            now = point + STEP;
            to = powers(&b, &m, torque);
            add(&sum, &from, &to);
            digest = digested(digest, &m);
            smallest = fmin(smallest, m.speed);
            largest = fmax(largest, m.speed);
        }
        printf("%016llx %a %a %.4g %.4g %.17g %.17g %.17g %.17g %.17g %.17g %ld\n",
               (unsigned long long)digest, m.omega, m.speed, largest, smallest, sum.drive,
               sum.creep, sum.resistance, sum.damping, sum.throughput, stored(&b, &m), pages());
    }
    double reached = 0.0;
    FUNCTION(fmi2GetRealStatus);
    FINE(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &reached));
    printf("%a %a\n", now, reached);
}

int main(int argc, char **argv) {
    if (argc < 7) fail("usage", "endurance cycles|trips 2|3 LIBRARY RESOURCES TOKEN COUNT ...");
    const fmi *v = fmi_of(atoi(argv[2]));
    long count = strtol(argv[6], NULL, 10);
    open_library(argv[3]);
    if (strcmp(argv[1], "cycles") == 0) {
        run_cycles(v, argv[4], argv[5], count);
        return 0;
    }
    static int messages;
    void *c = v->open(0, argv[5], argv[4], 1, &messages);
    if (argc != 10 || c == NULL) fail(argv[3], "cannot be instantiated");
    run_trips(v, c, count, strcmp(argv[7], "counted") == 0, strtod(argv[8], NULL), argv[9]);
    FINE(v->terminate(c));
    v->close(c);
    return 0;
}
