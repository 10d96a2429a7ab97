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
#define OPENED
#include "fmi.h"

enum { MAX_COLUMNS = 64, LINE_SIZE = 8192 };

typedef struct {
    char name[128], kind[16];
    unsigned reference;
    double largest, error;
} column;

static size_t read_header(FILE *file, column columns[MAX_COLUMNS]) {
    char line[LINE_SIZE];
    size_t n = 0;
    if (fgets(line, sizeof line, file) == NULL || strcmp(strtok(line, ",\r\n"), "time") != 0)
        fail("the golden case", "does not begin with time");
    for (char *cell; (cell = strtok(NULL, ",\r\n")) != NULL; n++) {
        column *c = &columns[n];
        if (n == MAX_COLUMNS) fail(cell, "is one column too many");
        c->largest = c->error = 0.0;
        if (sscanf(cell, "%127[^:]:%u:%15s", c->name, &c->reference, c->kind) != 3 ||
            (strcmp(c->kind, "in") && strcmp(c->kind, "out") && strcmp(c->kind, "boolean")))
            fail(cell, "is not name:value_reference:kind");
    }
    return n;
}

/* Time and values of the next row; 0 at the end of the file. */
static int read_row(FILE *file, size_t n, double row[MAX_COLUMNS + 1]) {
    char line[LINE_SIZE];
    if (fgets(line, sizeof line, file) == NULL) return 0;
    char *at = line;
    for (size_t i = 0; i <= n; i++) {
        char *end;
        row[i] = strtod(at, &end);
        if (end == at || (i < n && *end != ',')) fail(at, "is not a row of numbers");
        at = end + 1;
    }
    return 1;
}

static void compare(const fmi *v, void *c, column *output, double expected) {
    double got;
    int flag;
    if (strcmp(output->kind, "boolean") == 0) {
        FINE(v->get_boolean(c, &output->reference, 1, &flag));
        got = flag;
    } else {
        FINE(v->get(c, &output->reference, 1, &got));
    }
    /* A value that is no number must not pass by comparing as false. */
    if (!isfinite(got)) fail(output->name, "is not finite");
    output->largest = fmax(output->largest, fabs(expected));
    output->error = fmax(output->error, fabs(got - expected));
}

int main(int argc, char **argv) {
    if (argc != 7) fail("usage", "run_golden 2|3 LIBRARY RESOURCES TOKEN GOLDEN TOLERANCE");
    const fmi *v = fmi_of(atoi(argv[1]));
    static column columns[MAX_COLUMNS];
    static int messages; /* the FMU may keep the pointer */
    double row[MAX_COLUMNS + 1], tolerance = strtod(argv[6], NULL), worst = 0.0, time = 0.0;
    const char *where = "any column";
    unsigned rows = 0;

    FILE *file = fopen(argv[5], "r");
    if (file == NULL) fail(argv[5], "cannot be opened");
    size_t n = read_header(file, columns);
    open_library(argv[2]);
    void *c = v->open(0, argv[4], argv[3], 1, &messages);
    if (c == NULL) fail(argv[2], "cannot be instantiated");
    for (; read_row(file, n, row); rows++, time = row[0]) {
        const experiment e = {.start = row[0]};
        if (rows == 0) {
            FINE(v->set_up(c, &e));
            FINE(v->enter(c, &e));
        } else {
            FINE(v->step(c, time, row[0] - time));
        }
        for (size_t i = 0; i < n; i++)
            if (strcmp(columns[i].kind, "in") == 0)
                FINE(v->set(c, &columns[i].reference, 1, &row[i + 1]));
        if (rows == 0) FINE(v->leave(c));
        for (size_t i = 0; i < n; i++)
            if (strcmp(columns[i].kind, "in") != 0) compare(v, c, &columns[i], row[i + 1]);
    }
    FINE(v->terminate(c));
    v->close(c);
    fclose(file);

    for (size_t i = 0; i < n; i++) {
        const column *of = &columns[i];
        double error = of->largest > 0.0 ? of->error / of->largest : of->error;
        if (error > worst) worst = error, where = of->name;
    }
    printf("%u rows, largest relative error %.3g in %s\n", rows, worst, where);
    return rows > 0 && worst <= tolerance ? 0 : 1;
}
