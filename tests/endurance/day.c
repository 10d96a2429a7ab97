/* Trips of a locomotive, one after the other, in an FMU of kind wheelset; see day.py.
 *
 *     day LIBRARY RESOURCES TOKEN added|counted TRIPS TORQUE REFERENCES
 *
 * Communication points are sums of the steps so far, as tools without care make them, or multiples
 * of the step. REFERENCES, with commas between, are those of drive_torque, omega, speed,
 * creep_force, radius, minimum_speed, inertia, inverse_mass, damping, and constant_, linear_ and
 * quadratic_resistance. Prints a line for each trip: digest of every value on the way, angular
 * velocity and speed at its end, largest speeds forward and backward, works of drive, creep,
 * resistance and damping, drive work both ways together, energy stored, pages in memory; and then
 * the tool's time and the FMU's. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#include "library.h"

enum { STEPS_PER_TRIP = 600000 };
enum { TORQUE, OMEGA, SPEED, FORCE, FIRST_PARAMETER, REFERENCES = 12 };

static const double STEP = 1e-3;

typedef struct {
    double radius, minimum_speed, inertia, inverse_mass, damping, constant, linear, quadratic;
} body;

typedef struct {
    double omega, speed, force;
} motion;

typedef struct {
    double drive, creep, resistance, damping, throughput;
} works;

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                        fmi2String category, fmi2String message, ...) {
    (void)environment, (void)name, (void)status, (void)category;
    fprintf(stderr, "%s\n", message);
}

/* A start, a long pull next to the limit of adhesion, coasting, braking to rest, standstill; the
 * same backward with less. A brake holds what has come to rest. */
static double torque_at(double time, double speed, double most) {
    double brake = -0.55 * most * fmax(-1.0, fmin(1.0, speed / 0.5));
    if (time < 10.0) return most * time / 10.0;
    if (time < 70.0) return most;
    if (time < 200.0) return 0.0;
    if (time < 420.0) return brake;
    if (time < 425.0) return -0.3 * most * (time - 420.0) / 5.0;
    if (time < 450.0) return -0.3 * most;
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

static long pages(void) {
    long whole, resident;
    FILE *file = fopen("/proc/self/statm", "r");
    CHECK(file != NULL && fscanf(file, "%ld %ld", &whole, &resident) == 2);
    fclose(file);
    return resident;
}

int main(int argc, char **argv) {
    static const fmi2CallbackFunctions callbacks = {log_message, NULL, NULL, NULL, NULL};
    if (argc != 8) fail("reading the arguments");
    int counted = strcmp(argv[4], "counted") == 0;
    long trips = strtol(argv[5], NULL, 10);
    double most = strtod(argv[6], NULL), now = 0.0, status_time;
    unsigned references[REFERENCES];
    char *at = argv[7];
    for (int i = 0; i < REFERENCES; i++, at++) references[i] = (unsigned)strtoul(at, &at, 10);
    load(argv[1]);
    FUNCTION(fmi2Instantiate);
    FUNCTION(fmi2SetupExperiment);
    FUNCTION(fmi2EnterInitializationMode);
    FUNCTION(fmi2ExitInitializationMode);
    FUNCTION(fmi2SetReal);
    FUNCTION(fmi2GetReal);
    FUNCTION(fmi2DoStep);
    FUNCTION(fmi2GetRealStatus);
    FUNCTION(fmi2Terminate);
    FUNCTION(fmi2FreeInstance);
    fmi2Component c =
        fmi2Instantiate("day", fmi2CoSimulation, argv[3], argv[2], &callbacks, fmi2False, fmi2True);
    CHECK(c != NULL);
    double end = (double)trips * STEPS_PER_TRIP * STEP, rest[2] = {0.0, 0.0};
    body b;
    CHECK(fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2True, end) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK);
    CHECK(fmi2SetReal(c, references + OMEGA, 2, rest) == fmi2OK);
    CHECK(fmi2ExitInitializationMode(c) == fmi2OK);
    CHECK(fmi2GetReal(c, references + FIRST_PARAMETER, 8, (double *)&b) == fmi2OK);
    motion m;
    CHECK(fmi2GetReal(c, references + OMEGA, 3, (double *)&m) == fmi2OK);
    for (long trip = 0, step = 0; trip < trips; trip++) {
        works sum = {0.0, 0.0, 0.0, 0.0, 0.0};
        double least = 0.0, largest = 0.0;
        uint64_t digest = 0;
        for (long i = 0; i < STEPS_PER_TRIP; i++, step++) {
            double torque = torque_at((double)i * STEP, m.speed, most);
            works from = powers(&b, &m, torque), to;
            double point = counted ? (double)step * STEP : now;
            CHECK(fmi2SetReal(c, references + TORQUE, 1, &torque) == fmi2OK);
            CHECK(fmi2DoStep(c, point, STEP, fmi2True) == fmi2OK);
            CHECK(fmi2GetReal(c, references + OMEGA, 3, (double *)&m) == fmi2OK);
            now = point + STEP;
            to = powers(&b, &m, torque);
            add(&sum, &from, &to);
            digest = digested(digest, &m);
            least = fmin(least, m.speed);
            largest = fmax(largest, m.speed);
        }
        printf("%016llx %a %a %.4g %.4g %.17g %.17g %.17g %.17g %.17g %.17g %ld\n",
               (unsigned long long)digest, m.omega, m.speed, largest, least, sum.drive, sum.creep,
               sum.resistance, sum.damping, sum.throughput, stored(&b, &m), pages());
    }
    CHECK(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &status_time) == fmi2OK);
    printf("%a %a\n", now, status_time);
    CHECK(fmi2Terminate(c) == fmi2OK);
    fmi2FreeInstance(c);
    return 0;
}
