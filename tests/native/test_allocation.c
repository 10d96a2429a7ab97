/* Memory that is refused: an instance, its resources and its saved states, with each allocation in
 * turn the one that fails. What asked for it says so, and nothing is left behind.
 *
 *     test_allocation RESOURCES TOKEN
 *
 * RESOURCES is a URI. To be linked with malloc, calloc, realloc and free wrapped. */
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#include "checks.h"
#include "component.h"
#include "fmi2Functions.h"
#include "fmi3Functions.h"

void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *old, size_t size);
void __real_free(void *memory);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *old, size_t size);
void __wrap_free(void *memory);

static int to_fail, asked, refused, held; /* number of the one to fail; counts */
static int said;

static int refuses(void) {
    if (++asked != to_fail) return 0;
    refused = 1;
    return 1;
}

static void *counted(void *memory) {
    held += memory != NULL;
    return memory;
}

void *__wrap_malloc(size_t size) { return refuses() ? NULL : counted(__real_malloc(size)); }

void *__wrap_calloc(size_t count, size_t size) {
    return refuses() ? NULL : counted(__real_calloc(count, size));
}

void *__wrap_realloc(void *old, size_t size) {
    return refuses() ? NULL : __real_realloc(old, size);
}

void __wrap_free(void *memory) {
    held -= memory != NULL;
    __real_free(memory);
}

static void log2_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                         fmi2String category, fmi2String message, ...) {
    (void)environment;
    CHECK(strcmp(name, "an instance") == 0 && status == fmi2Error);
    CHECK(strcmp(category, "logStatusError") == 0 && strstr(message, "out of memory") != NULL);
    said++;
}

static void log3_message(fmi3InstanceEnvironment environment, fmi3Status status,
                         fmi3String category, fmi3String message) {
    (void)environment;
    CHECK(status == fmi3Error);
    CHECK(strcmp(category, "logStatusError") == 0 && strstr(message, "out of memory") != NULL);
    said++;
}

static const char *resources, *token;

static void life2(void) {
    static const fmi2CallbackFunctions callbacks = {.logger = log2_message};
    char bytes[4096];
    size_t size = 0;
    fmi2FMUstate saved = NULL, read = NULL;
    fmi2Component c =
        fmi2Instantiate("an instance", fmi2CoSimulation, token, resources, &callbacks, 0, 1);
    CHECK((c == NULL) == refused);
    if (c == NULL) return;
    CHECK(fmi2GetFMUstate(c, &saved) == (refused ? fmi2Error : fmi2OK));
    CHECK((saved == NULL) == refused);
    if (saved != NULL) {
        CHECK(fmi2SerializedFMUstateSize(c, saved, &size) == fmi2OK && size <= sizeof bytes);
        CHECK(fmi2SerializeFMUstate(c, saved, bytes, size) == fmi2OK);
        CHECK(fmi2DeSerializeFMUstate(c, bytes, size, &read) == (refused ? fmi2Error : fmi2OK));
        CHECK((read == NULL) == refused);
    }
    fmi2FreeFMUstate(c, &saved);
    fmi2FreeFMUstate(c, &read);
    fmi2FreeInstance(c);
}

static void life3(void) {
    fmi3FMUState saved = NULL;
    fmi3Instance c = fmi3InstantiateModelExchange("x", token, resources, 0, 1, NULL, log3_message);
    CHECK((c == NULL) == refused);
    if (c == NULL) return;
    CHECK(fmi3GetFMUState(c, &saved) == (refused ? fmi3Error : fmi3OK));
    fmi3FreeFMUState(c, &saved);
    fmi3FreeInstance(c);
}

/* A tool that gives no logger: the same without words. */
static void silent_lives(void) {
    fmi2FreeInstance(fmi2Instantiate(NULL, fmi2CoSimulation, token, resources, NULL, 0, 1));
    fmi3FreeInstance(fmi3InstantiateModelExchange("x", token, resources, 0, 1, NULL, NULL));
}

/* Number of allocations of a life, each of which has failed once. */
static int with_each_refused(void (*life)(void), int words) {
    for (to_fail = 1;; to_fail++) {
        asked = refused = said = 0;
        life();
        CHECK(held == 0);
        CHECK(said == (words ? refused : 0));
        if (!refused) return asked;
    }
}

/* No file can be opened any more. */
static void test_no_file(void) {
    struct rlimit usual, none;
    CHECK(getrlimit(RLIMIT_NOFILE, &usual) == 0);
    none = usual;
    none.rlim_cur = 3;
    CHECK(setrlimit(RLIMIT_NOFILE, &none) == 0);
    CHECK(fmi3InstantiateModelExchange("x", token, resources, 0, 1, NULL, NULL) == NULL);
    CHECK(setrlimit(RLIMIT_NOFILE, &usual) == 0);
    CHECK(held == 0);
}

int main(int count, char **arguments) {
    if (count != 3) return 2;
    resources = arguments[1];
    token = arguments[2];
    CHECK(with_each_refused(life2, 1) >= 5);
    CHECK(with_each_refused(life3, 1) >= 4);
    CHECK(with_each_refused(silent_lives, 0) >= 6);
    to_fail = 0;
    test_no_file();
    return verdict();
}
