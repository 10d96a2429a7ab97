/* A wheel-slide protection outside of a vehicle's FMU (FMI 2), as the master of a co-simulation.
 *
 *     contactlib fmu coach_braking.toml -o coach.fmu && unzip coach.fmu -d coach
 *     cc -I HEADERS_OF_FMI_2 vehicle_fmu.c -ldl -lm -o master
 *     ./master coach
 *
 * Every 10 ms it dumps the brake of each axle whose wheels slip more than a tenth of the speed, and
 * prints where and when the coach stands. */
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"

enum { AXLES = 4, LATE = 4 }; /* samples of the valves' dead time */

static const double SAMPLE = 0.01, FULL = 5700.0; /* [s], [N.m] */

static void *library;
static char description[1 << 20];

static void fail(const char *what) {
    fprintf(stderr, "%s failed\n", what);
    exit(1);
}

static void *function(const char *name) {
    void *found = dlsym(library, name);
    if (found == NULL) fail(name);
    return found;
}

/* Text of an attribute behind a place of modelDescription.xml. */
static char *attribute(const char *place, const char *name) {
    static char text[256];
    const char *found = place ? strstr(place, name) : NULL;
    if (found == NULL || sscanf(found + strlen(name), "=\"%255[^\"]", text) != 1) fail(name);
    return text;
}

static fmi2ValueReference reference(const char *name, int axle) {
    char entry[64];
    snprintf(entry, sizeof entry, axle ? "name=\"%s[%d]\"" : "name=\"%s\"", name, axle);
    return (fmi2ValueReference)atoi(attribute(strstr(description, entry), "valueReference"));
}

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                        fmi2String category, fmi2String message, ...) {
    (void)environment;
    fprintf(stderr, "%s, %s, status %d: %s\n", name, category, (int)status, message);
}

#define CALL(name, ...) \
    if (((name##TYPE *)function(#name))(__VA_ARGS__) > fmi2Warning) fail(#name)

/* Torque that the driver demands of each axle. */
static double demanded(double time) { return FULL * fmin(fmax(time - 0.5, 0.0), 1.0); }

int main(int count, char **argument) {
    char path[4096], guid[256];
    if (count != 2) fail("usage: master FOLDER, which");
    snprintf(path, sizeof path, "%s/modelDescription.xml", argument[1]);
    FILE *file = fopen(path, "rb");
    if (file == NULL || fread(description, 1, sizeof description - 1, file) == 0) fail(path);
    fclose(file);
    strcpy(guid, attribute(description, "guid"));
    snprintf(path, sizeof path, "%s/binaries/linux64/Vehicle.so", argument[1]);
    library = dlopen(path, RTLD_NOW);
    if (library == NULL) fail(path);

    fmi2ValueReference omega[AXLES], brake[AXLES], moved[2];
    for (int i = 0; i < AXLES; i++) {
        omega[i] = reference("omega", i + 1);
        brake[i] = reference("brake_torque", i + 1);
    }
    moved[0] = reference("speed", 0);
    moved[1] = reference("distance", 0);
    fmi2ValueReference of_radius = reference("radius", 1);

    snprintf(path, sizeof path, "%s/resources", argument[1]);
    fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, NULL};
    fmi2Component coach = ((fmi2InstantiateTYPE *)function("fmi2Instantiate"))(
        "coach", fmi2CoSimulation, guid, path, &callbacks, fmi2False, fmi2False);
    if (coach == NULL) fail("fmi2Instantiate");
    CALL(fmi2SetupExperiment, coach, fmi2True, 1e-7, 0.0, fmi2False, 0.0);
    CALL(fmi2EnterInitializationMode, coach);
    CALL(fmi2ExitInitializationMode, coach);

    double state[2] = {1.0, 0.0}, radius, rim[AXLES], sent[LATE + 1][AXLES] = {{0.0}};
    CALL(fmi2GetReal, coach, &of_radius, 1, &radius);
    int sample = 0;
    for (; state[0] > 0.01 && sample < 12000; sample++) {
        double time = SAMPLE * sample, *now = sent[sample % (LATE + 1)];
        CALL(fmi2GetReal, coach, moved, 2, state);
        CALL(fmi2GetReal, coach, omega, AXLES, rim);
        for (int i = 0; i < AXLES; i++)
            now[i] = radius * rim[i] < 0.9 * state[0] ? 0.0 : demanded(time);
        CALL(fmi2SetReal, coach, brake, AXLES, sent[(sample + 1) % (LATE + 1)]);
        CALL(fmi2DoStep, coach, time, SAMPLE, fmi2True);
    }
    printf("%.3f m, %.2f s\n", state[1], SAMPLE * sample);
    ((fmi2FreeInstanceTYPE *)function("fmi2FreeInstance"))(coach);
    return 0;
}
