/* Time per call of an FMU in co-simulation; see fmu_step.py.
 *
 *     fmu_step 2|3 LIBRARY RESOURCES TOKEN CALLS REPETITIONS INPUTS OUTPUTS MOVED MIN MAX \
 *         TOLERANCE
 *
 * INPUTS and OUTPUTS are value references with commas between. The first MOVED inputs take other
 * values between MIN and MAX at every call, so that an output cannot be remembered; the others are
 * set to their start values. Prints nanoseconds per call of set, step and get. */
#include <time.h>

#define OPENED
#include "fmi.h"

enum { MAX_REFERENCES = 64, VALUES = 4096 };

static const double LENGTH = 1e-3;
static double now, values[VALUES];
static unsigned inputs[MAX_REFERENCES], outputs[MAX_REFERENCES];
static size_t input_count, output_count, moved;

static size_t references(char *text, unsigned found[MAX_REFERENCES]) {
    size_t n = 0;
    for (char *cell = strtok(text, ","); cell != NULL; cell = strtok(NULL, ",")) {
        if (n == MAX_REFERENCES) fail(cell, "is one value reference too many");
        found[n++] = (unsigned)strtoul(cell, NULL, 10);
    }
    return n;
}

static void run(const fmi *v, void *c, size_t calls) {
    double in[MAX_REFERENCES], out[MAX_REFERENCES];
    FINE(v->get(c, inputs, input_count, in));
    for (size_t i = 0; i < calls; i++) {
        for (size_t k = 0; k < moved; k++) in[k] = values[(i + 7 * k) % VALUES];
        FINE(v->set(c, inputs, input_count, in));
        FINE(v->step(c, now, LENGTH));
        now += LENGTH;
        FINE(v->get(c, outputs, output_count, out));
    }
}

int main(int argc, char **argv) {
    if (argc != 13) fail("usage", "twelve arguments");
    const fmi *v = fmi_of(atoi(argv[1]));
    static int messages;
    int repetitions = atoi(argv[6]);
    size_t calls = (size_t)strtoul(argv[5], NULL, 10);
    double low = strtod(argv[10], NULL), high = strtod(argv[11], NULL), part = 0.0;
    input_count = references(argv[7], inputs);
    output_count = references(argv[8], outputs);
    moved = (size_t)strtoul(argv[9], NULL, 10);
    /* Multiples of the golden ratio: spread evenly, and no two neighbours alike. */
    for (size_t i = 0; i < VALUES; i++) {
        values[i] = low + (high - low) * part;
        part += 0.6180339887498949;
        if (part >= 1.0) part -= 1.0;
    }
    open_library(argv[2]);
    void *c = v->open(0, argv[4], argv[3], 0, &messages);
    if (c == NULL) fail(argv[2], "cannot be instantiated");
    FINE(start(v, c, strtod(argv[12], NULL)));
    double best = 1e300;
    for (int i = 0; i < repetitions; i++) {
        /* Processor time: others may use the machine too. */
        clock_t before = clock();
        run(v, c, calls);
        double spent = 1e9 * (double)(clock() - before) / CLOCKS_PER_SEC / (double)calls;
        if (spent < best) best = spent;
    }
    printf("%.2f\n", best);
    return 0;
}
