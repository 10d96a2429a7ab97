/* Memory that is refused: an instance, its resources and its saved states, with each allocation in
 * turn the one that fails. The caller logs it, and nothing is left behind.
 *
 *     test_allocation RESOURCES TOKEN
 *
 * RESOURCES is a URI. To be linked with malloc, calloc, realloc and free wrapped. */
#include <sys/resource.h>

#include "checks.h"
#include "component.h"
#include "fmi.h"

void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *old, size_t size);
void __real_free(void *memory);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *old, size_t size);
void __wrap_free(void *memory);

static int to_fail, attempts, refused, held; /* number of the one to fail; counts */
static int messages;

static int refuses(void) {
    if (++attempts != to_fail) return 0;
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

static const char *resources, *token;

static void life(int version) {
    const fmi *v = fmi_of(version);
    char bytes[4096];
    size_t size = 0;
    void *saved = NULL, *read = NULL;
    void *c = v->open(version == 3, token, resources, 1, &messages);
    CHECK((c == NULL) == refused);
    if (c == NULL) return;
    CHECK(v->save(c, &saved) == (refused ? RESULT_ERROR : RESULT_OK));
    CHECK((saved == NULL) == refused);
    if (saved != NULL) {
        CHECK(v->size(c, saved, &size) == RESULT_OK && size <= sizeof bytes);
        CHECK(v->serialize(c, saved, bytes, size) == RESULT_OK);
        CHECK(v->deserialize(c, bytes, size, &read) == (refused ? RESULT_ERROR : RESULT_OK));
        CHECK((read == NULL) == refused);
    }
    v->forget(c, &saved);
    v->forget(c, &read);
    v->close(c);
}

/* A tool that gives no logger: the same without words. */
static void silent_life(int version) {
    const fmi *v = fmi_of(version);
    v->close(v->open(version == 3, token, resources, 1, NULL));
}

/* Number of allocations of a life; each has failed once. */
static int with_each_refused(void (*of)(int), int version, int words) {
    for (to_fail = 1;; to_fail++) {
        attempts = refused = messages = 0;
        of(version);
        CHECK(held == 0);
        CHECK(messages == (words ? refused : 0));
        if (!refused) return attempts;
    }
}

/* No file can be opened any more. */
static void test_no_file(void) {
    struct rlimit usual, none;
    CHECK(getrlimit(RLIMIT_NOFILE, &usual) == 0);
    none = usual;
    none.rlim_cur = 3;
    CHECK(setrlimit(RLIMIT_NOFILE, &none) == 0);
    CHECK(fmi_of(3)->open(1, token, resources, 1, NULL) == NULL);
    CHECK(setrlimit(RLIMIT_NOFILE, &usual) == 0);
    CHECK(held == 0);
}

int main(int count, char **arguments) {
    if (count != 3) return 2;
    resources = arguments[1];
    token = arguments[2];
    must_say = "out of memory";
    for (int version = 2; version <= 3; version++) {
        CHECK(with_each_refused(life, version, 1) >= 5);
        CHECK(with_each_refused(silent_life, version, 0) >= 3);
    }
    to_fail = 0;
    test_no_file();
    return verdict();
}
