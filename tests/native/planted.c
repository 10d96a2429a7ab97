/* What the tools that watch the other programs must find: planted leak|uninitialized|race. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static volatile int shared;
static void *volatile kept;

static void *add(void *unused) {
    for (int i = 0; i < 1000; i++) shared = shared + 1;
    return unused;
}

int main(int count, char **arguments) {
    const char *what = count > 1 ? arguments[1] : "";
    if (strcmp(what, "leak") == 0) {
        kept = malloc(100);
        kept = NULL;
    }
    if (strcmp(what, "uninitialized") == 0) {
        volatile int *number = malloc(sizeof *number);
        if (number != NULL && *number > 0) puts("positive");
        free((void *)number);
    }
    if (strcmp(what, "race") == 0) {
        pthread_t threads[2];
        for (int i = 0; i < 2; i++) pthread_create(&threads[i], NULL, add, NULL);
        for (int i = 0; i < 2; i++) pthread_join(threads[i], NULL);
    }
    puts("0 failures");
    return 0;
}
