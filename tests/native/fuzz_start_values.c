/* Any bytes as one of an FMU's resource files, and any text as the place where they are: refused,
 * or an instance whose every value is one that a tool could have set. */
#include "checked_file.h"
#include "file_io.h"
#include "fuzz_input.h"

/* The files, without those that only several kinds of contacts have. */
enum { FILES = 3 };
static const struct {
    const char *name, *magic;
    uint32_t version;
} files[FILES] = {{"start_values.bin", "CREEPVAL", START_VALUES_VERSION},
                  {"creep_table.bin", "CREEPTAB", TABLE_VERSION},
                  {"rails.bin", "CREEPRAI", RAILS_VERSION}};

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void write_file(const char *folder, const char *name, const void *bytes, size_t size) {
    char path[PATH_LENGTH];
    snprintf(path, sizeof path, "%.400s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    MUST(file != NULL);
    MUST(fwrite(bytes, 1, size, file) == size);
    fclose(file);
}

static void copy_file(const char *from, const char *to, const char *name) {
    char message[8192];
    void *bytes;
    size_t size;
    MUST(resource_read(from, name, &bytes, &size, message, sizeof message) == NULL);
    write_file(to, name, bytes, size);
    free(bytes);
}

static void note(void *shell, result status, const char *category, const char *text) {
    (void)shell;
    MUST(status >= RESULT_WARNING && status <= RESULT_ERROR);
    MUST(category[0] != '\0' && text[0] != '\0');
}

static void read_values(component *core) {
    check_values(core);
    if (component_start(core) > RESULT_WARNING) return; /* friction that the table does not fit */
    for (unsigned i = 0; i < core->model->count * core->wheels; i++) {
        double value;
        unsigned of = i / (unsigned)core->wheels, wheel = i % (unsigned)core->wheels;
        int boolean = strcmp(core->model->variables[of].unit, TRUTH) == 0;
        if (component_get(core, of + MAX_VARIABLES * wheel, boolean, &value) == RESULT_OK)
            MUST(isfinite(value));
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_input in = {data, size};
    char text[64], message[8192], from[PATH_LENGTH], to[PATH_LENGTH], token[PATH_LENGTH];
    const char *name = FMU_NAMES[take_byte(&in) % FMUS];
    unsigned flags = take_byte(&in);
    unsigned which = flags / 2 % FILES;
    int exchange = (flags & 8) != 0;
    void *bytes;
    size_t length;
    if (resource_read(take_text(&in, text), "start_values.bin", &bytes, &length, message,
                      sizeof message) == NULL)
        free(bytes);

    location_of(name, from);
    location_of("scratch", to);
    token_of(name, token);
    for (unsigned i = 0; i < FILES; i++)
        if (i != which) copy_file(from, to, files[i].name);
    length = in.left;
    bytes = room(length, 1);
    take(&in, bytes, length);
    if (flags & 1 && length >= CHECKED_FILE_FRAME)
        checked_file_frame(bytes, length, files[which].magic, files[which].version);
    write_file(to, files[which].name, bytes, length);
    free(bytes);
    component core = {.logged = ~0u, .logger = note};
    if (component_open(&core, exchange, token, to) == RESULT_OK) read_values(&core);
    component_close(&core);
    return 0;
}
