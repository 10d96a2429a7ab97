/* Runs the library of an FMU through a golden case by co-simulation, as a tool on its platform
 * would, and compares. No FMI library and no Python, so that it runs wherever the FMU does:
 *
 *     run_golden 2|3 LIBRARY RESOURCES TOKEN GOLDEN TOLERANCE
 *
 * RESOURCES is a URI for FMI 2 and a path for FMI 3. GOLDEN is a CSV file; its header is "time" and
 * then "name:value_reference:kind", kind being "in", "out" or "boolean" (an output too). In every
 * row the inputs are set and the outputs read at the row's time: the first row in and after
 * initialization, each other one after a step from the row before. The error of a column is scaled
 * with its largest magnitude. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

enum { MOST_COLUMNS = 64, LINE_SIZE = 8192 };

typedef enum { COLUMN_IN, COLUMN_OUT, COLUMN_BOOLEAN } column_kind;

typedef struct {
    char name[128];
    unsigned reference;
    column_kind kind;
    double largest, error;
} column;

static void fail(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    exit(1);
}

/* ---- the library --------------------------------------------------------------------------- */

static void *library;

static void open_library(const char *path) {
#ifdef _WIN32
    library = (void *)LoadLibraryA(path);
    if (library == NULL) fail("cannot load %s: error %lu", path, GetLastError());
#else
    library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) fail("cannot load %s", dlerror());
#endif
}

/* C has no cast between the pointer that is found and one to a function, hence the copy. */
static void find(const char *name, void *function, size_t size) {
#ifdef _WIN32
    FARPROC found = GetProcAddress((HMODULE)library, name);
#else
    void *found = dlsym(library, name);
#endif
    if (found == NULL) fail("%s is missing", name);
    memcpy(function, &found, size);
}

#define FUNCTION(name) \
    name##TYPE *name;  \
    find(#name, (void *)&name, sizeof name)

/* Both versions number their statuses alike: 0 is OK, 1 a warning. */
#define CHECK(call)                                          \
    do {                                                     \
        int status_ = (int)(call);                           \
        if (status_ > 1) fail("%s gave %d", #call, status_); \
    } while (0)

/* ---- the two versions ---------------------------------------------------------------------- */

static void *instance;

/* What a golden case asks of an FMU. */
typedef struct {
    void (*instantiate)(const char *resources, const char *token);
    void (*enter_initialization)(double time);
    void (*exit_initialization)(void);
    void (*set)(unsigned reference, double value);
    double (*get)(unsigned reference);
    double (*get_boolean)(unsigned reference);
    void (*step)(double time, double step);
    void (*end)(void);
} fmi_version;

static void log_fmi2(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                     fmi2String category, fmi2String message, ...) {
    (void)environment, (void)category;
    va_list arguments;
    fprintf(stderr, "%s, status %d: ", name, (int)status);
    va_start(arguments, message);
    vfprintf(stderr, message, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

static void instantiate2(const char *resources, const char *token) {
    /* The FMU may keep the pointer. */
    static const fmi2CallbackFunctions callbacks = {
        .logger = log_fmi2, .allocateMemory = calloc, .freeMemory = free};
    FUNCTION(fmi2Instantiate);
    instance = fmi2Instantiate("golden", fmi2CoSimulation, token, resources, &callbacks, fmi2False,
                               fmi2True);
}

static void enter_initialization2(double time) {
    FUNCTION(fmi2SetupExperiment);
    FUNCTION(fmi2EnterInitializationMode);
    CHECK(fmi2SetupExperiment(instance, fmi2False, 0.0, time, fmi2False, 0.0));
    CHECK(fmi2EnterInitializationMode(instance));
}

static void exit_initialization2(void) {
    FUNCTION(fmi2ExitInitializationMode);
    CHECK(fmi2ExitInitializationMode(instance));
}

static void set2(unsigned reference, double value) {
    FUNCTION(fmi2SetReal);
    CHECK(fmi2SetReal(instance, &reference, 1, &value));
}

static double get2(unsigned reference) {
    double value;
    FUNCTION(fmi2GetReal);
    CHECK(fmi2GetReal(instance, &reference, 1, &value));
    return value;
}

static double get_boolean2(unsigned reference) {
    fmi2Boolean value;
    FUNCTION(fmi2GetBoolean);
    CHECK(fmi2GetBoolean(instance, &reference, 1, &value));
    return value;
}

static void step2(double time, double step) {
    FUNCTION(fmi2DoStep);
    CHECK(fmi2DoStep(instance, time, step, fmi2True));
}

static void end2(void) {
    FUNCTION(fmi2Terminate);
    FUNCTION(fmi2FreeInstance);
    CHECK(fmi2Terminate(instance));
    fmi2FreeInstance(instance);
}

static void log_fmi3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                     fmi3String message) {
    (void)environment, (void)category;
    fprintf(stderr, "golden, status %d: %s\n", (int)status, message);
}

static void instantiate3(const char *resources, const char *token) {
    FUNCTION(fmi3InstantiateCoSimulation);
    instance = fmi3InstantiateCoSimulation("golden", token, resources, fmi3False, fmi3True,
                                           fmi3False, fmi3False, NULL, 0, NULL, log_fmi3, NULL);
}

static void enter_initialization3(double time) {
    FUNCTION(fmi3EnterInitializationMode);
    CHECK(fmi3EnterInitializationMode(instance, fmi3False, 0.0, time, fmi3False, 0.0));
}

static void exit_initialization3(void) {
    FUNCTION(fmi3ExitInitializationMode);
    CHECK(fmi3ExitInitializationMode(instance));
}

static void set3(unsigned reference, double value) {
    FUNCTION(fmi3SetFloat64);
    CHECK(fmi3SetFloat64(instance, &reference, 1, &value, 1));
}

static double get3(unsigned reference) {
    double value;
    FUNCTION(fmi3GetFloat64);
    CHECK(fmi3GetFloat64(instance, &reference, 1, &value, 1));
    return value;
}

static double get_boolean3(unsigned reference) {
    fmi3Boolean value;
    FUNCTION(fmi3GetBoolean);
    CHECK(fmi3GetBoolean(instance, &reference, 1, &value, 1));
    return value;
}

static void step3(double time, double step) {
    fmi3Boolean event, terminate, early;
    double last;
    FUNCTION(fmi3DoStep);
    CHECK(fmi3DoStep(instance, time, step, fmi3True, &event, &terminate, &early, &last));
    if (terminate || early) fail("the step from %.17g ended at %.17g", time, last);
}

static void end3(void) {
    FUNCTION(fmi3Terminate);
    FUNCTION(fmi3FreeInstance);
    CHECK(fmi3Terminate(instance));
    fmi3FreeInstance(instance);
}

static const fmi_version FMI2 = {
    instantiate2, enter_initialization2, exit_initialization2, set2, get2, get_boolean2, step2,
    end2};
static const fmi_version FMI3 = {
    instantiate3, enter_initialization3, exit_initialization3, set3, get3, get_boolean3, step3,
    end3};

/* ---- the golden case ----------------------------------------------------------------------- */

static size_t read_header(FILE *file, column columns[MOST_COLUMNS]) {
    char line[LINE_SIZE], kind[16];
    size_t n = 0;
    if (fgets(line, sizeof line, file) == NULL) fail("the golden case is empty");
    if (strcmp(strtok(line, ",\r\n"), "time") != 0) fail("the first column is not time");
    for (char *cell; (cell = strtok(NULL, ",\r\n")) != NULL; n++) {
        if (n == MOST_COLUMNS) fail("too many columns");
        column *c = &columns[n];
        if (sscanf(cell, "%127[^:]:%u:%15s", c->name, &c->reference, kind) != 3)
            fail("%s is not name:value_reference:kind", cell);
        if (strcmp(kind, "in") == 0) c->kind = COLUMN_IN;
        else if (strcmp(kind, "out") == 0) c->kind = COLUMN_OUT;
        else if (strcmp(kind, "boolean") == 0) c->kind = COLUMN_BOOLEAN;
        else fail("%s is no kind of column", kind);
        c->largest = c->error = 0.0;
    }
    return n;
}

/* Time and values of the next row; 0 at the end of the file. */
static int read_row(FILE *file, size_t n, double row[MOST_COLUMNS + 1]) {
    char line[LINE_SIZE];
    if (fgets(line, sizeof line, file) == NULL) return 0;
    char *at = line;
    for (size_t i = 0; i <= n; i++) {
        char *end;
        row[i] = strtod(at, &end);
        if (end == at || (i < n && *end != ','))
            fail("not a row of %u numbers: %s", (unsigned)n, at);
        at = end + 1;
    }
    return 1;
}

static void set_inputs(const fmi_version *fmi, const column columns[], size_t n,
                       const double values[]) {
    for (size_t i = 0; i < n; i++)
        if (columns[i].kind == COLUMN_IN) fmi->set(columns[i].reference, values[i]);
}

static void compare_outputs(const fmi_version *fmi, column columns[], size_t n,
                            const double values[]) {
    for (size_t i = 0; i < n; i++) {
        column *c = &columns[i];
        if (c->kind == COLUMN_IN) continue;
        double got =
            c->kind == COLUMN_OUT ? fmi->get(c->reference) : fmi->get_boolean(c->reference);
        /* A value that is no number must not pass by comparing as false. */
        if (!isfinite(got)) fail("%s = %g", c->name, got);
        c->largest = fmax(c->largest, fabs(values[i]));
        c->error = fmax(c->error, fabs(got - values[i]));
    }
}

int main(int argc, char **argv) {
    if (argc != 7) fail("usage: run_golden 2|3 LIBRARY RESOURCES TOKEN GOLDEN TOLERANCE");
    const fmi_version *fmi = strcmp(argv[1], "3") == 0 ? &FMI3 : &FMI2;
    static column columns[MOST_COLUMNS];
    double row[MOST_COLUMNS + 1], tolerance = strtod(argv[6], NULL), worst = 0.0;
    const char *where = "any column";
    size_t rows = 0;

    FILE *file = fopen(argv[5], "r");
    if (file == NULL) fail("cannot open %s", argv[5]);
    size_t n = read_header(file, columns);
    open_library(argv[2]);
    fmi->instantiate(argv[3], argv[4]);
    if (instance == NULL) fail("cannot instantiate");

    for (double time = 0.0; read_row(file, n, row); rows++) {
        if (rows == 0) fmi->enter_initialization(row[0]);
        else fmi->step(time, row[0] - time);
        set_inputs(fmi, columns, n, row + 1);
        if (rows == 0) fmi->exit_initialization();
        compare_outputs(fmi, columns, n, row + 1);
        time = row[0];
    }
    fmi->end();
    fclose(file);

    for (size_t i = 0; i < n; i++) {
        const column *c = &columns[i];
        double error = c->largest > 0.0 ? c->error / c->largest : c->error;
        if (error > worst) worst = error, where = c->name;
    }
    printf("%u rows, largest relative error %.3g in %s\n", (unsigned)rows, worst, where);
    return rows > 0 && worst <= tolerance ? 0 : 1;
}
