/* Lives of an FMU's instances, one after the other, and what they leave behind; see cycles.py.
 *
 *     cycles 2|3 LIBRARY RESOURCES TOKEN CYCLES
 *
 * A cycle is an instance that is initialized, stepped, saved, restored and freed, and two that
 * fail: of another token and of another folder. Prints bytes allocated, pages in memory and files
 * open, after the first cycles and at the end. */
#define _GNU_SOURCE
#include <dirent.h>
#include <malloc.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"
#include "library.h"

enum { WARM_UP = 100 };

static long said;

static void log2_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                         fmi2String category, fmi2String message, ...) {
    (void)environment, (void)name, (void)status, (void)category;
    said += message[0] != '\0';
}

static void log3_message(fmi3InstanceEnvironment environment, fmi3Status status,
                         fmi3String category, fmi3String message) {
    (void)environment, (void)status, (void)category;
    said += message[0] != '\0';
}

static void cycle2(const char *resources, const char *token) {
    static const fmi2CallbackFunctions callbacks = {log2_message, calloc, free, NULL, NULL};
    FUNCTION(fmi2Instantiate);
    FUNCTION(fmi2SetupExperiment);
    FUNCTION(fmi2EnterInitializationMode);
    FUNCTION(fmi2ExitInitializationMode);
    FUNCTION(fmi2DoStep);
    FUNCTION(fmi2GetFMUstate);
    FUNCTION(fmi2SetFMUstate);
    FUNCTION(fmi2FreeFMUstate);
    FUNCTION(fmi2FreeInstance);
    fmi2FMUstate saved = NULL;
    CHECK(fmi2Instantiate("x", fmi2CoSimulation, "?", resources, &callbacks, 0, 1) == NULL);
    CHECK(fmi2Instantiate("x", fmi2CoSimulation, token, "file:///no/folder", &callbacks, 0, 1) ==
          NULL);
    fmi2Component c = fmi2Instantiate("x", fmi2CoSimulation, token, resources, &callbacks, 0, 1);
    CHECK(c != NULL);
    CHECK(fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK);
    CHECK(fmi2ExitInitializationMode(c) == fmi2OK);
    CHECK(fmi2DoStep(c, 0.0, 1e-3, 1) == fmi2OK);
    CHECK(fmi2DoStep(c, 1.0, 1e-3, 1) == fmi2Error);
    CHECK(fmi2GetFMUstate(c, &saved) == fmi2OK);
    CHECK(fmi2SetFMUstate(c, saved) == fmi2OK);
    CHECK(fmi2FreeFMUstate(c, &saved) == fmi2OK);
    fmi2FreeInstance(c);
}

static void cycle3(const char *resources, const char *token) {
    FUNCTION(fmi3InstantiateCoSimulation);
    FUNCTION(fmi3EnterInitializationMode);
    FUNCTION(fmi3ExitInitializationMode);
    FUNCTION(fmi3DoStep);
    FUNCTION(fmi3GetFMUState);
    FUNCTION(fmi3SetFMUState);
    FUNCTION(fmi3FreeFMUState);
    FUNCTION(fmi3FreeInstance);
    fmi3FMUState saved = NULL;
    fmi3Boolean b[3];
    double last;
    const char *tokens[] = {"?", token, token}, *folders[] = {resources, "/no/folder", resources};
    fmi3Instance c = NULL;
    for (int i = 0; i < 3; i++) {
        CHECK(c == NULL);
        c = fmi3InstantiateCoSimulation("x", tokens[i], folders[i], 0, 1, 0, 0, NULL, 0, NULL,
                                        log3_message, NULL);
    }
    CHECK(c != NULL);
    CHECK(fmi3EnterInitializationMode(c, 0, 0.0, 0.0, 0, 0.0) == fmi3OK);
    CHECK(fmi3ExitInitializationMode(c) == fmi3OK);
    CHECK(fmi3DoStep(c, 0.0, 1e-3, 1, b, b + 1, b + 2, &last) == fmi3OK);
    CHECK(fmi3DoStep(c, 1.0, 1e-3, 1, b, b + 1, b + 2, &last) == fmi3Error);
    CHECK(fmi3GetFMUState(c, &saved) == fmi3OK);
    CHECK(fmi3SetFMUState(c, saved) == fmi3OK);
    CHECK(fmi3FreeFMUState(c, &saved) == fmi3OK);
    fmi3FreeInstance(c);
}

static size_t allocated(void) {
    struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
}

static long pages(void) {
    long whole, resident;
    FILE *file = fopen("/proc/self/statm", "r");
    CHECK(file != NULL && fscanf(file, "%ld %ld", &whole, &resident) == 2);
    fclose(file);
    return resident;
}

static int open_files(void) {
    int n = 0;
    DIR *folder = opendir("/proc/self/fd");
    CHECK(folder != NULL);
    while (readdir(folder) != NULL) n++;
    closedir(folder);
    return n;
}

static void report(void) { printf("%zu %ld %d\n", allocated(), pages(), open_files()); }

int main(int argc, char **argv) {
    if (argc != 6) fail("reading the arguments");
    long cycles = strtol(argv[5], NULL, 10);
    load(argv[2]);
    void (*cycle)(const char *, const char *) = strcmp(argv[1], "3") == 0 ? cycle3 : cycle2;
    /* What reports need stays allocated too. */
    static char buffer[4096];
    setvbuf(stdout, buffer, _IOFBF, sizeof buffer);
    for (long i = 0; i < cycles; i++) {
        if (i == WARM_UP) report();
        cycle(argv[3], argv[4]);
    }
    report();
    CHECK(said == 3 * cycles);
    return 0;
}
