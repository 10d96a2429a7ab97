/* The functions of an FMU's library, and the end of a program in which one fails. */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void *library;

static void fail(const char *what) {
    fprintf(stderr, "%s failed\n", what);
    exit(1);
}

#define CHECK(condition)                    \
    do {                                    \
        if (!(condition)) fail(#condition); \
    } while (0)

static void load(const char *file) {
    library = dlopen(file, RTLD_NOW);
    if (library == NULL) fail(dlerror());
}

/* C has no cast between the pointer that is found and one to a function, hence the copy. */
static void find(const char *name, void *function, size_t size) {
    void *found = dlsym(library, name);
    if (found == NULL) fail(name);
    memcpy(function, &found, size);
}

#define FUNCTION(name)       \
    static name##TYPE *name; \
    if (name == NULL) find(#name, (void *)&name, sizeof name)
