#include "file_io.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#endif

enum { PATH_SIZE = 4096, MAX_FILE = 64 << 20 };

static int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/* Turn file:///a/b%20c, file:/a/b, file://localhost/a/b or a bare path into a path plus name. */
static const char *path_of(const char *uri, const char *name, char path[PATH_SIZE]) {
    if (uri == NULL) return "the resource location is null";
    int is_uri = strncmp(uri, "file:", 5) == 0;
    size_t n = 0;
    if (is_uri) {
        uri += 5;
        if (strncmp(uri, "//", 2) == 0) {
            uri += 2;
            if (strncmp(uri, "localhost/", 10) == 0) uri += 9;
            else if (*uri != '/') return "the resource location names another machine";
        }
        if (uri[0] == '/' && uri[1] != '\0' && uri[2] == ':') uri++; /* /C:/... is C:/... */
    }
    for (; *uri != '\0'; uri++) {
        char c = *uri;
        if (is_uri && c == '%') {
            int high = hex_digit(uri[1]), low = high < 0 ? -1 : hex_digit(uri[2]);
            if (low < 0) return "the resource location has a broken percent sign";
            c = (char)(16 * high + low);
            if (c == '\0') return "the resource location holds a null character";
            uri += 2;
        }
        if (n + 1 >= PATH_SIZE) return "the resource location is too long";
        path[n++] = c;
    }
    while (n > 0 && path[n - 1] == '/') n--;
    if (n + strlen(name) + 2 > PATH_SIZE) return "the resource location is too long";
    path[n++] = '/';
    strcpy(path + n, name);
    return NULL;
}

static FILE *open_utf8(const char *path) {
#ifdef _WIN32
    wchar_t wide[PATH_SIZE];
    if (MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, wide, PATH_SIZE) == 0)
        return NULL;
    return _wfopen(wide, L"rb");
#else
    return fopen(path, "rb");
#endif
}

const char *resource_read(const char *resource_uri, const char *name, void **bytes, size_t *size,
                          char *message, size_t message_size) {
    char path[PATH_SIZE], inner[PATH_SIZE], below[80];
    *bytes = NULL;
    if (resource_uri == NULL) return "the tool gave no resource location";
    const char *error = path_of(resource_uri, name, path);
    if (error != NULL) return error;
    FILE *file = open_utf8(path);
    snprintf(below, sizeof below, "resources/%s", name);
    if (file == NULL && path_of(resource_uri, below, inner) == NULL) file = open_utf8(inner);
    if (file == NULL) {
        snprintf(message, message_size, "cannot open %s", path);
        return message;
    }
    size_t capacity = 4096, length = 0;
    char *buffer = malloc(capacity);
    while (buffer != NULL) {
        length += fread(buffer + length, 1, capacity - length, file);
        if (length < capacity || capacity >= MAX_FILE) break;
        char *larger = realloc(buffer, 2 * capacity);
        if (larger == NULL) free(buffer);
        buffer = larger;
        capacity *= 2;
    }
    int failed = ferror(file);
    fclose(file);
    if (buffer == NULL) return "out of memory";
    if (failed || length == capacity) {
        free(buffer);
        snprintf(message, message_size, "cannot read %s", path);
        return message;
    }
    *bytes = buffer;
    *size = length;
    return NULL;
}
