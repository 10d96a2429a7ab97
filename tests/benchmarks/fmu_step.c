/* Time per call of an FMU in co-simulation; see fmu_step.py.
 *
 *     fmu_step 2|3 LIBRARY RESOURCES TOKEN CALLS REPETITIONS INPUTS OUTPUTS LEAST MOST TOLERANCE
 *
 * INPUTS and OUTPUTS are value references with commas between. The first input takes another value
 * between LEAST and MOST at every call, so that an output cannot be remembered; the others are set
 * to their start values. Prints nanoseconds per call of: step; set; set and step; set, step and
 * get. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

enum { MOST_REFERENCES = 64, VALUES = 4096 };
typedef enum { STEP_ALONE, SET, SET_STEP, SET_STEP_GET } extent;

static const double LENGTH = 1e-3;
static void *library, *instance;
static double now, tolerance, values[VALUES];
static unsigned inputs[MOST_REFERENCES], outputs[MOST_REFERENCES];
static size_t input_count, output_count;

static void fail(const char *what) {
    fprintf(stderr, "%s failed\n", what);
    exit(1);
}

static void open_library(const char *path) {
#ifdef _WIN32
    library = (void *)LoadLibraryA(path);
#else
    library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
#endif
    if (library == NULL) fail("loading the library");
}

/* C has no cast between the pointer that is found and one to a function, hence the copy. */
static void find(const char *name, void *function, size_t size) {
#ifdef _WIN32
    FARPROC found = GetProcAddress((HMODULE)library, name);
#else
    void *found = dlsym(library, name);
#endif
    if (found == NULL) fail(name);
    memcpy(function, &found, size);
}

#define FUNCTION(name) \
    name##TYPE *name;  \
    find(#name, (void *)&name, sizeof name)

#define CHECK(call)                       \
    do {                                  \
        if ((int)(call) > 1) fail(#call); \
    } while (0)

static size_t references(char *text, unsigned found[MOST_REFERENCES]) {
    size_t n = 0;
    for (char *cell = strtok(text, ","); cell != NULL; cell = strtok(NULL, ",")) {
        if (n == MOST_REFERENCES) fail("reading value references");
        found[n++] = (unsigned)strtoul(cell, NULL, 10);
    }
    return n;
}

static void log2_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                         fmi2String category, fmi2String message, ...) {
    (void)environment, (void)name, (void)status, (void)category;
    fprintf(stderr, "%s\n", message);
}

static void log3_message(fmi3InstanceEnvironment environment, fmi3Status status,
                         fmi3String category, fmi3String message) {
    (void)environment, (void)status, (void)category;
    fprintf(stderr, "%s\n", message);
}

static void start2(const char *resources, const char *token) {
    static const fmi2CallbackFunctions callbacks = {log2_message, calloc, free, NULL, NULL};
    FUNCTION(fmi2Instantiate);
    FUNCTION(fmi2SetupExperiment);
    FUNCTION(fmi2EnterInitializationMode);
    FUNCTION(fmi2ExitInitializationMode);
    instance = fmi2Instantiate("timed", fmi2CoSimulation, token, resources, &callbacks, fmi2False,
                               fmi2False);
    if (instance == NULL) fail("fmi2Instantiate");
    CHECK(fmi2SetupExperiment(instance, fmi2True, tolerance, 0.0, fmi2False, 0.0));
    CHECK(fmi2EnterInitializationMode(instance));
    CHECK(fmi2ExitInitializationMode(instance));
}

static void start3(const char *resources, const char *token) {
    FUNCTION(fmi3InstantiateCoSimulation);
    FUNCTION(fmi3EnterInitializationMode);
    FUNCTION(fmi3ExitInitializationMode);
    instance = fmi3InstantiateCoSimulation("timed", token, resources, fmi3False, fmi3False,
                                           fmi3False, fmi3False, NULL, 0, NULL, log3_message, NULL);
    if (instance == NULL) fail("fmi3InstantiateCoSimulation");
    CHECK(fmi3EnterInitializationMode(instance, fmi3True, tolerance, 0.0, fmi3False, 0.0));
    CHECK(fmi3ExitInitializationMode(instance));
}

static void calls2(size_t calls, extent what) {
    double in[MOST_REFERENCES], out[MOST_REFERENCES];
    FUNCTION(fmi2SetReal);
    FUNCTION(fmi2DoStep);
    FUNCTION(fmi2GetReal);
    CHECK(fmi2GetReal(instance, inputs, input_count, in));
    for (size_t i = 0; i < calls; i++) {
        in[0] = values[i % VALUES];
        if (what != STEP_ALONE) CHECK(fmi2SetReal(instance, inputs, input_count, in));
        if (what == SET) continue;
        CHECK(fmi2DoStep(instance, now, LENGTH, fmi2True));
        now += LENGTH;
        if (what != SET_STEP_GET) continue;
        CHECK(fmi2GetReal(instance, outputs, output_count, out));
    }
}

static void calls3(size_t calls, extent what) {
    double in[MOST_REFERENCES], out[MOST_REFERENCES], last;
    fmi3Boolean event, terminate, early;
    FUNCTION(fmi3SetFloat64);
    FUNCTION(fmi3DoStep);
    FUNCTION(fmi3GetFloat64);
    CHECK(fmi3GetFloat64(instance, inputs, input_count, in, input_count));
    for (size_t i = 0; i < calls; i++) {
        in[0] = values[i % VALUES];
        if (what != STEP_ALONE)
            CHECK(fmi3SetFloat64(instance, inputs, input_count, in, input_count));
        if (what == SET) continue;
        CHECK(fmi3DoStep(instance, now, LENGTH, fmi3True, &event, &terminate, &early, &last));
        now += LENGTH;
        if (what != SET_STEP_GET) continue;
        CHECK(fmi3GetFloat64(instance, outputs, output_count, out, output_count));
    }
}

int main(int argc, char **argv) {
    if (argc != 12) fail("reading the arguments");
    int version = atoi(argv[1]), repetitions = atoi(argv[6]);
    size_t calls = (size_t)strtoul(argv[5], NULL, 10);
    double least = strtod(argv[9], NULL), most = strtod(argv[10], NULL), part = 0.0;
    tolerance = strtod(argv[11], NULL);
    input_count = references(argv[7], inputs);
    output_count = references(argv[8], outputs);
    /* Multiples of the golden ratio: spread evenly, and no two neighbours alike. */
    for (size_t i = 0; i < VALUES; i++) {
        values[i] = least + (most - least) * part;
        part += 0.6180339887498949;
        if (part >= 1.0) part -= 1.0;
    }
    open_library(argv[2]);
    (version == 3 ? start3 : start2)(argv[3], argv[4]);
    for (int what = STEP_ALONE; what <= SET_STEP_GET; what++) {
        double best = 1e300;
        for (int i = 0; i < repetitions; i++) {
            /* Processor time: others may use the machine too. */
            clock_t before = clock();
            (version == 3 ? calls3 : calls2)(calls, (extent)what);
            double spent = 1e9 * (double)(clock() - before) / CLOCKS_PER_SEC / (double)calls;
            if (spent < best) best = spent;
        }
        printf("%.2f ", best);
    }
    printf("\n");
    return 0;
}
