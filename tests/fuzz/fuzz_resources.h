/* FMUs to fuzz: their resources lie in folders of these names, in the folder that the environment
 * variable FUZZ_RESOURCES names. */
#ifndef FUZZ_RESOURCES_H
#define FUZZ_RESOURCES_H

#include "component.h"
#include "fuzz_input.h"

enum { FMUS = 7, PATH_LENGTH = 512 };

static const char *const FMU_NAMES[FMUS] = {
    "force_element", "force_element-relaxed", "force_element-implicit",
    "wheelset",      "wheelset-relaxed",      "wheelset_body",
    "creep_forces"};

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
    for (size_t i = 0; i < m->count; i++) {
        const model_variable *v = &m->variables[i];
        double value = model_get(v, &core->now.values);
        if (v->role == INDEPENDENT) MUST(isfinite(value));
        if (v->role == OUTPUT || v->role == INDEPENDENT || v->role == DERIVATIVE ||
            v->role == INDICATOR)
            continue;
        if (!model_has(v, &core->now.values)) continue;
        if (!(value >= v->minimum && value <= v->maximum))
            fprintf(stderr, "%s = %g\n", v->name, value);
        MUST(value >= v->minimum && value <= v->maximum);
    }
}

#endif
