/* Any bytes as one of an FMU's resource files, and any text as the place where they are: refused,
 * or an instance whose every value is one that a tool could have set. */
#include "checked_file.h"
#include "file_io.h"
#include "fuzz_input.h"

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
    int is_table = flags & 2, exchange = (flags & 4) != 0;
    void *bytes;
    size_t length;
    if (resource_read(take_text(&in, text), "start_values.bin", &bytes, &length, message,
                      sizeof message) == NULL)
        free(bytes);

    location_of(name, from);
    location_of("scratch", to);
    token_of(name, token);
    copy_file(from, to, is_table ? "start_values.bin" : "creep_table.bin");
    length = in.left;
    bytes = room(length, 1);
    take(&in, bytes, length);
    if (flags & 1 && length >= CHECKED_FILE_FRAME)
        checked_file_frame(bytes, length, is_table ? "CREEPTAB" : "CREEPVAL", is_table ? 2 : 4);
    write_file(to, is_table ? "creep_table.bin" : "start_values.bin", bytes, length);
    free(bytes);
    component core = {.logged = ~0u, .logger = note};
    if (component_open(&core, exchange, token, to) == RESULT_OK) read_values(&core);
    component_close(&core);
    return 0;
}
