/* The fuzzer's bytes, taken one thing at a time - where they end there are zeros - and what it
 * fuzzes. */
#ifndef FUZZ_INPUT_H
#define FUZZ_INPUT_H

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "component.h"

/* What must hold whatever the bytes are. */
#define MUST(condition)                                                     \
    do {                                                                    \
        if (!(condition)) {                                                 \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
            abort();                                                        \
        }                                                                   \
    } while (0)

typedef struct {
    const uint8_t *at;
    size_t left;
} fuzz_input;

/* Up to n bytes into `to`; the rest of it becomes zero. */
static inline void take(fuzz_input *in, void *to, size_t n) {
    size_t given = n < in->left ? n : in->left;
    memset(to, 0, n);
    if (given > 0) memcpy(to, in->at, given);
    in->at += given;
    in->left -= given;
}

static inline unsigned take_byte(fuzz_input *in) {
    uint8_t byte;
    take(in, &byte, sizeof byte);
    return byte;
}

static inline uint32_t take_word(fuzz_input *in) {
    uint32_t word;
    take(in, &word, sizeof word);
    return word;
}

/* Any number: odd ones, ones of any bits, and most often ones that a tool could mean. */
static inline double take_number(fuzz_input *in) {
    static const double odd[] = {0.0,       -0.0,    1.0,     -1.0,     NAN,      INFINITY,
                                 -INFINITY, DBL_MAX, DBL_MIN, -DBL_MAX, 4.9e-324, 1e9,
                                 -1e9,      1e12,    1e-6,    1e300};
    unsigned kind = take_byte(in);
    double number;
    if (kind < 16) return odd[kind];
    if (kind < 48) {
        take(in, &number, sizeof number);
        return number;
    }
    int exponent = (int)(take_byte(in) % 22) - 10;
    number = (1.0 + take_byte(in) / 28.0) * pow(10.0, exponent);
    return kind % 4 == 0 ? -number : number;
}

/* A string of up to 63 bytes, with any of them but zero. */
static inline const char *take_text(fuzz_input *in, char text[64]) {
    size_t length = take_byte(in) % 64;
    take(in, text, length);
    text[length] = '\0';
    return text;
}

/* Room for exactly this many, so that the sanitizer sees one too many. */
static inline void *room(size_t count, size_t size) {
    void *found = calloc(count > 0 ? count : 1, size);
    MUST(found != NULL);
    return found;
}

/* FMUs to fuzz: their resources lie in folders of these names, in the folder that the environment
 * variable FUZZ_RESOURCES names. */
enum { FMUS = 8, PATH_LENGTH = 512 };

static const char *const FMU_NAMES[FMUS] = {
    "force_element",   "force_element-memory", "force_element-implicit", "wheelset",
    "wheelset-memory", "wheelset_body",        "creep_forces",           "vehicle"};

static inline const char *resources_folder(void) {
    const char *folder = getenv("FUZZ_RESOURCES");
    MUST(folder != NULL && strlen(folder) < PATH_LENGTH - 64);
    return folder;
}

static inline void location_of(const char *name, char location[PATH_LENGTH]) {
    snprintf(location, PATH_LENGTH, "%s/%s", resources_folder(), name);
}

/* A token that this library takes for its own, of the kind that the name begins with. */
static inline void token_of(const char *name, char token[PATH_LENGTH]) {
    snprintf(token, PATH_LENGTH, "%s-%.*s-fuzz", CONTACTLIB_TOKEN, (int)strcspn(name, "-"), name);
}

/* Parameters, inputs and states hold what a tool could have set, after any call whatever. */
static inline void check_values(const component *core) {
    const model *m = core->model;
    for (size_t i = 0; i < m->count * core->wheels; i++) {
        const model_variable *v = &m->variables[i / core->wheels];
        const model_values *values = &core->now->values[i % core->wheels];
        double value = model_get(v, values);
        if (v->role == INDEPENDENT) MUST(isfinite(value));
        if (v->role == OUTPUT || v->role == INDEPENDENT || v->role == DERIVATIVE ||
            v->role == INDICATOR)
            continue;
        if (!model_has(v, values)) continue;
        if (!(value >= v->minimum && value <= v->maximum))
            fprintf(stderr, "%s = %g\n", v->name, value);
        MUST(value >= v->minimum && value <= v->maximum);
    }
}

#endif
